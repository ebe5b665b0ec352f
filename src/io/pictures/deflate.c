/* Each part of PART bytes is one block of its own, with Huffman codes made for it, or stored where that is no longer,
 * and ends at a whole byte, so that the parts can be put one behind the other (as pigz does). */
#include "io/pictures/deflate.h"

#include <assert.h>
#include <string.h>

enum {
    PART = 1 << 17,
    PARTS_AT_ONCE = 16,
    ROOM = PART + PART / 8 + 1024, /* for a compressed part */
    HASH_BITS = 15,
    CHAIN = 12, /* earlier places that are looked at */
    LEAST_MATCH = 3,
    MOST_MATCH = 258,
    WINDOW = 32768,
    LITERALS = 286,
    DISTANCES = 30,
    MOST_BITS = 15,
    LENGTH_CODES = 19,
    MOST_LENGTH_BITS = 7,
    END = 256
};

static const uint16_t length_base[29] = {3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                         31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
static const uint8_t length_extra[29] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                         2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
static const uint16_t distance_base[30] = {1,    2,    3,    4,    5,    7,    9,    13,    17,    25,
                                           33,   49,   65,   97,   129,  193,  257,  385,   513,   769,
                                           1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
static const uint8_t distance_extra[30] = {0, 0, 0, 0, 1, 1, 2, 2,  3,  3,  4,  4,  5,  5,  6,
                                           6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13};

/* Scratch of one part. A token is a literal, or a match: its length above its distance. */
typedef struct part {
    uint8_t in[PART + 8], out[ROOM];
    uint32_t token[PART], head[1 << HASH_BITS], before[PART];
    uint32_t tokens, size, checksum; /* size: of `in`; the Adler-32 of it */
    size_t written, most;
    uint64_t bits;
    int held; /* bits */
    bool overflows;
} part;

typedef struct huffman {
    uint8_t length[LITERALS];
    uint16_t code[LITERALS];
} huffman;

/* ---- bits */

static void put_bits(part *p, uint32_t value, int count)
{
    p->bits |= (uint64_t)value << p->held, p->held += count;
    for (; p->held >= 8; p->held -= 8, p->bits >>= 8) {
        if (p->written < p->most) p->out[p->written++] = (uint8_t)p->bits;
        else p->overflows = true;
    }
}

static void align(part *p)
{
    if (p->held > 0) put_bits(p, 0, 8 - p->held);
}

/* ---- matches */

static uint32_t hash_at(const uint8_t *p)
{
    uint32_t x = p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16;
    return x * 2654435761u >> (32 - HASH_BITS);
}

static uint32_t match_length(const uint8_t *a, const uint8_t *b, uint32_t most)
{
    uint32_t n = 0;
    while (n < most && a[n] == b[n]) n++;
    return n;
}

/* The longest match of an earlier place with what begins at `at`; 0 where it is too short. */
static uint32_t find_match(const part *p, uint32_t at, uint32_t *distance)
{
    uint32_t most = p->size - at < MOST_MATCH ? p->size - at : MOST_MATCH, best = 0;
    uint32_t place = p->head[hash_at(p->in + at)];
    for (int i = 0; i < CHAIN && place > 0 && at - (place - 1) <= WINDOW && best < most; i++) {
        const uint8_t *there = p->in + place - 1;
        if (there[best] == p->in[at + best]) {
            uint32_t n = match_length(there, p->in + at, most);
            if (n > best) best = n, *distance = at - (place - 1);
        }
        place = p->before[place - 1];
    }
    return best >= LEAST_MATCH ? best : 0;
}

static void remember(part *p, uint32_t at)
{
    uint32_t h = hash_at(p->in + at);
    p->before[at] = p->head[h], p->head[h] = at + 1;
}

static void find_tokens(part *p)
{
    p->tokens = 0;
    memset(p->head, 0, sizeof p->head);
    for (uint32_t at = 0; at < p->size;) {
        uint32_t distance = 0, length = at + LEAST_MATCH <= p->size ? find_match(p, at, &distance) : 0;
        p->token[p->tokens++] = length ? length << 16 | (distance - 1) : p->in[at];
        for (uint32_t end = at + (length ? length : 1); at < end; at++)
            if (at + LEAST_MATCH <= p->size) remember(p, at);
    }
}

static uint32_t code_of(uint32_t value, const uint16_t *base, uint32_t count)
{
    uint32_t low = 0, high = count - 1;
    while (low < high) {
        uint32_t middle = (low + high + 1) / 2;
        if (base[middle] <= value) low = middle;
        else high = middle - 1;
    }
    return low;
}

/* ---- codes */

/* Lengths of a Huffman code for these counts, at most `most` bits: by joining the two rarest over and over; where a
   code is too long, with counts that differ less. At least two symbols have a code. */
static void find_lengths(const uint32_t *given, uint32_t symbols, int most, uint8_t *length)
{
    uint32_t count[2 * LITERALS], parent[2 * LITERALS], scaled[LITERALS];
    memcpy(scaled, given, symbols * sizeof *scaled);
    for (uint32_t s = 0, used = 0; s < symbols; s++) used += scaled[s] > 0, scaled[s] += s + 2 >= symbols && used < 2;
    for (;;) {
        uint8_t alive[2 * LITERALS] = {0};
        uint32_t nodes = symbols, left = 0;
        int longest = 0;
        for (uint32_t s = 0; s < symbols; s++) count[s] = scaled[s], alive[s] = scaled[s] > 0, left += alive[s];
        for (; left > 1; left--) {
            uint32_t pick[2];
            for (int k = 0; k < 2; k++) {
                pick[k] = QW_NONE;
                for (uint32_t n = 0; n < nodes; n++)
                    if (alive[n] && (pick[k] == QW_NONE || count[n] < count[pick[k]])) pick[k] = n;
                alive[pick[k]] = 0, parent[pick[k]] = nodes;
            }
            count[nodes] = count[pick[0]] + count[pick[1]], alive[nodes++] = 1;
        }
        for (uint32_t s = 0; s < symbols; s++) {
            length[s] = 0;
            if (!scaled[s]) continue;
            for (uint32_t n = s; n != nodes - 1; n = parent[n]) length[s]++;
            if (length[s] > longest) longest = length[s];
        }
        if (longest <= most) return;
        for (uint32_t s = 0; s < symbols; s++) scaled[s] = scaled[s] ? scaled[s] / 2 + 1 : 0;
    }
}

/* Codes by their lengths, bits in the order in which they are put. */
static void find_codes(huffman *h, uint32_t symbols)
{
    uint32_t of_length[MOST_BITS + 2] = {0}, next = 0;
    for (int bits = 1; bits <= MOST_BITS; bits++) {
        next <<= 1, of_length[bits] = next;
        for (uint32_t s = 0; s < symbols; s++) next += h->length[s] == bits;
    }
    for (uint32_t s = 0; s < symbols; s++) {
        uint32_t code = of_length[h->length[s]]++, turned = 0;
        for (int i = 0; i < h->length[s]; i++) turned |= (code >> i & 1) << (h->length[s] - 1 - i);
        h->code[s] = (uint16_t)turned;
    }
}

/* How often each code of literals and lengths, and of distances, is used by a part. */
static void count_tokens(const part *p, uint32_t *literals, uint32_t *distances)
{
    memset(literals, 0, LITERALS * sizeof *literals), memset(distances, 0, DISTANCES * sizeof *distances);
    for (uint32_t i = 0; i < p->tokens; i++) {
        uint32_t t = p->token[i], length = t >> 16;
        if (length == 0) {
            literals[t]++;
            continue;
        }
        literals[END + 1 + code_of(length, length_base, 29)]++;
        distances[code_of((t & 0xffff) + 1, distance_base, DISTANCES)]++;
    }
    literals[END] = 1;
}

/* The lengths of both codes, one code of lengths for them, no runs. */
static void put_lengths(part *p, const huffman *l, const huffman *d)
{
    static const uint8_t order[LENGTH_CODES] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    uint32_t count[LENGTH_CODES] = {0};
    huffman h = {{0}, {0}};
    for (uint32_t s = 0; s < LITERALS; s++) count[l->length[s]]++;
    for (uint32_t s = 0; s < DISTANCES; s++) count[d->length[s]]++;
    find_lengths(count, LENGTH_CODES, MOST_LENGTH_BITS, h.length);
    find_codes(&h, LENGTH_CODES);
    put_bits(p, LITERALS - 257, 5), put_bits(p, DISTANCES - 1, 5), put_bits(p, LENGTH_CODES - 4, 4);
    for (int i = 0; i < LENGTH_CODES; i++) put_bits(p, h.length[order[i]], 3);
    for (uint32_t s = 0; s < LITERALS; s++) put_bits(p, h.code[l->length[s]], h.length[l->length[s]]);
    for (uint32_t s = 0; s < DISTANCES; s++) put_bits(p, h.code[d->length[s]], h.length[d->length[s]]);
}

/* Writes the tokens of a part by these codes, and the end of the block. */
static void put_tokens(part *p, const huffman *l, const huffman *d)
{
    for (uint32_t i = 0; i < p->tokens; i++) {
        uint32_t t = p->token[i], length = t >> 16, distance = (t & 0xffff) + 1;
        if (length == 0) {
            put_bits(p, l->code[t], l->length[t]);
            continue;
        }
        uint32_t a = code_of(length, length_base, 29), b = code_of(distance, distance_base, DISTANCES);
        put_bits(p, l->code[END + 1 + a], l->length[END + 1 + a]);
        put_bits(p, length - length_base[a], length_extra[a]);
        put_bits(p, d->code[b], d->length[b]);
        put_bits(p, distance - distance_base[b], distance_extra[b]);
    }
    put_bits(p, l->code[END], l->length[END]);
}

/* ---- parts */

static void put_stored(part *p)
{
    enum { MOST_STORED = 65535 };
    p->written = 0, p->bits = 0, p->held = 0, p->most = ROOM, p->overflows = false;
    for (uint32_t at = 0, n; at < p->size; at += n) {
        n = p->size - at < MOST_STORED ? p->size - at : MOST_STORED;
        put_bits(p, 0, 3), align(p);
        put_bits(p, n, 16), put_bits(p, ~n & 0xffff, 16);
        memcpy(p->out + p->written, p->in + at, n), p->written += n;
    }
}

static uint32_t adler(const uint8_t *bytes, size_t size)
{
    uint32_t a = 1, b = 0;
    while (size > 0) {
        size_t n = size < 3800 ? size : 3800; /* sums stay below 2^32 */
        for (size_t i = 0; i < n; i++) a += bytes[i], b += a;
        a %= 65521, b %= 65521;
        bytes += n, size -= n;
    }
    return b << 16 | a;
}

/* The checksum of two pieces, one behind the other. */
static uint32_t adler_join(uint32_t first, uint32_t second, size_t size)
{
    uint64_t m = 65521, a1 = first & 0xffff, b1 = first >> 16, a2 = second & 0xffff, b2 = second >> 16;
    uint64_t a = (a1 + a2 + m - 1) % m, b = (b1 + b2 + size % m * (a1 + m - 1)) % m;
    return (uint32_t)(b << 16 | a);
}

/* Compresses a part of the input into bytes of its own, which end at a whole byte; stored as it is where that is
   shorter. */
static void compress(part *p)
{
    uint32_t literals[LITERALS], distances[DISTANCES];
    huffman l, d;
    p->checksum = adler(p->in, p->size);
    find_tokens(p);
    count_tokens(p, literals, distances);
    find_lengths(literals, LITERALS, MOST_BITS, l.length), find_codes(&l, LITERALS);
    find_lengths(distances, DISTANCES, MOST_BITS, d.length), find_codes(&d, DISTANCES);
    p->written = 0, p->bits = 0, p->held = 0, p->overflows = false, p->most = p->size;
    put_bits(p, 0, 1), put_bits(p, 2, 2);
    put_lengths(p, &l, &d);
    put_tokens(p, &l, &d);
    put_bits(p, 0, 3), align(p); /* an empty stored block ends at a whole byte */
    put_bits(p, 0, 16), put_bits(p, 0xffff, 16);
    if (p->overflows) put_stored(p);
}

typedef struct deflater {
    part *part; /* part[PARTS_AT_ONCE] */
    size_t at, size;
    qw_deflate_source source;
    void *user;
} deflater;

static void compress_parts(void *user, uint32_t begin, uint32_t end)
{
    deflater *d = user;
    for (uint32_t i = begin; i < end; i++) {
        size_t at = d->at + (size_t)i * PART, left = d->size - at;
        d->part[i].size = (uint32_t)(left < PART ? left : PART);
        d->source(d->user, at, d->part[i].size, d->part[i].in);
        compress(&d->part[i]);
    }
}

void qw_deflate(qw_env *env, size_t size, qw_deflate_source source, qw_deflate_sink sink, void *user)
{
    static const uint8_t head[2] = {0x78, 0x9c}, last[5] = {1, 0, 0, 0xff, 0xff};
    size_t all = size / PART + (size % PART != 0);
    qw_scope_begin(env);
    deflater d = {.size = size, .source = source, .user = user};
    d.part = QW_NEW(env, part, all < PARTS_AT_ONCE ? all + !all : PARTS_AT_ONCE);
    uint32_t checksum = 1;
    sink(user, head, sizeof head);
    for (size_t done = 0; done < all; done += PARTS_AT_ONCE) {
        uint32_t n = all - done < PARTS_AT_ONCE ? (uint32_t)(all - done) : PARTS_AT_ONCE;
        d.at = done * PART;
        qw_parallel(env, n, 1, compress_parts, &d);
        for (uint32_t i = 0; i < n; i++) {
            sink(user, d.part[i].out, d.part[i].written);
            checksum = adler_join(checksum, d.part[i].checksum, d.part[i].size);
        }
    }
    sink(user, last, sizeof last);
    const uint8_t tail[4] = {(uint8_t)(checksum >> 24), (uint8_t)(checksum >> 16), (uint8_t)(checksum >> 8),
                             (uint8_t)checksum};
    sink(user, tail, sizeof tail);
    qw_scope_end(env);
}

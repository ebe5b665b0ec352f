/* PNG files (ISO/IEC 15948). Each row has the filter after which its bytes, as signed numbers, are smallest in all. */
#include "io/pictures/deflate.h"
#include "io/pictures/picture.h"

#include <stdlib.h>
#include <string.h>

enum { FILTERS = 5 };

typedef struct png {
    const qw_picture *picture;
    size_t row, step; /* bytes of a row and of a pixel */
    qw_pen *pen;
    size_t chunk; /* where the IDAT's length stands */
} png;

/* ---- chunks */

/* The checksum of PNG's chunks, half a byte at a time. */
static uint32_t crc(const char *bytes, size_t size)
{
    static const uint32_t nibble[16] = {0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
                                        0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
                                        0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
    uint32_t c = 0xffffffff;
    for (size_t i = 0; i < size; i++) {
        c ^= (uint8_t)bytes[i];
        c = c >> 4 ^ nibble[c & 15];
        c = c >> 4 ^ nibble[c & 15];
    }
    return ~c;
}

static void put_word(qw_pen *pen, uint32_t x)
{
    const uint8_t b[4] = {(uint8_t)(x >> 24), (uint8_t)(x >> 16), (uint8_t)(x >> 8), (uint8_t)x};
    qw_pen_put(pen, b, 4);
}

/* begin: where the chunk's length stands, which is filled in. */
static void end_chunk(qw_pen *pen, size_t begin)
{
    uint32_t size = (uint32_t)(pen->size - begin - 8);
    for (int i = 0; i < 4; i++) pen->at[begin + (size_t)i] = (char)(size >> (24 - 8 * i));
    put_word(pen, crc(pen->at + begin + 4, size + 4));
}

static size_t begin_chunk(qw_pen *pen, const char *type)
{
    size_t begin = pen->size;
    put_word(pen, 0), qw_pen_put(pen, type, 4);
    return begin;
}

/* ---- rows */

/* Byte i of a row, as PNG orders the two of 16 bits. */
static uint8_t byte_of(const png *p, size_t y, size_t i)
{
    if (p->picture->bits == 8) return ((const uint8_t *)p->picture->pixels)[y * p->row + i];
    uint16_t v = ((const uint16_t *)p->picture->pixels)[(y * p->row + i) / 2];
    return (uint8_t)(i % 2 ? v : v >> 8);
}

static uint8_t filtered(int filter, int here, int left, int up, int corner)
{
    int p = left + up - corner, a = abs(p - left), b = abs(p - up), c = abs(p - corner);
    switch (filter) {
    case 1: return (uint8_t)(here - left);
    case 2: return (uint8_t)(here - up);
    case 3: return (uint8_t)(here - (left + up) / 2);
    case 4: return (uint8_t)(here - (a <= b && a <= c ? left : b <= c ? up : corner));
    default: return (uint8_t)here;
    }
}

/* A byte of a filtered row. */
static uint8_t filtered_byte(const png *p, size_t y, size_t i, int filter)
{
    int here = byte_of(p, y, i), left = i >= p->step ? byte_of(p, y, i - p->step) : 0;
    int up = y > 0 ? byte_of(p, y - 1, i) : 0, corner = y > 0 && i >= p->step ? byte_of(p, y - 1, i - p->step) : 0;
    return filtered(filter, here, left, up, corner);
}

/* The filter of row y whose bytes have the least sum, taken as signed. */
static int choose_filter(const png *p, size_t y)
{
    uint64_t sum[FILTERS] = {0};
    int best = 0;
    for (size_t i = 0; i < p->row; i++) {
        int here = byte_of(p, y, i), left = i >= p->step ? byte_of(p, y, i - p->step) : 0;
        int up = y > 0 ? byte_of(p, y - 1, i) : 0, corner = y > 0 && i >= p->step ? byte_of(p, y - 1, i - p->step) : 0;
        for (int f = 0; f < FILTERS; f++) sum[f] += (uint64_t)abs((int8_t)filtered(f, here, left, up, corner));
    }
    for (int f = 1; f < FILTERS; f++)
        if (sum[f] < sum[best]) best = f;
    return best;
}

/* The bytes that are compressed: of each row its filter, and the row. */
static void fill_rows(void *user, size_t at, size_t size, uint8_t *to)
{
    const png *p = user;
    size_t wide = p->row + 1;
    for (size_t end = at + size; at < end;) {
        size_t y = at / wide, from = at % wide, until = (y + 1) * wide < end ? wide : end - y * wide;
        int filter = choose_filter(p, y);
        for (size_t i = from; i < until; i++) *to++ = i ? filtered_byte(p, y, i - 1, filter) : (uint8_t)filter;
        at = y * wide + until;
    }
}

static void take_bytes(void *user, const void *bytes, size_t size) { qw_pen_put(((png *)user)->pen, bytes, size); }

void qw_put_png(qw_env *env, const qw_picture *picture, qw_pen *pen)
{
    static const uint8_t colour_type[] = {[1] = 0, [2] = 4, [3] = 2, [4] = 6};
    png p = {.picture = picture, .step = picture->channels * (size_t)picture->bits / 8, .pen = pen};
    p.row = picture->width * p.step;
    qw_pen_put(pen, "\x89PNG\r\n\x1a\n", 8);
    size_t begin = begin_chunk(pen, "IHDR");
    put_word(pen, picture->width), put_word(pen, picture->height);
    const uint8_t kind[5] = {(uint8_t)picture->bits, colour_type[picture->channels], 0, 0, 0};
    qw_pen_put(pen, kind, sizeof kind);
    end_chunk(pen, begin);
    begin = begin_chunk(pen, "IDAT");
    qw_deflate(env, (p.row + 1) * picture->height, fill_rows, take_bytes, &p);
    if (pen->size - begin > INT32_MAX) qw_fail(env, QW_TOO_LARGE, -1, "a picture is larger than a PNG file can hold");
    end_chunk(pen, begin);
    begin = begin_chunk(pen, "IEND");
    end_chunk(pen, begin);
}

void qw_write_png(qw_env *env, const char *path, const qw_picture *picture)
{
    qw_scope_begin(env);
    qw_pen pen = {.env = env};
    qw_put_png(env, picture, &pen);
    qw_file *file = qw_file_begin(env, path);
    qw_file_put(file, pen.at, pen.size);
    qw_file_finish(file);
    qw_scope_end(env);
}

#include "products/atlas/mask.h"

#include <assert.h>
#include <string.h>

enum { AT_ONCE = 4 }; /* words of places that are tested together */

static uint32_t divisor(uint32_t a, uint32_t b) { return b ? divisor(b, a % b) : a; }

void qw_mask_size(qw_mask *m, uint32_t across, uint32_t down)
{
    *m = (qw_mask){.across = across, .down = down, .words = across / QW_WORD + 1, .step = (uint32_t)(0.618 * down) + 1};
    while (divisor(m->step, down) != 1) m->step++;
    m->step %= down;
}

void qw_mask_fill(qw_mask *m, uint32_t y, uint32_t from, uint32_t to)
{
    uint64_t *row = m->row + (size_t)y * m->words;
    for (uint32_t x = from; x <= to;) {
        uint32_t end = (x / QW_WORD + 1) * QW_WORD - 1;
        if (end > to) end = to;
        uint64_t bits = end - x == QW_WORD - 1 ? UINT64_MAX : ((UINT64_C(1) << (end - x + 1)) - 1) << x % QW_WORD;
        row[x / QW_WORD] |= bits;
        x = end + 1;
    }
}

/* The next run of a row at or behind x; false: there is none. */
static bool next_run(const uint64_t *row, uint32_t words, uint32_t x, uint32_t *first, uint32_t *end)
{
    uint32_t w = x / QW_WORD;
    if (w >= words) return false;
    uint64_t bits = row[w] & UINT64_MAX << x % QW_WORD;
    while (!bits && ++w < words) bits = row[w];
    if (!bits) return false;
    *first = w * QW_WORD + (uint32_t)__builtin_ctzll(bits);
    bits = ~row[w] & UINT64_MAX << *first % QW_WORD;
    while (!bits && ++w < words) bits = ~row[w];
    *end = w * QW_WORD + (bits ? (uint32_t)__builtin_ctzll(bits) : 0);
    return true;
}

void qw_mask_widen(const qw_mask *m, uint32_t reach, qw_mask *across, qw_mask *wide)
{
    for (uint32_t y = 0; y < m->down; y++)
        for (uint32_t x = 0, end; next_run(m->row + (size_t)y * m->words, m->words, x, &x, &end); x = end) {
            uint32_t to = end - 1 + reach < m->across ? end - 1 + reach : m->across - 1;
            qw_mask_fill(across, y, x > reach ? x - reach : 0, to);
        }
    for (uint32_t y = 0; y < m->down; y++) {
        uint32_t from = y > reach ? y - reach : 0, to = y + reach < m->down ? y + reach : m->down - 1;
        for (uint32_t z = from; z <= to; z++)
            for (uint32_t w = 0; w < m->words; w++)
                wide->row[(size_t)y * m->words + w] |= across->row[(size_t)z * m->words + w];
    }
}

/* The word of a row at a cell that need not begin one. */
static uint64_t word_at(const uint64_t *row, uint32_t words, uint32_t x)
{
    uint32_t w = x / QW_WORD, s = x % QW_WORD;
    uint64_t bits = w < words ? row[w] >> s : 0;
    if (s && w + 1 < words) bits |= row[w + 1] << (QW_WORD - s);
    return bits;
}

bool qw_mask_meets(const qw_mask *tile, const qw_mask *m, uint32_t x, uint32_t y)
{
    for (uint32_t i = 0, r = m->down / 2; i < m->down;
         i++, r = r + m->step < m->down ? r + m->step : r + m->step - m->down) {
        const uint64_t *row = m->row + (size_t)r * m->words, *under = tile->row + (size_t)(y + r) * tile->words;
        for (uint32_t w = 0; w < m->words; w++)
            if (row[w] && row[w] & word_at(under, tile->words, x + w * QW_WORD)) return true;
    }
    return false;
}

static void stamp_row(uint64_t *to, const uint64_t *row, uint32_t words, uint32_t x, bool is_there)
{
    to += x / QW_WORD;
    for (uint32_t w = 0; w < words; w++) {
        if (!row[w]) continue;
        uint64_t low = row[w] << x % QW_WORD, high = x % QW_WORD ? row[w] >> (QW_WORD - x % QW_WORD) : 0;
        to[w] = is_there ? to[w] | low : to[w] & ~low;
        if (high) to[w + 1] = is_there ? to[w + 1] | high : to[w + 1] & ~high;
    }
}

void qw_mask_stamp(qw_mask *tile, const qw_mask *m, uint32_t x, uint32_t y, bool is_there)
{
    for (uint32_t r = 0; r < m->down; r++)
        stamp_row(tile->row + (size_t)(y + r) * tile->words, m->row + (size_t)r * m->words, m->words, x, is_there);
}

uint32_t qw_mask_runs(const qw_mask *m, qw_mask_run *to)
{
    uint32_t count = 0, longest = 0;
    for (uint32_t i = 0, r = m->down / 2; i < m->down;
         i++, r = r + m->step < m->down ? r + m->step : r + m->step - m->down)
        for (uint32_t x = 0, end; next_run(m->row + (size_t)r * m->words, m->words, x, &x, &end); x = end, count++) {
            if (!to) continue;
            to[count] = (qw_mask_run){.row = r, .first = x, .length = end - x};
            if (to[count].length > to[longest].length) longest = count;
        }
    if (!to || count == 0) return count;
    qw_mask_run first = to[0];
    to[0] = to[longest], to[longest] = first;
    return count;
}

/* ---- a board */

qw_board qw_board_of(qw_env *env, uint32_t across, uint32_t rows)
{
    qw_board b = {.across = across, .words = across / QW_WORD + 1, .levels = 1, .rows = rows};
    while (UINT64_C(1) << b.levels <= across) b.levels++;
    b.row = QW_NEW_ZERO(env, uint64_t, (size_t)b.words * b.levels * b.rows + b.words + 2 * AT_ONCE);
    b.room = QW_NEW(env, uint8_t, rows);
    memset(b.room, (int)b.levels - 1, rows);
    return b;
}

void qw_board_clear(qw_board *b)
{
    memset(b->row, 0, (size_t)b->words * b->levels * b->used * sizeof *b->row);
    memset(b->room, (int)b->levels - 1, b->used);
    b->used = 0;
}

/* Whether the first cells of a row are all set, so many. */
static bool is_full(const uint64_t *row, uint32_t cells)
{
    for (uint32_t w = 0; w < cells / QW_WORD; w++)
        if (row[w] != UINT64_MAX) return false;
    uint64_t rest = (UINT64_C(1) << cells % QW_WORD) - 1;
    return (row[cells / QW_WORD] & rest) == rest;
}

/* Cells that are set, or so many before one that is; by: fewer than the row has. */
static void grow_row(const uint64_t *row, uint32_t words, uint32_t by, uint64_t *restrict to)
{
    uint32_t skipped = by / QW_WORD, left = words - skipped - 1, s = by % QW_WORD;
    const uint64_t *from = row + skipped;
    for (uint32_t w = 0; w < left; w++) to[w] = row[w] | from[w] >> s | (from[w + 1] << 1) << (QW_WORD - 1 - s);
    to[left] = row[left] | from[left] >> s;
    for (uint32_t w = left + 1; w < words; w++) to[w] = row[w];
}

void qw_board_stamp(qw_board *b, const qw_mask *m, uint32_t x, uint32_t y, uint32_t longest)
{
    uint32_t levels = 32 - (uint32_t)__builtin_clz(longest | 1);
    if (levels > b->levels) levels = b->levels;
    assert(y + m->down <= b->rows);
    for (uint32_t r = 0; r < m->down; r++) {
        uint64_t *row = b->row + (size_t)(y + r) * b->words * b->levels;
        stamp_row(row, m->row + (size_t)r * m->words, m->words, x, true);
        for (uint32_t k = 1; k < levels; k++, row += b->words) grow_row(row, b->words, 1u << (k - 1), row + b->words);
        row -= (size_t)(levels - 1) * b->words;
        uint8_t *room = &b->room[y + r];
        if (*room >= levels) *room = (uint8_t)(levels - 1);
        while (*room > 0 && is_full(row + (size_t)*room * b->words, b->across - (1u << *room) + 1)) --*room;
    }
    if (b->used < y + m->down) b->used = y + m->down;
}

/* Bits from .. to of a row of words, both included. */
static uint64_t bits_between(uint32_t from, uint32_t to, uint32_t w)
{
    uint64_t bits = w < from / QW_WORD || w > to / QW_WORD ? 0 : UINT64_MAX;
    if (w == from / QW_WORD) bits &= UINT64_MAX << from % QW_WORD;
    if (w == to / QW_WORD) bits &= UINT64_MAX >> (QW_WORD - 1 - to % QW_WORD);
    return bits;
}

/* Clears the places, those of the words from `begin` on, at which the run meets something. What is read behind the end
   of a row is of places that are clear already. */
static uint64_t rule_out(const qw_board *b, const qw_mask_run *run, uint32_t begin, uint32_t y, uint64_t free[AT_ONCE])
{
    uint32_t k = 31 - (uint32_t)__builtin_clz(run->length), last = run->first + run->length - (1u << k);
    const uint64_t *row = b->row + ((size_t)(y + run->row) * b->levels + k) * b->words + begin;
    const uint64_t *low = row + run->first / QW_WORD, *high = row + last / QW_WORD;
    uint32_t s = run->first % QW_WORD, t = last % QW_WORD;
    for (uint32_t w = 0; w < AT_ONCE; w++)
        free[w] &= ~(low[w] >> s | (low[w + 1] << 1) << (QW_WORD - 1 - s) | high[w] >> t |
                     (high[w + 1] << 1) << (QW_WORD - 1 - t));
    uint64_t any = 0;
    for (uint32_t w = 0; w < AT_ONCE; w++) any |= free[w];
    return any;
}

uint32_t qw_board_place(const qw_board *b, const qw_mask_run *run, uint32_t count, uint32_t from, uint32_t to,
                        uint32_t y)
{
    /* most places low down have no room for the longest run anywhere along the row */
    if (count > 0 && y + run->row < b->used && run->length >> b->room[y + run->row] > 1) return QW_NONE;
    for (uint32_t begin = from / QW_WORD; begin <= to / QW_WORD; begin += AT_ONCE) {
        uint64_t free[AT_ONCE], any = 1;
        for (uint32_t w = 0; w < AT_ONCE; w++) free[w] = bits_between(from, to, begin + w);
        for (uint32_t i = 0; i < count && any; i++)
            if (y + run[i].row < b->used) any = rule_out(b, &run[i], begin, y, free);
        for (uint32_t w = 0; w < AT_ONCE && any; w++)
            if (free[w]) return (begin + w) * QW_WORD + (uint32_t)__builtin_ctzll(free[w]);
    }
    return QW_NONE;
}

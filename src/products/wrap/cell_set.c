#include "products/wrap/cell_set.h"

#include <assert.h>
#include <string.h>

enum { LISTEN = 1 << 12 /* words between two words to the host */ };

static size_t words_of(const qw_cell_set *c) { return (size_t)c->words * c->across[1] * c->across[2]; }

qw_cell_set qw_cell_set_new(qw_env *env, const uint32_t across[3])
{
    qw_cell_set c = {.across = {across[0], across[1], across[2]}, .words = (across[0] + QW_WORD - 1) / QW_WORD};
    c.row = QW_NEW_ZERO(env, uint64_t, words_of(&c));
    return c;
}

/* The bits of a row's last word that are cells. */
static uint64_t last_word(const qw_cell_set *c) { return ~(uint64_t)0 >> (c->words * QW_WORD - c->across[0]); }

qw_cell_set qw_cell_set_others(qw_env *env, const qw_cell_set *c)
{
    qw_cell_set o = *c;
    size_t count = words_of(c);
    o.row = QW_NEW(env, uint64_t, count);
    for (size_t w = 0; w < count; w++) o.row[w] = ~c->row[w];
    for (size_t w = c->words; w <= count; w += c->words) o.row[w - 1] &= last_word(c);
    return o;
}

/* ---- floods */

qw_flood qw_flood_begin(qw_env *env, const qw_cell_set *like)
{
    return (qw_flood){.env = env, .fresh = QW_NEW_ZERO(env, uint64_t, words_of(like))};
}

void qw_flood_end(qw_flood *f) { qw_free(f->env, f->fresh), qw_free(f->env, f->stack); }

/* Those of a word's cells that are in `from` are reached. */
static void reach(qw_flood *f, qw_cell_set *from, qw_cell_set *to, size_t word, uint64_t cells)
{
    cells &= from->row[word];
    if (cells == 0) return;
    from->row[word] &= ~cells, to->row[word] |= cells;
    if (f->fresh[word] == 0) {
        f->stack = qw_grow(f->env, f->stack, &f->capacity, f->count + 1, sizeof *f->stack);
        f->stack[f->count++] = (uint32_t)word;
    }
    f->fresh[word] |= cells;
}

/* The bits of `within` that are joined to those of `cells`, and these: runs twice as long with each step. */
static uint64_t spread(uint64_t cells, uint64_t within)
{
    uint64_t up = within, down = within;
    for (int step = 1; step < QW_WORD; step *= 2) {
        cells |= up & cells << step, up &= up << step;
        cells |= down & cells >> step, down &= down >> step;
    }
    return cells;
}

typedef struct box {
    uint32_t low[3], high[3];
} box;

static void widen(box *b, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t at[3] = {x, y, z};
    for (int k = 0; k < 3; k++) {
        if (at[k] < b->low[k]) b->low[k] = at[k];
        if (at[k] > b->high[k]) b->high[k] = at[k];
    }
}

/* Reaches the neighbours of the fresh cells of a word. */
static void flood_word(qw_flood *f, qw_cell_set *from, qw_cell_set *to, uint32_t word, box *b)
{
    uint32_t w = word % from->words, y = word / from->words % from->across[1], z = word / from->words / from->across[1];
    size_t layer = (size_t)from->words * from->across[1];
    uint64_t cells = spread(f->fresh[word], from->row[word]);
    from->row[word] &= ~cells, to->row[word] |= cells, f->fresh[word] = 0;
    assert(cells);
    widen(b, w * QW_WORD + (uint32_t)__builtin_ctzll(cells), y, z);
    widen(b, w * QW_WORD + QW_WORD - 1 - (uint32_t)__builtin_clzll(cells), y, z);
    if (w > 0) reach(f, from, to, word - 1, cells << (QW_WORD - 1));
    if (w + 1 < from->words) reach(f, from, to, (size_t)word + 1, cells >> (QW_WORD - 1));
    if (y > 0) reach(f, from, to, word - from->words, cells);
    if (y + 1 < from->across[1]) reach(f, from, to, (size_t)word + from->words, cells);
    if (z > 0) reach(f, from, to, word - layer, cells);
    if (z + 1 < from->across[2]) reach(f, from, to, word + layer, cells);
}

void qw_flood_from(qw_flood *f, qw_cell_set *from, const uint32_t at[3], qw_cell_set *to, uint32_t extent[3])
{
    box b = {{at[0], at[1], at[2]}, {at[0], at[1], at[2]}};
    assert(f->count == 0 && qw_cell_set_has(from, at[0], at[1], at[2]));
    reach(f, from, to, ((size_t)at[2] * from->across[1] + at[1]) * from->words + at[0] / QW_WORD,
          (uint64_t)1 << at[0] % QW_WORD);
    while (f->count > 0) {
        flood_word(f, from, to, f->stack[--f->count], &b);
        if (++f->done % LISTEN == 0) qw_heartbeat(f->env);
    }
    for (int k = 0; k < 3; k++) extent[k] = b.high[k] - b.low[k] + 1;
}

/* ---- gaps */

typedef struct opening {
    qw_env *env;
    qw_cell_set *cells, middle; /* middle: of the balls */
    uint8_t *lost;              /* uint8_t[across[2]]: 1: a layer has lost cells */
} opening;

/* A word's cells and their two neighbours along the row: all of the three, or any. */
static uint64_t all_along(const qw_cell_set *c, const uint64_t *row, uint32_t w)
{
    uint64_t before = w > 0 ? row[w - 1] >> (QW_WORD - 1) : 0,
             after = w + 1 < c->words ? row[w + 1] << (QW_WORD - 1) : 0;
    return row[w] & (row[w] << 1 | before) & (row[w] >> 1 | after);
}

static uint64_t any_along(const qw_cell_set *c, const uint64_t *row, uint32_t w)
{
    uint64_t before = w > 0 ? row[w - 1] >> (QW_WORD - 1) : 0,
             after = w + 1 < c->words ? row[w + 1] << (QW_WORD - 1) : 0;
    return row[w] | row[w] << 1 | before | row[w] >> 1 | after;
}

/* Cells whose surroundings, a ball of 19 cells, are all in the set. */
static void find_middles(void *user, uint32_t begin, uint32_t end)
{
    const opening *o = user;
    const qw_cell_set *c = o->cells;
    if (!qw_listen(o->env)) return;
    for (uint32_t z = begin; z < end; z++)
        for (uint32_t y = 1; y + 1 < c->across[1] && z > 0 && z + 1 < c->across[2]; y++)
            for (uint32_t w = 0; w < c->words; w++)
                qw_cell_set_row(&o->middle, y, z)[w] =
                    all_along(c, qw_cell_set_row(c, y, z), w) & all_along(c, qw_cell_set_row(c, y - 1, z), w) &
                    all_along(c, qw_cell_set_row(c, y + 1, z), w) & all_along(c, qw_cell_set_row(c, y, z - 1), w) &
                    all_along(c, qw_cell_set_row(c, y, z + 1), w) & qw_cell_set_row(c, y - 1, z - 1)[w] &
                    qw_cell_set_row(c, y + 1, z - 1)[w] & qw_cell_set_row(c, y - 1, z + 1)[w] &
                    qw_cell_set_row(c, y + 1, z + 1)[w];
}

/* The cells of a word, not at the rim in y and z, that are in balls. */
static uint64_t in_balls(const qw_cell_set *m, uint32_t w, uint32_t y, uint32_t z)
{
    return any_along(m, qw_cell_set_row(m, y, z), w) | any_along(m, qw_cell_set_row(m, y - 1, z), w) |
           any_along(m, qw_cell_set_row(m, y + 1, z), w) | any_along(m, qw_cell_set_row(m, y, z - 1), w) |
           any_along(m, qw_cell_set_row(m, y, z + 1), w) | qw_cell_set_row(m, y - 1, z - 1)[w] |
           qw_cell_set_row(m, y + 1, z - 1)[w] | qw_cell_set_row(m, y - 1, z + 1)[w] |
           qw_cell_set_row(m, y + 1, z + 1)[w];
}

/* Keeps the cells that lie in some ball of the set, and those on its border. */
static void keep_balls(void *user, uint32_t begin, uint32_t end)
{
    const opening *o = user;
    qw_cell_set *c = o->cells;
    uint32_t last = c->across[0] - 1;
    if (!qw_listen(o->env)) return;
    for (uint32_t z = begin; z < end; z++)
        for (uint32_t y = 1; y + 1 < c->across[1] && z > 0 && z + 1 < c->across[2]; y++)
            for (uint32_t w = 0; w < c->words; w++) {
                uint64_t *cells = qw_cell_set_row(c, y, z) + w, kept = in_balls(&o->middle, w, y, z);
                if (w == 0) kept |= 1;
                if (w == last / QW_WORD) kept |= (uint64_t)1 << last % QW_WORD;
                o->lost[z] |= (*cells & ~kept) != 0;
                *cells &= kept;
            }
}

bool qw_cell_set_open(qw_env *env, qw_cell_set *c)
{
    enum { LAYERS = 4 }; /* that one task looks at */
    bool lost = false;
    opening o = {env, c, qw_cell_set_new(env, c->across), QW_NEW_ZERO(env, uint8_t, c->across[2])};
    qw_parallel(env, c->across[2], LAYERS, find_middles, &o);
    qw_parallel(env, c->across[2], LAYERS, keep_balls, &o);
    qw_heartbeat(env);
    for (uint32_t z = 0; z < c->across[2]; z++) lost |= o.lost[z];
    qw_free(env, o.middle.row), qw_free(env, o.lost);
    return lost;
}

/* Charts are drawn into bit masks of cells some texels wide, every cell that a triangle touches. From the largest on
 * each goes to the lowest place, of four quarter turns, where its mask, widened by the margin, meets none of those
 * before. The scale is the largest of a bisection at which all find a place.
 */
#include "atlas/pack.h"

#include "math/elementary.h"
#include "mesh/polygons.h"

#include <assert.h>
#include <string.h>

enum {
    MOST_CELLS = 512,   /* along a side */
    COARSE_CELLS = 192, /* of the first search for the scale */
    COARSE_ROUNDS = 9,  /* of bisection there */
    FINE_ROUNDS = 5,    /* and in finer cells */
    LAST_ROUNDS = 3,
    COARSE_EFFORT = 4000, /* pieces that are placed in orders that are tried */
    FINE_EFFORT = 2400,
    COARSE_ORDERS = 100, /* orders at most */
    FINE_ORDERS = 60,
    WORD = 64
};
static const double PACKING = 0.65;     /* share of the work on texture coordinates that comes before */
static const double STEP = 1.01;        /* of the scale */
static const double DENSEST = 0.97;     /* share of the area at which the search begins */
static const double LEAST_SHARE = 1e-4; /* and ends: the margin leaves no room */

typedef struct mask {
    uint32_t across, down, words; /* cells, and words of a row */
    uint64_t *row;                /* uint64_t[down][words] */
} mask;

typedef struct packer {
    qw_env *env;
    qw_piece *piece;
    uint32_t count, cells, border, reach; /* cells: along a side; border, reach: the margins in cells */
    uint32_t *order;                      /* uint32_t[count]: by falling size */
    double *area, *key;                   /* double[count] */
    double total;
    mask tile;                    /* of all tiles, one above the other */
    uint32_t tiles, round, tried; /* tried: orders so far */
} packer;

/* ---- masks */

static mask make_mask(qw_env *env, uint32_t across, uint32_t down)
{
    mask m = {across, down, across / WORD + 1, NULL};
    m.row = QW_NEW_ZERO(env, uint64_t, (size_t)m.words * down);
    return m;
}

static void fill(mask *m, uint32_t y, uint32_t from, uint32_t to)
{
    uint64_t *row = m->row + (size_t)y * m->words;
    for (uint32_t x = from; x <= to;) {
        uint32_t end = (x / WORD + 1) * WORD - 1;
        if (end > to) end = to;
        uint64_t bits = end - x == WORD - 1 ? UINT64_MAX : ((UINT64_C(1) << (end - x + 1)) - 1) << x % WORD;
        row[x / WORD] |= bits;
        x = end + 1;
    }
}

/* The range along x of the part of a triangle between two heights. */
static bool slice(const double p[3][2], double low, double high, double range[2])
{
    range[0] = INFINITY, range[1] = -INFINITY;
    for (int i = 0; i < 3; i++) {
        const double *a = p[i], *b = p[(i + 1) % 3];
        if (a[1] >= low && a[1] <= high) range[0] = fmin(range[0], a[0]), range[1] = fmax(range[1], a[0]);
        for (int side = 0; side < 2; side++) {
            double y = side ? high : low;
            if ((a[1] < y) == (b[1] < y)) continue;
            double x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
            range[0] = fmin(range[0], x), range[1] = fmax(range[1], x);
        }
    }
    return range[0] <= range[1];
}

static void turned(const double p[2], uint32_t quarters, double to[2])
{
    double x = p[0], y = p[1];
    to[0] = quarters == 0 ? x : quarters == 1 ? -y : quarters == 2 ? -x : y;
    to[1] = quarters == 0 ? y : quarters == 1 ? x : quarters == 2 ? -y : -x;
}

/* Least coordinates of a piece that is turned, and its size. */
static void box_of(const qw_piece *p, uint32_t quarters, double least[2], double size[2])
{
    double most[2] = {-INFINITY, -INFINITY};
    least[0] = least[1] = INFINITY;
    for (uint32_t i = 0; i < p->point_count; i++) {
        double q[2];
        turned(p->at[i], quarters, q);
        for (int r = 0; r < 2; r++) least[r] = fmin(least[r], q[r]), most[r] = fmax(most[r], q[r]);
    }
    for (int r = 0; r < 2; r++) size[r] = most[r] - least[r];
}

/* scale: cells a unit of length. The piece begins at cell (pad, pad). */
static mask draw(qw_env *env, const qw_piece *p, uint32_t quarters, double scale, uint32_t pad)
{
    double least[2], size[2];
    box_of(p, quarters, least, size);
    uint32_t across = (uint32_t)(size[0] * scale) + 1, down = (uint32_t)(size[1] * scale) + 1;
    mask m = make_mask(env, across + 2 * pad, down + 2 * pad);
    for (uint32_t f = 0; f < p->triangle_count; f++) {
        double q[3][2], range[2], low = INFINITY, high = -INFINITY;
        for (int i = 0; i < 3; i++) {
            turned(p->at[p->corner[3 * f + (uint32_t)i]], quarters, q[i]);
            for (int r = 0; r < 2; r++) q[i][r] = (q[i][r] - least[r]) * scale;
            low = fmin(low, q[i][1]), high = fmax(high, q[i][1]);
        }
        for (uint32_t y = (uint32_t)fmax(low, 0); y <= (uint32_t)high && y < down; y++) {
            if (!slice((const double(*)[2])q, y, y + 1.0, range)) continue;
            uint32_t from = (uint32_t)fmax(range[0], 0), to = (uint32_t)fmax(range[1], 0);
            fill(&m, y + pad, from + pad, (to < across ? to : across - 1) + pad);
        }
    }
    return m;
}

/* Widened by so many cells in all eight directions, into a mask of the same size. */
static mask widen(qw_env *env, const mask *m, uint32_t reach)
{
    mask wide = make_mask(env, m->across, m->down), across = make_mask(env, m->across, m->down);
    for (uint32_t y = 0; y < m->down; y++) {
        const uint64_t *in = m->row + (size_t)y * m->words;
        for (uint32_t x = 0; x < m->across; x++) {
            if (!(in[x / WORD] >> x % WORD & 1)) continue;
            uint32_t end = x;
            while (end + 1 < m->across && (in[(end + 1) / WORD] >> (end + 1) % WORD & 1)) end++;
            uint32_t to = end + reach < m->across ? end + reach : m->across - 1;
            fill(&across, y, x > reach ? x - reach : 0, to);
            x = end;
        }
    }
    for (uint32_t y = 0; y < m->down; y++) {
        uint32_t from = y > reach ? y - reach : 0, to = y + reach < m->down ? y + reach : m->down - 1;
        for (uint32_t z = from; z <= to; z++)
            for (uint32_t w = 0; w < m->words; w++)
                wide.row[(size_t)y * m->words + w] |= across.row[(size_t)z * m->words + w];
    }
    qw_free(env, across.row);
    return wide;
}

/* The word of a row at a cell that need not begin one. */
static uint64_t word_at(const uint64_t *row, uint32_t words, uint32_t x)
{
    uint32_t w = x / WORD, s = x % WORD;
    uint64_t bits = w < words ? row[w] >> s : 0;
    if (s && w + 1 < words) bits |= row[w + 1] << (WORD - s);
    return bits;
}

/* 0 where the mask, its lower corner at (x, y), meets nothing; else how far to go on along x at least. */
static uint32_t meets(const mask *tile, const mask *m, uint32_t x, uint32_t y)
{
    for (uint32_t r = 0; r < m->down; r++) {
        const uint64_t *row = m->row + (size_t)r * m->words, *under = tile->row + (size_t)(y + r) * tile->words;
        for (uint32_t w = 0; w < m->words; w++) {
            if (!row[w]) continue;
            uint64_t both = row[w] & word_at(under, tile->words, x + w * WORD);
            if (!both) continue;
            /* the rightmost cell in the way is met until the run of the mask's bits that ends there is past it */
            uint32_t bit = WORD - 1 - (uint32_t)__builtin_clzll(both);
            uint64_t clear = ~(row[w] << (WORD - 1 - bit));
            return clear ? (uint32_t)__builtin_clzll(clear) : WORD;
        }
    }
    return 0;
}

static void stamp(mask *tile, const mask *m, uint32_t x, uint32_t y)
{
    for (uint32_t r = 0; r < m->down; r++)
        for (uint32_t w = 0; w < m->words; w++) {
            uint64_t bits = m->row[(size_t)r * m->words + w];
            uint64_t *to = tile->row + (size_t)(y + r) * tile->words + (x + w * WORD) / WORD;
            uint32_t s = (x + w * WORD) % WORD;
            if (!bits) continue;
            to[0] |= bits << s;
            if (s && bits >> (WORD - s)) to[1] |= bits >> (WORD - s);
        }
}

/* ---- places */

typedef struct spot {
    uint32_t x, y, tile, quarters, top;
} spot;

/* The lowest place for a mask in a tile: that whose upper end is lowest, then the leftmost. pad: of the mask, which may
   lie outside of the tile. The rows of a tile have pad more on each side. */
static bool find_spot(const packer *k, const mask *m, uint32_t tile, uint32_t bound, spot *best)
{
    uint32_t side = k->cells + 2 * k->reach, from = k->border, base = tile * side;
    if (m->across + 2 * from > side || m->down + 2 * from > side) return false;
    for (uint32_t y = from; y + m->down + from <= side && y + m->down < bound; y++)
        for (uint32_t x = from; x + m->across + from <= side;) {
            uint32_t on = meets(&k->tile, m, x, base + y);
            if (!on) {
                *best = (spot){.x = x, .y = y, .tile = tile, .top = y + m->down};
                return true;
            }
            x += on;
        }
    return false;
}

/* cells: a unit of length. */
static bool place_one(packer *k, uint32_t i, double scale)
{
    qw_piece *p = &k->piece[i];
    bool found = false;
    spot best = {0};
    mask kept = {0};
    qw_scope_begin(k->env);
    for (uint32_t tile = 0; tile < k->tiles && !found; tile++)
        for (uint32_t quarters = 0; quarters < 4; quarters++) {
            double least[2], size[2];
            spot here;
            box_of(p, quarters, least, size);
            if (size[0] * scale + 1 > k->cells || size[1] * scale + 1 > k->cells) continue;
            mask thin = draw(k->env, p, quarters, scale, k->reach), wide = widen(k->env, &thin, k->reach);
            if (find_spot(k, &wide, tile, found ? best.top : UINT32_MAX, &here)) {
                best = here, best.quarters = quarters, found = true;
                qw_free(k->env, kept.row), kept = thin;
            } else {
                qw_free(k->env, thin.row);
            }
            qw_free(k->env, wide.row);
        }
    if (found) {
        double least[2], size[2];
        uint32_t side = k->cells + 2 * k->reach;
        box_of(p, best.quarters, least, size);
        stamp(&k->tile, &kept, best.x, best.tile * side + best.y);
        p->quarters = best.quarters, p->tile = best.tile;
        p->shift[0] = best.x / (double)k->cells - least[0] * scale / k->cells;
        p->shift[1] = best.y / (double)k->cells - least[1] * scale / k->cells;
    }
    qw_scope_end(k->env);
    return found;
}

/* scale: tiles a unit of length. */
static bool place_all(packer *k, double scale)
{
    uint32_t side = k->cells + 2 * k->reach;
    qw_scope_begin(k->env);
    k->tile = make_mask(k->env, side + WORD, k->tiles * side);
    bool all = true;
    for (uint32_t i = 0; i < k->count && all; i++) {
        all = place_one(k, k->order[i], scale * k->cells);
        qw_break_silence(k->env);
    }
    qw_scope_end(k->env);
    return all;
}

/* Sorts the pieces by falling size, each times a number about 1 of its own; round 0: by size alone. */
static void order_pieces(packer *k, uint32_t round)
{
    for (uint32_t i = 0; i < k->count; i++) {
        double chance = (double)(qw_mix((uint64_t)round << 32 | i) >> 11) / 9007199254740992.0;
        double size = k->area[i] * (round ? 0.4 + 1.2 * chance : 1);
        uint32_t at = i;
        k->key[i] = size;
        for (; at > 0 && k->key[k->order[at - 1]] < size; at--) k->order[at] = k->order[at - 1];
        k->order[at] = i;
    }
}

static void measure(packer *k)
{
    for (uint32_t i = 0; i < k->count; i++) {
        const qw_piece *p = &k->piece[i];
        for (uint32_t f = 0; f < p->triangle_count; f++) {
            const double *a = p->at[p->corner[3 * f]], *b = p->at[p->corner[3 * f + 1]],
                         *c = p->at[p->corner[3 * f + 2]];
            k->area[i] += fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
        }
        k->total += k->area[i];
    }
    order_pieces(k, 0);
}

static void set_cells(packer *k, const qw_pack_options *o, uint32_t most)
{
    k->cells = o->texels < most ? o->texels : most;
    double texels = o->texels / (double)k->cells; /* of a cell */
    k->reach = (uint32_t)qw_ceil(o->margin / texels);
    k->border = (uint32_t)qw_ceil(o->margin / 2.0 / texels);
}

/* The largest scale at which all fit, between one that does and one that need not. */
static double bisect(packer *k, double fits, double fails, int rounds)
{
    for (int i = 0; i < rounds; i++) {
        double middle = (fits + fails) / 2;
        if (place_all(k, middle)) fits = middle;
        else fails = middle;
    }
    return fits;
}

/* Orders that an effort allows. */
static uint32_t orders_of(const packer *k, uint32_t effort, uint32_t most)
{
    uint32_t orders = effort / k->count;
    return orders < most ? orders : most;
}

/* Tries other orders at scales that are a little larger each time one fits. The order of the best is left. */
static double ratchet(packer *k, double good, uint32_t rounds)
{
    uint32_t best = k->round;
    for (uint32_t i = 1; i <= rounds; i++) {
        k->tried++;
        qw_progress_work(k->env, PACKING + (1 - PACKING) * k->tried / (COARSE_ORDERS + FINE_ORDERS + 1));
        order_pieces(k, i);
        while (place_all(k, good * STEP)) good *= STEP, best = i;
    }
    order_pieces(k, k->round = best);
    return good;
}

static double find_scale(packer *k, const qw_pack_options *o)
{
    double most = sqrt(DENSEST * o->tiles / k->total), least = most;
    set_cells(k, o, COARSE_CELLS);
    while (!place_all(k, least)) {
        least *= 0.8;
        if (least < most * sqrt(LEAST_SHARE))
            qw_fail(k->env, QW_ARGUMENT, -1,
                    "%u charts with a margin of %u texels have no room in %u texture(s) of %u x %u", k->count,
                    o->margin, o->tiles, o->texels, o->texels);
    }
    double good = least < most ? bisect(k, least, least / 0.8, COARSE_ROUNDS / 2) : least;
    good = ratchet(k, good, orders_of(k, COARSE_EFFORT, COARSE_ORDERS));
    set_cells(k, o, MOST_CELLS);
    double high = good * 1.06;
    while (!place_all(k, good)) high = good, good *= 0.97;
    good = bisect(k, good, high, FINE_ROUNDS);
    good = ratchet(k, good, orders_of(k, FINE_EFFORT, FINE_ORDERS));
    return bisect(k, good, good * STEP, LAST_ROUNDS);
}

void qw_place_in_tile(const qw_piece *p, double scale, const double at[2], double to[2])
{
    turned(at, p->quarters, to);
    for (int r = 0; r < 2; r++) to[r] = to[r] * scale + p->shift[r];
}

qw_packing qw_pack(qw_env *env, qw_piece *piece, uint32_t count, const qw_pack_options *o)
{
    packer k = {.env = env, .piece = piece, .count = count, .tiles = o->tiles};
    qw_packing packing = {.scale = 1};
    if (count == 0) return packing;
    k.order = QW_NEW(env, uint32_t, count), k.area = QW_NEW_ZERO(env, double, count),
    k.key = QW_NEW(env, double, count);
    measure(&k);
    packing.scale = o->scale > 0 ? o->scale : find_scale(&k, o);
    set_cells(&k, o, MOST_CELLS);
    if (!place_all(&k, packing.scale))
        qw_fail(env, QW_ARGUMENT, -1, "the charts do not fit into %u texture(s) of %u x %u at that texel density",
                o->tiles, o->texels, o->texels);
    for (uint32_t i = 0; i < count; i++)
        if (piece[i].tile >= packing.tiles) packing.tiles = piece[i].tile + 1;
    /* masks begin `reach` cells inside of theirs, and tiles as much outside of their square: the two are even */
    packing.used = k.total * packing.scale * packing.scale / packing.tiles;
    qw_free(env, k.order), qw_free(env, k.area), qw_free(env, k.key);
    return packing;
}

/* Charts are drawn into bit masks of cells some texels wide, every cell that a triangle touches, in four quarter turns.
 * One after the other goes to the lowest place where its mask, widened by the margin, meets none of those before; the
 * last tile has no upper end, and what is sought is an order, and turns for some, whose top is lowest. Wherever the top
 * comes to lie inside of the tile, the charts grow. Several orders are tried at a time on the run's threads, always the
 * same number of them. In the end, in finer cells, the charts are pushed down and aside, near where they lie, as long
 * as that lets them grow.
 */
#include "products/atlas/pack.h"

#include "base/hash.h"
#include "base/sort.h"
#include "products/atlas/mask.h"
#include "base/elementary.h"
#include "geometry/polygons.h"

#include <assert.h>
#include <string.h>

enum {
    SLOTS = 8,           /* orders that are tried at a time, at most */
    ANY_TURN = 4,        /* of a piece: the quarter turn whose place is lowest */
    CHART_CELLS = 100,   /* a chart, along its side, where a share is all that is asked for */
    COARSE_CELLS = 512,  /* along a side, while orders are tried */
    FINE_CELLS = 1024,   /* while pieces are pushed */
    SETTLES = 12,        /* changes of the scale until something fits */
    EFFORT = 20000,      /* pieces that are placed in orders that are tried */
    ROUGH_EFFORT = 1500, /* where a share is all that is asked for */
    MOST_BATCHES = 120   /* of orders that are tried */
};
static const double PACKING = 0.65;     /* share of the work on texture coordinates that comes before */
static const double STEP = 1.002;       /* of the scale, at least */
static const double FIRST_SHARE = 0.7;  /* of the area at which the search begins */
static const double LEAST_SHARE = 1e-4; /* and ends: the margin leaves no room */

typedef struct spot {
    uint32_t x, y, tile, quarters, top; /* top: upper end in its tile, the border of the tile included */
} spot;

/* An order, and what came of it. */
typedef struct packing {
    uint32_t *order;   /* uint32_t[count] */
    uint8_t *turn;     /* uint8_t[count]: quarters of each piece, or ANY_TURN */
    spot *at;          /* spot[count] */
    uint32_t *longest; /* uint32_t[count + 1]: the longest run of those that follow in the order, itself included */
    uint32_t kept;  /* so many, the first in the order, lie where `at` says: as in a packing that was placed before */
    qw_board board; /* the tiles, one above the other; the last is twice as high */
    uint32_t top;   /* in the last tile; UINT32_MAX: not all were placed */
} packing;

typedef struct packer {
    qw_env *env;
    qw_piece *piece;
    uint32_t count, tiles, slots;  /* slots: as many as the effort allows of so many pieces */
    uint32_t cells, border, reach; /* cells along a tile; the margins in cells */
    uint32_t side, stride;         /* of a tile with these; with what lies beyond its end */
    uint32_t tried, batches;       /* batches so far, of so many; 0: nobody is told */
    double scale;                  /* cells a unit of length */
    double *area, *key;            /* double[count] */
    uint64_t *item;                /* uint64_t[count]: of sorting */
    double total;
    qw_mask *thin, *wide, *scratch;  /* qw_mask[count][4]: of this scale */
    qw_mask_run *run;                /* of the wide masks, one after the other; NULL while pieces are pushed */
    uint32_t *first_run;             /* uint32_t[4 count + 1]: of each */
    qw_mask pushed;                  /* the tiles, while pieces are pushed */
    packing slot[SLOTS], best, good; /* best: of this scale; good: the last that fitted */
    double good_scale;               /* of it: tiles a unit of length */
    uint32_t good_cells;
} packer;

/* ---- drawing */

/* Inline, unlike the library's, as this is done for each side of each triangle in each row. */
static double smaller(double a, double b) { return a < b ? a : b; }
static double larger(double a, double b) { return a > b ? a : b; }

/* The range along x of the part of a triangle between two heights. */
static bool slice(const double p[3][2], double low, double high, double range[2])
{
    assert(low <= high);
    range[0] = INFINITY, range[1] = -INFINITY;
    for (int i = 0; i < 3; i++) {
        const double *a = p[i], *b = p[(i + 1) % 3];
        if (a[1] >= low && a[1] <= high) range[0] = smaller(range[0], a[0]), range[1] = larger(range[1], a[0]);
        for (int side = 0; side < 2; side++) {
            double y = side ? high : low;
            if ((a[1] < y) == (b[1] < y)) continue;
            double x = a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]));
            range[0] = smaller(range[0], x), range[1] = larger(range[1], x);
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
        for (int r = 0; r < 2; r++) least[r] = smaller(least[r], q[r]), most[r] = larger(most[r], q[r]);
    }
    for (int r = 0; r < 2; r++) size[r] = most[r] - least[r];
}

/* scale: cells a unit of length. The piece begins at cell (pad, pad) of a mask that is clear. */
static void draw(const qw_piece *p, uint32_t quarters, double scale, uint32_t pad, qw_mask *m)
{
    double least[2], size[2];
    box_of(p, quarters, least, size);
    assert(m->across > 2 * pad && m->down > 2 * pad);
    uint32_t across = m->across - 2 * pad, down = m->down - 2 * pad;
    for (uint32_t f = 0; f < p->triangle_count; f++) {
        double q[3][2], range[2], low = INFINITY, high = -INFINITY;
        for (int i = 0; i < 3; i++) {
            turned(p->at[p->corner[3 * f + (uint32_t)i]], quarters, q[i]);
            for (int r = 0; r < 2; r++) q[i][r] = (q[i][r] - least[r]) * scale;
            low = smaller(low, q[i][1]), high = larger(high, q[i][1]);
        }
        for (uint32_t y = (uint32_t)larger(low, 0); y <= (uint32_t)high && y < down; y++) {
            if (!slice((const double(*)[2])q, y, y + 1.0, range)) continue;
            uint32_t from = (uint32_t)larger(range[0], 0), to = (uint32_t)larger(range[1], 0);
            qw_mask_fill(m, y + pad, from + pad, (to < across ? to : across - 1) + pad);
        }
    }
}

static void draw_pieces(void *user, uint32_t begin, uint32_t end)
{
    packer *k = user;
    for (uint32_t i = begin; i < end; i++) {
        if (!k->thin[i].row) continue;
        draw(&k->piece[i / 4], i % 4, k->scale, k->reach, &k->thin[i]);
        qw_mask_widen(&k->thin[i], k->reach, &k->scratch[i], &k->wide[i]);
    }
}

/* ---- places */

/* The lowest place for a mask in a tile, below `bound`: that whose upper end is lowest, then the leftmost. A mask may
   lie with its margin outside of the tile. */
static bool find_spot(const packer *k, const packing *a, uint32_t i, uint32_t tile, uint32_t bound, spot *best)
{
    const qw_mask *m = &k->wide[i];
    const qw_mask_run *run = k->run + k->first_run[i];
    uint32_t count = k->first_run[i + 1] - k->first_run[i];
    uint32_t from = k->border, base = tile * k->stride, high = tile + 1 < k->tiles ? k->side : 2 * k->side;
    if (m->across + 2 * from > k->side || m->down + 2 * from > high) return false;
    for (uint32_t y = from; y + m->down + from <= high && y + m->down + from < bound; y++) {
        uint32_t x = qw_board_place(&a->board, run, count, from, k->side - from - m->across, base + y);
        if (x == QW_NONE) continue;
        assert(x + m->across + from <= k->side);
        *best = (spot){.x = x, .y = y, .tile = tile, .top = y + m->down + from};
        return true;
    }
    return false;
}

/* The n-th of the order. */
static bool place_one(const packer *k, packing *a, uint32_t n)
{
    uint32_t i = a->order[n];
    bool found = n < a->kept;
    for (uint32_t tile = 0; tile < k->tiles && !found; tile++)
        for (uint32_t quarters = 0; quarters < 4; quarters++) {
            spot here;
            if (!k->wide[4 * i + quarters].row || (a->turn[i] != ANY_TURN && a->turn[i] != quarters)) continue;
            uint32_t bound = found ? a->at[i].top : UINT32_MAX;
            if (!find_spot(k, a, 4 * i + quarters, tile, bound, &here)) continue;
            a->at[i] = here, a->at[i].quarters = quarters, found = true;
        }
    if (!found) return false;
    const spot *s = &a->at[i];
    assert(s->tile < k->tiles && k->thin[4 * i + s->quarters].row);
    qw_board_stamp(&a->board, &k->thin[4 * i + s->quarters], s->x, s->tile * k->stride + s->y, a->longest[n + 1]);
    if (s->tile + 1 == k->tiles && s->top > a->top) a->top = s->top;
    return true;
}

/* In any of its turns. */
static uint32_t longest_run(const packer *k, uint32_t i)
{
    uint32_t longest = 0;
    for (uint32_t q = 4 * i; q < 4 * i + 4; q++) { /* each has its longest first */
        uint32_t here = k->first_run[q] < k->first_run[q + 1] ? k->run[k->first_run[q]].length : 0;
        longest = here > longest ? here : longest;
    }
    return longest;
}

/* Places all; given up where the top is already above that of the best. */
static void place_all(const packer *k, packing *a)
{
    qw_board_clear(&a->board);
    a->top = 0, a->longest[k->count] = 0;
    for (uint32_t n = k->count; n-- > 0;) {
        uint32_t own = longest_run(k, a->order[n]);
        a->longest[n] = own > a->longest[n + 1] ? own : a->longest[n + 1];
    }
    for (uint32_t i = 0; i < k->count; i++)
        if (!place_one(k, a, i) || a->top > k->best.top) {
            a->top = UINT32_MAX;
            return;
        }
}

static void place_slots(void *user, uint32_t begin, uint32_t end)
{
    packer *k = user;
    for (uint32_t i = begin; i < end; i++) place_all(k, &k->slot[i]);
}

/* ---- orders */

static packing new_packing(packer *k)
{
    packing a = {.top = UINT32_MAX};
    a.order = QW_NEW(k->env, uint32_t, k->count), a.turn = QW_NEW(k->env, uint8_t, k->count);
    a.at = QW_NEW_ZERO(k->env, spot, k->count), a.longest = QW_NEW(k->env, uint32_t, k->count + (size_t)1);
    return a;
}

static void copy_packing(const packer *k, packing *to, const packing *from)
{
    memcpy(to->order, from->order, k->count * sizeof *to->order), memcpy(to->turn, from->turn, k->count);
    memcpy(to->at, from->at, k->count * sizeof *to->at);
    to->top = from->top, to->kept = 0;
}

/* The highest key first. In single precision by a sort of integers, and what that leaves by insertion. */
static void sort_by_key(packer *k, uint32_t *order)
{
    for (uint32_t i = 0; i < k->count; i++) k->item[i] = (uint64_t)~qw_signed_float_key((float)k->key[i]) << 32 | i;
    qw_sort_u64(k->item, k->count);
    for (uint32_t i = 0; i < k->count; i++) {
        uint32_t at = i, piece = (uint32_t)k->item[i];
        for (; at > 0 && k->key[order[at - 1]] < k->key[piece]; at--) order[at] = order[at - 1];
        order[at] = piece;
    }
}

/* Of a packing that has been changed from the best: what comes before the first change is placed alike. */
static void keep_alike(const packer *k, packing *a)
{
    for (a->kept = 0; a->kept < k->count; a->kept++) {
        uint32_t i = k->best.order[a->kept];
        if (a->order[a->kept] != i || a->turn[i] != k->best.turn[i]) return;
    }
}

static double chance(uint64_t seed) { return (double)(qw_mix(seed) >> 11) / 9007199254740992.0; }

/* By area, each times a number about 1. */
static void order_by_chance(packer *k, packing *a, uint64_t seed)
{
    for (uint32_t i = 0; i < k->count; i++) k->key[i] = k->area[i] * (0.4 + 1.2 * chance(seed << 20 | i));
    sort_by_key(k, a->order);
    memset(a->turn, ANY_TURN, k->count), a->kept = 0;
}

/* The first orders: by area, by the longer side, by the sides' sum, by the box; and by chance. */
static void begin_orders(packer *k)
{
    for (uint32_t s = 0; s < k->slots; s++) {
        order_by_chance(k, &k->slot[s], s);
        for (uint32_t i = 0; i < k->count && s < 4; i++) {
            double least[2], size[2];
            box_of(&k->piece[i], 0, least, size);
            const double by[4] = {k->area[i], fmax(size[0], size[1]), size[0] + size[1], size[0] * size[1]};
            k->key[i] = by[s];
        }
        if (s < 4) sort_by_key(k, k->slot[s].order);
    }
    copy_packing(k, &k->best, &k->slot[0]); /* until something is placed */
}

/* Two pieces change their places in the order, or one goes elsewhere, or has another turn. */
static void change(const packer *k, packing *a, uint64_t seed)
{
    uint32_t p = (uint32_t)(chance(seed) * k->count), q = (uint32_t)(chance(seed + 1) * k->count), moved = a->order[p];
    double kind = chance(seed + 2);
    if (kind < 0.4) {
        a->order[p] = a->order[q], a->order[q] = moved;
    } else if (kind < 0.7) {
        for (; p < q; p++) a->order[p] = a->order[p + 1];
        for (; p > q; p--) a->order[p] = a->order[p - 1];
        a->order[q] = moved;
    } else {
        a->turn[moved] = (uint8_t)(chance(seed + 3) * (ANY_TURN + 1));
    }
}

/* Tries the slots as they are; the lowest is the best where it is no higher than that. */
static void try_slots(packer *k)
{
    uint32_t least = 0;
    uint32_t done = k->tried < k->batches ? k->tried : k->batches;
    if (k->batches == 0) qw_heartbeat(k->env);
    else qw_progress_work(k->env, PACKING + (1 - PACKING) * done / (k->batches + 1));
    k->tried++;
    qw_parallel(k->env, k->slots, 1, place_slots, k);
    for (uint32_t i = 1; i < k->slots; i++)
        if (k->slot[i].top < k->slot[least].top) least = i;
    if (k->slot[least].top == UINT32_MAX || k->slot[least].top > k->best.top) return;
    copy_packing(k, &k->best, &k->slot[least]);
}

/* Orders near the best, the first of them the best itself where the scale is new; and others far from it. */
static void try_near(packer *k)
{
    for (uint32_t s = 0; s < k->slots; s++) {
        uint64_t seed = ((uint64_t)k->tried << 16 | s) << 16;
        if (s > 0 && s >= k->slots / 2) {
            order_by_chance(k, &k->slot[s], seed);
            continue;
        }
        copy_packing(k, &k->slot[s], &k->best);
        if (s > 0 || k->best.top != UINT32_MAX) change(k, &k->slot[s], seed);
        if (s > 1) change(k, &k->slot[s], seed + 8);
        if (k->best.top != UINT32_MAX) keep_alike(k, &k->slot[s]);
    }
    try_slots(k);
}

/* ---- the scale */

static void list_runs(packer *k)
{
    qw_free(k->env, k->run);
    k->first_run[0] = 0;
    for (uint32_t i = 0; i < 4 * k->count; i++)
        k->first_run[i + 1] = k->first_run[i] + (k->wide[i].row ? qw_mask_runs(&k->wide[i], NULL) : 0);
    k->run = QW_NEW(k->env, qw_mask_run, k->first_run[4 * k->count]);
    for (uint32_t i = 0; i < 4 * k->count; i++)
        if (k->wide[i].row) qw_mask_runs(&k->wide[i], k->run + k->first_run[i]);
}

/* Masks of another scale, tiles a unit of length; of the turns of a layout alone where one is given. */
static void begin_scale(packer *k, double scale, const packing *only)
{
    size_t words = 0;
    k->scale = scale * k->cells, k->best.top = UINT32_MAX;
    for (uint32_t i = 0; i < 4 * k->count; i++) {
        double least[2], size[2];
        qw_free(k->env, k->thin[i].row), qw_free(k->env, k->wide[i].row);
        k->thin[i].row = k->wide[i].row = NULL;
        if (only && only->at[i / 4].quarters != i % 4) continue;
        box_of(&k->piece[i / 4], i % 4, least, size);
        if (size[0] * k->scale + 1 > k->cells || size[1] * k->scale + 1 > 2 * k->cells) continue;
        qw_mask *all[3] = {&k->thin[i], &k->wide[i], &k->scratch[i]};
        for (int r = 0; r < 3; r++) {
            qw_mask_size(all[r], (uint32_t)(size[0] * k->scale) + 1 + 2 * k->reach,
                         (uint32_t)(size[1] * k->scale) + 1 + 2 * k->reach);
            words = (size_t)all[r]->words * all[r]->down;
            all[r]->row = QW_NEW_ZERO(k->env, uint64_t, words);
        }
    }
    qw_parallel(k->env, 4 * k->count, 4, draw_pieces, k);
    for (uint32_t i = 0; i < 4 * k->count; i++) qw_free(k->env, k->scratch[i].row), k->scratch[i].row = NULL;
    if (!only) list_runs(k);
}

/* beyond: cells behind the ends of each tile. */
static void set_cells(packer *k, const qw_pack_options *o, uint32_t cells, uint32_t beyond)
{
    k->cells = o->texels < cells ? o->texels : cells;
    double texels = o->texels / (double)k->cells; /* of a cell */
    k->reach = (uint32_t)qw_ceil(o->margin / texels);
    k->border = (uint32_t)qw_ceil(o->margin / 2.0 / texels);
    k->side = k->cells + 2 * k->reach, k->stride = k->side + beyond;
}

static void begin_boards(packer *k)
{
    for (uint32_t s = 0; s < k->slots; s++)
        k->slot[s].board = qw_board_of(k->env, k->stride, (k->tiles + 1) * k->stride);
}

static void begin_pushing(packer *k)
{
    qw_mask_size(&k->pushed, k->stride + QW_WORD, (k->tiles + 1) * k->stride);
    k->pushed.row = QW_NEW_ZERO(k->env, uint64_t, (size_t)k->pushed.words * k->pushed.down);
}

static void keep_good(packer *k)
{
    copy_packing(k, &k->good, &k->best);
    k->good_scale = k->scale / k->cells, k->good_cells = k->cells;
}

/* How much the scale may change so that the top comes to lie at the end of the tile, other things being equal. */
static double room_above(const packer *k)
{
    if (k->best.top == UINT32_MAX) return 0.9;
    double ratio = ((k->tiles - 1.0) * k->side + k->side) / ((k->tiles - 1.0) * k->side + k->best.top);
    return fmax(0.9, sqrt(ratio));
}

/* Whether the pieces may have room at a scale: each with the cells of its margin on two sides covers no cell of
   another's, and by Brunn and Minkowski these are no fewer than those of squares of the same areas. */
static bool may_fit(const packer *k, double scale)
{
    double cells = 0, all = (double)k->tiles * k->side * k->side;
    for (uint32_t i = 0; i < k->count && cells <= all; i++) {
        double side = fmax(sqrt(k->area[i]) * scale * k->cells, 1) + k->reach;
        cells += side * side;
    }
    return cells <= all;
}

/* Lowers the scale until something fits; the slots are set. */
static void settle(packer *k, const qw_pack_options *o, double scale)
{
    double least = sqrt(LEAST_SHARE * o->tiles / k->total);
    while (scale >= least && !may_fit(k, scale)) scale *= 0.9;
    for (uint32_t i = 0;; i++) {
        if (scale < least)
            qw_fail(k->env, QW_ARGUMENT, -1,
                    "%u charts with a margin of %u texels have no room in %u texture(s) of %u x %u", k->count,
                    o->margin, o->tiles, o->texels, o->texels);
        begin_scale(k, scale, NULL);
        if (i == 0) try_slots(k);
        else try_near(k);
        if (k->best.top <= k->side) break;
        scale *= i < SETTLES ? fmin(room_above(k), 1 / STEP) : 0.9;
    }
    keep_good(k);
}

static uint32_t batches_of(const packer *k, const qw_pack_options *o)
{
    uint32_t batches = (o->enough > 0 ? ROUGH_EFFORT : EFFORT) / (k->slots * k->count) + 1;
    return batches < MOST_BATCHES ? batches : MOST_BATCHES;
}

/* Of the square that the last layout that fitted fills. */
static double share_of(const packer *k) { return k->total * k->good_scale * k->good_scale / k->tiles; }

/* Whether a search for enough ends: that is found, or, as the first tenth of it says, and two fifths, out of reach. */
static bool is_settled(const packer *k, const qw_pack_options *o, uint32_t tried, uint32_t batches)
{
    const double FAR = 0.09, NEAR = 0.03; /* of the square: hardly any search finds as much more from there on */
    double lacks = o->enough - share_of(k);
    if (o->enough == 0 || lacks <= 0) return o->enough > 0;
    return (10 * tried >= batches && lacks > FAR) || (5 * tried >= 2 * batches && lacks > NEAR);
}

/* Tries orders near the best at scales that grow each time one fits. */
static void grow(packer *k, const qw_pack_options *o)
{
    uint32_t batches = batches_of(k, o);
    for (uint32_t i = 0; i < batches && !is_settled(k, o, i, batches); i++) {
        if (k->best.top <= k->side) {
            double more = fmax(STEP, room_above(k));
            keep_good(k);
            begin_scale(k, k->good_scale * more, NULL);
        }
        try_near(k);
    }
    if (k->best.top <= k->side) keep_good(k);
}

/* ---- pushing */

static void set_piece(packer *k, const packing *a, uint32_t i, bool is_there)
{
    const spot *s = &a->at[i];
    qw_mask_stamp(&k->pushed, &k->thin[4 * i + s->quarters], s->x, s->tile * k->stride + s->y, is_there);
}

static bool is_free(const packer *k, uint32_t i, const spot *s, int64_t x, int64_t y)
{
    const qw_mask *m = &k->wide[4 * i + s->quarters];
    if (!m->row || x < k->border || y < k->border) return false;
    if (x + m->across > k->stride || y + m->down > k->stride) return false;
    return !qw_mask_meets(&k->pushed, m, (uint32_t)x, (uint32_t)(s->tile * k->stride + y));
}

/* 0, -1, 1, -2, 2, ... */
static int64_t alternate(int64_t i) { return i & 1 ? -(i + 1) / 2 : i / 2; }

/* All of a layout in the masks of another scale, each coordinate times a number, or near that. */
static bool move_over(packer *k, const packing *from, double times, int64_t within, packing *to)
{
    memset(k->pushed.row, 0, (size_t)k->pushed.down * k->pushed.words * sizeof *k->pushed.row);
    for (uint32_t i = 0; i < k->count; i++) k->key[i] = -(double)(from->at[i].x + from->at[i].y);
    sort_by_key(k, to->order);
    for (uint32_t n = 0; n < k->count; n++) {
        uint32_t i = to->order[n];
        spot s = from->at[i];
        double x = qw_ceil(s.x * times), y = qw_ceil(s.y * times);
        bool found = false;
        for (int64_t q = 0; q <= 2 * within && !found; q++)
            for (int64_t p = 0; p <= q && !found; p++)
                for (int turn = 0; turn < 2 && !found; turn++) {
                    int64_t at_x = (int64_t)x + alternate(turn ? q : p), at_y = (int64_t)y + alternate(turn ? p : q);
                    found = is_free(k, i, &s, at_x, at_y);
                    if (found) s.x = (uint32_t)at_x, s.y = (uint32_t)at_y;
                }
        if (!found) return false;
        to->at[i] = s;
        set_piece(k, to, i, true);
    }
    return true;
}

/* One piece after the other goes as far along an axis (1: down, 0: to the left) as some cells around it allow. */
static bool push_all(packer *k, packing *a, int axis, int64_t within)
{
    bool has_moved = false;
    for (uint32_t i = 0; i < k->count; i++) k->key[i] = -(double)(axis ? a->at[i].y : a->at[i].x);
    sort_by_key(k, a->order);
    for (uint32_t n = 0; n < k->count; n++) {
        uint32_t i = a->order[n];
        spot *s = &a->at[i], was = *s;
        bool found = false;
        set_piece(k, a, i, false);
        for (int64_t p = -within; p < 0 && !found; p++)
            for (int64_t q = 0; q <= within && !found; q++) {
                int64_t x = was.x + (axis ? -q : p), y = was.y + (axis ? p : -q);
                found = is_free(k, i, &was, x, y);
                if (found) s->x = (uint32_t)x, s->y = (uint32_t)y;
            }
        set_piece(k, a, i, true);
        has_moved |= found;
    }
    qw_heartbeat(k->env);
    return has_moved;
}

static bool is_inside(const packer *k, const packing *a)
{
    for (uint32_t i = 0; i < k->count; i++) {
        const spot *s = &a->at[i];
        const qw_mask *m = &k->wide[4 * i + s->quarters];
        if (s->x + m->across + k->border > k->side || s->y + m->down + k->border > k->side) return false;
    }
    return true;
}

/* The layout that is good in finer cells, grown as far as pushing makes room. Between pushes it may reach beyond the
   tile. */
static void push_together(packer *k, const qw_pack_options *o)
{
    enum { MOST_GROWTHS = 24, MOST_PUSHES = 12 };
    packing *a = &k->slot[0];
    double cells = k->cells, more = 1.02;
    set_cells(k, o, FINE_CELLS, 2 * QW_WORD), begin_pushing(k);
    double times = k->cells / cells, scale = k->good_scale;
    int64_t within = (int64_t)qw_ceil(times);
    for (uint32_t i = 0; i < MOST_GROWTHS && more > 1.0005; i++) {
        double growth = i == 0 ? 1 : more;
        begin_scale(k, scale * growth, &k->good);
        bool fits = move_over(k, &k->good, times * growth, 2 * within, a), moves = fits;
        for (uint32_t p = 0; p < MOST_PUSHES && moves && (i == 0 || !is_inside(k, a)); p++) {
            moves = push_all(k, a, 1, within);
            if (push_all(k, a, 0, within)) moves = true;
        }
        fits = fits && is_inside(k, a);
        if (!fits && i == 0) return;
        if (fits) {
            scale *= growth, times = 1;
            copy_packing(k, &k->good, a);
            k->good_scale = scale, k->good_cells = k->cells;
        } else {
            more = sqrt(more);
        }
    }
}

static void find_scale(packer *k, const qw_pack_options *o)
{
    k->batches = o->is_untold ? 0 : batches_of(k, o) + SETTLES;
    begin_orders(k);
    double rough = CHART_CELLS * sqrt(k->count);
    set_cells(k, o, o->enough > 0 && rough < COARSE_CELLS ? (uint32_t)rough : COARSE_CELLS, 0), begin_boards(k);
    settle(k, o, sqrt(FIRST_SHARE * o->tiles / k->total));
    grow(k, o);
    if (o->texels > COARSE_CELLS && o->enough == 0) push_together(k, o);
}

/* At a scale that is given: a few orders more than the first. */
static void fit_scale(packer *k, const qw_pack_options *o)
{
    begin_orders(k);
    set_cells(k, o, FINE_CELLS / 2, 0), begin_boards(k);
    begin_scale(k, o->scale, NULL);
    k->batches = batches_of(k, o) / 8 + 1;
    try_slots(k);
    for (uint32_t i = 1; i < k->batches && k->best.top > k->side && k->best.top != UINT32_MAX; i++) try_near(k);
    if (k->best.top > k->side)
        qw_fail(k->env, QW_ARGUMENT, -1,
                "the charts do not fit into %u texture(s) of %u x %u at that texel density: they cover as much as %.1f",
                o->tiles, o->texels, o->texels, k->total * o->scale * o->scale);
    keep_good(k);
}

/* ---- all */

/* The area of each piece, and of all. */
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
}

/* Masks begin `reach` cells inside of theirs, and tiles as much outside of their square: the two are even. */
static void take_places(const packer *k)
{
    for (uint32_t i = 0; i < k->count; i++) {
        qw_piece *p = &k->piece[i];
        const spot *s = &k->good.at[i];
        double least[2], size[2];
        box_of(p, s->quarters, least, size);
        p->quarters = s->quarters, p->tile = s->tile;
        p->shift[0] = s->x / (double)k->good_cells - least[0] * k->good_scale;
        p->shift[1] = s->y / (double)k->good_cells - least[1] * k->good_scale;
    }
}

void qw_place_in_tile(const qw_piece *p, double scale, const double at[2], double to[2])
{
    turned(at, p->quarters, to);
    for (int r = 0; r < 2; r++) to[r] = to[r] * scale + p->shift[r];
}

qw_packing qw_pack(qw_env *env, qw_piece *piece, uint32_t count, const qw_pack_options *o)
{
    packer k = {.env = env, .piece = piece, .count = count, .tiles = o->tiles};
    qw_packing found = {.scale = 1};
    if (count == 0) return found;
    qw_scope_begin(env);
    k.area = QW_NEW_ZERO(env, double, count), k.key = QW_NEW(env, double, count);
    k.item = QW_NEW(env, uint64_t, count);
    k.slots = EFFORT / count < 1 ? 1 : EFFORT / count < SLOTS ? EFFORT / count : SLOTS;
    k.thin = QW_NEW_ZERO(env, qw_mask, 4 * (size_t)count), k.wide = QW_NEW_ZERO(env, qw_mask, 4 * (size_t)count);
    k.scratch = QW_NEW_ZERO(env, qw_mask, 4 * (size_t)count);
    k.first_run = QW_NEW(env, uint32_t, 4 * (size_t)count + 1);
    for (uint32_t s = 0; s < k.slots; s++) k.slot[s] = new_packing(&k);
    k.best = new_packing(&k), k.good = new_packing(&k);
    measure(&k);
    if (o->scale > 0) fit_scale(&k, o);
    else find_scale(&k, o);
    assert(k.good_scale > 0);
    take_places(&k);
    found.scale = k.good_scale;
    for (uint32_t i = 0; i < count; i++)
        if (piece[i].tile >= found.tiles) found.tiles = piece[i].tile + 1;
    found.used = k.total * found.scale * found.scale / found.tiles;
    qw_scope_end(env);
    return found;
}

#include "products/atlas/overlap.h"

#include "products/atlas/flat.h"
#include "base/elementary.h"

#include <assert.h>
#include <string.h>

static bool is_between(int32_t a, int32_t b, int32_t x) { return a < b ? a <= x && x <= b : b <= x && x <= a; }

static bool lies_on(qw_grid_point a, qw_grid_point b, qw_grid_point p)
{
    return qw_grid_turn(a, b, p) == 0 && is_between(a.x, b.x, p.x) && is_between(a.y, b.y, p.y);
}

static int sign(int64_t x) { return (x > 0) - (x < 0); }

static bool do_meet(qw_grid_point a, qw_grid_point b, qw_grid_point c, qw_grid_point d)
{
    if (lies_on(a, b, c) || lies_on(a, b, d) || lies_on(c, d, a) || lies_on(c, d, b)) return true;
    return sign(qw_grid_turn(a, b, c)) * sign(qw_grid_turn(a, b, d)) < 0 &&
           sign(qw_grid_turn(c, d, a)) * sign(qw_grid_turn(c, d, b)) < 0;
}

/* Two that share one end meet beyond it where one lies on the other. */
static bool pair_meets(const qw_grid_point *p, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    if ((a == c && b == d) || (a == d && b == c)) return true;
    if (a == c) return lies_on(p[a], p[b], p[d]) || lies_on(p[c], p[d], p[b]);
    if (a == d) return lies_on(p[a], p[b], p[c]) || lies_on(p[c], p[d], p[b]);
    if (b == c) return lies_on(p[a], p[b], p[d]) || lies_on(p[c], p[d], p[a]);
    if (b == d) return lies_on(p[a], p[b], p[c]) || lies_on(p[c], p[d], p[a]);
    return do_meet(p[a], p[b], p[c], p[d]);
}

/* Segments by the cells of a grid that their boxes meet. */
typedef struct cells {
    int64_t x, y, size; /* lower corner; edge of a cell */
    uint32_t across, down;
    uint32_t *first, *item;
} cells;

typedef struct span {
    uint32_t x0, x1, y0, y1;
} span;

static span span_of(const cells *c, qw_grid_point a, qw_grid_point b)
{
    int32_t lx = a.x < b.x ? a.x : b.x, hx = a.x < b.x ? b.x : a.x, ly = a.y < b.y ? a.y : b.y,
            hy = a.y < b.y ? b.y : a.y;
    return (span){(uint32_t)((lx - c->x) / c->size), (uint32_t)((hx - c->x) / c->size),
                  (uint32_t)((ly - c->y) / c->size), (uint32_t)((hy - c->y) / c->size)};
}

/* A grid of cells over the segments, about as large as these are long. */
static cells lay_grid(const qw_grid_point *p, const uint32_t *from, const uint32_t *to, uint32_t count)
{
    assert(count > 0);
    int64_t least[2] = {INT32_MAX, INT32_MAX}, most[2] = {INT32_MIN, INT32_MIN}, length = 0;
    for (uint32_t i = 0; i < count; i++) {
        qw_grid_point a = p[from[i]], b = p[to[i]];
        int64_t x[2] = {a.x, b.x}, y[2] = {a.y, b.y};
        for (int k = 0; k < 2; k++) {
            if (x[k] < least[0]) least[0] = x[k];
            if (x[k] > most[0]) most[0] = x[k];
            if (y[k] < least[1]) least[1] = y[k];
            if (y[k] > most[1]) most[1] = y[k];
        }
        int64_t dx = x[1] > x[0] ? x[1] - x[0] : x[0] - x[1], dy = y[1] > y[0] ? y[1] - y[0] : y[0] - y[1];
        length += dx > dy ? dx : dy;
    }
    cells c = {.x = least[0], .y = least[1]};
    int64_t wide = most[0] - least[0], high = most[1] - least[1], widest = wide > high ? wide : high;
    c.size = 2 * length / count + 1;
    if (c.size < widest / 2048 + 1) c.size = widest / 2048 + 1;
    c.across = (uint32_t)(wide / c.size) + 1, c.down = (uint32_t)(high / c.size) + 1;
    return c;
}

bool qw_segments_meet(qw_env *env, const qw_grid_point *p, const uint32_t *from, const uint32_t *to, uint32_t count)
{
    if (count < 2) return false;
    qw_scope_begin(env);
    cells c = lay_grid(p, from, to, count);
    c.first = QW_NEW_ZERO(env, uint32_t, (size_t)c.across * c.down + 2);
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t i = 0; i < count; i++) {
            span s = span_of(&c, p[from[i]], p[to[i]]);
            assert(s.x1 < c.across && s.y1 < c.down);
            for (uint32_t y = s.y0; y <= s.y1; y++)
                for (uint32_t x = s.x0; x <= s.x1; x++) {
                    size_t cell = (size_t)y * c.across + x;
                    if (pass) c.item[c.first[cell + 1]++] = i;
                    else c.first[cell + 2]++;
                }
        }
        if (pass) break;
        for (size_t k = 2; k < (size_t)c.across * c.down + 2; k++) c.first[k] += c.first[k - 1];
        c.item = QW_NEW(env, uint32_t, c.first[(size_t)c.across * c.down + 1]);
    }
    bool meet = false;
    for (size_t cell = 0; cell < (size_t)c.across * c.down && !meet; cell++)
        for (uint32_t i = c.first[cell]; i < c.first[cell + 1] && !meet; i++)
            for (uint32_t k = i + 1; k < c.first[cell + 1] && !meet; k++)
                meet = pair_meets(p, from[c.item[i]], to[c.item[i]], from[c.item[k]], to[c.item[k]]);
    qw_scope_end(env);
    return meet;
}

static bool is_before(qw_grid_point a, qw_grid_point b) { return a.x != b.x ? a.x < b.x : a.y < b.y; }

/* Loops that run counter-clockwise, of a boundary that crosses nothing: each turns as it does at its leftmost, and
   there lowest, vertex. */
static uint32_t count_outlines(const qw_flat *t, const qw_grid_point *p)
{
    uint32_t count = 0;
    for (uint32_t begin = 0, end; begin < t->rim_count; begin = end) {
        uint32_t least = begin;
        for (end = begin; end == begin || t->rim_to[end - 1] != t->rim[begin]; end++)
            if (is_before(p[t->rim[end]], p[t->rim[least]])) least = end;
        uint32_t before = t->rim[least > begin ? least - 1 : end - 1];
        count += qw_grid_turn(p[before], p[t->rim[least]], p[t->rim_to[least]]) > 0;
    }
    return count;
}

bool qw_flat_is_simple(qw_env *env, const qw_flat *t, double grid)
{
    qw_scope_begin(env);
    qw_grid_point *p = QW_NEW(env, qw_grid_point, t->vertex_count);
    bool simple = true;
    for (uint32_t v = 0; v < t->vertex_count && simple; v++) {
        double x = qw_round_even(t->at[v][0] / grid), y = qw_round_even(t->at[v][1] / grid);
        simple = fabs(x) < 1 << 29 && fabs(y) < 1 << 29;
        if (simple) p[v] = (qw_grid_point){(int32_t)x, (int32_t)y};
    }
    for (uint32_t f = 0; f < t->triangle_count && simple; f++)
        simple = qw_grid_turn(p[t->corner[3 * f]], p[t->corner[3 * f + 1]], p[t->corner[3 * f + 2]]) > 0;
    if (simple) simple = !qw_segments_meet(env, p, t->rim, t->rim_to, t->rim_count) && count_outlines(t, p) == 1;
    qw_scope_end(env);
    return simple;
}

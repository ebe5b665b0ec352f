#include "remesh/sizes/cells.h"

#include "base/elementary.h"
#include "geometry/long_edges.h"
#include "solve/queue.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Cells begin so far apart, in their width: their mean distance is the width then. */
static const float APART = 0.8f;

/* ---- the graph of the vertices */

/* Neighbours of a vertex are in no order. */
qw_cells qw_cells_of_vertices(qw_env *env, const qw_trimesh *m)
{
    assert(m->twin);
    uint32_t n = m->vertex_count, half_edges = 3 * m->face_count;
    qw_cells g = {.count = n, .begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2), .point = m->position};
    for (uint32_t h = 0; h < half_edges; h++) {
        g.begin[m->corner[h] + 2]++;
        if (m->twin[h] == QW_NONE) g.begin[m->corner[qw_next(h)] + 2]++;
    }
    for (uint32_t v = 0; v < n; v++) g.begin[v + 2] += g.begin[v + 1];
    g.neighbour = QW_NEW(env, uint32_t, g.begin[n + 1]);
    for (uint32_t h = 0; h < half_edges; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        g.neighbour[g.begin[a + 1]++] = b;
        if (m->twin[h] == QW_NONE) g.neighbour[g.begin[b + 1]++] = a;
    }
    return g;
}

/* ---- cells */

/* A vertex as the search for starts sees it: together in memory, as it looks at some thirty a vertex. */
typedef struct spot {
    qw_vec3 point;
    uint32_t seen; /* the start that was there last, or QW_NONE */
} spot;

static spot *make_spots(qw_env *env, const qw_cells *g)
{
    spot *at = QW_NEW(env, spot, g->count);
    for (uint32_t v = 0; v < g->count; v++) at[v] = (spot){g->point[v], QW_NONE};
    return at;
}

/* Where cells begin: no two within `apart` of one another, and everything within it of one, along the graph. Returns
   their number; start: uint32_t[g->count]. */
static uint32_t choose_starts(qw_env *env, const qw_cells *g, float apart, uint32_t *start)
{
    uint32_t count = 0, *stack = QW_NEW(env, uint32_t, g->count);
    spot *at = make_spots(env, g);
    for (uint32_t v = 0; v < g->count; v++) {
        if (at[v].seen != QW_NONE) continue;
        uint32_t deep = 0;
        qw_vec3 middle = at[v].point;
        start[count] = v, at[v].seen = count, stack[deep++] = v;
        while (deep > 0) {
            uint32_t u = stack[--deep];
            for (uint32_t i = g->begin[u]; i < g->begin[u + 1]; i++) {
                spot *w = &at[g->neighbour[i]];
                if (w->seen == count || qw_distance(w->point, middle) > apart) continue;
                w->seen = count, stack[deep++] = g->neighbour[i];
            }
        }
        count++;
    }
    qw_free(env, stack), qw_free(env, at);
    return count;
}

/* Sets of[] to the start that each is fewest links away from; of several the first that came. */
static void grow_cells(qw_env *env, const qw_cells *g, const uint32_t *start, uint32_t count, uint32_t *of)
{
    uint32_t *queue = QW_NEW(env, uint32_t, g->count), last = 0;
    memset(of, 0xff, g->count * sizeof *of);
    for (uint32_t c = 0; c < count; c++) of[start[c]] = c, queue[last++] = start[c];
    for (uint32_t i = 0; i < last; i++)
        for (uint32_t k = g->begin[queue[i]]; k < g->begin[queue[i] + 1]; k++) {
            uint32_t w = g->neighbour[k];
            if (of[w] == QW_NONE) of[w] = of[queue[i]], queue[last++] = w;
        }
    assert(last == g->count);
    qw_free(env, queue);
}

/* Sets begin, neighbour and step of the cells from what touches in the finer graph. */
static void link_cells(qw_env *env, const qw_cells *g, qw_cells *c)
{
    uint32_t *first, *member = qw_group(env, c->of, g->count, c->count, &first),
                     *seen = QW_NEW(env, uint32_t, c->count), kept = 0;
    double sum = 0;
    memset(seen, 0xff, c->count * sizeof *seen); /* the last cell that was found to touch it */
    c->neighbour = QW_NEW(env, uint32_t, g->begin[g->count]);
    c->begin = QW_NEW_ZERO(env, uint32_t, (size_t)c->count + 1);
    for (uint32_t a = 0; a < c->count; a++) {
        for (uint32_t k = first[a]; k < first[a + 1]; k++)
            for (uint32_t i = g->begin[member[k]]; i < g->begin[member[k] + 1]; i++) {
                uint32_t b = c->of[g->neighbour[i]];
                if (b == a || seen[b] == a) continue;
                seen[b] = a;
                c->neighbour[kept++] = b;
                sum += (double)qw_distance(c->point[a], c->point[b]);
            }
        c->begin[a + 1] = kept;
    }
    c->step = kept ? (float)(sum / kept) : 0;
    qw_free(env, first), qw_free(env, member), qw_free(env, seen);
}

qw_cells qw_cells_of_cells(qw_env *env, const qw_cells *g, float width)
{
    assert(g->count > 0 && width > 0);
    qw_cells c = {.of = QW_NEW(env, uint32_t, g->count), .start = QW_NEW(env, uint32_t, g->count)};
    c.count = choose_starts(env, g, APART * width, c.start);
    grow_cells(env, g, c.start, c.count, c.of);
    c.point = QW_NEW(env, qw_vec3, c.count);
    for (uint32_t i = 0; i < c.count; i++) c.point[i] = g->point[c.start[i]];
    link_cells(env, g, &c);
    return c;
}

qw_cells qw_cells_of_mesh(qw_env *env, const qw_trimesh *mesh, float width)
{
    qw_cells g = qw_cells_of_vertices(env, mesh), c = qw_cells_of_cells(env, &g, width);
    qw_free(env, g.begin), qw_free(env, g.neighbour);
    return c;
}

/* Width of the cells, in mean edges of the quads, up to FEW quads; then it grows by the fourth root of their number, up
   to MANY times as many: what is to be seen then is many quads large. No edge of the surface is longer, or what lies
   between its ends would not be seen. The faces of a surface cut so are at most so many for each cell, and as many as
   before. */
static const double CELL = 0.45, FEW = 3000, MANY = 5;
enum { FACES_A_CELL = 32 };

qw_surface_cells qw_cells_of_surface(qw_env *env, const qw_trimesh *m, double edge)
{
    assert(edge > 0);
    double area = qw_trimesh_area(m), more = fmin(fmax(area / (edge * edge) / FEW, 1), MANY),
           width = CELL * edge * sqrt(sqrt(more)),
           most = m->face_count + FACES_A_CELL * fmin(area / (width * width), 1e7);
    qw_surface_cells s = {.mesh = qw_without_long_edges(env, m, (float)width, (uint32_t)fmin(most, QW_NONE / 8))};
    s.cells = qw_cells_of_mesh(env, &s.mesh, (float)width);
    return s;
}

/* ---- sums and bounds */

uint32_t qw_cells_rounds(const qw_cells *cells, double radius)
{
    double steps = cells->step > 0 ? radius / (double)cells->step : 0;
    return (uint32_t)fmin(qw_floor(steps * steps + 0.5), 1000);
}

typedef struct spread_task {
    const qw_cells *cells;
    const float *share; /* float[cells->count]: of its sums that each neighbour gets */
    const float *from;
    float *to;
    uint32_t channels;
} spread_task;

/* Sums of a cell that are spread at once. */
enum { AT_ONCE = 4 };

/* Spreads `count` of the sums of cells begin <= a < end, at most AT_ONCE, from the sum `first` on. */
static inline void spread_some(const spread_task *t, uint32_t begin, uint32_t end, uint32_t first, uint32_t count)
{
    const qw_cells *c = t->cells;
    for (uint32_t a = begin; a < end; a++) {
        const float *from = t->from + first, *own = from + (size_t)t->channels * a;
        float by = c->begin[a + 1] > c->begin[a] ? 0.5f : 1, sum[AT_ONCE];
        for (uint32_t k = 0; k < count; k++) sum[k] = by * own[k];
        for (uint32_t i = c->begin[a]; i < c->begin[a + 1]; i++) {
            uint32_t b = c->neighbour[i];
            for (uint32_t k = 0; k < count; k++) sum[k] += t->share[b] * from[(size_t)t->channels * b + k];
        }
        for (uint32_t k = 0; k < count; k++) t->to[(size_t)t->channels * a + first + k] = sum[k];
    }
}

/* The counts are written out, so that compilers lay the sums side by side. */
static void spread_block(void *user, uint32_t begin, uint32_t end)
{
    const spread_task *t = user;
    uint32_t first = 0;
    for (; first + AT_ONCE <= t->channels; first += AT_ONCE) spread_some(t, begin, end, first, AT_ONCE);
    if (t->channels - first == 2) spread_some(t, begin, end, first, 2);
    else if (first < t->channels) spread_some(t, begin, end, first, t->channels - first);
}

void qw_cells_spread(qw_env *env, const qw_cells *cells, float *sum, uint32_t channels, uint32_t rounds)
{
    assert(channels > 0);
    size_t values = (size_t)cells->count * channels;
    float *other = QW_NEW(env, float, values), *share = QW_NEW(env, float, cells->count), *from = sum, *to = other;
    for (uint32_t c = 0; c < cells->count; c++) share[c] = 0.5f / (float)(cells->begin[c + 1] - cells->begin[c]);
    for (uint32_t i = 0; i < rounds; i++) {
        qw_heartbeat(env);
        spread_task t = {cells, share, from, to, channels};
        qw_parallel(env, cells->count, QW_GRAIN, spread_block, &t);
        float *turn = from;
        from = to, to = turn;
    }
    if (from != sum) memcpy(sum, from, values * sizeof *sum);
    qw_free(env, share), qw_free(env, other);
}

/* Whether a neighbour's value is to be lowered for that of cell a. */
static bool limits_another(const qw_cells *c, const float *value, float slope, uint32_t a)
{
    for (uint32_t i = c->begin[a]; i < c->begin[a + 1]; i++) {
        uint32_t b = c->neighbour[i];
        if (value[b] > value[a] && value[b] > value[a] + slope * qw_distance(c->point[a], c->point[b])) return true;
    }
    return false;
}

void qw_cells_limit(qw_env *env, const qw_cells *cells, float *value, float slope)
{
    assert(slope >= 0);
    float unit = 0;
    for (uint32_t c = 0; c < cells->count; c++) unit = fmaxf(unit, value[c]);
    if (!(unit > 0)) return;
    qw_queue queue = qw_queue_create(env, cells->count);
    for (uint32_t c = 0; c < cells->count; c++)
        if (limits_another(cells, value, slope, c)) qw_queue_put(&queue, c, (int64_t)(value[c] / unit * QW_QUEUE_UNIT));
    for (uint32_t c; (c = qw_queue_take(&queue)) != QW_NONE;)
        for (uint32_t i = cells->begin[c]; i < cells->begin[c + 1]; i++) {
            uint32_t b = cells->neighbour[i];
            float most = value[c] + slope * qw_distance(cells->point[c], cells->point[b]);
            if (value[b] <= most) continue;
            value[b] = most;
            qw_queue_put(&queue, b, (int64_t)(most / unit * QW_QUEUE_UNIT));
        }
    qw_free(env, queue.link);
}

/* ---- values between the points of cells */

void qw_cells_interpolate(const qw_cells *cells, const float *value, float slope, const qw_vec3 *point, uint32_t count,
                          float *at)
{
    for (uint32_t v = 0; v < count; v++) {
        uint32_t c = cells->of[v];
        float way = slope * qw_distance(point[v], cells->point[c]), low = value[c] - way, high = value[c] + way;
        for (uint32_t i = cells->begin[c]; i < cells->begin[c + 1]; i++) {
            uint32_t b = cells->neighbour[i];
            way = slope * qw_distance(point[v], cells->point[b]);
            low = fmaxf(low, value[b] - way), high = fminf(high, value[b] + way);
        }
        at[v] = 0.5f * (low + high);
    }
}

#include "products/exact/ease.h"

#include "base/vec.h"
#include "geometry/step_search.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { SWEEPS = 8, LENGTHS = 3, MOST_COLORS = 64 };
/* In edges: the longest step tried. */
static const double LONGEST = 0.12;
/* What even sides count beside right angles. */
static const double EVEN = 0.05;

typedef struct easing {
    const qw_quadmesh *quads;
    const qw_held *held;
    qw_step_search search;
    uint8_t *ways;      /* uint8_t[vertices]: 0: stays; 1: along a curve; 2: all over its primitive */
    uint32_t (*end)[2]; /* uint32_t[vertices][2]: neighbours along the curve */
} easing;

static double *place_of(const easing *e, uint32_t v) { return e->held->place + 3 * (size_t)v; }

/* The sum of the squares of the cosines of a quad's corners, and of how uneven its sides are; infinite where a corner
   turns over. */
static double price_of(void *user, uint32_t v, uint32_t f)
{
    (void)v;
    const easing *e = user;
    const uint32_t *c = e->quads->corner + 4 * (size_t)f;
    double side[4][3], length[4], normal[4][3], up[3] = {0}, sum = 0, mean = 0;
    for (int i = 0; i < 4; i++) {
        const double *p = place_of(e, c[i]), *q = place_of(e, c[(i + 1) & 3]);
        for (int k = 0; k < 3; k++) side[i][k] = q[k] - p[k];
        length[i] = sqrt(qw_dot_doubles(side[i], side[i])), mean += length[i] / 4;
    }
    for (int i = 0; i < 4; i++) {
        const double *last = side[(i + 3) & 3], lengths = length[i] * length[(i + 3) & 3];
        if (!(lengths > 0)) return INFINITY;
        double cosine = qw_dot_doubles(last, side[i]) / lengths, off = length[i] / mean - 1;
        sum += cosine * cosine + EVEN * off * off;
        qw_cross_doubles(last, side[i], normal[i]);
        for (int k = 0; k < 3; k++) up[k] += normal[i][k];
    }
    for (int i = 0; i < 4; i++)
        if (!(qw_dot_doubles(normal[i], up) > 0)) return INFINITY;
    return sum;
}

static double frame_of(void *user, uint32_t v, qw_spot *here, qw_vec3 axis[2])
{
    const easing *e = user;
    const double *p = place_of(e, v), *a = place_of(e, e->end[v][0]), *b = place_of(e, e->end[v][1]);
    double normal[3];
    (void)here;
    if (!e->ways[v]) return 0;
    if (e->ways[v] == 1) {
        axis[0] = qw_normalize(qw_v3((float)(b[0] - a[0]), (float)(b[1] - a[1]), (float)(b[2] - a[2])));
        axis[1] = qw_v3(0, 0, 0);
    } else {
        qw_primitive_distance(&e->held->item[e->held->of[v][0]], p, normal);
        qw_vec3 n = qw_v3_of_doubles(normal);
        axis[0] = qw_any_orthogonal(n), axis[1] = qw_cross(n, axis[0]);
    }
    return LONGEST * (double)e->held->edge[v];
}

/* On the primitives again. */
static bool land(void *user, uint32_t v, const double to[3], qw_spot *spot)
{
    const easing *e = user;
    memcpy(spot->at, to, sizeof spot->at);
    e->held->put(e->held->user, v, spot->at);
    return true;
}

static bool is_of(const easing *e, uint32_t v, uint32_t item)
{
    return e->held->of[v][0] == item || e->held->of[v][1] == item;
}

/* Which vertices may go where: those on a curve by two of its edges, none with a neighbour that is on neither. */
static void find_ways(const easing *e, const uint8_t *stays, uint8_t *on_curve)
{
    const qw_quadmesh *q = e->quads;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t twin = q->twin[h], c[2] = {q->corner[h], q->corner[qw_quad_next(h)]};
        if (twin != QW_NONE && (twin < h || !q->mark || !q->mark[h])) continue;
        for (int k = 0; k < 2; k++) {
            if (on_curve[c[k]] < 2) e->end[c[k]][on_curve[c[k]]] = c[1 - k];
            if (on_curve[c[k]] < 3) on_curve[c[k]]++;
        }
    }
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        const uint32_t *of = e->held->of[v];
        bool is_corner = q->kind && q->kind[v] == QW_VERTEX_CORNER;
        if (stays[v] || is_corner || of[0] == QW_NONE) continue;
        if (on_curve[v] == 0) e->ways[v] = 2;
        if (on_curve[v] == 2 && of[1] != QW_NONE) e->ways[v] = 1;
    }
    for (uint32_t f = 0; f < q->face_count; f++)
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                uint32_t v = q->corner[4 * (size_t)f + (size_t)i], w = q->corner[4 * (size_t)f + (size_t)j];
                const uint32_t *of = e->held->of[v];
                bool is_corner = q->kind && q->kind[w] == QW_VERTEX_CORNER;
                if (e->ways[v] && !is_corner && !is_of(e, w, of[0]) && !(e->ways[v] == 1 && is_of(e, w, of[1])))
                    e->ways[v] = 0;
            }
}

/* ---- all of them */

/* Vertices by colour: no two of one colour have a quad in common, so that they may move side by side. */
typedef struct colors {
    uint32_t count, *begin, *vertex; /* those of colour i: vertex[begin[i] .. begin[i + 1]) */
} colors;

static uint32_t color_of(const easing *e, uint32_t v, const uint8_t *color)
{
    uint64_t taken = 0;
    uint32_t free = 0;
    for (uint32_t k = e->search.begin[v]; k < e->search.begin[v + 1]; k++)
        for (uint32_t i = 0; i < 4; i++) {
            uint32_t w = e->quads->corner[(e->search.around[k] & ~3u) + i];
            if (w < v && color[w] < MOST_COLORS) taken |= (uint64_t)1 << color[w];
        }
    while (free < MOST_COLORS && (taken >> free & 1)) free++;
    return free;
}

/* Of those that may go somewhere, but for the few that find all colours taken around them. */
static colors sort_by_color(qw_env *env, const easing *e)
{
    uint32_t n = e->quads->vertex_count;
    uint8_t *color = QW_NEW(env, uint8_t, n);
    colors c = {0, QW_NEW_ZERO(env, uint32_t, MOST_COLORS + 2), QW_NEW(env, uint32_t, n)};
    memset(color, MOST_COLORS, n);
    for (uint32_t v = 0; v < n; v++) {
        if (!e->ways[v]) continue;
        color[v] = (uint8_t)color_of(e, v, color);
        if (color[v] < MOST_COLORS) c.begin[color[v] + 2]++;
        if (color[v] < MOST_COLORS && color[v] >= c.count) c.count = color[v] + 1u;
    }
    for (uint32_t i = 0; i < c.count; i++) c.begin[i + 2] += c.begin[i + 1];
    for (uint32_t v = 0; v < n; v++)
        if (color[v] < MOST_COLORS) c.vertex[c.begin[color[v] + 1]++] = v;
    return c;
}

typedef struct ease_task {
    const easing *e;
    const uint32_t *vertex;
    uint8_t *moved; /* uint8_t[vertices of the colour] */
} ease_task;

static void ease_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const ease_task *t = user;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t v = t->vertex[i];
        t->moved[i] = t->e->search.awake[v] && qw_search_vertex(&t->e->search, v);
    }
}

/* Returns whether any vertex of the colour moved. */
static bool ease_color(qw_env *env, const easing *e, const uint32_t *vertex, uint32_t count, uint8_t *moved)
{
    bool any = false;
    ease_task t = {e, vertex, moved};
    qw_parallel(env, count, QW_GRAIN_SEARCH, ease_block, &t);
    for (uint32_t i = 0; i < count; i++)
        if (moved[i]) qw_wake_around(&e->search, vertex[i]), any = true;
    return any;
}

void qw_ease_angles(qw_env *env, const qw_quadmesh *quads, const qw_held *held, const uint8_t *stays)
{
    assert(quads->twin && held->place && held->put);
    uint32_t n = quads->vertex_count;
    qw_scope_begin(env);
    uint8_t *awake = memset(QW_NEW(env, uint8_t, n), 1, n);
    easing e = {.quads = quads, .held = held};
    e.search = (qw_step_search){quads->corner, NULL, held->place, NULL, NULL, awake,
                                LENGTHS,       &e,   frame_of,    land, NULL, price_of};
    qw_corners_at_vertices(env, quads, &e.search.begin, &e.search.around);
    e.ways = QW_NEW_ZERO(env, uint8_t, n);
    e.end = qw_alloc(env, n, sizeof *e.end);
    find_ways(&e, stays, QW_NEW_ZERO(env, uint8_t, n));
    colors c = sort_by_color(env, &e);
    uint8_t *moved = QW_NEW(env, uint8_t, n);
    bool any = true;
    for (int sweep = 0; sweep < SWEEPS && any; sweep++) {
        any = false;
        for (uint32_t i = 0; i < c.count; i++)
            any |= ease_color(env, &e, c.vertex + c.begin[i], c.begin[i + 1] - c.begin[i], moved);
    }
    qw_scope_end(env);
}

#include "products/exact/ease.h"

#include "base/mechanisms.h"
#include "base/vec.h"
#include "geometry/go_back.h"
#include "geometry/step_search.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { EASE_SWEEPS = 8, LENGTHS = 3, EVEN_SWEEPS = 80, SPREAD_SWEEPS = 24 };
/* In edges: the longest step tried; how far a vertex may move along a circle. */
static const double LONGEST = 0.12, MOST_AROUND = 0.9;
/* What even sides count beside right angles. */
static const double EVEN = 0.05;
/* By how much a vertex goes farther than to the middle of its neighbours on a circle, as in over-relaxation. */
static const double BEYOND = 1.7;
/* The least sine of the corners of a quad that may still become worse. */
static const double GOOD = 0.3;

typedef struct easing {
    const qw_quadmesh *quads;
    const qw_held *held;
    qw_step_search search;
    uint8_t *ways;        /* uint8_t[vertices]: 0: stays; 1: along a curve; 2: all over its primitive */
    uint32_t (*end)[2];   /* uint32_t[vertices][2]: neighbours along the curve */
    uint8_t *curves;      /* uint8_t[vertices]: edges of curves there, 3 at most */
    uint8_t *is_even;     /* uint8_t[vertices]: 1: on a circle, which gets equal edges */
    const double *before; /* double[vertices][3] */
} easing;

static double *place_of(const easing *e, uint32_t v) { return e->held->place + 3 * (size_t)v; }

static bool is_corner(const easing *e, uint32_t v) { return e->quads->kind && e->quads->kind[v] == QW_VERTEX_CORNER; }

/* For each vertex how many edges of curves it has, and where two of them lead. */
static void link_curves(const easing *e)
{
    const qw_quadmesh *q = e->quads;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t twin = q->twin[h], c[2] = {q->corner[h], q->corner[qw_quad_next(h)]};
        if (twin != QW_NONE && (twin < h || !q->mark || !q->mark[h])) continue;
        for (int k = 0; k < 2; k++) {
            if (e->curves[c[k]] < 2) e->end[c[k]][e->curves[c[k]]] = c[1 - k];
            if (e->curves[c[k]] < 3) e->curves[c[k]]++;
        }
    }
}

/* ---- circles */

static bool is_round(const easing *e, uint32_t item)
{
    return item != QW_NONE && e->held->item[item].kind != QW_PLANE && e->held->item[item].kind != QW_SPHERE;
}

/* From v on, away from `last`, vertices go back to where they were and stay there. */
static void leave_curve(const easing *e, uint32_t v, uint32_t last)
{
    while (e->is_even[v]) {
        e->is_even[v] = 0;
        memcpy(place_of(e, v), e->before + 3 * (size_t)v, 3 * sizeof *e->before);
        uint32_t to = e->end[v][0] == last ? e->end[v][1] : e->end[v][0];
        last = v, v = to;
    }
}

/* All circles; what lies across arcs that end at corners keeps its spacing. */
static void find_circles(const easing *e)
{
    for (uint32_t v = 0; v < e->quads->vertex_count; v++) {
        const uint32_t *of = e->held->of[v];
        e->is_even[v] = e->curves[v] == 2 && of[1] != QW_NONE && !is_corner(e, v) &&
                        (is_round(e, of[0]) || is_round(e, of[1]));
    }
    for (uint32_t v = 0; v < e->quads->vertex_count; v++)
        for (int k = 0; k < 2 && e->is_even[v]; k++)
            if (is_corner(e, e->end[v][k])) leave_curve(e, v, e->end[v][k]);
}

/* Each vertex of a circle goes to the middle of its neighbours, again and again. */
static void even_circles(const easing *e)
{
    uint32_t n = e->quads->vertex_count;
    for (int sweep = 0; sweep < EVEN_SWEEPS; sweep++)
        for (uint32_t v = 0; v < n; v++) {
            if (!e->is_even[v]) continue;
            double *p = place_of(e, v), *a = place_of(e, e->end[v][0]), *b = place_of(e, e->end[v][1]);
            for (int k = 0; k < 3; k++) p[k] += BEYOND * (0.5 * (a[k] + b[k]) - p[k]);
            e->held->put(e->held->user, v, p);
        }
    for (uint32_t v = 0; v < n; v++) {
        const double *p = place_of(e, v), *was = e->before + 3 * (size_t)v;
        double d[3] = {p[0] - was[0], p[1] - was[1], p[2] - was[2]}, most = MOST_AROUND * (double)e->held->edge[v];
        if (!e->is_even[v] || qw_dot_doubles(d, d) <= most * most) continue;
        uint32_t other = e->end[v][0];
        leave_curve(e, v, e->end[v][1]), leave_curve(e, other == v ? v : other, v);
    }
}

/* What is free goes with its neighbours: their ways from `before` are spread over the mesh. */
static void spread(qw_env *env, const easing *e)
{
    const qw_quadmesh *q = e->quads;
    size_t n = q->vertex_count;
    double *way = QW_NEW_ZERO(env, double, 3 * n), *sum = QW_NEW(env, double, 4 * n);
    for (size_t i = 0; i < 3 * n; i++) way[i] = e->held->place[i] - e->before[i];
    for (int sweep = 0; sweep < SPREAD_SWEEPS; sweep++) {
        memset(sum, 0, 4 * n * sizeof *sum);
        for (uint32_t h = 0; h < 4 * q->face_count; h++) {
            size_t a = q->corner[h], b = q->corner[qw_quad_next(h)];
            for (size_t k = 0; k < 3; k++) sum[4 * a + k] += way[3 * b + k], sum[4 * b + k] += way[3 * a + k];
            sum[4 * a + 3]++, sum[4 * b + 3]++;
        }
        for (size_t v = 0; v < n; v++)
            for (size_t k = 0; k < 3 && !e->curves[v] && !is_corner(e, (uint32_t)v) && sum[4 * v + 3] > 0; k++)
                way[3 * v + k] = sum[4 * v + k] / sum[4 * v + 3];
    }
    for (size_t i = 0; i < 3 * n; i++) e->held->place[i] = e->before[i] + way[i];
    qw_free(env, sum), qw_free(env, way);
}

/* ---- right angles */

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

/* How far vertex v may be moved, along which axes: along its curve, or in the plane of its primitive; 0: it stays. */
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
static void find_ways(const easing *e)
{
    const qw_quadmesh *q = e->quads;
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        const uint32_t *of = e->held->of[v];
        e->ways[v] = 0;
        if (e->is_even[v] || is_corner(e, v) || of[0] == QW_NONE) continue;
        if (e->curves[v] == 0) e->ways[v] = 2;
        if (e->curves[v] == 2 && of[1] != QW_NONE) e->ways[v] = 1;
    }
    for (uint32_t f = 0; f < q->face_count; f++)
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                uint32_t v = q->corner[4 * (size_t)f + (size_t)i], w = q->corner[4 * (size_t)f + (size_t)j];
                const uint32_t *of = e->held->of[v];
                if (e->ways[v] && !is_corner(e, w) && !is_of(e, w, of[0]) && !(e->ways[v] == 1 && is_of(e, w, of[1])))
                    e->ways[v] = 0;
            }
}

static void ease_angles(qw_env *env, easing *e)
{
    uint32_t n = e->quads->vertex_count;
    memset(e->search.awake, 1, n);
    find_ways(e);
    for (int sweep = 0; sweep < EASE_SWEEPS && qw_search_all(&e->search, NULL, n); sweep++) qw_heartbeat(env);
}

/* ---- what became bad */

/* The least sine of the four angles of quad f with these places; below 0 where a corner is folded. */
static double least_sine(const qw_quadmesh *q, uint32_t f, const double *place)
{
    assert(f < q->face_count);
    double least = 1;
    double n[3] = {0}, c[4][3], length[4];
    for (uint32_t i = 0; i < 4; i++) {
        const double *p = place + 3 * (size_t)q->corner[4 * (size_t)f + i],
                     *next = place + 3 * (size_t)q->corner[4 * (size_t)f + (i + 1) % 4],
                     *last = place + 3 * (size_t)q->corner[4 * (size_t)f + (i + 3) % 4];
        double a[3], b[3];
        for (int k = 0; k < 3; k++) a[k] = next[k] - p[k], b[k] = last[k] - p[k];
        qw_cross_doubles(a, b, c[i]);
        length[i] = sqrt(qw_dot_doubles(a, a) * qw_dot_doubles(b, b));
        for (int k = 0; k < 3; k++) n[k] += c[i][k];
    }
    double size = sqrt(qw_dot_doubles(n, n));
    for (int i = 0; i < 4; i++)
        least = fmin(least, size * length[i] > 0 ? qw_dot_doubles(c[i], n) / (size * length[i]) : -1);
    return least;
}

typedef struct undoing {
    const qw_quadmesh *quads;
    double *place;
    const double *before;
    double slack;
} undoing;

static void find_worse(qw_env *env, void *user, uint8_t *is_worse)
{
    (void)env;
    const undoing *u = user;
    for (uint32_t f = 0; f < u->quads->face_count; f++) {
        double is = least_sine(u->quads, f, u->place);
        is_worse[f] = is < GOOD && is < least_sine(u->quads, f, u->before) - u->slack;
    }
}

static void undo(void *user, uint32_t v, float share)
{
    (void)share;
    const undoing *u = user;
    memcpy(u->place + 3 * (size_t)v, u->before + 3 * (size_t)v, 3 * sizeof *u->place);
}

void qw_undo_bad(qw_env *env, const qw_quadmesh *q, double *place, const double *before, double slack, uint8_t *back)
{
    undoing u = {q, place, before, slack};
    qw_go_back(env, &(qw_going_back){q, true, &u, find_worse, undo}, back);
}

void qw_even_circles(qw_env *env, const qw_quadmesh *quads, const qw_held *held)
{
    assert(quads->twin && held->place && held->put);
    uint32_t n = quads->vertex_count;
    qw_scope_begin(env);
    double *before = memcpy(QW_NEW(env, double, 3 * (size_t)n), held->place, 3 * (size_t)n * sizeof *before);
    easing e = {.quads = quads, .held = held, .before = before};
    e.search = (qw_step_search){quads->corner, NULL, held->place, NULL, NULL, QW_NEW(env, uint8_t, n),
                                LENGTHS,       &e,   frame_of,    land, NULL, price_of};
    e.search.around = qw_group(env, quads->corner, 4 * quads->face_count, quads->vertex_count, &e.search.begin);
    e.ways = QW_NEW(env, uint8_t, n), e.curves = QW_NEW_ZERO(env, uint8_t, n), e.is_even = QW_NEW(env, uint8_t, n);
    e.end = memset(qw_alloc(env, n, sizeof *e.end), 0, n * sizeof *e.end);
    link_curves(&e);
    find_circles(&e);
    even_circles(&e);
    spread(env, &e);
    held->settle(held->user);
    ease_angles(env, &e);
    qw_undo_bad(env, quads, held->place, before, 1e-12, NULL);
    ease_angles(env, &e);
    qw_scope_end(env);
}

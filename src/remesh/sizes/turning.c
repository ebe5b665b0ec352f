#include "remesh/sizes/turning.h"

#include "base/elementary.h"
#include "geometry/harmonic.h"
#include "solve/cg.h"

#include <assert.h>
#include <math.h>

static const double TOLERANCE = 1e-2;

typedef struct diffusion {
    uint32_t vertices, edges, *end; /* uint32_t[2 edges] */
    double *area, *weight;          /* double[vertices], double[edges] */
    double time;
} diffusion;

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    const diffusion *d = user;
    for (uint32_t v = 0; v < d->vertices; v++) y[v] = d->area[v] * x[v];
    for (uint32_t e = 0; e < d->edges; e++) {
        uint32_t a = d->end[2 * e], b = d->end[2 * e + 1];
        double flow = d->time * d->weight[e] * (x[a] - x[b]);
        y[a] += flow, y[b] -= flow;
    }
}

/* The angle of an edge times its length, positive where convex; in a cut half of that between a face and its image. At
   a sharp edge the surface ends. */
static double turn_at(const qw_trimesh *m, uint32_t h, const double *cut)
{
    uint32_t t = m->twin[h];
    if (qw_is_curve_edge(m, h, !cut)) return 0;
    qw_vec3 way = qw_edge_way(m, h), n = qw_normalize(qw_face_cross(m, h / 3)), other;
    if (t != QW_NONE) other = qw_normalize(qw_face_cross(m, t / 3));
    else {
        qw_vec3 normal = qw_v3_of_doubles(cut);
        other = qw_madd(n, -2 * qw_dot(n, normal), normal);
    }
    double angle = qw_atan2((double)qw_dot(qw_cross(n, other), qw_normalize(way)), (double)qw_dot(n, other));
    return angle * (double)qw_length(way) * (t == QW_NONE ? 0.5 : 1);
}

float *qw_turning(qw_env *env, const qw_trimesh *m, const double *cut, double width, uint32_t count)
{
    assert(m->twin && width > 0);
    uint32_t n = m->vertex_count;
    float *levels = QW_NEW(env, float, (size_t)n *count);
    qw_scope_begin(env);
    double *turn = QW_NEW_ZERO(env, double, n), *density = QW_NEW_ZERO(env, double, n),
           *diagonal = QW_NEW(env, double, n);
    diffusion d = {n,
                   0,
                   QW_NEW(env, uint32_t, 6 * (size_t)m->face_count),
                   QW_NEW_ZERO(env, double, n),
                   QW_NEW(env, double, 3 * (size_t)m->face_count),
                   0};
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        d.area[a] += (double)qw_length(qw_face_cross(m, h / 3)) / 6;
        if (!qw_stands_for_edge(m, h)) continue;
        double by = turn_at(m, h, cut) / 2;
        turn[a] += by, turn[b] += by;
        d.end[2 * d.edges] = a, d.end[2 * d.edges + 1] = b;
        d.weight[d.edges++] = qw_cotangent_weight(m, h, m->twin[h] == QW_NONE);
    }
    double before = 0; /* the square of the width so far */
    for (uint32_t i = 0; i < count; i++) {
        double square = width * width * (double)(1ull << i);
        d.time = (square - before) / 2, before = square;
        for (uint32_t v = 0; v < n; v++) diagonal[v] = d.area[v];
        for (uint32_t e = 0; e < 2 * d.edges; e++) diagonal[d.end[e]] += d.time * d.weight[e / 2];
        qw_cg_solve(env, n, apply, &d, diagonal, turn, density, TOLERANCE, QW_CG_MOST);
        for (uint32_t v = 0; v < n; v++) {
            turn[v] = d.area[v] * density[v];
            levels[(size_t)i * n + v] = (float)density[v];
        }
    }
    qw_scope_end(env);
    return levels;
}

#include "remesh/sizes/turning.h"

#include "base/elementary.h"
#include "solve/cg.h"

#include <assert.h>
#include <math.h>

/* Weights of edges between obtuse triangles are raised to this. */
static const double LEAST_WEIGHT = 0.02, TOLERANCE = 1e-4;

typedef struct diffusion {
    const qw_trimesh *mesh;
    double *area, *weight; /* double[vertices], double[half-edges]: 0 where another stands for the edge */
    double time;
} diffusion;

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    const diffusion *d = user;
    const qw_trimesh *m = d->mesh;
    for (uint32_t v = 0; v < m->vertex_count; v++) y[v] = d->area[v] * x[v];
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        double flow = d->time * d->weight[h] * (x[a] - x[b]);
        y[a] += flow, y[b] -= flow;
    }
}

static double cotangent_at(const qw_trimesh *m, uint32_t h)
{
    const qw_vec3 p = m->position[m->corner[h]], a = qw_sub(m->position[m->corner[qw_next(h)]], p),
                  b = qw_sub(m->position[m->corner[qw_prev(h)]], p);
    double sine = (double)qw_length(qw_cross(a, b));
    return sine > 0 ? (double)qw_dot(a, b) / sine : 0;
}

/* The angle of an edge times its length, positive where convex; in a cut half of that between a face and its image. */
static double turn_at(const qw_trimesh *m, uint32_t h, const double *cut)
{
    uint32_t t = m->twin[h];
    if (t == QW_NONE && !cut) return 0;
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
    diffusion d = {m, QW_NEW_ZERO(env, double, n), QW_NEW_ZERO(env, double, 3 * (size_t)m->face_count), 0};
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t t = m->twin[h], a = m->corner[h], b = m->corner[qw_next(h)];
        d.area[a] += (double)qw_length(qw_face_cross(m, h / 3)) / 6;
        if (!qw_stands_for_edge(m, h)) continue;
        double by = turn_at(m, h, cut) / 2;
        turn[a] += by, turn[b] += by;
        d.weight[h] = fmax((cotangent_at(m, qw_prev(h)) + (t == QW_NONE ? 0 : cotangent_at(m, qw_prev(t)))) / 2,
                           LEAST_WEIGHT);
    }
    double before = 0; /* the square of the width so far */
    for (uint32_t i = 0; i < count; i++) {
        double square = width * width * (double)(1ull << i);
        d.time = (square - before) / 2, before = square;
        for (uint32_t v = 0; v < n; v++) diagonal[v] = d.area[v];
        for (uint32_t h = 0; h < 3 * m->face_count; h++) {
            diagonal[m->corner[h]] += d.time * d.weight[h];
            diagonal[m->corner[qw_next(h)]] += d.time * d.weight[h];
        }
        qw_cg_solve(env, n, apply, &d, diagonal, turn, density, TOLERANCE, QW_CG_MOST);
        for (uint32_t v = 0; v < n; v++) {
            turn[v] = d.area[v] * density[v];
            levels[(size_t)i * n + v] = (float)density[v];
        }
    }
    qw_scope_end(env);
    return levels;
}

#include "remesh/field/girth.h"

#include "base/elementary.h"
#include "solve/cg.h"

#include <assert.h>
#include <math.h>

static const double TOLERANCE = 1e-2;
#define DUAL_LENGTH 0.57735027f /* of the edge between two equilateral triangles */

typedef struct girth {
    const qw_trimesh *mesh;
    const qw_vec3 *normal, *orientation;
    const float *size;
    double *rise, *diagonal, *lack; /* rise, [half-edges]: from the face to its left to the one to its right */
    const double *x;
    double *y;
} girth;

/* The angle of d to the cross at v. */
static double angle_at(const girth *g, uint32_t v, qw_vec3 d)
{
    qw_vec3 o = g->orientation[v];
    return qw_atan2(qw_dot(d, qw_cross(g->normal[v], o)), qw_dot(d, o));
}

static double log_size_of(const girth *g, uint32_t f)
{
    const uint32_t *c = g->mesh->corner + 3 * (size_t)f;
    return qw_ln(((double)g->size[c[0]] + (double)g->size[c[1]] + (double)g->size[c[2]]) / 3);
}

/* How the logarithm of the size would rise across each edge, if it followed the turns of the field. */
static void measure_block(void *user, uint32_t begin, uint32_t end)
{
    const girth *g = user;
    const qw_trimesh *m = g->mesh;
    for (uint32_t f = begin; f < end; f++) {
        g->diagonal[f] = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t t = m->twin[h], u = m->corner[h], v = m->corner[qw_next(h)];
            g->rise[h] = 0;
            if (t == QW_NONE) continue;
            qw_vec3 d = qw_sub(m->position[v], m->position[u]);
            double turn = qw_remainder(angle_at(g, u, d) - angle_at(g, v, d), QW_PI / 2);
            g->rise[h] = (double)DUAL_LENGTH * turn - log_size_of(g, t / 3) + log_size_of(g, f);
            g->diagonal[f] += 1;
        }
    }
}

static void lack_block(void *user, uint32_t begin, uint32_t end)
{
    const girth *g = user;
    for (uint32_t f = begin; f < end; f++) {
        g->lack[f] = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            if (g->mesh->twin[h] != QW_NONE) g->lack[f] -= (g->rise[h] - g->rise[g->mesh->twin[h]]) / 2;
    }
}

/* y = A x, the Laplacian over triangles. */
static void apply_block(void *user, uint32_t begin, uint32_t end)
{
    const girth *g = user;
    for (uint32_t f = begin; f < end; f++) {
        double sum = g->diagonal[f] * g->x[f];
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            if (g->mesh->twin[h] != QW_NONE) sum -= g->x[g->mesh->twin[h] / 3];
        g->y[f] = sum;
    }
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    girth *g = user;
    g->x = x, g->y = y;
    qw_parallel(env, g->mesh->face_count, QW_GRAIN, apply_block, g);
}

/* Takes the mean off each component; returns the root of the mean square. */
static double centre(qw_env *env, const qw_trimesh *m, double *x)
{
    uint32_t *component = QW_NEW(env, uint32_t, m->face_count);
    uint32_t count = qw_label_components(env, 3, m->twin, m->face_count, component);
    double *sum = QW_NEW_ZERO(env, double, count), *area = QW_NEW_ZERO(env, double, count), square = 0, all = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double a = qw_length(qw_face_cross(m, f));
        sum[component[f]] += a * x[f], area[component[f]] += a;
    }
    for (uint32_t f = 0; f < m->face_count; f++) {
        double a = qw_length(qw_face_cross(m, f));
        x[f] -= area[component[f]] > 0 ? sum[component[f]] / area[component[f]] : 0;
        square += a * x[f] * x[f], all += a;
    }
    return all > 0 ? sqrt(square / all) : 0;
}

/* The slope of x at each vertex, the root of twice the mean square over the edges around it. */
static void find_slopes(qw_env *env, const qw_trimesh *m, const double *x, float *slope)
{
    float *count = QW_NEW_ZERO(env, float, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) slope[v] = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] == QW_NONE) continue;
        float length = qw_edge_length(m, h) * DUAL_LENGTH, s = (float)(x[m->twin[h] / 3] - x[h / 3]) / length;
        for (int k = 0; k < 2; k++) {
            uint32_t v = m->corner[k ? qw_next(h) : h];
            slope[v] += s * s, count[v]++;
        }
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) slope[v] = count[v] > 0 ? sqrtf(2 * slope[v] / count[v]) : 0;
}

double qw_girth_spread(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *orientation,
                       const float *size, float *slope)
{
    assert(mesh->twin && normal && orientation && size && slope);
    uint32_t n = mesh->face_count;
    qw_scope_begin(env);
    girth g = {.mesh = mesh, .normal = normal, .orientation = orientation, .size = size};
    g.rise = QW_NEW(env, double, 3 * (size_t)n), g.diagonal = QW_NEW(env, double, n), g.lack = QW_NEW(env, double, n);
    qw_parallel(env, n, QW_GRAIN, measure_block, &g);
    qw_parallel(env, n, QW_GRAIN, lack_block, &g);
    double *x = QW_NEW_ZERO(env, double, n);
    qw_cg_solve(env, n, apply, &g, g.diagonal, g.lack, x, TOLERANCE, QW_CG_MOST);
    double spread = centre(env, mesh, x);
    find_slopes(env, mesh, x, slope);
    qw_scope_end(env);
    return spread;
}

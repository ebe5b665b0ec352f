#include "geometry/harmonic.h"

#include "solve/cg.h"

#include <assert.h>
#include <math.h>

/* Weights of edges between obtuse triangles are raised to this, so that functions have their extremes on the rims. */
static const double LEAST_WEIGHT = 0.02;
static const double TOLERANCE = 1e-4;
enum { MAX_ITERATIONS = 1000 };

/* y = A x: the Laplacian by cotangents, the identity for what is fixed. */
static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    const qw_harmonic *p = user;
    for (uint32_t i = 0; i < p->count; i++) y[i] = 0;
    for (uint32_t e = 0; e < p->edges; e++) {
        uint32_t a = p->end[2 * e], b = p->end[2 * e + 1];
        double flow = p->weight[e] * (x[a] - x[b]);
        y[a] += flow, y[b] -= flow;
    }
    for (uint32_t i = 0; i < p->count; i++)
        if (p->is_fixed[i]) y[i] = x[i];
}

/* Of the angle between the next and the previous half-edge of h, across from it. */
static double cotangent_across(const qw_trimesh *m, uint32_t h)
{
    const qw_vec3 p = m->position[m->corner[qw_prev(h)]], a = qw_sub(m->position[m->corner[h]], p),
                  b = qw_sub(m->position[m->corner[qw_next(h)]], p);
    double sine = (double)qw_length(qw_cross(a, b));
    return sine > 0 ? (double)qw_dot(a, b) / sine : 0;
}

double qw_cotangent_weight(const qw_trimesh *m, uint32_t h, bool is_rim)
{
    double sum = cotangent_across(m, h) + (is_rim ? 0 : cotangent_across(m, m->twin[h]));
    return fmax(sum / 2, LEAST_WEIGHT);
}

/* Edges of the patch, each once, with their weights, and the diagonal of the sums of these. */
static void set_weights(qw_harmonic *p, const uint32_t *of, uint32_t id)
{
    const qw_trimesh *m = p->mesh;
    for (uint32_t i = 0; i < p->face_count; i++)
        for (uint32_t h = 3 * p->face[i]; h < 3 * p->face[i] + 3; h++) {
            uint32_t t = m->twin[h], a = p->place[m->corner[h]], b = p->place[m->corner[qw_next(h)]];
            bool is_rim = t == QW_NONE || of[t / 3] != id;
            if (!is_rim && t < h) continue;
            p->weight[p->edges] = qw_cotangent_weight(m, h, is_rim);
            p->end[2 * p->edges] = a, p->end[2 * p->edges + 1] = b;
            p->diagonal[a] += p->weight[p->edges], p->diagonal[b] += p->weight[p->edges];
            p->edges++;
        }
}

qw_harmonic qw_harmonic_begin(qw_env *env, const qw_trimesh *mesh, const uint32_t *face, uint32_t face_count,
                              const uint32_t *of, uint32_t id)
{
    assert(mesh->twin && face_count > 0 && of[face[0]] == id);
    uint32_t most = 3 * face_count;
    qw_harmonic p = {.mesh = mesh, .face = face, .face_count = face_count};
    p.vertex = QW_NEW(env, uint32_t, most), p.place = QW_NEW(env, uint32_t, mesh->vertex_count);
    p.end = QW_NEW(env, uint32_t, 2 * (size_t)most), p.weight = QW_NEW(env, double, most);
    p.is_fixed = QW_NEW_ZERO(env, uint8_t, most);
    p.diagonal = QW_NEW_ZERO(env, double, most), p.value = QW_NEW_ZERO(env, double, most);
    for (uint32_t i = 0; i < most; i++) p.place[mesh->corner[3 * face[i / 3] + i % 3]] = QW_NONE;
    for (uint32_t i = 0; i < most; i++) {
        uint32_t v = mesh->corner[3 * face[i / 3] + i % 3];
        if (p.place[v] == QW_NONE) p.place[v] = p.count, p.vertex[p.count++] = v;
    }
    set_weights(&p, of, id);
    return p;
}

void qw_harmonic_solve(qw_env *env, qw_harmonic *p)
{
    qw_scope_begin(env);
    double *b = QW_NEW(env, double, p->count), *x = QW_NEW_ZERO(env, double, p->count);
    apply(p, env, p->value, b);
    for (uint32_t i = 0; i < p->count; i++) {
        b[i] = p->is_fixed[i] ? 0 : -b[i];
        if (p->is_fixed[i]) p->diagonal[i] = 1;
    }
    qw_cg_solve(env, p->count, apply, p, p->diagonal, b, x, TOLERANCE, MAX_ITERATIONS);
    for (uint32_t i = 0; i < p->count; i++) p->value[i] += x[i];
    qw_scope_end(env);
}

double qw_harmonic_energy(const qw_harmonic *p)
{
    double sum = 0;
    for (uint32_t e = 0; e < p->edges; e++) {
        double step = p->value[p->end[2 * e]] - p->value[p->end[2 * e + 1]];
        sum += p->weight[e] * step * step;
    }
    return sum;
}

qw_vec3 *qw_harmonic_lines(qw_env *env, const qw_harmonic *p)
{
    const qw_trimesh *m = p->mesh;
    qw_vec3 *along = QW_NEW_ZERO(env, qw_vec3, p->count);
    for (uint32_t i = 0; i < p->face_count; i++) {
        const uint32_t *c = m->corner + 3 * (size_t)p->face[i];
        qw_vec3 sum = qw_v3(0, 0, 0);
        for (int k = 0; k < 3; k++)
            sum = qw_madd(sum, (float)p->value[p->place[c[k]]],
                          qw_sub(m->position[c[(k + 2) % 3]], m->position[c[(k + 1) % 3]]));
        for (int k = 0; k < 3; k++) along[p->place[c[k]]] = qw_add(along[p->place[c[k]]], sum);
    }
    return along;
}

/* Normals at the scale of the quads: one implicit step (M + r^2 L) n' = M n of the heat equation over the time r^2, by conjugate
 * gradients. M is the vertex area; the cotangent weights of L are those of an equilateral mesh, 1 / sqrt(3) an edge, as the working mesh
 * is near to one. */
#include "field/orientation.h"

#include "solve/cg.h"

#include <string.h>

enum { GRAIN = 2048, MAX_ITERATIONS = 200 };
#define EDGE_WEIGHT 0.57735027

/* Directions to half a degree; the field asks for no more. */
static const double TOLERANCE = 1e-2;

/* How long the mean of the normals is tells relief from limbs. Bumps and noise leave it long: where they lean by 45 degrees, 0.7. Around
   a limb the normals cancel: to 1 / (1 + r^2 / R^2) for a cylinder of radius R, a half where R = r. There a smaller radius counts, or a
   finger would lose its tip. */
#define RELIEF 0.7f
#define LIMB 0.4f
#define NEAR_SHARE 0.5f

typedef struct diffusion {
    const qw_trimesh *mesh;
    const uint32_t *outgoing;
    const uint8_t *crease; /* vertices of marked edges: they keep their normal and hand it to nobody */
    const double *mass;    /* double[vertex_count], over the radius squared and EDGE_WEIGHT, so that an edge counts 1 */
    const double *x;
    double *y;
} diffusion;

static void add_difference(const diffusion *d, uint32_t v, uint32_t u, double *y)
{
    if (d->crease[u]) return;
    for (uint32_t k = 0; k < 3; k++) y[k] += d->x[3 * (size_t)v + k] - d->x[3 * (size_t)u + k];
}

static void apply_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const diffusion *d = user;
    for (uint32_t v = begin; v < end; v++) {
        double *y = d->y + 3 * (size_t)v;
        for (uint32_t k = 0; k < 3; k++) y[k] = d->crease[v] ? 0 : d->mass[v] * d->x[3 * (size_t)v + k];
        uint32_t h = d->outgoing[v];
        if (d->crease[v]) continue;
        do {
            add_difference(d, v, d->mesh->corner[qw_next(h)], y);
            uint32_t back = qw_prev(h);
            if (d->mesh->twin[back] == QW_NONE) add_difference(d, v, d->mesh->corner[back], y);
            h = d->mesh->twin[back];
        } while (h != QW_NONE && h != d->outgoing[v]);
    }
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    diffusion *d = user;
    d->x = x, d->y = y;
    qw_parallel(env, d->mesh->vertex_count, GRAIN, apply_block, d);
}

/* Per vertex: mass, crease, and the diagonal of the system (0 where the normal is kept). */
static void prepare(qw_env *env, diffusion *d, double radius, double *diagonal)
{
    const qw_trimesh *mesh = d->mesh;
    uint32_t n = mesh->vertex_count;
    uint8_t *crease = QW_NEW_ZERO(env, uint8_t, n);
    double *mass = QW_NEW_ZERO(env, double, n);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        double area = qw_length(qw_face_cross(mesh, f)) / 6.0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            mass[mesh->corner[h]] += area / (radius * radius * EDGE_WEIGHT);
            if (mesh->mark && (mesh->mark[h] & QW_MARK_FEATURE)) crease[mesh->corner[h]] = crease[mesh->corner[qw_next(h)]] = 1;
        }
    }
    memset(diagonal, 0, 3 * (size_t)n * sizeof *diagonal);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
        if (crease[u] || crease[v]) continue;
        diagonal[3 * (size_t)u] += 1;
        if (mesh->twin[h] == QW_NONE) diagonal[3 * (size_t)v] += 1;
    }
    for (size_t v = 0; v < n; v++) {
        if (!crease[v]) diagonal[3 * v] += mass[v];
        diagonal[3 * v + 1] = diagonal[3 * v + 2] = diagonal[3 * v];
    }
    d->crease = crease, d->mass = mass;
}

/* One step from the normals in `from`; the result, not of unit length, in x. */
static void diffuse(qw_env *env, diffusion *d, double radius, const qw_vec3 *from, double *x)
{
    qw_scope_begin(env);
    uint32_t n = d->mesh->vertex_count;
    double *diagonal = QW_NEW(env, double, 3 * (size_t)n), *b = QW_NEW(env, double, 3 * (size_t)n);
    prepare(env, d, radius, diagonal);
    for (size_t v = 0; v < n; v++) {
        const double mine[3] = {from[v].x, from[v].y, from[v].z};
        for (size_t k = 0; k < 3; k++) {
            x[3 * v + k] = mine[k];
            b[3 * v + k] = d->crease[v] ? 0 : d->mass[v] * mine[k];
        }
    }
    qw_cg_solve(env, 3 * n, apply, d, diagonal, b, x, TOLERANCE, MAX_ITERATIONS);
    qw_scope_end(env);
}

static float corner_angle(const qw_trimesh *mesh, uint32_t h)
{
    qw_vec3 p = mesh->position[mesh->corner[h]];
    qw_vec3 a = qw_sub(mesh->position[mesh->corner[qw_next(h)]], p), b = qw_sub(mesh->position[mesh->corner[qw_prev(h)]], p);
    return atan2f(qw_length(qw_cross(a, b)), qw_dot(a, b));
}

void qw_balance_creases(qw_env *env, const qw_trimesh *mesh, qw_vec3 *normal)
{
    if (!mesh->mark) return;
    qw_scope_begin(env);
    qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, mesh->vertex_count);
    uint8_t *crease = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t v = mesh->corner[h];
        if (mesh->mark[h] & QW_MARK_FEATURE) crease[v] = crease[mesh->corner[qw_next(h)]] = 1;
        sum[v] = qw_madd(sum[v], corner_angle(mesh, h), qw_normalize(qw_face_cross(mesh, h / 3)));
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (crease[v] && qw_length2(sum[v]) > 1e-6f) normal[v] = qw_normalize(sum[v]);
    qw_scope_end(env);
}

void qw_smooth_normals(qw_env *env, const qw_trimesh *mesh, float radius, qw_vec3 *normal)
{
    if (radius <= 0) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count;
    double *far = QW_NEW(env, double, 3 * (size_t)n), *near = QW_NEW(env, double, 3 * (size_t)n);
    diffusion d = {.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh)};
    diffuse(env, &d, radius, normal, far);
    diffuse(env, &d, NEAR_SHARE * radius, normal, near);
    for (size_t v = 0; v < n; v++) {
        qw_vec3 f = qw_v3((float)far[3 * v], (float)far[3 * v + 1], (float)far[3 * v + 2]);
        qw_vec3 s = qw_v3((float)near[3 * v], (float)near[3 * v + 1], (float)near[3 * v + 2]);
        float trust = fminf(fmaxf((qw_length(f) - LIMB) / (RELIEF - LIMB), 0), 1);
        qw_vec3 smooth = qw_lerp(qw_normalize(s), qw_normalize(f), trust);
        if (qw_length2(smooth) > 1e-12f) normal[v] = qw_normalize(smooth);
    }
    qw_scope_end(env);
}

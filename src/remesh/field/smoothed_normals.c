/* Normals at the scale of the quads: one implicit step (M / r^2 + L) n' = M / r^2 n of the heat equation over the time
 * r^2, by conjugate gradients; r may differ from vertex to vertex. M is the vertex area; the cotangent weights of L are
 * those of an equilateral mesh, 1 / sqrt(3) an edge, as the working mesh is near to one. */
#include "remesh/field/orientation.h"

#include "base/elementary.h"
#include "solve/cg.h"

#include <assert.h>
#include <string.h>

#define EDGE_WEIGHT 0.57735027

/* Directions to half a degree; the field asks for no more. */
static const double TOLERANCE = 1e-2;

/* How long the mean of the normals is tells relief from protrusions. Bumps and noise leave it long: where they lean by
   45 degrees, 0.7. Around a protrusion the normals cancel: to 1 / (1 + r^2 / R^2) for a cylinder of radius R, a half
   where R = r. There a smaller radius counts, or a finger would lose its tip. */
#define RELIEF     0.7f
#define PROTRUSION 0.4f
#define NEAR_SHARE 0.5f

typedef struct diffusion {
    const qw_trimesh *mesh;
    const float *size;           /* float[vertex_count] or NULL: the radius is in these */
    uint32_t *begin, *neighbour; /* of each vertex, without those on creases */
    const uint8_t *crease;       /* vertices of marked edges: they keep their normal and hand it to nobody */
    const double *mass; /* double[vertex_count], over the radius squared and EDGE_WEIGHT, so that an edge counts 1 */
    const double *x;
    double *y;
} diffusion;

/* Lists the neighbours of each vertex off creases; along a boundary twice, as the missing triangle would. */
static void collect_neighbours(qw_env *env, diffusion *d)
{
    assert(d->mesh->twin);
    const qw_trimesh *mesh = d->mesh;
    uint32_t n = mesh->vertex_count, half_edges = 3 * mesh->face_count;
    uint32_t *begin = d->begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2);
    d->neighbour = QW_NEW(env, uint32_t, 2 * (size_t)half_edges);
    for (int fill = 0; fill < 2; fill++) {
        for (uint32_t h = 0; h < half_edges; h++) {
            uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
            if (d->crease[u] || d->crease[v]) continue;
            uint32_t *at_u = &begin[u + 2 - fill], *at_v = &begin[v + 2 - fill];
            if (fill) d->neighbour[*at_u] = v;
            ++*at_u;
            if (mesh->twin[h] != QW_NONE) continue;
            if (fill) d->neighbour[*at_v] = u;
            ++*at_v;
        }
        for (uint32_t v = 0; v < n && !fill; v++) begin[v + 2] += begin[v + 1];
    }
}

/* y = A x for three coordinates, the matrix of the diffusion. */
static void apply_block(void *user, uint32_t begin, uint32_t end)
{
    const diffusion *d = user;
    for (uint32_t v = begin; v < end; v++) {
        const double *x = d->x + 3 * (size_t)v;
        double weight = d->crease[v] ? 0 : d->mass[v] + (double)(d->begin[v + 1] - d->begin[v]),
               sum[3] = {weight * x[0], weight * x[1], weight * x[2]};
        for (uint32_t i = d->begin[v]; i < d->begin[v + 1]; i++) {
            const double *u = d->x + 3 * (size_t)d->neighbour[i];
            for (int k = 0; k < 3; k++) sum[k] -= u[k];
        }
        memcpy(d->y + 3 * (size_t)v, sum, sizeof sum);
    }
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    diffusion *d = user;
    d->x = x, d->y = y;
    qw_parallel(env, d->mesh->vertex_count, QW_GRAIN, apply_block, d);
}

static void find_creases(qw_env *env, diffusion *d)
{
    const qw_trimesh *mesh = d->mesh;
    uint8_t *crease = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count && mesh->mark; h++)
        if (mesh->mark[h] & QW_MARK_FEATURE) crease[mesh->corner[h]] = crease[mesh->corner[qw_next(h)]] = 1;
    d->crease = crease;
}

/* Vertex areas, over the radius squared and EDGE_WEIGHT. */
static double *find_masses(qw_env *env, const diffusion *d, double radius)
{
    assert(radius > 0);
    const qw_trimesh *mesh = d->mesh;
    double *mass = QW_NEW_ZERO(env, double, mesh->vertex_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        double area = qw_length(qw_face_cross(mesh, f)) / 6.0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) mass[mesh->corner[h]] += area / (radius * radius * EDGE_WEIGHT);
    }
    for (size_t v = 0; d->size && v < mesh->vertex_count; v++) mass[v] /= (double)d->size[v] * d->size[v];
    return mass;
}

typedef struct equations {
    const diffusion *d;
    const qw_vec3 *from;
    double *diagonal, *b, *x; /* 0 on the diagonal where the normal is kept */
} equations;

/* Diagonal, right side and first guess of the diffusion. */
static void fill_block(void *user, uint32_t begin, uint32_t end)
{
    const equations *q = user;
    const diffusion *d = q->d;
    for (size_t v = begin; v < end; v++) {
        const double mine[3] = {q->from[v].x, q->from[v].y, q->from[v].z};
        double diagonal = d->crease[v] ? 0 : d->mass[v] + (double)(d->begin[v + 1] - d->begin[v]);
        for (size_t k = 0; k < 3; k++) {
            q->diagonal[3 * v + k] = diagonal;
            q->x[3 * v + k] = mine[k];
            q->b[3 * v + k] = d->crease[v] ? 0 : d->mass[v] * mine[k];
        }
    }
}

/* One step from the normals in `from`; the result, not of unit length, in x. */
static void diffuse(qw_env *env, diffusion *d, double radius, const qw_vec3 *from, double *x)
{
    qw_scope_begin(env);
    uint32_t n = d->mesh->vertex_count;
    d->mass = find_masses(env, d, radius);
    equations q = {d, from, QW_NEW(env, double, 3 * (size_t)n), QW_NEW(env, double, 3 * (size_t)n), x};
    qw_parallel(env, n, QW_GRAIN, fill_block, &q);
    qw_cg_solve(env, 3 * n, apply, d, q.diagonal, q.b, x, TOLERANCE, QW_CG_MOST);
    qw_scope_end(env);
}

void qw_balance_creases(qw_env *env, const qw_trimesh *mesh, qw_vec3 *normal)
{
    assert(mesh->twin && normal);
    if (!mesh->mark) return;
    qw_scope_begin(env);
    qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, mesh->vertex_count);
    uint8_t *crease = QW_NEW_ZERO(env, uint8_t, mesh->vertex_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t v = mesh->corner[h];
        if (mesh->mark[h] & QW_MARK_FEATURE) crease[v] = crease[mesh->corner[qw_next(h)]] = 1;
        sum[v] = qw_madd(sum[v], (float)qw_corner_angle(mesh->position, mesh->corner, h),
                         qw_normalize(qw_face_cross(mesh, h / 3)));
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (crease[v] && qw_length2(sum[v]) > 1e-6f) normal[v] = qw_normalize(sum[v]);
    qw_scope_end(env);
}

typedef struct blend {
    const double *far, *near; /* [3 vertex_count] */
    qw_vec3 *normal;
    float *share; /* or NULL */
} blend;

/* The normal of each vertex between the slightly and the widely smoothed one: the latter only as far as the former
 * is long. */
static void blend_block(void *user, uint32_t begin, uint32_t end)
{
    const blend *b = user;
    for (size_t v = begin; v < end; v++) {
        qw_vec3 f = qw_v3((float)b->far[3 * v], (float)b->far[3 * v + 1], (float)b->far[3 * v + 2]);
        qw_vec3 s = qw_v3((float)b->near[3 * v], (float)b->near[3 * v + 1], (float)b->near[3 * v + 2]);
        float trust = fminf(fmaxf((qw_length(f) - PROTRUSION) / (RELIEF - PROTRUSION), 0), 1);
        qw_vec3 smooth = qw_lerp(qw_normalize(s), qw_normalize(f), trust);
        if (qw_length2(smooth) > 1e-12f) b->normal[v] = qw_normalize(smooth);
        if (b->share) b->share[v] = NEAR_SHARE + (1 - NEAR_SHARE) * trust;
    }
}

void qw_smooth_normals(qw_env *env, const qw_trimesh *mesh, const float *size, float radius, qw_vec3 *normal,
                       float *share)
{
    assert(mesh->twin && normal);
    for (uint32_t v = 0; share && v < mesh->vertex_count; v++) share[v] = 1;
    if (radius <= 0) return;
    qw_scope_begin(env);
    uint32_t n = mesh->vertex_count;
    double *far = QW_NEW(env, double, 3 * (size_t)n), *near = QW_NEW(env, double, 3 * (size_t)n);
    diffusion d = {.mesh = mesh, .size = size};
    find_creases(env, &d);
    collect_neighbours(env, &d);
    diffuse(env, &d, radius, normal, far);
    diffuse(env, &d, NEAR_SHARE * radius, normal, near);
    blend b = {far, near, normal, share};
    qw_parallel(env, n, QW_GRAIN, blend_block, &b);
    qw_scope_end(env);
}

/* One implicit step of the heat equation on the triangles: (A + r^2 W) k = K, with A the areas, K the curvatures, k
 * their density afterwards and W the Laplacian of the dual graph with weights sqrt(3), as an equilateral mesh has.
 * Whatever k is, the flow r^2 sqrt(3) (k_f - k_g) from a triangle f to its neighbour g keeps the sum, so k need not be
 * exact. */
#include "remesh/field/curvature_diffusion.h"

#include "base/elementary.h"
#include "solve/cg.h"

#include <assert.h>

/* Flows across a whole skin of a wrap do not converge in so many, nor need they. */
enum { MAX_ITERATIONS = 100 };
#define DUAL_WEIGHT 1.7320508f

/* Tighter changes nothing in the finished meshes at the default smoothness. */
static const double TOLERANCE = 0.1;

typedef struct diffusion {
    const qw_trimesh *mesh;
    const qw_level *level;
    const float *radius;
    float *log_size;                     /* [faces] or NULL */
    double *area, *curvature, *diagonal; /* [faces] */
    float *flow; /* [half-edges] what flows across for a unit of difference in density; the same for both twins; -1
                    where nothing may */
    const double *x;
    double *y;
    float *turn;
} diffusion;

static bool has_corner(const diffusion *e, uint32_t f)
{
    const uint32_t *c = e->mesh->corner + 3 * (size_t)f;
    const uint8_t *constraint = e->level->constraint;
    return constraint[c[0]] == QW_VERTEX_CORNER || constraint[c[1]] == QW_VERTEX_CORNER ||
           constraint[c[2]] == QW_VERTEX_CORNER;
}

/* The solid angle of three normals (van Oosterom and Strackee 1983), less whole quarter turns: a cross comes back the
   same with or without these, and where normals are so far apart they are no guide. */
static double curvature_between(qw_vec3 a, qw_vec3 b, qw_vec3 c)
{
    double volume = qw_dot(a, qw_cross(b, c)), sum = 1 + qw_dot(a, b) + qw_dot(b, c) + qw_dot(c, a);
    if (fabs(volume) < 0.1 * sum) { /* nearly everywhere: the series to 1e-7, as the function takes long */
        double t = volume / sum;
        return 2 * t * (1 - t * t / 3 + t * t * t * t / 5);
    }
    return qw_remainder(2 * qw_atan2(volume, sum), QW_PI / 2);
}

/* Area and curvature of each triangle, and how much flows across its edges: nothing across curves, boundaries and
 * at corners. */
static void measure_block(void *user, uint32_t begin, uint32_t end)
{
    const diffusion *e = user;
    const qw_trimesh *m = e->mesh;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        bool closed = has_corner(e, f);
        e->area[f] = qw_length(qw_face_cross(m, f)) / 2;
        e->curvature[f] =
            closed ? 0 : curvature_between(e->level->normal[c[0]], e->level->normal[c[1]], e->level->normal[c[2]]);
        e->diagonal[f] = e->area[f];
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t g = m->twin[h];
            e->flow[h] = -1;
            if (closed || g == QW_NONE || (m->mark && m->mark[h] & QW_MARK_FEATURE) || has_corner(e, g / 3)) continue;
            float reach = (e->radius[m->corner[h]] + e->radius[m->corner[qw_next(h)]]) / 2;
            e->flow[h] = DUAL_WEIGHT * reach * reach;
            e->diagonal[f] += e->flow[h];
        }
    }
}

/* y = A x, the matrix of the diffusion. */
static void apply_block(void *user, uint32_t begin, uint32_t end)
{
    const diffusion *e = user;
    for (uint32_t f = begin; f < end; f++) {
        double sum = e->diagonal[f] * e->x[f];
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            if (e->flow[h] > 0) sum -= e->flow[h] * e->x[e->mesh->twin[h] / 3];
        e->y[f] = sum;
    }
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    diffusion *e = user;
    e->x = x, e->y = y;
    qw_parallel(env, e->mesh->face_count, QW_GRAIN, apply_block, e);
}

/* What carrying along an edge turns by more on the stretched surface. */
static float size_turn(const diffusion *e, uint32_t h)
{
    return e->log_size ? DUAL_WEIGHT * (e->log_size[e->mesh->twin[h] / 3] - e->log_size[h / 3]) : 0;
}

/* What of the diffused curvature and of the sizes a cross has to turn by along each edge. */
static void turn_block(void *user, uint32_t begin, uint32_t end)
{
    const diffusion *e = user;
    const qw_trimesh *m = e->mesh;
    for (uint32_t h = 3 * begin; h < 3 * end; h++) {
        if (e->flow[h] < 0) continue;
        uint32_t u = m->corner[h], v = m->corner[qw_next(h)], slot = e->level->begin[v];
        while (e->level->neighbour[slot] != u) slot++;
        e->turn[slot] = (float)(e->flow[h] * (e->x[m->twin[h] / 3] - e->x[h / 3])) + size_turn(e, h);
    }
}

/* Curvature as it is on the surface stretched by 1 / size, on which all quads are of one size: K - Laplacian of log (1
   / size), integrated over each triangle. */
static void stretch(qw_env *env, diffusion *e, const float *size)
{
    const qw_trimesh *m = e->mesh;
    e->log_size = QW_NEW(env, float, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        e->log_size[f] = (float)qw_ln(((double)size[c[0]] + (double)size[c[1]] + (double)size[c[2]]) / 3);
    }
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (e->flow[h] >= 0) e->curvature[h / 3] += (double)size_turn(e, h);
}

float *qw_diffuse_curvature(qw_env *env, const qw_trimesh *mesh, const qw_level *level, const float *radius,
                            const float *size)
{
    assert(mesh->twin && radius && level->vertex_count == mesh->vertex_count);
    uint32_t n = mesh->face_count;
    diffusion e = {.mesh = mesh, .level = level, .radius = radius};
    e.turn = QW_NEW_ZERO(env, float, level->begin[level->vertex_count]);
    qw_scope_begin(env);
    e.area = QW_NEW(env, double, n), e.curvature = QW_NEW(env, double, n), e.diagonal = QW_NEW(env, double, n);
    e.flow = QW_NEW(env, float, 3 * (size_t)n);
    qw_parallel(env, n, QW_GRAIN, measure_block, &e);
    if (size) stretch(env, &e, size);
    double *density = QW_NEW_ZERO(env, double, n);
    qw_cg_solve(env, n, apply, &e, e.diagonal, e.curvature, density, TOLERANCE, MAX_ITERATIONS);
    e.x = density;
    qw_parallel(env, n, QW_GRAIN, turn_block, &e);
    qw_scope_end(env);
    return e.turn;
}

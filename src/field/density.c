#include "field/density.h"

#include "field/scale.h"
#include "math/elementary.h"
#include "mesh/bvh.h"
#include "mesh/corners.h"
#include "mesh/lumps.h"

#include <assert.h>
#include <string.h>

enum {
    GRAIN = 256,
    RAYS = 7,      /* one inward, six around it */
    FIT_ROUNDS = 6 /* the count is then met to a thousandth, most often */
};
/* Of edges, in mean edges, at strength 1. */
static const double LEAST = 0.25, MOST = 1.8;
static const double LEAST_BEND = 1e-6; /* of the mean: keeps divisions from 0 */

/* ---- curvature at its own scale */

typedef struct bend_task {
    const qw_lumps *lumps;
    const qw_trimesh *mesh;
    const qw_vec3 *normal;
    const float *share; /* float[vertex_count]: 0 where the ball is not asked; NULL: it is everywhere */
    float *bend;
} bend_task;

static void bend_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const bend_task *t = user;
    for (uint32_t v = begin; v < end; v++) {
        double k[2];
        if (t->share && !(t->share[v] > 0)) continue;
        qw_lumps_curvature(t->lumps, t->mesh->position[v], t->normal[v], k);
        float bend = (float)sqrt(k[0] * k[0] + k[1] * k[1]);
        t->bend[v] += (bend - t->bend[v]) * (t->share ? t->share[v] : 1);
    }
}

/* Mean over the area. */
static double mean_of(const qw_trimesh *m, const float *value)
{
    double sum = 0, area = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        double a = qw_length(qw_face_cross(m, f));
        sum += a * ((double)value[c[0]] + (double)value[c[1]] + (double)value[c[2]]) / 3;
        area += a;
    }
    return area > 0 ? sum / area : 0;
}

/* How much a ball of half the radius is asked where a bend was found in one of `radius`: the more, the smaller the
   edge is, in radii, with which all quads bow alike, as far as `strength` has sizes go there. */
static float share_of_finer(double bend, double mean, double edge, double radius, double strength)
{
    double fits = qw_pow(mean / fmax(bend, LEAST_BEND * mean), 0.5 * strength) * edge / radius;
    return (float)fmin(fmax(-qw_ln(fits) / qw_ln(2), 0), 1);
}

/* Makes the normals of triangles that no ball asked for can reach zero: near-by ones count by their way along edges, at
   most twice as long as the straight one. */
static void forget_far_triangles(qw_env *env, const qw_trimesh *m, const float *share, double radius, qw_vec3 *facing)
{
    assert(share && facing);
    static const float DETOUR = 2;
    qw_scope_begin(env);
    uint8_t *is_asked = QW_NEW(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) is_asked[v] = share[v] > 0;
    float *distance = qw_distances(env, m, is_asked), most = DETOUR * (float)radius;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        if (fminf(fminf(distance[c[0]], distance[c[1]]), distance[c[2]]) > most) facing[f] = qw_v3(0, 0, 0);
    }
    qw_scope_end(env);
}

float *qw_bend_at_scale(qw_env *env, const qw_trimesh *m, const qw_vec3 *normal, double edge, double strength)
{
    assert(edge > 0);
    uint32_t n = m->vertex_count;
    float *bend = QW_NEW_ZERO(env, float, n);
    qw_scope_begin(env);
    qw_vec3 *facing = QW_NEW(env, qw_vec3, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) facing[f] = qw_normalize(qw_face_cross(m, f));
    float *share = QW_NEW(env, float, n);
    double radius = edge, mean = 0;
    int halvings = (int)qw_floor(-strength * qw_ln(LEAST) / qw_ln(2) + 0.5); /* down to the smallest quads there are */
    for (int scale = 0; scale <= halvings; scale++, radius /= 2) {
        if (scale > 0) forget_far_triangles(env, m, share, radius, facing);
        qw_scope_begin(env);
        bend_task t = {.mesh = m, .normal = normal, .share = scale > 0 ? share : NULL, .bend = bend};
        t.lumps = qw_lumps_make(env, m, facing, radius);
        qw_parallel(env, n, GRAIN, bend_block, &t);
        qw_scope_end(env);
        if (scale == 0) mean = mean_of(m, bend);
        if (!(mean > 0)) break; /* a plane */
        for (uint32_t v = 0; v < n; v++) share[v] = share_of_finer((double)bend[v], mean, edge, radius, strength);
    }
    qw_scope_end(env);
    return bend;
}

/* ---- limbs */

/* So many quads should go around the larger of two circles: the one that has the surface's curvature, and the one that
 * has the thickness there for its diameter. On a limb they are one; on a thin plate the first is larger, on its rim the
 * second, and neither asks for small quads. */
static const float AROUND = 6;
/* In mean edges: no limb asks for less, or one as thin as a hair would take most of the quads. */
static const float LEAST_LIMB = 0.4f;

typedef struct limb_task {
    const qw_bvh *tree;
    const qw_trimesh *mesh;
    const qw_vec3 *normal;
    const float *bend;
    float thickest; /* no limb is thicker */
    float *size;    /* wanted so far; lowered */
} limb_task;

/* The median length of rays inward, within a cone of 27 degrees; `thickest` where they meet nothing. */
static float thickness_at(const limb_task *t, uint32_t v)
{
    static const float SPREAD = 0.5f, LIFT = 1e-4f;
    float length[RAYS];
    qw_vec3 n = t->normal[v], x = qw_any_orthogonal(n), y = qw_cross(n, x),
            from = qw_madd(t->mesh->position[v], -LIFT * t->thickest, n);
    for (int i = 0; i < RAYS; i++) {
        double angle = 2 * QW_PI * i / (RAYS - 1);
        float slant = i < RAYS - 1 ? SPREAD : 0;
        qw_vec3 d = qw_madd(qw_madd(qw_scale(n, -1), slant * (float)qw_cos(angle), x), slant * (float)qw_sin(angle), y);
        qw_hit hit = qw_bvh_ray(t->tree, from, qw_normalize(d), t->thickest, QW_NONE);
        float l = hit.face == QW_NONE ? t->thickest : sqrtf(hit.distance2);
        int k = i;
        for (; k > 0 && length[k - 1] > l; k--) length[k] = length[k - 1];
        length[k] = l;
    }
    return length[RAYS / 2];
}

static void limb_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const limb_task *t = user;
    const float share = (float)QW_PI / AROUND;
    for (uint32_t v = begin; v < end; v++) {
        float round = 2 / t->bend[v]; /* the diameter of the circle with that curvature */
        if (!(share * round < t->size[v])) continue;
        float wide = fmaxf(thickness_at(t, v), round);
        t->size[v] = fminf(t->size[v], share * wide);
    }
}

void qw_fit_limbs(qw_env *env, const qw_trimesh *m, const qw_vec3 *normal, const float *bend, float *size)
{
    assert(normal && bend && size);
    float most = 0;
    qw_scope_begin(env);
    for (uint32_t v = 0; v < m->vertex_count; v++) most = fmaxf(most, size[v]);
    limb_task t = {qw_bvh_build(env, m), m, normal, bend, most * AROUND / (float)QW_PI, size};
    qw_parallel(env, m->vertex_count, GRAIN, limb_block, &t);
    qw_scope_end(env);
}

/* ---- feature curves side by side */

/* Quads between two curves. */
static const float BETWEEN = 2;
/* Beside a corner the way between two curves is short because they meet there. What is farther from every corner than
   this many times its distance to the curves is between two that do not meet: those of a corner of 39 degrees. */
static const float BESIDE_CORNER = 3;
/* A vertex lies half way where no neighbour is farther from the curves by this share of the way to it. */
static const float STILL_RISING = 0.5f;

void qw_fit_between_curves(qw_env *env, const qw_trimesh *m, bool with_boundary, float *size)
{
    assert(m->twin && size);
    uint32_t n = m->vertex_count;
    qw_scope_begin(env);
    uint8_t *is_end = QW_NEW(env, uint8_t, n), *on_curve = QW_NEW(env, uint8_t, n),
            *rises = QW_NEW_ZERO(env, uint8_t, n);
    const qw_curve_ends *ends = qw_find_curve_ends(env, m, with_boundary);
    for (uint32_t v = 0; v < n; v++) on_curve[v] = ends[v].count != 0, is_end[v] = qw_curves_end_at(&ends[v]);
    float *to_curve = qw_distances(env, m, on_curve), *to_corner = qw_distances(env, m, is_end);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        float rise = STILL_RISING * qw_distance(m->position[a], m->position[b]);
        if (to_curve[b] > to_curve[a] + rise) rises[a] = 1;
        if (to_curve[a] > to_curve[b] + rise) rises[b] = 1;
    }
    for (uint32_t v = 0; v < n; v++)
        if (!rises[v] && !on_curve[v] && to_corner[v] > BESIDE_CORNER * to_curve[v])
            size[v] = fminf(size[v], 2 * to_curve[v] / BETWEEN);
    qw_scope_end(env);
}

/* ---- all together */

/* Sizes go as this power of 1 / curvature; docs/decisions/density.md has the others. */
static const double POWER = 0.36;
/* Besides the curvature itself, in mean curvatures: a plane has none. */
static const double FLAT = 0.05;
/* How much the edge length grows at most over its own length. */
static const double GRADATION = 0.25;

double qw_quads_of_size(const qw_trimesh *m, const float *size)
{
    double sum = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        double s = ((double)size[c[0]] + (double)size[c[1]] + (double)size[c[2]]) / 3;
        sum += 0.5 * (double)qw_length(qw_face_cross(m, f)) / (s * s);
    }
    return sum;
}

/* The edge that the shape asks for at each vertex, in mean edges: `even` up to a factor that the count decides, but at
   most `bound`. */
typedef struct shape_wish {
    float *even, *bound; /* float[vertex_count] */
} shape_wish;

static shape_wish wish_of_shape(qw_env *env, const qw_trimesh *m, const qw_density_wish *wish)
{
    assert(wish->edge > 0 && wish->strength > 0);
    uint32_t n = m->vertex_count;
    shape_wish w = {QW_NEW(env, float, n), QW_NEW(env, float, n)};
    qw_vec3 *normal = qw_vertex_normals(env, m);
    float *bend = qw_bend_at_scale(env, m, normal, wish->edge, wish->strength), edge = (float)wish->edge;
    double mean = mean_of(m, bend);
    for (uint32_t v = 0; v < n; v++) {
        double share = mean > 0 ? ((double)bend[v] / mean + FLAT) / (1 + FLAT) : 1;
        w.even[v] = (float)qw_pow(share, -POWER);
        w.bound[v] = edge * fminf(w.even[v], (float)MOST);
    }
    qw_fit_limbs(env, m, normal, bend, w.bound);
    qw_fit_between_curves(env, m, wish->with_boundary, w.bound);
    for (uint32_t v = 0; v < n; v++) {
        float bound = w.bound[v] / edge;
        w.bound[v] = bound < fminf(w.even[v], (float)MOST) ? fmaxf(bound, LEAST_LIMB) : INFINITY;
    }
    qw_free(env, bend), qw_free(env, normal);
    return w;
}

/* Sizes that depend on a factor, which the number of quads decides. */
typedef struct fitting {
    const qw_trimesh *mesh;
    const qw_density_wish *wish;
    const shape_wish *shape; /* sizes that the shape asks for; NULL: those of `before`, as painted */
    const float *before;     /* float[vertex_count], in mean edges; NULL: shape is there */
    float *size;             /* float[vertex_count], in mean edges: the result */
} fitting;

static double value_at(const fitting *f, double by, uint32_t v)
{
    if (!f->shape) return by * (double)f->before[v] / (double)f->wish->painted[v];
    double size = fmin(fmin(by * (double)f->shape->even[v], MOST), (double)f->shape->bound[v]);
    return qw_pow(fmax(size, LEAST), f->wish->strength);
}

/* Of less strength the factor still grows as of this one: it hardly changes a size then. */
static const double LEAST_STRENGTH = 0.1;

/* As many quads as with one size everywhere. Bounds and growth do not go with the factor, so it takes a few rounds. */
static void fit_count(qw_env *env, const fitting *f)
{
    uint32_t n = f->mesh->vertex_count;
    double quads = qw_trimesh_area(f->mesh), by = 1, fit = 1,
           power = f->shape ? 1 / fmax(f->wish->strength, LEAST_STRENGTH) : 1;
    for (int round = 0; round < FIT_ROUNDS; round++) {
        for (uint32_t v = 0; v < n; v++) f->size[v] = (float)(f->wish->edge * value_at(f, by, v));
        qw_limit_gradation(env, f->mesh, f->size, (float)GRADATION);
        for (uint32_t v = 0; v < n; v++) f->size[v] /= (float)f->wish->edge;
        fit = sqrt(qw_quads_of_size(f->mesh, f->size) / quads);
        by *= qw_pow(fit, power);
    }
    for (uint32_t v = 0; v < n; v++) f->size[v] *= (float)fit;
}

float *qw_size_factors(qw_env *env, const qw_trimesh *m, const qw_density_wish *wish)
{
    assert(wish->edge > 0 && wish->strength >= 0 && wish->strength <= 1);
    uint32_t n = m->vertex_count;
    float *size = QW_NEW(env, float, n);
    qw_scope_begin(env);
    for (uint32_t v = 0; v < n; v++) size[v] = 1;
    if (wish->strength > 0) {
        shape_wish shape = wish_of_shape(env, m, wish);
        fit_count(env, &(fitting){m, wish, &shape, NULL, size});
    }
    if (wish->painted) {
        float *before = QW_NEW(env, float, n);
        memcpy(before, size, n * sizeof *size);
        fit_count(env, &(fitting){m, wish, NULL, before, size});
    }
    qw_scope_end(env);
    return size;
}

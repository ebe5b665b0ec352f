#include "remesh/sizes/density.h"

#include "base/mechanisms.h"
#include "remesh/sizes/bends.h"
#include "remesh/sizes/scale.h"
#include "base/elementary.h"
#include "geometry/bvh.h"
#include "geometry/corners.h"

#include <assert.h>
#include <string.h>

enum {
    RAYS = 7,      /* one inward, six around it */
    FIT_ROUNDS = 6 /* the count is then met to a thousandth, most often */
};
/* Of edges, in mean edges, at strength 1. */
static const double LEAST = 0.2, MOST = 2.5;

/* ---- how the surface bends */

/* Curvatures are means over balls of three radii: near by, of so many mean edges; far around, of so many roots of the
   area; and of the geometric mean of both. Balls as large as a head or a hand say where there is much to see, those
   between tell a face from the skull. Wide ones are found on cells of a third of their radius. */
static const double NEAR = 1, FAR = 0.15;
/* In 1 / mean edges: keeps logarithms of curvatures from nothing; that of a plane. */
static const double FLAT = 0.02;

/* Means over the area in balls of some radius of what is given for each cell. value: float[cells->count], replaced. */
static void average(qw_env *env, const qw_cells *cells, const float *area, double radius, float *value)
{
    float(*sum)[2] = (float(*)[2])QW_NEW(env, float, (size_t)2 * cells->count);
    for (uint32_t c = 0; c < cells->count; c++) sum[c][0] = area[c], sum[c][1] = area[c] * value[c];
    qw_cells_spread(env, cells, sum[0], 2, qw_cells_rounds(cells, radius));
    for (uint32_t c = 0; c < cells->count; c++) value[c] = sum[c][0] > 0 ? sum[c][1] / sum[c][0] : 0;
    qw_free(env, sum);
}

/* The same in wide balls, found on coarser cells and smoothed so that these are not seen. */
static void average_widely(qw_env *env, const qw_cells *cells, const float *area, double radius, float *value)
{
    double width = radius / 3;
    if (width <= 2 * (double)cells->step) {
        average(env, cells, area, radius, value);
        return;
    }
    qw_scope_begin(env);
    qw_cells coarse = qw_cells_of_cells(env, cells, (float)width);
    float *wide = QW_NEW_ZERO(env, float, coarse.count), *whole = QW_NEW_ZERO(env, float, coarse.count);
    for (uint32_t c = 0; c < cells->count; c++)
        whole[coarse.of[c]] += area[c], wide[coarse.of[c]] += area[c] * value[c];
    for (uint32_t c = 0; c < coarse.count; c++) wide[c] = whole[c] > 0 ? wide[c] / whole[c] : 0;
    average(env, &coarse, whole, radius, wide);
    for (uint32_t c = 0; c < cells->count; c++) value[c] = wide[coarse.of[c]];
    average(env, cells, area, width / 2, value);
    qw_scope_end(env);
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
    const qw_vec3 *point, *normal;
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
            from = qw_madd(t->point[v], -LIFT * t->thickest, n);
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

/* Lowers the size where the surface is round, so that AROUND edges or so go around a limb. */
static void limb_block(void *user, uint32_t begin, uint32_t end)
{
    const limb_task *t = user;
    const float share = (float)QW_PI / AROUND;
    for (uint32_t v = begin; v < end; v++) {
        float round = 2 / t->bend[v]; /* the diameter of the circle with that curvature */
        if (!(share * round < t->size[v])) continue;
        float wide = fmaxf(thickness_at(t, v), round);
        t->size[v] = fminf(t->size[v], share * wide);
    }
}

void qw_fit_limbs(qw_env *env, const qw_bvh *tree, const qw_limb_points *at, float *size)
{
    assert(tree && at->point && at->normal && at->bend && size);
    float most = 0;
    for (uint32_t v = 0; v < at->count; v++) most = fmaxf(most, size[v]);
    limb_task t = {tree, at->point, at->normal, at->bend, most * AROUND / (float)QW_PI, size};
    qw_parallel(env, at->count, QW_GRAIN_HEAVY, limb_block, &t);
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
    bool has_curves = false;
    for (uint32_t v = 0; v < n; v++) {
        on_curve[v] = ends[v].count != 0, is_end[v] = qw_curves_end_at(&ends[v]);
        has_curves |= on_curve[v] != 0;
    }
    if (!has_curves) {
        qw_scope_end(env);
        return;
    }
    /* what is farther, by an edge at least, than the largest size changes none */
    float far = 0, longest = 0;
    for (uint32_t v = 0; v < n; v++) far = fmaxf(far, size[v]);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        longest = fmaxf(longest, qw_distance(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]]));
    far = 1.001f * (far + longest);
    float *to_curve = qw_distances(env, m, on_curve, far),
          *to_corner = qw_distances(env, m, is_end, BESIDE_CORNER * far);
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

/* Sizes go as these powers of 1 / curvature. Up to the strength NEAREST: of the bend near by, which brings the quads
   nearest to the surface. At strength 1, as people have them: of the bend and of the lesser curvature, which say how
   much there is to see, in the balls between and far around. */
enum { BEND_NEAR, BEND_BETWEEN, LESSER_BETWEEN, LESSER_FAR, POWERS };
static const double NEAREST_POWER[POWERS] = {0.36}, SEEN_POWER[POWERS] = {0.1, 0.15, 0.6, 0.35};
static const double NEAREST = 0.5;
/* How much the edge length grows at most over its own length: up to NEAREST, and at strength 1. People let it grow by
   a third to twice as much from one quad to the next where these are few, and with less a face gets no finer than its
   skull. */
static const double GRADATION[2] = {0.25, 0.45};
static const double FITS = 1e-3; /* a factor nearer to 1 than this is met */

/* How far the strength is from NEAREST to 1; 0 below. */
static double beyond_nearest(const qw_density_request *request)
{
    return fmax((request->strength - NEAREST) / (1 - NEAREST), 0);
}

static double gradation_of(const qw_density_request *request)
{
    return GRADATION[0] + (GRADATION[1] - GRADATION[0]) * beyond_nearest(request);
}

/* twice: float[m->face_count], the doubled areas, or NULL: to be found. */
static double quads_of_size(const qw_trimesh *m, const float *twice, const float *size)
{
    double sum = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * (size_t)f;
        double s = ((double)size[c[0]] + (double)size[c[1]] + (double)size[c[2]]) / 3;
        sum += 0.5 * (double)(twice ? twice[f] : qw_length(qw_face_cross(m, f))) / (s * s);
    }
    return sum;
}

double qw_quads_of_size(const qw_trimesh *m, const float *size) { return quads_of_size(m, NULL, size); }

/* The edge that the shape asks for in each cell, in mean edges: `even` up to a factor that the count decides, but at
   most `bound`. */
typedef struct shape_sizes {
    qw_cells cells;
    float *area, *even, *bound; /* float[cells.count] */
} shape_sizes;

/* What cells see of the shape, and what that asks for. */
typedef struct even_task {
    const qw_bends *sums;
    double edge, power;
    float *bend, *lesser, *mean; /* float[cells]: of the curvatures; what goes in with the power */
    qw_vec3 *normal;
    float *even;
} even_task;

/* Normal and curvatures of each cell, out of its tensor. */
static void look_at_cells(void *user, uint32_t begin, uint32_t end)
{
    const even_task *t = user;
    for (uint32_t c = begin; c < end; c++) {
        double k[2];
        t->normal[c] = qw_principal_curvatures(&t->sums[c], k);
        t->bend[c] = (float)sqrt(k[0] * k[0] + k[1] * k[1]);
        t->lesser[c] = (float)fmin(fabs(k[0]), fabs(k[1]));
        t->even[c] = 1;
    }
}

static void shrink_cells(void *user, uint32_t begin, uint32_t end)
{
    const even_task *t = user;
    for (uint32_t c = begin; c < end; c++) t->even[c] *= (float)qw_pow((double)t->mean[c] * t->edge + FLAT, -t->power);
}

/* Sets w->even, the edge that curvature asks for before any bound: a product of powers of means, in balls of POWERS
   radii, near to far, of both curvatures of the cells together and of the lesser one. At low strengths only what is
   near counts. bend: both curvatures of each cell, normal: where it faces; [cells.count] both, filled in. */
static void find_even(qw_env *env, const qw_trimesh *m, const qw_density_request *request, shape_sizes *w, float *bend,
                      qw_vec3 *normal)
{
    double edge = request->edge, far = FAR * sqrt(qw_trimesh_area(m)), seen = beyond_nearest(request);
    uint32_t n = w->cells.count;
    qw_bends *sums = qw_sum_bends(env, m, w->cells.of, w->cells.count);
    for (uint32_t c = 0; c < n; c++) w->area[c] = sums[c].area;
    qw_cells_spread(env, &w->cells, &sums->area, QW_BENDS, 1);
    float *lesser = QW_NEW(env, float, n), *mean = QW_NEW(env, float, n);
    even_task t = {sums, edge, 0, bend, lesser, mean, normal, w->even};
    qw_parallel(env, n, QW_GRAIN_HEAVY, look_at_cells, &t);
    const float *of[POWERS] = {bend, bend, lesser, lesser};
    double between = sqrt(NEAR * edge * far), radius[POWERS] = {NEAR * edge, between, between, far};
    for (int i = 0; i < POWERS; i++) {
        double power = NEAREST_POWER[i] + seen * (SEEN_POWER[i] - NEAREST_POWER[i]);
        if (power == 0 || !qw_uses(env, i == LESSER_FAR ? QW_MECH_DENSITY_FAR : QW_MECH_DENSITY_BETWEEN)) continue;
        if (i > 0) qw_did(env, i == LESSER_FAR ? QW_MECH_DENSITY_FAR : QW_MECH_DENSITY_BETWEEN, 1);
        memcpy(mean, of[i], n * sizeof *mean);
        average_widely(env, &w->cells, w->area, radius[i], mean);
        t.power = power * fmin(request->strength / NEAREST, 1);
        qw_parallel(env, n, QW_GRAIN_HEAVY, shrink_cells, &t);
    }
    qw_free(env, lesser), qw_free(env, mean), qw_free(env, sums);
}

/* Sizes are multiplied so that the mean of 1 / size^2 over the area is 1. */
static void scale_to_one(const shape_sizes *w, float *size)
{
    double sum = 0, area = 0;
    for (uint32_t c = 0; c < w->cells.count; c++)
        sum += (double)w->area[c] / ((double)size[c] * (double)size[c]), area += (double)w->area[c];
    float by = area > 0 ? (float)sqrt(sum / area) : 1;
    for (uint32_t c = 0; c < w->cells.count; c++) size[c] *= by;
}

/* Lowers w->bound where limbs ask for it: about once a quad, as it takes rays. bend, normal: [w->cells.count]. */
static void fit_limbs_of_cells(qw_env *env, const qw_bvh *tree, shape_sizes *w, float edge, const float *bend,
                               const qw_vec3 *normal)
{
    qw_scope_begin(env);
    qw_cells wide = qw_cells_of_cells(env, &w->cells, edge);
    float *size = QW_NEW(env, float, wide.count), *bends = QW_NEW(env, float, wide.count);
    qw_vec3 *up = QW_NEW(env, qw_vec3, wide.count);
    for (uint32_t c = 0; c < wide.count; c++)
        size[c] = w->bound[wide.start[c]], bends[c] = bend[wide.start[c]], up[c] = normal[wide.start[c]];
    qw_fit_limbs(env, tree, &(qw_limb_points){wide.count, wide.point, up, bends}, size);
    for (uint32_t c = 0; c < w->cells.count; c++)
        if (size[wide.of[c]] < w->bound[wide.start[wide.of[c]]]) w->bound[c] = fminf(w->bound[c], size[wide.of[c]]);
    qw_scope_end(env);
}

/* The sizes that the shape asks for by cells: even ones by curvature, and bounds by limbs and curves. */
static shape_sizes sizes_of_shape(qw_env *env, const qw_trimesh *m, const qw_density_request *request)
{
    assert(request->edge > 0 && request->strength > 0 && request->cells);
    float edge = (float)request->edge;
    shape_sizes w = {.cells = request->cells->cells};
    uint32_t n = w.cells.count;
    w.area = QW_NEW(env, float, n), w.even = QW_NEW(env, float, n), w.bound = QW_NEW(env, float, n);
    float *bend = QW_NEW(env, float, n);
    qw_vec3 *normal = QW_NEW(env, qw_vec3, n);
    find_even(env, &request->cells->mesh, request, &w, bend, normal);
    scale_to_one(&w, w.even);
    for (uint32_t c = 0; c < n; c++) w.bound[c] = edge * fminf(w.even[c], (float)MOST);
    fit_limbs_of_cells(env, request->tree ? request->tree : qw_bvh_build(env, m), &w, edge, bend, normal);
    float *size = QW_NEW(env, float, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) size[v] = w.bound[w.cells.of[v]];
    qw_fit_between_curves(env, m, request->with_boundary, size);
    for (uint32_t v = 0; v < m->vertex_count; v++) w.bound[w.cells.of[v]] = fminf(w.bound[w.cells.of[v]], size[v]);
    for (uint32_t c = 0; c < n; c++) {
        float bound = w.bound[c] / edge;
        w.bound[c] = bound < fminf(w.even[c], (float)MOST)
                         ? (float)qw_pow((double)fmaxf(bound, LEAST_LIMB), request->strength)
                         : INFINITY;
    }
    qw_free(env, bend), qw_free(env, normal), qw_free(env, size);
    return w;
}

/* Sizes of cells, in mean edges, with which as many quads cover them as with one size everywhere. Bounds and growth do
   not go with the factor, so it takes a few rounds. */
static void fit_cells(qw_env *env, const shape_sizes *w, const qw_density_request *request, float *size)
{
    double by = 1;
    for (int round = 0; round < FIT_ROUNDS; round++) {
        double sum = 0, area = 0;
        for (uint32_t c = 0; c < w->cells.count; c++) {
            double wanted = fmin(fmin(by * (double)w->even[c], MOST), (double)w->bound[c]);
            size[c] = (float)(request->edge * fmax(wanted, LEAST));
        }
        qw_cells_limit(env, &w->cells, size, (float)gradation_of(request));
        for (uint32_t c = 0; c < w->cells.count; c++) {
            size[c] /= (float)request->edge;
            sum += (double)w->area[c] / ((double)size[c] * (double)size[c]), area += (double)w->area[c];
        }
        double fit = area > 0 ? sqrt(sum / area) : 1;
        by *= fit;
        if (fabs(fit - 1) < FITS) break;
    }
}

/* The growth of sizes is bounded, and as many quads cover the surface as with one size. */
static void settle(qw_env *env, const qw_trimesh *m, const qw_density_request *request, float *size)
{
    double quads = qw_trimesh_area(m), edge = request->edge;
    float *twice = QW_NEW(env, float, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) twice[f] = qw_length(qw_face_cross(m, f));
    for (int round = 0; round < FIT_ROUNDS; round++) {
        for (uint32_t v = 0; v < m->vertex_count; v++) size[v] *= (float)edge;
        qw_limit_gradation(env, m, size, (float)(gradation_of(request) / (1 + FITS)));
        for (uint32_t v = 0; v < m->vertex_count; v++) size[v] /= (float)edge;
        double fit = sqrt(quads_of_size(m, twice, size) / quads);
        for (uint32_t v = 0; v < m->vertex_count; v++) size[v] *= (float)fit;
        if (fabs(fit - 1) < FITS) break;
    }
    qw_free(env, twice);
}

/* Sets size, float[m->vertex_count], to what the shape asks for. */
static void fit_shape(qw_env *env, const qw_trimesh *m, const qw_density_request *request, float *size)
{
    qw_scope_begin(env);
    shape_sizes w = sizes_of_shape(env, m, request);
    float *of_cell = QW_NEW(env, float, w.cells.count);
    fit_cells(env, &w, request, of_cell);
    qw_cells_interpolate(&w.cells, of_cell, (float)(gradation_of(request) / request->edge), m->position,
                         m->vertex_count, size);
    qw_scope_end(env);
    settle(env, m, request, size);
}

/* Multiplies sizes by 1 / painted density. Growth does not go with the factor, so the count takes a few rounds. */
static void fit_paint(qw_env *env, const qw_trimesh *m, const qw_density_request *request, float *size)
{
    float *before = QW_NEW(env, float, m->vertex_count);
    memcpy(before, size, m->vertex_count * sizeof *size);
    double quads = qw_trimesh_area(m), by = request->edge, fit = 1;
    for (int round = 0; round < FIT_ROUNDS; round++) {
        for (uint32_t v = 0; v < m->vertex_count; v++)
            size[v] = (float)(by * (double)before[v] / (double)request->painted[v]);
        qw_limit_gradation(env, m, size, (float)GRADATION[0]);
        for (uint32_t v = 0; v < m->vertex_count; v++) size[v] /= (float)request->edge;
        fit = sqrt(qw_quads_of_size(m, size) / quads);
        by *= fit;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) size[v] *= (float)fit;
    qw_free(env, before);
}

float *qw_size_factors(qw_env *env, const qw_trimesh *m, const qw_density_request *request)
{
    assert(request->edge > 0 && request->strength >= 0 && request->strength <= 1);
    float *size = QW_NEW(env, float, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) size[v] = 1;
    if (request->strength > 0) fit_shape(env, m, request, size);
    if (request->painted) fit_paint(env, m, request, size);
    return size;
}

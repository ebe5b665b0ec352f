/* Charts, flattening and packing: whatever the shape, no two points of the surface lie at one place of the texture, by
 * a second and slower way of telling, and charts keep their distance. */
#include "geometry/trimesh.h"
#include "products/atlas/atlas.h"
#include "products/atlas/blocks.h"
#include "products/atlas/charts.h"
#include "products/atlas/flat.h"
#include "products/atlas/mask.h"
#include "products/atlas/overlap.h"
#include "products/atlas/seen.h"
#include "quad_shapes.h"
#include "random.h"
#include "solve/envelope.h"
#include "suite.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void protect(void (*body)(void *user), void *user)
{
    qw_env *env = *(qw_env **)user = qw_env_create(NULL, 1);
    qw_status status = qw_protect(env, body, user);
    if (status != QW_OK) fail_msg("%s", qw_env_message(env));
    qw_env_destroy(env);
}

/* ---- the second way: every pair of triangles */

typedef struct corner3 {
    int64_t x[3], y[3];
} corner3;

static int64_t area2(const corner3 *t)
{
    return (t->x[1] - t->x[0]) * (t->y[2] - t->y[0]) - (t->y[1] - t->y[0]) * (t->x[2] - t->x[0]);
}

/* Whether an edge of a has all of b on its outer side, or on itself: then they share no inner point. */
static bool parts(const corner3 *a, const corner3 *b)
{
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3;
        bool all = true;
        for (int k = 0; k < 3; k++)
            all &= (a->x[j] - a->x[i]) * (b->y[k] - a->y[i]) - (a->y[j] - a->y[i]) * (b->x[k] - a->x[i]) <= 0;
        if (all) return true;
    }
    return false;
}

static uint32_t count_overlaps(const qw_atlas *atlas, uint32_t faces)
{
    uint32_t overlaps = 0, n = 2 * faces;
    corner3 *t = malloc(n * sizeof *t);
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++) {
            const int corner[2][3] = {{0, 1, 2}, {0, 2, 3}};
            const float *uv = atlas->uv + 2 * (4 * (size_t)(i / 2) + (size_t)corner[i % 2][k]);
            double x = (double)uv[0] * (1 << QW_UV_BITS), y = (double)uv[1] * (1 << QW_UV_BITS);
            assert_true(x == floor(x) && y == floor(y));
            t[i].x[k] = (int64_t)x, t[i].y[k] = (int64_t)y;
        }
    for (uint32_t i = 0; i < n; i++) {
        overlaps += area2(&t[i]) <= 0;
        for (uint32_t k = i + 1; k < n; k++) overlaps += !parts(&t[i], &t[k]) && !parts(&t[k], &t[i]);
    }
    free(t);
    return overlaps;
}

/* The least distance between corners of one chart and edges of others, and from all to the border of their tile. */
static double least_margin(const qw_atlas *a, uint32_t faces, double *border)
{
    double least = INFINITY;
    *border = INFINITY;
    for (uint32_t c = 0; c < 4 * faces; c++) {
        double x = (double)a->uv[2 * c], y = (double)a->uv[2 * c + 1], u = x - floor(x);
        *border = fmin(*border, fmin(fmin(u, 1 - u), fmin(y, 1 - y)));
        for (uint32_t d = 0; d < 4 * faces; d++) {
            if (a->chart[c / 4] == a->chart[d / 4]) continue;
            uint32_t e = d % 4 == 3 ? d - 3 : d + 1;
            double px = (double)a->uv[2 * d], py = (double)a->uv[2 * d + 1];
            double dx = (double)a->uv[2 * e] - px, dy = (double)a->uv[2 * e + 1] - py;
            double t = fmax(0, fmin(1, ((x - px) * dx + (y - py) * dy) / (dx * dx + dy * dy)));
            least = fmin(least, hypot(px + t * dx - x, py + t * dy - y));
        }
    }
    return least;
}

/* Mean of s1 / s2 and of the areas' ratio, by the metric of each triangle, not by singular values. */
static void measure_stretch(const qw_atlas *a, const quad_shape *s, double *angle, double *area)
{
    double sum = 0, scale = a->packing.scale;
    *angle = *area = 0;
    for (uint32_t i = 0; i < 2 * s->face_count; i++) {
        const uint32_t corner[2][3] = {{0, 1, 2}, {0, 2, 3}};
        double g[3] = {0}, h[3] = {0}; /* products of the two sides, in space and in the texture */
        const double *p[3];
        const float *q[3];
        for (int k = 0; k < 3; k++) {
            size_t c = 4 * (size_t)(i / 2) + corner[i % 2][k];
            p[k] = s->position + 3 * (size_t)s->corner[c], q[k] = a->uv + 2 * c;
        }
        for (int r = 0; r < 3; r++) {
            double u = p[1][r] - p[0][r], v = p[2][r] - p[0][r];
            g[0] += u * u, g[1] += u * v, g[2] += v * v;
        }
        for (int r = 0; r < 2; r++) {
            double u = (double)(q[1][r] - q[0][r]) / scale, v = (double)(q[2][r] - q[0][r]) / scale;
            h[0] += u * u, h[1] += u * v, h[2] += v * v;
        }
        double det = g[0] * g[2] - g[1] * g[1], flat = h[0] * h[2] - h[1] * h[1];
        double trace = (g[2] * h[0] - 2 * g[1] * h[1] + g[0] * h[2]) / det, ratio = sqrt(flat / det), w = sqrt(det);
        double s1 = sqrt((trace + sqrt(fmax(0, trace * trace - 4 * flat / det))) / 2), s2 = ratio / s1;
        *angle += w * s1 / s2, *area += w * fmax(ratio, 1 / ratio), sum += w;
    }
    *angle /= sum, *area /= sum;
}

/* ---- shapes */

typedef struct job {
    qw_env *env;
    quad_shape shape;
    uint32_t texels, margin, tiles, most_charts;
    double least_used;
} job;

static void unwrap(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const qw_atlas_options options = {.most_stretch = 1.15,
                                      .pack = {.texels = j->texels, .margin = j->margin, .tiles = j->tiles}};
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    double border, angle, area, margin = least_margin(&a, j->shape.face_count, &border);
    assert_int_equal(a.overlapping, 0);
    assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
    assert_true(margin >= (double)j->margin / j->texels);
    assert_true(border >= j->margin / 2.0 / j->texels);
    assert_true(a.charts >= 1 && a.charts <= j->most_charts);
    assert_true(a.packing.used >= j->least_used);
    measure_stretch(&a, &j->shape, &angle, &area);
    assert_float_equal(angle, a.angle, 2e-3);
    assert_float_equal(area, a.area, 2e-3);
    assert_true(angle < 1.2 && area < 1.2);
}

static void run(quad_shape shape, uint32_t most_charts, double least_used)
{
    job j = {
        .shape = shape, .texels = 512, .margin = 4, .tiles = 1, .most_charts = most_charts, .least_used = least_used};
    protect(unwrap, &j);
    quad_shape_free(&j.shape);
}

static void one_quad(void **state)
{
    (void)state;
    run(quad_sheet(1, 1, 0, 0, 0), 1, 0.6);
}
static void sheet(void **state)
{
    (void)state;
    run(quad_sheet(8, 6, 0, 0, 0), 12, 0.5);
}
static void ring(void **state)
{
    (void)state;
    run(quad_sheet(16, 5, 1, 0, 0), 12, 0.6);
}
static void closed_sphere(void **state)
{
    (void)state;
    run(quad_sphere(6), 12, 0.5);
}
static void torus(void **state)
{
    (void)state;
    run(quad_sheet(24, 12, 1, 1, 0), 16, 0.55);
}
static void moebius_strip(void **state)
{
    (void)state;
    run(quad_sheet(24, 4, 1, 0, 1), 24, 0.6);
}

/* Rows of quads down to a part of a step of the texture's grid in width, which meet: nothing crosses by rounding. */
static void slivers(void **state)
{
    (void)state;
    enum { N = 12 };
    for (uint64_t seed = 1; seed <= 12; seed++) {
        quad_shape s = quad_sheet(N, N, 0, 0, 0);
        double along[N + 1] = {0}, across[N + 1] = {0};
        uint64_t chance = seed;
        for (uint64_t i = 0; i < N; i++) {
            along[i + 1] = along[i] + (i % 3 == 1 ? (double)(1 + random_bits(&chance) % 9) * 1e-6 : 1);
            across[i + 1] = across[i] + (i % 4 == 2 ? (double)(1 + random_bits(&chance) % 9) * 1e-6 : 1);
        }
        for (uint32_t v = 0; v < s.vertex_count; v++) {
            double *p = s.position + 3 * (size_t)v, x = along[v % (N + 1)], y = across[v / (N + 1)];
            p[0] = x, p[1] = y, p[2] = 0.1 * sin(x);
        }
        run(s, 30, 0.3);
    }
}

/* A plane with holes lies flat as it is: one chart, and no seam from hole to hole. */
static void flat_with_holes(void *user)
{
    job *j = user;
    uint32_t kept = 0;
    for (uint32_t f = 0; f < j->shape.face_count; f++) {
        uint32_t x = f % 14, y = f / 14;
        if (x % 4 == 2 && (y % 5 == 2 || y % 5 == 3)) continue;
        memmove(j->shape.corner + 4 * (size_t)kept++, j->shape.corner + 4 * (size_t)f, 4 * sizeof *j->shape.corner);
    }
    assert_true(kept < j->shape.face_count);
    j->shape.face_count = kept;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const qw_atlas_options options = {.most_stretch = 1.15, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    assert_int_equal(a.charts, 1);
    assert_true(a.seam_length == 0);
    assert_int_equal(count_overlaps(&a, kept), 0);
}
static void holes_need_no_seams(void **state)
{
    (void)state;
    job j = {.shape = quad_sheet(14, 14, 0, 0, 0)};
    protect(flat_with_holes, &j);
    quad_shape_free(&j.shape);
}

/* On a symmetric surface every seam has one opposite to it. */
/* A square slit between two points, and a flap on the upper side of the slit that lies over what is below it: its rim
   is a second outline, and nothing crosses. The same points with a hole. */
static void flap_over_slit(void *user)
{
    qw_env *env = ((job *)user)->env;
    double at[7][2] = {{-3, -3}, {3, -3}, {3, 3}, {-3, 3}, {-1, 0}, {1, 0}, {0, -1}};
    uint32_t flap[] = {4, 5, 2, 4, 2, 3, 0, 4, 3, 1, 2, 5, 0, 1, 5, 0, 5, 4, 4, 6, 5};
    uint32_t hole[] = {4, 5, 2, 4, 2, 3, 0, 4, 3, 1, 2, 5, 0, 6, 4, 0, 1, 6, 1, 5, 6};
    uint32_t flap_rim[] = {0, 1, 2, 3, 4, 6, 5}, flap_to[] = {1, 2, 3, 0, 6, 5, 4};
    uint32_t hole_rim[] = {0, 1, 2, 3, 4, 5, 6}, hole_to[] = {1, 2, 3, 0, 5, 6, 4};
    qw_flat t = {.vertex_count = 7, .triangle_count = 7, .rim_count = 7, .loops = 2, .at = at};
    t.corner = flap, t.rim = flap_rim, t.rim_to = flap_to;
    assert_false(qw_flat_is_simple(env, &t, 0.125));
    t.corner = hole, t.rim = hole_rim, t.rim_to = hole_to;
    assert_true(qw_flat_is_simple(env, &t, 0.125));
}
static void one_outline_only(void **state)
{
    (void)state;
    job j = {0};
    protect(flap_over_slit, &j);
}

/* A sheet with a line of marked edges across: sharp edges stay seams, rings do not. */
static void unwrap_marked(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    uint8_t *mark = QW_NEW_ZERO(j->env, uint8_t, 4 * (size_t)j->shape.face_count);
    for (int ring = 0; ring < 2; ring++) {
        for (uint32_t c = 0; c < 4 * j->shape.face_count; c++) {
            const double *a = j->shape.position + 3 * (size_t)j->shape.corner[c],
                         *b = j->shape.position + 3 * (size_t)j->shape.corner[c / 4 * 4 + (c + 1) % 4];
            if (fabs(a[0] - 0.5) < 1e-9 && fabs(b[0] - 0.5) < 1e-9) mark[c] = ring ? QW_MARKS : QW_MARK_FEATURE;
        }
        qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, mark, 4 * j->shape.face_count, NULL);
        const qw_atlas_options options = {.most_stretch = 1.15, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
        assert_int_equal(qw_make_atlas(j->env, &mesh, &options).charts, ring ? 1 : 2);
    }
}
static void rings_are_no_seams(void **state)
{
    (void)state;
    job j = {.shape = quad_sheet(16, 16, 0, 0, 0)};
    protect(unwrap_marked, &j);
    quad_shape_free(&j.shape);
}

static void unwrap_mirrored(void *user)
{
    job *j = user;
    const double normal[3] = {1, 0, 0};
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    qw_atlas_options options = {.most_stretch = 1.15, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
    options.weight = qw_seam_weights(j->env, &mesh);
    const uint32_t *mirror = options.mirror = qw_mirrored_corners(j->env, &mesh, normal, 0);
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    assert_true(a.charts > 1 && a.charts <= j->most_charts);
    for (uint32_t c = 0; c < mesh.corner_count; c++) {
        assert_int_not_equal(mirror[c], QW_NONE);
        assert_int_equal(mirror[mirror[c]], c);
        assert_int_equal(mesh.seam[c], mesh.seam[mirror[c]]);
    }
}
static void mirrored_seams(void **state)
{
    (void)state;
    job j = {.shape = quad_sphere(8), .most_charts = 16};
    protect(unwrap_mirrored, &j);
    quad_shape_free(&j.shape);
}

/* Patches whose border costs less in another chart go there: else the first of these balls, which are open below, is
 * two charts and the second three. */
static void unwrap_open_ball(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    qw_atlas_options options = {.most_stretch = 1.25, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
    options.weight = qw_seam_weights(j->env, &mesh);
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    assert_true(a.charts <= j->most_charts);
    assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
}
static void patches_change_charts(void **state)
{
    (void)state;
    static const double below[] = {-0.2, -0.8};
    for (uint32_t i = 0; i < 2; i++) {
        job j = {.shape = quad_sphere(7), .most_charts = i + 1};
        uint32_t kept = 0;
        for (uint32_t f = 0; f < j.shape.face_count; f++) {
            const uint32_t *q = j.shape.corner + 4 * (size_t)f;
            double z = (j.shape.position[3 * (size_t)q[0] + 2] + j.shape.position[3 * (size_t)q[2] + 2]) / 2;
            if (z > below[i]) memmove(j.shape.corner + 4 * (size_t)kept++, q, 4 * sizeof *q);
        }
        j.shape.face_count = kept;
        protect(unwrap_open_ball, &j);
        quad_shape_free(&j.shape);
    }
}

/* In a groove the surface is less open than beside it. */
static void weigh_fold(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    uint32_t across = 9;
    for (uint32_t v = 0; v < j->shape.vertex_count; v++) {
        double *p = j->shape.position + 3 * (size_t)v;
        double x = (double)(v % across) - 4; /* a V along y, open upward */
        p[0] = 0.05 * x, p[1] = 0.05 * (v / across), p[2] = 0.1 * fabs(x);
    }
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const double *weight = qw_seam_weights(j->env, &mesh);
    double groove = 0, rim = 0;
    for (uint32_t c = 0; c < mesh.corner_count; c++) {
        uint32_t a = mesh.corner[c] % across, b = mesh.corner[qw_atlas_next(&mesh, c)] % across;
        if (a == 4 && b == 4) groove = fmax(groove, weight[c]);
        if (a == 1 && b == 1) rim = fmax(rim, weight[c]);
    }
    assert_true(groove > 0 && rim > 0);
    if (!(groove < 0.8 * rim)) fail_msg("groove %g, rim %g", groove, rim);
}
static void seams_in_grooves(void **state)
{
    (void)state;
    job j = {.shape = quad_sheet(8, 8, 0, 0, 0)};
    protect(weigh_fold, &j);
    quad_shape_free(&j.shape);
}

/* ---- blocks */

/* Every quad is a square of so many texels, at whole ones, and neighbours within a block lie side by side. */
static void lay_blocks(void *user)
{
    enum { PER_QUAD = 8 };
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const qw_block_options options = {.texels = j->texels, .tiles = j->tiles, .per_quad = PER_QUAD};
    qw_atlas a = qw_make_block_atlas(j->env, &mesh, &options);
    if (a.charts < 1 || a.charts > j->most_charts || a.packing.tiles > j->tiles)
        fail_msg("%u blocks in %u tiles", a.charts, a.packing.tiles);
    assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
    for (uint32_t c = 0; c < mesh.corner_count; c++) {
        const float *p = a.uv + 2 * (size_t)c, *q = a.uv + 2 * (size_t)qw_atlas_next(&mesh, c);
        double x = fabs((double)(q[0] - p[0])) * j->texels, y = fabs((double)(q[1] - p[1])) * j->texels;
        assert_true((x == PER_QUAD && y == 0) || (x == 0 && y == PER_QUAD));
        assert_true(fmod((double)p[0] * j->texels, PER_QUAD) == 0 && fmod((double)p[1] * j->texels, PER_QUAD) == 0);
        uint32_t t = mesh.twin[c];
        if (t == QW_NONE || mesh.seam[c]) continue;
        const float *r = a.uv + 2 * (size_t)qw_atlas_next(&mesh, t);
        assert_true(r[0] == p[0] && r[1] == p[1]);
    }
    double side = (double)PER_QUAD / j->texels;
    assert_float_equal(a.packing.used, j->shape.face_count * side * side / a.packing.tiles, 1e-9);
    assert_true(a.packing.used >= j->least_used);
}
static void run_blocks(quad_shape shape, uint32_t texels, uint32_t tiles, uint32_t most, double least_used)
{
    job j = {.shape = shape, .texels = texels, .tiles = tiles, .most_charts = most, .least_used = least_used};
    protect(lay_blocks, &j);
    quad_shape_free(&j.shape);
}
static void blocks_are_rectangles(void **state)
{
    (void)state;
    run_blocks(quad_sheet(1, 1, 0, 0, 0), 16, 1, 1, 0);
    run_blocks(quad_sheet(8, 6, 0, 0, 0), 64, 1, 1, 0.75);
    run_blocks(quad_sheet(16, 5, 1, 0, 0), 128, 1, 1, 0);
    run_blocks(quad_sheet(24, 12, 1, 1, 0), 256, 1, 4, 0);
    run_blocks(quad_sheet(24, 4, 1, 0, 1), 256, 1, 4, 0);
    run_blocks(quad_sphere(6), 128, 1, 24, 0.8);
    run_blocks(quad_sphere(8), 64, 6, 6, 1);
    run_blocks(quad_sheet(60, 40, 0, 0, 0), 128, 12, 240, 0.9);
}

static void refuse_blocks(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const qw_block_options options = {.texels = 32, .tiles = 1, .per_quad = 8};
    qw_make_block_atlas(j->env, &mesh, &options);
}
static void blocks_that_do_not_fit(void **state)
{
    (void)state;
    job j = {.shape = quad_sphere(4)};
    j.env = qw_env_create(NULL, 1);
    assert_int_equal(qw_protect(j.env, refuse_blocks, &j), QW_ARGUMENT);
    assert_non_null(strstr(qw_env_message(j.env), "8 texels a quad need"));
    qw_env_destroy(j.env);
    quad_shape_free(&j.shape);
}

/* ---- tiles */

static void fill_tiles(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    qw_atlas_options options = {.most_stretch = 1.15, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
    double one = qw_make_atlas(j->env, &mesh, &options).packing.scale;
    options.pack.tiles = 3;
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    assert_true(a.packing.tiles == 2 || a.packing.tiles == 3);
    assert_true(a.packing.scale > 1.3 * one); /* the root of 3 at best */
    assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
    double most = 0;
    for (uint32_t c = 0; c < 4 * j->shape.face_count; c++) most = fmax(most, (double)a.uv[2 * c]);
    assert_true(most > a.packing.tiles - 1 && most < a.packing.tiles);
}
static void several_tiles(void **state)
{
    (void)state;
    job j = {.shape = quad_sphere(6)};
    protect(fill_tiles, &j);
    quad_shape_free(&j.shape);
}

/* Two sheets of one size, one of four times as many quads: with focus both have as many texels a quad, else an area. */
static void focus_sheets(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    for (int focus = 0; focus <= 1; focus++) {
        qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
        const qw_atlas_options options = {
            .most_stretch = 1.15, .focus = focus, .pack = {.texels = 512, .margin = 4, .tiles = 1}};
        qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
        double area[2] = {0};
        for (uint32_t f = 0; f < j->shape.face_count; f++) {
            const float *p = a.uv + 8 * (size_t)f;
            for (int k = 0; k < 4; k++) {
                const float *q = p + 2 * k, *r = p + 2 * ((k + 1) % 4);
                area[f >= j->texels] += 0.5 * (double)(q[0] * r[1] - q[1] * r[0]);
            }
        }
        assert_int_equal(a.charts, 2);
        assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
        assert_float_equal(area[1] / area[0], focus ? 4 : 1, 0.02);
        assert_true(fabs(a.area - 1) < 1e-3); /* it is no stretch */
    }
}
static void texels_follow_quads(void **state)
{
    (void)state;
    quad_shape a = quad_sheet(6, 6, 0, 0, 0), b = quad_sheet(12, 12, 0, 0, 0), *s = &a;
    uint32_t vertices = a.vertex_count, faces = a.face_count;
    s->vertex_count += b.vertex_count, s->face_count += b.face_count;
    s->position = realloc(s->position, 3 * sizeof(double) * s->vertex_count);
    s->corner = realloc(s->corner, 4 * sizeof(uint32_t) * s->face_count);
    memcpy(s->position + 3 * vertices, b.position, 3 * sizeof(double) * b.vertex_count);
    for (uint32_t v = vertices; v < s->vertex_count; v++) s->position[3 * v + 2] += 1;
    for (uint32_t c = 0; c < 4 * b.face_count; c++) s->corner[4 * faces + c] = b.corner[c] + vertices;
    job j = {.shape = a, .texels = faces};
    protect(focus_sheets, &j);
    quad_shape_free(&b), quad_shape_free(&j.shape);
}

/* Where the size of texels is given charts are no longer than a tile, however long strips of the surface are. */
static void fit_density(void *user)
{
    job *j = user;
    qw_mesh_view view = quad_shape_view(&j->shape);
    qw_atlas_mesh mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    qw_atlas_options options = {.most_stretch = 1.35,
                                .pack = {.texels = 128, .margin = 4, .tiles = 2, .scale = 30.0 / 128}};
    qw_atlas a = qw_make_atlas(j->env, &mesh, &options);
    assert_true(a.packing.tiles == 2 && a.packing.scale == options.pack.scale);
    assert_int_equal(count_overlaps(&a, j->shape.face_count), 0);
}
static void charts_fit_tiles(void **state)
{
    (void)state;
    job j = {.shape = quad_sheet(24, 12, 1, 1, 0)};
    protect(fit_density, &j);
    quad_shape_free(&j.shape);
}

/* ---- the parts */

static void chance_segments(void *user)
{
    job *j = user;
    uint64_t random = 12;
    for (int round = 0; round < 400; round++) {
        qw_grid_point p[12];
        uint32_t from[6], to[6];
        bool meet = false;
        for (int i = 0; i < 12; i++)
            p[i] = (qw_grid_point){(int32_t)(random_bits(&random) % 40), (int32_t)(random_bits(&random) % 40)};
        for (uint32_t i = 0; i < 6; i++) from[i] = 2 * i, to[i] = 2 * i + 1;
        for (int a = 0; a < 6 && !meet; a++) /* in the plane of doubles, which hold these products */
            for (int b = a + 1; b < 6 && !meet; b++) {
                qw_grid_point A = p[2 * a], B = p[2 * a + 1], C = p[2 * b], D = p[2 * b + 1];
                double ux = B.x - A.x, uy = B.y - A.y, vx = D.x - C.x, vy = D.y - C.y, wx = C.x - A.x, wy = C.y - A.y;
                double det = ux * vy - uy * vx;
                if (det != 0) {
                    double s = (wx * vy - wy * vx) / det, t = (wx * uy - wy * ux) / det;
                    meet = s >= 0 && s <= 1 && t >= 0 && t <= 1;
                } else if (wx * uy - wy * ux == 0 && wx * vy - wy * vx == 0) { /* on one line, or points */
                    int lax = A.x < B.x ? A.x : B.x, hax = A.x < B.x ? B.x : A.x, lcx = C.x < D.x ? C.x : D.x,
                        hcx = C.x < D.x ? D.x : C.x, lay = A.y < B.y ? A.y : B.y, hay = A.y < B.y ? B.y : A.y,
                        lcy = C.y < D.y ? C.y : D.y, hcy = C.y < D.y ? D.y : C.y;
                    meet = lax <= hcx && lcx <= hax && lay <= hcy && lcy <= hay;
                }
            }
        assert_int_equal(qw_segments_meet(j->env, p, from, to, 6), meet);
    }
}
static void segments_that_meet(void **state)
{
    (void)state;
    job j = {0};
    protect(chance_segments, &j);
}

static void solve_grid(void *user)
{
    enum { SIDE = 9, N = SIDE * SIDE };
    job *j = user;
    uint32_t first[N + 1] = {0}, column[4 * N], held = 0;
    double want[N], x[N], a[N][N] = {{0}};
    for (uint32_t v = 0; v < N; v++) {
        if (v % SIDE) column[held++] = v - 1;
        if (v % SIDE < SIDE - 1) column[held++] = v + 1;
        if (v >= SIDE) column[held++] = v - SIDE;
        if (v + SIDE < N) column[held++] = v + SIDE;
        first[v + 1] = held;
    }
    qw_envelope e = qw_envelope_of(j->env, N, first, column);
    for (uint32_t v = 0; v < N; v++) {
        want[v] = (v * 37 % 11) - 5.0;
        for (uint32_t k = first[v]; k < first[v + 1]; k++) a[v][column[k]] = -1.0 - (v + column[k]) % 3;
    }
    for (uint32_t v = 0; v < N; v++) {
        for (uint32_t k = first[v]; k < first[v + 1]; k++) {
            a[v][v] -= a[v][column[k]];
            if (column[k] < v) qw_envelope_add(&e, v, column[k], a[v][column[k]]);
        }
        a[v][v] += 0.5;
        qw_envelope_add(&e, v, v, a[v][v]);
    }
    for (uint32_t v = 0; v < N; v++) {
        x[v] = 0;
        for (uint32_t w = 0; w < N; w++) x[v] += a[v][w] * want[w];
    }
    assert_true(qw_envelope_factor(&e));
    qw_envelope_solve(&e, x);
    for (uint32_t v = 0; v < N; v++) assert_float_equal(x[v], want[v], 1e-9);
}
static void envelope_solves(void **state)
{
    (void)state;
    job j = {0};
    protect(solve_grid, &j);
}

/* ---- places on a board, and by trying each */

static qw_mask random_mask(qw_env *env, uint32_t across, uint32_t down, uint64_t *seed)
{
    qw_mask m;
    qw_mask_size(&m, across, down);
    m.row = QW_NEW_ZERO(env, uint64_t, (size_t)m.words * m.down);
    for (uint32_t y = 0; y < down; y++)
        for (int i = 0; i < 2; i++) { /* rows of one run, or two with a gap */
            uint32_t a = (uint32_t)(random_bits(seed) % across), b = (uint32_t)(random_bits(seed) % across);
            qw_mask_fill(&m, y, a < b ? a : b, a < b ? b : a);
        }
    return m;
}

static void place_masks(void *user)
{
    enum { ACROSS = 203, ROWS = 120, MASKS = 60, MOST = 150 };
    job *j = user;
    uint64_t seed = 5;
    uint32_t placed = 0;
    qw_board board = qw_board_of(j->env, ACROSS, ROWS);
    qw_mask tile = random_mask(j->env, ACROSS, ROWS, &seed);
    memset(tile.row, 0, (size_t)tile.words * tile.down * sizeof *tile.row);
    for (int i = 0; i < MASKS; i++) {
        qw_mask m = random_mask(j->env, 1 + (uint32_t)(random_bits(&seed) % (MOST / (1 + (uint32_t)i / 4) + 1)),
                                1 + (uint32_t)(random_bits(&seed) % 30), &seed);
        uint32_t runs = qw_mask_runs(&m, NULL), x = QW_NONE, to = ACROSS - 3 - m.across;
        qw_mask_run *run = QW_NEW(j->env, qw_mask_run, runs);
        assert_int_equal(qw_mask_runs(&m, run), runs);
        for (uint32_t y = 0; y + m.down <= ROWS && x == QW_NONE; y++) {
            uint32_t want = 3;
            while (want <= to && qw_mask_meets(&tile, &m, want, y)) want++;
            x = qw_board_place(&board, run, runs, 3, to, y);
            assert_int_equal(x, want <= to ? want : QW_NONE);
            if (x == QW_NONE) continue;
            qw_mask_stamp(&tile, &m, x, y, true);
            qw_board_stamp(&board, &m, x, y, 1 + MOST / (1 + ((uint32_t)i + 1) / 4)); /* masks become narrower */
            placed++;
        }
    }
    assert_true(placed > MASKS / 2);
    qw_board_clear(&board);
    const qw_mask_run one = {.row = 1, .first = 0, .length = 200};
    assert_int_equal(qw_board_place(&board, &one, 1, 1, 3, 0), 1);
}
static void places_on_a_board(void **state)
{
    (void)state;
    job j = {0};
    protect(place_masks, &j);
}

enum { MANY = 20000 };

/* Charts whose margins alone fill the texture. */
static void pack_many(void *user)
{
    job *j = user;
    static const double at[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    static const uint32_t corner[] = {0, 1, 2};
    qw_piece *piece = QW_NEW(j->env, qw_piece, MANY);
    for (uint32_t i = 0; i < MANY; i++)
        piece[i] = (qw_piece){.at = at, .point_count = 3, .triangle_count = 1, .corner = corner};
    qw_pack(j->env, piece, MANY, &(qw_pack_options){.texels = 512, .margin = 4, .tiles = 1});
}
static void no_room_for_margins(void **state)
{
    (void)state;
    job j = {.env = qw_env_create(NULL, 1)};
    assert_int_equal(qw_protect(j.env, pack_many, &j), QW_ARGUMENT);
    assert_non_null(strstr(qw_env_message(j.env), "20000 charts with a margin of 4 texels have no room"));
    qw_env_destroy(j.env);
}

QW_TEST_SUITE(atlas)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_quad),
        cmocka_unit_test(sheet),
        cmocka_unit_test(ring),
        cmocka_unit_test(closed_sphere),
        cmocka_unit_test(torus),
        cmocka_unit_test(moebius_strip),
        cmocka_unit_test(slivers),
        cmocka_unit_test(holes_need_no_seams),
        cmocka_unit_test(rings_are_no_seams),
        cmocka_unit_test(mirrored_seams),
        cmocka_unit_test(patches_change_charts),
        cmocka_unit_test(one_outline_only),
        cmocka_unit_test(seams_in_grooves),
        cmocka_unit_test(blocks_are_rectangles),
        cmocka_unit_test(blocks_that_do_not_fit),
        cmocka_unit_test(several_tiles),
        cmocka_unit_test(charts_fit_tiles),
        cmocka_unit_test(texels_follow_quads),
        cmocka_unit_test(places_on_a_board),
        cmocka_unit_test(envelope_solves),
        cmocka_unit_test(segments_that_meet),
        cmocka_unit_test(no_room_for_margins),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Sizes from the shape and from paint: what each part asks for on surfaces where that is known, bounded growth, and
 * whole runs. */
#include "suite.h"

#include "shapes.h"
#include "unit_shapes.h"

#include "remesh/sizes/cells.h"
#include "geometry/long_edges.h"
#include "remesh/sizes/around.h"
#include "remesh/sizes/density.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static double quads_with(const qw_trimesh *m, const float *factor, double edge)
{
    double sum = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corner + 3 * f;
        double s = edge * (double)(factor[c[0]] + factor[c[1]] + factor[c[2]]) / 3;
        sum += 0.5 * (double)qw_length(qw_face_cross(m, f)) / (s * s);
    }
    return sum;
}

/* The certificate of bounded gradation: no edge along which sizes grow by more than this share of its length. Returns
   the largest share. */
static double assert_graded(const qw_trimesh *m, const float *factor, double edge, double most)
{
    double largest = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
        double length = (double)qw_distance(m->position[a], m->position[b]);
        double growth = edge * fabs((double)factor[a] - (double)factor[b]);
        assert_true(growth <= most * 1.0004 * length + 1e-6);
        largest = fmax(largest, growth / length);
    }
    return largest;
}

static void sizes_are_graded_and_keep_the_count(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {7};
    qw_trimesh meshes[] = {unit_torus(env, 90, 40, 0.4f), unit_cube(env, 5), unit_grid(env, 30, 30, false, false),
                           unit_sphere(env, 5), unit_double_torus(env, 3)};
    double steepest = 0;
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < 4; k++) {
            const qw_trimesh *m = &meshes[i];
            double edge = sqrt(qw_trimesh_area(m) / 1000);
            qw_density *painted = QW_NEW(env, qw_density, m->vertex_count);
            for (uint32_t v = 0; v < m->vertex_count; v++)
                painted[v] = m->position[v].x > 0.2f ? 6 : 1.5f + unit_real(&r);
            qw_surface_cells cells = qw_cells_of_surface(env, m, edge);
            qw_density_request request = {edge, k / 3.0, k % 2 ? NULL : painted, true, &cells, NULL};
            float *factor = qw_size_factors(env, m, &request);
            /* a quarter of the length; beyond the strength that is best for distances more, but not on paint */
            steepest = fmax(steepest, assert_graded(m, factor, edge, k == 3 ? 0.45 : 0.25));
            assert_true(fabs(quads_with(m, factor, edge) / 1000 - 1) < 0.02);
        }
    assert_true(steepest > 0.3);
    qw_env_destroy(env);
}

/* Far from the border of the paint, sizes are as the densities say, whatever these are multiplied by. */
static void paint_is_a_ratio(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_sphere(env, 6);
    qw_density *painted = QW_NEW(env, qw_density, m.vertex_count);
    for (int unit = 0; unit < 2; unit++) {
        for (uint32_t v = 0; v < m.vertex_count; v++)
            painted[v] = (m.position[v].z > 0.8f ? 8.0f : 1.0f) * (unit ? 20 : 1);
        qw_density_request request = {0.05, 0, painted, true, NULL, NULL};
        float *factor = qw_size_factors(env, &m, &request), least = INFINITY, most = 0;
        for (uint32_t v = 0; v < m.vertex_count; v++) least = fminf(least, factor[v]), most = fmaxf(most, factor[v]);
        assert_true(fabsf(most / least - 8) < 1e-3f);
        for (uint32_t v = 0; v < m.vertex_count; v++)
            if (m.position[v].z > 0.8f) assert_true(factor[v] < 1.001f * least);
    }
    qw_env_destroy(env);
}

/* Cells are connected, cover the surface, touch one another both ways and are as far apart as is asked for, on fine and
 * on coarse triangles. */
static void cells_cover_the_surface(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh meshes[] = {unit_sphere(env, 6), unit_torus(env, 90, 40, 0.4f), unit_grid(env, 60, 60, false, false)};
    for (int i = 0; i < 3; i++) {
        const qw_trimesh *m = &meshes[i];
        float width = sqrtf((float)qw_trimesh_area(m) / 200);
        qw_cells c = qw_cells_of_mesh(env, m, width);
        assert_true(c.count > 120 && c.count < 350 && fabsf(c.step / width - 1) < 0.25f);
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            assert_true(c.of[v] < c.count);
            assert_true(qw_distance(m->position[v], c.point[c.of[v]]) < 1.5f * width);
        }
        for (uint32_t a = 0; a < c.count; a++) {
            assert_int_equal(c.of[c.start[a]], a);
            for (uint32_t k = c.begin[a]; k < c.begin[a + 1]; k++) {
                uint32_t b = c.neighbour[k], back = c.begin[b];
                while (back < c.begin[b + 1] && c.neighbour[back] != a) back++;
                assert_true(b != a && back < c.begin[b + 1]);
            }
        }
    }
    qw_env_destroy(env);
}

/* Sums keep their total and become even; limits are met by the largest values that meet them. */
static void cells_spread_and_limit(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_sphere(env, 5);
    qw_cells c = qw_cells_of_mesh(env, &m, 0.2f);
    float *sum = QW_NEW_ZERO(env, float, 2 * (size_t)c.count), *value = QW_NEW(env, float, c.count), total = 0;
    sum[1] = 1;
    qw_cells_spread(env, &c, sum, 2, 200);
    for (uint32_t a = 0; a < c.count; a++) {
        assert_true(sum[2 * a] == 0 && sum[2 * a + 1] > 0.2f / (float)c.count);
        total += sum[2 * a + 1];
        value[a] = a == 7 ? 0.1f : 5;
    }
    assert_true(fabsf(total - 1) < 1e-3f);
    qw_cells_limit(env, &c, value, 0.25f);
    for (uint32_t a = 0; a < c.count; a++) {
        float most = a == 7 ? 0.1f : 5;
        for (uint32_t k = c.begin[a]; k < c.begin[a + 1]; k++)
            most = fminf(most, value[c.neighbour[k]] + 0.25f * qw_distance(c.point[a], c.point[c.neighbour[k]]));
        assert_true(fabsf(value[a] - most) < 1e-5f);
    }
    qw_env_destroy(env);
}

/* A cube of twelve triangles is cut so that no edge is long; its vertices keep their numbers. */
static void long_edges_are_cut(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh cube = unit_cube(env, 1), cut = qw_without_long_edges(env, &cube, 0.1f, 100000);
    qw_trimesh_validate(env, &cut);
    assert_true(fabs(qw_trimesh_area(&cut) / qw_trimesh_area(&cube) - 1) < 1e-5);
    for (uint32_t h = 0; h < 3 * cut.face_count; h++) assert_true(qw_edge_length(&cut, h) <= 0.1f);
    for (uint32_t v = 0; v < cube.vertex_count; v++)
        assert_memory_equal(&cut.position[v], &cube.position[v], sizeof *cube.position);
    qw_trimesh same = qw_without_long_edges(env, &cube, 0.1f, 20);
    assert_int_equal(same.face_count, cube.face_count);
    qw_trimesh rod = unit_cylinder(env, 7, 5, 12), plate = unit_fan(env, 9);
    for (float longest = 0.05f; longest < 8; longest *= 1.3f) { /* all the ways in which a triangle is parted */
        qw_trimesh of_rod = qw_without_long_edges(env, &rod, longest, 1000000),
                   of_plate = qw_without_long_edges(env, &plate, longest, 1000000);
        qw_trimesh_validate(env, &of_rod), qw_trimesh_validate(env, &of_plate);
        for (uint32_t h = 0; h < 3 * of_rod.face_count; h++) assert_true(qw_edge_length(&of_rod, h) <= longest);
        for (uint32_t h = 0; h < 3 * of_plate.face_count; h++) assert_true(qw_edge_length(&of_plate, h) <= longest);
    }
    qw_env_destroy(env);
}

/* Six quads around a rod; none of that on a plate, which is as thin. */
static void limbs_get_six_quads_around(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh rod = unit_cylinder(env, 48, 60, 12), plate = unit_slab(env, 3, 3, "#########");
    for (int i = 0; i < 4; i++) plate = unit_quarter(env, &plate);
    for (uint32_t v = 0; v < plate.vertex_count; v++) plate.position[v].z *= 0.1f;
    const qw_trimesh *meshes[] = {&rod, &plate};
    for (int i = 0; i < 2; i++) {
        const qw_trimesh *m = meshes[i];
        qw_vec3 *normal = qw_vertex_normals(env, m);
        float *size = QW_NEW(env, float, m->vertex_count), *bend = QW_NEW(env, float, m->vertex_count);
        for (uint32_t v = 0; v < m->vertex_count; v++) size[v] = 2, bend[v] = i == 0;
        qw_fit_limbs(env, qw_bvh_build(env, m), &(qw_limb_points){m->vertex_count, m->position, normal, bend}, size);
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            qw_vec3 p = m->position[v];
            if (i == 0 && fabsf(p.z - 6) < 4) assert_true(fabs(2 * 3.14159265 / (double)size[v] - 6) < 0.6);
            if (i == 1 && fabsf(p.x - 1.5f) < 0.7f && fabsf(p.y - 1.5f) < 0.7f) assert_true(size[v] == 2);
        }
    }
    qw_env_destroy(env);
}

/* The radius of a round, of fine triangles and of long facets whose edges are cut afterwards, and sizes that turn by a
   tenth of a circle on it and make as many quads. */
static void circles_are_found(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    const uint32_t rows[] = {60, 1};
    for (int i = 0; i < 2; i++) {
        qw_trimesh rod = unit_cylinder(env, 36, rows[i], 12), cut = qw_without_long_edges(env, &rod, 0.4f, 1 << 20);
        float *bend = qw_find_circles(env, &rod, &cut, 0.5, true), *size = QW_NEW(env, float, cut.vertex_count);
        uint32_t inside = 0;
        for (uint32_t v = 0; v < cut.vertex_count; v++) {
            if (fabsf(cut.position[v].z - 6) < 4 && bend[v] > 0) {
                inside++;
                assert_true(fabsf(bend[v] - 1) < 0.02f);
            }
            size[v] = 1;
        }
        assert_true(inside >= 36);
        double quads = qw_quads_of_size(&cut, size);
        for (uint32_t v = 0; v < cut.vertex_count; v++)
            if (cut.position[v].z > 2) bend[v] = 0; /* there is room */
        qw_fit_around(env, &cut, bend, 0.6, size);
        assert_true(fabs(qw_quads_of_size(&cut, size) / quads - 1) < 0.01);
        for (uint32_t v = 0; v < cut.vertex_count; v++)
            assert_true(cut.position[v].z > 2 || !(bend[v] > 0) || size[v] <= 0.61f);
    }
    qw_env_destroy(env);
}

/* Two marked lines a tenth apart, and two that meet at a right angle. */
static void curves_side_by_side_keep_room(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (int meet = 0; meet < 2; meet++) {
        qw_trimesh m = unit_grid(env, 40, 40, false, false);
        m.mark = QW_NEW_ZERO(env, uint8_t, 3 * m.face_count);
        for (uint32_t h = 0; h < 3 * m.face_count; h++) {
            qw_vec3 a = m.position[m.corner[h]], b = m.position[m.corner[qw_next(h)]];
            bool low = fabsf(a.y - 0.5f) + fabsf(b.y - 0.5f) < 1e-3f,
                 high = meet ? fabsf(a.x - 0.5f) + fabsf(b.x - 0.5f) < 1e-3f
                             : fabsf(a.y - 0.6f) + fabsf(b.y - 0.6f) < 1e-3f;
            m.mark[h] = low || high ? QW_MARK_FEATURE : 0;
        }
        float *size = QW_NEW(env, float, m.vertex_count), least = 1;
        for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = 1;
        qw_fit_between_curves(env, &m, false, size);
        for (uint32_t v = 0; v < m.vertex_count; v++) least = fminf(least, size[v]);
        if (meet) assert_true(least == 1);
        else assert_true(fabsf(least - 0.05f) < 0.01f);
    }
    qw_env_destroy(env);
}

/* ---- whole runs */

typedef struct run_result {
    double *vertex; /* double[vertices][3] */
    uint32_t *quad, vertices, quads;
    qw_report report;
} run_result;

/* The result of a context, which is destroyed. */
static run_result take_result(qw_context *context)
{
    qw_mesh_view quads;
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    run_result r = {.vertices = quads.vertex_count, .quads = quads.face_count, .report = *qw_get_report(context)};
    r.vertex = malloc(3 * (size_t)r.vertices * sizeof *r.vertex), r.quad = malloc(4 * (size_t)r.quads * sizeof *r.quad);
    memcpy(r.vertex, quads.positions, 3 * (size_t)r.vertices * sizeof *r.vertex);
    memcpy(r.quad, quads.corners, 4 * (size_t)r.quads * sizeof *r.quad);
    qw_destroy(context);
    return r;
}

static qw_context *painted_context(const shape *s, const qw_density *density)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    if (density) assert_int_equal(qw_set_density(context, density, view.vertex_count), QW_OK);
    return context;
}

static qw_options options_of(int64_t faces, double adaptive)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces, options.adaptive = adaptive;
    return options;
}

static run_result run_with(const shape *s, int64_t faces, double adaptive, const qw_density *density)
{
    qw_context *context = painted_context(s, density);
    qw_options options = options_of(faces, adaptive);
    assert_int_equal(qw_run(context, &options), QW_OK);
    return take_result(context);
}

static void free_run(run_result *r) { free(r->vertex), free(r->quad); }

static bool are_same(const run_result *a, const run_result *b)
{
    return a->vertices == b->vertices && a->quads == b->quads &&
           memcmp(a->vertex, b->vertex, 3 * (size_t)a->vertices * sizeof *a->vertex) == 0 &&
           memcmp(a->quad, b->quad, 4 * (size_t)a->quads * sizeof *a->quad) == 0;
}

/* The mean edge of the quads whose centre has a height (z) between two. */
static double mean_edge_between(const run_result *r, double low, double high)
{
    double sum = 0, count = 0;
    for (uint32_t f = 0; f < r->quads; f++) {
        const uint32_t *c = r->quad + 4 * (size_t)f;
        double z = 0, length = 0;
        for (int i = 0; i < 4; i++) {
            const double *a = r->vertex + 3 * (size_t)c[i], *b = r->vertex + 3 * (size_t)c[(i + 1) % 4];
            z += a[2] / 4;
            length +=
                sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2])) / 4;
        }
        if (z >= low && z <= high) sum += length, count++;
    }
    assert_true(count > 20);
    return sum / count;
}

/* Edges are as many times smaller as is painted, within 15 %, and the count is the one asked for. */
static void painted_edges_are_as_small(void **state)
{
    (void)state;
    shape s = shape_sphere(32);
    double top = 0;
    for (uint32_t v = 0; v < s.vertex_count; v++) top = fmax(top, s.position[3 * v + 2]);
    qw_density *density = malloc(s.vertex_count * sizeof *density);
    for (int painted = 2; painted <= 8; painted *= 2) {
        for (uint32_t v = 0; v < s.vertex_count; v++)
            density[v] = s.position[3 * v + 2] > 0.8 * top ? (float)painted : 1.0f;
        run_result r = run_with(&s, 6000, 0, density);
        double ratio = mean_edge_between(&r, -top, 0) / mean_edge_between(&r, 0.86 * top, top);
        assert_true(fabs(ratio / painted - 1) < 0.15);
        assert_true(fabs(r.quads / 6000.0 - 1) < 0.02);
        assert_true(r.report.size_cv < 0.3 && r.report.area_cv > 1.5 * r.report.size_cv);
        free_run(&r);
    }
    free(density);
    shape_free(&s);
}

/* Only ratios count: one density everywhere is none. */
static void one_density_is_none(void **state)
{
    (void)state;
    shape s = shape_hand(6);
    qw_density *density = malloc(s.vertex_count * sizeof *density);
    for (uint32_t v = 0; v < s.vertex_count; v++) density[v] = 3;
    run_result none = run_with(&s, 900, 0, NULL), one = run_with(&s, 900, 0, density);
    assert_true(are_same(&none, &one));
    for (uint32_t v = 0; v < s.vertex_count; v++) density[v] = 1 + (float)(v % 2);
    run_result other = run_with(&s, 900, 0, density);
    assert_false(are_same(&none, &other));
    free_run(&none), free_run(&one), free_run(&other);
    free(density);
    shape_free(&s);
}

static void densities_are_checked(void **state)
{
    (void)state;
    shape s = shape_sphere(6);
    qw_mesh_view view = shape_view(&s);
    qw_context *context;
    qw_density *density = malloc(s.vertex_count * sizeof *density);
    for (uint32_t v = 0; v < s.vertex_count; v++) density[v] = 1;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_density(NULL, density, s.vertex_count), QW_ARGUMENT);
    assert_int_equal(qw_set_density(context, density, s.vertex_count), QW_NOT_READY);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_set_density(context, density, s.vertex_count - 1), QW_ARGUMENT);
    assert_int_equal(qw_set_density(context, NULL, 5), QW_ARGUMENT);
    static const float wrong[] = {0, -1, NAN, INFINITY, 1e4f};
    for (int i = 0; i < 5; i++) {
        density[7] = wrong[i];
        assert_int_equal(qw_set_density(context, density, s.vertex_count), QW_ARGUMENT);
        assert_non_null(strstr(qw_message(context), "vertex 7"));
    }
    density[7] = 4;
    qw_options options = options_of(300, 0);
    assert_int_equal(qw_run(context, &options), QW_OK); /* with none: all were refused */
    assert_int_equal(qw_set_density(context, density, s.vertex_count), QW_OK);
    qw_mesh_view quads;
    assert_int_equal(qw_get_mesh(context, &quads), QW_NOT_READY);
    assert_int_equal(qw_run(context, &options), QW_OK);
    assert_int_equal(qw_set_density(context, NULL, 0), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_OK);
    run_result none = run_with(&s, 300, 0, NULL);
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    assert_int_equal(quads.face_count, none.quads);
    assert_memory_equal(quads.positions, none.vertex, 3 * (size_t)none.vertices * sizeof *none.vertex);
    free_run(&none);
    qw_destroy(context);
    free(density);
    shape_free(&s);
}

/* The bytes are the same with any number of threads, and from a dump; other options after a run give those of a fresh
   one. */
static void runs_with_density_are_one(void **state)
{
    (void)state;
    static const char *path = "test-density.dump";
    shape s = shape_hand(8);
    qw_density *density = malloc(s.vertex_count * sizeof *density);
    for (uint32_t v = 0; v < s.vertex_count; v++) density[v] = s.position[3 * v + 1] > 0.5 ? 2 : 1;
    qw_options options = options_of(700, 0.8);
    run_result want = run_with(&s, 700, 0.8, density);
    for (int threads = 1; threads <= 3; threads += 2) {
        qw_context *context = painted_context(&s, density), *resumed;
        options.threads = threads;
        assert_int_equal(qw_run_until(context, &options, threads == 1 ? QW_STAGE_CLEAN : QW_STAGE_SCALE), QW_OK);
        assert_int_equal(qw_dump(context, path), QW_OK);
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        assert_int_equal(qw_resume(resumed, path), QW_OK);
        assert_int_equal(qw_run(resumed, &options), QW_OK);
        run_result got = take_result(resumed);
        assert_true(are_same(&want, &got));
        free_run(&got);
        qw_options other = options_of(400, 0);
        assert_int_equal(qw_run(context, &other), QW_OK);
        assert_int_equal(qw_run(context, &options), QW_OK);
        got = take_result(context);
        assert_true(are_same(&want, &got));
        free_run(&got);
    }
    remove(path);
    free_run(&want);
    free(density);
    shape_free(&s);
}

/* Fingers are followed more closely with as many quads. */
static void detail_gets_the_quads(void **state)
{
    (void)state;
    shape s = shape_hand(10);
    shape_smooth(&s, 12);
    qw_mesh_view view = shape_view(&s);
    double far[2];
    for (int adaptive = 0; adaptive < 2; adaptive++) {
        run_result r = run_with(&s, 800, adaptive, NULL);
        qw_mesh_view quads = {.size = sizeof quads,
                              .vertex_count = r.vertices,
                              .face_count = r.quads,
                              .uniform_face_size = 4,
                              .positions = r.vertex,
                              .corners = r.quad};
        qw_topology topology;
        qw_quality quality;
        assert_int_equal(qw_measure(&quads, &view, NULL, &topology, &quality), QW_OK);
        far[adaptive] = quality.chamfer * quality.mean_edge;
        assert_true(fabs(r.quads / 800.0 - 1) < 0.02);
        free_run(&r);
    }
    assert_true(far[1] < 0.97 * far[0]);
    shape_free(&s);
}

QW_TEST_SUITE(density)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sizes_are_graded_and_keep_the_count),
        cmocka_unit_test(paint_is_a_ratio),
        cmocka_unit_test(cells_cover_the_surface),
        cmocka_unit_test(cells_spread_and_limit),
        cmocka_unit_test(long_edges_are_cut),
        cmocka_unit_test(limbs_get_six_quads_around),
        cmocka_unit_test(circles_are_found),
        cmocka_unit_test(curves_side_by_side_keep_room),
        cmocka_unit_test(painted_edges_are_as_small),
        cmocka_unit_test(one_density_is_none),
        cmocka_unit_test(densities_are_checked),
        cmocka_unit_test(runs_with_density_are_one),
        cmocka_unit_test(detail_gets_the_quads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Designed parts: their planes, cylinders and cones are found, and the vertices of the quads lie on them. */
#include "suite.h"

#include "parts.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

enum { QUADS = 500 };

static const double PI = 3.14159265358979323846;

typedef struct counts {
    int64_t planes, cylinders, cones, spheres, tori;
} counts;

static qw_result *remeshed(const qw_mesh_view *view, int64_t faces, bool exact)
{
    qw_result *result;
    qw_options o;
    qw_options_init(&o);
    o.faces = faces, o.threads = 2, o.exact = exact;
    if (qw_remesh(view, &o, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    return result;
}

static double diagonal_of(const qw_mesh_view *m)
{
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, sum = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], m->positions[3 * v + (uint32_t)k]);
            high[k] = fmax(high[k], m->positions[3 * v + (uint32_t)k]);
        }
    for (int k = 0; k < 3; k++) sum += (high[k] - low[k]) * (high[k] - low[k]);
    return sqrt(sum);
}

/* The largest distance of a vertex from the part's true sides, in diagonals. */
static double farthest(const part *p, const qw_result *result)
{
    qw_mesh_view m = qw_result_mesh(result);
    double most = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++) most = fmax(most, part_distance(p, m.positions + 3 * (size_t)v));
    return most / diagonal_of(&m);
}

static void expect_exact(part *p, counts found, bool has_rounds)
{
    qw_mesh_view view = part_view(p);
    qw_result *with = remeshed(&view, QUADS, true), *without = remeshed(&view, QUADS, false);
    const qw_report *r = qw_result_report(with);
    assert_int_equal(r->exact_planes, found.planes);
    assert_int_equal(r->exact_cylinders, found.cylinders);
    assert_int_equal(r->exact_cones, found.cones);
    assert_int_equal(r->exact_spheres, found.spheres);
    assert_int_equal(r->exact_tori, found.tori);
    assert_true(farthest(p, with) < 1e-6);
    assert_true(!has_rounds || farthest(p, without) > 1e-4); /* on the triangles, or off them */
    assert_true(r->topology.euler == r->euler && r->topology.degenerate_faces == 0);
    qw_result_destroy(with), qw_result_destroy(without);
    free(p);
}

static void turned_parts(void **state)
{
    (void)state;
    const double pipe[4][2] = {{16, 0}, {20, 0}, {20, 60}, {16, 60}}, cone[4][2] = {{6, 0}, {30, 0}, {12, 50}, {6, 50}},
                 flange[8][2] = {{14, 0}, {40, 0}, {40, 10}, {22, 10}, {22, 40}, {18, 40}, {18, 30}, {14, 30}},
                 thread[9][2] = {{4, 0}, {10, 0}, {12, 3}, {10, 6}, {12, 9}, {10, 12}, {12, 15}, {10, 18}, {4, 18}},
                 shaft[6][2] = {{3, 0}, {10, 0}, {12, 2}, {12, 30}, {10, 32}, {3, 32}},
                 sunk[5][2] = {{5, 0}, {20, 0}, {20, 8}, {9, 8}, {5, 4}};
    expect_exact(part_turned(4, pipe, 48), (counts){2, 2, 0, 0, 0}, true);
    expect_exact(part_turned(4, cone, 64), (counts){2, 1, 1, 0, 0}, true);
    expect_exact(part_turned(8, flange, 60), (counts){4, 4, 0, 0, 0}, true);
    expect_exact(part_turned(9, thread, 40), (counts){2, 1, 6, 0, 0}, true);
    expect_exact(part_turned(6, shaft, 50), (counts){2, 2, 2, 0, 0}, true);
    expect_exact(part_turned(5, sunk, 36), (counts){2, 2, 1, 0, 0}, true);
}

static void upright_parts(void **state)
{
    (void)state;
    double q = PI / 2;
    const part_point rounded[8] = {{6, 0, 0},   {44, 0, q}, {50, 6, 0}, {50, 34, q},
                                   {44, 40, 0}, {6, 40, q}, {0, 34, 0}, {0, 6, q}},
                     bracket[7] = {{0, 0, 0}, {60, 0, 0}, {60, 6, 0}, {14, 6, -q}, {6, 14, 0}, {6, 50, 0}, {0, 50, 0}},
                     slotted[4] = {{0, 0, 0}, {40, 0, PI}, {40, 20, 0}, {0, 20, PI}},
                     cut[8] = {{5, 0, 0},   {45, 0, 0}, {50, 5, 0}, {50, 35, 0},
                               {45, 40, 0}, {5, 40, 0}, {0, 35, 0}, {0, 5, 0}};
    expect_exact(part_upright(8, rounded, 20, 0.2), (counts){6, 4, 0, 0, 0}, true);
    expect_exact(part_upright(7, bracket, 30, 0.2), (counts){8, 1, 0, 0, 0}, true);
    expect_exact(part_upright(4, slotted, 12, 0.15), (counts){4, 2, 0, 0, 0}, true);
    expect_exact(part_upright(8, cut, 25, 0.2), (counts){10, 0, 0, 0, 0}, false);
    expect_exact(part_holes(3, 0.25, 0.2, 40), (counts){6, 3, 0, 0, 0}, true);
}

/* Rings, fillets whose ends are tangents, and balls. */
static void round_parts(void **state)
{
    (void)state;
    const double q = PI / 2;
    const part_point ring[2] = {{38, 0, PI}, {22, 0, PI}},
                     boss[7] = {{4, 0, 0}, {18, 0, 0}, {18, 12, 0}, {14, 12, -q}, {10, 16, 0}, {10, 30, 0}, {4, 30, 0}},
                     ball[2] = {{6, -8, 2 * atan2(8, 6)}, {6, 8, 0}},
                     wheel[5] = {{10, -3, 0}, {30, -3, q}, {33, 0, q}, {30, 3, 0}, {10, 3, 0}},
                     pin[5] = {{3, 0, 0}, {10, 0, 0}, {10, 30, acos(0.3)}, {3, 30 + sqrt(91), 0}, {3, 10, 0}};
    expect_exact(part_round(2, ring, 0.4, 48), (counts){0, 0, 0, 0, 1}, true);
    expect_exact(part_round(7, boss, 0.2, 48), (counts){3, 3, 0, 0, 1}, true);
    expect_exact(part_round(2, ball, 0.15, 40), (counts){0, 1, 0, 1, 0}, true);
    expect_exact(part_round(5, wheel, 0.3, 60), (counts){2, 1, 0, 0, 1}, true);
    expect_exact(part_round(5, pin, 0.15, 48), (counts){1, 2, 0, 1, 0}, true);
}

/* The edges of a pipe's rims are equal, its lines upright and its rows level. */
static void rows_are_even(void **state)
{
    (void)state;
    const double pipe[4][2] = {{16, 0}, {20, 0}, {20, 60}, {16, 60}};
    part *p = part_turned(4, pipe, 50);
    qw_mesh_view view = part_view(p);
    qw_result *result = remeshed(&view, QUADS, true);
    qw_mesh_view m = qw_result_mesh(result);
    double least = INFINITY, most = 0;
    uint32_t upright = 0, level = 0, rims = 0;
    for (uint32_t h = 0; h < 4 * m.face_count; h++) {
        const double *a = m.positions + 3 * (size_t)m.corners[h],
                     *b = m.positions + 3 * (size_t)m.corners[h % 4 == 3 ? h - 3 : h + 1];
        double d = hypot(b[0] - a[0], b[1] - a[1]), up = fabs(b[2] - a[2]);
        bool outside = fabs(hypot(a[0], a[1]) - 20) < 1e-6 && fabs(hypot(b[0], b[1]) - 20) < 1e-6;
        if (!outside) continue;
        if (up > d) assert_true(d < 0.03 * up), upright++;
        else assert_true(up < 0.03 * d), level++;
        if (a[2] < 1e-6 && b[2] < 1e-6) rims++, least = fmin(least, d), most = fmax(most, d);
    }
    assert_true(upright > 50 && level > 50 && rims > 10);
    assert_true(most - least < 1e-5);
    qw_result_destroy(result);
    free(p);
}

/* Vertices on the circle about (x, 0, z). */
static uint32_t count_on_circle(const qw_mesh_view *m, double x, double z, double radius)
{
    uint32_t sum = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        const double *at = m->positions + 3 * (size_t)v;
        sum += fabs(hypot(at[0] - x, at[1]) - radius) < 1e-6 && fabs(at[2] - z) < 1e-6;
    }
    return sum;
}

/* The circles of holes have even numbers of quads, above and below the same. */
static void circles_are_even(void **state)
{
    (void)state;
    for (int64_t faces = 300; faces <= 900; faces += 200) {
        part *p = part_holes(3, 0.25, 0.2, 40);
        qw_mesh_view view = part_view(p);
        qw_result *result = remeshed(&view, faces, true);
        qw_mesh_view m = qw_result_mesh(result);
        for (int hole = 0; hole < 3; hole++) {
            uint32_t below = count_on_circle(&m, hole, 0, 0.25), above = count_on_circle(&m, hole, 0.2, 0.25);
            assert_true(below >= 4 && below % 2 == 0 && above == below);
        }
        qw_result_destroy(result);
        free(p);
    }
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The largest less the smallest of the angles from one vertex on the circle about (x, 0, z) to the next. */
static double unevenness_of_circle(const qw_mesh_view *m, double x, double z, double radius)
{
    uint32_t n = count_on_circle(m, x, z, radius), found = 0;
    double *at = calloc(n + 1, sizeof *at), least = INFINITY, most = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        const double *p = m->positions + 3 * (size_t)v;
        if (fabs(hypot(p[0] - x, p[1]) - radius) < 1e-6 && fabs(p[2] - z) < 1e-6) at[found++] = atan2(p[1], p[0] - x);
    }
    assert_true(n > 2);
    qsort(at, n, sizeof *at, by_size);
    at[n] = at[0] + 2 * PI;
    for (uint32_t i = 0; i < n; i++) least = fmin(least, at[i + 1] - at[i]), most = fmax(most, at[i + 1] - at[i]);
    free(at);
    return most - least;
}

/* Of deep holes in a block of few quads, where the sizes asked for have no even circles that do not touch. */
static void circles_are_even_at_other_sizes(void **state)
{
    (void)state;
    const double hole[3][3] = {{2.2, 0.8, 0.25}, {1, 1.2, 0.38}, {1.8, 1.3, 0.1}};
    qw_mesh *mesh;
    qw_result *result;
    qw_options o;
    qw_options_init(&o);
    o.faces = 200, o.threads = 2, o.sharp_angle = 30, o.adaptive = 0, o.loops = 1, o.evenness = 0.25, o.around = 12,
    o.rings = 0;
    assert_int_equal(qw_load(QW_TEST_DATA "/regress/odd_circles.obj", NULL, &mesh), QW_OK);
    qw_mesh_view view = qw_mesh_get(mesh);
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    qw_mesh_view m = qw_result_mesh(result);
    for (int i = 0; i < 6; i++) {
        const double *c = hole[i / 2], height = i % 2 ? 2.1 : 0;
        uint32_t edges = 0;
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            const double *at = m.positions + 3 * (size_t)v;
            edges += fabs(hypot(at[0] - c[0], at[1] - c[1]) / c[2] - 1) < 0.02 && fabs(at[2] - height) < 1e-3;
        }
        assert_true(edges >= 4 && edges % 2 == 0);
    }
    qw_result_destroy(result);
    qw_mesh_destroy(mesh);
}

/* A hole that the file has as a polygon of twelve is a circle with equal edges: its corners are none. */
static void circles_of_few_edges_are_even(void **state)
{
    (void)state;
    for (int64_t faces = 340; faces <= 420; faces += 40) {
        part *p = part_holes(3, 0.25, 0.2, 12);
        qw_mesh_view view = part_view(p);
        qw_result *result = remeshed(&view, faces, true);
        qw_mesh_view m = qw_result_mesh(result);
        for (int hole = 0; hole < 3; hole++)
            for (int side = 0; side < 2; side++) assert_true(unevenness_of_circle(&m, hole, 0.2 * side, 0.25) < 1e-5);
        qw_result_destroy(result);
        free(p);
    }
}

/* As many edges around each hole as are asked for, above and below, with the number of quads asked for; where these are
   too few, a note says so. */
static void circles_get_edges_around(void **state)
{
    (void)state;
    for (int64_t around = 0; around <= 18; around += 6) {
        part *p = part_holes(3, 0.08, 0.3, 40);
        qw_mesh_view view = part_view(p);
        qw_result *result;
        qw_options o;
        qw_options_init(&o);
        o.faces = around == 18 ? 100 : 2500, o.threads = 2, o.around = around, o.adaptive = 0;
        assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
        qw_mesh_view m = qw_result_mesh(result);
        uint32_t least = UINT32_MAX;
        for (int i = 0; i < 6; i++) {
            uint32_t count = count_on_circle(&m, i / 2, 0.3 * (i % 2), 0.08);
            least = count < least ? count : least;
        }
        assert_true(around == 0 || around == 18 ? least < 12 : (int64_t)least >= around);
        assert_true(fabs((double)m.face_count / (double)o.faces - 1) <= 0.05);
        const qw_report *r = qw_result_report(result);
        bool is_said = false;
        for (int64_t i = 0; i < r->warning_count; i++) is_said |= strstr(r->warnings[i], "edges around") != NULL;
        assert_int_equal(is_said, around == 18);
        qw_result_destroy(result);
        free(p);
    }
}

/* What was not designed stays as it was, to the byte. */
static void other_shapes_stay(void **state)
{
    (void)state;
    shape s = shape_sphere(8); /* an egg then */
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * v] *= 1.2, s.position[3 * v + 1] *= 1.4;
    qw_mesh_view view = shape_view(&s);
    qw_result *with = remeshed(&view, 300, true), *without = remeshed(&view, 300, false);
    qw_mesh_view a = qw_result_mesh(with), b = qw_result_mesh(without);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_memory_equal(a.positions, b.positions, 3 * a.vertex_count * sizeof *a.positions);
    assert_int_equal(qw_result_report(with)->exact_vertices, 0);
    qw_result_destroy(with), qw_result_destroy(without);
    shape_free(&s);
}

/* Split quads, those of a limit surface, and both sides of a plane. */
static void what_follows_keeps_them(void **state)
{
    (void)state;
    const double pipe[4][2] = {{16, 0}, {20, 0}, {20, 60}, {16, 60}};
    for (int k = 0; k < 3; k++) {
        part *p = part_turned(4, pipe, 48);
        qw_mesh_view view = part_view(p);
        qw_result *result;
        qw_options o;
        qw_options_init(&o);
        o.faces = k == 0 ? 150 : 400;
        if (k == 0) o.subdivide = 1;
        if (k == 1) o.fit_to = 1;
        if (k == 2) o.symmetry = 4;
        assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
        assert_true(qw_result_report(result)->exact_vertices > 0);
        if (k != 1) assert_true(farthest(p, result) < 1e-6);
        qw_result_destroy(result);
        free(p);
    }
}

/* A wedge has corners that no move of vertices opens: they are counted, and said. */
static void low_jacobians_are_reported(void **state)
{
    (void)state;
    const part_point wedge[3] = {{0, 0, 0}, {40, 0, 0}, {40, 8, 0}};
    part *p = part_upright(3, wedge, 10, 1);
    qw_mesh_view view = part_view(p);
    qw_result *result;
    qw_options o;
    qw_options_init(&o);
    o.faces = 300, o.jacobian_min = 0.5;
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    const qw_report *r = qw_result_report(result);
    assert_true(r->low_jacobians > 0);
    bool is_said = false;
    for (uint32_t i = 0; i < r->warning_count; i++) is_said |= strstr(r->warnings[i], "scaled Jacobian") != NULL;
    assert_true(is_said);
    qw_result_destroy(result);
    free(p);
}

/* Quads both sides of whose corner lie on one sharp edge: only another edge there helps. A side turns, or a quad
   becomes five. The report counts what is left (how much that is, is a trend: bench/trends.c). */
static void low_quads_are_mended(void **state)
{
    (void)state;
    for (int fineness = 2; fineness <= 3; fineness++)
        for (int64_t faces = 90; faces <= 170; faces += 40) {
            shape s = shape_hand(fineness);
            qw_mesh_view view = shape_view(&s), quads;
            qw_result *result;
            qw_options o;
            qw_topology topology;
            qw_quality quality;
            qw_options_init(&o);
            o.faces = faces, o.jacobian_min = 0.3;
            assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
            const qw_report *r = qw_result_report(result);
            assert_true(r->raised_jacobians > 0);
            assert_true(r->topology.euler == r->euler && r->topology.degenerate_faces == 0);
            assert_true(fabs((double)r->topology.faces / (double)o.faces - 1) <= 0.05);
            quads = qw_result_mesh(result);
            assert_int_equal(qw_measure(&quads, NULL, NULL, &topology, &quality), QW_OK);
            assert_int_equal((int64_t)(quality.low_jacobian * (double)topology.quads + 0.5), r->low_jacobians);
            qw_result_destroy(result);
            shape_free(&s);
        }
}

/* Patches from blocks have the part's faces, each once, with its radius, and their vertices lie on them. */
static void expect_faces(part *p, counts wanted, const double *radius, uint32_t radii)
{
    enum { MOST = 1 << 16 };
    static double point[MOST][3];
    static uint32_t vertex[MOST];
    static char line[1 << 16];
    qw_mesh_view view = part_view(p);
    qw_context *context = NULL;
    qw_options o;
    qw_options_init(&o);
    o.faces = QUADS, o.fit_to = 1, o.sharp_angle = 30, o.adaptive = 0, o.around = 12, o.threads = 2;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &o), QW_OK);
    assert_int_equal(qw_save_patches_from(context, "faces.step", QW_PATCHES_OF_BLOCKS), QW_OK);
    qw_destroy(context);
    counts found = {0};
    uint32_t faces = 0, edges = 0;
    FILE *file = fopen("faces.step", "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file)) {
        unsigned id, of, end[2];
        double at[3], r;
        if (sscanf(line, "#%u=CARTESIAN_POINT('',(%lf,%lf,%lf", &id, &at[0], &at[1], &at[2]) == 4 && id < MOST)
            memcpy(point[id], at, sizeof at);
        if (sscanf(line, "#%u=VERTEX_POINT('',#%u", &id, &of) == 2 && id < MOST && of < MOST) vertex[id] = of;
        if (sscanf(line, "#%u=EDGE_CURVE('',#%u,#%u", &id, &end[0], &end[1]) == 3) {
            for (int k = 0; k < 2; k++) {
                assert_true(end[k] < MOST && vertex[end[k]] < MOST);
                assert_true(part_distance(p, point[vertex[end[k]]]) < 1e-6 * diagonal_of(&view));
            }
            edges++;
        }
        if (sscanf(line, "#%u=CYLINDRICAL_SURFACE('',#%u,%lf", &id, &of, &r) == 3) {
            double least = INFINITY;
            for (uint32_t i = 0; i < radii; i++) least = fmin(least, fabs(r / radius[i] - 1));
            assert_true(least < 1e-6);
            found.cylinders++;
        }
        found.planes += strstr(line, "=PLANE(") != NULL, found.cones += strstr(line, "=CONICAL_SURFACE(") != NULL;
        faces += strstr(line, "=ADVANCED_FACE(") != NULL;
    }
    fclose(file);
    remove("faces.step");
    assert_true(edges > 0);
    assert_int_equal(found.planes, wanted.planes);
    assert_int_equal(found.cylinders, wanted.cylinders);
    assert_int_equal(found.cones, wanted.cones);
    assert_int_equal(faces, wanted.planes + wanted.cylinders + wanted.cones);
    free(p);
}

static void faces_of_parts_are_written(void **state)
{
    (void)state;
    const double pipe[4][2] = {{16, 0}, {20, 0}, {20, 30}, {16, 30}},
                 sunk[5][2] = {{5, 0}, {20, 0}, {20, 8}, {9, 8}, {5, 4}},
                 cone[4][2] = {{4, 0}, {20, 0}, {12, 20}, {4, 20}};
    expect_faces(part_turned(4, pipe, 48), (counts){2, 2, 0, 0, 0}, (double[]){16, 20}, 2);
    expect_faces(part_turned(5, sunk, 36), (counts){2, 2, 1, 0, 0}, (double[]){5, 20}, 2);
    expect_faces(part_turned(4, cone, 64), (counts){2, 1, 1, 0, 0}, (double[]){4}, 1);
    expect_faces(part_holes(3, 0.25, 0.2, 40), (counts){6, 3, 0, 0, 0}, (double[]){0.25}, 1);
}

QW_TEST_SUITE(exact)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(low_quads_are_mended),
        cmocka_unit_test(low_jacobians_are_reported),
        cmocka_unit_test(turned_parts),
        cmocka_unit_test(upright_parts),
        cmocka_unit_test(round_parts),
        cmocka_unit_test(rows_are_even),
        cmocka_unit_test(circles_are_even),
        cmocka_unit_test(circles_are_even_at_other_sizes),
        cmocka_unit_test(circles_of_few_edges_are_even),
        cmocka_unit_test(circles_get_edges_around),
        cmocka_unit_test(other_shapes_stay),
        cmocka_unit_test(what_follows_keeps_them),
        cmocka_unit_test(faces_of_parts_are_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What is a feature and what is none, on surfaces of which it is known: whole runs, at several counts. */
#include "suite.h"

#include "run/driver.h"
#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "loaded.h"
#include "shape_context.h"

static int64_t feature_edges(const shape *s, int64_t faces)
{
    qw_context *context = context_of(s, faces, QW_STAGE_SURFACE);
    int64_t count = ((qw_context_state *)context)->report.feature_edges;
    qw_destroy(context);
    return count;
}

static qw_result *quads_of_view(const qw_mesh_view *view, int64_t faces)
{
    qw_result *result;
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    assert_int_equal(qw_remesh(view, &options, NULL, &result), QW_OK);
    return result;
}

static qw_result *quads_of(const shape *s, int64_t faces)
{
    qw_mesh_view view = shape_view(s);
    return quads_of_view(&view, faces);
}

/* From a point to the nearest vertex of the quads. */
static double distance_to(const qw_result *result, const double *point)
{
    qw_mesh_view quads = qw_result_mesh(result);
    double nearest = INFINITY;
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v;
        double x = p[0] - point[0], y = p[1] - point[1], z = p[2] - point[2];
        nearest = fmin(nearest, sqrt(x * x + y * y + z * z));
    }
    return nearest;
}

static qw_topology topology_of(const shape *s, int64_t faces)
{
    qw_result *result = quads_of(s, faces);
    qw_topology topology = qw_result_report(result)->topology;
    qw_result_destroy(result);
    return topology;
}

/* ---- stairs */

static bool in_ball(int x, int y, int z)
{
    int a = 2 * x - 15, b = 2 * y - 15, c = 2 * z - 15;
    return a * a + b * b + c * c < 15 * 15;
}
static bool in_hill(int x, int y, int z) /* a cone of terraces */ { return hypot(x - 9.5, y - 9.5) < 9 - z; }
static bool in_comb(int x, int y, int z) /* its outline is 50 long and has 20 corners */
{
    return z == 0 && (y == 0 || x % 2 == 0);
}

static void voxels_have_no_creases(void **state)
{
    (void)state;
    shape ball = shape_of_cells(16, 16, 16, 1, in_ball), hill = shape_of_cells(20, 20, 8, 1, in_hill);
    static const int64_t faces[] = {100, 300, 1100, 3000};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(feature_edges(&ball, faces[i]), 0);
        assert_int_equal(topology_of(&ball, faces[i]).irregular, 8);
    }
    assert_int_equal(feature_edges(&hill, 300), 0);
    shape_free(&ball), shape_free(&hill);
}

static void steps_that_are_meant_stay(void **state)
{
    (void)state;
    shape box = shape_of_cells(1, 1, 1, 16, shape_all), comb = shape_of_cells(9, 4, 1, 4, in_comb);
    for (int64_t faces = 300; faces <= 3000; faces += 900) {
        assert_int_equal(feature_edges(&box, faces), 12 * 16);
        assert_int_equal(feature_edges(&comb, faces), 4 * (2 * 50 + 20));
    }
    shape_free(&box), shape_free(&comb);
}

/* ---- points */

static double spin_height, spin_power; /* of the surface below */
static int spin_sides;

/* Around the z axis, closed: from a foot to a tip at (0, 0, spin_height); sides straight where spin_power is 1. */
static shape spindle(int rows, bool round_foot)
{
    uint32_t n = (uint32_t)spin_sides;
    shape s = {0, 0, malloc(3 * ((size_t)rows * n + 2) * sizeof(double)),
               malloc(6 * (size_t)rows * n * sizeof(uint32_t))};
    s.position[0] = s.position[1] = 0, s.position[2] = spin_height;
    s.vertex_count = 1;
    for (int i = 1; i <= rows; i++)
        for (uint32_t j = 0; j < n; j++) {
            double t = (double)i / rows, a = 6.283185307179586 * j / n, r = pow(t, spin_power);
            if (round_foot) r *= sqrt(1 - t * t * t * t * (1 - 1e-9));
            double *p = s.position + 3 * (size_t)s.vertex_count++;
            p[0] = r * cos(a), p[1] = r * sin(a), p[2] = spin_height * (1 - t);
        }
    uint32_t foot = s.vertex_count++;
    s.position[3 * foot] = s.position[3 * foot + 1] = s.position[3 * foot + 2] = 0;
    for (uint32_t j = 0; j < n; j++) {
        uint32_t k = (j + 1) % n, last = 1 + (uint32_t)(rows - 1) * n;
        shape_triangle(&s, 0, 1 + j, 1 + k), shape_triangle(&s, foot, last + k, last + j);
        for (uint32_t i = 0; i + 1 < (uint32_t)rows; i++)
            shape_square(&s, 1 + i * n + j, 1 + (i + 1) * n + j, 1 + (i + 1) * n + k, 1 + i * n + k, false);
    }
    return s;
}

static void assert_tip(const shape *s, int64_t faces)
{
    qw_result *result = quads_of(s, faces);
    assert_int_equal(qw_result_report(result)->feature_points, 1);
    assert_true(distance_to(result, s->position) < 1e-5);
    qw_result_destroy(result);
}

static void tips_get_a_vertex(void **state)
{
    (void)state;
    static const struct {
        double height, power;
        int sides, rows;
        bool round_foot;
    } kinds[] = {
        {3, 1, 52, 1, false},   /* a cone */
        {3, 1, 40, 20, false},  /* the same in rows */
        {1, 1, 40, 10, false},  /* a blunt one */
        {4, 1, 9, 6, false},    /* a pyramid, the edges between whose sides turn by 38 degrees */
        {3, 1, 40, 30, true},   /* a drop, without any sharp edge */
        {3, 1.5, 40, 30, true}, /* one with a spike */
    };
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        spin_height = kinds[i].height, spin_power = kinds[i].power, spin_sides = kinds[i].sides;
        shape s = spindle(kinds[i].rows, kinds[i].round_foot);
        for (int64_t faces = 150; faces <= 2400; faces *= 4) assert_tip(&s, faces);
        shape_free(&s);
    }
}

static void round_ends_and_noise_have_no_points(void **state)
{
    (void)state;
    shape ball = shape_sphere(8), rough = shape_sphere(24), torus = shape_torus(12);
    uint64_t random = 3;
    for (uint32_t i = 0; i < 3 * rough.vertex_count; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        rough.position[i] += 0.05 * ((double)(random >> 33) / 2147483648.0 - 0.5);
    }
    const shape *all[] = {&ball, &rough, &torus};
    for (int i = 0; i < 3; i++)
        for (int64_t faces = 100; faces <= 10000; faces *= 10) {
            qw_context *context = context_of(all[i], faces, QW_STAGE_SURFACE);
            assert_int_equal(((qw_context_state *)context)->report.feature_points, 0);
            qw_destroy(context);
        }
    shape_free(&ball), shape_free(&rough), shape_free(&torus);
}

/* ---- close edges */

static bool is_ledge(int x, int y, int z) { return x == 0 || y == 0 || z < 0; }

/* A block with a ledge all along it, 1 wide, at counts for which 1 is 0.45 to 0.8 of a quad. */
static void narrow_ledges_stay(void **state)
{
    (void)state;
    static const double at[3][3] = {{0, 19, 20}, {0, 4, 12}, {0, 20, 20}};
    shape s = shape_of_cells(2, 2, 1, 1, is_ledge);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        for (int i = 0; i < 3; i++) s.position[3 * v + (uint32_t)i] = at[i][(int)s.position[3 * v + (uint32_t)i]];
    for (int64_t faces = 400; faces <= 1100; faces += 50) {
        qw_result *result = quads_of(&s, faces);
        assert_int_equal(qw_result_report(result)->topology.irregular, 12);
        int64_t made = qw_result_mesh(result).face_count, off = made > faces ? made - faces : faces - made;
        assert_true(off <= faces / 50 || (faces < 500 && off <= faces / 20));
        for (uint32_t v = 0; v < s.vertex_count; v++) /* all are corners or on an edge of the block */
            if (s.position[3 * v] >= 19 && s.position[3 * v + 1] > 0)
                assert_true(distance_to(result, s.position + 3 * (size_t)v) < 1e-4);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

static bool is_sink(int x, int y, int z) { return (z == 0 || x % 2 == 0) && y == 0; }

/* Seven fins on a base. */
static shape sink(double fin, double gap, double height)
{
    shape s = shape_of_cells(13, 1, 2, 1, is_sink);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v;
        int before = (int)p[0];
        p[0] = (before + 1) / 2 * fin + before / 2 * gap;
        p[1] *= 12, p[2] = p[2] == 2 ? 1 + height : p[2];
    }
    return s;
}

/* At counts for which fins and gaps are half a quad wide each stays, a row of its own. */
static void thin_fins_stay(void **state)
{
    (void)state;
    static const struct {
        double fin, gap, height;
        int64_t faces;
    } cases[] = {{0.4, 1.0, 5, 600}, {0.4, 1.0, 5, 1200}, {0.6, 0.6, 3, 500}, {0.6, 0.6, 3, 600}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        shape s = sink(cases[k].fin, cases[k].gap, cases[k].height);
        double end = 7 * cases[k].fin + 6 * cases[k].gap;
        qw_result *result = quads_of(&s, cases[k].faces);
        for (uint32_t v = 0; v < s.vertex_count; v++) { /* all but the middles of edges are corners */
            const double *p = s.position + 3 * (size_t)v;
            bool is_corner = p[2] > 1 || (p[2] == 1 && p[0] > 0 && p[0] < end - 1e-9);
            if (is_corner) assert_true(distance_to(result, p) < 1e-4);
        }
        assert_int_equal(qw_result_report(result)->topology.euler, 2);
        qw_result_destroy(result), shape_free(&s);
    }
}

static bool is_fin(int x, int y, int z) { return z == 0 || (x == 1 && y % 2 == 1); }

/* Corners of what stands on the top of a block of cells, off by more than 1e-4 from each vertex of the quads. */
static int missed_above(const shape *s, const qw_result *result)
{
    int count = 0;
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        const double *p = s->position + 3 * (size_t)v;
        bool is_above = p[0] > 0 && p[0] < 20 && p[1] > 0 && p[1] < 10 && p[2] > 0;
        count += is_above && !(distance_to(result, p) < 1e-4);
    }
    return count;
}

/* Ends of a low rib on a block, a fifth of a quad wide and high: both ends of each of its short edges are corners, and
   no vertex lies between them. */
static void low_ribs_stay(void **state)
{
    (void)state;
    static const double at[3][4] = {{0, 5, 15, 20}, {0, 4.85, 5.15, 10}, {0, 5, 5.3}};
    shape s = shape_of_cells(3, 3, 2, 1, is_fin);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        for (int i = 0; i < 3; i++) s.position[3 * v + (uint32_t)i] = at[i][(int)s.position[3 * v + (uint32_t)i]];
    for (int64_t faces = 350; faces <= 500; faces += 50) {
        qw_result *result = quads_of(&s, faces);
        assert_int_equal(qw_result_report(result)->merged_arcs, 0);
        assert_int_equal(qw_result_report(result)->topology.irregular, 16);
        assert_int_equal(missed_above(&s, result), 0);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

/* Five fins and the gaps between them, a quarter of a quad wide: more curves touch than a quarter of the quads. */
static void rows_of_fins_stay(void **state)
{
    (void)state;
    shape s = shape_of_cells(3, 11, 2, 1, is_fin);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v;
        p[0] = p[0] == 3 ? 20 : p[0] * p[0] * 2.5 + p[0] * 2.5; /* 0, 5, 15, 20 */
        p[1] = p[1] == 0 ? 0 : p[1] == 11 ? 10 : 1.5 + p[1] / 2;
        p[2] = p[2] == 2 ? 7 : p[2] * 5;
    }
    qw_result *result = quads_of(&s, 250);
    assert_int_equal(qw_result_report(result)->topology.irregular, 48);
    assert_int_equal(missed_above(&s, result), 0);
    qw_result_destroy(result), shape_free(&s);
}

/* Ledges too narrow for a row of quads are named, with how long they are and where; those that are kept are followed.
 */
static void curves_that_give_way_are_named(void **state)
{
    (void)state;
    static const double at[3][3] = {{0, 19, 20}, {0, 4, 12}, {0, 20, 20}};
    shape s = shape_of_cells(2, 2, 1, 1, is_ledge);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        for (int i = 0; i < 3; i++) s.position[3 * v + (uint32_t)i] = at[i][(int)s.position[3 * v + (uint32_t)i]];
    qw_result *narrow = quads_of(&s, 30), *wide = quads_of(&s, 400);
    const qw_report *r = qw_result_report(narrow);
    assert_true(r->merged_arcs > 0 && r->curve_count > 0 && r->arcs_given_up > 0.02 && r->arcs_given_up < 0.5);
    assert_string_equal(r->curves[0].verdict, "merged");
    double sum = 0;
    for (uint32_t i = 0; i < r->curve_count; i++) {
        sum += r->curves[i].length;
        double x = r->curves[i].at[0]; /* its outer edge, or across its end */
        assert_true((fabs(x - 20) < 1e-3 || (x > 19 && r->curves[i].length < 0.2)) &&
                    fabs(r->curves[i].at[1] - 4) < 1e-3);
        assert_true(i == 0 || r->curves[i].length <= r->curves[i - 1].length);
    }
    assert_true(sum > 2 && sum < 4); /* 20 long, edges of 7 */
    r = qw_result_report(wide);
    assert_int_equal(r->feature_arcs, 18); /* of a block with a ledge along one side */
    assert_true(r->curve_count == 0 && r->arcs_given_up == 0 && r->lost_edges == 0);
    qw_result_destroy(narrow), qw_result_destroy(wide), shape_free(&s);
}

/* A ledge that is a fifth of an edge wide near its middle, more at one end and less at the other, gives way or is kept
   as a whole, with its ends: no arc of it is cut. */
static void ledges_have_one_verdict(void **state)
{
    (void)state;
    static const double at[3][3] = {{0, 19.7, 20}, {0, 5, 10}, {0, 20, 20}};
    shape s = shape_of_cells(2, 2, 1, 1, is_ledge);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v;
        bool is_between = p[0] == 1;
        for (int i = 0; i < 3; i++) p[i] = at[i][(int)p[i]];
        if (is_between) p[0] = p[2] == 0 ? 19.76 : 19.64;
    }
    for (int64_t faces = 400; faces <= 800; faces += 100) {
        qw_result *result = quads_of(&s, faces);
        const qw_report *r = qw_result_report(result);
        assert_int_equal(r->feature_arcs, 18);
        assert_true((r->merged_arcs == 3 && r->topology.irregular == 8) ||
                    (r->merged_arcs == 0 && r->topology.irregular == 12));
        assert_int_equal(r->dropped_arcs, 0);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

/* Too few quads for the fins: the report says so, and the count that it names will do. */
static void lost_edges_are_told(void **state)
{
    (void)state;
    shape s = sink(0.4, 1.0, 5);
    qw_result *result = quads_of(&s, 200);
    const qw_report *report = qw_result_report(result);
    int64_t enough = report->faces_for_edges;
    assert_true(report->lost_edges > 0.01 && report->lost_edges < 1 && report->warning_count > 0);
    assert_true(enough > 200 && enough < 20000);
    qw_result_destroy(result);
    result = quads_of(&s, enough);
    report = qw_result_report(result);
    assert_true(report->lost_edges < 1e-3 && report->faces_for_edges == 0);
    qw_result_destroy(result), shape_free(&s);
}

/* A count far beyond what was asked for is no advice: the sentence says what is. */
static void edges_that_no_count_would_hold(void **state)
{
    (void)state;
    shape s = sink(0.004, 1.0, 5);
    qw_result *result = quads_of(&s, 300);
    const qw_report *report = qw_result_report(result);
    assert_true(report->faces_for_edges > 20 * 300);
    bool is_said = false;
    for (uint32_t i = 0; i < report->warning_count; i++) {
        assert_null(strstr(report->warnings[i], "would have room"));
        is_said |= strstr(report->warnings[i], "a larger sharp angle leaves them out") != NULL;
    }
    assert_true(is_said);
    qw_result_destroy(result), shape_free(&s);
}

/* ---- outlines */

/* A plate whose outline turns by 37, 53 and 90 degrees between straight sides: all its corners are vertices. */
static void corners_of_outlines_are_vertices(void **state)
{
    (void)state;
    qw_mesh *plate = load_file(QW_TEST_DATA "/regress/kinked_plate.obj");
    qw_mesh_view view = qw_mesh_get(plate);
    for (int64_t faces = 100; faces <= 1000; faces += 300) {
        qw_result *result = quads_of_view(&view, faces);
        double edge = qw_result_report(result)->mean_edge;
        for (uint32_t i = 0; i < 5; i++) assert_true(distance_to(result, view.positions + 3 * (size_t)i) < 0.02 * edge);
        qw_result_destroy(result);
    }
    qw_mesh_destroy(plate);
}

QW_TEST_SUITE(feature_kinds)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(voxels_have_no_creases),
        cmocka_unit_test(steps_that_are_meant_stay),
        cmocka_unit_test(tips_get_a_vertex),
        cmocka_unit_test(round_ends_and_noise_have_no_points),
        cmocka_unit_test(narrow_ledges_stay),
        cmocka_unit_test(thin_fins_stay),
        cmocka_unit_test(low_ribs_stay),
        cmocka_unit_test(rows_of_fins_stay),
        cmocka_unit_test(curves_that_give_way_are_named),
        cmocka_unit_test(ledges_have_one_verdict),
        cmocka_unit_test(lost_edges_are_told),
        cmocka_unit_test(edges_that_no_count_would_hold),
        cmocka_unit_test(corners_of_outlines_are_vertices),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

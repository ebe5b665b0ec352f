/* Quads run along and around what bends one way, on surfaces whose directions are known: whole runs, at several counts.
 */
#include "suite.h"

#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static const double PI = 3.14159265358979;

/* A rod with round ends, of radius 1 and a straight part of 4. */
static void at_capsule(double u, double v, double p[3])
{
    double length = 4 + PI, s = v * length, a = 2 * PI * u, turn = fmin(s, PI / 2) + fmax(s - PI / 2 - 4, 0);
    double r = v > 0 && v < 1 ? sin(turn) : 0, straight = fmin(fmax(s - PI / 2, 0), 4);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = straight - cos(turn);
}

static qw_quality quality_of(const shape *s, int64_t faces, double follow, int64_t *irregular)
{
    qw_result *result;
    qw_mesh_view view = shape_view(s), quads;
    qw_options options;
    qw_topology topology;
    qw_quality quality;
    qw_options_init(&options);
    options.faces = faces, options.adaptive = 0; /* the straight part as fine as the ends */
    if (follow >= 0) options.follow = follow, options.loops = 0;
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
    quads = qw_result_mesh(result);
    assert_int_equal(qw_measure(&quads, &view, NULL, &topology, &quality), QW_OK);
    *irregular = topology.irregular;
    qw_result_destroy(result);
    return quality;
}

/* Quads wound around the straight part at 43 degrees, as no direction costs a field more than another there. */
static void capsules_have_rings(void **state)
{
    (void)state;
    static const int64_t counts[] = {200, 300, 600, 1200};
    shape s = shape_of_sheet(&(shape_sheet){48, 56, true, false, false, at_capsule});
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        int64_t irregular;
        qw_quality quality = quality_of(&s, counts[i], -1, &irregular);
        assert_int_equal(quality.crossing, 0); /* strips run along or around */
        assert_true(quality.follow < 3);
        assert_true(irregular <= 8);
    }
    shape_free(&s);
}

/* Without it, and without lines that meet, the quads lie as few irregular vertices have them. */
static void none_is_asked_for(void **state)
{
    (void)state;
    int64_t irregular;
    shape s = shape_of_sheet(&(shape_sheet){48, 56, true, false, false, at_capsule});
    assert_true(quality_of(&s, 300, 0, &irregular).follow > 10);
    assert_int_equal(irregular, 8);
    shape_free(&s);
}

QW_TEST_SUITE(follow)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(capsules_have_rings), cmocka_unit_test(none_is_asked_for)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

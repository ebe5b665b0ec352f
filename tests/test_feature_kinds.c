/* What is a feature and what is none, on surfaces of which it is known: whole runs, at several counts. */
#include "suite.h"

#include "driver.h"
#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static qw_context *context_of(const shape *s, int64_t faces, qw_stage last)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run_until(context, &options, last), QW_OK);
    return context;
}

static int64_t feature_edges(const shape *s, int64_t faces)
{
    qw_context *context = context_of(s, faces, QW_STAGE_SURFACE);
    int64_t count = ((qw_context_state *)context)->report.feature_edges;
    qw_destroy(context);
    return count;
}

static qw_topology topology_of(const shape *s, int64_t faces)
{
    qw_result *result;
    qw_mesh_view view = shape_view(s);
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
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

QW_TEST_SUITE(feature_kinds)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(voxels_have_no_creases),
        cmocka_unit_test(steps_that_are_meant_stay),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

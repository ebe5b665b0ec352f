/* Quick answers: what they leave out, that they keep the promise, and that a run after one is as if there had been
 * none. */
#include "suite.h"
#include "shapes.h"

#include "remesh/sizes/fast.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void says_what_is_left_out(void **state)
{
    (void)state;
    qw_options o;
    qw_options_init(&o);
    o.loops = 0.75, o.follow = 0.75, o.adaptive = 0.25, o.fit = 0.5;
    for (o.fast = QW_FAST_NO; o.fast <= QW_FAST_PREVIEW; o.fast++) {
        qw_options now = qw_without_slow(&o);
        assert_true(now.loops == (o.fast == QW_FAST_NO ? 0.75 : 0));
        assert_true(now.follow == (o.fast == QW_FAST_PREVIEW ? 0 : 0.75));
        assert_true(now.adaptive == (o.fast == QW_FAST_PREVIEW ? 0 : 0.25));
        assert_true(now.fit == (o.fast == QW_FAST_PREVIEW ? 0 : 0.5));
    }
}

static void run_with(qw_context *context, int64_t fast, qw_mesh_view *mesh)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = 600, o.fast = (int32_t)fast;
    if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
    assert_int_equal(qw_get_mesh(context, mesh), QW_OK);
}

/* A pretzel of two holes, in one context with each setting in turn and in fresh ones. */
static void keeps_the_promise(void **state)
{
    (void)state;
    static const int64_t order[] = {QW_FAST_NO, QW_FAST_PREVIEW, QW_FAST_DRAFT, QW_FAST_NO};
    shape s = shape_of_cells(5, 3, 1, 4, shape_two_holes);
    shape_smooth(&s, 3);
    qw_mesh_view view = shape_view(&s), mesh, same;
    qw_context *context, *fresh;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    for (size_t i = 0; i < sizeof order / sizeof *order; i++) {
        run_with(context, order[i], &mesh);
        const qw_topology *t = &qw_get_report(context)->topology;
        assert_int_equal(t->euler, -2);
        assert_int_equal(t->quads, t->faces);
        assert_int_equal(t->boundary_edges, 0);
        assert_in_range(t->faces, 600 - 600 / 25, 600 + 600 / 25);
        assert_int_equal(qw_create(NULL, &fresh), QW_OK);
        assert_int_equal(qw_set_mesh(fresh, &view), QW_OK);
        run_with(fresh, order[i], &same);
        assert_int_equal(mesh.vertex_count, same.vertex_count);
        assert_memory_equal(mesh.positions, same.positions, 3 * (size_t)mesh.vertex_count * sizeof(double));
        qw_destroy(fresh);
    }
    qw_destroy(context);
    shape_free(&s);
}

QW_TEST_SUITE(fast)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(says_what_is_left_out),
        cmocka_unit_test(keeps_the_promise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What a finished RELAX asks for: quads that are certainly turned over have the run made again with smaller ones around
 * them. */
#include "suite.h"
#include "driver.h"
#include "quad/untangle.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

enum { FACE = 17 };

typedef struct attempt {
    qw_run_state *run;
    bool again;
} attempt;

static void ask(void *user)
{
    attempt *a = user;
    a->again = qw_adjust_result(a->run);
}

static bool wants_another(qw_context_state *c)
{
    attempt a = {.run = &c->run};
    assert_int_equal(qw_protect(c->env, ask, &a), QW_OK);
    return a.again;
}

static qw_context *relaxed_torus(void)
{
    shape torus = shape_torus(6);
    qw_context *context;
    qw_mesh_view view = shape_view(&torus);
    qw_options options;
    qw_options_init(&options);
    options.faces = 300;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_RELAX), QW_OK);
    shape_free(&torus);
    return context;
}

static void flipped_quads_ask_for_smaller_ones(void **state)
{
    (void)state;
    qw_context *context = relaxed_torus();
    qw_context_state *c = (qw_context_state *)context; /* its first member */
    qw_run_state *run = &c->run;
    assert_false(wants_another(c));
    run->flipped[FACE] = 1; /* perhaps */
    assert_false(wants_another(c));
    assert_int_equal(run->refine_count, 0);
    run->flipped[FACE] = QW_CERTAINLY_FLIPPED;
    assert_true(wants_another(c));
    assert_int_equal(run->refine_count, 1);
    qw_vec3 corner = run->relaxed.position[run->relaxed.corner[4 * FACE]];
    assert_true(qw_distance(run->refine[0].center, corner) < 2 * run->rho);
    assert_true(run->refine[0].radius >= run->rho);
    qw_destroy(context);
}

/* Where others are no better, and as many tries are made as there are, the best is made once more: with no smaller
 * quads here. */
static void the_best_is_made_again(void **state)
{
    (void)state;
    qw_context *context = relaxed_torus();
    qw_context_state *c = (qw_context_state *)context;
    qw_run_state *run = &c->run;
    run->flipped[FACE] = QW_CERTAINLY_FLIPPED;
    uint32_t tries = 0;
    while (wants_another(c) && !run->settled) {
        run->flipped[FACE + ++tries] = QW_CERTAINLY_FLIPPED; /* each leaves one more than the one before */
        assert_true(tries < 10);
    }
    assert_true(tries >= 1);
    assert_true(run->settled);
    assert_int_equal(run->refine_count, 0);
    assert_false(wants_another(c));
    qw_destroy(context);
}

/* What comes of it may reach everything as well and have no quad that is certainly turned over, and yet be worse. */
static void what_is_worse_does_not_stay(void **state)
{
    (void)state;
    qw_context *context = relaxed_torus();
    qw_context_state *c = (qw_context_state *)context;
    qw_run_state *run = &c->run;
    run->flipped[FACE] = QW_CERTAINLY_FLIPPED;
    assert_true(wants_another(c));
    for (uint32_t i = 0; i < 5; i++) run->flipped[FACE + i] = 1;
    assert_true(wants_another(c));
    assert_true(run->settled);
    assert_int_equal(run->refine_count, 0);
    qw_destroy(context);
}

/* Made again it is what it was: no other count, no other way to the integers and no other corners are tried on the way.
 */
static void the_best_is_the_same_again(void **state)
{
    (void)state;
    qw_context *context = relaxed_torus();
    qw_context_state *c = (qw_context_state *)context;
    qw_run_state *run = &c->run;
    run->flipped[FACE] = QW_CERTAINLY_FLIPPED;
    run->rho_scale = 1.25, run->way = QW_INTEGER_WAYS - 1, run->corners_freed = 1;
    assert_true(wants_another(c));
    assert_true(run->way == QW_WAY_CLOSED && run->corners_freed == 0);
    for (uint32_t i = 0; i < 5; i++) run->flipped[FACE + i] = 1;
    run->rho_scale = 0.75;
    assert_true(wants_another(c));
    assert_true(run->settled);
    assert_true(run->rho_scale == 1.25 && run->way == QW_INTEGER_WAYS - 1 && run->corners_freed == 1);
    run->report->inverted_after_sat = 5;
    assert_false(qw_adjust_way(run));
    run->faces_wanted *= 2;
    assert_false(qw_adjust_count(run, QW_STAGE_UPRIGHT) || qw_adjust_count(run, QW_STAGE_REPAIR));
    qw_destroy(context);
}

static void what_is_better_stays(void **state)
{
    (void)state;
    qw_context *context = relaxed_torus();
    qw_context_state *c = (qw_context_state *)context;
    qw_run_state *run = &c->run;
    run->flipped[FACE] = QW_CERTAINLY_FLIPPED;
    assert_true(wants_another(c));
    run->flipped[FACE] = 0;
    assert_false(wants_another(c));
    assert_int_equal(run->refine_count, 1);
    qw_destroy(context);
}

QW_TEST_SUITE(attempts)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flipped_quads_ask_for_smaller_ones), cmocka_unit_test(the_best_is_made_again),
        cmocka_unit_test(the_best_is_the_same_again), cmocka_unit_test(what_is_worse_does_not_stay),
        cmocka_unit_test(what_is_better_stays)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What is seen of an attempt, and attempts that are kept: the one that a run ends with is what it would be alone. */
#include "suite.h"

#include "run/driver.h"
#include "run/judge.h"
#include "run/stages/coverage.h"
#include "run/stages/stages.h"
#include "geometry/flips.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "shape_context.h"

enum { FACE = 17 };

static qw_context_state *state_of(qw_context *context) { return (qw_context_state *)context; /* its first member */ }

/* ---- verdicts */

typedef struct look {
    qw_context_state *c;
    qw_judgement judgement;
} look;

static void judge(void *user)
{
    look *l = user;
    qw_judge(&l->c->run, QW_STAGE_RELAX, &l->judgement);
}

static look look_at(qw_context *context)
{
    look l = {.c = state_of(context)};
    assert_int_equal(qw_protect(l.c->env, judge, &l), QW_OK);
    return l;
}

static void flipped_quads_are_seen(void **state)
{
    (void)state;
    shape torus = shape_torus(6);
    qw_context *context = context_of(&torus, 300, QW_STAGE_RELAX);
    qw_run_state *run = &state_of(context)->run;
    look l = look_at(context);
    assert_true(l.judgement.verdict.flipped == 0 && l.judgement.verdict.uncovered == 0);
    assert_int_equal(l.judgement.verdict.places, 0);
    run->flipped[FACE] = 1; /* perhaps */
    l = look_at(context);
    assert_true(l.judgement.verdict.flipped == 1);
    assert_int_equal(l.judgement.verdict.places, 0);
    run->flipped[FACE] = QW_FLIPPED;
    l = look_at(context);
    assert_true(l.judgement.verdict.flipped == 2);
    assert_int_equal(l.judgement.verdict.places, 1);
    qw_vec3 corner = run->relaxed.position[run->relaxed.corner[4 * FACE]];
    assert_true(qw_distance(l.judgement.places.point[0], corner) < 2 * run->rho);
    qw_destroy(context);
    shape_free(&torus);
}

/* A ring of quads that is gone leaves the surface under it uncovered, in quads. */
static void uncovered_area_is_seen(void **state)
{
    (void)state;
    shape torus = shape_torus(6);
    qw_context *context = context_of(&torus, 300, QW_STAGE_RELAX);
    qw_run_state *run = &state_of(context)->run;
    assert_int_equal(qw_count_lost_parts(run, &run->relaxed), 0);
    for (uint32_t v = 0; v < run->relaxed.vertex_count; v++)
        if (run->relaxed.position[v].x > 0) run->relaxed.position[v].x = 0;
    run->relaxed_covers = 0; /* no more */
    look l = look_at(context);
    assert_true(l.judgement.verdict.uncovered > 20 && l.judgement.verdict.uncovered < 150);
    assert_true(l.judgement.verdict.places > 0);
    assert_int_equal(qw_count_lost_parts(run, &run->relaxed), 1);
    qw_destroy(context);
    shape_free(&torus);
}

/* ---- candidates */

typedef struct alone {
    qw_context_state *c;
    qw_plan plan;
} alone;

static const qw_stage_function stages[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) qw_stage_##name,
#include "quadwright/stages.def"
};

static void run_stages(void *user)
{
    alone *a = user;
    a->c->run.plan = a->plan;
    for (int stage = QW_STAGE_WORKING; stage < QW_STAGE_COUNT; stage++) stages[stage](&a->c->run);
}

/* The plan that `context` has ended with, in a context of its own that knows of no other. */
static void same_alone(qw_context *context, const shape *s, int64_t faces)
{
    qw_context_state *c = state_of(context);
    qw_context *other = context_of(s, faces, QW_STAGE_SURFACE);
    alone a = {state_of(other), c->history.attempt[c->history.current].plan};
    memcpy(a.c->refinement, c->refinement, sizeof c->refinement);
    assert_int_equal(qw_protect(a.c->env, run_stages, &a), QW_OK);
    const qw_quadmesh *x = &c->run.finished, *y = &a.c->run.finished;
    assert_int_equal(x->face_count, y->face_count);
    assert_int_equal(x->vertex_count, y->vertex_count);
    assert_memory_equal(x->corner, y->corner, 4 * (size_t)x->face_count * sizeof *x->corner);
    assert_memory_equal(c->run.output, a.c->run.output, 3 * (size_t)x->vertex_count * sizeof *c->run.output);
    assert_int_equal(c->report.working_vertices, a.c->report.working_vertices);
    assert_int_equal(c->report.grown_protrusions, a.c->report.grown_protrusions);
    assert_int_equal(c->report.warning_count, a.c->report.warning_count);
    qw_destroy(other);
}

static void what_is_taken_is_what_it_was(void **state)
{
    (void)state;
    static const int64_t counts[] = {20, 130};
    uint32_t earlier = 0, later = 0;
    for (int is_hand = 0; is_hand < 2; is_hand++)
        for (int i = 0; i < (is_hand ? 3 : 2); i++) {
            shape s = is_hand ? shape_hand(3) : shape_cube(2);
            int64_t faces = is_hand ? (int64_t[]){60, 40, 80}[i] : counts[i];
            qw_context *context = context_of(&s, faces, QW_STAGE_ASSEMBLE);
            const qw_history *h = &state_of(context)->history;
            same_alone(context, &s, faces);
            earlier += h->current + 1 < h->count, later += h->current > 0;
            qw_destroy(context);
            shape_free(&s);
        }
    assert_true(earlier > 0 && later > 0);
}

QW_TEST_SUITE(attempts)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flipped_quads_are_seen),
        cmocka_unit_test(uncovered_area_is_seen),
        cmocka_unit_test(what_is_taken_is_what_it_was),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Validators at the borders of stages: silent on what the stages make, loud on each of these faults. */
#include "suite.h"
#include "run/border_checks.h"
#include "run/driver.h"
#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

typedef struct border {
    qw_run_state *run;
    qw_stage stage;
} border;

static void check(void *user)
{
    border *b = user;
    qw_check_border(b->run, b->stage);
}

typedef struct fault {
    qw_stage stage;
    const char *word; /* of the message */
    void (*spoil)(qw_run_state *run);
} fault;

static void clean_twin(qw_run_state *r) { r->whole.clean.mesh.twin[5] = r->whole.clean.mesh.twin[4]; }
static void clean_area(qw_run_state *r) { r->whole.area = NAN; }
static void core_times(qw_run_state *r) { r->mirror.times = 9; }
static void surface_twin(qw_run_state *r) { r->surface.twin[5] = r->surface.twin[4]; }
static void surface_position(qw_run_state *r) { r->surface.position[2].x = NAN; }
static void working_size(qw_run_state *r) { r->rho = NAN; }
static void working_position(qw_run_state *r) { r->working.mesh.position[3].y = INFINITY; }
static void working_target(qw_run_state *r) { r->working.target[7] = 0; }
static void working_topology(qw_run_state *r)
{
    r->surface.face_count = 1, r->surface.twin[0] = r->surface.twin[1] = r->surface.twin[2] = QW_NONE;
}
static void hierarchy_parent(qw_run_state *r) { r->hierarchy->level[0].parent[2] = QW_NONE; }
static void hierarchy_color(qw_run_state *r)
{
    r->hierarchy->level[1].by_color[0] = r->hierarchy->level[1].by_color[1];
}
static void orientation(qw_run_state *r) { r->orientation[9] = qw_v3(0, 0, 0); }
static void size(qw_run_state *r) { r->size[1] = -1; }
static void lattice(qw_run_state *r) { r->lattice[1].x = NAN; }
static void offset_edge(qw_run_state *r) { r->offsets.edge[0] = r->offsets.edge[1]; }
static void regular(qw_run_state *r) { r->regular.d[0].x += 1; }
static void inversion_free_size(qw_run_state *r) { r->inversion_free.size[0] = 0; }
static void quads(qw_run_state *r) { r->extraction.quads.position[0].z = NAN; }
static void placed(qw_run_state *r) { r->embedded.position[0].z = -INFINITY; }
static void repaired(qw_run_state *r) { r->repaired.corner[0] = r->repaired.corner[2]; }
static void relaxed(qw_run_state *r) { r->relaxed.position[0].x = NAN; }
static void simplified(qw_run_state *r) { r->simplified.corner[0] = r->simplified.corner[2]; }
static void fitted(qw_run_state *r) { r->fitted.position[0].x = NAN; }
static void output(qw_run_state *r) { r->output[5] = NAN; }
static void no_quads(qw_run_state *r) { r->finished.face_count = 0; }

static const fault faults[] = {
    {QW_STAGE_CLEAN, "", clean_twin},
    {QW_STAGE_CLEAN, "area", clean_area},
    {QW_STAGE_CORE, "times", core_times},
    {QW_STAGE_SURFACE, "", surface_twin},
    {QW_STAGE_SURFACE, "finite", surface_position},
    {QW_STAGE_WORKING, "size", working_size},
    {QW_STAGE_WORKING, "finite", working_position},
    {QW_STAGE_WORKING, "target", working_target},
    {QW_STAGE_WORKING, "Euler", working_topology},
    {QW_STAGE_HIERARCHY, "parent", hierarchy_parent},
    {QW_STAGE_HIERARCHY, "colour", hierarchy_color},
    {QW_STAGE_ORIENTATION, "direction", orientation},
    {QW_STAGE_SCALE, "size", size},
    {QW_STAGE_POSITION, "lattice", lattice},
    {QW_STAGE_OFFSETS, "", offset_edge},
    {QW_STAGE_REGULAR, "close", regular},
    {QW_STAGE_INVERSIONS, "size", inversion_free_size},
    {QW_STAGE_QUADS, "finite", quads},
    {QW_STAGE_POSITIONS, "finite", placed},
    {QW_STAGE_REPAIR, "", repaired},
    {QW_STAGE_SIMPLIFY, "", simplified},
    {QW_STAGE_RELAX, "", relaxed},
    {QW_STAGE_FINISH, "finite", fitted},
    {QW_STAGE_ASSEMBLE, "output", output},
    {QW_STAGE_ASSEMBLE, "no quads", no_quads},
};

/* The driver's own memory: what a fault has spoilt is not to be run any further. */
static void fault_is_found(void **state)
{
    const fault *f = *state;
    shape torus = shape_torus(6);
    qw_context *context;
    qw_mesh_view view = shape_view(&torus);
    qw_options options;
    qw_options_init(&options);
    options.faces = 200;
    options.threads = 1;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run_until(context, &options, f->stage), QW_OK);
    qw_context_state *c = (qw_context_state *)context; /* its first member */
    border b = {&c->run, f->stage};
    assert_int_equal(qw_protect(c->env, check, &b), QW_OK);
    f->spoil(&c->run);
    assert_int_equal(qw_protect(c->env, check, &b), QW_INTERNAL);
    if (!strstr(qw_env_message(c->env), f->word))
        fail_msg("\"%s\" does not speak of \"%s\"", qw_env_message(c->env), f->word);
    qw_destroy(context);
    shape_free(&torus);
}

QW_TEST_SUITE(borders)
{
    enum { COUNT = sizeof faults / sizeof *faults };
    struct CMUnitTest tests[COUNT];
    for (int i = 0; i < COUNT; i++)
        tests[i] = (struct CMUnitTest){.name = qw_stage_title(faults[i].stage),
                                       .test_func = fault_is_found,
                                       .initial_state = (void *)(uintptr_t)&faults[i]};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

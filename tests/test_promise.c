/* The promise (all quads, manifold, oriented, the topology and the place of the input, the count that was asked for),
 * on whole runs over shapes of known topology, at few and at many faces. The figures are those of qw_measure, which
 * knows nothing of the run. */
#include "suite.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

typedef struct subject {
    const char *name;
    shape (*make)(int k);
    int k;
    bool one_sided;
} subject;

static const subject subjects[] = {
    {"sphere", shape_sphere, 12, false},
    {"torus", shape_torus, 12, false},
    {"cube", shape_cube, 10, false},
    {"cube of twelve triangles", shape_cube, 1, false},
    {"double torus", shape_double_torus, 5, false},
    {"double frame", shape_double_frame, 4, false},
    {"disc", shape_disc, 24, false},
    {"annulus", shape_annulus, 10, false},
    {"moebius", shape_moebius, 10, true},
    {"two cubes", shape_two_cubes, 8, false},
    {"thin plate", shape_plate, 16, false},
    {"one triangle", shape_one_triangle, 1, false},
    {"tetrahedron", shape_tetrahedron, 1, false},
    {"regular tetrahedron", shape_regular_tetrahedron, 1, false},
};
typedef struct pick {
    const char *subject;
    int64_t faces;
} pick;

static const pick held_trials[] = {
    {"sphere", 100},
    {"torus", 100},
    {"cube", 100},
    {"cube of twelve triangles", 100},
    {"double frame", 100},
    {"double frame", 500},
    {"disc", 100},
    {"annulus", 100},
    {"two cubes", 100},
    {"thin plate", 100},
    {"one triangle", 100},
    {"tetrahedron", 100},
    {"regular tetrahedron", 110}, /* four cones of three in one place took a tip along */
    {"sphere", 500},
    {"torus", 500},
    {"cube", 500},
    {"cube of twelve triangles", 500},
    {"double torus", 500},
    {"disc", 500},
    {"annulus", 500},
    {"two cubes", 500},
    {"thin plate", 500},
    {"one triangle", 500},
    {"tetrahedron", 500},
    {"tetrahedron", 2000},
    {"thin plate", 2000},
    {"sphere", 2000},
    {"torus", 2000},
    {"cube", 2000},
    {"cube of twelve triangles", 2000},
    {"double torus", 2000},
    {"double frame", 2000},
    {"disc", 2000},
    {"annulus", 2000},
    {"two cubes", 2000},
    {"one triangle", 2000},
};
/* These do not hold yet. docs/dev/testing.md tells what is missing; one that comes to hold moves up. */
static const pick open_trials[] = {
    {"double torus", 100},
    {"moebius", 100},
    {"moebius", 500},
    {"moebius", 2000},
};
enum {
    SUBJECTS = sizeof subjects / sizeof *subjects,
    HELD = sizeof held_trials / sizeof *held_trials,
    OPEN = sizeof open_trials / sizeof *open_trials,
};

typedef struct trial {
    const subject *subject;
    int64_t faces;
    char name[64];
    int broken; /* parts of the promise */
} trial;

static void expect(trial *t, bool kept, const char *what, double is)
{
    if (kept) return;
    print_message("%s: %s, but it is %g\n", t->name, what, is);
    t->broken++;
}

static void compare(trial *t, int64_t out, int64_t in, const char *what)
{
    if (out == in) return;
    print_message("%s: %s should be %lld, but it is %lld\n", t->name, what, (long long)in, (long long)out);
    t->broken++;
}

static void check_topology(trial *t, const qw_topology *out, const qw_topology *in, const qw_report *report)
{
    compare(t, out->quads, out->faces, "quads");
    compare(t, out->degenerate_faces, 0, "degenerate faces");
    compare(t, out->duplicate_faces, 0, "duplicate faces");
    compare(t, out->nonmanifold_edges, 0, "edges of more than two faces");
    compare(t, out->nonmanifold_vertices, 0, "vertices of several fans");
    compare(t, out->isolated_vertices, 0, "isolated vertices");
    compare(t, out->components, in->components, "components");
    compare(t, out->boundary_loops, in->boundary_loops, "boundary loops");
    compare(t, out->euler, in->euler, "the Euler number");
    if (t->subject->one_sided)
        expect(t, report->one_sided_seam_edges > 0, "the report should tell of the seam",
               (double)report->one_sided_seam_edges);
    else compare(t, out->inconsistent_edges, 0, "edges of inconsistent faces");
    compare(t, report->position_singularities_after, 0, "position singularities");
}

static void check_quality(trial *t, const qw_topology *out, const qw_quality *quality)
{
    double off = (double)out->faces / (double)t->faces - 1;
    expect(t, fabs(off) <= (t->faces < 500 ? 0.05 : 0.02), "the count should be the one asked for", (double)out->faces);
    if (!t->subject->one_sided)
        compare(t, quality->flipped_faces, 0, "flipped faces"); /* there, half of the input's are as well */
    expect(t, quality->out_to_in_mean < 0.1, "the quads should lie on the input", quality->out_to_in_mean);
    expect(t, quality->in_to_out_mean < 0.1, "the quads should cover the input", quality->in_to_out_mean);
    expect(t, quality->hausdorff < 0.5, "no point should be half an edge away", quality->hausdorff);
}

static void keeps_the_promise(void **state)
{
    trial *t = *state;
    shape input = t->subject->make(t->subject->k);
    qw_mesh_view view = shape_view(&input);
    qw_options options;
    qw_options_init(&options);
    options.faces = t->faces;
    qw_result *result;
    qw_status status = qw_remesh(&view, &options, NULL, &result);
    if (status != QW_OK) {
        print_message("%s: %s: %s\n", t->name, qw_status_name(status), qw_result_message(result));
        t->broken++;
    } else {
        qw_mesh_view quads = qw_result_mesh(result);
        qw_topology in, out;
        qw_quality quality;
        assert_int_equal(qw_measure(&view, NULL, NULL, &in, &quality), QW_OK);
        assert_int_equal(qw_measure(&quads, &view, NULL, &out, &quality), QW_OK);
        check_topology(t, &out, &in, qw_result_report(result));
        check_quality(t, &out, &quality);
    }
    qw_result_destroy(result);
    shape_free(&input);
    assert_int_equal(t->broken, 0);
}

static const subject *find_subject(const char *name)
{
    for (size_t i = 0; i < SUBJECTS; i++)
        if (!strcmp(subjects[i].name, name)) return &subjects[i];
    fprintf(stderr, "no subject is called %s\n", name);
    exit(2);
}

static void add_trials(const pick *picks, size_t count, trial *trials, struct CMUnitTest *tests)
{
    for (size_t i = 0; i < count; i++) {
        trial *t = &trials[i];
        t->subject = find_subject(picks[i].subject);
        t->faces = picks[i].faces;
        snprintf(t->name, sizeof t->name, "%s at %lld faces", t->subject->name, (long long)t->faces);
        tests[i] = (struct CMUnitTest){.name = t->name, .test_func = keeps_the_promise, .initial_state = t};
    }
}

/* An argument picks the trials whose names match it. QW_OPEN_TRIALS in the environment adds those that do not hold yet.
 */
QW_TEST_SUITE(promise)
{
    static trial trials[HELD + OPEN];
    struct CMUnitTest held[HELD], open[OPEN];
    add_trials(held_trials, HELD, trials, held);
    add_trials(open_trials, OPEN, trials + HELD, open);
    int failed = cmocka_run_group_tests(held, NULL, NULL);
    if (getenv("QW_OPEN_TRIALS")) failed += cmocka_run_group_tests(open, NULL, NULL);
    else printf("%d trials are known to fail: run with QW_OPEN_TRIALS=1\n", (int)OPEN);
    return failed;
}

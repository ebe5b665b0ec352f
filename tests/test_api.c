/* Contexts as a host meets them: options that change between runs, calls out of place, bad arguments, memory that runs
 * out at every allocation, a cancel at every call, and the same bytes whoever runs the tasks. */
#include "faults.h"
#include "suite.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

static qw_options options_for(int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    options.threads = 1;
    return options;
}

static qw_context *with_mesh(const shape *s, const qw_host *host)
{
    qw_context *context;
    qw_mesh_view view = shape_view(s);
    assert_int_equal(qw_create(host, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    return context;
}

static bool same_mesh(const qw_context *a, const qw_context *b)
{
    qw_mesh_view x, y;
    assert_int_equal(qw_get_mesh(a, &x), QW_OK);
    assert_int_equal(qw_get_mesh(b, &y), QW_OK);
    assert_true(x.face_count > 0);
    return x.vertex_count == y.vertex_count && x.face_count == y.face_count &&
           memcmp(x.positions, y.positions, (size_t)x.vertex_count * 3 * sizeof(double)) == 0 &&
           memcmp(x.corners, y.corners, (size_t)x.face_count * 4 * sizeof(uint32_t)) == 0;
}

/* The account of the count: what each mechanism has added and taken is the result's. */
static void assert_account(const qw_report *r)
{
    int64_t sum = r->count_integers + r->count_repaired + r->count_rebuilt + r->count_simplified + r->count_cut +
                  r->count_chords_removed + r->count_quads_removed + r->count_added + r->count_grown +
                  r->count_finished + r->count_assembled;
    assert_int_equal(sum, r->topology.faces);
    assert_true(r->count_integers > 0 && r->count_chords_removed <= 0 && r->count_quads_removed <= 0);
    assert_true(r->count_added >= 0);
}

/* What does not depend on the clock. */
static void assert_same_report(const qw_context *a, const qw_context *b)
{
    qw_report x = *qw_get_report(a), y = *qw_get_report(b);
    assert_account(&x);
    x.seconds = y.seconds = 0, x.peak_bytes = y.peak_bytes = 0;
    memset(x.stages, 0, sizeof x.stages), memset(y.stages, 0, sizeof y.stages);
    assert_memory_equal(&x, &y, sizeof x);
}

static qw_context *fresh_run(const shape *s, const qw_options *options)
{
    qw_context *context = with_mesh(s, NULL);
    assert_int_equal(qw_run(context, options), QW_OK);
    return context;
}

/* ---- options */

typedef struct change {
    const char *name, *value;
} change;

static const change changes[] = {
    {"relax", "off"},        {"repair", "off"},
    {"sat", "on"},           {"flow", "mf"},
    {"cost", "plain"},       {"seed", "7"},
    {"adaptive", "0.8"},     {"smoothness", "0"},
    {"faces", "170"},        {"threads", "2"},
    {"sharp_angle", "180"},  {"align_boundary", "off"},
    {"evenness", "0.9"},     {"sharp_marks", "on"},
    {"keep_marks", "on"},    {"min_component", "0.1"},
    {"outward", "off"},      {"follow", "0"},
    {"rings", "1"},          {"around", "12"},
    {"symmetry", "x"},       {"symmetry_follow", "on"},
    {"symmetry_x", "1"},     {"symmetry_y", "1"},
    {"symmetry_z", "1"},     {"symmetry_offset", "0.2"},
    {"fix_boundary", "on"},  {"loops", "0"},
    {"fit", "0.5"},          {"region_rim", "free"},
    {"wrap", "on"},          {"wrap_distance", "0.1"},
    {"subdivide", "1"},      {"fit_to", "limit"},
    {"fill_holes", "40"},    {"fast", "draft"},
    {"wrap_quads", "0.5"},   {"exact", "0"},
    {"jacobian_min", "0.3"}, {"follow_motion", "1"},
};
enum { CHANGES = sizeof changes / sizeof *changes };

/* After a run with other options, the same as if there had been none: one option away and back, and from each to the
 * next. */
static void changed_options(shape *s, int64_t faces)
{
    qw_options first = options_for(faces);
    first.sat = 0; /* the longest stage by far */
    qw_context *context = fresh_run(s, &first), *unchanged = fresh_run(s, &first), *fresh_runs[CHANGES];
    for (int i = 0; i < 2 * CHANGES; i++) {
        const change *c = &changes[i % CHANGES];
        qw_options second = first;
        assert_int_equal(qw_option_set(&second, c->name, c->value, NULL, 0), QW_OK);
        assert_int_equal(qw_run(context, &second), QW_OK);
        if (i < CHANGES) fresh_runs[i] = fresh_run(s, &second);
        qw_context *fresh = fresh_runs[i % CHANGES];
        if (!same_mesh(context, fresh)) fail_msg("%s=%s after another run differs from a fresh one", c->name, c->value);
        assert_same_report(context, fresh);
        if (i >= CHANGES) continue;
        assert_int_equal(qw_run(context, &first), QW_OK);
        if (!same_mesh(context, unchanged)) fail_msg("%s taken back differs from never set", c->name);
        assert_same_report(context, unchanged);
    }
    for (int i = 0; i < CHANGES; i++) qw_destroy(fresh_runs[i]);
    qw_destroy(context);
    qw_destroy(unchanged);
}

static void options_change_between_runs(void **state)
{
    (void)state;
    shape disc = shape_disc(8), torus = shape_torus(6);
    changed_options(&disc, 40);
    changed_options(&torus, 80);
    shape_free(&disc), shape_free(&torus);
}

/* What does not depend on the count is kept from run to run, and what is made of it is what a fresh run makes. */
static void a_dense_surface_serves_other_counts(void **state)
{
    (void)state;
    shape s = shape_torus(20);
    static const int64_t counts[] = {60, 50, 90, 250, 1200}; /* up to 100, 100, 100, 316, 3162 */
    qw_options options = options_for(counts[0]);
    qw_context *context = fresh_run(&s, &options);
    double cleaning = qw_get_report(context)->stages[QW_STAGE_CLEAN].seconds,
           marking = qw_get_report(context)->stages[QW_STAGE_SURFACE].seconds;
    for (int i = 1; i < 5; i++) {
        options = options_for(counts[i]);
        qw_context *fresh = fresh_run(&s, &options);
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_true(same_mesh(context, fresh));
        assert_same_report(context, fresh);
        const qw_report *report = qw_get_report(context);
        assert_true(report->stages[QW_STAGE_CLEAN].seconds == cleaning);
        assert_true((report->stages[QW_STAGE_SURFACE].seconds == marking) == (i < 3));
        qw_destroy(fresh);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* Legs thinner than quads, on two bodies, so that what a round makes of one may be put with what another makes of the
 * other. */
static shape two_spiders(void)
{
    qw_mesh *mesh;
    assert_int_equal(qw_load(QW_TEST_DATA "/regress/spiders.obj", NULL, &mesh), QW_OK);
    qw_mesh_view view = qw_mesh_get(mesh);
    shape s = {view.vertex_count, view.face_count, malloc(3 * view.vertex_count * sizeof *s.position),
               malloc(3 * view.face_count * sizeof *s.corner)};
    memcpy(s.position, view.positions, 3 * view.vertex_count * sizeof *s.position);
    memcpy(s.corner, view.corners, 3 * view.face_count * sizeof *s.corner);
    qw_mesh_destroy(mesh);
    return s;
}

/* Legs are lost at so few quads and looked for in other rounds; none of those comes into the next run. */
static void rounds_are_forgotten(void **state)
{
    (void)state;
    shape s = two_spiders();
    static const int64_t counts[] = {10, 90, 10, 60}; /* of 10 there are too few for another round */
    static const double evenness[] = {0.5, 0.9};
    qw_context *context = NULL;
    uint32_t attempts = 0;
    for (int i = 0; i < 8; i++) {
        qw_options options = options_for(counts[i / 2]);
        options.evenness = evenness[i % 2];
        qw_context *fresh = fresh_run(&s, &options);
        if (!context) context = fresh_run(&s, &options);
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_true(same_mesh(context, fresh));
        assert_same_report(context, fresh);
        attempts += qw_get_report(fresh)->attempts;
        qw_destroy(fresh);
    }
    assert_true(attempts >= 4);
    qw_destroy(context);
    shape_free(&s);
}

/* A small cube beside a large one goes when that is asked for, and the report says so. */
static void small_components_are_dropped(void **state)
{
    (void)state;
    shape s = shape_two_cubes(4);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        for (int k = 0; k < 3 && s.position[3 * v] >= 1.5; k++)
            s.position[3 * v + (uint32_t)k] = 2 + 0.1 * (s.position[3 * v + (uint32_t)k] - 2);
    qw_options options = options_for(200);
    for (int dropped = 0; dropped < 2; dropped++) {
        assert_int_equal(qw_option_set(&options, "min-component", dropped ? "0.05" : "0", NULL, 0), QW_OK);
        qw_context *context = fresh_run(&s, &options);
        const qw_report *report = qw_get_report(context);
        assert_int_equal(report->dropped_components, dropped);
        assert_int_equal(report->components, 2 - dropped);
        assert_int_equal(report->topology.components, 2 - dropped);
        qw_destroy(context);
    }
    shape_free(&s);
}

static void every_option_is_tried(void **state)
{
    (void)state;
    static const char *const other_targets[] = {"vertices", "edge_length", "ratio"}; /* as faces are */
    for (size_t i = 0; i < qw_option_count(); i++) {
        bool tried = false;
        for (int k = 0; k < CHANGES; k++) tried |= strcmp(changes[k].name, qw_option_at(i)->name) == 0;
        for (int k = 0; k < 3; k++) tried |= strcmp(other_targets[k], qw_option_at(i)->name) == 0;
        if (!tried) fail_msg("option %s is not among the changes of this test", qw_option_at(i)->name);
    }
}

/* A view of the context's own result may be what it gets next; a mesh that is refused leaves what there was. */
static void the_result_goes_back_in(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options options = options_for(130);
    qw_context *context = fresh_run(&s, &options), *other = with_mesh(&s, NULL);
    qw_mesh_view view;
    for (int round = 0; round < 3; round++) {
        assert_int_equal(qw_get_mesh(context, &view), QW_OK);
        assert_int_equal(qw_set_mesh(other, &view), QW_OK);
        assert_int_equal(qw_set_mesh(context, &view), QW_OK);
        assert_int_equal(qw_get_mesh(context, &view), QW_NOT_READY);
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_int_equal(qw_run(other, &options), QW_OK);
        assert_true(same_mesh(context, other));
        assert_same_report(context, other);
        assert_int_equal(qw_set_mesh(context, NULL), QW_ARGUMENT);
        assert_true(same_mesh(context, other));
    }
    qw_destroy(context);
    qw_destroy(other);
    shape_free(&s);
}

/* Memory that runs out while the next mesh is copied leaves the one that is there, with its result. */
static void no_memory_for_the_next(void **state)
{
    (void)state;
    shape s = shape_torus(6), next = shape_cube(3);
    qw_options options = options_for(130);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    const qw_host host = faults_host(&f);
    qw_context *context = with_mesh(&s, &host), *other = fresh_run(&s, &options);
    qw_mesh_view view = shape_view(&next);
    assert_int_equal(qw_run(context, &options), QW_OK);
    for (int n = 0;; n++) {
        f.allocations = n;
        qw_status status = qw_set_mesh(context, &view);
        f.allocations = FAULTS_NONE;
        if (status == QW_OK) break;
        assert_int_equal(status, QW_MEMORY);
        assert_true(same_mesh(context, other) && n < 20);
    }
    qw_destroy(context), qw_destroy(other);
    shape_free(&s), shape_free(&next);
}

/* An edge length or a ratio that asks for more than there can be, at once and also after another count. */
static void too_many_quads(void **state)
{
    (void)state;
    shape s = shape_cube(3);
    qw_options options = options_for(20000000);
    qw_context *context = with_mesh(&s, NULL);
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_SURFACE), QW_OK);
    options.faces = 0, options.edge_length = 1e-9;
    assert_int_equal(qw_run(context, &options), QW_OPTION);
    assert_non_null(strstr(qw_message(context), "edge_length, 1e-09, asks for"));
    assert_non_null(strstr(qw_message(context), "20000000"));
    options.edge_length = 0.5;
    assert_int_equal(qw_run(context, &options), QW_OK);
    qw_destroy(context);
    shape_free(&s);
}

static bool warns_of(const qw_context *context, const char *text)
{
    const qw_report *report = qw_get_report(context);
    for (uint32_t i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], text)) return true;
    return false;
}

/* What cleaning did that a user may not expect stands among the warnings. */
static void cleaning_is_told(void **state)
{
    (void)state;
    qw_options options = options_for(60);
    shape s = shape_two_cubes(3);
    uint32_t half = s.face_count / 2;
    for (uint32_t f = 0; f < half; f++) { /* the first cube inside out */
        uint32_t keep = s.corner[3 * f];
        s.corner[3 * f] = s.corner[3 * f + 1], s.corner[3 * f + 1] = keep;
    }
    for (int outward = 1; outward >= 0; outward--) {
        options.outward = outward;
        qw_context *context = fresh_run(&s, &options);
        assert_int_equal(qw_get_report(context)->turned_components, outward);
        assert_int_equal(warns_of(context, "1 closed component turned outward"), outward);
        qw_mesh_view view;
        assert_int_equal(qw_get_mesh(context, &view), QW_OK);
        double volume = 0; /* of both, by the divergence theorem, each about its own middle as both are closed */
        for (uint32_t f = 0; f < view.face_count; f++)
            for (uint32_t t = 1; t < 3; t++) {
                const double *a = view.positions + 3 * view.corners[4 * f],
                             *b = view.positions + 3 * view.corners[4 * f + t],
                             *c = view.positions + 3 * view.corners[4 * f + t + 1];
                volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
                           a[2] * (b[0] * c[1] - b[1] * c[0])) /
                          6;
            }
        if (outward) assert_true(volume > 1);
        else assert_true(fabs(volume) < 0.2);
        qw_destroy(context);
    }
    options.outward = 1;
    for (uint32_t f = 0; f < half - 1; f++) { /* all of the first but its last face are right again */
        uint32_t keep = s.corner[3 * f];
        s.corner[3 * f] = s.corner[3 * f + 1], s.corner[3 * f + 1] = keep;
    }
    memcpy(s.corner + 3 * (half + 1), s.corner + 3 * half, 3 * sizeof *s.corner); /* twice the same */
    qw_context *context = fresh_run(&s, &options);
    assert_true(warns_of(context, "1 triangle flipped to agree"));
    assert_true(warns_of(context, "1 triangle dropped"));
    assert_false(warns_of(context, "turned outward"));
    qw_destroy(context);
    shape_free(&s);
}

/* A Klein bottle gets a seam, as a Moebius strip does, and is told so. */
static void one_sided_surfaces_are_told(void **state)
{
    (void)state;
    shape bottles[2] = {shape_klein(12), shape_moebius(6)};
    for (int i = 0; i < 2; i++) {
        qw_options options = options_for(300);
        qw_context *context = fresh_run(&bottles[i], &options);
        assert_true(qw_get_report(context)->one_sided_seam_edges > 0);
        assert_true(qw_get_report(context)->boundary_loops > 0);
        assert_true(warns_of(context, "Klein bottle, was cut open along a seam"));
        qw_destroy(context);
        shape_free(&bottles[i]);
    }
}

/* Stage by stage, with options that change on the way. */
static void options_change_within_a_run(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options first = options_for(130), second = first;
    second.flow = 0, second.adaptive = 0.5;
    qw_context *fresh = fresh_run(&s, &second);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        qw_context *context = with_mesh(&s, NULL);
        assert_int_equal(qw_run_until(context, &first, (qw_stage)stage), QW_OK);
        assert_int_equal(qw_run(context, &second), QW_OK);
        assert_true(same_mesh(context, fresh));
        assert_int_equal(qw_run_until(context, &second, QW_STAGE_CLEAN), QW_OK); /* done already: nothing is lost */
        assert_true(same_mesh(context, fresh));
        qw_destroy(context);
    }
    qw_destroy(fresh);
    shape_free(&s);
}

/* Figures of stages whose results other options discard are 0 again. */
static void stale_figures_are_forgotten(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options first = options_for(130), second = first;
    second.adaptive = 0;
    qw_context *context = fresh_run(&s, &first);
    const qw_report *report = qw_get_report(context);
    assert_true(report->angle_rms > 0 && report->working_vertices > 0);
    assert_int_equal(qw_run_until(context, &second, QW_STAGE_SURFACE), QW_OK);
    assert_int_equal(report->input_faces, s.face_count);
    assert_true(report->angle_rms == 0 && report->working_vertices == 0 && report->stages[QW_STAGE_RELAX].seconds == 0);
    qw_destroy(context);
    shape_free(&s);
}

/* ---- arguments */

static void before_its_time(void **state)
{
    (void)state;
    shape s = shape_cube(3);
    qw_options options = options_for(40);
    qw_mesh_view view;
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_string_equal(qw_message(context), "");
    assert_int_equal(qw_get_report(context)->size, sizeof(qw_report));
    assert_int_equal(qw_run(context, &options), QW_NOT_READY);
    assert_non_null(strstr(qw_message(context), "qw_set_mesh"));
    assert_int_equal(qw_get_mesh(context, &view), QW_NOT_READY);
    assert_int_equal(view.size, sizeof view);
    assert_int_equal(view.face_count, 0);
    view = shape_view(&s);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_string_equal(qw_message(context), "");
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_REPAIR), QW_OK);
    assert_int_equal(qw_get_mesh(context, &view), QW_NOT_READY);
    assert_int_equal(qw_run(context, &options), QW_OK);
    assert_int_equal(qw_get_mesh(context, &view), QW_OK);
    assert_int_equal(view.uniform_face_size, 4);
    assert_null(view.face_sizes);
    qw_mesh_view again = shape_view(&s);
    assert_int_equal(qw_set_mesh(context, &again), QW_OK);
    assert_int_equal(qw_get_mesh(context, &view), QW_NOT_READY);
    assert_int_equal(qw_get_report(context)->input_faces, 0);
    qw_destroy(context);
    shape_free(&s);
}

/* Ten digits are more than single precision means, and all that a coordinate of a small shape has. */
static void coordinates_are_short(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options options = options_for(300);
    qw_context *c = fresh_run(&s, &options);
    qw_mesh_view quads;
    assert_int_equal(qw_get_mesh(c, &quads), QW_OK);
    for (size_t i = 0; i < 3 * (size_t)quads.vertex_count; i++) {
        char text[64];
        snprintf(text, sizeof text, "%.10g", quads.positions[i]);
        assert_true(strtod(text, NULL) == quads.positions[i]);
    }
    qw_destroy(c);
    shape_free(&s);
}

static void refused(qw_context *context, const qw_mesh_view *mesh, qw_status expected, const char *says)
{
    assert_int_equal(qw_set_mesh(context, mesh), expected);
    if (!strstr(qw_message(context), says)) fail_msg("\"%s\" does not say \"%s\"", qw_message(context), says);
}

static void bad_meshes(void **state)
{
    (void)state;
    shape s = shape_tetrahedron(1);
    qw_context *context = with_mesh(&s, NULL);
    qw_mesh_view view = shape_view(&s);
    refused(context, NULL, QW_ARGUMENT, "no mesh");
    view.size = 4, refused(context, &view, QW_ARGUMENT, "size"), view = shape_view(&s);
    view.positions = NULL, refused(context, &view, QW_ARGUMENT, "positions"), view = shape_view(&s);
    view.corners = NULL, refused(context, &view, QW_ARGUMENT, "corners"), view = shape_view(&s);
    view.face_count = 0, refused(context, &view, QW_NO_FACES, "no faces"), view = shape_view(&s);
    view.vertex_count = 3, refused(context, &view, QW_INDEX_RANGE, "vertex 3 of 3"), view = shape_view(&s);
    for (uint32_t size = 0; size < 3; size++)
        view.uniform_face_size = size, refused(context, &view, QW_ARGUMENT, "corners; the least is 3");
    static const uint32_t sizes[][4] = {
        {3, 3, 3, 2}, {3, 0, 3, 3}, {3, 3, UINT32_MAX, 3}, {UINT32_MAX / 2, UINT32_MAX / 2, 3, 3}};
    static const qw_status statuses[] = {QW_ARGUMENT, QW_ARGUMENT, QW_TOO_LARGE, QW_TOO_LARGE};
    for (int i = 0; i < 4; i++) view.face_sizes = sizes[i], refused(context, &view, statuses[i], "corners");
    static const double wrong[] = {NAN, INFINITY, -INFINITY};
    for (int i = 0; i < 12; i++) {
        double *p = &s.position[i], right = *p;
        view = shape_view(&s);
        *p = wrong[i % 3], refused(context, &view, QW_NOT_FINITE, "is not finite");
        *p = i % 2 ? 1.7e308 : -1.01e300, refused(context, &view, QW_TOO_LARGE, "the most is 1e+300"), *p = right;
    }
    qw_options options = options_for(30);
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_CLEAN), QW_OK); /* what was there before stays */
    qw_destroy(context);
    shape_free(&s);
}

static void bad_calls(void **state)
{
    (void)state;
    shape s = shape_cube(2);
    qw_mesh_view view = shape_view(&s);
    qw_context *context = with_mesh(&s, NULL);
    qw_options options = options_for(40);
    assert_int_equal(qw_create(NULL, NULL), QW_ARGUMENT);
    assert_int_equal(qw_set_mesh(NULL, &view), QW_ARGUMENT);
    assert_int_equal(qw_run(NULL, &options), QW_ARGUMENT);
    assert_int_equal(qw_run(context, NULL), QW_ARGUMENT);
    assert_true(strlen(qw_message(context)) > 0);
    assert_int_equal(qw_run_until(context, &options, QW_STAGE_COUNT), QW_ARGUMENT);
    assert_int_equal(qw_run_until(context, &options, (qw_stage)-1), QW_ARGUMENT);
    assert_int_equal(qw_get_mesh(NULL, &view), QW_ARGUMENT);
    assert_int_equal(qw_get_mesh(context, NULL), QW_ARGUMENT);
    assert_null(qw_get_report(NULL));
    assert_string_equal(qw_message(NULL), "no context");
    qw_destroy(NULL);
    options.faces = -1;
    assert_int_equal(qw_run(context, &options), QW_OPTION);
    assert_non_null(strstr(qw_message(context), "faces"));
    options = options_for(40), options.size = 0;
    assert_int_equal(qw_run(context, &options), QW_OPTION);
    options = options_for(40), options.ratio = 0.5;
    assert_int_equal(qw_run(context, &options), QW_OPTION);
#define QW_OPTION_COUNT(name, stage, initial, least, most, unit, help)
#define QW_OPTION_FLAG(name, stage, initial, help)
#define QW_OPTION_CHOICE(name, stage, initial, last, list, help)
#define QW_OPTION_REAL(name, stage, initial, least, most, unit, help) \
    options = options_for(40), options.name = NAN;                    \
    assert_int_equal(qw_run(context, &options), QW_OPTION);           \
    assert_non_null(strstr(qw_message(context), #name));              \
    options.name = INFINITY;                                          \
    assert_int_equal(qw_run(context, &options), QW_OPTION);           \
    assert_non_null(strstr(qw_message(context), #name));
#include "quadwright/options.def"
    options = options_for(40);
    assert_int_equal(qw_run(context, &options), QW_OK);
    assert_string_equal(qw_message(context), "");
    qw_destroy(context);
    shape_free(&s);
}

static void the_short_way(void **state)
{
    (void)state;
    shape s = shape_cube(2);
    qw_mesh_view view = shape_view(&s);
    qw_options options = options_for(40);
    qw_result *result;
    assert_int_equal(qw_remesh(&view, &options, NULL, NULL), QW_ARGUMENT);
    assert_int_equal(qw_remesh(NULL, &options, NULL, &result), QW_ARGUMENT);
    assert_true(strlen(qw_result_message(result)) > 0);
    assert_int_equal(qw_result_mesh(result).face_count, 0);
    assert_non_null(qw_result_report(result));
    qw_result_destroy(result);
    assert_int_equal(qw_remesh(&view, NULL, NULL, &result), QW_ARGUMENT);
    qw_result_destroy(result);
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
    assert_string_equal(qw_result_message(result), "");
    assert_true(qw_result_mesh(result).face_count > 0);
    const qw_report *report = qw_result_report(result);
    assert_int_equal(report->faces_asked, 40);
    assert_int_equal(report->topology.quads, qw_result_mesh(result).face_count);
    assert_int_equal(report->topology.vertices, qw_result_mesh(result).vertex_count);
    assert_true(report->mean_edge > 0 && report->angle_rms >= 0 && report->area_cv >= 0);
    assert_true(report->seconds > 0 && report->peak_bytes > 0);
    qw_result_destroy(result);
    qw_result_destroy(NULL);
    assert_string_equal(qw_result_message(NULL), "out of memory");
    assert_int_equal(qw_result_mesh(NULL).vertex_count, 0);
    shape_free(&s);
}

static void two_contexts_interleaved(void **state)
{
    (void)state;
    shape disc = shape_disc(7), torus = shape_torus(5);
    qw_options one = options_for(50), two = options_for(110);
    two.seed = 3, two.threads = 2;
    qw_context *direct_one = fresh_run(&disc, &one), *direct_two = fresh_run(&torus, &two);
    qw_context *a = with_mesh(&disc, NULL), *b = with_mesh(&torus, NULL);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        assert_int_equal(qw_run_until(a, &one, (qw_stage)stage), QW_OK);
        assert_int_equal(qw_run_until(b, &two, (qw_stage)stage), QW_OK);
    }
    assert_true(same_mesh(a, direct_one));
    assert_true(same_mesh(b, direct_two));
    qw_destroy(a), qw_destroy(direct_one);
    assert_true(same_mesh(b, direct_two));
    qw_destroy(b), qw_destroy(direct_two);
    shape_free(&disc), shape_free(&torus);
}

/* ---- memory */

static void failing_creation(void **state)
{
    (void)state;
    shape s = shape_cube(1);
    qw_mesh_view view = shape_view(&s);
    for (long n = 0;; n++) {
        faults f = {.allocations = n, .reports = FAULTS_NONE};
        const qw_host host = faults_host(&f);
        qw_context *context;
        qw_status status = qw_create(&host, &context);
        if (status == QW_OK) status = qw_set_mesh(context, &view);
        bool finished = f.allocations >= 0;
        assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
        qw_destroy(context);
        assert_int_equal(f.blocks, 0);
        assert_int_equal(f.held, 0);
        if (finished) break;
    }
    shape_free(&s);
}

/* Each stage fails at its first allocation, then at its second, ... and leaves nothing behind, until it succeeds; the
   stages before it stay, so that all of this costs no more than the allocations of each stage times its own time. */
static void failing_stages(void **state)
{
    (void)state;
    shape s = shape_cube(1);
    qw_options options = options_for(54);
    qw_context *direct = fresh_run(&s, &options);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    const qw_host host = faults_host(&f);
    qw_context *context = with_mesh(&s, &host);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        size_t before = f.held;
        for (long n = 0;; n++) {
            f.allocations = n;
            qw_status status = qw_run_until(context, &options, (qw_stage)stage);
            bool finished = f.allocations >= 0;
            assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
            if (finished) break;
            assert_true(strlen(qw_message(context)) > 0);
            if (stage <= QW_STAGE_POSITION)
                assert_int_equal(f.held, before); /* later ones may have gone back for another attempt */
        }
    }
    f.allocations = FAULTS_NONE;
    assert_true(same_mesh(context, direct));
    qw_destroy(context);
    assert_int_equal(f.blocks, 0);
    assert_int_equal(f.held, 0);
    qw_destroy(direct);
    shape_free(&s);
}

/* The whole run at once, so that attempts are among what fails: a first failure at some hundred places over all of it.
 */
static void failing_runs(void **state)
{
    (void)state;
    shape s = shape_cube(1);
    qw_mesh_view view = shape_view(&s);
    qw_options options = options_for(50);
    for (long n = 0;; n += 1 + n / 40) {
        faults f = {.allocations = n, .reports = FAULTS_NONE};
        const qw_host host = faults_host(&f);
        qw_result *result;
        qw_status status = qw_remesh(&view, &options, &host, &result);
        bool finished = f.allocations >= 0;
        assert_int_equal(status, finished ? QW_OK : QW_MEMORY);
        if (!finished) assert_int_equal(qw_result_mesh(result).face_count, 0);
        qw_result_destroy(result);
        assert_int_equal(f.blocks, 0);
        assert_int_equal(f.held, 0);
        if (finished) break;
    }
    shape_free(&s);
}

static void memory_limit(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options options = options_for(100);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    qw_host host = faults_host(&f);
    qw_context *context = with_mesh(&s, &host);
    assert_int_equal(qw_run(context, &options), QW_OK);
    size_t needed = qw_get_report(context)->peak_bytes;
    assert_true(needed > 0 && needed <= f.most);
    qw_destroy(context);
    for (int part = 0; part <= 8; part++) {
        f = (faults){.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
        host.memory_limit = 20000 + (needed - 20000) * (size_t)part / 8;
        qw_mesh_view view = shape_view(&s);
        assert_int_equal(qw_create(&host, &context), QW_OK);
        size_t own = f.held; /* of the context and its environment, which do not count */
        assert_true(own <= 65536);
        qw_status status = qw_set_mesh(context, &view);
        if (status == QW_OK) status = qw_run(context, &options);
        assert_int_equal(status, part == 8 ? QW_OK : QW_MEMORY);
        if (part < 8) assert_non_null(strstr(qw_message(context), "memory limit"));
        assert_true(f.most <= host.memory_limit + own + 12288);
        qw_destroy(context);
        assert_int_equal(f.held, 0);
    }
    shape_free(&s);
}

/* ---- progress */

typedef struct watcher {
    long calls_left; /* the call that cancels; below zero: none */
    long calls;
    double last;
    bool fell;
} watcher;

static int watch(void *user, qw_stage stage, double fraction)
{
    watcher *w = user;
    assert_in_range((unsigned)stage, 0, QW_STAGE_COUNT - 1);
    w->fell |= fraction < w->last || fraction < 0 || fraction > 1.0000001;
    w->last = fraction;
    w->calls++;
    return w->calls_left-- == 0;
}

static void progress_rises(void **state)
{
    (void)state;
    shape s = shape_torus(6);
    qw_options options = options_for(130);
    watcher w = {.calls_left = -1};
    const qw_host host = {.progress = watch, .progress_user = &w};
    qw_context *context = with_mesh(&s, &host);
    for (int run = 0; run < 4; run++) { /* again with another seed, without relaxation, with more faces */
        w = (watcher){.calls_left = -1};
        if (run == 1) options.seed = 4;
        if (run == 2) options.relax = 0;
        if (run == 3) options.faces = 190;
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_true(w.calls > 0);
        assert_false(w.fell);
        assert_true(w.last == 1);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* Each stage is cancelled at its first call, then at its second, ...; the run that goes on afterwards ends as if
 * nothing had been. */
static void cancelled_at_every_call(void **state)
{
    (void)state;
    shape s = shape_torus(4);
    qw_options options = options_for(110);
    qw_context *direct = fresh_run(&s, &options);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    watcher w = {.calls_left = -1};
    const qw_host host = {.resize = faults_resize, .resize_user = &f, .progress = watch, .progress_user = &w};
    qw_context *context = with_mesh(&s, &host);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++)
        for (long n = 0;; n++) {
            w.calls_left = n;
            qw_status status = qw_run_until(context, &options, (qw_stage)stage);
            if (w.calls_left >= 0 || w.last >= 1) { /* told of the end there is nothing left to cancel */
                assert_int_equal(status, QW_OK);
                break;
            }
            assert_int_equal(status, QW_CANCELLED);
            assert_non_null(strstr(qw_message(context), "cancelled"));
        }
    assert_true(same_mesh(context, direct));
    assert_same_report(context, direct);
    qw_destroy(context);
    assert_int_equal(f.held, 0);
    qw_destroy(direct);
    shape_free(&s);
}

/* The same between rounds of a run that looks for lost legs, and where memory runs out there. */
static void broken_off_between_rounds(void **state)
{
    (void)state;
    shape s = two_spiders();
    qw_options options = options_for(90);
    qw_context *direct = fresh_run(&s, &options);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    watcher w = {.calls_left = -1};
    const qw_host host = {.resize = faults_resize, .resize_user = &f, .progress = watch, .progress_user = &w};
    bool ended = false;
    for (long n = 40; !ended; n = n * 3 / 2) {
        qw_context *context = with_mesh(&s, &host);
        w.calls_left = n;
        qw_status status = qw_run(context, &options);
        ended = status == QW_OK;
        assert_true(ended || status == QW_CANCELLED);
        w.calls_left = -1;
        for (long left = 1 + n % 97; !ended && left < 5000; left = left * 5 + 7) {
            f.allocations = left;
            status = qw_run(context, &options);
            assert_true(status == QW_OK || status == QW_MEMORY);
        }
        f.allocations = FAULTS_NONE;
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_true(same_mesh(context, direct));
        qw_destroy(context);
    }
    assert_int_equal(f.held, 0);
    qw_destroy(direct);
    shape_free(&s);
}

/* ---- threads */

static void backwards(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    *(long *)user += 1;
    for (uint32_t i = count; i-- > 0;) task(task_user, i);
}

static void same_bytes_at_any_thread_count(void **state)
{
    (void)state;
    static const int64_t threads[] = {2, 3, 8, 0};
    shape s = shape_sphere(24);
    qw_options options = options_for(600);
    options.adaptive = 0.5, options.sat = 0; /* the solver knows no threads */
    qw_context *one = fresh_run(&s, &options);
    for (int i = 0; i < 4; i++) {
        options.threads = threads[i];
        qw_context *many = fresh_run(&s, &options);
        assert_true(same_mesh(one, many));
        qw_destroy(many);
    }
    long calls = 0;
    const qw_host host = {.parallel = backwards, .parallel_user = &calls};
    qw_context *reversed = with_mesh(&s, &host);
    assert_int_equal(qw_run(reversed, &options), QW_OK);
    assert_true(same_mesh(one, reversed));
    assert_true(calls > 0);
    qw_destroy(reversed);
    qw_destroy(one);
    shape_free(&s);
}

QW_TEST_SUITE(api)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_option_is_tried),
        cmocka_unit_test(small_components_are_dropped),
        cmocka_unit_test(the_result_goes_back_in),
        cmocka_unit_test(no_memory_for_the_next),
        cmocka_unit_test(too_many_quads),
        cmocka_unit_test(cleaning_is_told),
        cmocka_unit_test(one_sided_surfaces_are_told),
        cmocka_unit_test(before_its_time),
        cmocka_unit_test(bad_meshes),
        cmocka_unit_test(bad_calls),
        cmocka_unit_test(the_short_way),
        cmocka_unit_test(two_contexts_interleaved),
        cmocka_unit_test(failing_creation),
        cmocka_unit_test(failing_stages),
        cmocka_unit_test(failing_runs),
        cmocka_unit_test(memory_limit),
        cmocka_unit_test(progress_rises),
        cmocka_unit_test(cancelled_at_every_call),
        cmocka_unit_test(same_bytes_at_any_thread_count),
        cmocka_unit_test(coordinates_are_short),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Whole runs one after another in one context. */
QW_TEST_SUITE(reruns)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(options_change_between_runs), cmocka_unit_test(a_dense_surface_serves_other_counts),
        cmocka_unit_test(options_change_within_a_run), cmocka_unit_test(stale_figures_are_forgotten),
        cmocka_unit_test(rounds_are_forgotten),        cmocka_unit_test(broken_off_between_rounds),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#include "base/platform.h"
#include "borders.h"
#include "driver.h"

#include "mesh/measure.h"

#include <string.h>

/* The first stage that each option bears on, CLEAN for those that are not named here. Those of the count bear on
 * SURFACE too, in steps: see needs_other_surface. */
static qw_stage first_stage_of(const char *option)
{
    static const struct {
        const char *name;
        qw_stage stage;
    } later[] = {
        {"sharp_angle", QW_STAGE_SURFACE}, {"sharp_marks", QW_STAGE_SURFACE}, {"align_boundary", QW_STAGE_SURFACE},
        {"faces", QW_STAGE_WORKING},       {"vertices", QW_STAGE_WORKING},    {"edge_length", QW_STAGE_WORKING},
        {"ratio", QW_STAGE_WORKING},       {"smoothness", QW_STAGE_WORKING},  {"seed", QW_STAGE_ORIENTATION},
        {"adaptive", QW_STAGE_SCALE},      {"flow", QW_STAGE_POSITION},       {"cost", QW_STAGE_REGULAR},
        {"sat", QW_STAGE_UPRIGHT},         {"relax", QW_STAGE_POSITIONS},     {"repair", QW_STAGE_REPAIR},
        {"evenness", QW_STAGE_RELAX},      {"threads", QW_STAGE_COUNT}};
    for (size_t i = 0; i < sizeof later / sizeof *later; i++)
        if (strcmp(option, later[i].name) == 0) return later[i].stage;
    return QW_STAGE_CLEAN;
}

/* The first stage whose result the new options make stale. */
static qw_stage first_stale(const qw_options *used, const qw_options *now)
{
    qw_stage first = QW_STAGE_COUNT;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        char a[64], b[64];
        qw_option_get(used, name, a, sizeof a);
        qw_option_get(now, name, b, sizeof b);
        if (strcmp(a, b) != 0 && first_stage_of(name) < first) first = first_stage_of(name);
    }
    return first;
}

/* ---- forgetting */

static void discard_from(qw_context_state *c, int first)
{
    while (c->done > first) {
        qw_scope_end(c->env);
        c->done--;
        c->report.warning_count = c->warnings_before[c->done];
    }
    size_t kept = c->report.warning_count, all = sizeof c->report.warnings / sizeof *c->report.warnings;
    memset(c->report.warnings + kept, 0, (all - kept) * sizeof *c->report.warnings);
}

static void begin_attempts(qw_context_state *c)
{
    qw_begin_attempts(&c->run);
    c->report.attempts = 0;
    c->asked_by = -1;
    c->went_to = QW_STAGE_COUNT;
}

static void begin_run(qw_context_state *c)
{
    discard_from(c, QW_STAGE_CLEAN);
    c->report = (qw_report){.size = sizeof c->report};
    c->run = (qw_run_state){.env = c->env, .input = &c->input, .report = &c->report};
    begin_attempts(c);
}

void qw_forget_mesh(qw_context_state *c)
{
    begin_run(c);
    qw_free(c->env, (void *)c->input.position), qw_free(c->env, (void *)c->input.face_begin),
        qw_free(c->env, (void *)c->input.corner);
    c->input = (qw_clean_input){0};
    c->has_input = false;
}

static bool needs_other_surface(const qw_context_state *c, const qw_options *options)
{
    return c->done > QW_STAGE_SURFACE && qw_surface_faces(&c->run, options) != c->run.surface_faces;
}

/* Goes back to where a run with these options would differ, so that going on gives what a fresh run gives. */
static void forget_stale(qw_context_state *c, const qw_options *options)
{
    int stale = c->done ? (int)first_stale(&c->used, options) : QW_STAGE_CLEAN;
    if (stale == QW_STAGE_CLEAN) {
        begin_run(c);
        return;
    }
    if (stale > QW_STAGE_SURFACE && needs_other_surface(c, options)) stale = QW_STAGE_SURFACE;
    if (stale <=
        c->asked_by) { /* an attempt was asked for by a result that holds no longer: a fresh run would decide anew */
        if (c->went_to < stale) stale = c->went_to;
        begin_attempts(c);
    }
    discard_from(c, stale);
    for (int s = stale; s < QW_STAGE_COUNT; s++) c->report.stages[s] = (qw_stage_report){0};
}

/* ---- running */

typedef struct stage_call {
    qw_run_state *run;
    qw_stage stage, again; /* again: where to go back to, or QW_STAGE_COUNT */
} stage_call;

/* The part of the report that is of the result. */
static void describe_result(qw_run_state *run)
{
    const qw_quadmesh *quads = &run->result;
    qw_mesh_view view = {.size = sizeof view,
                         .vertex_count = quads->vertex_count,
                         .face_count = quads->face_count,
                         .uniform_face_size = 4,
                         .positions = run->output,
                         .corners = quads->corner};
    qw_quality quality;
    qw_scope_begin(run->env);
    qw_measure_mesh(run->env, &view, NULL, &run->report->topology, &quality);
    qw_scope_end(run->env);
    run->report->angle_rms = quality.angle_rms, run->report->area_cv = quality.area_cv,
    run->report->mean_edge = quality.mean_edge;
}

static void call_stage(void *user)
{
    stage_call *call = user;
    qw_enter_stage(call->run->env, call->stage);
    qw_stage_functions[call->stage](call->run);
    if (QW_CHECKS_BORDERS) qw_check_border(call->run, call->stage);
    if (call->stage + 1 == QW_STAGE_COUNT) describe_result(call->run);
    qw_progress(call->run->env, 1.0);
    call->again = qw_next_attempt(call->run, call->stage); /* last: a stage that fails has decided nothing */
}

static void add_up(qw_report *report)
{
    report->seconds = 0, report->peak_bytes = 0;
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        report->seconds += report->stages[s].seconds;
        if (report->stages[s].peak_bytes > report->peak_bytes) report->peak_bytes = report->stages[s].peak_bytes;
    }
}

static qw_status run_stage(qw_context_state *c, qw_stage stage)
{
    stage_call call = {&c->run, stage, QW_STAGE_COUNT};
    qw_stage_report *r = &c->report.stages[stage];
    double begin = qw_seconds_now();
    c->warnings_before[stage] = c->report.warning_count;
    qw_env_reset_peak(c->env);
    qw_scope_begin(c->env);
    qw_status status = qw_protect(c->env, call_stage, &call);
    c->done = (int)stage + 1;
    r->seconds += qw_seconds_now() - begin;
    if (qw_env_peak(c->env) > r->peak_bytes) r->peak_bytes = qw_env_peak(c->env);
    add_up(&c->report);
    if (status != QW_OK) {
        discard_from(c, (int)stage);
    } else if (call.again < QW_STAGE_COUNT) {
        c->report.attempts++;
        if ((int)stage > c->asked_by) c->asked_by = (int)stage;
        if ((int)call.again < c->went_to) c->went_to = (int)call.again;
        qw_progress_back(c->env, call.again);
        discard_from(c, (int)call.again);
    }
    return status;
}

/* Rounds of results do not outlive a call: where one broke off between them, what follows the surface is made anew. */
static void forget_rounds(qw_context_state *c)
{
    if (c->run.rounds.count > 0 && c->done < QW_STAGE_COUNT) {
        begin_attempts(c);
        discard_from(c, QW_STAGE_WORKING);
        for (int s = QW_STAGE_WORKING; s < QW_STAGE_COUNT; s++) c->report.stages[s] = (qw_stage_report){0};
    }
    qw_rounds_drop(&c->run.rounds);
}

qw_status qw_drive(qw_context_state *c, const qw_options *options, qw_stage last)
{
    forget_stale(c, options);
    c->used = c->run.options = *options;
    qw_env_set_threads(c->env, (uint32_t)options->threads);
    bool runs = c->done <= (int)last;
    if (runs) qw_env_reset_progress(c->env);
    qw_status status = QW_OK;
    while (status == QW_OK && c->done <= (int)last) status = run_stage(c, (qw_stage)c->done);
    forget_rounds(c);
    if (runs && status == QW_OK && c->done == QW_STAGE_COUNT) qw_progress_done(c->env);
    return status;
}

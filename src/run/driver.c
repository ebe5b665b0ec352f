#include "base/report.h"
#include "base/mechanisms.h"
#include "base/platform.h"
#include "run/border_checks.h"
#include "run/driver.h"
#include "run/stages/stages.h"
#include "whole/asked.h"
#include "whole/kept_rims.h"
#include "whole/wrapped.h"
#include "remesh/sizes/fast.h"

#include "base/constants.h"
#include "run/judge.h"
#include "products/measure/measure.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Of each option the first stage whose result depends on it; QW_STAGE_COUNT: none does. Options of the count also
   decide, in steps, which surface is made: see needs_other_surface. */
static const qw_stage first_stage[] = {
#define QW_OPTION_COUNT(name, stage, initial, least, most, unit, help) QW_STAGE_##stage,
#define QW_OPTION_REAL(name, stage, initial, least, most, unit, help)  QW_STAGE_##stage,
#define QW_OPTION_FLAG(name, stage, initial, help)                     QW_STAGE_##stage,
#define QW_OPTION_CHOICE(name, stage, initial, last, list, help)       QW_STAGE_##stage,
#include "quadwright/options.def"
};

/* The first stage whose result the new options make stale. */
static qw_stage first_stale(const qw_options *used, const qw_options *now)
{
    qw_stage first = QW_STAGE_COUNT;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        char a[64], b[64];
        qw_option_get(used, name, a, sizeof a);
        qw_option_get(now, name, b, sizeof b);
        if (strcmp(a, b) == 0) continue;
        if (first_stage[i] < first) first = first_stage[i];
        if (first_stage[i] == QW_STAGE_WORKING && qw_wraps_by_count(now)) first = QW_STAGE_CLEAN;
    }
    return first;
}

/* ---- forgetting */

/* Removes the warnings that stage `done` and later ones have added to the report. */
static void take_warnings_back(qw_context_state *c)
{
    qw_report *r = &c->report;
    r->warning_count = c->warnings_before[c->done];
    size_t kept = r->warning_count, all = sizeof r->warnings / sizeof *r->warnings;
    memset(r->warnings + kept, 0, (all - kept) * sizeof *r->warnings);
}

static void discard_from(qw_context_state *c, int first)
{
    if (c->done <= first) return;
    c->carried = NULL, c->asset = NULL, c->told = NULL;
    for (; c->done > first; c->done--) qw_scope_end(c->env);
    take_warnings_back(c);
}

static void drop_candidate(qw_context_state *c, uint32_t slot)
{
    c->candidate[slot].attempt = QW_NO_ATTEMPT;
    qw_scopes_drop(c->env, slot);
}

static void begin_history(qw_context_state *c)
{
    qw_history_begin(&c->history);
    c->run.plan = c->history.attempt[0].plan;
    c->report.attempts = 0;
    for (uint32_t slot = 0; slot < QW_ASIDE_SLOTS; slot++) drop_candidate(c, slot);
}

/* Forgets all of an earlier run, and begins with the input that was given. */
static void begin_run(qw_context_state *c)
{
    discard_from(c, QW_STAGE_CLEAN);
    c->report = (qw_report){.size = sizeof c->report};
    c->run = (qw_run_state){.env = c->env,
                            .report = &c->report,
                            .refinement = c->refinement,
                            .whole = {.input = &c->input, .steering = &c->steering}};
    memset(c->refinement, 0, sizeof c->refinement);
    begin_history(c);
}

static void free_unless(qw_context_state *c, void *before, const void *now)
{
    if (before != now) qw_free(c->env, before);
}

void qw_replace_steering(qw_context_state *c, const qw_steering *steering)
{
    const qw_steering was = c->steering, *now = steering;
    void *made[] = {now->field == was.field ? NULL : now->field,
                    now->guide_begin == was.guide_begin ? NULL : now->guide_begin,
                    now->guide_kind == was.guide_kind ? NULL : now->guide_kind,
                    now->guide_rings == was.guide_rings ? NULL : now->guide_rings,
                    now->guide_point == was.guide_point ? NULL : now->guide_point,
                    now->motion == was.motion ? NULL : now->motion,
                    now->joint_begin == was.joint_begin ? NULL : now->joint_begin,
                    now->joint_point == was.joint_point ? NULL : now->joint_point,
                    now->region == was.region ? NULL : now->region};
    while (c->done > 0) { /* out of the scopes of the stages, which end here */
        for (size_t i = 0; i < sizeof made / sizeof *made; i++) qw_keep(c->env, made[i]);
        discard_from(c, c->done - 1);
    }
    begin_run(c);
    free_unless(c, was.field, now->field), free_unless(c, was.guide_begin, now->guide_begin);
    free_unless(c, was.guide_kind, now->guide_kind), free_unless(c, was.guide_rings, now->guide_rings);
    free_unless(c, was.guide_point, now->guide_point);
    free_unless(c, was.joint_begin, now->joint_begin), free_unless(c, was.joint_point, now->joint_point);
    free_unless(c, was.motion, now->motion), free_unless(c, was.region, now->region);
    c->steering = *now;
}

void qw_forget_mesh(qw_context_state *c)
{
    begin_run(c);
    qw_free(c->env, (void *)c->input.position), qw_free(c->env, (void *)c->input.face_begin),
        qw_free(c->env, (void *)c->input.corner), qw_free(c->env, (void *)c->input.mark);
    qw_free(c->env, (void *)c->input.density);
    c->input = (qw_clean_input){0};
    c->has_input = false;
    qw_steering none = {0};
    qw_replace_steering(c, &none);
}

void qw_replace_mesh(qw_context_state *c, const qw_clean_input *input)
{
    while (c->done > 0) { /* out of the scopes of the stages, which end here */
        qw_keep(c->env, (void *)input->position), qw_keep(c->env, (void *)input->face_begin);
        qw_keep(c->env, (void *)input->corner), qw_keep(c->env, (void *)input->mark);
        discard_from(c, c->done - 1);
    }
    qw_forget_mesh(c);
    c->input = *input;
    c->has_input = true;
}

void qw_replace_density(qw_context_state *c, const qw_density *density)
{
    while (c->done > 0) {
        qw_keep(c->env, (void *)density);
        discard_from(c, c->done - 1);
    }
    begin_run(c);
    qw_free(c->env, (void *)c->input.density);
    c->input.density = density;
}

static bool needs_other_surface(const qw_context_state *c, const qw_options *options)
{
    return c->done > QW_STAGE_SURFACE && c->run.surface_faces > 0 &&
           qw_surface_faces(&c->run, options) != c->run.surface_faces;
}

/* What is narrow at a plane that was found, whether others across it are used, and how nearly a component must be its
   own reflection, depends on the count. */
static bool needs_other_core(const qw_context_state *c, const qw_options *options)
{
    bool is_sharp = c->done <= QW_STAGE_SURFACE || c->report.feature_edges > 0;
    bool has_handles = c->report.euler < 0, is_one = c->report.components == 1;
    return c->done > QW_STAGE_CORE && c->report.symmetry_far > 0 && (is_sharp || has_handles || !is_one) &&
           qw_finds_plane(options->symmetry) && qw_faces_wanted(&c->run, options) != qw_faces_wanted(&c->run, &c->used);
}

/* Discards the stages whose results the new options would change, so that going on gives the bytes of a fresh run. */
static void forget_stale(qw_context_state *c, const qw_options *options)
{
    int stale = c->done ? (int)first_stale(&c->used, options) : QW_STAGE_CLEAN;
    if (stale == QW_STAGE_CLEAN) {
        begin_run(c);
        return;
    }
    if (stale > QW_STAGE_CORE && needs_other_core(c, options)) stale = QW_STAGE_CORE;
    if (stale > QW_STAGE_SURFACE && needs_other_surface(c, options)) stale = QW_STAGE_SURFACE;
    if (stale <= qw_history_asked_by(&c->history)) { /* a fresh run would judge its attempts with the new options */
        if ((int)qw_history_went_to(&c->history) < stale) stale = (int)qw_history_went_to(&c->history);
        begin_history(c);
    }
    qw_attempt *a = &c->history.attempt[c->history.current];
    if ((int)a->judged > stale) a->judged = (uint32_t)stale;
    discard_from(c, stale);
    qw_report_forget(&c->report, (qw_stage)stale);
}

/* ---- attempts */

/* The stages to which retries go back, from the innermost loop to the outermost. A candidate of each loop is kept in
   the slot of the same index. */
static const qw_stage loops[QW_ASIDE_SLOTS] = {QW_STAGE_REGULAR, QW_STAGE_SCALE, QW_STAGE_WORKING};

/* QW_ASIDE_SLOTS for what goes back further, which keeps no candidate. */
static uint32_t slot_of(qw_stage back)
{
    uint32_t slot = 0;
    while (slot < QW_ASIDE_SLOTS && loops[slot] != back) slot++;
    assert(slot < QW_ASIDE_SLOTS || back < loops[QW_ASIDE_SLOTS - 1]);
    return slot;
}

/* Whether no retry can go back to the loop's beginning any more once the run has passed `stage`. */
static bool is_left(uint32_t slot, qw_stage stage)
{
    for (int i = 0; i < QW_RETRIES; i++)
        if (qw_retry_rows[i].back == loops[slot] && qw_retry_rows[i].after > stage &&
            !qw_begins_anew(&qw_retry_rows[i]))
            return false;
    return true;
}

/* Sets aside what the current attempt has made from stage `first` on. */
static void keep_candidate(qw_context_state *c, uint32_t slot, int first)
{
    qw_attempt_result *k = &c->candidate[slot];
    k->attempt = c->history.current, k->first = first, k->done = c->done;
    k->run = c->run, k->report = c->report;
    memcpy(k->warnings_before, c->warnings_before, sizeof k->warnings_before);
    qw_scopes_set_aside(c->env, slot, (uint32_t)(c->done - first));
    c->done = first;
    take_warnings_back(c);
}

/* Continues with the attempt that is kept in the slot. Times and number of attempts in the report stay those of all
   attempts. */
static void take_candidate(qw_context_state *c, uint32_t slot)
{
    qw_attempt_result *k = &c->candidate[slot];
    qw_report cost = c->report;
    discard_from(c, k->first);
    qw_scopes_take_up(c->env, slot);
    c->run = k->run, c->report = k->report, c->done = k->done;
    memcpy(c->report.stages, cost.stages, sizeof cost.stages);
    c->report.attempts = cost.attempts;
    memcpy(c->warnings_before, k->warnings_before, sizeof k->warnings_before);
    c->history.current = k->attempt;
    k->attempt = QW_NO_ATTEMPT;
}

/* Takes the attempt that was chosen at this stage in the place of the current one, and drops those that can't be
 * chosen any more. */
static void go_on_with(qw_context_state *c, qw_stage stage, uint32_t attempt)
{
    for (uint32_t slot = 0; slot < QW_ASIDE_SLOTS && c->history.current != attempt; slot++)
        if (c->candidate[slot].attempt == attempt) take_candidate(c, slot);
    assert(c->history.current == attempt);
    for (uint32_t slot = 0; slot < QW_ASIDE_SLOTS; slot++)
        if (is_left(slot, stage)) drop_candidate(c, slot);
}

/* Appends the refinements of the next plan that the current plan does not have. */
static void add_refinements(qw_context_state *c, const qw_plan *next, const qw_sites *places)
{
    uint32_t round = 1;
    for (uint32_t i = 1; i < c->history.count; i++)
        round += qw_retry_rows[c->history.attempt[i].cause].back == QW_STAGE_WORKING;
    for (uint32_t i = c->run.plan.refinements, k = 0; i < next->refinements; i++, k++)
        c->refinement[i] = (qw_refinement){places->point[k], (float)QW_REFINED_RADIUS * places->size[k], round};
}

/* Keeps the current attempt if it is the best so far, and begins another from the stage that the step says. */
static void go_back(qw_context_state *c, const qw_step *step, const qw_judgement *j)
{
    qw_stage back = qw_retry_rows[step->cause].back;
    uint32_t slot = slot_of(back);
    assert((int)back < c->done);
    add_refinements(c, &step->plan, &j->places);
    for (uint32_t inner = 0; inner < slot; inner++) drop_candidate(c, inner);
    if (step->best == c->history.current) keep_candidate(c, slot, (int)back);
    else discard_from(c, (int)back);
    qw_history_go_back(&c->history, step);
    c->run.plan = step->plan;
    c->report.attempts = c->history.earlier + c->history.count - 1;
    qw_log(c->env, QW_LOG_DEBUG, "attempt %lld: %s", (long long)c->report.attempts,
           qw_retry_rows[step->cause].sentence);
    qw_progress_back(c->env, back);
}

static const qw_mechanism of_retry[] = {
#define QW_RETRY(name, after, back, most, sentence) QW_MECH_RETRY_##name,
#include "run/retries.def"
};

/* Counts the retry that the attempt was begun for as kept. */
static void count_kept(const qw_context_state *c, qw_stage stage, uint32_t attempt)
{
    qw_retry cause = c->history.attempt[attempt].cause;
    if (cause == QW_NO_RETRY) return;
    const qw_retry_row *row = &qw_retry_rows[cause];
    bool is_judged = row->after == stage || (stage == QW_STAGE_RELAX && row->back == QW_STAGE_WORKING);
    qw_kept(c->env, of_retry[cause], is_judged);
}

/* Where developers have switched a retry off, the run goes on instead, with the best attempt so far. */
static void switch_retry(qw_context_state *c, qw_step *step)
{
    if (step->cause == QW_NO_RETRY) return;
    if (qw_uses(c->env, of_retry[step->cause])) {
        qw_acted(c->env, of_retry[step->cause], 1);
        return;
    }
    step->cause = QW_NO_RETRY;
    if (step->best == QW_NO_ATTEMPT) step->best = c->history.current;
}

/* Writes down the verdict, asks what follows, and does that. */
static void decide(qw_context_state *c, qw_stage stage, const qw_judgement *j)
{
    assert(c->history.current < c->history.count);
    qw_attempt *a = &c->history.attempt[c->history.current];
    a->verdict = j->verdict, a->judged = (uint32_t)stage + 1;
    c->history.request = (qw_request){c->run.faces_wanted,
                                      c->run.core.needed,
                                      qw_is_closed_flow(&c->run.options),
                                      c->run.options.repair != 0,
                                      qw_times_used(&c->run),
                                      qw_finds_plane(c->run.options.symmetry),
                                      c->run.options.symmetry == QW_SYMMETRY_AUTO,
                                      c->run.options.fast != QW_FAST_NO,
                                      (uint32_t)c->run.core.census.components};
    qw_step step = qw_next_step(&c->history, stage);
    switch_retry(c, &step);
    if (step.cause == QW_NO_RETRY) count_kept(c, stage, step.best), go_on_with(c, stage, step.best);
    else go_back(c, &step, j);
}

/* ---- running */

typedef struct stage_call {
    qw_context_state *c;
    qw_stage stage;
    qw_stage_function function;
    qw_judgement judgement;
} stage_call;

static void refuse_sides(void *user)
{
    qw_fail(
        ((qw_context_state *)user)->env, QW_INTERNAL, -1,
        "a part that the plane of symmetry cuts is too small for the two sides to keep its topology: more quads are "
        "needed, or no symmetry");
}

/* Fills the part of the report that describes the result. */
static void describe_result(qw_run_state *run)
{
    qw_mesh_view view = qw_view_of_result(run);
    qw_quality quality;
    qw_scope_begin(run->env);
    qw_measure_mesh(run->env, &view, NULL, NULL, &run->report->topology, &quality);
    qw_scope_end(run->env);
    run->report->angle_rms = quality.angle_rms, run->report->area_cv = quality.area_cv,
    run->report->mean_edge = quality.mean_edge, run->report->simple = fmax(quality.simple, 0);
    run->report->count_assembled = run->report->topology.faces - run->fitted.face_count;
}

/* One stage under protection: runs it, checks what it leaves, and judges it. */
static void call_stage(void *user)
{
    stage_call *call = user;
    qw_context_state *c = call->c;
    qw_enter_stage(c->env, call->stage);
    call->function(&c->run);
    if (QW_CHECKS_BORDERS) qw_check_border(&c->run, call->stage);
    if (call->stage + 1 == QW_STAGE_COUNT) describe_result(&c->run);
    call->judgement.verdict = c->history.attempt[c->history.current].verdict;
    qw_judge(&c->run, call->stage, &call->judgement);
    qw_progress(c->env, 1.0);
}

static void add_up(qw_report *report)
{
    report->seconds = 0, report->peak_bytes = 0;
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        report->seconds += report->stages[s].seconds;
        if (report->stages[s].peak_bytes > report->peak_bytes) report->peak_bytes = report->stages[s].peak_bytes;
    }
}

/* Runs the next stage. */
static qw_status run_call(qw_context_state *c, stage_call *call)
{
    qw_stage stage = call->stage;
    assert(c->done == (int)stage);
    qw_stage_report *r = &c->report.stages[stage];
    double begin = qw_seconds_now();
    c->warnings_before[stage] = c->report.warning_count;
    qw_env_reset_peak(c->env);
    qw_scope_begin(c->env);
    qw_status status = qw_protect(c->env, call_stage, call);
    c->done = (int)stage + 1;
    r->seconds += qw_seconds_now() - begin;
    if (qw_env_peak(c->env) > r->peak_bytes) r->peak_bytes = qw_env_peak(c->env);
    add_up(&c->report);
    return status;
}

qw_status qw_run_stage(qw_context_state *c, qw_stage_function function)
{
    stage_call call = {.c = c, .stage = (qw_stage)c->done, .function = function};
    qw_status status = run_call(c, &call);
    if (status != QW_OK) discard_from(c, (int)call.stage);
    return status;
}

qw_status qw_run_judged_stage(qw_context_state *c, qw_stage_function function)
{
    stage_call call = {.c = c, .stage = (qw_stage)c->done, .function = function};
    qw_status status = run_call(c, &call);
    if (status == QW_OK) decide(c, call.stage, &call.judgement);
    if (c->done == QW_STAGE_COUNT && !c->run.sides_meet) status = qw_protect(c->env, refuse_sides, c);
    if (status != QW_OK && c->done > (int)call.stage) discard_from(c, (int)call.stage); /* it gives no verdict */
    return status;
}

/* Candidates are kept only within one call: where a run was interrupted between attempts, all stages after SURFACE
   are discarded, and the core if it is not that of the first plan. */
static void forget_candidates(qw_context_state *c)
{
    bool is_between = false;
    for (uint32_t slot = 0; slot < QW_ASIDE_SLOTS; slot++) is_between |= c->candidate[slot].attempt != QW_NO_ATTEMPT;
    if (!is_between) return;
    qw_stage back = qw_history_went_to(&c->history);
    if (back > QW_STAGE_WORKING) back = QW_STAGE_WORKING;
    begin_history(c);
    discard_from(c, (int)back);
    qw_report_forget(&c->report, back);
}

void qw_begin_drive(qw_context_state *c, const qw_options *options, qw_stage last)
{
    forget_stale(c, options);
    c->used = *options;
    c->run.options = qw_without_slow(options);
    qw_env_set_threads(c->env, (uint32_t)options->threads);
    c->works = c->done <= (int)last;
    if (c->works) qw_env_reset_progress(c->env);
}

void qw_end_drive(qw_context_state *c, qw_status status)
{
    forget_candidates(c);
    if (c->works && status == QW_OK && c->done == QW_STAGE_COUNT) qw_progress_done(c->env);
}

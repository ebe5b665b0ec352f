#define _POSIX_C_SOURCE 200809L
#include "driver.h"

#include <assert.h>
#include <string.h>
#include <time.h>

static double seconds_now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* The first stage that each option bears on. */
static qw_stage first_stage_of(const char *option)
{
    static const struct {
        const char *name;
        qw_stage stage;
    } later[] = {{"seed", QW_STAGE_ORIENTATION}, {"adaptive", QW_STAGE_SCALE}, {"flow", QW_STAGE_REGULAR}, {"cost", QW_STAGE_REGULAR}, {"cost", QW_STAGE_REGULAR}, {"sat", QW_STAGE_UPRIGHT},
                 {"repair", QW_STAGE_REPAIR},    {"relax", QW_STAGE_RELAX},    {"threads", QW_STAGE_COUNT}};
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

void qw_discard_from(qw_context_state *c, qw_stage first)
{
    while (c->done > (int)first) {
        qw_scope_end(c->env);
        c->done--;
    }
}

typedef struct stage_call {
    qw_run_state *run;
    qw_stage stage;
} stage_call;

static void call_stage(void *user)
{
    stage_call *call = user;
    qw_enter_stage(call->run->env, call->stage);
    qw_stage_functions[call->stage](call->run);
    qw_progress(call->run->env, 1.0);
}

static qw_status run_stage(qw_context_state *c, qw_stage stage)
{
    stage_call call = {&c->run, stage};
    qw_stage_report *r = &c->report.stages[stage];
    double begin = seconds_now();
    qw_env_reset_peak(c->env);
    qw_scope_begin(c->env);
    qw_status status = qw_protect(c->env, call_stage, &call);
    r->seconds += seconds_now() - begin;
    if (qw_env_peak(c->env) > r->peak_bytes) r->peak_bytes = qw_env_peak(c->env);
    if (r->peak_bytes > c->report.peak_bytes) c->report.peak_bytes = r->peak_bytes;
    c->report.seconds += seconds_now() - begin;
    if (status != QW_OK)
        qw_scope_end(c->env);
    else
        c->done = (int)stage + 1;
    return status;
}

static void begin_run(qw_context_state *c)
{
    memset(&c->report, 0, sizeof c->report);
    c->report.size = sizeof c->report;
    c->run = (qw_run_state){.env = c->env, .input = &c->input, .report = &c->report, .rho_scale = 1};
}

qw_status qw_drive(qw_context_state *c, const qw_options *options, qw_stage last)
{
    qw_stage stale = c->done ? first_stale(&c->used, options) : QW_STAGE_CLEAN;
    if (stale < QW_STAGE_COUNT) {
        qw_discard_from(c, stale);
        if (stale <= QW_STAGE_WORKING) begin_run(c), qw_discard_from(c, QW_STAGE_CLEAN);
    }
    c->used = c->run.options = *options;
    qw_env_set_threads(c->env, (uint32_t)options->threads);
    while (c->done <= (int)last) {
        qw_status status = run_stage(c, (qw_stage)c->done);
        if (status != QW_OK) return status;
        qw_stage again = qw_next_attempt(&c->run, (qw_stage)(c->done - 1));
        if (again < QW_STAGE_COUNT) c->report.attempts++, qw_discard_from(c, again);
    }
    return QW_OK;
}

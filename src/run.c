#include "run.h"

#include <stdio.h>
#include <string.h>

void qw_warn_once(qw_run_state *run, const char *text)
{
    const qw_report *r = run->report;
    for (uint32_t i = 0; i < r->warning_count; i++)
        if (strncmp(r->warnings[i], text, sizeof r->warnings[0] - 1) == 0) return;
    qw_warn(run, text);
}

void qw_warn(qw_run_state *run, const char *text)
{
    qw_report *r = run->report;
    if (r->warning_count < sizeof r->warnings / sizeof *r->warnings) {
        snprintf(r->warnings[r->warning_count], sizeof r->warnings[0], "%s", text);
        r->warning_count++;
    }
    qw_log(run->env, QW_LOG_WARNING, "%s", text);
}

#include "run.h"

#include <stdio.h>

void qw_warn(qw_run_state *run, const char *text)
{
    qw_report *r = run->report;
    if (r->warning_count < sizeof r->warnings / sizeof *r->warnings) {
        snprintf(r->warnings[r->warning_count], sizeof r->warnings[0], "%s", text);
        r->warning_count++;
    }
    qw_log(run->env, QW_LOG_WARNING, "%s", text);
}

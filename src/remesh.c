/* The whole of Quadwright in order: the stages are in stages.def, what each does in stages_*.c and finish.c, why some
 * are run again in retries.def.
 */
#include "remesh.h"

#include <stdio.h>

const qw_stage_function qw_stage_functions[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) qw_stage_##name,
#include "quadwright/stages.def"
#undef QW_STAGE
};

void qw_warn(qw_run_state *run, const char *text)
{
    qw_report *r = run->report;
    if (r->warning_count < sizeof r->warnings / sizeof *r->warnings) {
        snprintf(r->warnings[r->warning_count], sizeof r->warnings[0], "%s", text);
        r->warning_count++;
    }
    qw_log(run->env, QW_LOG_WARNING, "%s", text);
}

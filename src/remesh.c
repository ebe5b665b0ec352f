/* The whole of Quadwright in the order of DESIGN section 2. The stages are in stages.def, what each does in stages.c.
 */
#include "remesh.h"

#include <math.h>

const qw_stage_function qw_stage_functions[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) qw_stage_##name,
#include "quadwright/stages.def"
#undef QW_STAGE
};

void qw_begin_attempts(qw_run_state *run)
{
    run->rho_scale = run->best_scale = 1;
    run->best_off = INFINITY;
    run->count_attempts = run->way_attempts = run->corners_freed = 0;
    run->corners_off = run->corners_scale = 1;
    run->way = QW_WAY_CLOSED;
    run->refine_rounds = run->refine_attempts = run->reach_attempts = run->flip_attempts = run->refine_count = 0;
    run->report->refined_regions = 0;
    qw_rounds_drop(&run->rounds);
    run->least_bad = INFINITY;
    run->best_refine_count = run->settled = 0;
    run->best_refine_scale = 1;
    run->best_refine_way = QW_WAY_CLOSED, run->best_refine_way_attempts = 0;
    run->best_refine_corners = 0;
}

qw_stage qw_next_attempt(qw_run_state *run, qw_stage finished)
{
    if (finished == QW_STAGE_UPRIGHT && qw_adjust_way(run)) return QW_STAGE_SCALE;
    if (finished == QW_STAGE_REPAIR && qw_adjust_refinement(run)) return QW_STAGE_WORKING;
    if (finished == QW_STAGE_RELAX && qw_adjust_result(run)) return QW_STAGE_WORKING;
    if ((finished == QW_STAGE_UPRIGHT || finished == QW_STAGE_REPAIR) && qw_adjust_count(run, finished))
        return QW_STAGE_SCALE;
    return QW_STAGE_COUNT;
}

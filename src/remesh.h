/* The pipeline: runs stages in order, again where the count or the topology asks for it. */
#ifndef QW_REMESH_H
#define QW_REMESH_H

#include "run.h"

typedef void (*qw_stage_function)(qw_run_state *run);
extern const qw_stage_function qw_stage_functions[QW_STAGE_COUNT];

/* What attempts decide, as it is before the first one. */
void qw_begin_attempts(qw_run_state *run);
/* After `finished`: the stage to go back to for another attempt, or QW_STAGE_COUNT to go on. */
qw_stage qw_next_attempt(qw_run_state *run, qw_stage finished);

#endif

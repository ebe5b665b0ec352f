/* The pipeline: the stages in their order. */
#ifndef QW_REMESH_H
#define QW_REMESH_H

#include "stages/stages.h"

typedef void (*qw_stage_function)(qw_run_state *run);
extern const qw_stage_function qw_stage_functions[QW_STAGE_COUNT];

#endif

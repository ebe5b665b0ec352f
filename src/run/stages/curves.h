/* What the report says of the feature curves that the quads do not follow. */
#ifndef QW_RUN_STAGES_CURVES_H
#define QW_RUN_STAGES_CURVES_H

#include "whole/state.h"

/* From run->curve_outcome. */
void qw_report_curves(qw_run_state *run);

#endif

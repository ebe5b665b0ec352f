/* What the report says of the feature curves that the quads do not follow. */
#ifndef QW_STAGES_CURVES_H
#define QW_STAGES_CURVES_H

#include "run_state.h"

/* From run->curve_outcome. */
void qw_report_curves(qw_run_state *run);

#endif

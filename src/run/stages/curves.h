/* What the report says of the feature curves that the quads do not follow. */
#pragma once

#include "whole/state.h"

/* From run->curve_outcome. */
void qw_report_curves(qw_run_state *run);

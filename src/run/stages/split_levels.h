/* The quads of the result as a surface to be subdivided: fitted so that its limit lies on the input (fit_to), and split
 * into finer quads that are put on the input (subdivide). */
#pragma once

#include "whole/state.h"

/* In ASSEMBLE: replaces run->finished, run->output, run->reflected and run->source, and sets run->coarse, as the
   options ask for it. Fails with QW_OPTION where quads are to be split that a boundary keeps as they are. */
void qw_make_levels(qw_run_state *run);
/* Whether they are fitted so that their limit surface lies near. */
bool qw_fits_limit(const qw_run_state *run);
/* Before there are quads: fails with QW_OPTION as above, and with QW_TOO_LARGE where splitting so many is refused. */
void qw_require_levels(const qw_run_state *run);

/* Components with a plane of symmetry of their own, where the surface as a whole has none: several things in one file.
 * Each is cut at its plane, and its other side is the reflection; the others stay whole. */
#pragma once

#include "whole/state.h"

/* Looks at the largest components. A plane must suit its component as one of the whole would (whole/suits_cut.h), and
   in another plan than the first reflect it exactly (qw_is_alike). edge: that of a quad, in diagonals of the surface.
   Returns what is known of them, and sets `own`; is_used: 0 where there are none. In the current scope. */
qw_mirror qw_find_own_planes(const qw_run_state *run, double edge);

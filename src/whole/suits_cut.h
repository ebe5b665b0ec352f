/* Which surfaces may be cut along a plane of symmetry without loss. */
#pragma once

#include "whole/state.h"

/* Whether half of the surface can be made into quads as well as the whole: not where tips lie on the plane, where what
   is narrow is cut along, where creases were sampled, which are found less well beside a cut, and not plain solids
   and sharp sheets that were wrapped, both of whose sides are fitted at once.
   Needs what CLEAN leaves. */
bool qw_suits_cut(const qw_run_state *run, const qw_mirror_plane *plane);

/* Whether the surface has sharp edges of some length. */
bool qw_is_sharp(const qw_run_state *run);

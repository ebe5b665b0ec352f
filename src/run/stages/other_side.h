/* Where the two sides of a plane of symmetry are nearly alike: the quads of the other side on its own surface. */
#pragma once

#include "whole/state.h"

/* In ASSEMBLE. Where the reflections of the quads' vertices lie: double[quads->vertex_count][3], in the coordinates of
   the input; NULL where the other side is no surface on which they can lie. quads: of the core, in its frame; sewn:
   uint8_t[4 quads->face_count], 1: half-edges that lie in the plane, whose vertices both sides share. *suits: false
   where the quads are not as near to the other side as to the core's. In the current scope. */
double *qw_place_other_side(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *sewn, bool *suits);

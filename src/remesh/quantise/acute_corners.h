/* Acute corners: two constrained curves that leave a corner along the same lattice line, since the angle between
   them is less than about 45 degrees. All that lies between them would have no width. From the corner on neither is
   constrained any more, up to where a quad fits between them. */
#pragma once

#include "remesh/offsets/offsets.h"

/* Returns how many edges are no longer constrained. Changes m->fixed, and m->constraint and m->direction of vertices
   at which no constrained edge is left; corners stay. verdict: uint8_t[3 face_count], qw_curve_verdict: SHORTENED for
   both sides of these edges; NULL: not told. */
int64_t qw_release_acute_corners(qw_env *env, qw_offset_mesh *m, uint8_t *verdict);

/* Acute corners: two constrained curves that leave a corner on one and the same lattice line, since the angle between
 * them is less than about 45 degrees. All that lies between them would have no width. From the corner on both are let
 * go, up to where a quad fits between them.
 */
#ifndef QW_INTEGER_ACUTE_CORNERS_H
#define QW_INTEGER_ACUTE_CORNERS_H

#include "integer/offsets.h"

/* Returns how many edges are constrained no longer. Changes m->fixed, and m->constraint and m->direction of vertices
   that no constrained edge is left at; corners stay. */
int64_t qw_release_acute_corners(qw_env *env, qw_offset_mesh *m);

#endif

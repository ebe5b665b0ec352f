/* Corners of quads that are turned over are opened: the vertices around them search for better places, one by one. Free ones on the surface, those on curves
 * along them, and where that does not do, corners of curves as well, by a part of an edge.
 *
 * The relaxation's energy is a sum, so a few corners may stay turned over where that suits all others, and vertices that were brought back to
 * the surface or spread out by untangle.h have not been looked at again.
 */
#ifndef QW_QUAD_STRAIGHTEN_H
#define QW_QUAD_STRAIGHTEN_H

#include "quad/untangle.h"

/* Changes positions (and places on curves) near quads of which a corner is turned over, or that are said to be flipped, where fewer are then and the shape is kept,
   and nowhere else; u->flipped is set anew where it was set. Returns how many corners are left turned over. */
uint32_t qw_straighten_corners(qw_env *env, const qw_untangling *u);

#endif

/* Corners of quads that are turned over are opened: the vertices around them search for better places, one by one. Free
 * ones on the surface, those on curves along them, and where that does not do, corners of curves as well, by a part of
 * an edge.
 *
 * The relaxation's energy is a sum, so a few corners may stay turned over where that suits all others, and vertices
 * that were brought back to the surface or spread out by untangle.h have not been looked at again.
 */
#ifndef QW_QUAD_STRAIGHTEN_H
#define QW_QUAD_STRAIGHTEN_H

#include "quad/untangle.h"

/* Changes positions (and places on curves) near quads of which a corner is turned over, or that are said to be flipped,
   where fewer are then and the shape is kept, and nowhere else; u->flipped is set anew where it was set. Returns how
   many corners are left turned over. */
uint32_t qw_straighten_corners(qw_env *env, const qw_untangling *u);

/* Of f, how many corners are turned over against the quad itself. */
uint32_t qw_turned_corners(const qw_untangling *u, uint32_t f);

/* All vertices but those that are held (uint8_t[vertices]) search, from where they are and from the middle of their
   neighbours. They move over the surface, on a curve or not, but no farther than half an edge from where a curve has
   them. u->quads: linked, a part of a mesh with a mean edge length of `edge`; u->curves: none bound. */
void qw_straighten_patch(qw_env *env, const qw_untangling *u, const uint8_t *held, float edge);
/* After that: those that belong on curves go back to where they were (home: qw_vec3[vertices]), or half the way, if
 * that does no harm. */
void qw_put_on_curves(qw_env *env, const qw_untangling *u, const uint8_t *held, float edge, const qw_vec3 *home);

#endif

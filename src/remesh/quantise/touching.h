/* Curves that touch: the integer offsets of a decimated complex may leave no quads between two feature or boundary
 * curves, or between two corners, though they are apart on the surface. The band between them would be contracted: a
 * feature edge would be lost, or two holes would become one.
 *
 * A triangle without an area is folded: the lattice points of its longest edge become one with those of the two others.
 * Points that become one through such triangles, or through edges without a length, are one vertex of the quads.
 * Curves touch where such a vertex has pieces of two curves, or two corners.
 */
#pragma once

#include "remesh/quantise/complex_components.h"

/* Sets the signs of the component's complex (complex.h): curves between corners keep a length, and where a triangle
   lies between a curve and a vertex of another one they keep a distance. */
void qw_set_signs(qw_env *env, qw_component *component);

/* How often curves of the component touch at offsets d, qw_int2[edges of the component]: over all points of the quads,
   the curves and corners at it beyond the first of each. */
uint32_t qw_count_touching(qw_env *env, const qw_component *component, const qw_int2 *d);

/* Parts curves that touch: puts a row of quads between them, at the least cost of rounding, as long as fewer curves
   touch then and no more triangles are inverted. real: qw_real2[edges], the real offsets that were rounded. d: as
   above; obeys Eq. (3) before and after. *work: triangles that may be looked at; is lowered by those that were. Returns
   how often curves touch afterwards. */
uint32_t qw_part_curves(qw_env *env, const qw_component *component, const qw_real2 *real, qw_int2 *d, double *work);

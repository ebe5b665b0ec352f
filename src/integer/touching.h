/* Curves that touch: integer offsets of a decimated complex that bring two feature or boundary curves together, or two
 * corners of one, which the surface has apart. The band between them would be contracted: an edge would be gone, or two
 * holes be one.
 *
 * A triangle without an area contracts across itself: its longest edge falls together with the two others, lattice
 * point by lattice point. Points that fall together through such triangles, and through edges without a length, are
 * one point of the quad mesh. Where one has parts of two curves, or two corners, they touch.
 */
#ifndef QW_INTEGER_TOUCHING_H
#define QW_INTEGER_TOUCHING_H

#include "integer/components.h"

/* Sets the signs of the component's complex (complex.h): curves between corners keep a length, and where a triangle
   lies between a curve and a vertex of another one they keep a distance. */
void qw_set_signs(qw_env *env, qw_component *component);

/* How often curves of the component touch at offsets d, qw_int2[edges of the component]: over all points of the quads,
   the curves and corners at it beyond the first of each. */
uint32_t qw_count_touching(qw_env *env, const qw_component *component, const qw_int2 *d);

/* Parts curves that touch: lets a row of quads between them, at the least cost of rounding, as long as that touches
   fewer curves and inverts no more triangles than before. real: qw_real2[edges], what the integers are near to. d: as
   above, closed (Eq. 3) and so afterwards. *work: triangles that may be looked at, less those that were. Returns how
   often curves touch then. */
uint32_t qw_part_curves(qw_env *env, const qw_component *component, const qw_real2 *real, qw_int2 *d, double *work);

#endif

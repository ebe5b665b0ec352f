/* The count by single steps: where curves are so near to one another that a row of quads fits between, the area in
 * quads does not grow with the size, but by whole rows that run along many curves. Then single curves are made one quad
 * longer or shorter, whatever costs least. */
#ifndef QW_INTEGER_NUDGE_H
#define QW_INTEGER_NUDGE_H

#include "integer/complex.h"

/* Changes the closed offsets c->d by steps of curves until their area is within the bounds, or none brings it nearer.
   No curve loses its length and no triangle is inverted by that. *work: triangles that may be looked at, less those
   that were. Returns whether the area is within the bounds. */
bool qw_nudge_area(qw_env *env, qw_complex *c, double least_area, double most_area, double *work);

#endif

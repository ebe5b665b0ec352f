/* The number of quads by single steps. Where curves are so near to one another that one row of quads lies between, the
 * number does not follow the size of the quads but changes by whole rows, each along many curves. Then single edges of
 * curves are made one quad longer or shorter, the cheapest first. */
#pragma once

#include "remesh/quantise/complex.h"

/* Makes edges of curves longer or shorter, and keeps the offsets c->d closed, until their area in quads is within the
   bounds or no such step brings it nearer. No edge loses its length and no more triangles are inverted. *work:
   triangles that may be looked at; is lowered by those that were. Returns whether the area is within the bounds. */
bool qw_nudge_area(qw_env *env, qw_complex *c, double least_area, double most_area, double *work);

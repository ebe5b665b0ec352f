/* Quads of second order: a node at each corner and one on each side, which lies on the surface as far as the element
 * stays one that solvers take.
 */
#pragma once

#include "base/env.h"

#include <stdint.h>

/* Moves nodes of sides toward the middles of their ends, at last onto them, until the determinant of no element falls
   below a quarter of what it would be with straight sides. position: double[vertices][3]; corner: those of quads that
   were split once, uint32_t[16 elements], four quads an element. Returns how many elements had to be held back. */
uint32_t qw_hold_sides_back(qw_env *env, double *position, const uint32_t *corner, uint32_t elements,
                            uint32_t vertices);

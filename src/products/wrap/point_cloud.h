/* Points become a soup of triangles that the wrap makes a surface of: each point is joined to the neighbours whose
 * cells of the Voronoi diagram in its tangent plane touch its own. The stars of neighbours need not agree: they all lie
 * on the surface that the points were taken from, and a skin goes around them. No orientation is needed: outside is
 * outside. */
#pragma once

#include "base/env.h"

/* position: double[count][3], finite. Returns how many triangles; *corner: uint32_t[3 triangles], in the current scope.
 * Each triangle comes once. Fails with QW_ONLY_DEGENERATE where no three points make one. */
uint32_t qw_triangles_of_points(qw_env *env, const double *position, uint32_t count, uint32_t **corner);

/* double[count][3], in the current scope: the positions, of which those that are noise beside how far points are apart
 * lie on one sheet. The two sides of a plate thinner than that become one. position: as above. */
double *qw_flatten_points(qw_env *env, const double *position, uint32_t count);

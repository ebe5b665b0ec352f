/* Quads whose Catmull-Clark limit surface lies nearest to a shape.
 *
 * Limit points at the vertices, edges and middles of the quads are sums of vertices with weights that depend on the
 * connectivity alone (stencils.h). Each has a nearest point on the shape, and the vertices are the least squares of the
 * distances from the planes of the shape there, weighted by area; along the planes the limit points are drawn to where
 * they were at first, by a little, which keeps the quads as even as they came. The nearest points are looked up a few
 * times anew.
 */
#pragma once

#include "products/limit/fit_shape.h"

typedef struct qw_limit_fit {
    const qw_shape *shape;
    const uint8_t *stays; /* uint8_t[quads->vertex_count]: vertices that stay; NULL: corners alone do */
} qw_limit_fit;

/* Moves quads->position. No corner of a quad, nor of the limit surface, turns over. quads: linked, on the shape, with
   kinds, marks and components. */
void qw_fit_limit(qw_env *env, qw_quadmesh *quads, const qw_limit_fit *fit);

/* So many edges around each full circle: of curves that turn, such as the rims of holes, and of the surface where it
 * bends, such as on fillets. */
#pragma once

#include "geometry/trimesh.h"

/* The curvature of the least circle that lies at each vertex of `cut`, 1 over its radius: float[cut->vertex_count], 0
   where there is none; in the current scope. mesh: facets as the input has them; cut: the same with its long edges cut
   (long_edges.h). least: of the turns that count, in radians. with_boundary: boundaries are curves too. */
float *qw_find_circles(qw_env *env, const qw_trimesh *mesh, const qw_trimesh *cut, double least, bool with_boundary);

/* Lowers size, float[mesh->vertex_count], so that an edge turns by at most `turn` on the circle that it lies on, and
   raises the rest so that as many quads cover the surface as with the sizes given. Where there is no room for that,
   edges on circles turn more. bend: float[mesh->vertex_count], as above. */
void qw_fit_around(qw_env *env, const qw_trimesh *mesh, const float *bend, double turn, float *size);

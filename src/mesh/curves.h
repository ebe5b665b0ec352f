/* Which feature curves the quads can follow. */
#ifndef QW_MESH_CURVES_H
#define QW_MESH_CURVES_H

#include "mesh/trimesh.h"

/* Takes the marks off feature edges that run beside a stronger curve, closer than 0.4 `least`, and off what is then
   left in pieces too short to be worth an edge of a quad. Between two curves on the same lattice line nothing has room:
   where they meet at a sharp angle (less than a quarter of a right one) the band between them would be drawn to a line
   over its whole length. The stronger is the boundary, then the longer times the sharper. least: float[vertex_count],
   about half the wanted edge length of the quads, so that the band is at most one triangle wide. Returns the number of
   edges that lost their mark. */
int64_t qw_drop_close_curves(qw_env *env, qw_trimesh *mesh, const float *least);

#endif

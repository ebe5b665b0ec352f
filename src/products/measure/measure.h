/* What a polygon mesh is worth: topology, quality, and distances to the surface it stands for. */
#pragma once

#include "products/measure/distance.h"

/* Fills both. against may be NULL: distances and flipped_faces are then negative, as are the figures of quads in a mesh
   without any. sides: may be NULL.
   Non-manifold vertices count as one vertex a fan in euler, and their fans apart in boundary_loops. Lengths are given
   in mean edges of the quads, or of all faces where there is no quad. The same input gives the same figures at any
   thread count. */
void qw_measure_mesh(qw_env *env, const qw_mesh_view *mesh, const qw_mesh_view *against, const qw_sides *sides,
                     qw_topology *topology, qw_quality *quality);

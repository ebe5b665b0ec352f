/* Distances between a polygon mesh and the surface it stands for; called by qw_measure_mesh. */
#ifndef QW_MESH_DISTANCE_H
#define QW_MESH_DISTANCE_H

#include "mesh/polygons.h"

/* Fills flipped_faces and the distances, in units of quality->mean_edge, which is set and positive.
   both: as qw_measure_mesh has it. */
void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, const uint8_t *both, qw_quality *quality);

#endif

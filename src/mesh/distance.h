/* Distances between a polygon mesh and the surface it stands for; called by qw_measure_mesh. */
#ifndef QW_MESH_DISTANCE_H
#define QW_MESH_DISTANCE_H

#include "mesh/polygons.h"

/* By what it is known whether faces are flipped, where the surface alone does not say. */
typedef struct qw_sides {
    const uint8_t *both; /* uint8_t[faces of the surface], 1 on sheets that faces may lie on either side of, or NULL */
    const qw_mesh_view *origin; /* to be judged by in place of the surface, or NULL */
} qw_sides;

/* Fills flipped_faces and the distances, in units of quality->mean_edge, which is set and positive.
   sides: may be NULL. */
void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, const qw_sides *sides, qw_quality *quality);

#endif

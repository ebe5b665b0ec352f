/* Distances between a polygon mesh and the surface it stands for; called by qw_measure_mesh. */
#pragma once

#include "geometry/polygons.h"

/* Of a triangle of which only the outside is seen: it is a sheet, on either side of which faces may lie; beyond its
 * edge i there is room (QW_SEEN_BEYOND << i), so that one that is sharp is an edge of what is seen. */
enum qw_seen_flag { QW_SEEN_BOTH = 1, QW_SEEN_BEYOND = 2 };

/* What is known of a surface that it does not say alone. */
typedef struct qw_sides {
    const uint8_t *seen;        /* uint8_t[faces of the surface, triangles]: QW_SEEN_ flags; or NULL: all is seen */
    const qw_mesh_view *origin; /* to be judged by in place of the surface, or NULL */
} qw_sides;

/* Fills flipped_faces and the distances, in units of quality->mean_edge, which is set and positive.
   sides: may be NULL. */
void qw_measure_distances(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges,
                          const qw_mesh_view *against, const qw_sides *sides, qw_quality *quality);

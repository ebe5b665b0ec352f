/* Joining of vertices: renames corners to the lowest vertex of each group and returns how many vertices were renamed.
 */
#pragma once

#include "geometry/edges.h"

/* Equal as numbers (-0 is 0). only: uint8_t[vertex_count], vertices that may be joined; NULL for all. */
uint32_t qw_weld_equal(qw_env *env, const double *position, uint32_t vertex_count, const uint8_t *only,
                       uint32_t *corner, uint32_t face_count);

/* Joins boundary vertices that are closer than the tolerance, where that closes boundary edges and gives no edge more
   than two sides. Groups that would do the latter, and groups that hold both ends of an edge (short edges are not to
   vanish), are left alone. Changes nothing unless the number of boundary edges falls. edges: of the corners as they
   are. */
uint32_t qw_weld_near(qw_env *env, const double *position, uint32_t vertex_count, double tolerance, const uint8_t *only,
                      const qw_edges *edges, uint32_t *corner, uint32_t face_count);

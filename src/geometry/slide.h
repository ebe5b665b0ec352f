/* Nearest points found by walking: from a known place on a surface to a nearby one, face by face, always downhill in
 * distance.
 *
 * Unlike a search in space (geometry/bvh.h) a walk needs no tree, costs a few faces, and cannot jump to the other side
 * of a thin wall, as it never leaves the sheet it started on. It ends in a local minimum of the distance, which is what
 * is wanted of a vertex that slides a fraction of an edge.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_surface_point {
    uint32_t half_edge; /* the point lies in its face, or on it where a curve was walked */
    float distance2;    /* from the point asked for, squared */
    qw_vec3 point;
} qw_surface_point;

/* Starts in the face of half-edge `from`; ends early once distance2 <= enough2. outgoing: as of qw_trimesh_outgoing. */
qw_surface_point qw_slide_on_surface(const qw_trimesh *mesh, const uint32_t *outgoing, uint32_t from, qw_vec3 p,
                                     float enough2);
/* Along the curve of marked or boundary edges that the half-edge `from` lies on, not beyond vertices v with stop[v].
   stop: uint8_t[vertex_count]; every curve vertex that is not on exactly two curve edges must have it. */
qw_surface_point qw_slide_on_curve(const qw_trimesh *mesh, const uint32_t *outgoing, const uint8_t *stop, uint32_t from,
                                   qw_vec3 p);
/* The best of the curves that leave the vertex v, which is on one at least. */
qw_surface_point qw_slide_from_corner(const qw_trimesh *mesh, const uint32_t *outgoing, const uint8_t *stop, uint32_t v,
                                      qw_vec3 p);

/* Squared distance of p from the triangle. */
float qw_triangle_distance2(qw_vec3 a, qw_vec3 b, qw_vec3 c, qw_vec3 p);

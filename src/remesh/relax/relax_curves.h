/* Which curve of the input (sharp edges, boundary) each curve vertex of the quads belongs to, and where on it.
 *
 * Curve vertices that neighbour one another along constrained edges of the quads form chains, from corner to corner or
 * closed. A chain belongs to the one input curve that most of its vertices are nearest to, so that a vertex never lands
 * on a curve that merely runs close by. Corners are pinned to the input's corners; curves end there and where other
 * than two of their edges meet.
 */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

typedef struct qw_curve_binding {
    const qw_trimesh *surface;
    uint32_t *outgoing; /* of the surface; NULL where it has no curves */
    uint8_t *stop;      /* uint8_t[surface->vertex_count]: no vertex slides beyond */
    uint32_t *edge; /* uint32_t[quads->vertex_count]: the surface's half-edge that a curve vertex lies on, or QW_NONE */
} qw_curve_binding;

/* Moves the curve vertices onto their curves and corners to theirs. position, size: [quads->vertex_count]; size: edge
 * length around. */
qw_curve_binding qw_bind_curves(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const float *size,
                                qw_vec3 *position);

/* The point of the curve nearest to p, walking from *edge, which follows. */
qw_vec3 qw_slide_bound(const qw_curve_binding *b, uint32_t *edge, qw_vec3 p);

/* Boundary and marked edges of the surface; NULL where it has none. */
qw_curve_tree *qw_all_curves(qw_env *env, const qw_trimesh *surface);

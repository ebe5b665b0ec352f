/* Relaxation on the input surface: vertices slide on the surface, vertices on curves along their own
 * curve, corners not at all, until the quads are as square and as even as their connectivity lets them; no quad is
 * flipped, and those that come in so are turned back where that can be done. Where a corner of a quad stays
 * inverted otherwise, corners move along curves, by a part of an edge. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

/* What the quads should be like. mesh, size: a wanted edge length at each vertex of a surface near by,
   float[mesh->vertex_count], of which only the ratios within a component count; both NULL: all of one size. evenness: 0
   cares for right angles alone, 1 for areas before all. flipped: uint8_t[quads->face_count], set to the qw_flip
   (geometry/flips.h) of each quad; turn: the same, as of qw_choose_diagonals; each may be NULL. direction:
   qw_vec3[mesh->vertex_count], tangents along or across which quads are to lie, as long as they are clear, 0 to 1, or
   NULL; follow: how much that counts, 0 to 1. held: uint8_t[quads->vertex_count], 1 for vertices that stay where they
   are, or NULL. */
typedef struct qw_relax_target {
    const qw_bvh *tree; /* of the surface; NULL: it is built */
    const qw_trimesh *mesh;
    const qw_bvh *near; /* of `mesh`; NULL: it is built where it is needed */
    const float *size;
    float evenness;
    uint8_t *flipped, *turn;
    const qw_vec3 *direction;
    float follow;
    const uint8_t *held;
    bool leaves_flips; /* flipped quads are not repaired, as the quads are to be changed and relaxed again */
} qw_relax_target;

/* An angle that is off by some radians counts as much as an area that is off by that share. */
#define QW_EVENNESS 0.5f

/* surface: with marks; its marked and boundary edges are the curves. Returns qw_vec3[quads->vertex_count]. */
qw_vec3 *qw_relax_quads(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface,
                        const qw_relax_target *target);

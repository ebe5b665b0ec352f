/* Flip repair: quads that lie with their back to the surface, and inverted corners, by the steps of one table. Vertices
 * move, and nothing else changes.
 */
#pragma once

#include "geometry/flips.h"
#include "remesh/relax/relax_curves.h"

typedef struct qw_flip_repair {
    const qw_trimesh *surface; /* as relaxation has it: vertices move on it */
    const qw_bvh *tree;        /* of the surface; NULL: it is built where it is needed */
    qw_curve_binding *curves;  /* of the quads' vertices, changed with them; NULL: none is bound */
    const qw_vec3 *ground;     /* qw_vec3[vertices]: normal of the surface where each lies, or 0; may be NULL */
    const uint8_t *stays;      /* uint8_t[vertices]: 1: does not move; NULL: all may */
} qw_flip_repair;

typedef struct qw_flip_counts {
    uint32_t flipped, flipped_left, doubtful_left; /* quads */
    uint32_t inverted, inverted_left;              /* corners */
} qw_flip_counts;

/* Repairs quads near flipped ones and near inverted corners, where that leaves fewer and keeps the shape; all other
   quads stay as they are. quads: linked; their positions change. flipped: uint8_t[quads->face_count], set to the
   qw_flip of each quad. */
qw_flip_counts qw_repair_flips(qw_env *env, qw_quadmesh *quads, const qw_flip_repair *repair, uint8_t *flipped);

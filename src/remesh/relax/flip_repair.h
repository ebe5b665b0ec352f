/* Flip repair: quads that lie with their back to the surface, and inverted corners, by the steps of one table.
 *
 * After relaxation vertices move, and nothing else changes. Where no other attempt follows, as the last resort,
 * vertices may also leave their curves by a part of an edge, and the quads around are changed by moves (quad_moves.h).
 */
#ifndef QW_REMESH_RELAX_FLIP_REPAIR_H
#define QW_REMESH_RELAX_FLIP_REPAIR_H

#include "geometry/flips.h"
#include "remesh/relax/relax_curves.h"

typedef struct qw_flip_repair {
    const qw_trimesh *surface; /* as relaxation has it: vertices move on it */
    const qw_bvh *tree;        /* of the surface; NULL: it is built where it is needed */
    const qw_trimesh *whole;   /* by which quads are flipped; NULL: the surface */
    qw_curve_binding *curves;  /* of the quads' vertices, changed with them; NULL: none is bound */
    const qw_vec3 *ground;     /* qw_vec3[vertices]: normal of the surface where each lies, or 0; may be NULL */
    bool last_resort;          /* the steps of the last resort, not those that follow relaxation */
    int64_t least;             /* the last resort leaves so many quads at least, if there are as many */
} qw_flip_repair;

typedef struct qw_flip_counts {
    uint32_t flipped, flipped_left, doubtful_left; /* quads */
    uint32_t inverted, inverted_left;              /* corners */
} qw_flip_counts;

/* Repairs quads near flipped ones and, after relaxation, near inverted corners, where that leaves fewer and keeps
   the shape; all other quads stay as they are. After relaxation the positions of `quads` (linked) change; as the
   last resort connectivity changes as well, and *quads gets new arrays, in the current scope, where there was
   anything to repair. flipped: uint8_t[quads->face_count], set to the qw_flip of each quad. */
qw_flip_counts qw_repair_flips(qw_env *env, qw_quadmesh *quads, const qw_flip_repair *repair, uint8_t *flipped);

#endif

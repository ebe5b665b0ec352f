/* A surface that stands for another one, as the skin of a wrap stands for what of the input is seen from outside: where
 * the two lie close together the other one is the target, and quads are fitted to it. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

typedef struct qw_fit_target {
    const qw_bvh *surface; /* that stands for the other one, near to which the quads lie */
    const qw_bvh *tree;    /* of the target, each triangle both ways round; NULL: the surface itself */
    float reach;           /* what is farther than this from the surface is no part of it */
    float off;             /* where the surface lies on both sides of the target, each side stays so far off it */
} qw_fit_target;

/* The place that counts for one on the surface whose side is towards `up`; the surface's own where there is no target.
   hint: of the tree, as of qw_bvh_nearest. *is_thin, unless NULL: whether the surface has another side behind the
   place, within `reach`. Thread-safe. */
qw_vec3 qw_target_place(const qw_fit_target *m, qw_vec3 place, qw_vec3 up, uint32_t *hint, bool *is_thin);

/* Moves the vertices on curves and at corners, but those of boundaries, onto the edges and corners in which the planes
   of the target around them meet. quads: linked. */
void qw_put_curves_on_target(qw_env *env, qw_quadmesh *quads, const qw_fit_target *m);

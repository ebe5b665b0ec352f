/* A connected component made straight from its triangles, without fields: these draw together what is thinner than
 * quads, and for components of next to no quads they take far too long.
 *
 * - The fewest quads that there can be: one for a disc, its corners on the boundary; the six of a box for a sphere. The
 *   time is proportional to the triangles.
 * - Of a sphere that is a rod, wire or spring: rings (rod.h).
 * - Pairs: remeshed with twice as many triangles as quads, paired (remesh/quads/pair.h), thinned out.
 *
 * All variants have one judge: the topology of the component, and no flipped quad.
 */
#pragma once

#include "geometry/flips.h"
#include "geometry/quadmesh.h"

typedef struct qw_straight {
    double quads;   /* about so many */
    qw_flip enough; /* what a quad may be at worst, so that no other variant is tried */
    bool is_least;  /* the fewest quads that there can be, or none */
} qw_straight;

/* Quads of `part`, a component as a surface of its own, in the current scope: of the variant whose worst quad is best,
 *worst, with all arrays; component 0. No faces: each variant has lost the topology or has flipped quads. */
qw_quadmesh qw_make_straight(qw_env *env, const qw_trimesh *part, const qw_straight *plan, qw_flip *worst);

/* Quads on the planes, cylinders, cones, spheres and tori of a designed part: their vertices lie on these to rounding,
 * and not on the triangles that cut the corner; those between two of them on both. Circles have equal edges, and angles
 * around them are eased. */
#pragma once

#include "geometry/bvh.h"
#include "products/exact/primitives.h"
#include "geometry/quadmesh.h"

typedef struct qw_exact {
    const qw_primitives *found;
    const qw_trimesh *surface;
    const double *position; /* double[surface->vertex_count][3]: the surface's, in the frame, as exact as they come */
    const qw_bvh *tree;     /* of the surface */
    const uint8_t *stays;   /* uint8_t[quads->vertex_count], 1: stays where it is; NULL: none does */
    bool planes_only;       /* only vertices all about which is one plane */
    bool evens;             /* rows and circles are made even */
} qw_exact;

/* Moves place, double[quads->vertex_count][3] in the frame, and quads->position. quads: linked, with kinds, marks and
   components; no corner of theirs turns over. Returns how many vertices lie on primitives then. */
uint32_t qw_put_on_primitives(qw_env *env, qw_quadmesh *quads, double *place, const qw_exact *exact);

/* The boundary of a half: where it was cut, and where the surface was open before. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

/* The boundary of a surface in arcs, between the points where the cut meets other boundaries. */
typedef struct qw_rim {
    uint32_t arc_count;
    uint8_t *cut;    /* uint8_t[arc_count]: number of the plane along which it was cut, plus 1; 0: it was open before */
    qw_vec3 *middle; /* qw_vec3[arc_count]: the point halfway along */
    uint8_t *is_closed;  /* uint8_t[arc_count]: a whole boundary loop */
    uint32_t *arc;       /* of each segment of the tree */
    qw_curve_tree *tree; /* NULL: there is no boundary */
} qw_rim;

/* on_planes: uint8_t[surface->vertex_count], bit p: lies in plane p. surface: linked. In the current scope. */
qw_rim qw_rim_of(qw_env *env, const qw_trimesh *surface, const uint8_t *on_planes);

/* uint8_t[4 quads->face_count]: of half-edges of the boundary of the quads, made of that surface, as `cut` of the arc
   that they lie on, else 0.
   Each arc has an edge, and one that was no cut has two: where it has less, as a hole that is smaller than a quad, its
   middle becomes the place of the nearest vertex. */
uint8_t *qw_find_sewn(qw_env *env, const qw_rim *rim, qw_quadmesh *quads);

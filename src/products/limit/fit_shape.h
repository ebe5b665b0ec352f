/* The surface that subdivided quads and limit surfaces are fitted to: its triangles and its curves, sharp edges and
 * boundaries, for queries of the nearest point. */
#pragma once

#include "geometry/bvh.h"

typedef struct qw_shape {
    const qw_bvh *tree;          /* of the surface, whose components are those of the quads */
    const qw_curve_tree *curves; /* NULL: it has none */
    const qw_vec3 *from, *to;    /* qw_vec3[segments]: the curves' segments */
    const qw_trimesh *surface;   /* of the tree */
} qw_shape;

/* Where a point of the quads belongs. */
typedef struct qw_shape_hit {
    bool is_found;
    qw_vec3 point, along; /* along: the surface's unit normal, or the curve's unit tangent */
} qw_shape_hit;

/* The nearest point within reach of the sheet that faces as the normal does; of the component, unless that is QW_NONE.
   hint: a face to begin with, which follows; may point to QW_NONE. */
qw_shape_hit qw_nearest_on_shape(const qw_shape *shape, uint32_t component, qw_vec3 point, qw_vec3 normal, float reach,
                                 uint32_t *hint);
/* The nearest point within reach of a curve that runs as the tangent does, either way. */
qw_shape_hit qw_nearest_on_curves(const qw_shape *shape, qw_vec3 point, qw_vec3 tangent, float reach);

/* Puts the vertices of quads, which are linked and have their kinds, marks and components, on the shape: on its curves
   where the quads have one, corners and the vertices that stay nowhere else, uint8_t[quads->vertex_count], NULL: none
   do. No corner of a quad turns over. */
void qw_put_on_shape(qw_env *env, qw_quadmesh *quads, const qw_shape *shape, const uint8_t *stays);

/* The mean length of the edges at each vertex: float[quads->vertex_count], in the current scope. */
float *qw_edges_around(qw_env *env, const qw_quadmesh *quads);

/* How a surface bends, summed up over pieces of it: areas, normals and the tensors of its edges, of which the principal
 * curvatures of the whole piece follow (Cohen-Steiner and Morvan 2003, Restricted Delaunay triangulations and normal
 * cycle). */
#pragma once

#include "geometry/trimesh.h"

/* What a piece sums up of its surface; sums of pieces are those of both. */
typedef struct qw_bends {
    float area;
    float normal[3]; /* times the area */
    float tensor[6]; /* angle times length along each edge: xx, yy, zz, xy, yz, zx */
} qw_bends;
enum { QW_BENDS = sizeof(qw_bends) / sizeof(float) };

/* of: uint32_t[mesh->vertex_count], the piece of each vertex, or NULL: each is one. Curve edges do not count. Returns
   qw_bends[count], in the current scope, in the same order at any thread count. */
qw_bends *qw_sum_bends(qw_env *env, const qw_trimesh *mesh, const uint32_t *of, uint32_t count);

/* The mean principal curvatures of what was summed up, the larger first. Returns the normal. */
qw_vec3 qw_principal_curvatures(const qw_bends *sums, double curvature[2]);

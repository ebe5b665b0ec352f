/* Which parts of a surface are planes, cylinders, cones, spheres and tori, as those of a part that was designed are:
 * its vertices lie on them, and its triangles cut the corner.
 *
 * Triangles in one plane are facets. Facets that meet at a blunt angle are tried for a cylinder or a cone through all
 * their vertices; what fits grows over its neighbours as long as their vertices lie on it. It is one where more points
 * agree than are needed to say so, far better than the facets do, and where it ends for a reason: at a boundary, at a
 * sharp edge, or where the surface goes on less bent, as it does at the tangent of a round. A facet that is no part of
 * any is a plane where it ends in the same way. Spheres and tori need a vertex inside instead, and may need no reason.
 */
#pragma once

#include "products/exact/primitive.h"
#include "geometry/trimesh.h"

typedef struct qw_primitives {
    uint32_t count;
    qw_primitive *item; /* qw_primitive[count] */
    uint32_t *of_face;  /* uint32_t[faces]: the primitive that each triangle is of, or QW_NONE */
} qw_primitives;

/* By a sample of triangles, in no time: whether so many lie in one plane with a neighbour that it may be worth looking.
 */
bool qw_may_be_designed(const qw_trimesh *mesh);

/* mesh: linked. position: double[mesh->vertex_count][3], in the centred frame, as exactly as the input has them.
   sharp: cosine between the normals of triangles below which their edge is sharp. quads: how many will lie on it, so
   that planes smaller than one are none. In the current scope. */
qw_primitives qw_find_primitives(qw_env *env, const qw_trimesh *mesh, const double *position, double sharp,
                                 uint32_t quads);

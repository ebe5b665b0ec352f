/* Where quads are smaller and where larger: from the shape of the surface, and from a density painted on it.
 *
 * A quad of edge s on a surface of curvature k bows by s^2 k / 8. Were the bow equal everywhere, s would go as the root
 * of 1 / k; a little less than that is best for the mean distance as well. Curvature is that of the input itself in a
 * ball as wide as the quads will be there. Besides, there should be some quads around a limb
 * and between two feature curves. Sizes grow from quad to quad by a bounded factor, and the number of quads stays as it
 * was.
 */
#pragma once

#include "remesh/sizes/cells.h"
#include "geometry/bvh.h"

typedef struct qw_density_request {
    double edge;                   /* of the quads on the average, in the frame of the surface; positive */
    double strength;               /* how much the shape says: 0 nothing, 1 all of it */
    const qw_density *painted;     /* qw_density[surface->vertex_count], positive; NULL: 1 everywhere */
    bool with_boundary;            /* boundaries are feature curves as well */
    const qw_surface_cells *cells; /* of the surface and the edge; NULL: strength is 0 */
    const qw_bvh *tree;            /* of the surface; NULL: there is none yet */
} qw_density_request;

/* By what the wanted edge length at each vertex is to be multiplied: float[surface->vertex_count], in the current
   scope. The integral of area / factor^2 is the area. In the same order at any thread count. */
float *qw_size_factors(qw_env *env, const qw_trimesh *surface, const qw_density_request *request);

/* How many quads cover the surface if their edges have these lengths: size, float[surface->vertex_count]. */
double qw_quads_of_size(const qw_trimesh *surface, const float *size);

/* Points of a surface with its normals there and how far it bends: the root of the sum of the squared principal
   curvatures, in 1 / length. */
typedef struct qw_limb_points {
    uint32_t count;
    const qw_vec3 *point, *normal; /* qw_vec3[count] */
    const float *bend;             /* float[count] */
} qw_limb_points;

/* Lowers size where fewer than six quads would go around the limb that a point lies on. size: float[at->count]. */
void qw_fit_limbs(qw_env *env, const qw_bvh *surface, const qw_limb_points *at, float *size);

/* Lowers size where two feature curves run side by side with fewer than two quads between them. */
void qw_fit_between_curves(qw_env *env, const qw_trimesh *surface, bool with_boundary, float *size);

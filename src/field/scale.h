/* Scale field: how large the quads should be at each vertex (the paper's program has one; the paper does not describe
 * it). */
#ifndef QW_FIELD_SCALE_H
#define QW_FIELD_SCALE_H

#include "mesh/trimesh.h"

/* Makes sizes smaller so that they grow by at most `slope` a unit of length along the edges; never larger. size:
 * float[vertex_count]. */
void qw_limit_gradation(qw_env *env, const qw_trimesh *mesh, float *size, float slope);

/* Multiplies size so that it follows curvature: small where the normals turn fast, large where the surface is flat, by
   a factor between 1/3 and 1.6 at strength 1, with bounded gradation, and with the sum of area / size^2 (the number of
   quads) unchanged. */
void qw_scale_by_curvature(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, float strength, float *size);

#endif

/* Bounded gradation: how fast sizes may grow along a surface. */
#pragma once

#include "geometry/trimesh.h"

/* Makes sizes smaller so that they grow by at most `slope` a unit of length along the edges; never larger. size:
 * float[vertex_count]. */
void qw_limit_gradation(qw_env *env, const qw_trimesh *mesh, float *size, float slope);

/* The length of the shortest way along edges to a vertex that is_from, `farthest` where it is longer:
   float[vertex_count]. */
float *qw_distances(qw_env *env, const qw_trimesh *mesh, const uint8_t *is_from, float farthest);

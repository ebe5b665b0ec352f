/* Room around small loops. */
#pragma once

#include "geometry/trimesh.h"

/* A closed curve that meets no other (the rim of a hole) needs four edges of quads, or the hole closes. Makes sizes
   smaller along loops that have no room for them, and around, where they grow with the distance as the circles about a
   small one do. size: float[vertex_count]. Returns the number of such loops. */
int64_t qw_fit_loops(qw_env *env, const qw_trimesh *mesh, bool with_boundary, float *size);

/* Isolated points of a surface: tips of cones, spikes and dull pyramids, which lie on no sharp edge. */
#pragma once

#include "geometry/trimesh.h"

/* Sets mesh->point: uint8_t[vertex_count], 1 at each tip; NULL where there is none. size: the edge length that the
   quads would have. Sharp edges are marked already. Returns their number. */
uint32_t qw_find_points(qw_env *env, qw_trimesh *mesh, float size);

/* Surfaces without long edges: what is looked for at their vertices is not missed between them. */
#pragma once

#include "geometry/trimesh.h"

/* The surface with its long edges cut in halves until none is longer than `longest`; vertices keep their numbers. The
   surface itself where none is, or where it would take more than `most` faces; else arrays of the current scope. */
qw_trimesh qw_without_long_edges(qw_env *env, const qw_trimesh *mesh, float longest, uint32_t most);

/* Few large patches for many small ones: lines that leave vertices which are not regular go straight on, and the quads
 * between them are grids, of which each is one B-spline surface. */
#pragma once

#include "io/step.h"
#include "geometry/quadmesh.h"

/* The patches of quads (products/limit/patches.h) as blocks; NULL where some of them are no grids. In the current
 * scope. */
qw_patch_blocks *qw_join_patches(qw_env *env, const qw_quadmesh *quads, const qw_patches *patches);

/* Quads of a rod, wire or spring: rings of four, one behind the other, and one at either end; or of one that is closed,
   as key rings and links of chains are: rings all the way. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

/* part: a closed component without handles, or with one where is_ring, as a surface of its own; tree: over it. About so
   many quads, in the current scope, component 0. No faces where lines at one distance from the end of it are not one
   loop each. */
qw_quadmesh qw_make_rod(qw_env *env, const qw_trimesh *part, const qw_bvh *tree, bool is_ring, double quads);

/* Which components of a surface quads lie on. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

/* uint32_t[quads->vertex_count]: the component of the surface that each connected part of the quads, or one side of it,
   lies on, that of most of its quads; 0 where the surface's are not told apart. reflected: the first quad that is a
   reflection. tree: of the surface. In the current scope. */
uint32_t *qw_components_below(qw_env *env, const qw_quadmesh *quads, uint32_t reflected, const qw_trimesh *surface,
                              const qw_bvh *tree);

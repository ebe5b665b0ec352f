/* A caller's mesh of quads, subdivided. */
#pragma once

#include "geometry/quadmesh.h"

/* The mesh with each quad split `times` times and all vertices on the limit surface of Catmull and Clark's rule, in the
   current scope. Marked edges are creases, a vertex marked with itself is a corner. Fails with QW_ARGUMENT where a face
   is no quad, an edge has more than two or two that are turned unlike, or a mark is no edge. */
qw_mesh_view qw_limit_of_cage(qw_env *env, const qw_mesh_view *cage, uint32_t times);

/* The marks of quads as a view has them: the ends of the creases, uint32_t[*count][2], and corners twice; NULL where
   there are none. In the current scope. */
uint32_t *qw_list_creases(qw_env *env, const qw_quadmesh *quads, uint32_t *count);

/* Moves of vertices that turn no corner of a quad over. */
#ifndef QW_LIMIT_UPRIGHT_H
#define QW_LIMIT_UPRIGHT_H

#include "mesh/quadmesh.h"

/* Takes back so much of the way from `before` to quads->position, qw_vec3[quads->vertex_count] both, that no corner of
   a quad becomes inverted or turns over: half of it, then half of the rest, and at last all, at the vertices of such
   quads. Returns how many vertices were held back. */
uint32_t qw_keep_upright(qw_env *env, qw_quadmesh *quads, const qw_vec3 *before);

#endif

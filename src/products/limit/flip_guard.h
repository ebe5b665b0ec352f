/* Moves of vertices that flip no corner of a quad. */
#ifndef QW_PRODUCTS_LIMIT_FLIP_GUARD_H
#define QW_PRODUCTS_LIMIT_FLIP_GUARD_H

#include "geometry/quadmesh.h"

/* Takes back so much of the way from `before` to quads->position, qw_vec3[quads->vertex_count] both, that no corner of
   a quad becomes inverted or flipped: half of it, then half of the rest, and at last all, at the vertices of such
   quads. Returns how many vertices were held back. */
uint32_t qw_hold_back_flips(qw_env *env, qw_quadmesh *quads, const qw_vec3 *before);

#endif

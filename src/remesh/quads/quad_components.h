/* Quads picked and joined by their components. */
#pragma once

#include "geometry/quadmesh.h"

/* The quads of the components that are wanted, in their order, with room for those of `more` (may be NULL) behind them.
   quads has kinds, marks, twins and components; wanted: uint8_t for each number in quads->component. In the current
   scope. */
qw_quadmesh qw_pick_components(qw_env *env, const qw_quadmesh *quads, const uint8_t *wanted, const qw_quadmesh *more);

/* quads has room for them. */
void qw_append_quads(qw_quadmesh *quads, const qw_quadmesh *more);

/* All of them, one behind the other; each has all arrays. In the current scope. */
qw_quadmesh qw_join_quads(qw_env *env, const qw_quadmesh *quads, uint32_t count);

void qw_keep_quads(qw_env *env, const qw_quadmesh *quads); /* qw_keep for all of its arrays */

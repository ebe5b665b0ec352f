/* Aggregates: the unknowns of a signed graph Laplacian that move as one in the next coarser system, with the signs that
 * their couplings ask for (a negative entry: the same sign). They are joined by fours along their strongest couplings,
 * in pairs, then pairs of pairs. */
#pragma once

#include "solve/grid.h"

/* Fills group, member_first and member, in the current scope. Returns the number of aggregates. */
uint32_t qw_make_aggregates(qw_env *env, qw_grid *l);

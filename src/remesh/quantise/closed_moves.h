/* The closed moves of a small complex: all offsets that can be added to closed ones, so that they stay closed and what
 * is fixed stays zero. A box has one for each of its three lengths. */
#pragma once

#include "remesh/quantise/complex.h"

enum { QW_MOST_MOVED_EDGES = 128 };

/* A basis, qw_int2[count][edge_count] in *move. 0 where there are more than `most` (32 at most) or QW_MOST_MOVED_EDGES,
   or one has other fractions than halves. In the current scope. */
uint32_t qw_find_moves(qw_env *env, const qw_complex *c, uint32_t most, qw_int2 **move);

/* Subdivision of long integer edges (paper, Section 3.3 and Figure 6), so that every component of every offset is -1, 0
 * or 1. */
#pragma once

#include "remesh/offsets/offsets.h"

/* Splits edges with a component beyond 1 at their midpoints, longest first, until there are none. Eq. (3) must hold on
   every triangle. Returns how many edges were split. Arrays of m grow in the caller's scope. */
int64_t qw_subdivide_long_edges(qw_env *env, qw_offset_mesh *m);

/* Positions as they are written: doubles in the coordinates of the input, rounded to few digits where that costs
 * nothing. The promise that no quad is degenerate is kept here, on what the file will hold. */
#pragma once

#include "geometry/quadmesh.h"

/* Rounds position, double[quads->vertex_count][3], to whole multiples of 1 / unit (0: not), but for vertices whose
   edges are hardly longer than that. Where corners of a quad fall together or lie on one line all the same, they are
   pushed apart, by as little as does. Returns the first quad for which that failed, or QW_NONE; *moved: how often a
   vertex was pushed. quads: linked, none with a repeated corner. */
uint32_t qw_settle_written(qw_env *env, const qw_quadmesh *quads, double unit, double *position, uint32_t *moved);

/* Whether two corners of the quad are at one position or all four lie on one line. Certain: a quad that is none has an
   area in exact arithmetic too. */
bool qw_is_degenerate(const uint32_t *corner, const double *position);

/* Even rows of quads on cylinders and cones. */
#pragma once

#include "products/exact/held.h"

/* Turns vertices about the axes, and shifts them along, by less than half an edge: circles get equal edges, lines along
   the axis one angle, rows around it one height. The vertices lie on their primitives before. quads: linked, with
   kinds. */
void qw_even_rows(qw_env *env, const qw_quadmesh *quads, const qw_held *held);

/* Where a quad would become bad, and worse by more than `slack` than it was, least sines of its corners both, its
   vertices go back to `before`, double[vertices][3], and back, uint8_t[vertices], is 1 (NULL: not told). */
void qw_undo_bad(qw_env *env, const qw_quadmesh *quads, double *place, const double *before, double slack,
                 uint8_t *back);

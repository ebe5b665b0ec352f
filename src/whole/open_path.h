/* Rows of quads from one boundary loop to another: each adds an edge to both loops. A mesh of quads has an even number
 * of boundary edges in each component, so that loops that should have one edge more come in pairs. */
#pragma once

#include "geometry/quadmesh.h"

/* Gives each loop that is odd, uint8_t[loops] in the order of qw_find_rims, an odd number of edges more, and each of
   the others an even number, if it changes at all: the quads along a path of edges between two loops are drawn apart.
   quads: linked; gets new arrays where something changes. The order of the loops, and all half-edges, stay; odd is
   overwritten. Fails where an odd loop has none to go with it in its component. */
void qw_add_rows_between(qw_env *env, qw_quadmesh *quads, uint8_t *odd);

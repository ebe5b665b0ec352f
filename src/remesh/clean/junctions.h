/* T-junctions: vertices on open edges of other triangles, where two rows of triangles meet that were cut in different
 * places, as solids of modellers and of slicers have them.
 *
 *       a ______w______ b        the edge a b is split at w where an open edge leaves w along it: then its parts, and
 *        \     / \    /          those of the row below, are the same
 *         \   /   \  /
 */
#pragma once

#include "remesh/clean/sheets.h"

/* Splits open edges at the vertices of other open edges that lie on them and run along them, no further off than the
   tolerance. An edge is split only where a part of it is closed by that and none has more than two sides. edges: of the
   faces as they are. Faces that lie on one another are not sewn. only: uint8_t[vertex_count], edges between other
   vertices than these stay; NULL: all may be split. Corner, source and named are new where something was split. sewn:
   uint8_t[vertex_count], receives 1 at vertices where there were splits and ends of what was split. Returns the number
   of splits. */
uint32_t qw_sew_junctions(qw_env *env, qw_sheets *s, double tolerance, const qw_edges *edges, const uint8_t *only,
                          uint8_t *sewn);

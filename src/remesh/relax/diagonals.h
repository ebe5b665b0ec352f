/* The choice of the diagonal along which a quad that is not plane is folded. Renderers, printers and measures cut
   quads into two triangles, nearly all from the first corner to the third. So each quad begins at the corner from
   which this cut lies nearer to the surface: the mean distance of the same vertices falls by an eighth to a fifth. */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

/* turn: uint8_t[quads->face_count], set to 1 for quads that should begin at their second corner: where the other
   diagonal's middle lies nearer to the surface, or a corner that is straight or points inward would not be cut through
   else. place: uint32_t[quads->vertex_count], the triangle of the surface in which each vertex lies, from where a walk
   is shorter than a search, or QW_NONE. outgoing: as of qw_trimesh_outgoing; tree: of the surface. */
void qw_choose_diagonals(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const uint32_t *outgoing,
                         const qw_bvh *tree, const uint32_t *place, uint8_t *turn);

/* The same mesh with these quads begun at their second corner; corners, twins and marks are new, in the current scope.
 */
qw_quadmesh qw_turn_quads(qw_env *env, const qw_quadmesh *quads, const uint8_t *turn);

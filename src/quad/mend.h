/* The last resort for quads that are left turned over: other quads in their place. What untangle.h and straighten.h
 * could not help by moving vertices is mostly beyond help that way, such as quads squeezed in between several holes
 * that are all smaller than an edge. Here vertices may leave their curves by a part of an edge, and the quads around
 * are changed by moves (moves.h), one or two at a time, as long as fewer are turned over then.
 */
#ifndef QW_QUAD_MEND_H
#define QW_QUAD_MEND_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"

/* Whether a quad is certainly turned over: most of it opposes the surface, and no part of that within an edge length
   agrees that is worth mentioning (crumbs do not count: scans have single triangles that face any way). surface: as
   relaxation has it; whole: before it was made coarser, by which is judged. */
bool qw_has_flipped(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_trimesh *whole);

/* A new mesh in the current scope, of at least `least` quads if it had as many; the same where nothing helped. flipped:
   uint8_t[quads->face_count], as of untangle.h, which is replaced by that of the new mesh. Returns how many were
   mended. */
uint32_t qw_mend_flipped(qw_env *env, qw_quadmesh *quads, const qw_trimesh *surface, const qw_trimesh *whole,
                         int64_t least, uint8_t **flipped);

#endif

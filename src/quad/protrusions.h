/* Protrusions that the quads do not reach: a horn, a leg or a finger that the integers made vanish as a disc grows out
 * of the quad below it, in rings of four, as one would extrude it by hand. The topology stays.
 */
#ifndef QW_QUAD_PROTRUSIONS_H
#define QW_QUAD_PROTRUSIONS_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"

/* A new mesh in the current scope with at most `most` quads more, on the surface but not relaxed; the same where
   nothing grew. A protrusion is a disc of the surface that is further than `edge` halves from every quad, and somewhere
   further than `far`. edge: the mean length of an edge. marked: those that have marked edges, which their quads do not
   follow; else those that have none. Returns how many grew. */
uint32_t qw_extrude_protrusions(qw_env *env, qw_quadmesh *quads, const qw_trimesh *surface, float edge, float far,
                                bool marked, uint32_t most);

#endif

/* Relaxation on the input surface (DESIGN 2.6): every quad pulls its corners towards the square that fits it best, blended towards the
 * wanted size; free vertices slide on the surface, vertices on curves along them, corners not at all; a move that would turn a corner inside out
 * is not made. */
#ifndef QW_QUAD_RELAX_H
#define QW_QUAD_RELAX_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"

/* surface: with marks; its marked and boundary edges are the curves. Returns qw_vec3[quads->vertex_count]. */
qw_vec3 *qw_relax_quads(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface);

#endif

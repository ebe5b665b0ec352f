/* Which way rows run on planes: along the straight edges around them.
 *
 * A plane bends nowhere, so that the shape asks for nothing there; but lines that part around a hole are to be straight
 * again behind it. The edges around a plane vote for their directions by the fourth power of the angle: those of a
 * rectangle agree, those of holes and discs cancel. */
#pragma once

#include "geometry/trimesh.h"

/* Sets the directions of vertices of planes: along the edges around, as long as these agree and the cross there lies
   that way, 0 to 1; where they are longer they stay. normal, cross, direction: qw_vec3[vertex_count]. */
void qw_direct_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *cross,
                      qw_vec3 *direction);

/* Sets the directions of vertices of planes that lie between two curves, as those of washers and gears do: around,
   along lines of equal value of the harmonic function between them, so that no cone needs to lie between. The curves
   turn no further at their corners than rows can; they are closed or, in what was cut along planes of symmetry, run
   from cut to cut. cut: uint8_t[vertex_count], bit i: it lies in plane i of these; NULL: there is none. */
void qw_direct_rings(qw_env *env, const qw_trimesh *mesh, const uint8_t *cut, const qw_vec3 *normal,
                     qw_vec3 *direction);

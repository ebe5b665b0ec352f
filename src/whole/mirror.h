/* Symmetry: the core is the surface on one side of a plane, and the whole is its quads and their reflection.
 *
 * The clean surface is cut along the plane; the side of the larger area becomes the core, cleaned like an input of its
 * own, for which the cut is a boundary, so that quads are aligned to it. Components off the plane that have no twin on
 * its other side stay as they are and are not reflected. Where the surface has planes across the first one
 * (whole/across.h) the side is cut again by these, and the core is a quarter or an eighth. The connectivity of the
 * whole is that of the core twice, sewn along the cut: so it is a surface, and with its topology the whole has that of
 * the core and its reflection.
 */
#pragma once

#include "products/attributes/crosses.h"
#include "whole/state.h"

/* In CORE: takes the first plane, from run->plan.plane on, that may be used, and cuts. Leaves the core as it is, and
   says why, where no plane may be used. Sets what whole/state.h says. Needs the core to be the whole. */
void qw_take_one_side(qw_run_state *run);

/* Makes the other side of the plane, reflected, the core of a copy of the run, without the components that are not
   reflected. False where its topology is not that of the core. */
bool qw_take_other_side(qw_run_state *run);

/* Whether the quads of the other side lie on its own surface, which is not quite the reflection of the core's. */
bool qw_sides_differ(const qw_run_state *run);

/* In SIMPLIFY, so that their number is judged with the others, and in ASSEMBLE: the core's quads, those that would meet
   their own reflections split. Their kinds, marks and components are set. *sewn: uint8_t[4 faces of the
   result], p + 1: half-edges of its boundary that lie in plane p of the cut; else 0. In the current scope. */
qw_quadmesh qw_split_at_cut(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t **sewn);

/* The crosses at the vertices of the working mesh, in the frame of the whole, with their reflections. Needs what
   ORIENTATION leaves. In the current scope. */
qw_vertex_crosses qw_crosses_of_whole(const qw_run_state *run);

/* uint8_t[quads->vertex_count]: as of qw_mirror.about, of each vertex' component; NULL: all are reflected. quads: of
   the core. */
uint8_t *qw_planes_of_quads(const qw_run_state *run, const qw_quadmesh *quads);

/* The planes of vertices of the components of the whole that are given, uint32_t[count]. In the current scope. */
qw_mirror_planes qw_planes_of_whole(const qw_run_state *run, const uint32_t *component, uint32_t count);

/* How many images of the core the whole is made of: 1 without symmetry. */
uint32_t qw_image_count(const qw_run_state *run);

/* Whether image i has the component of the core's clean surface. */
bool qw_image_has(const qw_run_state *run, uint32_t i, uint32_t component);

/* The point of the core in image i of it, in the frame of the whole. Images of an odd number of bits are turned. */
qw_vec3 qw_image_of(const qw_run_state *run, uint32_t i, qw_vec3 point);

/* How many more quads the result would have, in quads of the core, than run->mirror.times as many as these: 0 unless
   some are not reflected. */
double qw_surplus_of_core(const qw_run_state *run, const qw_quadmesh *quads);

/* In ASSEMBLE. Sets run->finished, run->output, run->reflected and run->sides_meet from these quads of the core, where
   they are sewn (as of qw_split_at_cut), and their positions, double[quads->vertex_count][3] in the coordinates of the
   input. own: where the reflections of their vertices lie; NULL: where the plane puts them. */
void qw_reflect_core(qw_run_state *run, const qw_quadmesh *quads, const uint8_t *sewn, const double *position,
                     const double *own);

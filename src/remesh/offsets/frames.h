/* Frames of the triangles, and cones: which vertices take the turns of the field.
 *
 * Around a triangle in which the field is singular the crosses of its corners do not agree. Its frame is that of one
 * corner, and the whole turn is laid on another corner, the cone. The choice of that corner decides what feature
 * curves near by can be:
 * - a free vertex where there is one, as it may move to where it fits;
 * - but (at_corners) a corner of feature curves, where the sector that the triangle is in would otherwise turn by a
 * wrong number of quarters.
 *
 *         |         Three edges of a box meet at a corner, which lacks a quarter turn. If the turn is laid beside the
 *         o         corner, two of the edges lie on one lattice line, and if the wall between them is low, so does
 *        / \        everything up to its other rim: the wall vanishes.
 */
#pragma once

#include "remesh/offsets/offset_mesh.h"

/* Makes m->rot and m->index, in the current scope. turn: uint8_t[edge_count], quarter turns from the frame of the
   head of the edge's own half-edge to the frame of its tail. m's edges, constraints and real offsets must be set. */
void qw_set_frames(qw_env *env, qw_offset_mesh *m, const uint8_t *turn, bool at_corners);

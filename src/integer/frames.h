/* Frames of the triangles and cones: where the turns of the field are laid.
 *
 * Around a triangle in which the field is singular the crosses of its corners don't agree. Its frame is that of one
 * corner and all of the turn is laid on another, the cone. Which one is free to choose, and decides what the curves
 * nearby can be:
 *
 *     a free vertex, where there is one: it may come to lie where it fits
 *     but (at_corners) a corner of the curves, where the sector of the triangle would else turn by a wrong number of
 * quarters:
 *
 *            |    three edges of a box meet. Its corner lacks a quarter turn. Laid beside the corner, two of the three
 * edges / \   lie on one lattice line, and if the wall between them is low, so does everything up to its other rim: /
 * \  the wall is gone
 */
#ifndef QW_INTEGER_FRAMES_H
#define QW_INTEGER_FRAMES_H

#include "integer/offset_mesh.h"

/* Makes m->rot and m->index, of the current scope. turn: uint8_t[edge_count], quarter turns from the frame of the head
   of the edge's own half-edge to its tail's. Of m the edges, what is constrained and the real offsets must be known. */
void qw_set_frames(qw_env *env, qw_offset_mesh *m, const uint8_t *turn, bool at_corners);

#endif

/* Which feature curves the quads can follow, decided before there are fields. */
#pragma once

#include "remesh/features/verdict.h"
#include "geometry/trimesh.h"

/* The verdict of each edge: KEPT, MERGED along and across a band without room (bands.h), or LET_GO where what is then
   left is too short to be worth an edge of a quad. Between two curves on the same lattice line nothing has room: where
   they meet at a sharp angle (less than a quarter of a right one) the band between them would be drawn to a line over
   its whole length. The stronger is the boundary, then the longer times the sharper, each with what else lies close
   beside it. least: float[vertex_count], about half the wanted edge length of the quads, so that the band is at most
   one triangle wide. Returns uint8_t[3 face_count], qw_curve_verdict, the same on both sides, in the current scope. */
uint8_t *qw_decide_curves(qw_env *env, const qw_trimesh *mesh, const float *least);

/* Takes the marks off feature edges that are not kept. Returns the number of edges that lost theirs. */
int64_t qw_unmark_curves(qw_trimesh *mesh, const uint8_t *verdict);

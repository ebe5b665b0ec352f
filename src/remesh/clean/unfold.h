/* Folds in flat places are smoothed out: a vertex that lies beyond the ring of its neighbours, so that triangles at it
 * lie face down on the flat surface around, goes back to where it sees the whole ring. No point of the surface is lost
 * or won by that; left as it is such a fold has sharp edges that no one drew.
 *
 * Two-sided sheets and folds in curved places stay: they are shape. So do vertices on a boundary.
 */
#pragma once

#include "geometry/clean_input.h"
#include "geometry/trimesh.h"

/* Moves vertices, but none at which a mark of the input ends, as marks are known by their places; returns how many. */
uint32_t qw_unfold(qw_env *env, const qw_clean_input *input, const qw_frame *frame, qw_trimesh *mesh);

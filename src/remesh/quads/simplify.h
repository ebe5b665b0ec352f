/* Fewer irregular vertices by local moves (quad_moves.h): removes those that fields, contraction and pairing leave
 * behind without need.
 *
 * The measure is a cost of how many quads are too many or too few in the sectors into which boundary and marked edges
 * cut the quads around a vertex: there should be four around a free vertex, two on either side of a curve, and as
 * many as its angle holds at a corner. A move is kept if the cost falls, the surface stays simple, no quad flips, and
 * shapes are good or get no worse.
 */
#pragma once

#include "remesh/quads/wanted.h"

typedef struct qw_simplify_counts {
    int64_t collapses, rotations; /* kept */
} qw_simplify_counts;

/* A new mesh in the current scope, of at least `least` quads if it has as many now; its free vertices near a move are
   moved as well. Where there are more than `most` left, quads are collapsed though the cost rises, the smallest first
   (over the area wanted there; NULL: the same everywhere), and, unless `gently`, though shapes or sharp edges suffer;
   there may still be more where no collapse is legal. */
qw_quadmesh qw_simplify_quads(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least,
                              int64_t most, bool gently, qw_simplify_counts *counts);

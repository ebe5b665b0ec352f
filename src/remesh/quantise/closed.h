/* The closest closed real offsets: what the integers would be if they did not have to be integers.
 *
 * x[e], the edge itself in its frame and in wanted lengths (m->real), is not closed: its sum around a triangle is the
 * curl of the frame field there. The offsets c that obey Eq. (3) exactly and minimise sum w |c - x|^2, w = 1 / |x|^2,
 * are found by one linear solve: with A the rows of Eq. (3) and multipliers l, two a triangle,
 *
 *     A W^-1 A^T l = A x,     c = x - W^-1 A^T l.
 *
 * The map from x to c stretches a triangle along its axes and turns its lines. With `give` above 0 sizes give way to
 * directions: x is stretched as c was, by the square root of the change of area, and the system is solved again. So
 * lines keep the directions of the field where quads of other proportions let them.
 *
 * Components that are constrained to 0 are no variables. The matrix is the signed Laplacian of the network of Section
 * 3.3: a row has at most three entries beside its diagonal (remesh/quantise/network.h), and multigrid solves it
 * (solve/multigrid.h).
 */
#pragma once

#include "remesh/offsets/offsets.h"

typedef struct qw_closed_counts {
    /* squeezed: triangles that lost most of their area, after the first solve */
    uint32_t iterations, squeezed;
    double residual; /* relative, of the linear system */
} qw_closed_counts;

/* qw_real2[m->edge_count], each in its edge's frame. stiffness: float[m->edge_count], written: what w was multiplied
   by, in a second solve, where many triangles were inverted or squeezed. give: 0 to 1, what share of the
   stretch m->real takes over; 0 leaves it as it is. */
qw_real2 *qw_closed_offsets(qw_env *env, qw_offset_mesh *m, float give, float *stiffness, qw_closed_counts *counts);

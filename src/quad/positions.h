/* Positions again, Eq. (9) of the paper: with the offsets now fixed, where the vertices of the quads lie is a linear least-squares problem.
 *
 * One unknown point a contraction class of the offset mesh (a vertex of the quad mesh), held in the class's tangent plane; on curves held on the
 * curve's line (the sharp-edge constraint of Section 3.5); corners fixed.
 */
#ifndef QW_QUAD_POSITIONS_H
#define QW_QUAD_POSITIONS_H

#include "quad/extract.h"

typedef struct qw_positions_counts {
    uint32_t iterations;
    double residual; /* of the normal equations, relative */
    double energy_before, energy_after; /* Eq. (9), in units of the squared wanted length, a mean over edges */
} qw_positions_counts;

/* Returns qw_vec3[x->quads.vertex_count]. */
qw_vec3 *qw_solve_positions(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x, qw_positions_counts *counts);

#endif

/* Least squares by multigrid: solves A x = b for large symmetric positive (semi)definite A that are signed graph
 * Laplacians, that is entries of either sign and a diagonal of no less than the sum of their sizes, in a time that
 * grows as the number of entries. It also serves other diagonally dominant matrices. Where A has a null space, b must
 * have no part in it.
 *
 * Vectors are float, sums double over fixed blocks in order, so the number of threads changes no bit of x. Within, the
 * sum of the steps is double, and the result's residual is of that, before it is rounded to float. Rounding adds to the
 * residual up to 1e-7 |A||x| / |b|, much where b is smooth over many unknowns (as much as 0.1); the energy of the
 * error, which differences of neighbours show, stays small.
 */
#pragma once

#include "solve/cg.h"
#include "solve/csr.h"

/* The coarser systems of a matrix. Belongs to the scope that it was built in, and borrows the matrix. */
typedef struct qw_multigrid qw_multigrid;

/* Fewer than 2^31 rows. */
qw_multigrid *qw_multigrid_build(qw_env *env, const qw_csr *matrix);

/* To be called in the scope of the grids when the values of the matrix have changed (not the pattern). What goes
   together in the coarser systems stays as it was, which serves as long as few couplings changed by much. */
void qw_multigrid_refresh(qw_env *env, qw_multigrid *grids);

/* Iterations after which a system that does not converge is left as it is. */
enum { QW_MULTIGRID_MOST = 60 };

/* b, x: float[row_count]. x holds the first guess on entry (and becomes 0 when b is 0). Where the diagonal is 0, the
   unknown is left alone. An iteration takes as long as ten of conjugate gradients. Ends at the tolerance, at
   max_iterations, or where rounding lets the residual fall no further. */
qw_cg_result qw_multigrid_solve_with(qw_env *env, qw_multigrid *grids, const float *b, float *x, double tolerance,
                                     uint32_t max_iterations);

/* Least squares by conjugate gradients: solves A x = b for a symmetric positive definite A, or a semidefinite one when
 * b has no part in its null space (a Laplacian and a right-hand side of zero mean; the part of x in the null space then
 * stays as it was on entry).
 *
 * Vectors and sums are double; sums run over fixed blocks in order, so the number of threads changes no bit of x.
 */
#pragma once

#include "base/env.h"

typedef struct qw_cg_result {
    uint32_t iterations;
    double residual; /* |b - A x| / |b|, computed anew from x where the tolerance is small; 0 when b is 0 */
    bool converged;  /* residual <= tolerance */
    double fall;     /* of multigrid: what the last iteration took off x . A x - 2 b . x */
} qw_cg_result;

/* Iterations where nothing else is known: many more than a solve takes that ends well. */
enum { QW_CG_MOST = 200 };

/* y = A x, over n rows; may use qw_parallel. */
typedef void (*qw_apply)(void *user, qw_env *env, const double *x, double *y);

/* x holds the first guess on entry (and becomes 0 when b is 0). The preconditioner is the diagonal (Jacobi); where that
   is 0, the unknown is left alone. diagonal, b, x: double[n]. Ends at the tolerance, at max_iterations, or where
   rounding lets the residual fall no further. */
qw_cg_result qw_cg_solve(qw_env *env, uint32_t n, qw_apply apply, void *user, const double *diagonal, const double *b,
                         double *x, double tolerance, uint32_t max_iterations);

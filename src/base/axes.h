/* Principal axes of a symmetric matrix of three rows. */
#pragma once

/* Eigenvectors of m as the rows of axis, orthonormal, by Jacobi's rotations. The eigenvalues are left on m's diagonal,
   in the same order; no order of theirs is promised. */
void qw_principal_axes(double m[3][3], double axis[3][3]);

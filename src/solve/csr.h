#pragma once

#include "base/env.h"

/* A symmetric matrix in compressed rows. The diagonal is apart and double: where it is minus the sum of the entries as
   stored, the rows of a Laplacian sum to zero as well as doubles can, although the entries are float. */
typedef struct qw_csr {
    uint32_t row_count;
    const uint32_t *first;  /* uint32_t[row_count + 1] */
    const uint32_t *column; /* uint32_t[first[row_count]], none on the diagonal but such of value 0 */
    const float *value;     /* float[first[row_count]] */
    const double *diagonal; /* double[row_count], >= 0 */
} qw_csr;

/* Symmetric positive definite systems that are solved many times: Cholesky factors within the envelope, the entries
 * between the first of each row and the diagonal, with the unknowns ordered so that these are few (Cuthill and McKee
 * 1969, reversed). For meshes of n vertices a row has about sqrt(n) entries, so it suits up to some ten thousand
 * unknowns. All numbers are double and all sums in one order.
 */
#pragma once

#include "base/env.h"

typedef struct qw_envelope {
    uint32_t count;
    uint32_t *place; /* uint32_t[count]: row of each unknown */
    uint32_t *low;   /* uint32_t[count]: first column of each row */
    size_t *begin;   /* size_t[count + 1]: entries of row i, columns low[i] .. i, are value[begin[i]] .. */
    double *value;   /* double[begin[count]]: the matrix, then its factor */
    double *scratch; /* double[count] */
} qw_envelope;

/* The pattern: first, column: rows of the neighbours of each unknown, itself left out, both directions. All entries are
   0. In the caller's scope. */
qw_envelope qw_envelope_of(qw_env *env, uint32_t count, const uint32_t *first, const uint32_t *column);

/* Adds to the entry (i, j), and so to (j, i): once for both. */
static inline void qw_envelope_add(qw_envelope *e, uint32_t i, uint32_t j, double value)
{
    uint32_t r = e->place[i], c = e->place[j];
    if (c > r) {
        uint32_t swap = r;
        r = c, c = swap;
    }
    e->value[e->begin[r] + (c - e->low[r])] += value;
}
/* False where the matrix is not positive definite; the factor is of no use then. */
bool qw_envelope_factor(qw_envelope *e);
/* x: double[count], the right-hand side, then the solution. */
void qw_envelope_solve(const qw_envelope *e, double *x);

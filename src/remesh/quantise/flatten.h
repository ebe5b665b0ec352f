/* From closed integers to closed integers near the surface's own lengths: vertices are laid out in the plane and
 * rounded.
 *
 * d obeys Eq. (3) but may be far from x (all length may sit on a few edges). Moving vertex v by u[v] changes
 *
 *     d'[e] = d[e] + R2(a) u[head] - R2(b) u[tail]
 *
 * and keeps Eq. (3), whatever u. The real u that minimises sum w |d' - x|^2, w = 1 / |x|^2, is found by one linear
 * solve over the vertices; cones and corners stay, vertices on curves move along them. Rounding each u to the nearest
 * lattice point then gives integers d' that are still closed.
 */
#pragma once

#include "remesh/offsets/offsets.h"

typedef struct qw_flatten_counts {
    uint32_t iterations;
    double residual;
    double energy; /* mean over the edges of |d' - x|^2 / |x|^2 before rounding */
} qw_flatten_counts;

/* Changes m->d. stiffness: float[m->edge_count], as qw_closed_offsets left it. */
void qw_flatten(qw_env *env, qw_offset_mesh *m, const float *stiffness, qw_flatten_counts *counts);

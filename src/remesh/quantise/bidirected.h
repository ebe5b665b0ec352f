/* Regular offsets without freezing: the unbalanced variables of Section 3.3 solved rather than constrained.
 *
 * A variable that appears with equal signs in two rows is an arc with two heads or two tails: the network is
 * bidirected. Its double cover has two copies of every node, one for the row and one for its negative, and in it every
 * variable is a pair of ordinary arcs; half the sum of the pair's flows solves the original with the variables whole or
 * half. The half ones form cycles (and paths between boundaries) that are rounded alternately up and down; where that
 * cannot close, one row is left off by one, for the frozen network to repair.
 */
#pragma once

#include "remesh/quantise/network.h"

typedef struct qw_bidirected_counts {
    int64_t half_variables; /* before rounding */
    int64_t odd_cycles;     /* left rows off by one */
} qw_bidirected_counts;

/* step_cost(user, variable, step): cost of changing the variable (2 e + component) by step, +1 or -1; at least 1. Every
   variable changes by at most one, so that the network stays small. Changes c->d. potential:
   int64_t[QW_POTENTIALS(c->face_count)] of the flow; on entry 0, or what was left for a complex of the same triangles
   and constrained edges but somewhat other lengths, which takes a fraction of the time; or NULL. */
#define QW_POTENTIALS(faces) (4 * (size_t)(faces) + 1)
typedef int32_t (*qw_step_cost)(const void *user, uint32_t variable, int32_t step);
qw_bidirected_counts qw_solve_bidirected(qw_env *env, const qw_network *network, qw_complex *c, qw_step_cost step_cost,
                                         const void *user, int64_t *potential);

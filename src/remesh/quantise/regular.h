/* Regular offsets of a complex: changes d as little as possible so that Eq. (3) holds on every triangle (paper, Section
 * 3.3). */
#pragma once

#include "quadwright/quadwright.h"
#include "remesh/quantise/network.h"

/* Cost of changing a component: 1 a step, Eq. (7); more, the further beyond half a step from the edge itself; or the
   growth of the squared distance from the edge. The first two are the option `cost`. Maximum flow ignores costs. */
enum { QW_COST_SQUARE = QW_COST_GEOMETRIC + 1 };
typedef uint32_t qw_cost_kind;

typedef struct qw_regular_counts {
    int64_t nodes, arcs, network_components; /* of the finest network that was solved */
    int64_t free_variables, fixed_variables; /* balanced / frozen because unbalanced */
    int64_t half_variables, odd_cycles;      /* of the bidirected network, before rounding */
    int64_t levels, capacity_rounds;         /* rounds: 0 where the bidirected network left nothing to do */
    int64_t cost;                            /* sum of |change| over all components of all edges: Eq. (7) */
    int64_t irregular_before, irregular_after;
} qw_regular_counts;

/* Changes c->d; returns whether Eq. (3) then holds everywhere. network: the complex's (qw_network_build), or NULL.
   final: capacities open until it does. potential: as of qw_solve_bidirected. */
bool qw_solve_complex(qw_env *env, qw_complex *c, const qw_network *network, qw_flow_choice kind, qw_cost_kind cost,
                      bool final, int64_t *potential, qw_regular_counts *counts);

/* Triangles on which Eq. (3) does not hold. */
int64_t qw_count_irregular(const qw_complex *c);

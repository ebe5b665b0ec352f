/* Integer flows on directed networks (paper, Section 3.3). Knows nothing of meshes.
 *
 * A problem: nodes with supplies (positive: the node sends that much, negative: it takes that much; the sum is zero)
 * and arcs with capacities and costs. A flow meets the supplies when at every node  out - in = supply. Source s and
 * sink t of the paper are not in the node list: solvers that want them add them.
 */
#pragma once

#include "solve/flow_problem.h"

/* All solvers write flow (int32_t[arc_count], within 0 .. capacity) and keep conservation at every node up to the
   supplies not met. `flow` on entry is a feasible start (0 everywhere, or what an earlier call with smaller capacities
   left). The supplies need not balance, nor be reachable: as much as can be met is met, and met < wanted tells. met
   counts the units of the start, too. */

/* Maximum flow by two search trees that are kept and repaired (Boykov and Kolmogorov 2004). Costs are not looked at. */
qw_flow_result qw_flow_boykov_kolmogorov(qw_env *env, const qw_flow_problem *problem, int32_t *flow);
/* Maximum flow by shortest augmenting paths (Edmonds and Karp 1972): for the last few units. */
qw_flow_result qw_flow_edmonds_karp(qw_env *env, const qw_flow_problem *problem, int32_t *flow);
/* Exact minimum-cost flow among those of maximum value. What flow holds on entry does not matter. potential:
   int64_t[node_count], on entry 0 everywhere, or, which takes a fraction of the time, what a problem left that differs
   from this one in a few costs and supplies; then the certificate: qw_flow_is_optimal holds for it; from potentials of
   0 every potential lies in least .. 0; a node with supply left over has the least, a node that still lacks some has
   0. With these the potentials prove optimality also for the network with the paper's s and t added, that is, no other
   choice of which supplies to leave out is cheaper.
   Gives up on supplies whose cheapest way costs more than `farthest` beyond what the potentials say (INT64_MAX: on
   none): the flow is then optimal for what it sends, and from potentials of 0 the exact minimum-cost flow of its value.
   From others met and wanted only say whether all was sent. */
qw_flow_result qw_flow_min_cost(qw_env *env, const qw_flow_problem *problem, int64_t farthest, int32_t *flow,
                                int64_t *potential);
/* The same by GLPK's integer program solver, without potentials and with another flow of the same cost where there are
   several. False when this build has no GLPK (nothing is written then). Not to be called while the host itself is
   inside GLPK on this thread. */
bool qw_flow_integer_program(qw_env *env, const qw_flow_problem *problem, int32_t *flow, qw_flow_result *result);
bool qw_flow_has_integer_program(void);

/* Certificates. */

/* Bounds and conservation: 0 <= flow <= capacity, no node sends or takes more than its supply or the other way about,
   and what is sent is met. */
bool qw_flow_is_feasible(qw_env *env, const qw_flow_problem *problem, const int32_t *flow, int64_t met);
/* No augmenting path is left from any node that has supply to any that lacks it (a minimum cut exists). */
bool qw_flow_is_maximum(qw_env *env, const qw_flow_problem *problem, const int32_t *flow);
/* Complementary slackness: every residual arc has reduced cost cost + potential[tail] - potential[head] >= 0. */
bool qw_flow_is_optimal(const qw_flow_problem *problem, const int32_t *flow, const int64_t *potential);

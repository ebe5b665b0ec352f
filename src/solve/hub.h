/* Minimum-cost flow through a node of very many arcs (the ground of a network with a long boundary). */
#pragma once

#include "solve/flow.h"

/* As qw_flow_min_cost, but the arcs at `hub` hang on a tree of small nodes joined by free arcs, so that no search
   has to look through all of them at each visit. The free arcs have room for everything, which makes the tree's
   potentials equal: those returned certify the problem as given. */
qw_flow_result qw_flow_min_cost_hub(qw_env *env, const qw_flow_problem *problem, uint32_t hub, int64_t farthest,
                                    int32_t *flow, int64_t *potential);

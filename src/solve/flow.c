/* Certificates of flows. */
#include "solve/flow.h"

#include <assert.h>

bool qw_flow_is_feasible(qw_env *env, const qw_flow_problem *problem, const int32_t *flow, int64_t met)
{
    assert(problem->supply && flow);
    qw_scope_begin(env);
    int64_t *sent = QW_NEW_ZERO(env, int64_t, problem->node_count), total = 0;
    bool fine = true;
    for (uint32_t a = 0; a < problem->arc_count; a++) {
        if (flow[a] < 0 || flow[a] > problem->capacity[a]) fine = false;
        sent[problem->tail[a]] += flow[a];
        sent[problem->head[a]] -= flow[a];
    }
    for (uint32_t v = 0; v < problem->node_count; v++) {
        int64_t supply = problem->supply[v];
        if (supply >= 0 ? sent[v] < 0 || sent[v] > supply : sent[v] > 0 || sent[v] < supply) fine = false;
        if (sent[v] > 0) total += sent[v];
    }
    qw_scope_end(env);
    return fine && total == met;
}

bool qw_flow_is_optimal(const qw_flow_problem *problem, const int32_t *flow, const int64_t *potential)
{
    assert(problem->cost && potential);
    for (uint32_t a = 0; a < problem->arc_count; a++) {
        int64_t reduced = problem->cost[a] + potential[problem->tail[a]] - potential[problem->head[a]];
        if (flow[a] < problem->capacity[a] && reduced < 0) return false;
        if (flow[a] > 0 && reduced > 0) return false;
    }
    return true;
}

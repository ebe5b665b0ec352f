/* Certificates of flows, and the maximum flow by shortest augmenting paths. */
#include "solve/flow.h"
#include "solve/residual.h"

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

/* Breadth first from all nodes with supply left at once. */
typedef struct flow_search {
    qw_residual g;
    uint32_t *queue;   /* uint32_t[node_count] */
    uint32_t *sources; /* uint32_t[source_count], the nodes that may have supply left */
    uint32_t source_count;
    uint32_t now; /* a node was reached in this flow_search when its stamp is this */
} flow_search;

static flow_search search_create(qw_env *env, const qw_flow_problem *problem, const int32_t *flow)
{
    flow_search s = {.g = qw_residual_create(env, problem, flow)};
    s.queue = QW_NEW(env, uint32_t, s.g.node_count);
    s.sources = QW_NEW(env, uint32_t, s.g.node_count);
    for (uint32_t v = 0; v < s.g.node_count; v++)
        if (s.g.node[v].excess > 0) s.sources[s.source_count++] = v;
    return s;
}

/* Drops the sources that are used up and queues the others. */
static uint32_t queue_sources(flow_search *s)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < s->source_count; i++) {
        uint32_t v = s->sources[i];
        if (s->g.node[v].excess <= 0) continue;
        s->g.node[v].parent = QW_ROOT;
        s->g.node[v].stamp = s->now;
        s->queue[kept] = s->sources[kept] = v;
        kept++;
    }
    return s->source_count = kept;
}

/* The first lacking node that is found, with its way back in the parents; QW_NONE when there is none to be reached. */
static uint32_t find_lacking(flow_search *s)
{
    qw_residual *g = &s->g;
    s->now++;
    uint32_t end = queue_sources(s);
    for (uint32_t begin = 0; begin < end; begin++) {
        uint32_t v = s->queue[begin];
        for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
            uint32_t w = g->half[h].head;
            if (g->half[h].room == 0 || g->node[w].stamp == s->now) continue;
            g->node[w].stamp = s->now;
            g->node[w].parent = g->half[h].mate;
            if (g->node[w].excess < 0) return w;
            s->queue[end++] = w;
        }
    }
    return QW_NONE;
}

static void augment(qw_residual *g, uint32_t sink)
{
    int32_t amount = qw_residual_amount(g, sink);
    uint32_t v = sink;
    g->node[sink].excess += amount;
    for (; g->node[v].parent != QW_ROOT; v = qw_residual_parent_node(g, v))
        qw_residual_push(g, g->half[g->node[v].parent].mate, amount);
    g->node[v].excess -= amount;
}

qw_flow_result qw_flow_edmonds_karp(qw_env *env, const qw_flow_problem *problem, int32_t *flow)
{
    assert(problem->supply && flow);
    qw_scope_begin(env);
    flow_search s = search_create(env, problem, flow);
    int64_t augmentations = 0;
    for (uint32_t sink; (sink = find_lacking(&s)) != QW_NONE; augmentations++) augment(&s.g, sink);
    qw_flow_result result = qw_residual_finish(&s.g, problem, flow, augmentations);
    qw_scope_end(env);
    return result;
}

bool qw_flow_is_maximum(qw_env *env, const qw_flow_problem *problem, const int32_t *flow)
{
    qw_scope_begin(env);
    flow_search s = search_create(env, problem, flow);
    bool maximum = find_lacking(&s) == QW_NONE;
    qw_scope_end(env);
    return maximum;
}

#include "solve/residual.h"

#include <assert.h>

static bool is_used(const qw_flow_problem *problem, uint32_t arc)
{
    return problem->capacity[arc] > 0 && problem->tail[arc] != problem->head[arc];
}

/* What each node has too much of, with this flow, or lacks. */
static void set_excess(qw_residual *g, const qw_flow_problem *problem, const int32_t *flow)
{
    for (uint32_t v = 0; v < g->node_count; v++)
        g->node[v] = (qw_tree_node){.parent = QW_NONE, .excess = problem->supply[v]};
    for (uint32_t a = 0; a < problem->arc_count; a++) {
        /* Sums may pass the bounds of int32_t on the way, but a feasible start ends within them, and so does one with
         * full arcs. */
        int32_t *tail = &g->node[problem->tail[a]].excess, *head = &g->node[problem->head[a]].excess;
        *tail = (int32_t)((uint32_t)*tail - (uint32_t)flow[a]);
        *head = (int32_t)((uint32_t)*head + (uint32_t)flow[a]);
    }
}

qw_residual qw_residual_create(qw_env *env, const qw_flow_problem *problem, const int32_t *flow)
{
    uint32_t n = problem->node_count, m = problem->arc_count;
    if (m > (QW_ORPHAN - 1) / 2) qw_fail(env, QW_TOO_LARGE, -1, "a flow network of %u arcs is too large", m);
    qw_residual g = {.node_count = n};
    g.first = QW_NEW_ZERO(env, uint32_t, (size_t)n + 1);
    for (uint32_t a = 0; a < m; a++) {
        assert(problem->tail[a] < n && problem->head[a] < n && problem->cost[a] >= 0);
        assert(flow[a] >= 0 && flow[a] <= problem->capacity[a]);
        if (!is_used(problem, a)) continue;
        g.first[problem->tail[a]]++;
        g.first[problem->head[a]]++;
        g.half_count += 2;
    }
    /* first[v] becomes the end of v's range, and sinks to its begin while the halves are placed. */
    for (uint32_t v = 0; v < n; v++) g.first[v + 1] += g.first[v];
    g.half = QW_NEW(env, qw_half_arc, g.half_count);
    g.place = QW_NEW(env, uint32_t, m);
    for (uint32_t a = m; a-- > 0;) {
        g.place[a] = QW_NONE;
        if (!is_used(problem, a)) continue;
        uint32_t tail = problem->tail[a], head = problem->head[a], there = --g.first[tail], back = --g.first[head];
        g.half[there] =
            (qw_half_arc){.head = head, .mate = back, .room = problem->capacity[a] - flow[a], .cost = problem->cost[a]};
        g.half[back] = (qw_half_arc){.head = tail, .mate = there, .room = flow[a], .cost = -problem->cost[a]};
        g.place[a] = there;
    }
    g.node = QW_NEW(env, qw_tree_node, n);
    set_excess(&g, problem, flow);
    return g;
}

qw_flow_result qw_residual_finish(const qw_residual *g, const qw_flow_problem *problem, int32_t *flow,
                                  int64_t augmentations)
{
    assert(flow);
    qw_flow_result result = {.augmentations = augmentations};
    for (uint32_t a = 0; a < problem->arc_count; a++) {
        if (g->place[a] != QW_NONE) flow[a] = problem->capacity[a] - g->half[g->place[a]].room;
        result.cost += (int64_t)flow[a] * problem->cost[a];
    }
    for (uint32_t v = 0; v < g->node_count; v++) {
        if (problem->supply[v] <= 0) continue;
        result.wanted += problem->supply[v];
        result.met += problem->supply[v] - g->node[v].excess;
    }
    return result;
}

uint32_t qw_residual_depth(qw_residual *g, uint32_t node, uint32_t now)
{
    uint32_t depth = 0, v = node;
    while (g->node[v].stamp != now) {
        uint32_t parent = g->node[v].parent;
        if (parent == QW_ORPHAN) return 0;
        depth++;
        if (parent == QW_ROOT) break;
        v = g->half[parent].head;
    }
    if (g->node[v].stamp == now) depth += g->node[v].depth;
    uint32_t found = depth;
    for (v = node; g->node[v].stamp != now; v = g->half[g->node[v].parent].head) {
        g->node[v].stamp = now;
        g->node[v].depth = depth--;
        if (g->node[v].parent == QW_ROOT) break;
    }
    return found;
}

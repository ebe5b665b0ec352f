#include "solve/hub.h"

#include <assert.h>
#include <string.h>

enum { ARCS_A_LEAF = 16, CHILDREN = 4, ROOM = INT32_MAX / 8 };

static uint32_t degree_of(const qw_flow_problem *p, uint32_t node)
{
    uint32_t degree = 0;
    for (uint32_t a = 0; a < p->arc_count; a++) degree += (p->tail[a] == node) + (p->head[a] == node);
    return degree;
}

qw_flow_result qw_flow_min_cost_hub(qw_env *env, const qw_flow_problem *p, uint32_t hub, int64_t farthest,
                                    int32_t *flow, int64_t *potential)
{
    assert(hub < p->node_count && p->cost && flow && potential);
    uint32_t degree = degree_of(p, hub);
    if (degree <= 2 * ARCS_A_LEAF) return qw_flow_min_cost(env, p, farthest, flow, potential);
    qw_scope_begin(env);
    uint32_t leaves = degree / ARCS_A_LEAF + 1, nodes = p->node_count + leaves, arcs = p->arc_count + 2 * leaves,
             at = 0;
    uint32_t *tail = QW_NEW(env, uint32_t, arcs), *head = QW_NEW(env, uint32_t, arcs);
    int32_t *capacity = QW_NEW(env, int32_t, arcs), *cost = QW_NEW_ZERO(env, int32_t, arcs),
            *wide = QW_NEW_ZERO(env, int32_t, arcs);
    int32_t *supply = QW_NEW_ZERO(env, int32_t, nodes);
    int64_t *height = QW_NEW(env, int64_t, nodes);
    memcpy(capacity, p->capacity, p->arc_count * sizeof *capacity);
    memcpy(cost, p->cost, p->arc_count * sizeof *cost);
    memcpy(supply, p->supply, p->node_count * sizeof *supply);
    for (uint32_t a = 0; a < p->arc_count; a++) {
        tail[a] = p->tail[a] == hub ? p->node_count + at++ / ARCS_A_LEAF : p->tail[a];
        head[a] = p->head[a] == hub ? p->node_count + at++ / ARCS_A_LEAF : p->head[a];
    }
    memcpy(height, potential, p->node_count * sizeof *height);
    for (uint32_t i = 0; i < leaves; i++) {
        uint32_t leaf = p->node_count + i, parent = i < CHILDREN ? hub : p->node_count + i / CHILDREN - 1,
                 a = p->arc_count + 2 * i;
        tail[a] = head[a + 1] = leaf;
        head[a] = tail[a + 1] = parent;
        capacity[a] = capacity[a + 1] = ROOM;
        height[leaf] = potential[hub];
    }
    qw_flow_problem spread = {nodes, arcs, tail, head, capacity, cost, supply};
    qw_flow_result result = qw_flow_min_cost(env, &spread, farthest, wide, height);
    memcpy(flow, wide, p->arc_count * sizeof *flow);
    memcpy(potential, height, p->node_count * sizeof *potential);
    qw_scope_end(env);
    return result;
}

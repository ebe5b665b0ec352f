/* The residual network that the flow solvers share, and the search trees they grow in it.
 *
 * Arc a becomes two halves: one leaves its tail with room capacity - flow, its mate leaves its head with room flow and
 * the negated cost. Pushing moves room from a half to its mate. Halves lie sorted by the node they leave:
 *
 *     half[first[v]] .. half[first[v + 1] - 1]   leave node v
 *
 * A tree node's parent is the half that leaves it towards its parent node; flow that comes down a tree runs along the
 * mates.
 */
#pragma once

#include "solve/flow_problem.h"

#define QW_ROOT   (QW_NONE - 1) /* parent of a tree's root */
#define QW_ORPHAN (QW_NONE - 2) /* parent of a node whose way to its parent was used up */

typedef struct qw_half_arc {
    uint32_t head, mate; /* node it leads to; its other half */
    int32_t room;        /* units that can still be pushed along */
    int32_t cost;        /* of one unit */
} qw_half_arc;

typedef struct qw_tree_node {
    uint32_t parent; /* half, QW_ROOT or QW_ORPHAN; without meaning in a node that is in no tree */
    uint32_t stamp;  /* when depth was last known to be right; never older than in a child */
    uint32_t depth;  /* 1 in a root; 0 for a node that is in no tree */
    int32_t excess;  /* supply not sent yet; negative: lacking */
    int64_t label;   /* the minimum-cost solver's; 0 at first */
} qw_tree_node;

typedef struct qw_residual {
    uint32_t node_count, half_count;
    uint32_t *first;    /* uint32_t[node_count + 1] */
    qw_half_arc *half;  /* qw_half_arc[half_count] */
    uint32_t *place;    /* uint32_t[arc_count], first half of an arc; QW_NONE for loops and arcs without capacity */
    qw_tree_node *node; /* qw_tree_node[node_count], in no tree at first */
} qw_residual;

/* All arrays belong to the current scope. */
qw_residual qw_residual_create(qw_env *env, const qw_flow_problem *problem, const int32_t *flow);
/* Writes the flow back and sums up what it does. */
qw_flow_result qw_residual_finish(const qw_residual *residual, const qw_flow_problem *problem, int32_t *flow,
                                  int64_t augmentations);

static inline void qw_residual_push(qw_residual *residual, uint32_t half, int32_t amount)
{
    residual->half[half].room -= amount;
    residual->half[residual->half[half].mate].room += amount;
}

static inline uint32_t qw_residual_parent_node(const qw_residual *residual, uint32_t node)
{
    return residual->half[residual->node[node].parent].head;
}

/* What can be sent down the tree to the node `sink`: the least of what it lacks, of the room of the arcs on its way to
   the root, and of the root's excess. */
static inline int32_t qw_residual_amount(const qw_residual *residual, uint32_t sink)
{
    int32_t amount = -residual->node[sink].excess;
    uint32_t v = sink;
    for (; residual->node[v].parent != QW_ROOT; v = qw_residual_parent_node(residual, v)) {
        int32_t room = residual->half[residual->half[residual->node[v].parent].mate].room;
        if (room < amount) amount = room;
    }
    return residual->node[v].excess < amount ? residual->node[v].excess : amount;
}

/* Nodes on the way from a tree node to its root; 0 when the way is broken by an orphan. Depths found are kept and
   stamped `now`, so that ways which join one already walked end there (the marking heuristic of Boykov and Kolmogorov,
   Section 3.2.3). */
uint32_t qw_residual_depth(qw_residual *residual, uint32_t node, uint32_t now);

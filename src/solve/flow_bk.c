/* Maximum flow by two search trees (Boykov and Kolmogorov, An Experimental Comparison of Min-Cut/Max-Flow Algorithms,
 * 2004).
 *
 * Every node with supply left roots a tree of the source side, every lacking one a tree of the sink side. Three steps
 * in turn: grow the trees from their active nodes until they touch; augment along the path through the touching half;
 * adopt the nodes that the augmentation cut from their parents, or set them free. The trees are kept from one
 * augmentation to the next.
 */
#include "solve/flow.h"
#include "solve/residual.h"

#include <assert.h>

enum side { SOURCE, SINK };

typedef struct trees {
    qw_residual g;
    uint8_t *side;   /* enum side[node_count], of a node that is in a tree */
    uint32_t *queue; /* uint32_t[node_count], ring of the active nodes, each at most once */
    uint8_t *active; /* bool[node_count], in the ring */
    uint32_t begin, length;
    uint32_t *orphans; /* uint32_t[node_count]; a node is orphaned at most once an augmentation */
    uint32_t orphan_count;
    uint32_t now; /* augmentations begun; stamps of the depths */
} trees;

static void activate(trees *t, uint32_t v)
{
    if (t->active[v]) return;
    t->active[v] = 1;
    uint32_t at = t->begin + t->length++;
    t->queue[at < t->g.node_count ? at : at - t->g.node_count] = v;
}

static void deactivate_first(trees *t)
{
    t->active[t->queue[t->begin]] = 0;
    t->length--;
    if (++t->begin == t->g.node_count) t->begin = 0;
}

/* The trees of a flow: each node with an excess or a lack is the root of one. */
static void trees_begin(trees *t, qw_env *env, const qw_flow_problem *problem, const int32_t *flow)
{
    *t = (trees){.g = qw_residual_create(env, problem, flow)};
    uint32_t n = t->g.node_count;
    t->side = QW_NEW(env, uint8_t, n);
    t->queue = QW_NEW(env, uint32_t, n);
    t->active = QW_NEW_ZERO(env, uint8_t, n);
    t->orphans = QW_NEW(env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) {
        qw_tree_node *node = &t->g.node[v];
        if (node->excess == 0) continue;
        node->parent = QW_ROOT;
        node->depth = 1;
        t->side[v] = node->excess > 0 ? SOURCE : SINK;
        activate(t, v);
    }
}

/* Room for flow along half h of a node of this side, from root to leaf in a source tree and from leaf to root in a sink
 * tree. */
static int32_t room_down(const trees *t, enum side side, uint32_t h)
{
    return side == SOURCE ? t->g.half[h].room : t->g.half[t->g.half[h].mate].room;
}

static int32_t room_up(const trees *t, enum side side, uint32_t h)
{
    return side == SINK ? t->g.half[h].room : t->g.half[t->g.half[h].mate].room;
}

/* Takes the neighbours of v into its tree. Returns the half from a source tree to a sink tree where the two touch, or
 * QW_NONE. */
static uint32_t grow(trees *t, uint32_t v)
{
    qw_residual *g = &t->g;
    enum side side = t->side[v];
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        uint32_t w = g->half[h].head;
        qw_tree_node *node = &g->node[w];
        if (node->depth > 0 && t->side[w] == side) {
            /* Bring w nearer to a root where that is known to be so: shorter paths, and fewer nodes below to lose. */
            if (node->stamp > g->node[v].stamp || node->depth <= g->node[v].depth + 1 || room_down(t, side, h) == 0)
                continue;
        } else {
            if (room_down(t, side, h) == 0) continue;
            if (node->depth > 0) return side == SOURCE ? h : g->half[h].mate;
            t->side[w] = (uint8_t)side;
            activate(t, w);
        }
        node->parent = g->half[h].mate;
        node->stamp = g->node[v].stamp;
        node->depth = g->node[v].depth + 1;
    }
    return QW_NONE;
}

static void make_orphan(trees *t, uint32_t v)
{
    t->g.node[v].parent = QW_ORPHAN;
    t->orphans[t->orphan_count++] = v;
}

/* The half that carries flow between v and its parent. */
static uint32_t carrier(const trees *t, enum side side, uint32_t v)
{
    uint32_t parent = t->g.node[v].parent;
    return side == SOURCE ? t->g.half[parent].mate : parent;
}

/* The least room between v and its root, the root's excess included. */
static int32_t bottleneck(const trees *t, enum side side, uint32_t v, int32_t amount)
{
    for (; t->g.node[v].parent != QW_ROOT; v = qw_residual_parent_node(&t->g, v)) {
        int32_t room = t->g.half[carrier(t, side, v)].room;
        if (room < amount) amount = room;
    }
    int32_t excess = side == SOURCE ? t->g.node[v].excess : -t->g.node[v].excess;
    return excess < amount ? excess : amount;
}

static void push(trees *t, enum side side, uint32_t v, int32_t amount)
{
    while (t->g.node[v].parent != QW_ROOT) {
        uint32_t h = carrier(t, side, v), next = qw_residual_parent_node(&t->g, v);
        qw_residual_push(&t->g, h, amount);
        if (t->g.half[h].room == 0) make_orphan(t, v);
        v = next;
    }
    t->g.node[v].excess -= side == SOURCE ? amount : -amount;
    if (t->g.node[v].excess == 0) make_orphan(t, v);
}

static void augment(trees *t, uint32_t bridge)
{
    uint32_t from = t->g.half[t->g.half[bridge].mate].head, to = t->g.half[bridge].head;
    int32_t amount = bottleneck(t, SINK, to, bottleneck(t, SOURCE, from, t->g.half[bridge].room));
    qw_residual_push(&t->g, bridge, amount);
    push(t, SOURCE, from, amount);
    push(t, SINK, to, amount);
}

/* The half to the neighbour nearest to a root that can be v's parent, or QW_NONE. */
static uint32_t find_parent(trees *t, uint32_t v, uint32_t *depth)
{
    qw_residual *g = &t->g;
    enum side side = t->side[v];
    uint32_t best = QW_NONE;
    *depth = UINT32_MAX;
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        uint32_t w = g->half[h].head;
        if (g->node[w].depth == 0 || t->side[w] != side || room_up(t, side, h) == 0) continue;
        uint32_t d = qw_residual_depth(g, w, t->now);
        if (d == 0 || d >= *depth) continue;
        best = h;
        *depth = d;
    }
    return best;
}

/* Takes v out of its tree; its children lose their parent, and neighbours that may take it back are active. */
static void set_free(trees *t, uint32_t v)
{
    qw_residual *g = &t->g;
    enum side side = t->side[v];
    g->node[v].depth = 0;
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        uint32_t w = g->half[h].head;
        if (g->node[w].depth == 0 || t->side[w] != side) continue;
        if (room_up(t, side, h) > 0) activate(t, w); /* w can take v back */
        if (g->node[w].parent == g->half[h].mate) make_orphan(t, w);
    }
}

/* Finds a new parent in the same tree for every orphan; one that has none is set free. */
static void adopt(trees *t)
{
    for (uint32_t i = 0; i < t->orphan_count; i++) {
        uint32_t v = t->orphans[i], depth, parent = find_parent(t, v, &depth);
        if (parent == QW_NONE) {
            set_free(t, v);
        } else {
            t->g.node[v].parent = parent;
            t->g.node[v].stamp = t->now;
            t->g.node[v].depth = depth + 1;
        }
    }
    t->orphan_count = 0;
}

qw_flow_result qw_flow_boykov_kolmogorov(qw_env *env, const qw_flow_problem *problem, int32_t *flow)
{
    assert(problem->supply && flow);
    trees t;
    qw_scope_begin(env);
    trees_begin(&t, env, problem, flow);
    for (uint32_t step = 0; t.length > 0; step++) { /* a step takes a node from the queue or lessens the flow wanted */
        if (step % QW_GRAIN_LIGHT == 0) qw_heartbeat(env);
        uint32_t v = t.queue[t.begin];
        uint32_t bridge = t.g.node[v].depth > 0 ? grow(&t, v) : QW_NONE;
        if (bridge == QW_NONE) {
            deactivate_first(&t);
            continue;
        }
        t.now++;
        augment(&t, bridge);
        adopt(&t);
    }
    qw_flow_result result = qw_residual_finish(&t.g, problem, flow, t.now);
    qw_scope_end(env);
    return result;
}

/* Exact minimum-cost flow by successive shortest paths, all sources at once, in one forest that is kept and repaired.
 *
 * It is a primal-dual method. Every node has a potential p <= 0, all 0 at first, and every residual arc keeps the
 * reduced cost cost + p[tail] - p[head] >= 0. The nodes with supply left root trees of tight arcs (reduced cost 0). As
 * time passes, the potentials of all tree nodes sink together, one for one, so arcs that leave the forest become tight
 * one after another: a queue by time holds for each node next to the forest when that will be. A free node that is
 * reached joins; a lacking one is first sent flow along its tree, which cuts nodes from their parents. Those look for
 * another tight arc from the forest, or leave it with the potential they have and wait in the queue: adoption as in
 * Boykov and Kolmogorov's maximum flow, with time added.
 *
 * Each node's label makes the sinking implicit: p = label - time in a tree, p = label outside. In a tree the label is
 * the cost of the way from the root. Work is done only next to what changes, and trees of different sources never
 * overlap, so supplies that are few and near their sinks cost little more than one bounded search by Dijkstra's method
 * from all of them.
 *
 * The last supplies are far from their sinks, and their trees, which are cut at each augmentation, are large: a fifth
 * of the supplies may take nine tenths of the time. So a problem that is much like one solved before begins with its
 * potentials: arcs of negative reduced cost are filled, and what that leaves unmet is little.
 */
#include "solve/queue.h"
#include "solve/flow.h"
#include "solve/residual.h"

#include <assert.h>

typedef struct forest {
    qw_residual g;
    qw_queue queue;    /* of free nodes next to the forest; last is the time, parent the half that is to become tight */
    uint32_t *orphans; /* uint32_t[node_count]; a node is orphaned at most once an augmentation */
    uint32_t orphan_count;
    uint32_t now;          /* augmentations begun; stamps of the depths */
    int64_t left, lacking; /* sums of the excesses above and below 0 */
} forest;

static bool in_tree(const forest *f, uint32_t v) { return f->g.node[v].depth > 0; }

/* When the mate of half h of the free node v, which comes in from a tree node, becomes tight. In a tree node: 0 when it
 * is tight. */
static int64_t tight_time(const forest *f, uint32_t v, uint32_t h)
{
    return f->g.node[f->g.half[h].head].label - f->g.half[h].cost - f->g.node[v].label;
}

/* Tells the free neighbours of the new tree node u when it reaches them. */
static void reach_out(forest *f, uint32_t u)
{
    const qw_residual *g = &f->g;
    for (uint32_t h = g->first[u]; h < g->first[u + 1]; h++) {
        uint32_t v = g->half[h].head;
        if (g->half[h].room == 0 || in_tree(f, v)) continue;
        int64_t time = f->g.node[u].label + g->half[h].cost - f->g.node[v].label;
        if (qw_queue_has(&f->queue, v) && f->queue.link[v].key <= time) continue;
        g->node[v].parent = g->half[h].mate;
        qw_queue_put(&f->queue, v, time);
    }
}

/* Finds anew when the free node v is reached first. */
static void wait_again(forest *f, uint32_t v)
{
    const qw_residual *g = &f->g;
    int64_t first = INT64_MAX;
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        if (!in_tree(f, g->half[h].head)) continue;
        int64_t time = tight_time(f, v, h);
        if (time >= first || g->half[g->half[h].mate].room == 0) continue;
        first = time;
        g->node[v].parent = h;
    }
    if (first == INT64_MAX) qw_queue_remove(&f->queue, v);
    else qw_queue_put(&f->queue, v, first);
}

static bool is_reached(const forest *f, uint32_t v)
{
    const qw_half_arc *parent = &f->g.half[f->g.node[v].parent];
    return in_tree(f, parent->head) && f->g.half[parent->mate].room > 0 &&
           tight_time(f, v, f->g.node[v].parent) == f->queue.last;
}

static void join(forest *f, uint32_t v)
{
    const qw_tree_node *parent = &f->g.node[qw_residual_parent_node(&f->g, v)];
    f->g.node[v].depth = parent->depth + 1;
    f->g.node[v].stamp = parent->stamp;
    f->g.node[v].label += f->queue.last;
    reach_out(f, v);
}

static void make_orphan(forest *f, uint32_t v)
{
    f->g.node[v].parent = QW_ORPHAN;
    f->orphans[f->orphan_count++] = v;
}

/* Sends what can be sent down the tree to the lacking node `sink`, which is reached but has not joined. */
static void augment(forest *f, uint32_t sink)
{
    qw_residual *g = &f->g;
    int32_t amount = qw_residual_amount(g, sink);
    uint32_t v = sink;
    assert(amount > 0);
    g->node[sink].excess += amount;
    f->left -= amount;
    f->lacking -= amount;
    while (g->node[v].parent != QW_ROOT) {
        uint32_t carrier = g->half[g->node[v].parent].mate, next = qw_residual_parent_node(g, v);
        qw_residual_push(g, carrier, amount);
        if (g->half[carrier].room == 0 && v != sink) make_orphan(f, v);
        v = next;
    }
    g->node[v].excess -= amount;
    if (g->node[v].excess == 0) make_orphan(f, v);
}

/* The half of v to the tree node nearest to a root from which a tight arc comes in, or QW_NONE. */
static uint32_t find_parent(forest *f, uint32_t v, uint32_t *depth)
{
    qw_residual *g = &f->g;
    uint32_t best = QW_NONE;
    *depth = UINT32_MAX;
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        uint32_t u = g->half[h].head;
        if (!in_tree(f, u) || tight_time(f, v, h) != 0 || g->half[g->half[h].mate].room == 0) continue;
        uint32_t d = qw_residual_depth(g, u, f->now);
        if (d == 0 || d >= *depth) continue;
        best = h;
        *depth = d;
    }
    return best;
}

static void leave(forest *f, uint32_t v)
{
    qw_residual *g = &f->g;
    g->node[v].depth = 0;
    f->g.node[v].label -= f->queue.last;
    for (uint32_t h = g->first[v]; h < g->first[v + 1]; h++) {
        uint32_t w = g->half[h].head;
        if (in_tree(f, w) && g->node[w].parent == g->half[h].mate) make_orphan(f, w);
    }
}

/* Finds a new parent for every orphan; one that has none leaves the forest and waits to be reached again. */
static void adopt(forest *f)
{
    uint32_t left = 0;
    for (uint32_t i = 0; i < f->orphan_count; i++) {
        uint32_t v = f->orphans[i], depth, parent = find_parent(f, v, &depth);
        if (parent == QW_NONE) {
            leave(f, v);
            f->orphans[left++] = v;
        } else {
            f->g.node[v].parent = parent;
            f->g.node[v].stamp = f->now;
            f->g.node[v].depth = depth + 1;
        }
    }
    f->orphan_count = 0;
    for (uint32_t i = 0; i < left; i++) wait_again(f, f->orphans[i]); /* not before it is known who else has left */
}

/* The flow that goes with the potentials: none along arcs that cost something, all along those that pay. */
static void flow_of(const qw_flow_problem *p, const int64_t *potential, int32_t *flow)
{
    for (uint32_t a = 0; a < p->arc_count; a++)
        flow[a] = p->cost[a] + potential[p->tail[a]] - potential[p->head[a]] < 0 ? p->capacity[a] : 0;
}

/* A forest whose roots are the nodes with an excess, labelled by their potentials, and what these reach. */
static void forest_begin(forest *f, qw_env *env, const qw_flow_problem *problem, const int32_t *flow,
                         const int64_t *potential)
{
    *f = (forest){.g = qw_residual_create(env, problem, flow)};
    uint32_t n = f->g.node_count;
    f->queue = qw_queue_create(env, n);
    f->orphans = QW_NEW(env, uint32_t, n);
    for (uint32_t v = 0; v < n; v++) {
        qw_tree_node *node = &f->g.node[v];
        node->label = potential[v];
        if (node->excess < 0) f->lacking -= node->excess;
        if (node->excess <= 0) continue;
        f->left += node->excess;
        node->parent = QW_ROOT;
        node->depth = 1;
    }
    for (uint32_t v = 0; v < n; v++)
        if (in_tree(f, v)) reach_out(f, v);
}

qw_flow_result qw_flow_min_cost(qw_env *env, const qw_flow_problem *problem, int64_t farthest, int32_t *flow,
                                int64_t *potential)
{
    assert(problem->cost && problem->supply && flow && potential && farthest >= 0);
    forest f;
    qw_scope_begin(env);
    flow_of(problem, potential, flow);
    forest_begin(&f, env, problem, flow, potential);
    for (uint32_t step = 0; f.left > 0 && f.lacking > 0; step++) {
        if (step % QW_GRAIN_HEAVY == 0) qw_heartbeat(env);
        uint32_t v = qw_queue_take(&f.queue);
        if (v == QW_NONE || f.queue.last > farthest) break;
        if (!is_reached(&f, v)) {
            wait_again(&f, v);
        } else if (f.g.node[v].excess == 0) {
            join(&f, v);
        } else {
            f.now++;
            augment(&f, v);
            adopt(&f);
            wait_again(&f, v);
        }
    }
    for (uint32_t v = 0; v < f.g.node_count; v++)
        potential[v] = f.g.node[v].label - (in_tree(&f, v) ? f.queue.last : 0);
    qw_flow_result result = qw_residual_finish(&f.g, problem, flow, f.now);
    qw_scope_end(env);
    return result;
}

#include "remesh/quantise/network.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* One end of a variable: the node and the sign with which it appears there. */
typedef struct end {
    uint32_t node;
    int sign;
} end;

static end end_of(const qw_complex *c, uint32_t e, unsigned k, int which, uint32_t ground)
{
    uint32_t h = c->side[2 * e + (uint32_t)which];
    if (h == QW_NONE) return (end){ground, 0};
    qw_row row = qw_row_of(c->rot[h], k);
    return (end){2 * (h / 3) + row.row, row.sign};
}

/* Signs by breadth-first spreading over the triangles' rows; the ground takes no part (it balances with anything). */
static void sign_nodes(qw_env *env, const qw_complex *c, qw_network *net)
{
    uint32_t ground = net->node_count - 1, count = 0;
    uint32_t *queue = QW_NEW(env, uint32_t, net->node_count);
    memset(net->sign, 0, net->node_count);
    for (uint32_t root = 0; root < ground; root++) {
        if (net->sign[root]) continue;
        uint32_t tail = 0, head = 0;
        net->sign[root] = 1;
        net->component[root] = count;
        queue[tail++] = root;
        while (head < tail) {
            uint32_t node = queue[head++], f = node / 2;
            for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
                for (unsigned k = 0; k < 2; k++) {
                    uint32_t e = c->edge[h];
                    qw_row here = qw_row_of(c->rot[h], k);
                    if (here.row != (node & 1u) || qw_is_fixed(c->fixed[e], k)) continue;
                    end there = end_of(c, e, k, c->side[2 * e] == h ? 1 : 0, ground);
                    if (there.node == ground || net->sign[there.node]) continue;
                    net->sign[there.node] = (int8_t)(-net->sign[node] * here.sign * there.sign);
                    net->component[there.node] = count;
                    queue[tail++] = there.node;
                }
        }
        count++;
    }
    net->sign[ground] = 1;
    net->component_count = count;
    qw_free(env, queue);
}

static void add_arc(qw_network *net, uint32_t variable, uint32_t minus, uint32_t plus)
{
    assert(minus < net->node_count && plus < net->node_count);
    net->variable[net->variable_count] = variable;
    net->minus[net->variable_count] = minus;
    net->plus[net->variable_count++] = plus;
}

/* Sorts the variables: those with opposite signs in their two rows become arcs, those with equal signs are frozen.
 * */
static void collect_variables(const qw_complex *c, qw_network *net)
{
    uint32_t ground = net->node_count - 1;
    for (uint32_t e = 0; e < c->edge_count; e++)
        for (unsigned k = 0; k < 2; k++) {
            if (qw_is_fixed(c->fixed[e], k)) continue;
            end a = end_of(c, e, k, 0, ground), b = end_of(c, e, k, 1, ground);
            int sa = a.sign * net->sign[a.node], sb = b.node == ground ? -sa : b.sign * net->sign[b.node];
            if (a.node == b.node && sa != sb) continue; /* appears with both signs in one row: it has no effect */
            if (sa == sb) net->frozen[net->frozen_count++] = 2 * e + k;
            else add_arc(net, 2 * e + k, sa < 0 ? a.node : b.node, sa < 0 ? b.node : a.node);
        }
}

/* All components that touch the ground are one. */
static void join_ground(qw_env *env, qw_network *net)
{
    uint32_t ground = net->node_count - 1;
    uint8_t *grounded = QW_NEW_ZERO(env, uint8_t, (size_t)net->component_count + 1);
    net->ground_component = QW_NONE;
    for (uint32_t i = 0; i < net->variable_count; i++) {
        uint32_t other = net->minus[i] == ground ? net->plus[i] : net->plus[i] == ground ? net->minus[i] : QW_NONE;
        if (other == QW_NONE) continue;
        uint32_t c = net->component[other];
        grounded[c] = 1;
        if (net->ground_component == QW_NONE || c < net->ground_component) net->ground_component = c;
    }
    for (uint32_t v = 0; v < ground; v++)
        if (grounded[net->component[v]]) net->component[v] = net->ground_component;
    net->component[ground] = net->ground_component == QW_NONE ? net->component_count++ : net->ground_component;
    qw_free(env, grounded);
}

/* The network of a complex: a node for each row, and the ground; an arc for each variable that appears with both
 * signs. */
qw_network qw_network_build(qw_env *env, const qw_complex *c)
{
    assert(c->edge && c->rot);
    assert(c->face_count < QW_NONE / 2);
    size_t most = (size_t)2 * c->edge_count;
    qw_network net = {.node_count = 2 * c->face_count + 1};
    net.variable = QW_NEW(env, uint32_t, most);
    net.minus = QW_NEW(env, uint32_t, most);
    net.plus = QW_NEW(env, uint32_t, most);
    net.frozen = QW_NEW(env, uint32_t, most);
    net.sign = QW_NEW(env, int8_t, net.node_count);
    net.component = QW_NEW(env, uint32_t, net.node_count);
    sign_nodes(env, c, &net);
    collect_variables(c, &net);
    join_ground(env, &net);
    net.frozen = qw_resize(env, net.frozen, net.frozen_count, sizeof *net.frozen);
    return net;
}

void qw_network_supply(const qw_network *net, const qw_complex *c, int32_t *supply)
{
    assert(c->d && supply);
    /* The signed row must gain -sign residual, and gaining is inflow: outflow minus inflow is sign residual. */
    uint32_t ground = net->node_count - 1;
    int64_t grounded = 0;
    for (uint32_t f = 0; f < c->face_count; f++) {
        qw_int2 r = qw_complex_residual(c, f);
        supply[2 * f] = net->sign[2 * f] * r.x;
        supply[2 * f + 1] = net->sign[2 * f + 1] * r.y;
        for (uint32_t n = 2 * f; n < 2 * f + 2; n++)
            if (net->component[n] == net->component[ground]) grounded += supply[n];
    }
    supply[ground] = (int32_t)-grounded;
}

static int32_t *component_of(qw_complex *c, uint32_t variable)
{
    qw_int2 *d = &c->d[variable / 2];
    return variable & 1u ? &d->y : &d->x;
}

/* Change of the component's sum of supplies when the frozen variable rises by one. */
static int frozen_effect(const qw_network *net, const qw_complex *c, uint32_t variable, uint32_t *component)
{
    end a = end_of(c, variable / 2, variable & 1u, 0, net->node_count - 1);
    *component = net->component[a.node];
    return 2 * a.sign * net->sign[a.node];
}

/* Search state for spread_changes. */
typedef struct spreading {
    uint32_t *origin; /* [nodes] the supply node that reached this one first, or QW_NONE */
    uint32_t *queue;  /* [nodes] */
    uint8_t *spent;   /* [nodes] supply nodes that have their change */
    uint8_t *state;   /* [2 edges] 1: frozen and not yet changed, 0: otherwise */
    int64_t *sum;     /* [components] */
    int32_t limit;    /* a change keeps |d| within this, or makes it smaller */
    bool moved;
} spreading;

/* Changes the frozen variable for the benefit of the supply node `origin`. */
static bool change_frozen(const qw_network *net, qw_complex *c, spreading *s, uint32_t variable, uint32_t origin)
{
    assert(variable / 2 < c->edge_count);
    uint32_t component;
    int effect = frozen_effect(net, c, variable, &component);
    int step = (s->sum[component] > 0) == (effect > 0) ? -1 : 1;
    int32_t *d = component_of(c, variable);
    int64_t sum = s->sum[component];
    /* each change reduces the sum by 2, so an odd rest (constrained components) stays */
    if ((sum >= -1 && sum <= 1) || (abs(*d + step) > s->limit && abs(*d + step) > abs(*d))) return false;
    *d += step;
    s->sum[component] += effect * step;
    s->state[variable] = 0;
    s->spent[origin] = 1;
    s->moved = true;
    return true;
}

/* Visits the variables of one row: changes a frozen one if there is one, and walks on through the others. */
static void visit_row(const qw_network *net, qw_complex *c, spreading *s, uint32_t node, uint32_t *tail)
{
    uint32_t ground = net->node_count - 1, f = node / 2, origin = s->origin[node];
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
        for (unsigned k = 0; k < 2; k++) {
            uint32_t e = c->edge[h];
            if (qw_row_of(c->rot[h], k).row != (node & 1u) || qw_is_fixed(c->fixed[e], k)) continue;
            if (s->state[2 * e + k] && !s->spent[origin] && change_frozen(net, c, s, 2 * e + k, origin)) continue;
            uint32_t there = end_of(c, e, k, c->side[2 * e] == h ? 1 : 0, ground).node;
            if (there == ground || s->origin[there] != QW_NONE || net->component[there] != net->component[node])
                continue;
            s->origin[there] = origin;
            s->queue[(*tail)++] = there;
        }
}

/* Each supply of the surplus sign searches breadth first for the nearest frozen variable that no other supply took.
   The changes then lie where the flow would have to end anyway and paths stay short; in any other order (by index,
   or at random as in the paper) hundreds of units cross the whole surface. */
static void spread_changes(const qw_network *net, qw_complex *c, const int32_t *supply, spreading *s)
{
    assert(s->limit > 0 && supply);
    uint32_t head = 0, tail = 0, ground = net->node_count - 1;
    memset(s->origin, 0xff, net->node_count * sizeof *s->origin);
    memset(s->spent, 0, net->node_count);
    for (uint32_t n = 0; n < ground; n++) {
        int64_t sum = s->sum[net->component[n]];
        bool wanted = net->component[n] != net->ground_component && sum && supply[n] && (sum > 0) == (supply[n] > 0);
        if (wanted) s->origin[n] = n, s->queue[tail++] = n;
    }
    while (head < tail) visit_row(net, c, s, s->queue[head], &tail), head++;
}

uint32_t qw_network_balance_sums(qw_env *env, const qw_network *net, qw_complex *c, uint8_t *bad)
{
    assert(c->d && net->sign);
    qw_scope_begin(env);
    int32_t *supply = QW_NEW(env, int32_t, net->node_count);
    spreading s = {QW_NEW(env, uint32_t, net->node_count),
                   QW_NEW(env, uint32_t, net->node_count),
                   QW_NEW(env, uint8_t, net->node_count),
                   QW_NEW(env, uint8_t, (size_t)2 * c->edge_count),
                   QW_NEW_ZERO(env, int64_t, net->component_count),
                   2,
                   true};
    for (; s.moved || s.limit <= 16; s.limit = s.moved ? s.limit : 2 * s.limit) {
        s.moved = false;
        qw_network_supply(net, c, supply);
        memset(s.sum, 0, net->component_count * sizeof *s.sum);
        memset(s.state, 0, (size_t)2 * c->edge_count);
        for (uint32_t n = 0; n < net->node_count; n++) s.sum[net->component[n]] += supply[n];
        for (uint32_t i = 0; i < net->frozen_count; i++) s.state[net->frozen[i]] = 1;
        spread_changes(net, c, supply, &s);
    }
    uint32_t failures = 0;
    for (uint32_t k = 0; k < net->component_count; k++) {
        bool wrong = s.sum[k] != 0 && k != net->ground_component;
        if (bad) bad[k] = wrong;
        failures += wrong;
    }
    qw_scope_end(env);
    return failures;
}

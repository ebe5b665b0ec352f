#include "integer/network.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* One end of a variable: the node and the sign with which it appears there. */
typedef struct end {
    uint32_t node;
    int sign;
} end;

static bool is_variable(const qw_complex *c, uint32_t e, unsigned k) { return !(c->fixed[e] & (k ? QW_FIXED_Y : QW_FIXED_X)); }

static end end_of(const qw_complex *c, uint32_t e, unsigned k, int which, uint32_t ground)
{
    uint32_t h = c->side[2 * e + (uint32_t)which];
    if (h == QW_NONE) return (end){ground, 0};
    qw_row row = qw_row_of(c->rot[h], k);
    return (end){2 * (h / 3) + row.row, row.sign};
}

/* Signs by breadth-first search over the triangles' rows; the ground takes no part (it balances with anything). */
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
                    if (here.row != (node & 1u) || !is_variable(c, e, k)) continue;
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
    net->variable[net->variable_count] = variable;
    net->minus[net->variable_count] = minus;
    net->plus[net->variable_count++] = plus;
}

static void collect_variables(const qw_complex *c, qw_network *net)
{
    uint32_t ground = net->node_count - 1;
    for (uint32_t e = 0; e < c->edge_count; e++)
        for (unsigned k = 0; k < 2; k++) {
            if (!is_variable(c, e, k)) continue;
            end a = end_of(c, e, k, 0, ground), b = end_of(c, e, k, 1, ground);
            int sa = a.sign * net->sign[a.node], sb = b.node == ground ? -sa : b.sign * net->sign[b.node];
            if (a.node == b.node && sa != sb) continue; /* cancels itself: nothing to decide */
            if (sa == sb)
                net->frozen[net->frozen_count++] = 2 * e + k;
            else
                add_arc(net, 2 * e + k, sa < 0 ? a.node : b.node, sa < 0 ? b.node : a.node);
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

qw_network qw_network_build(qw_env *env, const qw_complex *c)
{
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

/* By how much the component's supply sum changes when the frozen variable is raised by one. */
static int frozen_effect(const qw_network *net, const qw_complex *c, uint32_t variable, uint32_t *component)
{
    end a = end_of(c, variable / 2, variable & 1u, 0, net->node_count - 1);
    *component = net->component[a.node];
    return 2 * a.sign * net->sign[a.node];
}

uint32_t qw_network_balance_sums(qw_env *env, const qw_network *net, qw_complex *c, uint8_t *bad)
{
    qw_scope_begin(env);
    int64_t *sum = QW_NEW_ZERO(env, int64_t, net->component_count);
    int32_t *supply = QW_NEW(env, int32_t, net->node_count);
    qw_network_supply(net, c, supply);
    for (uint32_t n = 0; n < net->node_count; n++) sum[net->component[n]] += supply[n];
    /* Passes: first only changes towards zero, then also those that keep |d| <= 2, then more. The sum is that of effect * d over the frozen
       variables, so changes towards zero alone reach zero in the end; each takes 2 off, so an odd rest (held values) stays. */
    bool moved = true;
    for (int32_t pass = 0; moved || pass < 8; pass++) {
        moved = false;
        for (uint32_t i = 0; i < net->frozen_count; i++) {
            uint32_t component;
            int effect = frozen_effect(net, c, net->frozen[i], &component);
            if (sum[component] >= -1 && sum[component] <= 1) continue;
            int step = (sum[component] > 0) == (effect > 0) ? -1 : 1;
            int32_t *d = component_of(c, net->frozen[i]);
            bool towards_zero = *d != 0 && (*d > 0) != (step > 0);
            if (!towards_zero && (pass == 0 || abs(*d + step) > 2 + (pass > 1 ? pass - 1 : 0))) continue;
            *d += step;
            sum[component] += effect * step;
            moved = true;
        }
    }
    uint32_t failures = 0;
    for (uint32_t k = 0; k < net->component_count; k++) {
        bool wrong = sum[k] != 0 && k != net->ground_component;
        if (bad) bad[k] = wrong;
        failures += wrong;
    }
    qw_scope_end(env);
    return failures;
}

/* Section 3.3 on one complex: balance, make the sums zero, flow with capacities that open round by round. */
#include "remesh/quantise/regular.h"

#include "remesh/quantise/bidirected.h"
#include "remesh/quantise/network.h"
#include "solve/hub.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_LIMIT = 2, STEP_BY_STEP = 7, FEW_LEFT = 10 };

/* Four arcs a variable: the first step up, further steps up, the first step down, further steps down; capacities keep
   |d| <= limit. Costs rise with the steps, so a cheaper arc is always used first. */
enum { ARCS = 4 };
typedef struct arcs {
    uint32_t *tail, *head;
    int32_t *capacity, *cost, *flow, *supply;
    int64_t *potential;
    uint32_t count;
} arcs;

static int32_t value_of(const qw_complex *c, uint32_t variable)
{
    return variable & 1u ? c->d[variable / 2].y : c->d[variable / 2].x;
}

static float weight_of(const qw_complex *c, uint32_t variable) { return c->weight ? c->weight[variable / 2] : 1.0f; }

static void set_capacities(const qw_network *net, const qw_complex *c, int32_t limit, arcs *a)
{
    assert(limit > 0 && a->capacity);
    for (uint32_t i = 0; i < net->variable_count; i++) {
        int32_t d = value_of(c, net->variable[i]), *capacity = a->capacity + (size_t)ARCS * i;
        int32_t up = limit - d > 0 ? limit - d : 0, down = limit + d > 0 ? limit + d : 0;
        capacity[0] = up > 0, capacity[1] = up > 0 ? up - 1 : 0;
        capacity[2] = down > 0, capacity[3] = down > 0 ? down - 1 : 0;
    }
}

/* The cost of a step from d to z. Plain: 1, Eq. (7). Geometric: x is the edge's own component, and d may be rounded
   to either side of it almost for free; a step further than FREE beyond x is dear, as it inverts triangles; losing
   length costs slightly more than gaining it, or rows of quads would vanish more often than appear
   (docs/dev/decisions/flow-costs.md). Square: (z - x)^2, for edges that are many quads long. */
static int32_t step_cost(qw_cost_kind kind, int32_t d, int32_t z, float x, float weight, int32_t more_short)
{
    static const float FREE = 0.5f, WEIGHT = 32.0f, FARTHEST = 6.0f, SQUARE = 100.0f, MOST = 1000.0f;
    static const int32_t GAIN = 2, LOSS = 3;
    if (kind == QW_COST_PLAIN) return 1;
    if (kind == QW_COST_SQUARE) {
        float more = ((float)z - x) * ((float)z - x) - ((float)d - x) * ((float)d - x);
        more = weight * more + (float)(QW_BOUND_COST * more_short);
        return 1 + (int32_t)(SQUARE * fminf(fmaxf(more, 0.0f), weight * MOST) + 0.5f);
    }
    float beyond = fminf(fmaxf(fabsf((float)z - x) - FREE, 0.0f), FARTHEST);
    return (abs(z) < abs(d) ? LOSS : GAIN) + (int32_t)(WEIGHT * beyond * beyond + 0.5f);
}

/* By how many steps more component v of value z is short of its sign than of value d. */
static int32_t more_short(const qw_complex *c, uint32_t v, int32_t d, int32_t z)
{
    return qw_complex_short(c, v, z) - qw_complex_short(c, v, d);
}

typedef struct pricing {
    const qw_complex *complex;
    qw_cost_kind kind;
} pricing;

static int32_t cost_of_step(const void *user, uint32_t variable, int32_t step)
{
    const pricing *p = user;
    int32_t d = value_of(p->complex, variable);
    qw_real2 x = p->complex->real[variable / 2];
    return step_cost(p->kind, d, d + step, variable & 1u ? x.y : x.x, weight_of(p->complex, variable),
                     more_short(p->complex, variable, d, d + step));
}

/* What the first and the second step up and down of each variable cost; the second never less than the first, so
 * that the sum is convex. */
static void set_costs(const qw_network *net, const qw_complex *c, qw_cost_kind cost_kind, arcs *a)
{
    for (uint32_t i = 0; i < net->variable_count; i++) {
        uint32_t v = net->variable[i];
        int32_t d = value_of(c, v), *cost = a->cost + (size_t)ARCS * i;
        float x = v & 1u ? c->real[v / 2].y : c->real[v / 2].x, weight = weight_of(c, v);
        for (int32_t k = 0; k < 2; k++) {
            cost[k] = step_cost(cost_kind, d, d + 1 + k, x, weight, more_short(c, v, d, d + 1 + k));
            cost[2 + k] = step_cost(cost_kind, d, d - 1 - k, x, weight, more_short(c, v, d, d - 1 - k));
            if (k && cost[k] < cost[0]) cost[k] = cost[0];
            if (k && cost[2 + k] < cost[2]) cost[2 + k] = cost[2];
        }
    }
}

/* The arcs of a flow: two up and two down for each variable. */
static arcs make_arcs(qw_env *env, const qw_network *net, const qw_complex *c, qw_cost_kind cost_kind)
{
    arcs a = {.count = ARCS * net->variable_count};
    a.tail = QW_NEW(env, uint32_t, a.count);
    a.head = QW_NEW(env, uint32_t, a.count);
    a.capacity = QW_NEW(env, int32_t, a.count);
    a.cost = QW_NEW(env, int32_t, a.count);
    a.flow = QW_NEW_ZERO(env, int32_t, a.count);
    a.supply = QW_NEW(env, int32_t, net->node_count);
    a.potential = QW_NEW(env, int64_t, net->node_count);
    for (uint32_t i = 0; i < a.count; i++) {
        bool raises = i % ARCS < 2;
        a.tail[i] = raises ? net->minus[i / ARCS] : net->plus[i / ARCS];
        a.head[i] = raises ? net->plus[i / ARCS] : net->minus[i / ARCS];
    }
    set_costs(net, c, cost_kind, &a);
    qw_network_supply(net, c, a.supply);
    return a;
}

/* Solves the flow problem by the way that the option says. */
static qw_flow_result solve_once(qw_env *env, const qw_flow_problem *problem, qw_flow_choice kind, arcs *a)
{
    if (kind == QW_FLOW_MCF || kind == QW_FLOW_ILP) {
        memset(a->flow, 0, a->count * sizeof *a->flow);
        memset(a->potential, 0, problem->node_count * sizeof *a->potential);
        qw_flow_result result;
        if (kind == QW_FLOW_ILP) {
            if (!qw_flow_integer_program(env, problem, a->flow, &result))
                qw_fail(env, QW_UNSUPPORTED, -1, "flow=ilp needs GLPK, which this build was made without");
            return result;
        }
        result = qw_flow_min_cost_hub(env, problem, problem->node_count - 1, INT64_MAX, a->flow, a->potential);
        assert(qw_flow_is_optimal(problem, a->flow, a->potential));
        return result;
    }
    int64_t unmet = 0;
    for (uint32_t n = 0; n < problem->node_count; n++) unmet += problem->supply[n] > 0 ? problem->supply[n] : 0;
    /* the paper: Boykov-Kolmogorov while more than a few equations are unmet, Edmonds-Karp for the last */
    return unmet > FEW_LEFT ? qw_flow_boykov_kolmogorov(env, problem, a->flow)
                            : qw_flow_edmonds_karp(env, problem, a->flow);
}

static void apply_flow(const qw_network *net, const arcs *a, qw_complex *c)
{
    for (uint32_t i = 0; i < net->variable_count; i++) {
        const int32_t *flow = a->flow + (size_t)ARCS * i;
        int32_t change = flow[0] + flow[1] - flow[2] - flow[3];
        uint32_t v = net->variable[i];
        if (v & 1u) c->d[v / 2].y += change;
        else c->d[v / 2].x += change;
    }
}

int64_t qw_count_irregular(const qw_complex *c)
{
    int64_t count = 0;
    for (uint32_t f = 0; f < c->face_count; f++) count += !qw_int2_is_zero(qw_complex_residual(c, f));
    return count;
}

/* A capacity that all supply fits through: what is not met with it can never be met. */
static int64_t enough(const qw_network *net, const qw_complex *c, const int32_t *supply)
{
    int64_t sum = 0, largest = 0;
    for (uint32_t n = 0; n < net->node_count; n++) sum += supply[n] > 0 ? supply[n] : 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        int32_t l = qw_int2_norm(c->d[e]);
        if (l > largest) largest = l;
    }
    return sum + largest;
}

static void describe_network(const qw_network *net, qw_regular_counts *counts)
{
    counts->nodes = net->node_count;
    counts->arcs = ARCS * net->variable_count;
    counts->network_components = net->component_count;
    counts->free_variables = net->variable_count;
    counts->fixed_variables = net->frozen_count;
}

/* Solves through the balanced network what the bidirected one has left. */
static bool solve_balanced(qw_env *env, qw_complex *c, qw_flow_choice kind, qw_cost_kind cost, bool final,
                           qw_regular_counts *counts)
{
    qw_network net = qw_network_build(env, c);
    qw_network_balance_sums(env, &net, c, NULL);
    arcs a = make_arcs(env, &net, c, cost);
    qw_flow_problem problem = {net.node_count, a.count, a.tail, a.head, a.capacity, a.cost, a.supply};
    qw_flow_result result = {0};
    int64_t most = enough(&net, c, a.supply);
    for (int32_t limit = FIRST_LIMIT;; limit = limit < STEP_BY_STEP ? limit + 1 : 2 * limit) {
        set_capacities(&net, c, limit, &a);
        result = solve_once(env, &problem, kind, &a);
        counts->capacity_rounds++;
        if (result.met == result.wanted || !final || limit >= most) break;
    }
    assert(qw_flow_is_feasible(env, &problem, a.flow, result.met));
    apply_flow(&net, &a, c);
    describe_network(&net, counts);
    return result.met == result.wanted;
}

bool qw_solve_complex(qw_env *env, qw_complex *c, const qw_network *network, qw_flow_choice kind, qw_cost_kind cost,
                      bool final, int64_t *potential, qw_regular_counts *counts)
{
    assert(counts && c->d && c->real && c->fixed);
    qw_scope_begin(env);
    bool is_done = false;
    if (cost != QW_COST_PLAIN && (kind == QW_FLOW_MCF || kind == QW_FLOW_ILP)) {
        qw_network own;
        if (!network) own = qw_network_build(env, c), network = &own;
        qw_bidirected_counts b = qw_solve_bidirected(env, network, c, cost_of_step, &(pricing){c, cost}, potential);
        counts->half_variables += b.half_variables;
        counts->odd_cycles += b.odd_cycles;
        is_done = kind != QW_FLOW_ILP &&
                  qw_count_irregular(c) ==
                      0; /* always solved with: whether the build has an integer program must not depend on the mesh */
        if (is_done) describe_network(network, counts);
    }
    if (!is_done) is_done = solve_balanced(env, c, kind, cost, final, counts);
    qw_scope_end(env);
    return is_done;
}

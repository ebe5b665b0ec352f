/* Flows against enumeration, against each other, against GLPK, and by their certificates. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "solve/flow.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_NODES = 10000, MAX_ARCS = 60000 };

/* A network that can be changed, with a flow. */
typedef struct net {
    qw_env *env;
    uint64_t random;
    uint32_t n, m;
    uint32_t tail[MAX_ARCS], head[MAX_ARCS];
    int32_t capacity[MAX_ARCS], cost[MAX_ARCS], supply[MAX_NODES];
    int32_t flow[MAX_ARCS], other[MAX_ARCS];
    int64_t potential[MAX_NODES];
} net;

static uint32_t below(net *t, uint32_t bound)
{
    random_step(&t->random);
    return (uint32_t)(((t->random >> 32) * bound) >> 32);
}

static void arc(net *t, uint32_t tail, uint32_t head, int32_t capacity, int32_t cost)
{
    t->tail[t->m] = tail;
    t->head[t->m] = head;
    t->capacity[t->m] = capacity;
    t->cost[t->m++] = cost;
}

static qw_flow_problem problem_of(const net *t)
{
    return (qw_flow_problem){t->n, t->m, t->tail, t->head, t->capacity, t->cost, t->supply};
}

typedef void (*body)(void *user);

/* Each test's body runs on a fresh network, and all that it allocates is gone afterwards. */
static void run(body b)
{
    net *t = calloc(1, sizeof *t);
    t->env = qw_env_create(NULL, 1);
    t->random = 7;
    assert_int_equal(qw_protect(t->env, b, t), QW_OK);
    assert_int_equal(qw_env_bytes(t->env), 0);
    qw_env_destroy(t->env);
    free(t);
}

/* What qw_flow_min_cost promises of its potentials, besides that they prove the flow. */
static void check_potentials(const net *t, const int32_t *flow)
{
    int64_t least = 0, sent[MAX_NODES];
    memset(sent, 0, sizeof sent);
    for (uint32_t a = 0; a < t->m; a++) sent[t->tail[a]] += flow[a], sent[t->head[a]] -= flow[a];
    for (uint32_t v = 0; v < t->n; v++) {
        assert_true(t->potential[v] <= 0);
        if (t->potential[v] < least) least = t->potential[v];
    }
    for (uint32_t v = 0; v < t->n; v++) {
        if (t->supply[v] > sent[v]) assert_true(t->potential[v] == least);
        if (t->supply[v] < sent[v]) assert_true(t->potential[v] == 0);
    }
}

static qw_flow_result solve_min_cost(net *t)
{
    qw_flow_problem p = problem_of(t);
    memset(t->flow, 0, sizeof t->flow);
    memset(t->potential, 0, sizeof t->potential);
    qw_flow_result r = qw_flow_min_cost(t->env, &p, INT64_MAX, t->flow, t->potential);
    assert_true(qw_flow_is_feasible(t->env, &p, t->flow, r.met));
    assert_true(qw_flow_is_maximum(t->env, &p, t->flow));
    assert_true(qw_flow_is_optimal(&p, t->flow, t->potential));
    check_potentials(t, t->flow);
    return r;
}

static qw_flow_result solve_maximum(net *t, bool boykov, bool warm)
{
    qw_flow_problem p = problem_of(t);
    if (!warm) memset(t->other, 0, sizeof t->other);
    qw_flow_result r = boykov ? qw_flow_boykov_kolmogorov(t->env, &p, t->other)
                              : qw_flow_edmonds_karp(t->env, &p, t->other);
    assert_true(qw_flow_is_feasible(t->env, &p, t->other, r.met));
    assert_true(qw_flow_is_maximum(t->env, &p, t->other));
    return r;
}

/* The paper's Figure 4. As printed, x2 - x3 = -5 cannot hold with x3 <= 2: three units must stay. */
static void figure_4(net *t, int32_t capacity_x3)
{
    t->n = 4;
    t->m = 0;
    arc(t, 1, 3, 3, 1);
    arc(t, 1, 0, 2, 2);
    arc(t, 0, 2, capacity_x3, 3);
    arc(t, 3, 2, 3, 1);
    arc(t, 2, 1, 1, 4);
    memcpy(t->supply, (int32_t[]){5, 2, -4, -3}, 4 * sizeof(int32_t));
}

static void figure_4_body(void *user)
{
    net *t = user;
    figure_4(t, 2);
    qw_flow_result r = solve_min_cost(t);
    assert_int_equal(r.wanted, 7);
    assert_int_equal(r.met, 4);
    assert_int_equal(r.cost, 8);
    assert_int_equal(solve_maximum(t, true, false).met, 4);
    assert_int_equal(solve_maximum(t, false, false).met, 4);
    figure_4(t, 5);
    r = solve_min_cost(t);
    assert_int_equal(r.met, 7);
    assert_int_equal(r.cost, 22);
    assert_memory_equal(t->flow, ((int32_t[]){3, 0, 5, 0, 1}), 5 * sizeof(int32_t));
    assert_int_equal(solve_maximum(t, true, false).met, 7);
}

/* The best of all flows within the capacities. */
static void enumerate(const net *t, int64_t *best_met, int64_t *best_cost)
{
    int32_t flow[16] = {0};
    *best_met = -1;
    *best_cost = 0;
    for (;;) {
        int64_t sent[8] = {0}, met = 0, cost = 0;
        bool fine = true;
        for (uint32_t a = 0; a < t->m; a++)
            sent[t->tail[a]] += flow[a], sent[t->head[a]] -= flow[a], cost += flow[a] * t->cost[a];
        for (uint32_t v = 0; v < t->n; v++) {
            int64_t s = t->supply[v];
            fine = fine && (s >= 0 ? sent[v] >= 0 && sent[v] <= s : sent[v] <= 0 && sent[v] >= s);
            if (sent[v] > 0) met += sent[v];
        }
        if (fine && (met > *best_met || (met == *best_met && cost < *best_cost))) *best_met = met, *best_cost = cost;
        uint32_t a = 0;
        while (a < t->m && flow[a] == t->capacity[a]) flow[a++] = 0;
        if (a == t->m) return;
        flow[a]++;
    }
}

static void tiny_body(void *user)
{
    net *t = user;
    for (int round = 0; round < 4000; round++) {
        t->n = 2 + below(t, 4);
        t->m = 0;
        uint32_t arcs = below(t, 8);
        for (uint32_t a = 0; a < arcs; a++)
            arc(t, below(t, t->n), below(t, t->n), (int32_t)below(t, 3), (int32_t)below(t, 4));
        for (uint32_t v = 0; v < t->n; v++) t->supply[v] = (int32_t)below(t, 5) - 2;
        int64_t met, cost;
        enumerate(t, &met, &cost);
        qw_flow_result r = solve_min_cost(t);
        assert_int_equal(r.met, met);
        assert_int_equal(r.cost, cost);
        assert_int_equal(solve_maximum(t, true, false).met, met);
        assert_int_equal(solve_maximum(t, false, false).met, met);
    }
}

static void random_net(net *t, uint32_t nodes, uint32_t arcs, int32_t dearest)
{
    t->n = nodes;
    t->m = 0;
    memset(t->supply, 0, sizeof t->supply);
    for (uint32_t a = 0; a < arcs; a++) {
        uint32_t v = below(t, nodes), w = below(t, 4) ? (v + 1 + below(t, 5)) % nodes : below(t, nodes);
        if (below(t, 2)) v ^= w, w ^= v, v ^= w;
        arc(t, v, w, (int32_t)below(t, 4), (int32_t)below(t, (uint32_t)dearest + 1));
    }
    for (uint32_t i = 0; i < nodes / 2; i++) t->supply[below(t, nodes)]++, t->supply[below(t, nodes)]--;
}

static void medium_body(void *user)
{
    net *t = user;
    int cases = 0, unmet = 0;
    for (int round = 0; round < 300; round++) {
        random_net(t, 10 + below(t, 60), 30 + below(t, 300), round % 3 == 0 ? 1 : 9);
        qw_flow_result r = solve_min_cost(t), bk = solve_maximum(t, true, false), ek = solve_maximum(t, false, false),
                       ip;
        assert_int_equal(r.met, bk.met);
        assert_int_equal(r.met, ek.met);
        assert_true(r.cost <= bk.cost && r.cost <= ek.cost);
        unmet += r.met < r.wanted;
        qw_flow_problem p = problem_of(t);
        if (round % 3 || !qw_flow_integer_program(t->env, &p, t->other, &ip)) continue;
        cases++;
        assert_int_equal(ip.met, r.met);
        assert_int_equal(ip.cost, r.cost);
        assert_true(qw_flow_is_feasible(t->env, &p, t->other, ip.met));
        assert_true(qw_flow_is_optimal(&p, t->other, t->potential)); /* the potentials prove any optimum */
    }
    assert_true(unmet > 20 && unmet < 280);
    assert_int_equal(cases, qw_flow_has_integer_program() ? 100 : 0);
}

static void grid_net(net *t, uint32_t side, uint32_t pairs, uint32_t dearest, int32_t capacity)
{
    t->n = side * side;
    t->m = 0;
    memset(t->supply, 0, sizeof t->supply);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++)
            for (uint32_t way = 0; way < 4; way++) {
                uint32_t v = y * side + x, w = way < 2 ? v + 1 : v + side;
                if (way < 2 ? x + 1 == side : y + 1 == side) continue;
                arc(t, way & 1 ? w : v, way & 1 ? v : w, capacity, (int32_t)below(t, dearest + 1));
            }
    for (uint32_t i = 0; i < pairs; i++) {
        uint32_t x = below(t, side - 8), y = below(t, side - 8);
        t->supply[(y + 4) * side + x + 4]++;
        t->supply[(y + below(t, 9)) * side + x + below(t, 9)]--;
    }
}

static void grid_body(void *user)
{
    net *t = user;
    for (uint32_t dearest = 0; dearest <= 20; dearest += 5)
        for (int32_t capacity = 1; capacity <= 2; capacity++) {
            grid_net(t, 100, 500, dearest, capacity);
            qw_flow_result r = solve_min_cost(t);
            assert_int_equal(r.met, solve_maximum(t, true, false).met);
            assert_int_equal(r.met, solve_maximum(t, false, false).met);
        }
}

static void warm_body(void *user)
{
    net *t = user;
    int raised = 0;
    for (int round = 0; round < 100; round++) {
        grid_net(t, 20, 60, 3, 0);
        for (uint32_t a = 0; a < t->m; a++) t->capacity[a] = (int32_t)below(t, 2);
        int64_t met = solve_maximum(t, round & 1, false).met;
        for (uint32_t a = 0; a < t->m; a++) t->capacity[a] += (int32_t)below(t, 2);
        int64_t warm = solve_maximum(t, round & 2, true).met;
        raised += warm > met;
        assert_true(warm >= met);
        assert_int_equal(warm, solve_min_cost(t).met);
    }
    assert_true(raised > 50);
}

/* From the potentials of a problem with a few other costs, capacities and supplies: an optimum as from 0. */
static void alike_body(void *user)
{
    net *t = user;
    int met = 0;
    for (int round = 0; round < 40; round++) {
        grid_net(t, 30, 150, 20, 2);
        solve_min_cost(t);
        for (uint32_t a = 0; a < t->m; a += 1 + below(t, 40))
            t->cost[a] = (int32_t)below(t, 21), t->capacity[a] = 1 + (int32_t)below(t, 2);
        uint32_t v = below(t, t->n);
        t->supply[v]++, t->supply[(v + 1) % t->n]--;
        qw_flow_problem p = problem_of(t);
        qw_flow_result again = qw_flow_min_cost(t->env, &p, INT64_MAX, t->other, t->potential);
        assert_true(qw_flow_is_optimal(&p, t->other, t->potential));
        qw_flow_result r = solve_min_cost(t);
        if (r.met < r.wanted) continue;
        met++;
        assert_int_equal(again.met, r.met);
        assert_int_equal(again.cost, r.cost);
        assert_true(qw_flow_is_feasible(t->env, &p, t->other, again.met));
    }
    assert_true(met > 30);
}

/* Units on three ways cost 1, 3, 5, ..., that is z^2 for z units: they spread evenly. */
static void convex_body(void *user)
{
    net *t = user;
    t->n = 5;
    for (uint32_t way = 1; way <= 3; way++) {
        arc(t, way, 4, 10, 0);
        for (int32_t unit = 0; unit < 6; unit++) arc(t, 0, way, 1, 2 * unit + 1);
    }
    t->supply[0] = 7;
    t->supply[4] = -7;
    qw_flow_result r = solve_min_cost(t);
    assert_int_equal(r.met, 7);
    assert_int_equal(r.cost, 3 * 3 + 2 * 2 + 2 * 2);
    for (uint32_t a = 0; a + 1 < t->m; a++) /* no unit before a cheaper one of the same way */
        if (t->tail[a] == 0 && t->tail[a + 1] == 0) assert_true(t->flow[a] >= t->flow[a + 1]);
}

/* Each way of spoiling a solution is seen. */
static void tamper_body(void *user)
{
    net *t = user;
    grid_net(t, 20, 40, 9, 2);
    for (uint32_t a = 0; a < t->m; a++) t->cost[a]++; /* no flow is free */
    qw_flow_result r = solve_min_cost(t);
    qw_flow_problem p = problem_of(t);
    assert_false(qw_flow_is_feasible(t->env, &p, t->flow, r.met + 1));
    int used = 0;
    for (uint32_t a = 0; a < t->m; a++) {
        int32_t was = t->flow[a];
        t->flow[a] = was + 1;
        assert_false(qw_flow_is_feasible(t->env, &p, t->flow, r.met));
        t->flow[a] = t->capacity[a] + 1;
        assert_false(qw_flow_is_feasible(t->env, &p, t->flow, r.met));
        t->flow[a] = -1;
        assert_false(qw_flow_is_feasible(t->env, &p, t->flow, r.met));
        t->flow[a] = was;
        if (was == 0 || was == t->capacity[a]) continue;
        used++; /* a residual arc both ways is tight: any change of either potential breaks it */
        t->potential[t->tail[a]]++;
        assert_false(qw_flow_is_optimal(&p, t->flow, t->potential));
        t->potential[t->tail[a]] -= 2;
        assert_false(qw_flow_is_optimal(&p, t->flow, t->potential));
        t->potential[t->tail[a]]++;
    }
    assert_true(used > 10);
    for (uint32_t a = 0; a + 1 < t->m; a += 2) { /* a round trip stays feasible and maximal, but is not cheapest */
        if (t->flow[a] == t->capacity[a] || t->flow[a + 1] == t->capacity[a + 1]) continue;
        t->flow[a]++, t->flow[a + 1]++;
        assert_true(qw_flow_is_feasible(t->env, &p, t->flow, r.met) && qw_flow_is_maximum(t->env, &p, t->flow));
        assert_false(qw_flow_is_optimal(&p, t->flow, t->potential));
        t->flow[a]--, t->flow[a + 1]--;
    }
    memset(t->flow, 0, sizeof t->flow);
    assert_true(qw_flow_is_feasible(t->env, &p, t->flow, 0));
    assert_false(qw_flow_is_maximum(t->env, &p, t->flow));
}

/* Nothing at all; parts that do not meet; supplies that do not balance; costs whose sums need 64 bits. */
static void odd_body(void *user)
{
    net *t = user;
    assert_int_equal(solve_min_cost(t).met, 0);
    assert_int_equal(solve_maximum(t, true, false).met, 0);
    t->n = 4;
    memcpy(t->supply, (int32_t[]){3, -1, 2, -5}, 4 * sizeof(int32_t));
    assert_int_equal(solve_min_cost(t).wanted, 5);
    arc(t, 0, 1, 9, 1);
    arc(t, 2, 3, 9, 1);
    qw_flow_result r = solve_min_cost(t);
    assert_int_equal(r.met, 3);
    assert_int_equal(r.cost, 3);
    assert_int_equal(solve_maximum(t, true, false).met, 3);
    assert_int_equal(solve_maximum(t, false, false).met, 3);

    memset(t->supply, 0, sizeof t->supply);
    t->n = 5000;
    t->m = 0;
    for (uint32_t v = 0; v + 1 < t->n; v++) arc(t, v, v + 1, INT32_MAX, 1);
    t->supply[0] = INT32_MAX / 2;
    t->supply[t->n - 1] = -INT32_MAX / 2;
    t->supply[t->n - 2] = -1;
    t->supply[2] = 1;
    assert_int_equal(solve_maximum(t, true, false).met, INT32_MAX / 2 + 1);
    for (uint32_t a = 0; a < t->m; a++) t->cost[a] = INT32_MAX;
    t->supply[0] = 1000;
    t->supply[t->n - 1] = -1000;
    assert_true(solve_min_cost(t).cost == (int64_t)INT32_MAX * (1000 * 4999ll + 4998 - 2));
}

static void same_body(void *user)
{
    net *t = user;
    qw_flow_problem p = problem_of(t);
    grid_net(t, 40, 150, 4, 1);
    p = problem_of(t);
    for (int solver = 0; solver < 3; solver++) {
        int64_t *again = calloc(t->n, sizeof *again);
        memset(t->flow, 0, sizeof t->flow);
        memset(t->other, 0, sizeof t->other);
        memset(t->potential, 0, sizeof t->potential);
        for (int time = 0; time < 2; time++) {
            int32_t *flow = time ? t->other : t->flow;
            if (solver == 0) qw_flow_min_cost(t->env, &p, INT64_MAX, flow, time ? again : t->potential);
            if (solver == 1) qw_flow_boykov_kolmogorov(t->env, &p, flow);
            if (solver == 2) qw_flow_edmonds_karp(t->env, &p, flow);
        }
        assert_memory_equal(t->flow, t->other, t->m * sizeof *t->flow);
        if (solver == 0) assert_memory_equal(t->potential, again, t->n * sizeof *again);
        free(again);
    }
}

static void all_solvers(void *user)
{
    net *t = user;
    qw_flow_result r;
    solve_min_cost(t);
    solve_maximum(t, true, false);
    solve_maximum(t, false, false);
    qw_flow_problem p = problem_of(t);
    qw_flow_integer_program(t->env, &p, t->other, &r);
}

static void test_scarce_memory(void **state)
{
    (void)state;
    net *t = calloc(1, sizeof *t);
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    t->random = 3;
    qw_host host = faults_host(&f);
    t->env = qw_env_create(&host, 1);
    random_net(t, 20, 60, 5);
    qw_status status = QW_MEMORY;
    int allowed = 0;
    for (; status != QW_OK; allowed++) {
        f.allocations = allowed;
        status = qw_protect(t->env, all_solvers, t);
        assert_true(status == QW_OK || status == QW_MEMORY);
        assert_int_equal(qw_env_bytes(t->env), 0);
    }
    assert_true(allowed > 20);
    qw_env_destroy(t->env);
    free(t);
}

#define TEST(name)                        \
    static void test_##name(void **state) \
    {                                     \
        (void)state;                      \
        run(name##_body);                 \
    }
TEST(figure_4)
TEST(tiny)
TEST(medium)
TEST(grid)
TEST(warm)
TEST(alike)
TEST(convex)
TEST(tamper)
TEST(odd)
TEST(same)

QW_TEST_SUITE(flow)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_figure_4), cmocka_unit_test(test_tiny),          cmocka_unit_test(test_medium),
        cmocka_unit_test(test_grid),     cmocka_unit_test(test_warm),          cmocka_unit_test(test_alike),
        cmocka_unit_test(test_convex),   cmocka_unit_test(test_tamper),        cmocka_unit_test(test_odd),
        cmocka_unit_test(test_same),     cmocka_unit_test(test_scarce_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Times the flow solvers on a network like those of the regularity equations: a square grid of nodes, two antiparallel
 * arcs of small cost between neighbours, and pairs of a supply and a demand a few steps apart. Not built by default: cc
 * -O3 -Iinclude -Isrc bench/bench_flow.c build/libquadwright.a -lcadical -lstdc++ -lm -lpthread -o bench_flow
 *     bench_flow [pairs] [reach] [largest cost] [capacity] [side]
 */
#include "solve/flow.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct bench {
    qw_env *env;
    uint32_t side, pairs, reach;
    int32_t largest_cost, capacity;
    uint64_t random;
} bench;

/* Of the processor, so that other work on the machine counts less. */
static double seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

static uint32_t below(bench *b, uint32_t bound)
{
    b->random = b->random * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(((b->random >> 32) * bound) >> 32);
}

static void link(bench *b, qw_flow_problem *p, uint32_t *tail, uint32_t *head, int32_t *capacity, int32_t *cost,
                 uint32_t v, uint32_t w)
{
    for (int way = 0; way < 2; way++) {
        uint32_t a = p->arc_count++;
        tail[a] = way ? w : v;
        head[a] = way ? v : w;
        capacity[a] = b->capacity;
        cost[a] = b->largest_cost <= 1 ? b->largest_cost : (int32_t)below(b, (uint32_t)b->largest_cost + 1);
    }
}

static qw_flow_problem generate(bench *b)
{
    uint32_t side = b->side, n = side * side;
    qw_flow_problem p = {.node_count = n};
    uint32_t *tail = QW_NEW(b->env, uint32_t, 4 * n), *head = QW_NEW(b->env, uint32_t, 4 * n);
    int32_t *capacity = QW_NEW(b->env, int32_t, 4 * n), *cost = QW_NEW(b->env, int32_t, 4 * n),
            *supply = QW_NEW_ZERO(b->env, int32_t, n);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            if (x + 1 < side) link(b, &p, tail, head, capacity, cost, y * side + x, y * side + x + 1);
            if (y + 1 < side) link(b, &p, tail, head, capacity, cost, y * side + x, (y + 1) * side + x);
        }
    for (uint32_t i = 0; i < b->pairs; i++) {
        uint32_t x = below(b, side - 2 * b->reach), y = below(b, side - 2 * b->reach), width = 2 * b->reach + 1;
        supply[(y + b->reach) * side + x + b->reach]++;
        supply[(y + below(b, width)) * side + x + below(b, width)]--;
    }
    p.tail = tail, p.head = head, p.capacity = capacity, p.cost = cost, p.supply = supply;
    return p;
}

static void report(const char *name, double begin, qw_flow_result r, bool proved)
{
    printf("%-18s %7.3f s  met %lld of %lld  cost %lld  augmentations %lld  %s\n", name, seconds() - begin,
           (long long)r.met, (long long)r.wanted, (long long)r.cost, (long long)r.augmentations,
           proved ? "proved" : "WRONG");
}

static void body(void *user)
{
    bench *b = user;
    qw_flow_problem p = generate(b);
    int32_t *flow = QW_NEW(b->env, int32_t, p.arc_count);
    int64_t *potential = QW_NEW_ZERO(b->env, int64_t, p.node_count);
    printf("%u nodes, %u arcs\n", p.node_count, p.arc_count);

    memset(flow, 0, p.arc_count * sizeof *flow);
    double begin = seconds();
    qw_flow_result r = qw_flow_min_cost(b->env, &p, INT64_MAX, flow, potential);
    report("min cost", begin, r,
           qw_flow_is_optimal(&p, flow, potential) && qw_flow_is_feasible(b->env, &p, flow, r.met));

    memset(flow, 0, p.arc_count * sizeof *flow);
    begin = seconds();
    r = qw_flow_boykov_kolmogorov(b->env, &p, flow);
    report("boykov kolmogorov", begin, r,
           qw_flow_is_maximum(b->env, &p, flow) && qw_flow_is_feasible(b->env, &p, flow, r.met));

    memset(flow, 0, p.arc_count * sizeof *flow);
    begin = seconds();
    r = qw_flow_edmonds_karp(b->env, &p, flow);
    report("edmonds karp", begin, r,
           qw_flow_is_maximum(b->env, &p, flow) && qw_flow_is_feasible(b->env, &p, flow, r.met));
}

int main(int argc, char **argv)
{
    uint32_t value[] = {1000, 20, 20, 2, 354};
    for (int i = 1; i < argc && i <= 5; i++) value[i - 1] = (uint32_t)atoi(argv[i]);
    bench b = {.pairs = value[0], .reach = value[1], .side = value[4], .random = 1};
    b.largest_cost = (int32_t)value[2];
    b.capacity = (int32_t)value[3];
    b.env = qw_env_create(NULL, 1);
    qw_status status = b.env ? qw_protect(b.env, body, &b) : QW_MEMORY;
    if (status != QW_OK) printf("%s\n", qw_status_text(status));
    qw_env_destroy(b.env);
    return status != QW_OK;
}

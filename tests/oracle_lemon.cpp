// Minimum-cost flows against LEMON's network simplex, on networks larger than GLPK likes. Built only where LEMON is found:
//     c++ -std=c++17 -O2 -Iinclude -Isrc tests/oracle_lemon.cpp libquadwright_static.a ... -o oracle_lemon
// Exits with 0 when all costs agree.
#define _Noreturn [[noreturn]]
extern "C" {
#include "solve/flow.h"
}

#include <lemon/network_simplex.h>
#include <lemon/smart_graph.h>

#include <cstdio>
#include <random>
#include <vector>

namespace {

struct Network {
    std::vector<uint32_t> tail, head;
    std::vector<int32_t> capacity, cost, supply;

    void arc(uint32_t v, uint32_t w, int32_t most, int32_t price)
    {
        tail.push_back(v), head.push_back(w), capacity.push_back(most), cost.push_back(price);
    }

    qw_flow_problem problem() const
    {
        return {uint32_t(supply.size()), uint32_t(tail.size()), tail.data(), head.data(), capacity.data(), cost.data(), supply.data()};
    }
};

// A square grid with arcs both ways, each with a dearer second unit, and pairs of a supply and a demand near each other.
Network grid(uint32_t side, uint32_t pairs, uint32_t dearest, uint32_t seed)
{
    std::mt19937 random(seed);
    auto below = [&](uint32_t bound) { return uint32_t(random() % bound); };
    Network net;
    net.supply.resize(size_t(side) * side);
    for (uint32_t v = 0; v < side * side; v++)
        for (uint32_t step : {1u, side}) {
            if (step == 1 ? v % side + 1 == side : v + side >= side * side) continue;
            for (int way = 0; way < 2; way++) {
                int32_t price = int32_t(below(dearest + 1));
                for (int32_t unit = 0; unit < 2; unit++)
                    net.arc(way ? v + step : v, way ? v : v + step, 1 + int32_t(below(3)), price + 2 * unit);
            }
        }
    for (uint32_t i = 0; i < pairs; i++) {
        uint32_t x = below(side - 10), y = below(side - 10);
        net.supply[(y + 5) * side + x + 5]++;
        net.supply[(y + below(11)) * side + x + below(11)]--;
    }
    return net;
}

bool lemon_cost(const Network &net, long long *cost)
{
    lemon::SmartDigraph graph;
    std::vector<lemon::SmartDigraph::Node> nodes;
    for (size_t v = 0; v < net.supply.size(); v++) nodes.push_back(graph.addNode());
    lemon::SmartDigraph::NodeMap<int> supply(graph);
    lemon::SmartDigraph::ArcMap<int> capacity(graph), price(graph);
    for (size_t v = 0; v < nodes.size(); v++) supply[nodes[v]] = net.supply[v];
    for (size_t a = 0; a < net.tail.size(); a++) {
        auto arc = graph.addArc(nodes[net.tail[a]], nodes[net.head[a]]);
        capacity[arc] = net.capacity[a];
        price[arc] = net.cost[a];
    }
    lemon::NetworkSimplex<lemon::SmartDigraph, int, long long> simplex(graph);
    simplex.upperMap(capacity).costMap(price).supplyMap(supply);
    bool met = simplex.run() == simplex.OPTIMAL;
    *cost = met ? simplex.totalCost() : -1;
    return met;
}

struct Case {
    qw_env *env;
    int wrong;
};

void body(void *user)
{
    Case *c = static_cast<Case *>(user);
    for (uint32_t seed = 1; seed <= 24; seed++) {
        Network net = grid(20 + 8 * seed, 20 * seed, seed % 4 * 5, seed);
        qw_flow_problem problem = net.problem();
        std::vector<int32_t> flow(net.tail.size());
        std::vector<int64_t> potential(net.supply.size());
        qw_flow_result r = qw_flow_min_cost(c->env, &problem, INT64_MAX, flow.data(), potential.data());
        long long cost;
        bool met = lemon_cost(net, &cost);
        bool same = met ? r.met == r.wanted && r.cost == cost : r.met < r.wanted;
        if (!same || !qw_flow_is_optimal(&problem, flow.data(), potential.data())) {
            std::printf("seed %u: %lld of %lld at cost %lld, LEMON %lld\n", seed, (long long)r.met, (long long)r.wanted,
                        (long long)r.cost, cost);
            c->wrong++;
        }
    }
}

} // namespace

int main()
{
    Case c = {qw_env_create(nullptr, 1), 0};
    qw_status status = qw_protect(c.env, body, &c);
    qw_env_destroy(c.env);
    return status != QW_OK || c.wrong;
}

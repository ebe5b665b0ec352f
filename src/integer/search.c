#include "integer/search.h"

#include "integer/search_count.h"
#include "integer/search_curves.h"
#include "integer/search_sizes.h"
#include "integer/touching.h"

#include <assert.h>

static void add_counts(qw_regular_counts *sum, const qw_regular_counts *c)
{
    sum->nodes += c->nodes, sum->arcs += c->arcs, sum->network_components += c->network_components;
    sum->free_variables += c->free_variables, sum->fixed_variables += c->fixed_variables, sum->released += c->released;
    sum->half_variables += c->half_variables, sum->odd_cycles += c->odd_cycles,
        sum->capacity_rounds += c->capacity_rounds;
    sum->cost += c->cost, sum->irregular_before += c->irregular_before, sum->irregular_after += c->irregular_after;
    if (c->levels > sum->levels) sum->levels = c->levels;
}

/* Adds what was kept of each component to the result, and writes its integers to d, by the edges of the whole. */
static void gather(qw_env *env, const qw_search *s, qw_search_result *result, qw_int2 *d)
{
    for (uint32_t p = 0; p < s->components->count; p++) {
        const qw_component *component = &s->components->component[p];
        const qw_trial *kept = &s->kept[p];
        for (uint32_t e = 0; e < component->decimated.complex.edge_count; e++) d[component->edge[e]] = kept->d[e];
        result->scale[p] = kept->scale;
        result->touching += qw_count_touching(env, component, kept->d);
        add_counts(&result->regular, &kept->counts);
    }
    result->area = s->sum.area;
    result->rounding_cost = s->edges ? s->sum.cost / s->edges : 0;
    result->inverted = (uint32_t)s->sum.inverted, result->collapsed = (uint32_t)s->sum.collapsed;
}

qw_search_result qw_search_integers(qw_env *env, const qw_components *components, const qw_search_wish *wish,
                                    qw_int2 *d)
{
    assert(wish->quads > 0 && wish->size > 0 && wish->cut && d);
    qw_search_result result = {.scale = QW_NEW(env, double, components->count)};
    qw_scope_begin(env);
    qw_search s = qw_search_begin(env, components, wish);
    qw_search_sizes(env, &s);
    qw_search_other_sizes(env, &s);
    qw_search_moves(env, &s);
    result.tries = qw_search_noise(env, &s);
    qw_search_part_curves(env, &s);
    result.meetings = qw_search_meet(env, &s);
    gather(env, &s, &result, d);
    qw_scope_end(env);
    return result;
}

#include "remesh/quantise/search.h"

#include "base/mechanisms.h"
#include "base/promise.h"
#include "remesh/quantise/search_count.h"
#include "remesh/quantise/search_curves.h"
#include "remesh/quantise/search_sizes.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>

/* MOST_APART: larger complexes, in edges, skip the second search, which keeps curves apart. */
enum { MOST_APART = 4000 };
/* APART_SHARE: the second search is accepted if at most this share of the contacts remains. MOST_TOUCHING: where the
   complex has more triangles than quads are wanted, it is skipped above this many contacts a quad, as each takes a row
   of quads, and it would find nothing in ten times the time. */
static const double APART_SHARE = 0.25, MOST_TOUCHING = 0.25;

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

/* Integers without regard to lines: what sizes, the nearest ones, noise and, where the request says so, parting of
 * curves find. */
static qw_search find_without_lines(qw_env *env, qw_components *components, const qw_search_request *request,
                                    uint32_t *tries)
{
    qw_search s = qw_search_begin(env, components, request);
    qw_search_sizes(env, &s);
    qw_search_other_sizes(env, &s);
    qw_search_nearest(env, &s);
    *tries += qw_search_noise(env, &s);
    qw_search_part_curves(env, &s);
    return s;
}

static uint32_t count_touching(qw_env *env, const qw_search *s)
{
    uint32_t sum = 0;
    for (uint32_t p = 0; p < s->components->count; p++)
        sum += qw_count_touching(env, &s->components->component[p], s->kept[p].d);
    return sum;
}

/* Searches once more where curves touch, now with the signs that keep them apart. That is taken where most of it is
   mended for no more other faults: more curves than there are rows of quads for cannot be kept apart. */
static void keep_apart(qw_env *env, qw_components *components, qw_search *s, uint32_t *tries)
{
    double quads = s->request.quads;
    uint32_t touching = s->edges > MOST_APART ? 0 : count_touching(env, s);
    if (touching == 0 || !qw_uses(env, QW_MECH_SIGNS) || (s->request.effort < 1 && touching > MOST_TOUCHING * quads))
        return;
    for (uint32_t p = 0; p < components->count; p++) qw_set_signs(env, &components->component[p]);
    qw_search_request request = s->request;
    request.apart = true;
    qw_acted(env, QW_MECH_SIGNS, 1);
    qw_search other = find_without_lines(env, components, &request, tries);
    uint32_t left = count_touching(env, &other);
    double off = fabs(s->sum.area - quads), now = fabs(other.sum.area - quads),
           bound = quads * QW_COUNT_MARGIN * qw_count_tolerance(quads, request.times);
    qw_log(env, QW_LOG_DEBUG,
           "curves touch %u times, %u with signs; %u and %u inverted, %u and %u vanish; %.0f and %.0f of %.0f quads",
           touching, left, (unsigned)s->sum.inverted, (unsigned)other.sum.inverted, (unsigned)s->sum.collapsed,
           (unsigned)other.sum.collapsed, s->sum.area, other.sum.area, quads);
    if (left <= APART_SHARE * touching && other.sum.inverted <= s->sum.inverted &&
        other.sum.collapsed <= s->sum.collapsed && now <= fmax(off, bound))
        *s = other, qw_kept(env, QW_MECH_SIGNS, 1);
    else
        for (uint32_t p = 0; p < components->count; p++) components->component[p].decimated.complex.at_least = NULL;
}

qw_search_result qw_search_integers(qw_env *env, qw_components *components, const qw_search_request *request,
                                    qw_int2 *d)
{
    assert(request->quads > 0 && request->size > 0 && request->cut && d);
    qw_search_result result = {.scale = QW_NEW(env, double, components->count)};
    qw_scope_begin(env);
    qw_search_request plain = *request;
    plain.apart = false;
    qw_search s = find_without_lines(env, components, &plain, &result.tries);
    if (request->apart) keep_apart(env, components, &s, &result.tries);
    if (qw_uses(env, QW_MECH_EVEN_CURVES)) qw_search_make_even(env, &s);
    if (qw_uses(env, QW_MECH_MEETINGS)) result.meetings = qw_search_meet(env, &s);
    qw_acted(env, QW_MECH_MEETINGS, result.meetings.tried), qw_kept(env, QW_MECH_MEETINGS, result.meetings.kept);
    gather(env, &s, &result, d);
    qw_scope_end(env);
    return result;
}

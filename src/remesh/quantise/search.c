#include "remesh/quantise/search.h"

#include "base/mechanisms.h"
#include "base/promise.h"
#include "remesh/meetings/tries.h"
#include "remesh/quantise/closed_curves.h"
#include "remesh/quantise/closed_moves.h"
#include "remesh/quantise/search_count.h"
#include "remesh/quantise/search_curves.h"
#include "remesh/quantise/search_sizes.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* MOST_APART: larger complexes, in edges, skip the second search, which keeps curves apart. */
enum { MOST_APART = 4000 };
/* What rounding with fewer quads may cost more than with all, as a share of the quads. */
static const double MOST_ROUNDING = 0.03;
/* Quads that lines must be shorter by for a unit of energy: more than in a meeting, as energy counts quads, and where
   they are large there are few. */
static const double ENERGY_WORTH = 2;
/* Strips are counted so often with fewer quads, where that is quickly done, to all quads once: it is not done again
   with all. */
static const double COARSE_STRIPS = 2;
/* APART_SHARE: the second search is accepted if at most this share of the contacts remains. MOST_TOUCHING: where the
   complex has more triangles than quads are wanted, it is skipped above this many contacts a quad, as each takes a row
   of quads, and it would find nothing in ten times the time. */
static const double APART_SHARE = 0.25, MOST_TOUCHING = 0.25;

static void add_counts(qw_regular_counts *sum, const qw_regular_counts *c)
{
    sum->nodes += c->nodes, sum->arcs += c->arcs, sum->network_components += c->network_components;
    sum->free_variables += c->free_variables, sum->fixed_variables += c->fixed_variables;
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
    qw_search_nearest(env, &s);
    qw_search_noise(env, &s);
    *tries += (uint32_t)s.tries;
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

/* By how much the integers of fewer quads may be multiplied: rounding is off by up to half a quad in two components of
   an edge, which costs a sixth in the mean. */
static uint32_t coarse_factor(qw_env *env, const qw_search *s)
{
    if (!(s->request.loops > 0) || !qw_uses(env, QW_MECH_COARSE_FIRST)) return 1;
    return (uint32_t)sqrt(6 * MOST_ROUNDING * s->request.quads / fmax(s->edges, 1));
}

/* The trials of another search, `factor` as many quads each way. Returns their sums. */
static qw_search_total multiply(qw_env *env, const qw_search *coarse, uint32_t factor, const qw_search *s, qw_trial *to)
{
    qw_search_total sum = {0};
    for (uint32_t p = 0; p < s->components->count; p++) {
        qw_trial *t = &to[p];
        *t = qw_search_copy_kept(env, coarse, p);
        t->scale *= factor;
        for (uint32_t e = 0; e < qw_search_complex(s, p)->edge_count; e++)
            t->d[e].x *= (int32_t)factor, t->d[e].y *= (int32_t)factor;
        qw_search_judge(s, t);
        t->touching = qw_count_touching(env, &s->components->component[p], t->d);
        sum = qw_search_with(sum, t);
    }
    return sum;
}

/* Integers with fewer quads, without the signs that keep curves apart. */
static qw_search find_coarse(qw_env *env, qw_components *components, const qw_search *s, uint32_t factor,
                             uint32_t *tries)
{
    qw_search_request request = s->request;
    request.quads /= factor * factor, request.size /= factor, request.apart = false;
    int8_t **signs = QW_NEW(env, int8_t *, components->count);
    for (uint32_t p = 0; p < components->count; p++) {
        int8_t **at_least = &components->component[p].decimated.complex.at_least;
        signs[p] = *at_least, *at_least = NULL;
    }
    qw_search coarse = find_without_lines(env, components, &request, tries);
    for (uint32_t p = 0; p < components->count; p++) components->component[p].decimated.complex.at_least = signs[p];
    return coarse;
}

static int64_t length_of(const qw_closed_curves *curves, uint32_t i, const qw_int2 *d)
{
    int64_t length = 0;
    for (uint32_t k = curves->begin[i]; k < curves->begin[i + 1]; k++)
        length += abs(d[curves->edge[k]].x) + abs(d[curves->edge[k]].y);
    return length;
}

/* Whether the rims that search s keeps open are not shorter in the other. */
static bool keeps_holes(qw_env *env, const qw_search *s, const qw_search *other)
{
    bool all = true;
    for (uint32_t p = 0; p < s->components->count; p++) {
        qw_closed_curves curves = qw_find_closed_curves(env, &s->components->component[p]);
        for (uint32_t i = 0; i < curves.count; i++) {
            int64_t had = length_of(&curves, i, s->kept[p].d), has = length_of(&curves, i, other->kept[p].d);
            all &= has >= had || has >= QW_HOLE_EDGES;
        }
    }
    return all;
}

/* Makes lines meet with fewer quads, and multiplies the integers: each strip becomes as many side by side, and lines
   that meet still do. `other` becomes the search with these integers; false where they have a fault that there is not
   without. */
static bool meet_coarse(qw_env *env, qw_components *components, const qw_search *s, uint32_t factor, qw_search *other,
                        qw_search_result *result)
{
    assert(factor > 1);
    qw_search coarse = find_coarse(env, components, s, factor, &result->tries);
    if (factor % 2 == 1 && qw_uses(env, QW_MECH_EVEN_CURVES)) qw_search_make_even(env, &coarse);
    *other = *s, other->kept = QW_NEW(env, qw_trial, components->count);
    qw_search_total sum = multiply(env, &coarse, factor, s, other->kept);
    bool is_sound = sum.open <= s->sum.open && sum.inverted <= s->sum.inverted && sum.collapsed <= s->sum.collapsed &&
                    sum.touching <= count_touching(env, s) && keeps_holes(env, s, other) &&
                    sum.cost <= s->sum.cost + MOST_ROUNDING * s->request.quads &&
                    qw_search_miss(s, &sum) <= qw_search_miss(s, &s->sum);
    qw_log(env, QW_LOG_DEBUG,
           "%.0f quads, %u times each way: %.0f, %u touch, %u inverted, %u vanish; cost %.0f for %.0f%s",
           coarse.sum.area, factor, sum.area, (unsigned)sum.touching, (unsigned)sum.inverted, (unsigned)sum.collapsed,
           sum.cost, s->sum.cost, is_sound ? "" : ": left");
    if (!is_sound) return false;
    qw_meeting_counts meetings = qw_search_meet(env, &coarse, 1, COARSE_STRIPS);
    other->sum = multiply(env, &coarse, factor, s, other->kept);
    result->meetings = qw_search_meet(env, other, 0, 0);
    result->meetings.tried += meetings.tried, result->meetings.kept += meetings.kept;
    result->meetings.length_before = meetings.length_before * factor;
    return qw_search_miss(s, &other->sum) <= qw_search_miss(s, &s->sum);
}

/* What lines, strips that cross themselves and distortion cost together, in quads. */
static double score_lines(qw_env *env, const qw_search *s, const qw_meeting_counts *m)
{
    double energy = 0, crossing = 0;
    qw_strip_room room;
    for (uint32_t p = 0; p < s->components->count; p++) {
        qw_complex c = *qw_search_complex(s, p);
        c.d = s->kept[p].d, c.real = QW_NEW(env, qw_real2, c.edge_count);
        qw_trial_aim(qw_search_complex(s, p), &s->kept[p], c.real);
        energy += qw_complex_energy(&c);
        room = (qw_strip_room){0};
        crossing += qw_count_strips(env, &c, &room).crossing_area;
    }
    return (double)m->length_after + crossing + ENERGY_WORTH * energy;
}

/* With as few quads first as serve, else with all. Where there are few cones lines meet with all as well, and the
   better is taken: they often meet there too. */
static void make_lines_meet(qw_env *env, qw_components *components, qw_search *s, qw_search_result *result)
{
    qw_search other;
    bool is_found = false;
    for (uint32_t factor = coarse_factor(env, s); factor > 1 && !is_found; factor = factor > 2 ? 2 : 1) {
        is_found = meet_coarse(env, components, s, factor, &other, result);
        qw_acted(env, QW_MECH_COARSE_FIRST, 1);
    }
    bool is_taken = is_found && s->most_edges > QW_MOST_MOVED_EDGES;
    if (!is_taken) {
        qw_meeting_counts meetings = qw_search_meet(env, s, 1, 1);
        is_taken = is_found && score_lines(env, &other, &result->meetings) < score_lines(env, s, &meetings);
        if (!is_taken) result->meetings = meetings;
    }
    if (is_taken) *s = other, qw_kept(env, QW_MECH_COARSE_FIRST, 1);
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
    if (qw_uses(env, QW_MECH_MEETINGS)) make_lines_meet(env, components, &s, &result);
    qw_acted(env, QW_MECH_MEETINGS, result.meetings.tried), qw_kept(env, QW_MECH_MEETINGS, result.meetings.kept);
    gather(env, &s, &result, d);
    qw_scope_end(env);
    return result;
}

#include "remesh/quantise/closed_curves.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "base/sets.h"
#include "remesh/quantise/circuits.h"
#include "remesh/quantise/nudge.h"
#include "remesh/quantise/touching.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Of each vertex: the root of its chain of held edges, and, at the root, whether it is open: it ends or meets another
   curve. */
typedef struct chains {
    uint32_t *root;
    uint8_t *is_open;
} chains;

/* The chains of curve edges of a component: the root of each vertex's, and whether it has ends. */
static chains find_chains(qw_env *env, const qw_component *component)
{
    const qw_complex *c = &component->decimated.complex;
    const uint32_t *corner = component->decimated.corner;
    uint32_t n = component->vertex_count, *degree = QW_NEW_ZERO(env, uint32_t, n);
    chains k = {QW_NEW(env, uint32_t, n), QW_NEW_ZERO(env, uint8_t, n)};
    qw_sets_begin(k.root, n);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (!c->fixed[e]) continue;
        uint32_t h = c->side[2 * e], a = corner[h], b = corner[qw_next(h)];
        degree[a]++, degree[b]++;
        qw_join_sets(k.root, a, b);
    }
    for (uint32_t v = 0; v < n; v++) {
        k.root[v] = qw_set_of(k.root, v);
        if (degree[v] != 2) k.is_open[k.root[v]] = 1;
    }
    qw_free(env, degree);
    return k;
}

qw_closed_curves qw_find_closed_curves(qw_env *env, const qw_component *component)
{
    const qw_complex *c = &component->decimated.complex;
    uint32_t n = component->vertex_count, used = 0;
    qw_closed_curves r = {.begin = QW_NEW_ZERO(env, uint32_t, n + 1), .edge = QW_NEW(env, uint32_t, c->edge_count)};
    qw_scope_begin(env);
    chains k = find_chains(env, component);
    uint32_t *number = QW_NEW(env, uint32_t, n), *at = QW_NEW_ZERO(env, uint32_t, n);
    memset(number, 0xff, n * sizeof *number);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t root = k.root[component->decimated.corner[c->side[2 * e]]];
        if (!c->fixed[e] || k.is_open[root]) continue;
        if (number[root] == QW_NONE) number[root] = r.count++;
        at[number[root]]++;
    }
    for (uint32_t i = 0; i < r.count; i++) r.begin[i] = used, used += at[i], at[i] = r.begin[i];
    r.begin[r.count] = used;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t root = k.root[component->decimated.corner[c->side[2 * e]]];
        if (c->fixed[e] && !k.is_open[root]) r.edge[at[number[root]]++] = e;
    }
    qw_scope_end(env);
    return r;
}

static bool is_odd(const qw_closed_curves *curves, uint32_t i, const qw_int2 *d)
{
    int32_t sum = 0;
    for (uint32_t k = curves->begin[i]; k < curves->begin[i + 1]; k++)
        sum += d[curves->edge[k]].x + d[curves->edge[k]].y;
    return sum % 2 != 0;
}

uint32_t qw_count_odd_curves(const qw_closed_curves *curves, const qw_int2 *d)
{
    uint32_t sum = 0;
    for (uint32_t i = 0; i < curves->count; i++) sum += is_odd(curves, i, d);
    return sum;
}

/* ---- made even */

typedef struct evening {
    const qw_component *component;
    qw_closed_curves curves;
    double least_area, most_area;
    uint32_t odd, inverted, touching;
    uint8_t *fixed; /* uint8_t[edges], the complex's own */
    qw_int2 *had, *best;
    double best_cost;
} evening;

/* No walk may go through the curve from then on. */
static void hold(const evening *e, qw_complex *c, uint32_t curve)
{
    for (uint32_t k = e->curves.begin[curve]; k < e->curves.begin[curve + 1]; k++)
        c->fixed[e->curves.edge[k]] = QW_FIXED_X | QW_FIXED_Y;
}

static void hold_all(const evening *e, qw_complex *c, bool odd_ones_too)
{
    for (uint32_t i = 0; i < e->curves.count; i++)
        if (odd_ones_too || !is_odd(&e->curves, i, e->had)) hold(e, c, i);
}

static double area_off(const evening *e, const qw_complex *c)
{
    double area = qw_complex_area(c);
    return fmax(fmax(e->least_area - area, area - e->most_area), 0);
}

/* Whether an edge that had a length has none: two irregular vertices would become one. */
static bool loses_edge(const evening *e, const qw_complex *c)
{
    for (uint32_t i = 0; i < c->edge_count; i++)
        if (qw_int2_is_zero(c->d[i]) && !qw_int2_is_zero(e->had[i])) return true;
    return false;
}

static bool is_fine(qw_env *env, const evening *e, const qw_complex *c)
{
    return qw_count_odd_curves(&e->curves, c->d) < e->odd && qw_complex_inverted(c) <= e->inverted &&
           !loses_edge(e, c) && qw_count_touching(env, e->component, c->d) <= e->touching;
}

/* Tries one step of an edge of a curve whose others are held, with the even curves held too and, where that does not
   help, without; keeps the offsets if they are the cheapest so far, and restores c->d. A quad that the count is off by
   costs 1. */
static void try_step(qw_env *env, evening *e, qw_complex *c, uint32_t curve, uint32_t v, int32_t by)
{
    size_t bytes = c->edge_count * sizeof *c->d;
    bool is_done = false;
    for (int held = 1; held >= 0 && !is_done; held--) {
        hold(e, c, curve);
        if (held) hold_all(e, c, false);
        c->fixed[v / 2] = e->fixed[v / 2];
        bool closed = qw_step_offsets(env, c, v, by, QW_LONGEST_WALK, QW_MOST_WALK_COST);
        memcpy(c->fixed, e->fixed, c->edge_count);
        is_done = closed && is_fine(env, e, c);
        double cost = is_done ? qw_complex_cost(c) + area_off(e, c) : INFINITY;
        if (cost < e->best_cost) e->best_cost = cost, memcpy(e->best, c->d, bytes);
        memcpy(c->d, e->had, bytes);
    }
}

/* Takes the best step of any odd curve; false where there is none. */
static bool take_step(qw_env *env, evening *e, qw_complex *c, double *work)
{
    e->best_cost = INFINITY;
    memcpy(e->had, c->d, c->edge_count * sizeof *c->d);
    for (uint32_t i = 0; i < e->curves.count; i++)
        for (uint32_t k = e->curves.begin[i]; is_odd(&e->curves, i, e->had) && k < e->curves.begin[i + 1]; k++) {
            uint32_t edge = e->curves.edge[k], v = 2 * edge + (e->fixed[edge] == QW_FIXED_X);
            if (*work <= 0 || e->fixed[edge] == (QW_FIXED_X | QW_FIXED_Y)) continue;
            *work -= 4 * c->face_count;
            qw_heartbeat(env);
            try_step(env, e, c, i, v, 1), try_step(env, e, c, i, v, -1);
        }
    if (e->best_cost == INFINITY) return false;
    memcpy(c->d, e->best, c->edge_count * sizeof *c->d);
    e->odd = qw_count_odd_curves(&e->curves, c->d);
    return true;
}

/* Where the area is beyond the bounds, brings it back by other curves. */
static bool settle_area(qw_env *env, evening *e, qw_complex *c, double *work)
{
    if (area_off(e, c) <= 0) return true;
    hold_all(e, c, true);
    bool is_within = qw_nudge_area(env, c, e->least_area, e->most_area, work);
    memcpy(c->fixed, e->fixed, c->edge_count);
    return is_within && qw_count_touching(env, e->component, c->d) <= e->touching;
}

uint32_t qw_make_curves_even(qw_env *env, const qw_component *component, qw_complex *c, double least_area,
                             double most_area, double *work)
{
    assert(c->d && c->fixed && least_area <= most_area && work);
    qw_scope_begin(env);
    size_t bytes = c->edge_count * sizeof *c->d;
    evening e = {.component = component,
                 .curves = qw_find_closed_curves(env, component),
                 .least_area = least_area,
                 .most_area = most_area};
    e.odd = qw_count_odd_curves(&e.curves, c->d), e.inverted = qw_complex_inverted(c);
    e.touching = e.odd ? qw_count_touching(env, component, c->d) : 0;
    e.had = QW_NEW(env, qw_int2, c->edge_count), e.best = QW_NEW(env, qw_int2, c->edge_count);
    e.fixed = c->fixed, c->fixed = memcpy(QW_NEW(env, uint8_t, c->edge_count), e.fixed, c->edge_count);
    qw_int2 *within = memcpy(QW_NEW(env, qw_int2, c->edge_count), c->d, bytes);
    uint32_t odd = e.odd;
    while (e.odd > 0 && *work > 0 && take_step(env, &e, c, work))
        if (area_off(&e, c) <= 0) memcpy(within, c->d, bytes);
    if (!settle_area(env, &e, c, work)) memcpy(c->d, within, bytes);
    e.odd = qw_count_odd_curves(&e.curves, c->d);
    qw_did(env, QW_MECH_EVEN_CURVES, odd - e.odd);
    c->fixed = e.fixed;
    qw_scope_end(env);
    return e.odd;
}

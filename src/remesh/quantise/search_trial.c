#include "remesh/quantise/search_trial.h"

#include "base/lanes.h"
#include "remesh/quantise/bidirected.h"
#include "remesh/quantise/circuits.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Flows that a trial may take until its integers are closed, each from where the last has ended; capacities of the last
   of them open until they are. */
enum { BIDIRECTED_ROUNDS = 4 };
/* Steps that a circuit may have which improves known integers. */
enum { LONGEST_CIRCUIT = 48 };
/* Bytes of a lane: ARENA_LEAST and so many an edge. Measured on seven decimated complexes of 45 to 8,187 edges: 600 to
   730 an edge and 15 thousand. Where that is more than ARENA_FEW there are no more lanes than threads, and none where
   it is more than ARENA_MOST. */
enum { ARENA_LEAST = 1 << 16, ARENA_AN_EDGE = 800, ARENA_FEW = 1 << 23, ARENA_MOST = 1 << 27 };
/* A trial of more edges takes milliseconds: the lanes then stop after a trial each, so that the host can cancel. */
enum { LONG_TRIAL = 1000 };

/* A number from -1 to 1 that depends on nothing but i (a step of a linear congruence, mixed). */
static float scattered(uint64_t i)
{
    i = (i + 1) * 0x9e3779b97f4a7c15u;
    i ^= i >> 29;
    i *= 0xbf58476d1ce4e5b9u;
    return (float)(i >> 40) / (float)(1 << 23) - 1.0f;
}

static float aimed_at(float real, const qw_trial *t)
{
    double x = (double)real * t->scale;
    return (float)(fabs(x) > t->beyond ? x * t->stretch : x);
}

void qw_trial_aim(const qw_complex *real, const qw_trial *t, qw_real2 *to)
{
    for (uint32_t e = 0; e < real->edge_count; e++)
        to[e] = (qw_real2){aimed_at(real->real[e].x, t), aimed_at(real->real[e].y, t)};
}

/* Moves the rounded offset of edge e to where its bounds allow it (qw_complex.at_least). */
static void keep_sign(qw_complex *c, uint32_t e)
{
    if (!c->at_least) return;
    c->d[e].x += c->at_least[2 * e] * qw_complex_short(c, 2 * e, c->d[e].x);
    c->d[e].y += c->at_least[2 * e + 1] * qw_complex_short(c, 2 * e + 1, c->d[e].y);
}

/* Rounds the real offsets, with noise if the trial has any, and closes them by flows of single steps. potential: as of
   qw_solve_bidirected. */
static void choose_integers(qw_env *env, const qw_complex *real, qw_trial *t, qw_complex *c, int64_t *potential)
{
    assert(real->edge_count == c->edge_count);
    qw_trial_aim(real, t, c->real);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        c->fixed[e] = real->fixed[e];
        if (!(c->fixed[e] & QW_FIXED_X)) c->real[e].x += t->noise * scattered(t->seed + 2 * (uint64_t)e);
        if (!(c->fixed[e] & QW_FIXED_Y)) c->real[e].y += t->noise * scattered(t->seed + 2 * (uint64_t)e + 1);
        c->d[e] = (qw_int2){(int32_t)qw_round_even(c->real[e].x), (int32_t)qw_round_even(c->real[e].y)};
        keep_sign(c, e);
    }
    for (int i = 0; i < BIDIRECTED_ROUNDS && !qw_complex_is_closed(c); i++) {
        bool is_last = i + 1 == BIDIRECTED_ROUNDS;
        qw_solve_complex(env, c, t->network, QW_FLOW_MCF, QW_COST_SQUARE, is_last, i == 0 ? potential : NULL,
                         &t->counts);
    }
    if (t->noise > 0) qw_trial_aim(real, t, c->real);
}

/* The trials of one lane. */
typedef struct series {
    const qw_lane *lane;
    qw_complex room; /* for the component with most edges */
    const qw_components *components;
    qw_trial **trial;
    uint32_t begin, end;
} series;

static qw_complex complex_room(qw_env *env, uint32_t edges)
{
    return (qw_complex){
        .d = QW_NEW(env, qw_int2, edges), .real = QW_NEW(env, qw_real2, edges), .fixed = QW_NEW(env, uint8_t, edges)};
}

/* Chooses the integers of one trial, or improves those that it has. room: of the largest component. */
static void make_trial(qw_env *env, const qw_components *components, const qw_complex *room, qw_trial *t)
{
    assert(t->component < components->count && t->d);
    qw_scope_begin(env);
    const qw_complex *real = &components->component[t->component].decimated.complex;
    qw_complex c = *real;
    c.d = room->d, c.real = room->real, c.fixed = room->fixed;
    if (t->known) {
        memcpy(c.d, t->d, c.edge_count * sizeof *c.d);
        memcpy(c.fixed, real->fixed, c.edge_count);
        qw_trial_aim(real, t, c.real);
        qw_improve_offsets(env, &c, LONGEST_CIRCUIT);
    } else {
        t->counts = (qw_regular_counts){0};
        size_t n = QW_POTENTIALS(real->face_count);
        int64_t *potential = memcpy(QW_NEW(env, int64_t, n), t->potential, n * sizeof *potential);
        choose_integers(env, real, t, &c, potential);
        /* Not before: a trial whose lane runs out of memory is made again from the potentials that it began with. */
        if (t->first) memcpy(t->potential, potential, n * sizeof *potential);
    }
    qw_scope_end(env);
    memcpy(t->d, c.d, c.edge_count * sizeof *t->d);
    t->done = true;
}

static void make_trials(void *user)
{
    series *l = user;
    for (uint32_t i = l->begin; i < l->end; i++) make_trial(l->lane->env, l->components, &l->room, l->trial[i]);
}

static void run_series(void *user, uint32_t begin, uint32_t end)
{
    series *all = user;
    for (uint32_t i = begin; i < end; i++)
        if (all[i].lane->env) (void)qw_protect(all[i].lane->env, make_trials, &all[i]); /* what failed is not `done` */
}

static uint32_t lanes_for(const qw_env *env, size_t bytes, uint32_t trials)
{
    uint32_t threads = qw_env_threads(env), most = trials < QW_MOST_LANES ? trials : QW_MOST_LANES;
    if (bytes <= ARENA_FEW) return QW_MOST_LANES;
    if (bytes > ARENA_MOST || threads == 1 || trials == 1) return 0;
    return threads < most ? threads : most;
}

void qw_run_trials(qw_env *env, const qw_components *components, uint32_t most_edges, qw_trial **trials, uint32_t count)
{
    assert(trials || count == 0);
    qw_scope_begin(env);
    size_t bytes = ARENA_LEAST + (size_t)most_edges * ARENA_AN_EDGE;
    uint32_t lane_count = lanes_for(env, bytes, count);
    qw_lane *lanes = qw_lanes_begin(env, lane_count, bytes);
    series *all = QW_NEW(env, series, QW_MOST_LANES);
    for (uint32_t i = 0; i < lane_count; i++)
        all[i] = (series){&lanes[i], complex_room(env, most_edges), components, trials, 0, 0};
    uint32_t step = most_edges > LONG_TRIAL ? lane_count : count;
    for (uint32_t from = 0, to; from < count && lane_count > 0; from = to) {
        to = count - from > step ? from + step : count;
        for (uint32_t i = 0; i < lane_count; i++)
            all[i].begin = from + (to - from) * i / lane_count, all[i].end = from + (to - from) * (i + 1) / lane_count;
        qw_parallel(env, lane_count, 1, run_series, all);
    }
    qw_lanes_end(lanes, lane_count);
    qw_complex own = complex_room(env, most_edges);
    for (uint32_t i = 0; i < count; i++)
        if (!trials[i]->done) make_trial(env, components, &own, trials[i]);
    qw_scope_end(env);
}

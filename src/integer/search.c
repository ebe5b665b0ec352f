#include "integer/search.h"

#include "base/arena.h"
#include "base/promise.h"
#include "integer/bidirected.h"
#include "integer/circuits.h"
#include "integer/collapse.h"
#include "integer/moves.h"
#include "integer/nudge.h"
#include "integer/touching.h"
#include "math/elementary.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sizes are tried up to this share above and below the wanted one, in this many steps; fewer where the complex is
   large. */
static const double SEARCH = 0.03;
enum { MOST_TRIES = 17, EDGES_TRIED = 60000, BIDIRECTED_ROUNDS = 4, NOISY_ROUNDS = 14 };
/* Where no size will do and the complex has few edges, components longer than `beyond` quads are stretched: by what
   the count lacks (along one direction) or by its root (along both), a few steps of STRETCH more or less. */
static const struct {
    double beyond;
    bool root;
} stretches[] = {{4, false}, {8, false}, {12, false}, {8, true}};
static const double STRETCH = 0.007;
enum {
    STRETCHED_EDGES = 128,
    STEPS_A_STRETCH = 8,
    STRETCHES = STEPS_A_STRETCH * (sizeof stretches / sizeof *stretches)
};
/* A count that is off by less than COUNT_FREE counts as exact; one that is off by more than the margin breaks the
   promise. An inverted triangle weighs as much as a percent, as it can only be repaired. */
static const double COUNT_FREE = 0.008;
static const double OPEN_WEIGHT = 1e6, COUNT_WEIGHT = 100, BROKEN_WEIGHT = 1000, INVERTED_WEIGHT = 1,
                    COLLAPSE_WEIGHT = 1, TOUCHING_WEIGHT = 1;
static const float NOISE = 0.4f;
/* Trials run in so many lanes, each with so many bytes: seven decimated complexes of 45 to 8,187 edges took 600 to 730
   an edge and 15 thousand. Where that were more than ARENA_MOST there are no lanes. */
enum { LANES = 4, ARENA_LEAST = 1 << 16, ARENA_AN_EDGE = 800, ARENA_MOST = 1 << 23 };
/* A trial of so many edges takes milliseconds: then the host is heard after each in a lane, not after all. */
enum { LONG_TRIAL = 1000 };
/* Sweeps over the components, in each of which a component takes the size that is best while the others keep theirs. */
enum { SWEEPS = 8 };
/* Steps of each move of a small complex that are tried: as kept, or by one or two either way. */
enum { MOVE_STEPS = 5 };
/* The best sizes are improved by circuits of at most LONGEST_CIRCUIT variables: BEST_SIZES of them, more where the
   complex is small (docs/decisions/closed-offsets.md). */
enum { BEST_SIZES = 3, EDGES_IMPROVED = 6000, LONGEST_CIRCUIT = 48 };

/* ---- one component */

/* A number from -1 to 1 that depends on nothing but i (a step of a linear congruence, mixed). */
static float scattered(uint64_t i)
{
    i = (i + 1) * 0x9e3779b97f4a7c15u;
    i ^= i >> 29;
    i *= 0xbf58476d1ce4e5b9u;
    return (float)(i >> 40) / (float)(1 << 23) - 1.0f;
}

/* One trial: integers of one component for one size. */
typedef struct trial {
    uint32_t component, number;    /* number: of the try */
    double scale, beyond, stretch; /* each component that is longer than `beyond` then is stretched, so that what is
                                      aimed at need not close */
    float noise;                   /* up to so much is added, by the seed */
    uint64_t seed;
    qw_int2 *d;                /* [edges of the component] */
    const qw_network *network; /* of the component */
    int64_t *potential; /* [potentials of the component] of the flow of the first size, with which those of all others
                           begin */
    bool first;
    qw_regular_counts counts;
    bool known; /* d is closed and to be made better */
    bool done;  /* else there was no room in the lane's memory */
    /* judged afterwards */
    double area, cost;                      /* in quads; sum of w (z - x)^2 */
    uint32_t inverted, collapsed, touching; /* touching: counted last, as a rule it is 0 */
    bool open;
} trial;

static float aimed_at(float real, const trial *t)
{
    double x = (double)real * t->scale;
    return (float)(fabs(x) > t->beyond ? x * t->stretch : x);
}

/* The real offsets that trial t aims at. */
static void aim(const qw_complex *real, const trial *t, qw_real2 *to)
{
    for (uint32_t e = 0; e < real->edge_count; e++)
        to[e] = (qw_real2){aimed_at(real->real[e].x, t), aimed_at(real->real[e].y, t)};
}

/* Steps to the side of each component's sign that it is short of. */
static void keep_sign(qw_complex *c, uint32_t e)
{
    if (!c->sign) return;
    c->d[e].x += c->sign[2 * e] * qw_complex_short(c, 2 * e, c->d[e].x);
    c->d[e].y += c->sign[2 * e + 1] * qw_complex_short(c, 2 * e + 1, c->d[e].y);
}

/* Integers near those, by a flow of single steps from the nearest integers, or from the nearest to offsets with
   noise. potential: as of qw_solve_bidirected. */
static void choose_integers(qw_env *env, const qw_complex *real, trial *t, qw_complex *c, int64_t *potential)
{
    assert(real->edge_count == c->edge_count);
    aim(real, t, c->real);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        float nx = t->noise * scattered(t->seed + 2 * (uint64_t)e),
              ny = t->noise * scattered(t->seed + 2 * (uint64_t)e + 1);
        c->fixed[e] = real->fixed[e];
        if (!(c->fixed[e] & QW_FIXED_X)) c->real[e].x += nx;
        if (!(c->fixed[e] & QW_FIXED_Y)) c->real[e].y += ny;
        c->d[e] = (qw_int2){(int32_t)qw_round_even(c->real[e].x), (int32_t)qw_round_even(c->real[e].y)};
        keep_sign(c, e);
    }
    for (int i = 0; i < BIDIRECTED_ROUNDS && !qw_complex_is_closed(c); i++) {
        const qw_network *network = i == 0 ? t->network : NULL; /* valid until curves are freed */
        qw_solve_complex(env, c, network, QW_FLOW_MCF, QW_COST_SQUARE, i + 1 == BIDIRECTED_ROUNDS,
                         i == 0 ? potential : NULL, &t->counts);
    }
    if (t->noise > 0) aim(real, t, c->real);
}

/* ---- trials side by side, in lanes with memory of their own: a worker may not ask the run's environment for any */

typedef struct lane {
    qw_env *run;     /* the whole run's */
    qw_env *env;     /* in an arena; NULL where not even that had room */
    qw_complex room; /* for the component with most edges */
    const qw_components *components;
    trial **trial;
    uint32_t begin, end;
    qw_arena arena;
} lane;

static qw_complex complex_room(qw_env *env, uint32_t edges)
{
    return (qw_complex){
        .d = QW_NEW(env, qw_int2, edges), .real = QW_NEW(env, qw_real2, edges), .fixed = QW_NEW(env, uint8_t, edges)};
}

/* A copy of c's structure whose numbers lie in the arrays of another complex. */
static qw_complex in_room(const qw_complex *c, const qw_complex *room)
{
    qw_complex k = *c;
    k.d = room->d, k.real = room->real, k.fixed = room->fixed;
    return k;
}

static void make_trial(qw_env *env, const qw_components *components, const qw_complex *room, trial *t)
{
    assert(t->component < components->count && t->d);
    qw_scope_begin(env);
    const qw_complex *real = &components->component[t->component].decimated.complex;
    qw_complex c = in_room(real, room);
    if (t->known) {
        memcpy(c.d, t->d, c.edge_count * sizeof *c.d);
        memcpy(c.fixed, real->fixed, c.edge_count);
        aim(real, t, c.real);
        qw_improve_offsets(env, &c, LONGEST_CIRCUIT);
    } else {
        t->counts = (qw_regular_counts){0};
        size_t n = QW_POTENTIALS(real->face_count);
        int64_t *potential = memcpy(QW_NEW(env, int64_t, n), t->potential, n * sizeof *potential);
        choose_integers(env, real, t, &c, potential);
        if (t->first)
            memcpy(t->potential, potential, n * sizeof *potential); /* kept only once a trial is done: one that ran out
                                                                       of memory is repeated, from 0 */
    }
    qw_scope_end(env);
    memcpy(t->d, c.d, c.edge_count * sizeof *t->d);
    t->done = true;
}

static void make_trials(void *user)
{
    lane *l = user;
    for (uint32_t i = l->begin; i < l->end; i++) make_trial(l->env, l->components, &l->room, l->trial[i]);
}

static void run_lane(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    lane *lanes = user;
    for (uint32_t i = begin; i < end; i++)
        if (lanes[i].env)
            (void)qw_protect(lanes[i].env, make_trials, &lanes[i]); /* trials that are not done are repeated */
}

/* Lets the host cancel while trials run; called on the thread that may speak to the host. */
static int hear(void *user, qw_stage stage, double fraction)
{
    (void)stage, (void)fraction;
    return qw_listen(((lane *)user)->run) ? 0 : 1;
}

static void run_trials(qw_env *env, const qw_components *components, uint32_t most_edges, trial **trials,
                       uint32_t count)
{
    assert(trials || count == 0);
    qw_scope_begin(env);
    size_t bytes = ARENA_LEAST + (size_t)most_edges * ARENA_AN_EDGE;
    lane *lanes = QW_NEW_ZERO(env, lane, LANES);
    for (uint32_t i = 0; i < LANES && bytes <= ARENA_MOST; i++) {
        lane *l = &lanes[i];
        l->run = env, l->components = components, l->trial = trials;
        l->room = complex_room(env, most_edges);
        qw_arena_begin(&l->arena, qw_alloc(env, bytes, 1), bytes);
        qw_host host = {.resize = qw_arena_resize, .resize_user = &l->arena, .progress = hear, .progress_user = l};
        l->env = qw_env_create(&host, 1);
    }
    uint32_t step = most_edges > LONG_TRIAL ? LANES : count;
    for (uint32_t from = 0, to; from < count; from = to) {
        to = count - from > step ? from + step : count;
        for (uint32_t i = 0; i < LANES; i++)
            lanes[i].begin = from + (to - from) * i / LANES, lanes[i].end = from + (to - from) * (i + 1) / LANES;
        qw_parallel(env, LANES, 1, run_lane, lanes);
    }
    for (uint32_t i = 0; i < LANES; i++) qw_env_destroy(lanes[i].env);
    qw_complex own = complex_room(env, most_edges);
    for (uint32_t i = 0; i < count; i++)
        if (!trials[i]->done) make_trial(env, components, &own, trials[i]);
    qw_scope_end(env);
}

/* ---- all components */

typedef struct total {
    double area, cost;
    int64_t inverted, collapsed, touching, open;
} total;

typedef struct search {
    const qw_components *components;
    qw_search_wish wish;
    qw_collapse_finder *finder; /* [components] */
    qw_real2 *room;             /* for the component with most edges */
    uint32_t edges, most_edges; /* of all components, of the largest */
    uint32_t *first;            /* [components]: in a row of the edges of all components */
    qw_network *network;        /* [components] */
    int64_t **potential;        /* [components] */
    int tries;                  /* without noise */
    trial *kept;                /* [components] */
    total sum;                  /* of what is kept */
    double score;
    bool *given_up; /* [components] */
} search;

static void begin_search(qw_env *env, search *s, const qw_components *components, const qw_search_wish *wish)
{
    uint32_t n = components->count;
    *s = (search){.components = components, .wish = *wish};
    s->finder = QW_NEW(env, qw_collapse_finder, n), s->first = QW_NEW(env, uint32_t, n),
    s->kept = QW_NEW_ZERO(env, trial, n), s->given_up = QW_NEW_ZERO(env, bool, n);
    s->potential = QW_NEW(env, int64_t *, n), s->network = QW_NEW(env, qw_network, n);
    for (uint32_t p = 0; p < n; p++) {
        const qw_decimated *k = &components->component[p].decimated;
        s->finder[p] = qw_collapse_finder_make(env, k);
        s->first[p] = s->edges, s->edges += k->complex.edge_count;
        if (k->complex.edge_count > s->most_edges) s->most_edges = k->complex.edge_count;
        s->network[p] = qw_network_build(env, &k->complex);
        s->potential[p] = QW_NEW_ZERO(env, int64_t, QW_POTENTIALS(k->complex.face_count));
        s->kept[p].d = QW_NEW_ZERO(env, qw_int2, k->complex.edge_count);
        s->kept[p].scale = wish->size, s->kept[p].beyond = INFINITY, s->kept[p].stretch = 1;
    }
    s->room = QW_NEW(env, qw_real2, s->most_edges);
    s->tries = (int)fmax(3, fmin(MOST_TRIES, EDGES_TRIED / fmax(s->edges, 1)));
}

/* The i-th of all, in the room of t. */
static void prepare(const search *s, trial *t, uint32_t component, int i)
{
    assert(component < s->components->count && s->tries > 0);
    int k = i % s->tries;
    double side = k & 1 ? -1 : 1;
    t->component = component, t->number = (uint32_t)i;
    t->scale = s->wish.size * (1 + side * SEARCH * ((k + 1) / 2) / (s->tries / 2)), t->beyond = INFINITY,
    t->stretch = 1;
    t->noise = NOISE * (float)(i / s->tries);
    t->seed = (uint64_t)i << 32;
    t->network = &s->network[component], t->potential = s->potential[component];
    t->first = i == 0;
    t->known = t->done = false;
}

static void judge(const search *s, trial *t)
{
    const qw_complex *real = &s->components->component[t->component].decimated.complex;
    qw_complex c = *real;
    c.d = t->d, c.real = s->room;
    aim(real, t, c.real);
    t->area = qw_complex_area(&c) + t->scale * t->scale * s->wish.cut[t->component];
    t->cost = qw_complex_cost(&c);
    t->inverted = qw_complex_inverted(&c);
    t->collapsed = qw_find_collapsed(&s->finder[t->component], t->d);
    t->open = !qw_complex_is_closed(&c);
}

static total with(total sum, const trial *t)
{
    return (total){sum.area + t->area,           sum.cost + t->cost,         sum.inverted + t->inverted,
                   sum.collapsed + t->collapsed, sum.touching + t->touching, sum.open + t->open};
}

static total exchanged(total sum, const trial *from, const trial *to)
{
    total rest = {sum.area - from->area,           sum.cost - from->cost,         sum.inverted - from->inverted,
                  sum.collapsed - from->collapsed, sum.touching - from->touching, sum.open - from->open};
    return with(rest, to);
}

static double count_beyond_bound(const search *s, const total *sum)
{
    double bound = QW_COUNT_MARGIN * qw_count_tolerance(s->wish.quads, 1);
    return fmax(fabs(sum->area / s->wish.quads - 1) - bound, 0);
}

static double score_of(const search *s, const total *sum)
{
    double off = fabs(sum->area / s->wish.quads - 1);
    double count = COUNT_WEIGHT * fmax(off - COUNT_FREE, 0) + BROKEN_WEIGHT * count_beyond_bound(s, sum);
    double cost = s->edges ? sum->cost / s->edges : 0;
    return OPEN_WEIGHT * (double)sum->open + count + cost + INVERTED_WEIGHT * (double)sum->inverted +
           COLLAPSE_WEIGHT * (double)sum->collapsed + TOUCHING_WEIGHT * sqrt((double)sum->touching);
}

static void keep(search *s, const trial *t)
{
    assert(t->component < s->components->count);
    trial *to = &s->kept[t->component];
    qw_int2 *d = to->d;
    memcpy(d, t->d, s->components->component[t->component].decimated.complex.edge_count * sizeof *d);
    *to = *t, to->d = d;
}

/* Takes trial t for its component if that makes the total better. */
static bool take_if_better(search *s, const trial *t)
{
    total sum = exchanged(s->sum, &s->kept[t->component], t);
    double score = score_of(s, &sum);
    if (score >= s->score) return false;
    keep(s, t);
    s->sum = sum, s->score = score;
    return true;
}

static bool has_faults(const trial *t) { return t->open || t->inverted > 0 || t->collapsed > 0; }

/* Trials for `r` rows, one of each component in a row. */
static trial *trial_room(qw_env *env, const search *s, int rows)
{
    assert(rows > 0);
    uint32_t n = s->components->count;
    trial *t = QW_NEW_ZERO(env, trial, (size_t)rows * n);
    for (int i = 0; i < rows; i++) {
        qw_int2 *d = QW_NEW(env, qw_int2, s->edges);
        for (uint32_t p = 0; p < n; p++) t[(size_t)i * n + p].d = d + s->first[p];
    }
    return t;
}

/* A row: one trial of each component, all at the same size. */
typedef struct row {
    trial *trial; /* [components] */
    total sum;
    double score;
} row;

static row *make_rows(qw_env *env, trial *trials, uint32_t components, int count)
{
    row *rows = QW_NEW(env, row, count);
    for (int i = 0; i < count; i++) rows[i] = (row){.trial = trials + (size_t)i * components};
    return rows;
}

static void run_rows(qw_env *env, const search *s, row *rows, int count)
{
    uint32_t n = s->components->count;
    trial **list = QW_NEW(env, trial *, (size_t)count * n);
    for (size_t i = 0; i < (size_t)count * n; i++) list[i] = &rows[i / n].trial[i % n];
    run_trials(env, s->components, s->most_edges, list, (uint32_t)count * n);
    for (int i = 0; i < count; i++) {
        row *r = &rows[i];
        r->sum = (total){0};
        for (uint32_t p = 0; p < n; p++) judge(s, &r->trial[p]), r->sum = with(r->sum, &r->trial[p]);
        r->score = score_of(s, &r->sum);
    }
}

/* Sorts by score, the lowest first; stable. */
static void sort_rows(row *rows, int count)
{
    for (int i = 1; i < count; i++) {
        row r = rows[i];
        int at = i;
        for (; at > 0 && rows[at - 1].score > r.score; at--) rows[at] = rows[at - 1];
        rows[at] = r;
    }
}

static int most_improved(const search *s)
{
    return (int)fmax(BEST_SIZES, fmin(s->tries, EDGES_IMPROVED / fmax(s->edges, 1)));
}

/* Repeats the best rows, behind the given ones, with improvement by circuits. Returns how many. */
static int improve_best(qw_env *env, const search *s, row *rows, int count)
{
    int best = 0;
    for (; best < most_improved(s) && rows[best].sum.open == 0; best++)
        for (uint32_t p = 0; p < s->components->count; p++) {
            trial *to = &rows[count + best].trial[p];
            qw_int2 *d = to->d;
            *to = rows[best].trial[p], to->d = d;
            memcpy(d, rows[best].trial[p].d, s->components->component[p].decimated.complex.edge_count * sizeof *d);
            to->known = true, to->done = false;
        }
    run_rows(env, s, rows + count, best);
    return best;
}

/* The cheapest row without faults, whatever its count; NULL where all rows have faults. */
static const row *cheapest(const row *rows, int count)
{
    const row *best = NULL;
    for (const row *r = rows; r < rows + count; r++)
        if (r->sum.open == 0 && r->sum.inverted == 0 && r->sum.collapsed == 0 &&
            (!best || r->sum.cost < best->sum.cost))
            best = r;
    return best;
}

static bool is_poor(const search *s, uint32_t p)
{
    return has_faults(&s->kept[p]) || count_beyond_bound(s, &s->sum) > 0;
}

/* A part two or three quads wide has few possible widths, and perhaps no size with the right count: a rod three
   quads around becomes four around and as much shorter. So its length is stretched. plain: the cheapest of the sizes
   tried that has no faults, whatever its count. */
static void stretch_components(qw_env *env, search *s, const row *plain)
{
    assert(plain && s->wish.quads > 0);
    qw_scope_begin(env);
    double lacks = s->wish.quads / fmax(plain->sum.area, 1);
    trial **list = QW_NEW(env, trial *, STRETCHES * (size_t)s->components->count);
    uint32_t count = 0, edges = 0;
    for (uint32_t p = 0; p < s->components->count && edges <= STRETCHED_EDGES; p++) {
        if (!is_poor(s, p)) continue;
        uint32_t of_component = s->components->component[p].decimated.complex.edge_count;
        edges += of_component;
        trial *trials = QW_NEW_ZERO(env, trial, STRETCHES);
        for (int i = 0; i < STRETCHES; i++) {
            int k = i % STEPS_A_STRETCH;
            trial *t = list[count++] = &trials[i];
            t->d = QW_NEW(env, qw_int2, of_component);
            prepare(s, t, p, 0);
            t->first = false, t->scale = plain->trial[p].scale, t->beyond = stretches[i / STEPS_A_STRETCH].beyond;
            t->stretch = (stretches[i / STEPS_A_STRETCH].root ? sqrt(lacks) : lacks) *
                         (1 + (k & 1 ? -1 : 1) * STRETCH * ((k + 1) / 2));
        }
    }
    if (edges > STRETCHED_EDGES) count = 0;
    run_trials(env, s->components, s->most_edges, list, count);
    for (uint32_t i = 0; i < count; i++) judge(s, list[i]), take_if_better(s, list[i]);
    qw_scope_end(env);
}

/* Tries sizes for all components together, from the middle outward, and takes the best. Then, for each component
   with faults, and for all where the count is missed, the size that is best while the others keep theirs. */
static void try_sizes(qw_env *env, search *s)
{
    assert(s->tries > 0);
    qw_scope_begin(env);
    uint32_t n = s->components->count;
    int count = s->tries;
    row *rows = make_rows(env, trial_room(env, s, count + most_improved(s)), n, count + most_improved(s));
    for (int i = 0; i < count; i++)
        for (uint32_t p = 0; p < n; p++) prepare(s, &rows[i].trial[p], p, i);
    run_rows(env, s, rows, 1);
    run_rows(env, s, rows + 1, count - 1);
    sort_rows(rows, count);
    count += improve_best(env, s, rows, count);
    sort_rows(rows, count);
    const row *plain = cheapest(rows, count);
    s->sum = rows[0].sum, s->score = rows[0].score;
    for (uint32_t p = 0; p < n; p++) keep(s, &rows[0].trial[p]);
    bool better = n > 1;
    for (int sweep = 0; sweep < SWEEPS && better; sweep++) {
        better = false;
        for (uint32_t p = 0; p < n; p++)
            for (int i = 0; i < count && is_poor(s, p); i++) better |= take_if_better(s, &rows[i].trial[p]);
    }
    if (plain) stretch_components(env, s, plain);
    qw_scope_end(env);
}

/* Rounds in which the sizes tried are moved to where the last had the count. */
enum { SIZE_ROUNDS = 3 };

/* Whether a component is only as long as its sign asks for. */
static bool has_forced(const qw_complex *c, const trial *t)
{
    for (uint32_t v = 0; c->sign && v < 2 * c->edge_count; v++) {
        double x = t->scale * (double)(v & 1u ? c->real[v / 2].y : c->real[v / 2].x);
        if (c->sign[v] && c->sign[v] * (v & 1u ? t->d[v / 2].y : t->d[v / 2].x) == 1 && fabs(x) < 1) return true;
    }
    return false;
}

/* Rows of quads that are there for the sake of curves next to one another are not in proportion to the size: where the
   count is missed by them, sizes around another are tried. */
static void try_other_sizes(qw_env *env, search *s)
{
    qw_scope_begin(env);
    uint32_t n = s->components->count;
    bool forced = false;
    for (uint32_t p = 0; p < n; p++) forced |= has_forced(&s->components->component[p].decimated.complex, &s->kept[p]);
    trial *had = trial_room(env, s, 1);
    for (int round = 0; round < SIZE_ROUNDS && forced && count_beyond_bound(s, &s->sum) > 0; round++) {
        total sum = s->sum;
        double score = s->score, size = s->wish.size;
        for (uint32_t p = 0; p < n; p++) {
            qw_int2 *d = had[p].d;
            memcpy(d, s->kept[p].d, s->components->component[p].decimated.complex.edge_count * sizeof *d);
            had[p] = s->kept[p], had[p].d = d;
        }
        s->wish.size = fmin(s->kept[0].scale, size) * sqrt(s->wish.quads / fmax(s->sum.area, 1));
        try_sizes(env, s);
        if (s->score < score) continue;
        for (uint32_t p = 0; p < n; p++) keep(s, &had[p]);
        s->sum = sum, s->score = score, s->wish.size = size;
        break;
    }
    qw_scope_end(env);
}

/* Triangles that may be looked at, of all components, to bring the count within its bound by single steps. */
static const double NUDGING_WORK = 4e5;

/* Where all sizes miss the count, as a row of quads runs along many curves at once, single curves get one quad more or
   less. others: area of the other components. */
static void nudge(qw_env *env, const search *s, trial *t, double others, double *work)
{
    const qw_complex *real = &s->components->component[t->component].decimated.complex;
    double quads = s->wish.quads, bound = quads * QW_COUNT_MARGIN * qw_count_tolerance(quads, 1);
    if (t->open || !has_forced(real, t)) return;
    qw_scope_begin(env);
    qw_complex c = *real;
    c.d = t->d, c.real = QW_NEW(env, qw_real2, real->edge_count);
    aim(real, t, c.real);
    double rest = others + t->area - qw_complex_area(&c);
    qw_nudge_area(env, &c, quads - bound - rest, quads + bound - rest, work);
    judge(s, t);
    qw_scope_end(env);
}

static void nudge_count(qw_env *env, search *s)
{
    double work = NUDGING_WORK;
    for (uint32_t p = 0; p < s->components->count && work > 0 && count_beyond_bound(s, &s->sum) > 0; p++) {
        uint32_t edges = s->components->component[p].decimated.complex.edge_count;
        qw_scope_begin(env);
        trial t = s->kept[p];
        t.d = QW_NEW(env, qw_int2, edges);
        memcpy(t.d, s->kept[p].d, edges * sizeof *t.d);
        nudge(env, s, &t, s->sum.area - t.area, &work);
        take_if_better(s, &t);
        qw_scope_end(env);
    }
}

/* Whether an edge that has a length has none any more: a narrow band would go for the sake of the count. */
static bool loses_length(const qw_int2 *had, const qw_int2 *has, uint32_t edges)
{
    for (uint32_t e = 0; e < edges; e++)
        if ((had[e].x != 0 && has[e].x == 0) || (had[e].y != 0 && has[e].y == 0)) return true;
    return false;
}

/* The offsets kept and so much of each move: base MOVE_STEPS digits of `number`, from -2 to 2. */
static void move_by(const qw_int2 *kept, const qw_int2 *move, uint32_t moves, uint32_t edges, uint32_t number,
                    qw_int2 *d)
{
    memcpy(d, kept, edges * sizeof *d);
    for (uint32_t i = 0; i < moves; i++, number /= MOVE_STEPS) {
        int32_t times = (int32_t)(number % MOVE_STEPS) - MOVE_STEPS / 2;
        for (uint32_t e = 0; e < edges; e++)
            d[e].x += times * move[(size_t)i * edges + e].x, d[e].y += times * move[(size_t)i * edges + e].y;
    }
}

/* Whether a band of quads between curves is one quad wide. Cones have no room beside its corners, so another attempt
   with them there would lose the band, and the count has to be met by the lengths. */
static bool has_narrow_band(const qw_int2 *d, uint32_t edges)
{
    for (uint32_t e = 0; e < edges; e++)
        if (abs(d[e].x) + abs(d[e].y) == 1) return true;
    return false;
}

/* A box has few lengths: all those near the ones that are kept can be tried, and the closest be taken of which the
 * count is right and no edge vanishes. */
static void try_moves(qw_env *env, search *s, uint32_t p)
{
    assert(p < s->components->count);
    qw_scope_begin(env);
    const qw_complex *real = &s->components->component[p].decimated.complex;
    qw_int2 *move;
    uint32_t moves = qw_find_moves(env, real, &move), numbers = moves > 0;
    for (uint32_t i = 0; i < moves; i++) numbers *= MOVE_STEPS;
    trial t = s->kept[p];
    t.d = QW_NEW(env, qw_int2, real->edge_count);
    qw_complex c = in_room(real, &(qw_complex){.d = QW_NEW(env, qw_int2, real->edge_count),
                                               .real = QW_NEW(env, qw_real2, real->edge_count),
                                               .fixed = real->fixed});
    aim(real, &t, c.real);
    memcpy(c.d, s->kept[p].d, real->edge_count * sizeof *c.d);
    double least = INFINITY, area_kept = qw_complex_area(&c);
    for (uint32_t number = 0; number < numbers; number++) {
        move_by(s->kept[p].d, move, moves, real->edge_count, number, c.d);
        total sum = s->sum;
        sum.area += qw_complex_area(&c) - area_kept;
        double cost = qw_complex_cost(&c);
        if (count_beyond_bound(s, &sum) > 0 || cost >= least || qw_complex_inverted(&c) > 0 ||
            loses_length(s->kept[p].d, c.d, real->edge_count))
            continue;
        least = cost;
        memcpy(t.d, c.d, real->edge_count * sizeof *t.d);
    }
    if (least < INFINITY) judge(s, &t), take_if_better(s, &t);
    qw_scope_end(env);
}

/* Whether the count breaks the promise or component p has an inverted triangle. */
static bool is_broken(const search *s, uint32_t p)
{
    return !s->given_up[p] && (s->kept[p].inverted > 0 || count_beyond_bound(s, &s->sum) > 0);
}

static uint64_t broken_edges(const search *s)
{
    uint64_t sum = 0;
    for (uint32_t p = 0; p < s->components->count; p++)
        if (is_broken(s, p)) sum += s->components->component[p].decimated.complex.edge_count;
    return sum;
}

/* Gives up the components for which the last two rounds have found nothing better. */
static void give_up(search *s, int next)
{
    for (uint32_t p = 0; p < s->components->count; p++)
        s->given_up[p] |= is_broken(s, p) && s->kept[p].number + 2 * (uint32_t)s->tries < (uint32_t)next;
}

/* Tries more and more noise as long as that improves anything: a complex of few edges has few integers near its
   lengths. Returns how many sizes were tried. */
static uint32_t try_noise(qw_env *env, search *s)
{
    qw_scope_begin(env);
    uint32_t n = s->components->count, count = 0, at = 0;
    trial *trials = trial_room(env, s, LANES), **list = QW_NEW(env, trial *, (size_t)LANES * n);
    int i = s->tries, end = i; /* those below `end` have been tried */
    for (; i < NOISY_ROUNDS * s->tries; i++) {
        if (i % (2 * s->tries) == s->tries && i > s->tries) give_up(s, i);
        uint64_t edges = broken_edges(s);
        if (edges == 0 || (uint64_t)i * edges >= EDGES_TRIED) break;
        if (i == end) { /* the first noisy trial without faults ends the search */
            end = i + LANES;
            count = at = 0;
            for (int j = i; j < end; j++)
                for (uint32_t p = 0; p < n; p++) {
                    if (!is_broken(s, p)) continue;
                    list[count] = &trials[(size_t)(j - i) * n + p];
                    prepare(s, list[count++], p, j);
                }
            run_trials(env, s->components, s->most_edges, list, count);
        }
        for (; at < count && list[at]->number == (uint32_t)i; at++) {
            if (!is_broken(s, list[at]->component)) continue;
            judge(s, list[at]);
            take_if_better(s, list[at]);
        }
    }
    qw_scope_end(env);
    return (uint32_t)i;
}

/* ---- curves that touch */

/* Triangles that may be looked at, of all components; sizes tried of each, so much smaller one after the other: rows
   between curves are more quads. */
static const double PARTING_WORK = 4e5, PARTING_STEP = 0.01;
enum { PARTING_SIZES = 16, PARTING_EDGES = 12000 };

/* Parts the curves of component p that touch, at the size that was kept and at smaller ones, as long as the count is
   missed. */
static void part_curves(qw_env *env, search *s, uint32_t p, double *work)
{
    const qw_component *component = &s->components->component[p];
    const qw_complex *real = &component->decimated.complex;
    trial *kept = &s->kept[p];
    uint32_t touching = qw_count_touching(env, component, kept->d);
    if (touching == 0) return;
    s->sum.touching += touching - kept->touching, kept->touching = touching;
    s->score = score_of(s, &s->sum);
    qw_scope_begin(env);
    qw_real2 *aimed = QW_NEW(env, qw_real2, real->edge_count);
    qw_int2 *d = QW_NEW(env, qw_int2, real->edge_count);
    double scale = kept->scale;
    int sizes = (int)fmax(1, fmin(PARTING_SIZES, PARTING_EDGES / fmax(s->edges, 1)));
    for (int i = 0; i < sizes && work[0] > 0; i++) {
        trial t = *kept, *list = &t;
        t.d = d;
        if (i == 0) memcpy(d, kept->d, real->edge_count * sizeof *d);
        else {
            prepare(s, &t, p, 0);
            t.first = false, t.scale = scale * (1 - PARTING_STEP * i);
            run_trials(env, s->components, s->most_edges, &list, 1);
            t.known = true, t.done = false;
            run_trials(env, s->components, s->most_edges, &list, 1);
            judge(s, &t);
            if (t.open) continue;
        }
        aim(real, &t, aimed);
        t.touching = qw_part_curves(env, component, aimed, d, work);
        judge(s, &t);
        double others = s->sum.area - s->kept[p].area;
        total sum = {.area = others + t.area};
        if (count_beyond_bound(s, &sum) > 0) nudge(env, s, &t, others, work);
        t.touching = qw_count_touching(env, component, d);
        take_if_better(s, &t);
        if (s->kept[p].touching == 0 && count_beyond_bound(s, &s->sum) <= 0) break;
    }
    qw_scope_end(env);
}

static void add_counts(qw_regular_counts *sum, const qw_regular_counts *c)
{
    sum->nodes += c->nodes, sum->arcs += c->arcs, sum->network_components += c->network_components;
    sum->free_variables += c->free_variables, sum->fixed_variables += c->fixed_variables, sum->released += c->released;
    sum->half_variables += c->half_variables, sum->odd_cycles += c->odd_cycles,
        sum->capacity_rounds += c->capacity_rounds;
    sum->cost += c->cost, sum->irregular_before += c->irregular_before, sum->irregular_after += c->irregular_after;
    if (c->levels > sum->levels) sum->levels = c->levels;
}

/* Makes lines of component p meet, as far as the count and the topology stay. */
static qw_meeting_counts meet(qw_env *env, search *s, uint32_t p, uint32_t all_faces)
{
    assert(p < s->components->count && all_faces > 0);
    qw_scope_begin(env);
    const qw_component *component = &s->components->component[p];
    const qw_complex *real = &component->decimated.complex;
    double quads = s->wish.quads, bound = quads * COUNT_FREE;
    trial t = s->kept[p];
    t.d = QW_NEW(env, qw_int2, real->edge_count);
    memcpy(t.d, s->kept[p].d, real->edge_count * sizeof *t.d);
    qw_real2 *aimed = QW_NEW(env, qw_real2, real->edge_count);
    aim(real, &t, aimed);
    double rest = s->sum.area - t.area + t.scale * t.scale * s->wish.cut[p]; /* the other components, and what is cut */
    qw_meeting_wish wish = {aimed, s->wish.loops, fmin(quads - bound, s->sum.area) - rest,
                            fmax(quads + bound, s->sum.area) - rest, (double)real->face_count / all_faces};
    qw_meeting_counts counts = qw_make_meetings(env, component, &wish, t.d);
    total before = s->sum;
    judge(s, &t);
    s->sum = exchanged(s->sum, &s->kept[p], &t);
    const trial *had = &s->kept[p];
    if (t.open || t.inverted > had->inverted || t.collapsed > had->collapsed)
        s->sum = before, counts.kept = 0, counts.length_after = counts.length_before;
    else keep(s, &t);
    qw_scope_end(env);
    return counts;
}

static qw_meeting_counts make_meetings(qw_env *env, search *s)
{
    qw_meeting_counts sum = {0};
    uint32_t faces = 1;
    for (uint32_t p = 0; p < s->components->count; p++)
        faces += s->components->component[p].decimated.complex.face_count;
    for (uint32_t p = 0; p < s->components->count && s->wish.loops > 0; p++) {
        if (s->kept[p].open) continue;
        qw_meeting_counts c = meet(env, s, p, faces);
        sum.tried += c.tried, sum.kept += c.kept;
        sum.length_before += c.length_before, sum.length_after += c.length_after;
    }
    return sum;
}

qw_search_result qw_search_integers(qw_env *env, const qw_components *components, const qw_search_wish *wish,
                                    qw_int2 *d)
{
    assert(wish->quads > 0 && wish->size > 0 && wish->cut && d);
    qw_search_result result = {.scale = QW_NEW(env, double, components->count)};
    qw_scope_begin(env);
    search s;
    begin_search(env, &s, components, wish);
    try_sizes(env, &s);
    try_other_sizes(env, &s);
    nudge_count(env, &s);
    for (uint32_t p = 0; p < components->count && count_beyond_bound(&s, &s.sum) > 0; p++)
        if (!has_faults(&s.kept[p]) &&
            has_narrow_band(s.kept[p].d, components->component[p].decimated.complex.edge_count))
            try_moves(env, &s, p);
    result.tries = try_noise(env, &s);
    double work = PARTING_WORK;
    for (uint32_t p = 0; p < components->count && wish->apart; p++)
        if (!s.kept[p].open) part_curves(env, &s, p, &work);
    result.meetings = make_meetings(env, &s);
    for (uint32_t p = 0; p < components->count; p++)
        result.touching += qw_count_touching(env, &components->component[p], s.kept[p].d);
    result.area = s.sum.area;
    for (uint32_t p = 0; p < components->count; p++) {
        const qw_component *component = &components->component[p];
        for (uint32_t e = 0; e < component->decimated.complex.edge_count; e++) d[component->edge[e]] = s.kept[p].d[e];
        result.scale[p] = s.kept[p].scale;
        add_counts(&result.regular, &s.kept[p].counts);
    }
    result.rounding_cost = s.edges ? s.sum.cost / s.edges : 0;
    result.inverted = (uint32_t)s.sum.inverted, result.collapsed = (uint32_t)s.sum.collapsed;
    qw_scope_end(env);
    return result;
}

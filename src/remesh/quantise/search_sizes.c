#include "remesh/quantise/search_sizes.h"

#include "base/mechanisms.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Where the count is missed at every size, components are stretched whose edges together are at most STRETCHED_EDGES:
   real offsets longer than `beyond` quads are multiplied by what the count lacks (`root`: by its square root, as both
   directions are stretched), in STEPS_A_STRETCH steps around that, each STRETCH apart. */
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
/* The best sizes are improved by circuits: BEST_SIZES of them, or more where edges times sizes stay below
   EDGES_IMPROVED (docs/dev/decisions/closed-offsets.md). */
enum { BEST_SIZES = 3, EDGES_IMPROVED = 6000 };

/* How often all sizes are tried, the first time without noise. */
enum { NOISY_ROUNDS = 14 };

/* A combination: one trial of each component, all at the same size. */
typedef struct combination {
    qw_trial *trial; /* [components] */
    qw_search_total sum;
    double score;
} combination;

static combination *make_combinations(qw_env *env, const qw_search *s, int count)
{
    qw_trial *trials = qw_search_room(env, s, count);
    combination *made = QW_NEW(env, combination, count);
    for (int i = 0; i < count; i++) made[i] = (combination){.trial = trials + (size_t)i * s->components->count};
    return made;
}

/* Runs the trials of some combinations of sizes side by side, and judges each combination by its sum. */
static void run_combinations(qw_env *env, const qw_search *s, combination *some, int count)
{
    uint32_t n = s->components->count;
    qw_trial **list = QW_NEW(env, qw_trial *, (size_t)count * n);
    for (size_t i = 0; i < (size_t)count * n; i++) list[i] = &some[i / n].trial[i % n];
    qw_run_trials(env, s->components, s->most_edges, list, (uint32_t)count * n);
    for (int i = 0; i < count; i++) {
        combination *r = &some[i];
        r->sum = (qw_search_total){0};
        for (uint32_t p = 0; p < n; p++) {
            qw_search_judge(s, &r->trial[p]);
            r->sum = qw_search_with(r->sum, &r->trial[p]);
        }
        r->score = qw_search_score(s, &r->sum);
    }
}

/* Sorts by score, the lowest first; stable. */
static void sort_combinations(combination *some, int count)
{
    for (int i = 1; i < count; i++) {
        combination r = some[i];
        int at = i;
        for (; at > 0 && some[at - 1].score > r.score; at--) some[at] = some[at - 1];
        some[at] = r;
    }
}

static int most_improved(const qw_search *s)
{
    return (int)fmin(s->tries, fmax(BEST_SIZES, EDGES_IMPROVED / fmax(s->edges, 1)));
}

/* Copies the best combinations behind the `count` given ones and improves the copies by circuits. Returns how many. */
static int improve_best(qw_env *env, const qw_search *s, combination *some, int count)
{
    int best = 0;
    for (; best < most_improved(s) && some[best].sum.open == 0; best++)
        for (uint32_t p = 0; p < s->components->count; p++) {
            qw_trial *to = &some[count + best].trial[p];
            qw_search_copy(s, to, &some[best].trial[p]);
            to->known = true, to->done = false;
        }
    run_combinations(env, s, some + count, best);
    return best;
}

/* The cheapest combination without faults, whatever its count; NULL where all have faults. */
static const combination *cheapest(const combination *some, int count)
{
    const combination *best = NULL;
    for (const combination *r = some; r < some + count; r++)
        if (r->sum.open == 0 && r->sum.inverted == 0 && r->sum.collapsed == 0 &&
            (!best || r->sum.cost < best->sum.cost))
            best = r;
    return best;
}

static bool is_poor(const qw_search *s, uint32_t p)
{
    return qw_trial_has_faults(&s->kept[p]) || qw_search_miss(s, &s->sum) > 0;
}

/* A component two or three quads wide has few possible widths, and perhaps no size with the right count: a rod three
   quads around becomes four around and as much shorter. So its length is stretched. plain: the cheapest combination
   without faults. */
static void stretch_components(qw_env *env, qw_search *s, const combination *plain)
{
    assert(plain && s->request.quads > 0);
    qw_scope_begin(env);
    double lacks = s->request.quads / fmax(plain->sum.area, 1);
    qw_trial **list = QW_NEW(env, qw_trial *, STRETCHES * (size_t)s->components->count);
    uint32_t count = 0, edges = 0;
    for (uint32_t p = 0; p < s->components->count && edges <= STRETCHED_EDGES; p++) {
        if (!is_poor(s, p)) continue;
        uint32_t of_component = qw_search_complex(s, p)->edge_count;
        edges += of_component;
        qw_trial *trials = QW_NEW_ZERO(env, qw_trial, STRETCHES);
        for (int i = 0; i < STRETCHES; i++) {
            int k = i % STEPS_A_STRETCH;
            qw_trial *t = list[count++] = &trials[i];
            t->d = QW_NEW(env, qw_int2, of_component);
            qw_search_prepare(s, t, p, 0);
            t->first = false, t->scale = plain->trial[p].scale, t->beyond = stretches[i / STEPS_A_STRETCH].beyond;
            t->stretch = (stretches[i / STEPS_A_STRETCH].root ? sqrt(lacks) : lacks) *
                         (1 + (k & 1 ? -1 : 1) * STRETCH * ((k + 1) / 2));
        }
    }
    if (edges > STRETCHED_EDGES) count = 0;
    qw_run_trials(env, s->components, s->most_edges, list, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_search_judge(s, list[i]);
        qw_acted(env, QW_MECH_STRETCHED, 1);
        qw_kept(env, QW_MECH_STRETCHED, qw_search_take_if_better(s, list[i]));
    }
    qw_scope_end(env);
}

void qw_search_sizes(qw_env *env, qw_search *s)
{
    assert(s->tries > 0);
    qw_scope_begin(env);
    uint32_t n = s->components->count;
    int count = s->tries;
    combination *some = make_combinations(env, s, count + most_improved(s));
    for (int i = 0; i < count; i++)
        for (uint32_t p = 0; p < n; p++) qw_search_prepare(s, &some[i].trial[p], p, i);
    run_combinations(env, s, some, 1); /* alone, as the flows of the others start from its potentials */
    run_combinations(env, s, some + 1, count - 1);
    sort_combinations(some, count);
    int improved = qw_uses(env, QW_MECH_CIRCUITS) ? improve_best(env, s, some, count) : 0;
    count += improved;
    qw_acted(env, QW_MECH_CIRCUITS, improved);
    sort_combinations(some, count);
    qw_kept(env, QW_MECH_CIRCUITS, some[0].trial[0].known);
    s->sum = some[0].sum, s->score = some[0].score;
    for (uint32_t p = 0; p < n; p++) qw_search_copy(s, &s->kept[p], &some[0].trial[p]);
    const combination *plain = cheapest(some, count);
    if (plain && qw_uses(env, QW_MECH_STRETCHED)) stretch_components(env, s, plain);
    qw_scope_end(env);
}

/* Whether noise may help component p: the count breaks the promise, or it has an inverted triangle. */
static bool is_broken(const qw_search *s, uint32_t p)
{
    return s->kept[p].inverted > 0 || qw_search_miss(s, &s->sum) > 0;
}

/* Trials of all broken components at all sizes, with the noise of the round. Returns how many edges they have. */
static double try_noise(qw_env *env, qw_search *s, int round)
{
    qw_scope_begin(env);
    double edges = 0;
    uint32_t n = s->components->count, count = 0;
    qw_trial *trials = qw_search_room(env, s, s->tries), **list = QW_NEW(env, qw_trial *, (size_t)s->tries * n);
    for (int i = 0; i < s->tries; i++)
        for (uint32_t p = 0; p < n; p++) {
            if (!is_broken(s, p)) continue;
            list[count] = &trials[(size_t)i * n + p];
            qw_search_prepare(s, list[count++], p, round * s->tries + i);
            edges += qw_search_complex(s, p)->edge_count;
        }
    qw_run_trials(env, s->components, s->most_edges, list, count);
    for (uint32_t i = 0; i < count; i++) {
        if (!is_broken(s, list[i]->component)) continue;
        qw_search_judge(s, list[i]);
        qw_acted(env, QW_MECH_NOISE, 1), qw_kept(env, QW_MECH_NOISE, qw_search_take_if_better(s, list[i]));
    }
    qw_scope_end(env);
    return edges;
}

void qw_search_noise(qw_env *env, qw_search *s)
{
    double left = s->request.effort * QW_SEARCH_EDGES - (double)s->tries * s->edges, edges = 1;
    for (int round = 1; round < NOISY_ROUNDS && left > 0 && edges > 0 && qw_uses(env, QW_MECH_NOISE); round++)
        left -= edges = try_noise(env, s, round);
}

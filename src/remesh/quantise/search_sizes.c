#include "remesh/quantise/search_sizes.h"

#include "base/mechanisms.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The best sizes are improved by circuits: BEST_SIZES of them, or more where edges times sizes stay below
   EDGES_IMPROVED (docs/dev/decisions/closed-offsets.md). */
enum { BEST_SIZES = 3, EDGES_IMPROVED = 6000 };

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
    qw_scope_end(env);
}

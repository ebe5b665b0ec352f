#include "remesh/quantise/search_count.h"

#include "base/mechanisms.h"
#include "base/promise.h"
#include "remesh/quantise/nearest.h"
#include "remesh/quantise/nudge.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Offsets that are looked at, over all components, of each by its edges. */
enum { MOST_NEAREST = 4096 };
/* More energy a quad is worth no count: so much has one that is sheared by 32 degrees. */
static const double MOST_ENERGY = 0.2;

void qw_nudge_trial(qw_env *env, const qw_search *s, qw_trial *t, double others, double *work)
{
    assert(t->component < s->components->count && work);
    const qw_complex *real = qw_search_complex(s, t->component);
    double quads = s->request.quads, bound = quads * QW_COUNT_MARGIN * qw_count_tolerance(quads, s->request.times);
    if (t->open || !qw_trial_is_forced(s, t)) return;
    qw_scope_begin(env);
    qw_complex c = *real;
    c.d = t->d, c.real = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial_aim(real, t, c.real);
    double rest = others + t->area - qw_complex_area(&c);
    qw_nudge_area(env, &c, quads - bound - rest, quads + bound - rest, work);
    qw_search_judge(s, t);
    qw_scope_end(env);
}

/* The least distorted offsets so far that come nearest to the count; no edge loses its length. */
typedef struct choice {
    const qw_search *s;
    const qw_complex *c; /* with the offsets that are looked at */
    const qw_int2 *kept;
    double area_kept, most, miss, energy; /* most: energy */
    qw_int2 *d;
} choice;

/* Keeps the integers at hand if they are the best so far and invert nothing. */
static void choose_least(qw_env *env, void *user)
{
    (void)env;
    choice *k = user;
    qw_search_total sum = k->s->sum;
    sum.area += qw_complex_area(k->c) - k->area_kept;
    double miss = qw_search_miss(k->s, &sum), energy;
    if (miss > k->miss || qw_complex_inverted(k->c) > 0 || qw_complex_loses_length(k->c, k->kept)) return;
    energy = qw_complex_energy(k->c);
    if (energy > k->most || (miss == k->miss && energy >= k->energy)) return;
    k->miss = miss, k->energy = energy;
    memcpy(k->d, k->c->d, k->c->edge_count * sizeof *k->d);
}

/* Tries the offsets nearest to the real ones. */
static void try_nearest(qw_env *env, qw_search *s, uint32_t p)
{
    assert(p < s->components->count);
    qw_scope_begin(env);
    const qw_complex *real = qw_search_complex(s, p);
    qw_trial t = qw_search_copy_kept(env, s, p);
    qw_complex c = *real;
    c.d = QW_NEW(env, qw_int2, real->edge_count), c.real = QW_NEW(env, qw_real2, real->edge_count);
    qw_trial_aim(real, &t, c.real);
    memcpy(c.d, t.d, real->edge_count * sizeof *c.d);
    double most = MOST_ENERGY * qw_complex_area(&c);
    choice k = {s, &c, s->kept[p].d, qw_complex_area(&c), most, qw_search_miss(s, &s->sum), INFINITY, t.d};
    uint32_t looks = (uint32_t)qw_ceil((double)MOST_NEAREST * c.edge_count / s->edges);
    qw_nearest_request request = {.most = looks, .farthest = INFINITY, .visit = choose_least, .user = &k};
    qw_visit_nearest(env, &c, &request);
    qw_acted(env, QW_MECH_NEAREST, 1);
    if (k.energy < INFINITY) {
        qw_search_judge(s, &t);
        qw_kept(env, QW_MECH_NEAREST, qw_search_take_if_better(s, &t));
    }
    qw_scope_end(env);
}

void qw_search_nearest(qw_env *env, qw_search *s)
{
    for (uint32_t p = 0; p < s->components->count && qw_search_miss(s, &s->sum) > 0; p++)
        if (!s->kept[p].open && qw_uses(env, QW_MECH_NEAREST)) try_nearest(env, s, p);
}

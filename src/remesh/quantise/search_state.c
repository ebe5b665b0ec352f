#include "remesh/quantise/search_state.h"

#include "base/constants.h"
#include "base/promise.h"
#include "remesh/quantise/bidirected.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Sizes are tried up to this share above and below the wanted one, in MOST_TRIES steps or fewer (QW_SEARCH_EDGES). */
static const double SIZE_RANGE = 0.03;
enum { MOST_TRIES = 17 };
/* Noise is increased by so much, in quads, each time that all sizes have been tried. */
static const float NOISE = 0.4f;
/* Weights of the score: of an open component, of the share by which the count is off, and of what is beyond the
   promise. An inverted triangle, which later stages must repair, counts 1, as much as a percent of the count; so do a
   contracted part and the square root of the number of touching curves. */
static const double OPEN_WEIGHT = 1e6, COUNT_WEIGHT = 100, BROKEN_WEIGHT = 1000;

qw_search qw_search_begin(qw_env *env, const qw_components *components, const qw_search_request *request)
{
    uint32_t n = components->count;
    qw_search s = {.components = components, .request = *request};
    s.finder = QW_NEW(env, qw_collapse_finder, n), s.first = QW_NEW(env, uint32_t, n);
    s.kept = QW_NEW_ZERO(env, qw_trial, n);
    s.potential = QW_NEW(env, int64_t *, n), s.network = QW_NEW(env, qw_network, n);
    for (uint32_t p = 0; p < n; p++) {
        const qw_decimated *k = &components->component[p].decimated;
        s.finder[p] = qw_collapse_finder_make(env, k);
        s.first[p] = s.edges, s.edges += k->complex.edge_count;
        if (k->complex.edge_count > s.most_edges) s.most_edges = k->complex.edge_count;
        s.network[p] = qw_network_build(env, &k->complex);
        s.potential[p] = QW_NEW_ZERO(env, int64_t, QW_POTENTIALS(k->complex.face_count));
        s.kept[p].d = QW_NEW_ZERO(env, qw_int2, k->complex.edge_count);
        s.kept[p].scale = request->size, s.kept[p].beyond = INFINITY, s.kept[p].stretch = 1;
    }
    s.room = QW_NEW(env, qw_real2, s.most_edges);
    s.tries = request->effort * QW_MOST_DECIMATED < 1
                  ? 1
                  : (int)fmax(3, fmin(MOST_TRIES, request->effort * QW_SEARCH_EDGES / fmax(s.edges, 1)));
    return s;
}

qw_trial *qw_search_room(qw_env *env, const qw_search *s, int combinations)
{
    assert(combinations > 0);
    uint32_t n = s->components->count;
    qw_trial *t = QW_NEW_ZERO(env, qw_trial, (size_t)combinations * n);
    for (int i = 0; i < combinations; i++) {
        qw_int2 *d = QW_NEW(env, qw_int2, s->edges);
        for (uint32_t p = 0; p < n; p++) t[(size_t)i * n + p].d = d + s->first[p];
    }
    return t;
}

void qw_search_prepare(const qw_search *s, qw_trial *t, uint32_t component, int i)
{
    assert(component < s->components->count && i >= 0);
    int k = i % s->tries;
    double side = k & 1 ? -1 : 1;
    t->component = component;
    t->scale = s->request.size * (1 + side * SIZE_RANGE * ((k + 1) / 2) / fmax(s->tries / 2, 1));
    t->beyond = INFINITY, t->stretch = 1;
    t->noise = NOISE * (float)(i / s->tries), t->seed = (uint64_t)i << 32;
    t->network = &s->network[component], t->potential = s->potential[component];
    t->first = i == 0;
    t->known = t->done = false;
}

void qw_search_judge(const qw_search *s, qw_trial *t)
{
    const qw_complex *real = qw_search_complex(s, t->component);
    qw_complex c = *real;
    c.d = t->d, c.real = s->room;
    qw_trial_aim(real, t, c.real);
    t->area = qw_complex_area(&c) + t->scale * t->scale * s->request.cut[t->component];
    t->cost = qw_complex_cost(&c);
    t->inverted = qw_complex_inverted(&c);
    t->collapsed = qw_find_collapsed(&s->finder[t->component], t->d);
    t->open = !qw_complex_is_closed(&c);
}

qw_search_total qw_search_with(qw_search_total sum, const qw_trial *t)
{
    return (qw_search_total){sum.area + t->area,           sum.cost + t->cost,         sum.inverted + t->inverted,
                             sum.collapsed + t->collapsed, sum.touching + t->touching, sum.open + t->open};
}

qw_search_total qw_search_exchange(qw_search_total sum, const qw_trial *from, const qw_trial *to)
{
    assert(from->component == to->component);
    qw_search_total rest = {sum.area - from->area,         sum.cost - from->cost,
                            sum.inverted - from->inverted, sum.collapsed - from->collapsed,
                            sum.touching - from->touching, sum.open - from->open};
    return qw_search_with(rest, to);
}

double qw_search_miss(const qw_search *s, const qw_search_total *sum)
{
    double bound = QW_COUNT_MARGIN * qw_count_tolerance(s->request.quads, s->request.times);
    return fmax(fabs(sum->area / s->request.quads - 1) - bound, 0);
}

double qw_search_score(const qw_search *s, const qw_search_total *sum)
{
    double off = fabs(sum->area / s->request.quads - 1);
    double count = COUNT_WEIGHT * fmax(off - QW_SEARCH_COUNT_FREE, 0) + BROKEN_WEIGHT * qw_search_miss(s, sum);
    double cost = s->edges ? sum->cost / s->edges : 0;
    return OPEN_WEIGHT * (double)sum->open + count + cost + (double)sum->inverted + (double)sum->collapsed +
           sqrt((double)sum->touching);
}

void qw_search_copy(const qw_search *s, qw_trial *to, const qw_trial *from)
{
    assert(from->component < s->components->count && to->d && to->d != from->d);
    qw_int2 *d = to->d;
    memcpy(d, from->d, qw_search_complex(s, from->component)->edge_count * sizeof *d);
    *to = *from, to->d = d;
}

qw_trial qw_search_copy_kept(qw_env *env, const qw_search *s, uint32_t p)
{
    qw_trial t = {.d = QW_NEW(env, qw_int2, qw_search_complex(s, p)->edge_count)};
    qw_search_copy(s, &t, &s->kept[p]);
    return t;
}

bool qw_search_take_if_better(qw_search *s, const qw_trial *t)
{
    qw_search_total sum = qw_search_exchange(s->sum, &s->kept[t->component], t);
    double score = qw_search_score(s, &sum);
    if (score >= s->score) return false;
    qw_search_copy(s, &s->kept[t->component], t);
    s->sum = sum, s->score = score;
    return true;
}

bool qw_trial_has_faults(const qw_trial *t) { return t->open || t->inverted > 0 || t->collapsed > 0; }

bool qw_trial_is_forced(const qw_search *s, const qw_trial *t)
{
    const qw_complex *c = qw_search_complex(s, t->component);
    for (uint32_t v = 0; c->at_least && v < 2 * c->edge_count; v++) {
        double x = t->scale * (double)(v & 1u ? c->real[v / 2].y : c->real[v / 2].x);
        if (c->at_least[v] && c->at_least[v] * (v & 1u ? t->d[v / 2].y : t->d[v / 2].x) == 1 && fabs(x) < 1)
            return true;
    }
    return false;
}

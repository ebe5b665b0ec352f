/* What the steps of the search for integers share: the best trial of each component so far, the totals over all
 * components, and the score by which two totals are compared. */
#pragma once

#include "remesh/quantise/collapse.h"
#include "remesh/quantise/search_trial.h"
#include "remesh/quantise/search_request.h"

/* Sums over one trial of each component. */
typedef struct qw_search_total {
    double area, cost; /* units as in qw_trial */
    int64_t inverted, collapsed, touching, open;
} qw_search_total;

typedef struct qw_search {
    const qw_components *components;
    qw_search_request request;
    qw_collapse_finder *finder; /* qw_collapse_finder[components] */
    qw_real2 *room;             /* qw_real2[most_edges], to work in */
    uint32_t edges, most_edges; /* of all components, of the largest */
    uint32_t *first;            /* uint32_t[components]: the place of a component in an array over the edges of all */
    qw_network *network;        /* qw_network[components] */
    int64_t **potential;        /* int64_t *[components]: see qw_trial */
    int tries;                  /* sizes that are tried */
    qw_trial *kept;             /* qw_trial[components], each with its own d: the best so far */
    qw_search_total sum;        /* of those kept */
    double score;               /* of sum; what is lower is better */
} qw_search;

/* Edges, times sizes, that are tried: a large complex gets fewer sizes. */
enum { QW_SEARCH_EDGES = 60000 };

/* A count that is off by less than this share counts as exact. */
#define QW_SEARCH_COUNT_FREE 0.008

/* In the current scope. */
qw_search qw_search_begin(qw_env *env, const qw_components *components, const qw_search_request *request);

/* qw_trial[combinations][components], each trial with room for its integers. In the current scope. */
qw_trial *qw_search_room(qw_env *env, const qw_search *s, int combinations);

/* Makes t the i-th trial of a component: the sizes around the wanted one, from the middle outward; then the
   same sizes with noise, with more each time. */
void qw_search_prepare(const qw_search *s, qw_trial *t, uint32_t component, int i);

/* Fills what a trial is judged by: area, cost, inverted, collapsed, open. */
void qw_search_judge(const qw_search *s, qw_trial *t);

/* The sums with one more trial, or with one trial exchanged for another. */
qw_search_total qw_search_with(qw_search_total sum, const qw_trial *t);
qw_search_total qw_search_exchange(qw_search_total sum, const qw_trial *from, const qw_trial *to);

/* By what share of the wanted count the sum's misses the promise; 0 where it keeps it. */
double qw_search_miss(const qw_search *s, const qw_search_total *sum);

/* Weighted sum of the misses of count and of all faults, and of the mean cost an edge. */
double qw_search_score(const qw_search *s, const qw_search_total *sum);

/* Copies a trial, with its integers, into the room of another. */
void qw_search_copy(const qw_search *s, qw_trial *to, const qw_trial *from);

/* A copy of the trial that is kept of component p, with integers of its own. In the current scope. */
qw_trial qw_search_copy_kept(qw_env *env, const qw_search *s, uint32_t p);

/* Keeps trial t of its component if that lowers the score. */
bool qw_search_take_if_better(qw_search *s, const qw_trial *t);

bool qw_trial_has_faults(const qw_trial *t);

/* Whether in t some edge is a quad long only because of its bound (qw_complex.at_least): such lengths do not follow the
   size. */
bool qw_trial_is_forced(const qw_search *s, const qw_trial *t);

static inline const qw_complex *qw_search_complex(const qw_search *s, uint32_t p)
{
    return &s->components->component[p].decimated.complex;
}

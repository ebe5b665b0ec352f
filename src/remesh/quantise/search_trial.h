/* Trials of the search for integers: each chooses the integer offsets of one connected component for one size of the
 * quads. Trials do not depend on one another, so they run in parallel. */
#pragma once

#include "base/lanes.h"
#include "remesh/quantise/complex_components.h"
#include "remesh/quantise/network.h"
#include "remesh/quantise/regular.h"

typedef struct qw_trial {
    uint32_t component;
    double scale;  /* factor of the real offsets */
    double beyond; /* quads: a real offset that is longer, once scaled, is multiplied by `stretch` as well. The
                      offsets that are aimed at need not be closed then. INFINITY: none is. */
    double stretch;
    float noise;               /* quads: up to so much is added to each real offset before it is rounded */
    uint64_t seed;             /* of the noise */
    qw_int2 *d;                /* qw_int2[edges of the component], the caller's: the integers that were chosen */
    const qw_network *network; /* of the component */
    int64_t *potential;        /* int64_t[QW_POTENTIALS(faces of the component)]: the dual solution of the trial whose
                                  `first` is set, from which the flows of all others start */
    bool first;
    bool known; /* d is closed already and is only improved */
    bool done;
    qw_regular_counts counts;
    /* what qw_search_judge finds */
    double area, cost;            /* quads; sum of weight * (d - real)^2 */
    uint32_t inverted, collapsed; /* triangles, contracted parts (collapse.h) */
    uint32_t touching;            /* as of qw_count_touching, which is slow: 0 until curves are parted */
    bool open;                    /* d does not obey Eq. (3) */
} qw_trial;

/* The real offsets that trial t rounds: those of `real`, its component's complex, at its size. to: qw_real2[edges]. */
void qw_trial_aim(const qw_complex *real, const qw_trial *t, qw_real2 *to);

/* Fills d and counts of each trial. most_edges: of the largest component among them. */
void qw_run_trials(qw_env *env, const qw_components *components, uint32_t most_edges, qw_trial **trials,
                   uint32_t count);

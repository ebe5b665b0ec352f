/* Regular offsets: changes d as little as possible so that Eq. (3) holds on every triangle (paper, Section 3.3). */
#ifndef QW_INTEGER_REGULAR_H
#define QW_INTEGER_REGULAR_H

#include "integer/offsets.h"

/* As the option `flow` (Table 4 of the paper). */
typedef enum qw_flow_kind { QW_FLOW_MF, QW_FLOW_MF_MR, QW_FLOW_MCF, QW_FLOW_MCF_MR, QW_FLOW_ILP } qw_flow_kind;

typedef struct qw_regular_counts {
    int64_t nodes, arcs, network_components; /* of the finest network that was solved */
    int64_t free_variables, fixed_variables; /* balanced / frozen because unbalanced */
    int64_t released;                        /* curve components that had to be let go for a component's sum to be zero */
    int64_t levels, capacity_rounds;
    int64_t cost;                            /* sum of |change| over all components of all edges: Eq. (7) */
    int64_t irregular_before, irregular_after;
} qw_regular_counts;

/* Changes m->d (and m->fixed where components are released). geometric: costs that know the edges (the paper's best future work) instead of
   the plain count of changes, Eq. (7); maximum flow looks at neither. */
qw_regular_counts qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_kind kind, bool geometric);

#endif

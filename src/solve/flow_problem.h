/* What the flow solvers take and give. */
#pragma once

#include "base/env.h"

typedef struct qw_flow_problem {
    uint32_t node_count, arc_count;
    const uint32_t *tail, *head; /* uint32_t[arc_count], node */
    const int32_t *capacity;     /* int32_t[arc_count], >= 0 */
    const int32_t *cost;         /* int32_t[arc_count], >= 0 (parallel arcs of rising cost make a convex cost) */
    const int32_t *supply;       /* int32_t[node_count] */
} qw_flow_problem;

typedef struct qw_flow_result {
    int64_t met;    /* supply units that were sent */
    int64_t wanted; /* sum of the positive supplies */
    int64_t cost;
    int64_t augmentations;
} qw_flow_result;

/* Which vertices of the input are one where a region meets what was left out. */
#pragma once

#include "base/env.h"
#include "geometry/clean_input.h"

/* The rims as they are: loops of vertices of the input, the region to their left. */
typedef struct qw_old_rims {
    uint32_t count, *begin; /* uint32_t[count + 1] */
    uint32_t *vertex;       /* uint32_t[begin[count]]: of the input; QW_NONE: one that cleaning has made, which stays */
    uint32_t *component;    /* uint32_t[count]: in each the loops have an even number of edges together afterwards */
} qw_old_rims;

/* uint32_t[input->vertex_count]: the least vertex that is one with each. At the two ends of an edge of a rim, and of
   the edge of a polygon that was left out at the same places, vertices are one: parts that touch in a point, whose
   vertices lie at one place too, stay apart. In the current scope. */
uint32_t *qw_weld_along_rims(qw_env *env, const qw_clean_input *input, const uint8_t *left_out,
                             const qw_old_rims *rims);

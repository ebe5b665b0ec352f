/* Exact tests of whether flat triangles overlap. Coordinates are whole numbers below 2^29 in size, whose products fit
 * 64 bits. */
#pragma once

#include "base/env.h"

typedef struct qw_grid_point {
    int32_t x, y;
} qw_grid_point;

/* Twice the signed area of a triangle: above 0 where it is counter-clockwise. */
static inline int64_t qw_grid_turn(qw_grid_point a, qw_grid_point b, qw_grid_point c)
{
    return ((int64_t)b.x - a.x) * ((int64_t)c.y - a.y) - ((int64_t)b.y - a.y) * ((int64_t)c.x - a.x);
}

/* Whether any two of the segments from loop[i] to loop[next[i]] meet other than at an end that they share by number. */
bool qw_segments_meet(qw_env *env, const qw_grid_point *point, const uint32_t *from, const uint32_t *to,
                      uint32_t count);

/* Boundary loops of a mesh of triangles or of quads. */
#pragma once

#include "base/env.h"

typedef struct qw_rims {
    uint32_t count;  /* loops, in the order of their first half-edges */
    uint32_t *begin; /* uint32_t[count + 1] */
    uint32_t *half;  /* uint32_t[begin[count]]: the boundary half-edges along each loop, so that the surface lies to
                        their left */
} qw_rims;

/* sides: 3 or 4, corners of a face; twin: uint32_t[sides face_count]. Arrays of the current scope. */
qw_rims qw_find_rims(qw_env *env, uint32_t sides, const uint32_t *twin, uint32_t face_count);

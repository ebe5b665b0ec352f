/* Polygons -> triangles that name the same vertices. */
#pragma once

#include "base/env.h"
#include "geometry/clean_input.h"

typedef struct qw_triangles {
    uint32_t count;
    uint32_t *corner; /* uint32_t[3 count] */
    uint32_t *source; /* uint32_t[count]: the polygon */
} qw_triangles;

/* A polygon of n corners gives n - 2 triangles, in the polygon's order and orientation. Faces with fewer than three
   corners give none. Fails with QW_TOO_LARGE where half-edges would no longer be addressed by 32 bits. */
qw_triangles qw_triangulate(qw_env *env, const qw_clean_input *input);

/* A strip of quads between two loops of vertices, with as many quads across as both ask for.
 *
 * Cells join one edge of one loop to an odd number of edges of the other. Between one and three edges lie four quads:
 *
 *     t0 ------------- t1        inner loop
 *      | \           / |
 *      |  x0 ----- x1  |
 *      |  /         \  |
 *     b0 --- b1 b2 --- b3        outer loop
 *
 * (b0 b1 x0 t0, b1 b2 x1 x0, b2 b3 t1 x1, x0 x1 t1 t0); with five edges the pattern is nested, and so on. So two loops
 * can be joined wherever their numbers of edges are both even or both odd; which edges go together is found by dynamic
 * programming, so that what is joined lies at the same place along the loops.
 */
#pragma once

#include "base/env.h"
#include "base/vec.h"

/* Quads that are being made, with arrays that grow. */
typedef struct qw_quad_builder {
    qw_env *env;
    uint32_t vertex_count, face_count;
    qw_vec3 *position; /* qw_vec3[vertex_count] */
    uint32_t *corner;  /* uint32_t[4 face_count] */
    size_t position_capacity, corner_capacity;
} qw_quad_builder;

uint32_t qw_builder_vertex(qw_quad_builder *b, qw_vec3 position);
void qw_builder_quad(qw_quad_builder *b, uint32_t p, uint32_t q, uint32_t r, uint32_t s);

/* A loop: the strip lies to the left of the outer one and to the right of the inner one. */
typedef struct qw_ring {
    uint32_t count;
    uint32_t *vertex; /* uint32_t[count] */
    double *at;       /* double[count]: where each lies along the rim, never falling, and at most `period` above the
                         first */
    uint8_t *station; /* uint8_t[count]: 1 where a vertex must be joined to one at the same place; NULL: none */
} qw_ring;

/* outer->count and inner->count are both even or both odd, and at least 1. */
void qw_fill_strip(qw_quad_builder *b, const qw_ring *outer, const qw_ring *inner, double period);

/* The equations of regularity by themselves: triangles, edges and turns without a surface, so that they can be made
 * coarser than any surface (decimated.h, paper/multiresolution.h). Each triangle has three half-edges 3f, 3f+1,
 * 3f+2; an edge has one or two. */
#pragma once

#include "remesh/offsets/offsets.h"
#include "remesh/quantise/double2.h"

typedef struct qw_complex {
    uint32_t face_count, edge_count;
    uint32_t *edge; /* uint32_t[3 face_count] */
    uint8_t *rot;   /* uint8_t[3 face_count] */
    uint32_t *side; /* uint32_t[2 edge_count], half-edges of the edge; the second is QW_NONE on the boundary */
    qw_int2 *d;     /* qw_int2[edge_count] */
    qw_real2 *real; /* qw_real2[edge_count], as in qw_offset_mesh */
    uint8_t *fixed; /* uint8_t[edge_count], QW_FIXED_ bits */
    float *weight;  /* float[edge_count], of each edge in QW_COST_SQUARE; NULL: all 1 */
    /* int8_t[2 edge_count], of each component: +1, it must be 1 or more; -1, it must be -1 or less, as feature curves
       would touch otherwise; 0, free. NULL: all are free. */
    int8_t *at_least;
} qw_complex;

qw_complex qw_complex_of(qw_env *env, const qw_offset_mesh *m); /* d is copied */

/* Sets the weights to those of linear finite elements on the triangles: half the sum of the cotangents of the angles
   opposite the edge. The cost of rounding is then the energy of a map that is linear on each triangle. Weights are
   bounded, as slivers have no meaningful ones. */
void qw_complex_weigh(qw_complex *c);

/* Sum of weight * (d - real)^2 over all components, and of the penalties for bounds (at_least) that are not met. */
double qw_complex_cost(const qw_complex *c);

double qw_complex_area(const qw_complex *c);       /* of the offsets d, in quads */
uint32_t qw_complex_inverted(const qw_complex *c); /* triangles that d inverts, though `real` gives them an area */
bool qw_complex_is_closed(const qw_complex *c);    /* whether Eq. (3) holds on every triangle */

/* Whether a component that is not 0 in `had` (qw_int2[edge_count]) is 0 in c->d. A narrow band may vanish then. */
bool qw_complex_loses_length(const qw_complex *c, const qw_int2 *had);

/* Penalty, in squared quads, for each step by which a component misses its bound: more than a row of quads costs
 * nearby. */
#define QW_BOUND_COST 64

/* By how many steps component v, 2 edge + (it is y), of value z misses its bound. */
static inline int32_t qw_complex_short(const qw_complex *c, uint32_t v, int32_t z)
{
    int32_t side = c->at_least ? c->at_least[v] : 0;
    return side && side * z < 1 ? 1 - side * z : 0;
}

/* The offset along a half-edge, in the frame of its triangle. */
static inline qw_int2 qw_steps_along(const qw_complex *c, uint32_t h) { return qw_turn(c->rot[h], c->d[c->edge[h]]); }

static inline qw_int2 qw_complex_residual(const qw_complex *c, uint32_t f)
{
    qw_int2 sum = {0, 0};
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) sum = qw_int2_add(sum, qw_steps_along(c, h));
    return sum;
}

/* The real offset along a half-edge, in the frame of its triangle. */
static inline qw_double2 qw_along(const qw_complex *c, uint32_t h)
{
    qw_real2 d = c->real[c->edge[h]];
    return qw_turned2(c->rot[h], (qw_double2){(double)d.x, (double)d.y});
}

/* Energy of the map from the real to the integer complex that is linear on triangle f: the integral of the square of
   how far its derivative is from the identity, in quads, and what it costs where the triangle is crushed. The square
   alone takes a strip of three quads that becomes one for less than a fifth of what its rows lose. */
double qw_triangle_energy(const qw_complex *c, uint32_t f);
/* Of all triangles. */
double qw_complex_energy(const qw_complex *c);

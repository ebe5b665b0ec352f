/* The decimated complex of a closed map: its surface collapsed to cones, corners and little else. (Choosing the
 * integers on a coarse triangulation of the singularities is an idea of Coudert-Osmont et al. 2023; the method here
 * is our own.)
 *
 * Moving a vertex onto a neighbour changes the offsets of all its edges by one vector and keeps them closed; two
 * triangles become flat, and each says that its two other edges are one but for a turn. A regular vertex may be moved
 * so wherever it is, a vertex on a curve along the curve. The edges that are left are as long as the features are
 * apart. Any integers that are closed there give closed integers of the whole surface: every edge of it is one of the
 * decimated complex's, turned, or zero.
 */
#pragma once

#include "remesh/quantise/complex.h"

/* d[edge] = R2(turn[0]) d[from[0]] + R2(turn[1]) d[from[1]], without those that are QW_NONE, as long as edge still was
   what it is on the surface. */
typedef struct qw_decimation_step {
    uint32_t edge, from[2];
    uint8_t turn[2];
} qw_decimation_step;

typedef struct qw_decimated {
    qw_complex complex; /* real: the closed offsets of its edges; d: the same rounded */
    uint32_t *corner;   /* uint32_t[3 complex.face_count], vertices of the surface that are left */
    uint32_t fine_edge_count;
    uint32_t *edge_number;    /* uint32_t[fine_edge_count], edge of the complex that has the place of the surface's, or
                                 QW_NONE */
    qw_decimation_step *step; /* qw_decimation_step[step_count], to be taken back from the last */
    uint32_t step_count;
} qw_decimated;

/* closed: qw_real2[m->edge_count], which obey Eq. (3) to rounding. */
qw_decimated qw_decimate(qw_env *env, const qw_offset_mesh *m, const qw_real2 *closed);

/* Takes the steps back, from the last: d has the offsets of the edges that are left, and receives those of the others.
 */
void qw_take_back(const qw_decimation_step *step, uint32_t count, qw_int2 *d);

/* The offsets of the surface's edges that follow from those of the decimated complex: fine is
   qw_int2[fine_edge_count]. */
void qw_decimated_expand(const qw_decimated *s, const qw_int2 *d, qw_int2 *fine);

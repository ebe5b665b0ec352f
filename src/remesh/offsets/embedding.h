/* Positions of the lattice points, Eq. (9) of the paper: with the offsets fixed, where the lattice points lie is a
 * linear least-squares problem.
 *
 * Vertices that zero edges join refer to one lattice point: a contraction class, which is one vertex of the quad mesh
 * to be. Each class has one unknown point, constrained to its tangent plane; on curves to the curve's line (the
 * sharp-edge constraint of Section 3.5); corners are fixed.
 */
#pragma once

#include "remesh/offsets/offsets.h"

/* Contraction class of each vertex, named by its lowest vertex: uint32_t[m->vertex_count]. */
uint32_t *qw_offset_classes(qw_env *env, const qw_offset_mesh *m);

typedef struct qw_embedding_counts {
    uint32_t iterations;
    double residual; /* of the normal equations, relative */
    /* Eq. (9) in units of the squared wanted length, a mean over the edges between classes */
    double energy_before, energy_after;
} qw_embedding_counts;

/* qw_vec3[m->vertex_count], set at the vertices that name a class. tolerance: the relative residual to which it is
   solved. */
qw_vec3 *qw_solve_embedding(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of, double tolerance,
                            qw_embedding_counts *counts);

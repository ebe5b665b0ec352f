/* Position field: a square lattice at every vertex, as consistent as can be between neighbours in the sense of Eq. (2).
 */
#pragma once

#include "remesh/field/hierarchy.h"
#include "remesh/offsets/lattice.h"

/* Solves Eq. (2) coarse to fine. orientation: qw_vec3[vertex_count of level 0]; size: float[the same], wanted edge
   length. Vertices on curves keep a lattice line on the curve, corners a lattice point on themselves, on every level.
   Returns qw_vec3[the same]: for each vertex the lattice point nearest to it. */
qw_vec3 *qw_position_field(qw_env *env, const qw_hierarchy *hierarchy, const qw_vec3 *orientation, const float *size);

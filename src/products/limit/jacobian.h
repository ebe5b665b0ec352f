/* Quads for computing on: none with a scaled Jacobian below an aim, as far as moving vertices does it. */
#pragma once

#include "products/limit/fit_shape.h"

/* The scaled Jacobian of a quad: the least sine of its corners, against its normal; 0 where a side has no length. */
float qw_scaled_jacobian(const qw_vec3 *position, const uint32_t *corner);

/* Moves vertices of quads below the aim, and of those beside them, on the shape: along curves where they lie on one,
   not at all at corners and where stays, uint8_t[quads->vertex_count], is 1 (NULL: nowhere), by up to an edge. No quad
   that was above becomes one below. quads: linked, with kinds, marks and components. Returns how many were below. */
uint32_t qw_raise_jacobians(qw_env *env, qw_quadmesh *quads, const qw_shape *shape, const uint8_t *stays, float aim);

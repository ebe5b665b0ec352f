/* Closed shells that bound a hollow inside another one. */
#pragma once

#include "geometry/quadmesh.h"

/* uint32_t[shells], in the current scope: of each closed shell that is inside out the smallest one around it that is
   not; QW_NONE of all others. position: double[vertices][3]; shell: uint32_t[faces]; closed: uint8_t[shells]. */
uint32_t *qw_find_cavities(qw_env *env, const qw_quadmesh *quads, const double *position, const uint32_t *shell,
                           uint32_t shells, const uint8_t *closed);

/* The part of a surface that is seen from outside, for measuring against it. */
#pragma once

#include "base/env.h"
#include "geometry/clean_input.h"

/* Triangles of the input, cut where they go inside others, to the precision of a cell, that are seen through gaps wider
 * than `distance` (in the input's coordinates), each turned to the side from which it is seen. *seen: uint8_t[faces of
 * the result], QW_SEEN_ flags (products/measure/distance.h); may be NULL. Fails as qw_wrap does. In the caller's scope;
 * vertices of the input come first. */
qw_clean_input qw_visible_part(qw_env *env, const qw_clean_input *input, double distance, uint8_t **seen);

/* Things sorted by the group that each is in. */
#pragma once

#include "base/env.h"

/* of: uint32_t[count], the group of each thing, below `groups`, or QW_NONE for one in none. Returns the things, those
   of group g from (*first)[g] to (*first)[g + 1], rising: uint32_t[count], and *first: uint32_t[groups + 2], the last
   for counting only. Both in the current scope. */
uint32_t *qw_group(qw_env *env, const uint32_t *of, uint32_t count, uint32_t groups, uint32_t **first);

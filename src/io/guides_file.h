/* Guides as OBJ files of lines: v x y z, and l with the numbers of vertices along each polyline, which is closed where
 * the last is the first. Lines are of the kind that their group or object is named after (g, o): "direction", and what
 * begins so, or "loop", which is what they are where nothing is said. Other statements are passed over. */
#pragma once

#include "base/env.h"

/* Guides with their points, qw_guide[*count], in the caller's scope. "-" is standard input. */
qw_guide *qw_read_guides(qw_env *env, const char *path, uint32_t *count);

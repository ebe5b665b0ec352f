/* What a quick answer leaves out (--fast): docs/dev/decisions/fast.md. Beside this a draft has the working mesh of
 * quads that follow nothing, a preview a coarser one (resolution.c), and neither goes back for its coverage
 * (run/retry.c).
 */
#pragma once

#include "quadwright/quadwright.h"

/* The options that the stages are to see: those that say how much of something is wanted are 0 where it is left out. */
qw_options qw_without_slow(const qw_options *options);

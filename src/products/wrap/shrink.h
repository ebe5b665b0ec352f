/* A skin of cell faces becomes one that lies on the input: vertices move to it, edges that cut its corners are split
 * and flipped until they run along them, and short ones collapse. Each step is one that the guard allows. */
#pragma once

#include "products/wrap/guard.h"
#include "products/wrap/wrap_target.h"

void qw_shrink(qw_env *env, qw_skin *skin, const qw_wrap_target *target);

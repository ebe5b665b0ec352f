/* What a dump says, part by part, against what the stages leave: each structure by its own validator. */
#pragma once

#include "run/driver.h"

/* The part is a stage, or -1 for the input; finished: stages in the dump. Earlier parts have been validated, indices
   are in range and numbers finite. Fails with QW_INTERNAL and a sentence. Sets the numbers
   that a dump leaves out, as they follow from what it has: censuses, areas, wanted sizes, what is held. */
void qw_state_validate(qw_context_state *c, int part, uint32_t finished);

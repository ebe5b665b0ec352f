/* Where a joined result lies on the input, and its attributes: those of the quads, and behind them those that the
 * polygons which were left out have anyway. */
#pragma once

#include "whole/state.h"

/* Turns the provenance of the finished quads into that of the joined mesh. Arrays of the current scope. */
void qw_join_provenance(const qw_run_state *run, qw_provenance *provenance);

/* Turns attributes of the finished quads, qw_attribute[count], into those of the joined mesh. attributes: of the input,
   in the same order. In the current scope. */
void qw_join_attributes(const qw_run_state *run, const qw_attribute *attributes, uint32_t count, qw_attribute *joined);

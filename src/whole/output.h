/* Positions as the result has them. */
#pragma once

#include "whole/state.h"

/* Positions in the coordinates of the input of quads in the frame of a clean surface: double[quads->vertex_count][3] in
   the current scope. *flat: the index of a quad that has no area there, though its vertices were pushed apart, or
   QW_NONE. */
double *qw_output_positions(const qw_run_state *run, const qw_clean *clean, const qw_quadmesh *quads, uint32_t *flat);
/* Rounds positions in those coordinates, double[quads->vertex_count][3], in the same way. */
void qw_settle_output(const qw_run_state *run, const qw_clean *clean, const qw_quadmesh *quads, double *output,
                      uint32_t *flat);

/* The quads of a designed part on its planes, cylinders and their like (products/exact/exact.h). */
#pragma once

#include "products/exact/primitive.h"
#include "whole/state.h"

/* In ASSEMBLE: moves run->finished and run->output, and says in the report onto what. is_cage: the quads are those of a
   limit surface, so that only what is flat all around stays in its plane. evens: rows and circles are made even. */
void qw_make_exact(qw_run_state *run, bool is_cage, bool evens);

/* The planes, cylinders and cones of the surface, as the output has its coordinates; of: uint32_t[count], the one next
   to each point of the output, or QW_NONE. In the current scope. */
const qw_primitive *qw_find_designed(qw_run_state *run, double (*point)[3], uint32_t count, uint32_t *of);

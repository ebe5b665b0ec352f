/* The quads of a designed part on its planes, cylinders and their like (products/exact/exact.h). */
#ifndef QW_RUN_STAGES_DESIGNED_H
#define QW_RUN_STAGES_DESIGNED_H

#include "whole/state.h"

/* In ASSEMBLE: moves run->finished and run->output, and says in the report onto what. is_cage: the quads are those of a
   limit surface, so that only what is flat all around stays in its plane. evens: rows and circles are made even. */
void qw_make_exact(qw_run_state *run, bool is_cage, bool evens);

#endif

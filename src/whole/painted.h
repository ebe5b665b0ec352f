/* The density that a host has painted on the input, as the surface of a run sees it. */
#ifndef QW_WHOLE_PAINTED_H
#define QW_WHOLE_PAINTED_H

#include "whole/state.h"

/* qw_density[run->surface.vertex_count], in the current scope; NULL where none was painted. Needs what CLEAN leaves,
   and run->surface. */
qw_density *qw_painted_density(const qw_run_state *run);

/* The same at the vertices of the clean surface, qw_density[run->clean.mesh.vertex_count]. Where one was painted. */
qw_density *qw_painted_at_clean(const qw_run_state *run);

#endif

/* How many quads the options ask for. */
#pragma once

#include "whole/state.h"

/* What the options ask for, from 1 to 2e7. Needs what CLEAN leaves. */
double qw_faces_wanted(const qw_run_state *run, const qw_options *options);

/* Fails with QW_OPTION where an edge length or a ratio asks for more than there can be. */
void qw_require_few_faces(const qw_run_state *run);

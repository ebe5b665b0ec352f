/* The pipeline: remesh.c names the stages in their order. */
#pragma once

#include "run/driver.h"

/* Runs the stages up to and including `last` with these options, those that an earlier call has finished excepted where
   these options change nothing in them. */
qw_status qw_remesh_until(qw_context_state *c, const qw_options *options, qw_stage last);

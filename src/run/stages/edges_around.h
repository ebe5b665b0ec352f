/* How many edges the result has around the circles of the surface. */
#pragma once

#include "whole/state.h"

/* Warns where closed curves without corners have fewer edges around than the option `around` asks for. */
void qw_report_edges_around(qw_run_state *run, const qw_quadmesh *quads);

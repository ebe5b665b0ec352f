/* Sharp edges that the result does not have: how much of them, and how many quads would do. */
#pragma once

#include "whole/state.h"

/* Sets report->lost_edges and report->faces_for_edges of the quads, and warns where a sharp edge is gone. */
void qw_report_lost_edges(qw_run_state *run, const qw_quadmesh *quads);

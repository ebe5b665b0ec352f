/* Which way the caller wants the crosses, at the vertices of the working mesh. */
#pragma once

#include "whole/state.h"

/* Tangents to run->normal, as long as they count, 0 to 1: qw_vec3[working vertices] in the current scope; NULL where
   the caller asks for nothing. Needs what WORKING leaves. */
qw_vec3 *qw_directions_asked(const qw_run_state *run);

/* report->field_angle of the quads, which are in the frame of the whole. */
void qw_report_field_angle(qw_run_state *run, const qw_quadmesh *quads);

/* How much quads are relaxed along run->alignment: `follow`, but where the caller asks for directions no less than is
   usual. */
double qw_lines_followed(const qw_run_state *run);

/* The plane along which the core was cut from the whole, and the frames of both. */
#pragma once

#include "whole/state.h"

/* Whether a point, in the frame of the core, lies in the plane of the cut. */
bool qw_is_in_cut(const qw_run_state *run, qw_vec3 point);

/* The point in the frame of the core as one in the frame of the whole, and the scale from the one to the other. */
qw_vec3 qw_in_whole(const qw_run_state *run, qw_vec3 point);
double qw_whole_scale(const qw_run_state *run);

/* How the input moves, on the surfaces of a run. */
#pragma once

#include "whole/state.h"

/* Wanted edges become so many times shorter at the most. */
#define QW_MOST_SHORTER 1.5f

/* Whether skin weights or targets steer the run. */
bool qw_follows_motion(const qw_run_state *run);

/* qw_motion_at_points in the frame of the run. */
qw_vec3 *qw_motion_on(const qw_run_state *run, const qw_vec3 *point, const qw_vec3 *normal, uint32_t count);

/* Whether quads of a size are small enough for a change: 1 where half of the rows that are wanted fit across it, so
   that edges that are somewhat shorter make three, and from there down to 0 where three eighths do. */
float qw_room_of_motion(float size, qw_vec3 change);

/* Shortens the wanted edges at the vertices of run->surface so that some rows lie where movement changes. */
void qw_fit_motion(const qw_run_state *run, float *size);

/* The planes along which the core was cut from the whole, and the frames of both. */
#pragma once

#include "whole/state.h"

/* The planes of the cut in which a point, in the frame of the core, lies: bit i, in run->input.cut[i]. */
uint8_t qw_cuts_at(const qw_run_state *run, qw_vec3 point);

/* uint8_t[mesh->vertex_count]: the same of all vertices of the surface or the working mesh, of the planes about which
   each vertex' component is reflected. In the current scope. */
uint8_t *qw_find_cuts(const qw_run_state *run, const qw_trimesh *mesh);

/* The same planes in the frame of the core: double[cuts][4], unit normals and offsets. In the current scope. */
double *qw_cuts_in_frame(const qw_run_state *run);

/* The point in the frame of the core as one in the frame of the whole, and the scale from the one to the other. */
qw_vec3 qw_in_whole(const qw_run_state *run, qw_vec3 point);
double qw_whole_scale(const qw_run_state *run);

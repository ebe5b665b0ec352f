/* What is done to the input before it is a surface: a skin about it, with --wrap, or holes closed, with --fill-holes.
 */
#pragma once

#include "whole/state.h"

/* Sets run->whole.clean, as qw_clean_surface would, to a skin of the input; the polygon that each of its triangles
 * comes from is the nearest one. */
void qw_wrap_whole(qw_run_state *run);
/* What of the input is seen from outside, as triangles that face both ways, in the frame of the quads; *mesh and the
   tree, which refers to it, are of the current scope. NULL: there is no skin. */
qw_bvh *qw_seen_of_input(qw_run_state *run, qw_trimesh *mesh);
/* Closes holes of run->whole.clean: the option fill_holes. */
void qw_close_holes(qw_run_state *run);
/* Whether the skin depends on how many quads are wanted. */
bool qw_wraps_by_count(const qw_options *options);

/* Whether so many parts of the clean surface hide one another, or have so few quads, that a wrap would serve better:
 * finds run->whole.hidden; and says so. */
void qw_look_for_soup(qw_run_state *run);
void qw_advise_wrap(qw_run_state *run);

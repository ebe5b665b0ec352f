/* The lines that a caller has drawn: on which edges of the result are to lie, or along which quads are to run. */
#pragma once

#include "whole/state.h"

/* What steers the whole, with the joints behind its guides as guides of the kind QW_GUIDE_JOINT. */
qw_steering qw_steering_with_joints(const qw_run_state *run);

/* Makes the loops among the guides marked edges of run->surface, which has its other marks. Fails with QW_ARGUMENT
   where a guide is off the surface. */
void qw_engrave_guides(qw_run_state *run);

/* Necks of run->surface, as strongly as the option `rings` says (remesh/sizes/necks.h); none where it asks for none. In
   the current scope. */
qw_necks qw_necks_of_surface(const qw_run_state *run, double rho);

/* Makes those that can be drawn on the surface curves of nests, after the joints that have room, and so openings:
   run->necks. Whether there are any, and marks on the surface for them. rho: mean edge of the quads. */
bool qw_engrave_necks(qw_run_state *run, double rho, const qw_necks *found);

/* Adds to the directions asked for, qw_vec3[working vertices], what guides of direction ask for beside them. */
void qw_add_guide_directions(const qw_run_state *run, qw_vec3 *asked);

/* Whether there are guides of a kind. */
bool qw_has_guides(const qw_run_state *run, qw_guide_kind kind);

/* report->guide_off of the quads. */
void qw_report_guides(qw_run_state *run, const qw_quadmesh *quads);

/* Guides as curves in the frame: those with rings as the smooth curves that they stand for, and the nests around them.
 */
#pragma once

#include "remesh/sizes/nests.h"
#include "whole/state.h"

/* A polygon with rings that a person drew stands for a smooth curve: each step is halved so often by the interpolating
   four-point scheme of Dyn, Levin and Gregory (1987). */
enum { QW_HALVINGS = 2, QW_FINER = 1 << QW_HALVINGS };

static inline bool qw_has_rings(const qw_run_state *run, uint32_t guide)
{
    return run->steering.guide_rings[guide] > 0;
}

/* All guides as they were drawn, in the frame: qw_vec3[points]. */
qw_vec3 *qw_guides_in_frame(const qw_run_state *run);

/* Points of a guide: those that were drawn, or of the smooth curve through them. */
uint32_t qw_smooth_count(const qw_run_state *run, uint32_t guide);
/* Writes them. point: of qw_guides_in_frame. */
void qw_smooth_guide(const qw_run_state *run, uint32_t guide, const qw_vec3 *point, qw_vec3 *smooth);

/* The nests that guides ask for (remesh/sizes/nests.h), rings as far as quads of this edge allow, and those of
   run->necks, of which some may have no room; in the current scope. */
qw_nests qw_nests_of_guides(const qw_run_state *run, double rho);

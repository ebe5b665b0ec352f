/* Openings that have rings around them: eyes, mouths, sleeves and collars of surfaces that end there. */
#pragma once

#include "whole/state.h"

typedef struct qw_openings {
    qw_necks curves;
    uint32_t *half; /* beside curves.point: the half-edge of the boundary that begins there */
} qw_openings;

/* The boundary loops that are round or a slit and whose q (remesh/sizes/necks.h), for the area of the whole surface, is
   small enough; of loops that a cut halves, the halves. None that was drawn. rho: mean edge of the quads. In the
   current scope. */
qw_openings qw_find_openings(const qw_run_state *run, double rho);

/* Marks them on the surface as curves of nests. */
void qw_mark_openings(qw_run_state *run, const qw_openings *openings);

/* Marks the opening around which a curve was drawn that is nowhere farther from it than this, if there is one; returns
   of how many edges it is. Beside it there would be no room for a row of quads. */
int64_t qw_mark_drawn_opening(qw_run_state *run, const qw_vec3 *point, uint32_t count, float near);

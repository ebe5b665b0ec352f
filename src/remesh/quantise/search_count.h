/* The steps of the search for integers that bring the number of quads within the promise where no size does: lengths of
 * small components, or single curves, are made longer or shorter by whole quads. */
#pragma once

#include "remesh/quantise/search_state.h"

/* Where all sizes miss the count because rows of quads run along many curves at once: makes single curves of trial t a
   quad longer or shorter (nudge.h), and judges it anew. others: area of the other components. work: as of
   qw_nudge_area. */
void qw_nudge_trial(qw_env *env, const qw_search *s, qw_trial *t, double others, double *work);

/* For small components without faults, tries the offsets nearest to the real ones
   (nearest.h). */
void qw_search_nearest(qw_env *env, qw_search *s);

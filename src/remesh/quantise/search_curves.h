/* The last steps of the search for integers: curves that touch are parted, and lines of edges are made to meet. */
#pragma once

#include "remesh/meetings/meetings.h"
#include "remesh/quantise/search_state.h"

/* Parts curves that touch (touching.h), at the size that was kept and, as long as the count is missed, at smaller
   ones. */
void qw_search_part_curves(qw_env *env, qw_search *s);

/* Makes closed curves even (closed_curves.h) as far as the count stays. */
void qw_search_make_even(qw_env *env, qw_search *s);

/* Makes lines meet (meetings.h) as far as the count and the topology stay. share, strips_share: as in
   qw_meeting_request, of all components. Returns the sums over the components. */
qw_meeting_counts qw_search_meet(qw_env *env, qw_search *s, double share, double strips_share);

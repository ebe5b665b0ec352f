/* Lines that meet: the integers of a component are changed so that lines which leave its cones end soon at others.
 *
 * A quad mesh is cut into patches by the lines of edges that leave its irregular vertices straight on, each until it
 * meets another irregular vertex. Where integers are only near their real values most lines miss each other by a quad
 * or two and run on, until they have cut nearly every loop. Two cones lie on one line exactly where the offset between
 * them has no part across it. So segments between cones become edges of the complex (remesh/meetings/segment.h) that
 * are held on a lattice line, as those of feature curves are, one by one; the offsets are closed again by the cheapest
 * walks; and what makes all lines together shorter, for little distortion, is kept.
 *
 * Patches are as many as crossings of lines, but for a constant (Euler), so few where lines are short. That the
 * positions of singularities are chosen for a coarse layout is an idea of Campen and Kobbelt 2014 and Lyon et al. 2021;
 * the method here is our own. */
#pragma once

#include "remesh/quantise/complex_components.h"

typedef struct qw_meeting_request {
    const qw_real2 *real; /* qw_real2[edges of the component]: what the integers are near to */
    double loops;         /* as the option, above 0 */
    double least_area;    /* of the component's complex, in quads */
    double most_area;     /* nothing is tried where it is not above 0 */
    /* of the area, as the count is promised; beyond least_area and most_area at a cost */
    double least_promised, most_promised;
    double share, strips_share; /* of all the work that may be done, as there are other components: for lines, which are
                                   kept as they are where it is 0, and for strips */
} qw_meeting_request;

typedef struct qw_meeting_counts {
    uint32_t tried, kept;
    int64_t length_before, length_after; /* of all lines, in quads */
} qw_meeting_counts;

/* d: qw_int2[edges of the component], which obey Eq. (3) and do so afterwards. */
qw_meeting_counts qw_make_meetings(qw_env *env, const qw_component *component, const qw_meeting_request *request,
                                   qw_int2 *d);

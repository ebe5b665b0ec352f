/* Integer offsets for a decimated complex. Several sizes of the quads are tried for each connected component, and the
 * combination is taken that comes nearest to the closed real offsets and to the wanted count (search_sizes.h). Where no
 * size meets the count, small components get other lengths (search_count.h). Then curves that touch are parted and
 * lines are made to meet (search_curves.h). */
#pragma once

#include "remesh/meetings/meetings.h"
#include "remesh/quantise/regular.h"
#include "remesh/quantise/search_request.h"

typedef struct qw_search_result {
    double *scale;                /* double[components]: the size taken */
    double area;                  /* in quads */
    double rounding_cost;         /* mean of w (z - x)^2 over the edges */
    uint32_t inverted, collapsed; /* triangles that have an area, components that vanish */
    uint32_t touching;            /* how often curves touch: touching.h */
    uint32_t tries;               /* sizes tried */
    qw_regular_counts regular;    /* summed over the components */
    qw_meeting_counts meetings;   /* summed over the components */
} qw_search_result;

/* d: qw_int2[edges of the whole], receives what was found. Components get signs (touching.h) where the request is that
   curves are parted, some touched, and a search with signs parted them. In the current scope. */
qw_search_result qw_search_integers(qw_env *env, qw_components *components, const qw_search_request *request,
                                    qw_int2 *d);

/* Integer offsets for a decimated complex: several sizes of the quads are tried for each connected component, and
   the combination is taken that together comes nearest to the closed offsets and to the count. Where a component has
   inverted triangles at every size, noise is added to its offsets before they are rounded. */
#ifndef QW_INTEGER_SEARCH_H
#define QW_INTEGER_SEARCH_H

#include "integer/meetings.h"
#include "integer/regular.h"

typedef struct qw_search_wish {
    double quads;
    double size;       /* factor of the lengths, around which sizes are tried */
    const double *cut; /* double[components]: area of the surface that the decimated complex lacks, as it cuts across
                          boundaries that nothing holds; it counts as it is */
    double loops;      /* how much lines are made to meet, as the option; 0: not at all */
    bool apart;        /* curves are to be parted where they touch (touching.h); complexes have their signs then */
} qw_search_wish;

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

/* d: qw_int2[edges of the whole], receives what was found. In the current scope. */
qw_search_result qw_search_integers(qw_env *env, const qw_components *components, const qw_search_wish *wish,
                                    qw_int2 *d);

#endif

/* Whole offsets for a decimated complex: several sizes of the quads are tried, component by component, and of each
 * component is taken what together comes nearest to the closed offsets and to the count. Where a component has
 * triangles inverted whatever the size, noise is added to what it is rounded from. */
#ifndef QW_INTEGER_SEARCH_H
#define QW_INTEGER_SEARCH_H

#include "integer/components.h"
#include "integer/regular.h"

typedef struct qw_search_wish {
    double quads;
    double size;       /* that the lengths are multiplied by where sizes are tried around */
    const double *cut; /* double[components]: area of the surface that the decimated complex lacks, as it cuts across
                          boundaries that nothing holds; it counts as it is */
} qw_search_wish;

typedef struct qw_search_result {
    double *scale;                /* double[components]: the size taken */
    double rounding_cost;         /* mean of w (z - x)^2 over the edges */
    uint32_t inverted, collapsed; /* triangles that have an area, components that vanish */
    uint32_t tries;               /* sizes tried */
    qw_regular_counts regular;    /* summed over the components */
} qw_search_result;

/* d: qw_int2[edges of the whole], receives what was found. In the current scope. */
qw_search_result qw_search_integers(qw_env *env, const qw_components *components, const qw_search_wish *wish,
                                    qw_int2 *d);

#endif

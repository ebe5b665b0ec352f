/* What the search for integers is asked for. */
#pragma once

#include <stdbool.h>

typedef struct qw_search_request {
    double quads;      /* wanted number of quads of the whole surface */
    double times;      /* as in base/promise.h */
    double size;       /* factor of the real offsets, around which sizes are tried */
    const double *cut; /* double[components], squares of the wanted edge length: the area of the surface that the
                          decimated complex lacks, where its edges cut off a part of a boundary without a feature
                          constraint. Scaled by the size, it is added to the number of quads. */
    double loops;      /* the option of that name: how much lines are made to meet; 0: not at all */
    double effort;     /* share of the usual effort, up to 1 */
    bool apart;        /* curves that touch are to be parted (touching.h), for which the complexes get signs */
} qw_search_request;

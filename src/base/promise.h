/* What is promised of the face count, and the bounds that follow. */
#pragma once

#include "base/constants.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* A count may be off by this share of the one wanted. times, here and below: how often the quads that are counted are
   in the result, 2 for one side of a symmetric mesh. */
static inline double qw_count_tolerance(double wanted, double times)
{
    return times * wanted < QW_FEW_FACES ? QW_COUNT_TOLERANCE_FEW : QW_COUNT_TOLERANCE;
}

static inline bool qw_is_near_count(double wanted, double faces, double times)
{
    return fabs(faces / wanted - 1) <= qw_count_tolerance(wanted, times);
}

/* So few inverted triangles are no reason for another attempt at all integers. */
static inline bool qw_is_little_inverted(double wanted, double inverted)
{
    return inverted > 0 && inverted <= QW_LITTLE_INVERTED * wanted;
}

/* Ratio of the larger to the smaller, 1 or more. */
static inline double qw_count_error(double wanted, double faces)
{
    return fmax(faces / wanted, wanted / fmax(faces, 1));
}

/* The least and the most faces that use up `share` of the tolerance. */
static inline int64_t qw_least_faces(double wanted, double share, double times)
{
    double least = wanted * (1 - share * qw_count_tolerance(wanted, times));
    return (int64_t)least + ((double)(int64_t)least < least);
}
/* No less than qw_least_faces: where the tolerance of a few quads holds no whole number, the next one above it. */
static inline int64_t qw_most_faces(double wanted, double share, double times)
{
    int64_t most = (int64_t)(wanted * (1 + share * qw_count_tolerance(wanted, times))),
            least = qw_least_faces(wanted, share, times);
    return most > least ? most : least;
}

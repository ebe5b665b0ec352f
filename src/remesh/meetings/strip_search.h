/* A search for integers with fewer strips that cross themselves (strips.h).
 *
 * Meetings shorten lines between cones one by one, each of which must pay at once. Whether a strip crosses itself
 * depends on all integers along it: a helix around a limb comes back beside its start, and becomes rings where the
 * translation across is made zero (Bommes, Lempfer and Kobbelt 2011). So closed moves of the integers, circuits along
 * which single offsets rise or fall by one, are taken at random, also when they make matters worse by less than a
 * threshold that falls to zero (threshold accepting, Dueck and Scheuer 1990). Of several such searches, which begin
 * with different thresholds, the best is taken. */
#pragma once

#include "remesh/meetings/tries.h"

typedef struct qw_strip_search_counts {
    uint32_t tried, kept; /* moves */
    double freed;         /* quads by which strips that cross themselves have become fewer */
} qw_strip_search_counts;

/* c: the component's, with scaled lengths; c->d obeys what the terms ask for, before and after. share: of all the work
   that may be done. lane_bytes: as of qw_tries_begin. */
qw_strip_search_counts qw_search_strips(qw_env *env, const qw_meeting_terms *terms, qw_complex *c, double share,
                                        size_t lane_bytes);

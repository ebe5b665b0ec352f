/* A search for integers with fewer strips that cross themselves (strips.h).
 *
 * Meetings shorten lines between cones one by one, each of which must pay at once. Whether a strip crosses itself
 * depends on all integers along it: a helix around a limb comes back beside its start, and becomes rings where the
 * translation across is made zero (Bommes, Lempfer and Kobbelt 2011). So closed moves of the integers, circuits along
 * which single offsets rise or fall by one, are taken at random, also when they make matters worse by less than a
 * threshold that falls to zero (threshold accepting, Dueck and Scheuer 1990). There are several such searches, which
 * begin with different thresholds; where there are so few edges that all pairs of moves could be
 * tried, one of them slips along strips as well. */
#pragma once

#include "remesh/meetings/tries.h"

enum { QW_STRIP_SEARCHES = 3 };

/* What a search has found. */
typedef struct qw_strip_find {
    qw_int2 *d;           /* qw_int2[edges] */
    uint32_t tried, kept; /* moves */
    double freed;         /* quads by which strips that cross themselves have become fewer */
    double score;         /* quads: what it lowers */
} qw_strip_find;

/* c: the component's, with scaled lengths; c->d obeys what the terms ask for, and so does what is found. share: of all
   the work that may be done. lane_bytes: as of qw_tries_begin. Returns how many searches there were. In the current
   scope. */
uint32_t qw_search_strips(qw_env *env, const qw_meeting_terms *terms, const qw_complex *c, double share,
                          size_t lane_bytes, qw_strip_find found[QW_STRIP_SEARCHES]);

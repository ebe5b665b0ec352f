/* Pairs of lines that may meet: what is seen from a cone along its lines, in the real layout. */
#pragma once

#include "remesh/meetings/segment.h"

typedef struct qw_candidate {
    qw_segment segment;
    uint32_t from, line, end_line; /* vertex; numbers of the lines at both ends */
    double ahead, aside;           /* quads along the line and across it to the other cone */
    double gain;                   /* quads by which the two lines become shorter */
    double turned;                 /* 1 + aside^2 */
    double key;                    /* the larger, the sooner it is tried */
    bool misses_count;             /* a try at it failed as there would have been too many quads, or too few */
} qw_candidate;

typedef struct qw_candidates {
    qw_candidate *found;
    size_t count, room;
} qw_candidates;

typedef struct qw_outlook {
    const qw_layout *layout; /* numbered */
    const int32_t *length;   /* as qw_layout_measure leaves it */
    double reach;            /* quads along a line: those farther off are not found */
    bool nearest_first;      /* sorted by distance (ahead times turned) rather than by gain over turned */
} qw_outlook;

/* Quads along a line: cones farther off are not looked for. */
extern const double QW_FARTHEST_CONE;

/* Adds the candidates that are seen from the tails of the half-edges begin <= h < end, each into its triangle. */
void qw_add_candidates(qw_env *env, const qw_outlook *outlook, uint32_t begin, uint32_t end, qw_candidates *to);
/* The most promising first; in the same order however they were found. */
void qw_sort_candidates(qw_candidates *c);
/* The same two cones, either seen from the other in the same place. */
bool qw_is_same_candidate(const qw_candidate *a, const qw_candidate *b);

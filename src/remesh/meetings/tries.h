/* Tries to make two lines meet, each from the same layout: they do not depend on one another, so several are made
 * side by side, and the first that can be kept is taken, as if they had been made one after the other. */
#pragma once

#include "base/lanes.h"
#include "remesh/meetings/candidates.h"
#include "remesh/meetings/strips.h"
#include "remesh/quantise/closed_curves.h"

/* What decides whether a try is kept: the same for all of a search. */
typedef struct qw_meeting_terms {
    const qw_component *component;
    const qw_int2 *first;                 /* the component's offsets before the search */
    double first_area;                    /* theirs, in quads */
    uint32_t inverted, touching;          /* triangles of theirs, and how often their curves touch */
    qw_closed_curves curves;              /* those that are closed, */
    uint32_t odd;                         /* and how many have an odd number of quads */
    double worth;                         /* quads that lines must become shorter by for a unit of energy */
    double least_area, most_area;         /* quads */
    double least_promised, most_promised; /* quads */
    int32_t longest;                      /* quads: the longest that a line can count */
    /* Tries are accepted by an estimate of what they save, not by measuring what they did. */
    bool accepts_by_estimate;
    double best_score; /* of what has been found so far */
} qw_meeting_terms;

/* A layout and what is measured of it. */
typedef struct qw_measured_layout {
    qw_layout layout;
    bool is_numbered;     /* the layout's lines have been numbered since it was changed, but for its integers */
    int32_t *length;      /* int32_t[QW_MOST_LINES V]: of lines, as qw_layout_measure leaves them */
    qw_complex source;    /* the component's, with scaled lengths and the offsets of its edges that the layout's are */
    double lines, energy; /* quads: length of all lines; energy of the map from the real to the integer complex */
} qw_measured_layout;

/* Room for layouts of so many faces. real: qw_real2[edges], the component's scaled lengths. */
qw_measured_layout qw_measured_layout_make(qw_env *env, const qw_component *component, const qw_real2 *real,
                                           uint32_t room);
/* Begins anew with offsets d of the component. */
void qw_measured_layout_fill(const qw_meeting_terms *terms, qw_measured_layout *m, const qw_int2 *d);
/* Measures the energy of the layout with its integers as they are; false where they have faults. */
bool qw_measure_energy(const qw_meeting_terms *terms, qw_measured_layout *m);
/* Length of all lines if the quads were as many as the first offsets have: fewer and larger ones are no gain. False
   where it is not less than `most`; then it may not be known. */
bool qw_measure_lines(const qw_meeting_terms *terms, qw_measured_layout *m, double most);

/* How far an area is beyond the bounds, in quads. */
double qw_area_beyond(double least, double most, double area);

/* Where tries are made. */
typedef struct qw_tries qw_tries;
/* lane_bytes: memory of each lane; there is a lane for each thread, up to four. 0: no lanes. Work for which a lane has
   too little memory is done again in the memory of the run. */
qw_tries *qw_tries_begin(qw_env *env, const qw_meeting_terms *terms, const qw_real2 *real, uint32_t room,
                         size_t lane_bytes);
void qw_tries_end(qw_tries *a);
/* All candidates that are seen so far off, the most promising first. */
void qw_tries_find(qw_env *env, qw_tries *a, const qw_outlook *outlook, qw_candidates *found);
/* Makes tries at these candidates, from `now`, until one can be kept, whose layout takes the place of `now`. Returns
   its index, or count. Those before it have their misses_count set. */
uint32_t qw_tries_make(qw_env *env, qw_tries *a, qw_candidate *const *candidate, uint32_t count,
                       qw_measured_layout *now);

/* Why a run is repeated, and what changes then: a plan is all that may differ between two attempts, a verdict is what
 * one attempt was like, and the next plan is a pure function of both (tests/test_retry.c has tables of them).
 *
 * An attempt begins with a plan. After each judged stage (the rows of retries.def) the driver adds to its verdict what
 * can be seen there, and asks qw_next_step: either the run goes on, with this attempt or with an earlier one that was
 * kept, or it goes back with another plan, which begins the next attempt.
 */
#pragma once

#include "whole/plan.h"

#include "quadwright/quadwright.h"

typedef enum qw_retry {
#define QW_RETRY(name, after, back, most, sentence) QW_RETRY_##name,
#include "run/retries.def"
    QW_RETRIES,
    QW_NO_RETRY = QW_RETRIES,
} qw_retry;

typedef struct qw_retry_row {
    const char *name;
    qw_stage after, back;
    uint32_t most;
    const char *sentence;
} qw_retry_row;
extern const qw_retry_row qw_retry_rows[QW_RETRIES];

/* Whether nothing is kept of what came before: a retry after the last stage. */
static inline int qw_begins_anew(const qw_retry_row *row) { return row->after + 1 == QW_STAGE_COUNT; }

/* What an attempt was like: 0 what has not been judged yet. Flags are 0 or 1. */
typedef struct qw_verdict {
    /* after INVERSIONS */
    int64_t inverted; /* triangles that the integers leave inverted */
    /* after REPAIR */
    uint32_t topology_lost; /* flag: the quads of a component do not have its topology */
    /* after SIMPLIFY */
    double faces; /* quads */
    /* after RELAX */
    double uncovered;     /* area that the quads leave uncovered, in quads */
    double flipped;       /* quads: 1 that may be flipped, 2 one that certainly is */
    double lacking;       /* quads that protrusions needed and had no room for, until it was made; 0: none */
    double misshapen;     /* what this left, in quads: too long ones, and six for each protrusion that is lost */
    uint32_t protrusions; /* that RELAX let grow; a repeated attempt has to grow them again */
    uint32_t working_vertices;
    /* after ASSEMBLE */
    uint32_t sides_apart;  /* flag: one side sewn to its reflection is not the surface that it is to be */
    uint32_t sides_unlike; /* qw_unlike */
    uint32_t has_rings;    /* flag: there are rings that were found */
    uint32_t has_across;   /* flag: one side was cut again by planes across the first */
    uint32_t count_off;    /* flag: both sides together have not the count that is promised */
    uint32_t rims_flipped; /* quads beside the rim of a region that are flipped or have no area */
    uint32_t lacks_room;   /* after INVERSIONS: 1: cones cut the surface into more triangles than quads are wanted, or
                              lines run together over much of it; 2: into many times as many */
    /* after REPAIR or RELAX */
    uint32_t places; /* where topology was lost, area is uncovered or quads are flipped, if smaller quads can be had */
} qw_verdict;

typedef struct qw_attempt {
    qw_plan plan;
    qw_verdict verdict;
    qw_retry cause;  /* why it was begun; QW_NO_RETRY: it is the first */
    uint32_t judged; /* the last stage judged, plus 1; 0: none yet */
} qw_attempt;

/* What does not change between attempts. */
typedef struct qw_request {
    /* needed: the least number of quads in which all components keep their topology */
    double faces_wanted, faces_needed;
    /* flag: integers come from closed offsets; the paper's flows know no plan but the size factor */
    uint32_t is_closed;
    uint32_t repairs;          /* flag: the option */
    double times_used;         /* of base/promise.h */
    uint32_t planes;           /* flag: a plane of symmetry may be given up for another or none */
    uint32_t symmetry_is_free; /* flag: it is, at once, where it costs quads */
    uint32_t hurries;          /* flag: the run does not go back for its coverage */
    uint32_t components;
} qw_request;

/* Seven rounds (one for the topology, one for protrusions, four for the coverage) of six attempts (one for inverted
   triangles, four for the count) are 42. A retry after the last stage begins the history
   anew. */
enum { QW_MAX_ATTEMPTS = 42, QW_NO_ATTEMPT = 0xffff };
typedef struct qw_history {
    qw_request request;
    uint32_t count, current; /* current: the attempt that the run goes on with */
    uint32_t earlier;        /* attempts before the history was begun anew */
    uint32_t unused;         /* 0 */
    qw_attempt attempt[QW_MAX_ATTEMPTS];
} qw_history;

/* Decision after a judged stage. */
typedef struct qw_step {
    qw_retry cause; /* QW_NO_RETRY: the run goes on with `best` */
    /* the best attempt so far of those that compete; kept, or continued with. QW_NO_ATTEMPT: none is kept */
    uint32_t best;
    qw_plan plan; /* of the next attempt */
} qw_step;
qw_step qw_next_step(const qw_history *history, qw_stage judged);

/* A history of one attempt, with the plan that every run begins with. */
void qw_history_begin(qw_history *history);
/* Adds the attempt that the step asks for, which is then the current one; alone, where the retry goes back from the
   last stage: none before it can be chosen any more. */
void qw_history_go_back(qw_history *history, const qw_step *step);

/* A sentence that says why a history read from a file is impossible after so many stages, or NULL where it is
   possible. Kept attempts do not outlive a call: in a dump only the current attempt can have reached the last stage
   or still be chosen. */
const char *qw_history_fault(const qw_history *history, uint32_t finished);

/* The last judged stage that has led to a retry, or -1, and the first stage that one has gone back to, or
   QW_STAGE_COUNT. */
int qw_history_asked_by(const qw_history *history);
qw_stage qw_history_went_to(const qw_history *history);

/* Whether fewer faces are wanted than the components need: then no plan leads to fewer. */
static inline int qw_is_too_few(const qw_request *r) { return r->faces_wanted < r->faces_needed; }

/* The count that sizes aim at: what was asked for, or the least that the components can have where that is more. */
static inline double qw_faces_aimed_at(const qw_request *r)
{
    return qw_is_too_few(r) ? r->faces_needed : r->faces_wanted;
}

/* Runs a state's stages with their reports, as the public functions ask for, again and again as retry.h says.
 *
 * An attempt that a later one may turn out to be worse than is kept as a candidate: all that its stages have left, with
 * the memory that it lies in, so that the run can go on with it as if no other had followed. There is at most one for
 * each loop: for the retries that go back to REGULAR, to SCALE and to WORKING.
 */
#pragma once

#include "run/retry.h"
#include "whole/state.h"

typedef struct qw_attempt_result {
    uint32_t attempt; /* its number in the history, or QW_NO_ATTEMPT: none is kept */
    int first, done;  /* its stages are first .. done - 1 */
    qw_run_state run;
    qw_report report;
    uint32_t warnings_before[QW_STAGE_COUNT];
} qw_attempt_result;

typedef struct qw_context_state {
    qw_env *env;
    qw_run_state run;
    qw_report report;
    int done;   /* stages finished, in order: 0 .. QW_STAGE_COUNT; each has a memory scope of its own, opened in that
                   order */
    bool works; /* the present call has a stage to run */
    qw_options used;      /* the options that the finished stages ran with */
    qw_clean_input input; /* its arrays are blocks of the scope outside all stages */
    bool has_input;
    qw_steering steering;                     /* the same of its arrays */
    uint32_t warnings_before[QW_STAGE_COUNT]; /* report.warning_count when the stage began */

    struct qw_carried *carried; /* what attributes are carried over with, in the scope of FINISH; NULL: not asked for */
    struct qw_asset *asset;     /* texture coordinates and maps, the same; NULL: not asked for */
    qw_vec3 *told;              /* the field at the elements of the input, for qw_get_field, in the scope of the last
                                   stage; NULL: not asked for */

    qw_history history;
    qw_refinement refinement[QW_MAX_REFINEMENTS]; /* those of all rounds, in order */
    qw_attempt_result candidate[QW_ASIDE_SLOTS];  /* the memory of each is in the slot of its number */
} qw_context_state;

/* What remesh.c is made of: runs the next stage with its report, and for one that retries are judged after decides
   whether the run goes on or back (run/retry.h). */
typedef void (*qw_stage_function)(qw_run_state *run);
qw_status qw_run_stage(qw_context_state *c, qw_stage_function function);
qw_status qw_run_judged_stage(qw_context_state *c, qw_stage_function function);

/* Before and after the stages of one call up to `last`: at first the results that the new options would change are
   forgotten, at the end the attempts that were kept to go back to. */
void qw_begin_drive(qw_context_state *c, const qw_options *options, qw_stage last);
void qw_end_drive(qw_context_state *c, qw_status status);

/* Forgets the mesh and all that was made of it: the state of a context that has just been made. */
void qw_forget_mesh(qw_context_state *c);

/* Forgets the mesh and takes another, whose arrays are blocks of the innermost scope. */
void qw_replace_mesh(qw_context_state *c, const qw_clean_input *input);

/* Forgets all that was made of the mesh and paints a density on it, a block of the innermost scope with one for each
   vertex of the input; NULL: none. */
void qw_replace_density(qw_context_state *c, const qw_density *density);
/* Forgets all that was made of the mesh, and steers by this from now on: arrays that are not those of before are blocks
   of the innermost scope. */
void qw_replace_steering(qw_context_state *c, const qw_steering *steering);

/* Runs a state's stages with their reports, as the public functions ask for. */
#ifndef QW_DRIVER_H
#define QW_DRIVER_H

#include "remesh.h"

typedef struct qw_context_state {
    qw_env *env;
    qw_run_state run;
    qw_report report;
    int done; /* stages finished, in order: 0 .. QW_STAGE_COUNT; each has a memory scope of its own, opened in that
                 order */
    qw_options used;      /* the options that the finished stages ran with */
    qw_clean_input input; /* its arrays are blocks of the scope outside all stages */
    bool has_input;
    int asked_by, went_to; /* the last stage that asked for another attempt and the first gone back to; -1 and
                              QW_STAGE_COUNT: none */
    uint32_t warnings_before[QW_STAGE_COUNT]; /* report.warning_count when the stage began */
} qw_context_state;

qw_status qw_drive(qw_context_state *c, const qw_options *options, qw_stage last);
/* Forgets the mesh and all that was made of it: the state of a context that has just been made. */
void qw_forget_mesh(qw_context_state *c);

/* Forgets the mesh and takes another, whose arrays are blocks of the innermost scope. */
void qw_replace_mesh(qw_context_state *c, const qw_clean_input *input);

#endif

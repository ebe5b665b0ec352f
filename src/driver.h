/* Runs a state's stages with their reports, as the public functions ask for. */
#ifndef QW_DRIVER_H
#define QW_DRIVER_H

#include "remesh.h"

/* A mesh as a caller of the library sees it, owned by one block list of the environment. */
typedef struct qw_context_state {
    qw_env *env;
    qw_run_state run;
    qw_report report;
    int done; /* stages finished, in order: 0 .. QW_STAGE_COUNT; each has a memory scope of its own, opened in that order */
    qw_options used; /* the options that the finished stages ran with */
    qw_clean_input input;
    bool has_input;
} qw_context_state;

qw_status qw_drive(qw_context_state *c, const qw_options *options, qw_stage last);
/* Forgets the results of `first` and all later stages. */
void qw_discard_from(qw_context_state *c, qw_stage first);

#endif

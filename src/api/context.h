/* A context as the public functions hold it. */
#ifndef QW_CONTEXT_H
#define QW_CONTEXT_H

#include "run/driver.h"
#include "symmetry/plane.h"

struct qw_context {
    qw_context_state state;
    qw_host host;
    char message[512]; /* of a failure that happened outside the environment */
    qw_status status;
    double told; /* the largest share of the current run that the host was told of */

    /* of a symmetric run (symmetric.c) */
    qw_context *half;                       /* which remeshes one side; NULL: none */
    qw_mirror_search found[QW_MOST_PLANES]; /* of the surface that state.begun had the number `searched` for */
    uint32_t planes, plane;                 /* how many were found, and which of them is used */
    uint32_t clean_warnings;                /* warnings in the report before the search's own */
    double cut[4];                          /* of the half's input (mesh/clean_input.h) */
    qw_mirror_plane half_plane;             /* the half lies above it */
    qw_census whole;                        /* of the half's surface sewn to its reflection */
    uint64_t searched;                      /* 0: no plane was looked for */
    bool is_symmetric;                      /* the plane found is used */
};

/* Tells the host, never less than before. The host has a progress function. */
int qw_tell_progress(qw_context *context, qw_stage stage, double fraction);

/* The end of a call: the status, with the environment's sentence, or with one of its own. */
qw_status qw_done(qw_context *context, qw_status status);
qw_status qw_refuse(qw_context *context, qw_status status, const char *message);

#endif

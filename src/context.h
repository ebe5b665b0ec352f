/* A context as the public functions hold it. */
#ifndef QW_CONTEXT_H
#define QW_CONTEXT_H

#include "driver.h"
#include "symmetry/plane.h"

struct qw_context {
    qw_context_state state;
    qw_host host;
    char message[512]; /* of a failure that happened outside the environment */
    qw_status status;

    /* of a symmetric run (symmetric.c) */
    qw_context *half;            /* which remeshes one side; NULL: none */
    qw_mirror_search found;      /* of the surface that state.begun had the number `searched` for */
    qw_mirror_plane half_plane;  /* the half lies above it */
    qw_census whole;             /* of the half's surface sewn to its reflection */
    uint64_t searched;           /* 0: no plane was looked for */
    bool is_symmetric;           /* the plane found is used */
};

/* The end of a call: the status, with the environment's sentence, or with one of its own. */
qw_status qw_done(qw_context *context, qw_status status);
qw_status qw_refuse(qw_context *context, qw_status status, const char *message);

#endif

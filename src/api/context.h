/* A context as the public functions hold it. */
#pragma once

#include "run/driver.h"
#include "whole/plane.h"

struct qw_context {
    qw_context_state state;
    qw_host host;
    char message[512]; /* of a failure that happened outside the environment */
    qw_status status;
    double told; /* the largest share of the current run that the host was told of */
};

/* The end of a call: the status, with the environment's sentence, or with one of its own. */
qw_status qw_done(qw_context *context, qw_status status);
qw_status qw_refuse(qw_context *context, qw_status status, const char *message);

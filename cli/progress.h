/* Progress on standard error: a bar on a terminal, a line a stage elsewhere, nothing when quiet; and Ctrl-C as a
 * cancel.
 */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>

typedef struct qw_meter {
    bool quiet, terminal;
    int stage;           /* last one shown, -1 before the first */
    int percent;         /* last one shown */
    int phase, phases;   /* what the fraction is of, as it begins anew with texture coordinates and with maps */
    double fraction;     /* last one told */
    double begin, shown; /* seconds of the monotonic clock */
    double limit;        /* seconds after which the run is cancelled; 0: none */
    bool late;           /* it was, for that */
    bool ended;          /* nothing more is shown; the hook still listens */
} qw_meter;

void qw_meter_begin(qw_meter *meter, bool quiet, double limit);
/* A qw_host progress hook; user is the meter. */
int qw_meter_progress(void *user, qw_stage stage, double fraction);
/* Takes the bar away. */
void qw_meter_end(qw_meter *meter);

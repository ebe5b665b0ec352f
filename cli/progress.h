/* Progress on standard error: a bar on a terminal, a line a stage elsewhere, nothing when quiet; and Ctrl-C as a
 * cancel.
 *
 * Signals that ask the process to end are blocked while the library works and looked for at each call of the progress
 * hook. So no handler runs and no variable is global, the library unwinds by itself, and no half-written file is left.
 * Those that are ignored when the tool starts (nohup, a job in the background) stay so. */
#ifndef QW_CLI_PROGRESS_H
#define QW_CLI_PROGRESS_H

#include "quadwright/quadwright.h"

#include <stdbool.h>

typedef struct qw_meter {
    bool quiet, terminal;
    int stage;           /* last one shown, -1 before the first */
    int percent;         /* last one shown */
    double begin, shown; /* seconds of the monotonic clock */
    double limit;        /* seconds after which the run is cancelled; 0: none */
    bool late;           /* it was, for that */
    bool ended;          /* nothing more is shown; the hook still listens */
} qw_meter;

/* A closed pipe and a limit of file sizes are errors of the write that meets them, no end of the process. */
void qw_ignore_write_signals(void);
/* From here on, on this thread and those it starts, SIGINT, SIGTERM, SIGHUP and SIGXCPU wait for the progress hook. */
void qw_hold_interrupts(void);
/* What the signal that waits is called, "SIGINT (interrupted)", or NULL where none does. */
const char *qw_interrupted(void);

void qw_meter_begin(qw_meter *meter, bool quiet, double limit);
/* A qw_host progress hook; user is the meter. */
int qw_meter_progress(void *user, qw_stage stage, double fraction);
/* Takes the bar away. */
void qw_meter_end(qw_meter *meter);

#endif

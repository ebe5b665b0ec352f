/* Work that goes on side by side and needs memory of its own: a worker may not allocate from the run's environment, so
 * each lane has one, in an arena. */
#pragma once

#include "base/arena.h"
#include "base/env.h"

/* Trials run in so many lanes side by side whatever the number of threads, attempts in no more than there are threads.
 */
enum { QW_MOST_LANES = 4 };

typedef struct qw_lane {
    qw_env *run; /* the whole run's */
    qw_env *env; /* the lane's; NULL where its arena had no room even for that */
    qw_arena arena;
} qw_lane;

/* qw_lane[count], each with an arena of so many bytes, in the current scope. What is run in a lane lets the host cancel
   the run. */
qw_lane *qw_lanes_begin(qw_env *run, uint32_t count, size_t bytes);
void qw_lanes_end(qw_lane *lanes, uint32_t count);

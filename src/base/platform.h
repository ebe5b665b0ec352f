/* What differs between operating systems: clocks, processors, threads' identity, files by UTF-8 paths. Nothing above
 * this file and pool.c knows which system it is. Paths are UTF-8 everywhere; on Windows the wide calls get them as
 * UTF-16, so that names outside the code page work, and files are binary. */
#pragma once

#include <stdint.h>

/* Seconds of a clock that never goes back, from any beginning. */
double qw_seconds_now(void);

/* Processors that threads of this process may run on; at least 1. */
uint32_t qw_processor_count(void);

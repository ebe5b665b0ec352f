/* What was given and changes nothing in this run, as what it belongs to was not given. */
#pragma once

#include "args.h"

/* A note a line, of what the library cannot see; of its options the report says so (src/whole/idle.h). */
void qw_say_idle(FILE *file, const qw_arguments *a);

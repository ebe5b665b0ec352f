/* What was given and changes nothing in this run, as what it belongs to was not given. */
#ifndef QW_CLI_WITHOUT_EFFECT_H
#define QW_CLI_WITHOUT_EFFECT_H

#include "args.h"

/* A note a line, of what the library cannot see; of its options the report says so (src/whole/idle.h). */
void qw_say_idle(FILE *file, const qw_arguments *a);

#endif

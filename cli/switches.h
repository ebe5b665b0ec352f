/* The switches of the command line, one table for the parser, the manual and the completions; the library's options
 * come from options.def. */
#pragma once

#include "args.h"

typedef enum qw_switch_id {
    SWITCH_HELP,
    SWITCH_VERSION,
    SWITCH_INPUT,
    SWITCH_OUTPUT,
    SWITCH_FORMAT,
    SWITCH_JSON,
    SWITCH_PROVENANCE,
    SWITCH_KEEP,
    SWITCH_DENSITY,
    SWITCH_FIELD_IN,
    SWITCH_FIELD_OUT,
    SWITCH_FIELD_PER,
    SWITCH_GUIDES,
    SWITCH_REGION,
    SWITCH_UNWRAP,
    SWITCH_BAKE,
    SWITCH_NO_ATTRIBUTES,
    SWITCH_NORMALS,
    SWITCH_AGAINST,
    SWITCH_VISIBLE,
    SWITCH_LIMIT,
    SWITCH_COARSE,
    SWITCH_LEVELS,
    SWITCH_PATCHES,
    SWITCH_PATCHES_FROM,
    SWITCH_SECOND_ORDER,
    SWITCH_QUIET,
    SWITCH_VERBOSE,
    SWITCH_DUMP_STAGE,
    SWITCH_FROM_STAGE,
    SWITCH_WIDTH,
    SWITCH_HEIGHT,
    SWITCH_VIEWS,
    SWITCH_COLOR,
    SWITCH_LINES,
    SWITCH_CLOSED,
    SWITCH_CHORD,
    SWITCH_AZIMUTH,
    SWITCH_ELEVATION,
    SWITCH_SHARP,
    SWITCH_MEMORY_LIMIT,
    SWITCH_TIME_LIMIT,
    SWITCH_JOBS,
    SWITCH_SHARD,
    SWITCH_RETRY,
    SWITCH_FORCE,
    SWITCH_PRESET,
    SWITCH_STANDS_FOR /* an option of the library with a fixed or a given value */
} qw_switch_id;

typedef struct qw_switch_row {
    qw_switch_id id;
    int commands;               /* bits of the commands that take it */
    const char *name, *alias;   /* after "--" and after "-"; NULL: none */
    const char *value;          /* what follows, for the manual; NULL: nothing follows */
    const char *option, *fixed; /* SWITCH_STANDS_FOR: sets option to fixed, or to what follows */
    const char *help;
} qw_switch_row;

enum { QW_COMMAND_COUNT = QW_COMMAND_HELP + 1, QW_STAGE_WORD = 32 };

/* NULL past the end. */
const qw_switch_row *qw_switch_at(size_t index);
const char *qw_command_name(qw_command command);
/* The stage as --dump-stage takes it, in lower case. */
const char *qw_stage_word(qw_stage stage, char word[QW_STAGE_WORD]);
/* The option or switch that was meant and is nearer than best (base/near.h), or NULL. */
const char *qw_option_meant(const char *typed, unsigned *best);
/* Equal, where '-' and '_' are the same. */
bool qw_same_name(const char *a, const char *b);

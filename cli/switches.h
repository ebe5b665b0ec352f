/* The switches of the command line, one table for the parser, the manual and the completions; the library's options
 * come from options.def. */
#pragma once

#include "args.h"

typedef enum qw_switch_id {
    SWITCH_FLAG, /* what sets one member of qw_arguments: to true, to the text, to the number that follows */
    SWITCH_TEXT,
    SWITCH_WHOLE,
    SWITCH_HELP,
    SWITCH_INPUT,
    SWITCH_FORMAT,
    SWITCH_JSON,
    SWITCH_KEEP,
    SWITCH_FIELD_PER,
    SWITCH_BAKE,
    SWITCH_NORMALS,
    SWITCH_LEVELS,
    SWITCH_PATCHES,
    SWITCH_PATCHES_FROM,
    SWITCH_SECOND_ORDER,
    SWITCH_DUMP_STAGE,
    SWITCH_COLOR,
    SWITCH_SHARP,
    SWITCH_MEMORY_LIMIT,
    SWITCH_SHARD,
    SWITCH_STANDS_FOR /* an option of the library with a fixed or a given value */
} qw_switch_id;

typedef struct qw_switch_row {
    qw_switch_id id;
    int commands;             /* bits of the commands that take it */
    const char *name, *alias; /* after "--" and after "-"; NULL: none */
    const char *value;        /* what follows, for the manual; NULL: nothing follows */
    const char *help;
    size_t member;              /* of qw_arguments, in bytes: SWITCH_FLAG, SWITCH_TEXT, SWITCH_WHOLE */
    int64_t least, most;        /* SWITCH_WHOLE */
    const char *option, *fixed; /* SWITCH_STANDS_FOR: sets option to fixed, or to what follows */
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

/* The manual, from the tables: one screen, a topic, one option, or the whole. */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdio.h>

/* How the program is called, and for what. */
typedef struct qw_usage_row {
    const char *line, *about;
} qw_usage_row;

/* NULL past the end. */
const qw_usage_row *qw_usage_at(size_t index);
const char *qw_example_at(size_t index);
const char *qw_topic_at(size_t index);

/* What `quadwright --help` prints. */
void qw_print_screen(FILE *file);
void qw_print_manual(FILE *file);
/* A topic, a command, an option or a switch, with or without dashes; false, and a sentence, where there is none. */
bool qw_print_about(FILE *file, const char *name, char *message, size_t message_size);
/* One line an option: name, kind, default, bounds, choices, tab-separated. */
void qw_print_options(FILE *file);

/* For tools/manual.c: how an option is given ("--[no-]sat", "--faces N"), and its default. */
void qw_option_usage(const qw_option_info *info, char *text, size_t size);
void qw_option_initial(const qw_option_info *info, char *text, size_t size);

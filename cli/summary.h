/* What a run did and what a mesh is like, for people. For programs: base/report.h. */
#pragma once

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdio.h>

/* What the reader of the input warned of, printable. */
enum { QW_MOST_NOTES = 8, QW_NOTE_SIZE = 512 };
typedef struct qw_notes {
    int count;
    char text[QW_MOST_NOTES][QW_NOTE_SIZE];
} qw_notes;

/* A few lines: counts, quality, time, and every note and warning. input, output: as the user named them, may be NULL.
 */
void qw_print_summary(FILE *file, const qw_report *report, const qw_notes *notes, const char *input, const char *output,
                      bool second_order);
/* One "name value" line a figure; those that do not apply are left out. */
void qw_print_measures(FILE *file, const qw_topology *topology, const qw_quality *quality);

/* The state of a run as a file: written after any stage, taken up again at the next one, with the same bytes in the
 * end.
 *
 *     "QWSTATE\n"  uint32_t version, order mark, stages finished, 0
 *     records: of the options, then those of dump.def for INPUT and each finished stage
 *
 * A record is a qw_state_record and its bytes, all in the byte order of the machine that wrote it. An array that two
 * members share is written once. Nothing that is read is believed: names, sizes, counts and sums must agree, indices
 * hold, numbers be finite.
 */
#pragma once

#include "run/driver.h"

enum { QW_STATE_VERSION = 33, QW_STATE_NAME = 40, QW_STATE_HEADER = 24 };

typedef struct qw_state_record {
    char name[QW_STATE_NAME];
    uint32_t element_size;
    uint32_t bytes_of; /* the record whose bytes these are: its own number, that of an earlier one, or QW_NONE for a
                          NULL array */
    uint64_t count;
    uint64_t sum; /* qw_state_sum */
} qw_state_record;

/* Checksum of the record and its own bytes; record->sum is left out. */
uint64_t qw_state_sum(const qw_state_record *record, const void *bytes, size_t size);

qw_status qw_state_write(qw_context_state *c, const char *path);
/* Into a state without a mesh; a failure leaves it so. Fails with QW_FILE_ as reading does, QW_FORMAT_UNKNOWN,
   QW_FORMAT_TRUNCATED or QW_FORMAT_SYNTAX. */
qw_status qw_state_read(qw_context_state *c, const char *path);

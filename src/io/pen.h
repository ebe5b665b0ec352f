/* Bytes that grow at their end: text of JSON, or a buffer. In the scope of the environment in which it is first written
 * to. */
#pragma once

#include "io/file.h"

typedef struct qw_pen {
    qw_env *env;
    char *at; /* char[size] */
    size_t size, capacity;
} qw_pen;

char *qw_pen_room(qw_pen *pen, size_t size); /* so many bytes more, for the caller to fill */
void qw_pen_put(qw_pen *pen, const void *bytes, size_t size);
void qw_pen_text(qw_pen *pen, const char *text);
void qw_pen_whole(qw_pen *pen, uint64_t value);
void qw_pen_number(qw_pen *pen, double value);     /* finite */
void qw_pen_string(qw_pen *pen, const char *text); /* of JSON, in quotes, as qw_pen_utf8 */
/* Puts text, each byte that is no UTF-8 as the letter that it is in Latin-1 (ISO 8859-1): what is written is valid, and
   what differed still differs. What follows the text must be readable: a zero, or a byte of ASCII. */
void qw_pen_utf8(qw_pen *pen, const char *text, size_t size);
/* The text so formatted, of at most 255 bytes. */
void qw_pen_print(qw_pen *pen, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Writes what there is, and forgets it, where that is so many bytes or more: QW_PEN_FULL, or 0 at the end. */
enum { QW_PEN_FULL = 1 << 16 };
void qw_pen_flush(qw_pen *pen, qw_file *file, size_t from);
void qw_pen_align(qw_pen *pen, size_t to, char with);

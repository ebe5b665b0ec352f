/* A small JSON writer, into memory of its own or into a buffer of the caller's. Out of memory is remembered and said
 * once, by qw_json_failed. Numbers have a point in every locale. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct qw_json {
    char *text; /* char[length], NUL terminated; NULL at first; the caller's to free, by free() */
    size_t length, capacity;
    bool is_fixed; /* text is a buffer of the caller's: what does not fit is counted in length and left out */
    bool is_line;  /* everything on one line */
    int depth;
    bool comma; /* the next value needs one before it */
    bool failed;
} qw_json;

/* A writer into a buffer. capacity 0: only the length is found, and text may be NULL. */
qw_json qw_json_into(char *text, size_t capacity);

/* name is NULL for the outermost value and for items of a list. */
void qw_json_begin(qw_json *json, const char *name, char bracket); /* '{' or '[' */
void qw_json_end(qw_json *json, char bracket);                     /* '}' or ']' */
void qw_json_whole(qw_json *json, const char *name, int64_t value);
void qw_json_real(qw_json *json, const char *name, double value); /* null where it is not finite */
void qw_json_text(qw_json *json, const char *name, const char *value);
void qw_json_flag(qw_json *json, const char *name, bool value);
void qw_json_null(qw_json *json, const char *name);
bool qw_json_failed(const qw_json *json);

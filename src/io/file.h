/* Bytes from files and to files: what can go wrong with a path, and nothing about formats. */
#ifndef QW_IO_FILE_H
#define QW_IO_FILE_H

#include "base/env.h"

/* So many zeros follow bytes, so that readers of text need not look for the end, nor those of eight digits at once. */
enum { QW_ZEROS = 8 };

typedef struct qw_bytes {
    const char *at; /* char[size + QW_ZEROS] */
    size_t size;
} qw_bytes;

/* The path as messages show it: its end where it is long, "standard input" for "-". In the caller's scope. */
const char *qw_path_for_messages(qw_env *env, const char *path, const char *standard);

/* The whole file, at once: a map of it would turn a file that shrinks under us into a crash. "-" is standard input. */
qw_bytes qw_file_read(qw_env *env, const char *path, const char *name);

/* A file being written; in the scope in which it was begun, whose end without qw_file_finish leaves nothing behind. */
typedef struct qw_file qw_file;

/* Writes beside the target until the end, unless the target is no regular file ("-", a device, a pipe): then into it.
 */
qw_file *qw_file_begin(qw_env *env, const char *path);
void qw_file_put(qw_file *file, const void *bytes, size_t size);
void qw_file_finish(qw_file *file);

#endif

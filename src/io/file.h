/* Bytes from files and to files: what can go wrong with a path, and nothing about formats.
 *
 * "-" is standard input or output. /dev/stdout, /dev/stderr, /dev/fd/N and what links to them are descriptors of this
 * process and are written as such, since opening them anew fails where they are sockets or another user's. Symbolic
 * links are followed, also where what they point to does not exist yet: the link stays.
 *
 * A pipe or a terminal may not take or give anything for long. While it does not, the host is asked whether to go on
 * (qw_heartbeat_outside). Limits of the system (a full disk, a file-size limit, a closed pipe) fail with a
 * sentence; the signals SIGXFSZ and SIGPIPE that come with two of them never reach the host. */
#pragma once

#include "base/env.h"

/* So many zeros follow bytes, so that readers of text need not look for the end, nor those of eight digits at once. */
enum { QW_ZEROS = 8 };
/* Of file.c and file_windows.c alone: bytes that are read at once at first and at most (Linux gives up to 2 GiB a call,
   others less), and collected before they are written; of the system's own words, and of a temporary file's name; such
   names that are tried. */
enum {
    QW_FIRST_READ = 1 << 16,
    QW_MOST_READ = 1 << 30,
    QW_FILE_BUFFER = 1 << 17,
    QW_CAUSE_SIZE = 96,
    QW_TEMPORARY_SIZE = 64,
    QW_MOST_NAMES_TRIED = 1000
};

typedef struct qw_bytes {
    const char *at; /* char[size + QW_ZEROS] */
    size_t size;
} qw_bytes;

/* The path as messages show it: printable (base/printable.h), its end where it is long, `standard` for "-". In the
   caller's scope. */
const char *qw_path_for_messages(qw_env *env, const char *path, const char *standard);

/* The whole file, at once: a map of it would turn a file that shrinks under us into a crash. */
qw_bytes qw_file_read(qw_env *env, const char *path, const char *name);

/* A file that another names. Only a regular one, whose size is known before it is read: a pipe may never give anything,
   and a device never end. Of a file of more than `most` bytes the first so many, or where it is not to be cut, a
   failure. */
qw_bytes qw_file_read_regular(qw_env *env, const char *path, const char *name, uint64_t most, bool may_cut);

/* A file being written; in the scope in which it was begun, whose end without qw_file_finish leaves nothing behind. */
typedef struct qw_file qw_file;

/* Writes beside the target until the end, unless the target is no regular file ("-", a device, a pipe): then into it.
 */
qw_file *qw_file_begin(qw_env *env, const char *path);
void qw_file_put(qw_file *file, const void *bytes, size_t size);
/* All is on its way to the disk, still beside the target. */
void qw_file_settle(qw_file *file);
/* Settles it, and the target is the new file. */
void qw_file_finish(qw_file *file);

/* Fails as qw_file_begin would, before there is something to write. What passes may still fail later. */
void qw_file_require_writable(qw_env *env, const char *path);

/* Whether two paths lead to one file, so that the second to be written would destroy the first: by symbolic and hard
   links, other spellings, the same pipe; and where neither exists yet, by names in one folder that differ at most in
   the case of letters, as not all file systems tell those apart. Never for terminals and /dev/null, which keep nothing.
 */
bool qw_file_is_same(qw_env *env, const char *path, const char *other);

#define _XOPEN_SOURCE 700 /* realpath, fsync */

#include "io/file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    LONGEST_NAME = 240, /* of a path in a message, so that the sentence after it is not cut */
    FIRST_READ = 1 << 16,
    MOST_AT_ONCE = 1 << 30, /* Linux gives up to 2 GiB a call, others less */
    BUFFER_SIZE = 1 << 17,
    CAUSE_SIZE = 96,
    MAX_NAMES_TRIED = 1000,
    TEMPORARY_SIZE = 64 /* of its name */
};

/* strerror keeps its text in a global. */
typedef struct cause {
    char text[CAUSE_SIZE];
} cause;

static cause cause_of(int error)
{
    cause c;
    if (strerror_r(error, c.text, sizeof c.text) != 0) snprintf(c.text, sizeof c.text, "error %d", error);
    return c;
}

const char *qw_path_for_messages(qw_env *env, const char *path, const char *standard)
{
    if (strcmp(path, "-") == 0) return standard;
    size_t size = strlen(path);
    if (size <= LONGEST_NAME) return path;
    char *name = qw_alloc(env, LONGEST_NAME + 1, 1);
    const char *tail = path + size - (LONGEST_NAME - 3);
    while (((unsigned char)*tail & 0xc0) == 0x80) tail++; /* not in the middle of a UTF-8 character */
    snprintf(name, LONGEST_NAME + 1, "...%s", tail);
    return name;
}

/* ---- reading */

static void close_descriptor(void *resource)
{
    if (*(int *)resource >= 0) close(*(int *)resource);
}

static _Noreturn void fail_to_read(qw_env *env, const char *name, int error)
{
    cause c = cause_of(error);
    if (error == ENOENT || error == ENOTDIR) qw_fail(env, QW_FILE_MISSING, -1, "%s: the file does not exist", name);
    if (error == EISDIR) qw_fail(env, QW_FILE_IS_DIRECTORY, -1, "%s: is a directory", name);
    qw_fail(env, QW_FILE_UNREADABLE, -1, "%s: cannot be read: %s", name, c.text);
}

static qw_bytes read_all(qw_env *env, int descriptor, const char *name)
{
    struct stat info;
    if (fstat(descriptor, &info) != 0) fail_to_read(env, name, errno);
    if (S_ISDIR(info.st_mode)) fail_to_read(env, name, EISDIR);
    size_t capacity = 0, size = 0;
    size_t expected = S_ISREG(info.st_mode) && info.st_size > 0 ? (size_t)info.st_size + QW_ZEROS + 1
                                                                : FIRST_READ; /* a byte to see the end */
    char *bytes = qw_grow(env, NULL, &capacity, expected, 1);
    for (;;) {
        if (size + QW_ZEROS == capacity) bytes = qw_grow(env, bytes, &capacity, capacity + 1, 1);
        size_t room = capacity - QW_ZEROS - size;
        ssize_t got = read(descriptor, bytes + size, room < MOST_AT_ONCE ? room : MOST_AT_ONCE);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) fail_to_read(env, name, errno);
        if (got == 0) break;
        size += (size_t)got;
    }
    memset(bytes + size, 0, QW_ZEROS);
    return (qw_bytes){bytes, size};
}

qw_bytes qw_file_read(qw_env *env, const char *path, const char *name)
{
    if (strcmp(path, "-") == 0) return read_all(env, STDIN_FILENO, name);
    int *descriptor = QW_NEW(env, int, 1);
    *descriptor = -1;
    qw_defer(env, close_descriptor, descriptor); /* before there is something to lose, as this may fail */
    *descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (*descriptor < 0) fail_to_read(env, name, errno);
    return read_all(env, *descriptor, name);
}

/* ---- writing */

struct qw_file {
    qw_env *env;
    const char *name;
    int descriptor;               /* -1: none */
    bool standard;                /* not ours to close */
    const char *target;           /* NULL: written directly */
    char *temporary;              /* beside the target */
    bool has_temporary, replaces; /* replaces: the target was there before */
    size_t filled;
    char *buffer; /* char[BUFFER_SIZE] */
};

static void abandon(void *resource)
{
    qw_file *f = resource;
    if (f->descriptor >= 0 && !f->standard) close(f->descriptor);
    if (f->has_temporary) unlink(f->temporary);
}

static _Noreturn void fail_to_write(qw_file *f, int error)
{
    cause c = cause_of(error);
    qw_fail(f->env, QW_FILE_UNWRITABLE, -1, "%s: cannot be written: %s", f->name, c.text);
}

static void free_pointer(void *resource) { free(*(void **)resource); }

/* The file behind symbolic links: the link stays, and what it points to is replaced. */
static const char *resolve(qw_env *env, const char *path)
{
    char **real = QW_NEW_ZERO(env, char *, 1);
    qw_defer(env, free_pointer, real);
    *real = realpath(path, NULL);
    return *real ? *real : path; /* a file that does not exist yet, most often */
}

/* Names of ours may be left from a run that was killed, or be in use by another. */
static void open_temporary(qw_file *f)
{
    const char *slash = strrchr(f->target, '/');
    int folder = slash ? (int)(slash + 1 - f->target) : 0;
    for (int i = 0; i < MAX_NAMES_TRIED; i++) {
        /* not from the target's name, which may be as long as names may be */
        sprintf(f->temporary, "%.*squadwright-%ld-%d.part", folder, f->target, (long)getpid(), i);
        f->descriptor = open(f->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        f->has_temporary = f->descriptor >= 0;
        if (f->has_temporary) return;
        if (errno != EEXIST) break;
    }
    fail_to_write(f, errno);
}

static void open_direct(qw_file *f, const char *path)
{
    f->descriptor = open(path, O_WRONLY | O_CLOEXEC);
    if (f->descriptor < 0) fail_to_write(f, errno);
}

qw_file *qw_file_begin(qw_env *env, const char *path)
{
    qw_file *f = QW_NEW_ZERO(env, qw_file, 1);
    f->env = env;
    f->name = qw_path_for_messages(env, path, "standard output");
    f->descriptor = -1;
    f->buffer = qw_alloc(env, BUFFER_SIZE, 1);
    struct stat info;
    bool exists = false;
    f->standard = strcmp(path, "-") == 0;
    if (!f->standard) {
        exists = stat(path, &info) == 0;
        if (exists && S_ISDIR(info.st_mode)) fail_to_write(f, EISDIR);
        if (exists && access(path, W_OK) != 0) fail_to_write(f, errno); /* a rename would not mind */
        if (!exists || S_ISREG(info.st_mode)) {
            f->target = resolve(env, path);
            f->temporary = qw_alloc(env, strlen(f->target) + TEMPORARY_SIZE, 1);
        }
    }
    qw_defer(env, abandon, f); /* after all blocks that it needs: they are released later */
    if (f->standard) {
        fflush(stdout); /* what the host has printed comes first */
        f->descriptor = STDOUT_FILENO;
    } else if (!f->target) {
        open_direct(f, path);
    } else {
        open_temporary(f);
        f->replaces = exists;
        if (exists) (void)!fchmod(f->descriptor, info.st_mode & 0777); /* no harm where it is not ours to set */
    }
    return f;
}

static void flush(qw_file *f)
{
    for (size_t done = 0; done < f->filled;) {
        ssize_t put = write(f->descriptor, f->buffer + done, f->filled - done);
        if (put < 0 && errno == EINTR) continue;
        if (put < 0) fail_to_write(f, errno);
        done += (size_t)put;
    }
    f->filled = 0;
}

void qw_file_put(qw_file *f, const void *bytes, size_t size)
{
    for (const char *at = bytes; size > 0;) {
        if (f->filled == BUFFER_SIZE) flush(f);
        size_t room = BUFFER_SIZE - f->filled, n = size < room ? size : room;
        memcpy(f->buffer + f->filled, at, n);
        f->filled += n;
        at += n, size -= n;
    }
}

void qw_file_finish(qw_file *f)
{
    flush(f);
    /* What is replaced is lost in a power cut unless the new contents are on the disk first; what is new can be made
       again, and the disk may take longer than the quads did. File systems that cannot sync say EINVAL. */
    if (f->replaces && fsync(f->descriptor) != 0 && errno != EINVAL) fail_to_write(f, errno);
    int descriptor = f->descriptor;
    f->descriptor = -1;
    if (!f->standard && close(descriptor) != 0) fail_to_write(f, errno);
    if (!f->target) return;
    if (rename(f->temporary, f->target) != 0) fail_to_write(f, errno);
    f->has_temporary = false;
}

#ifndef _WIN32            /* there it is file_windows.c */
#define _XOPEN_SOURCE 700 /* readlink, fsync */

#include "io/file.h"
#include "base/printable.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum {
    WAIT = 20,      /* milliseconds between two questions to the host */
    MOST_LINKS = 40 /* from one to the next, as Linux has it */
};

/* strerror keeps its text in a global. */
typedef struct cause {
    char text[QW_CAUSE_SIZE];
} cause;

static cause cause_of(int error)
{
    cause c;
    if (strerror_r(error, c.text, sizeof c.text) != 0) snprintf(c.text, sizeof c.text, "error %d", error);
    return c;
}

/* ---- links and descriptors */

/* Of "-" as an output, "/dev/stdout" and the like; -1 where the path names no descriptor. */
static int descriptor_of(const char *path)
{
    static const struct {
        const char *begin;
        int descriptor; /* -1: the number that follows */
    } names[] = {{"/dev/stdin", 0}, {"/dev/stdout", 1}, {"/dev/stderr", 2}, {"/dev/fd/", -1}, {"/proc/self/fd/", -1}};
    if (strcmp(path, "-") == 0) return STDOUT_FILENO;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        size_t size = strlen(names[i].begin);
        if (strncmp(path, names[i].begin, size) != 0) continue;
        if (names[i].descriptor >= 0 && path[size] == 0) return names[i].descriptor;
        if (names[i].descriptor >= 0 || path[size] < '0' || path[size] > '9') continue;
        char *end;
        long number = strtol(path + size, &end, 10);
        if (*end == 0 && number <= INT_MAX) return (int)number;
    }
    return -1;
}

/* Where the symbolic link at `path` points, or NULL where it is none. In the caller's scope. */
static char *link_target(qw_env *env, const char *path)
{
    char *text = qw_alloc(env, QW_PATH_SIZE, 1);
    ssize_t size = readlink(path, text, QW_PATH_SIZE - 1);
    if (size < 0 || size == QW_PATH_SIZE - 1) {
        qw_free(env, text);
        return NULL;
    }
    text[size] = 0;
    const char *slash = strrchr(path, '/');
    if (text[0] == '/' || !slash) return text;
    size_t folder = (size_t)(slash + 1 - path);
    char *joined = qw_alloc(env, folder + (size_t)size + 1, 1);
    memcpy(joined, path, folder);
    memcpy(joined + folder, text, (size_t)size + 1);
    qw_free(env, text);
    return joined;
}

/* The file behind symbolic links, which may not exist yet; or the name of a descriptor. */
static const char *resolve(qw_env *env, const char *path)
{
    for (int i = 0; i < MOST_LINKS && descriptor_of(path) < 0; i++) {
        const char *next = link_target(env, path);
        if (!next) break;
        path = next;
    }
    return path;
}

/* ---- waiting */

/* Until the descriptor can be read or written (events) without waiting, or has failed. */
static void wait_for(qw_env *env, int descriptor, short events)
{
    struct pollfd one = {.fd = descriptor, .events = events};
    while (poll(&one, 1, WAIT) == 0) qw_heartbeat_outside(env);
}

static void sleep_a_while(qw_env *env)
{
    nanosleep(&(struct timespec){.tv_nsec = WAIT * 1000000L}, NULL);
    qw_heartbeat_outside(env);
}

/* Opening a FIFO waits for the other end; this way the host is asked meanwhile. Returns -1 as open does. */
static int open_patiently(qw_env *env, const char *path, int flags)
{
    int descriptor = open(path, flags | O_NONBLOCK | O_CLOEXEC);
    while (descriptor < 0 && (errno == EINTR || (errno == ENXIO && flags == O_WRONLY))) {
        struct stat info;
        if (errno == ENXIO && (stat(path, &info) != 0 || !S_ISFIFO(info.st_mode))) {
            errno = ENXIO;
            break;
        }
        sleep_a_while(env);
        descriptor = open(path, flags | O_NONBLOCK | O_CLOEXEC);
    }
    if (descriptor >= 0) {
        int now = fcntl(descriptor, F_GETFL);
        if (now >= 0) (void)fcntl(descriptor, F_SETFL, now & ~O_NONBLOCK);
    }
    return descriptor;
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

static struct stat ask_descriptor(qw_env *env, int descriptor, const char *name)
{
    struct stat info;
    if (fstat(descriptor, &info) != 0) fail_to_read(env, name, errno);
    if (S_ISDIR(info.st_mode)) fail_to_read(env, name, EISDIR);
    return info;
}

/* All bytes of a descriptor, with QW_ZEROS zeros behind them; waits for pipes in a way that can be cancelled. */
static qw_bytes read_all(qw_env *env, int descriptor, const char *name)
{
    struct stat info = ask_descriptor(env, descriptor, name);
    bool regular = S_ISREG(info.st_mode);
    size_t capacity = 0, size = 0;
    size_t expected = regular && info.st_size > 0 ? (size_t)info.st_size + QW_ZEROS + 1
                                                  : QW_FIRST_READ; /* a byte to see the end */
    char *bytes = qw_grow(env, NULL, &capacity, expected, 1);
    for (;;) {
        if (size + QW_ZEROS == capacity) bytes = qw_grow(env, bytes, &capacity, capacity + 1, 1);
        size_t room = capacity - QW_ZEROS - size;
        if (!regular) wait_for(env, descriptor, POLLIN);
        ssize_t got = read(descriptor, bytes + size, room < QW_MOST_READ ? room : QW_MOST_READ);
        if (got < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (got < 0) fail_to_read(env, name, errno);
        if (got == 0) break;
        size += (size_t)got;
    }
    memset(bytes + size, 0, QW_ZEROS);
    return (qw_bytes){bytes, size};
}

/* A descriptor that is closed with the caller's scope. */
static int open_to_read(qw_env *env, const char *path, const char *name)
{
    int *descriptor = QW_NEW(env, int, 1);
    *descriptor = -1;
    qw_defer(env, close_descriptor, descriptor); /* before there is something to lose, as this may fail */
    *descriptor = open_patiently(env, path, O_RDONLY);
    if (*descriptor < 0) fail_to_read(env, name, errno);
    return *descriptor;
}

qw_bytes qw_file_read(qw_env *env, const char *path, const char *name)
{
    int own = strcmp(path, "-") == 0 ? STDIN_FILENO : descriptor_of(path);
    return read_all(env, own >= 0 ? own : open_to_read(env, path, name), name);
}

qw_bytes qw_file_read_regular(qw_env *env, const char *path, const char *name, uint64_t most, bool may_cut)
{
    int descriptor = open_to_read(env, path, name);
    struct stat info = ask_descriptor(env, descriptor, name);
    if (!S_ISREG(info.st_mode)) qw_fail(env, QW_FILE_UNREADABLE, -1, "%s: is no regular file", name);
    uint64_t wanted = info.st_size > 0 ? (uint64_t)info.st_size : 0;
    if (wanted > most && !may_cut) qw_fail(env, QW_TOO_LARGE, -1, "%s: has more than %" PRIu64 " bytes", name, most);
    if (wanted > most) wanted = most;
    if (wanted > SIZE_MAX / 2) qw_fail(env, QW_MEMORY, -1, "%s: is too large to be read", name);
    char *bytes = qw_alloc(env, (size_t)wanted + QW_ZEROS, 1);
    size_t size = 0;
    while (size < wanted) {
        size_t left = (size_t)wanted - size;
        ssize_t got = read(descriptor, bytes + size, left < QW_MOST_READ ? left : QW_MOST_READ);
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) fail_to_read(env, name, errno);
        if (got == 0) break; /* it has become shorter */
        size += (size_t)got;
    }
    memset(bytes + size, 0, QW_ZEROS);
    return (qw_bytes){bytes, size};
}

/* ---- writing */

struct qw_file {
    qw_env *env;
    const char *name;
    int descriptor;               /* -1: none */
    bool borrowed;                /* the process's own, not ours to close */
    bool slow;                    /* no regular file: it may keep us waiting */
    const char *target;           /* NULL: written directly */
    char *temporary;              /* beside the target */
    bool has_temporary, replaces; /* replaces: the target was there before */
    size_t filled;
    char *buffer; /* char[QW_FILE_BUFFER] */
};

static void abandon(void *resource)
{
    qw_file *f = resource;
    if (f->descriptor >= 0 && !f->borrowed) close(f->descriptor);
    if (f->has_temporary) unlink(f->temporary);
}

static _Noreturn void fail_to_write(qw_env *env, const char *name, int error)
{
    cause c = cause_of(error);
    qw_fail(env, QW_FILE_UNWRITABLE, -1, "%s: cannot be written: %s", name, c.text);
}

/* The folder of `path` with its slash, "./" where there is none. In the caller's scope. */
static char *folder_of(qw_env *env, const char *path)
{
    const char *slash = strrchr(path, '/');
    size_t size = slash ? (size_t)(slash + 1 - path) : 2;
    char *folder = qw_alloc(env, size + 1, 1);
    memcpy(folder, slash ? path : "./", size);
    folder[size] = 0;
    return folder;
}

/* Where and how `path` is to be written. */
typedef struct destination {
    const char *path; /* behind links */
    int descriptor;   /* of this process, or -1 */
    bool exists, regular;
    mode_t mode;
} destination;

/* Fails where it cannot be. A rename would not mind that the file is another's: that is asked here. */
static destination destination_of(qw_env *env, const char *path, const char *name)
{
    if (!path[0]) fail_to_write(env, name, ENOENT);
    destination d = {.path = resolve(env, path)};
    d.descriptor = descriptor_of(d.path);
    struct stat info;
    d.exists = (d.descriptor >= 0 ? fstat(d.descriptor, &info) : stat(d.path, &info)) == 0;
    if (!d.exists && d.descriptor >= 0) fail_to_write(env, name, errno);
    if (!d.exists && errno == ELOOP) fail_to_write(env, name, ELOOP);
    d.regular = !d.exists || S_ISREG(info.st_mode);
    d.mode = d.exists ? info.st_mode : 0;
    if (d.descriptor >= 0) return d;
    if (d.exists && S_ISDIR(info.st_mode))
        qw_fail(env, QW_FILE_UNWRITABLE, -1, "%s is a directory and cannot be written", name);
    if (d.exists && access(d.path, W_OK) != 0) fail_to_write(env, name, errno);
    if (d.regular && access(folder_of(env, d.path), W_OK) != 0) {
        cause c = cause_of(errno);
        qw_fail(env, QW_FILE_UNWRITABLE, -1, "%s: cannot be written: its folder takes no new files: %s", name, c.text);
    }
    return d;
}

void qw_file_require_writable(qw_env *env, const char *path)
{
    qw_scope_begin(env);
    (void)destination_of(env, path, qw_path_for_messages(env, path, "standard output"));
    qw_scope_end(env);
}

/* Names of ours may be left from a run that was killed, or be in use by another. */
static void open_temporary(qw_file *f)
{
    const char *slash = strrchr(f->target, '/');
    int folder = slash ? (int)(slash + 1 - f->target) : 0;
    for (int i = 0; i < QW_MOST_NAMES_TRIED; i++) {
        /* not from the target's name, which may be as long as names may be */
        sprintf(f->temporary, "%.*squadwright-%ld-%d.part", folder, f->target, (long)getpid(), i);
        f->descriptor = open(f->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        f->has_temporary = f->descriptor >= 0;
        if (f->has_temporary) return;
        if (errno != EEXIST) break;
    }
    fail_to_write(f->env, f->name, errno);
}

qw_file *qw_file_begin(qw_env *env, const char *path)
{
    qw_file *f = QW_NEW_ZERO(env, qw_file, 1);
    f->env = env;
    qw_heartbeat_begin(env);
    f->name = qw_path_for_messages(env, path, "standard output");
    f->descriptor = -1;
    f->buffer = qw_alloc(env, QW_FILE_BUFFER, 1);
    destination d = destination_of(env, path, f->name);
    f->slow = !d.regular;
    f->borrowed = d.descriptor >= 0;
    if (d.regular && !f->borrowed) {
        f->target = d.path;
        f->temporary = qw_alloc(env, strlen(f->target) + QW_TEMPORARY_SIZE, 1);
    }
    qw_defer(env, abandon, f); /* after all blocks that it needs: they are released later */
    if (f->borrowed) {
        fflush(d.descriptor == STDERR_FILENO ? stderr : stdout); /* what the host has printed comes first */
        f->descriptor = d.descriptor;
    } else if (!f->target) {
        f->descriptor = open_patiently(env, d.path, O_WRONLY);
        if (f->descriptor < 0) fail_to_write(env, f->name, errno);
    } else {
        open_temporary(f);
        f->replaces = d.exists;
        if (d.exists) (void)!fchmod(f->descriptor, d.mode & 0777); /* no harm where it is not ours to set */
    }
    return f;
}

/* write, but a limit of the system comes back as an error alone: the signal that tells of it too would end the process.
   It is sent to the thread that writes, so it can be blocked and taken here. One that waited before is not ours. */
static ssize_t write_quietly(int descriptor, const void *bytes, size_t size)
{
    sigset_t loud, before, waiting;
    sigemptyset(&loud);
    sigaddset(&loud, SIGXFSZ);
    sigaddset(&loud, SIGPIPE);
    sigemptyset(&waiting);
    sigpending(&waiting);
    if (pthread_sigmask(SIG_BLOCK, &loud, &before) != 0) return write(descriptor, bytes, size);
    ssize_t put = write(descriptor, bytes, size);
    int error = errno, sent = put >= 0 ? 0 : error == EPIPE ? SIGPIPE : error == EFBIG ? SIGXFSZ : 0;
    if (sent && sigismember(&waiting, sent) == 0) {
        sigset_t one;
        sigemptyset(&one);
        sigaddset(&one, sent);
        sigpending(&waiting);
        if (sigismember(&waiting, sent) == 1) (void)sigwait(&one, &sent);
    }
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    errno = error;
    return put;
}

/* Writes what the buffer holds, all of it, and empties it; waits for slow readers in a way that can be cancelled. */
static void flush(qw_file *f)
{
    for (size_t done = 0; done < f->filled;) {
        size_t left = f->filled - done;
        if (f->slow) wait_for(f->env, f->descriptor, POLLOUT);
        else qw_heartbeat_outside(f->env);
        ssize_t put = write_quietly(f->descriptor, f->buffer + done, f->slow && left > PIPE_BUF ? PIPE_BUF : left);
        if (put < 0 && (errno == EINTR || errno == EAGAIN)) continue;
        if (put < 0) fail_to_write(f->env, f->name, errno);
        done += (size_t)put;
    }
    f->filled = 0;
}

void qw_file_put(qw_file *f, const void *bytes, size_t size)
{
    for (const char *at = bytes; size > 0;) {
        if (f->filled == QW_FILE_BUFFER) flush(f);
        size_t room = QW_FILE_BUFFER - f->filled, n = size < room ? size : room;
        memcpy(f->buffer + f->filled, at, n);
        f->filled += n;
        at += n, size -= n;
    }
}

void qw_file_settle(qw_file *f)
{
    flush(f);
    /* What is replaced is lost in a power cut unless the new contents are on the disk first; what is new can be made
       again, and the disk may take longer than the quads did. File systems that cannot sync say EINVAL. */
    if (f->replaces && fsync(f->descriptor) != 0 && errno != EINVAL) fail_to_write(f->env, f->name, errno);
    int descriptor = f->descriptor;
    f->descriptor = -1;
    if (!f->borrowed && close(descriptor) != 0) fail_to_write(f->env, f->name, errno);
}

void qw_file_finish(qw_file *f)
{
    if (f->descriptor >= 0) qw_file_settle(f);
    if (!f->target) return;
    if (rename(f->temporary, f->target) != 0) fail_to_write(f->env, f->name, errno);
    f->has_temporary = false;
}

/* ---- the same file */

static char lower(char c) { return c >= 'A' && c <= 'Z' ? (char)(c + 32) : c; }

/* What a path leads to: a file that exists, or a name in a folder. */
typedef struct identity {
    bool known, exists, keeps; /* keeps: what is written to it; terminals do not */
    struct stat at;            /* of the file, or of the folder that it would be made in */
    const char *name;          /* within the folder, where the file does not exist */
} identity;

/* What tells one file from another: its inode, or that of its folder and its name if it does not exist. */
static identity identity_of(qw_env *env, const char *path)
{
    identity it = {.keeps = true};
    path = resolve(env, path);
    int descriptor = descriptor_of(path);
    it.exists = (descriptor >= 0 ? fstat(descriptor, &it.at) : stat(path, &it.at)) == 0;
    if (it.exists) it.keeps = !S_ISCHR(it.at.st_mode);
    it.known = it.exists || (descriptor < 0 && stat(folder_of(env, path), &it.at) == 0);
    const char *slash = strrchr(path, '/');
    it.name = slash ? slash + 1 : path;
    return it;
}

bool qw_file_is_same(qw_env *env, const char *path, const char *other)
{
    qw_scope_begin(env);
    identity a = identity_of(env, path), b = identity_of(env, other);
    bool same = a.known && b.known && a.exists == b.exists && a.keeps && b.keeps && a.at.st_dev == b.at.st_dev &&
                a.at.st_ino == b.at.st_ino;
    for (const char *p = a.name, *q = b.name; same && !a.exists && (*p || *q); p++, q++) same = lower(*p) == lower(*q);
    qw_scope_end(env);
    return same;
}

#endif

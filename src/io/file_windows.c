#ifdef _WIN32 /* elsewhere it is file.c */
/* Files on Windows, by the wide calls, as UTF-8 paths need them. A file is written beside its target and takes its
 * place by MoveFileEx, which replaces what is there at once. Streams are binary. */
#include "io/file.h"

#define WIN32_LEAN_AND_MEAN
#include <fcntl.h>
#include <inttypes.h>
#include <io.h>
#include <stdio.h>
#include <string.h>
#include <windows.h>

struct qw_file {
    qw_env *env;
    const char *name;     /* for messages */
    HANDLE handle;        /* INVALID_HANDLE_VALUE: none */
    bool standard;        /* not ours to close */
    const char *target;   /* NULL: written directly */
    wchar_t *target_wide; /* of target */
    wchar_t *temporary;   /* beside the target */
    bool has_temporary, is_settled;
    size_t filled;
    char *buffer; /* char[QW_FILE_BUFFER] */
};

typedef struct cause {
    char text[QW_CAUSE_SIZE];
} cause;

static cause cause_of(DWORD error)
{
    cause c = {{0}};
    DWORD size = FormatMessageA(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, NULL, error, 0, c.text,
                                QW_CAUSE_SIZE - 1, NULL);
    while (size > 0 && (c.text[size - 1] == '\n' || c.text[size - 1] == '\r' || c.text[size - 1] == '.')) size--;
    c.text[size] = 0;
    if (size == 0) snprintf(c.text, sizeof c.text, "error %lu", (unsigned long)error);
    return c;
}

static wchar_t *wide_of(qw_env *env, const char *path, size_t room)
{
    int size = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, path, -1, NULL, 0);
    if (size <= 0) qw_fail(env, QW_ARGUMENT, -1, "%s: the path is not UTF-8", qw_path_for_messages(env, path, path));
    wchar_t *wide = QW_NEW_ZERO(env, wchar_t, (size_t)size + room);
    MultiByteToWideChar(CP_UTF8, 0, path, -1, wide, size);
    return wide;
}

/* ---- reading */

static void close_handle(void *resource)
{
    HANDLE *handle = resource;
    if (*handle != INVALID_HANDLE_VALUE) CloseHandle(*handle);
}

static _Noreturn void fail_to_read(qw_env *env, const char *name, DWORD error)
{
    cause c = cause_of(error);
    if (error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND || error == ERROR_INVALID_NAME)
        qw_fail(env, QW_FILE_MISSING, -1, "%s: the file does not exist", name);
    qw_fail(env, QW_FILE_UNREADABLE, -1, "%s: cannot be read: %s", name, c.text);
}

/* What is left of the handle; of what has a size no more than `most` bytes. */
static qw_bytes read_all(qw_env *env, HANDLE handle, const char *name, uint64_t most)
{
    LARGE_INTEGER length;
    bool known = GetFileType(handle) == FILE_TYPE_DISK && GetFileSizeEx(handle, &length) && length.QuadPart > 0;
    uint64_t there = known ? (uint64_t)length.QuadPart : 0;
    if (there > most) there = most;
    if (there > SIZE_MAX / 2) qw_fail(env, QW_MEMORY, -1, "%s: is too large to be read", name);
    size_t capacity = 0, size = 0, expected = known ? (size_t)there + QW_ZEROS + 1 : QW_FIRST_READ;
    char *bytes = qw_grow(env, NULL, &capacity, expected, 1);
    for (;;) {
        if (size + QW_ZEROS == capacity) bytes = qw_grow(env, bytes, &capacity, capacity + 1, 1);
        size_t room = capacity - QW_ZEROS - size;
        DWORD got = 0;
        qw_heartbeat_outside(env);
        if (!ReadFile(handle, bytes + size, (DWORD)(room < QW_MOST_READ ? room : QW_MOST_READ), &got, NULL)) {
            if (GetLastError() == ERROR_BROKEN_PIPE || GetLastError() == ERROR_HANDLE_EOF) break;
            fail_to_read(env, name, GetLastError());
        }
        if (got == 0) break;
        size += got;
        if (size >= most) {
            size = (size_t)most;
            break;
        }
    }
    memset(bytes + size, 0, QW_ZEROS);
    return (qw_bytes){bytes, size};
}

/* A handle that is closed with the caller's scope. */
static HANDLE open_to_read(qw_env *env, const char *path, const char *name)
{
    wchar_t *wide = wide_of(env, path, 0);
    DWORD attributes = GetFileAttributesW(wide);
    if (attributes != INVALID_FILE_ATTRIBUTES && attributes & FILE_ATTRIBUTE_DIRECTORY)
        qw_fail(env, QW_FILE_IS_DIRECTORY, -1, "%s: is a directory", name);
    HANDLE *handle = QW_NEW(env, HANDLE, 1);
    *handle = INVALID_HANDLE_VALUE;
    qw_defer(env, close_handle, handle); /* before there is something to lose, as this may fail */
    *handle = CreateFileW(wide, GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL,
                          OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, NULL);
    if (*handle == INVALID_HANDLE_VALUE) fail_to_read(env, name, GetLastError());
    return *handle;
}

qw_bytes qw_file_read(qw_env *env, const char *path, const char *name)
{
    qw_heartbeat_begin(env);
    bool standard = strcmp(path, "-") == 0;
    return read_all(env, standard ? GetStdHandle(STD_INPUT_HANDLE) : open_to_read(env, path, name), name, UINT64_MAX);
}

qw_bytes qw_file_read_regular(qw_env *env, const char *path, const char *name, uint64_t most, bool may_cut)
{
    qw_heartbeat_begin(env);
    HANDLE handle = open_to_read(env, path, name);
    if (GetFileType(handle) != FILE_TYPE_DISK) qw_fail(env, QW_FILE_UNREADABLE, -1, "%s: is no regular file", name);
    LARGE_INTEGER length;
    if (!may_cut && GetFileSizeEx(handle, &length) && (uint64_t)length.QuadPart > most)
        qw_fail(env, QW_TOO_LARGE, -1, "%s: has more than %" PRIu64 " bytes", name, most);
    return read_all(env, handle, name, most);
}

/* ---- writing */

static _Noreturn void fail_to_write(qw_env *env, const char *name, DWORD error)
{
    cause c = cause_of(error);
    qw_fail(env, QW_FILE_UNWRITABLE, -1, "%s: cannot be written: %s", name, c.text);
}

static void abandon(void *resource)
{
    qw_file *f = resource;
    if (f->handle != INVALID_HANDLE_VALUE && !f->standard) CloseHandle(f->handle);
    if (f->has_temporary) DeleteFileW(f->temporary);
}

static bool is_standard(const char *path) { return strcmp(path, "-") == 0; }

/* Devices ("NUL", "CON", a named pipe) are written directly. */
static bool is_device(const wchar_t *wide)
{
    HANDLE handle = CreateFileW(wide, 0, FILE_SHARE_READ | FILE_SHARE_WRITE, NULL, OPEN_EXISTING, 0, NULL);
    if (handle == INVALID_HANDLE_VALUE) return false;
    bool device = GetFileType(handle) != FILE_TYPE_DISK;
    CloseHandle(handle);
    return device;
}

/* The folder and "quadwright-<process>-<i>.part" beside the target: names of ours may be left from a run that was
 * killed. */
static void open_temporary(qw_file *f)
{
    const wchar_t *last = f->target_wide;
    for (const wchar_t *c = f->target_wide; *c; c++)
        if (*c == L'/' || *c == L'\\' || *c == L':') last = c + 1;
    size_t folder = (size_t)(last - f->target_wide);
    memcpy(f->temporary, f->target_wide, folder * sizeof *f->temporary);
    for (int i = 0; i < QW_MOST_NAMES_TRIED; i++) {
        _snwprintf(f->temporary + folder, QW_TEMPORARY_SIZE, L"quadwright-%lu-%d.part",
                   (unsigned long)GetCurrentProcessId(), i);
        f->handle = CreateFileW(f->temporary, GENERIC_WRITE, 0, NULL, CREATE_NEW, FILE_ATTRIBUTE_NORMAL, NULL);
        f->has_temporary = f->handle != INVALID_HANDLE_VALUE;
        if (f->has_temporary) return;
        if (GetLastError() != ERROR_FILE_EXISTS) break;
    }
    fail_to_write(f->env, f->name, GetLastError());
}

static void require_target(qw_env *env, const wchar_t *wide, const char *name)
{
    DWORD attributes = GetFileAttributesW(wide);
    if (attributes == INVALID_FILE_ATTRIBUTES) return;
    if (attributes & FILE_ATTRIBUTE_DIRECTORY) qw_fail(env, QW_FILE_UNWRITABLE, -1, "%s: is a directory", name);
    if (attributes & FILE_ATTRIBUTE_READONLY) fail_to_write(env, name, ERROR_ACCESS_DENIED);
}

qw_file *qw_file_begin(qw_env *env, const char *path)
{
    qw_file *f = QW_NEW_ZERO(env, qw_file, 1);
    f->env = env;
    qw_heartbeat_begin(env);
    f->name = qw_path_for_messages(env, path, "standard output");
    f->handle = INVALID_HANDLE_VALUE;
    f->buffer = qw_alloc(env, QW_FILE_BUFFER, 1);
    f->standard = is_standard(path);
    if (!f->standard) {
        f->target_wide = wide_of(env, path, 0);
        f->temporary = wide_of(env, path, QW_TEMPORARY_SIZE);
        require_target(env, f->target_wide, f->name);
        if (!is_device(f->target_wide)) f->target = path;
    }
    qw_defer(env, abandon, f); /* after all blocks that it needs: they are released later */
    if (f->standard) {
        fflush(stdout); /* what the host has printed comes first */
        f->handle = GetStdHandle(STD_OUTPUT_HANDLE);
    } else if (f->target) {
        open_temporary(f);
    } else {
        f->handle = CreateFileW(f->target_wide, GENERIC_WRITE, FILE_SHARE_READ | FILE_SHARE_WRITE, NULL, OPEN_EXISTING,
                                FILE_ATTRIBUTE_NORMAL, NULL);
        if (f->handle == INVALID_HANDLE_VALUE) fail_to_write(env, f->name, GetLastError());
    }
    return f;
}

static void flush(qw_file *f)
{
    for (size_t done = 0; done < f->filled;) {
        DWORD put = 0;
        qw_heartbeat_outside(f->env);
        if (!WriteFile(f->handle, f->buffer + done, (DWORD)(f->filled - done), &put, NULL))
            fail_to_write(f->env, f->name, GetLastError());
        done += put;
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
    if (f->is_settled) return;
    flush(f);
    if (f->target && !FlushFileBuffers(f->handle)) fail_to_write(f->env, f->name, GetLastError());
    HANDLE handle = f->handle;
    f->handle = INVALID_HANDLE_VALUE;
    if (!f->standard && !CloseHandle(handle)) fail_to_write(f->env, f->name, GetLastError());
    f->is_settled = true;
}

void qw_file_finish(qw_file *f)
{
    qw_file_settle(f);
    if (!f->target) return;
    if (!MoveFileExW(f->temporary, f->target_wide, MOVEFILE_REPLACE_EXISTING))
        fail_to_write(f->env, f->name, GetLastError());
    f->has_temporary = false;
}

void qw_file_require_writable(qw_env *env, const char *path)
{
    if (is_standard(path)) return;
    qw_scope_begin(env);
    const char *name = qw_path_for_messages(env, path, "standard output");
    wchar_t *wide = wide_of(env, path, 0), *folder = wide_of(env, path, 2), *last = NULL;
    require_target(env, wide, name);
    for (wchar_t *c = folder; *c; c++)
        if (*c == L'/' || *c == L'\\') last = c;
    if (last) {
        last[1] = 0;
        DWORD attributes = GetFileAttributesW(folder);
        if (attributes == INVALID_FILE_ATTRIBUTES) fail_to_write(env, name, ERROR_PATH_NOT_FOUND);
    }
    qw_scope_end(env);
}

/* ---- identity */

static bool identity_of(const wchar_t *wide, BY_HANDLE_FILE_INFORMATION *info)
{
    HANDLE handle = CreateFileW(wide, 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, NULL, OPEN_EXISTING,
                                FILE_FLAG_BACKUP_SEMANTICS, NULL);
    if (handle == INVALID_HANDLE_VALUE) return false;
    bool known = GetFileType(handle) == FILE_TYPE_DISK && GetFileInformationByHandle(handle, info);
    CloseHandle(handle);
    return known;
}

bool qw_file_is_same(qw_env *env, const char *path, const char *other)
{
    if (is_standard(path) || is_standard(other)) return false;
    qw_scope_begin(env);
    wchar_t *a = wide_of(env, path, 0), *b = wide_of(env, other, 0);
    BY_HANDLE_FILE_INFORMATION ia, ib;
    bool has_a = identity_of(a, &ia), has_b = identity_of(b, &ib), same = false;
    if (has_a && has_b) {
        same = ia.dwVolumeSerialNumber == ib.dwVolumeSerialNumber && ia.nFileIndexHigh == ib.nFileIndexHigh &&
               ia.nFileIndexLow == ib.nFileIndexLow;
    } else if (!has_a && !has_b && !is_device(a) && !is_device(b)) {
        wchar_t full_a[MAX_PATH], full_b[MAX_PATH];
        DWORD na = GetFullPathNameW(a, MAX_PATH, full_a, NULL), nb = GetFullPathNameW(b, MAX_PATH, full_b, NULL);
        same = na > 0 && nb > 0 && na < MAX_PATH && nb < MAX_PATH &&
               CompareStringOrdinal(full_a, -1, full_b, -1, TRUE) == CSTR_EQUAL;
    }
    qw_scope_end(env);
    return same;
}

#endif

/* What a result of a batch depends on, and what keeps two batches, or two sets of options, out of one folder. */
#define _XOPEN_SOURCE 700
#include "batch.h"
#include "commands.h"

#ifndef _WIN32

#include "base/json.h"
#include "base/report.h"
#include "io/gltf/gltf.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum {
    MOST_BEGINNING = 64,    /* bytes of a file by which glTF is told */
    MOST_OF_HEAD = 1 << 16, /* bytes of an OBJ in which its mtllib is looked for */
    MOST_OF_MTL = 1 << 24
};

/* ---- keys */

static uint64_t hash_text(uint64_t h, const char *text) { return qw_hash_bytes(h, text, strlen(text) + 1); }

/* Size and time; of a file that is not there, that. */
static uint64_t hash_file(uint64_t h, const char *path)
{
    struct stat s;
    int64_t parts[3] = {-1};
    if (stat(path, &s) == 0)
        parts[0] = (int64_t)s.st_size, parts[1] = (int64_t)s.st_mtim.tv_sec, parts[2] = (int64_t)s.st_mtim.tv_nsec;
    return qw_hash_bytes(h, parts, sizeof parts);
}

/* Texture coordinates and maps, where they are asked for. */
static uint64_t hash_asset(uint64_t h, const qw_arguments *a)
{
    const uint32_t what[] = {a->unwrap, a->bake, a->maps};
    for (size_t i = 0; i < qw_asset_option_count(); i++) {
        char value[64] = "";
        qw_asset_option_get(&a->asset, qw_asset_option_at(i)->name, value, sizeof value);
        h = hash_text(h, value);
    }
    return qw_hash_bytes(h, what, sizeof what);
}

/* A hash of all that the result depends on besides the input: options without threads, version, what is kept,
   levels, asset. */
static uint64_t hash_settings(const qw_arguments *a)
{
    uint64_t h = QW_HASH_BYTES;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        char value[64] = "";
        qw_option_get(&a->options, name, value, sizeof value);
        if (strcmp(name, "threads") == 0) continue;
        h = hash_text(hash_text(h, name), value);
    }
    const char *const others[] = {qw_version(), a->keep, a->density ? a->density : "", a->bare ? "bare" : ""};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) h = hash_text(h, others[i]);
    if (a->level_count > 0) h = qw_hash_bytes(h, a->level, (size_t)a->level_count * sizeof a->level[0]);
    return a->unwrap || a->bake ? hash_asset(h, a) : h;
}

typedef struct beside {
    qw_env *env;
    const char *path;
    qw_pen files;
} beside;

static void list_files(void *user)
{
    beside *b = user;
    qw_bytes bytes = qw_file_read_regular(b->env, b->path, b->path, UINT64_MAX, true);
    qw_gltf_list_files(b->env, b->path, b->path, bytes, &b->files);
}

/* Whether the file is glTF, whose buffers and images may lie beside it. */
static bool names_files(const char *path)
{
    struct stat s;
    char begin[MOST_BEGINNING + QW_ZEROS] = "";
    FILE *file = stat(path, &s) == 0 && S_ISREG(s.st_mode) ? fopen(path, "rb") : NULL;
    size_t size = file ? fread(begin, 1, MOST_BEGINNING, file) : 0;
    if (file) fclose(file);
    return qw_is_glb((qw_bytes){begin, size}) || qw_is_gltf((qw_bytes){begin, size});
}

static uint64_t hash_files_beside(uint64_t h, const char *path)
{
    beside b = {.path = path};
    if (!names_files(path) || !(b.env = qw_env_create(NULL, 1))) return h;
    b.files.env = b.env;
    /* a file that cannot be read, or is no glTF, depends on nothing else */
    if (qw_protect(b.env, list_files, &b) == QW_OK)
        for (size_t at = 0; at < b.files.size; at += strlen(b.files.at + at) + 1) h = hash_file(h, b.files.at + at);
    qw_env_destroy(b.env);
    return h;
}

/* The first bytes of a text file, a line each cut off by 0; NULL: it cannot be read. */
static char *read_lines(const char *path, size_t most, size_t *size)
{
    FILE *file = fopen(path, "rb");
    char *text = file ? malloc(most + 1) : NULL;
    *size = text ? fread(text, 1, most, file) : 0;
    if (file) fclose(file);
    for (size_t i = 0; i < *size; i++)
        if (text[i] == '\n' || text[i] == '\r') text[i] = 0;
    if (text) text[*size] = 0;
    return text;
}

/* What follows one of the words at the beginning of a line; NULL: another line. */
static const char *after_word(const char *line, const char *const *words)
{
    while (*line == ' ' || *line == '\t') line++;
    for (; *words; words++)
        if (strncmp(line, *words, strlen(*words)) == 0) {
            line += strcspn(line, " \t"), line += strspn(line, " \t");
            return *line ? line : NULL;
        }
    return NULL;
}

static void join_folder(char *to, size_t size, const char *path, const char *name)
{
    const char *slash = strrchr(path, '/');
    snprintf(to, size, "%.*s%s", slash ? (int)(slash + 1 - path) : 0, path, name);
}

/* The textures that an MTL names: the last word of each line. */
static uint64_t hash_textures(uint64_t h, const char *mtl)
{
    static const char *const words[] = {"map_", "norm", "bump", "disp", NULL};
    char path[4200];
    size_t size;
    char *text = read_lines(mtl, MOST_OF_MTL, &size);
    for (size_t at = 0; text && at < size; at += strlen(text + at) + 1) {
        const char *name = after_word(text + at, words);
        if (!name) continue;
        const char *space = strrchr(name, ' ');
        join_folder(path, sizeof path, mtl, space && space[1] ? space + 1 : name);
        h = hash_file(h, path);
    }
    free(text);
    return h;
}

/* Materials are baked: those that an OBJ names at its head, and their textures. */
static uint64_t hash_materials(uint64_t h, const char *path)
{
    static const char *const words[] = {"mtllib", NULL};
    char mtl[4200];
    size_t size;
    char *text = read_lines(path, MOST_OF_HEAD, &size);
    for (size_t at = 0; text && at < size; at += strlen(text + at) + 1) {
        const char *name = after_word(text + at, words);
        if (!name) continue;
        join_folder(mtl, sizeof mtl, path, name);
        h = hash_textures(hash_file(h, mtl), mtl);
    }
    free(text);
    return h;
}

void batch_settings_key(const qw_arguments *a, char key[BATCH_KEY_SIZE])
{
    snprintf(key, BATCH_KEY_SIZE, "%016" PRIx64, hash_settings(a));
}

void batch_key(const qw_arguments *a, const batch_model *m, char key[BATCH_KEY_SIZE])
{
    uint64_t h = hash_file(hash_settings(a), m->input);
    if (a->density) h = hash_file(h, a->density); /* where it is no property */
    if (a->bake) h = hash_materials(h, m->input);
    snprintf(key, BATCH_KEY_SIZE, "%016" PRIx64, hash_files_beside(h, m->input));
}

/* ---- results of other options */

void batch_member(const char *record, const char *name, char *value, size_t size)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", name);
    const char *at = strstr(record, quoted);
    value[0] = 0;
    if (!at) return;
    at += strlen(quoted);
    at += *at == '"';
    size_t n = strcspn(at, "\",}");
    snprintf(value, size, "%.*s", (int)(n < size ? n : size - 1), at);
}

/* The first option that the record has otherwise: "faces was 4000 and is 5000 now". */
static void tell_difference(const qw_arguments *a, const char *record, char *text, size_t size)
{
    char was[64], is[64];
    const char *options = strstr(record, "\"options\": {");
    qw_json json = {.is_line = true};
    qw_json_begin(&json, NULL, '{');
    qw_json_options(&json, "options", &a->options);
    qw_json_end(&json, '}');
    snprintf(text, size, "another set of switches");
    batch_member(record, "version", was, sizeof was);
    if (strcmp(was, qw_version()) != 0) snprintf(text, size, "another version of the program");
    for (size_t i = 0; options && !qw_json_failed(&json) && i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        batch_member(options, name, was, sizeof was), batch_member(json.text, name, is, sizeof is);
        if (strcmp(name, "threads") == 0 || strcmp(was, is) == 0) continue;
        snprintf(text, size, "%s was %s and is %s now", name, was, is);
        break;
    }
    free(json.text);
}

int batch_require_same_options(const qw_arguments *a, const batch_list *list)
{
    char settings[BATCH_KEY_SIZE], was[BATCH_KEY_SIZE], status[32], difference[200] = "", message[800];
    size_t others = 0;
    batch_settings_key(a, settings);
    for (size_t i = 0; i < list->count && !a->force; i++) {
        size_t size = 0;
        char *record = batch_read(list->model[i].record, &size);
        if (!record) continue;
        bool is_whole = size > 2 && strcmp(record + size - 2, "}\n") == 0;
        batch_member(record, "settings", was, sizeof was);
        batch_member(record, "status", status, sizeof status);
        if (is_whole && strcmp(status, "OK") == 0 && strcmp(was, settings) != 0) {
            if (others++ == 0) tell_difference(a, record, difference, sizeof difference);
        }
        free(record);
    }
    if (others == 0) return 0;
    snprintf(message, sizeof message,
             "%.200s holds %zu results of other options (%s): choose another folder, or replace them with --force",
             a->output, others, difference);
    return qw_complain(QW_ARGUMENT, message);
}

/* ---- one batch at a time */

/* Whether another process has the file. A record lock is the process's own: forked children have no share of it, and it
 * goes with the process, however that ends. Where the file system has no locks nobody has it. */
static bool is_taken(const char *path, short how)
{
    struct flock all = {.l_type = how, .l_whence = SEEK_SET};
    int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0) return false;
    if (fcntl(file, F_SETLK, &all) == 0) return false; /* kept open until the end: to close it would give it back */
    bool taken = errno == EACCES || errno == EAGAIN;
    close(file);
    return taken;
}

/* All of the folder, or, of what all shards share, this shard. */
int batch_lock(const qw_arguments *a)
{
    char path[4200], message[512];
    snprintf(path, sizeof path, "%s/.quadwright-batch", a->output);
    (void)batch_make_folders(path); /* where that fails, the first model says so */
    bool taken = is_taken(path, a->shards ? F_RDLCK : F_WRLCK);
    if (a->shards && !taken) {
        snprintf(path, sizeof path, "%s/.quadwright-batch-%lld-of-%lld", a->output, (long long)a->shard,
                 (long long)a->shards);
        taken = is_taken(path, F_WRLCK);
    }
    if (!taken) return 0;
    snprintf(message, sizeof message,
             "%.300s: another batch is at work in this folder; wait for its end, or choose another", a->output);
    return qw_complain(QW_FILE_UNWRITABLE, message);
}

#endif

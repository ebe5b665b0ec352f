/* Which models a batch is of: a folder with all below it, or a list of paths; and of these the shard. */
#define _XOPEN_SOURCE 700
#include "batch.h"
#include "commands.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

void batch_free(batch_list *list)
{
    for (size_t i = 0; i < list->count; i++) {
        batch_model *m = &list->model[i];
        free(m->name), free(m->input), free(m->output), free(m->record);
    }
    for (size_t i = 0; i < list->others; i++) free(list->other[i]);
    free(list->model), free(list->other);
    *list = (batch_list){0};
}

#ifndef _WIN32

#include <dirent.h>
#include <errno.h>
#include <sys/stat.h>

static char *join(const char *a, const char *between, const char *b)
{
    size_t n = strlen(a) + strlen(between) + strlen(b) + 1;
    char *text = malloc(n);
    if (text) snprintf(text, n, "%s%s%s", a, between, b);
    return text;
}

bool batch_make_folders(const char *path)
{
    char *copy = join(path, "", "");
    bool is_made = copy != NULL;
    for (char *at = copy; is_made && (at = strchr(at + 1, '/'));) {
        *at = 0;
        is_made = mkdir(copy, 0777) == 0 || errno == EEXIST;
        *at = '/';
    }
    free(copy);
    return is_made;
}

char *batch_read(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    size_t length = 0, capacity = 1 << 16, got = 1;
    char *text = file ? malloc(capacity) : NULL;
    while (text && got > 0) {
        if (length + 1 >= capacity) {
            char *grown = realloc(text, capacity *= 2);
            if (!grown) {
                free(text);
                text = NULL;
                break;
            }
            text = grown;
        }
        length += got = fread(text + length, 1, capacity - 1 - length, file);
    }
    if (text) text[length] = 0;
    if (file) fclose(file);
    if (size) *size = length;
    return text;
}

static bool is_of_shard(const qw_arguments *a, const char *name)
{
    uint64_t hash = qw_mix(qw_hash_bytes(QW_HASH_BYTES, name, strlen(name)));
    return a->shards == 0 || hash % (uint64_t)a->shards == (uint64_t)a->shard;
}

/* The path without what would lead out of a folder that it is put into. */
static char *inner_name(const char *path)
{
    char *name = malloc(strlen(path) + 1), *to = name;
    while (name && *path) {
        size_t n = strcspn(path, "/");
        bool is_kept = n > 0 && !(n == 1 && path[0] == '.') && !(n == 2 && path[0] == '.' && path[1] == '.');
        if (is_kept) {
            if (to > name) *to++ = '/';
            memcpy(to, path, n), to += n;
        }
        path += n + (path[n] == '/');
    }
    if (name) *to = 0;
    return name;
}

/* A model of the list: its input, output and record. False: out of memory. Those of other shards are passed over. */
static bool add(const qw_arguments *a, batch_list *list, const char *input, const char *path_in_out)
{
    char *name = inner_name(path_in_out);
    if (!name) return false;
    if (!name[0] || !is_of_shard(a, name)) {
        free(name);
        return true;
    }
    if (list->count == list->capacity) {
        size_t wanted = 2 * list->capacity + 64;
        batch_model *grown = realloc(list->model, wanted * sizeof *grown);
        if (!grown) {
            free(name);
            return false;
        }
        list->model = grown, list->capacity = wanted;
    }
    char *stem = join(a->output, "/", name);
    batch_model m = {.name = name, .input = join(input, "", "")};
    if (stem) m.output = join(stem, ".quads.", qw_format_words[a->format]), m.record = join(stem, "", ".record.json");
    free(stem);
    list->model[list->count++] = m;
    return m.input && m.output && m.record;
}

static bool add_other(batch_list *list, const char *name)
{
    if (list->others == list->other_capacity) {
        size_t wanted = 2 * list->other_capacity + 64;
        char **grown = realloc(list->other, wanted * sizeof *grown);
        if (!grown) return false;
        list->other = grown, list->other_capacity = wanted;
    }
    list->other[list->others] = join(name, "", "");
    return list->other[list->others++] != NULL;
}

static bool ends(const char *name, const char *ending)
{
    size_t n = strlen(name), length = strlen(ending);
    return n > length && strcasecmp(name + n - length, ending) == 0;
}

/* Points count too, which are wrapped. */
static bool is_mesh_name(const char *name)
{
    static const char *const endings[] = {".obj", ".ply", ".off", ".stl", ".glb", ".gltf", ".xyz", ".pts", ".pcd"};
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        if (ends(name, endings[i])) return true;
    return false;
}

typedef struct identity {
    dev_t device;
    ino_t number;
} identity;

static int by_identity(const void *a, const void *b)
{
    const identity *x = a, *y = b;
    if (x->device != y->device) return x->device < y->device ? -1 : 1;
    return x->number < y->number ? -1 : x->number > y->number;
}

static bool identify(const char *path, identity *it)
{
    struct stat s;
    if (stat(path, &s) != 0) return false;
    *it = (identity){s.st_dev, s.st_ino};
    return true;
}

static bool is_same_file(const char *a, const char *b)
{
    identity x, y;
    return identify(a, &x) && identify(b, &y) && by_identity(&x, &y) == 0;
}

enum { DEEPEST = 32 }; /* folders within folders; links may lead in circles */

/* All meshes below a folder, but for those in the output folder. */
static bool add_folder(const qw_arguments *a, batch_list *list, const char *path, const char *name, int depth)
{
    struct stat here;
    if (depth > DEEPEST || stat(path, &here) != 0) return true;
    if (is_same_file(path, a->output)) return true;
    DIR *folder = opendir(path);
    if (!folder) return false;
    bool is_whole = true;
    for (struct dirent *entry; is_whole && (entry = readdir(folder));) {
        if (entry->d_name[0] == '.') continue;
        char *below = join(path, "/", entry->d_name),
             *inner = name[0] ? join(name, "/", entry->d_name) : join(entry->d_name, "", "");
        is_whole = below && inner;
        if (is_whole && stat(below, &here) == 0) {
            if (S_ISDIR(here.st_mode)) is_whole = add_folder(a, list, below, inner, depth + 1);
            else if (S_ISREG(here.st_mode))
                is_whole = is_mesh_name(entry->d_name) ? add(a, list, below, inner) : add_other(list, inner);
        }
        free(below), free(inner);
    }
    closedir(folder);
    return is_whole;
}

static bool add_lines(const qw_arguments *a, batch_list *list, FILE *file)
{
    char line[8192];
    bool is_whole = true;
    while (is_whole && fgets(line, sizeof line, file)) {
        line[strcspn(line, "\r\n")] = 0;
        if (line[0]) is_whole = add(a, list, line, line);
    }
    return is_whole && !ferror(file);
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const batch_model *)a)->name, ((const batch_model *)b)->name);
}

static int by_text(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

/* Two lines may name the same file, and then it is one model. Two files of one name are refused, as they would have one
 * output; the exit code. */
static int sort(batch_list *list)
{
    size_t kept = 0;
    if (list->count > 0) qsort(list->model, list->count, sizeof *list->model, by_name);
    if (list->others > 0) qsort(list->other, list->others, sizeof *list->other, by_text);
    for (size_t i = 0; i < list->count; i++) {
        batch_model m = list->model[i], *last = kept > 0 ? &list->model[kept - 1] : NULL;
        if (last && strcmp(last->name, m.name) == 0) {
            bool is_same = strcmp(last->input, m.input) == 0 || is_same_file(last->input, m.input);
            char message[512];
            snprintf(message, sizeof message, "%.200s and %.200s would both become %.60s", last->input, m.input,
                     m.name);
            free(m.name), free(m.input), free(m.output), free(m.record);
            if (is_same) continue;
            for (size_t k = i + 1; k < list->count; k++) list->model[kept++] = list->model[k]; /* to be freed */
            list->count = kept;
            return qw_complain(QW_ARGUMENT, message);
        }
        list->model[kept++] = m;
    }
    list->count = kept;
    return 0;
}

/* A list may name quads of an earlier batch, over which this one would write; the exit code. */
static int require_spared(const batch_list *list)
{
    identity *input = calloc(list->count + 1, sizeof *input), it;
    size_t inputs = 0;
    char message[512] = "";
    if (!input) return qw_complain(QW_MEMORY, NULL);
    for (size_t i = 0; i < list->count; i++) inputs += identify(list->model[i].input, &input[inputs]);
    qsort(input, inputs, sizeof *input, by_identity);
    for (size_t i = 0; i < list->count && !message[0]; i++) {
        const char *written[] = {list->model[i].output, list->model[i].record};
        for (int k = 0; k < 2; k++)
            if (identify(written[k], &it) && bsearch(&it, input, inputs, sizeof *input, by_identity))
                snprintf(message, sizeof message, "the quads of %.200s would write over %.200s, which is an input too",
                         list->model[i].name, written[k]);
    }
    free(input);
    return message[0] ? qw_complain(QW_ARGUMENT, message) : 0;
}

int batch_find(const qw_arguments *a, batch_list *list)
{
    struct stat s;
    *list = (batch_list){0};
    bool is_whole = false, is_stdin = strcmp(a->input, "-") == 0;
    char message[512] = "";
    errno = 0;
    if (!is_stdin && stat(a->input, &s) != 0) {
        snprintf(message, sizeof message, "%.400s: %s", a->input, strerror(errno));
        return qw_complain(QW_FILE_MISSING, message);
    }
    bool is_step = ends(a->input, ".step") || ends(a->input, ".stp");
    if (!is_stdin && !S_ISDIR(s.st_mode) && (is_step || is_mesh_name(a->input))) {
        snprintf(message, sizeof message,
                 "%.300s is a model%s: a batch takes a folder of models, or a file with the name of one on each line",
                 a->input, is_step ? ", of which gmsh FILE.step -2 -o FILE.stl makes one that can be read" : "");
        return qw_complain(QW_ARGUMENT, message);
    }
    if (!is_stdin && S_ISDIR(s.st_mode)) {
        is_whole = add_folder(a, list, a->input, "", 0);
    } else {
        FILE *file = is_stdin ? stdin : fopen(a->input, "rb");
        is_whole = file && add_lines(a, list, file);
        if (file && !is_stdin) fclose(file);
    }
    if (!is_whole) {
        snprintf(message, sizeof message, "%.400s: the models cannot be listed: %s", a->input,
                 strerror(errno ? errno : ENOMEM));
        batch_free(list);
        return qw_complain(QW_FILE_UNREADABLE, message);
    }
    int code = sort(list);
    if (code == 0) code = require_spared(list);
    if (code != 0) batch_free(list);
    return code;
}

#endif

/* JSON, a zero and bytes as the two chunks of a GLB, with lengths that are right, so that what is behind them is
 * reached: either a mesh with attributes that hold, which can be written and read again, or a failure with a sentence.
 *
 * The file lies in a folder in which URIs find what files may be: regular ("b", 60 bytes), a pipe that nobody writes to
 * ("p"), a device without end ("z"), one that is vast and holds nothing ("v"), a folder ("d") and a link to nothing
 * ("n"). What is written must be UTF-8 and JSON, whatever bytes the names have.
 */
#define _GNU_SOURCE /* memfd_create */
#include "base/printable.h"
#include "base/mesh_view.h"
#include "io/gltf/gltf.h"
#include "io/json_read.h"

#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

typedef struct trial {
    qw_env *env;
    char *glb;
    size_t size;
    qw_soup soup;
} trial;

static void put_word(char *at, size_t value)
{
    for (int i = 0; i < 4; i++) at[i] = (char)(value >> 8 * i);
}

static char *assemble(const uint8_t *bytes, size_t size, size_t *total)
{
    const uint8_t *zero = size ? memchr(bytes, 0, size) : NULL;
    size_t json = zero ? (size_t)(zero - bytes) : size, rest = zero ? size - json - 1 : 0;
    char *glb = calloc(28 + size + QW_ZEROS, 1);
    if (!glb) abort();
    memcpy(glb, "glTF", 4), put_word(glb + 4, 2), put_word(glb + 8, 28 + json + rest);
    put_word(glb + 12, json), memcpy(glb + 16, "JSON", 4);
    if (json) memcpy(glb + 20, bytes, json);
    put_word(glb + 20 + json, rest), memcpy(glb + 24 + json, "BIN", 4);
    if (rest) memcpy(glb + 28 + json, zero + 1, rest);
    *total = 28 + json + rest;
    return glb;
}

static char folder[] = "/tmp/fuzz_gltf-XXXXXX";
static int written = -1; /* what was written last */

static void remove_folder(void)
{
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    if (system(command) != 0) abort();
}

static void begin_folder(void)
{
    if (written >= 0) return;
    written = memfd_create("written", 0);
    if (written < 0 || !mkdtemp(folder)) abort();
    atexit(remove_folder);
    int there = open(folder, O_DIRECTORY), b = openat(there, "b", O_CREAT | O_WRONLY, 0600),
        v = openat(there, "v", O_CREAT | O_WRONLY, 0600);
    char bytes[60] = {[15] = 0x40, [27] = 0x40, [31] = 0x40, [43] = 0x40, [50] = 1, [52] = 2, [56] = 2, [58] = 3};
    bool is_made = write(b, bytes, sizeof bytes) == sizeof bytes && ftruncate(v, (off_t)1 << 40) == 0 &&
                   mkfifoat(there, "p", 0600) == 0 && symlinkat("/dev/zero", there, "z") == 0 &&
                   mkdirat(there, "d", 0700) == 0 && symlinkat("nothing", there, "n") == 0;
    if (!is_made) abort();
    close(b), close(v), close(there);
}

static void read_it(void *user)
{
    trial *t = user;
    char path[64];
    snprintf(path, sizeof path, "%s/it.glb", folder);
    t->soup = qw_read_gltf(t->env, "fuzz", path, (qw_bytes){t->glb, t->size});
}

static bool is_utf8(const char *text)
{
    while (*text && qw_utf8_size(text) > 0) text += qw_utf8_size(text);
    return *text == 0;
}

static void check(const qw_soup *s)
{
    const uint32_t counts[] = {s->vertex_count, s->face_begin[s->face_count], s->face_count};
    if (s->face_count == 0) abort();
    for (uint32_t c = 0; c < counts[1]; c++)
        if (s->corner[c] >= s->vertex_count) abort();
    for (size_t i = 0; i < 3 * (size_t)s->vertex_count; i++)
        if (!isfinite(s->position[i])) abort();
    for (uint32_t i = 0; i < s->attribute_count; i++) {
        const qw_attribute *a = &s->attribute[i];
        if (a->count != counts[a->domain] || !a->name[0] || !is_utf8(a->name)) abort();
        for (uint32_t k = 0; a->label_names && k < a->label_count; k++)
            if (!is_utf8(a->label_names[k])) abort();
        for (size_t k = 0; k < (size_t)a->count * a->components; k++) {
            if (a->values && !isfinite(a->values[k])) abort();
            if (a->labels && (a->labels[k] < -1 || a->labels[k] >= (int64_t)a->label_count)) abort();
            if (a->group && a->group[k] >= (a->label_count ? a->label_count : 1)) abort();
        }
    }
}

/* The JSON that was written, which holds all names and the buffer as a URI. */
static void check_json(qw_env *env)
{
    off_t size = lseek(written, 0, SEEK_END);
    char *text = qw_alloc_zero(env, (size_t)size + QW_ZEROS, 1);
    if (pread(written, text, (size_t)size, 0) != size) abort();
    for (off_t i = 0, step; i < size; i += step)
        if ((step = (off_t)qw_utf8_size(text + i)) == 0 || text[i] == 0) abort();
    (void)qw_json_parse(env, "written", text, (size_t)size);
}

static void write_it(void *user)
{
    trial *t = user;
    const qw_soup *s = &t->soup;
    qw_scope_begin(t->env);
    uint32_t *sizes = QW_NEW(t->env, uint32_t, s->face_count);
    for (uint32_t f = 0; f < s->face_count; f++) sizes[f] = s->face_begin[f + 1] - s->face_begin[f];
    const qw_mesh_view view = {.size = sizeof view,
                               .vertex_count = s->vertex_count,
                               .face_count = s->face_count,
                               .positions = s->position,
                               .face_sizes = sizes,
                               .corners = s->corner};
    const qw_carried_along along = {s->attribute, s->attribute_count, NULL, s->gltf, false}, bare = {0};
    char path[32];
    snprintf(path, sizeof path, "/dev/fd/%d", written);
    qw_write_with(t->env, "/dev/null", QW_FORMAT_GLB, &view, &bare);
    for (int i = 0; i < 2; i++) { /* with all of the file, and with its attributes alone, as for another's */
        const qw_carried_along alone = {s->attribute, s->attribute_count, NULL, NULL, false};
        if (ftruncate(written, 0) != 0 || lseek(written, 0, SEEK_SET) != 0) abort();
        qw_write_with(t->env, path, QW_FORMAT_GLTF, &view, i ? &alone : &along);
        check_json(t->env);
    }
    qw_scope_end(t->env);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    trial t = {.env = qw_env_create(&host, 1)};
    if (!t.env) return 0;
    begin_folder();
    t.glb = assemble(bytes, size, &t.size);
    qw_status status = qw_protect(t.env, read_it, &t);
    free(t.glb);
    if (status == QW_INTERNAL || (status != QW_OK && (!qw_env_message(t.env)[0] || qw_env_bytes(t.env)))) abort();
    if (status == QW_OK) {
        check(&t.soup);
        status = qw_protect(t.env, write_it, &t);
        bool is_refused = status == QW_MEMORY || status == QW_TOO_LARGE || status == QW_FILE_UNWRITABLE;
        if (status != QW_OK && !is_refused) abort();
    }
    qw_env_destroy(t.env);
    return 0;
}

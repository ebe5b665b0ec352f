/* JSON, a zero and bytes as the two chunks of a GLB, with lengths that are right, so that what is behind them is
 * reached: either a mesh with attributes that hold, which can be written and read again, or a failure with a sentence.
 */
#include "base/view.h"
#include "io/gltf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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
    char *glb = malloc(28 + size);
    if (!glb) abort();
    memcpy(glb, "glTF", 4), put_word(glb + 4, 2), put_word(glb + 8, 28 + json + rest);
    put_word(glb + 12, json), memcpy(glb + 16, "JSON", 4);
    if (json) memcpy(glb + 20, bytes, json);
    put_word(glb + 20 + json, rest), memcpy(glb + 24 + json, "BIN", 4);
    if (rest) memcpy(glb + 28 + json, zero + 1, rest);
    *total = 28 + json + rest;
    return glb;
}

static void read_it(void *user)
{
    trial *t = user;
    t->soup = qw_read_memory(t->env, t->glb, t->size, "fuzz");
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
        if (a->count != counts[a->domain] || !a->name[0]) abort();
        for (size_t k = 0; k < (size_t)a->count * a->components; k++) {
            if (a->values && !isfinite(a->values[k])) abort();
            if (a->labels && (a->labels[k] < -1 || a->labels[k] >= (int64_t)a->label_count)) abort();
            if (a->group && a->group[k] >= (a->label_count ? a->label_count : 1)) abort();
        }
    }
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
    const qw_carried_along along = {s->attribute, s->attribute_count, NULL, s->gltf}, bare = {0};
    qw_write_with(t->env, "/dev/null", QW_FORMAT_GLB, &view, &along);
    qw_write_with(t->env, "/dev/null", QW_FORMAT_GLTF, &view, &bare);
    qw_scope_end(t->env);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    trial t = {.env = qw_env_create(&host, 1)};
    if (!t.env) return 0;
    t.glb = assemble(bytes, size, &t.size);
    qw_status status = qw_protect(t.env, read_it, &t);
    free(t.glb);
    if (status == QW_INTERNAL || (status != QW_OK && (!qw_env_message(t.env)[0] || qw_env_bytes(t.env)))) abort();
    if (status == QW_OK) {
        check(&t.soup);
        status = qw_protect(t.env, write_it, &t);
        if (status != QW_OK && status != QW_MEMORY && status != QW_TOO_LARGE) abort();
    }
    qw_env_destroy(t.env);
    return 0;
}

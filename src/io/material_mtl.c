/* Materials of OBJ files (MTL). Factors are those of its old model; Pr, Pm and norm are the common extensions. */
#include "io/material.h"

#include <stdlib.h>
#include <string.h>

typedef struct mtl {
    qw_env *env;
    const char *folder; /* up to and with the last slash */
    qw_material_list list;
    size_t capacity;
    qw_material *now; /* NULL: before the first, or one that no face has */
    const char *const *names;
} mtl;

static char *copy(qw_env *env, const char *text, size_t size)
{
    char *to = QW_NEW(env, char, size + 1);
    memcpy(to, text, size), to[size] = 0;
    return to;
}

static char *beside(const mtl *m, const char *name)
{
    size_t a = name[0] == '/' ? 0 : strlen(m->folder), b = strlen(name);
    char *path = QW_NEW(m->env, char, a + b + 1);
    memcpy(path, m->folder, a), memcpy(path + a, name, b + 1);
    for (char *c = path + a; *c; c++)
        if (*c == '\\') *c = '/';
    return path;
}

/* A file, or at NULL where it cannot be read. */
typedef struct reading {
    qw_env *env;
    const char *path;
    qw_bytes bytes;
} reading;

static void read_file(void *user)
{
    reading *a = user;
    a->bytes = qw_file_read_regular(a->env, a->path, a->path, UINT32_MAX, false);
}

static qw_bytes read_or_warn(qw_env *env, const char *path)
{
    reading a = {.env = env, .path = path};
    if (qw_protect(env, read_file, &a) == QW_OK) return a.bytes;
    qw_log(env, QW_LOG_WARNING, "%s", qw_env_message(env));
    return (qw_bytes){NULL, 0};
}

/* What follows options such as -bm 1.0 is the name of a file. */
static const char *skip_options(const char *at)
{
    while (at[0] == '-' && at[1] >= 'a' && at[1] <= 'z') {
        at += strcspn(at, " \t"), at += strspn(at, " \t");
        for (int words = 0; words < 3; words++) {
            char *end;
            bool is_word = strncmp(at, "on", 2) == 0 || strncmp(at, "off", 3) == 0;
            double value = strtod(at, &end);
            (void)value;
            if ((end == at && !is_word) || (!is_word && *end != ' ' && *end != '\t')) break;
            at += strcspn(at, " \t"), at += strspn(at, " \t");
            if (is_word) break;
        }
    }
    return at;
}

static void take_map(mtl *m, const char *value, qw_texture *t)
{
    const char *path = beside(m, skip_options(value));
    for (uint32_t i = 0; i < m->list.image_count; i++)
        if (strcmp(m->list.image_name[i], path) == 0) {
            t->image = i;
            return;
        }
    size_t capacity = m->capacity;
    m->list.image = qw_grow(m->env, m->list.image, &capacity, m->list.image_count + (size_t)1, sizeof *m->list.image);
    m->list.image_name = qw_grow(m->env, m->list.image_name, &m->capacity, m->list.image_count + (size_t)1,
                                 sizeof *m->list.image_name);
    m->list.image[m->list.image_count] = read_or_warn(m->env, path);
    m->list.image_name[m->list.image_count] = path;
    t->image = m->list.image_count++;
}

static void take_numbers(const char *value, float *to, int count)
{
    for (int i = 0; i < count; i++) {
        char *end;
        double x = strtod(value, &end);
        if (end == value) return;
        to[i] = (float)x, value = end;
    }
}

static void take_line(mtl *m, char *word, char *value)
{
    qw_material *a = m->now;
    if (strcmp(word, "newmtl") == 0) {
        m->now = NULL;
        for (uint32_t i = 0; i < m->list.count; i++)
            if (strcmp(m->names[i], value) == 0) m->now = &m->list.material[i];
        return;
    }
    if (!a) return;
    if (strcmp(word, "Kd") == 0) take_numbers(value, a->color, 3);
    else if (strcmp(word, "Ke") == 0) take_numbers(value, a->emission, 3);
    else if (strcmp(word, "d") == 0) take_numbers(value, &a->color[3], 1);
    else if (strcmp(word, "Pr") == 0) take_numbers(value, &a->roughness, 1);
    else if (strcmp(word, "Pm") == 0) take_numbers(value, &a->metallic, 1);
    else if (strcmp(word, "map_Kd") == 0) take_map(m, value, &a->color_map);
    else if (strcmp(word, "map_Pr") == 0) take_map(m, value, &a->roughness_map);
    else if (strcmp(word, "map_Pm") == 0) take_map(m, value, &a->metallic_map);
    else if (strcmp(word, "norm") == 0) take_map(m, value, &a->normal_map);
    else if (strcmp(word, "map_Ke") == 0) {
        take_map(m, value, &a->emission_map);
        if (a->emission[0] == 0 && a->emission[1] == 0 && a->emission[2] == 0)
            a->emission[0] = a->emission[1] = a->emission[2] = 1;
    }
}

static void read_library(mtl *m, const char *name)
{
    qw_bytes bytes = read_or_warn(m->env, beside(m, name));
    m->now = NULL;
    for (size_t at = 0; bytes.at && at < bytes.size;) {
        size_t end = at;
        while (end < bytes.size && bytes.at[end] != '\n') end++;
        char *line = copy(m->env, bytes.at + at, end - at), *word = line + strspn(line, " \t");
        char *value = word + strcspn(word, " \t\r");
        if (*value) *value++ = 0, value += strspn(value, " \t");
        for (size_t n = strlen(value); n > 0 && strchr(" \t\r", value[n - 1]); n--) value[n - 1] = 0;
        take_line(m, word, value);
        at = end + 1;
    }
}

qw_material_list qw_mtl_materials(qw_env *env, const char *path, const char *library, const char *const *names,
                                  uint32_t count)
{
    const char *slash = strrchr(path, '/'), *back = strrchr(path, '\\');
    if (!slash || (back && back > slash)) slash = back;
    mtl m = {.env = env, .names = names};
    m.folder = copy(env, path, slash ? (size_t)(slash - path) + 1 : 0);
    m.list.count = count, m.list.material = QW_NEW(env, qw_material, count);
    for (uint32_t i = 0; i < count; i++) m.list.material[i] = qw_plain_material(), m.list.material[i].name = names[i];
    for (const char *at = library; at && *at;) {
        size_t size = strcspn(at, "\n");
        if (size > 0) read_library(&m, copy(env, at, size));
        at += size + (at[size] == '\n');
    }
    return m.list;
}

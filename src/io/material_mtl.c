/* Materials of OBJ files (MTL). Factors are those of its old model; Pr, Pm and norm are the common extensions. */
#include "io/material.h"

#include "io/number.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

typedef struct mtl {
    qw_env *env;
    const char *folder; /* up to and with the last slash */
    qw_material_list list;
    size_t capacity;
    qw_material *now; /* NULL: before the first, or one that no face has */
    const char *const *names;
    bool has_d, has_picture; /* of the material that is read */
} mtl;

/* QW_ZEROS zeros follow. */
static char *copy(qw_env *env, const char *text, size_t size)
{
    char *to = QW_NEW_ZERO(env, char, size + QW_ZEROS);
    memcpy(to, text, size);
    return to;
}

/* The path of a file that is named in another one, which some write in quotation marks. */
static char *beside(const mtl *m, const char *name)
{
    size_t b = strlen(name);
    if (b > 1 && name[0] == '"' && name[b - 1] == '"') name++, b -= 2;
    size_t a = name[0] == '/' ? 0 : strlen(m->folder);
    char *path = QW_NEW_ZERO(m->env, char, a + b + 1);
    memcpy(path, m->folder, a), memcpy(path + a, name, b);
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

static qw_bytes read_or_note(mtl *m, const char *path)
{
    reading a = {.env = m->env, .path = path};
    qw_status status = qw_protect(m->env, read_file, &a);
    if (status == QW_OK) return a.bytes;
    char why[QW_MATERIAL_NOTE];
    snprintf(why, sizeof why, "%s", qw_env_message(m->env));
    if (status == QW_MEMORY || status == QW_CANCELLED) qw_fail(m->env, status, -1, "%s", why);
    qw_note_material(m->env, &m->list, "%s", why);
    return (qw_bytes){NULL, 0};
}

/* ---- numbers */

/* Up to `most` of them; returns how many there are, and *at follows the last. */
static int take_numbers(const char **at, double *to, int most)
{
    int count = 0;
    for (; count < most; count++) {
        const char *next = *at + strspn(*at, " \t");
        if (!qw_number_read(&next, &to[count]) || (*next && *next != ' ' && *next != '\t')) break;
        *at = next;
    }
    *at += strspn(*at, " \t");
    return count;
}

/* One number stands for all of them. */
static void take_factors(mtl *m, const char *word, const char *value, qw_factor_range range, float *to, int count)
{
    double x[3];
    int there = take_numbers(&value, x, count);
    for (int i = 0; i < count && there > 0; i++)
        to[i] = qw_checked_factor(m->env, &m->list, m->now->name, word, x[i < there ? i : 0], range, to[i]);
}

/* ---- maps */

/* The number of the image of that path, which is read if it is new. */
static uint32_t image_at(mtl *m, const char *path)
{
    qw_material_list *l = &m->list;
    for (uint32_t i = 0; i < l->image_count; i++)
        if (strcmp(l->image_name[i], path) == 0) return i;
    size_t capacity = m->capacity;
    l->image = qw_grow(m->env, l->image, &capacity, l->image_count + (size_t)1, sizeof *l->image);
    l->image_name = qw_grow(m->env, l->image_name, &m->capacity, l->image_count + (size_t)1, sizeof *l->image_name);
    l->image[l->image_count] = read_or_note(m, path);
    l->image_name[l->image_count] = path;
    return l->image_count++;
}

static const char *word_end(const char *at) { return at + strcspn(at, " \t"); }

/* The option at *at, such as -s 2 2 1, for a texture; false: there is none. v grows downward in the texture, but upward
   in the file. */
static bool take_option(mtl *m, const char **at, qw_texture *t, double up[2][2])
{
    const char *name = *at, *end = word_end(name), *next = end + strspn(end, " \t");
    size_t size = (size_t)(end - name);
    double x[3];
    if (name[0] != '-' || !(name[1] >= 'a' && name[1] <= 'z')) return false;
    bool is_scale = size == 2 && name[1] == 's', is_shift = size == 2 && name[1] == 'o';
    int there = take_numbers(&next, x, 3);
    for (int i = 0; i < 2 && i < there && (is_scale || is_shift); i++)
        up[is_shift][i] = (double)qw_checked_factor(m->env, &m->list, m->now->name, is_shift ? "-o" : "-s", x[i],
                                                    qw_factor_any, (float)up[is_shift][i]);
    bool is_on = strncmp(next, "on", 2) == 0 && word_end(next) == next + 2, is_off = strncmp(next, "off", 3) == 0;
    if (size == 6 && strncmp(name, "-clamp", size) == 0 && is_on) t->wrap[0] = t->wrap[1] = 1;
    if (size == 8 && strncmp(name, "-imfchan", size) == 0 && strchr("rgbm", *next) && *next)
        t->channel = (uint32_t)(strchr("rgbm", *next) - "rgbm");
    bool has_word = there == 0 && (is_on || is_off || size == 8 || (size == 5 && strncmp(name, "-type", size) == 0));
    if (has_word) next = word_end(next), next += strspn(next, " \t");
    *at = next;
    return true;
}

static void take_map(mtl *m, const char *value, qw_texture *t)
{
    double up[2][2] = {{1, 1}, {0, 0}};
    while (take_option(m, &value, t, up)) continue;
    t->scale[0] = (float)up[0][0], t->offset[0] = (float)up[1][0];
    t->scale[1] = (float)up[0][1], t->offset[1] = (float)(1 - up[0][1] - up[1][1]);
    if (*value) t->image = image_at(m, beside(m, value));
}

/* ---- statements */

typedef struct factor_row {
    const char *word;
    size_t at; /* in a material */
    int count;
    bool is_share;
} factor_row;
static const factor_row factor_rows[] = {{"Kd", offsetof(qw_material, color), 3, true},
                                         {"Ke", offsetof(qw_material, emission), 3, false},
                                         {"Pr", offsetof(qw_material, roughness), 1, true},
                                         {"Pm", offsetof(qw_material, metallic), 1, true}};

typedef struct map_row {
    const char *word;
    size_t at; /* in a material */
} map_row;
static const map_row map_rows[] = {
    {"map_Kd", offsetof(qw_material, color_map)},     {"map_d", offsetof(qw_material, alpha_map)},
    {"map_Pr", offsetof(qw_material, roughness_map)}, {"map_Pm", offsetof(qw_material, metallic_map)},
    {"map_Ke", offsetof(qw_material, emission_map)},  {"norm", offsetof(qw_material, normal_map)}};

/* What is left out; first heights. */
enum { HEIGHTS = 3 };
static const char *const other_maps[] = {"map_Bump", "bump", "disp", "map_Ks", "map_Ka", "map_Ns", "decal", "refl"};

/* Whatever letters are capitals. */
static bool reads(const char *word, const char *name)
{
    while (*word && (*word | 0x20) == (*name | 0x20)) word++, name++;
    return *word == *name;
}

static bool take_factor(mtl *m, const char *word, const char *value)
{
    for (size_t i = 0; i < sizeof factor_rows / sizeof *factor_rows; i++) {
        const factor_row *r = &factor_rows[i];
        if (!reads(word, r->word)) continue;
        take_factors(m, r->word, value, r->is_share ? qw_factor_share : qw_factor_upward,
                     (float *)(void *)((char *)m->now + r->at), r->count);
        return true;
    }
    return false;
}

/* Both may be there, d and 1 - d; d is meant the same by all who write it. */
static void take_alpha(mtl *m, const char *word, const char *value)
{
    bool is_d = reads(word, "d"), is_tr = reads(word, "Tr");
    if (!is_d && !(is_tr && !m->has_d)) return;
    if (is_d && strncmp(value, "-halo", 5) == 0) value += 5;
    float x = is_d ? m->now->color[3] : 1 - m->now->color[3];
    take_factors(m, word, value, qw_factor_share, &x, 1);
    m->now->color[3] = is_d ? x : 1 - x, m->has_d |= is_d;
    m->now->alpha = m->now->color[3] < 1 ? 2 : 0;
}

/* Takes one line of an MTL file: a word, and the value behind it. */
static void take_line(mtl *m, char *word, char *value)
{
    if (reads(word, "newmtl")) {
        m->now = NULL, m->has_d = m->has_picture = false;
        for (uint32_t i = 0; i < m->list.count; i++)
            if (strcmp(m->names[i], value) == 0) m->now = &m->list.material[i];
        return;
    }
    if (!m->now) return;
    if (reads(word, "Kd") && m->has_picture) {
        float given[3] = {m->now->color[0], m->now->color[1], m->now->color[2]};
        take_factor(m, word, value);
        if (m->now->color[0] == 0 && m->now->color[1] == 0 && m->now->color[2] == 0)
            memcpy(m->now->color, given, sizeof given);
        return;
    }
    if (take_factor(m, word, value)) return;
    take_alpha(m, word, value);
    if (reads(word, "map_Kd")) {
        const float *c = m->now->color; /* as many write it who mean the picture alone */
        if (c[0] == 0 && c[1] == 0 && c[2] == 0) m->now->color[0] = m->now->color[1] = m->now->color[2] = 1;
        m->has_picture = true;
    }
    for (size_t i = 0; i < sizeof other_maps / sizeof *other_maps; i++)
        if (reads(word, other_maps[i]))
            qw_note_material(m->env, &m->list, "%s of materials is left out, as %s", other_maps[i],
                             i < HEIGHTS ? "heights have no unit; norm is read" : "maps have no place for it");
    for (size_t i = 0; i < sizeof map_rows / sizeof *map_rows; i++)
        if (reads(word, map_rows[i].word)) take_map(m, value, (qw_texture *)(void *)((char *)m->now + map_rows[i].at));
    const float *e = m->now->emission;
    if (reads(word, "map_Ke") && e[0] == 0 && e[1] == 0 && e[2] == 0)
        m->now->emission[0] = m->now->emission[1] = m->now->emission[2] = 1;
}

/* Reads an MTL file line by line; one that cannot be read is told of. */
static void read_library(mtl *m, const char *name)
{
    qw_bytes bytes = read_or_note(m, beside(m, name));
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

/* Materials with numbers at the ends: text that begins with { is a glTF, else it is an MTL of the materials a and b. In
 * both @ and a digit is a number from the table below. Whatever stands there, factors are finite, within what a
 * material may be, and each note is a sentence; or the file is refused with one. */
#define _GNU_SOURCE /* memfd_create */
#include "io/formats.h"
#include "io/material.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

enum { LONGEST = 12 }; /* bytes that stand for two */

static const char *const ends[10] = {"1e39",   "-1e39", "1e300",        "1e999", "nan",
                                     "1e-320", "-0",    "340282356e31", "-1",    "2147483648"};

typedef struct trial {
    qw_env *env;
    char *text; /* QW_ZEROS zeros follow */
    size_t size;
} trial;

static trial spell_out(const uint8_t *bytes, size_t size)
{
    trial t = {.text = calloc(LONGEST * size + QW_ZEROS + 1, 1)};
    if (!t.text) abort();
    for (size_t i = 0; i < size; i++) {
        bool is_end = bytes[i] == '@' && i + 1 < size && bytes[i + 1] >= '0' && bytes[i + 1] <= '9';
        if (!is_end) t.text[t.size++] = (char)bytes[i];
        else t.size += strlen(strcpy(t.text + t.size, ends[bytes[++i] - '0']));
    }
    return t;
}

static void require_within(float value, qw_factor_range range)
{
    if (!(value >= range.least && value <= range.most)) abort();
}

static void check_texture(const qw_texture *t)
{
    if (t->image == QW_NONE) return;
    /* an MTL's v goes up: its offset downward is 1 less scale and offset, each of which is in range */
    const qw_factor_range turned = {-2 * QW_MOST_FACTOR - 1, 2 * QW_MOST_FACTOR + 1};
    for (int k = 0; k < 2; k++) require_within(t->offset[k], turned), require_within(t->scale[k], qw_factor_any);
    require_within(t->rotation, qw_factor_any);
}

static void check(const qw_material_list *list)
{
    for (uint32_t i = 0; i < list->count; i++) {
        const qw_material *m = &list->material[i];
        for (int k = 0; k < 4; k++) require_within(m->color[k], k < 3 ? qw_factor_upward : qw_factor_share);
        for (int k = 0; k < 3; k++) require_within(m->emission[k], qw_factor_upward);
        require_within(m->metallic, qw_factor_share), require_within(m->roughness, qw_factor_share);
        require_within(m->occlusion_strength, qw_factor_share), require_within(m->normal_scale, qw_factor_any);
        require_within(m->cutoff, qw_factor_upward);
        if (m->alpha < 0 || m->alpha > 2) abort();
        const qw_texture *maps[] = {&m->color_map,     &m->alpha_map,    &m->metallic_map, &m->roughness_map,
                                    &m->occlusion_map, &m->emission_map, &m->normal_map};
        for (size_t k = 0; k < sizeof maps / sizeof *maps; k++) check_texture(maps[k]);
    }
    for (uint32_t i = 0; i < list->note_count; i++)
        if (!list->note[i][0]) abort();
}

static void read_gltf(void *user)
{
    trial *t = user;
    qw_soup soup = qw_read_gltf(t->env, "fuzz", NULL, (qw_bytes){t->text, t->size});
    qw_material_list list = qw_gltf_materials(t->env, soup.gltf, NULL);
    check(&list);
}

static void read_mtl(void *user)
{
    static const char *const names[] = {"a", "b"};
    trial *t = user;
    char library[32];
    int file = memfd_create("mtl", 0);
    if (file < 0 || write(file, t->text, t->size) != (ssize_t)t->size) abort();
    snprintf(library, sizeof library, "%d", file);
    qw_material_list list = qw_mtl_materials(t->env, "/dev/fd/it.obj", library, names, 2);
    close(file);
    check(&list);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    const qw_host host = {.memory_limit = (size_t)64 << 20};
    trial t = spell_out(bytes, size);
    t.env = qw_env_create(&host, 1);
    if (!t.env) abort();
    qw_status status = qw_protect(t.env, t.text[0] == '{' ? read_gltf : read_mtl, &t);
    if (status == QW_INTERNAL || (status != QW_OK && !qw_env_message(t.env)[0])) abort();
    qw_env_destroy(t.env);
    free(t.text);
    return 0;
}

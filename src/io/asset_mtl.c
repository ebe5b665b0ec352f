#include "io/asset_file.h"

#include <stdio.h>
#include <string.h>

typedef struct maker {
    qw_env *env;
    const qw_asset_look *look;
    const char *base; /* the path without its ending */
    const char *name; /* the same without its folder */
    qw_pen mtl;
} maker;

static const char *joined(qw_env *env, const char *a, const char *b, const char *c)
{
    qw_pen pen = {.env = env};
    qw_pen_text(&pen, a), qw_pen_text(&pen, b), qw_pen_text(&pen, c), qw_pen_put(&pen, "", 1);
    return pen.at;
}

/* ".1001" and so on, or "" where there is one tile only. */
static const char *number_of(qw_env *env, const qw_asset_look *look, uint32_t tile)
{
    char text[16] = "";
    if (look->tiles > 1) snprintf(text, sizeof text, ".%u", 1001 + tile);
    return joined(env, text, "", "");
}

/* The picture is written with the first material that has it. */
static void put_map(maker *k, uint32_t tile, uint32_t i, qw_map map, const char *statement)
{
    const qw_picture *p = &k->look->picture[tile * QW_MAP_COUNT + (uint32_t)map];
    if (!p->pixels) return;
    const char *end = joined(k->env, "_", qw_map_name(map),
                             joined(k->env, number_of(k->env, k->look, tile), ".png", ""));
    if (i == 0) {
        qw_pen png = {.env = k->env};
        qw_scope_begin(k->env);
        qw_put_png(k->env, p, &png);
        qw_file *file = qw_file_begin(k->env, joined(k->env, k->base, end, ""));
        qw_file_put(file, png.at, png.size);
        qw_file_finish(file);
        qw_scope_end(k->env);
    }
    qw_pen_text(&k->mtl, statement), qw_pen_text(&k->mtl, k->name), qw_pen_text(&k->mtl, end);
    qw_pen_text(&k->mtl, "\n");
}

static void put_numbers(qw_pen *pen, const char *word, const float *x, int count)
{
    qw_pen_text(pen, word);
    for (int i = 0; i < count; i++) qw_pen_text(pen, " "), qw_pen_number(pen, (double)x[i]);
    qw_pen_text(pen, "\n");
}

/* A material of the library, as is usual for physically based ones: factors where there is no map, else the maps. */
static void put_material(maker *k, uint32_t tile, uint32_t i, const char *name)
{
    const qw_asset_look *l = k->look;
    const float white[3] = {1, 1, 1};
    const qw_picture *p = l->picture + tile * (size_t)QW_MAP_COUNT;
    qw_pen_text(&k->mtl, "newmtl "), qw_pen_text(&k->mtl, name), qw_pen_text(&k->mtl, "\n");
    put_numbers(&k->mtl, "Kd", p[QW_MAP_COLOR].pixels ? white : l->color, 3);
    float bright[3];
    for (int c = 0; c < 3; c++) bright[c] = l->brightest * (p[QW_MAP_EMISSION].pixels ? 1 : l->emission[c]);
    put_numbers(&k->mtl, "Ke", bright, 3);
    if (l->alpha[i] && !p[QW_MAP_COLOR].pixels) put_numbers(&k->mtl, "d", &l->color[3], 1);
    put_numbers(&k->mtl, "Pr", &l->roughness, 1), put_numbers(&k->mtl, "Pm", &l->metallic, 1);
    put_map(k, tile, i, QW_MAP_COLOR, "map_Kd ");
    if (l->alpha[i] && p[QW_MAP_COLOR].pixels) { /* the fourth channel of the same picture */
        qw_pen_text(&k->mtl, "map_d "), qw_pen_text(&k->mtl, k->name);
        qw_pen_text(&k->mtl, joined(k->env, "_color", number_of(k->env, l, tile), ".png\n"));
    }
    put_map(k, tile, i, QW_MAP_NORMAL, "norm ");
    put_map(k, tile, i, QW_MAP_ORM, "# occlusion, roughness, metallic: ");
    put_map(k, tile, i, QW_MAP_EMISSION, "map_Ke ");
    put_map(k, tile, i, QW_MAP_OCCLUSION, "map_Ka ");
    put_map(k, tile, i, QW_MAP_HEIGHT, "# height, the middle is 0: ");
}

const char *qw_write_mtl(qw_env *env, const char *path, const qw_asset_look *look, const char ***names)
{
    size_t size = strlen(path), begin = 0;
    for (size_t i = 0; i < size; i++)
        if (path[i] == '/' || path[i] == '\\') begin = i + 1;
    size_t end = size;
    while (end > begin && path[end - 1] != '.') end--;
    char *base = QW_NEW(env, char, size + 1);
    memcpy(base, path, size + 1);
    if (end > begin + 1) base[end - 1] = 0;
    maker k = {.env = env, .look = look, .base = base, .name = base + begin, .mtl = {.env = env}};
    *names = QW_NEW(env, const char *, look->tiles * look->alphas);
    for (uint32_t m = 0; m < look->tiles * look->alphas; m++) {
        uint32_t tile = m / look->alphas, i = m % look->alphas;
        (*names)[m] = joined(env, "asset", number_of(env, look, tile), qw_alpha_suffix(look, i));
        put_material(&k, tile, i, (*names)[m]);
    }
    qw_file *file = qw_file_begin(env, joined(env, base, ".mtl", ""));
    qw_file_put(file, k.mtl.at, k.mtl.size);
    qw_file_finish(file);
    return joined(env, k.name, ".mtl", "");
}

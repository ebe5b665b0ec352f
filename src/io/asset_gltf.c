#include "io/asset_file.h"

#include <string.h>

typedef struct maker {
    qw_env *env;
    const qw_asset_look *look;
    qw_gltf_rest *rest;
    qw_pen text, bytes, views, images, textures, materials;
    uint32_t texture_count, level;  /* level: QW_NONE: there are none */
    uint32_t texture[QW_MAP_COUNT]; /* of the tile's maps */
    bool is_bright, is_unlit;       /* extensions that a material uses */
} maker;

static size_t begin_piece(maker *k) { return k->text.size; }
static void end_piece(maker *k) { qw_pen_put(&k->text, "", 1); }
static size_t piece(maker *k, const char *text)
{
    size_t at = begin_piece(k);
    qw_pen_text(&k->text, text);
    end_piece(k);
    return at;
}

/* A picture as a texture; returns its number. */
static uint32_t put_texture(maker *k, const qw_picture *p, const char *name)
{
    qw_pen_align(&k->bytes, QW_GLTF_ALIGNMENT, 0);
    size_t begin = k->bytes.size;
    qw_put_png(k->env, p, &k->bytes);
    qw_pen_print(&k->views, "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu},", begin, k->bytes.size - begin);
    qw_pen_print(&k->images, "%s{\"name\":\"%s\",\"bufferView\":%u,\"mimeType\":\"image/png\"}",
                 k->texture_count ? "," : "", name, k->rest->view_count++);
    qw_pen_print(&k->textures, "%s{\"sampler\":0,\"source\":%u}", k->texture_count ? "," : "", k->texture_count);
    return k->texture_count++;
}

static void put_numbers(qw_pen *pen, const char *name, const float *x, int count)
{
    qw_pen_print(pen, ",\"%s\":", name);
    if (count > 1) qw_pen_text(pen, "[");
    for (int i = 0; i < count; i++) {
        if (i) qw_pen_text(pen, ",");
        qw_pen_number(pen, (double)x[i]);
    }
    if (count > 1) qw_pen_text(pen, "]");
}

static void put_map(maker *k, qw_pen *to, const char *member, const qw_picture *of_tile, qw_map map)
{
    if (of_tile[map].pixels) qw_pen_print(to, ",\"%s\":{\"index\":%u}", member, k->texture[map]);
}

static void put_textures(maker *k, const qw_picture *of_tile)
{
    for (uint32_t map = 0; map < QW_MAP_COUNT; map++)
        if (of_tile[map].pixels)
            k->texture[map] = put_texture(
                k, &of_tile[map], map == QW_MAP_ORM ? "occlusion_roughness_metallic" : qw_map_name((qw_map)map));
}

/* Adds the material of one tile, number i of the file, with the pictures that were made. */
static void put_material(maker *k, uint32_t tile, uint32_t i)
{
    const qw_asset_look *l = k->look;
    const qw_picture *p = l->picture + tile * (size_t)QW_MAP_COUNT;
    const float one[4] = {1, 1, 1, l->color[3]};
    qw_pen *m = &k->materials;
    qw_pen_print(m, "%s{\"name\":\"asset", m->size ? "," : "");
    if (k->level != QW_NONE) qw_pen_print(m, " LOD%u", k->level);
    if (l->tiles > 1) qw_pen_print(m, ".%u", 1001 + tile);
    qw_pen_text(m, qw_alpha_suffix(l, i));
    qw_pen_text(m, "\",\"pbrMetallicRoughness\":{\"baseColorFactor\":[");
    const float *color = p[QW_MAP_COLOR].pixels ? one : l->color;
    for (int c = 0; c < 4; c++) {
        if (c) qw_pen_text(m, ",");
        qw_pen_number(m, p[QW_MAP_COLOR].pixels ? 1 : (double)color[c]);
    }
    qw_pen_text(m, "]");
    bool has_orm = p[QW_MAP_ORM].pixels != NULL;
    const float full = 1;
    put_numbers(m, "metallicFactor", has_orm ? &full : &l->metallic, 1);
    put_numbers(m, "roughnessFactor", has_orm ? &full : &l->roughness, 1);
    put_map(k, m, "baseColorTexture", p, QW_MAP_COLOR);
    put_map(k, m, "metallicRoughnessTexture", p, QW_MAP_ORM);
    qw_pen_text(m, "}");
    put_map(k, m, "normalTexture", p, QW_MAP_NORMAL);
    bool is_apart = p[QW_MAP_OCCLUSION].pixels || !l->has_occlusion;
    put_map(k, m, "occlusionTexture", p, is_apart ? QW_MAP_OCCLUSION : QW_MAP_ORM);
    const float white[3] = {1, 1, 1};
    put_map(k, m, "emissiveTexture", p, QW_MAP_EMISSION);
    put_numbers(m, "emissiveFactor", p[QW_MAP_EMISSION].pixels ? white : l->emission, 3);
    if (l->alpha[i] == 2) qw_pen_text(m, ",\"alphaMode\":\"BLEND\"");
    if (l->alpha[i] == 1) qw_pen_text(m, ",\"alphaMode\":\"MASK\""), put_numbers(m, "alphaCutoff", &l->cutoff, 1);
    bool is_bright = l->brightest > 1;
    if (is_bright || l->is_unlit) qw_pen_text(m, ",\"extensions\":{");
    if (is_bright)
        qw_pen_text(m, "\"KHR_materials_emissive_strength\":{\"emissiveStrength\":"),
            qw_pen_number(m, (double)l->brightest), qw_pen_text(m, l->is_unlit ? "}," : "}");
    if (l->is_unlit) qw_pen_text(m, "\"KHR_materials_unlit\":{}");
    if (is_bright || l->is_unlit) qw_pen_text(m, "}");
    k->is_bright |= is_bright, k->is_unlit |= l->is_unlit;
    if (l->double_sided) qw_pen_text(m, ",\"doubleSided\":true");
    if (p[QW_MAP_HEIGHT].pixels) qw_pen_print(m, ",\"extras\":{\"heightTexture\":%u}", k->texture[QW_MAP_HEIGHT]);
    qw_pen_text(m, "}");
}

static void put_materials(maker *k)
{
    const qw_asset_look *l = k->look;
    for (uint32_t tile = 0; tile < l->tiles; tile++) {
        put_textures(k, l->picture + tile * (size_t)QW_MAP_COUNT);
        for (uint32_t i = 0; i < l->alphas; i++) put_material(k, tile, i);
    }
    k->rest->material_count += l->tiles * l->alphas;
}

static void put_list(qw_pen *to, const char *name, const qw_pen *items)
{
    if (items->size == 0) return;
    qw_pen_print(to, "\"%s\":[", name);
    qw_pen_put(to, items->at, items->size);
    qw_pen_text(to, "],");
}

static void put_look(maker *k)
{
    k->rest->look = begin_piece(k);
    if (k->texture_count) qw_pen_text(&k->text, "\"samplers\":[{\"magFilter\":9729,\"minFilter\":9987}],");
    put_list(&k->text, "images", &k->images), put_list(&k->text, "textures", &k->textures);
    put_list(&k->text, "materials", &k->materials);
    end_piece(k);
}

static size_t put_used(maker *k)
{
    size_t at = begin_piece(k);
    if (k->is_bright) qw_pen_text(&k->text, "\"KHR_materials_emissive_strength\",");
    if (k->is_unlit) qw_pen_text(&k->text, "\"KHR_materials_unlit\",");
    end_piece(k);
    return at;
}

qw_gltf_rest *qw_gltf_of_looks(qw_env *env, const qw_asset_look *const *look, uint32_t count, bool are_levels)
{
    const qw_pen none = {.env = env};
    qw_gltf_rest *r = QW_NEW_ZERO(env, qw_gltf_rest, 1);
    maker k = {.env = env, .rest = r, .text = none, .bytes = none, .views = none};
    k.images = k.textures = k.materials = none;
    for (uint32_t i = 0; i < count; i++) {
        k.look = look[i], k.level = are_levels ? i : QW_NONE;
        put_materials(&k);
    }
    put_look(&k);
    r->views = begin_piece(&k);
    qw_pen_put(&k.text, k.views.at, k.views.size);
    end_piece(&k);
    r->used = put_used(&k), r->required = piece(&k, "");
    r->text = k.text.at, r->bytes = k.bytes.at, r->byte_count = k.bytes.size;
    return r;
}

#include "io/material.h"

#include "io/gltf/gltf_document.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_NOTES = 16 }; /* a report has room for as many */

static const qw_texture no_texture = {.image = QW_NONE, .scale = {1, 1}};

qw_material qw_plain_material(void)
{
    return (qw_material){.name = "",
                         .color = {1, 1, 1, 1},
                         .metallic = 0,
                         .roughness = 1,
                         .normal_scale = 1,
                         .occlusion_strength = 1,
                         .cutoff = 0.5f,
                         .color_map = no_texture,
                         .alpha_map = {.image = QW_NONE, .scale = {1, 1}, .channel = QW_NONE},
                         .metallic_map = no_texture,
                         .roughness_map = no_texture,
                         .occlusion_map = no_texture,
                         .emission_map = no_texture,
                         .normal_map = no_texture};
}

void qw_note_material(qw_env *env, qw_material_list *list, const char *format, ...)
{
    char text[QW_MATERIAL_NOTE];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    for (uint32_t i = 0; i < list->note_count; i++)
        if (strcmp(list->note[i], text) == 0) return;
    if (list->note_count == MOST_NOTES) return;
    size_t size = strlen(text) + 1;
    list->note = qw_grow(env, list->note, &list->note_room, list->note_count + (size_t)1, sizeof *list->note);
    list->note[list->note_count++] = memcpy(QW_NEW(env, char, size), text, size);
}

const qw_factor_range qw_factor_share = {0, 1}, qw_factor_upward = {0, QW_MOST_FACTOR},
                      qw_factor_any = {-QW_MOST_FACTOR, QW_MOST_FACTOR};

float qw_checked_factor(qw_env *env, qw_material_list *list, const char *material, const char *name, double value,
                        qw_factor_range range, float kept)
{
    float used = isnan(value)                  ? kept
                 : value < (double)range.least ? range.least
                 : value > (double)range.most  ? range.most
                                               : (float)value;
    if (isnan(value) || value < (double)range.least || value > (double)range.most)
        qw_note_material(env, list, "material \"%.40s\": %s is %g, which must be %g to %g; %g is taken", material, name,
                         value, (double)range.least, (double)range.most, (double)used);
    return used;
}

/* ---- glTF */

typedef struct reader {
    qw_env *env;
    const char *name; /* of the material that is read */
    qw_json_doc json;
    const qw_gltf_rest *rest;
    qw_material_list list;
    struct items {
        uint32_t *token, count; /* of each item */
    } textures, samplers, images, views;
} reader;

/* The items of an array of the document; none where it has no such array. */
static struct items list_items(const reader *r, const char *name)
{
    uint32_t array = qw_json_member(&r->json, 0, name);
    if (!qw_json_has_kind(&r->json, array, QW_JSON_ARRAY)) return (struct items){NULL, 0};
    struct items list = {.count = r->json.token[array].count};
    list.token = QW_NEW(r->env, uint32_t, list.count);
    for (uint32_t i = 0, t = array + 1; i < list.count; i++, t = r->json.token[t].next) list.token[i] = t;
    return list;
}

/* Item i, or QW_NONE. */
static uint32_t item(const struct items *list, double i)
{
    return i >= 0 && i < list->count ? list->token[(uint32_t)i] : QW_NONE;
}

static double number(const reader *r, uint32_t object, const char *name, double missing)
{
    double value;
    return qw_json_number(&r->json, qw_json_member(&r->json, object, name), &value) ? value : missing;
}

/* Factors of a material; those that are missing stay as they are. */
static void factors(reader *r, uint32_t object, const char *name, qw_factor_range range, float *to, uint32_t count)
{
    uint32_t array = qw_json_member(&r->json, object, name);
    if (!qw_json_has_kind(&r->json, array, QW_JSON_ARRAY)) return;
    for (uint32_t i = 0, t = array + 1; i < count && i < r->json.token[array].count; i++, t = r->json.token[t].next) {
        double value;
        if (qw_json_number(&r->json, t, &value))
            to[i] = qw_checked_factor(r->env, &r->list, r->name, name, value, range, to[i]);
    }
}

static void factor(reader *r, uint32_t object, const char *name, qw_factor_range range, float *to)
{
    double value;
    if (qw_json_number(&r->json, qw_json_member(&r->json, object, name), &value))
        *to = qw_checked_factor(r->env, &r->list, r->name, name, value, range, *to);
}

/* A small whole number; what is none is a large one, which nothing has. */
static uint32_t small_whole(double x) { return x >= 0 && x < 1e6 ? (uint32_t)x : QW_NONE; }

static void read_transform(reader *r, uint32_t info, qw_texture *t)
{
    uint32_t e = qw_json_member(&r->json, qw_json_member(&r->json, info, "extensions"), "KHR_texture_transform");
    if (e == QW_NONE) return;
    factors(r, e, "offset", qw_factor_any, t->offset, 2), factors(r, e, "scale", qw_factor_any, t->scale, 2);
    factor(r, e, "rotation", qw_factor_any, &t->rotation);
    t->set = small_whole(number(r, e, "texCoord", t->set));
}

static int wrap_of(double mode) { return mode == 33071 ? 1 : mode == 33648 ? 2 : 0; }

/* The image of a texture: its WebP where it has one that can be read. */
static double source_of(const reader *r, uint32_t texture)
{
    const qw_json_doc *j = &r->json;
    uint32_t more = qw_json_member(j, texture, "extensions"), webp = qw_json_member(j, more, "EXT_texture_webp");
    double image = number(r, texture, "source", -1);
    if (image < 0) image = number(r, qw_json_member(j, more, "KHR_texture_basisu"), "source", -1);
    if (image < 0) image = number(r, qw_json_member(j, more, "MSFT_texture_dds"), "source", -1);
    return webp == QW_NONE || (!qw_reads_webp() && image >= 0) ? image : number(r, webp, "source", image);
}

/* The texture of that name in a JSON object: image, set of coordinates, wrapping and transform; none where it is
   not there. */
static qw_texture read_texture(reader *r, uint32_t object, const char *name, uint32_t channel)
{
    qw_texture t = no_texture;
    uint32_t info = qw_json_member(&r->json, object, name);
    if (info == QW_NONE) return t;
    uint32_t texture = item(&r->textures, number(r, info, "index", -1));
    uint32_t sampler = item(&r->samplers, number(r, texture, "sampler", -1));
    double image = source_of(r, texture);
    if (!(image >= 0 && image < r->list.image_count)) return t;
    t.image = (uint32_t)image, t.channel = channel, t.set = small_whole(number(r, info, "texCoord", 0));
    t.wrap[0] = wrap_of(number(r, sampler, "wrapS", 0)), t.wrap[1] = wrap_of(number(r, sampler, "wrapT", 0));
    read_transform(r, info, &t);
    return t;
}

/* The older model of colours of diffuse and of mirrored light. Of a metal of share 1 - x and base colour b they are
   0.96 b x, d, and 0.04 x + b (1 - x), s: in grey 0.04 x^2 - (s + d / 0.96) x + d / 0.96 = 0. */
static void read_specular_glossiness(reader *r, uint32_t e, qw_material *a)
{
    float specular[3] = {1, 1, 1}, gloss = 1, d = 0, s = 0;
    factors(r, e, "diffuseFactor", qw_factor_share, a->color, 4);
    factors(r, e, "specularFactor", qw_factor_share, specular, 3);
    factor(r, e, "glossinessFactor", qw_factor_share, &gloss);
    a->color_map = read_texture(r, e, "diffuseTexture", 0);
    a->roughness = 1 - gloss, a->metallic = 0;
    a->roughness_map = a->metallic_map = no_texture;
    for (int k = 0; k < 3; k++) d += a->color[k] / (3 * 0.96f), s += specular[k] / 3;
    float half = (s + d) / 0.08f, x = half - sqrtf(fmaxf(half * half - d / 0.04f, 0));
    if (s > 0.04f && x < 1 && a->color_map.image == QW_NONE) {
        a->metallic = 1 - x;
        for (int k = 0; k < 3; k++) a->color[k] = fminf(1, a->color[k] / 0.96f + fmaxf(0, specular[k] - 0.04f * x));
    }
    if (qw_json_member(&r->json, e, "specularGlossinessTexture") != QW_NONE)
        qw_note_material(r->env, &r->list, "material \"%.40s\": its picture of mirrored colours and gloss is left out",
                         r->name);
}

/* What the extensions of material m say, into *a; those that maps have no place for are told of. */
static void read_extensions(reader *r, uint32_t m, qw_material *a)
{
    const qw_json_doc *j = &r->json;
    uint32_t all = qw_json_member(j, m, "extensions"), key = all + 1;
    if (!qw_json_has_kind(j, all, QW_JSON_OBJECT)) return;
    for (uint32_t i = 0; i < j->token[all].count; i++, key = j->token[key + 1].next) {
        float strength = 1;
        if (qw_json_reads(j, key, "KHR_materials_pbrSpecularGlossiness")) {
            read_specular_glossiness(r, key + 1, a);
        } else if (qw_json_reads(j, key, "KHR_materials_unlit")) {
            a->is_unlit = true;
        } else if (qw_json_reads(j, key, "KHR_materials_emissive_strength")) {
            factor(r, key + 1, "emissiveStrength", qw_factor_upward, &strength);
            for (int k = 0; k < 3; k++) a->emission[k] = fminf(a->emission[k] * strength, QW_MOST_FACTOR);
        } else {
            qw_note_material(r->env, &r->list, "material \"%.40s\": %.60s is left out, as maps have no place for it",
                             r->name, qw_json_string(j, key));
        }
    }
}

/* Reads material m of a glTF document: factors, maps, and what of it has no place. */
static qw_material read_material(reader *r, uint32_t m)
{
    const qw_json_doc *j = &r->json;
    qw_material a = qw_plain_material();
    uint32_t pbr = qw_json_member(j, m, "pbrMetallicRoughness"), mode = qw_json_member(j, m, "alphaMode");
    char *name = qw_json_string(j, qw_json_member(j, m, "name"));
    if (name) a.name = name;
    r->name = a.name, a.metallic = 1;
    factors(r, pbr, "baseColorFactor", qw_factor_share, a.color, 4),
        factors(r, m, "emissiveFactor", qw_factor_upward, a.emission, 3);
    factor(r, pbr, "metallicFactor", qw_factor_share, &a.metallic),
        factor(r, pbr, "roughnessFactor", qw_factor_share, &a.roughness);
    a.color_map = read_texture(r, pbr, "baseColorTexture", 0);
    a.roughness_map = read_texture(r, pbr, "metallicRoughnessTexture", 1);
    a.metallic_map = read_texture(r, pbr, "metallicRoughnessTexture", 2);
    a.emission_map = read_texture(r, m, "emissiveTexture", 0);
    a.occlusion_map = read_texture(r, m, "occlusionTexture", 0);
    a.normal_map = read_texture(r, m, "normalTexture", 0);
    factor(r, qw_json_member(j, m, "occlusionTexture"), "strength", qw_factor_share, &a.occlusion_strength);
    factor(r, qw_json_member(j, m, "normalTexture"), "scale", qw_factor_any, &a.normal_scale);
    a.alpha = mode == QW_NONE ? 0 : qw_json_reads(j, mode, "MASK") ? 1 : qw_json_reads(j, mode, "BLEND") ? 2 : 0;
    factor(r, m, "alphaCutoff", qw_factor_upward, &a.cutoff);
    read_extensions(r, m, &a);
    a.double_sided = qw_json_has_kind(j, qw_json_member(j, m, "doubleSided"), QW_JSON_TRUE);
    return a;
}

/* The bytes of image i, from a view or a URI, and a name for messages; without bytes it is told of. */
static void read_image(reader *r, uint32_t i)
{
    uint32_t image = item(&r->images, i), view = item(&r->views, number(r, image, "bufferView", -1));
    char media[64], *uri = qw_json_bytes(&r->json, qw_json_member(&r->json, image, "uri"));
    const char *why = uri ? "its file could not be read" : "it is not there";
    qw_gltf_document d = {.env = r->env, .name = "the input"};
    if (view != QW_NONE) {
        double at = number(r, view, "byteOffset", 0), size = number(r, view, "byteLength", 0);
        if (at >= 0 && size >= 0 && at + size <= (double)r->rest->byte_count)
            r->list.image[i] = (qw_bytes){r->rest->bytes + (size_t)at, (size_t)size};
    } else if (uri && strncmp(uri, "data:", 5) == 0) {
        r->list.image[i] = qw_gltf_fetch_uri(&d, uri, UINT32_MAX, false, media, &why);
    }
    const char *own = qw_json_string(&r->json, qw_json_member(&r->json, image, "name"));
    if (!own && uri && strncmp(uri, "data:", 5) != 0) own = uri;
    char name[96];
    int size = snprintf(name, sizeof name, own ? "image %u (%.60s)" : "image %u", i, own ? own : "");
    char *kept = QW_NEW(r->env, char, (size_t)size + 1);
    memcpy(kept, name, (size_t)size + 1);
    r->list.image_name[i] = kept;
    if (!r->list.image[i].at) qw_note_material(r->env, &r->list, "%s is left out of the maps: %.80s", name, why);
}

enum { MAPS = 7 };
static void list_maps(qw_material *m, qw_texture *map[MAPS])
{
    qw_texture *const all[MAPS] = {&m->color_map,     &m->alpha_map,    &m->metallic_map, &m->roughness_map,
                                   &m->occlusion_map, &m->emission_map, &m->normal_map};
    memcpy(map, all, sizeof all);
}

void qw_renumber_images(qw_material *m, uint32_t before)
{
    qw_texture *map[MAPS];
    list_maps(m, map);
    for (int i = 0; i < MAPS; i++)
        if (map[i]->image != QW_NONE) map[i]->image += before;
}

/* Marks the images of a material. */
static void mark_images(qw_material *m, uint8_t *is_wanted)
{
    qw_texture *map[MAPS];
    list_maps(m, map);
    for (int i = 0; i < MAPS; i++)
        if (map[i]->image != QW_NONE) is_wanted[map[i]->image] = 1;
}

qw_material_list qw_gltf_materials(qw_env *env, const qw_gltf_rest *rest, const uint8_t *used)
{
    qw_pen text = {.env = env};
    reader r = {.env = env, .rest = rest};
    qw_pen_text(&text, "{");
    qw_pen_text(&text, rest->text + rest->head);
    qw_pen_text(&text, "\"bufferViews\":[");
    qw_pen_text(&text, rest->text + rest->views);
    if (text.at[text.size - 1] == ',') text.size--;
    qw_pen_text(&text, "]}");
    size_t size = text.size;
    memset(qw_pen_room(&text, QW_ZEROS), 0, QW_ZEROS);
    r.json = qw_json_parse(env, "the materials of the input", text.at, size);
    r.textures = list_items(&r, "textures"), r.samplers = list_items(&r, "samplers");
    r.images = list_items(&r, "images"), r.views = list_items(&r, "bufferViews");
    const struct items materials = list_items(&r, "materials");
    r.list.used = used, r.list.count = materials.count, r.list.image_count = r.images.count;
    r.list.image = QW_NEW_ZERO(env, qw_bytes, r.list.image_count);
    r.list.image_name = QW_NEW_ZERO(env, const char *, r.list.image_count);
    r.list.material = QW_NEW(env, qw_material, r.list.count);
    uint8_t *is_wanted = QW_NEW_ZERO(env, uint8_t, r.list.image_count);
    for (uint32_t i = 0; i < r.list.count; i++) {
        uint32_t notes = r.list.note_count;
        r.list.material[i] = read_material(&r, materials.token[i]);
        if (used && !used[i]) r.list.note_count = notes; /* what is not seen is not spoken of */
        if (!used || used[i]) mark_images(&r.list.material[i], is_wanted);
    }
    for (uint32_t i = 0; i < r.list.image_count; i++)
        if (is_wanted[i]) read_image(&r, i);
    if (list_items(&r, "animations").count > 0)
        qw_note_material(env, &r.list, "the animations of the input are not in the asset");
    uint32_t all = qw_json_member(&r.json, 0, "extensions"), key = all + 1;
    for (uint32_t i = 0; qw_json_has_kind(&r.json, all, QW_JSON_OBJECT) && i < r.json.token[all].count; i++) {
        qw_note_material(env, &r.list, "%.60s of the input is not in the asset", qw_json_string(&r.json, key));
        key = r.json.token[key + 1].next;
    }
    return r.list;
}

/* What a glTF file holds beside its surface, cut out of it and numbered anew. */
#include "io/gltf/gltf_document.h"
#include "io/pen.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* Bytes of a GLB, which images become part of. */
static const uint64_t MOST_IMAGE = UINT32_MAX;

typedef struct pass {
    qw_gltf_document *d;
    qw_gltf_rest *rest;
    uint32_t *patch;    /* uint32_t[tokens]: the number that stands in the place of one, or QW_NONE */
    uint32_t *accessor; /* uint32_t[accessors]: its new number, or QW_NONE; the same for views */
    uint32_t *view;
    uint32_t *kept_accessors, *kept_views; /* old numbers, in the new order; beyond those of the file: fetched */
    qw_bytes *fetched;                     /* qw_bytes[images]: of files; at NULL: stays as it is */
    uint32_t *fetched_view;                /* uint32_t[images] */
    qw_pen text, bytes;
} pass;

/* ---- pieces of text */

static void put(pass *p, const char *at, size_t size) { qw_pen_utf8(&p->text, at, size); }
static void put_text(pass *p, const char *text) { qw_pen_text(&p->text, text); }
static void put_whole(pass *p, uint64_t value) { qw_pen_whole(&p->text, value); }
static size_t begin_piece(const pass *p) { return p->text.size; }
static void end_piece(pass *p) { put(p, "", 1); }

/* A value as it is in the file, but for numbers that are patched, and those such as 1e999, which readers have no double
   for: the largest of single precision stand in their place. */
static void put_value(pass *p, uint32_t token)
{
    const qw_json_doc *j = &p->d->json;
    uint32_t at = qw_json_begin_of(j, token);
    for (uint32_t t = token; t < j->token[token].next; t++) {
        double value;
        bool is_beyond = qw_json_number(j, t, &value) && isinf(value);
        if (p->patch[t] == QW_NONE && !is_beyond) continue;
        put(p, j->text + at, j->token[t].begin - at);
        if (is_beyond) qw_pen_number(&p->text, (double)copysignf(FLT_MAX, (float)value));
        else put_whole(p, p->patch[t]);
        at = j->token[t].end;
    }
    put(p, j->text + at, qw_json_end_of(j, token) - at);
}

/* "name":value */
static void put_member(pass *p, uint32_t key)
{
    const qw_json_doc *j = &p->d->json;
    put(p, j->text + qw_json_begin_of(j, key), qw_json_end_of(j, key) - qw_json_begin_of(j, key));
    put_text(p, ":");
    put_value(p, key + 1);
}

static bool is_one_of(const qw_json_doc *j, uint32_t key, const char *const *names)
{
    for (; *names; names++)
        if (qw_json_reads(j, key, *names)) return true;
    return false;
}

/* The members of an object but those named, each followed by a comma, or all but the first after one. */
static void put_members(pass *p, uint32_t object, const char *const *without, bool is_followed)
{
    const qw_json_doc *j = &p->d->json;
    uint32_t key = object + 1;
    bool first = true;
    for (uint32_t i = 0; i < j->token[object].count; i++, key = j->token[key + 1].next) {
        if (is_one_of(j, key, without)) continue;
        if (!is_followed && !first) put_text(p, ",");
        put_member(p, key);
        if (is_followed) put_text(p, ",");
        first = false;
    }
}

/* ---- accessors and views that are still needed */

static uint32_t keep_accessor(pass *p, uint32_t a)
{
    if (p->accessor[a] == QW_NONE) {
        p->kept_accessors[p->rest->accessor_count] = a;
        p->accessor[a] = p->rest->accessor_count++;
    }
    return p->accessor[a];
}

static uint32_t keep_view(pass *p, uint32_t v)
{
    if (p->view[v] == QW_NONE) {
        p->kept_views[p->rest->view_count] = v;
        p->view[v] = p->rest->view_count++;
    }
    return p->view[v];
}

static void need_accessor(pass *p, uint32_t object, const char *member, qw_gltf_list list, uint32_t i)
{
    uint32_t a = qw_gltf_index(p->d, object, member, QW_GLTF_ACCESSORS, list, i);
    if (a != QW_NONE) p->patch[qw_json_member(&p->d->json, object, member)] = keep_accessor(p, a);
}

static void need_view(pass *p, uint32_t object, qw_gltf_list list, uint32_t i)
{
    uint32_t v = qw_gltf_index(p->d, object, "bufferView", QW_GLTF_VIEWS, list, i);
    if (v != QW_NONE) p->patch[qw_json_member(&p->d->json, object, "bufferView")] = keep_view(p, v);
}

/* Lists the accessors that skins and animations need, and the views that these lie in. */
static void find_needed_accessors(pass *p)
{
    qw_gltf_document *d = p->d;
    const qw_json_doc *j = &d->json;
    for (uint32_t i = 0; i < d->length[QW_GLTF_SKINS]; i++)
        need_accessor(p, d->list[QW_GLTF_SKINS][i], "inverseBindMatrices", QW_GLTF_SKINS, i);
    for (uint32_t i = 0; i < d->length[QW_GLTF_ANIMATIONS]; i++) {
        uint32_t samplers = qw_gltf_array(d, d->list[QW_GLTF_ANIMATIONS][i], "samplers", QW_GLTF_ANIMATIONS, i);
        if (samplers == QW_NONE) continue;
        for (uint32_t k = 0, t = samplers + 1; k < j->token[samplers].count; k++, t = j->token[t].next) {
            need_accessor(p, t, "input", QW_GLTF_ANIMATIONS, i);
            need_accessor(p, t, "output", QW_GLTF_ANIMATIONS, i);
        }
    }
    for (uint32_t k = 0; k < p->rest->accessor_count; k++) {
        uint32_t i = p->kept_accessors[k], t = d->list[QW_GLTF_ACCESSORS][i], sparse = qw_json_member(j, t, "sparse");
        need_view(p, t, QW_GLTF_ACCESSORS, i);
        need_view(p, qw_json_member(j, sparse, "indices"), QW_GLTF_ACCESSORS, i);
        need_view(p, qw_json_member(j, sparse, "values"), QW_GLTF_ACCESSORS, i);
    }
}

/* What kind of image the bytes are, where the file does not say so. */
static const char *media_of(qw_bytes b)
{
    if (b.size > 8 && memcmp(b.at, "\x89PNG", 4) == 0) return "image/png";
    if (b.size > 3 && memcmp(b.at, "\xff\xd8\xff", 3) == 0) return "image/jpeg";
    if (b.size > 11 && memcmp(b.at, "RIFF", 4) == 0 && memcmp(b.at + 8, "WEBP", 4) == 0) return "image/webp";
    if (b.size > 12 && memcmp(b.at, "\xabKTX", 4) == 0) return "image/ktx2";
    return "application/octet-stream";
}

/* Images in files of their own go into the buffer, as the result need not lie beside them. */
static void find_images(pass *p)
{
    qw_gltf_document *d = p->d;
    uint32_t count = d->length[QW_GLTF_IMAGES];
    p->fetched = QW_NEW_ZERO(d->env, qw_bytes, count);
    p->fetched_view = QW_NEW_ZERO(d->env, uint32_t, count);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t t = d->list[QW_GLTF_IMAGES][i];
        need_view(p, t, QW_GLTF_IMAGES, i);
    }
    for (uint32_t i = 0; i < count; i++) {
        char media[64], *uri = qw_json_bytes(&d->json, qw_json_member(&d->json, d->list[QW_GLTF_IMAGES][i], "uri"));
        const char *why = "";
        if (!uri || strncmp(uri, "data:", 5) == 0) continue;
        p->fetched[i] = qw_gltf_fetch_uri(d, uri, MOST_IMAGE, false, media, &why);
        if (p->fetched[i].at) p->fetched_view[i] = p->rest->view_count++;
        else
            qw_log(d->env, QW_LOG_WARNING, "%s: image %u stays where it is, in \"%.60s\": %.150s", d->name, i, uri,
                   why);
    }
}

/* The images as they were; those that came from files of their own now lie in views. */
static void put_images(pass *p)
{
    static const char *const place[] = {"uri", "bufferView", "mimeType", NULL};
    const qw_gltf_document *d = p->d;
    put_text(p, "\"images\":[");
    for (uint32_t i = 0; i < d->length[QW_GLTF_IMAGES]; i++) {
        uint32_t t = d->list[QW_GLTF_IMAGES][i];
        if (i) put_text(p, ",");
        if (!p->fetched[i].at) {
            put_value(p, t);
            continue;
        }
        put_text(p, "{");
        put_members(p, t, place, true);
        put_text(p, "\"bufferView\":");
        put_whole(p, p->fetched_view[i]);
        put_text(p, ",\"mimeType\":\"");
        put_text(p, media_of(p->fetched[i]));
        put_text(p, "\"}");
    }
    put_text(p, "],");
}

/* ---- the buffer */

static void put_view(pass *p, qw_bytes bytes, uint32_t stride)
{
    qw_pen_align(&p->bytes, QW_GLTF_ALIGNMENT, 0);
    put_text(p, "{\"buffer\":0,\"byteOffset\":");
    put_whole(p, p->bytes.size);
    put_text(p, ",\"byteLength\":");
    put_whole(p, bytes.size);
    if (stride) put_text(p, ",\"byteStride\":"), put_whole(p, stride);
    put_text(p, "},");
    qw_pen_put(&p->bytes, bytes.at, bytes.size);
}

/* The views and accessors that are kept, as text in their new order. */
static void put_views(pass *p)
{
    const qw_gltf_document *d = p->d;
    uint32_t fetched = 0;
    for (uint32_t i = 0; i < d->length[QW_GLTF_IMAGES]; i++) fetched += p->fetched[i].at != NULL;
    p->rest->views = begin_piece(p);
    for (uint32_t k = 0; k + fetched < p->rest->view_count; k++) {
        const qw_gltf_view *v = &d->view[p->kept_views[k]];
        put_view(p, (qw_bytes){v->at, v->size}, v->stride);
    }
    for (uint32_t i = 0; i < d->length[QW_GLTF_IMAGES]; i++)
        if (p->fetched[i].at) put_view(p, p->fetched[i], 0);
    end_piece(p);
    p->rest->accessors = begin_piece(p);
    for (uint32_t k = 0; k < p->rest->accessor_count; k++) {
        put_value(p, d->list[QW_GLTF_ACCESSORS][p->kept_accessors[k]]);
        put_text(p, ",");
    }
    end_piece(p);
}

/* ---- the document */

/* Where there is no scene, that of all nodes that are nobody's children. */
static void put_scene(pass *p)
{
    const qw_gltf_document *d = p->d;
    const qw_json_doc *j = &d->json;
    uint32_t nodes = d->length[QW_GLTF_NODES];
    bool *is_child = QW_NEW_ZERO(d->env, bool, nodes), first = true;
    for (uint32_t i = 0; i < nodes; i++) {
        uint32_t children = qw_gltf_array(d, d->list[QW_GLTF_NODES][i], "children", QW_GLTF_NODES, i);
        for (uint32_t k = 0, t = children + 1; children != QW_NONE && k < j->token[children].count;
             k++, t = j->token[t].next)
            is_child[qw_gltf_item_index(d, t, QW_GLTF_NODES, QW_GLTF_NODES, i)] = true;
    }
    put_text(p, "\"scene\":0,\"scenes\":[{\"nodes\":[");
    for (uint32_t i = 0; i < nodes; i++) {
        if (is_child[i]) continue;
        if (!first) put_text(p, ",");
        put_whole(p, i);
        first = false;
    }
    put_text(p, "]}],");
    qw_free(d->env, is_child);
}

/* All members of the document that no mesh belongs to, with a scene and the images. */
static void put_head(pass *p)
{
    static const char *const own[] = {"asset", "accessors",      "bufferViews",        "buffers", "meshes", "images",
                                      "nodes", "extensionsUsed", "extensionsRequired", NULL},
                             *const of_asset[] = {"version", "generator", "minVersion", NULL};
    qw_gltf_document *d = p->d;
    p->rest->head = begin_piece(p);
    put_text(p, "\"asset\":{");
    put_members(p, qw_json_member(&d->json, 0, "asset"), of_asset, true);
    put_text(p, QW_GLTF_ASSET "},");
    put_members(p, 0, own, true);
    if (d->length[QW_GLTF_SCENES] == 0) put_scene(p);
    if (d->length[QW_GLTF_IMAGES]) put_images(p);
    end_piece(p);
}

static void put_look(pass *p)
{
    static const char *const of_look[] = {"materials", "textures", "samplers", NULL};
    const qw_json_doc *j = &p->d->json;
    p->rest->look = begin_piece(p);
    for (uint32_t i = 0, key = 1; i < j->token[0].count; i++, key = j->token[key + 1].next)
        if (is_one_of(j, key, of_look)) put_member(p, key), put_text(p, ",");
    if (p->d->length[QW_GLTF_IMAGES]) put_images(p);
    end_piece(p);
}

/* Members of a node that say something of the mesh that it shows are left to that, or no longer true. */
static void put_nodes(pass *p)
{
    static const char *const of_mesh[] = {"mesh", "skin", "weights", NULL}, *const of_instances[] = {
                                                                                "mesh", "skin", "weights", "extensions",
                                                                                NULL};
    const qw_gltf_document *d = p->d;
    const qw_json_doc *j = &d->json;
    qw_gltf_object *o = p->rest->object, *end = o + p->rest->object_count;
    size_t piece = begin_piece(p);
    for (uint32_t i = 0; i < d->length[QW_GLTF_NODES]; i++) {
        uint32_t t = d->list[QW_GLTF_NODES][i], skin = qw_json_member(j, t, "skin"),
                 weights = qw_json_member(j, t, "weights"), extensions = qw_json_member(j, t, "extensions");
        bool is_instanced = qw_json_member(j, extensions, "EXT_mesh_gpu_instancing") != QW_NONE;
        put_text(p, i ? ",{" : "{");
        if (o < end && o->node == i) {
            end_piece(p);
            o->nodes = piece, o->members = begin_piece(p);
            if (skin != QW_NONE) put_text(p, ",\"skin\":"), put_value(p, skin);
            if (weights != QW_NONE) put_text(p, ",\"weights\":"), put_value(p, weights);
            end_piece(p);
            piece = begin_piece(p);
            o++;
        }
        put_members(p, t, is_instanced ? of_instances : of_mesh, false);
        put_text(p, "}");
    }
    end_piece(p);
    p->rest->nodes_end = piece;
}

/* What a mesh says besides its primitives, for each object that has that mesh. */
static void put_mesh_heads(pass *p)
{
    static const char *const own[] = {"primitives", NULL};
    uint32_t meshes = p->d->length[QW_GLTF_MESHES];
    size_t *head = QW_NEW(p->d->env, size_t, meshes);
    for (uint32_t i = 0; i < meshes; i++) {
        head[i] = begin_piece(p);
        put_members(p, p->d->list[QW_GLTF_MESHES][i], own, true);
        end_piece(p);
    }
    for (uint32_t i = 0; i < p->rest->object_count; i++) p->rest->object[i].head = head[p->rest->object[i].mesh];
    qw_free(p->d->env, head);
}

/* Without those of the surface, which is another one now. */
static void put_extensions(pass *p, const char *member, bool is_followed)
{
    static const char *const of_surface[] = {"KHR_draco_mesh_compression",
                                             "EXT_meshopt_compression",
                                             "KHR_meshopt_compression",
                                             "KHR_mesh_quantization",
                                             "FB_ngon_encoding",
                                             "EXT_mesh_gpu_instancing",
                                             NULL};
    const qw_json_doc *j = &p->d->json;
    uint32_t array = qw_json_member(j, 0, member);
    bool first = true;
    for (uint32_t k = 0, t = array + 1; qw_json_has_kind(j, array, QW_JSON_ARRAY) && k < j->token[array].count;
         k++, t = j->token[t].next) {
        if (!qw_json_has_kind(j, t, QW_JSON_STRING) || is_one_of(j, t, of_surface)) continue;
        if (!first && !is_followed) put_text(p, ",");
        put_value(p, t);
        if (is_followed) put_text(p, ",");
        first = false;
    }
    end_piece(p);
}

static uint32_t *nones(qw_env *env, size_t count)
{
    uint32_t *all = QW_NEW(env, uint32_t, count);
    memset(all, 0xff, count * sizeof *all);
    return all;
}

qw_gltf_rest *qw_gltf_pass_on(qw_gltf_document *d, qw_gltf_object *objects, uint32_t count, const char *const *names,
                              uint32_t targets)
{
    qw_env *env = d->env;
    qw_gltf_rest *r = QW_NEW_ZERO(env, qw_gltf_rest, 1);
    pass p = {.d = d,
              .rest = r,
              .text = {.env = env},
              .bytes = {.env = env},
              .patch = nones(env, d->json.count),
              .accessor = nones(env, d->length[QW_GLTF_ACCESSORS]),
              .view = nones(env, d->length[QW_GLTF_VIEWS]),
              .kept_accessors = nones(env, d->length[QW_GLTF_ACCESSORS]),
              .kept_views = nones(env, d->length[QW_GLTF_VIEWS])};
    r->object = objects, r->object_count = count;
    r->material_count = d->length[QW_GLTF_MATERIALS];
    r->target = QW_NEW(env, size_t, targets);
    find_needed_accessors(&p);
    find_images(&p);
    put_head(&p);
    put_look(&p);
    put_views(&p);
    put_nodes(&p);
    put_mesh_heads(&p);
    r->used = begin_piece(&p);
    put_extensions(&p, "extensionsUsed", true);
    r->required = begin_piece(&p);
    put_extensions(&p, "extensionsRequired", false);
    for (uint32_t i = 0; i < targets; i++) {
        r->target[i] = begin_piece(&p);
        put(&p, names[i], strlen(names[i]) + 1);
    }
    r->text = p.text.at, r->bytes = p.bytes.at, r->byte_count = p.bytes.size;
    qw_free(env, p.patch), qw_free(env, p.accessor), qw_free(env, p.view);
    qw_free(env, p.kept_accessors), qw_free(env, p.kept_views);
    qw_free(env, p.fetched), qw_free(env, p.fetched_view);
    return r;
}

void qw_gltf_each_block(qw_env *env, qw_gltf_rest *rest, void (*each)(qw_env *env, void *block))
{
    if (!rest) return;
    void *blocks[] = {rest->text, rest->bytes, rest->object, rest->target, rest};
    for (size_t i = 0; i < sizeof blocks / sizeof *blocks; i++) each(env, blocks[i]);
}

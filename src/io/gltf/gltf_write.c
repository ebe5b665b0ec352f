/* Documents of GLB and glTF around their meshes (gltf_mesh_write.c): nodes, materials, levels of detail, the buffer. */
#include "base/printable.h"
#include "base/mesh_view.h"
#include "io/gltf/gltf_writer.h"

#include <string.h>

/* ---- the document */

/* The nodes of the file that was read, each object's with its new mesh. mesh: uint32_t[objects]: QW_NONE: nothing is
 * left of it. */
static void put_nodes(const qw_gltf_writer *w, qw_pen *out, const uint32_t *mesh)
{
    const qw_gltf_rest *r = w->rest;
    qw_pen_text(out, "\"nodes\":[");
    for (uint32_t i = 0; i < r->object_count; i++) {
        const qw_gltf_object *o = &r->object[i];
        qw_pen_text(out, r->text + o->nodes);
        const char *next = r->text + (i + 1 < r->object_count ? o[1].nodes : r->nodes_end);
        if (mesh[i] == QW_NONE) continue;
        qw_pen_print(out, "\"mesh\":%u", mesh[i]);
        qw_pen_text(out, r->text + o->members);
        if (next[0] != '}') qw_pen_text(out, ",");
    }
    qw_pen_text(out, r->text + r->nodes_end);
    qw_pen_text(out, "],");
}

static void put_translation(const qw_gltf_writer *w, qw_pen *out)
{
    if (w->centre[0] == 0 && w->centre[1] == 0 && w->centre[2] == 0) return;
    for (int k = 0; k < 3; k++) {
        qw_pen_text(out, k ? "," : ",\"translation\":[");
        qw_pen_number(out, (double)w->centre[k]);
    }
    qw_pen_text(out, "]");
}

static void put_materials(const qw_gltf_writer *w, qw_pen *out)
{
    if (!w->material || !w->material->label_names || w->material->label_count == 0) return;
    qw_pen_text(out, "\"materials\":[");
    for (uint32_t i = 0; i < w->material->label_count; i++) {
        qw_pen_text(out, i ? ",{\"name\":" : "{\"name\":");
        qw_pen_string(out, w->material->label_names[i]);
        qw_pen_text(out, "}");
    }
    qw_pen_text(out, "],");
}

/* What labels of materials refer to. */
static void put_look(const qw_gltf_writer *w, qw_pen *out)
{
    if (w->pictures) qw_pen_text(out, w->pictures->text + w->pictures->look);
    else put_materials(w, out);
}

/* A node for each mesh, by the names of the objects; materials by their names. */
static void put_own_head(const qw_gltf_writer *w, qw_pen *out, const uint32_t *first_face)
{
    qw_pen_text(out, "\"asset\":{" QW_GLTF_ASSET "},\"scene\":0,\"scenes\":[{\"nodes\":[");
    for (uint32_t i = 0; i < w->mesh_count; i++) qw_pen_print(out, i ? ",%u" : "%u", i);
    qw_pen_text(out, "]}],\"nodes\":[");
    for (uint32_t i = 0; i < w->mesh_count; i++) {
        int32_t label = w->object ? w->object->labels[first_face[i]] : -1;
        qw_pen_print(out, "%s{\"mesh\":%u", i ? "," : "", i);
        put_translation(w, out);
        if (label >= 0 && w->object->label_names)
            qw_pen_text(out, ",\"name\":"), qw_pen_string(out, w->object->label_names[label]);
        qw_pen_text(out, "}");
    }
    qw_pen_text(out, "],");
    put_look(w, out);
}

static void put_list(qw_pen *out, const char *name, const char *passed, const qw_pen *own)
{
    qw_pen_print(out, "\"%s\":[", name);
    qw_pen_text(out, passed);
    qw_pen_put(out, own->at, own->size);
    if (out->at[out->size - 1] == ',') out->size--;
    qw_pen_text(out, "],");
}

/* What follows the nodes and materials, up to the buffer, which ends the document. extension: one that is used, or "".
 */
static void put_rest(const qw_gltf_writer *w, qw_pen *out, const char *extension)
{
    const qw_gltf_rest *r = w->rest ? w->rest : w->pictures;
    qw_pen_text(out, "\"meshes\":[");
    qw_pen_put(out, w->meshes.at, w->meshes.size);
    qw_pen_text(out, "],");
    put_list(out, "accessors", w->rest ? r->text + r->accessors : "", &w->accessors);
    put_list(out, "bufferViews", r ? r->text + r->views : "", &w->views);
    qw_pen_text(out, "\"extensionsUsed\":[");
    if (r) qw_pen_text(out, r->text + r->used);
    qw_pen_print(out, "\"FB_ngon_encoding\"%s],", extension);
    if (r && r->text[r->required])
        qw_pen_text(out, "\"extensionsRequired\":["), qw_pen_text(out, r->text + r->required), qw_pen_text(out, "],");
    qw_pen_print(out, "\"buffers\":[{\"byteLength\":%zu", w->bytes.size);
}

/* The JSON up to the accessors: of the document that the input came from, or a new one. */
static qw_pen put_document(const qw_gltf_writer *w, const uint32_t *first_face)
{
    const qw_gltf_rest *r = w->rest;
    qw_pen out = {.env = w->env};
    qw_pen_text(&out, "{");
    if (r) {
        uint32_t *mesh = QW_NEW(w->env, uint32_t, r->object_count);
        for (uint32_t i = 0; i < r->object_count; i++) mesh[i] = QW_NONE;
        for (uint32_t i = 0; i < w->mesh_count; i++) mesh[qw_gltf_object_of(w, first_face[i])] = i;
        qw_pen_text(&out, r->text + r->head);
        put_nodes(w, &out, mesh);
    } else {
        put_own_head(w, &out, first_face);
    }
    put_rest(w, &out, "");
    return out;
}

/* ---- the file */

/* Writes header, JSON and bytes as GLB; fails beyond what that can hold. */
static void put_glb(qw_gltf_writer *w, qw_file *file, qw_pen *json)
{
    qw_pen_text(json, "}]}");
    qw_pen_align(json, QW_GLTF_ALIGNMENT, ' ');
    qw_pen_align(&w->bytes, QW_GLTF_ALIGNMENT, 0);
    uint64_t total = QW_GLB_HEADER + 2 * QW_GLB_CHUNK_HEADER + (uint64_t)json->size + w->bytes.size;
    if (total > UINT32_MAX)
        qw_fail(w->env, QW_TOO_LARGE, -1, "the result needs %.0f bytes as GLB, which holds at most 4294967295",
                (double)total);
    qw_pen head = {.env = w->env};
    qw_pen_text(&head, "glTF");
    qw_put_bits(&head, 2, 4), qw_put_bits(&head, (uint32_t)total, 4);
    qw_put_bits(&head, (uint32_t)json->size, 4), qw_pen_text(&head, "JSON");
    qw_file_put(file, head.at, head.size);
    qw_file_put(file, json->at, json->size);
    head.size = 0;
    qw_put_bits(&head, (uint32_t)w->bytes.size, 4), qw_pen_put(&head, "BIN", 4);
    qw_file_put(file, head.at, head.size);
    qw_file_put(file, w->bytes.at, w->bytes.size);
}

/* Writes bytes as base64, filled up with "=". */
static void put_base64(qw_file *file, const char *bytes, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char text[4096];
    size_t held = 0;
    for (size_t i = 0; i < size; i += 3) {
        uint32_t bits = 0;
        for (size_t k = 0; k < 3; k++) bits = bits << 8 | (i + k < size ? (unsigned char)bytes[i + k] : 0);
        for (size_t k = 0; k < 4; k++) text[held++] = i + k < size + 1 ? digits[bits >> (18 - 6 * k) & 63] : '=';
        if (held == sizeof text) qw_file_put(file, text, held), held = 0;
    }
    qw_file_put(file, text, held);
}

static void put_json(qw_gltf_writer *w, qw_file *file, qw_pen *json)
{
    qw_pen_text(json, ",\"uri\":\"data:application/octet-stream;base64,");
    qw_file_put(file, json->at, json->size);
    put_base64(file, w->bytes.at, w->bytes.size);
    qw_file_put(file, "\"}]}\n", 5);
}

static void order_faces(qw_gltf_writer *w)
{
    qw_attribute by[2];
    uint32_t count = 0;
    if (w->object) by[count++] = *w->object;
    if (w->material) by[count++] = *w->material;
    w->order = qw_order_faces(w->env, w->mesh->face_count, by, count);
}

/* Of a glTF file that was read the reader has told. */
static void warn_of_names(const qw_gltf_writer *w)
{
    const qw_attribute *labels[] = {w->object, w->material};
    bool is_utf8 = true;
    for (int i = 0; i < 2 && !w->rest; i++)
        for (uint32_t k = 0; labels[i] && labels[i]->label_names && k < labels[i]->label_count; k++)
            for (const char *c = labels[i]->label_names[k]; *c && is_utf8; c += qw_utf8_size(c))
                is_utf8 = qw_utf8_size(c) > 0;
    if (!is_utf8)
        qw_log(w->env, QW_LOG_WARNING,
               "names that are not UTF-8 are written as if they were Latin-1 (ISO 8859-1): glTF holds UTF-8 only");
}

/* Which labels of materials refer to by their numbers. */
static void begin_pictures(qw_gltf_writer *w, const qw_gltf_rest *pictures)
{
    if (!pictures) return;
    qw_pen_put(&w->bytes, pictures->bytes, pictures->byte_count);
    w->pictures = pictures, w->view_count = pictures->view_count, w->material_count = pictures->material_count;
}

/* Makes room for the copies of vertices, takes over what is kept of the input, and orders the faces by object and
   material. */
static void begin_writer(qw_gltf_writer *w)
{
    const qw_mesh_view *m = w->mesh;
    w->begin = QW_NEW(w->env, uint32_t, m->face_count + (size_t)1);
    w->begin[0] = 0;
    for (uint32_t f = 0; f < m->face_count; f++) w->begin[f + 1] = w->begin[f] + qw_view_face_size(m, f);
    size_t corners = w->begin[m->face_count];
    w->copy = QW_NEW(w->env, uint32_t, corners), w->last = QW_NEW_ZERO(w->env, uint32_t, m->vertex_count);
    w->before = QW_NEW(w->env, uint32_t, corners), w->corner = QW_NEW(w->env, uint32_t, corners);
    if (w->rest) {
        w->view_count = w->rest->view_count, w->accessor_count = w->rest->accessor_count;
        qw_pen_put(&w->bytes, w->rest->bytes, w->rest->byte_count);
    }
    w->object = qw_gltf_labels(w, "object"), w->material = qw_gltf_labels(w, "material");
    warn_of_names(w);
    qw_find_gltf_centre(w);
    qw_find_gltf_streams(w);
    order_faces(w);
}

void qw_put_gltf(qw_env *env, qw_file *file, bool is_binary, const qw_mesh_view *mesh, const qw_attribute *attributes,
                 uint32_t count, const qw_gltf_rest *rest)
{
    const qw_pen none = {.env = env};
    qw_gltf_writer w = {.env = env,
                        .mesh = mesh,
                        .attributes = attributes,
                        .count = count,
                        .rest = rest && rest->object_count ? rest : NULL,
                        .meshes = none,
                        .views = none,
                        .accessors = none,
                        .bytes = none};
    if (!w.rest) begin_pictures(&w, rest);
    begin_writer(&w);
    uint32_t *first_face = NULL;
    size_t capacity = 0;
    for (uint32_t i = 0, end; i < mesh->face_count; i = end) {
        uint32_t object = qw_gltf_object_of(&w, qw_gltf_face_at(&w, i));
        for (end = i; end < mesh->face_count && qw_gltf_object_of(&w, qw_gltf_face_at(&w, end)) == object; end++)
            continue;
        first_face = qw_grow(env, first_face, &capacity, w.mesh_count + (size_t)1, sizeof *first_face);
        first_face[w.mesh_count] = qw_gltf_face_at(&w, i);
        qw_put_gltf_mesh(&w, i, end);
    }
    qw_pen json = put_document(&w, first_face);
    if (is_binary) put_glb(&w, file, &json);
    else put_json(&w, file, &json);
}

/* ---- levels of detail */

/* The JSON of levels of detail: a node for each, of which the first names the others (MSFT_lod). */
static qw_pen put_levels_document(const qw_gltf_writer *w, uint32_t levels)
{
    qw_pen out = {.env = w->env};
    qw_pen_text(&out, "{\"asset\":{" QW_GLTF_ASSET "},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[");
    for (uint32_t i = 0; i < levels; i++) {
        qw_pen_print(&out, "%s{\"name\":\"LOD%u\",\"mesh\":%u", i ? "," : "", i, i);
        put_translation(w, &out);
        for (uint32_t k = 1; k < levels && i == 0; k++)
            qw_pen_print(&out, k > 1 ? ",%u" : ",\"extensions\":{\"MSFT_lod\":{\"ids\":[%u", k);
        qw_pen_text(&out, i == 0 && levels > 1 ? "]}}}" : "}");
    }
    qw_pen_text(&out, "],");
    put_look(w, &out);
    put_rest(w, &out, levels > 1 ? ",\"MSFT_lod\"" : "");
    return out;
}

void qw_put_gltf_levels(qw_env *env, qw_file *file, bool is_binary, const qw_gltf_level *levels, uint32_t count,
                        const qw_gltf_rest *pictures)
{
    const qw_pen none = {.env = env};
    qw_gltf_writer w = {.env = env, .meshes = none, .views = none, .accessors = none, .bytes = none};
    float centre[3];
    begin_pictures(&w, pictures);
    for (uint32_t i = 0; i < count; i++) {
        w.mesh = levels[i].mesh, w.attributes = levels[i].attributes, w.count = levels[i].count;
        w.copies = w.streams = 0;
        begin_writer(&w);
        w.object = NULL, order_faces(&w); /* a level is one node */
        if (i == 0) memcpy(centre, w.centre, sizeof centre);
        else memcpy(w.centre, centre, sizeof centre);
        qw_put_gltf_mesh(&w, 0, w.mesh->face_count);
    }
    qw_pen json = put_levels_document(&w, count);
    if (is_binary) put_glb(&w, file, &json);
    else put_json(&w, file, &json);
}

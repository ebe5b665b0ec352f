#include "io/gltf/gltf_document.h"

#include "base/printable.h"
#include "io/fetch.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

enum { MOST_STRIDE = 255 };

/* Whole numbers in JSON are doubles to many writers. */
static const uint64_t MOST_WHOLE = UINT64_C(1) << 53;

static const char *const list_member[] = {
    [QW_GLTF_ACCESSORS] = "accessors",  [QW_GLTF_VIEWS] = "bufferViews",   [QW_GLTF_BUFFERS] = "buffers",
    [QW_GLTF_MESHES] = "meshes",        [QW_GLTF_NODES] = "nodes",         [QW_GLTF_SCENES] = "scenes",
    [QW_GLTF_SKINS] = "skins",          [QW_GLTF_MATERIALS] = "materials", [QW_GLTF_IMAGES] = "images",
    [QW_GLTF_ANIMATIONS] = "animations"};
static const char *const list_item[] = {
    [QW_GLTF_ACCESSORS] = "accessor",  [QW_GLTF_VIEWS] = "buffer view",  [QW_GLTF_BUFFERS] = "buffer",
    [QW_GLTF_MESHES] = "mesh",         [QW_GLTF_NODES] = "node",         [QW_GLTF_SCENES] = "scene",
    [QW_GLTF_SKINS] = "skin",          [QW_GLTF_MATERIALS] = "material", [QW_GLTF_IMAGES] = "image",
    [QW_GLTF_ANIMATIONS] = "animation"};

_Noreturn void qw_gltf_fail(const qw_gltf_document *d, qw_status status, qw_gltf_list list, uint32_t index,
                            const char *format, ...)
{
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    qw_fail(d->env, status, index, "%s: %s %u: %s", d->name, list_item[list], index, text);
}

/* ---- members */

uint64_t qw_gltf_whole(const qw_gltf_document *d, uint32_t object, const char *member, uint64_t most, uint64_t missing,
                       qw_gltf_list list, uint32_t index)
{
    uint32_t t = qw_json_member(&d->json, object, member);
    double value;
    if (t == QW_NONE) return missing;
    if (!qw_json_number(&d->json, t, &value) || !(value >= 0) || (value < 1e15 && value != (double)(uint64_t)value))
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, list, index, "its %s is not a whole number from 0 up", member);
    if (value > (double)most)
        qw_gltf_fail(d, QW_TOO_LARGE, list, index, "its %s is %.0f; at most %" PRIu64 " is allowed", member, value,
                     most);
    return (uint64_t)value;
}

static uint32_t check_index(const qw_gltf_document *d, uint32_t token, qw_gltf_list of, qw_gltf_list list,
                            uint32_t index)
{
    double value;
    if (!qw_json_number(&d->json, token, &value) || !(value >= 0) || (value < 1e15 && value != (double)(uint64_t)value))
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, list, index, "the number of a %s is not a whole number from 0 up",
                     list_item[of]);
    if (value >= d->length[of])
        qw_gltf_fail(d, QW_INDEX_RANGE, list, index, "it names %s %.0f, but there are %u, counted from 0",
                     list_item[of], value, d->length[of]);
    return (uint32_t)value;
}

uint32_t qw_gltf_index(const qw_gltf_document *d, uint32_t object, const char *member, qw_gltf_list of,
                       qw_gltf_list list, uint32_t index)
{
    uint32_t t = qw_json_member(&d->json, object, member);
    return t == QW_NONE ? QW_NONE : check_index(d, t, of, list, index);
}

uint32_t qw_gltf_item_index(const qw_gltf_document *d, uint32_t token, qw_gltf_list of, qw_gltf_list list,
                            uint32_t index)
{
    return check_index(d, token, of, list, index);
}

uint32_t qw_gltf_array(const qw_gltf_document *d, uint32_t object, const char *member, qw_gltf_list list,
                       uint32_t index)
{
    uint32_t t = qw_json_member(&d->json, object, member);
    if (t != QW_NONE && !qw_json_has_kind(&d->json, t, QW_JSON_ARRAY))
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, list, index, "its %s is not an array", member);
    return t;
}

/* ---- URIs */

static int sextet(char c)
{
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' || c == '-' ? 62 : c == '/' || c == '_' ? 63 : -1;
}

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

/* at NULL: it is no base64. */
static qw_bytes decode_base64(qw_env *env, const char *text)
{
    size_t length = strlen(text), size = 0;
    uint32_t bits = 0, held = 0;
    char *bytes = qw_alloc(env, length / 4 * 3 + 3 + QW_ZEROS, 1);
    while (length > 0 && text[length - 1] == '=') length--;
    for (size_t i = 0; i < length; i++) {
        int value = sextet(text[i]);
        if (value < 0) return (qw_bytes){NULL, 0};
        bits = bits << 6 | (uint32_t)value, held += 6;
        if (held >= 8) held -= 8, bytes[size++] = (char)(bits >> held);
    }
    memset(bytes + size, 0, QW_ZEROS);
    return (qw_bytes){bytes, size};
}

/* %20 and the like. In place. */
static void decode_percents(char *text)
{
    char *out = text;
    for (const char *in = text; *in; in++) {
        int high = *in == '%' ? hex_digit(in[1]) : -1, low = high < 0 ? -1 : hex_digit(in[2]);
        if (low >= 0 && (high || low)) *out++ = (char)(high << 4 | low), in += 2;
        else *out++ = *in;
    }
    *out = 0;
}

/* Only what lies in the folder of the file or below it: a file that was sent to somebody reads nothing else of theirs.
 */
static bool leaves_folder(const char *path)
{
    if (path[0] == '/' || path[0] == '\\' || strchr(path, ':')) return true;
    for (const char *at = path; *at;) {
        size_t size = strcspn(at, "/\\");
        if (size == 2 && at[0] == '.' && at[1] == '.') return true;
        at += size + (at[size] != 0);
    }
    return path[0] == 0;
}

typedef struct file_read {
    qw_env *env;
    const char *path;
    uint64_t most;
    bool may_cut;
    qw_bytes bytes;
} file_read;

static void read_file(void *user)
{
    file_read *f = user;
    f->bytes = qw_file_read_regular(f->env, f->path, qw_path_for_messages(f->env, f->path, f->path), f->most,
                                    f->may_cut);
}

static void nothing(void *user) { (void)user; }

/* What cannot be read is for the caller to judge; that memory runs out or the host cancels is not. */
static qw_bytes try_file(qw_env *env, const char *path, uint64_t most, bool may_cut, const char **why)
{
    file_read f = {.env = env, .path = path, .most = most, .may_cut = may_cut};
    qw_status status = qw_protect(env, read_file, &f);
    if (status == QW_OK) return f.bytes;
    char sentence[512];
    snprintf(sentence, sizeof sentence, "%s", qw_env_message(env));
    if (status == QW_MEMORY || status == QW_CANCELLED) qw_fail(env, status, -1, "%s", sentence);
    qw_protect(env, nothing, NULL); /* the message is not that of a failure */
    size_t size = strlen(sentence) + 1;
    *why = memcpy(qw_alloc(env, size + 4, 1), sentence, size);
    return (qw_bytes){NULL, 0};
}

/* Where the file is that a URI names; NULL: nowhere, and *why says so. In the caller's scope. */
static char *path_of_uri(const qw_gltf_document *d, const char *uri, const char **why)
{
    size_t size = strlen(uri) + 1, folder = d->path ? strlen(d->path) : 0;
    *why = "it is in another file, and none is at hand";
    if (!d->path || strcmp(d->path, "-") == 0) return NULL;
    while (folder > 0 && d->path[folder - 1] != '/' && d->path[folder - 1] != '\\') folder--;
    char *path = qw_alloc(d->env, folder + size, 1);
    memcpy(path, d->path, folder);
    memcpy(path + folder, uri, size);
    decode_percents(path + folder);
    *why = "it leads out of the folder of the file";
    return leaves_folder(path + folder) ? NULL : path;
}

static bool is_data(const char *uri) { return strncmp(uri, "data:", 5) == 0; }

qw_bytes qw_gltf_fetch_uri(const qw_gltf_document *d, const char *uri, uint64_t most, bool may_cut, char media[64],
                           const char **why)
{
    media[0] = 0;
    if (!is_data(uri)) {
        const char *path = path_of_uri(d, uri, why);
        return path ? try_file(d->env, path, most, may_cut, why) : (qw_bytes){NULL, 0};
    }
    const char *comma = strchr(uri, ',');
    size_t size = strcspn(uri + 5, ";,");
    *why = "it is not data in base64";
    if (!comma || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0) return (qw_bytes){NULL, 0};
    if (size < 64) memcpy(media, uri + 5, size), media[size] = 0;
    return decode_base64(d->env, comma + 1);
}

/* ---- the file */

bool qw_is_glb(qw_bytes bytes) { return bytes.size >= 4 && memcmp(bytes.at, "glTF", 4) == 0; }

bool qw_is_gltf(qw_bytes bytes)
{
    size_t at = bytes.size >= 3 && memcmp(bytes.at, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (at < bytes.size && strchr(" \t\r\n", bytes.at[at]) && bytes.at[at]) at++;
    return at < bytes.size && bytes.at[at] == '{';
}

/* The JSON of a GLB, and its other chunk. */
static qw_bytes open_glb(qw_gltf_document *d, qw_bytes file)
{
    if (file.size < QW_GLB_HEADER)
        qw_fail(d->env, QW_FORMAT_TRUNCATED, -1, "%s: the file ends in the header of GLB", d->name);
    uint32_t version = (uint32_t)qw_fetch_bits(file.at + 4, 4, false);
    uint64_t length = qw_fetch_bits(file.at + 8, 4, false);
    if (version != 2)
        qw_fail(d->env, QW_UNSUPPORTED, -1, "%s: this is version %u of GLB; version 2 can be read", d->name, version);
    if (length > file.size)
        qw_fail(d->env, QW_FORMAT_TRUNCATED, -1,
                "%s: the header of GLB announces %" PRIu64 " bytes, but the file has %zu", d->name, length, file.size);
    qw_bytes json = {NULL, 0};
    for (uint64_t at = QW_GLB_HEADER; at + QW_GLB_CHUNK_HEADER <= length;) {
        uint64_t size = qw_fetch_bits(file.at + at, 4, false);
        const char *kind = file.at + at + 4;
        at += QW_GLB_CHUNK_HEADER;
        if (size > length - at)
            qw_fail(d->env, QW_FORMAT_TRUNCATED, (int64_t)at,
                    "%s, byte %" PRIu64 ": a chunk has %" PRIu64 " bytes, but %" PRIu64 " are left", d->name,
                    at - QW_GLB_CHUNK_HEADER, size, length - at);
        if (memcmp(kind, "JSON", 4) == 0 && !json.at) json = (qw_bytes){file.at + at, (size_t)size};
        else if (memcmp(kind, "BIN", 4) == 0 && !d->chunk.at) d->chunk = (qw_bytes){file.at + at, (size_t)size};
        at += size;
    }
    if (!json.at) qw_fail(d->env, QW_FORMAT_SYNTAX, -1, "%s: the GLB has no chunk of JSON", d->name);
    return json;
}

/* Fails unless the JSON is glTF of version 2. */
static void check_asset(const qw_gltf_document *d)
{
    const qw_json_doc *j = &d->json;
    uint32_t asset = qw_json_member(j, 0, "asset");
    if (!qw_json_has_kind(j, asset, QW_JSON_OBJECT))
        qw_fail(d->env, QW_FORMAT_UNKNOWN, -1,
                "%s: the format is unknown: it is JSON, but not glTF, which has an \"asset\"", d->name);
    const char *version = qw_json_string(j, qw_json_member(j, asset, "version"));
    if (!version || version[0] != '2')
        qw_fail(d->env, QW_UNSUPPORTED, -1, "%s: this is version %.20s of glTF; version 2 can be read", d->name,
                version ? version : "(none)");
}

/* Fails where meshes are compressed by an extension that is not read. */
static void check_extensions(const qw_gltf_document *d)
{
    static const char *const packed[] = {"KHR_draco_mesh_compression", "EXT_meshopt_compression",
                                         "KHR_meshopt_compression"};
    const qw_json_doc *j = &d->json;
    uint32_t required = qw_json_member(j, 0, "extensionsRequired");
    if (!qw_json_has_kind(j, required, QW_JSON_ARRAY)) return;
    uint32_t t = required + 1;
    for (uint32_t i = 0; i < j->token[required].count; i++, t = j->token[t].next)
        for (size_t k = 0; k < sizeof packed / sizeof *packed; k++)
            if (qw_json_reads(j, t, packed[k]))
                qw_fail(d->env, QW_UNSUPPORTED, -1,
                        "%s: its meshes are compressed by %s, which is not read; write it without, as from "
                        "Blender or with gltf-transform",
                        d->name, packed[k]);
}

/* Names are kept and written: what is no UTF-8 there would be no JSON. */
static void warn_of_bytes(const qw_gltf_document *d, qw_bytes json)
{
    size_t count = 0;
    for (size_t i = 0, step; i < json.size; i += step) {
        step = (unsigned char)json.at[i] < 0x80 ? 1 : qw_utf8_size(json.at + i);
        if (step == 0) count++, step = 1;
    }
    if (count > 0)
        qw_log(d->env, QW_LOG_WARNING,
               "%s: %zu bytes of its JSON are not UTF-8; in names they are taken for letters of Latin-1 (ISO 8859-1)",
               d->name, count);
}

/* The tokens of all meshes, nodes, accessors and so on; fails where a list is none, or holds what is no object. */
static void find_lists(qw_gltf_document *d)
{
    const qw_json_doc *j = &d->json;
    for (int k = 0; k < QW_GLTF_LIST_COUNT; k++) {
        uint32_t array = qw_json_member(j, 0, list_member[k]);
        if (array == QW_NONE) continue;
        if (!qw_json_has_kind(j, array, QW_JSON_ARRAY))
            qw_fail(d->env, QW_FORMAT_SYNTAX, -1, "%s: its %s are not an array", d->name, list_member[k]);
        d->length[k] = j->token[array].count;
        d->list[k] = QW_NEW(d->env, uint32_t, d->length[k]);
        uint32_t t = array + 1;
        for (uint32_t i = 0; i < d->length[k]; i++, t = j->token[t].next) {
            if (!qw_json_has_kind(j, t, QW_JSON_OBJECT))
                qw_gltf_fail(d, QW_FORMAT_SYNTAX, (qw_gltf_list)k, i, "it is not an object");
            d->list[k][i] = t;
        }
    }
}

/* ---- buffers and views */

/* The bytes of buffer i: of the GLB chunk, a data URI or a file beside; fails where they are fewer than announced. */
static void open_buffer(qw_gltf_document *d, uint32_t i)
{
    uint32_t t = d->list[QW_GLTF_BUFFERS][i];
    uint64_t size = qw_gltf_whole(d, t, "byteLength", MOST_WHOLE, MOST_WHOLE, QW_GLTF_BUFFERS, i);
    qw_bytes bytes = d->chunk;
    uint32_t uri = qw_json_member(&d->json, t, "uri");
    if (uri != QW_NONE) {
        char media[64];
        const char *why = "", *text = qw_json_bytes(&d->json, uri);
        if (!text) qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_BUFFERS, i, "its uri is not a string");
        bytes = qw_gltf_fetch_uri(d, text, size, true, media, &why);
        bool data = is_data(text);
        if (!bytes.at)
            qw_gltf_fail(d, data ? QW_FORMAT_SYNTAX : QW_FILE_MISSING, QW_GLTF_BUFFERS, i, "its uri \"%.60s\": %.150s",
                         text, why);
    } else if (i > 0 || !bytes.at) {
        bytes = (qw_bytes){"", 0}; /* without bytes, which some extensions allow: views of it fail */
        size = 0;
    }
    if (size == MOST_WHOLE) size = bytes.size;
    if (size > bytes.size)
        qw_gltf_fail(d, QW_FORMAT_TRUNCATED, QW_GLTF_BUFFERS, i, "it announces %" PRIu64 " bytes, but there are %zu",
                     size, bytes.size);
    d->buffer[i] = (qw_gltf_view){bytes.at, (size_t)size, 0};
}

/* View i as bytes of its buffer; fails where it reaches beyond the end. */
static void open_view(qw_gltf_document *d, uint32_t i)
{
    uint32_t t = d->list[QW_GLTF_VIEWS][i];
    uint32_t b = qw_gltf_index(d, t, "buffer", QW_GLTF_BUFFERS, QW_GLTF_VIEWS, i);
    uint64_t offset = qw_gltf_whole(d, t, "byteOffset", MOST_WHOLE, 0, QW_GLTF_VIEWS, i),
             size = qw_gltf_whole(d, t, "byteLength", MOST_WHOLE, 0, QW_GLTF_VIEWS, i);
    if (b == QW_NONE) qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_VIEWS, i, "it names no buffer");
    if (offset > d->buffer[b].size || size > d->buffer[b].size - offset)
        qw_gltf_fail(d, QW_FORMAT_TRUNCATED, QW_GLTF_VIEWS, i,
                     "bytes %" PRIu64 " to %" PRIu64 " lie beyond the end of buffer %u, which has %zu", offset,
                     offset + size, b, d->buffer[b].size);
    uint32_t stride = (uint32_t)qw_gltf_whole(d, t, "byteStride", MOST_STRIDE, 0, QW_GLTF_VIEWS, i);
    d->view[i] = (qw_gltf_view){d->buffer[b].at + offset, (size_t)size, stride};
}

/* ---- accessors */

static uint32_t size_of_type(uint32_t type)
{
    static const uint32_t size[] = {1, 1, 2, 2, 0, 4, 4};
    return type < QW_GLTF_INT8 || type > QW_GLTF_FLOAT32 ? 0 : size[type - QW_GLTF_INT8];
}

/* Numbers of an element of accessor i by its type, and whether they are a matrix. */
static uint32_t read_components(const qw_gltf_document *d, uint32_t object, uint32_t i, bool *is_matrix)
{
    static const struct {
        const char *name;
        uint32_t components;
    } types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}};
    uint32_t t = qw_json_member(&d->json, object, "type");
    for (size_t k = 0; k < sizeof types / sizeof *types; k++)
        if (qw_json_reads(&d->json, t, types[k].name)) {
            *is_matrix = k >= 4;
            return types[k].components;
        }
    qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, i, "its type is none of SCALAR, VEC2 to VEC4, MAT2 to MAT4");
}

static uint32_t read_type(const qw_gltf_document *d, uint32_t object, uint32_t i)
{
    uint64_t type = qw_gltf_whole(d, object, "componentType", MOST_WHOLE, 0, QW_GLTF_ACCESSORS, i);
    if (type > UINT32_MAX || size_of_type((uint32_t)type) == 0)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, i,
                     "its componentType %" PRIu64 " is none of 5120 to 5123, 5125 and 5126", type);
    return (uint32_t)type;
}

/* `count` elements of `size` bytes, `stride` apart, from `offset` on lie within the view. */
static void require_inside(const qw_gltf_document *d, uint32_t i, uint32_t view, uint64_t offset, uint64_t count,
                           uint64_t stride, uint64_t size)
{
    uint64_t there = d->view[view].size;
    if (count > 0 && (offset > there || size > there - offset || (count - 1) > (there - offset - size) / stride))
        qw_gltf_fail(d, QW_FORMAT_TRUNCATED, QW_GLTF_ACCESSORS, i,
                     "%" PRIu64 " elements from byte %" PRIu64
                     " on lie beyond the end of buffer view %u, which has %" PRIu64 " bytes",
                     count, offset, view, there);
}

/* Columns of matrices begin at multiples of four bytes. */
static uint32_t size_of_element(const qw_gltf_accessor *a)
{
    uint32_t size = size_of_type(a->type);
    if (!a->is_matrix) return size * a->components;
    uint32_t rows = a->components == 4 ? 2 : a->components == 9 ? 3 : 4;
    return rows * ((rows * size + 3) / 4 * 4);
}

/* What replaces some elements of accessor i, if it is sparse; fails where indices or values reach beyond their
   views. */
static void open_sparse(qw_gltf_document *d, uint32_t i, uint32_t object)
{
    qw_gltf_accessor *a = &d->accessor[i];
    uint32_t sparse = qw_json_member(&d->json, object, "sparse");
    if (sparse == QW_NONE) return;
    uint32_t indices = qw_json_member(&d->json, sparse, "indices"), values = qw_json_member(&d->json, sparse, "values");
    a->sparse_count = (uint32_t)qw_gltf_whole(d, sparse, "count", a->count, 0, QW_GLTF_ACCESSORS, i);
    a->sparse_type = read_type(d, indices, i);
    a->sparse_indices = qw_gltf_index(d, indices, "bufferView", QW_GLTF_VIEWS, QW_GLTF_ACCESSORS, i);
    a->sparse_values = qw_gltf_index(d, values, "bufferView", QW_GLTF_VIEWS, QW_GLTF_ACCESSORS, i);
    if (a->sparse_indices == QW_NONE || a->sparse_values == QW_NONE)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, i, "it is sparse, but names no buffer view of it");
    if (a->sparse_type == QW_GLTF_FLOAT32 || a->sparse_type == QW_GLTF_INT8 || a->sparse_type == QW_GLTF_INT16)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, i, "its sparse indices are of no unsigned type");
    uint64_t first_index = qw_gltf_whole(d, indices, "byteOffset", MOST_WHOLE, 0, QW_GLTF_ACCESSORS, i),
             first_value = qw_gltf_whole(d, values, "byteOffset", MOST_WHOLE, 0, QW_GLTF_ACCESSORS, i);
    uint32_t index_size = size_of_type(a->sparse_type), size = size_of_element(a);
    require_inside(d, i, a->sparse_indices, first_index, a->sparse_count, index_size, index_size);
    require_inside(d, i, a->sparse_values, first_value, a->sparse_count, size, size);
    a->indices_offset = (size_t)first_index, a->values_offset = (size_t)first_value;
}

/* Type, count, view and stride of accessor i; fails where it reaches beyond its view. */
static void open_accessor(qw_gltf_document *d, uint32_t i)
{
    uint32_t t = d->list[QW_GLTF_ACCESSORS][i];
    qw_gltf_accessor *a = &d->accessor[i];
    a->components = read_components(d, t, i, &a->is_matrix);
    a->type = read_type(d, t, i);
    a->count = (uint32_t)qw_gltf_whole(d, t, "count", (UINT64_C(1) << 31) - 1, 0, QW_GLTF_ACCESSORS, i);
    a->view = qw_gltf_index(d, t, "bufferView", QW_GLTF_VIEWS, QW_GLTF_ACCESSORS, i);
    uint64_t offset = qw_gltf_whole(d, t, "byteOffset", MOST_WHOLE, 0, QW_GLTF_ACCESSORS, i);
    a->is_normalised = qw_json_has_kind(&d->json, qw_json_member(&d->json, t, "normalized"), QW_JSON_TRUE);
    uint32_t size = size_of_element(a), stride = a->view == QW_NONE ? 0 : d->view[a->view].stride;
    a->stride = stride ? stride : size;
    if (a->stride < size)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, i, "its elements of %u bytes are %u bytes apart", size,
                     a->stride);
    if (a->view != QW_NONE) require_inside(d, i, a->view, offset, a->count, a->stride, size);
    a->offset = (size_t)offset;
    open_sparse(d, i, t);
}

qw_gltf_document qw_gltf_open(qw_env *env, const char *name, const char *path, qw_bytes bytes)
{
    qw_gltf_document d = {.env = env, .name = name, .path = path};
    qw_bytes json = qw_is_glb(bytes) ? open_glb(&d, bytes) : bytes;
    d.json = qw_json_parse(env, name, json.at, json.size);
    check_asset(&d);
    check_extensions(&d);
    warn_of_bytes(&d, json);
    find_lists(&d);
    d.buffer = QW_NEW_ZERO(env, qw_gltf_view, d.length[QW_GLTF_BUFFERS]);
    d.view = QW_NEW_ZERO(env, qw_gltf_view, d.length[QW_GLTF_VIEWS]);
    d.accessor = QW_NEW_ZERO(env, qw_gltf_accessor, d.length[QW_GLTF_ACCESSORS]);
    for (uint32_t i = 0; i < d.length[QW_GLTF_BUFFERS]; i++) open_buffer(&d, i);
    for (uint32_t i = 0; i < d.length[QW_GLTF_VIEWS]; i++) open_view(&d, i);
    for (uint32_t i = 0; i < d.length[QW_GLTF_ACCESSORS]; i++) open_accessor(&d, i);
    return d;
}

void qw_gltf_list_files(qw_env *env, const char *name, const char *path, qw_bytes bytes, qw_pen *paths)
{
    static const qw_gltf_list lists[] = {QW_GLTF_BUFFERS, QW_GLTF_IMAGES};
    qw_gltf_document d = {.env = env, .name = name, .path = path};
    qw_bytes json = qw_is_glb(bytes) ? open_glb(&d, bytes) : bytes;
    d.json = qw_json_parse(env, name, json.at, json.size);
    find_lists(&d);
    for (int k = 0; k < 2; k++)
        for (uint32_t i = 0; i < d.length[lists[k]]; i++) {
            const char *why, *uri = qw_json_bytes(&d.json, qw_json_member(&d.json, d.list[lists[k]][i], "uri")),
                             *file = uri && !is_data(uri) ? path_of_uri(&d, uri, &why) : NULL;
            if (file) qw_pen_put(paths, file, strlen(file) + 1);
        }
}

/* ---- values */

/* A component as a number; of normalised integers from -1 or 0 to 1. */
static float fetch(const char *at, uint32_t type, bool is_normalised)
{
    uint64_t bits = qw_fetch_bits(at, (int)size_of_type(type), false);
    float least = -1;
    switch (type) {
    case QW_GLTF_INT8:
        return is_normalised ? (float)(int8_t)bits / 127 < least ? least : (float)(int8_t)bits / 127
                             : (float)(int8_t)bits;
    case QW_GLTF_INT16:
        return is_normalised ? (float)(int16_t)bits / 32767 < least ? least : (float)(int16_t)bits / 32767
                             : (float)(int16_t)bits;
    case QW_GLTF_UINT8: return is_normalised ? (float)bits / 255 : (float)bits;
    case QW_GLTF_UINT16: return is_normalised ? (float)bits / 65535 : (float)bits;
    case QW_GLTF_UINT32: return (float)bits;
    default: return (float)qw_fetch_float(at, false);
    }
}

static void fetch_element(const qw_gltf_accessor *a, const char *at, float *out)
{
    uint32_t size = size_of_type(a->type), rows = a->components == 4 ? 2 : a->components == 9 ? 3 : 4;
    for (uint32_t k = 0; k < a->components; k++) {
        uint32_t byte = a->is_matrix ? k / rows * ((rows * size + 3) / 4 * 4) + k % rows * size : k * size;
        out[k] = fetch(at + byte, a->type, a->is_normalised);
    }
}

/* Writes the elements that a sparse accessor replaces into its values. */
static void put_sparse(const qw_gltf_document *d, uint32_t i)
{
    const qw_gltf_accessor *a = &d->accessor[i];
    const char *index = d->view[a->sparse_indices].at + a->indices_offset,
               *value = d->view[a->sparse_values].at + a->values_offset;
    uint32_t index_size = size_of_type(a->sparse_type), size = size_of_element(a);
    for (size_t k = 0; k < a->sparse_count; k++) {
        uint32_t at = (uint32_t)qw_fetch_bits(index + k * index_size, (int)index_size, false);
        if (at >= a->count)
            qw_gltf_fail(d, QW_INDEX_RANGE, QW_GLTF_ACCESSORS, i, "it is sparse and names element %u, but has %u", at,
                         a->count);
        fetch_element(a, value + k * size, a->values + (size_t)a->components * at);
    }
}

const float *qw_gltf_values(qw_gltf_document *d, uint32_t accessor)
{
    qw_gltf_accessor *a = &d->accessor[accessor];
    if (a->values) return a->values;
    a->values = QW_NEW_ZERO(d->env, float, (size_t)a->count * a->components);
    if (a->view != QW_NONE) {
        const char *at = d->view[a->view].at + a->offset;
        for (size_t e = 0; e < a->count; e++) fetch_element(a, at + e * a->stride, a->values + e * a->components);
    }
    if (a->sparse_count) put_sparse(d, accessor);
    return a->values;
}

uint32_t *qw_gltf_indices(const qw_gltf_document *d, uint32_t accessor)
{
    const qw_gltf_accessor *a = &d->accessor[accessor];
    uint32_t size = size_of_type(a->type);
    bool is_whole = a->type == QW_GLTF_UINT8 || a->type == QW_GLTF_UINT16 || a->type == QW_GLTF_UINT32;
    if (a->components != 1 || !is_whole || a->is_normalised || a->view == QW_NONE || a->sparse_count)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_ACCESSORS, accessor,
                     "it is used for the corners of faces, but is not made of whole numbers in a buffer view");
    uint32_t *index = QW_NEW(d->env, uint32_t, a->count);
    const char *at = d->view[a->view].at + a->offset;
    for (size_t e = 0; e < a->count; e++) index[e] = (uint32_t)qw_fetch_bits(at + e * a->stride, (int)size, false);
    return index;
}

/* Meshes with attributes to files: OBJ, PLY and OFF. One element after the other, as such meshes are as small as what
 * is made of them. */
#include "base/sort.h"
#include "base/mesh_view.h"
#include "io/formats.h"
#include "io/number.h"
#include "io/soup.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { LINE_SIZE = 512 };

/* To the nearest whole number, ties away from 0; |x| below 2^62. */
static double whole(double x) { return (double)(int64_t)(x < 0 ? x - 0.5 : x + 0.5); }

/* Decimals of normals and colours in text; texture coordinates have as many as tell multiples of 2^-20 apart, far
   beyond what parts two triangles. */
static const double DECIMALS = 1e6, UV_DECIMALS = 1e9;

typedef struct output {
    qw_env *env;
    qw_file *file;
    const qw_mesh_view *mesh;
    const qw_attribute *attributes;
    uint32_t count;
    const uint32_t *order; /* uint32_t[face_count]: NULL: as they are */
    const uint32_t *begin; /* uint32_t[face_count + 1]: first corner of each face */
} output;

/* ---- bytes */

static void put(output *o, const char *bytes, size_t size) { qw_file_put(o->file, bytes, size); }

static void put_text(output *o, const char *text) { put(o, text, strlen(text)); }

static void put_number(output *o, double value)
{
    char text[QW_NUMBER_SIZE];
    put(o, text, qw_number_print(text, value));
}

static void put_rounded(output *o, float value, double decimals)
{
    double v = (double)value;
    put_text(o, " ");
    put_number(o, fabs(v) < 1e9 ? whole(v * decimals) / decimals + 0.0 : v);
}

static void put_short(output *o, float value) { put_rounded(o, value, DECIMALS); }

static void put_whole(output *o, int64_t value)
{
    char text[24], *end = text + sizeof text, *at = end;
    uint64_t left = value < 0 ? 0 - (uint64_t)value : (uint64_t)value;
    do *--at = (char)('0' + left % 10);
    while (left /= 10);
    if (value < 0) *--at = '-';
    put(o, at, (size_t)(end - at));
}

/* ---- what there is */

/* Texture coordinates of any domain. */
static const qw_attribute *find(const output *o, const char *name, qw_domain domain, qw_attribute_kind kind)
{
    for (uint32_t i = 0; i < o->count; i++) {
        const qw_attribute *a = &o->attributes[i];
        if ((a->domain == domain || kind == QW_UVS) && a->kind == kind && (!name || strcmp(a->name, name) == 0))
            return a;
    }
    return NULL;
}

static uint32_t face_at(const output *o, uint32_t i) { return o->order ? o->order[i] : i; }

uint32_t *qw_order_faces(qw_env *env, uint32_t face_count, const qw_attribute *attributes, uint32_t count)
{
    uint32_t *order = NULL;
    uint64_t *key = NULL;
    for (uint32_t i = count; i-- > 0;) { /* the last first: the sort is stable */
        const qw_attribute *a = &attributes[i];
        if (a->domain != QW_PER_FACE || a->kind != QW_LABELS) continue;
        if (!order) {
            order = QW_NEW(env, uint32_t, face_count), key = QW_NEW(env, uint64_t, face_count);
            for (uint32_t f = 0; f < face_count; f++) order[f] = f;
        }
        uint32_t *before = QW_NEW(env, uint32_t, face_count);
        memcpy(before, order, face_count * sizeof *order);
        for (uint32_t f = 0; f < face_count; f++)
            key[f] = (uint64_t)((uint32_t)a->labels[order[f]] ^ 0x80000000u) << 32 | f;
        qw_sort_u64(key, face_count);
        for (uint32_t f = 0; f < face_count; f++) order[f] = before[(uint32_t)key[f]];
        qw_free(env, before);
    }
    qw_free(env, key);
    return order;
}

/* ---- OBJ */

/* The rows of an attribute of corners or vertices, one for each value of a vertex: row[corner], from 1. Writes them. */
static uint32_t *put_rows(output *o, const qw_attribute *a, const char *word)
{
    if (!a) return NULL;
    const qw_mesh_view *m = o->mesh;
    uint32_t corners = o->begin[m->face_count], rows = 0, n = a->components;
    uint32_t *row = QW_NEW(o->env, uint32_t, corners), *last = QW_NEW_ZERO(o->env, uint32_t, m->vertex_count),
             *before = QW_NEW(o->env, uint32_t, corners), *from = QW_NEW(o->env, uint32_t, corners);
    for (uint32_t i = 0; i < m->face_count; i++)
        for (uint32_t c = o->begin[face_at(o, i)]; c < o->begin[face_at(o, i) + 1]; c++) {
            uint32_t v = m->corners[c], r = last[v], at = a->domain == QW_PER_VERTEX ? v : c;
            while (r && memcmp(a->values + (size_t)n * from[r - 1], a->values + (size_t)n * at, n * sizeof(float)))
                r = before[r - 1];
            if (r == 0) {
                from[rows] = at, before[rows] = last[v], r = last[v] = ++rows;
                put_text(o, word);
                for (uint32_t k = 0; k < n; k++)
                    put_rounded(o, a->values[(size_t)n * at + k], a->kind == QW_UVS ? UV_DECIMALS : DECIMALS);
                put_text(o, "\n");
            }
            row[c] = r;
        }
    qw_free(o->env, last), qw_free(o->env, before), qw_free(o->env, from);
    return row;
}

/* Writes o, g, usemtl and s lines where face f has another label than those in force. */
static void put_labels(output *o, uint32_t f, int32_t *in_force)
{
    static const char *const names[4][2] = {
        {"object", "o "}, {"group", "g "}, {"material", "usemtl "}, {"smoothing", "s "}};
    for (int i = 0; i < 4; i++) {
        const qw_attribute *a = find(o, names[i][0], QW_PER_FACE, QW_LABELS);
        if (!a || a->labels[f] == in_force[i]) continue;
        in_force[i] = a->labels[f];
        if (a->labels[f] < 0 && i != 3) continue; /* nothing takes a name back, and such faces come first */
        put_text(o, names[i][1]);
        if (a->labels[f] < 0) put_text(o, "off");
        else if (a->label_names) put_text(o, a->label_names[a->labels[f]]);
        else put_whole(o, a->labels[f]);
        put_text(o, "\n");
    }
}

static void put_libraries(output *o, const char *library)
{
    for (const char *at = library; at && *at;) {
        size_t size = strcspn(at, "\n");
        put_text(o, "mtllib ");
        put(o, at, size);
        put_text(o, "\n");
        at += size + (at[size] != 0);
    }
}

/* Writes the mesh with its normals, texture coordinates, colours and groups as Wavefront OBJ. */
static void put_obj(output *o, const char *library)
{
    const qw_mesh_view *m = o->mesh;
    const qw_attribute *colour = find(o, "color", QW_PER_VERTEX, QW_VALUES),
                       *normal = find(o, NULL, QW_PER_CORNER, QW_NORMALS),
                       *smooth = normal ? NULL : find(o, NULL, QW_PER_VERTEX, QW_NORMALS);
    int32_t in_force[4] = {-1, -1, -1, -1};
    put_libraries(o, library);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        put_text(o, "v");
        for (size_t k = 0; k < 3; k++) put_text(o, " "), put_number(o, m->positions[3 * (size_t)v + k]);
        for (size_t k = 0; colour && colour->components >= 3 && k < 3; k++)
            put_short(o, colour->values[colour->components * (size_t)v + k]);
        put_text(o, "\n");
    }
    const uint32_t *vt = put_rows(o, find(o, NULL, QW_PER_CORNER, QW_UVS), "vt"), *vn = put_rows(o, normal, "vn");
    for (uint32_t v = 0; v < m->vertex_count && smooth; v++) {
        put_text(o, "vn");
        for (size_t k = 0; k < 3; k++) put_short(o, smooth->values[3 * (size_t)v + k]);
        put_text(o, "\n");
    }
    for (uint32_t i = 0; i < m->face_count; i++) {
        uint32_t f = face_at(o, i);
        put_labels(o, f, in_force);
        put_text(o, "f");
        for (uint32_t c = o->begin[f]; c < o->begin[f + 1]; c++) {
            put_text(o, " ");
            put_whole(o, (int64_t)m->corners[c] + 1);
            if (vt || vn || smooth) put_text(o, "/");
            if (vt) put_whole(o, vt[c]);
            if (vn || smooth) put_text(o, "/"), put_whole(o, vn ? vn[c] : (int64_t)m->corners[c] + 1);
        }
        put_text(o, "\n");
    }
}

/* ---- PLY */

typedef struct ply_type {
    const char *name;
    int size;
    double least, most;
} ply_type;

static const ply_type types[] = {[QW_FLOAT32] = {"float", 4, 0, 0},
                                 [QW_FLOAT64] = {"double", 8, 0, 0},
                                 [QW_INT8] = {"char", 1, -128, 127},
                                 [QW_UINT8] = {"uchar", 1, 0, 255},
                                 [QW_INT16] = {"short", 2, -32768, 32767},
                                 [QW_UINT16] = {"ushort", 2, 0, 65535},
                                 [QW_INT32] = {"int", 4, -2147483648.0, 2147483647},
                                 [QW_UINT32] = {"uint", 4, 0, 4294967295.0}};

static void put_bits(output *o, uint64_t bits, int size)
{
    char bytes[8];
    for (int i = 0; i < size; i++) bytes[i] = (char)(bits >> 8 * i);
    put(o, bytes, (size_t)size);
}

static void put_value(output *o, double value, qw_storage storage)
{
    const ply_type *t = &types[storage];
    uint64_t bits = 0;
    float single = (float)value;
    uint32_t half;
    if (storage == QW_FLOAT32) memcpy(&half, &single, sizeof half), bits = half;
    else if (storage == QW_FLOAT64) memcpy(&bits, &value, sizeof bits);
    else bits = (uint64_t)(int64_t)whole(fmin(fmax(value, t->least), t->most));
    put_bits(o, bits, t->size);
}

static qw_storage storage_of(const qw_attribute *a)
{
    qw_storage s = (unsigned)a->storage > QW_UINT32 ? QW_FLOAT32 : a->storage;
    return a->kind == QW_LABELS && s <= QW_FLOAT64 ? QW_INT32 : s;
}

/* "red", "nx", the name itself, or the name and a number. */
static void property_name(const qw_attribute *a, uint32_t k, char *name, size_t size)
{
    static const char *const colours[] = {"red", "green", "blue", "alpha"}, *const normals[] = {"nx", "ny", "nz"};
    if (strcmp(a->name, "color") == 0 && k < 4) snprintf(name, size, "%s", colours[k]);
    else if (a->kind == QW_NORMALS) snprintf(name, size, "%s", normals[k]);
    else if (a->components == 1) snprintf(name, size, "%.200s", a->name);
    else snprintf(name, size, "%.200s_%u", a->name, k);
    for (char *c = name; *c; c++)
        if ((unsigned char)*c <= ' ') *c = '_';
}

static bool is_ply_property(const qw_attribute *a, qw_domain domain)
{
    return a->domain == domain && a->kind != QW_WEIGHTS && a->kind != QW_UVS;
}

static void put_properties(output *o, qw_domain domain)
{
    for (uint32_t i = 0; i < o->count; i++)
        for (uint32_t k = 0; k < o->attributes[i].components && is_ply_property(&o->attributes[i], domain); k++) {
            char name[256], line[320];
            property_name(&o->attributes[i], k, name, sizeof name);
            snprintf(line, sizeof line, "property %s %s\n", types[storage_of(&o->attributes[i])].name, name);
            put_text(o, line);
        }
}

static void put_values(output *o, qw_domain domain, size_t element)
{
    for (uint32_t i = 0; i < o->count; i++) {
        const qw_attribute *a = &o->attributes[i];
        double factor = strcmp(a->name, "color") == 0 && a->storage == QW_UINT8 ? 255 : 1;
        for (uint32_t k = 0; k < a->components && is_ply_property(a, domain); k++)
            put_value(
                o, a->kind == QW_LABELS ? a->labels[element] : factor * (double)a->values[element * a->components + k],
                storage_of(a));
    }
}

/* Writes the mesh with its colours, normals and texture coordinates as binary PLY. */
static void put_ply(output *o)
{
    const qw_mesh_view *m = o->mesh;
    const qw_attribute *uv = find(o, NULL, QW_PER_CORNER, QW_UVS);
    char line[LINE_SIZE];
    snprintf(line, sizeof line,
             "ply\nformat binary_little_endian 1.0\nelement vertex %" PRIu32
             "\nproperty double x\nproperty double y\nproperty double z\n",
             m->vertex_count);
    put_text(o, line);
    put_properties(o, QW_PER_VERTEX);
    snprintf(line, sizeof line, "element face %" PRIu32 "\nproperty list uchar int vertex_indices\n", m->face_count);
    put_text(o, line);
    put_properties(o, QW_PER_FACE);
    put_text(o, uv ? "property list uchar float texcoord\nend_header\n" : "end_header\n");
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        for (size_t k = 0; k < 3; k++) put_value(o, m->positions[3 * (size_t)v + k], QW_FLOAT64);
        put_values(o, QW_PER_VERTEX, v);
    }
    for (uint32_t i = 0; i < m->face_count; i++) {
        uint32_t f = face_at(o, i), size = o->begin[f + 1] - o->begin[f];
        put_bits(o, size, 1);
        for (uint32_t c = o->begin[f]; c < o->begin[f + 1]; c++) put_bits(o, m->corners[c], 4);
        put_values(o, QW_PER_FACE, f);
        if (uv) put_bits(o, 2 * size, 1);
        for (uint32_t c = o->begin[f]; uv && c < o->begin[f + 1]; c++) {
            size_t at = uv->components * (size_t)(uv->domain == QW_PER_VERTEX ? m->corners[c] : c);
            for (uint32_t k = 0; k < 2; k++) put_value(o, (double)uv->values[at + k], QW_FLOAT32);
        }
    }
}

/* ---- OFF */

/* Writes the mesh as OFF, with colours of vertices or faces where there are some. */
static void put_off(output *o)
{
    const qw_mesh_view *m = o->mesh;
    const qw_attribute *colour = find(o, "color", QW_PER_VERTEX, QW_VALUES),
                       *of_face = find(o, "color", QW_PER_FACE, QW_VALUES);
    char line[LINE_SIZE];
    if (colour && colour->components < 3) colour = NULL;
    snprintf(line, sizeof line, "%sOFF\n%" PRIu32 " %" PRIu32 " 0\n", colour ? "C" : "", m->vertex_count,
             m->face_count);
    put_text(o, line);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        for (size_t k = 0; k < 3; k++) {
            if (k) put_text(o, " ");
            put_number(o, m->positions[3 * (size_t)v + k]);
        }
        for (uint32_t k = 0; colour && k < 4; k++)
            put_short(o, k < colour->components ? colour->values[(size_t)colour->components * v + k] : 1);
        put_text(o, "\n");
    }
    for (uint32_t i = 0; i < m->face_count; i++) {
        uint32_t f = face_at(o, i);
        put_whole(o, o->begin[f + 1] - o->begin[f]);
        for (uint32_t c = o->begin[f]; c < o->begin[f + 1]; c++) put_text(o, " "), put_whole(o, m->corners[c]);
        for (uint32_t k = 0; of_face && of_face->components >= 3 && k < of_face->components && k < 4; k++)
            put_short(o, of_face->values[(size_t)of_face->components * f + k]);
        put_text(o, "\n");
    }
}

void qw_put_with(qw_env *env, qw_file *file, qw_format format, const qw_mesh_view *mesh, const qw_attribute *attributes,
                 uint32_t count, const char *library)
{
    uint32_t *begin = QW_NEW(env, uint32_t, mesh->face_count + (size_t)1);
    begin[0] = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) begin[f + 1] = begin[f] + qw_view_face_size(mesh, f);
    output o = {.env = env,
                .file = file,
                .mesh = mesh,
                .attributes = attributes,
                .count = count,
                .order = qw_order_faces(env, mesh->face_count, attributes, count),
                .begin = begin};
    if (format == QW_FORMAT_OBJ) put_obj(&o, library);
    if (format == QW_FORMAT_PLY) put_ply(&o);
    if (format == QW_FORMAT_OFF) put_off(&o);
}

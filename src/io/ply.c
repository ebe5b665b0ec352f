/* Stanford PLY: a header in text lists elements and their properties in order; then come their values, as text or
 * binary.
 *
 * Taken: x, y, z of element vertex; the list vertex_indices (or vertex_index) of element face; and of element
 * tristrips, whose triangles alternate in winding and start again after a -1; as attributes, every other number of
 * vertices and faces, and the lists texcoord of faces. All else is passed over. Elements and properties may come in any
 * order, so indices are checked against the count in the header.
 *
 * Text bodies have one element a line. Letting an element run on into the next line, as some readers do, would turn a
 * missing value into a shifted mesh.
 */
#include "io/build.h"
#include "io/fetch.h"
#include "io/formats.h"
#include "io/text.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>

typedef enum type { INT8, UINT8, INT16, UINT16, INT32, UINT32, FLOAT32, FLOAT64, NO_TYPE } type;

static const uint8_t type_size[] = {1, 1, 2, 2, 4, 4, 4, 8};

typedef enum kind { OTHER, VERTEX, FACE, STRIPS } kind;

enum { AXIS_X, AXIS_Y, AXIS_Z, INDICES, UNUSED, CARRIED, TEXTURE }; /* what a property is for */

typedef struct property {
    type count_type; /* NO_TYPE: not a list */
    type value_type;
    int use;
    qw_quote name;
    /* CARRIED: a value of each element that is kept; TEXTURE: two of each corner */
    float *value;
    size_t capacity;
    bool is_broken; /* there is a value that is not finite or a list of another length: it is left out */
} property;

typedef struct element {
    kind kind;
    int64_t count;
    size_t first_property, property_count;
    qw_quote name;
} element;

typedef struct ply {
    qw_env *env;
    const char *name;
    qw_text text; /* the header, and the body if it is text */
    bool has_format, binary, big;
    bool points;       /* wanted: faces are not */
    const char *begin; /* of the file */
    element *elements;
    property *properties; /* of all elements */
    size_t element_count, element_capacity, property_count, property_capacity;
    int64_t vertex_count, index_elements; /* as the header announces; elements that list faces */
    /* where the body is being read */
    const element *element;
    int64_t index;
    size_t dropped; /* faces of this element */
    bool face_was_dropped;
    qw_builder build;
} ply;

/* ---- header */

/* The type that a word of the header names. */
static type find_type(qw_word word)
{
    static const struct {
        const char *name;
        type type;
    } types[] = {{"char", INT8},   {"uchar", UINT8},   {"short", INT16},     {"ushort", UINT16},
                 {"int", INT32},   {"uint", UINT32},   {"float", FLOAT32},   {"double", FLOAT64},
                 {"int8", INT8},   {"uint8", UINT8},   {"int16", INT16},     {"uint16", UINT16},
                 {"int32", INT32}, {"uint32", UINT32}, {"float32", FLOAT32}, {"float64", FLOAT64}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (qw_word_is(word, types[i].name)) return types[i].type;
    return NO_TYPE;
}

static type read_type(qw_text *t)
{
    qw_text before = *t;
    type found = find_type(qw_text_word(t));
    if (found == NO_TYPE) qw_text_expected(&before, "a type");
    return found;
}

/* The line "format": text or binary, and the order of bytes. */
static void read_format(ply *p)
{
    qw_text *t = &p->text, before;
    qw_text_blanks(t);
    before = *t;
    qw_word word = qw_text_word(t);
    p->binary = !qw_word_is(word, "ascii");
    p->big = qw_word_is(word, "binary_big_endian");
    if (p->binary && !p->big && !qw_word_is(word, "binary_little_endian"))
        qw_text_expected(&before, "ascii, binary_little_endian or binary_big_endian");
    p->has_format = true;
}

/* A line "element": its name and count; vertices and faces are counted. */
static void read_element(ply *p)
{
    qw_text *t = &p->text;
    if (qw_text_line_ends(t)) qw_text_expected(t, "the name of an element");
    qw_word name = qw_text_word(t);
    element e = {.name = qw_quote_word(name), .first_property = p->property_count};
    e.count = qw_text_integer(t, "the number of elements");
    if (e.count < 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the number of elements is negative");
    if (qw_word_is(name, "vertex")) {
        e.kind = VERTEX;
        qw_build_check_count(p->env, p->name, (uint64_t)e.count, "vertices");
        if (p->vertex_count >= 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "there is a second element vertex");
        p->vertex_count = e.count;
    } else if (qw_word_is(name, "face") || qw_word_is(name, "tristrips")) {
        e.kind = *name.at == 'f' ? FACE : STRIPS;
        qw_build_check_count(p->env, p->name, (uint64_t)e.count, e.kind == FACE ? "faces" : "strips");
        p->index_elements++;
    }
    p->elements = qw_grow(p->env, p->elements, &p->element_capacity, p->element_count + 1, sizeof(element));
    p->elements[p->element_count++] = e;
}

static bool has_use(const ply *p, const element *e, int use)
{
    for (size_t i = 0; i < e->property_count; i++)
        if (p->properties[e->first_property + i].use == use) return true;
    return false;
}

/* Reads a line of the header that declares a property of the last element. */
static void read_property(ply *p)
{
    qw_text *t = &p->text, before = *t;
    if (p->element_count == 0) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "a property belongs to no element");
    element *e = &p->elements[p->element_count - 1];
    property q = {.count_type = NO_TYPE, .use = UNUSED};
    if (qw_word_is(qw_text_word(t), "list")) {
        q.count_type = read_type(t);
        if (q.count_type >= FLOAT32)
            qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the length of a list is not of a whole type");
    } else {
        *t = before;
    }
    q.value_type = read_type(t);
    if (qw_text_line_ends(t)) qw_text_expected(t, "the name of a property");
    qw_word name = qw_text_word(t);
    q.name = qw_quote_word(name);
    if (e->kind == VERTEX && q.count_type == NO_TYPE && name.size == 1 && *name.at >= 'x' && *name.at <= 'z')
        q.use = AXIS_X + (*name.at - 'x');
    bool indices = qw_word_is(name, "vertex_indices") || qw_word_is(name, "vertex_index");
    if ((e->kind == FACE || e->kind == STRIPS) && q.count_type != NO_TYPE && indices) q.use = INDICES;
    if (q.use == UNUSED && q.count_type == NO_TYPE && (e->kind == VERTEX || e->kind == FACE)) q.use = CARRIED;
    if (q.use == UNUSED && e->kind == FACE && qw_word_is(name, "texcoord")) q.use = TEXTURE;
    if (q.use < UNUSED && has_use(p, e, q.use))
        qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "there is a second property %s", q.name.text);
    p->properties = qw_grow(p->env, p->properties, &p->property_capacity, p->property_count + 1, sizeof(property));
    p->properties[p->property_count++] = q;
    e->property_count++;
}

/* Ends at the first byte of the body. */
static void read_header(ply *p)
{
    qw_text *t = &p->text;
    for (qw_text_next_line(t);; qw_text_next_line(t)) {
        if (!qw_text_find_line(t)) qw_text_fail(t, QW_FORMAT_TRUNCATED, -1, "the file ends in its header");
        qw_text before = *t;
        qw_word word = qw_text_word(t);
        if (qw_word_is(word, "comment") || qw_word_is(word, "obj_info")) continue;
        if (qw_word_is(word, "Created"))
            continue; /* "Created by Blender3D", which Blender 2.4 wrote without "comment" */
        if (qw_word_is(word, "end_header")) break;
        if (qw_word_is(word, "format")) read_format(p);
        else if (qw_word_is(word, "element")) read_element(p);
        else if (qw_word_is(word, "property")) read_property(p);
        else qw_text_expected(&before, "comment, obj_info, format, element, property or end_header");
    }
    if (!p->has_format) qw_text_fail(t, QW_FORMAT_SYNTAX, -1, "the header has no line \"format\"");
    if (!qw_text_line_ends(t)) qw_text_expected(t, "the end of the header");
    qw_text_next_line(t);
}

/* Fails where the header lacks vertices, faces, coordinates or lists of indices. */
static void check_header(const ply *p)
{
    static const char axes[] = "xyz";
    if (p->vertex_count < 0) qw_text_fail(&p->text, QW_FORMAT_SYNTAX, -1, "the header has no element vertex");
    if (p->index_elements == 0 && !p->points)
        qw_text_fail(&p->text, QW_NO_FACES, -1, "the header has no element face (or tristrips): these are only points");
    for (const element *e = p->elements; e < p->elements + p->element_count; e++) {
        for (int i = 0; i < 3; i++)
            if (e->kind == VERTEX && !has_use(p, e, AXIS_X + i))
                qw_text_fail(&p->text, QW_FORMAT_SYNTAX, -1, "element vertex has no property %c", axes[i]);
        if ((e->kind == FACE || e->kind == STRIPS) && !has_use(p, e, INDICES))
            qw_text_fail(&p->text, QW_FORMAT_SYNTAX, -1, "element %s has no list vertex_indices", e->name.text);
    }
}

/* ---- body */

/* "PATH, line 12, face 3: " or "PATH, byte 345, face 3: ". */
static _Noreturn void fail_in_body(const ply *p, qw_status status, const char *what)
{
    const char *of = p->element->name.text;
    if (!p->binary) qw_text_fail(&p->text, status, p->index, "%s %" PRId64 ": %s", of, p->index, what);
    qw_fail(p->env, status, p->index, "%s, byte %zu: %s %" PRId64 ": %s", p->name, (size_t)(p->text.at - p->begin), of,
            p->index, what);
}

/* The next number of the body, of a property of that type. */
static double next_value(ply *p, const property *q, type value_type)
{
    qw_text *t = &p->text;
    if (!p->binary) return qw_text_number(t, q->name.text);
    int size = type_size[value_type];
    if (t->end - t->at < size) fail_in_body(p, QW_FORMAT_TRUNCATED, "the file ends here");
    const char *at = t->at;
    t->at += size;
    if (value_type == FLOAT32) return qw_fetch_float(at, p->big);
    uint64_t bits = qw_fetch_bits(at, size, p->big);
    switch (value_type) {
    case INT8: return (int8_t)bits;
    case INT16: return (int16_t)bits;
    case INT32: return (int32_t)bits;
    case FLOAT64: {
        double value;
        memcpy(&value, &bits, sizeof value);
        return value;
    }
    default: return (double)bits;
    }
}

static uint32_t check_index(const ply *p, double value)
{
    if (value >= 0 && value < (double)p->vertex_count && value == (double)(uint32_t)value) return (uint32_t)value;
    char text[96];
    if (value - value != 0 || (value > -1e15 && value < 1e15 && value != (double)(int64_t)value))
        fail_in_body(p, QW_FORMAT_SYNTAX, "an index of a vertex is not a whole number");
    snprintf(text, sizeof text, "names vertex %.0f, but there are only %" PRId64 ", counted from 0", value,
             p->vertex_count);
    fail_in_body(p, QW_INDEX_RANGE, text);
}

static int64_t read_length(ply *p, const property *q)
{
    double length = next_value(p, q, q->count_type);
    size_t left = (size_t)(p->text.end - p->text.at);
    if (!(length >= 0 && length == (double)(uint64_t)(length < 1e15 ? length : 0)))
        fail_in_body(p, QW_FORMAT_SYNTAX, "the length of a list is not a count");
    double least = length * (p->binary ? type_size[q->value_type] : 2); /* a blank and a digit */
    if (least > (double)left) fail_in_body(p, QW_FORMAT_TRUNCATED, "the file ends in a list");
    return (int64_t)length;
}

static void read_face_list(ply *p, const property *q)
{
    int64_t length = read_length(p, q);
    for (int64_t i = 0; i < length; i++) qw_build_corner(&p->build, check_index(p, next_value(p, q, q->value_type)));
    qw_build_face(&p->build);
}

/* The triangles of a list of strips; -1 ends one. */
static void read_strips(ply *p, const property *q)
{
    int64_t length = read_length(p, q);
    uint32_t last[2] = {0, 0};
    for (int64_t i = 0, run = 0; i < length; i++) {
        double value = next_value(p, q, q->value_type);
        if (value == -1.0) {
            run = 0;
            continue;
        }
        uint32_t vertex = check_index(p, value);
        if (run++ >= 2) {
            bool odd = (run & 1) == 0; /* the triangle i, i+1, i+2 of a strip is turned for odd i */
            qw_build_corner(&p->build, last[odd]);
            qw_build_corner(&p->build, last[!odd]);
            qw_build_corner(&p->build, vertex);
            qw_build_face(&p->build);
        }
        last[0] = last[1];
        last[1] = vertex;
    }
}

/* Where face_count is still what it was, the face was dropped, and the next one takes its place. */
static void carry_value(ply *p, property *q, double value)
{
    const qw_soup *s = &p->build.soup;
    size_t at = p->element->kind == VERTEX ? s->vertex_count : (size_t)p->index - p->dropped;
    if (!isfinite((float)value)) q->is_broken = true;
    if (q->is_broken) return;
    if (at >= q->capacity) q->value = qw_grow(p->env, q->value, &q->capacity, at + 1, sizeof *q->value);
    q->value[at] = (float)value;
}

/* Texture coordinates of the corners of the face that was read last; a list of another length breaks the property. */
static void read_texture(ply *p, property *q)
{
    const qw_soup *s = &p->build.soup;
    int64_t length = read_length(p, q);
    bool corners_first = p->build.corner_count == s->face_begin[s->face_count];
    size_t size = corners_first && s->face_count ? s->face_begin[s->face_count] - s->face_begin[s->face_count - 1] : 0,
           at = corners_first && s->face_count ? 2 * (size_t)s->face_begin[s->face_count - 1] : 0;
    if (length != (int64_t)(2 * size) || p->face_was_dropped) q->is_broken |= length != 0 || !p->face_was_dropped;
    for (int64_t i = 0; i < length; i++) {
        double value = next_value(p, q, q->value_type);
        if (!isfinite((float)value)) q->is_broken = true;
        if (q->is_broken) continue;
        if (at + (size_t)i >= q->capacity)
            q->value = qw_grow(p->env, q->value, &q->capacity, at + (size_t)i + 1, sizeof *q->value);
        q->value[at + (size_t)i] = (float)value;
    }
}

/* Reads one item of the current element, and takes from it the vertex, face or edge that it is. */
static void read_item(ply *p)
{
    uint32_t faces = p->build.soup.face_count;
    p->face_was_dropped = false;
    double position[3] = {0, 0, 0};
    const element *e = p->element;
    property *end = p->properties + e->first_property + e->property_count;
    for (property *q = end - e->property_count; q < end; q++) {
        if (q->use < INDICES) {
            position[q->use - AXIS_X] = next_value(p, q, q->value_type);
        } else if (q->use == INDICES) {
            if (e->kind == FACE) read_face_list(p, q);
            else read_strips(p, q);
            p->face_was_dropped = e->kind == FACE && p->build.soup.face_count == faces;
        } else if (q->use == CARRIED) {
            carry_value(p, q, next_value(p, q, q->value_type));
        } else if (q->use == TEXTURE) {
            read_texture(p, q);
        } else {
            int64_t length = q->count_type == NO_TYPE ? 1 : read_length(p, q);
            if (p->binary && q->count_type != NO_TYPE)
                p->text.at += length * type_size[q->value_type]; /* read_length made sure of it */
            else
                for (int64_t i = 0; i < length; i++) next_value(p, q, q->value_type);
        }
    }
    p->dropped += p->face_was_dropped;
    if (e->kind != VERTEX) return;
    if (!qw_is_finite3(position)) fail_in_body(p, QW_NOT_FINITE, "a coordinate is NaN or infinite");
    qw_build_vertex(&p->build, position);
}

/* The least that one takes in the file: a byte of digits and one of blank a value, or the size of its types. */
static uint64_t least_bytes(const ply *p, const element *e)
{
    uint64_t bytes = 0;
    for (size_t i = 0; i < e->property_count; i++) {
        const property *q = &p->properties[e->first_property + i];
        bytes += !p->binary ? 2 : type_size[q->count_type != NO_TYPE ? q->count_type : q->value_type];
    }
    return bytes;
}

/* Before anything is allocated: what the header announces must fit what is left of the file. */
static void check_room(const ply *p)
{
    uint64_t left = (uint64_t)(p->text.end - p->text.at) + !p->binary; /* the last newline may be missing */
    for (const element *e = p->elements; e < p->elements + p->element_count; e++) {
        uint64_t each = least_bytes(p, e);
        if (each > 0 && (uint64_t)e->count > left / each)
            qw_text_fail(&p->text, QW_FORMAT_TRUNCATED, -1,
                         "the header announces %" PRId64 " elements %s, more than the rest of the file can hold",
                         e->count, e->name.text);
        left -= each * (uint64_t)e->count;
    }
}

/* Whether the binary values of an item are those that most files have: x, y and z as floats, or one list of 32-bit
   indices. */
static bool is_plain(const ply *p, const element *e)
{
    const property *q = p->properties + e->first_property;
    if (!p->binary || p->big) return false;
    if (e->kind == FACE)
        return e->property_count == 1 && type_size[q->count_type] == 1 &&
               (q->value_type == INT32 || q->value_type == UINT32);
    if (e->kind != VERTEX || e->property_count != 3) return false;
    for (int i = 0; i < 3; i++)
        if (q[i].use != AXIS_X + i || q[i].count_type != NO_TYPE || q[i].value_type != FLOAT32) return false;
    return true;
}

/* Reads plain vertices from here on, up to the last or to one that cannot be. */
static void read_plain_vertices(ply *p)
{
    enum { BYTES = 12 };
    qw_text *t = &p->text;
    for (; p->index < p->element->count && t->end - t->at >= BYTES; p->index++, t->at += BYTES) {
        double position[3];
        for (int i = 0; i < 3; i++) position[i] = qw_fetch_float(t->at + 4 * i, false);
        if (!qw_is_finite3(position)) return;
        qw_build_vertex(&p->build, position);
    }
}

/* Likewise triangles. */
static void read_plain_triangles(ply *p)
{
    enum { BYTES = 13 };
    qw_text *t = &p->text;
    uint32_t corner[3];
    for (; p->index < p->element->count && t->end - t->at >= BYTES && *t->at == 3; p->index++, t->at += BYTES) {
        for (int i = 0; i < 3; i++) {
            corner[i] = (uint32_t)qw_fetch_bits(t->at + 1 + 4 * i, 4, false);
            if (corner[i] >= p->vertex_count) return;
        }
        for (int i = 0; i < 3; i++) qw_build_corner(&p->build, corner[i]);
        qw_build_face(&p->build);
    }
}

static void read_plain(ply *p)
{
    if (p->element->kind == VERTEX) read_plain_vertices(p);
    else read_plain_triangles(p);
}

/* Reads the items of all elements in their order. */
static void read_body(ply *p)
{
    for (p->element = p->elements; p->element < p->elements + p->element_count; p->element++) {
        int64_t count = p->element->property_count ? p->element->count
                                                   : 0; /* those without properties leave no trace */
        p->dropped = 0;
        bool plain = count > 0 && is_plain(p, p->element);
        for (p->index = 0; p->index < count; p->index++) {
            if (plain) read_plain(p);
            if (p->index == count) break;
            if (p->binary) {
                read_item(p);
                continue;
            }
            if (!qw_text_find_line(&p->text)) fail_in_body(p, QW_FORMAT_TRUNCATED, "the file ends before it");
            read_item(p);
            if (!qw_text_line_ends(&p->text)) qw_text_expected(&p->text, "the end of the line");
            qw_text_next_line(&p->text);
        }
    }
}

/* ---- attributes */

typedef struct known_set {
    const char *name, *of[4]; /* of: the properties, of which the last may be missing */
    qw_attribute_kind kind;
    uint32_t least;
} known_set;

static const known_set sets[] = {{"color", {"red", "green", "blue", "alpha"}, QW_VALUES, 3},
                                 {"color", {"diffuse_red", "diffuse_green", "diffuse_blue", NULL}, QW_VALUES, 3},
                                 {"normal", {"nx", "ny", "nz", NULL}, QW_NORMALS, 3},
                                 {"uv", {"s", "t", NULL, NULL}, QW_UVS, 2},
                                 {"uv", {"u", "v", NULL, NULL}, QW_UVS, 2},
                                 {"uv", {"texture_u", "texture_v", NULL, NULL}, QW_UVS, 2}};

static qw_storage storage_of(type t)
{
    static const qw_storage of[] = {QW_INT8,  QW_UINT8,  QW_INT16,   QW_UINT16,
                                    QW_INT32, QW_UINT32, QW_FLOAT32, QW_FLOAT64};
    return of[t];
}

static property *carried_named(const ply *p, const element *e, const char *name)
{
    for (size_t i = 0; i < e->property_count && name; i++) {
        property *q = &p->properties[e->first_property + i];
        if (q->use == CARRIED && !q->is_broken && strcmp(q->name.text, name) == 0) return q;
    }
    return NULL;
}

/* The attribute of those properties, which are used up. */
static void add_attribute(ply *p, qw_soup *s, const element *e, const char *name, qw_attribute_kind meant,
                          property *const *q, uint32_t n)
{
    qw_attribute *a = qw_build_attribute(p->env, s, name, e->kind == VERTEX ? QW_PER_VERTEX : QW_PER_FACE, meant, n);
    bool is_byte = q[0]->value_type == UINT8 && strcmp(name, "color") == 0;
    a->storage = storage_of(q[0]->value_type);
    int32_t *label = meant == QW_LABELS ? QW_NEW(p->env, int32_t, a->count) : NULL;
    float *value = label ? NULL : QW_NEW(p->env, float, (size_t)n * a->count);
    for (size_t i = 0; i < a->count; i++)
        for (uint32_t k = 0; k < n; k++) {
            float v = q[k]->value[i];
            if (label) label[i] = v >= 2147483648.0f ? INT32_MAX : (int32_t)v;
            else value[i * n + k] = is_byte ? v / 255 : v;
        }
    a->labels = label, a->values = value;
    for (uint32_t k = 0; k < n; k++) {
        qw_free(p->env, q[k]->value);
        q[k]->use = UNUSED, q[k]->value = NULL;
    }
}

static void add_sets(ply *p, qw_soup *s, const element *e)
{
    for (size_t i = 0; i < sizeof sets / sizeof *sets; i++) {
        property *of[4];
        uint32_t n = 0;
        while (n < 4 && (of[n] = carried_named(p, e, sets[i].of[n])) != NULL) n++;
        if (n < sets[i].least || (e->kind == FACE && sets[i].kind != QW_VALUES)) continue;
        add_attribute(p, s, e, sets[i].name, sets[i].kind, of, n);
    }
}

/* Makes attributes of all properties of vertices and faces that were read whole. */
static void add_attributes(ply *p, qw_soup *s)
{
    for (const element *e = p->elements; e < p->elements + p->element_count; e++) {
        bool whole = e->kind == VERTEX || (e->kind == FACE && p->index_elements == 1);
        if (!whole || e->count == 0) continue;
        add_sets(p, s, e);
        for (size_t i = 0; i < e->property_count; i++) {
            property *q = &p->properties[e->first_property + i];
            if (q->use == CARRIED && !q->is_broken)
                add_attribute(p, s, e, q->name.text, q->value_type < FLOAT32 ? QW_LABELS : QW_VALUES, &q, 1);
            if (q->use != TEXTURE || q->is_broken || q->capacity < 2 * (size_t)s->face_begin[s->face_count]) continue;
            qw_attribute *a = qw_build_attribute(p->env, s, "uv", QW_PER_CORNER, QW_UVS, 2);
            a->values = q->value;
        }
    }
}

/* A PLY file as a surface, or as points. */
static qw_soup read_ply(qw_env *env, const char *name, qw_bytes bytes, bool points)
{
    ply p = {.env = env, .name = name, .begin = bytes.at, .vertex_count = -1, .points = points};
    p.text = qw_text_open(env, name, bytes, 0);
    read_header(&p);
    check_header(&p);
    check_room(&p);
    size_t faces = 0;
    for (size_t i = 0; i < p.element_count; i++)
        if (p.elements[i].kind == FACE) faces += (size_t)p.elements[i].count;
    if (points && faces > 0)
        qw_fail(env, QW_FORMAT_UNKNOWN, -1, "%s: the file has faces: it is no file of points", name);
    p.build = qw_build_begin(env, name, (size_t)p.vertex_count, faces, 3 * faces);
    read_body(&p);
    if (p.binary ? p.text.at < p.text.end : qw_text_find_line(&p.text))
        qw_build_warn_rest(&p.build, (size_t)(p.text.end - p.text.at));
    qw_soup soup = points ? qw_build_finish_points(&p.build) : qw_build_finish(&p.build);
    add_attributes(&p, &soup);
    return soup;
}

qw_soup qw_read_ply(qw_env *env, const char *name, qw_bytes bytes) { return read_ply(env, name, bytes, false); }
qw_soup qw_read_ply_points(qw_env *env, const char *name, qw_bytes bytes) { return read_ply(env, name, bytes, true); }

bool qw_is_ply(qw_bytes bytes)
{
    const char *p = bytes.at;
    if (strncmp(p, "\xef\xbb\xbf", 3) == 0) p += 3;
    return strncmp(p, "ply", 3) == 0 && (p[3] == '\n' || p[3] == '\r' || p[3] == ' ' || p[3] == '\t');
}

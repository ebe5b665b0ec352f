/* Meshes to GLB and glTF. Each object is a mesh of its own, in the coordinates of its node, with a primitive a
 * material.
 *
 * A vertex of glTF is a combination of a position and attributes: here one for each that the corners at a vertex have.
 * Polygons are fans of triangles that begin at one corner, and no two that follow one another at the same, so that they
 * can be told apart again (FB_ngon_encoding). */
#include "base/printable.h"
#include "base/view.h"
#include "io/gltf.h"
#include "io/number.h"
#include "io/pen.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum {
    HEADER = 12,
    CHUNK_HEADER = 8,
    ALIGNMENT = 4,
    MOST_SEMANTIC = 136,
    MOST_SHORT = 65535, /* vertices that 16 bits can name, as the last number is not allowed */
    SET = 4,            /* joints of one set */
    TYPE_UINT8 = 5121,
    TYPE_UINT16 = 5123,
    TYPE_UINT32 = 5125,
    TYPE_FLOAT32 = 5126,
    OF_VERTICES = 34962,
    OF_INDICES = 34963
};

/* An attribute as glTF has it. */
typedef struct stream {
    char semantic[MOST_SEMANTIC];
    const qw_attribute *of;
} stream;

typedef struct writer {
    qw_env *env;
    const qw_mesh_view *mesh;
    const qw_attribute *attributes;
    uint32_t count;
    const qw_gltf_rest *rest;                        /* NULL: none */
    const qw_attribute *object, *material, *weights; /* NULL: none */
    stream *stream;
    uint32_t streams;
    const uint32_t *order;     /* uint32_t[faces]: by object and material; NULL: as they are */
    uint32_t *begin;           /* uint32_t[faces + 1]: corners */
    uint32_t *copy;            /* uint32_t[corners]: vertex of its object's mesh */
    uint32_t *last;            /* uint32_t[vertices]: latest copy of each, plus 1; 0: none */
    uint32_t *before, *corner; /* of each copy: the one before of the same vertex, as in last; a corner that it is of */
    uint32_t copies, first_copy; /* of all objects so far; of this one */
    float centre[3];             /* translation of the nodes of our own; 0 0 0: none */
    qw_pen meshes, views, accessors, bytes;
    uint32_t view_count, accessor_count, mesh_count;
} writer;

static uint32_t face_at(const writer *w, uint32_t i) { return w->order ? w->order[i] : i; }

/* ---- what is written of the attributes */

static const qw_attribute *find_labels(const writer *w, const char *name)
{
    for (uint32_t i = 0; i < w->count; i++)
        if (w->attributes[i].kind == QW_LABELS && w->attributes[i].domain == QW_PER_FACE &&
            strcmp(w->attributes[i].name, name) == 0)
            return &w->attributes[i];
    return NULL;
}

static const char *type_of(uint32_t components)
{
    static const char *const types[] = {
        [1] = "SCALAR", [2] = "VEC2", [3] = "VEC3", [4] = "VEC4", [9] = "MAT3", [16] = "MAT4"};
    return components < sizeof types / sizeof *types ? types[components] : NULL;
}

/* Behind a first part, as of "uv1"; 0 for the part alone; -1: it has another. */
static int number_behind(const char *name, const char *first)
{
    size_t size = strlen(first);
    if (strncmp(name, first, size) != 0) return -1;
    if (!name[size]) return 0;
    const char *c = name + size;
    int number = 0;
    for (; *c >= '0' && *c <= '9' && number < 100; c++) number = 10 * number + *c - '0';
    return *c || number == 0 ? -1 : number;
}

static bool is_target(const qw_attribute *a)
{
    return a->kind == QW_VALUES && a->domain == QW_PER_VERTEX && a->components == 3 &&
           strncmp(a->name, "target:", 7) == 0;
}

/* False where glTF has no place for it. */
static bool name_stream(const writer *w, const qw_attribute *a, stream *s)
{
    if (a->domain == QW_PER_FACE || is_target(a)) return false;
    int set = -1;
    s->of = a;
    if (a->kind == QW_NORMALS) {
        snprintf(s->semantic, sizeof s->semantic, "NORMAL");
    } else if (a->kind == QW_UVS) {
        set = number_behind(a->name, "uv");
        snprintf(s->semantic, sizeof s->semantic, "TEXCOORD_%d", set < 0 ? 0 : set);
    } else if (a->kind == QW_VALUES && (set = number_behind(a->name, "color")) >= 0 &&
               (a->components == 3 || a->components == 4)) {
        snprintf(s->semantic, sizeof s->semantic, "COLOR_%d", set);
    } else if (a->kind == QW_VALUES && a->components == 4 && strcmp(a->name, "tangent") == 0) {
        snprintf(s->semantic, sizeof s->semantic, "TANGENT");
    } else if (a->kind == QW_VALUES && type_of(a->components)) {
        snprintf(s->semantic, sizeof s->semantic, "_%.120s", a->name[0] == '_' ? a->name + 1 : a->name);
    } else {
        return false;
    }
    for (uint32_t i = 0; i < w->streams; i++)
        if (strcmp(w->stream[i].semantic, s->semantic) == 0) return false;
    return true;
}

static void find_streams(writer *w)
{
    w->stream = QW_NEW(w->env, stream, w->count);
    for (uint32_t i = 0; i < w->count; i++) {
        if (w->attributes[i].kind == QW_WEIGHTS && w->rest) w->weights = &w->attributes[i];
        if (name_stream(w, &w->attributes[i], &w->stream[w->streams])) w->streams++;
    }
}

/* ---- copies of vertices */

static bool is_same_copy(const writer *w, uint32_t c, uint32_t d)
{
    for (uint32_t i = 0; i < w->streams; i++) {
        const qw_attribute *a = w->stream[i].of;
        if (a->domain == QW_PER_CORNER &&
            memcmp(a->values + (size_t)a->components * c, a->values + (size_t)a->components * d,
                   a->components * sizeof *a->values))
            return false;
    }
    return true;
}

static void take_corner(writer *w, uint32_t c)
{
    uint32_t v = w->mesh->corners[c], known = w->last[v];
    while (known > w->first_copy && !is_same_copy(w, w->corner[known - 1], c)) known = w->before[known - 1];
    if (known <= w->first_copy) {
        w->before[w->copies] = w->last[v], w->corner[w->copies] = c;
        known = w->last[v] = ++w->copies;
    }
    w->copy[c] = known - 1 - w->first_copy;
}

/* ---- the buffer */

static void begin_view(writer *w) { qw_pen_align(&w->bytes, ALIGNMENT, 0); }

static void end_view(writer *w, size_t begin, int target)
{
    qw_pen_print(&w->views, "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d},", begin,
                 w->bytes.size - begin, target);
    w->view_count++;
}

static void put_bits(qw_pen *pen, uint32_t bits, int size)
{
    char *at = qw_pen_room(pen, (size_t)size);
    for (int i = 0; i < size; i++) at[i] = (char)(bits >> 8 * i);
}

static void put_float(qw_pen *pen, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    put_bits(pen, bits, 4);
}

/* Describes the view that was written last; a comma follows. Returns its number. */
static uint32_t put_accessor(writer *w, int type, size_t count, const char *kind, const char *more)
{
    qw_pen_print(&w->accessors, "{\"bufferView\":%u,\"componentType\":%d,\"count\":%zu,\"type\":\"%s\"",
                 w->view_count - 1, type, count, kind);
    qw_pen_text(&w->accessors, more);
    qw_pen_text(&w->accessors, "},");
    return w->accessor_count++;
}

/* ---- coordinates */

/* Coordinates are written in single precision. Of a mesh that lies farther from the origin than it is large, they would
 * lose digits by the distance, until vertices coincide: a translation of its nodes takes that distance. It is the same
 * for all nodes, so that what they share stays together, and is itself in single precision, as readers may hold it so.
 */
static void find_centre(writer *w)
{
    const qw_mesh_view *m = w->mesh;
    double least[3], most[3], away = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        least[k] = INFINITY, most[k] = -INFINITY;
        for (size_t v = 0; v < m->vertex_count; v++) {
            double x = m->positions[3 * v + (size_t)k];
            least[k] = fmin(least[k], x), most[k] = fmax(most[k], x);
        }
        size = fmax(size, most[k] - least[k]), away = fmax(away, fmax(least[k], -most[k]));
    }
    if (w->rest || !(away > size)) return;
    for (int k = 0; k < 3; k++) w->centre[k] = (float)(least[k] / 2 + most[k] / 2);
    if (!isfinite(w->centre[0] + w->centre[1] + w->centre[2])) memset(w->centre, 0, sizeof w->centre);
}

/* double[3][4]: from the coordinates of the mesh to those of the object's node. own: room for it. */
static const double *map_of(const writer *w, const qw_gltf_object *o, double own[12])
{
    if (o) return o->to_local;
    for (int i = 0; i < 12; i++) own[i] = i % 5 == 0 ? 1 : i % 4 == 3 ? 0.0 - (double)w->centre[i / 4] : 0;
    return own;
}

/* In the coordinates of the object's node, as it is written. */
static void place(const double *map, const double *p, float out[3])
{
    for (int r = 0; r < 3; r++) {
        double sum = map[4 * r + 3];
        for (int k = 0; k < 3; k++) sum += map[4 * r + k] * p[k];
        out[r] = (float)sum;
    }
}

/* ---- no face is degenerate in what is written */

/* Bound of the rounding error of a cross product of two differences, as a share of the squared longer one. */
static const double CERTAIN = 16 * DBL_EPSILON;

/* Whether three points lie on one line, or at one place. */
static bool is_flat(const double a[3], const double b[3], const double c[3])
{
    double n2 = 0, u2 = 0, v2 = 0;
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        double n = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
        n2 += n * n, u2 += (b[k] - a[k]) * (b[k] - a[k]), v2 += (c[k] - a[k]) * (c[k] - a[k]);
    }
    return !(n2 > CERTAIN * CERTAIN * fmax(u2, v2) * fmax(u2, v2));
}

static bool is_same(const double a[3], const double b[3]) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

static void round_place(const double *map, const double *p, double out[3])
{
    float single[3];
    place(map, p, single);
    for (int k = 0; k < 3; k++) out[k] = (double)single[k];
}

/* Fails where corners of a face would fall together in single precision, or all of it on one line. */
static void require_area(const writer *w, const double *map, uint32_t f)
{
    const uint32_t *corner = w->mesh->corners + w->begin[f];
    uint32_t n = w->begin[f + 1] - w->begin[f];
    double at[3][3]; /* of the first corner, and of two that follow one another */
    bool had_area = false, has_area = false, falls = false;
    const double *p[3] = {w->mesh->positions + 3 * (size_t)corner[0]};
    round_place(map, p[0], at[0]);
    for (uint32_t i = 1; i < n; i++) {
        p[1] = w->mesh->positions + 3 * (size_t)corner[i];
        p[2] = w->mesh->positions + 3 * (size_t)corner[i + 1 < n ? i + 1 : 0];
        for (int k = 1; k < 3; k++) round_place(map, p[k], at[k]);
        for (int k = 0; k < 2; k++) falls |= is_same(at[k], at[k + 1]) && !is_same(p[k], p[k + 1]);
        falls |= is_same(at[0], at[2]) && !is_same(p[0], p[2]);
        had_area |= !is_flat(p[0], p[1], p[2]), has_area |= !is_flat(at[0], at[1], at[2]);
    }
    if (falls || (had_area && !has_area))
        qw_fail(
            w->env, QW_FILE_UNWRITABLE, f,
            "face %u would have no area, or corners at one place, in the 32-bit numbers of glTF, at (%g, %g, %g) in "
            "its node: OBJ and PLY hold 64 bits",
            f, at[0][0], at[0][1], at[0][2]);
}

typedef struct bounds {
    float least[3], most[3];
} bounds;

static void put_bounds(char *text, size_t size, const bounds *b)
{
    size_t at = 0;
    for (int which = 0; which < 2; which++) {
        at += (size_t)snprintf(text + at, size - at, which ? "],\"max\":[" : ",\"min\":[");
        for (int k = 0; k < 3; k++) {
            char number[QW_NUMBER_SIZE];
            size_t length = qw_number_print(number, (double)(which ? b->most[k] : b->least[k]));
            at += (size_t)snprintf(text + at, size - at, "%s%.*s", k ? "," : "", (int)length, number);
        }
    }
    snprintf(text + at, size - at, "]");
}

/* Positions, or how a morph target moves them. moves: NULL: positions. */
static uint32_t put_points(writer *w, const qw_gltf_object *o, const float *moves)
{
    double own[12];
    const double *m = map_of(w, o, own);
    bounds b = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = w->first_copy; i < w->copies; i++) {
        uint32_t v = w->mesh->corners[w->corner[i]];
        for (int r = 0; r < 3; r++) {
            double sum = moves ? 0 : m[4 * r + 3];
            for (int k = 0; k < 3; k++)
                sum += m[4 * r + k] * (moves ? (double)moves[3 * (size_t)v + (size_t)k]
                                             : w->mesh->positions[3 * (size_t)v + (size_t)k]);
            float value = (float)sum;
            if (!isfinite(value))
                qw_fail(w->env, QW_TOO_LARGE, v, "vertex %u lies at %g, beyond what glTF's 32-bit numbers hold", v,
                        sum);
            b.least[r] = fminf(b.least[r], value), b.most[r] = fmaxf(b.most[r], value);
            put_float(&w->bytes, value);
        }
    }
    end_view(w, begin, OF_VERTICES);
    char more[8 * QW_NUMBER_SIZE];
    put_bounds(more, sizeof more, &b);
    return put_accessor(w, TYPE_FLOAT32, w->copies - w->first_copy, "VEC3", more);
}

/* By the inverse transposed of the map, of unit length. */
static void turn_normal(const double *m, const float v[3], float out[3])
{
    double n[3], det = 0, length = 0;
    for (int i = 0; i < 3; i++) {
        int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        n[i] = 0;
        for (int k = 0; k < 3; k++) {
            int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            double c = m[4 * i1 + k1] * m[4 * i2 + k2] - m[4 * i1 + k2] * m[4 * i2 + k1];
            n[i] += c * (double)v[k];
            if (i == 0) det += m[k] * c;
        }
        length += n[i] * n[i];
    }
    length = sqrt(length);
    for (int i = 0; i < 3; i++)
        out[i] = length > 0 && isfinite(length) ? (float)(n[i] / (det < 0 ? -length : length)) : i == 2;
}

/* ---- attributes of one object */

static void put_stream(writer *w, const qw_gltf_object *o, const stream *s)
{
    const qw_attribute *a = s->of;
    uint32_t n = a->kind == QW_UVS ? 2 : a->components;
    double own[12];
    const double *map = map_of(w, o, own);
    bool is_colour = strncmp(s->semantic, "COLOR_", strlen("COLOR_")) == 0; /* from 0 to 1, by glTF's rules */
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = w->first_copy; i < w->copies; i++) {
        uint32_t c = w->corner[i], e = a->domain == QW_PER_CORNER ? c : w->mesh->corners[c];
        const float *in = a->values + (size_t)a->components * e;
        float turned[3];
        if (a->kind == QW_NORMALS) turn_normal(map, in, turned), in = turned;
        for (uint32_t k = 0; k < n; k++) {
            float value = a->kind == QW_UVS && k == 1 ? 1 - in[k] : in[k];
            put_float(&w->bytes, is_colour ? fminf(fmaxf(value, 0), 1) : value);
        }
    }
    end_view(w, begin, OF_VERTICES);
    uint32_t number = put_accessor(w, TYPE_FLOAT32, w->copies - w->first_copy, type_of(n), "");
    qw_pen_text(&w->meshes, ",");
    qw_pen_string(&w->meshes, s->semantic);
    qw_pen_print(&w->meshes, ":%u", number);
}

/* Influence k of a vertex on this object: joint of its skin and weight, 1 together; of what has none the first joint
 * holds all. */
static float influence(const writer *w, const qw_gltf_object *o, uint32_t v, uint32_t k, uint32_t *joint)
{
    const qw_attribute *a = w->weights;
    float sum = 0, weight = 0;
    *joint = 0;
    for (uint32_t i = 0; i < a->components; i++) {
        size_t at = (size_t)a->components * v + i;
        bool mine = a->group[at] >= o->joint_begin && a->group[at] - o->joint_begin < o->joint_count &&
                    a->values[at] > 0;
        if (mine) sum += a->values[at];
        if (mine && i == k) weight = a->values[at], *joint = a->group[at] - o->joint_begin;
    }
    return sum > 0 ? weight / sum : k == 0;
}

static void put_influences(writer *w, const qw_gltf_object *o, uint32_t set, bool weights)
{
    int size = o->joint_count <= 256 ? 1 : 2;
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = w->first_copy; i < w->copies; i++)
        for (uint32_t k = SET * set; k < SET * (set + 1); k++) {
            uint32_t joint;
            float weight = influence(w, o, w->mesh->corners[w->corner[i]], k, &joint);
            if (weights) put_float(&w->bytes, weight);
            else put_bits(&w->bytes, weight > 0 ? joint : 0, size);
        }
    end_view(w, begin, OF_VERTICES);
    int type = weights ? TYPE_FLOAT32 : size == 1 ? TYPE_UINT8 : TYPE_UINT16;
    uint32_t number = put_accessor(w, type, w->copies - w->first_copy, "VEC4", "");
    qw_pen_print(&w->meshes, ",\"%s_%u\":%u", weights ? "WEIGHTS" : "JOINTS", set, number);
}

/* "attributes":{...}, the same for all primitives of an object, and its "targets". */
static void put_attributes(writer *w, const qw_gltf_object *o)
{
    qw_pen_print(&w->meshes, "\"attributes\":{\"POSITION\":%u", put_points(w, o, NULL));
    for (uint32_t i = 0; i < w->streams; i++) put_stream(w, o, &w->stream[i]);
    if (w->weights && o && o->joint_count)
        for (uint32_t set = 0; SET * set < w->weights->components; set++)
            put_influences(w, o, set, false), put_influences(w, o, set, true);
    qw_pen_text(&w->meshes, "}");
    uint32_t targets = o ? o->target_count : w->count, written = 0;
    for (uint32_t i = 0; i < targets; i++) {
        const qw_attribute *a = o ? NULL : &w->attributes[i];
        for (uint32_t k = 0; o && k < w->count; k++)
            if (strcmp(w->attributes[k].name, w->rest->text + w->rest->target[o->target_begin + i]) == 0)
                a = &w->attributes[k];
        if (!o && !is_target(a)) continue;
        qw_pen_text(&w->meshes, written++ ? "," : ",\"targets\":[");
        uint32_t number = w->accessor_count;
        if (a && is_target(a)) put_points(w, o, a->values);
        else /* the animation still counts on it: zeros */
            qw_pen_print(&w->accessors,
                         "{\"componentType\":%d,\"count\":%u,\"type\":\"VEC3\",\"min\":[0,0,0],\"max\":[0,0,0]},",
                         TYPE_FLOAT32, w->copies - w->first_copy),
                w->accessor_count++;
        qw_pen_print(&w->meshes, "{\"POSITION\":%u}", number);
    }
    if (written) qw_pen_text(&w->meshes, "]");
}

/* ---- faces */

/* The corner at which a polygon's triangles begin: not at the vertex of the polygon before. A quad can as well begin at
   the opposite corner: its diagonal stays. */
static uint32_t first_corner(const writer *w, uint32_t f, uint32_t taken)
{
    uint32_t begin = w->begin[f], size = w->begin[f + 1] - begin, step = size == 4 ? 2 : 1;
    return w->copy[begin] == taken ? step : 0;
}

static uint32_t put_indices(writer *w, uint32_t from, uint32_t to)
{
    int size = w->copies - w->first_copy <= MOST_SHORT ? 2 : 4;
    uint32_t taken = QW_NONE;
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = from; i < to; i++) {
        uint32_t f = face_at(w, i), n = w->begin[f + 1] - w->begin[f], first = first_corner(w, f, taken);
        const uint32_t *copy = w->copy + w->begin[f];
        taken = copy[first];
        for (uint32_t k = 1; k + 1 < n; k++) {
            put_bits(&w->bytes, taken, size);
            put_bits(&w->bytes, copy[(first + k) % n], size);
            put_bits(&w->bytes, copy[(first + k + 1) % n], size);
        }
    }
    size_t count = (w->bytes.size - begin) / (size_t)size;
    end_view(w, begin, OF_INDICES);
    return put_accessor(w, size == 2 ? TYPE_UINT16 : TYPE_UINT32, count, "SCALAR", "");
}

static int32_t material_of(const writer *w, uint32_t f)
{
    int32_t m = w->material ? w->material->labels[f] : -1;
    if (w->rest) return m >= 0 && (uint32_t)m < w->rest->material_count ? m : -1;
    return m >= 0 && w->material->label_names ? m : -1;
}

static uint32_t object_of(const writer *w, uint32_t f)
{
    int32_t o = w->object ? w->object->labels[f] : 0;
    if (o < 0) return 0;
    return w->rest && (uint32_t)o >= w->rest->object_count ? w->rest->object_count - 1 : (uint32_t)o;
}

/* Where most programs look for them. */
static void put_target_names(writer *w)
{
    uint32_t written = 0;
    for (uint32_t i = 0; i < w->count; i++) {
        if (!is_target(&w->attributes[i])) continue;
        qw_pen_text(&w->meshes, written++ ? "," : "\"extras\":{\"targetNames\":[");
        qw_pen_string(&w->meshes, w->attributes[i].name + strlen("target:"));
    }
    if (written) qw_pen_text(&w->meshes, "]},");
}

/* Faces from .. to - 1 of the order are those of one object. */
static void put_mesh(writer *w, uint32_t from, uint32_t to)
{
    const qw_gltf_object *o = w->rest ? &w->rest->object[object_of(w, face_at(w, from))] : NULL;
    double own[12];
    const double *map = map_of(w, o, own);
    w->first_copy = w->copies;
    for (uint32_t i = from; i < to; i++)
        for (uint32_t c = w->begin[face_at(w, i)]; c < w->begin[face_at(w, i) + 1]; c++) take_corner(w, c);
    qw_pen_text(&w->meshes, w->mesh_count++ ? ",{" : "{");
    if (o) qw_pen_text(&w->meshes, w->rest->text + o->head);
    else put_target_names(w);
    qw_pen attributes = w->meshes;
    w->meshes = (qw_pen){.env = w->env};
    put_attributes(w, o);
    for (uint32_t i = from; i < to; i++) require_area(w, map, face_at(w, i));
    qw_pen shared = w->meshes;
    w->meshes = attributes;
    qw_pen_text(&w->meshes, "\"primitives\":[");
    for (uint32_t i = from, end; i < to; i = end) {
        int32_t material = material_of(w, face_at(w, i));
        for (end = i; end < to && material_of(w, face_at(w, end)) == material; end++) continue;
        qw_pen_text(&w->meshes, i > from ? ",{" : "{");
        qw_pen_put(&w->meshes, shared.at, shared.size);
        qw_pen_print(&w->meshes, ",\"indices\":%u", put_indices(w, i, end));
        if (material >= 0) qw_pen_print(&w->meshes, ",\"material\":%d", material);
        qw_pen_text(&w->meshes, ",\"extensions\":{\"FB_ngon_encoding\":{}}}");
    }
    qw_pen_text(&w->meshes, "]}");
    qw_free(w->env, shared.at);
}

/* ---- the document */

/* The nodes of the file that was read, each object's with its new mesh. mesh: uint32_t[objects]: QW_NONE: nothing is
 * left of it. */
static void put_nodes(const writer *w, qw_pen *out, const uint32_t *mesh)
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

static void put_translation(const writer *w, qw_pen *out)
{
    if (w->centre[0] == 0 && w->centre[1] == 0 && w->centre[2] == 0) return;
    for (int k = 0; k < 3; k++) {
        qw_pen_text(out, k ? "," : ",\"translation\":[");
        qw_pen_number(out, (double)w->centre[k]);
    }
    qw_pen_text(out, "]");
}

static void put_materials(const writer *w, qw_pen *out)
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

/* A node for each mesh, by the names of the objects; materials by their names. */
static void put_own_head(const writer *w, qw_pen *out, const uint32_t *first_face)
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
    put_materials(w, out);
}

static void put_list(qw_pen *out, const char *name, const char *passed, const qw_pen *own)
{
    qw_pen_print(out, "\"%s\":[", name);
    qw_pen_text(out, passed);
    qw_pen_put(out, own->at, own->size);
    if (out->at[out->size - 1] == ',') out->size--;
    qw_pen_text(out, "],");
}

/* All but the buffer, which ends the document. */
static qw_pen put_document(const writer *w, const uint32_t *first_face)
{
    const qw_gltf_rest *r = w->rest;
    qw_pen out = {.env = w->env};
    qw_pen_text(&out, "{");
    if (r) {
        uint32_t *mesh = QW_NEW(w->env, uint32_t, r->object_count);
        for (uint32_t i = 0; i < r->object_count; i++) mesh[i] = QW_NONE;
        for (uint32_t i = 0; i < w->mesh_count; i++) mesh[object_of(w, first_face[i])] = i;
        qw_pen_text(&out, r->text + r->head);
        put_nodes(w, &out, mesh);
    } else {
        put_own_head(w, &out, first_face);
    }
    qw_pen_text(&out, "\"meshes\":[");
    qw_pen_put(&out, w->meshes.at, w->meshes.size);
    qw_pen_text(&out, "],");
    put_list(&out, "accessors", r ? r->text + r->accessors : "", &w->accessors);
    put_list(&out, "bufferViews", r ? r->text + r->views : "", &w->views);
    qw_pen_text(&out, "\"extensionsUsed\":[");
    if (r) qw_pen_text(&out, r->text + r->used);
    qw_pen_text(&out, "\"FB_ngon_encoding\"],");
    if (r && r->text[r->required])
        qw_pen_text(&out, "\"extensionsRequired\":["), qw_pen_text(&out, r->text + r->required),
            qw_pen_text(&out, "],");
    qw_pen_print(&out, "\"buffers\":[{\"byteLength\":%zu", w->bytes.size);
    return out;
}

/* ---- the file */

static void put_glb(writer *w, qw_file *file, qw_pen *json)
{
    qw_pen_text(json, "}]}");
    qw_pen_align(json, ALIGNMENT, ' ');
    qw_pen_align(&w->bytes, ALIGNMENT, 0);
    uint64_t total = HEADER + 2 * CHUNK_HEADER + (uint64_t)json->size + w->bytes.size;
    if (total > UINT32_MAX)
        qw_fail(w->env, QW_TOO_LARGE, -1, "the result needs %.0f bytes as GLB, which holds at most 4294967295",
                (double)total);
    qw_pen head = {.env = w->env};
    qw_pen_text(&head, "glTF");
    put_bits(&head, 2, 4), put_bits(&head, (uint32_t)total, 4);
    put_bits(&head, (uint32_t)json->size, 4), qw_pen_text(&head, "JSON");
    qw_file_put(file, head.at, head.size);
    qw_file_put(file, json->at, json->size);
    head.size = 0;
    put_bits(&head, (uint32_t)w->bytes.size, 4), qw_pen_put(&head, "BIN", 4);
    qw_file_put(file, head.at, head.size);
    qw_file_put(file, w->bytes.at, w->bytes.size);
}

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

static void put_json(writer *w, qw_file *file, qw_pen *json)
{
    qw_pen_text(json, ",\"uri\":\"data:application/octet-stream;base64,");
    qw_file_put(file, json->at, json->size);
    put_base64(file, w->bytes.at, w->bytes.size);
    qw_file_put(file, "\"}]}\n", 5);
}

static void order_faces(writer *w)
{
    qw_attribute by[2];
    uint32_t count = 0;
    if (w->object) by[count++] = *w->object;
    if (w->material) by[count++] = *w->material;
    w->order = qw_order_faces(w->env, w->mesh->face_count, by, count);
}

/* Of a glTF file that was read the reader has told. */
static void warn_of_names(const writer *w)
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

static void begin_writer(writer *w)
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
    w->object = find_labels(w, "object"), w->material = find_labels(w, "material");
    warn_of_names(w);
    find_centre(w);
    find_streams(w);
    order_faces(w);
}

void qw_put_gltf(qw_env *env, qw_file *file, bool is_binary, const qw_mesh_view *mesh, const qw_attribute *attributes,
                 uint32_t count, const qw_gltf_rest *rest)
{
    const qw_pen none = {.env = env};
    writer w = {.env = env,
                .mesh = mesh,
                .attributes = attributes,
                .count = count,
                .rest = rest,
                .meshes = none,
                .views = none,
                .accessors = none,
                .bytes = none};
    begin_writer(&w);
    uint32_t *first_face = NULL;
    size_t capacity = 0;
    for (uint32_t i = 0, end; i < mesh->face_count; i = end) {
        uint32_t object = object_of(&w, face_at(&w, i));
        for (end = i; end < mesh->face_count && object_of(&w, face_at(&w, end)) == object; end++) continue;
        first_face = qw_grow(env, first_face, &capacity, w.mesh_count + (size_t)1, sizeof *first_face);
        first_face[w.mesh_count] = face_at(&w, i);
        put_mesh(&w, i, end);
    }
    qw_pen json = put_document(&w, first_face);
    if (is_binary) put_glb(&w, file, &json);
    else put_json(&w, file, &json);
}

/* ---- levels of detail */

static qw_pen put_levels_document(const writer *w, uint32_t levels)
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
    put_materials(w, &out);
    qw_pen_text(&out, "\"meshes\":[");
    qw_pen_put(&out, w->meshes.at, w->meshes.size);
    qw_pen_text(&out, "],");
    put_list(&out, "accessors", "", &w->accessors);
    put_list(&out, "bufferViews", "", &w->views);
    qw_pen_text(&out, levels > 1 ? "\"extensionsUsed\":[\"FB_ngon_encoding\",\"MSFT_lod\"],"
                                 : "\"extensionsUsed\":[\"FB_ngon_encoding\"],");
    qw_pen_print(&out, "\"buffers\":[{\"byteLength\":%zu", w->bytes.size);
    return out;
}

void qw_put_gltf_levels(qw_env *env, qw_file *file, bool is_binary, const qw_gltf_level *levels, uint32_t count)
{
    const qw_pen none = {.env = env};
    writer w = {.env = env, .meshes = none, .views = none, .accessors = none, .bytes = none};
    float centre[3];
    for (uint32_t i = 0; i < count; i++) {
        w.mesh = levels[i].mesh, w.attributes = levels[i].attributes, w.count = levels[i].count;
        w.copies = w.streams = 0;
        begin_writer(&w);
        w.object = NULL, order_faces(&w); /* a level is one node */
        if (i == 0) memcpy(centre, w.centre, sizeof centre);
        else memcpy(w.centre, centre, sizeof centre);
        put_mesh(&w, 0, w.mesh->face_count);
    }
    qw_pen json = put_levels_document(&w, count);
    if (is_binary) put_glb(&w, file, &json);
    else put_json(&w, file, &json);
}

/* The meshes of a glTF file: each object is one, in the coordinates of its node, with a primitive a material.
 *
 * A vertex of glTF is a combination of a position and attributes: here one for each that the corners at a vertex have.
 * Polygons are fans of triangles that begin at one corner, and no two that follow one another at the same, so that they
 * can be told apart again (FB_ngon_encoding). */
#include "base/mesh_view.h"
#include "base/vec.h"
#include "io/gltf/gltf_writer.h"
#include "io/number.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum buffer_target { OF_VERTICES = 34962, OF_INDICES = 34963 };

/* ---- what is written of the attributes */

const qw_attribute *qw_gltf_labels(const qw_gltf_writer *w, const char *name)
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
static bool name_stream(const qw_gltf_writer *w, const qw_attribute *a, qw_gltf_stream *s)
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

void qw_find_gltf_streams(qw_gltf_writer *w)
{
    w->stream = QW_NEW(w->env, qw_gltf_stream, w->count);
    for (uint32_t i = 0; i < w->count; i++) {
        if (w->attributes[i].kind == QW_WEIGHTS && w->rest) w->weights = &w->attributes[i];
        if (name_stream(w, &w->attributes[i], &w->stream[w->streams])) w->streams++;
    }
}

/* ---- copies of vertices */

static bool is_same_copy(const qw_gltf_writer *w, uint32_t c, uint32_t d)
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

static void take_corner(qw_gltf_writer *w, uint32_t c)
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

static void begin_view(qw_gltf_writer *w) { qw_pen_align(&w->bytes, QW_GLTF_ALIGNMENT, 0); }

static void end_view(qw_gltf_writer *w, size_t begin, int target)
{
    qw_pen_print(&w->views, "{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,\"target\":%d},", begin,
                 w->bytes.size - begin, target);
    w->view_count++;
}

void qw_put_bits(qw_pen *pen, uint32_t bits, int size)
{
    char *at = qw_pen_room(pen, (size_t)size);
    for (int i = 0; i < size; i++) at[i] = (char)(bits >> 8 * i);
}

static void put_float(qw_pen *pen, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    qw_put_bits(pen, bits, 4);
}

/* Describes the view that was written last; a comma follows. Returns its number. */
static uint32_t put_accessor(qw_gltf_writer *w, int type, size_t count, const char *kind, const char *more)
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
void qw_find_gltf_centre(qw_gltf_writer *w)
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
static const double *map_of(const qw_gltf_writer *w, const qw_gltf_object *o, double own[12])
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

/* Whether three points lie on one line, or at one place. */
static bool is_flat(const double a[3], const double b[3], const double c[3])
{
    double longer2 = fmax(qw_distance2_doubles(a, b), qw_distance2_doubles(a, c));
    return !(qw_cross2_doubles(a, b, c) > QW_CROSS_CERTAIN * QW_CROSS_CERTAIN * longer2 * longer2);
}

static bool is_same(const double a[3], const double b[3]) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

static void round_place(const double *map, const double *p, double out[3])
{
    float single[3];
    place(map, p, single);
    for (int k = 0; k < 3; k++) out[k] = (double)single[k];
}

/* Fails where corners of a face would fall together in single precision, or all of it on one line. */
static void require_area(const qw_gltf_writer *w, const double *map, uint32_t f)
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

/* The least and the most of positions, as members of an accessor, into `text`. */
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
static uint32_t put_points(qw_gltf_writer *w, const qw_gltf_object *o, const float *moves)
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
    return put_accessor(w, QW_GLTF_FLOAT32, w->copies - w->first_copy, "VEC3", more);
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

/* Writes an attribute of the vertices of a primitive into a view with an accessor, and names it in the primitive. */
static void put_stream(qw_gltf_writer *w, const qw_gltf_object *o, const qw_gltf_stream *s)
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
    uint32_t number = put_accessor(w, QW_GLTF_FLOAT32, w->copies - w->first_copy, type_of(n), "");
    qw_pen_text(&w->meshes, ",");
    qw_pen_string(&w->meshes, s->semantic);
    qw_pen_print(&w->meshes, ":%u", number);
}

/* Influence k of a vertex on this object: joint of its skin and weight, 1 together; of what has none the first joint
 * holds all. */
static float influence(const qw_gltf_writer *w, const qw_gltf_object *o, uint32_t v, uint32_t k, uint32_t *joint)
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

/* The same of four bones of each vertex, from the set-th four on: their weights, or which they are. */
static void put_influences(qw_gltf_writer *w, const qw_gltf_object *o, uint32_t set, bool weights)
{
    int size = o->joint_count <= 256 ? 1 : 2;
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = w->first_copy; i < w->copies; i++)
        for (uint32_t k = QW_GLTF_SET * set; k < QW_GLTF_SET * (set + 1); k++) {
            uint32_t joint;
            float weight = influence(w, o, w->mesh->corners[w->corner[i]], k, &joint);
            if (weights) put_float(&w->bytes, weight);
            else qw_put_bits(&w->bytes, weight > 0 ? joint : 0, size);
        }
    end_view(w, begin, OF_VERTICES);
    int type = weights ? QW_GLTF_FLOAT32 : size == 1 ? QW_GLTF_UINT8 : QW_GLTF_UINT16;
    uint32_t number = put_accessor(w, type, w->copies - w->first_copy, "VEC4", "");
    qw_pen_print(&w->meshes, ",\"%s_%u\":%u", weights ? "WEIGHTS" : "JOINTS", set, number);
}

/* "attributes":{...}, the same for all primitives of an object, and its "targets". */
static void put_attributes(qw_gltf_writer *w, const qw_gltf_object *o)
{
    qw_pen_print(&w->meshes, "\"attributes\":{\"POSITION\":%u", put_points(w, o, NULL));
    for (uint32_t i = 0; i < w->streams; i++) put_stream(w, o, &w->stream[i]);
    if (w->weights && o && o->joint_count)
        for (uint32_t set = 0; QW_GLTF_SET * set < w->weights->components; set++)
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
                         QW_GLTF_FLOAT32, w->copies - w->first_copy),
                w->accessor_count++;
        qw_pen_print(&w->meshes, "{\"POSITION\":%u}", number);
    }
    if (written) qw_pen_text(&w->meshes, "]");
}

/* ---- faces */

/* The corner at which a polygon's triangles begin: not at the vertex of the polygon before. A quad can as well begin at
   the opposite corner: its diagonal stays. */
static uint32_t first_corner(const qw_gltf_writer *w, uint32_t f, uint32_t taken)
{
    uint32_t begin = w->begin[f], size = w->begin[f + 1] - begin, step = size == 4 ? 2 : 1;
    return w->copy[begin] == taken ? step : 0;
}

/* The triangles of faces from .. to, as fans that tell polygons apart (FB_ngon_encoding). Returns the accessor. */
static uint32_t put_indices(qw_gltf_writer *w, uint32_t from, uint32_t to)
{
    int size = w->copies - w->first_copy <= UINT16_MAX ? 2 : 4;
    uint32_t taken = QW_NONE;
    begin_view(w);
    size_t begin = w->bytes.size;
    for (uint32_t i = from; i < to; i++) {
        uint32_t f = qw_gltf_face_at(w, i), n = w->begin[f + 1] - w->begin[f], first = first_corner(w, f, taken);
        const uint32_t *copy = w->copy + w->begin[f];
        taken = copy[first];
        for (uint32_t k = 1; k + 1 < n; k++) {
            qw_put_bits(&w->bytes, taken, size);
            qw_put_bits(&w->bytes, copy[(first + k) % n], size);
            qw_put_bits(&w->bytes, copy[(first + k + 1) % n], size);
        }
    }
    size_t count = (w->bytes.size - begin) / (size_t)size;
    end_view(w, begin, OF_INDICES);
    return put_accessor(w, size == 2 ? QW_GLTF_UINT16 : QW_GLTF_UINT32, count, "SCALAR", "");
}

static int32_t material_of(const qw_gltf_writer *w, uint32_t f)
{
    int32_t m = w->material ? w->material->labels[f] : -1;
    if (w->material_count) return m >= 0 && (uint32_t)m < w->material_count ? m : -1;
    if (w->rest) return m >= 0 && (uint32_t)m < w->rest->material_count ? m : -1;
    return m >= 0 && w->material->label_names ? m : -1;
}

uint32_t qw_gltf_object_of(const qw_gltf_writer *w, uint32_t f)
{
    int32_t o = w->object ? w->object->labels[f] : 0;
    if (o < 0) return 0;
    return w->rest && (uint32_t)o >= w->rest->object_count ? w->rest->object_count - 1 : (uint32_t)o;
}

/* Where most programs look for them. */
static void put_target_names(qw_gltf_writer *w)
{
    uint32_t written = 0;
    for (uint32_t i = 0; i < w->count; i++) {
        if (!is_target(&w->attributes[i])) continue;
        qw_pen_text(&w->meshes, written++ ? "," : "\"extras\":{\"targetNames\":[");
        qw_pen_string(&w->meshes, w->attributes[i].name + strlen("target:"));
    }
    if (written) qw_pen_text(&w->meshes, "]},");
}

void qw_put_gltf_mesh(qw_gltf_writer *w, uint32_t from, uint32_t to)
{
    const qw_gltf_object *o = w->rest ? &w->rest->object[qw_gltf_object_of(w, qw_gltf_face_at(w, from))] : NULL;
    double own[12];
    const double *map = map_of(w, o, own);
    w->first_copy = w->copies;
    for (uint32_t i = from; i < to; i++)
        for (uint32_t c = w->begin[qw_gltf_face_at(w, i)]; c < w->begin[qw_gltf_face_at(w, i) + 1]; c++)
            take_corner(w, c);
    qw_pen_text(&w->meshes, w->mesh_count++ ? ",{" : "{");
    if (o) qw_pen_text(&w->meshes, w->rest->text + o->head);
    else put_target_names(w);
    qw_pen attributes = w->meshes;
    w->meshes = (qw_pen){.env = w->env};
    put_attributes(w, o);
    for (uint32_t i = from; i < to; i++) require_area(w, map, qw_gltf_face_at(w, i));
    qw_pen shared = w->meshes;
    w->meshes = attributes;
    qw_pen_text(&w->meshes, "\"primitives\":[");
    for (uint32_t i = from, end; i < to; i = end) {
        int32_t material = material_of(w, qw_gltf_face_at(w, i));
        for (end = i; end < to && material_of(w, qw_gltf_face_at(w, end)) == material; end++) continue;
        qw_pen_text(&w->meshes, i > from ? ",{" : "{");
        qw_pen_put(&w->meshes, shared.at, shared.size);
        qw_pen_print(&w->meshes, ",\"indices\":%u", put_indices(w, i, end));
        if (material >= 0) qw_pen_print(&w->meshes, ",\"material\":%d", material);
        qw_pen_text(&w->meshes, ",\"extensions\":{\"FB_ngon_encoding\":{}}}");
    }
    qw_pen_text(&w->meshes, "]}");
    qw_free(w->env, shared.at);
}

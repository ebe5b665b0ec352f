#include "io/gltf/gltf_surface.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MOST_CHANNELS = 1024, MOST_ATTRIBUTES = 64 /* of a primitive */, MOST_NAME = 120 };
enum channel_kind { CHANNEL_NONE = -1, CHANNEL_JOINTS = -2, CHANNEL_WEIGHTS = -3 };
enum primitive_mode { TRIANGLES = 4, STRIP = 5, FAN = 6 };

/* ---- names */

/* The number behind a name's first part, as of TEXCOORD_1; -1: it has another. */
static int set_of(const char *name, const char *first)
{
    size_t size = strlen(first);
    if (strncmp(name, first, size) != 0) return -1;
    const char *digits = name + size;
    if (strlen(digits) < 1 || strlen(digits) > 2) return -1;
    for (const char *c = digits; *c; c++)
        if (*c < '0' || *c > '9') return -1;
    return digits[1] ? 10 * (digits[0] - '0') + digits[1] - '0' : digits[0] - '0';
}

static void make_printable(char *name)
{
    for (char *c = name; *c; c++)
        if ((unsigned char)*c < ' ' || *c == 127) *c = '_';
}

static const char *keep_name(qw_env *env, const char *first, const char *rest)
{
    size_t size = strlen(first) + strlen(rest) + 1;
    char *name = qw_alloc(env, size, 1);
    snprintf(name, size, "%s%s", first, rest);
    make_printable(name);
    return name;
}

typedef struct meaning {
    char name[MOST_NAME];
    int channel; /* 0: of the name; or CHANNEL_NONE, ... */
    int set;
    qw_attribute_kind kind;
    uint32_t least, most; /* components */
    float missing;
} meaning;

static meaning numbered(const char *name, int set, qw_attribute_kind kind, uint32_t least, uint32_t most, float missing)
{
    meaning m = {.kind = kind, .set = set, .least = least, .most = most, .missing = missing};
    if (set) snprintf(m.name, sizeof m.name, "%s%d", name, set);
    else snprintf(m.name, sizeof m.name, "%s", name);
    make_printable(m.name);
    return m;
}

static bool is_taken(const char *name)
{
    static const char *const ours[] = {"normal", "weights", "material", "object", "group", "smoothing"};
    for (size_t i = 0; i < sizeof ours / sizeof *ours; i++)
        if (strcmp(name, ours[i]) == 0) return true;
    return !name[0] || strncmp(name, "uv", 2) == 0 || strncmp(name, "color", 5) == 0 ||
           strncmp(name, "target:", 7) == 0;
}

/* What an attribute of a primitive is to us. */
static meaning meaning_of(const char *name)
{
    int set;
    if (strcmp(name, "NORMAL") == 0) return numbered("normal", 0, QW_NORMALS, 3, 3, 0);
    if ((set = set_of(name, "TEXCOORD_")) >= 0) return numbered("uv", set, QW_UVS, 2, 2, 0);
    if ((set = set_of(name, "COLOR_")) >= 0) return numbered("color", set, QW_VALUES, 3, 4, 1);
    meaning m = {.channel = CHANNEL_NONE};
    if ((set = set_of(name, "JOINTS_")) >= 0)
        m = (meaning){.channel = CHANNEL_JOINTS, .set = set, .least = QW_GLTF_SET, .most = QW_GLTF_SET};
    if ((set = set_of(name, "WEIGHTS_")) >= 0)
        m = (meaning){.channel = CHANNEL_WEIGHTS, .set = set, .least = QW_GLTF_SET, .most = QW_GLTF_SET};
    if (name[0] != '_' || strlen(name) >= MOST_NAME) return m;
    return numbered(is_taken(name + 1) ? name : name + 1, 0, QW_VALUES, 1, QW_MOST_COMPONENTS, 0);
}

/* ---- planning */

static uint32_t channel_named(const qw_gltf_surface *s, const char *name)
{
    for (uint32_t i = 0; i < s->channels; i++)
        if (strcmp(s->channel[i].name, name) == 0) return i;
    return QW_NONE;
}

/* The number of the channel of that name, a new one if there is none, with as many components as are asked for at
   least. */
static uint32_t plan_channel(qw_gltf_surface *s, const char *name, qw_attribute_kind kind, uint32_t components,
                             float missing, bool is_of_vertex)
{
    qw_env *env = s->d->env;
    uint32_t i = channel_named(s, name);
    if (i == QW_NONE && s->channels == MOST_CHANNELS)
        qw_fail(env, QW_TOO_LARGE, -1, "%s: its vertices have more than %d attributes and morph targets", s->d->name,
                MOST_CHANNELS);
    if (i == QW_NONE) {
        s->channel = qw_resize(env, s->channel, s->channels + (size_t)1, sizeof *s->channel);
        i = s->channels++;
        s->channel[i] = (qw_gltf_channel){
            .name = keep_name(env, "", name), .kind = kind, .missing = missing, .is_of_vertex = is_of_vertex};
    }
    if (components > s->channel[i].components) s->channel[i].components = components;
    return i;
}

/* The most morph targets that a primitive of the mesh has. */
static uint32_t count_targets(const qw_gltf_surface *s, uint32_t mesh, uint32_t primitives)
{
    const qw_json_doc *j = &s->d->json;
    uint32_t most = 0;
    for (uint32_t k = 0, t = primitives + 1; k < j->token[primitives].count; k++, t = j->token[t].next) {
        uint32_t targets = qw_json_member(j, t, "targets");
        if (targets != QW_NONE && !qw_json_has_kind(j, targets, QW_JSON_ARRAY))
            qw_gltf_fail(s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "the targets of primitive %u are not an array",
                         k);
        if (targets != QW_NONE && j->token[targets].count > most) most = j->token[targets].count;
    }
    if (most > MOST_CHANNELS)
        qw_gltf_fail(s->d, QW_TOO_LARGE, QW_GLTF_MESHES, mesh, "it has %u morph targets; %d can be read", most,
                     MOST_CHANNELS);
    return most;
}

/* Morph targets are named where most programs name them, or else by number. */
static void plan_targets(qw_gltf_surface *s, uint32_t mesh, uint32_t primitives)
{
    const qw_json_doc *j = &s->d->json;
    uint32_t count = count_targets(s, mesh, primitives), t = QW_NONE, named = 0;
    uint32_t names = qw_json_member(j, qw_json_member(j, s->d->list[QW_GLTF_MESHES][mesh], "extras"), "targetNames");
    if (qw_json_has_kind(j, names, QW_JSON_ARRAY)) named = j->token[names].count, t = names + 1;
    s->of_mesh[mesh].begin = s->targets, s->of_mesh[mesh].count = count;
    s->target = qw_grow(j->env, s->target, &s->target_capacity, s->targets + (size_t)count, sizeof *s->target);
    for (uint32_t i = 0; i < count; i++) {
        char number[16], *name = i < named ? qw_json_string(j, t) : NULL;
        snprintf(number, sizeof number, "%u", i);
        if (i < named) t = j->token[t].next;
        const char *full = keep_name(j->env, "target:", name && name[0] ? name : number);
        s->target[s->targets++] = plan_channel(s, full, QW_VALUES, 3, 0, true);
    }
}

/* Plans channels for all attributes of a primitive that are read, and counts the bones of a vertex. */
static void plan_primitive(qw_gltf_surface *s, uint32_t primitive, uint32_t mesh)
{
    const qw_json_doc *j = &s->d->json;
    uint32_t attributes = qw_json_member(j, primitive, "attributes");
    if (!qw_json_has_kind(j, attributes, QW_JSON_OBJECT))
        qw_gltf_fail(s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "a primitive of it has no attributes");
    if (j->token[attributes].count > MOST_ATTRIBUTES)
        qw_gltf_fail(s->d, QW_TOO_LARGE, QW_GLTF_MESHES, mesh, "a primitive of it has %u attributes; %d can be read",
                     j->token[attributes].count, MOST_ATTRIBUTES);
    for (uint32_t k = 0, key = attributes + 1; k < j->token[attributes].count; k++, key = j->token[key + 1].next) {
        char *name = qw_json_string(j, key);
        meaning m = meaning_of(name);
        uint32_t a = qw_gltf_item_index(s->d, key + 1, QW_GLTF_ACCESSORS, QW_GLTF_MESHES, mesh),
                 components = s->d->accessor[a].components;
        if (m.channel != CHANNEL_NONE && (components < m.least || components > m.most))
            qw_gltf_fail(s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "its %.40s has %u components", name, components);
        if (m.channel == 0) plan_channel(s, m.name, m.kind, components, m.missing, false);
        uint32_t influences = QW_GLTF_SET * (uint32_t)(m.set + 1);
        if (m.channel <= CHANNEL_JOINTS && influences > s->influences && influences <= QW_MOST_COMPONENTS)
            s->influences = influences;
        qw_free(j->env, name);
    }
}

void qw_gltf_plan_mesh(qw_gltf_surface *s, uint32_t mesh)
{
    const qw_json_doc *j = &s->d->json;
    uint32_t primitives = qw_gltf_array(s->d, s->d->list[QW_GLTF_MESHES][mesh], "primitives", QW_GLTF_MESHES, mesh);
    if (primitives == QW_NONE) qw_gltf_fail(s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "it has no primitives");
    for (uint32_t k = 0, t = primitives + 1; k < j->token[primitives].count; k++, t = j->token[t].next)
        plan_primitive(s, t, mesh);
    plan_targets(s, mesh, primitives);
}

/* ---- one primitive */

/* A source of values for a channel, of the primitive that is being read. */
typedef struct feed {
    const float *values; /* NULL: none */
    uint32_t components;
} feed;

typedef struct primitive {
    qw_gltf_surface *s;
    const qw_gltf_object *object;
    const qw_gltf_map *map;
    uint32_t number, token; /* of the object */
    uint32_t vertices;      /* of its accessors */
    const float *position;
    feed *feed; /* feed[channels] */
    feed joints[4], weights[4];
    int32_t material;
    bool is_ngons;
} primitive;

/* The accessor of an attribute, if it has one value a vertex. */
static feed feed_of(primitive *p, uint32_t accessor, const char *name)
{
    qw_gltf_document *d = p->s->d;
    const qw_gltf_accessor *a = &d->accessor[accessor];
    if (a->count != p->vertices)
        qw_gltf_fail(d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, p->object->mesh, "its %.40s has %u elements for %u vertices",
                     name, a->count, p->vertices);
    return (feed){qw_gltf_values(d, accessor), a->components};
}

/* Finds the positions of a primitive and what feeds each channel, joints and weights. */
static void open_attributes(primitive *p)
{
    const qw_json_doc *j = &p->s->d->json;
    uint32_t attributes = qw_json_member(j, p->token, "attributes"), mesh = p->object->mesh;
    uint32_t position = qw_gltf_index(p->s->d, attributes, "POSITION", QW_GLTF_ACCESSORS, QW_GLTF_MESHES, mesh);
    if (position == QW_NONE)
        qw_gltf_fail(p->s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "a primitive of it has no POSITION");
    if (p->s->d->accessor[position].components != 3 || p->s->d->accessor[position].view == QW_NONE)
        qw_gltf_fail(p->s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, mesh, "its POSITION is not a VEC3 in a buffer view");
    p->vertices = p->s->d->accessor[position].count;
    p->position = qw_gltf_values(p->s->d, position);
    for (uint32_t k = 0, key = attributes + 1; k < j->token[attributes].count; k++, key = j->token[key + 1].next) {
        char *name = qw_json_string(j, key);
        meaning m = meaning_of(name);
        uint32_t a = qw_gltf_item_index(p->s->d, key + 1, QW_GLTF_ACCESSORS, QW_GLTF_MESHES, mesh);
        if (m.channel == 0) p->feed[channel_named(p->s, m.name)] = feed_of(p, a, name);
        if (m.channel == CHANNEL_JOINTS && m.set < 4) p->joints[m.set] = feed_of(p, a, name);
        if (m.channel == CHANNEL_WEIGHTS && m.set < 4) p->weights[m.set] = feed_of(p, a, name);
        qw_free(j->env, name);
    }
}

/* The same of its morph targets. */
static void open_targets(primitive *p)
{
    const qw_json_doc *j = &p->s->d->json;
    uint32_t targets = qw_json_member(j, p->token, "targets");
    for (uint32_t k = 0, t = targets + 1; targets != QW_NONE && k < j->token[targets].count;
         k++, t = j->token[t].next) {
        uint32_t a = qw_gltf_index(p->s->d, t, "POSITION", QW_GLTF_ACCESSORS, QW_GLTF_MESHES, p->object->mesh);
        if (a == QW_NONE) continue;
        if (p->s->d->accessor[a].components != 3)
            qw_gltf_fail(p->s->d, QW_FORMAT_SYNTAX, QW_GLTF_MESHES, p->object->mesh,
                         "the POSITION of its target %u is not a VEC3", k);
        p->feed[p->s->target[p->s->of_mesh[p->object->mesh].begin + k]] = feed_of(p, a, "morph target");
    }
}

/* ---- vertices */

static void turn(const qw_gltf_map *map, const float v[3], float out[3])
{
    for (int i = 0; i < 3; i++) {
        double sum = 0;
        for (int k = 0; k < 3; k++) sum += map->m[4 * i + k] * (double)v[k];
        out[i] = (float)sum;
    }
}

/* By the inverse transposed, of unit length. */
static void turn_normal(const qw_gltf_object *o, const float v[3], float out[3])
{
    double n[3] = {0, 0, 0}, length = 0;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) n[i] += o->to_local[4 * k + i] * (double)v[k];
        length += n[i] * n[i];
    }
    length = sqrt(length);
    for (int i = 0; i < 3; i++) out[i] = length > 0 && isfinite(length) ? (float)(n[i] / length) : 0;
}

/* Writes a vertex of a channel from element `at` of its feed: turned, mapped into the scene, missing ones filled
   in. */
static void take_values(primitive *p, qw_gltf_channel *c, const feed *f, uint32_t vertex, uint32_t at)
{
    if (vertex >= c->capacity)
        c->values = qw_grow(p->s->d->env, c->values, &c->capacity, vertex + (size_t)1, c->components * sizeof(float));
    float *out = c->values + (size_t)c->components * vertex;
    const float *in = f->values ? f->values + (size_t)f->components * at : NULL;
    for (uint32_t k = 0; k < c->components; k++) out[k] = in && k < f->components ? in[k] : c->missing;
    if (in && c->kind == QW_NORMALS) turn_normal(p->object, in, out);
    if (in && c->is_of_vertex) turn(p->map, in, out);
    if (in && c->kind == QW_UVS) out[1] = 1 - in[1]; /* from above to from below, as everywhere else */
    for (uint32_t k = 0; k < c->components; k++) c->is_broken |= !isfinite(out[k]);
}

/* Writes bones and weights of a vertex; fails where a weight is no number or a joint is none of the skin. */
static void take_influences(primitive *p, uint32_t vertex, uint32_t at)
{
    qw_gltf_surface *s = p->s;
    uint32_t n = s->influences;
    s->weight = qw_grow(s->d->env, s->weight, &s->weight_capacity, vertex + (size_t)1, n * sizeof *s->weight);
    s->joint = qw_grow(s->d->env, s->joint, &s->joint_capacity, vertex + (size_t)1, n * sizeof *s->joint);
    for (uint32_t k = 0; k < n; k++) {
        const feed *j = &p->joints[k / QW_GLTF_SET], *w = &p->weights[k / QW_GLTF_SET];
        bool is_there = j->values && w->values && p->object->joint_count;
        float weight = is_there ? w->values[QW_GLTF_SET * (size_t)at + k % QW_GLTF_SET] : 0,
              joint = is_there ? j->values[QW_GLTF_SET * (size_t)at + k % QW_GLTF_SET] : 0;
        if (!(weight >= 0) || !isfinite(weight))
            qw_gltf_fail(s->d, QW_NOT_FINITE, QW_GLTF_MESHES, p->object->mesh,
                         "a weight of vertex %u is below 0 or no number", at);
        if (weight > 0 && !(joint >= 0 && joint < (float)p->object->joint_count))
            qw_gltf_fail(s->d, QW_INDEX_RANGE, QW_GLTF_MESHES, p->object->mesh,
                         "vertex %u names joint %.0f, but its skin has %u, counted from 0", at, (double)joint,
                         p->object->joint_count);
        s->weight[(size_t)n * vertex + k] = weight;
        s->joint[(size_t)n * vertex + k] = weight > 0 ? p->object->joint_begin + (uint32_t)joint : 0;
    }
}

/* The vertex of element `at` of the primitive, made with all its channels where it is new. */
static uint32_t take_vertex(primitive *p, uint32_t at)
{
    qw_gltf_surface *s = p->s;
    if (s->stamp[at] == s->stamps) return s->known[at];
    const float *in = p->position + 3 * (size_t)at;
    uint32_t vertex = s->build.soup.vertex_count;
    double out[3];
    for (int i = 0; i < 3; i++) {
        out[i] = p->map->m[4 * i + 3];
        for (int k = 0; k < 3; k++) out[i] += p->map->m[4 * i + k] * (double)in[k];
    }
    if (!qw_is_finite3(out))
        qw_gltf_fail(s->d, QW_NOT_FINITE, QW_GLTF_MESHES, p->object->mesh,
                     "a coordinate of vertex %u is NaN or infinite", at);
    qw_build_vertex(&s->build, out);
    s->owner = qw_grow(s->d->env, s->owner, &s->owner_capacity, vertex + (size_t)1, sizeof *s->owner);
    s->owner[vertex] = p->number;
    for (uint32_t c = 0; c < s->channels; c++) take_values(p, &s->channel[c], &p->feed[c], vertex, at);
    if (s->influences) take_influences(p, vertex, at);
    s->stamp[at] = s->stamps, s->known[at] = vertex;
    return vertex;
}

/* ---- faces */

/* The corners since the last face are one, counter-clockwise as the scene shows it. */
static void end_face(primitive *p)
{
    qw_gltf_surface *s = p->s;
    qw_soup *soup = &s->build.soup;
    uint32_t f = soup->face_count, begin = soup->face_begin[f], end = s->build.corner_count;
    for (uint32_t i = begin, k = end; p->object->is_mirrored && i + 1 < k; i++) {
        uint32_t moved = soup->corner[i];
        soup->corner[i] = soup->corner[--k], soup->corner[k] = moved;
    }
    qw_build_face(&s->build);
    if (soup->face_count == f) return;
    s->material = qw_grow(s->d->env, s->material, &s->material_capacity, f + (size_t)1, sizeof *s->material);
    s->object = qw_grow(s->d->env, s->object, &s->object_capacity, f + (size_t)1, sizeof *s->object);
    s->material[f] = p->material, s->object[f] = (int32_t)p->number;
}

typedef struct corners {
    primitive *p;
    const uint32_t *index; /* NULL: the vertices in their order */
    uint32_t count;
} corners;

static uint32_t corner_at(const corners *c, uint32_t i)
{
    uint32_t at = c->index ? c->index[i] : i;
    if (at >= c->p->vertices)
        qw_gltf_fail(c->p->s->d, QW_INDEX_RANGE, QW_GLTF_MESHES, c->p->object->mesh,
                     "corner %u names vertex %u, but there are %u, counted from 0", i, at, c->p->vertices);
    return at;
}

/* Triangles that follow one another and begin at one corner are one polygon where the file says so (FB_ngon_encoding).
 */
static void take_triangles(const corners *c)
{
    primitive *p = c->p;
    uint32_t first = QW_NONE, last = QW_NONE;
    for (uint32_t i = 0; i + 3 <= c->count; i += 3) {
        uint32_t v[3] = {corner_at(c, i), corner_at(c, i + 1), corner_at(c, i + 2)};
        bool goes_on = p->is_ngons && i > 0 && v[0] == first && v[1] == last;
        if (!goes_on && i > 0) end_face(p);
        for (int k = goes_on ? 2 : 0; k < 3; k++) qw_build_corner(&p->s->build, take_vertex(p, v[k]));
        first = v[0], last = v[2];
        if (i % 3072 == 0) qw_heartbeat(p->s->d->env);
    }
    if (c->count >= 3) end_face(p);
}

static void take_strip_or_fan(const corners *c, bool is_fan)
{
    primitive *p = c->p;
    for (uint32_t i = 0; i + 3 <= c->count; i++) {
        uint32_t odd = !is_fan && i % 2;
        uint32_t v[3] = {corner_at(c, is_fan ? 0 : i), corner_at(c, i + 1 + odd), corner_at(c, i + 2 - odd)};
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue; /* strips are joined by such */
        for (int k = 0; k < 3; k++) qw_build_corner(&p->s->build, take_vertex(p, v[k]));
        end_face(p);
    }
}

static void begin_stamps(qw_gltf_surface *s, uint32_t vertices)
{
    if (vertices > s->stamp_size) {
        s->stamp = qw_resize(s->d->env, s->stamp, vertices, sizeof *s->stamp);
        s->known = qw_resize(s->d->env, s->known, vertices, sizeof *s->known);
        memset(s->stamp + s->stamp_size, 0, (vertices - s->stamp_size) * sizeof *s->stamp);
        s->stamp_size = vertices;
    }
    s->stamps++;
}

/* Reads the faces of a primitive; points and lines are only counted. */
static void take_primitive(primitive *p)
{
    qw_gltf_document *d = p->s->d;
    uint32_t mesh = p->object->mesh,
             mode = (uint32_t)qw_gltf_whole(d, p->token, "mode", FAN, TRIANGLES, QW_GLTF_MESHES, mesh);
    if (mode < TRIANGLES) {
        p->s->skipped++;
        return;
    }
    uint32_t material = qw_gltf_index(d, p->token, "material", QW_GLTF_MATERIALS, QW_GLTF_MESHES, mesh);
    p->material = material == QW_NONE ? -1 : (int32_t)material;
    p->is_ngons = qw_json_member(&d->json, qw_json_member(&d->json, p->token, "extensions"), "FB_ngon_encoding") !=
                  QW_NONE;
    open_attributes(p);
    open_targets(p);
    begin_stamps(p->s, p->vertices);
    uint32_t a = qw_gltf_index(d, p->token, "indices", QW_GLTF_ACCESSORS, QW_GLTF_MESHES, mesh);
    uint32_t *index = a == QW_NONE ? NULL : qw_gltf_indices(d, a);
    corners c = {p, index, index ? d->accessor[a].count : p->vertices};
    if (mode == TRIANGLES) take_triangles(&c);
    else take_strip_or_fan(&c, mode == FAN);
    qw_free(d->env, index);
}

void qw_gltf_take_object(qw_gltf_surface *s, uint32_t number, const qw_gltf_object *object, const qw_gltf_map *to_scene)
{
    const qw_json_doc *j = &s->d->json;
    uint32_t primitives = qw_json_member(j, s->d->list[QW_GLTF_MESHES][object->mesh], "primitives");
    feed *feeds = QW_NEW(j->env, feed, s->channels);
    for (uint32_t k = 0, t = primitives + 1; k < j->token[primitives].count; k++, t = j->token[t].next) {
        memset(feeds, 0, s->channels * sizeof *feeds);
        primitive p = {.s = s, .object = object, .map = to_scene, .number = number, .token = t, .feed = feeds};
        take_primitive(&p);
    }
    qw_free(j->env, feeds);
}

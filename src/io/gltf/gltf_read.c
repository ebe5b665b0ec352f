/* glTF: its scene as one mesh, with everything that its vertices and faces carry, and what else it holds kept for the
 * writer.
 *
 * A vertex of glTF is a combination of a position and attributes, so a surface is cut open wherever normals or texture
 * coordinates change. Here vertices of an object that lie at one place and move alike (joints, weights, morph targets)
 * become one again, and what differs between them goes by corners. */
#include "base/hash.h"
#include "io/formats.h"
#include "io/gltf/gltf_surface.h"

#include <stdio.h>
#include <string.h>

/* ---- joining vertices */

/* A hash of all by which is_same_vertex tells vertices apart. */
static uint64_t hash_vertex(const qw_gltf_surface *s, uint32_t v)
{
    uint64_t h = s->owner[v] ^ qw_hash_place(s->build.soup.position + 3 * (size_t)v);
    for (size_t k = 0; k < s->influences; k++) {
        h = qw_hash_real(h, (double)s->weight[s->influences * (size_t)v + k]);
        h = qw_mix(h ^ s->joint[s->influences * (size_t)v + k]);
    }
    for (uint32_t c = 0; c < s->channels; c++)
        for (size_t k = 0; k < 3 && s->channel[c].is_of_vertex; k++)
            h = qw_hash_real(h, (double)s->channel[c].values[3 * (size_t)v + k]);
    return h;
}

typedef struct wanted_vertex {
    const qw_gltf_surface *s;
    uint32_t v;
} wanted_vertex;

/* Whether two vertices of one object lie at one place and have the same bones and morph targets. */
static bool is_same_vertex(const void *wanted, uint32_t w)
{
    const qw_gltf_surface *s = ((const wanted_vertex *)wanted)->s;
    const double *p = s->build.soup.position;
    uint32_t v = ((const wanted_vertex *)wanted)->v;
    bool same = s->owner[v] == s->owner[w] && qw_is_one_place(p + 3 * (size_t)v, p + 3 * (size_t)w);
    for (size_t k = 0, n = s->influences; k < n && same; k++)
        same = s->weight[n * v + k] == s->weight[n * w + k] && s->joint[n * v + k] == s->joint[n * w + k];
    for (uint32_t c = 0; c < s->channels && same; c++)
        for (size_t k = 0; k < 3 && s->channel[c].is_of_vertex && same; k++)
            same = s->channel[c].values[3 * (size_t)v + k] == s->channel[c].values[3 * (size_t)w + k];
    return same;
}

/* uint32_t[vertices]: the first of those that each is one with. */
static uint32_t *find_twins(const qw_gltf_surface *s)
{
    qw_env *env = s->d->env;
    uint32_t count = s->build.soup.vertex_count, *first = QW_NEW(env, uint32_t, count);
    qw_hash_table t = qw_hash_table_create(env, count);
    for (uint32_t v = 0; v < count; v++) {
        uint32_t *slot = qw_hash_slot(&t, hash_vertex(s, v), is_same_vertex, &(wanted_vertex){s, v});
        if (*slot == QW_NONE) *slot = v;
        first[v] = *slot;
    }
    qw_free(env, t.slot);
    return first;
}

typedef struct joining {
    uint32_t *first;  /* uint32_t[vertices as read] */
    uint32_t *number; /* uint32_t[vertices as read]: of the vertex that it is now */
    uint32_t *corner; /* uint32_t[corners]: vertex as read */
    uint32_t read, left, corners;
} joining;

/* Makes vertices that are the same one, in positions and corners; returns which became which, for their
   attributes. */
static joining join_vertices(qw_gltf_surface *s)
{
    qw_env *env = s->d->env;
    qw_soup *soup = &s->build.soup;
    joining j = {.first = find_twins(s), .read = soup->vertex_count, .corners = s->build.corner_count};
    j.number = QW_NEW(env, uint32_t, j.read), j.corner = QW_NEW(env, uint32_t, j.corners);
    for (uint32_t v = 0; v < j.read; v++) {
        j.number[v] = j.first[v] == v ? j.left++ : j.number[j.first[v]];
        if (j.first[v] == v)
            memmove(soup->position + 3 * (size_t)j.number[v], soup->position + 3 * (size_t)v, 3 * sizeof(double));
    }
    if (j.corners) memcpy(j.corner, soup->corner, j.corners * sizeof *j.corner);
    for (uint32_t c = 0; c < j.corners; c++) soup->corner[c] = j.number[soup->corner[c]];
    soup->vertex_count = j.left;
    return j;
}

/* ---- attributes */

static bool goes_by_vertices(const qw_gltf_channel *c, const joining *j)
{
    if (c->kind != QW_VALUES) return false;
    for (uint32_t v = 0; v < j->read && !c->is_of_vertex; v++)
        if (memcmp(c->values + (size_t)c->components * v, c->values + (size_t)c->components * j->first[v],
                   c->components * sizeof(float)))
            return false;
    return true;
}

/* Makes an attribute of a channel, of vertices where all corners of each agree, else of corners; a broken one is
   left out. */
static void finish_channel(qw_gltf_surface *s, qw_soup *soup, qw_gltf_channel *c, const joining *j)
{
    qw_env *env = s->d->env;
    size_t n = c->components;
    if (c->is_broken)
        qw_log(env, QW_LOG_WARNING, "%s: %.80s is left out: some of it is not finite", s->d->name, c->name);
    bool by_vertices = !c->is_broken && goes_by_vertices(c, j);
    if (!c->is_broken) {
        qw_attribute *a = qw_build_attribute(env, soup, c->name, by_vertices ? QW_PER_VERTEX : QW_PER_CORNER, c->kind,
                                             c->components);
        float *values = QW_NEW(env, float, a->count *n);
        for (uint32_t v = 0; v < j->read && by_vertices; v++)
            if (j->first[v] == v) memcpy(values + n * j->number[v], c->values + n * v, n * sizeof *values);
        for (uint32_t k = 0; k < j->corners && !by_vertices; k++)
            memcpy(values + n * k, c->values + n * j->corner[k], n * sizeof *values);
        a->values = values;
    }
    qw_free(env, c->values);
    c->values = NULL;
}

/* Names of what a list holds, by their "name" or else as "material 3": char *[count], of which the first is the block
   of all. item: uint32_t[count], their numbers in the list; NULL: all of it. */
static const char *const *names_of(const qw_gltf_document *d, qw_gltf_list list, const char *what, const uint32_t *item,
                                   uint32_t count)
{
    const char **names = QW_NEW(d->env, const char *, count);
    size_t *begin = QW_NEW(d->env, size_t, count), size = 0, capacity = 0;
    char *text = NULL, other[32];
    for (uint32_t i = 0; i < count; i++) {
        uint32_t k = item ? item[i] : i;
        char *name = qw_json_string(&d->json, qw_json_member(&d->json, d->list[list][k], "name"));
        snprintf(other, sizeof other, "%s %u", what, k);
        const char *from = name && name[0] ? name : other;
        size_t length = strlen(from) + 1;
        text = qw_grow(d->env, text, &capacity, size + length, 1);
        memcpy(text + size, from, length);
        for (char *c = text + size; *c; c++)
            if ((unsigned char)*c < ' ' || *c == 127) *c = '_';
        begin[i] = size, size += length;
        qw_free(d->env, name);
    }
    for (uint32_t i = 0; i < count; i++) names[i] = text + begin[i];
    qw_free(d->env, begin);
    return names;
}

static void add_labels(qw_gltf_surface *s, qw_soup *soup, const char *name, int32_t *labels, const char *const *names,
                       uint32_t count)
{
    qw_attribute *a = qw_build_attribute(s->d->env, soup, name, QW_PER_FACE, QW_LABELS, 1);
    a->labels = labels, a->label_names = names, a->label_count = count;
}

/* Makes the attribute "weights" of bones, of the vertices that are left, with the names of the joints of all
   skins. */
static void add_weights(qw_gltf_surface *s, qw_soup *soup, const joining *j, uint32_t joints)
{
    const qw_gltf_document *d = s->d;
    size_t n = s->influences;
    uint32_t *node = QW_NEW(d->env, uint32_t, joints), count = 0;
    for (uint32_t i = 0; i < d->length[QW_GLTF_SKINS]; i++) {
        uint32_t array = qw_gltf_array(d, d->list[QW_GLTF_SKINS][i], "joints", QW_GLTF_SKINS, i);
        for (uint32_t k = 0, t = array + 1; array != QW_NONE && k < d->json.token[array].count;
             k++, t = d->json.token[t].next)
            node[count++] = qw_gltf_item_index(d, t, QW_GLTF_NODES, QW_GLTF_SKINS, i);
    }
    for (uint32_t v = 0; v < j->read; v++) {
        if (j->first[v] != v) continue;
        memmove(s->weight + n * j->number[v], s->weight + n * v, n * sizeof *s->weight);
        memmove(s->joint + n * j->number[v], s->joint + n * v, n * sizeof *s->joint);
    }
    qw_attribute *a = qw_build_attribute(d->env, soup, "weights", QW_PER_VERTEX, QW_WEIGHTS, s->influences);
    a->values = s->weight, a->group = s->joint;
    a->label_names = names_of(d, QW_GLTF_NODES, "node", node, joints), a->label_count = joints;
    qw_free(d->env, node);
}

/* ---- the whole */

static bool is_first_of_kind(const char *name)
{
    return strcmp(name, "uv") == 0 || strcmp(name, "color") == 0 || strcmp(name, "normal") == 0;
}

/* Makes attributes of all that was read: channels, weights, and labels of objects and materials. */
static void finish_attributes(qw_gltf_surface *s, qw_soup *soup, const joining *j, qw_gltf_object *objects,
                              uint32_t count, uint32_t joints)
{
    qw_gltf_document *d = s->d;
    uint32_t materials = d->length[QW_GLTF_MATERIALS], *node = QW_NEW(d->env, uint32_t, count);
    for (int others = 0; others < 2; others++) /* formats with one set of each take the first */
        for (uint32_t c = 0; c < s->channels; c++)
            if (is_first_of_kind(s->channel[c].name) != others) finish_channel(s, soup, &s->channel[c], j);
    if (s->influences && joints) add_weights(s, soup, j, joints);
    for (uint32_t i = 0; i < count; i++) node[i] = objects[i].node;
    if (count > 1) add_labels(s, soup, "object", s->object, names_of(d, QW_GLTF_NODES, "node", node, count), count);
    if (materials)
        add_labels(s, soup, "material", s->material, names_of(d, QW_GLTF_MATERIALS, "material", NULL, materials),
                   materials);
    qw_free(d->env, node);
}

qw_soup qw_read_gltf(qw_env *env, const char *name, const char *path, qw_bytes bytes)
{
    qw_gltf_document d = qw_gltf_open(env, name, path, bytes);
    uint32_t count, joints;
    qw_gltf_map *to_scene;
    qw_gltf_object *objects = qw_gltf_find_objects(&d, &count, &to_scene, &joints);
    qw_gltf_surface s = {.d = &d, .build = qw_build_begin(env, name, 0, 0, 0)};
    s.of_mesh = qw_alloc_zero(env, d.length[QW_GLTF_MESHES], sizeof *s.of_mesh);
    bool *is_planned = QW_NEW_ZERO(env, bool, d.length[QW_GLTF_MESHES]);
    for (uint32_t i = 0; i < count; i++) {
        if (!is_planned[objects[i].mesh]) qw_gltf_plan_mesh(&s, objects[i].mesh);
        is_planned[objects[i].mesh] = true;
    }
    for (uint32_t i = 0; i < count; i++) qw_gltf_take_object(&s, i, &objects[i], &to_scene[i]);
    if (s.skipped) qw_log(env, QW_LOG_WARNING, "%s: %u primitives of points or lines are not read", name, s.skipped);
    if (s.build.soup.face_count == 0)
        qw_fail(env, QW_NO_FACES, -1, "%s: no node of its scene shows a mesh that has a triangle", name);
    joining j = join_vertices(&s);
    qw_soup soup = qw_build_finish(&s.build);
    finish_attributes(&s, &soup, &j, objects, count, joints);
    const char **names = QW_NEW(env, const char *, s.targets);
    for (uint32_t i = 0; i < s.targets; i++) names[i] = s.channel[s.target[i]].name;
    for (uint32_t i = 0; i < count; i++) {
        objects[i].target_begin = s.of_mesh[objects[i].mesh].begin;
        objects[i].target_count = s.of_mesh[objects[i].mesh].count;
    }
    soup.gltf = qw_gltf_pass_on(&d, objects, count, names, s.targets);
    return soup;
}

/* Several files as one mesh: each of them an object, named by its file, with its own materials. */
#include "api/loaded.h"
#include "products/bake/bake_surface.h"

#include <stdio.h>
#include <string.h>

static uint32_t corners_of(const qw_mesh_view *v)
{
    uint32_t corners = v->face_sizes ? 0 : v->face_count * v->uniform_face_size;
    for (uint32_t f = 0; v->face_sizes && f < v->face_count; f++) corners += v->face_sizes[f];
    return corners;
}

/* The views of all parts in one: vertices and faces of each follow those of the part before it. */
static void join_views(qw_env *env, qw_mesh *whole)
{
    uint64_t vertices = 0, faces = 0, corners = 0, marks = 0;
    for (uint32_t i = 0; i < whole->parts; i++) {
        const qw_mesh_view *v = &whole->part[i].view;
        vertices += v->vertex_count, faces += v->face_count, corners += corners_of(v), marks += v->marked_edge_count;
    }
    if (vertices > INT32_MAX || corners > INT32_MAX)
        qw_fail(env, QW_TOO_LARGE, -1, "the meshes have more vertices together than can be addressed");
    double *position = QW_NEW(env, double, 3 * vertices);
    uint32_t *size = QW_NEW(env, uint32_t, faces), *corner = QW_NEW(env, uint32_t, corners);
    uint32_t *mark = QW_NEW(env, uint32_t, 2 * marks);
    whole->view.positions = position, whole->view.face_sizes = size, whole->view.corners = corner;
    whole->view.marked_edges = mark, whole->view.marked_edge_count = (uint32_t)marks;
    whole->view.face_count = (uint32_t)faces;
    for (uint32_t i = 0; i < whole->parts; i++) {
        const qw_mesh_view *v = &whole->part[i].view;
        uint32_t before = whole->view.vertex_count, n = corners_of(v);
        memcpy(position + 3 * (size_t)before, v->positions, 3 * (size_t)v->vertex_count * sizeof *position);
        for (uint32_t f = 0; f < v->face_count; f++) *size++ = v->face_sizes ? v->face_sizes[f] : v->uniform_face_size;
        for (uint32_t c = 0; c < n; c++) *corner++ = before + v->corners[c];
        for (uint32_t k = 0; k < 2 * v->marked_edge_count; k++) *mark++ = before + v->marked_edges[k];
        whole->view.vertex_count += v->vertex_count;
    }
}

static const qw_attribute *attribute_of(const qw_mesh *part, const char *name, qw_attribute_kind kind)
{
    for (uint32_t i = 0; i < part->attribute_count; i++)
        if (part->attribute[i].kind == kind && strcmp(part->attribute[i].name, name) == 0) return &part->attribute[i];
    return NULL;
}

static qw_attribute *add(qw_mesh *whole, qw_attribute *list, const qw_attribute *like)
{
    qw_attribute *a = &list[whole->attribute_count++];
    *a = *like;
    a->size = sizeof *a, a->count = a->domain == QW_PER_FACE ? whole->view.face_count : corners_of(&whole->view);
    return a;
}

/* Of one corner of a part; colours of glTF are linear, of all other files as they are seen. */
static void take_value(const qw_mesh *part, const qw_attribute *from, size_t element, const qw_attribute *a, float *to)
{
    for (uint32_t k = 0; k < a->components && k < from->components; k++) {
        float value = from->values[element * from->components + k];
        to[k] = part->gltf && a->kind == QW_VALUES && k < 3 ? (float)qw_to_srgb((double)value) : value;
    }
}

/* Values by corners; where a part has none they are `missing`. */
static void join_values(qw_env *env, qw_mesh *whole, qw_attribute *list, const qw_attribute *like, float missing)
{
    bool is_there = false;
    for (uint32_t i = 0; i < whole->parts; i++)
        is_there |= attribute_of(&whole->part[i], like->name, like->kind) != NULL;
    if (!is_there) return;
    qw_attribute *a = add(whole, list, like);
    float *value = QW_NEW(env, float, a->count *(size_t)a->components), *to = value;
    for (size_t i = 0; i < a->count * (size_t)a->components; i++) value[i] = missing;
    for (uint32_t i = 0; i < whole->parts; i++) {
        const qw_mesh_view *v = &whole->part[i].view;
        const qw_attribute *from = attribute_of(&whole->part[i], a->name, a->kind);
        for (uint32_t c = 0, n = corners_of(v); c < n; c++, to += a->components)
            if (from) take_value(&whole->part[i], from, from->domain == QW_PER_VERTEX ? v->corners[c] : c, a, to);
    }
    a->values = value;
}

static void add_labels(qw_env *env, qw_mesh *whole, qw_attribute *list, const char *name, uint32_t count,
                       int32_t **label, const char ***names)
{
    const qw_attribute like = {.name = name, .domain = QW_PER_FACE, .kind = QW_LABELS, .components = 1};
    qw_attribute *a = add(whole, list, &like);
    a->label_count = count, a->labels = *label = QW_NEW(env, int32_t, a->count);
    a->label_names = *names = QW_NEW(env, const char *, count);
}

static const qw_attribute *materials_of(const qw_mesh *part)
{
    const qw_attribute *a = attribute_of(part, "material", QW_LABELS);
    return a && a->domain == QW_PER_FACE && a->label_names ? a : NULL;
}

uint32_t qw_count_part_materials(const qw_mesh *part)
{
    const qw_attribute *a = materials_of(part);
    return a ? a->label_count : 1;
}

/* Of each part after those of the parts before; where it has none, one for all of it. */
static void join_materials(qw_env *env, qw_mesh *whole, qw_attribute *list, const char *const *object)
{
    uint32_t count = 0;
    int32_t *label, before = 0;
    const char **name;
    for (uint32_t i = 0; i < whole->parts; i++) count += qw_count_part_materials(&whole->part[i]);
    add_labels(env, whole, list, "material", count, &label, &name);
    for (uint32_t i = 0; i < whole->parts; i++) {
        const qw_attribute *of = materials_of(&whole->part[i]);
        uint32_t n = qw_count_part_materials(&whole->part[i]);
        for (uint32_t f = 0; f < whole->part[i].view.face_count; f++)
            *label++ = of && of->labels[f] < 0 ? -1 : before + (of ? of->labels[f] : 0);
        for (uint32_t k = 0; k < n; k++) *name++ = of ? of->label_names[k] : object[i];
        before += (int32_t)n;
    }
}

static void join_objects(qw_env *env, qw_mesh *whole, qw_attribute *list, const char *const *object)
{
    int32_t *label;
    const char **name;
    add_labels(env, whole, list, "object", whole->parts, &label, &name);
    for (uint32_t i = 0; i < whole->parts; i++) {
        for (uint32_t f = 0; f < whole->part[i].view.face_count; f++) *label++ = (int32_t)i;
        name[i] = object[i];
    }
}

/* "a/b.obj" is b. */
static const char *stem_of(qw_env *env, const char *path)
{
    const char *name = path;
    for (const char *at = path; *at; at++)
        if (*at == '/' || *at == '\\') name = at + 1;
    const char *dot = strrchr(name, '.');
    size_t size = dot && dot > name ? (size_t)(dot - name) : strlen(name);
    return memcpy(QW_NEW_ZERO(env, char, size + 1), name, size);
}

void qw_join_parts(qw_env *env, qw_mesh *whole)
{
    const char **objects = QW_NEW(env, const char *, whole->parts);
    qw_attribute *list = QW_NEW(env, qw_attribute, QW_MOST_SETS + 4);
    for (uint32_t i = 0; i < whole->parts; i++) objects[i] = stem_of(env, whole->part[i].path);
    join_views(env, whole);
    for (uint32_t i = 0; i < QW_MOST_SETS; i++) {
        char *name = QW_NEW(env, char, 8);
        snprintf(name, 8, i ? "uv%u" : "uv", i);
        qw_attribute uv = {.name = name, .domain = QW_PER_CORNER, .kind = QW_UVS, .components = 2};
        join_values(env, whole, list, &uv, 0);
    }
    const qw_attribute color = {.name = "color", .domain = QW_PER_CORNER, .kind = QW_VALUES, .components = 4};
    const qw_attribute normal = {.name = "normal", .domain = QW_PER_CORNER, .kind = QW_NORMALS, .components = 3};
    join_values(env, whole, list, &color, 1), join_values(env, whole, list, &normal, 0);
    join_materials(env, whole, list, objects), join_objects(env, whole, list, objects);
    whole->attribute = list;
}

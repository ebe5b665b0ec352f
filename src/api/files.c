/* The public functions over files and measures. Each makes an environment of its own, so that they can be called
 * without a context and from any thread; a loaded mesh keeps its environment, which owns its arrays and its message. */
#include "products/attributes/transfer.h"
#include "products/limit/cage.h"
#include "base/hash.h"
#include "base/mesh_view.h"
#include "api/loaded.h"
#include "io/soup.h"
#include "products/wrap/point_cloud.h"
#include "products/wrap/wrap.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- loading */

typedef struct load_job {
    qw_env *env;
    qw_mesh *mesh;
    const char *const *path; /* char *[paths] */
    uint32_t paths;          /* 0: bytes */
    const void *bytes;       /* byte[size] */
    size_t size;
    const qw_mesh_view *view; /* of the caller, to be wrapped, as what follows, or split so many times */
    uint32_t times;
    const qw_attribute *attributes;
    uint32_t attribute_count;
    const char *library;
    const qw_mesh *source;
} load_job;

/* Formats that share no vertices between faces give each corner its own: equal positions become one vertex, numbered by
 * their first use. */
static void weld(qw_env *env, qw_soup *soup)
{
    uint32_t *place = qw_find_places(env, soup->position, soup->vertex_count, NULL), kept = 0;
    for (uint32_t v = 0; v < soup->vertex_count; v++) {
        place[v] = place[v] == v ? kept++ : place[place[v]];
        for (int k = 0; k < 3; k++) /* -0 becomes 0 */
            soup->position[3 * (size_t)place[v] + k] = soup->position[3 * (size_t)v + k] + 0.0;
    }
    for (uint32_t c = 0; c < soup->face_begin[soup->face_count]; c++) soup->corner[c] = place[soup->corner[c]];
    soup->vertex_count = kept;
    qw_free(env, place);
}

/* The view of what was read: uniform where all faces have three corners or all have four. */
static void view_soup(qw_env *env, const qw_soup *soup, qw_mesh_view *view)
{
    uint32_t first = soup->face_count ? soup->face_begin[1] : 0;
    bool uniform = first == 3 || first == 4;
    for (uint32_t f = 0; f < soup->face_count && uniform; f++)
        uniform = soup->face_begin[f + 1] - soup->face_begin[f] == first;
    uint32_t *sizes = NULL;
    if (!uniform) {
        sizes = QW_NEW(env, uint32_t, soup->face_count);
        for (uint32_t f = 0; f < soup->face_count; f++) sizes[f] = soup->face_begin[f + 1] - soup->face_begin[f];
    }
    *view = (qw_mesh_view){.size = sizeof *view,
                           .vertex_count = soup->vertex_count,
                           .face_count = soup->face_count,
                           .uniform_face_size = uniform ? first : 0,
                           .positions = soup->position,
                           .face_sizes = sizes,
                           .corners = soup->corner,
                           .marked_edges = soup->mark,
                           .marked_edge_count = soup->mark_count};
}

static void make_holder(void *user)
{
    load_job *job = user;
    qw_mesh *mesh = QW_NEW_ZERO(job->env, qw_mesh, 1);
    mesh->env = job->env;
    mesh->view.size = sizeof mesh->view;
    job->mesh = mesh;
}

static void take_soup(qw_env *env, qw_mesh *mesh, qw_soup soup, const char *path)
{
    if (soup.separate_corners) weld(env, &soup);
    qw_mesh_view view;
    view_soup(env, &soup, &view);
    mesh->view = view;
    mesh->attribute = soup.attribute, mesh->attribute_count = soup.attribute_count;
    if (path) mesh->path = memcpy(QW_NEW(env, char, strlen(path) + 1), path, strlen(path) + 1);
    mesh->library = soup.library, mesh->gltf = soup.gltf, mesh->is_whole = true;
}

static void require_something(const load_job *job)
{
    bool is_there = job->path || job->bytes;
    for (uint32_t i = 0; i < job->paths; i++) is_there = is_there && job->path[i];
    if (!is_there) qw_fail(job->env, QW_ARGUMENT, -1, "there is nothing to load: the path or the bytes are NULL");
}

/* Reads memory, a file, or several files that become one mesh. */
static void load_body(void *user)
{
    load_job *job = user;
    qw_mesh *mesh = job->mesh;
    require_something(job);
    if (job->bytes) take_soup(job->env, mesh, qw_read_memory(job->env, job->bytes, job->size, "memory"), NULL);
    else if (job->paths == 1) take_soup(job->env, mesh, qw_read(job->env, job->path[0]), job->path[0]);
    else {
        mesh->part = QW_NEW_ZERO(job->env, qw_mesh, job->paths), mesh->parts = job->paths;
        for (uint32_t i = 0; i < job->paths; i++)
            take_soup(job->env, &mesh->part[i], qw_read(job->env, job->path[i]), job->path[i]);
        qw_join_parts(job->env, mesh);
        mesh->is_whole = true;
    }
}

/* Points as a soup: src/products/wrap/point_cloud.h. */
static void points_body(void *user)
{
    load_job *job = user;
    require_something(job);
    qw_soup soup = job->path ? qw_read_points(job->env, *job->path)
                             : qw_read_points_memory(job->env, job->bytes, job->size, "memory");
    double *flat = qw_flatten_points(job->env, soup.position, soup.vertex_count);
    uint32_t *corner, faces = qw_triangles_of_points(job->env, flat, soup.vertex_count, &corner);
    job->mesh->view = (qw_mesh_view){.size = sizeof job->mesh->view,
                                     .vertex_count = soup.vertex_count,
                                     .face_count = faces,
                                     .uniform_face_size = 3,
                                     .positions = flat,
                                     .corners = corner};
    job->mesh->attribute = soup.attribute, job->mesh->attribute_count = soup.attribute_count;
    job->mesh->is_whole = true;
}

/* The caller's points, of which the view has no faces. */
static void own_points_body(void *user)
{
    load_job *job = user;
    const qw_mesh_view *v = job->view;
    if (v->vertex_count < 3) qw_fail(job->env, QW_NO_FACES, -1, "%u points make no surface", v->vertex_count);
    qw_require_view(job->env, v, "points");
    qw_require_moderate(job->env, v, "points");
    qw_require_attributes(job->env, job->attributes, job->attribute_count, v->vertex_count, 0, 0);
    double *flat = qw_flatten_points(job->env, v->positions, v->vertex_count);
    uint32_t *corner, faces = qw_triangles_of_points(job->env, flat, v->vertex_count, &corner);
    job->mesh->view = *v, job->mesh->view.positions = flat;
    job->mesh->view.face_count = faces, job->mesh->view.uniform_face_size = 3, job->mesh->view.corners = corner;
    job->mesh->attribute = job->attributes, job->mesh->attribute_count = job->attribute_count;
    job->mesh->is_whole = true;
}

/* Makes a mesh of arrays of the caller, which are checked and not copied; files that belong to it are those of
   `source`. */
static void wrap_body(void *user)
{
    load_job *job = user;
    qw_mesh *mesh = job->mesh;
    uint32_t corners = qw_require_view(job->env, job->view, "mesh");
    qw_require_attributes(job->env, job->attributes, job->attribute_count, job->view->vertex_count, corners,
                          job->view->face_count);
    mesh->view = *job->view;
    mesh->attribute = job->attributes, mesh->attribute_count = job->attribute_count;
    mesh->library = job->library, mesh->is_whole = true;
    if (job->source) {
        mesh->gltf = job->source->gltf, mesh->path = job->source->path;
        mesh->part = job->source->part, mesh->parts = job->source->parts;
    }
    if (job->source && !job->library) mesh->library = job->source->library;
}

static void limit_body(void *user)
{
    load_job *job = user;
    qw_require_view(job->env, job->view, "mesh");
    qw_require_moderate(job->env, job->view, "mesh");
    if (job->times > QW_MOST_SPLITS)
        qw_fail(job->env, QW_ARGUMENT, -1, "%u times are more than the %d that quads can be split", job->times,
                QW_MOST_SPLITS);
    job->mesh->view = qw_limit_of_cage(job->env, job->view, job->times);
    job->mesh->is_whole = true;
}

/* A mesh with an environment of its own, filled by `body`. *mesh is made even where body fails, to hold the
   message. */
static qw_status make_mesh(load_job job, void (*body)(void *user), const qw_host *host, qw_mesh **mesh)
{
    *mesh = NULL;
    job.env = qw_env_create(host, 0);
    if (!job.env) return QW_MEMORY;
    if (qw_protect(job.env, make_holder, &job) != QW_OK) {
        qw_env_destroy(job.env);
        return QW_MEMORY;
    }
    *mesh = job.mesh;
    qw_status status = qw_protect(job.env, body, &job);
    qw_env_set_threads(job.env, 1); /* a loaded mesh keeps no threads */
    return status;
}

qw_status qw_load(const char *path, const qw_host *host, qw_mesh **mesh)
{
    return mesh ? make_mesh((load_job){.path = &path, .paths = 1}, load_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_load_together(const char *const *paths, uint32_t count, const qw_host *host, qw_mesh **mesh)
{
    load_job job = {.path = count ? paths : NULL, .paths = count};
    return mesh ? make_mesh(job, load_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_load_points(const char *path, const qw_host *host, qw_mesh **mesh)
{
    return mesh ? make_mesh((load_job){.path = &path, .paths = 1}, points_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_load_points_memory(const void *bytes, size_t size, const qw_host *host, qw_mesh **mesh)
{
    return mesh ? make_mesh((load_job){.bytes = bytes, .size = size}, points_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_mesh_of_points(const double *positions, uint32_t point_count, const qw_attribute *attributes,
                            uint32_t count, const qw_host *host, qw_mesh **mesh)
{
    const qw_mesh_view view = {.size = sizeof view, .vertex_count = point_count, .positions = positions};
    load_job job = {.view = &view, .attributes = attributes, .attribute_count = count};
    return mesh ? make_mesh(job, own_points_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_load_memory(const void *bytes, size_t size, const qw_host *host, qw_mesh **mesh)
{
    return mesh ? make_mesh((load_job){.bytes = bytes, .size = size}, load_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_mesh_wrap(const qw_mesh_view *view, const qw_attribute *attributes, uint32_t count, const char *library,
                       const qw_mesh *source, const qw_host *host, qw_mesh **mesh)
{
    load_job job = {
        .view = view, .attributes = attributes, .attribute_count = count, .library = library, .source = source};
    return mesh ? make_mesh(job, wrap_body, host, mesh) : QW_ARGUMENT;
}

qw_status qw_limit(const qw_mesh_view *cage, uint32_t times, const qw_host *host, qw_mesh **limit)
{
    return limit ? make_mesh((load_job){.view = cage, .times = times}, limit_body, host, limit) : QW_ARGUMENT;
}

qw_mesh_view qw_mesh_get(const qw_mesh *mesh)
{
    return mesh ? mesh->view : (qw_mesh_view){.size = sizeof(qw_mesh_view)};
}
const qw_attribute *qw_mesh_attributes(const qw_mesh *mesh, uint32_t *count)
{
    if (count) *count = mesh ? mesh->attribute_count : 0;
    return mesh ? mesh->attribute : NULL;
}

/* ---- marking */

enum { MOST_MARKING = 64 }; /* attributes whose borders are marked at once */

typedef struct mark_job {
    qw_mesh *mesh;
    const char *names;
} mark_job;

/* The attribute of that name; fails with a list of those that are there. */
static const qw_attribute *attribute_named(const qw_mesh *mesh, const char *name, size_t size)
{
    char there[240] = "";
    size_t used = 0;
    for (uint32_t i = 0; i < mesh->attribute_count; i++)
        if (strlen(mesh->attribute[i].name) == size && memcmp(mesh->attribute[i].name, name, size) == 0)
            return &mesh->attribute[i];
    for (uint32_t i = 0; i < mesh->attribute_count && used + 50 < sizeof there; i++)
        used += (size_t)snprintf(there + used, sizeof there - used, "%s%.40s", used ? ", " : "; it has ",
                                 mesh->attribute[i].name);
    qw_fail(mesh->env, QW_ARGUMENT, -1, "the mesh has no attribute \"%.*s\" whose borders could be kept%s",
            (int)(size < 80 ? size : 80), name, there[0] ? there : "; it has none");
}

/* Marks the edges at which one of the attributes named in the list changes. */
static void mark_body(void *user)
{
    mark_job *job = user;
    const qw_attribute *of[MOST_MARKING];
    uint32_t count = 0, edges;
    for (const char *at = job->names; *at;) {
        size_t size = strcspn(at, ",");
        if (count == MOST_MARKING)
            qw_fail(job->mesh->env, QW_ARGUMENT, -1, "more than %d attributes to mark", MOST_MARKING);
        of[count++] = attribute_named(job->mesh, at, size);
        at += size + (at[size] == ',');
    }
    uint32_t *edge = qw_find_attribute_borders(job->mesh->env, &job->mesh->view, of, count, &edges);
    job->mesh->view.marked_edges = edge, job->mesh->view.marked_edge_count = edges;
}

qw_status qw_mesh_mark(qw_mesh *mesh, const char *names, uint32_t *edges)
{
    if (!mesh || !names) return QW_ARGUMENT;
    mark_job job = {mesh, names};
    qw_status status = qw_protect(mesh->env, mark_body, &job);
    if (edges) *edges = mesh->view.marked_edge_count;
    return status;
}

/* ---- the faces of a label */

typedef struct region_job {
    qw_mesh *mesh;
    const char *label;
    uint8_t *inside;
} region_job;

/* The number of a label of this name, or that the name is; false where there is none. */
static bool find_label(const qw_attribute *a, const char *name, int32_t *label)
{
    for (uint32_t i = 0; a->label_names && i < a->label_count; i++)
        if (strcmp(a->label_names[i], name) == 0) {
            *label = (int32_t)i;
            return true;
        }
    char *end;
    long number = strtol(name, &end, 10);
    if (a->label_names || end == name || *end || number < INT32_MIN || number > INT32_MAX) return false;
    *label = (int32_t)number;
    return true;
}

/* Some of the labels that there are, as "group=arm, group=leg, part=3". */
static void list_labels(const qw_mesh *mesh, char *text, size_t size)
{
    size_t used = 0;
    text[0] = 0;
    for (uint32_t i = 0; i < mesh->attribute_count; i++) {
        const qw_attribute *a = &mesh->attribute[i];
        if (a->kind != QW_LABELS || a->domain != QW_PER_FACE) continue;
        for (uint32_t k = 0; k < (a->label_names ? a->label_count : 1) && used + 80 < size; k++)
            used += (size_t)snprintf(text + used, 80, "%s%.30s=%.40s", used ? ", " : "", a->name,
                                     a->label_names ? a->label_names[k] : "NUMBER");
    }
}

/* Marks the faces that have the label in one of the attributes that it may be of. Returns how many. */
static uint32_t mark_faces(const region_job *job, const char *attribute, size_t length, const char *name)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < job->mesh->attribute_count; i++) {
        const qw_attribute *a = &job->mesh->attribute[i];
        int32_t label;
        if (a->kind != QW_LABELS || a->domain != QW_PER_FACE) continue;
        if (attribute ? strlen(a->name) != length || memcmp(a->name, attribute, length) != 0 : !a->label_names)
            continue;
        if (!find_label(a, name, &label)) continue;
        for (uint32_t f = 0; f < a->count; f++)
            if (a->labels[f] == label) count += !job->inside[f], job->inside[f] = 1;
    }
    return count;
}

/* Marks the faces that have a label, "name" or "attribute=name"; fails with those that are there. */
static void region_body(void *user)
{
    region_job *job = user;
    const char *equals = strchr(job->label, '=');
    char labels[480];
    memset(job->inside, 0, job->mesh->view.face_count);
    uint32_t count = mark_faces(job, NULL, 0, job->label);
    if (count == 0 && equals) count = mark_faces(job, job->label, (size_t)(equals - job->label), equals + 1);
    if (count > 0) return;
    list_labels(job->mesh, labels, sizeof labels);
    qw_fail(job->mesh->env, QW_ARGUMENT, -1, "no face has the label \"%.80s\"; %s%s", job->label,
            labels[0] ? "the labels are " : "the mesh has no labels of faces", labels);
}

qw_status qw_mesh_region(qw_mesh *mesh, const char *label, uint8_t *inside)
{
    if (!mesh || !label || !inside) return QW_ARGUMENT;
    region_job job = {mesh, label, inside};
    return qw_protect(mesh->env, region_body, &job);
}

const char *qw_mesh_library(const qw_mesh *mesh) { return mesh ? mesh->library : NULL; }
const char *qw_mesh_message(const qw_mesh *mesh) { return mesh ? qw_env_message(mesh->env) : "out of memory"; }

void qw_mesh_destroy(qw_mesh *mesh)
{
    if (mesh) qw_env_destroy(mesh->env); /* owns the holder too */
}

/* ---- saving */

typedef struct save_job {
    qw_env *env;
    const qw_mesh_view *mesh;
    const char *path;
    qw_format format;
} save_job;

static void save_body(void *user)
{
    save_job *job = user;
    if (!job->path || !job->path[0]) qw_fail(job->env, QW_ARGUMENT, -1, "there is no path to write to");
    qw_require_view(job->env, job->mesh, "mesh");
    qw_write(job->env, job->path, job->format, job->mesh);
}

qw_status qw_save(const qw_mesh_view *mesh, const char *path, qw_format format, char *message, size_t message_size)
{
    if (message && message_size) message[0] = 0;
    /* one thread: those of a context that has just run would be in the way of others */
    save_job job = {.env = qw_env_create(NULL, 1), .mesh = mesh, .path = path, .format = format};
    qw_status status = job.env ? qw_protect(job.env, save_body, &job) : QW_MEMORY;
    if (status != QW_OK && message && message_size)
        snprintf(message, message_size, "%s", job.env ? qw_env_message(job.env) : qw_status_text(QW_MEMORY));
    qw_env_destroy(job.env);
    return status;
}

typedef struct save_mesh_job {
    qw_mesh *mesh;
    const char *path;
    qw_format format;
} save_mesh_job;

static void save_mesh_body(void *user)
{
    save_mesh_job *job = user;
    qw_mesh *mesh = job->mesh;
    if (!job->path || !job->path[0]) qw_fail(mesh->env, QW_ARGUMENT, -1, "there is no path to write to");
    if (!mesh->is_whole) qw_fail(mesh->env, QW_ARGUMENT, -1, "there is no mesh: it could not be read");
    qw_scope_begin(mesh->env);
    const qw_carried_along along = {mesh->attribute, mesh->attribute_count, mesh->library, mesh->gltf, false};
    qw_write_with(mesh->env, job->path, job->format, &mesh->view, &along);
    qw_scope_end(mesh->env);
}

qw_status qw_mesh_save(qw_mesh *mesh, const char *path, qw_format format)
{
    if (!mesh) return QW_ARGUMENT;
    save_mesh_job job = {mesh, path, format};
    return qw_protect(mesh->env, save_mesh_body, &job);
}

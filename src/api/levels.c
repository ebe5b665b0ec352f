/* Levels of detail: results that outlive their context, and one file of several. */
#include "api/asset.h"
#include "api/context.h"
#include "api/loaded.h"
#include "products/attributes/transfer.h"
#include "base/mesh_view.h"
#include "whole/kept_rims.h"
#include "io/gltf/gltf.h"

#include <stdio.h>
#include <string.h>

typedef struct level_call {
    qw_env *env;
    qw_mesh_view view;
    const qw_attribute *attributes;
    uint32_t count;
    const qw_asset *asset; /* whose maps are taken; NULL: none */
    qw_mesh *mesh;
} level_call;

/* Copies of size bytes; NULL stays NULL. */
static void *copy_of(qw_env *env, const void *from, size_t size)
{
    if (!from) return NULL;
    char *to = QW_NEW(env, char, size);
    memcpy(to, from, size);
    return to;
}

/* Replaces all that an attribute points at by copies of the environment's own. */
static void copy_attribute(qw_env *env, qw_attribute *a)
{
    size_t values = (size_t)a->count * a->components * sizeof(float);
    a->name = copy_of(env, a->name, strlen(a->name) + 1);
    a->values = copy_of(env, a->values, values), a->group = copy_of(env, a->group, values);
    a->labels = copy_of(env, a->labels, (size_t)a->count * sizeof *a->labels);
    if (!a->label_names) return;
    const char **names = QW_NEW(env, const char *, a->label_count);
    for (uint32_t i = 0; i < a->label_count; i++)
        names[i] = copy_of(env, a->label_names[i], strlen(a->label_names[i]) + 1);
    a->label_names = names;
}

static const qw_asset_look *copy_look(qw_env *env, const qw_asset_look *look)
{
    qw_asset_look *to = copy_of(env, look, sizeof *look);
    qw_picture *picture = copy_of(env, look->picture, look->tiles * (size_t)QW_MAP_COUNT * sizeof *picture);
    for (uint32_t i = 0; i < look->tiles * QW_MAP_COUNT; i++) {
        qw_picture *p = &picture[i];
        p->pixels = copy_of(env, p->pixels, (size_t)p->width * p->height * (p->channels * p->bits / 8));
    }
    to->picture = picture;
    return to;
}

/* Copies a result, with attributes and the look of its asset, into a mesh that lives on without its context. */
static void copy_level(void *user)
{
    level_call *call = user;
    qw_env *env = call->env;
    if (call->asset)
        call->attributes = qw_list_asset(env, call->asset, &call->view, call->attributes, &call->count, true);
    qw_mesh *mesh = QW_NEW_ZERO(env, qw_mesh, 1);
    qw_mesh_view *v = &mesh->view;
    uint32_t corners = qw_require_view(env, &call->view, "mesh");
    qw_require_attributes(env, call->attributes, call->count, call->view.vertex_count, corners, call->view.face_count);
    *v = call->view;
    v->positions = copy_of(env, v->positions, 3 * (size_t)v->vertex_count * sizeof *v->positions);
    v->corners = copy_of(env, v->corners, (size_t)corners * sizeof *v->corners);
    v->face_sizes = copy_of(env, v->face_sizes, (size_t)v->face_count * sizeof *v->face_sizes);
    v->marked_edges = copy_of(env, v->marked_edges, 2 * (size_t)v->marked_edge_count * sizeof *v->marked_edges);
    qw_attribute *attribute = QW_NEW(env, qw_attribute, call->count);
    for (uint32_t i = 0; i < call->count; i++) attribute[i] = call->attributes[i], copy_attribute(env, &attribute[i]);
    if (call->asset) mesh->look = copy_look(env, &call->asset->look);
    mesh->env = env, mesh->attribute = attribute, mesh->attribute_count = call->count, mesh->is_whole = true;
    call->mesh = mesh;
}

qw_status qw_take_level(qw_context *context, const qw_attribute *attributes, uint32_t count, qw_mesh **level)
{
    if (!context || !level || (!attributes && count > 0)) return QW_ARGUMENT;
    *level = NULL;
    level_call call = {.attributes = attributes, .count = count};
    if (context->state.asset && context->state.asset->picture) call.asset = context->state.asset;
    if (qw_get_mesh(context, &call.view) != QW_OK)
        return qw_refuse(context, QW_NOT_READY, "the last stage has not finished yet: there is no level to take");
    call.env = qw_env_create(&(qw_host){.resize = context->host.resize, .resize_user = context->host.resize_user}, 1);
    if (!call.env) return QW_MEMORY;
    qw_status status = qw_protect(call.env, copy_level, &call);
    if (status == QW_OK) {
        *level = call.mesh;
        return qw_done(context, QW_OK);
    }
    status = qw_refuse(context, status, qw_env_message(call.env));
    qw_env_destroy(call.env);
    return status;
}

typedef struct save_call {
    qw_env *env;
    const qw_mesh *const *levels;
    uint32_t count;
    const qw_mesh *source; /* NULL: none */
    const char *path;
    qw_format format;
} save_call;

static bool ends_in(const char *path, const char *ending)
{
    size_t size = strlen(path), length = strlen(ending);
    return size >= length && strcmp(path + size - length, ending) == 0;
}

/* The attributes of a level with maps, whose material, the last, begins at a number among those of all levels. */
static const qw_attribute *number_materials(qw_env *env, const qw_mesh *m, int32_t first)
{
    qw_attribute *list = copy_of(env, m->attribute, m->attribute_count * sizeof *list);
    qw_attribute *material = &list[m->attribute_count - 1];
    int32_t *label = copy_of(env, material->labels, material->count * sizeof *label);
    for (uint32_t f = 0; f < material->count; f++) label[f] += first;
    material->labels = label;
    return list;
}

/* Writes all levels into one GLB or glTF file, with the materials of each. */
static void save_levels(void *user)
{
    save_call *call = user;
    if (!call->path || !call->path[0] || !call->levels || call->count == 0)
        qw_fail(call->env, QW_ARGUMENT, -1, "there are no levels, or there is no path to write to");
    bool is_glb = call->format == QW_FORMAT_GLB || (call->format == QW_FORMAT_AUTO && ends_in(call->path, ".glb")),
         is_gltf = call->format == QW_FORMAT_GLTF || (call->format == QW_FORMAT_AUTO && ends_in(call->path, ".gltf"));
    if (!is_glb && !is_gltf)
        qw_fail(call->env, QW_UNSUPPORTED, -1,
                "levels of detail in one file are GLB or glTF, which hold several meshes");
    qw_gltf_level *level = QW_NEW(call->env, qw_gltf_level, call->count);
    const qw_asset_look **look = QW_NEW(call->env, const qw_asset_look *, call->count);
    int32_t materials = 0; /* of the levels before */
    for (uint32_t i = 0; i < call->count; i++) {
        const qw_mesh *m = call->levels[i];
        if (!m || !m->is_whole) qw_fail(call->env, QW_ARGUMENT, i, "level %u is no mesh", i);
        if (!m->look != !call->levels[0]->look)
            qw_fail(call->env, QW_ARGUMENT, i, "level %u %s maps, unlike the first", i, m->look ? "has" : "has no");
        level[i] = (qw_gltf_level){&m->view, m->attribute, m->attribute_count};
        look[i] = m->look;
        if (!m->look) continue;
        level[i].attributes = number_materials(call->env, m, materials);
        materials += (int32_t)(m->look->tiles * m->look->alphas);
    }
    const qw_gltf_rest *pictures = look[0]        ? qw_gltf_of_looks(call->env, look, call->count, true)
                                   : call->source ? call->source->gltf
                                                  : NULL;
    qw_file *file = qw_file_begin(call->env, call->path);
    qw_put_gltf_levels(call->env, file, is_glb, level, call->count, pictures);
    qw_file_finish(file);
}

qw_status qw_save_levels(const qw_mesh *const *levels, uint32_t count, const qw_mesh *source, const char *path,
                         qw_format format, char *message, size_t message_size)
{
    if (message && message_size) message[0] = 0;
    save_call call = {.env = qw_env_create(NULL, 1),
                      .levels = levels,
                      .count = count,
                      .source = source,
                      .path = path,
                      .format = format};
    qw_status status = call.env ? qw_protect(call.env, save_levels, &call) : QW_MEMORY;
    if (status != QW_OK && message && message_size)
        snprintf(message, message_size, "%s", call.env ? qw_env_message(call.env) : qw_status_text(QW_MEMORY));
    qw_env_destroy(call.env);
    return status;
}

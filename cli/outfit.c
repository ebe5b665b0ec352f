#include "outfit.h"

#include <stdlib.h>
#include <string.h>

/* Besides what is carried over: normals, what was filled, texture coordinates. */
enum { MOST_ADDED = 3 };

/* Takes out all attributes of a kind. */
static void drop(qw_outfit *o, qw_attribute_kind kind)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < o->count; i++)
        if (o->list[i].kind != kind) o->list[kept++] = o->list[i];
    o->count = kept;
}

/* Carries the attributes of the input to the result and begins the outfit's list with them; with --bare none. */
static qw_status carry(qw_context *context, const qw_arguments *a, const qw_mesh *input, qw_outfit *o)
{
    uint32_t count = 0;
    const qw_attribute *of_input = qw_mesh_attributes(a->bare ? NULL : input, &count), *carried = NULL;
    qw_status status = count > 0 ? qw_transfer(context, of_input, count, 0, &carried, &o->transfer) : QW_OK;
    if (status != QW_OK) return status;
    o->list = malloc((count + (size_t)MOST_ADDED) * sizeof *o->list);
    if (!o->list) return QW_MEMORY;
    for (uint32_t i = 0; i < count; i++) o->list[o->count++] = carried[i];
    o->has_transfer = count > 0;
    return QW_OK;
}

/* Normals of the quads, or none, instead of what the input has. */
static qw_status settle_normals(qw_context *context, qw_normals wanted, qw_outfit *o)
{
    if (wanted == QW_NORMALS_CARRIED) return QW_OK;
    drop(o, QW_NORMALS);
    if (wanted == QW_NORMALS_NONE) return QW_OK;
    qw_shading shading = wanted == QW_NORMALS_SPLIT ? QW_SHADING_SPLIT : QW_SHADING_SMOOTH;
    return qw_get_normals(context, shading, &o->list[o->count++]);
}

static bool has_label(const qw_outfit *o, const char *name)
{
    for (uint32_t i = 0; i < o->count; i++)
        if (strcmp(o->list[i].name, name) == 0) return true;
    return false;
}

/* Which faces lie in holes that were closed: a property of PLY, else groups, or, in glTF, materials, where the input
   has none. */
static qw_status mark_filled(qw_context *context, const qw_arguments *a, qw_outfit *o)
{
    bool is_scene = a->format == QW_FORMAT_GLB || a->format == QW_FORMAT_GLTF;
    const char *name = a->format == QW_FORMAT_PLY ? "filled" : is_scene ? "material" : "group";
    if (a->bare || qw_get_report(context)->filled_holes == 0 || has_label(o, name)) return QW_OK;
    qw_status status = qw_get_filled(context, &o->list[o->count]);
    if (status == QW_OK) o->list[o->count++].name = name;
    return status;
}

/* Labels of materials are borders of charts, unless maps make one material of all. */
static const int32_t *find_borders(const qw_outfit *o)
{
    const int32_t *borders = NULL;
    for (uint32_t i = 0; i < o->count; i++)
        if (o->list[i].kind == QW_LABELS && o->list[i].domain == QW_PER_FACE &&
            strcmp(o->list[i].name, "material") == 0)
            borders = o->list[i].labels;
    return borders;
}

/* Texture coordinates of the result's own instead of those of the input, and maps on them. */
static qw_status settle_uv(qw_context *context, const qw_arguments *a, const qw_mesh *input, qw_outfit *o)
{
    const qw_image *images;
    uint32_t count;
    if (!a->unwrap && !a->bake) return QW_OK;
    drop(o, QW_UVS);
    qw_status status = qw_unwrap(context, &a->asset, a->bake ? NULL : find_borders(o), &o->list[o->count], &o->asset);
    if (status != QW_OK) return status;
    o->count++, o->has_asset = true;
    return a->bake ? qw_bake(context, input, a->maps, &images, &count, &o->asset) : QW_OK;
}

qw_status qw_dress(qw_context *context, const qw_arguments *a, const qw_mesh *input, qw_outfit *o)
{
    qw_status status = carry(context, a, input, o);
    if (status == QW_OK) status = settle_normals(context, a->normals, o);
    if (status == QW_OK) status = mark_filled(context, a, o);
    if (status == QW_OK) status = settle_uv(context, a, input, o);
    return status;
}

void qw_undress(qw_outfit *o)
{
    free(o->list);
    o->list = NULL, o->count = 0;
}

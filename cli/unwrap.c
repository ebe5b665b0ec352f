#include "commands.h"

#include <stdlib.h>
#include <string.h>

/* Labels of materials are borders of charts, unless maps make one material of all. */
static const int32_t *find_borders(const qw_attribute *attributes, uint32_t count)
{
    const int32_t *borders = NULL;
    for (uint32_t i = 0; i < count; i++)
        if (attributes[i].kind == QW_LABELS && attributes[i].domain == QW_PER_FACE &&
            strcmp(attributes[i].name, "material") == 0)
            borders = attributes[i].labels;
    return borders;
}

qw_status qw_unwrap_carried(qw_context *context, const qw_arguments *a, const qw_attribute *carried, uint32_t *count,
                            qw_attribute **list, qw_asset_report *report)
{
    uint32_t kept = 0;
    qw_attribute *all = *list = malloc((*count + (size_t)1) * sizeof *all);
    const int32_t *borders = a->bake ? NULL : find_borders(carried, *count);
    if (!all) return QW_MEMORY;
    for (uint32_t i = 0; i < *count; i++)
        if (carried[i].kind != QW_UVS) all[kept++] = carried[i];
    qw_status status = qw_unwrap(context, &a->asset, borders, &all[kept], report);
    *count = status == QW_OK ? kept + 1 : 0;
    return status;
}

static bool has_label(const qw_attribute *attributes, uint32_t count, const char *name)
{
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(attributes[i].name, name) == 0) return true;
    return false;
}

qw_status qw_mark_filled(qw_context *context, const qw_arguments *a, const qw_attribute *carried, uint32_t *count,
                         qw_attribute **list)
{
    bool is_scene = a->format == QW_FORMAT_GLB || a->format == QW_FORMAT_GLTF;
    const char *name = a->format == QW_FORMAT_PLY ? "filled" : is_scene ? "material" : "group";
    *list = NULL;
    if (a->bare || qw_get_report(context)->filled_holes == 0 || has_label(carried, *count, name)) return QW_OK;
    qw_attribute *all = *list = malloc((*count + (size_t)1) * sizeof *all);
    if (!all) return QW_MEMORY;
    for (uint32_t i = 0; i < *count; i++) all[i] = carried[i];
    qw_status status = qw_get_filled(context, &all[*count]);
    all[*count].name = name;
    if (status == QW_OK) ++*count;
    return status;
}

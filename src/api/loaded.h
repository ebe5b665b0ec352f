/* A mesh that was read from a file. */
#pragma once

#include "io/soup.h"

struct qw_mesh {
    qw_env *env; /* owns all */
    qw_mesh_view view;
    const qw_attribute *attribute; /* qw_attribute[attribute_count] */
    uint32_t attribute_count;
    const char *path;                 /* of its file; or NULL */
    const char *library;              /* OBJ; or NULL */
    const qw_gltf_rest *gltf;         /* glTF; or NULL */
    const struct qw_asset_look *look; /* of a level with maps; or NULL */
    qw_mesh *part;                    /* qw_mesh[parts]: the files that it is joined of; or NULL */
    uint32_t parts;
    bool is_whole; /* false: reading it failed */
};

/* Sets view and attributes of a mesh by its parts. */
void qw_join_parts(qw_env *env, qw_mesh *whole);
uint32_t qw_count_part_materials(const qw_mesh *part);

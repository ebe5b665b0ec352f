/* Meshes that tests load, and their attributes. */
#ifndef QW_TESTS_LOADED_H
#define QW_TESTS_LOADED_H

#include "quadwright/quadwright.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static inline qw_mesh *load_text(const char *text)
{
    qw_mesh *mesh;
    qw_status status = qw_load_memory(text, strlen(text), NULL, &mesh);
    if (status != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    return mesh;
}

static inline qw_mesh *load_file(const char *path)
{
    qw_mesh *mesh;
    qw_status status = qw_load(path, NULL, &mesh);
    if (status != QW_OK) fail_msg("%s", qw_mesh_message(mesh));
    return mesh;
}

/* NULL where the mesh has none of this name. */
static inline const qw_attribute *named(const qw_mesh *mesh, const char *name)
{
    uint32_t count;
    const qw_attribute *a = qw_mesh_attributes(mesh, &count);
    for (uint32_t i = 0; i < count; i++)
        if (strcmp(a[i].name, name) == 0) return &a[i];
    return NULL;
}

#endif

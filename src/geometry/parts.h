/* The connected components of a surface one by one: their faces, and each as a surface of its own. Taking all of them
 * costs as much as going over the surface once. */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_parts {
    const qw_trimesh *mesh;
    uint32_t count;
    uint32_t *face;    /* uint32_t[mesh->face_count], by component, in their order */
    uint32_t *begin;   /* uint32_t[count + 1]: where those of each begin */
    uint32_t *number;  /* uint32_t[mesh->face_count]: of each face among those of its component */
    uint32_t *vertex;  /* uint32_t[mesh->vertex_count], scratch: number of a vertex in the part taken last */
    uint32_t *visited; /* uint32_t[mesh->vertex_count], scratch: `taken` when a vertex was last taken */
    uint32_t taken;    /* parts so far */
} qw_parts;

/* component: uint32_t[mesh->face_count], below `count`. In the current scope. */
qw_parts qw_sort_parts(qw_env *env, const qw_trimesh *mesh, const uint32_t *component, uint32_t count);

/* One component with positions, corners and twins; vertices are numbered as its faces name them. In the current scope.
 */
qw_trimesh qw_take_part(qw_env *env, qw_parts *parts, uint32_t component);

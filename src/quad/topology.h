/* Whether the quads have the topology of the surface, where they lost it, and the last resort for a part that cannot be had otherwise. */
#ifndef QW_QUAD_TOPOLOGY_H
#define QW_QUAD_TOPOLOGY_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"
#include "quad/extract.h"

typedef struct qw_topology_check {
    uint32_t component_count; /* of the surface */
    uint32_t broken_count;
    uint8_t *broken; /* uint8_t[component_count]: pieces, Euler characteristic or boundary loops differ, or there are faces or edges on the
                        same vertices as others */
} qw_topology_check;

/* surface: what the quads were made from (its components numbered by their first faces, as quads->component says). */
qw_topology_check qw_check_topology(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface);

/* Points at which the contraction lost something: classes that are no disc and do not show as exactly one vertex of the quads, triangles left turned
   over, and one point of each component that has no quads. point, size: qw_vec3[*count] and wanted edge length there. */
typedef struct qw_losses {
    uint32_t count;
    qw_vec3 *point;
    float *size;
} qw_losses;
qw_losses qw_find_losses(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x);

/* Last resort: the broken components are made anew from their own triangles, coarsened with exact topology and cut into three quads each. Their
   connectivity is always right and never pretty. size: float[surface->vertex_count], wanted edge length. */
qw_quadmesh qw_replace_components(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const float *size,
                                  const qw_topology_check *check);

#endif

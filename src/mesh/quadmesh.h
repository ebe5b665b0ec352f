/* Quad meshes as they leave extraction. Half-edge h = 4 f + i goes from corner[h] to corner[4 f + (i + 1) % 4]. */
#ifndef QW_MESH_QUADMESH_H
#define QW_MESH_QUADMESH_H

#include "base/env.h"
#include "math/vec.h"

/* What a vertex may do when the mesh is relaxed. */
enum { QW_VERTEX_FREE = 0, QW_VERTEX_CURVE = 1, QW_VERTEX_CORNER = 2 };

typedef struct qw_quadmesh {
    uint32_t vertex_count, face_count;
    qw_vec3 *position; /* qw_vec3[vertex_count] */
    uint32_t *corner;  /* uint32_t[4 face_count] */
    uint32_t *twin;    /* uint32_t[4 face_count], half-edge or QW_NONE; NULL until linked */
    uint8_t *kind;     /* uint8_t[vertex_count], QW_VERTEX_; may be NULL: all free */
    uint8_t *mark;     /* uint8_t[4 face_count], QW_MARK_FEATURE on edges that lie on a sharp edge of the input; may be NULL */
} qw_quadmesh;

static inline uint32_t qw_quad_next(uint32_t h) { return (h & ~3u) | ((h + 1) & 3u); }
static inline uint32_t qw_quad_prev(uint32_t h) { return (h & ~3u) | ((h + 3) & 3u); }

#endif

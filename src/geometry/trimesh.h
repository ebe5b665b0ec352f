/* Triangle surfaces: oriented, edge- and vertex-manifold (with boundary), as every stage after cleaning sees them.
 *
 *     half-edge h = 3 f + i of triangle f goes from corner[h] to corner[qw_next(h)]
 *     twin[h] is the half-edge that goes the other way in the neighbour, or QW_NONE on the boundary
 *
 *              corner[3f+2]
 *                 /  \            half-edge 3f   : corner[3f]   -> corner[3f+1]
 *           3f+2 /    \ 3f+1      half-edge 3f+1 : corner[3f+1] -> corner[3f+2]
 *               /  f   \          half-edge 3f+2 : corner[3f+2] -> corner[3f]
 *   corner[3f] ----3f---- corner[3f+1]
 */
#pragma once

#include "base/env.h"
#include "base/vec.h"

/* Bits of `mark`, one byte a half-edge; the two half-edges of an edge carry the same bits. */
enum qw_mark_flag {
    QW_MARK_FEATURE = 1,
    QW_MARK_RING = 2, /* beside QW_MARK_FEATURE: of the curve of a nest (remesh/sizes/nests.h), which has no corners */
    QW_MARKS = QW_MARK_FEATURE | QW_MARK_RING
};
/* Whether an edge with these bits may be sharp: rings lie on smooth surfaces. */
static inline bool qw_is_hard(uint8_t mark) { return (mark & QW_MARKS) == QW_MARK_FEATURE; }

/* Feature constraint of a vertex. A curve is a chain of marked or boundary edges (geometry/corners.h). */
typedef enum qw_vertex_kind {
    QW_VERTEX_FREE,   /* on no curve */
    QW_VERTEX_CURVE,  /* inside one curve: it may slide along it */
    QW_VERTEX_CORNER, /* where curves end, meet or turn sharply: it stays */
} qw_vertex_kind;

typedef struct qw_trimesh {
    uint32_t vertex_count, face_count;
    qw_vec3 *position; /* qw_vec3[vertex_count], centred frame */
    uint32_t *corner;  /* uint32_t[3 face_count], vertex */
    uint32_t *twin;    /* uint32_t[3 face_count], half-edge or QW_NONE */
    uint8_t *mark;     /* uint8_t[3 face_count], QW_MARK_ bits; may be NULL: none set */
    uint8_t *point; /* uint8_t[vertex_count], 1: a feature by itself (feature_points.h); may be NULL: there is none */
    /* uint32_t[face_count], as of a census, for trees in which a part asks for its own component only (bvh.h); that of
       others; may be NULL */
    const uint32_t *component;
} qw_trimesh;

static inline uint32_t qw_next(uint32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }
static inline uint32_t qw_prev(uint32_t h) { return h % 3 == 0 ? h + 2 : h - 1; }

/* p = (q - center) * scale takes the input's coordinates to the centred frame. */
typedef struct qw_frame {
    double center[3];
    double scale;
} qw_frame;

static inline qw_vec3 qw_in_frame(const qw_frame *frame, const double p[3])
{
    return qw_v3((float)((p[0] - frame->center[0]) * frame->scale), (float)((p[1] - frame->center[1]) * frame->scale),
                 (float)((p[2] - frame->center[2]) * frame->scale));
}

/* Finds twin from corner. Fails with QW_INTERNAL where an edge has more than two sides or two of the same direction. */
void qw_trimesh_link(qw_env *env, qw_trimesh *mesh);

/* Everything a stage may rely on: indices in range, twins mutual and opposite, no face with a repeated vertex, one fan
   a vertex, no isolated vertex, marks equal on both sides. Fails with QW_INTERNAL naming the element. Called at stage
   borders in debug. */
void qw_trimesh_validate(qw_env *env, const qw_trimesh *mesh);

/* One outgoing half-edge a vertex: on the boundary the one from which qw_prev/twin turns sweep the whole fan
   counter-clockwise, that is, the half-edge whose own twin is QW_NONE. uint32_t[vertex_count]. */
uint32_t *qw_trimesh_outgoing(qw_env *env, const qw_trimesh *mesh);
/* The next outgoing half-edge counter-clockwise around the tail of h, or QW_NONE past the last. */
static inline uint32_t qw_around(const qw_trimesh *mesh, uint32_t h) { return mesh->twin[qw_prev(h)]; }

typedef struct qw_census {
    int64_t vertices, edges, faces, components, boundary_loops, euler;
    uint32_t *component; /* uint32_t[face_count]: component of each face; the caller's scope */
} qw_census;
qw_census qw_trimesh_census(qw_env *env, const qw_trimesh *mesh);
/* The same where it is known which component each face is in. */
qw_census qw_trimesh_census_of(qw_env *env, const qw_trimesh *mesh, uint32_t *component, uint32_t components);
/* One number for each component, of its boundary loops and its Euler number: uint64_t[census->components], sorted. */
uint64_t *qw_list_topologies(qw_env *env, const qw_trimesh *mesh, const qw_census *census);
/* Numbers components in the order of their first faces; returns how many there are. twin: uint32_t[sides face_count],
   where a face has 3 or 4 sides; component: uint32_t[face_count]. */
uint32_t qw_label_components(qw_env *env, uint32_t sides, const uint32_t *twin, uint32_t face_count,
                             uint32_t *component);

/* The boundary half-edge that starts where the boundary half-edge h ends. */
static inline uint32_t qw_next_on_boundary(const qw_trimesh *mesh, uint32_t h)
{
    for (h = qw_next(h); mesh->twin[h] != QW_NONE;) h = qw_next(mesh->twin[h]);
    return h;
}

/* Whether a feature curve runs along the edge of h: a sharp edge, or a boundary edge where those count. */
static inline bool qw_is_curve_edge(const qw_trimesh *mesh, uint32_t h, bool with_boundary)
{
    return mesh->twin[h] == QW_NONE ? with_boundary : mesh->mark && (mesh->mark[h] & QW_MARK_FEATURE);
}
/* True for one of the half-edges of each edge. */
static inline bool qw_stands_for_edge(const qw_trimesh *mesh, uint32_t h)
{
    return mesh->twin[h] == QW_NONE || h < mesh->twin[h];
}

/* Normal to the triangle, its length twice the triangle's area. */
static inline qw_vec3 qw_triangle_cross(const qw_vec3 *position, const uint32_t *corner)
{
    qw_vec3 a = position[corner[0]];
    return qw_cross(qw_sub(position[corner[1]], a), qw_sub(position[corner[2]], a));
}
static inline qw_vec3 qw_face_cross(const qw_trimesh *mesh, uint32_t f)
{
    return qw_triangle_cross(mesh->position, mesh->corner + 3 * f);
}
static inline qw_vec3 qw_edge_way(const qw_trimesh *mesh, uint32_t h) /* from the tail of h to its head */
{
    return qw_sub(mesh->position[mesh->corner[qw_next(h)]], mesh->position[mesh->corner[h]]);
}
static inline float qw_edge_length(const qw_trimesh *mesh, uint32_t h)
{
    return qw_distance(mesh->position[mesh->corner[h]], mesh->position[mesh->corner[qw_next(h)]]);
}
/* The angle of a triangle at the corner of h, in [0, pi]. position, corner: those of its mesh. */
static inline double qw_corner_angle(const qw_vec3 *position, const uint32_t *corner, uint32_t h)
{
    return qw_angle_at(position[corner[h]], position[corner[qw_next(h)]], position[corner[qw_prev(h)]]);
}
double qw_trimesh_area(const qw_trimesh *mesh);
/* Unit normals weighted by area: qw_vec3[face_count], qw_vec3[vertex_count]. Zero-area faces have normal 0. */
qw_vec3 *qw_face_normals(qw_env *env, const qw_trimesh *mesh);
qw_vec3 *qw_vertex_normals(qw_env *env, const qw_trimesh *mesh);

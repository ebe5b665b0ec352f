/* Integer offsets on the edges of a triangle mesh (paper, Definition 3.1 and Equations (3), (4)).
 *
 * Each edge e has its own frame and an integer offset d[e] in it. Each half-edge h carries rot[h], so that the vector
 * along h in the frame of its triangle is R2(rot[h]) d[edge[h]]; the two half-edges of an edge run opposite ways, and
 * rot contains the 180 degrees for that. Everything after this file needs only rot and d, for every triangle f:
 *
 *     Eq. (3), regularity    R2(rot[3f]) d + R2(rot[3f+1]) d + R2(rot[3f+2]) d = 0
 *     Eq. (4), orientation   det(R2(rot[3f]) d, R2(rot[3f+1]) d) >= 0     (twice the area in quads)
 *
 * The triangle's frame is that of one of its corners. Where the field turns around a triangle (an orientation
 * singularity) the three corners' frames do not agree; the triangle's frame is then chosen so that all of the turn
 * appears at one corner, the cone. index[v] is the sum of the turns that were laid on v: a vertex of the quad mesh
 * with valence 4 - index.
 */
#pragma once

#include "base/rosy.h"
#include "geometry/trimesh.h"

typedef struct qw_real2 {
    float x, y;
} qw_real2;

enum qw_fixed_flag { QW_FIXED_X = 1, QW_FIXED_Y = 2 };
/* Of the bits of an edge: whether its x (k even) or its y is fixed. */
static inline bool qw_is_fixed(uint8_t bits, uint32_t k) { return bits & (k % 2 ? QW_FIXED_Y : QW_FIXED_X); }

typedef struct qw_offset_mesh {
    uint32_t vertex_count, face_count, edge_count;
    uint32_t *corner, *twin; /* uint32_t[3 face_count], as in qw_trimesh */
    uint32_t *edge;          /* uint32_t[3 face_count], edge of each half-edge */
    uint8_t *rot;            /* uint8_t[3 face_count], 0..3 */
    uint8_t *mark;           /* uint8_t[3 face_count], QW_MARK_ bits */
    uint32_t *half;          /* uint32_t[edge_count], the half-edge that set the edge's frame */
    qw_int2 *d;              /* qw_int2[edge_count] */
    qw_real2 *real; /* qw_real2[edge_count], the edge itself in its frame, in wanted lengths: what d would be if it were
                       not whole */
    uint8_t *fixed; /* uint8_t[edge_count], QW_FIXED_ bits: this component is constrained to 0 (curves stay on lattice
                       lines) */
    qw_vec3 *axis;  /* qw_vec3[edge_count], x axis of the edge's frame in space (unit) */
    qw_vec3 *side;  /* qw_vec3[edge_count], y axis */
    qw_vec3 *position;   /* qw_vec3[vertex_count], on the surface */
    qw_vec3 *normal;     /* qw_vec3[vertex_count], unit */
    qw_vec3 *lattice;    /* qw_vec3[vertex_count], the position field p, or the vertices themselves */
    float *size;         /* float[vertex_count], wanted edge length */
    uint8_t *constraint; /* uint8_t[vertex_count], qw_vertex_kind */
    qw_vec3 *direction;  /* qw_vec3[vertex_count], tangent of the curve or 0 */
    int8_t *index;       /* int8_t[vertex_count], quarter turns */
} qw_offset_mesh;

/* A copy that shares nothing. */
qw_offset_mesh qw_offset_copy(qw_env *env, const qw_offset_mesh *m);
/* A copy of what making offsets regular changes: d, real, fixed, size, constraint and direction; the rest is shared. */
qw_offset_mesh qw_offset_branch(qw_env *env, const qw_offset_mesh *m);

static inline qw_real2 qw_turn_real(unsigned k, qw_real2 d)
{
    switch (k & 3u) {
    case 0: return d;
    case 1: return (qw_real2){-d.y, d.x};
    case 2: return (qw_real2){-d.x, -d.y};
    default: return (qw_real2){d.y, -d.x};
    }
}

/* The vector along h in its triangle's frame. */
static inline qw_int2 qw_offset_along(const qw_offset_mesh *m, uint32_t h)
{
    return qw_turn(m->rot[h], m->d[m->edge[h]]);
}
/* Eq. (3): zero where the triangle encloses no position singularity. */
static inline qw_int2 qw_offset_residual(const qw_offset_mesh *m, uint32_t f)
{
    return qw_int2_add(qw_int2_add(qw_offset_along(m, 3 * f), qw_offset_along(m, 3 * f + 1)),
                       qw_offset_along(m, 3 * f + 2));
}
/* Eq. (4) for a regular triangle. */
static inline int32_t qw_offset_det(const qw_offset_mesh *m, uint32_t f)
{
    return qw_int2_det(qw_offset_along(m, 3 * f), qw_offset_along(m, 3 * f + 1));
}

/* The x and y axes in space of the frame of h's triangle, from the frame of its edge. (rot also has the 180 degrees of
   a half-edge that runs against its edge; those turn the vector, not the frame.) */
void qw_offset_axes(const qw_offset_mesh *m, uint32_t h, qw_vec3 *x, qw_vec3 *y);

typedef struct qw_offset_counts {
    int64_t singular_vertices;   /* index other than 0 */
    int64_t index_sum;           /* of all vertices */
    int64_t irregular_triangles; /* Eq. (3) broken: position singularities */
    int64_t inverted_triangles;  /* regular, but Eq. (4) broken */
    int64_t long_edges;          /* a component beyond 1 */
    int64_t double_area;         /* sum of the determinants: twice the number of quads where Eq. (4) holds */
} qw_offset_counts;
qw_offset_counts qw_offset_count(const qw_offset_mesh *m);

/* Fails with QW_INTERNAL where edge, twin, rot and half disagree, or where a fixed component is not 0. */
void qw_offset_validate(qw_env *env, const qw_offset_mesh *m);

/* Polygon meshes as a host gives them: edges, valences and points, in double precision. */
#pragma once

#include "geometry/trimesh.h"

#include <math.h>

/* The edges of any polygon mesh, manifold or not. Half-edge c goes from corners[c] to the next corner of its face.
   An edge is a pair of vertices, whatever the number of half-edges on it. */
typedef struct qw_polygon_edges {
    uint32_t corner_count, edge_count;
    uint32_t *face_begin; /* uint32_t[face_count + 1]: corners of face f are face_begin[f] .. face_begin[f + 1] - 1 */
    uint32_t *face;       /* uint32_t[corner_count]: face of each corner */
    uint32_t *sorted;     /* uint32_t[corner_count]: half-edges by lower vertex, then higher vertex, then number */
    uint32_t *edge_begin; /* uint32_t[edge_count + 1]: half-edges of edge e are sorted[edge_begin[e]] .. */
} qw_polygon_edges;

/* Fails with QW_INDEX_RANGE, QW_TOO_LARGE or QW_ARGUMENT where the view breaks its own rules. */
qw_polygon_edges qw_find_polygon_edges(qw_env *env, const qw_mesh_view *mesh);

/* The next corner of the same face. */
static inline uint32_t qw_polygon_next(const qw_polygon_edges *edges, uint32_t corner)
{
    uint32_t f = edges->face[corner];
    return corner + 1 == edges->face_begin[f + 1] ? edges->face_begin[f] : corner + 1;
}

/* As qw_find_twins, of the half-edges of polygons. */
uint32_t *qw_polygon_twins(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, uint32_t *fault);

/* Valence of each vertex (edges that end there) and whether it lies on an edge of one face only. */
typedef struct qw_valences {
    uint32_t *valence;    /* uint32_t[vertex_count], 0 for isolated vertices */
    uint8_t *on_boundary; /* uint8_t[vertex_count] */
} qw_valences;
/* Arrays of zeros, and what counts into them: the second allocates nothing. */
qw_valences qw_begin_valences(qw_env *env, const qw_mesh_view *mesh);
void qw_count_valences(const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_valences *v);
/* Both in one. */
qw_valences qw_find_valences(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges);

/* Double precision, for figures that must not depend on where the coordinates lie. */
typedef struct qw_dvec3 {
    double x, y, z;
} qw_dvec3;

static inline qw_dvec3 qw_dsub(qw_dvec3 a, qw_dvec3 b) { return (qw_dvec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline qw_dvec3 qw_dscale(qw_dvec3 a, double s) { return (qw_dvec3){a.x * s, a.y * s, a.z * s}; }
static inline double qw_ddot(qw_dvec3 a, qw_dvec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double qw_dlength(qw_dvec3 a) { return sqrt(qw_ddot(a, a)); }
static inline qw_dvec3 qw_dcross(qw_dvec3 a, qw_dvec3 b)
{
    return (qw_dvec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline qw_dvec3 qw_dpoint(const qw_mesh_view *mesh, uint32_t vertex, double scale)
{
    const double *p = mesh->positions + 3 * (size_t)vertex;
    return (qw_dvec3){p[0] * scale, p[1] * scale, p[2] * scale};
}

/* A frame in which both (other may be NULL) have a box of half to one quarter; its scale is a power of two. Vertices
   that no face uses do not count. */
qw_frame qw_common_frame(const qw_mesh_view *mesh, const qw_mesh_view *other);

/* The value below which the share (0 to 1) of the values lies, between neighbours linearly. Values are not negative,
 * count not 0. */
double qw_percentile(const float *values, size_t count, double share);

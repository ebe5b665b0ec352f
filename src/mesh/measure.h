/* What a polygon mesh is worth (DESIGN 7): topology, quality, and distances to the surface it stands for. */
#ifndef QW_MESH_MEASURE_H
#define QW_MESH_MEASURE_H

#include "base/env.h"

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

/* Valence of each vertex (edges that end there) and whether it lies on an edge of one face only. */
typedef struct qw_valences {
    uint32_t *valence;    /* uint32_t[vertex_count], 0 for isolated vertices */
    uint8_t *on_boundary; /* uint8_t[vertex_count] */
} qw_valences;
qw_valences qw_find_valences(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges);

/* Fills both. against may be NULL: distances and flipped_faces are then negative, as are the figures of quads in a mesh
   without any. Non-manifold vertices count as one vertex a fan in euler, and their fans apart in boundary_loops.
   Lengths are given in mean edges of the quads, or of all faces where there is no quad. The same input gives the same
   figures at any thread count. */
void qw_measure_mesh(qw_env *env, const qw_mesh_view *mesh, const qw_mesh_view *against, qw_topology *topology,
                     qw_quality *quality);

#endif

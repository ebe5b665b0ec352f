/* The feature curves of a surface as a graph. An arc is a curve from one node to the next, or closed; a node is a
 * vertex where curves end or meet, where one turns by more than 45 degrees, or where what becomes of it changes
 * (verdict.h).
 *
 *      o-------------o      nodes o; three arcs of a ledge end at each of its corners
 *      |   ledge     |
 *      o-------------o
 */
#pragma once

#include "remesh/features/verdict.h"
#include "geometry/trimesh.h"

typedef struct qw_feature_arc {
    uint32_t begin, count; /* its edges: qw_feature_graph.half[begin] .. half[begin + count - 1] */
    uint32_t node[2];      /* vertices where it ends, one twice where it comes back; QW_NONE: it is closed */
    float length;          /* in units of the mesh */
    float strength; /* length times 1 - the cosine of the turn across it, summed; INFINITY with edges of the boundary */
} qw_feature_arc;

typedef struct qw_feature_graph {
    uint32_t arc_count;
    qw_feature_arc *arc; /* qw_feature_arc[arc_count], by their lowest half-edges */
    uint32_t *half;      /* uint32_t[edges]: the lower half-edge of each edge; ascending within an arc */
    uint32_t *arc_of;    /* uint32_t[3 faces]: the same on both sides; QW_NONE: no arc */
    uint32_t *degree;    /* uint32_t[vertices]: edges of arcs at a vertex */
} qw_feature_graph;

/* Edges whose verdict is in the set, with arcs that have one verdict each. verdict: uint8_t[3 face_count],
   qw_curve_verdict, the same on both sides. In the current scope. */
qw_feature_graph qw_feature_graph_build(qw_env *env, const qw_trimesh *mesh, const uint8_t *verdict, unsigned set);

/* uint8_t[3 face_count]: KEPT along feature edges and, where those count, the boundary; else NONE. */
uint8_t *qw_all_curves_kept(qw_env *env, const qw_trimesh *mesh, bool with_boundary);

/* Whether the verdicts are those of the mesh: KEPT along its curves, boundary and all, and there only, and the same on
   both sides. */
bool qw_are_verdicts_of(const qw_trimesh *mesh, const uint8_t *verdict);

/* Whether two arcs end at one node: side by side they are an acute corner. */
bool qw_arcs_share_node(const qw_feature_graph *graph, uint32_t a, uint32_t b);

/* Lists the edges of arcs at a vertex, each by the half-edge that leaves it or, for the last of an open fan, comes in.
   outgoing: of the mesh; half: room for degree[v]. Returns degree[v]. */
uint32_t qw_curves_at(const qw_feature_graph *graph, const qw_trimesh *mesh, const uint32_t *outgoing, uint32_t v,
                      uint32_t *half);

static inline uint32_t qw_lower_half(const qw_trimesh *mesh, uint32_t h)
{
    uint32_t t = mesh->twin[h];
    return t < h ? t : h;
}

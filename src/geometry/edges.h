/* Sides of triangles or quads gathered by edge, for surfaces of which nothing is known yet: any number of sides may
 * share an edge.
 *
 * A side is a half-edge h = 3 f + i as in trimesh.h, or 4 f + i as in quadmesh.h. Sides lie in buckets by the lower of
 * their two vertices, and inside a bucket by upper vertex, then half-edge, so that the sides of one edge are
 * neighbours:
 *
 *     for (uint32_t v = 0; v < vertex_count; v++)
 *         for (uint32_t i = edges.begin[v], end; i < edges.begin[v + 1]; i = end) {
 *             end = qw_edge_end(&edges, i, edges.begin[v + 1]);
 *             ... side[i] .. side[end - 1] are the sides of one edge
 *         }
 */
#pragma once

#include "base/env.h"

typedef struct qw_edges {
    uint32_t *begin; /* uint32_t[vertex_count + 1] */
    uint64_t *side;  /* uint64_t[begin[vertex_count]]: upper vertex << 32 | half-edge */
} qw_edges;

/* corner: uint32_t[sides face_count], sides 3 or 4. Faces with a side from a vertex to itself have no sides. */
qw_edges qw_edges_build(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count,
                        uint32_t vertex_count);
void qw_edges_free(qw_env *env, qw_edges *edges);

/* uint32_t[sides face_count]: for each half-edge the other one of its edge, where that has just two, of opposite
 * directions; QW_NONE: it is a boundary. *fault: a half-edge of an edge of more, or of two of one direction, or of a
 * face without sides; QW_NONE: there is none. In the caller's scope. */
uint32_t *qw_find_twins(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count, uint32_t vertex_count,
                        uint32_t *fault);

static inline uint32_t qw_side_half(uint64_t side) { return (uint32_t)side; }
static inline uint32_t qw_side_upper(uint64_t side) { return (uint32_t)(side >> 32); }

/* One past the last side of the edge that side i belongs to; limit: the end of its bucket. */
static inline uint32_t qw_edge_end(const qw_edges *edges, uint32_t i, uint32_t limit)
{
    uint32_t upper = qw_side_upper(edges->side[i]);
    while (++i < limit && qw_side_upper(edges->side[i]) == upper) continue;
    return i;
}

static inline int qw_repeats_vertex(const uint32_t *c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; }

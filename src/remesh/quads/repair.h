/* Repair of the quads' connectivity: what the promise forbids and contraction may leave behind, removed without
 * changing the topology.
 * - Doublets: an interior vertex of valence 2 (or 1). The quad's diagonal is closed, and the vertex goes.
 * - Double edges: two edges (or faces) on the same vertices, or an edge from a vertex to itself, where a part is only
 * one or two quads around. The chord through one of them is split lengthwise if it is short, which adds a row; else
 * one of the ends becomes two vertices with a quad in between, which adds irregular vertices.
 */
#pragma once

#include "geometry/quadmesh.h"

typedef struct qw_repair_counts {
    int64_t doublets;     /* diagonals closed */
    int64_t split_chords; /* rows added */
} qw_repair_counts;

/* A new mesh; the positions of vertices that stay are not changed. room: how many quads chords may add. Where a double
   edge stays nevertheless remesh/quads/topology.h makes its component anew. */
qw_quadmesh qw_repair_quads(qw_env *env, const qw_quadmesh *mesh, int64_t room, qw_repair_counts *counts);

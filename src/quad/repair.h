/* Repair of the quads' connectivity: what the promise forbids and contraction can leave behind, mended with exact
 * topology.
 *
 * doublets: an interior vertex of valence 2 (or 1): the quad's diagonal is closed and the vertex goes.
 * double edges: two edges (or faces) on the same vertices, or an edge from a vertex to itself, where a part is only one
 * or two quads around: the chord of quads through one of them is split lengthwise, which adds a row and never changes
 * the topology, if it is short; else one of their ends becomes two vertices with a quad in between, which adds
 * irregular vertices.
 */
#ifndef QW_QUAD_REPAIR_H
#define QW_QUAD_REPAIR_H

#include "mesh/quadmesh.h"

typedef struct qw_repair_counts {
    int64_t doublets;     /* diagonals closed */
    int64_t split_chords; /* rows added */
} qw_repair_counts;

/* A new mesh; the positions of vertices that stay are not changed. room: how many quads chords may add. Where a double
   edge stays nevertheless quad/topology.h makes its component anew. */
qw_quadmesh qw_repair_quads(qw_env *env, const qw_quadmesh *mesh, int64_t room, qw_repair_counts *counts);

#endif

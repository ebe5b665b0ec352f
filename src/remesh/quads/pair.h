/* Quads from any triangles, two by two, never losing the topology: for what extraction cannot make quads of.
 *
 * Pairs that are given stay where they can. Others are taken by quality; then each triangle that is left over walks
 * through pairs to another one: it takes the near triangle of a pair and sets the far one free, or, where it must leave
 * by a side of the near one, an edge of the three is flipped first. So two triangles left over can meet wherever the
 * surface between them is in one piece. Curves are not walked across: where a piece between curves has an odd number of
 * triangles, an edge of the curve is split, which adds one to either side; along a tree of pieces this evens out all of
 * them, with a boundary or a closed surface's even number at its root.
 *
 * The triangles are edited in place and stay a simplicial complex, so that no two edges of the quads join the same
 * vertices.
 */
#pragma once

#include "geometry/tri_edit.h"
#include "geometry/quadmesh.h"

typedef struct qw_pair_counts {
    int64_t given, taken; /* pairs across edges that were wanted, and by quality */
    int64_t split_edges;  /* of curves, for an even number of triangles */
    int64_t walks, steps, flips;
    int64_t unpaired; /* triangles left out, and holes; 0 but for surfaces of very few triangles */
} qw_pair_counts;

/* across: uint8_t[4 e->face_count], half-edges across which the triangles shall be paired if both sides say so; may be
   NULL. The vertices' `home` is their component. The quads belong to the current scope; *vertex_of:
   uint32_t[quads.vertex_count], vertex of e. */
qw_quadmesh qw_pair_triangles(qw_env *env, qw_edit *e, const uint8_t *across, uint32_t **vertex_of,
                              qw_pair_counts *counts);

/* Three quads a triangle: always right, and six times as many as pairs. */
qw_quadmesh qw_cut_triangles(qw_env *env, const qw_edit *e);

/* Where feature curves end, meet or turn sharply: their edges at each vertex, and the one test of how they turn there.
 *
 * The stages ask at different angles and of different meshes: quads keep what turns by more than QW_CORNER_ANGLE
 * (remesh/field/constraints.c on the working mesh, remesh/relax/relax_curves.c on the surface); the working mesh keeps
 * a little more than that (remesh/working/working.c), so that none of those corners is lost. */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_curve_ends {
    uint32_t count;    /* curve edges at the vertex */
    uint32_t other[2]; /* the other ends of the first two, in the order of their edges */
    bool is_ring;      /* they are all of the curves of nests */
} qw_curve_ends;

/* qw_curve_ends[mesh->vertex_count], in the current scope. with_boundary: boundary edges are curve edges too. */
qw_curve_ends *qw_find_curve_ends(qw_env *env, const qw_trimesh *mesh, bool with_boundary);

/* Whether curves end or meet at a vertex: there is one, but not just two edges of it. */
static inline bool qw_curves_end_at(const qw_curve_ends *at) { return at->count != 0 && at->count != 2; }

/* The vertex after `to` on the curve that comes from its neighbour `from`. Two curve edges meet at `to`. */
static inline uint32_t qw_curve_beyond(const qw_curve_ends *ends, uint32_t from, uint32_t to)
{
    return ends[to].other[ends[to].other[0] == from];
}

/* Whether the way from a by way of v to b turns by more than the angle of that cosine. */
bool qw_turns_sharply(qw_vec3 a, qw_vec3 v, qw_vec3 b, float least_cosine);

/* Whether curves end or meet at vertex v, or one turns there, from edge to edge, by more than the angle. */
bool qw_is_curve_corner(const qw_trimesh *mesh, const qw_curve_ends *ends, uint32_t v, float least_cosine);

/* Working mesh: a near-isotropic triangle mesh of the clean surface, whose size goes with the number of quads and not
 * with the input.
 *
 * Edges are split where longer than 4/3 of the local target length and collapsed where shorter than 4/5 of it, flips
 * make it Delaunay, free vertices slide to the middle of their neighbourhood (Botsch and Kobbelt 2004). What is
 * promised:
 * - topology: components, genus and boundary loops are those of the input;
 * - position: every vertex lies on the input surface, curve vertices on the input curve, to rounding;
 * - curves: boundary edges and marked edges stay chains of edges; corners (curve degree other than 2, or a sharp
 * turn) do not move;
 * - faces: each has at most one edge on a curve, and at least one corner on none.
 *
 * The target is lowered where the input asks for it: in components too small for some forty triangles, and around
 * handles and protrusions so thin that their edges cannot grow. Two curves closer than the target keep short edges
 * and slender faces between them.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_working {
    qw_trimesh mesh;
    float *target; /* float[mesh.vertex_count]: the edge length aimed at: as wanted, or lower as said above */
} qw_working;

/* census: of the input. target: float[input->vertex_count], positive: the wanted edge length at each input vertex.
   base_target: the target length before it is lowered around something small (a thin protrusion, a handle); never less
   than target; NULL: nothing is small. Inside a triangle of the input the target is linear, except that it grows to
   base_target from where it is lowered. */
qw_working qw_working_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *target,
                           const float *base_target);

/* The same surface with fewer triangles, for what need not know more than `length`, float[input->vertex_count]: edges
   shorter than four fifths of it are collapsed, none are split. Topology, positions, curves and corners are as above.
   In the current scope. */
qw_trimesh qw_condensed_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *length);

/* The same for one length everywhere; the input itself where such edges would give no fewer triangles. */
qw_trimesh qw_evenly_condensed_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, double length);

/* A working mesh with hardly a bound of how few triangles a component may have. */
qw_working qw_coarsest_mesh(qw_env *env, const qw_trimesh *input, const qw_census *census, const float *target);

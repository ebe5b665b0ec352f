/* Working mesh (DESIGN 2.2): a near-isotropic triangle mesh of the clean surface, so that every later stage costs O(output).
 *
 * Edges are split where longer than 4/3 of the local target length and collapsed where shorter than 4/5 of it; flips make it Delaunay-like.
 * Topology never changes: a collapse obeys the link condition (boundary included), turns no face by more than a limit, and keeps
 * boundary loops at three edges or more. Feature and boundary vertices move only along their curve; corners (feature degree
 * other than 2, or a curve that turns sharply) do not move at all. Vertices always lie on the input surface.
 */
#ifndef QW_MESH_WORKING_H
#define QW_MESH_WORKING_H

#include "mesh/trimesh.h"

typedef struct qw_working {
    qw_trimesh mesh;
    float *target; /* float[mesh.vertex_count]: the edge length wanted here, carried along from the input */
} qw_working;

/* target: float[input->vertex_count], the wanted edge length at each input vertex. */
qw_working qw_working_mesh(qw_env *env, const qw_trimesh *input, const float *target);

#endif

/* Curvature in balls, as mesh/curvature.h has it, for very many balls on dense meshes: edges and triangles are first
 * added up in cells a quarter as wide as the ball, so that a ball of any mesh holds about a hundred lumps. Its rim is
 * blurred by as much as a cell is wide. */
#ifndef QW_MESH_LUMPS_H
#define QW_MESH_LUMPS_H

#include "mesh/trimesh.h"

typedef struct qw_lumps qw_lumps;

/* mesh: linked; marked edges do not count. facing: qw_vec3[mesh->face_count], unit normals, zero for faces that do not
   count. radius: of the balls, positive. In the current scope. */
qw_lumps *qw_lumps_make(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *facing, double radius);

/* The principal curvatures at a point whose normal is about that of the surface, the greater first, convex positive;
   both 0 where the ball holds no area. Thread-safe. */
void qw_lumps_curvature(const qw_lumps *l, qw_vec3 point, qw_vec3 normal, double curvature[2]);

#endif

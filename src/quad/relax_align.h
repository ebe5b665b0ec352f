/* Along which directions the quads are to lie when they are relaxed, and what it costs them not to.
 *
 * A quad has two lines, u and v, between the middles of its opposite edges. Where the surface has a direction d there,
 * and a tangent e at a right angle to it, one line is to be along d and the other along e:
 *
 *     the smaller of  (u.e)^2 + (v.d)^2  and  (u.d)^2 + (v.e)^2,  over the wanted area
 *
 * which is the squared sine of the angle between them. */
#ifndef QW_QUAD_RELAX_ALIGN_H
#define QW_QUAD_RELAX_ALIGN_H

#include "math/lanes.h"
#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"
#include "quad/relax_energy.h"

/* d and e at the middle of each quad, each as long as the root of what the energy weighs there; 0 where the surface has
   no direction. */
typedef struct qw_relax_lines {
    qw_vec3 *along, *across; /* qw_vec3[face_count] */
} qw_relax_lines;

/* direction: qw_vec3[mesh->vertex_count], tangents as long as they are clear, 0 to 1, of a surface near by; strength:
   what a clear one weighs. In the current scope. */
qw_relax_lines qw_find_relax_lines(qw_env *env, const qw_quadmesh *quads, const qw_vec3 *position,
                                   const qw_trimesh *mesh, const qw_vec3 *direction, float strength);

/* Of four quads with corners p. */
qw_lanes qw_lines_energy(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes *along,
                         const qw_vec3_lanes *across);

/* Adds the same to the model by the axes of the corners. */
void qw_add_lines(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes axis[4][2], const qw_vec3_lanes *along,
                  const qw_vec3_lanes *across, qw_relax_model *model);

#endif

/* Along which directions the quads are to lie when they are relaxed, and what it costs them not to.
 *
 * A quad has two lines, u and v, between the middles of its opposite edges. Where the surface has a direction d there,
 * and a tangent e at a right angle to it, one line is to be along d and the other along e:
 *
 *     the smaller of  (u.e)^2 + (v.d)^2  and  (u.d)^2 + (v.e)^2,  over the wanted area
 *
 * which is the squared sine of the angle between them. */
#pragma once

#include "base/simd.h"
#include "geometry/bvh.h"
#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"
#include "remesh/relax/relax_energy.h"

/* d and e at the middle of each quad, each as long as the root of what the energy weighs there; 0 where the surface has
   no direction. */
typedef struct qw_relax_lines {
    const qw_quadmesh *quads;
    const qw_trimesh *mesh;
    const qw_vec3 *direction; /* qw_vec3[mesh->vertex_count], tangents as long as they are clear, 0 to 1 */
    float strength;           /* what a clear one weighs */
    const qw_bvh *tree;       /* of mesh */
    const uint32_t *outgoing; /* of mesh */
    qw_vec3 *along, *across;  /* qw_vec3[quads->face_count] */
    const float *share;       /* float[quads->face_count], 0 to 1, of the strength */
    const uint32_t *near; /* uint32_t[quads->face_count]: a triangle of mesh near each quad, or QW_NONE; NULL: none */
    uint32_t *place;      /* uint32_t[quads->face_count], triangle of mesh where the quad was last found */
} qw_relax_lines;

/* mesh: a surface near the quads, which is linked; tree: of it. In the current scope; without lines until they are
   looked up. */
qw_relax_lines qw_begin_relax_lines(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *mesh, const qw_bvh *tree,
                                    const qw_vec3 *direction, float strength, const float *share);
/* Where the quads are now. A quad moves by more than an edge while it is relaxed, to where the shape runs otherwise. */
void qw_find_relax_lines(qw_env *env, qw_relax_lines *lines, const qw_vec3 *position);

/* Of four quads with corners p. */
qw_lanes qw_lines_energy(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes *along,
                         const qw_vec3_lanes *across);

/* Adds the same to the model by the axes of the corners. */
void qw_add_lines(qw_lanes wanted, const qw_vec3_lanes p[4], const qw_vec3_lanes axis[4][2], const qw_vec3_lanes *along,
                  const qw_vec3_lanes *across, qw_relax_model *model);

/* The connection Laplacian of crosses on every level of the hierarchy (Knoeppel et al. 2013, Globally Optimal Direction
 * Fields).
 *
 * At vertex v of level 0 a cross is a complex number z of length 1: the fourth power of e^(i t) says that one of its
 * axes is turned by t from axis[v] about the normal. Along an edge it is carried by the least rotation between the two
 * normals, which turns z by a number r of length 1; it may be told to turn more, edge by edge
 * (remesh/field/curvature_diffusion.h). The energy is
 *
 *     sum over edges (u, v) of w |z_v - r_vu z_u|^2,    whose gradient at v is    diagonal z_v - (sum of link z_u) -
 * pull.
 *
 * A vertex of a coarser level stands for the free vertices below it, their crosses being parallel copies of its own:
 * z_child = along z_parent. Its row is the exact energy of such copies (Galerkin), so a coarse level knows how the
 * surface below it turns, however much it is bent, and what constrained vertices want of it. */
#pragma once

#include "remesh/field/connection_level.h"

typedef struct qw_connection {
    uint32_t level_count;
    qw_connection_level level[QW_MAX_LEVELS];
    qw_vec3 *axis; /* qw_vec3[vertex_count of level 0], unit tangents; the curve's where the vertex is constrained */
} qw_connection;

/* Vertices with a direction are constrained: z = 1 there. Corners have none to hold and take no part: their normal is a
   mean over sides that the field does not cross. turn: what qw_diffuse_curvature gives, or NULL. direction: what
   qw_principal_directions gives, or NULL; follow: how strongly these pull, 0 to 1. asked: directions that were asked
   for (remesh/field/alignment.h), or NULL. Allocated in the caller's scope; refers to the hierarchy. */
qw_connection qw_connection_build(qw_env *env, const qw_hierarchy *hierarchy, const float *turn, qw_vec3 *direction,
                                  float follow, const qw_vec3 *asked);

/* The energy of z: qw_phasor[vertex_count] on the level. Constrained vertices have none among themselves. */
double qw_connection_energy(const qw_connection_level *c, const qw_phasor *z);

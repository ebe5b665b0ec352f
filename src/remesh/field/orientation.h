/* Orientation field: a cross at every vertex, that turns as little as can be. */
#pragma once

#include "remesh/field/hierarchy.h"
#include "base/rosy.h"

/* The smoothest field found, crosses being carried in the surface and turned by `turn` besides
   (remesh/field/connection.h; may be NULL), and along the directions (remesh/field/alignment.h; may be NULL) as much as
   `follow` says, 0 to 1, and along those of `asked`, which were asked for (may be NULL). Vertices with a direction
   (curves) keep the cross aligned with it. Returns qw_vec3[vertex_count of level 0]: unit tangents orthogonal to the
   normals. Uses 0 to 1 of the stage's progress. */
qw_vec3 *qw_orientation_field(qw_env *env, const qw_hierarchy *hierarchy, const float *turn, qw_vec3 *direction,
                              float follow, const qw_vec3 *asked, uint64_t seed);

/* Normals of vertices on marked edges become those of the faces there weighted by angle: half way between the two sides
   of a crease, however thin the triangles of one of them. */
void qw_balance_creases(qw_env *env, const qw_trimesh *mesh, qw_vec3 *normal);

/* Normals smoothed by implicit diffusion over the time (radius size)^2 (remesh/field/smoothed_normals.c), so that
   relief smaller than the quads does not steer the field. Sharp edges do not smear: vertices on marked edges keep their
   normals and nothing flows through them. size: float[vertex_count], or NULL for 1 everywhere. normal:
   qw_vec3[vertex_count], smoothed in place. share: float[vertex_count], what part of the radius counted: 1, down to a
   half on protrusions that are thinner than that; may be NULL. */
void qw_smooth_normals(qw_env *env, const qw_trimesh *mesh, const float *size, float radius, qw_vec3 *normal,
                       float *share);

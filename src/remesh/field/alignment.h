/* Which way the shape wants the crosses: along the principal directions of the input at the scale of the quads, where
 * these are clear, and agree with those around.
 *
 * Curvature is that of the surface itself (geometry/curvature.h), as the working mesh is no finer than the quads. A
 * bump or a dent of noise has principal directions too; but those of a limb, a rim or a fold go on beside it, while
 * those of noise are other ones a quad further. So the directions are carried around by the connection and averaged,
 * and count as much as their mean is long compared with the mean of their lengths. */
#pragma once

#include "remesh/field/connection_level.h"
#include "geometry/trimesh.h"

/* The principal directions of the surface at scale h (in the frame) at points on it, as long as they are clear, 0 to 1.
   normal: qw_vec3[count], about that of the surface. Returns qw_vec3[count] in the current scope. */
qw_vec3 *qw_principal_directions(qw_env *env, const qw_trimesh *surface, double h, const qw_vec3 *point,
                                 const qw_vec3 *normal, uint32_t count);

/* The length of a direction says about how far the surface bends within h; shorter ones say no more than this. */
static const float QW_LEAST_BEND = 0.12f;

/* Adds the pull of the directions to the finest level, whose links are made: follow times as much as they are clear and
   agree. pulled: float[vertex_count]: the weights of what pulls, to be added to. */
void qw_pull_along(qw_env *env, qw_connection_level *c, const qw_vec3 *axis, qw_vec3 *direction, float follow,
                   float *pulled);

/* Adds the pull of directions that the caller of the library has asked for to the finest level: so strong that little
   but curves can turn a cross from them. asked: qw_vec3[vertex_count], tangents as long as they count, 0 to 1. */
void qw_pull_to_asked(qw_env *env, qw_connection_level *c, const qw_vec3 *axis, const qw_vec3 *asked, float *pulled);

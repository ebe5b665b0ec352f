/* Where a surface bends and stretches when it moves: out of its skin weights and morph targets.
 *
 * Rings of an elbow run along the lines on which the weights of its two bones are equal, those of a mouth along the
 * lines on which a morph target moves the surface equally far. So what counts is the gradient of what moves: with J of
 * a weight, or of a target's offset over its largest length, the sum of J^T J over all of them has the direction in
 * which movement changes the most. (Marcias et al. 2013 take directions from deformation gradients of an animation; a
 * bone's weight stands for all poses of that bone.) */
#pragma once

#include "remesh/clean/clean.h"

/* Whether an attribute is a target: of vertices, of three components, with a name that begins with "target:". How far
   it moves a vertex. */
bool qw_is_target(const qw_attribute *a);
double qw_offset_at(const qw_attribute *target, uint32_t v);
/* How far each attribute that is a target moves a vertex at the most: double[count], 0 for one that is none, or moves
   nothing far enough to count. */
double *qw_largest_offsets(qw_env *env, const qw_clean_input *in, const qw_attribute *attributes, uint32_t count);
/* The share of a group in all weights of a vertex. */
double qw_share_of_group(const qw_attribute *weights, uint32_t v, uint32_t group);

/* Of each polygon the direction in which movement changes the most, as long as it changes on a unit of length of the
   input (1: all of it; less where other directions are as good): qw_vec3[input->face_count]; NULL where nothing moves.
   What counts are QW_WEIGHTS and targets, whose largest offsets are double[count]. */
qw_vec3 *qw_motion_of_faces(qw_env *env, const qw_clean_input *input, const qw_attribute *attributes, uint32_t count,
                            const double *largest);

/* The same near the clean surface that was made of that input, which must outlive it. In the current scope. */
typedef struct qw_motion_field qw_motion_field;
qw_motion_field *qw_motion_begin(qw_env *env, const qw_clean *clean, const qw_vec3 *motion);
/* At points, tangents to normal, by a unit of the surface's frame: qw_vec3[count]. */
qw_vec3 *qw_motion_at_points(qw_env *env, const qw_motion_field *field, const qw_vec3 *point, const qw_vec3 *normal,
                             uint32_t count);

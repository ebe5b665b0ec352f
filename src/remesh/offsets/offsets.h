/* Integer offsets from crosses and lattice points (paper, Definition 3.1). */
#pragma once

#include "remesh/offsets/offset_mesh.h"

typedef struct qw_offset_input {
    const qw_trimesh *mesh;
    qw_vec3 *normal, *lattice;  /* qw_vec3[vertex_count]; lattice is NULL where no position field was solved */
    const qw_vec3 *orientation; /* qw_vec3[vertex_count] */
    const float *size;
    const uint8_t *constraint;
    const qw_vec3 *direction;
    const qw_vec3
        *nested; /* qw_vec3[vertex_count], along the rings of a nest, all the same way around; 0 outside; or NULL */
    bool with_boundary;    /* boundary edges are constrained to lattice lines */
    bool cones_at_corners; /* cones may lie at corners of curves where their sectors need them; otherwise there only if
                              there is no other place */
} qw_offset_input;

/* Shares corner, twin, position, normal and lattice with the input, and mark where the mesh has any: what changes these
   works on a copy (qw_offset_copy). */
qw_offset_mesh qw_integer_offsets(qw_env *env, const qw_offset_input *input);

/* Vertices on constrained curves and within a ring of them, about as far as their smoothed normals lean:
 * uint8_t[vertex_count], 0 elsewhere. */
uint8_t *qw_offset_near_curves(qw_env *env, const qw_offset_mesh *m);

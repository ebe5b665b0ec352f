/* Stairs: the terraces of voxels and of quantised heights, whose steps are as small as the quads. */
#pragma once

#include "geometry/trimesh.h"

/* Of the marked edges of one network: how long those are at which the surface turns back within the ball, and those of
   them at which its mean normal is askew. */
typedef struct qw_steps {
    double back, askew;
} qw_steps;

typedef struct qw_step_networks {
    const uint32_t *of_vertex; /* uint32_t[vertex_count], which one the marked edges at a vertex belong to */
    const uint8_t *asked;      /* uint8_t[networks], flags: those whose edges are looked at */
} qw_step_networks;

/* steps: qw_steps[networks], zeroed; normal: qw_vec3[face_count], unit; size: the edge length that the quads would
   have. */
void qw_find_steps(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_step_networks *networks,
                   float size, qw_steps *steps);

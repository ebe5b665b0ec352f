/* How much a seam along each edge would be seen. */
#pragma once

#include "products/atlas/seams.h"

/* double[corner_count], 1 in the mean over lengths: more where the surface is open around the edge and convex across
   it, less under arms, between legs and in grooves. In the caller's scope. */
double *qw_seam_weights(qw_env *env, const qw_atlas_mesh *mesh);

/* Which half-edge lies where each one is reflected to, about the plane of the points p with normal . p = offset (it
   goes the other way around its face): uint32_t[corner_count], QW_NONE where none does. In the caller's scope. */
uint32_t *qw_mirrored_corners(qw_env *env, const qw_atlas_mesh *mesh, const double normal[3], double offset);

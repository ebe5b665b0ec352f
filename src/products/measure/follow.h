/* Whether quads follow the shape of the surface that they stand for; called by qw_measure_distances. */
#pragma once

#include "geometry/curvature.h"

/* Fills follow, follow10 and follow30, and mirror where the surface has a plane of symmetry. out, in: the mesh and the
   surface in one frame, each with triangles; quality->mean_edge is set and positive. */
void qw_measure_shape(qw_env *env, const qw_mesh_view *mesh, const qw_polygon_edges *edges, const qw_surface *out,
                      const qw_mesh_view *against, const qw_surface *in, double scale, qw_quality *quality);

/* Angle in degrees, 0 to 45, between each quad's edges and the principal directions of the surface where it is nearest
   to the quad's centre, and how clear these are, 0 to 1. quad: uint32_t[count], faces with four corners; angle, weight:
   float[count]. */
void qw_find_quad_angles(qw_env *env, const qw_mesh_view *mesh, const qw_mesh_view *against, const uint32_t *quad,
                         uint32_t count, float *angle, float *weight);

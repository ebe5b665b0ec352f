/* Whether rows of quads would keep their width along a field of crosses: where a bottle gets narrow, rows that all run
 * into the neck do not.
 *
 * A field that turns as it is carried along an edge has lines that draw together or apart across it: on a surface
 * stretched by the right factor it would turn no more. The logarithm of that factor is found by least squares. It is
 * that of the width of the rows, but for a constant, and what it differs by from that of the wanted edge length is how
 * much too wide or too narrow rows are. */
#pragma once

#include "geometry/trimesh.h"

/* The root of the mean square of that difference over the area, each component by itself. orientation, normal:
   qw_vec3[mesh->vertex_count]; size: the wanted edge length, float[vertices]. slope, float[vertices]: how fast it
   changes there, in 1 / length. */
double qw_girth_spread(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *orientation,
                       const float *size, float *slope);

/* How a surface turns, at several scales: the sum of its principal curvatures, made smooth.
 *
 * The sum of it over a piece of surface, over the length of the piece's rim, is about the sine of the angle by which
 * the surface has turned away there on all sides: 0 on a plane, 1/2 on a cap that falls off by 30 degrees. */
#pragma once

#include "geometry/trimesh.h"

/* The first is smoothed over about `width`, each next over sqrt(2) times as much. cut: double[3], the normal of the
   plane that halves what the surface is half of, in which its boundary lies. float[count * vertices], in the current
   scope; positive where the surface is convex. */
float *qw_turning(qw_env *env, const qw_trimesh *mesh, const double *cut, double width, uint32_t count);

/* Normals that the result is shaded with: those of the input, in the mean around each vertex. What a map has left to
 * bend is little then, and quads without their map look as the input does. */
#pragma once

#include "products/bake/bake_target.h"
#include "products/bake/bake_surface.h"

/* float[corner_count][3], unit. The target has its corners, places and the normals of its own shape: corners of a
   vertex that share one share the new one. Where the input has no normal near that, or one far from it, it stays. In
   the caller's scope. */
float *qw_shading_of_input(qw_env *env, const qw_bake_target *target, const qw_look *look);

/* Teeth of marked lines: jags smaller than the quads, as borders of labels and materials have that run along the edges
 * of some triangulation. Quads that followed them would turn at each. */
#pragma once

#include "geometry/trimesh.h"

/* Moves the vertices of marked lines, and of boundaries where with_boundary is set, that run in teeth towards smooth
   lines, along the surface, by less than half of `edge`, and turns no triangle over. A tooth is a corner inside a line
   that has the next corner on either side within `edge`, both of which turn the other way; other corners and vertices
   at sharp edges stay, as do those that are held, uint8_t[vertices], NULL: none. Returns how many corners were teeth;
   the positions are new, in the current scope, where there are any. */
uint32_t qw_smooth_teeth(qw_env *env, qw_trimesh *mesh, double edge, bool with_boundary, const uint8_t *held);

/* Creases that were sampled (marching cubes, remeshing, generators): bands of chamfers, each of whose edges is below
 * the angle of a sharp one. Found as the lines where two smooth sides meet (sides.h), and made sharp again. */
#pragma once

#include "geometry/trimesh.h"

/* Where components of the surface have such creases, they are cut along them, which puts vertices there and marks the
   edges between them, and what the sampling had cut off is put back; marks that a component had are gone then.
   Topology, boundaries and components stay. census: of the surface. quad_edge: edge length of the quads: what is
   shorter is no crease. Returns false where the surface stays as it is; else its arrays are new, in the caller's scope.
 */
bool qw_sharpen(qw_env *env, qw_trimesh *surface, const qw_census *census, float quad_edge);

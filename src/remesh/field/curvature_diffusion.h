/* Curvature evened out, so that the field gets no singularities for bumps of about the size of the quads (after Ray et
 * al. 2009, Geometry-Aware Direction Field Processing).
 *
 * A cross carried around a triangle comes back turned by the curvature of the triangle, here the solid angle of its
 * normals, and where enough of it comes together a singularity is born. If along each edge the cross is turned a little
 * more or less than it would be, curvature flows across that edge from one triangle to the other. Here it flows as heat
 * does over the time radius^2: opposite curvatures near one another cancel, none is lost, and what is far from a bump
 * knows nothing of it. Normals stay as they are; smoothing these instead until as many singularities are gone bends the
 * field, and offsets measured with them, away from the surface. */
#pragma once

#include "remesh/field/hierarchy.h"

/* What carrying along each edge of the finest level turns by besides, in radians about the normals:
   float[level->begin[vertex_count]], slot i of row v being the way from neighbour[i] to v, and the way back its
   negative. Nothing flows across marked edges, nor to or from triangles with a corner. radius: float[vertex_count]; 0
   for none. size: float[vertex_count], the wanted edge length, or NULL for one everywhere: the crosses are carried and
   the curvature is that on the surface stretched by 1 / size, where quads of these sizes are all alike, so that
   singularities come up where rows of quads have to end. In the current scope. */
float *qw_diffuse_curvature(qw_env *env, const qw_trimesh *mesh, const qw_level *level, const float *radius,
                            const float *size);

/* Parts of the surface that the quads don't reach: a finger whose cones all fell on one vertex leaves the topology whole, and is gone. */
#ifndef QW_QUAD_REACH_H
#define QW_QUAD_REACH_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"
#include "quad/topology.h"

/* Points of the surface further than `far` wanted edge lengths from every quad, none within half that of another.
   size: float[surface->vertex_count], the wanted edge length there. */
qw_losses qw_find_unreached(qw_env *env, const qw_trimesh *surface, const float *size, const qw_quadmesh *quads, float far);

#endif

/* Parts of the surface that the quads don't reach: a finger whose cones all fell on one vertex leaves the topology whole, and is gone. */
#ifndef QW_QUAD_REACH_H
#define QW_QUAD_REACH_H

#include "mesh/quadmesh.h"
#include "mesh/trimesh.h"
#include "quad/topology.h"

/* Points of the surface further than `far` from every quad, none within half a wanted edge length of another.
   size: float[surface->vertex_count], the wanted edge length there. area: of all such points. */
qw_losses qw_find_unreached(qw_env *env, const qw_trimesh *surface, const float *size, const qw_quadmesh *quads, float far);

#endif

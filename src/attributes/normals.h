/* Normals of quads for shading. */
#ifndef QW_ATTRIBUTES_NORMALS_H
#define QW_ATTRIBUTES_NORMALS_H

#include "mesh/quadmesh.h"

/* Of unit length, the mean of the quads around a vertex weighted by their angles there; split: of those between sharp
   edges, which are the marked ones at which the quads turn. float[vertices or, split, corners][3], in the caller's
   scope. */
float *qw_shading_normals(qw_env *env, const qw_quadmesh *quads, bool split);

#endif

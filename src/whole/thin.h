/* Parts too thin for the quads that they get: wires, pins, twigs. Fields need some quads around a part and as many
 * along as make them square; with fewer the integers draw it together. These are remeshed with as few triangles
 * instead, which are paired, thinned out and relaxed on the part. */
#ifndef QW_WHOLE_THIN_H
#define QW_WHOLE_THIN_H

#include "geometry/quadmesh.h"
#include "geometry/trimesh.h"

/* The closed components that are `thin`, uint8_t[census->components], with at most quads[c] quads each, or the least
   that a closed part may have. Left out is what takes more without losing its topology or a flipped quad. component:
   their numbers in the census. In the current scope. */
qw_quadmesh qw_make_thin(qw_env *env, const qw_trimesh *mesh, const qw_census *census, const uint8_t *thin,
                         const double *quads);

#endif

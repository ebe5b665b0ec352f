/* Components so small that they get next to no quads, made straight from their triangles: one quad of a disc, the six
 * of a cube for a sphere. The time is proportional to their triangles, and no field is asked. */
#ifndef QW_REMESH_QUADS_MINIMAL_H
#define QW_REMESH_QUADS_MINIMAL_H

#include "geometry/quadmesh.h"

/* Quads of a disc and of a sphere that are made so. */
enum { QW_MINIMAL_OPEN = 1, QW_MINIMAL_CLOSED = 6 };

typedef struct qw_minimal {
    qw_quadmesh quads; /* of all components that were made; component: their numbers in the census */
    uint8_t *made;     /* uint8_t[census->components] */
    uint32_t count;    /* of components made */
} qw_minimal;

/* Makes the discs and spheres that would get hardly more quads of length `edge` than they are made with, but never
   the component of the largest area. Components of another topology are left, and those whose few quads would be
   flipped or have no area; where fewer than `least` would be made, none is. In the current scope. */
qw_minimal qw_make_minimal(qw_env *env, const qw_trimesh *mesh, const qw_census *census, double edge, uint32_t least);

#endif

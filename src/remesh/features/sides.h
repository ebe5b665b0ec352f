/* To which smooth side of a surface each vertex belongs, where sides meet in a band a few triangles wide: what a crease
 * is after a grid, a remesher or a generator has sampled it, with each of its edges below the angle of a sharp one.
 *
 * A plane is what lies within two edges or so of a vertex. Near a band each vertex takes the plane nearby that is
 * evenest and whose plane it lies in best (Kuwahara et al. 1976, for images), so that sides go on right up to where
 * they meet: nothing is rounded, and where three meet there are three.
 */
#pragma once

#include "geometry/trimesh.h"

typedef struct qw_side_plane {
    qw_vec3 point, normal; /* of its plane; the normal 0: not made, no band is near */
    float spread;          /* of the normals of its vertices, radians (root mean square) */
} qw_side_plane;

typedef struct qw_sides {
    const qw_trimesh *mesh;
    const uint32_t *outgoing; /* uint32_t[vertex_count] */
    float *edge;              /* float[vertex_count]: local length of edges, were they all the same */
    qw_side_plane *plane;     /* qw_side_plane[vertex_count] */
    uint32_t *side;           /* uint32_t[vertex_count]: the vertex whose plane it belongs to */
    uint8_t *rough;           /* uint8_t[vertex_count]: the triangles around it turn */
} qw_sides;

/* Belongs to the current scope. Returns false where a few places, tried first, say that there are no bands, or that
   they have their marks. */
bool qw_find_sides(qw_env *env, const qw_trimesh *mesh, qw_sides *sides);

/* Vertices within `radius` of a vertex that edges lead to without leaving the ball, the nearest rings first. */
enum { QW_BALL = 160, QW_BALL_BITS = 9 };
typedef struct qw_vertex_ball {
    uint32_t count, vertex[QW_BALL];
    uint32_t slot[1 << QW_BALL_BITS]; /* QW_NONE or an index into vertex: whether one is in it */
} qw_vertex_ball;
/* barred: uint8_t[3 face_count]: edges that are not to be crossed; NULL: none. */
void qw_collect_ball(const qw_sides *s, uint32_t v, float radius, const uint8_t *barred, qw_vertex_ball *ball);

/* A collar: a strip of quads along every boundary loop, so that the mesh ends in the very vertices of the surface's
 * own boundary, however many those are and however they are spaced.
 *
 * The outer half of the row of quads along the rim is given up for it: the quads' rim moves inward by half a quad, and
 * the strip lies between it and the surface's rim. Where the two have very different numbers of edges there are several
 * strips, none of which changes the number by more than about two and a half times. Loops whose numbers of edges
 * differ by an odd number get a row of quads more, from one such loop to another (whole/open_path.h). In the end the
 * vertices near the rim move on the surface, until the corners of the quads are as good as these few vertices can make
 * them; those of the rim never do.
 */
#pragma once

#include "geometry/bvh.h"
#include "geometry/quadmesh.h"

typedef struct qw_collar {
    qw_quadmesh quads; /* linked; kind, mark and component are set */
    uint32_t *rim;     /* uint32_t[quads.vertex_count]: the id of a rim vertex, or QW_NONE */
    uint32_t added;    /* quads more than there were */
} qw_collar;

/* The rims that the collars end in. */
typedef struct qw_outer_rims {
    uint32_t count, *begin; /* loops; uint32_t[count + 1] */
    qw_vec3 *position;      /* qw_vec3[begin[count]] */
    uint32_t *id;           /* uint32_t[begin[count]]: the caller's */
    uint32_t *component;    /* uint32_t[count], as of the quads; NULL: not known */
} qw_outer_rims;

/* Those of the surface, with its vertices as ids. In the current scope. */
qw_outer_rims qw_rims_of_surface(qw_env *env, const qw_trimesh *surface);

/* quads: linked, with as many boundary loops as there are rims, which have an even number of edges in each component.
   In the current scope. Fails with QW_INTERNAL where the loops do not match. */
qw_collar qw_add_collar(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const qw_outer_rims *outer);

/* About how many quads a collar adds to quads that have `inner` edges along a rim of `outer`. */
double qw_collar_faces(double outer, double inner);

/* Whether a vertex of the quads moves: never, only around quads that are inverted otherwise, or always. */
typedef enum qw_mobility { QW_STAYS, QW_MAY_MOVE, QW_MOVES } qw_mobility;

/* Moves vertices, by their uint8_t[quads->vertex_count] of qw_mobility, on the surface, so that the worst corners
   around them get better. */
void qw_square_corners(qw_env *env, qw_quadmesh *quads, const uint8_t *mobility, const qw_trimesh *surface,
                       const qw_bvh *tree);

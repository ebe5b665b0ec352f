/* A skin around anything: docs/dev/decisions/wrap.md. */
#ifndef QW_WRAP_WRAP_H
#define QW_WRAP_WRAP_H

#include "base/env.h"
#include "mesh/clean_input.h"

typedef struct qw_wrapped {
    qw_clean_input skin;    /* triangles: a closed, oriented manifold that does not intersect itself */
    uint32_t *source;       /* uint32_t[skin.face_count]: the polygon of the input that is nearest */
    double distance;        /* that was used, in the coordinates of the input */
    double origin[3], unit; /* vertices lie at the origin and whole numbers of units, at most 2^24, along each axis */
    int64_t triangles;      /* of the input */
    int64_t clusters, crumbs, hidden; /* components of the skin; parts that were too small for one; triangles inside */
} qw_wrapped;

/* distance: gaps narrower than this are closed, in the coordinates of the input. Fails with QW_ONLY_DEGENERATE,
 * QW_NO_FACES, QW_TOO_LARGE. The arrays are of the caller's scope. */
qw_wrapped qw_wrap(qw_env *env, const qw_clean_input *input, double distance);

/* The distance that is this share of the edges of so many quads on the wrapped surface. */
double qw_wrap_distance_for(qw_env *env, const qw_clean_input *input, double quads, double edges);
/* The diagonal of the box of the vertices that have faces. */
double qw_wrap_diagonal(const qw_clean_input *input);

#endif

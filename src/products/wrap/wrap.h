/* A skin around anything: docs/dev/decisions/wrap.md. */
#pragma once

#include "base/env.h"
#include "geometry/clean_input.h"
#include "geometry/triangulate.h"
#include "products/wrap/stats.h"

typedef struct qw_wrapped {
    qw_clean_input skin;    /* triangles: a closed, oriented manifold that does not intersect itself */
    uint32_t *source;       /* uint32_t[skin.face_count]: the polygon of the input that is nearest */
    uint8_t *seen;          /* uint8_t[faces of the input]: 1: the outside comes as near to the polygon as a cell */
    double distance;        /* that was used, in the coordinates of the input */
    double origin[3], unit; /* vertices lie at the origin and whole numbers of units, at most 2^24, along each axis */
    int64_t triangles;      /* of the input */
    int64_t clusters, fragments, hidden; /* components of the skin; clusters too small for one; triangles not seen */
    qw_wrap_stats stats;
} qw_wrapped;

/* The lattice of an input: polygons cut into triangles, these in units, and the cells. */
typedef struct qw_filled {
    qw_triangles polygons;
    qw_wrap_triangles triangles;
    qw_wrap_lattice lattice;
} qw_filled;
/* Gaps narrower than the distance are closed, in the coordinates of the input; cells are half as wide. Fails as qw_wrap
 * does. In the caller's scope. */
qw_filled qw_wrap_fill(qw_env *env, const qw_clean_input *input, double distance);

/* distance: gaps narrower than this are closed, in the coordinates of the input. Fails with QW_ONLY_DEGENERATE,
 * QW_NO_FACES, QW_TOO_LARGE. The arrays are of the caller's scope. */
qw_wrapped qw_wrap(qw_env *env, const qw_clean_input *input, double distance);

/* Cells of a wrap of this distance over the most that there may be. */
double qw_wrap_load(const qw_clean_input *input, double distance);
/* The distance that is this share of the edges of so many quads on the wrapped surface. */
double qw_wrap_distance_for(qw_env *env, const qw_clean_input *input, double quads, double edges);
/* The share of the input's area that lies inside of others, or in gaps narrower than a hundredth of its longest side.
 */
double qw_wrap_hidden(qw_env *env, const qw_clean_input *input);
/* The diagonal of the box of the vertices that have faces. */
double qw_wrap_diagonal(const qw_clean_input *input);

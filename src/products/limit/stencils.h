/* Catmull and Clark's rules as sparse rows: each vertex of the finer mesh, or of the limit surface, is a sum of weights
 * times vertices of the coarser one.
 *
 * Marked edges and boundaries are infinitely sharp creases, as OpenSubdiv has them: two of them at a vertex make a
 * cubic B-spline, more a corner, a single one ends smoothly (a dart). Vertices of kind QW_VERTEX_CORNER are corners
 * too, but for darts.
 *
 *     split of quad f: its child h = 4 f + i lies at its corner i       v ---h--- w
 *         child h:  corner[h], edge point of h, middle of f,            | h  |    |
 *                   edge point of the half-edge before h                e----f----e
 *         vertices: the old ones, then the edges, then the middles      |    |    |
 *                   of the faces, in the order of half-edges and faces  +----e----+
 */
#pragma once

#include "geometry/quadmesh.h"

/* The most quads that are split: fewer than this. */
#define QW_MOST_TO_SPLIT (QW_NONE / 64)

typedef struct qw_stencils {
    uint32_t row_count, column_count;
    size_t *first;    /* size_t[row_count + 1] */
    uint32_t *column; /* uint32_t[first[row_count]], each below column_count */
    double *value;    /* double[first[row_count]]; those of a row are 1 together */
} qw_stencils;

typedef enum qw_rule { QW_RULE_SMOOTH, QW_RULE_CREASE, QW_RULE_CORNER } qw_rule;

/* The rule of each vertex: uint8_t[quads->vertex_count]. crease: the two vertices at the other ends of the sharp edges
   of a crease, uint32_t[quads->vertex_count][2]; may be NULL. quads: linked. All in the current scope, as below. */
uint8_t *qw_find_rules(qw_env *env, const qw_quadmesh *quads, uint32_t (*crease)[2]);

/* The mesh whose quads are each split in four, with its marks, kinds and components; its positions are not set.
   Fails with QW_TOO_LARGE where it would have too many. quads: linked; what its kinds, marks and components lack is 0.
 */
qw_quadmesh qw_split_quads(qw_env *env, const qw_quadmesh *quads);
/* The rows of its vertices. */
qw_stencils qw_split_stencils(qw_env *env, const qw_quadmesh *quads);
/* The rows of where the vertices go when the mesh is split without end. */
qw_stencils qw_limit_stencils(qw_env *env, const qw_quadmesh *quads);

/* The rows of a after those of b. */
qw_stencils qw_stencils_product(qw_env *env, const qw_stencils *a, const qw_stencils *b);
/* Rows become columns; the values of a row of the result do not sum to 1. */
qw_stencils qw_stencils_transpose(qw_env *env, const qw_stencils *s);
/* out: double[row_count][3]; in: double[column_count][3]. */
void qw_stencils_apply(qw_env *env, const qw_stencils *s, const double *in, double *out);
/* The same of positions in single precision. */
void qw_stencils_place(qw_env *env, const qw_stencils *s, const qw_vec3 *in, qw_vec3 *out);

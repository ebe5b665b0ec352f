/* Coarser systems for the relaxation's: clusters of a dozen vertices that move as one along the plane in which they
 * lie, clusters of those, and so on. What each unknown of all of them would do by itself, added up, is a preconditioner
 * that knows long waves too (Bramble, Pasciak, Xu, "Parallel multilevel preconditioners", 1990).
 */
#pragma once

#include "base/env.h"
#include "remesh/relax/relax_energy.h"

/* A symmetric matrix of blocks of 2 by 2 numbers: row v has row[v]..row[v + 1], v itself first. */
typedef struct qw_relax_matrix {
    uint32_t count;
    uint32_t *row, *column;
    float (*block)[4];
} qw_relax_matrix;

/* Belongs to the scope that it was made in, and borrows the matrix, whose pattern stays. */
typedef struct qw_relax_grids qw_relax_grids;
qw_relax_grids *qw_relax_grids_create(qw_env *env, const qw_relax_matrix *fine);

/* For the matrix as it is now. axis: qw_vec3[count][2], along which the unknowns are; 0 where there is none. */
void qw_relax_grids_fill(qw_env *env, qw_relax_grids *g, qw_vec3 (*axis)[2]);

/* What the coarser systems make of a residual, by the clusters of the finest. */
typedef struct qw_relax_correction {
    const uint32_t *group; /* of each vertex, or NULL: there is none */
    const float (*share)[4];
    const qw_vec2 *z;
    double product; /* with the residual */
} qw_relax_correction;

/* r: qw_vec2[count]. The correction holds until the next. Serial from the second clusters on, as these are a hundredth
 * of the unknowns. */
qw_relax_correction qw_relax_grids_correct(qw_env *env, qw_relax_grids *g, const qw_vec2 *r);

/* Of a symmetric block that is never indefinite: its inverse, or that of the axis that has any. */
void qw_invert_block(const float a[4], float to[4]);
static inline qw_vec2 qw_block_times(const float m[4], qw_vec2 v)
{
    return (qw_vec2){m[0] * v.x + m[1] * v.y, m[2] * v.x + m[3] * v.y};
}
static inline qw_vec2 qw_correction_at(const qw_relax_correction *c, uint32_t v)
{
    return c->group ? qw_block_times(c->share[v], c->z[c->group[v]]) : (qw_vec2){0, 0};
}

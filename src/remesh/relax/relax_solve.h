/* The linear system of a step of relaxation: two unknowns a vertex, along its two axes, from a matrix of 8 by 8 a quad;
 * solved roughly by conjugate gradients, preconditioned by itself and by coarser ones (relax_grids.h). Sums run over
 * fixed blocks in order, so the number of threads changes no bit.
 */
#pragma once

#include "geometry/quadmesh.h"
#include "remesh/relax/relax_grids.h"

/* The rows' pattern: which vertices share a quad with each. Row v has row[v]..row[v + 1], v itself first. */
typedef struct qw_relax_system {
    uint32_t count;
    const uint32_t *begin, *around; /* corners at each vertex: half-edges around[begin[v]..begin[v + 1]] */
    uint32_t *row;                  /* uint32_t[count + 1] */
    uint32_t *column;               /* uint32_t[row[count]] */
    uint32_t *slot;    /* uint32_t[4 * corners]: where corner i of the quad of around[k] is in the row of its vertex */
    float (*block)[4]; /* float[row[count]][4], row by row */
    qw_vec2 *side, *x; /* [count] right-hand side and solution */
    qw_vec2 *r, *z, *p, *q; /* [count] */
    float (*inverse)[4];    /* float[count][4] of the blocks on the diagonal */
    double *sum;            /* [blocks of vertices] */
    qw_relax_grids *grids;
    qw_relax_correction correction; /* of r */
    float alpha, beta;
} qw_relax_system;

qw_relax_system qw_relax_system_create(qw_env *env, const qw_quadmesh *quads, const uint32_t *begin,
                                       const uint32_t *around);

/* Sums the quads' models, by the vertices' axes, quad f in lane f % QW_LANES of model[f / QW_LANES], into the system;
   each diagonal grows by damping times itself. The right-hand side becomes minus the gradient. axis: qw_vec3[count][2].
 */
void qw_relax_system_fill(qw_env *env, qw_relax_system *s, const qw_relax_model *model, qw_vec3 (*axis)[2],
                          float damping);

/* x, from zero, until the residual has fallen by `tolerance` or so many iterations are done; returns their number. */
uint32_t qw_relax_system_solve(qw_env *env, qw_relax_system *s, float tolerance, uint32_t most);

/* Regular offsets as the paper makes them (Section 3.3, Table 4): on the surface's own triangles, for the -mr kinds by
 * way of ever coarser complexes. */
#pragma once

#include "remesh/quantise/regular.h"

/* How a finer complex follows from a coarser one: d_fine[e] = R2(turn[e]) d_coarse[edge[e]], or zero where edge[e] is
 * QW_NONE. */
typedef struct qw_collapse {
    uint32_t *edge; /* uint32_t[edge_count of the finer] */
    uint8_t *turn;  /* uint8_t[the same] */
} qw_collapse;

/* One level: removes zero edges between two regular triangles, no two of them adjacent. Each of the two triangles then
   says that its other two edges are equal but for a turn, and they become one. Returns false, and no result, where
   fewer than one triangle in twenty goes. */
bool qw_complex_collapse(qw_env *env, const qw_complex *fine, qw_complex *coarse, qw_collapse *map);
void qw_complex_expand(const qw_complex *coarse, const qw_collapse *map, qw_complex *fine);

/* Changes m->d. */
qw_regular_counts qw_make_regular(qw_env *env, qw_offset_mesh *m, qw_flow_choice kind, qw_cost_kind cost);

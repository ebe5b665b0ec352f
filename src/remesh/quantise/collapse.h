/* Parts of the surface that given integers on a decimated complex would make vanish: a protrusion thinner than a
 * quad, whose cones all fall on one vertex; a handle; the band between two boundaries. Rounding 0.3 to 0 is always
 * the cheapest there, so such zeros are counted and other integers are preferred.
 *
 * Vertices joined by zero edges become one. That does no harm where the contracted part is a disc that leaves a
 * vertex of valence 2 or more and touches at most one stretch of the boundary.
 */
#pragma once

#include "remesh/quantise/decimated.h"

typedef struct qw_collapse_finder {
    const qw_complex *complex;
    uint32_t vertex_count;
    uint32_t *corner;  /* uint32_t[3 face_count], vertices numbered from 0 */
    int32_t *valence;  /* int32_t[vertex_count], of inner vertices: the angle of the real offsets around it, in quarter
                          turns */
    uint8_t *boundary; /* uint8_t[vertex_count] */
    uint32_t *parent;  /* the rest: room to work in */
    struct qw_collapsed *of;
} qw_collapse_finder;

/* In the current scope. The decimated complex must outlive it; its d may change between calls. */
qw_collapse_finder qw_collapse_finder_make(qw_env *env, const qw_decimated *s);

/* The number of contracted parts that d (qw_int2[edge_count]) would make vanish. */
uint32_t qw_find_collapsed(const qw_collapse_finder *finder, const qw_int2 *d);

/* Square lattices in tangent planes, and the integers by which those of neighbours differ (paper, Eq. (2) and
 * Definition 3.1). */
#pragma once

#include "base/rosy.h"

/* The lattice at a vertex v: { p + h (x o + y (n x o)) : x, y integers }, in the tangent plane through the vertex. */
typedef struct qw_lattice {
    qw_vec3 vertex, normal, o, p;
    float h; /* edge length wanted here: rho times the scale field */
} qw_lattice;

/* The integers of Eq. (2) for two neighbours: the lattice points of u and v, near both vertices, that are nearest to
 * one another. */
typedef struct qw_offsets {
    qw_int2 tu, tv; /* in the frames of u and of v, from pu and pv */
    float distance2;
} qw_offsets;
qw_offsets qw_match_lattices(const qw_lattice *u, const qw_lattice *v);
/* The lattice point of these integers. */
static inline qw_vec3 qw_lattice_point(const qw_lattice *l, qw_int2 t)
{
    qw_vec3 a = qw_cross(l->normal, l->o);
    return qw_madd(qw_madd(l->p, l->h * (float)t.x, l->o), l->h * (float)t.y, a);
}

/* The lattice point nearest to a point; *t: its integers. */
qw_vec3 qw_nearest_lattice_point(const qw_lattice *l, qw_vec3 point, qw_int2 *t);

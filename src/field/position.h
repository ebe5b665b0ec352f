/* Position field: a square lattice at every vertex, as consistent as can be between neighbours in the sense of Eq. (2).
 */
#ifndef QW_FIELD_POSITION_H
#define QW_FIELD_POSITION_H

#include "hierarchy/hierarchy.h"
#include "math/rosy.h"

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
static inline qw_vec3 qw_lattice_point(const qw_lattice *l, qw_int2 t)
{
    qw_vec3 a = qw_cross(l->normal, l->o);
    return qw_madd(qw_madd(l->p, l->h * (float)t.x, l->o), l->h * (float)t.y, a);
}

/* Solves Eq. (2) coarse to fine. orientation: qw_vec3[vertex_count of level 0]; size: float[the same], wanted edge
   length. Vertices on curves keep a lattice line on the curve, corners a lattice point on themselves, on every level.
   Returns qw_vec3[the same]: for each vertex the lattice point nearest to it. */
qw_vec3 *qw_position_field(qw_env *env, const qw_hierarchy *hierarchy, const qw_vec3 *orientation, const float *size);

/* The energy of Eq. (2) in units of the local squared edge length. */
double qw_position_energy(const qw_level *level, const qw_vec3 *orientation, const float *size,
                          const qw_vec3 *position);

#endif

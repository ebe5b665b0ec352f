#include "remesh/offsets/lattice.h"

#include "base/elementary.h"

#include <math.h>

/* Coordinates of a point in the lattice, in units of h. */
static void lattice_coordinates(const qw_lattice *l, qw_vec3 point, float *x, float *y)
{
    qw_vec3 q = qw_scale(qw_sub(point, l->p), 1.0f / l->h);
    *x = qw_dot(q, l->o);
    *y = qw_dot(q, qw_cross(l->normal, l->o));
}

qw_vec3 qw_nearest_lattice_point(const qw_lattice *l, qw_vec3 point, qw_int2 *t)
{
    float x, y;
    lattice_coordinates(l, point, &x, &y);
    *t = (qw_int2){(int32_t)qw_floor(x + 0.5f), (int32_t)qw_floor(y + 0.5f)};
    return qw_lattice_point(l, *t);
}

/* Squared sine of the angle between two tangent planes below which they meet too far away to say anything. */
static const float PARALLEL2 = 1e-4f;

/* A point near both vertices and near both tangent planes: where the planes' common line comes nearest to the middle.
 */
static qw_vec3 middle_point(const qw_lattice *u, const qw_lattice *v)
{
    qw_vec3 middle = qw_scale(qw_add(u->vertex, v->vertex), 0.5f);
    float c = qw_dot(u->normal, v->normal), room = 1.0f - c * c;
    if (room < PARALLEL2) return middle;
    float du = qw_dot(u->normal, qw_sub(u->vertex, middle)), dv = qw_dot(v->normal, qw_sub(v->vertex, middle));
    float a = (du - c * dv) / room, b = (dv - c * du) / room;
    qw_vec3 shift = qw_madd(qw_scale(u->normal, a), b, v->normal);
    float reach2 = qw_length2(qw_sub(u->vertex, v->vertex));
    return qw_length2(shift) <= reach2 ? qw_add(middle, shift) : middle;
}

/* The four lattice points of u around the middle, each with the nearest of v's: the best pair. */
qw_offsets qw_match_lattices(const qw_lattice *u, const qw_lattice *v)
{
    qw_vec3 middle = middle_point(u, v);
    float x, y;
    lattice_coordinates(u, middle, &x, &y);
    qw_int2 base = {(int32_t)qw_floor(x), (int32_t)qw_floor(y)};
    qw_offsets best = {.distance2 = INFINITY};
    for (int k = 0; k < 4; k++) {
        qw_int2 tu = {base.x + (k & 1), base.y + (k >> 1)}, tv;
        qw_vec3 pu = qw_lattice_point(u, tu), pv = qw_nearest_lattice_point(v, pu, &tv);
        float d = qw_length2(qw_sub(pu, pv));
        if (d < best.distance2) best = (qw_offsets){tu, tv, d};
    }
    return best;
}

/* Exact predicates over points with whole coordinates. Every answer is right: coordinates are below 2^QW_LATTICE_BITS,
 * so that differences and their products are exact in double precision; only the last product of an orientation may be
 * rounded, and where its sign is not certain it is found again in 128-bit integers. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum { QW_LATTICE_BITS = 24 };

/* A point of the lattice: 0 <= at[k] < 2^QW_LATTICE_BITS. */
typedef struct qw_wrap_lattice_point {
    int32_t at[3];
} qw_wrap_lattice_point;

static inline bool qw_same_point(const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b)
{
    return a->at[0] == b->at[0] && a->at[1] == b->at[1] && a->at[2] == b->at[2];
}

/* Cross product (b - a) x (c - a): exact, below 2^52. */
void qw_exact_normal(const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b, const qw_wrap_lattice_point *c,
                     double normal[3]);

/* Whether two triangles of a surface that may not intersect itself have a point in common that they should not have.
 * Their first `shared` corners are the same points of the surface, in this order: 0: they are to be disjoint; 1: to
 * meet there only; 2: along that edge only. Both have an area. */
bool qw_triangles_collide(const qw_wrap_lattice_point a[3], const qw_wrap_lattice_point b[3], int shared);

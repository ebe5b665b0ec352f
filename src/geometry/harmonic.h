/* Harmonic functions on pieces of a surface, by linear finite elements: where some vertices have values, the others get
 * those that vary least. Between two curves its lines of equal value go around with them, and none of them ends. */
#pragma once

#include "geometry/trimesh.h"

/* The weight of an edge in linear finite elements: half the cotangents of the angles across from it, of its own face
   alone at a rim, raised to a fiftieth so that functions have their extremes on rims. */
double qw_cotangent_weight(const qw_trimesh *m, uint32_t h, bool is_rim);

typedef struct qw_harmonic {
    const qw_trimesh *mesh;
    const uint32_t *face, face_count; /* of the piece */
    uint32_t count, *vertex;          /* of the piece: uint32_t[count] */
    uint32_t *place;                  /* uint32_t[vertices of the mesh]: the place of each of these in `vertex` */
    uint8_t *is_fixed;                /* uint8_t[count]: whether the vertex has its value; the caller's to set */
    double *value;                    /* double[count]; the caller's to set where it is fixed */
    uint32_t edges, *end;             /* uint32_t[2 edges], places */
    double *weight, *diagonal;        /* double[edges], double[count] */
} qw_harmonic;

/* The piece has the faces f, in that order, and their mark of[f] is `id`. Nothing is fixed, values are 0. In the
   current scope. */
qw_harmonic qw_harmonic_begin(qw_env *env, const qw_trimesh *mesh, const uint32_t *face, uint32_t face_count,
                              const uint32_t *of, uint32_t id);

/* Sets the values that are not fixed. */
void qw_harmonic_solve(qw_env *env, qw_harmonic *p);

/* The integral of the squared gradient: of a band between two curves with 0 and 1, its length over its width. */
double qw_harmonic_energy(const qw_harmonic *p);

/* The gradient turned by a quarter, along the lines of equal value, at each vertex the sum over its faces, times -2
   area: qw_vec3[count], in the current scope. */
qw_vec3 *qw_harmonic_lines(qw_env *env, const qw_harmonic *p);

/* One level of the connection Laplacian that remesh/field/connection.h describes, and the complex numbers on it. */
#pragma once

#include "remesh/field/hierarchy.h"

typedef struct qw_phasor {
    float re, im;
} qw_phasor;

static inline qw_phasor qw_phasor_mul(qw_phasor a, qw_phasor b)
{
    return (qw_phasor){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}
static inline qw_phasor qw_phasor_conj(qw_phasor a) { return (qw_phasor){a.re, -a.im}; }
static inline qw_phasor qw_phasor_add(qw_phasor a, qw_phasor b) { return (qw_phasor){a.re + b.re, a.im + b.im}; }
/* To length 1; 1 where a is too short to have a direction. */
static inline qw_phasor qw_phasor_unit(qw_phasor a)
{
    float l = sqrtf(a.re * a.re + a.im * a.im);
    return l > 1e-18f ? (qw_phasor){a.re / l, a.im / l} : (qw_phasor){1, 0};
}

/* The cross along d, in the plane of n and x: the fourth power of its angle to x. */
static inline qw_phasor qw_phasor_of_cross(qw_vec3 d, qw_vec3 n, qw_vec3 x)
{
    qw_phasor z = qw_phasor_unit((qw_phasor){qw_dot(d, x), qw_dot(d, qw_cross(n, x))});
    z = qw_phasor_mul(z, z);
    return qw_phasor_mul(z, z);
}

typedef struct qw_connection_level {
    const qw_level *level; /* its graph: row v of link is level->begin[v] .. level->begin[v + 1] */
    float *diagonal; /* float[vertex_count], >= 0; 0 where nothing moves z: constrained, or with no neighbour left */
    qw_phasor *link; /* qw_phasor[begin[vertex_count]]: w r, the conjugate on the way back; 0 to and from constrained
                        vertices */
    /* qw_phasor[vertex_count]: what constrained neighbours and the curvature of thin protrusions add */
    qw_phasor *pull;
    qw_phasor *along; /* qw_phasor[vertex_count], length 1; NULL on the coarsest level */
    uint32_t *vertex; /* uint32_t[vertex_count]: the vertex of level 0 from whose axis z turns; QW_NONE where all below
                         are constrained */
    double pulled;    /* sum of the weights in pull on level 0 */
} qw_connection_level;

/* Which primitives the vertices of quads lie on, while these are made even. */
#pragma once

#include "products/exact/primitive.h"
#include "geometry/quadmesh.h"

/* Cosine between an edge and the axis, the way around it or a tangent, along which it runs. */
static const double QW_ALONG_AXIS = 0.85;

/* Where vertices belong. */
typedef struct qw_held {
    const qw_primitive *item;
    uint32_t item_count;
    uint32_t (*of)[2]; /* uint32_t[vertices][2]: primitives that a vertex lies on, or QW_NONE; the first first */
    const float *edge; /* float[vertices]: mean length of the edges there */
    double *place;     /* double[vertices][3] */
    void (*settle)(void *user);                           /* puts all places onto their primitives again */
    void (*put)(void *user, uint32_t v, double place[3]); /* puts one there */
    void (*find_tangents)(void *user);                    /* puts rows along tangents onto these, and marks them */
    void (*leave_tangent)(void *user, uint32_t v);        /* of what it was before */
    const uint8_t *on_tangent;                            /* uint8_t[vertices] */
    void *user;
} qw_held;

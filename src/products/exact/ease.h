/* Even circles and right angles of quads on planes, cylinders and their like. */
#pragma once

#include "products/exact/primitive.h"
#include "geometry/quadmesh.h"

/* Where vertices belong. */
typedef struct qw_held {
    const qw_primitive *item;
    uint32_t (*of)[2]; /* uint32_t[vertices][2]: primitives that a vertex lies on, or QW_NONE; the first first */
    const float *edge; /* float[vertices]: mean length of the edges there */
    double *place;     /* double[vertices][3] */
    void (*settle)(void *user);                           /* puts all places onto their primitives again */
    void (*put)(void *user, uint32_t v, double place[3]); /* puts one there */
    void *user;
} qw_held;

/* Curves on rounds that end at no corner get equal edges, by less than MOST_AROUND of an edge, and what lies between
   goes along. Then vertices move on their primitives where that makes the corners around nearer to right angles: those
   all of whose neighbours lie on the primitive too, and, along it, those on other curves of two. quads: linked, with
   kinds. No quad becomes bad, nor flipped. */
void qw_even_circles(qw_env *env, const qw_quadmesh *quads, const qw_held *held);

/* Where a quad would become bad, and worse by more than `slack` than it was, least sines of its corners both, its
   vertices go back to `before`, double[vertices][3], and back, uint8_t[vertices], is 1 (NULL: not told). */
void qw_undo_bad(qw_env *env, const qw_quadmesh *quads, double *place, const double *before, double slack,
                 uint8_t *back);

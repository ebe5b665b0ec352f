/* Even rows of quads on cylinders and cones. */
#ifndef QW_EXACT_ROWS_H
#define QW_EXACT_ROWS_H

#include "exact/primitive.h"
#include "mesh/quadmesh.h"

/* Where vertices belong. */
typedef struct qw_held {
    const qw_primitive *item;
    uint32_t item_count;
    uint32_t (*of)[2]; /* uint32_t[vertices][2]: primitives that a vertex lies on, or QW_NONE; the first first */
    const float *edge; /* float[vertices]: mean length of the edges there */
    double *place;     /* double[vertices][3] */
    void (*settle)(void *user); /* puts all places onto their primitives again */
    void *user;
} qw_held;

/* Turns vertices about the axes, and shifts them along, by less than half an edge: circles get equal edges, lines along
   the axis one angle, rows around it one height. The vertices lie on their primitives before. quads: linked, with
   kinds. */
void qw_even_rows(qw_env *env, const qw_quadmesh *quads, const qw_held *held);

#endif

/* Bicubic patches joined into shells, as STEP text (AP214, ISO 10303-21). */
#ifndef QW_IO_STEP_H
#define QW_IO_STEP_H

#include "io/file.h"

/* Bezier patches over quads. Points are shared: the four of an edge by the patches on both of its sides. */
typedef struct qw_patches {
    uint32_t point_count, vertex_count, edge_count, face_count, shell_count;
    const double *point;          /* double[point_count][3]; the first vertex_count are the corners */
    const uint32_t (*edge)[4];    /* uint32_t[edge_count][4]: points from end to end */
    const uint32_t (*face)[16];   /* uint32_t[face_count][4 x 4]: row i along the first side, column j along the last */
    const uint32_t (*side)[4];    /* uint32_t[face_count][4]: edges in order */
    const uint8_t (*is_along)[4]; /* uint8_t[face_count][4]: 1: the face goes along the edge, 0: against it */
    const uint32_t *shell;        /* uint32_t[face_count] */
    const uint8_t *is_closed;     /* uint8_t[shell_count] */
    double tolerance;             /* how far what is said to meet may be apart, in the units of the points */
} qw_patches;

/* Closed shells are solids, others surface models. */
void qw_put_step(qw_env *env, qw_file *file, const qw_patches *patches);

#endif

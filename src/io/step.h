/* Bicubic patches joined into shells, as STEP text (AP214, ISO 10303-21). */
#pragma once

#include "io/file.h"

/* Grids of patches as one bicubic B-spline surface each, whose cubics meet with one tangent: of what would be
   (3 m + 1) by (3 n + 1) Bezier points the ends of cubics inside are left out, the means of those beside them. */
typedef struct qw_patch_blocks {
    uint32_t count, edge_count;
    uint32_t *edge_first, *edge_point; /* points of each edge: edge_point[edge_first[e] .. edge_first[e + 1]) */
    size_t *first;                     /* size_t[count + 1] */
    uint32_t *point;                   /* of block b: point[first[b] ...], 2 m + 2 rows of 2 n + 2 */
    uint32_t (*span)[2], (*side)[4];   /* m, n; edges around */
    uint8_t (*is_along)[4];
    uint32_t *shell; /* uint32_t[count] */
} qw_patch_blocks;

/* A plane, by a point and its normal; a cylinder, or a cone whose radius grows along the axis by an angle. */
typedef struct qw_patch_surface {
    double point[3], axis[3], radius, angle; /* radius 0: a plane */
    bool is_hollow;                          /* seen from inside */
} qw_patch_surface;

/* Blocks of one such surface as one face with loops. Of loop l the sides are side[side_first[l] .. side_first[l + 1]):
   2 e + 1 goes along edge e of the blocks, 2 e against it. */
typedef struct qw_patch_faces {
    uint32_t count, loop_count;
    uint32_t *of_block;        /* uint32_t[blocks]: the face that each is part of, or QW_NONE */
    uint32_t *block;           /* uint32_t[count]: one of its blocks */
    uint32_t *outer;           /* uint32_t[count]: the loop around it; QW_NONE: none is more so than others */
    qw_patch_surface *surface; /* qw_patch_surface[count] */
    uint32_t *loop_first;      /* uint32_t[count + 1] */
    uint32_t *side_first, *side;
    uint32_t *arc; /* uint32_t[edges of blocks]: the face about whose axis it is an arc, or QW_NONE */
} qw_patch_faces;

/* Bezier patches over quads. Points are shared: the four of an edge by the patches on both of its sides. */
typedef struct qw_patches {
    uint32_t point_count, vertex_count, edge_count, face_count, shell_count;
    double *point;                /* double[point_count][3]; the first vertex_count are the corners */
    const uint32_t (*edge)[4];    /* uint32_t[edge_count][4]: points from end to end */
    const uint32_t (*face)[16];   /* uint32_t[face_count][4 x 4]: row i along the first side, column j along the last */
    const uint32_t (*side)[4];    /* uint32_t[face_count][4]: edges in order */
    const uint8_t (*is_along)[4]; /* uint8_t[face_count][4]: 1: the face goes along the edge, 0: against it */
    const uint32_t *shell;        /* uint32_t[face_count] */
    const uint8_t *is_closed;     /* uint8_t[shell_count] */
    const uint32_t *outer;        /* uint32_t[shell_count]: the shell whose solid this one hollows; QW_NONE: none */
    const qw_patch_blocks *blocks; /* NULL: a face a quad */
    const qw_patch_faces *faces;   /* NULL: each block is a face */
    double tolerance;              /* how far what is said to meet may be apart, in the units of the points */
} qw_patches;

/* Closed shells are solids, with the cavities in them, others surface models. */
void qw_put_step(qw_env *env, qw_file *file, const qw_patches *patches);

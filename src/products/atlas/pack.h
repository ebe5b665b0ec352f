/* Packing: charts into the unit square, or several, as large as they fit, without overlap and with a margin. */
#pragma once

#include "base/env.h"

#include <stdbool.h>

/* One chart as packing sees it: triangles in the plane. */
typedef struct qw_piece {
    const double (*at)[2]; /* double[point_count][2] */
    uint32_t point_count, triangle_count;
    const uint32_t *corner; /* uint32_t[triangle_count][3] */
    /* the result: a point p goes to turn(p) * scale + shift, turned by so many quarters, in a tile */
    uint32_t quarters, tile;
    double shift[2];
} qw_piece;

typedef struct qw_packing {
    double scale; /* the sides of a tile are 1 */
    double used;  /* share of the tiles' area that triangles cover */
    uint32_t tiles;
} qw_packing;

typedef struct qw_pack_options {
    uint32_t texels; /* along a side of a tile */
    uint32_t margin; /* texels between charts, at least; half of it to the border */
    uint32_t tiles;  /* at most */
    double scale;    /* 0: the largest that fits */
    double enough;   /* share of the square with which the search ends, or where that is not in sight; 0: it does not */
    bool is_untold;  /* without an account of progress */
} qw_pack_options;

/* Sets the results of the pieces. Fails with QW_ARGUMENT where they do not fit at the given scale, or not with that
   margin at any. */
qw_packing qw_pack(qw_env *env, qw_piece *piece, uint32_t count, const qw_pack_options *options);

/* A point of a packed piece. */
void qw_place_in_tile(const qw_piece *piece, double scale, const double at[2], double to[2]);

/* A linear system of a multigrid hierarchy, with its aggregates and the vectors of a cycle. Shared by setup
 * (multigrid_setup.c, aggregation.c) and solution (multigrid.c). */
#pragma once

#include "solve/csr.h"

#include <string.h>

/* QW_MAX_GRIDS bounds the recursion: each system has at most 0.6 of the rows of the one before. QW_GRID_SUMS: dot
   products that are taken in one pass. */
enum { QW_MAX_GRIDS = 32, QW_GRID_SUMS = 3 };

/* Members and groups are packed with their sign: index << 1 | negative. */
typedef struct qw_grid {
    uint32_t n;
    uint32_t grain;                 /* rows a block; part of the result's definition */
    bool three;                     /* every row has three entries: loops of known length take two thirds of the time */
    const uint32_t *first, *column; /* as qw_csr */
    const float *value;
    const double *exact;       /* double[n], the diagonal */
    float *diagonal;           /* float[n] */
    float *inverse;            /* float[n], of the smoother's diagonal; 0: left alone */
    uint32_t *group;           /* uint32_t[n], packed unknown of the next system, or QW_NONE */
    uint32_t *member_first;    /* uint32_t[next n + 1] */
    uint32_t *member;          /* uint32_t[member_first[next n]], packed unknowns of this one */
    float *r, *y;              /* float[n]: right-hand side, and what the sweeps began with it */
    float *z[2], *v;           /* float[n]: what the two steps found, and A z[0] */
    double *sum[QW_GRID_SUMS]; /* double[blocks] */
    float factor[2];           /* the solution is factor[0] z[0] + factor[1] z[1] */
    float step;                /* of r along -v, before it is swept */
    uint32_t way;              /* which z is being made */
    float *dense;              /* NULL, or float[n * n], the inverse */
    struct qw_grid *next;      /* NULL: the coarsest */
} qw_grid;

struct qw_multigrid {
    const qw_csr *matrix;
    uint32_t grid_count;
    qw_grid grid[QW_MAX_GRIDS]; /* 0 is the finest */
    float *p, *q;               /* float[n], the outer direction and A times it */
};

/* Signs are as good as random, so a branch would be mispredicted half of the time. */
static inline float qw_with_sign(float value, uint32_t packed)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits ^= packed << 31;
    memcpy(&value, &bits, sizeof bits);
    return value;
}

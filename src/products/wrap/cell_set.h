/* Sets of cells of a lattice, one bit each, so that a word says and does for 64 cells at once what is asked of one:
 * which are joined across faces to a cell, and which lie in gaps. */
#pragma once

#include "base/env.h"

/* Rows along x of whole words; bits beyond the row are 0. */
typedef struct qw_cell_set {
    uint32_t across[3], words; /* cells; words of a row */
    uint64_t *row;             /* uint64_t[across[2]][across[1]][words] */
} qw_cell_set;

/* None. In the caller's scope. */
qw_cell_set qw_cell_set_new(qw_env *env, const uint32_t across[3]);

static inline uint64_t *qw_cell_set_row(const qw_cell_set *c, uint32_t y, uint32_t z)
{
    return c->row + ((size_t)z * c->across[1] + y) * c->words;
}

static inline bool qw_cell_set_has(const qw_cell_set *c, uint32_t x, uint32_t y, uint32_t z)
{
    return qw_cell_set_row(c, y, z)[x / 64] >> x % 64 & 1;
}

static inline void qw_cell_set_add(qw_cell_set *c, uint32_t x, uint32_t y, uint32_t z)
{
    qw_cell_set_row(c, y, z)[x / 64] |= (uint64_t)1 << x % 64;
}

static inline void qw_cell_set_remove(qw_cell_set *c, uint32_t x, uint32_t y, uint32_t z)
{
    qw_cell_set_row(c, y, z)[x / 64] &= ~((uint64_t)1 << x % 64);
}

/* Those that are not in the set. */
qw_cell_set qw_cell_set_others(qw_env *env, const qw_cell_set *c);

/* What walks over cells from one to the next. */
typedef struct qw_flood {
    qw_env *env;
    uint64_t *fresh; /* uint64_t[words of all rows]: reached, and their neighbours not yet looked at */
    uint32_t *stack; /* words that have such cells */
    size_t capacity, count, done;
} qw_flood;

qw_flood qw_flood_begin(qw_env *env, const qw_cell_set *like);
void qw_flood_end(qw_flood *f);

/* Moves all that is joined across faces to a cell of `from`, and it itself, to `to`. extent: the sides of their box. */
void qw_flood_from(qw_flood *f, qw_cell_set *from, const uint32_t at[3], qw_cell_set *to, uint32_t extent[3]);

/* Leaves those that are in a ball of such cells, a cube of three across without its corners, and those at the rim of
 * the lattice. Whether others went. */
bool qw_cell_set_open(qw_env *env, qw_cell_set *c);

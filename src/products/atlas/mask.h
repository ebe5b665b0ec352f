/* Bit masks of cells: what is drawn of a chart, and what is filled of the tiles it is to lie in. */
#pragma once

#include "base/env.h"

#include <stdbool.h>

typedef struct qw_mask {
    uint32_t across, down, words; /* cells, and words of a row */
    uint32_t step;                /* rows are looked at in steps of so many: each once, far from the last ones */
    uint64_t *row;                /* uint64_t[down][words] */
} qw_mask;

/* Sets all but the rows. */
void qw_mask_size(qw_mask *m, uint32_t across, uint32_t down);
/* Sets cells of a row, both ends included. */
void qw_mask_fill(qw_mask *m, uint32_t y, uint32_t from, uint32_t to);
/* Widened by so many cells in all eight directions; all three of one size, the last two clear. */
void qw_mask_widen(const qw_mask *m, uint32_t reach, qw_mask *across, qw_mask *wide);
/* Whether a mask that lies with its lower corner at (x, y) meets anything. */
bool qw_mask_meets(const qw_mask *tile, const qw_mask *m, uint32_t x, uint32_t y);
/* Sets or clears the mask's cells there. */
void qw_mask_stamp(qw_mask *tile, const qw_mask *m, uint32_t x, uint32_t y, bool is_there);

/* Cells of a mask's row that follow one another. */
typedef struct qw_mask_run {
    uint32_t row, first, length;
} qw_mask_run;
/* The runs of a mask, each once: the longest first, as it is most in the way, then row by row in its steps. to:
   qw_mask_run[], or NULL: they are only counted. */
uint32_t qw_mask_runs(const qw_mask *m, qw_mask_run *to);

/* What is filled, ready for many questions: with each row those in which a cell is set where one of the next 2^k of
   the row is. So all places along a row are tested together, two words for each 64 of them and run of the mask. */
typedef struct qw_board {
    uint32_t across, words, levels, rows;
    uint32_t used; /* rows that may hold something; those above are clear */
    uint64_t *row; /* uint64_t[rows][levels][words], and some behind the last that are read, not used */
    uint8_t *room; /* uint8_t[rows]: the largest k at which 2^k cells of the row that follow one another are clear */
} qw_board;

/* across: cells of a row; runs are no longer. In the caller's scope. */
qw_board qw_board_of(qw_env *env, uint32_t across, uint32_t rows);
void qw_board_clear(qw_board *b);
/* longest: no run that is placed later is longer. */
void qw_board_stamp(qw_board *b, const qw_mask *m, uint32_t x, uint32_t y, uint32_t longest);
/* The first x of from .. to at which the mask of these runs, its lower corner in row y, meets nothing; QW_NONE: none.
 */
uint32_t qw_board_place(const qw_board *b, const qw_mask_run *run, uint32_t count, uint32_t from, uint32_t to,
                        uint32_t y);

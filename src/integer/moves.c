/* The kernel of the equations of regularity, by elimination (Gauss and Jordan). The unknowns are the components of the
 * offsets; those without a pivot are free, and each of them is 1 in one vector of the basis. */
#include "integer/moves.h"

#include "math/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static const double NOTHING = 1e-6; /* entries are small multiples of a half */

typedef struct equations {
    uint32_t rows, columns;
    double *entry;   /* double[rows][columns] */
    uint32_t *pivot; /* uint32_t[columns]: row, or QW_NONE */
} equations;

static double *row_of(const equations *q, uint32_t r) { return q->entry + (size_t)r * q->columns; }

static void fill_equations(const qw_complex *c, equations *q)
{
    for (uint32_t h = 0; h < 3 * c->face_count; h++)
        for (uint32_t k = 0; k < 2; k++) {
            uint32_t e = c->edge[h];
            if (c->fixed[e] & (k ? QW_FIXED_Y : QW_FIXED_X)) continue; /* zero, or as it is */
            qw_int2 one = qw_turn(c->rot[h], (qw_int2){!k, (int32_t)k});
            row_of(q, 2 * (h / 3))[2 * e + k] += one.x, row_of(q, 2 * (h / 3) + 1)[2 * e + k] += one.y;
        }
}

/* Clears the column in all rows but the pivot's. That row is 0 to the left of the column: columns there either have
   been cleared, or were 0 in all rows that had no pivot yet. */
static void subtract(equations *q, uint32_t pivot, uint32_t column)
{
    assert(pivot < q->rows && column < q->columns);
    double *p = row_of(q, pivot), scale = 1 / p[column];
    for (uint32_t j = column; j < q->columns; j++) p[j] *= scale;
    for (uint32_t i = 0; i < q->rows; i++) {
        double *r = row_of(q, i), factor = r[column];
        if (i == pivot || fabs(factor) < NOTHING) continue;
        for (uint32_t j = column; j < q->columns; j++) r[j] -= factor * p[j];
    }
}

static void eliminate(equations *q)
{
    memset(q->pivot, 0xff, q->columns * sizeof *q->pivot);
    for (uint32_t column = 0, next = 0; column < q->columns && next < q->rows; column++) {
        uint32_t best = next;
        for (uint32_t i = next; i < q->rows; i++)
            if (fabs(row_of(q, i)[column]) > fabs(row_of(q, best)[column])) best = i;
        if (fabs(row_of(q, best)[column]) < NOTHING) continue;
        for (uint32_t j = column; j < q->columns; j++) {
            double swapped = row_of(q, best)[j];
            row_of(q, best)[j] = row_of(q, next)[j], row_of(q, next)[j] = swapped;
        }
        subtract(q, next, column);
        q->pivot[column] = next++;
    }
}

/* The vector of the basis in which this column is 1; false where it is not whole. */
static bool read_move(const equations *q, uint32_t free, qw_int2 *move)
{
    assert(free < q->columns);
    for (uint32_t j = 0; j < q->columns; j++) {
        double x = j == free ? 1 : q->pivot[j] == QW_NONE ? 0 : -row_of(q, q->pivot[j])[free];
        int32_t whole = (int32_t)qw_round_away(x);
        if (fabs(x - whole) > NOTHING) return false;
        if (j % 2) move[j / 2].y = whole;
        else move[j / 2].x = whole;
    }
    return true;
}

static bool is_fixed(const qw_complex *c, uint32_t column)
{
    return c->fixed[column / 2] & (column % 2 ? QW_FIXED_Y : QW_FIXED_X);
}

uint32_t qw_find_moves(qw_env *env, const qw_complex *c, uint32_t most, qw_int2 **move)
{
    assert(c->fixed && move);
    *move = NULL;
    if (c->edge_count > QW_MOST_MOVED_EDGES) return 0;
    *move = QW_NEW(env, qw_int2, most * (size_t)c->edge_count);
    qw_scope_begin(env);
    equations q = {.rows = 2 * c->face_count, .columns = 2 * c->edge_count};
    q.entry = QW_NEW_ZERO(env, double, (size_t)q.rows *q.columns);
    q.pivot = QW_NEW(env, uint32_t, q.columns);
    fill_equations(c, &q);
    eliminate(&q);
    uint32_t count = 0;
    bool whole = true;
    for (uint32_t j = 0; j < q.columns && whole; j++) {
        if (q.pivot[j] != QW_NONE || is_fixed(c, j)) continue;
        whole = count < most && read_move(&q, j, *move + (size_t)count * c->edge_count);
        count++;
    }
    qw_scope_end(env);
    return whole ? count : 0;
}

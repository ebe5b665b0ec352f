/* The kernel of the equations of regularity, by elimination (Gauss and Jordan). The unknowns are the components of the
 * offsets; those without a pivot are free, and each of them is 1 in one vector of the basis. */
#include "remesh/quantise/closed_moves.h"

#include "base/elementary.h"

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

/* Gauss-Jordan elimination with row exchanges. pivot: receives the row that each column is solved by, or QW_NONE.
 * */
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

/* The vectors of the basis, double[count][columns], each 1 in one free column. Returns how many there are, of which
   `most` are written. */
static uint32_t read_vectors(const equations *q, const qw_complex *c, uint32_t most, double *vector)
{
    uint32_t count = 0;
    for (uint32_t free = 0; free < q->columns; free++) {
        if (q->pivot[free] != QW_NONE || qw_is_fixed(c->fixed[free / 2], free) || count++ >= most) continue;
        double *v = vector + (size_t)(count - 1) * q->columns;
        for (uint32_t j = 0; j < q->columns; j++)
            v[j] = j == free ? 1 : q->pivot[j] == QW_NONE ? 0 : -row_of(q, q->pivot[j])[free];
    }
    return count;
}

static void add_vector(double *to, const double *vector, uint32_t columns)
{
    for (uint32_t j = 0; j < columns; j++) to[j] += vector[j];
}

/* Bits of the vectors that are an odd number of halves in this column. */
static uint32_t odd_halves(const double *vector, uint32_t count, uint32_t columns, uint32_t column)
{
    uint32_t bits = 0;
    for (uint32_t i = 0; i < count; i++) {
        double x = vector[(size_t)i * columns + column];
        bits |= (uint32_t)(fabs(x - qw_round_away(x)) > NOTHING) << i;
    }
    return bits;
}

/* Cones may leave vectors with halves. Sums of them are wanted with whole factors (each alone has something in its free
   column), and whole themselves where for each column those with an odd half there are taken an even number of times in
   sum: equations modulo 2. The vectors become a basis of these sums. */
static void make_whole(double *vector, uint32_t count, uint32_t columns)
{
    assert(count <= 32);
    uint32_t equation[32] = {0}; /* by its pivot, a bit that no other one has */
    for (uint32_t j = 0; j < columns; j++) {
        uint32_t bits = odd_halves(vector, count, columns, j), p = 0;
        for (uint32_t i = 0; i < count; i++)
            if (equation[i] && bits >> i & 1u) bits ^= equation[i];
        if (bits == 0) continue;
        while (!(bits >> p & 1u)) p++;
        for (uint32_t i = 0; i < count; i++)
            if (equation[i] >> p & 1u) equation[i] ^= bits;
        equation[p] = bits;
    }
    for (uint32_t i = 0; i < count; i++) /* the free ones first, as they take the pivots as they are */
        for (uint32_t p = 0; p < count && !equation[i]; p++)
            if (equation[p] >> i & 1u) add_vector(vector + (size_t)i * columns, vector + (size_t)p * columns, columns);
    for (uint32_t p = 0; p < count; p++)
        if (equation[p]) add_vector(vector + (size_t)p * columns, vector + (size_t)p * columns, columns);
}

/* As integers; false where they are none. */
static bool round_vectors(const double *vector, size_t numbers, qw_int2 *move)
{
    for (size_t j = 0; j < numbers; j++) {
        int32_t whole = (int32_t)qw_round_away(vector[j]);
        if (fabs(vector[j] - whole) > NOTHING) return false;
        if (j % 2) move[j / 2].y = whole;
        else move[j / 2].x = whole;
    }
    return true;
}

uint32_t qw_find_moves(qw_env *env, const qw_complex *c, uint32_t most, qw_int2 **move)
{
    assert(c->fixed && move && most <= 32);
    *move = NULL;
    if (c->edge_count > QW_MOST_MOVED_EDGES) return 0;
    *move = QW_NEW(env, qw_int2, most * (size_t)c->edge_count);
    qw_scope_begin(env);
    equations q = {.rows = 2 * c->face_count, .columns = 2 * c->edge_count};
    q.entry = QW_NEW_ZERO(env, double, (size_t)q.rows *q.columns);
    q.pivot = QW_NEW(env, uint32_t, q.columns);
    double *vector = QW_NEW(env, double, (size_t)most *q.columns);
    fill_equations(c, &q);
    eliminate(&q);
    uint32_t count = read_vectors(&q, c, most, vector);
    if (count > most) count = 0;
    make_whole(vector, count, q.columns);
    bool whole = round_vectors(vector, (size_t)count * q.columns, *move);
    qw_scope_end(env);
    return whole ? count : 0;
}

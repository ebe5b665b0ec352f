/* The coarser systems of a matrix: aggregates (aggregation.h), and the Galerkin product P'AP of each, again a signed
 * Laplacian. The smallest is inverted. */
#include "solve/aggregation.h"
#include "solve/multigrid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* GRAIN: rows a block of sweeps; or half of all rows, where there are no more than two blocks and a half is LEAST_HALF
   and more. DENSE: rows that are solved by the inverse, which then takes no longer than a sweep over the next finer
   system. PARTS: of a coarse matrix that are made side by side, each with its own marks, if it has SPLIT rows or more.
   */
enum { GRAIN = 2048, LEAST_HALF = 384, DENSE = 64, PARTS = 4, SPLIT = 512 };
/* A coarser system must have at most this share of the rows; else there is none. */
static const double SHRINK = 0.6;
/* A coarse diagonal, or a pivot, below this part of what it was made from is rounding: an isolated part without ground.
 */
static const double ROUNDING = 1e-10;

/* Row a of P'AP to value and column from `at` on; returns its end. mark: uint32_t[next n], positions, those of other
   rows below `at`. What rounding to float changes of the entries goes to the diagonal, so that a Laplacian without
   ground stays one. */
static uint32_t coarse_row(const qw_grid *l, uint32_t a, uint32_t at, uint32_t *mark, uint32_t *column, double *value,
                           double *diagonal)
{
    uint32_t begin = at;
    double own = 0, all = 0;
    for (uint32_t m = l->member_first[a]; m < l->member_first[a + 1]; m++) {
        uint32_t i = l->member[m] >> 1;
        own += l->exact[i];
        all += l->exact[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) {
            uint32_t packed = l->group[l->column[k]], b = packed >> 1;
            if (packed == QW_NONE) continue;
            double entry = qw_with_sign(l->value[k], packed ^ l->member[m]);
            if (b == a) {
                own += entry;
                continue;
            }
            if (mark[b] < begin || mark[b] == QW_NONE) {
                mark[b] = at;
                column[at] = b;
                value[at++ - begin] = 0;
            }
            value[mark[b] - begin] += entry;
        }
    }
    *diagonal = own > ROUNDING * all ? own : 0;
    return at;
}

typedef struct coarsening {
    const qw_grid *l, *c;
    uint32_t grain;
    uint32_t *first, *column; /* of the coarse matrix, each part's rows from `begin` on */
    float *value;
    double *exact;
    uint32_t begin[PARTS], end[PARTS];
    uint32_t *mark; /* uint32_t[PARTS * c->n] */
    double *row;    /* double[PARTS * c->n] */
} coarsening;

/* Rows begin .. end of the coarser matrix, into the part's own stretch of the arrays. */
static void coarse_task(void *user, uint32_t begin, uint32_t end)
{
    coarsening *w = user;
    uint32_t part = begin / w->grain, at = w->begin[part], *mark = w->mark + (size_t)part * w->c->n;
    double *row = w->row + (size_t)part * w->c->n;
    memset(mark, 0xff, w->c->n * sizeof *mark);
    for (uint32_t a = begin; a < end; a++) {
        uint32_t first = w->first[a] = at;
        at = coarse_row(w->l, a, at, mark, w->column, row, &w->exact[a]);
        for (uint32_t k = first; k < at; k++) {
            double entry = row[k - first];
            w->value[k] = (float)entry;
            if (w->exact[a] > 0) w->exact[a] += fabs((double)w->value[k]) - fabs(entry);
        }
    }
    w->end[part] = at;
}

/* Each part has room for all that its rows could hold; afterwards they are moved together. */
static void close_gaps(coarsening *w, uint32_t parts)
{
    uint32_t at = w->end[0];
    for (uint32_t p = 1; p < parts; p++) {
        uint32_t gap = w->begin[p] - at, count = w->end[p] - w->begin[p],
                 last = p + 1 < parts ? (p + 1) * w->grain : w->c->n;
        memmove(w->column + at, w->column + w->begin[p], count * sizeof *w->column);
        memmove(w->value + at, w->value + w->begin[p], count * sizeof *w->value);
        for (uint32_t a = p * w->grain; a < last; a++) w->first[a] -= gap;
        at += count;
    }
    w->first[w->c->n] = at;
}

/* The matrix of the coarser grid c, by groups of unknowns of l; in parts side by side, whose gaps are closed then. */
static void make_coarse(qw_env *env, const qw_grid *l, qw_grid *c)
{
    uint32_t entries = l->first[l->n], parts = c->n < SPLIT ? 1 : PARTS;
    coarsening w = {.l = l, .c = c, .grain = c->n / parts + (c->n % parts != 0)};
    w.first = QW_NEW(env, uint32_t, c->n + 1), w.column = QW_NEW(env, uint32_t, entries),
    w.value = QW_NEW(env, float, entries);
    w.exact = QW_NEW(env, double, c->n);
    qw_scope_begin(env);
    w.mark = QW_NEW(env, uint32_t, (size_t)parts * c->n), w.row = QW_NEW(env, double, (size_t)parts * c->n);
    for (uint32_t m = 0, p = 1, room = 0; p < parts; p++) {
        for (; m < l->member_first[p * w.grain]; m++)
            room += l->first[(l->member[m] >> 1) + 1] - l->first[l->member[m] >> 1];
        w.begin[p] = room;
    }
    qw_parallel(env, c->n, w.grain, coarse_task, &w);
    close_gaps(&w, parts);
    qw_scope_end(env);
    assert(w.first[c->n] <= entries);
    w.column = qw_resize(env, w.column, w.first[c->n], sizeof *w.column);
    w.value = qw_resize(env, w.value, w.first[c->n], sizeof *w.value);
    c->first = w.first, c->column = w.column, c->value = w.value, c->exact = w.exact;
}

/* The inverse by elimination of the rows in order, without those that have no diagonal left. */
static void invert(qw_env *env, qw_grid *l)
{
    assert(l->diagonal && l->value);
    uint32_t n = l->n;
    l->dense = QW_NEW(env, float, n *n);
    qw_scope_begin(env);
    double *a = QW_NEW_ZERO(env, double, n *n);
    for (uint32_t i = 0; i < n; i++) {
        a[i * n + i] = l->exact[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) a[i * n + l->column[k]] += (double)l->value[k];
    }
    for (uint32_t k = 0; k < n; k++) { /* sweeps: a becomes minus its inverse on the rows taken */
        double pivot = a[k * n + k];
        if (!(pivot > ROUNDING * l->exact[k])) continue;
        for (uint32_t i = 0; i < n; i++) {
            if (i == k) continue;
            double factor = a[i * n + k] / pivot;
            for (uint32_t j = 0; j < n; j++)
                if (j != k) a[i * n + j] -= factor * a[k * n + j];
        }
        for (uint32_t i = 0; i < n; i++)
            if (i != k) a[i * n + k] /= pivot, a[k * n + i] /= pivot;
        a[k * n + k] = -1 / pivot;
    }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            l->dense[i * n + j] = a[i * n + i] < 0 && a[j * n + j] < 0 ? (float)-a[i * n + j] : 0;
    qw_scope_end(env);
}

static void diagonal_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    for (uint32_t i = begin; i < end; i++) {
        double outside = 0;
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++)
            if (l->column[k] - begin >= end - begin) outside += fabsf(l->value[k]);
        l->diagonal[i] = (float)l->exact[i];
        l->inverse[i] = l->exact[i] > 0 ? (float)(1 / (l->exact[i] + 0.5 * outside)) : 0;
    }
}

static void make_vectors(qw_env *env, qw_grid *l)
{
    l->grain = l->n < 2 * LEAST_HALF || l->n > 2 * GRAIN ? GRAIN : (l->n + 1) / 2;
    float **vectors[] = {&l->diagonal, &l->inverse, &l->r, &l->y, &l->z[0], &l->z[1], &l->v};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) *vectors[i] = QW_NEW(env, float, l->n);
    for (int i = 0; i < QW_GRID_SUMS; i++) l->sum[i] = QW_NEW(env, double, qw_block_count(l->n, l->grain));
    qw_parallel(env, l->n, l->grain, diagonal_task, l);
}

static bool has_three(const qw_csr *a)
{
    bool three = true;
    for (uint32_t i = 0; i <= a->row_count && three; i++) three = a->first[i] == 3 * i;
    return three;
}

qw_multigrid *qw_multigrid_build(qw_env *env, const qw_csr *matrix)
{
    assert(matrix->row_count < QW_NONE / 2);
    qw_multigrid *grids = QW_NEW_ZERO(env, qw_multigrid, 1);
    grids->matrix = matrix;
    qw_grid *l = grids->grid;
    *l = (qw_grid){.n = matrix->row_count,
                   .three = has_three(matrix),
                   .first = matrix->first,
                   .column = matrix->column,
                   .value = matrix->value};
    l->exact = matrix->diagonal;
    for (;;) {
        make_vectors(env, l);
        grids->grid_count++;
        if (grids->grid_count > 1 && l->n <= DENSE) {
            invert(env, l);
            break;
        }
        if (grids->grid_count == QW_MAX_GRIDS) break;
        uint32_t n = qw_make_aggregates(env, l);
        if (n == 0 || n > SHRINK * l->n) break;
        l[1] = (qw_grid){.n = n};
        make_coarse(env, l, l + 1);
        l->next = l + 1;
        l++;
    }
    grids->p = QW_NEW(env, float, matrix->row_count);
    grids->q = QW_NEW(env, float, matrix->row_count);
    return grids;
}

void qw_multigrid_refresh(qw_env *env, qw_multigrid *grids)
{
    assert(grids);
    for (qw_grid *l = grids->grid; l; l = l->next) {
        qw_parallel(env, l->n, l->grain, diagonal_task, l);
        if (l->dense) {
            qw_free(env, l->dense);
            invert(env, l);
        }
        qw_grid *c = l->next;
        if (!c) return;
        qw_free(env, (void *)c->first), qw_free(env, (void *)c->column), qw_free(env, (void *)c->value),
            qw_free(env, (void *)c->exact);
        make_coarse(env, l, c);
    }
}

/* Conjugate gradients, preconditioned by aggregation multigrid with K-cycles (Notay, "An aggregation-based algebraic
 * multigrid method", 2010; Notay and Vassilevski, "Recursive Krylov-based multigrid cycles", 2008), for graphs with
 * signs.
 *
 * Each system is solved by two steps of conjugate gradients, preconditioned by: Gauss-Seidel forward, the correction
 * from the next coarser system, x_i = +-X_a, Gauss-Seidel backward. The smallest is solved by its inverse.
 *
 * Gauss-Seidel runs inside fixed blocks of rows; couplings between blocks see the values from before the sweep. Half of
 * their size is added to the diagonal, without which unknowns all of whose neighbours are in other blocks would swing
 * back and forth (the l1 smoother: Baker, Falgout, Kolev, Yang, "Multigrid smoothers for ultraparallel computing",
 * 2011).
 */
#include "solve/multigrid.h"

#include "solve/grid.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { RESTRICTED = 512 }; /* coarse rows a block of restriction */

/* A coarse system needs no second step when the first brought the residual to this (Notay's threshold is 0.25; with 0.5
   some solutions take an iteration more, all of them less work), and no step brings the outer residual down further
   than floats can between two computations anew. */
static const double ENOUGH = 0.5, ROUND = 1e-5;

static double total(const qw_grid *l, int which)
{
    double sum = 0;
    for (uint32_t i = 0; i < qw_block_count(l->n, l->grain); i++) sum += l->sum[which][i];
    return sum;
}

/* ---- cycle */

/* Loops over rows are written once, with `three` known when they are compiled. */
#define ALWAYS_INLINE static inline __attribute__((always_inline))
ALWAYS_INLINE uint32_t row_begin(const qw_grid *l, uint32_t i, bool three) { return three ? 3 * i : l->first[i]; }
ALWAYS_INLINE uint32_t row_count(const qw_grid *l, uint32_t i, bool three)
{
    return three ? 3 : l->first[i + 1] - l->first[i];
}

/* Couplings of row i, without the diagonal. */
ALWAYS_INLINE float couplings(const qw_grid *l, const float *v, uint32_t i, bool three)
{
    const uint32_t begin = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + begin;
    const float *value = l->value + begin;
    float sum = 0;
    for (uint32_t k = 0; k < count; k++) sum += value[k] * v[column[k]];
    return sum;
}

/* The forward sweep from 0: y = r / (lower triangle). Other entries read y[i], still 0, in place of a branch. */
ALWAYS_INLINE void sweep_rows(qw_grid *l, uint32_t begin, uint32_t end, bool three)
{
    float *y = l->y;
    for (uint32_t i = begin; i < end; i++) {
        const uint32_t first = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + first;
        const float *value = l->value + first;
        float sum = l->r[i];
        y[i] = 0;
        for (uint32_t k = 0; k < count; k++) {
            uint32_t j = column[k];
            sum -= value[k] * y[j - begin < i - begin ? j : i];
        }
        y[i] = sum * l->inverse[i];
    }
}

static void sweep_forward(qw_grid *l, uint32_t begin, uint32_t end)
{
    if (l->three) sweep_rows(l, begin, end, true);
    else sweep_rows(l, begin, end, false);
}

ALWAYS_INLINE void restrict_rows(qw_grid *l, uint32_t begin, uint32_t end, bool three)
{
    for (uint32_t a = begin; a < end; a++) {
        float sum = 0;
        for (uint32_t m = l->member_first[a]; m < l->member_first[a + 1]; m++) {
            uint32_t i = l->member[m] >> 1;
            sum += qw_with_sign(l->r[i] - l->diagonal[i] * l->y[i] - couplings(l, l->y, i, three), l->member[m]);
        }
        l->next->r[a] = sum;
    }
}

static void restrict_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    if (l->three) restrict_rows(l, begin, end, true);
    else restrict_rows(l, begin, end, false);
}

static void sweep_task(void *user, uint32_t begin, uint32_t end) { sweep_forward(user, begin, end); }

/* Adds the correction of the coarser grid to y of this one. */
static void prolong_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    const qw_grid *c = l->next;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t packed = l->group[i], a = packed >> 1;
        if (packed == QW_NONE) continue;
        float value = c->factor[0] * c->z[0][a];
        if (c->factor[1] != 0) value += c->factor[1] * c->z[1][a];
        l->y[i] += qw_with_sign(value, packed);
    }
}

ALWAYS_INLINE void backward_rows(const qw_grid *l, float *z, uint32_t begin, uint32_t end, bool three)
{
    const float *y = l->y;
    for (uint32_t i = end; i-- > begin;) {
        const uint32_t first = row_begin(l, i, three), count = row_count(l, i, three), *column = l->column + first;
        const float *value = l->value + first;
        float sum = l->r[i] - l->diagonal[i] * y[i];
        for (uint32_t k = 0; k < count; k++) {
            uint32_t j = column[k];
            const float *from = j - begin < end - begin ? z : y;
            sum -= value[k] * from[j];
        }
        z[i] = y[i] + sum * l->inverse[i];
    }
}

/* The backward sweep, from y to z. */
static void backward_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    float *z = l->z[l->way];
    memcpy(z + begin, l->y + begin, (end - begin) * sizeof *z);
    if (l->three) backward_rows(l, z, begin, end, true);
    else backward_rows(l, z, begin, end, false);
}

/* v = A z[0], with z . v, z . r and r . r; in the second step only the sums with z[1]: z . A z, z . r and z . v. */
static void multiply_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    const float *z = l->z[l->way];
    double sum[QW_GRID_SUMS] = {0};
    for (uint32_t i = begin; i < end; i++) {
        float product = l->diagonal[i] * z[i] + couplings(l, z, i, false);
        sum[0] += (double)z[i] * product;
        sum[1] += (double)z[i] * l->r[i];
        sum[2] += l->way ? (double)z[i] * l->v[i] : (double)l->r[i] * l->r[i];
        if (!l->way) l->v[i] = product;
    }
    for (int k = 0; k < QW_GRID_SUMS; k++) l->sum[k][begin / l->grain] = sum[k];
}

/* A step of r along v, and the forward sweep of the second cycle. */
static void reduce_task(void *user, uint32_t begin, uint32_t end)
{
    qw_grid *l = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        l->r[i] -= l->step * l->v[i];
        sum += (double)l->r[i] * l->r[i];
    }
    l->sum[0][begin / l->grain] = sum;
    sweep_forward(l, begin, end);
}

static void solve_grid(qw_env *env, qw_grid *l);

/* From r and the forward sweep in y to z[way]. */
static void cycle(qw_env *env, qw_grid *l, uint32_t way)
{
    if (l->next) {
        qw_parallel(env, l->next->n, RESTRICTED, restrict_task, l);
        if (!l->next->dense) qw_parallel(env, l->next->n, l->next->grain, sweep_task, l->next);
        solve_grid(env, l->next);
        qw_parallel(env, l->n, l->grain, prolong_task, l);
    }
    l->way = way;
    qw_parallel(env, l->n, l->grain, backward_task, l);
}

static void multiply_dense(qw_grid *l)
{
    memset(l->z[0], 0, l->n * sizeof(float));
    for (uint32_t j = 0; j < l->n; j++) {
        const float *column = l->dense + j * l->n;
        float *restrict z = l->z[0], factor = l->r[j];
        for (uint32_t i = 0; i < l->n; i++) z[i] += factor * column[i];
    }
    l->factor[0] = 1;
    l->factor[1] = 0;
}

/* Two steps of flexible conjugate gradients from 0. Solves for r, which it overwrites. Recurs once a system. */
static void solve_grid(qw_env *env, qw_grid *l)
{
    assert(l->r && l->y);
    if (l->dense) {
        multiply_dense(l);
        return;
    }
    l->factor[0] = l->factor[1] = 0;
    cycle(env, l, 0);
    qw_parallel(env, l->n, l->grain, multiply_task, l);
    double zv = total(l, 0), zr = total(l, 1), before = total(l, 2);
    if (!(zv > 0)) return;
    l->factor[0] = l->step = (float)(zr / zv);
    qw_parallel(env, l->n, l->grain, reduce_task, l);
    if (total(l, 0) <= ENOUGH * ENOUGH * before) return;
    cycle(env, l, 1);
    qw_parallel(env, l->n, l->grain, multiply_task, l);
    double cross = total(l, 2), own = total(l, 0) - cross * cross / zv;
    if (!(own > 0)) return;
    l->factor[1] = (float)(total(l, 1) / own);
    l->factor[0] -= (float)(cross / zv * (total(l, 1) / own));
}

/* ---- outer */

typedef struct solver {
    qw_env *env;
    qw_multigrid *grids;
    qw_grid *top;
    const float *b;
    float *given; /* float[n], the caller's x */
    double *x;
    double *before; /* double[n], x when the round began */
    float alpha, beta;
} solver;

static void run(solver *s, qw_task task) { qw_parallel(s->env, s->top->n, s->top->grain, task, s); }

static void widen_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    for (uint32_t i = begin; i < end; i++) s->x[i] = s->given[i];
}

static void narrow_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    for (uint32_t i = begin; i < end; i++) s->given[i] = (float)s->x[i];
}

static void remember_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    memcpy(s->before + begin, s->x + begin, (end - begin) * sizeof(double));
}

static void norm_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) sum += (double)s->b[i] * s->b[i];
    s->top->sum[0][begin / s->top->grain] = sum;
}

/* r = b - A x, and its forward sweep. */
static void residual_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    qw_grid *l = s->top;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        double r = (double)s->b[i] - l->exact[i] * s->x[i];
        for (uint32_t k = l->first[i]; k < l->first[i + 1]; k++) r -= (double)l->value[k] * s->x[l->column[k]];
        l->r[i] = (float)r;
        sum += r * r;
    }
    l->sum[0][begin / l->grain] = sum;
    sweep_forward(l, begin, end);
}

/* v = A z, with z . v, z . r and z . q. */
static void product_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    qw_grid *l = s->top;
    const float *z = l->z[0], *q = s->grids->q;
    double sum[QW_GRID_SUMS] = {0};
    for (uint32_t i = begin; i < end; i++) {
        l->v[i] = l->diagonal[i] * z[i] + (l->three ? couplings(l, z, i, true) : couplings(l, z, i, false));
        sum[0] += (double)z[i] * l->v[i];
        sum[1] += (double)z[i] * l->r[i];
        sum[2] += (double)z[i] * q[i];
    }
    for (int k = 0; k < QW_GRID_SUMS; k++) l->sum[k][begin / l->grain] = sum[k];
}

/* The direction, a step along it, and the next forward sweep. */
static void step_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    qw_grid *l = s->top;
    float *restrict p = s->grids->p, *restrict q = s->grids->q, *restrict r = l->r;
    double *restrict x = s->x;
    const float *restrict z = l->z[0], *restrict v = l->v;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) {
        p[i] = z[i] + s->beta * p[i];
        q[i] = v[i] + s->beta * q[i];
        x[i] += (double)(s->alpha * p[i]);
        r[i] -= s->alpha * q[i];
        sum += (double)r[i] * r[i];
    }
    l->sum[0][begin / l->grain] = sum;
    sweep_forward(l, begin, end);
}

/* Flexible conjugate gradients from where x and r are, by the recurrence for r. */
static void descend(solver *s, double norm, double tolerance, uint32_t max_iterations, qw_cg_result *result)
{
    assert(tolerance >= 0);
    uint32_t n = s->top->n;
    double residual = INFINITY, pq = INFINITY;
    memset(s->grids->p, 0, n * sizeof(float));
    memset(s->grids->q, 0, n * sizeof(float));
    while (result->iterations < max_iterations && residual > tolerance) {
        cycle(s->env, s->top, 0);
        run(s, product_task);
        double zq = total(s->top, 2), own = total(s->top, 0) - zq * zq / pq, zr = total(s->top, 1);
        if (!(own > 0) || !(zr > 0)) break; /* rounding has used up the descent, or A is not semidefinite */
        s->beta = (float)(-zq / pq);
        s->alpha = (float)(zr / own);
        run(s, step_task);
        residual = sqrt(total(s->top, 0)) / norm;
        pq = own;
        result->fall = zr * zr / own;
        result->iterations++;
    }
}

/* The recurrence, in float, drifts from the true residual. So each round brings it down by no more than floats can, the
   true one is computed anew, and a round that made it worse is undone. */
static qw_cg_result solve(solver *s, double tolerance, uint32_t max_iterations)
{
    qw_cg_result result = {.residual = INFINITY};
    size_t bytes = s->top->n * sizeof(double);
    run(s, norm_task);
    double norm = sqrt(total(s->top, 0));
    if (norm == 0) {
        memset(s->x, 0, bytes);
        return (qw_cg_result){.converged = true};
    }
    run(s, remember_task);
    for (;;) {
        run(s, residual_task);
        double residual = sqrt(total(s->top, 0)) / norm, gain = result.residual / residual;
        if (!(residual < result.residual)) {
            memcpy(s->x, s->before, bytes);
            return result;
        }
        result.residual = residual;
        result.converged = residual <= tolerance;
        if (result.converged || result.iterations >= max_iterations || !(gain >= 2)) return result;
        run(s, remember_task);
        descend(s, norm, fmax(tolerance, ROUND * residual), max_iterations, &result);
    }
}

qw_cg_result qw_multigrid_solve_with(qw_env *env, qw_multigrid *grids, const float *b, float *x, double tolerance,
                                     uint32_t max_iterations)
{
    assert(grids && b && x && tolerance >= 0);
    qw_scope_begin(env);
    uint32_t n = grids->grid->n;
    solver s = {.env = env,
                .grids = grids,
                .top = grids->grid,
                .b = b,
                .given = x,
                .x = QW_NEW(env, double, n),
                .before = QW_NEW(env, double, n)};
    run(&s, widen_task);
    qw_cg_result result = solve(&s, tolerance, max_iterations);
    run(&s, narrow_task);
    qw_scope_end(env);
    return result;
}

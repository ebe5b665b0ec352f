#include "solve/cg.h"
#include "base/simd.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Unknowns a block. Part of the result's definition: sums are kept a block. */

/* What a round may gain at most. */
static const double ROUND = 1e-10;
/* From here on up the residual by the recurrence is as good as the true one. */
static const double TRUSTED = 1e-6;

typedef struct solver {
    qw_env *env;
    uint32_t n;
    qw_apply apply;
    void *user;
    const double *b;
    double *x, *r, *p, *q;
    double *before; /* double[n], x when the round began */
    double *scale;  /* double[n], 1 / diagonal, or 0 */
    double alpha, beta;
    double *sum[2]; /* double[blocks] each */
} solver;

static double total(const solver *s, int which)
{
    double sum = 0;
    for (uint32_t i = 0; i < qw_block_count(s->n, QW_GRAIN_LIGHT); i++) sum += s->sum[which][i];
    return sum;
}

static void run(solver *s, qw_task task) { qw_parallel(s->env, s->n, QW_GRAIN_LIGHT, task, s); }

/* p . q. */
static void multiply_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) sum += s->p[i] * s->q[i];
    s->sum[0][begin / QW_GRAIN_LIGHT] = sum;
}

/* A step along p. Leaves r . r and r . scale r, each added up in QW_LANES strands so that the additions do not wait for
 * one another. */
static void step_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double *restrict x = s->x, *restrict r = s->r;
    const double *restrict p = s->p, *restrict q = s->q, *restrict scale = s->scale;
    double alpha = s->alpha, rr[QW_LANES] = {0}, rz[QW_LANES] = {0};
    for (uint32_t i = begin; i < end; i += QW_LANES) {
        uint32_t lanes = end - i < QW_LANES ? end - i : QW_LANES;
        for (uint32_t l = 0; l < lanes; l++) {
            uint32_t k = i + l;
            x[k] += alpha * p[k];
            double residual = r[k] - alpha * q[k];
            r[k] = residual;
            rr[l] += residual * residual;
            rz[l] += residual * residual * scale[k];
        }
    }
    s->sum[0][begin / QW_GRAIN_LIGHT] = (rr[0] + rr[1]) + (rr[2] + rr[3]);
    s->sum[1][begin / QW_GRAIN_LIGHT] = (rz[0] + rz[1]) + (rz[2] + rz[3]);
}

static void direction_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    for (uint32_t i = begin; i < end; i++) s->p[i] = s->scale[i] * s->r[i] + s->beta * s->p[i];
}

/* r = b - A x, the product already in q. Leaves the same sums as a step. */
static void residual_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double rr = 0, rz = 0;
    for (uint32_t i = begin; i < end; i++) {
        double r = s->b[i] - s->q[i];
        s->r[i] = r;
        rr += r * r;
        rz += r * r * s->scale[i];
    }
    s->sum[0][begin / QW_GRAIN_LIGHT] = rr;
    s->sum[1][begin / QW_GRAIN_LIGHT] = rz;
}

static void norm_task(void *user, uint32_t begin, uint32_t end)
{
    solver *s = user;
    double sum = 0;
    for (uint32_t i = begin; i < end; i++) sum += s->b[i] * s->b[i];
    s->sum[0][begin / QW_GRAIN_LIGHT] = sum;
}

/* Sums up |r| / |b|, and r . scale r into *rz. */
static double take_residual(solver *s, double norm, double *rz)
{
    *rz = total(s, 1);
    return sqrt(total(s, 0)) / norm;
}

static double true_residual(solver *s, double norm, double *rz)
{
    s->apply(s->user, s->env, s->x, s->q);
    run(s, residual_task);
    return take_residual(s, norm, rz);
}

/* Conjugate gradients from where x and r are, by the recurrence for r, whose size it returns. */
static double descend(solver *s, double norm, double rz, double tolerance, uint32_t max_iterations,
                      uint32_t *iterations)
{
    double residual = INFINITY;
    s->beta = 0;
    while (*iterations < max_iterations && residual > tolerance) {
        run(s, direction_task);
        s->apply(s->user, s->env, s->p, s->q);
        run(s, multiply_task);
        double pq = total(s, 0), before = rz;
        if (!(pq > 0)) break; /* rounding has used up the descent, or A is not semidefinite */
        s->alpha = rz / pq;
        run(s, step_task);
        residual = take_residual(s, norm, &rz);
        s->beta = rz / before;
        ++*iterations;
    }
    return residual;
}

/* The recurrence drifts from the true residual, and in a singular system feeds on rounding in the null space. So each
   round brings the residual down by no more than doubles can, the true one is computed anew but where TRUSTED says that
   it is the same, and a round that made it worse is undone. */
static qw_cg_result solve(solver *s, double tolerance, uint32_t max_iterations)
{
    qw_cg_result result = {.residual = INFINITY};
    run(s, norm_task);
    double norm = sqrt(total(s, 0)), rz;
    if (norm == 0) {
        memset(s->x, 0, s->n * sizeof *s->x);
        return (qw_cg_result){.converged = true};
    }
    memcpy(s->before, s->x, s->n * sizeof *s->x);
    for (;;) {
        double residual = true_residual(s, norm, &rz), gain = result.residual / residual;
        if (!(residual < result.residual)) {
            memcpy(s->x, s->before, s->n * sizeof *s->x);
            return result;
        }
        result.residual = residual;
        result.converged = residual <= tolerance;
        if (result.converged || result.iterations >= max_iterations || !(gain >= 2)) return result;
        memcpy(s->before, s->x, s->n * sizeof *s->x);
        double reached = descend(s, norm, rz, fmax(tolerance, ROUND * residual), max_iterations, &result.iterations);
        if (reached <= tolerance && tolerance >= TRUSTED)
            return (qw_cg_result){.iterations = result.iterations, .residual = reached, .converged = true};
    }
}

static void prepare(solver *s, const double *diagonal)
{
    s->r = QW_NEW(s->env, double, s->n);
    s->p = QW_NEW_ZERO(s->env, double, s->n);
    s->q = QW_NEW(s->env, double, s->n);
    s->before = QW_NEW(s->env, double, s->n);
    s->scale = QW_NEW(s->env, double, s->n);
    for (int i = 0; i < 2; i++) s->sum[i] = QW_NEW_ZERO(s->env, double, qw_block_count(s->n, QW_GRAIN_LIGHT));
    for (uint32_t i = 0; i < s->n; i++) s->scale[i] = diagonal[i] > 0 ? 1 / diagonal[i] : 0;
}

qw_cg_result qw_cg_solve(qw_env *env, uint32_t n, qw_apply apply, void *user, const double *diagonal, const double *b,
                         double *x, double tolerance, uint32_t max_iterations)
{
    assert(apply && diagonal && b && x && tolerance >= 0);
    qw_scope_begin(env);
    solver s = {.env = env, .n = n, .apply = apply, .user = user, .b = b, .x = x};
    prepare(&s, diagonal);
    qw_cg_result result = solve(&s, tolerance, max_iterations);
    qw_scope_end(env);
    return result;
}

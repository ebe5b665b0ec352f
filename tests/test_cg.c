/* Conjugate gradients against elimination, on singular Laplacians, and the same to the bit on any number of threads. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "solve/cg.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 150, MAX_ROWS = SIDE * SIDE, MAX_ENTRIES = 4 * MAX_ROWS, DENSE = 24 };

typedef struct linear_system {
    qw_env *env;
    uint64_t random;
    uint32_t n, first[MAX_ROWS + 1], column[MAX_ENTRIES];
    float value[MAX_ENTRIES];
    double diagonal[MAX_ROWS], b[MAX_ROWS], x[MAX_ROWS], exact[MAX_ROWS];
    double dense[DENSE][DENSE + 1];
    uint32_t iterations;
} linear_system;

static double unit(linear_system *s)
{
    random_step(&s->random);
    return (double)(s->random >> 40) / (1 << 24);
}

static void run(void (*body)(void *user))
{
    linear_system *s = calloc(1, sizeof *s);
    s->env = qw_env_create(NULL, 2);
    s->random = 5;
    assert_int_equal(qw_protect(s->env, body, s), QW_OK);
    assert_int_equal(qw_env_bytes(s->env), 0);
    qw_env_destroy(s->env);
    free(s);
}

static void multiply(const linear_system *s, const double *x, double *y)
{
    for (uint32_t i = 0; i < s->n; i++) {
        y[i] = s->diagonal[i] * x[i];
        for (uint32_t k = s->first[i]; k < s->first[i + 1]; k++) y[i] += (double)s->value[k] * x[s->column[k]];
    }
}

static double residual(const linear_system *s, const double *x)
{
    double rr = 0, bb = 0;
    double *y = malloc(s->n * sizeof *y);
    multiply(s, x, y);
    for (uint32_t i = 0; i < s->n; i++) rr += (s->b[i] - y[i]) * (s->b[i] - y[i]), bb += s->b[i] * s->b[i];
    free(y);
    return sqrt(rr / bb);
}

/* A random sparse symmetric matrix whose diagonal outweighs the rest, also written out in full. */
static void random_system(linear_system *s)
{
    s->n = 1 + (uint32_t)(unit(s) * (DENSE - 1));
    memset(s->dense, 0, sizeof s->dense);
    for (uint32_t i = 0; i < s->n; i++)
        for (uint32_t j = 0; j < i; j++) s->dense[i][j] = s->dense[j][i] = unit(s) < 0.3 ? (float)(unit(s) - 0.5) : 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < s->n; i++) {
        double sum = 0.01 + unit(s);
        s->first[i] = count;
        for (uint32_t j = 0; j < s->n; j++) {
            if (s->dense[i][j] == 0) continue;
            s->column[count] = j;
            s->value[count++] = (float)s->dense[i][j];
            sum += fabs(s->dense[i][j]);
        }
        s->diagonal[i] = s->dense[i][i] = sum;
        s->b[i] = s->dense[i][s->n] = unit(s) - 0.5;
        s->x[i] = 0;
    }
    s->first[s->n] = count;
}

static void eliminate(linear_system *s)
{
    for (uint32_t k = 0; k < s->n; k++)
        for (uint32_t i = 0; i < s->n; i++) {
            if (i == k) continue;
            double factor = s->dense[i][k] / s->dense[k][k];
            for (uint32_t j = k; j <= s->n; j++) s->dense[i][j] -= factor * s->dense[k][j];
        }
    for (uint32_t i = 0; i < s->n; i++) s->exact[i] = s->dense[i][s->n] / s->dense[i][i];
}

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    multiply(user, x, y);
}

static qw_cg_result descend(linear_system *s, double tolerance, uint32_t iterations)
{
    return qw_cg_solve(s->env, s->n, apply, s, s->diagonal, s->b, s->x, tolerance, iterations);
}

static void dense_body(void *user)
{
    linear_system *s = user;
    for (int round = 0; round < 200; round++) {
        random_system(s);
        eliminate(s);
        qw_cg_result r = descend(s, 1e-12, 1000);
        assert_true(r.converged && r.residual <= 1e-12 && r.iterations <= 4 * s->n + 4);
        for (uint32_t i = 0; i < s->n; i++) assert_true(fabs(s->x[i] - s->exact[i]) < 1e-9);
    }
}

static void join(linear_system *s, uint32_t *at, uint32_t i, uint32_t j, float weight)
{
    s->column[at[i]] = j;
    s->value[at[i]++] = -weight;
    s->diagonal[i] += weight;
}

/* Laplacian of a square grid with random weights: singular, the constants are its null space. */
static void grid_system(linear_system *s, uint32_t side)
{
    s->n = side * side;
    uint32_t *at = malloc(s->n * sizeof *at);
    for (uint32_t i = 0; i < s->n; i++) {
        uint32_t x = i % side, y = i / side;
        at[i] = s->first[i];
        s->first[i + 1] = s->first[i] + (x > 0) + (x + 1 < side) + (y > 0) + (y + 1 < side);
        s->diagonal[i] = s->x[i] = 0;
        s->exact[i] = unit(s) - 0.5;
    }
    for (uint32_t i = 0; i < s->n; i++)
        for (int way = 0; way < 2; way++) {
            uint32_t j = way ? i + side : i + 1;
            if (way ? j >= s->n : j % side == 0) continue;
            float weight = (float)(0.1 + unit(s));
            join(s, at, i, j, weight);
            join(s, at, j, i, weight);
        }
    free(at);
    multiply(s, s->exact, s->b);
}

static void laplacian_body(void *user)
{
    linear_system *s = user;
    grid_system(s, SIDE);
    for (uint32_t i = 0; i < s->n; i++) s->x[i] = 17; /* the constant part of the guess stays */
    qw_cg_result r = descend(s, 1e-10, 5000);
    assert_true(r.converged && r.iterations > 10);
    assert_true(fabs(residual(s, s->x) - r.residual) < 1e-13);
    double shift = s->x[0] - s->exact[0];
    for (uint32_t i = 0; i < s->n; i++) assert_true(fabs(s->x[i] - s->exact[i] - shift) < 1e-6);
    assert_true(fabs(shift - 17) < 1);
}

static void thread_body(void *user)
{
    linear_system *s = user;
    static const uint32_t threads[] = {1, 2, 3, 8};
    grid_system(s, SIDE);
    for (uint32_t i = 0; i < s->n; i++) s->diagonal[i] += 0.01;
    for (int t = 0; t < 4; t++) {
        qw_env_set_threads(s->env, threads[t]);
        memset(s->x, 0, sizeof s->x);
        qw_cg_result r = descend(s, 1e-8, 1000);
        assert_true(r.converged);
        if (t == 0) {
            memcpy(s->exact, s->x, sizeof s->x);
            s->iterations = r.iterations;
        }
        assert_int_equal(r.iterations, s->iterations);
        assert_memory_equal(s->x, s->exact, s->n * sizeof *s->x);
    }
}

static void limit_body(void *user)
{
    linear_system *s = user;
    grid_system(s, 60);
    qw_cg_result r = descend(s, 1e-10, 7);
    assert_true(!r.converged && r.iterations == 7 && r.residual < 1);
    assert_true(fabs(residual(s, s->x) - r.residual) < 1e-13);
    r = descend(s, 1e-10, 0);
    assert_int_equal(r.iterations, 0);
    r = descend(s, 0, 100000); /* more than rounding allows: ends all the same */
    assert_true(!r.converged && r.iterations < 20000 && r.residual < 1e-11);
    uint32_t again = descend(s, 1e-10, 1000).iterations;
    assert_int_equal(again, 0); /* from a good guess there is nothing to do */
}

/* No right-hand side, an unknown that no equation holds, a right-hand side that no x meets, and no number at all. */
static void odd_body(void *user)
{
    linear_system *s = user;
    s->n = 0;
    assert_true(descend(s, 1e-10, 10).converged);
    s->n = 3;
    memcpy(s->first, (uint32_t[]){0, 1, 2, 2}, 4 * sizeof(uint32_t));
    memcpy(s->column, (uint32_t[]){1, 0}, 2 * sizeof(uint32_t));
    memcpy(s->value, (float[]){-1, -1}, 2 * sizeof(float));
    memcpy(s->diagonal, (double[]){2, 2, 0}, 3 * sizeof(double));
    memcpy(s->x, (double[]){5, 5, 5}, 3 * sizeof(double));
    memcpy(s->b, (double[]){3, 0, 0}, 3 * sizeof(double));
    assert_true(descend(s, 1e-14, 10).converged);
    assert_true(fabs(s->x[0] - 2) < 1e-12 && fabs(s->x[1] - 1) < 1e-12 && s->x[2] == 5);
    s->b[2] = 1;
    qw_cg_result r = descend(s, 1e-14, 10);
    assert_true(!r.converged && fabs(r.residual - 1 / sqrt(10)) < 1e-12);
    memset(s->b, 0, sizeof s->b);
    r = descend(s, 1e-14, 10);
    assert_true(r.converged && s->x[0] == 0 && s->x[2] == 0);
    s->b[0] = NAN;
    r = descend(s, 1e-14, 1000);
    assert_true(!r.converged && r.iterations < 10);
    s->b[0] = 1;
    s->diagonal[0] = -5; /* not semidefinite */
    r = descend(s, 1e-14, 1000);
    assert_true(!r.converged && r.iterations < 100);
}

static void solve_body(void *user)
{
    linear_system *s = user;
    descend(s, 1e-10, 10);
}

static void test_scarce_memory(void **state)
{
    (void)state;
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    int allowed = 0;
    qw_host host = faults_host(&f);
    linear_system *s = calloc(1, sizeof *s);
    s->env = qw_env_create(&host, 1);
    random_system(s);
    for (qw_status status = QW_MEMORY; status != QW_OK; allowed++) {
        f.allocations = allowed;
        status = qw_protect(s->env, solve_body, s);
        assert_true(status == QW_OK || status == QW_MEMORY);
        assert_int_equal(qw_env_bytes(s->env), 0);
    }
    assert_true(allowed > 4);
    qw_env_destroy(s->env);
    free(s);
}

#define TEST(name)                        \
    static void test_##name(void **state) \
    {                                     \
        (void)state;                      \
        run(name##_body);                 \
    }
TEST(dense)
TEST(laplacian)
TEST(thread)
TEST(limit)
TEST(odd)

QW_TEST_SUITE(cg)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_dense), cmocka_unit_test(test_laplacian), cmocka_unit_test(test_thread),
        cmocka_unit_test(test_limit), cmocka_unit_test(test_odd),       cmocka_unit_test(test_scarce_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

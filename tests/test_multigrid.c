/* Multigrid against plain conjugate gradients on signed Laplacians, its residual against the matrix, and the same to
   the bit on any number of threads. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "solve/multigrid.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIDE = 120, MAX_ROWS = 4 * SIDE * SIDE, MAX_LINKS = 3 * MAX_ROWS };

typedef struct shape {
    uint32_t side;
    bool dual;     /* the triangles of the grid, not its vertices */
    bool cone;     /* signs that nothing balances */
    double spread; /* of the weights */
    int ground;    /* 0 nowhere, 1 a row, 2 a line */
    bool shuffled;
} shape;

typedef struct linear_system {
    qw_env *env;
    uint64_t random;
    uint32_t n, link_count, end[2][MAX_LINKS], first[MAX_ROWS + 2], column[2 * MAX_LINKS], order[MAX_ROWS];
    float weight[MAX_LINKS], value[2 * MAX_LINKS], b[MAX_ROWS], x[MAX_ROWS], kept[MAX_ROWS];
    double diagonal[MAX_ROWS], wide[MAX_ROWS], exact[MAX_ROWS];
    uint8_t turn[MAX_ROWS];
    shape shape;
} linear_system;

static double unit(linear_system *s)
{
    random_step(&s->random);
    return (double)(s->random >> 40) / (1 << 24);
}

static qw_csr matrix_of(const linear_system *s) { return (qw_csr){s->n, s->first, s->column, s->value, s->diagonal}; }

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

/* Whether |b - A x| / |b| is what the result says, up to what rounding x to float may change: 2^-24 |A||x|. */
static bool is_residual(const linear_system *s, double residual)
{
    double rr = 0, bb = 0, ee = 0;
    for (uint32_t i = 0; i < s->n; i++) {
        double r = s->b[i] - s->diagonal[i] * s->x[i], e = fabs(s->diagonal[i] * s->x[i]);
        for (uint32_t k = s->first[i]; k < s->first[i + 1]; k++) {
            double product = (double)s->value[k] * s->x[s->column[k]];
            r -= product;
            e += fabs(product);
        }
        rr += r * r, bb += (double)s->b[i] * s->b[i], ee += e * e;
    }
    return fabs(sqrt(rr / bb) - residual) <= 1e-12 + ldexp(sqrt(ee / bb), -24);
}

/* Two unknowns a place; those of the one place are those of the other after a quarter turn or more, one more across the
 * cut. */
static void join(linear_system *s, uint32_t v, uint32_t w, bool cut)
{
    float weight = (float)pow(s->shape.spread, unit(s));
    uint32_t turn = (uint32_t)(s->turn[w] - s->turn[v] + (cut && s->shape.cone)) & 3;
    for (uint32_t k = 0; k < 2; k++) {
        uint32_t to = k + turn;
        s->end[0][s->link_count] = 2 * s->order[v] + k;
        s->end[1][s->link_count] = 2 * s->order[w] + (to & 1);
        s->weight[s->link_count++] = to & 2 ? weight : -weight;
    }
}

static void assemble(linear_system *s)
{
    memset(s->first, 0, sizeof s->first);
    memset(s->diagonal, 0, sizeof s->diagonal);
    for (int way = 0; way < 2; way++)
        for (uint32_t k = 0; k < s->link_count; k++) s->first[s->end[way][k] + 2]++;
    for (uint32_t i = 0; i < s->n; i++) s->first[i + 2] += s->first[i + 1];
    for (uint32_t k = 0; k < s->link_count; k++)
        for (int way = 0; way < 2; way++) {
            uint32_t i = s->end[way][k], at = s->first[i + 1]++;
            s->column[at] = s->end[!way][k];
            s->value[at] = s->weight[k];
            s->diagonal[i] += fabsf(s->weight[k]);
        }
}

/* b is a divergence, which has no part in any null space. */
static void make_system(linear_system *s, shape wanted)
{
    uint32_t side = wanted.side, places = side * side * (wanted.dual ? 2 : 1);
    s->shape = wanted;
    s->n = 2 * places;
    s->link_count = 0;
    for (uint32_t i = 0; i < places; i++) s->turn[i] = (uint8_t)(4 * unit(s)), s->order[i] = i;
    for (uint32_t i = places; wanted.shuffled && i > 1; i--) {
        uint32_t j = (uint32_t)(unit(s) * i), t = s->order[i - 1];
        s->order[i - 1] = s->order[j], s->order[j] = t;
    }
    for (uint32_t v = 0; v < side * side; v++) {
        uint32_t x = v % side, y = v / side;
        bool cut = x == side / 2 && y > side / 2, half = unit(s) < 0.5, right = x + 1 < side, up = y + 1 < side;
        if (wanted.dual) {
            join(s, 2 * v, 2 * v + 1, false);
            if (right) join(s, 2 * v + 1, 2 * (v + 1), cut);
            if (up) join(s, 2 * v + half, 2 * (v + side) + (v & 1), false);
        } else {
            if (right) join(s, v, v + 1, cut);
            if (up) join(s, v, v + side, false);
            if (right && up && half) join(s, v, v + side + 1, cut);
        }
    }
    assemble(s);
    memset(s->b, 0, sizeof s->b);
    memset(s->x, 0, sizeof s->x);
    for (uint32_t k = 0; k < s->link_count; k++) {
        float flow = (float)(unit(s) - 0.5) * fabsf(s->weight[k]);
        s->b[s->end[0][k]] += flow;
        s->b[s->end[1][k]] += s->weight[k] > 0 ? flow : -flow;
    }
    uint32_t grounded = wanted.ground == 2 ? side : (uint32_t)wanted.ground;
    for (uint32_t i = 0; i < 2 * grounded; i++) s->diagonal[2 * s->order[places / 2 + i / 2] + (i & 1)] += 1;
}

static const shape shapes[] = {
    {40, false, false, 1, 1, false},   {40, true, false, 1, 1, false},    {40, false, true, 1, 0, false},
    {40, true, true, 1000, 0, true},   {40, false, false, 1000, 2, true}, {40, true, false, 1000, 2, false},
    {17, true, true, 10, 0, false},    {5, true, true, 10, 1, false},     {3, false, true, 1, 0, false},
    {40, true, false, 1000, 0, false}, {30, false, false, 100, 0, true},
};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static void apply(void *user, qw_env *env, const double *x, double *y)
{
    (void)env;
    const linear_system *s = user;
    for (uint32_t i = 0; i < s->n; i++) {
        y[i] = s->diagonal[i] * x[i];
        for (uint32_t k = s->first[i]; k < s->first[i + 1]; k++) y[i] += (double)s->value[k] * x[s->column[k]];
    }
}

/* With grids of its own. */
static qw_cg_result solve_afresh(linear_system *s, const qw_csr *a, double tolerance, uint32_t iterations)
{
    qw_scope_begin(s->env);
    qw_multigrid *grids = qw_multigrid_build(s->env, a);
    qw_cg_result r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, tolerance, iterations);
    qw_scope_end(s->env);
    return r;
}

static void check_plain(linear_system *s, double tolerance, uint32_t iterations)
{
    qw_csr a = matrix_of(s);
    for (uint32_t i = 0; i < s->n; i++) s->wide[i] = s->b[i], s->exact[i] = 0;
    /* As float, b has some part in the null space, about 1e-7 of it. */
    assert_true(qw_cg_solve(s->env, s->n, apply, s, s->diagonal, s->wide, s->exact, 1e-6, 20000).converged);
    qw_cg_result r = solve_afresh(s, &a, tolerance, 60);
    assert_true(r.converged && r.residual <= tolerance && r.iterations <= iterations && is_residual(s, r.residual));
    double error = 0, size = 0; /* energies e'Ae and x'Ax, which see no part in a null space */
    for (uint32_t i = 0; i < s->n; i++) {
        double product = s->diagonal[i] * (s->x[i] - s->exact[i]);
        for (uint32_t e = s->first[i]; e < s->first[i + 1]; e++)
            product += (double)s->value[e] * (s->x[s->column[e]] - s->exact[s->column[e]]);
        error += product * (s->x[i] - s->exact[i]);
        size += s->exact[i] * s->b[i];
    }
    assert_true(error < 1e-6 * size && size > 0);
}

static void plain_body(void *user)
{
    linear_system *s = user;
    for (int k = 0; k < SHAPES; k++) {
        make_system(s, shapes[k]);
        check_plain(s, 1e-5,
                    shapes[k].spread >= 100 ? 50 : 15); /* weights at random over decades are the hardest: 40 */
    }
}

/* The right-hand side is one direction all over, turned: x grows large, and its rounding alone makes a residual of 1e-4
 * and more. */
static void smooth_body(void *user)
{
    linear_system *s = user;
    static const float direction[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    for (int k = 0; k < 4; k++) {
        make_system(s, (shape){80, k & 1, k & 2, 1, k & 2 ? 0 : 2, false});
        for (uint32_t i = 0; i < s->n; i++) s->b[i] = direction[s->turn[i / 2]][i & 1];
        check_plain(s, 1e-6, 35);
    }
}

/* The larger system needs hardly more iterations than the small one. */
static void growth_body(void *user)
{
    linear_system *s = user;
    for (int kind = 0; kind < 8; kind++) {
        uint32_t iterations[2];
        for (int large = 0; large < 2; large++) {
            make_system(s, (shape){large ? SIDE : 16, kind & 1, kind & 2, kind & 4 ? 1000 : 1, 1, false});
            qw_csr a = matrix_of(s);
            qw_cg_result r = solve_afresh(s, &a, 1e-4, 60);
            assert_true(r.converged);
            iterations[large] = r.iterations;
        }
        assert_true(iterations[1] <= 2 * iterations[0] + 2 && iterations[1] <= (kind & 4 ? 30 : 12));
    }
}

static void thread_body(void *user)
{
    linear_system *s = user;
    static const uint32_t threads[] = {1, 2, 3, 8};
    make_system(s, (shape){80, true, true, 30, 2, true});
    qw_csr a = matrix_of(s);
    uint32_t iterations = 0;
    for (int t = 0; t < 4; t++) {
        qw_env_set_threads(s->env, threads[t]);
        memset(s->x, 0, sizeof s->x);
        qw_cg_result r = solve_afresh(s, &a, 1e-4, 100);
        assert_true(r.converged);
        if (t == 0) {
            memcpy(s->kept, s->x, sizeof s->x);
            iterations = r.iterations;
        }
        assert_int_equal(r.iterations, iterations);
        assert_memory_equal(s->x, s->kept, s->n * sizeof *s->x);
    }
}

/* One hierarchy, several right sides; few iterations; a good guess; more than doubles can. */
static void again_body(void *user)
{
    linear_system *s = user;
    make_system(s, (shape){50, true, true, 1, 1, false});
    qw_csr a = matrix_of(s);
    qw_scope_begin(s->env);
    qw_multigrid *grids = qw_multigrid_build(s->env, &a);
    qw_cg_result r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 1e-5, 2);
    assert_true(!r.converged && r.iterations == 2 && is_residual(s, r.residual));
    r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 1e-5, 0);
    assert_int_equal(r.iterations, 0);
    r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 1e-5, 100);
    assert_true(r.converged && is_residual(s, r.residual));
    memcpy(s->kept, s->x, sizeof s->x);
    assert_int_equal(qw_multigrid_solve_with(s->env, grids, s->b, s->x, 2e-5, 100).iterations, 0);
    assert_memory_equal(s->kept, s->x, sizeof s->x);
    for (uint32_t i = 0; i < s->n; i++) s->b[i] = (float)(unit(s) - 0.5);
    r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 0, 1000);
    assert_true(!r.converged && r.iterations < 200 && r.residual < 1e-12 && is_residual(s, r.residual));
    memset(s->b, 0, sizeof s->b);
    r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 1e-5, 10);
    assert_true(r.converged && r.residual == 0 && s->x[0] == 0 && s->x[s->n - 1] == 0);
    qw_scope_end(s->env);
}

/* The same pattern with other values: as few iterations as with grids of its own, nearly, and the same solution. */
static void refresh_body(void *user)
{
    linear_system *s = user;
    make_system(s, (shape){60, true, true, 1, 0, false});
    qw_csr a = matrix_of(s);
    qw_scope_begin(s->env);
    qw_multigrid *grids = qw_multigrid_build(s->env, &a);
    for (uint32_t k = 0; k < s->link_count; k++) s->weight[k] *= unit(s) < 0.1 ? 30 : 2;
    assemble(s);
    size_t held = qw_env_bytes(s->env);
    qw_multigrid_refresh(s->env, grids);
    assert_true(qw_env_bytes(s->env) == held);
    memset(s->x, 0, sizeof s->x);
    qw_cg_result fresh = solve_afresh(s, &a, 1e-5, 100);
    memset(s->x, 0, sizeof s->x);
    qw_cg_result r = qw_multigrid_solve_with(s->env, grids, s->b, s->x, 1e-5, 100);
    assert_true(fresh.converged && r.converged && is_residual(s, r.residual));
    assert_true(r.iterations <= 2 * fresh.iterations);
    qw_scope_end(s->env);
}

/* Many parts, each without ground, among them single unknowns that no equation holds; a hub with thousands of
 * neighbours. */
static void parts_body(void *user)
{
    linear_system *s = user;
    s->n = 9000;
    s->link_count = 0;
    for (uint32_t i = 0; i < 6000; i++) {
        if (i % 7 > 4) continue; /* chains of six, and one left over */
        s->end[0][s->link_count] = i;
        s->end[1][s->link_count] = i + 1;
        s->weight[s->link_count++] = (float)(i % 3 ? -unit(s) : unit(s));
    }
    for (uint32_t i = 6001; i < s->n; i++) {
        s->end[0][s->link_count] = 6000;
        s->end[1][s->link_count] = i;
        s->weight[s->link_count++] = (float)(0.5 - unit(s));
    }
    assemble(s);
    for (uint32_t k = 0; k < s->link_count; k++) {
        s->b[s->end[0][k]] += 1;
        s->b[s->end[1][k]] += s->weight[k] > 0 ? 1 : -1;
    }
    for (uint32_t i = 0; i < s->n; i++) s->x[i] = 3;
    for (uint32_t i = 0; i < s->n; i++) assert_true(s->diagonal[i] > 0 || s->b[i] == 0);
    qw_csr a = matrix_of(s);
    qw_cg_result r = solve_afresh(s, &a, 1e-5, 100);
    assert_true(r.converged && is_residual(s, r.residual));
    for (uint32_t i = 0; i < s->n; i++) assert_true(s->diagonal[i] > 0 || s->x[i] == 3);
}

static void odd_body(void *user)
{
    linear_system *s = user;
    s->n = 0;
    qw_csr a = matrix_of(s);
    assert_true(solve_afresh(s, &a, 1e-5, 10).converged);
    s->n = 1;
    s->diagonal[0] = 4, s->b[0] = 2;
    a = matrix_of(s);
    assert_true(solve_afresh(s, &a, 1e-6, 10).converged && s->x[0] == 0.5f);
    s->diagonal[0] = 0, s->x[0] = 7;
    qw_cg_result r = solve_afresh(s, &a, 1e-6, 10);
    assert_true(!r.converged && r.residual == 1 && s->x[0] == 7);
    s->n = 3;
    memcpy(s->first, (uint32_t[]){0, 1, 2, 2}, 4 * sizeof(uint32_t));
    memcpy(s->column, (uint32_t[]){1, 0}, 2 * sizeof(uint32_t));
    memcpy(s->value, (float[]){-1, -1}, 2 * sizeof(float));
    memcpy(s->diagonal, (double[]){2, 2, 0}, 3 * sizeof(double));
    memcpy(s->x, (float[]){5, 5, 5}, 3 * sizeof(float));
    memcpy(s->b, (float[]){3, 0, 0}, 3 * sizeof(float));
    a = matrix_of(s);
    assert_true(solve_afresh(s, &a, 1e-6, 10).converged);
    assert_true(fabs(s->x[0] - 2) < 1e-5 && fabs(s->x[1] - 1) < 1e-5 && s->x[2] == 5);
    s->b[2] = 1;
    r = solve_afresh(s, &a, 1e-6, 10);
    assert_true(!r.converged && fabs(r.residual - 1 / sqrt(10)) < 1e-6);
    s->b[0] = NAN;
    r = solve_afresh(s, &a, 1e-6, 1000);
    assert_true(!r.converged && r.iterations < 10);
    s->b[0] = 1;
    s->diagonal[0] = -5; /* not semidefinite */
    assert_true(!solve_afresh(s, &a, 1e-6, 1000).converged);
}

static void solve_body(void *user)
{
    linear_system *s = user;
    qw_csr a = matrix_of(s);
    solve_afresh(s, &a, 1e-4, 10);
}

static void test_scarce_memory(void **state)
{
    (void)state;
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    int allowed = 0;
    qw_host host = faults_host(&f);
    linear_system *s = calloc(1, sizeof *s);
    s->env = qw_env_create(&host, 1);
    make_system(s, (shape){12, true, true, 1, 1, false});
    for (qw_status status = QW_MEMORY; status != QW_OK; allowed++) {
        f.allocations = allowed;
        status = qw_protect(s->env, solve_body, s);
        assert_true(status == QW_OK || status == QW_MEMORY);
        assert_int_equal(qw_env_bytes(s->env), 0);
    }
    assert_true(allowed > 20);
    qw_env_destroy(s->env);
    free(s);
}

#define TEST(name)                        \
    static void test_##name(void **state) \
    {                                     \
        (void)state;                      \
        run(name##_body);                 \
    }
TEST(plain)
TEST(smooth)
TEST(growth)
TEST(thread)
TEST(again)
TEST(refresh)
TEST(parts)
TEST(odd)

QW_TEST_SUITE(multigrid)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plain),  cmocka_unit_test(test_smooth), cmocka_unit_test(test_growth),
        cmocka_unit_test(test_thread), cmocka_unit_test(test_again),  cmocka_unit_test(test_refresh),
        cmocka_unit_test(test_parts),  cmocka_unit_test(test_odd),    cmocka_unit_test(test_scarce_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

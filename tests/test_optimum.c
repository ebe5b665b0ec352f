/* The integers chosen on decimated complexes against the integer optimum, by GLPK: the sum of (z - x)^2 over the edges
 * under Eq. (3). */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/circuits.h"
#include "remesh/quantise/closed.h"
#include "remesh/quantise/network.h"
#include "remesh/quantise/decimated.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#ifdef QW_HAVE_GLPK
#include <glpk.h>

enum { REACH = 3, STEPS = 2 * REACH, ROUNDS = 4, LONGEST = 48 };

static double energy(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        double x = c->d[e].x - (double)c->real[e].x, y = c->d[e].y - (double)c->real[e].y;
        sum += x * x + y * y;
    }
    return sum;
}

/* Each component is its lowest value and STEPS binary steps upward, that cost more and more: an exact model of a convex
 * cost. Returns the least energy. */
static double optimum(qw_env *env, const qw_complex *c)
{
    uint32_t variables = 2 * c->edge_count, columns = STEPS * variables, rows = 2 * c->face_count;
    glp_term_out(GLP_OFF);
    glp_prob *lp = glp_create_prob();
    glp_add_rows(lp, (int)rows), glp_add_cols(lp, (int)columns);
    int *row = QW_NEW(env, int, 2 * (size_t)columns + 1), *column = QW_NEW(env, int, 2 * (size_t)columns + 1),
        entries = 0;
    double *value = QW_NEW(env, double, 2 * (size_t)columns + 1), *bound = QW_NEW_ZERO(env, double, rows), base = 0;
    for (uint32_t v = 0; v < variables; v++) {
        bool fixed = c->fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X);
        double x = fixed ? 0 : (double)(v & 1u ? c->real[v / 2].y : c->real[v / 2].x),
               low = fixed ? 0 : rint(x) - REACH;
        base += (low - x) * (low - x);
        for (int s = 0; s < 2; s++) {
            uint32_t h = c->side[2 * (v / 2) + (uint32_t)s];
            if (h == QW_NONE) continue;
            qw_row at = qw_row_of(c->rot[h], v & 1u);
            bound[2 * (h / 3) + at.row] -= at.sign * low;
            for (int k = 0; k < STEPS && !fixed; k++)
                row[++entries] = (int)(2 * (h / 3) + at.row) + 1, column[entries] = (int)(STEPS * v) + k + 1,
                value[entries] = at.sign;
        }
        for (int k = 0; k < STEPS; k++) {
            glp_set_col_kind(lp, (int)(STEPS * v) + k + 1, GLP_BV);
            glp_set_obj_coef(lp, (int)(STEPS * v) + k + 1, 2 * (low + k - x) + 1);
            if (fixed) glp_set_col_bnds(lp, (int)(STEPS * v) + k + 1, GLP_FX, 0, 0);
        }
    }
    for (uint32_t r = 0; r < rows; r++) glp_set_row_bnds(lp, (int)r + 1, GLP_FX, bound[r], bound[r]);
    glp_load_matrix(lp, entries, row, column, value);
    glp_iocp options;
    glp_init_iocp(&options);
    options.msg_lev = GLP_MSG_OFF, options.presolve = GLP_ON;
    assert_int_equal(glp_intopt(lp, &options), 0);
    assert_int_equal(glp_mip_status(lp), GLP_OPT);
    double least = base + glp_mip_obj_val(lp);
    glp_delete_prob(lp);
    glp_free_env();
    return least;
}

/* As the quantisation does it: from the nearest whole numbers, by single steps on the double cover, then by circuits.
 * Returns whether Eq. (3) holds. */
static bool choose(qw_env *env, qw_complex *c)
{
    qw_regular_counts counts = {0};
    for (uint32_t e = 0; e < c->edge_count; e++)
        c->d[e] = (qw_int2){(int32_t)lrintf(c->real[e].x), (int32_t)lrintf(c->real[e].y)};
    bool regular = false;
    for (int i = 0; i < ROUNDS && !regular; i++)
        regular = qw_solve_complex(env, c, NULL, QW_FLOW_MCF, QW_COST_SQUARE, i + 1 == ROUNDS, NULL, &counts);
    for (uint32_t f = 0; f < c->face_count; f++)
        if (!qw_int2_is_zero(qw_complex_residual(c, f))) return false;
    qw_improve_offsets(env, c, LONGEST);
    return true;
}

typedef struct sum {
    double ours, least;
    int cases, exact;
} sum;

static void compare(qw_env *env, const char *name, qw_trimesh mesh, float rho, sum *all)
{
    qw_scope_begin(env);
    qw_offset_mesh m = unit_solve(env, mesh, rho, true).offsets;
    float *stiffness = QW_NEW(env, float, m.edge_count);
    for (uint32_t e = 0; e < m.edge_count; e++) stiffness[e] = 1;
    qw_closed_counts closing;
    qw_real2 *closed = qw_closed_offsets(env, &m, 0, stiffness, &closing);
    qw_decimated s = qw_decimate(env, &m, closed);
    for (int size = 0; size < 5; size++) {
        qw_complex c = s.complex;
        c.real = QW_NEW(env, qw_real2, c.edge_count);
        float scale = 0.8f + 0.1f * (float)size;
        for (uint32_t e = 0; e < c.edge_count; e++)
            c.real[e] = (qw_real2){scale * s.complex.real[e].x, scale * s.complex.real[e].y};
        assert_true(choose(env, &c));
        double ours = energy(&c), least = optimum(env, &c);
        assert_true(ours >= least - 1e-3 * (1 + least));
        all->ours += ours, all->least += least, all->cases++;
        all->exact += ours <= least + 1e-3 * (1 + least);
        print_message("%-14s size %.1f: %3u triangles, energy %8.4f, optimum %8.4f, gap %5.1f %%\n", name,
                      (double)scale, c.face_count, ours, least, least > 1e-9 ? 100 * (ours / least - 1) : 0);
    }
    qw_scope_end(env);
}

static void close_to_the_optimum(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    sum all = {0};
    compare(env, "sphere", unit_sphere(env, 4), 0.2f, &all);
    compare(env, "cube", unit_cube(env, 4), 0.125f, &all);
    compare(env, "torus", unit_torus(env, 40, 24, 0.4f), 0.2f, &all);
    compare(env, "double torus", unit_double_torus(env, 2), 0.4f, &all);
    compare(env, "open cylinder", unit_cylinder(env, 40, 20, 2.0f), 0.2f, &all);
    print_message("all: gap %.2f %%, %d of %d at the optimum\n", 100 * (all.ours / all.least - 1), all.exact,
                  all.cases);
    assert_true(all.ours <= 1.01 * all.least);
    qw_env_destroy(env);
}

#else
static void close_to_the_optimum(void **state)
{
    (void)state;
    print_message("GLPK, the oracle, is not installed\n");
    skip();
}
#endif

QW_TEST_SUITE(optimum)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(close_to_the_optimum)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

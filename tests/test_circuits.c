/* Circuits on strips of a few triangles against all closed integers, tried one by one; on decimated complexes, that
 * nothing is off afterwards. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/circuits.h"
#include "remesh/quantise/closed.h"
#include "remesh/quantise/decimated.h"

enum { REACH = 2, ANY_LENGTH = 1000 };

static double cost_of(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        double x = c->d[e].x - (double)c->real[e].x, y = c->d[e].y - (double)c->real[e].y;
        sum += (c->weight ? (double)c->weight[e] : 1) * (x * x + y * y);
    }
    return sum;
}

static int32_t *value_of(qw_complex *c, uint32_t v) { return v & 1u ? &c->d[v / 2].y : &c->d[v / 2].x; }

/* Two triangles with a common edge, edge 0, whose frames are turned at random; real and weight at random, d zero. */
static qw_complex two_triangles(qw_env *env, unit_rng *r)
{
    qw_complex c = {.face_count = 2, .edge_count = 5};
    static const uint32_t edge[6] = {0, 1, 2, 0, 3, 4},
                          side[10] = {0, 3, 1, QW_NONE, 2, QW_NONE, 4, QW_NONE, 5, QW_NONE};
    c.edge = QW_NEW(env, uint32_t, 6), c.side = QW_NEW(env, uint32_t, 10);
    memcpy(c.edge, edge, sizeof edge), memcpy(c.side, side, sizeof side);
    c.rot = QW_NEW(env, uint8_t, 6), c.fixed = QW_NEW_ZERO(env, uint8_t, 5);
    c.d = QW_NEW_ZERO(env, qw_int2, 5), c.real = QW_NEW(env, qw_real2, 5), c.weight = QW_NEW(env, float, 5);
    for (uint32_t h = 0; h < 6; h++) c.rot[h] = (uint8_t)unit_random(r, 4);
    for (uint32_t e = 0; e < 5; e++) {
        c.real[e] = (qw_real2){unit_real(r) * 1.4f, unit_real(r) * 1.4f};
        c.weight[e] = 1.2f + unit_real(r);
    }
    for (uint32_t e = 1; e < 5; e++)
        if (unit_random(r, 4) == 0) c.fixed[e] = unit_random(r, 2) ? QW_FIXED_X : QW_FIXED_Y;
    return c;
}

/* The least cost of closed integers within REACH of zero. */
static double least_cost(qw_env *env, const qw_complex *given)
{
    qw_complex c = *given;
    c.d = QW_NEW_ZERO(env, qw_int2, c.edge_count);
    double least = INFINITY;
    uint32_t variables = 2 * c.edge_count;
    for (uint32_t v = 0; v < variables; v++)
        if (!(c.fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X))) *value_of(&c, v) = -REACH;
    for (uint32_t v = 0; v < variables;) {
        if (qw_complex_is_closed(&c)) least = fmin(least, cost_of(&c));
        for (v = 0; v < variables; v++) {
            if (c.fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X)) continue;
            if (++*value_of(&c, v) <= REACH) break;
            *value_of(&c, v) = -REACH;
        }
    }
    qw_free(env, c.d);
    return least;
}

/* From zero to the optimum, or hardly ever a little above it: a walk that meets itself the wrong way round is none. */
static void finds_the_optimum(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {1};
    int at_optimum = 0, cases = 0, better = 0;
    for (; cases < 100; cases++) {
        qw_complex c = two_triangles(env, &r);
        for (uint32_t e = 2; e < 5; e++) c.fixed[e] |= e == 2 + (uint32_t)cases % 3 ? QW_FIXED_X : 0;
        double before = cost_of(&c), least = least_cost(env, &c);
        uint32_t count = qw_improve_offsets(env, &c, ANY_LENGTH);
        double after = cost_of(&c);
        assert_true(qw_complex_is_closed(&c));
        for (uint32_t v = 0; v < 2 * c.edge_count; v++)
            if (c.fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X)) assert_int_equal(*value_of(&c, v), 0);
        assert_true(after >= least - 1e-3 && after <= before + 1e-3);
        assert_true((count > 0) == (after < before - 1e-6));
        at_optimum += after <= least + 1e-3, better += count > 0;
    }
    print_message("%d of %d made better, %d at the optimum\n", better, cases, at_optimum);
    assert_true(better >= cases / 2 && at_optimum >= cases - 3);
    qw_env_destroy(env);
}

/* What was closed and the cheapest stays as it is: whole real values. */
static void leaves_whole_values(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {5};
    qw_complex c = two_triangles(env, &r);
    for (uint32_t e = 0; e < 5; e++) c.real[e] = (qw_real2){0, 0};
    assert_int_equal(qw_improve_offsets(env, &c, ANY_LENGTH), 0);
    for (uint32_t v = 0; v < 10; v++) assert_int_equal(*value_of(&c, v), 0);
    qw_env_destroy(env);
}

/* On decimated complexes, from zero, which is closed and far away. */
static void decimated_complexes_stay_closed(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh shapes[] = {unit_sphere(env, 4), unit_torus(env, 40, 24, 0.4f), unit_double_torus(env, 2),
                           unit_cylinder(env, 40, 20, 2.0f)};
    double sums[3] = {0, 0, 0};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        qw_offset_mesh m = unit_solve(env, shapes[i], 0.3f, true).offsets;
        float *stiffness = QW_NEW(env, float, m.edge_count);
        qw_closed_counts closing;
        qw_real2 *closed = qw_closed_offsets(env, &m, 0, stiffness, &closing);
        qw_complex c = qw_decimate(env, &m, closed).complex;
        qw_int2 *first = QW_NEW(env, qw_int2, c.edge_count);
        memset(c.d, 0, c.edge_count * sizeof *c.d);
        memcpy(first, c.d, c.edge_count * sizeof *c.d);
        sums[0] += cost_of(&c);
        uint32_t longest[2] = {6, ANY_LENGTH};
        for (int k = 0; k < 2; k++) {
            memcpy(c.d, first, c.edge_count * sizeof *c.d);
            qw_improve_offsets(env, &c, longest[k]);
            assert_true(qw_complex_is_closed(&c));
            for (uint32_t v = 0; v < 2 * c.edge_count; v++)
                if (c.fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X)) assert_int_equal(*value_of(&c, v), 0);
            sums[1 + k] += cost_of(&c);
        }
    }
    print_message("from zero: %.1f, circuits of 6 %.1f, of any length %.1f\n", sums[0], sums[1], sums[2]);
    assert_true(sums[1] < sums[0] && sums[2] < 0.2 * sums[0] && sums[2] <= sums[1]);
    qw_env_destroy(env);
}

QW_TEST_SUITE(circuits)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(finds_the_optimum), cmocka_unit_test(leaves_whole_values),
                                       cmocka_unit_test(decimated_complexes_stay_closed)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Positions as they are written: rounded where that is free, no quad degenerate. */
#include "suite.h"
#include "whole/written.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "suite.h"

enum { SIDE = 4, POINTS = SIDE + 1, VERTICES = POINTS * POINTS, QUADS = SIDE * SIDE };

typedef struct sheet {
    qw_env *env;
    qw_quadmesh quads;
    double position[3 * VERTICES];
} sheet;

/* SIDE x SIDE squares of side 1 in a plane, wide times as wide. */
static sheet make_sheet(double wide)
{
    sheet s = {.env = qw_env_create(NULL, 1)};
    qw_scope_begin(s.env);
    qw_quadmesh *m = &s.quads;
    m->vertex_count = VERTICES, m->face_count = QUADS;
    m->corner = QW_NEW(s.env, uint32_t, 4 * QUADS), m->twin = QW_NEW(s.env, uint32_t, 4 * QUADS);
    for (uint32_t v = 0; v < VERTICES; v++) {
        double p[3] = {wide * (v % POINTS), v / POINTS, 1 / 3.0};
        memcpy(s.position + 3 * v, p, sizeof p);
    }
    for (uint32_t f = 0; f < QUADS; f++) {
        uint32_t x = f % SIDE, y = f / SIDE, a = y * POINTS + x;
        uint32_t corner[4] = {a, a + 1, a + POINTS + 1, a + POINTS};
        uint32_t twin[4] = {y ? 4 * (f - SIDE) + 2 : QW_NONE, x + 1 < SIDE ? 4 * (f + 1) + 3 : QW_NONE,
                            y + 1 < SIDE ? 4 * (f + SIDE) : QW_NONE, x ? 4 * (f - 1) + 1 : QW_NONE};
        memcpy(m->corner + 4 * f, corner, sizeof corner), memcpy(m->twin + 4 * f, twin, sizeof twin);
    }
    return s;
}

static void drop_sheet(sheet *s)
{
    qw_scope_end(s->env);
    qw_env_destroy(s->env);
}

static uint32_t count_degenerate(const sheet *s)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < QUADS; f++) count += qw_is_degenerate(s->quads.corner + 4 * f, s->position);
    return count;
}

static void tells_degenerate_quads(void **state)
{
    (void)state;
    static const uint32_t corner[4] = {0, 1, 2, 3};
    double square[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, line[12] = {0, 0, 0, 1, 1, 1, 3, 3, 3, 2, 2, 2},
           together[12] = {0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 1, 0}, dart[12] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 1, 1, 0};
    assert_false(qw_is_degenerate(corner, square));
    assert_false(qw_is_degenerate(corner, dart)); /* three corners may be on a line */
    assert_true(qw_is_degenerate(corner, line));
    assert_true(qw_is_degenerate(corner, together));
    for (int i = 0; i < 12; i++) square[i] *= 1e300, line[i] *= 1e-300;
    assert_false(qw_is_degenerate(corner, square));
    assert_true(qw_is_degenerate(corner, line));
    for (int i = 0; i < 12; i++) square[i] *= 1e-300, square[i] *= 1e-300;
    assert_false(qw_is_degenerate(corner, square));
}

static void rounds_what_is_wide(void **state)
{
    (void)state;
    sheet s = make_sheet(1);
    uint32_t moved;
    assert_int_equal(qw_settle_written(s.env, &s.quads, 1000, s.position, &moved), QW_NONE);
    assert_int_equal(moved, 0);
    for (uint32_t v = 0; v < VERTICES; v++)
        assert_true(s.position[3 * v + 2] <= 0.333 && s.position[3 * v + 2] > 0.3329);
    drop_sheet(&s);
}

/* Rounding would make lines of the quads, so it is left out. */
static void keeps_what_is_narrow(void **state)
{
    (void)state;
    for (double wide = 1e-3; wide > 1e-12; wide /= 10) {
        sheet s = make_sheet(wide);
        uint32_t moved;
        assert_int_equal(qw_settle_written(s.env, &s.quads, 1000, s.position, &moved), QW_NONE);
        assert_int_equal(moved, 0);
        assert_int_equal(count_degenerate(&s), 0);
        assert_true(s.position[3] == wide);
        drop_sheet(&s);
    }
}

static void parts_what_fell_together(void **state)
{
    (void)state;
    static const uint32_t to[][2] = {{6, 7}, {6, 12}, {0, 1}, {1, 6}, {12, 13}};
    for (size_t i = 0; i < sizeof to / sizeof *to; i++) {
        sheet s = make_sheet(1);
        double before[3 * VERTICES];
        uint32_t moved;
        memcpy(s.position + 3 * to[i][0], s.position + 3 * to[i][1], 3 * sizeof(double));
        memcpy(before, s.position, sizeof before);
        assert_true(count_degenerate(&s) > 0);
        assert_int_equal(qw_settle_written(s.env, &s.quads, 0, s.position, &moved), QW_NONE);
        assert_true(moved > 0);
        assert_int_equal(count_degenerate(&s), 0);
        for (int k = 0; k < 3 * VERTICES; k++) assert_true(fabs(s.position[k] - before[k]) < 0.01);
        drop_sheet(&s);
    }
}

/* A boundary that goes back upon itself: two neighbours at one place, and those beside them at another. Drawn towards
   their neighbours both move alike. */
static void parts_what_moves_alike(void **state)
{
    (void)state;
    sheet s = make_sheet(1);
    uint32_t moved;
    memcpy(s.position + 3 * 2, s.position + 3 * 1, 3 * sizeof(double));
    memcpy(s.position + 3 * 3, s.position + 3 * 0, 3 * sizeof(double));
    assert_int_equal(qw_settle_written(s.env, &s.quads, 0, s.position, &moved), QW_NONE);
    assert_int_equal(count_degenerate(&s), 0);
    drop_sheet(&s);
}

/* All in one point but the rim; all on one line; then all at the origin, where no step is small and none is large. */
static void says_what_cannot_be(void **state)
{
    (void)state;
    sheet s = make_sheet(1);
    uint32_t moved;
    for (uint32_t v = 0; v < VERTICES; v++)
        if (v % POINTS % SIDE && v / POINTS % SIDE) s.position[3 * v] = s.position[3 * v + 1] = 1.5;
    assert_int_equal(qw_settle_written(s.env, &s.quads, 0, s.position, &moved), QW_NONE);
    assert_int_equal(count_degenerate(&s), 0);
    for (uint32_t v = 0; v < VERTICES; v++) s.position[3 * v] = 0;
    assert_int_equal(qw_settle_written(s.env, &s.quads, 0, s.position, &moved), QW_NONE);
    assert_int_equal(count_degenerate(&s), 0);
    for (uint32_t v = 0; v < VERTICES; v++) assert_true(fabs(s.position[3 * v]) < 1e-6);
    memset(s.position, 0, sizeof s.position);
    assert_int_equal(qw_settle_written(s.env, &s.quads, 0, s.position, &moved), 0);
    drop_sheet(&s);
}

/* Each rim of a tube of three quads at one point: no vertex alone gives any quad an area. */
static void parts_tube_that_became_a_line(void **state)
{
    (void)state;
    for (int scale = 0; scale < 2; scale++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_scope_begin(env);
        uint32_t corner[12], twin[12], moved;
        double position[18];
        for (uint32_t f = 0; f < 3; f++) {
            uint32_t next = (f + 1) % 3, own[4] = {f, next, 3 + next, 3 + f},
                     other[4] = {QW_NONE, 4 * next + 3, QW_NONE, 4 * ((f + 2) % 3) + 1};
            memcpy(corner + 4 * f, own, sizeof own), memcpy(twin + 4 * f, other, sizeof other);
        }
        for (uint32_t v = 0; v < 6; v++)
            for (uint32_t k = 0; k < 3; k++)
                position[3 * v + k] = (scale ? 7.0 : 3e-5) + (v < 3 ? 1e-5 : 2e-5) * (scale ? k == 0 : k + 1);
        qw_quadmesh tube = {.vertex_count = 6, .face_count = 3, .corner = corner, .twin = twin};
        assert_int_equal(qw_settle_written(env, &tube, 1e9, position, &moved), QW_NONE);
        for (uint32_t f = 0; f < 3; f++) assert_false(qw_is_degenerate(corner + 4 * f, position));
        qw_scope_end(env);
        qw_env_destroy(env);
    }
}

QW_TEST_SUITE(written)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tells_degenerate_quads),        cmocka_unit_test(rounds_what_is_wide),
        cmocka_unit_test(keeps_what_is_narrow),          cmocka_unit_test(parts_what_fell_together),
        cmocka_unit_test(parts_what_moves_alike),        cmocka_unit_test(says_what_cannot_be),
        cmocka_unit_test(parts_tube_that_became_a_line),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

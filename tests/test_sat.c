/* The SAT solver against the 2^n assignments, its limits, and what becomes of it when a failure unwinds. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "solve/sat.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

typedef struct fixture {
    qw_env *env;
    uint64_t random;
    int literals[64][3];
    uint32_t sizes[64], clauses;
    int variables;
} fixture;

static uint32_t below(fixture *f, uint32_t bound)
{
    random_step(&f->random);
    return (uint32_t)(((f->random >> 32) * bound) >> 32);
}

static void run(void (*body)(void *user))
{
    if (!qw_sat_available()) skip();
    fixture f = {.env = qw_env_create(NULL, 1), .random = 11};
    assert_int_equal(qw_protect(f.env, body, &f), QW_OK);
    qw_env_destroy(f.env);
}

static void random_formula(fixture *f)
{
    f->variables = 1 + (int)below(f, 10);
    f->clauses = below(f, 64);
    for (uint32_t c = 0; c < f->clauses; c++) {
        f->sizes[c] = 1 + (below(f, 8) > 0) + (below(f, 8) > 0);
        for (uint32_t i = 0; i < f->sizes[c]; i++) {
            int variable = 1 + (int)below(f, (uint32_t)f->variables);
            f->literals[c][i] = below(f, 2) ? variable : -variable;
        }
    }
}

static bool is_met(const fixture *f, uint32_t c, uint32_t assignment)
{
    for (uint32_t i = 0; i < f->sizes[c]; i++) {
        int literal = f->literals[c][i], variable = abs(literal);
        if ((assignment >> (variable - 1) & 1) == (literal > 0)) return true;
    }
    return false;
}

static bool enumerate(const fixture *f)
{
    for (uint32_t assignment = 0; assignment < 1u << f->variables; assignment++) {
        uint32_t c = 0;
        while (c < f->clauses && is_met(f, c, assignment)) c++;
        if (c == f->clauses) return true;
    }
    return false;
}

static void enumerate_body(void *user)
{
    fixture *f = user;
    int yes = 0, no = 0;
    for (int round = 0; round < 600; round++) {
        random_formula(f);
        bool expected = enumerate(f);
        qw_scope_begin(f->env);
        qw_sat *sat = qw_sat_begin(f->env);
        for (uint32_t c = 0; c < f->clauses; c++) qw_sat_clause(sat, f->literals[c], f->sizes[c]);
        assert_int_equal(qw_sat_solve(sat, -1), expected ? QW_SAT_YES : QW_SAT_NO);
        uint32_t assignment = 0;
        for (int v = 1; v <= f->variables; v++) assignment |= (uint32_t)qw_sat_value(sat, v) << (v - 1);
        for (uint32_t c = 0; expected && c < f->clauses; c++) assert_true(is_met(f, c, assignment));
        assert_true(!expected || qw_sat_check(sat));
        qw_scope_end(f->env);
        yes += expected;
        no += !expected;
    }
    assert_true(yes > 100 && no > 100);
}

/* All models, one after another, each forbidden by a further clause. */
static void incremental_body(void *user)
{
    fixture *f = user;
    qw_sat *sat = qw_sat_begin(f->env);
    qw_sat_clause(sat, (int[]){1, 2, 3}, 3);
    qw_sat_clause(sat, (int[]){-1, -4}, 2);
    qw_sat_clause(sat, (int[]){4, 5, -5}, 3);
    int models = 0;
    for (; qw_sat_solve(sat, 1000) == QW_SAT_YES; models++) {
        assert_true(qw_sat_check(sat));
        int forbidden[5];
        for (int v = 1; v <= 5; v++) forbidden[v - 1] = qw_sat_value(sat, v) ? -v : v;
        qw_sat_clause(sat, forbidden, 5);
        assert_false(qw_sat_check(sat)); /* the old values break the new clause */
    }
    assert_int_equal(models, 2 * (4 + 6)); /* 5 is free; 1 and not 4: 2 and 3 free; not 1: (2 or 3), 4 free */
    assert_int_equal(qw_sat_solve(sat, 1000), QW_SAT_NO);
}

/* `holes + 1` pigeons: variable p * holes + h + 1 puts pigeon p into hole h. */
static qw_sat *pigeons(qw_env *env, int holes)
{
    qw_sat *sat = qw_sat_begin(env);
    for (int p = 0; p <= holes; p++) {
        int somewhere[16];
        for (int h = 0; h < holes; h++) somewhere[h] = p * holes + h + 1;
        qw_sat_clause(sat, somewhere, (uint32_t)holes);
        for (int q = 0; q < p; q++)
            for (int h = 0; h < holes; h++) qw_sat_clause(sat, (int[]){-(p * holes + h + 1), -(q * holes + h + 1)}, 2);
    }
    return sat;
}

static void limit_body(void *user)
{
    fixture *f = user;
    int64_t calls[2] = {0}, conflicts[2] = {0};
    for (int time = 0; time < 2; time++) {
        qw_sat *sat = pigeons(f->env, 7);
        qw_sat_answer answer = QW_SAT_UNKNOWN;
        for (int64_t limit = 10; answer == QW_SAT_UNKNOWN; limit *= 2, calls[time]++) {
            assert_true(limit < 1 << 24);
            answer = qw_sat_solve(sat, limit);
            int64_t spent = qw_sat_conflicts(sat);
            assert_true(answer == QW_SAT_UNKNOWN ? spent == limit : spent > 0 && spent <= limit);
            conflicts[time] += spent;
        }
        assert_int_equal(answer, QW_SAT_NO);
    }
    assert_true(calls[0] > 2);
    assert_true(calls[0] == calls[1] && conflicts[0] == conflicts[1]); /* the same effort each time */
}

static void edge_body(void *user)
{
    fixture *f = user;
    qw_sat *sat = qw_sat_begin(f->env);
    assert_int_equal(qw_sat_solve(sat, 0), QW_SAT_YES); /* nothing is asked */
    assert_false(qw_sat_value(sat, 1));
    assert_true(qw_sat_check(sat));
    qw_sat_clause(sat, (int[]){-70}, 1);
    qw_sat_clause(sat, (int[]){70, 900}, 2);
    assert_int_equal(qw_sat_solve(sat, INT64_MAX), QW_SAT_YES);
    assert_true(qw_sat_value(sat, 900) && !qw_sat_value(sat, 70) && !qw_sat_value(sat, 901));
    qw_sat_clause(sat, NULL, 0); /* the empty clause */
    assert_int_equal(qw_sat_solve(sat, -1), QW_SAT_NO);
}

static void abandon(void *user)
{
    fixture *f = user;
    qw_sat_solve(pigeons(f->env, 5), 5);
    qw_fail(f->env, QW_INTERNAL, -1, "the solver is released by the unwinding");
}

static void unwind_body(void *user)
{
    fixture *f = user;
    size_t before = qw_env_bytes(f->env);
    assert_int_equal(qw_protect(f->env, abandon, f), QW_INTERNAL);
    assert_int_equal(qw_env_bytes(f->env), before);
}

static void small_formula(void *user)
{
    fixture *f = user;
    qw_scope_begin(f->env);
    assert_int_equal(qw_sat_solve(pigeons(f->env, 4), -1), QW_SAT_NO);
    qw_scope_end(f->env);
}

static void test_scarce_memory(void **state)
{
    (void)state;
    if (!qw_sat_available()) skip();
    faults faulty = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    int allowed = 0;
    qw_host host = faults_host(&faulty);
    fixture f = {.env = qw_env_create(&host, 1)};
    for (qw_status status = QW_MEMORY; status != QW_OK; allowed++) {
        faulty.allocations = allowed;
        status = qw_protect(f.env, small_formula, &f);
        assert_true(status == QW_OK || status == QW_MEMORY);
        assert_int_equal(qw_env_bytes(f.env), 0);
    }
    assert_true(allowed > 4);
    qw_env_destroy(f.env);
}

static void absent_body(void *user)
{
    fixture *f = user;
    qw_sat *sat = qw_sat_begin(f->env);
    qw_sat_clause(sat, (int[]){1}, 1);
    assert_int_equal(qw_sat_solve(sat, -1), QW_SAT_UNKNOWN);
    assert_false(qw_sat_check(sat));
}

static void test_absent(void **state)
{
    (void)state;
    if (qw_sat_available()) skip();
    fixture f = {.env = qw_env_create(NULL, 1)};
    assert_int_equal(qw_protect(f.env, absent_body, &f), QW_OK);
    qw_env_destroy(f.env);
}

#define TEST(name)                        \
    static void test_##name(void **state) \
    {                                     \
        (void)state;                      \
        run(name##_body);                 \
    }
TEST(enumerate)
TEST(incremental)
TEST(limit)
TEST(edge)
TEST(unwind)

QW_TEST_SUITE(sat)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_enumerate),     cmocka_unit_test(test_incremental), cmocka_unit_test(test_limit),
        cmocka_unit_test(test_edge),          cmocka_unit_test(test_unwind),      cmocka_unit_test(test_absent),
        cmocka_unit_test(test_scarce_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* An arena: blocks that do not touch, given back in any order, and an environment that lives in one. */
#include "suite.h"
#include "base/arena.h"
#include "base/env.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { SIZE = 1 << 16, BLOCKS = 40 };

static void blocks_keep_apart(void **state)
{
    (void)state;
    unsigned char *bytes = malloc(SIZE), *block[BLOCKS] = {0};
    size_t size[BLOCKS] = {0};
    qw_arena a;
    qw_arena_begin(&a, bytes, SIZE);
    uint32_t random = 1, refused = 0;
    for (int step = 0; step < 20000; step++) {
        random = random * 1664525u + 1013904223u;
        int i = (int)(random >> 16) % BLOCKS;
        random = random * 1664525u + 1013904223u;
        size_t wanted = (random >> 16) % 3 ? (random >> 18) % 3000 : 0;
        for (size_t k = 0; k < size[i]; k++) assert_int_equal(block[i][k], i);
        unsigned char *fresh = wanted || block[i] ? qw_arena_resize(&a, block[i], size[i], wanted) : NULL;
        if (wanted && !fresh) { /* as it was */
            refused++;
            continue;
        }
        for (size_t k = 0; fresh && k < size[i] && k < wanted; k++) assert_int_equal(fresh[k], i);
        block[i] = fresh, size[i] = wanted;
        if (!fresh) continue;
        assert_true((uintptr_t)fresh % sizeof(void *) == 0 && fresh >= bytes && fresh + wanted <= bytes + SIZE);
        memset(fresh, i, wanted);
    }
    assert_true(refused > 0);
    for (int i = 0; i < BLOCKS; i++)
        if (block[i]) assert_null(qw_arena_resize(&a, block[i], size[i], 0));
    assert_int_equal(a.top, 0); /* all of it is free again */
    free(bytes);
}

static void take_too_much(void *user)
{
    qw_env *env = user;
    for (int i = 0; i < 1000; i++) (void)QW_NEW_ZERO(env, double, 1000);
}

static void take_a_little(void *user)
{
    qw_env *env = user;
    for (int i = 0; i < 1000; i++) {
        qw_scope_begin(env);
        double *a = QW_NEW_ZERO(env, double, 1000), *b = QW_NEW_ZERO(env, double, 1000);
        qw_free(env, a), qw_free(env, b);
        qw_scope_end(env);
    }
}

static void holds_an_environment(void **state)
{
    (void)state;
    void *bytes = malloc(SIZE);
    qw_arena a;
    qw_arena_begin(&a, bytes, SIZE);
    qw_host host = {.resize = qw_arena_resize, .resize_user = &a};
    qw_env *env = qw_env_create(&host, 1);
    assert_non_null(env);
    assert_int_equal(qw_protect(env, take_too_much, env), QW_MEMORY);
    assert_int_equal(qw_protect(env, take_a_little, env), QW_OK);
    qw_env_destroy(env);
    assert_int_equal(a.top, 0);
    qw_arena_begin(&a, bytes, 16);
    assert_null(qw_env_create(&host, 1));
    free(bytes);
}

QW_TEST_SUITE(arena)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(blocks_keep_apart), cmocka_unit_test(holds_an_environment)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

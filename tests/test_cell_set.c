/* Sets of cells as bits: floods and openings against those that look at one cell after another, on rows that end within
 * words, at their ends and beyond them. */
#include "random.h"
#include "suite.h"
#include "products/wrap/cell_set.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 140 * 12 * 9 };

typedef struct trial {
    qw_env *env;
    uint32_t across[3];
    uint8_t cell[MOST]; /* 1: in the set; x runs fastest */
    qw_cell_set set;
} trial;

static uint32_t count_of(const trial *t) { return t->across[0] * t->across[1] * t->across[2]; }

static void place(const trial *t, uint32_t c, uint32_t at[3])
{
    at[0] = c % t->across[0], at[1] = c / t->across[0] % t->across[1], at[2] = c / t->across[0] / t->across[1];
}

static uint32_t index_of(const trial *t, int x, int y, int z)
{
    if (x < 0 || y < 0 || z < 0 || x >= (int)t->across[0] || y >= (int)t->across[1] || z >= (int)t->across[2])
        return QW_NONE;
    return ((uint32_t)z * t->across[1] + (uint32_t)y) * t->across[0] + (uint32_t)x;
}

/* So many of a thousand cells; the rim always. */
static void make(trial *t, uint64_t seed, uint32_t share)
{
    uint64_t state = seed;
    t->set = qw_cell_set_new(t->env, t->across);
    for (uint32_t c = 0; c < count_of(t); c++) {
        uint32_t at[3];
        place(t, c, at);
        bool rim = false;
        for (int k = 0; k < 3; k++) rim |= at[k] == 0 || at[k] + 1 == t->across[k];
        t->cell[c] = rim || (random_step(&state) >> 33) % 1000 < share;
        if (t->cell[c]) qw_cell_set_add(&t->set, at[0], at[1], at[2]);
    }
}

static void check_same(const trial *t, const qw_cell_set *set, uint8_t value)
{
    for (uint32_t c = 0; c < count_of(t); c++) {
        uint32_t at[3];
        place(t, c, at);
        assert_int_equal(qw_cell_set_has(set, at[0], at[1], at[2]), t->cell[c] == value);
    }
}

static void check_others(trial *t)
{
    qw_cell_set others = qw_cell_set_others(t->env, &t->set);
    check_same(t, &others, 0);
    for (uint32_t z = 0; z < t->across[2]; z++) /* nothing beyond the rows */
        for (uint32_t y = 0; y < t->across[1]; y++)
            for (uint32_t x = t->across[0]; x < 64 * others.words; x++) assert_false(qw_cell_set_has(&others, x, y, z));
}

/* Turns what is joined to cell c from 1 to 2; the low and the high corner of it. */
static void flood(trial *t, uint32_t c, uint32_t low[3], uint32_t high[3])
{
    static const int step[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
    uint32_t *stack = malloc(MOST * sizeof *stack), count = 0, at[3];
    assert_non_null(stack);
    place(t, c, low), place(t, c, high);
    t->cell[c] = 2, stack[count++] = c;
    while (count > 0) {
        place(t, stack[--count], at);
        for (int k = 0; k < 3; k++) {
            if (at[k] < low[k]) low[k] = at[k];
            if (at[k] > high[k]) high[k] = at[k];
        }
        for (int i = 0; i < 6; i++) {
            uint32_t n = index_of(t, (int)at[0] + step[i][0], (int)at[1] + step[i][1], (int)at[2] + step[i][2]);
            if (n != QW_NONE && t->cell[n] == 1) t->cell[n] = 2, stack[count++] = n;
        }
    }
    free(stack);
}

static void check_flood(trial *t, uint32_t c)
{
    uint32_t at[3], low[3], high[3], extent[3];
    qw_flood f = qw_flood_begin(t->env, &t->set);
    qw_cell_set to = qw_cell_set_new(t->env, t->across);
    place(t, c, at);
    qw_flood_from(&f, &t->set, at, &to, extent);
    flood(t, c, low, high);
    check_same(t, &t->set, 1), check_same(t, &to, 2);
    for (int k = 0; k < 3; k++) assert_int_equal(extent[k], high[k] - low[k] + 1);
    for (uint32_t i = 0; i < count_of(t); i++) t->cell[i] = t->cell[i] == 1;
    qw_flood_end(&f);
}

/* Whether the ball about a place lies in the set. */
static bool is_middle(const trial *t, int x, int y, int z)
{
    for (int i = 0; i < 27; i++) {
        int d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
        uint32_t c = index_of(t, x + d[0], y + d[1], z + d[2]);
        if (d[0] * d[1] * d[2] == 0 && (c == QW_NONE || !t->cell[c])) return false;
    }
    return true;
}

static void check_opening(trial *t)
{
    uint8_t *kept = calloc(MOST, 1);
    bool lost = false;
    assert_non_null(kept);
    for (uint32_t c = 0; c < count_of(t); c++) {
        uint32_t at[3];
        place(t, c, at);
        for (int k = 0; k < 3; k++) kept[c] |= at[k] == 0 || at[k] + 1 == t->across[k];
        if (!is_middle(t, (int)at[0], (int)at[1], (int)at[2])) continue;
        for (int i = 0; i < 27; i++) {
            int d[3] = {i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1};
            if (d[0] * d[1] * d[2] == 0) kept[index_of(t, (int)at[0] + d[0], (int)at[1] + d[1], (int)at[2] + d[2])] = 1;
        }
    }
    for (uint32_t c = 0; c < count_of(t); c++) lost |= t->cell[c] && !kept[c], t->cell[c] &= kept[c];
    assert_int_equal(qw_cell_set_open(t->env, &t->set), lost);
    check_same(t, &t->set, 1);
    free(kept);
}

static void body(void *user)
{
    trial *t = user;
    static const uint32_t across[][3] = {{9, 9, 9}, {63, 9, 8}, {64, 10, 7}, {65, 8, 9}, {128, 7, 6}, {131, 12, 9}};
    for (size_t i = 0; i < sizeof across / sizeof *across; i++)
        for (uint64_t seed = 1; seed <= 3; seed++) {
            memcpy(t->across, across[i], sizeof t->across);
            make(t, seed, 320), check_others(t); /* as many as just hang together, and as many as hold some balls */
            check_flood(t, 0);
            for (uint32_t c = 0; c < count_of(t); c += 97)
                if (t->cell[c] == 1) check_flood(t, c);
            make(t, seed + 10, 940), check_opening(t);
            check_opening(t);
        }
}

static void test_cells(void **unused)
{
    (void)unused;
    for (uint32_t threads = 1; threads <= 3; threads += 2) {
        static trial t;
        t.env = qw_env_create(NULL, threads);
        if (qw_protect(t.env, body, &t) != QW_OK) fail_msg("%s", qw_env_message(t.env));
        qw_env_destroy(t.env);
    }
}

QW_TEST_SUITE(cell_set)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_cells)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

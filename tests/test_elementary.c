/* The elementary functions against the C library's in long double, in units of the last place, over every range that is
 * in use, and their special values. */
#include "random.h"
#include "suite.h"

#include "base/elementary.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdbool.h>
#include <string.h>

#include <cmocka.h>

enum { SAMPLES = 200000 };

/* Uniform in 0 to 1. */
static double next(uint64_t *state)
{
    random_step(state);
    return (double)(*state >> 11) * 0x1p-53;
}

/* Error of `got` in units of the last place of the double nearest to `want`. */
static double error_of(double got, long double want)
{
    int exponent;
    frexp((double)want, &exponent);
    if (exponent < -1021) exponent = -1021;
    return (double)(fabsl((long double)got - want) / ldexpl(1, exponent - 53));
}

typedef struct range {
    const char *name;
    double (*ours)(double);
    long double (*theirs)(long double);
    double least, most, bound; /* bound: on the error, in units of the last place */
} range;

static const range ranges[] = {
    {"sin", qw_sin, sinl, -8, 8, 1},           {"sin far", qw_sin, sinl, -1000, 1000, 1},
    {"cos", qw_cos, cosl, -8, 8, 1},           {"cos far", qw_cos, cosl, -1000, 1000, 1},
    {"acos", qw_acos, acosl, -1, 1, 4},        {"acos near 1", qw_acos, acosl, 0.999, 1, 4},
    {"ln", qw_ln, logl, 1e-12, 10, 1},         {"ln near 1", qw_ln, logl, 0.9, 1.1, 1},
    {"ln far", qw_ln, logl, 1e-300, 1e300, 1}, {"exp", qw_exp, expl, -40, 40, 1},
    {"exp far", qw_exp, expl, -700, 700, 1},
};

static void is_within_its_bound(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
        const range *r = &ranges[i];
        uint64_t seed = i + 1;
        double worst = 0, at = 0;
        for (int k = 0; k <= SAMPLES; k++) {
            double x = r->least + (r->most - r->least) * (k < SAMPLES ? next(&seed) : 1);
            double e = error_of(r->ours(x), r->theirs((long double)x));
            if (!(e <= worst)) worst = e, at = x;
        }
        if (!(worst <= r->bound)) fail_msg("%s(%.17g) is off by %g units", r->name, at, worst);
    }
}

static void powers_are_within_their_bound(void **state)
{
    (void)state;
    uint64_t seed = 7;
    for (int k = 0; k < SAMPLES; k++) {
        double base = 1e-3 + 1e3 * next(&seed) * next(&seed), exponent = 8 * next(&seed) - 4;
        long double want = powl((long double)base, (long double)exponent);
        double e = error_of(qw_pow(base, exponent), want);
        if (!(e <= 2 * (1 + fabs(exponent * log(base))))) fail_msg("pow(%.17g, %.17g) is off by %g", base, exponent, e);
    }
    assert_true(qw_pow(0, 2) == 0 && qw_pow(2, 0) == 1 && qw_pow(1, 1e300) == 1 && isnan(qw_pow(-1, 0.5)));
}

static void angles_of_all_quadrants(void **state)
{
    (void)state;
    uint64_t seed = 3;
    for (int k = 0; k < SAMPLES; k++) {
        double y = ldexp(2 * next(&seed) - 1, k % 40 - 20), x = 2 * next(&seed) - 1;
        double e = error_of(qw_atan2(y, x), atan2l((long double)y, (long double)x));
        if (!(e <= 3)) fail_msg("atan2(%.17g, %.17g) is off by %g", y, x, e);
    }
}

static bool same_bits(double a, double b) { return memcmp(&a, &b, sizeof a) == 0 || (isnan(a) && isnan(b)); }

static void special_values(void **state)
{
    (void)state;
    static const double values[] = {0.0, -0.0, 1, -1, INFINITY, -INFINITY, NAN, 0x1p-1074, -0x1p-1074, 1e308};
    enum { VALUES = sizeof values / sizeof *values };
    for (int i = 0; i < VALUES; i++) {
        double x = values[i];
        for (int k = 0; k < VALUES; k++) {
            double y = values[k], ours = qw_atan2(y, x), theirs = atan2(y, x);
            if (!same_bits(ours, theirs) && error_of(ours, (long double)theirs) > 2)
                fail_msg("atan2(%g, %g) is %.17g, not %.17g", y, x, ours, theirs);
        }
        if (isinf(x)) assert_true(isnan(qw_sin(x)) && isnan(qw_cos(x)));
    }
    assert_true(same_bits(qw_sin(-0.0), -0.0) && qw_cos(0) == 1 && qw_acos(1) == 0 && isnan(qw_acos(1.5)));
    assert_true(qw_ln(1) == 0 && isinf(qw_ln(0)) && isnan(qw_ln(-1)) && qw_ln(INFINITY) == INFINITY);
    assert_true(qw_exp(0) == 1 && qw_exp(-1000) == 0 && isinf(qw_exp(1000)));
}

/* Bit for bit: these are exact in the C library too. */
static void whole_numbers_and_remainders(void **state)
{
    (void)state;
    static const double halves[] = {0.5, 1.5,  2.5,    -0.5,       -1.5,          -2.5,
                                    0.0, -0.0, 0x1p52, 0x1p53 + 2, -0x1p52 + 0.5, 1e300};
    for (size_t i = 0; i < sizeof halves / sizeof *halves; i++) {
        double x = halves[i];
        assert_true(same_bits(qw_round_even(x), rint(x)) && same_bits(qw_round_away(x), round(x)));
        assert_true(qw_floor(x) == floor(x) && qw_ceil(x) == ceil(x));
    }
    uint64_t seed = 11;
    for (int k = 0; k < SAMPLES; k++) {
        double x = ldexp(2 * next(&seed) - 1, k % 80 - 10), y = 0.1 + next(&seed);
        assert_true(same_bits(qw_round_even(x), rint(x)) && same_bits(qw_round_away(x), round(x)));
        assert_true(qw_floor(x) == floor(x) && qw_ceil(x) == ceil(x));
        if (!(qw_remainder(x, y) == remainder(x, y))) fail_msg("remainder(%.17g, %.17g)", x, y);
    }
}

QW_TEST_SUITE(elementary)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_within_its_bound),          cmocka_unit_test(powers_are_within_their_bound),
        cmocka_unit_test(angles_of_all_quadrants),      cmocka_unit_test(special_values),
        cmocka_unit_test(whole_numbers_and_remainders),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

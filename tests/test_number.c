/* Number reading against strtod, and printing against the reading of it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "random.h"
#include "suite.h"
#include "io/number.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t bits_of(double value)
{
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

static double from_bits(uint64_t bits)
{
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* A number that begins a text of its own, with the eight zeros that the reader asks for and not a byte more. Returns
 * the bytes read, 0: none. */
static size_t read_number(const char *text, double *value)
{
    size_t size = strlen(text);
    char *copy = calloc(size + 8, 1);
    assert_non_null(copy);
    memcpy(copy, text, size);
    const char *at = copy;
    bool found = qw_number_read(&at, value);
    size_t read = (size_t)(at - copy);
    free(copy);
    assert_true(found == (read > 0));
    return read;
}

static void check_reading(const char *text)
{
    double value = 0, wanted = strtod(text, NULL);
    size_t read = read_number(text, &value);
    if (text[read] || read == 0 || bits_of(value) != bits_of(wanted))
        fail_msg("%s was read as %.17g, not %.17g, up to \"%s\"", text, value, wanted, text + read);
}

static const char *const fixed_texts[] = {
    "0",
    "-0",
    "+0",
    "1",
    "-1",
    "0.1",
    ".5",
    "5.",
    "-.5e-3",
    "1e22",
    "1e23",
    "1E+5",
    "1e-22",
    "123456789012345678",
    "9007199254740993",
    "9007199254740992.5",
    "9007199254740993.00000000000000000000000000000000000000000000001",
    "1e308",
    "1.7976931348623157e308",
    "1.7976931348623159e308",
    "1e309",
    "-1e400",
    "4.9e-324",
    "2.4703282292062327e-324",
    "2.4703282292062328e-324",
    "2.2250738585072011e-308",
    "2.2250738585072014e-308",
    "1e-400",
    "0e999999999999",
    "1e-999999999999",
    "18446744073709551615",
    "18446744073709551616",
    "9999999999999999999",
    "99999999999999999999",
    "0.000000000000000000000000000000000000000001",
    "000000000000000000000000000000000001",
    "0.1000000000000000055511151231257827021181583404541015625",
    "0.1000000000000000055511151231257827021181583404541015624",
    "0.28764899999999999",
    "8.5899345920000000e9",
    "7.2057594037927933e16",
    "123456789.123456789e-27",
    "9223372036854775807e27",
    "9223372036854775809e-27",
    "1844674407370955161e27",
    "1234567",
    "12345678",
    "-1234567.7654321",
    "1234567.76543210",
    "12345678.7",
    "0.0000001",
    "00000001",
    "0000000.0000000",
    "-0.0",
    "9999999.9999999",
    "7.e3",
    "7.0E-3",
};

static void test_reads_fixed(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof fixed_texts / sizeof *fixed_texts; i++) check_reading(fixed_texts[i]);
}

static void test_reads_far_digits(void **state)
{
    (void)state;
    /* half way between 1 and its successor, and a digit a long way out that breaks the tie; and a huge number cut down
     * again */
    char text[2400];
    int size = snprintf(text, sizeof text, "1.00000000000000011102230246251565404236316680908203125");
    check_reading(text);
    memset(text + size, '0', 2000);
    text[size + 2000] = 0;
    check_reading(text);
    text[size + 1999] = '1';
    check_reading(text);
    assert_true(strtod(text, NULL) > 1);
    memset(text, '7', 2000);
    snprintf(text + 2000, 32, "e-1990");
    check_reading(text);
    text[0] = '0', text[1] = '.';
    memset(text + 2, '0', 1998);
    snprintf(text + 2000, 32, "123e2000");
    check_reading(text);
}

static void test_reads_random(void **state)
{
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 300000; i++) {
        char text[80];
        char *p = text;
        int digits = 1 + (int)(random_bits(&random) % 24), point = (int)(random_bits(&random) % 25);
        if (random_bits(&random) & 1) *p++ = '-';
        for (int k = 0; k < digits; k++) {
            if (k == point) *p++ = '.';
            *p++ = (char)('0' + random_bits(&random) % 10);
        }
        *p = 0;
        int range = i % 4 == 0 ? 340 : 30;
        if (random_bits(&random) & 1)
            snprintf(p, 16, "e%d", (int)(random_bits(&random) % (uint64_t)(2 * range)) - range);
        check_reading(text);
    }
}

/* Decimals of exactly half way between neighbours, where every wrong rounding shows. */
static void test_reads_midpoints(void **state)
{
    (void)state;
    uint64_t random = 2;
    for (int i = 0; i < 100000; i++) {
        uint64_t m = (random_bits(&random) >> 11 | (uint64_t)1 << 52) * 2 + 1; /* 54 bits */
        char text[64];
        int shift = (int)(random_bits(&random) % 11);
        snprintf(text, sizeof text, "%llu", (unsigned long long)(m << shift));
        check_reading(text);
        snprintf(text, sizeof text, "%llu.%s", (unsigned long long)(m >> 2),
                 (const char *[]){"25", "75", "24999", "7500001"}[i % 4]);
        check_reading(text);
    }
}

static void test_special_numbers(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double value;
        size_t size;
    } rows[] = {{"nan", (double)NAN, 3},
                {"-NaN", (double)NAN, 4},
                {"inf ", (double)INFINITY, 3},
                {"-Infinity", -(double)INFINITY, 9},
                {"1.#INF", (double)INFINITY, 6},
                {"-1.#IND00", (double)INFINITY, 9},
                {"1.#QNAN", (double)NAN, 7},
                {"1.#c", 1, 2},
                {"1e", 1, 1},
                {"1e+ ", 1, 1},
                {"12abc", 12, 2},
                {"1.5#", 1.5, 3},
                {"1,5", 1, 1},
                {"0x10", 0, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double value = 7;
        assert_int_equal(read_number(rows[i].text, &value), rows[i].size);
        if (isfinite(rows[i].value)) assert_true(value == rows[i].value);
        else assert_false(isfinite(value));
    }
    static const char *const none[] = {"", "-", "+", ".", "-.", "e5", ".e5", "abc", "in", "na", "--1", " 1"};
    for (size_t i = 0; i < sizeof none / sizeof *none; i++) {
        double value;
        assert_int_equal(read_number(none[i], &value), 0);
    }
}

/* Back to the same bits, and no longer than it need be. */
static void check_printing(double value)
{
    char text[QW_NUMBER_SIZE + 1], shortest[64];
    size_t size = qw_number_print(text, value);
    assert_true(size < QW_NUMBER_SIZE);
    text[size] = 0;
    check_reading(text);
    if (bits_of(strtod(text, NULL)) != bits_of(value)) fail_msg("%.17g was printed as %s", value, text);
    int digits = 0, precision = 1;
    for (; precision < 17; precision++) {
        snprintf(shortest, sizeof shortest, "%.*e", precision - 1, value);
        if (strtod(shortest, NULL) == value) break;
    }
    bool leading = true;
    int zeros = 0;
    for (const char *p = text; *p && *p != 'e'; p++) {
        if (*p < '0' || *p > '9') continue;
        leading &= *p == '0';
        if (leading) continue;
        zeros = *p == '0' ? zeros + 1 : 0;
        digits++;
    }
    int extra = (bits_of(value) << 12) == 0; /* a power of two */
    if (fabs(value) >= DBL_MIN && digits - zeros > precision + extra)
        fail_msg("%s has more digits than %s", text, shortest);
}

static void test_prints(void **state)
{
    (void)state;
    static const double fixed[] = {0.0,
                                   -0.0,
                                   1,
                                   -1,
                                   0.1,
                                   0.5,
                                   100,
                                   1e15,
                                   1e16,
                                   1e17,
                                   1e18,
                                   123456789012345680.0,
                                   1e22,
                                   1e23,
                                   1e-4,
                                   1e-5,
                                   1e-6,
                                   1e-7,
                                   DBL_MAX,
                                   -DBL_MAX,
                                   DBL_MIN,
                                   5e-324,
                                   9.5,
                                   99.95,
                                   0.999999999999999999,
                                   9999999999999998.0,
                                   9007199254740993.0,
                                   4503599627370496.5,
                                   1.0 / 3,
                                   2.0 / 3,
                                   1e-11,
                                   9.99999999999999999e-12,
                                   1e100,
                                   1e-100};
    for (size_t i = 0; i < sizeof fixed / sizeof *fixed; i++) check_printing(fixed[i]);
    for (int e = -1074; e < 1024; e++) {
        check_printing(ldexp(1, e));
        check_printing(nextafter(ldexp(1, e), 0));
    }
    uint64_t random = 3;
    for (int i = 0; i < 20000; i++) {
        double any = from_bits(random_bits(&random));
        if (isfinite(any)) check_printing(any);
        double usual = ldexp((double)(int64_t)random_bits(&random), (int)(random_bits(&random) % 60) - 90);
        check_printing(usual);
        check_printing((double)(float)usual);
        check_printing((double)(int64_t)(random_bits(&random) % 2000001 - 1000000) / 1000);
    }
}

static void test_printed_form(void **state)
{
    (void)state;
    static const struct {
        double value;
        const char *text;
    } rows[] = {{0, "0"},
                {-0.0, "-0"},
                {1, "1"},
                {-1.5, "-1.5"},
                {0.1, "0.1"},
                {100, "100"},
                {1e16, "10000000000000000"},
                {1e17, "1e17"},
                {0.001, "0.001"},
                {0.00001, "0.00001"},
                {0.000001, "1e-6"},
                {1.25e-9, "1.25e-9"},
                {1.0 / 3, "0.3333333333333333"},
                {123.456, "123.456"}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[QW_NUMBER_SIZE + 1];
        text[qw_number_print(text, rows[i].value)] = 0;
        assert_string_equal(text, rows[i].text);
    }
}

/* The host may have set a locale whose point is a comma; where none is installed this repeats the others. */
static void test_locale(void **state)
{
    static const char *const names[] = {"de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "ru_RU.UTF-8"};
    bool found = false;
    for (size_t i = 0; i < sizeof names / sizeof *names && !found; i++) found = setlocale(LC_NUMERIC, names[i]) != NULL;
    test_printed_form(state);
    char text[QW_NUMBER_SIZE + 1];
    text[qw_number_print(text, 1.2345678901234567e-300)] = 0;
    double value;
    assert_int_equal(read_number(text, &value), strlen(text));
    assert_true(value == 1.2345678901234567e-300);
    assert_null(strchr(text, ','));
    setlocale(LC_NUMERIC, "C");
}

QW_TEST_SUITE(number)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reads_fixed),     cmocka_unit_test(test_reads_far_digits),
        cmocka_unit_test(test_reads_random),    cmocka_unit_test(test_reads_midpoints),
        cmocka_unit_test(test_special_numbers), cmocka_unit_test(test_prints),
        cmocka_unit_test(test_printed_form),    cmocka_unit_test(test_locale),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

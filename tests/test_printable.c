/* What may be shown of a text of others, against the definition of UTF-8. */
#include "suite.h"

#include "base/printable.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

/* The bytes of a Unicode value, by the table of RFC 3629. */
static size_t encode(uint32_t value, char *to)
{
    size_t size = value < 0x80 ? 1 : value < 0x800 ? 2 : value < 0x10000 ? 3 : 4;
    static const unsigned char lead[5] = {0, 0, 0xc0, 0xe0, 0xf0};
    for (size_t i = size; i-- > 1; value >>= 6) to[i] = (char)(0x80 | (value & 0x3f));
    to[0] = (char)(lead[size] | value);
    to[size] = 0;
    return size;
}

static void every_character(void **state)
{
    (void)state;
    for (uint32_t value = 1; value < 0x120000; value++) {
        char text[8], shown[32];
        size_t size = encode(value, text);
        bool character = value < 0x110000 && !(value >= 0xd800 && value < 0xe000);
        bool control = value < 0x20 || (value >= 0x7f && value < 0xa0);
        if (qw_utf8_size(text) != (character ? size : 0)) fail_msg("U+%04X", value);
        if (qw_is_printable(text) != (character && !control)) fail_msg("U+%04X", value);
        qw_printable(shown, sizeof shown, text);
        if (character && !control) assert_string_equal(shown, text);
        else assert_true(qw_is_printable(shown) && strlen(shown) == 4 * size);
    }
}

static void no_characters(void **state)
{
    (void)state;
    static const char *const bad[] = {
        "\x80", "\xc0\x80", "\xc1\xbf",     "\xe0\x80\x80", "\xf0\x8f\xbf\xbf", "\xf5\x80\x80\x80", "\xff",
        "\xc3", "\xe2\x82", "\xf0\x9f\x98", "\342a"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(qw_utf8_size(bad[i]), 0);
        assert_false(qw_is_printable(bad[i]));
    }
}

static void cut_between_characters(void **state)
{
    (void)state;
    static const char text[] = "a\x1b\xe2\x82\xac\xff"
                               "b";
    static const char whole[] = "a\\x1b\xe2\x82\xac\\xff"
                                "b";
    for (size_t size = 1; size < 24; size++) {
        char shown[24];
        memset(shown, 'x', sizeof shown);
        size_t used = qw_printable(shown, size, text);
        assert_true(used < size && used == strlen(shown) && qw_is_printable(shown));
        assert_int_equal(strncmp(shown, whole, used), 0);
        if (size > strlen(whole)) assert_string_equal(shown, whole);
    }
}

QW_TEST_SUITE(printable)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_character),
        cmocka_unit_test(no_characters),
        cmocka_unit_test(cut_between_characters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Options: defaults hold, every bound is enforced and named, text goes in and comes back in any locale. */
#include "suite.h"
#include "quadwright/quadwright.h"

#include <float.h>
#include <locale.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static void defaults_are_valid(void **state)
{
    (void)state;
    qw_options options;
    memset(&options, 0xff, sizeof options);
    qw_options_init(&options);
    char message[256] = "unset";
    assert_int_equal(qw_options_validate(&options, message, sizeof message), QW_OK);
    assert_string_equal(message, "");
    assert_int_equal(qw_options_validate(&options, NULL, 0), QW_OK);
    assert_int_equal(options.size, sizeof options);
    assert_int_equal(options.sat, 1);
    assert_true(options.sharp_angle == -1.0);
}

static void table_is_sound(void **state)
{
    (void)state;
    assert_true(qw_option_count() >= 14);
    assert_null(qw_option_at(qw_option_count()));
    for (size_t i = 0; i < qw_option_count(); i++) {
        const qw_option_info *info = qw_option_at(i);
        assert_true(info->initial >= info->least && info->initial <= info->most);
        assert_true(strlen(info->help) > 10);
        assert_non_null(info->unit);
        assert_int_equal(info->choices != NULL, info->kind == QW_KIND_CHOICE);
        if (info->kind != QW_KIND_CHOICE) continue;
        int bars = 0;
        for (const char *c = info->choices; *c; c++) bars += *c == '|';
        assert_int_equal(bars, (int)info->most); /* the table's last index fits its list */
    }
}

static void text_comes_back(void **state)
{
    (void)state;
    qw_options a, b;
    qw_options_init(&a);
    a.faces = 12345;
    a.edge_length = 0.1 + 0.2;
    a.sharp_angle = 1.0 / 3.0;
    a.adaptive = 5e-324;
    a.align_boundary = 0;
    a.flow = 1;
    a.seed = 2147483647;
    qw_options_init(&b);
    for (size_t i = 0; i < qw_option_count(); i++) {
        char text[64], message[256];
        assert_int_equal(qw_option_get(&a, qw_option_at(i)->name, text, sizeof text), QW_OK);
        assert_int_equal(qw_option_set(&b, qw_option_at(i)->name, text, message, sizeof message), QW_OK);
        assert_string_equal(message, "");
    }
    assert_int_equal(b.faces, a.faces);
    assert_true(b.edge_length == a.edge_length && b.sharp_angle == a.sharp_angle && b.adaptive == a.adaptive);
    assert_int_equal(b.align_boundary, 0);
    assert_int_equal(b.flow, 1);
    assert_int_equal(b.seed, 2147483647);
    char tiny[3];
    assert_int_equal(qw_option_get(&a, "faces", tiny, sizeof tiny), QW_OPTION);
    assert_string_equal(tiny, "");
}

static void dashes_are_underscores(void **state)
{
    (void)state;
    qw_options options;
    qw_options_init(&options);
    assert_int_equal(qw_option_set(&options, "edge-length", "0.25", NULL, 0), QW_OK);
    assert_true(options.edge_length == 0.25);
    assert_int_equal(qw_option_set(&options, "edge_length", "+.5", NULL, 0), QW_OK);
    assert_true(options.edge_length == 0.5);
    assert_int_equal(qw_option_set(&options, "align-boundary", "no", NULL, 0), QW_OK);
    assert_int_equal(options.align_boundary, 0);
    assert_int_equal(qw_option_set(&options, "flow", "ilp", NULL, 0), QW_OK);
    assert_int_equal(options.flow, 4);
}

static void refused(const char *name, const char *value, const char *must_say)
{
    qw_options options, before;
    memset(&options, 0, sizeof options);
    qw_options_init(&options);
    before = options;
    char message[256];
    assert_int_equal(qw_option_set(&options, name, value, message, sizeof message), QW_OPTION);
    assert_non_null(strstr(message, must_say));
    assert_non_null(strstr(message, name));
    assert_memory_equal(&options, &before, sizeof options);
}

static void wrong_text_is_refused(void **state)
{
    (void)state;
    static const char *const counts[] = {
        "", "x", "-1", "1e30", "12.5", "50%", "20000001", "99999999999999999999999", " 5", "5 ", "0x10", "-", "nan"};
    for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
        refused("faces", counts[i], "from 0 to 20000000 faces");
    static const char *const reals[] = {"",   "x",   "-2", "181", "inf",    "nan",  "0x1p3",
                                        "1e", "1e+", ".",  "1,5", "1.5deg", "1e999"};
    for (size_t i = 0; i < sizeof reals / sizeof reals[0]; i++)
        refused("sharp_angle", reals[i], "from -1 to 180 degrees");
    refused("sat", "maybe", "\"on\" or \"off\"");
    refused("flow", "mc", "mf|mf-mr|mcf|mcf-mr|ilp|closed");
    refused("flow", "", "mf|");
    refused("flow", "mf|mf-mr", "mf|");
}

/* What is no number, or none that is finite, and what is beyond the bounds, for each option that takes a number. */
static void every_number_refuses_nan_and_infinity(void **state)
{
    (void)state;
    static const char *const texts[] = {"nan",      "NaN",   "-nan",   "nan(1)", "inf", "-inf",
                                        "Infinity", "1e999", "-1e999", "0x1",    "",    "1 "};
    int reals = 0;
    for (size_t i = 0; i < qw_option_count(); i++) {
        const qw_option_info *info = qw_option_at(i);
        if (info->kind != QW_KIND_REAL && info->kind != QW_KIND_COUNT) continue;
        reals += info->kind == QW_KIND_REAL;
        for (size_t k = 0; k < sizeof texts / sizeof texts[0]; k++) refused(info->name, texts[k], "number from");
    }
    assert_true(reals >= 10);
}

static void unknown_names_get_advice(void **state)
{
    (void)state;
    refused("face", "5", "did you mean \"faces\"");
    refused("edge-lenght", "5", "did you mean \"edge_length\"");
    refused("facse", "5", "did you mean \"faces\"");
    refused("treads", "5", "did you mean \"threads\"");
    char message[256];
    qw_options options;
    qw_options_init(&options);
    assert_int_equal(qw_option_set(&options, "zzzzzzzzzzzz", "1", message, sizeof message), QW_OPTION);
    assert_null(strstr(message, "did you mean"));
    assert_int_equal(qw_option_set(&options, "a-name-that-is-much-longer-than-any-option-ever-will-be", "1", message,
                                   sizeof message),
                     QW_OPTION);
    assert_int_equal(qw_option_set(NULL, "faces", "1", message, sizeof message), QW_OPTION);
}

/* Each field is pushed past each of its bounds through the struct, as a binding would. */
static void every_bound_is_named(void **state)
{
    (void)state;
    char message[256];
    qw_options o;
#define EXPECT_REFUSAL(name)                                                       \
    assert_int_equal(qw_options_validate(&o, message, sizeof message), QW_OPTION); \
    assert_non_null(strstr(message, #name));
#define PUSH(name, value) \
    qw_options_init(&o);  \
    o.name = (value);     \
    EXPECT_REFUSAL(name)
#define QW_OPTION_COUNT(name, stage, initial, least, most, unit, help) \
    PUSH(name, least - 1) PUSH(name, (int64_t)most + 1)
#define QW_OPTION_REAL(name, stage, initial, least, most, unit, help) \
    PUSH(name, fmin(least - 0.5, nextafter(least, -INFINITY)))        \
    PUSH(name, nextafter(most, INFINITY)) PUSH(name, NAN) PUSH(name, INFINITY) PUSH(name, -INFINITY)
#define QW_OPTION_FLAG(name, stage, initial, help)               PUSH(name, -1) PUSH(name, 2)
#define QW_OPTION_CHOICE(name, stage, initial, last, list, help) PUSH(name, -1) PUSH(name, last + 1)
#include "quadwright/options.def"
    qw_options_init(&o);
    o.size--;
    EXPECT_REFUSAL(size)
    assert_int_equal(qw_options_validate(NULL, message, sizeof message), QW_OPTION);
    qw_options_init(&o);
    o.faces = 100;
    o.ratio = 0.5;
    EXPECT_REFUSAL(ratio)
}

/* A locale whose decimal point is a comma must change nothing. Skipped where none is installed. */
static void locale_does_not_matter(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "de_DE",
                                        "fr_FR.UTF-8", "fr_FR.utf8", "es_ES.UTF-8"};
    bool found = false;
    for (size_t i = 0; i < sizeof names / sizeof names[0] && !found; i++) found = setlocale(LC_ALL, names[i]) != NULL;
    if (!found) skip();
    defaults_are_valid(state);
    text_comes_back(state);
    dashes_are_underscores(state);
    wrong_text_is_refused(state);
    setlocale(LC_ALL, "C");
}

/* Every preset is valid and sets something, and nothing that says how many quads. */
static void presets_are_sound(void **state)
{
    (void)state;
    char message[256], initial[4096], now[4096]; /* as JSON, as structures have bytes between their fields */
    qw_options o;
    qw_options_init(&o);
    assert_in_range(qw_options_json(&o, initial, sizeof initial), 1, sizeof initial - 1);
    assert_true(qw_preset_count() >= 5);
    assert_null(qw_preset_at(qw_preset_count()));
    for (size_t i = 0; i < qw_preset_count(); i++) {
        qw_options_init(&o);
        assert_int_equal(qw_options_preset(&o, qw_preset_at(i)->name, message, sizeof message), QW_OK);
        assert_int_equal(qw_options_validate(&o, message, sizeof message), QW_OK);
        qw_options_json(&o, now, sizeof now);
        assert_string_not_equal(now, initial);
        assert_true(o.faces == 0 && o.vertices == 0 && o.edge_length == 0 && o.ratio == 0);
    }
    qw_options_init(&o);
    assert_int_equal(qw_options_preset(&o, "SCAN", message, sizeof message), QW_OPTION);
    assert_non_null(strstr(message, "there is no preset \"SCAN\"; there are scan, "));
    assert_non_null(strstr(message, "; did you mean \"scan\"?"));
    assert_int_equal(qw_options_preset(&o, "elephant", message, sizeof message), QW_OPTION);
    assert_null(strstr(message, "did you mean"));
    qw_options_json(&o, now, sizeof now);
    assert_string_equal(now, initial);
    assert_int_equal(qw_options_preset(&o, NULL, message, 20), QW_OPTION);
    assert_int_equal(qw_options_preset(NULL, "scan", NULL, 0), QW_OPTION);
}

static void memory_sizes(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint64_t bytes;
    } good[] = {{"0", 0}, {"300", 300}, {"1k", 1024}, {"512M", 512 << 20}, {"1.5G", 3ull << 29}, {"4GB", 4ull << 30}};
    static const char *const bad[] = {"",    "M",    "4X",           "4 G", "-1M",   "1e3",
                                      "4GG", "4Gb2", "99999999999T", "nan", "1.2.3M"};
    char message[128];
    uint64_t bytes = 7;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        assert_int_equal(qw_memory_size(good[i].text, &bytes, message, sizeof message), QW_OK);
        assert_true(bytes == good[i].bytes);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(qw_memory_size(bad[i], &bytes, message, sizeof message), QW_ARGUMENT);
    assert_int_equal(qw_memory_size(NULL, &bytes, NULL, 0), QW_ARGUMENT);
}

/* A plane in one word sets five options, or none. */
static void planes(void **state)
{
    (void)state;
    char message[128], value[64];
    qw_options o;
    qw_options_init(&o);
    assert_int_equal(qw_option_set(&o, "symmetry", "0,2,0,-0.5", message, sizeof message), QW_OK);
    assert_true(o.symmetry_x == 0 && o.symmetry_y == 2 && o.symmetry_z == 0 && o.symmetry_offset == -0.5);
    qw_option_get(&o, "symmetry", value, sizeof value);
    assert_string_equal(value, "plane");
    assert_int_equal(qw_option_set(&o, "symmetry", "1,0,0,x", message, sizeof message), QW_OPTION);
    assert_int_equal(qw_option_set(&o, "symmetry", "0,0,0,1", message, sizeof message), QW_OPTION);
    assert_true(o.symmetry_x == 0 && o.symmetry_y == 2 && o.symmetry_offset == -0.5);
}

static void wraps(void **state)
{
    (void)state;
    static const char *const wrong[] = {"", "q", "0.6", "0.01q", "101q", "0.5 q", "1e", "maybe", "0.5qq", "-1q"};
    char message[160], value[64];
    qw_options o;
    qw_options_init(&o);
    assert_int_equal(qw_option_set(&o, "wrap", "0.02", message, sizeof message), QW_OK);
    assert_true(o.wrap == 1 && o.wrap_distance == 0.02 && o.wrap_quads == 1);
    assert_int_equal(qw_option_set(&o, "wrap", "0.5q", message, sizeof message), QW_OK);
    assert_true(o.wrap == 1 && o.wrap_distance == 0 && o.wrap_quads == 0.5);
    assert_int_equal(qw_option_get(&o, "wrap", value, sizeof value), QW_OK);
    assert_string_equal(value, "on");
    assert_int_equal(qw_option_set(&o, "wrap", "off", message, sizeof message), QW_OK);
    assert_true(o.wrap == 0 && o.wrap_quads == 0.5);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
        assert_int_equal(qw_option_set(&o, "wrap", wrong[i], message, sizeof message), QW_OPTION);
    assert_true(o.wrap == 0 && o.wrap_distance == 0 && o.wrap_quads == 0.5);
}

static void status_tables(void **state)
{
    (void)state;
    for (int s = 0; s < QW_STATUS_COUNT; s++) {
        assert_true(strlen(qw_status_name((qw_status)s)) > 1);
        assert_true(strlen(qw_status_text((qw_status)s)) > 3);
        for (int t = 0; t < s; t++)
            assert_int_not_equal(qw_status_exit_code((qw_status)s), qw_status_exit_code((qw_status)t));
    }
    assert_string_equal(qw_status_name((qw_status)-1), "INTERNAL");
    assert_string_equal(qw_status_name((qw_status)1000), "INTERNAL");
    assert_string_equal(qw_stage_title((qw_stage)-1), "?");
    char version[32];
    snprintf(version, sizeof version, "%d.%d.%d", QW_VERSION_MAJOR, QW_VERSION_MINOR, QW_VERSION_PATCH);
    assert_string_equal(qw_version(), version);
}

QW_TEST_SUITE(options)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_valid),
        cmocka_unit_test(table_is_sound),
        cmocka_unit_test(text_comes_back),
        cmocka_unit_test(dashes_are_underscores),
        cmocka_unit_test(wrong_text_is_refused),
        cmocka_unit_test(unknown_names_get_advice),
        cmocka_unit_test(every_bound_is_named),
        cmocka_unit_test(locale_does_not_matter),
        cmocka_unit_test(presets_are_sound),
        cmocka_unit_test(memory_sizes),
        cmocka_unit_test(planes),
        cmocka_unit_test(wraps),
        cmocka_unit_test(status_tables),
        cmocka_unit_test(every_number_refuses_nan_and_infinity),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

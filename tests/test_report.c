/* The table of figures: every member of the structs is in it, with its place, and in the JSON, whatever the buffer and
 * the locale. */
#include "suite.h"
#include "base/report.h"

#include <locale.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The fields lie one after another: between the first and the last of the struct is no member that the table lacks. */
static void fields_fill_the_structs(void **state)
{
    (void)state;
    static const size_t ends[] = {[QW_RECORD_REPORT] = offsetof(qw_report, topology),
                                  [QW_RECORD_TOPOLOGY] = offsetof(qw_topology, valence),
                                  [QW_RECORD_QUALITY] = sizeof(qw_quality),
                                  [QW_RECORD_ASSET] = sizeof(qw_asset_report)};
    for (int record = QW_RECORD_REPORT; record <= QW_RECORD_ASSET; record++) {
        size_t at = record == QW_RECORD_REPORT || record == QW_RECORD_ASSET ? 8 : 0;
        const qw_field_info *info;
        for (size_t i = 0; (info = qw_field_at((qw_record)record, i)); i++, at += 8) {
            assert_int_equal(info->offset, at);
            assert_true(info->name[0] && info->unit[0] && info->help[0]);
        }
        assert_int_equal(at, ends[record]);
    }
    assert_null(qw_field_at((qw_record)4, 0));
    assert_null(qw_field_at((qw_record)-1, 0));
}

static void kinds_are_those_of_the_members(void **state)
{
    (void)state;
    static qw_quality quality;
    quality.follow = 12.5, quality.chords = 7, quality.min_scaled_jacobian = -0.5;
    int seen = 0;
    const qw_field_info *info;
    for (size_t i = 0; (info = qw_field_at(QW_RECORD_QUALITY, i)); i++) {
        const char *at = (const char *)&quality + info->offset;
        if (strcmp(info->name, "follow") == 0) seen += info->kind == QW_FIELD_REAL && *(const double *)at == 12.5;
        if (strcmp(info->name, "chords") == 0) seen += info->kind == QW_FIELD_WHOLE && *(const int64_t *)at == 7;
        if (strcmp(info->name, "min_scaled_jacobian") == 0) seen += !info->optional;
    }
    assert_int_equal(seen, 3);
}

static void has_names(const char *json, qw_record record)
{
    const qw_field_info *info;
    for (size_t i = 0; (info = qw_field_at(record, i)); i++) {
        char quoted[80];
        snprintf(quoted, sizeof quoted, "\"%s\": ", info->name);
        if (!strstr(json, quoted)) print_error("%s is missing\n", quoted);
        assert_non_null(strstr(json, quoted));
    }
}

static qw_report a_report(void)
{
    return (qw_report){
        .size = sizeof(qw_report), .sharp_angle = 32.5, .warning_count = 1, .warnings = {"a \"quoted\" word\n"}};
}

static void json_is_whole(void **state)
{
    (void)state;
    qw_report report = a_report();
    static char text[32768];
    size_t length = qw_report_json(&report, text, sizeof text);
    assert_int_equal(length, strlen(text));
    has_names(text, QW_RECORD_REPORT);
    has_names(text, QW_RECORD_TOPOLOGY);
    assert_non_null(strstr(text, "a \\\"quoted\\\" word\\u000a"));
    assert_non_null(strstr(text, "\"peak_bytes\": 0"));
    assert_non_null(strstr(text, "\"sharp_angle\": 32.5"));
    qw_topology topology = {.vertices = 3, .valence = {[4] = 5}};
    qw_quality quality = {.follow = -1, .patches = -1, .min_scaled_jacobian = -0.25};
    assert_true(qw_measures_json(&topology, &quality, text, sizeof text) < sizeof text);
    has_names(text, QW_RECORD_TOPOLOGY);
    has_names(text, QW_RECORD_QUALITY);
    assert_non_null(strstr(text, "\"follow\": null"));
    assert_non_null(strstr(text, "\"patches\": null"));
    assert_non_null(strstr(text, "\"min_scaled_jacobian\": -0.25"));
}

/* A text cut at any length is the beginning of the whole, ended, and nothing beyond the buffer is touched. */
static void short_buffers_are_kept(void **state)
{
    (void)state;
    qw_report report = a_report();
    size_t length = qw_report_json(&report, NULL, 0);
    char *whole = malloc(length + 1), *part = malloc(length + 2);
    assert_int_equal(qw_report_json(&report, whole, length + 1), length);
    assert_int_equal(strlen(whole), length);
    for (size_t size = 1; size <= length + 1; size += 1 + size / 16) {
        memset(part, 'x', length + 2);
        assert_int_equal(qw_report_json(&report, part, size), length);
        assert_memory_equal(part, whole, size - 1);
        assert_int_equal(part[size - 1], 0);
        assert_int_equal(part[size], 'x');
    }
    free(whole), free(part);
}

static void wrong_arguments_write_nothing(void **state)
{
    (void)state;
    char text[8] = "before";
    qw_report report = {.size = 8};
    qw_options options;
    qw_run_info run = {.size = sizeof run, .report = &report};
    qw_options_init(&options);
    assert_int_equal(qw_options_size(), sizeof options);
    options.size--;
    assert_int_equal(qw_report_json(&report, text, sizeof text), 0);
    assert_int_equal(qw_report_json(NULL, NULL, 0), 0);
    assert_int_equal(qw_options_json(&options, NULL, 0), 0);
    assert_int_equal(qw_options_json(NULL, NULL, 0), 0);
    assert_int_equal(qw_measures_json(NULL, NULL, NULL, 0), 0);
    assert_int_equal(qw_run_json(NULL, NULL, 0), 0);
    assert_int_equal(qw_run_json(&run, NULL, 0), 0);
    run = (qw_run_info){.size = sizeof run, .note_count = 1};
    assert_int_equal(qw_run_json(&run, NULL, 0), 0);
    run.note_count = 0;
    char small[512];
    size_t length = qw_run_json(&run, small, sizeof small);
    assert_int_equal(length, strlen(small));
    assert_non_null(strstr(small, "\"output\": null"));
    assert_non_null(strstr(small, "\"quality\": null"));
}

/* Where the machine has a locale with a decimal comma. */
static void locale_is_none_of_its_business(void **state)
{
    (void)state;
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8", "fr_FR.UTF-8", "de_DE"};
    const char *found = NULL;
    for (int i = 0; i < 4 && !found; i++) found = setlocale(LC_NUMERIC, names[i]);
    if (!found) skip();
    qw_report report = a_report();
    static char text[32768];
    qw_report_json(&report, text, sizeof text);
    setlocale(LC_NUMERIC, "C");
    assert_non_null(strstr(text, "\"sharp_angle\": 32.5"));
}

QW_TEST_SUITE(report)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fields_fill_the_structs),
        cmocka_unit_test(kinds_are_those_of_the_members),
        cmocka_unit_test(json_is_whole),
        cmocka_unit_test(short_buffers_are_kept),
        cmocka_unit_test(wrong_arguments_write_nothing),
        cmocka_unit_test(locale_is_none_of_its_business),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

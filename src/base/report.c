/* The figures of report.def: their table, and what is written of them. */
#include "base/report.h"

#include <assert.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

static const qw_field_info report_fields[] = {
#define QW_REPORT_WHOLE(name, stage, unit, help) {#name, QW_FIELD_WHOLE, 0, offsetof(qw_report, name), unit, help},
#define QW_REPORT_REAL(name, stage, unit, help)  {#name, QW_FIELD_REAL, 0, offsetof(qw_report, name), unit, help},
#include "quadwright/report.def"
};
static const qw_field_info topology_fields[] = {
#define QW_TOPOLOGY_WHOLE(name, unit, help) {#name, QW_FIELD_WHOLE, 0, offsetof(qw_topology, name), unit, help},
#include "quadwright/report.def"
};
static const qw_field_info quality_fields[] = {
#define QW_QUALITY_WHOLE(name, unit, help)  {#name, QW_FIELD_WHOLE, 1, offsetof(qw_quality, name), unit, help},
#define QW_QUALITY_REAL(name, unit, help)   {#name, QW_FIELD_REAL, 1, offsetof(qw_quality, name), unit, help},
#define QW_QUALITY_SIGNED(name, unit, help) {#name, QW_FIELD_REAL, 0, offsetof(qw_quality, name), unit, help},
#include "quadwright/report.def"
};

static const qw_field_info asset_fields[] = {
#define QW_MAPS_WHOLE(name, unit, help) {#name, QW_FIELD_WHOLE, 1, offsetof(qw_asset_report, name), unit, help},
#define QW_MAPS_REAL(name, unit, help)  {#name, QW_FIELD_REAL, 1, offsetof(qw_asset_report, name), unit, help},
#include "quadwright/report.def"
};

static const struct {
    const qw_field_info *fields;
    size_t count;
} records[] = {[QW_RECORD_REPORT] = {report_fields, sizeof report_fields / sizeof *report_fields},
               [QW_RECORD_TOPOLOGY] = {topology_fields, sizeof topology_fields / sizeof *topology_fields},
               [QW_RECORD_QUALITY] = {quality_fields, sizeof quality_fields / sizeof *quality_fields},
               [QW_RECORD_ASSET] = {asset_fields, sizeof asset_fields / sizeof *asset_fields}};

void qw_report_forget(qw_report *report, qw_stage first)
{
#define QW_REPORT_WHOLE(name, stage, unit, help) \
    if (QW_STAGE_##stage >= first) report->name = 0;
#define QW_REPORT_REAL(name, stage, unit, help) QW_REPORT_WHOLE(name, stage, unit, help)
#include "quadwright/report.def"
    if (QW_STAGE_REGULAR >= first) report->curve_count = 0, memset(report->curves, 0, sizeof report->curves);
    for (int s = (int)first; s < QW_STAGE_COUNT; s++) report->stages[s] = (qw_stage_report){0};
}

const qw_field_info *qw_field_at(qw_record record, size_t index)
{
    if ((unsigned)record >= sizeof records / sizeof *records) return NULL;
    return index < records[record].count ? &records[record].fields[index] : NULL;
}

static const char *const stage_names[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) #name,
#include "quadwright/stages.def"
};

/* ---- objects */

/* A field of a record as a number, or null where it is optional and below 0. */
static void put_field(qw_json *json, const qw_field_info *info, const void *values)
{
    const char *at = (const char *)values + info->offset;
    if (info->kind == QW_FIELD_WHOLE) {
        int64_t whole = *(const int64_t *)at;
        if (info->optional && whole < 0) qw_json_null(json, info->name);
        else qw_json_whole(json, info->name, whole);
    } else {
        double real = *(const double *)at;
        if (info->optional && real < 0) qw_json_null(json, info->name);
        else qw_json_real(json, info->name, real);
    }
}

static void put_fields(qw_json *json, qw_record record, qw_field_kind kind, int32_t optional, const void *values)
{
    const qw_field_info *info;
    for (size_t i = 0; (info = qw_field_at(record, i)); i++)
        if (info->kind == kind && info->optional == optional) put_field(json, info, values);
}

static void put_topology(qw_json *json, const qw_topology *topology)
{
    put_fields(json, QW_RECORD_TOPOLOGY, QW_FIELD_WHOLE, 0, topology);
    qw_json_begin(json, "valence", '{'); /* "9" is 9 and more */
    for (int v = 0; v < 10; v++) {
        char name[2] = {(char)('0' + v), 0};
        if (topology->valence[v]) qw_json_whole(json, name, topology->valence[v]);
    }
    qw_json_end(json, '}');
}

/* The time and the peak of memory of every stage, as an array. */
static void put_stages(qw_json *json, const qw_report *report)
{
    qw_json_begin(json, "stages", '[');
    for (int s = 0; s < QW_STAGE_COUNT; s++) {
        qw_json_begin(json, NULL, '{');
        qw_json_text(json, "stage", stage_names[s]);
        qw_json_text(json, "title", qw_stage_title((qw_stage)s));
        qw_json_real(json, "seconds", report->stages[s].seconds);
        qw_json_whole(json, "peak_bytes", (int64_t)report->stages[s].peak_bytes);
        qw_json_end(json, '}');
    }
    qw_json_end(json, ']');
}

/* What was decided on each feature curve, its length and a point of it, as an array. */
static void put_curves(qw_json *json, const qw_report *report)
{
    static const char *const axis[] = {"x", "y", "z"};
    qw_json_begin(json, "curves", '[');
    for (uint32_t i = 0; i < report->curve_count && i < sizeof report->curves / sizeof *report->curves; i++) {
        qw_json_begin(json, NULL, '{');
        qw_json_text(json, "verdict", report->curves[i].verdict);
        qw_json_real(json, "length", report->curves[i].length);
        for (int k = 0; k < 3; k++) qw_json_real(json, axis[k], report->curves[i].at[k]);
        qw_json_end(json, '}');
    }
    qw_json_end(json, ']');
}

void qw_json_report(qw_json *json, const char *name, const qw_report *report)
{
    assert(report->size == sizeof *report);
    qw_json_begin(json, name, '{');
    put_fields(json, QW_RECORD_REPORT, QW_FIELD_WHOLE, 0, report);
    put_fields(json, QW_RECORD_REPORT, QW_FIELD_REAL, 0, report);
    qw_json_whole(json, "peak_bytes", (int64_t)report->peak_bytes);
    qw_json_begin(json, "topology", '{');
    put_topology(json, &report->topology);
    qw_json_end(json, '}');
    put_stages(json, report);
    qw_json_begin(json, "warnings", '[');
    for (uint32_t w = 0; w < report->warning_count && w < 16; w++) qw_json_text(json, NULL, report->warnings[w]);
    qw_json_end(json, ']');
    qw_json_whole(json, "warning_count", report->warning_count);
    put_curves(json, report);
    qw_json_end(json, '}');
}

static void put_choice(qw_json *json, const qw_options *options, const char *name)
{
    char choice[64];
    qw_option_get(options, name, choice, sizeof choice);
    qw_json_text(json, name, choice);
}

void qw_json_options(qw_json *json, const char *name, const qw_options *options)
{
    qw_json_begin(json, name, '{');
#define QW_OPTION_COUNT(option, stage, initial, least, most, unit, help) qw_json_whole(json, #option, options->option);
#define QW_OPTION_REAL(option, stage, initial, least, most, unit, help)  qw_json_real(json, #option, options->option);
#define QW_OPTION_FLAG(option, stage, initial, help)                     qw_json_flag(json, #option, options->option != 0);
#define QW_OPTION_CHOICE(option, stage, initial, last, list, help)       put_choice(json, options, #option);
#include "quadwright/options.def"
    qw_json_end(json, '}');
}

static void put_quality(qw_json *json, const qw_quality *quality)
{
    put_fields(json, QW_RECORD_QUALITY, QW_FIELD_REAL, 1, quality);
    put_fields(json, QW_RECORD_QUALITY, QW_FIELD_WHOLE, 1, quality);
    put_fields(json, QW_RECORD_QUALITY, QW_FIELD_REAL, 0, quality);
}

void qw_json_quality(qw_json *json, const char *name, const qw_quality *quality)
{
    qw_json_begin(json, name, '{');
    put_quality(json, quality);
    qw_json_end(json, '}');
}

void qw_json_measures(qw_json *json, const qw_topology *topology, const qw_quality *quality)
{
    qw_json_begin(json, NULL, '{');
    put_topology(json, topology);
    put_quality(json, quality);
    qw_json_end(json, '}');
}

static void put_path(qw_json *json, const char *name, const char *path)
{
    if (path) qw_json_text(json, name, path);
    else qw_json_null(json, name);
}

void qw_json_transfer(qw_json *json, const qw_transfer_report *t)
{
    qw_json_begin(json, "attributes", '{');
    qw_json_whole(json, "charts", t->charts);
    qw_json_whole(json, "straddling_quads", t->straddling_quads);
    qw_json_whole(json, "filled_vertices", t->filled_vertices);
    qw_json_whole(json, "filled_corners", t->filled_corners);
    qw_json_whole(json, "filled_faces", t->filled_faces);
    qw_json_whole(json, "dropped_weights", t->dropped_weights);
    qw_json_end(json, '}');
}

void qw_json_asset(qw_json *json, const char *name, const qw_asset_report *report)
{
    assert(report->size == sizeof *report);
    qw_json_begin(json, name, '{');
    put_fields(json, QW_RECORD_ASSET, QW_FIELD_WHOLE, 1, report);
    put_fields(json, QW_RECORD_ASSET, QW_FIELD_REAL, 1, report);
    qw_json_end(json, '}');
}

void qw_json_run(qw_json *json, const qw_run_info *run)
{
    qw_json_begin(json, NULL, '{');
    qw_json_text(json, "program", "quadwright");
    qw_json_text(json, "version", qw_version());
    put_path(json, "input", run->input);
    put_path(json, "output", run->output);
    qw_json_begin(json, "input_notes", '[');
    for (uint32_t i = 0; i < run->note_count; i++) qw_json_text(json, NULL, run->notes[i]);
    qw_json_end(json, ']');
    if (run->options) qw_json_options(json, "options", run->options);
    else qw_json_null(json, "options");
    if (run->report) qw_json_report(json, "report", run->report);
    else qw_json_null(json, "report");
    if (run->transfer) qw_json_transfer(json, run->transfer);
    if (run->asset) qw_json_asset(json, "asset", run->asset);
    if (run->quality) qw_json_quality(json, "quality", run->quality);
    else qw_json_null(json, "quality");
    qw_json_end(json, '}');
}

/* ---- the public functions */

size_t qw_run_json(const qw_run_info *run, char *text, size_t size)
{
    qw_json json = qw_json_into(text, size);
    if (!run || run->size != sizeof *run || (run->note_count > 0 && !run->notes)) return 0;
    if (run->report && run->report->size != sizeof *run->report) return 0;
    qw_json_run(&json, run);
    return json.length;
}

size_t qw_options_json(const qw_options *options, char *text, size_t size)
{
    qw_json json = qw_json_into(text, size);
    if (!options || options->size != sizeof *options) return 0;
    qw_json_options(&json, NULL, options);
    return json.length;
}

size_t qw_report_json(const qw_report *report, char *text, size_t size)
{
    qw_json json = qw_json_into(text, size);
    if (!report || report->size != sizeof *report) return 0;
    qw_json_report(&json, NULL, report);
    return json.length;
}

size_t qw_asset_json(const qw_asset_report *report, char *text, size_t size)
{
    qw_json json = qw_json_into(text, size);
    if (!report || report->size != sizeof *report) return 0;
    qw_json_asset(&json, NULL, report);
    return json.length;
}

size_t qw_measures_json(const qw_topology *topology, const qw_quality *quality, char *text, size_t size)
{
    qw_json json = qw_json_into(text, size);
    if (!topology || !quality) return 0;
    qw_json_measures(&json, topology, quality);
    return json.length;
}

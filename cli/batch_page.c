/* What came of a batch: report.jsonl, a line a model in the order of names, and summary.html, with date, options,
 * totals, a legend, the failed, what was not done, histograms, the worst, and a table of all models with pictures. */
#define _XOPEN_SOURCE 700
#include "batch.h"
#include "commands.h"

#ifndef _WIN32

#include "products/render/render.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum { BINS = 24, WORST = 4, MOST_NAMED = 200 };

typedef struct measure {
    const char *title, *section, *name; /* section: member of the record that holds it; NULL: the record itself */
} measure;

static const measure measures[] = {
    {"distance to the surface, 99.9 % (mean edges)", "quality", "hausdorff_p999"},
    {"angles off 90 degrees, root mean square", "quality", "angle_rms"},
    {"areas, standard deviation over mean", "quality", "area_cv"},
    {"angle to the principal directions (degrees)", "quality", "follow"},
    {"share in rows that never cross themselves", "quality", "simple"},
    {"seconds", NULL, "wall_seconds"},
};
enum { MEASURES = sizeof measures / sizeof *measures, SIMPLE = MEASURES - 2, SECONDS = MEASURES - 1 };

/* Whole numbers, which have a column of the table and a total. */
static const measure numbers[] = {
    {"triangles", "report", "input_triangles"},
    {"quads", "topology", "faces"},
    {"irregular vertices", "topology", "irregular"},
    {"warnings", "report", "warning_count"},
};
enum { NUMBERS = sizeof numbers / sizeof *numbers, WARNINGS = NUMBERS - 1 };

typedef struct row {
    const batch_model *model;
    bool is_ok;
    char status[32];
    double number[NUMBERS], value[MEASURES]; /* negative: does not apply */
} row;

/* The number of that name in a record, behind the section's name where there is one; -1: none. */
static double figure(const char *record, const char *section, const char *name)
{
    char quoted[64];
    snprintf(quoted, sizeof quoted, "\"%s\": ", section ? section : name);
    const char *at = strstr(record, quoted);
    if (at && section) snprintf(quoted, sizeof quoted, "\"%s\": ", name), at = strstr(at, quoted);
    if (!at) return -1;
    at += strlen(quoted);
    char *end;
    double value = strtod(at, &end);
    return end == at || !isfinite(value) ? -1 : value;
}

static void put_escaped(FILE *file, const char *text)
{
    for (; *text; text++) {
        if (*text == '<') fputs("&lt;", file);
        else if (*text == '&') fputs("&amp;", file);
        else if (*text == '"') fputs("&quot;", file);
        else fputc(*text, file);
    }
}

/* A chart of how many models have how much of measure m, from 0 to the largest value. */
static void put_histogram(FILE *page, const row *rows, size_t count, int m)
{
    size_t bins[BINS] = {0}, most = 1;
    double top = 0;
    for (size_t i = 0; i < count; i++)
        if (rows[i].is_ok) top = fmax(top, rows[i].value[m]);
    for (size_t i = 0; i < count; i++) {
        if (!rows[i].is_ok || rows[i].value[m] < 0) continue;
        size_t bin = top > 0 ? (size_t)(rows[i].value[m] / top * BINS) : 0;
        bins[bin < BINS ? bin : BINS - 1]++;
    }
    for (int k = 0; k < BINS; k++) most = bins[k] > most ? bins[k] : most;
    fprintf(page, "<h2>%s</h2><svg width='480' height='140' role='img'>", measures[m].title);
    for (int k = 0; k < BINS; k++) {
        double height = 110.0 * (double)bins[k] / (double)most;
        fprintf(page, "<rect x='%d' y='%.1f' width='18' height='%.1f' fill='#4a7ab5'><title>%zu</title></rect>", 20 * k,
                115 - height, height, bins[k]);
    }
    fprintf(page, "<text x='0' y='132'>0</text><text x='480' y='132' text-anchor='end'>%.4g</text></svg>\n", top);
}

/* What the names of a shard's files have behind them: "-1-of-8", or "". */
static void shard_suffix(const qw_arguments *a, char suffix[64])
{
    suffix[0] = 0;
    if (a->shards) snprintf(suffix, 64, "-%lld-of-%lld", (long long)a->shard, (long long)a->shards);
}

/* The path as the address of a link: what may not stand in one is written as %20. */
static void put_address(FILE *page, const char *path)
{
    for (; *path; path++) {
        bool is_plain = (*path >= 'a' && *path <= 'z') || (*path >= 'A' && *path <= 'Z') ||
                        (*path >= '0' && *path <= '9') || strchr("/._-~", *path);
        fprintf(page, is_plain ? "%c" : "%%%02X", (unsigned char)*path);
    }
}

/* A link to a file of the output folder, beginning with its name there. */
static void begin_link(const qw_arguments *a, FILE *page, const char *path)
{
    fputs("<a href='", page);
    put_address(page, path + strlen(a->output) + 1);
    fputs("'>", page);
}

/* The model's name; a link to its input, where that is still there. */
static void put_name(FILE *page, const batch_model *m)
{
    char *path = realpath(m->input, NULL);
    if (path) fputs("<a href='", page), put_address(page, path), fputs("'>", page);
    put_escaped(page, m->name);
    if (path) fputs("</a>", page);
    free(path);
}

/* The picture, a link to the quads. */
static void put_picture(const qw_arguments *a, FILE *page, const batch_model *m, int width)
{
    char path[4200];
    batch_picture_path(a, m, path, sizeof path);
    if (!path[0] || access(path, R_OK) != 0) return;
    begin_link(a, page, m->output);
    fputs("<img loading='lazy' src='", page);
    put_address(page, path + strlen(a->output) + 1);
    fprintf(page, "' width='%d' alt='input and quads'></a>", width);
}

static void put_figure(const qw_arguments *a, FILE *page, const batch_model *m, double value)
{
    fputs("<figure>", page);
    put_picture(a, page, m, 360);
    fputs("<figcaption>", page);
    put_name(page, m);
    fprintf(page, ": %.4g</figcaption></figure>", value);
}

/* The worst values first, a few of them: of what is simple the least, else the largest. */
static void put_worst(const qw_arguments *a, FILE *page, const row *rows, size_t count, int m)
{
    double sign = m == SIMPLE ? -1 : 1, below = INFINITY;
    size_t last = SIZE_MAX;
    for (int k = 0; k < WORST; k++) {
        size_t found = SIZE_MAX;
        for (size_t i = 0; i < count; i++) {
            double v = sign * rows[i].value[m];
            bool is_next = v < below || (v == below && i > last);
            if (!rows[i].is_ok || rows[i].value[m] < 0 || !is_next) continue;
            if (found == SIZE_MAX || v > sign * rows[found].value[m]) found = i;
        }
        if (found == SIZE_MAX) return;
        below = sign * rows[found].value[m], last = found;
        put_figure(a, page, rows[found].model, rows[found].value[m]);
    }
}

/* The text of JSON as it reads, in place: up to its closing quote, and without escapes. */
static void unescape(char *text)
{
    char *to = text;
    for (; *text && *text != '"'; text++) {
        bool is_escape = *text == '\\' && text[1];
        if (is_escape) text++;
        bool is_number = is_escape && *text == 'u'; /* of a control, which shows nothing */
        *to++ = is_number ? ' ' : *text;
        for (int i = 0; i < 4 && is_number && text[1]; i++) text++;
    }
    *to = 0;
}

/* The sentence of a record, which is its last member. */
static void put_reason(FILE *page, char *record)
{
    char *text = record ? strstr(record, "\"message\": \"") : NULL;
    if (!text) return;
    text += strlen("\"message\": \"");
    unescape(text);
    if (text[0]) fputs(": ", page);
    put_escaped(page, text);
}

/* A list of the models that failed or are not done, with links to their records and why; the first MOST_NAMED. */
static void put_failed(const qw_arguments *a, FILE *page, const row *rows, size_t count, size_t failed)
{
    size_t shown = 0;
    if (failed == 0) return;
    fprintf(page, "<h2>%zu failed</h2><ul>", failed);
    for (size_t i = 0; i < count && shown < MOST_NAMED; i++) {
        if (rows[i].is_ok) continue;
        char *record = batch_read(rows[i].model->record, NULL);
        fputs("<li><b>", page);
        put_name(page, rows[i].model);
        fputs("</b> ", page);
        if (record) begin_link(a, page, rows[i].model->record);
        fprintf(page, "%s%s", record ? rows[i].status : "not done yet", record ? "</a>" : "");
        put_reason(page, record);
        fputs("</li>", page);
        free(record);
        shown++;
    }
    fputs("</ul>\n", page);
    if (shown < failed) fprintf(page, "<p>and %zu others, in the table below</p>\n", failed - shown);
}

/* What this run passed over: models that an earlier one had done, and files that are no models. */
static void put_skipped(FILE *page, const batch_list *list)
{
    size_t done = 0, shown = 0;
    for (size_t i = 0; i < list->count; i++) done += list->model[i].was_done;
    if (done > 0) fprintf(page, "<h2>%zu done by an earlier run</h2><p>", done);
    for (size_t i = 0; i < list->count && shown < MOST_NAMED; i++) {
        if (!list->model[i].was_done) continue;
        fputs(shown++ ? ", " : "", page);
        put_name(page, &list->model[i]);
    }
    if (done > 0) fputs(shown < done ? " and others</p>\n" : "</p>\n", page);
    if (list->others == 0) return;
    fprintf(page, "<h2>No models, by their endings: %zu</h2><p>", list->others);
    for (size_t i = 0; i < list->others && i < MOST_NAMED; i++)
        fputs(i ? ", " : "", page), put_escaped(page, list->other[i]);
    fputs(list->others > MOST_NAMED ? " and others</p>\n" : "</p>\n", page);
}

/* What pictures, dots, links and bars mean. */
static void put_legend(FILE *page)
{
    static const char *const kinds[] = {"two or fewer", "three", "five", "six or more"};
    fputs("<p>Pictures: the input, and beside it the quads; a click opens the file. Dots are irregular vertices, where "
          "not "
          "four edges meet but ",
          page);
    for (int k = 0; k < RENDER_KINDS; k++) {
        const uint8_t *c = render_kind_colour[k];
        fprintf(page, "%s<span style='color:#%02x%02x%02x'>&#9679;</span> %s", k ? ", " : "", c[0], c[1], c[2],
                kinds[k]);
    }
    fputs(". Names lead to the inputs. Bars count models from 0 to the largest value; the worst stand below.</p>\n",
          page);
}

/* The options that are not as they are where nothing is said. */
static void put_options(const qw_arguments *a, FILE *page)
{
    qw_options initial;
    int others = 0;
    qw_options_init(&initial);
    fputs("<p>Options: ", page);
    for (size_t i = 0; i < qw_option_count(); i++) {
        const char *name = qw_option_at(i)->name;
        char value[64] = "", was[64] = "";
        qw_option_get(&a->options, name, value, sizeof value);
        qw_option_get(&initial, name, was, sizeof was);
        if (strcmp(value, was) == 0 || strcmp(name, "threads") == 0) continue; /* --jobs says how many work */
        fprintf(page, "%s%s = ", others++ ? ", " : "", name);
        put_escaped(page, value);
    }
    if (a->keep[0]) fprintf(page, "%skeep = ", others++ ? ", " : ""), put_escaped(page, a->keep);
    if (a->density) fprintf(page, "%sdensity = ", others++ ? ", " : ""), put_escaped(page, a->density);
    fprintf(page, "%s</p>\n", others ? "" : "as they are where nothing is said");
}

/* Models, failures, date, and the sums of what is counted in all records. */
static void put_totals(FILE *page, const row *rows, size_t count, size_t failed)
{
    char date[64] = "";
    time_t now = time(NULL);
    struct tm utc;
    if (gmtime_r(&now, &utc)) strftime(date, sizeof date, "%Y-%m-%d %H:%M UTC", &utc);
    fprintf(page, "<p>%zu models, %zu failed, quadwright %s, %s</p>\n<p>In all ", count, failed, qw_version(), date);
    for (int k = 0; k < NUMBERS; k++) {
        double sum = 0;
        for (size_t i = 0; i < count; i++)
            if (rows[i].is_ok) sum += fmax(rows[i].number[k], 0);
        fprintf(page, "%.0f %s, ", sum, numbers[k].title);
    }
    double seconds = 0;
    for (size_t i = 0; i < count; i++) seconds += fmax(rows[i].value[SECONDS], 0);
    fprintf(page, "%.1f seconds of work.</p>\n", seconds);
}

/* A line of the table: picture, name, status, counts and measures of one model. */
static void put_row(const qw_arguments *a, FILE *page, const row *r)
{
    fputs("<tr><td>", page);
    if (r->is_ok) put_picture(a, page, r->model, 240);
    fputs("</td><td>", page);
    put_name(page, r->model);
    fprintf(page, "</td><td>%s%s</td>", r->status[0] ? r->status : "not done yet",
            r->model->was_done ? ", earlier" : "");
    for (int k = 0; k < NUMBERS; k++) {
        bool has_number = r->is_ok && r->number[k] >= 0, leads_on = has_number && k == WARNINGS && r->number[k] > 0;
        fputs("<td>", page);
        if (leads_on) begin_link(a, page, r->model->record); /* to their sentences */
        if (has_number) fprintf(page, "%.0f", r->number[k]);
        fputs(leads_on ? "</a></td>" : "</td>", page);
    }
    for (int m = 0; m < MEASURES; m++)
        if (r->value[m] >= 0) fprintf(page, "<td>%.3g</td>", r->value[m]);
        else fputs("<td></td>", page);
    fputs("</tr>\n", page);
}

static void put_table(const qw_arguments *a, FILE *page, const row *rows, size_t count)
{
    fputs("<h2>All models</h2><table><tr><th>input, quads</th><th>model</th><th>status</th>", page);
    for (int k = 0; k < NUMBERS; k++) fprintf(page, "<th>%s</th>", numbers[k].title);
    for (int m = 0; m < MEASURES; m++) fprintf(page, "<th>%s</th>", measures[m].title);
    fputs("</tr>\n", page);
    for (size_t i = 0; i < count; i++) put_row(a, page, &rows[i]);
    fputs("</table>\n", page);
}

/* The whole page, from totals to the table. */
static void put_page(const qw_arguments *a, FILE *page, const batch_list *list, const row *rows, size_t failed)
{
    size_t count = list->count;
    fputs("<!doctype html><html lang='en'><meta charset='utf-8'><title>quadwright batch</title>"
          "<style>body{font:15px sans-serif;margin:2em;max-width:1600px}figure{display:inline-block;margin:4px}"
          "figcaption{max-width:360px;overflow-wrap:anywhere}table{border-collapse:collapse}th{font-weight:normal;"
          "text-align:left;vertical-align:bottom}td,th{padding:2px 10px;border-bottom:1px solid #ddd}"
          "td+td+td+td{text-align:right}</style>\n<h1>quadwright batch</h1>",
          page);
    put_totals(page, rows, count, failed);
    put_options(a, page);
    put_legend(page);
    put_failed(a, page, rows, count, failed);
    put_skipped(page, list);
    for (int m = 0; m < MEASURES; m++) {
        put_histogram(page, rows, count, m);
        put_worst(a, page, rows, count, m);
    }
    put_table(a, page, rows, count);
    fputs("</html>\n", page);
}

static FILE *open_in(const qw_arguments *a, const char *name, const char *ending)
{
    char path[4200], shard[64];
    shard_suffix(a, shard);
    snprintf(path, sizeof path, "%s/%s%s.%s", a->output, name, shard, ending);
    return batch_make_folders(path) ? fopen(path, "wb") : NULL;
}

/* What the page shows of a model, out of its record, which goes into the file `lines` as it is. */
static void read_row(const batch_model *model, FILE *lines, row *r)
{
    size_t size;
    char *record = batch_read(model->record, &size);
    *r = (row){.model = model};
    if (!record) return;
    fwrite(record, 1, size, lines);
    batch_member(record, "status", r->status, sizeof r->status);
    r->is_ok = strcmp(r->status, "OK") == 0;
    for (int k = 0; k < NUMBERS; k++) r->number[k] = figure(record, numbers[k].section, numbers[k].name);
    for (int m = 0; m < MEASURES; m++) r->value[m] = figure(record, measures[m].section, measures[m].name);
    free(record);
}

int batch_report(const qw_arguments *a, const batch_list *list, size_t *failed)
{
    FILE *lines = open_in(a, "report", "jsonl"), *page = open_in(a, "summary", "html");
    row *rows = calloc(list->count + 1, sizeof *rows);
    *failed = 0;
    if (lines && page && rows) {
        for (size_t i = 0; i < list->count; i++) {
            read_row(&list->model[i], lines, &rows[i]);
            *failed += !rows[i].is_ok;
        }
        put_page(a, page, list, rows, *failed);
    }
    bool is_written = lines && page && rows && !ferror(lines) && !ferror(page);
    if (lines) is_written &= fclose(lines) == 0;
    if (page) is_written &= fclose(page) == 0;
    free(rows);
    return is_written ? 0 : qw_complain(QW_FILE_UNWRITABLE, "the report of the batch cannot be written");
}

#endif

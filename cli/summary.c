#include "summary.h"

#include "base/printable.h"

#include <inttypes.h>
#include <string.h>

/* ---- for people */

/* A line for each field of that kind in a record, by its table; optional ones below 0 are left out. */
static void print_fields(FILE *file, qw_record record, qw_field_kind kind, const void *values)
{
    const qw_field_info *info;
    for (size_t i = 0; (info = qw_field_at(record, i)); i++) {
        if (info->kind != kind || (record == QW_RECORD_QUALITY && !info->optional)) continue;
        const char *at = (const char *)values + info->offset;
        double real = kind == QW_FIELD_REAL ? *(const double *)at : 0;
        int64_t whole = kind == QW_FIELD_WHOLE ? *(const int64_t *)at : 0;
        if (info->optional && (real < 0 || whole < 0)) continue;
        fprintf(file, "%-24s ", info->name);
        if (kind == QW_FIELD_REAL) fprintf(file, "%.4g\n", real);
        else fprintf(file, "%" PRId64 "\n", whole);
    }
}

void qw_print_measures(FILE *file, const qw_topology *topology, const qw_quality *quality)
{
    print_fields(file, QW_RECORD_TOPOLOGY, QW_FIELD_WHOLE, topology);
    fprintf(file, "%-24s", "valence");
    for (int v = 0; v < 10; v++)
        if (topology->valence[v]) fprintf(file, " %d%s:%" PRId64, v, v == 9 ? "+" : "", topology->valence[v]);
    fputc('\n', file);
    print_fields(file, QW_RECORD_QUALITY, QW_FIELD_REAL, quality);
    print_fields(file, QW_RECORD_QUALITY, QW_FIELD_WHOLE, quality);
    if (topology->quads) fprintf(file, "%-24s %.4g\n", "min_scaled_jacobian", quality->min_scaled_jacobian);
}

static const char *shown(char text[QW_PATH_SIZE], const char *path)
{
    qw_printable(text, QW_PATH_SIZE, path);
    return text;
}

void qw_print_summary(FILE *file, const qw_report *report, const qw_notes *notes, const char *input, const char *output,
                      bool second_order)
{
    const qw_topology *t = &report->topology;
    const char *what = second_order ? "elements of second order" : "quads";
    char path[QW_PATH_SIZE];
    if (input)
        fprintf(file, "in:   %s, %" PRId64 " triangles in %" PRId64 " component%s\n", shown(path, input),
                report->input_triangles, report->components, report->components == 1 ? "" : "s");
    fprintf(file, "out:  %s, %" PRId64 " %s (%" PRId64 " asked for), %" PRId64 " vertices, %" PRId64 " irregular\n",
            output ? shown(path, output) : "nothing written", second_order ? t->quads / 4 : t->quads, what,
            report->faces_asked, t->vertices, t->irregular + t->irregular_boundary);
    fprintf(file,
            "      angles off by %.1f degrees, areas by %.0f %%, mean edge %.4g, %.0f %% in rows that never cross "
            "themselves\n",
            report->angle_rms, 100 * report->area_cv, report->mean_edge, 100 * report->simple);
    if (report->symmetric == 2) fprintf(file, "      components are symmetric about planes of their own\n");
    if (report->symmetric == 1)
        fprintf(file, "      symmetric about the plane %.4g x + %.4g y + %.4g z = %.4g\n", report->plane_x,
                report->plane_y, report->plane_z, report->plane_offset);
    fprintf(file, "took: %.2f s, %.0f MB\n", report->seconds, (double)report->peak_bytes / 1048576.0);
    for (int i = 0; i < notes->count; i++) fprintf(file, "note: %s\n", notes->text[i]);
    for (uint32_t w = 0; w < report->warning_count && w < 16; w++) fprintf(file, "note: %s\n", report->warnings[w]);
    if (report->warning_count > 16) fprintf(file, "note: and %" PRIu32 " more\n", report->warning_count - 16);
}

#include "summary.h"

#include "base/printable.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

/* The fields of the report in the order of quadwright.h; tests/test_cli.c reads the header and finds any that is
 * missing here. Laid out by hand, as rows of tables. */
/* clang-format off */
#define REPORT_WHOLE(FIELD) \
    FIELD(input_vertices) FIELD(input_faces) FIELD(input_triangles) FIELD(welded_vertices) \
    FIELD(dropped_degenerate) FIELD(dropped_duplicate) FIELD(dropped_isolated) FIELD(dropped_components) \
    FIELD(flipped_triangles) FIELD(turned_components) FIELD(split_edges) FIELD(split_vertices) FIELD(one_sided_seam_edges) \
    FIELD(unfolded_vertices) FIELD(components) FIELD(boundary_loops) FIELD(euler) FIELD(feature_edges) FIELD(feature_points) \
    FIELD(faces_asked) FIELD(working_vertices) FIELD(working_triangles) FIELD(hierarchy_levels) \
    FIELD(orientation_singularities) FIELD(position_singularities_before) \
    FIELD(position_singularities_after) FIELD(network_nodes) FIELD(network_arcs) FIELD(network_components) \
    FIELD(fixed_variables) FIELD(free_variables) FIELD(capacity_rounds) FIELD(flow_cost) \
    FIELD(subdivided_edges) FIELD(inverted_before) FIELD(inverted_after_greedy) FIELD(inverted_after_sat) \
    FIELD(sat_calls) FIELD(sat_conflicts) FIELD(least_squares_iterations) FIELD(repaired_doublets) \
    FIELD(repaired_pairs) FIELD(refined_regions) FIELD(fallback_components) FIELD(grown_protrusions) \
    FIELD(repaired_flips) FIELD(attempts)
#define REPORT_REAL(FIELD) \
    FIELD(sharp_angle) FIELD(least_squares_residual) FIELD(angle_rms) FIELD(area_cv) FIELD(mean_edge) \
    FIELD(seconds)
#define TOPOLOGY_WHOLE(FIELD) \
    FIELD(vertices) FIELD(edges) FIELD(faces) FIELD(quads) FIELD(triangles) FIELD(other_polygons) \
    FIELD(components) FIELD(boundary_loops) FIELD(boundary_edges) FIELD(euler) FIELD(degenerate_faces) \
    FIELD(duplicate_faces) FIELD(nonmanifold_edges) FIELD(nonmanifold_vertices) FIELD(inconsistent_edges) \
    FIELD(isolated_vertices) FIELD(irregular) FIELD(irregular_boundary)
#define QUALITY_REAL(FIELD) \
    FIELD(angle_rms) FIELD(angle_p99) FIELD(area_cv) FIELD(mean_edge) FIELD(edge_cv) FIELD(out_to_in_mean) \
    FIELD(in_to_out_mean) FIELD(chamfer) FIELD(hausdorff_p999) FIELD(hausdorff) FIELD(sharp_mean) \
    FIELD(sharp_p95) FIELD(follow) FIELD(follow10) FIELD(follow30) FIELD(patch_share) FIELD(chord_max) \
    FIELD(mirror)
#define QUALITY_WHOLE(FIELD) \
    FIELD(negative_corners) FIELD(flipped_faces) FIELD(patches) FIELD(chords) FIELD(crossing)
/* clang-format on */

static const char *const stage_names[QW_STAGE_COUNT] = {
#define QW_STAGE(name, title, source, weight) #name,
#include "quadwright/stages.def"
#undef QW_STAGE
};

enum { PATH_SIZE = 4096 }; /* of a path as it is shown */

/* ---- JSON */

static void json_topology(qw_json *json, const qw_topology *topology)
{
#define FIELD(name) qw_json_whole(json, #name, topology->name);
    TOPOLOGY_WHOLE(FIELD)
#undef FIELD
    qw_json_begin(json, "valence", '{'); /* "9" is 9 and more */
    for (int v = 0; v < 10; v++) {
        char name[2] = {(char)('0' + v), 0};
        if (topology->valence[v]) qw_json_whole(json, name, topology->valence[v]);
    }
    qw_json_end(json, '}');
}

void qw_json_report(qw_json *json, const char *name, const qw_report *report)
{
    qw_json_begin(json, name, '{');
#define FIELD(name) qw_json_whole(json, #name, report->name);
    REPORT_WHOLE(FIELD)
#undef FIELD
#define FIELD(name) qw_json_real(json, #name, report->name);
    REPORT_REAL(FIELD)
#undef FIELD
    qw_json_whole(json, "peak_bytes", (int64_t)report->peak_bytes);
    qw_json_begin(json, "topology", '{');
    json_topology(json, &report->topology);
    qw_json_end(json, '}');
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
    qw_json_begin(json, "warnings", '[');
    for (uint32_t w = 0; w < report->warning_count && w < 16; w++) qw_json_text(json, NULL, report->warnings[w]);
    qw_json_end(json, ']');
    qw_json_whole(json, "warning_count", report->warning_count);
    qw_json_end(json, '}');
}

void qw_json_options(qw_json *json, const char *name, const qw_options *options)
{
    qw_json_begin(json, name, '{');
#define QW_OPTION_COUNT(option, initial, least, most, unit, help) qw_json_whole(json, #option, options->option);
#define QW_OPTION_REAL(option, initial, least, most, unit, help)  qw_json_real(json, #option, options->option);
#define QW_OPTION_FLAG(option, initial, help)                     qw_json_flag(json, #option, options->option != 0);
#define QW_OPTION_CHOICE(option, initial, last, list, help)     \
    {                                                           \
        char choice[64];                                        \
        qw_option_get(options, #option, choice, sizeof choice); \
        qw_json_text(json, #option, choice);                    \
    }
#include "quadwright/options.def"
#undef QW_OPTION_COUNT
#undef QW_OPTION_REAL
#undef QW_OPTION_FLAG
#undef QW_OPTION_CHOICE
    qw_json_end(json, '}');
}

static void json_quality(qw_json *json, const qw_quality *quality)
{
#define FIELD(name) qw_json_real(json, #name, quality->name < 0 ? (double)NAN : quality->name);
    QUALITY_REAL(FIELD)
#undef FIELD
#define FIELD(name)                                   \
    if (quality->name < 0) qw_json_null(json, #name); \
    else qw_json_whole(json, #name, quality->name);
    QUALITY_WHOLE(FIELD)
#undef FIELD
    qw_json_real(json, "min_scaled_jacobian", quality->min_scaled_jacobian);
}

void qw_json_quality(qw_json *json, const char *name, const qw_quality *quality)
{
    qw_json_begin(json, name, '{');
    json_quality(json, quality);
    qw_json_end(json, '}');
}

void qw_json_measures(qw_json *json, const qw_topology *topology, const qw_quality *quality)
{
    qw_json_begin(json, NULL, '{');
    json_topology(json, topology);
    json_quality(json, quality);
    qw_json_end(json, '}');
}

/* ---- for people */

void qw_print_measures(FILE *file, const qw_topology *topology, const qw_quality *quality)
{
#define FIELD(name) fprintf(file, "%-24s %" PRId64 "\n", #name, topology->name);
    TOPOLOGY_WHOLE(FIELD)
#undef FIELD
    fprintf(file, "%-24s", "valence");
    for (int v = 0; v < 10; v++)
        if (topology->valence[v]) fprintf(file, " %d%s:%" PRId64, v, v == 9 ? "+" : "", topology->valence[v]);
    fputc('\n', file);
#define FIELD(name) \
    if (quality->name >= 0) fprintf(file, "%-24s %.4g\n", #name, quality->name);
    QUALITY_REAL(FIELD)
#undef FIELD
#define FIELD(name) \
    if (quality->name >= 0) fprintf(file, "%-24s %" PRId64 "\n", #name, quality->name);
    QUALITY_WHOLE(FIELD)
#undef FIELD
    if (topology->quads) fprintf(file, "%-24s %.4g\n", "min_scaled_jacobian", quality->min_scaled_jacobian);
}

static const char *shown(char text[PATH_SIZE], const char *path)
{
    qw_printable(text, PATH_SIZE, path);
    return text;
}

void qw_print_summary(FILE *file, const qw_report *report, const qw_notes *notes, const char *input, const char *output)
{
    const qw_topology *t = &report->topology;
    char path[PATH_SIZE];
    if (input)
        fprintf(file, "in:   %s, %" PRId64 " triangles in %" PRId64 " component%s\n", shown(path, input),
                report->input_triangles, report->components, report->components == 1 ? "" : "s");
    fprintf(file, "out:  %s, %" PRId64 " quads (%" PRId64 " asked for), %" PRId64 " vertices, %" PRId64 " irregular\n",
            output ? shown(path, output) : "nothing written", t->quads, report->faces_asked, t->vertices,
            t->irregular + t->irregular_boundary);
    fprintf(file, "      angles off by %.1f degrees, areas by %.0f %%, mean edge %.4g\n", report->angle_rms,
            100 * report->area_cv, report->mean_edge);
    fprintf(file, "took: %.2f s, %.0f MB\n", report->seconds, (double)report->peak_bytes / 1048576.0);
    for (int i = 0; i < notes->count; i++) fprintf(file, "note: %s\n", notes->text[i]);
    for (uint32_t w = 0; w < report->warning_count && w < 16; w++) fprintf(file, "note: %s\n", report->warnings[w]);
    if (report->warning_count > 16) fprintf(file, "note: and %" PRIu32 " more\n", report->warning_count - 16);
}

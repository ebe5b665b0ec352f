/* The main job: a file in, quads and a report out. Nothing is left behind by a run that fails or is interrupted. */
#include "commands.h"
#include "density_command.h"
#include "outfit.h"
#include "progress.h"
#include "summary.h"
#include "system.h"

#include "base/printable.h"
#include "base/report.h"
#include "io/file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct report_file {
    const char *target; /* NULL: no report is wanted */
    qw_env *env;        /* owns the file, and drops what is not finished */
    qw_file *file;
    qw_json json;
} report_file;

typedef struct session {
    const qw_arguments *arguments;
    qw_context *context;
    qw_meter meter;
    qw_notes notes;
    const qw_mesh *input; /* for the report and attributes; NULL: none, or not needed */
    qw_outfit outfit;     /* of the result */
    bool writing;         /* the results, after the run */
    bool saving;          /* files of them */
    char message[512];
} session;

static void serial(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user)
{
    (void)user;
    for (uint32_t i = 0; i < count; i++) task(task_user, i);
}

static void say_everything(void *user, qw_log_level level, const char *message)
{
    static const char *const names[] = {"debug", "info", "warning"};
    (void)user;
    char shown[1024];
    qw_printable(shown, sizeof shown, message);
    fprintf(stderr, "%s: %s\n", names[level], shown);
}

static qw_status keep(session *s, qw_status status)
{
    if (status != QW_OK) snprintf(s->message, sizeof s->message, "%s", qw_message(s->context));
    return status;
}

/* ---- what is said of a run that ended early */

static qw_status explain(session *s, qw_status status)
{
    const char *signal = qw_interrupted(),
               *left = s->writing ? "the result was not finished" : "the result was not written";
    if (status != QW_CANCELLED) return status;
    if (s->meter.late)
        snprintf(s->message, sizeof s->message, "the time limit of %lld s was reached; %s",
                 (long long)s->arguments->time_limit, left);
    else if (signal) snprintf(s->message, sizeof s->message, "ended by %s; %s", signal, left);
    return status;
}

/* ---- attributes */

static bool has_attributes(const session *s, const qw_mesh *input)
{
    uint32_t count = 0;
    qw_mesh_attributes(input, &count);
    bool scene = s->arguments->format == QW_FORMAT_GLB || s->arguments->format == QW_FORMAT_GLTF;
    return !s->arguments->bare && (count > 0 || qw_mesh_library(input) || scene);
}

static qw_status dress(session *s) { return keep(s, qw_dress(s->context, s->arguments, s->input, &s->outfit)); }

static qw_status save_coarse(session *s)
{
    qw_mesh_view coarse;
    qw_status status = qw_get_coarse(s->context, &coarse);
    if (status == QW_OK) status = qw_save(&coarse, s->arguments->coarse, QW_FORMAT_AUTO, s->message, sizeof s->message);
    return status;
}

static qw_status save_result(session *s)
{
    const qw_arguments *a = s->arguments;
    if (a->second_order) return qw_save_second_order(s->context, s->outfit.list, s->outfit.count, a->output, a->format);
    if (a->bake) return qw_save_asset(s->context, s->outfit.list, s->outfit.count, a->output, a->format);
    return qw_save_from(s->context, s->outfit.list, s->outfit.count, a->bare ? NULL : s->input, a->output, a->format);
}

/* Writes what was asked for, the result last; stops at the first that cannot be written. */
static qw_status save_all(session *s)
{
    const qw_arguments *a = s->arguments;
    qw_status status = QW_OK;
    s->saving = true;
    if (a->provenance) status = keep(s, qw_save_provenance(s->context, s->outfit.list, s->outfit.count, a->provenance));
    if (status == QW_OK && a->field_out) status = keep(s, qw_save_field(s->context, a->field_per, a->field_out));
    if (status == QW_OK && a->coarse) status = save_coarse(s);
    if (status == QW_OK && a->patches) status = keep(s, qw_save_patches_from(s->context, a->patches, a->blocks));
    if (status == QW_OK && a->output) status = keep(s, save_result(s));
    return status;
}

/* ---- the report */

/* The reader's warnings, for the report and the summary, and what is said while files are written, which comes after
   the report: the library's own begin with the first stage. */
static void take_note(void *user, qw_log_level level, const char *message)
{
    session *s = user;
    if (s->arguments->verbose) say_everything(NULL, level, message);
    if (level < (s->saving ? QW_LOG_INFO : QW_LOG_WARNING) || s->notes.count == QW_MOST_NOTES) return;
    qw_printable(s->notes.text[s->notes.count++], QW_NOTE_SIZE, message);
}

/* What is said before the work: that there will be more quads than were asked for. */
static void say_first(const char *message)
{
    char shown[1024];
    qw_printable(shown, sizeof shown, message);
    fprintf(stderr, "note: %s\n", shown);
}

/* What is said while files are written; other warnings are in the report. */
static void take_writing(void *user, qw_log_level level, const char *message)
{
    session *s = user;
    if (s->saving) take_note(user, level, message);
    else if (s->arguments->verbose) say_everything(NULL, level, message);
    else if (level == QW_LOG_INFO && !s->arguments->quiet) say_first(message);
}

/* The result against the input, where both are there. */
static qw_status measure(session *s, qw_quality *quality, bool *is_measured)
{
    const qw_arguments *a = s->arguments;
    const qw_host host = {.parallel = a->options.threads == 1 ? serial : NULL,
                          .progress = qw_meter_progress,
                          .progress_user = &s->meter,
                          .memory_limit = a->memory_limit};
    qw_mesh_view quads, surface = qw_mesh_get(s->input);
    *is_measured = qw_get_mesh(s->context, &quads) == QW_OK;
    if (!*is_measured) return QW_OK;
    qw_topology topology;
    qw_meter before = s->meter; /* measuring is no part of the bar */
    qw_meter_end(&s->meter);
    qw_status status = qw_measure_result(s->context, s->input ? &surface : NULL, &host, &topology, quality);
    before.late = s->meter.late, s->meter = before;
    if (status != QW_OK) snprintf(s->message, sizeof s->message, "the report: %s", qw_status_text(status));
    return status;
}

/* The JSON report of the run: options, report, notes, asset, and quality where it was measured. */
static qw_status fill_report(session *s, qw_json *json)
{
    const qw_arguments *a = s->arguments;
    const char *notes[QW_MOST_NOTES];
    for (int i = 0; i < s->notes.count; i++) notes[i] = s->notes.text[i];
    qw_run_info run = {.size = sizeof run,
                       .input = a->input ? a->input : a->from_stage,
                       .output = a->output,
                       .notes = notes,
                       .note_count = (uint32_t)s->notes.count,
                       .options = &a->options,
                       .report = qw_get_report(s->context)};
    if (s->outfit.has_transfer) run.transfer = &s->outfit.transfer;
    if (s->outfit.has_asset) run.asset = &s->outfit.asset;
    qw_quality quality;
    bool is_measured;
    qw_status status = measure(s, &quality, &is_measured);
    if (is_measured && status == QW_OK) run.quality = &quality;
    if (status == QW_OK) qw_json_run(json, &run);
    return status != QW_OK ? status : qw_json_failed(json) ? QW_MEMORY : QW_OK;
}

static void write_report(void *user)
{
    report_file *report = user;
    report->file = qw_file_begin(report->env, report->target);
    qw_file_put(report->file, report->json.text, report->json.length);
    qw_file_settle(report->file);
}

static void finish_report(void *user) { qw_file_finish(((report_file *)user)->file); }

static qw_status run_report(session *s, report_file *report, void (*body)(void *user))
{
    qw_status status = report->env ? qw_protect(report->env, body, report) : QW_MEMORY;
    if (status != QW_OK)
        snprintf(s->message, sizeof s->message, "the report: %s",
                 report->env ? qw_env_message(report->env) : qw_status_text(QW_MEMORY));
    return status;
}

/* The report lies beside its target first, so that it appears only together with the mesh. */
static qw_status write_results(session *s)
{
    const qw_arguments *a = s->arguments;
    const qw_host host = {.progress = qw_meter_progress, .progress_user = &s->meter};
    report_file report = {.target = a->json};
    qw_status status = QW_OK;
    s->writing = true;
    if (a->output) status = dress(s);
    if (status == QW_OK && a->json) {
        report.env = qw_env_create(&host, 1);
        status = fill_report(s, &report.json);
        if (status == QW_OK) status = run_report(s, &report, write_report);
    }
    if (status == QW_OK) status = save_all(s);
    if (status == QW_OK && a->json) status = run_report(s, &report, finish_report);
    qw_env_destroy(report.env);
    free(report.json.text);
    qw_undress(&s->outfit);
    return status;
}

/* ---- the run */

/* Runs to each stage of which a dump is asked for, writes that, then runs to the end where there is an output. */
static qw_status run_stages(session *s)
{
    const qw_arguments *a = s->arguments;
    qw_status status = QW_OK;
    for (int stage = 0; stage < QW_STAGE_COUNT && status == QW_OK; stage++) {
        if (!a->dump[stage]) continue;
        status = keep(s, qw_run_until(s->context, &a->options, (qw_stage)stage));
        if (status == QW_OK) status = keep(s, qw_dump(s->context, a->dump[stage]));
    }
    if (status == QW_OK && a->output) status = keep(s, qw_run(s->context, &a->options));
    return status;
}

/* ---- levels of detail */

/* "a/b.obj" becomes "a/b_LOD1.obj". */
static const char *level_path(char text[QW_PATH_SIZE], const char *path, int64_t level)
{
    if (!path || strcmp(path, "-") == 0) return path;
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
    size_t stem = dot ? (size_t)(dot - path) : strlen(path);
    snprintf(text, QW_PATH_SIZE, "%.*s_LOD%lld%s", (int)stem, path, (long long)level, path + stem);
    return text;
}

/* The names of the files of one level. */
typedef struct level_files {
    char output[QW_PATH_SIZE], json[QW_PATH_SIZE], provenance[QW_PATH_SIZE], patches[QW_PATH_SIZE],
        coarse[QW_PATH_SIZE], field[QW_PATH_SIZE];
} level_files;

static bool is_in_one_file(const qw_arguments *a) { return a->format == QW_FORMAT_GLB || a->format == QW_FORMAT_GLTF; }

/* Each level has maps of its own, of half as many texels along a side as the one before: it is seen from further off.
 */
void qw_halve_texture(qw_asset_options *o)
{
    enum { LEAST = 64 };
    if (o->texture / 2 < LEAST) return;
    o->texture /= 2, o->texel_density /= 2, o->unwrap_grid = (o->unwrap_grid + 1) / 2;
}

/* What is asked for, for one level: its count, and the files that it is written to. */
static qw_arguments arguments_of_level(const qw_arguments *all, int64_t level, level_files *files)
{
    qw_arguments one = *all;
    one.options.faces = all->level[level];
    for (int64_t i = 0; i < level; i++) qw_halve_texture(&one.asset);
    one.output = is_in_one_file(all) ? NULL : level_path(files->output, all->output, level);
    one.json = level_path(files->json, all->json, level);
    one.provenance = level_path(files->provenance, all->provenance, level);
    one.patches = level_path(files->patches, all->patches, level);
    one.coarse = level_path(files->coarse, all->coarse, level);
    one.field_out = level_path(files->field, all->field_out, level);
    return one;
}

/* Runs and writes one level: into a file of its own, or, for glTF, as a mesh for the file of all. */
static qw_status make_level(session *s, const qw_arguments *all, int64_t level, qw_mesh **taken)
{
    level_files files;
    qw_arguments one = arguments_of_level(all, level, &files);
    s->arguments = &one, s->outfit = (qw_outfit){0};
    s->writing = s->saving = false;
    int notes = s->notes.count;
    qw_status status = keep(s, qw_run(s->context, &one.options));
    if (status == QW_OK && is_in_one_file(all)) {
        s->writing = true, status = dress(s);
        if (status == QW_OK) status = keep(s, qw_take_level(s->context, s->outfit.list, s->outfit.count, taken));
    }
    if (status == QW_OK) status = write_results(s);
    qw_undress(&s->outfit);
    if (status == QW_OK && !all->quiet)
        qw_print_summary(stderr, qw_get_report(s->context), &s->notes, level == 0 ? all->input : NULL,
                         is_in_one_file(all) ? all->output : one.output, all->second_order);
    s->arguments = all, s->notes.count = notes;
    return status;
}

/* Removes the files of a level, as another one failed: all are written or none. */
static void take_level_back(const qw_arguments *all, int64_t level)
{
    level_files files;
    qw_arguments one = arguments_of_level(all, level, &files);
    const char *written[] = {one.output, one.json, one.provenance, one.patches, one.coarse, one.field_out};
    for (size_t i = 0; i < sizeof written / sizeof *written; i++)
        if (written[i] && strcmp(written[i], "-") != 0) remove(written[i]);
}

/* Makes each level of detail and writes all together; where one fails none is left behind. */
static qw_status make_levels(session *s)
{
    const qw_arguments *a = s->arguments;
    qw_mesh *taken[QW_MOST_LEVELS] = {NULL};
    const qw_mesh *levels[QW_MOST_LEVELS];
    qw_status status = QW_OK;
    int64_t made = 0;
    while (made < a->level_count && status == QW_OK) {
        status = make_level(s, a, made, &taken[made]);
        levels[made] = taken[made];
        made += status == QW_OK;
    }
    if (status == QW_OK && taken[0])
        status = qw_save_levels(levels, (uint32_t)a->level_count, a->bare ? NULL : s->input, a->output, a->format,
                                s->message, sizeof s->message);
    for (int64_t i = 0; i < made && status != QW_OK; i++) take_level_back(a, i);
    for (int64_t i = 0; i < a->level_count; i++) qw_mesh_destroy(taken[i]);
    return status;
}

static qw_status pick_region(session *s, qw_mesh *input)
{
    uint32_t faces = qw_mesh_get(input).face_count;
    uint8_t *inside = calloc(faces ? faces : 1, 1);
    if (!inside) return QW_MEMORY;
    qw_status status = qw_mesh_region(input, s->arguments->region, inside);
    if (status != QW_OK) snprintf(s->message, sizeof s->message, "%s", qw_mesh_message(input));
    else status = keep(s, qw_set_region(s->context, inside, faces));
    free(inside);
    return status;
}

static qw_status steer(session *s, qw_mesh *input)
{
    const qw_arguments *a = s->arguments;
    qw_status status = QW_OK;
    if (a->field_in) status = keep(s, qw_load_field(s->context, a->field_in));
    if (status == QW_OK && a->guides) status = keep(s, qw_load_guides(s->context, a->guides));
    if (status == QW_OK && a->region) status = pick_region(s, input);
    return status;
}

/* The input or the dump is loaded, what steers is read, and the run is run as far as was asked. */
static qw_status work(session *s, qw_mesh **input)
{
    const qw_arguments *a = s->arguments;
    qw_status status;
    if (a->from_stage) {
        status = keep(s, qw_resume(s->context, a->from_stage));
    } else {
        qw_mesh_view view = qw_mesh_get(*input);
        status = keep(s, qw_set_mesh(s->context, &view));
        uint32_t count;
        const qw_attribute *of_input = qw_mesh_attributes(*input, &count);
        if (status == QW_OK && !a->bare && a->options.follow_motion > 0)
            status = keep(s, qw_set_motion(s->context, of_input, count));
        if (status == QW_OK && a->density)
            status = qw_paint_density(s->context, *input, a->density, s->message, sizeof s->message);
        if (status == QW_OK) status = steer(s, *input);
        if (a->json || a->bake || has_attributes(s, *input)) {
            s->input = *input;
        } else { /* the context has its copy */
            qw_mesh_destroy(*input);
            *input = NULL;
        }
    }
    bool has_levels = a->level_count > 0;
    if (status == QW_OK) status = has_levels ? make_levels(s) : run_stages(s);
    if (status == QW_OK && qw_interrupted()) status = QW_CANCELLED;
    if (status == QW_OK && !has_levels) status = write_results(s);
    qw_meter_end(&s->meter);
    return explain(s, status);
}

/* The run with its meter, host and context, from input to summary. *input: the mesh, which may be given up early. */
static qw_status run(session *s, qw_mesh **input)
{
    const qw_arguments *a = s->arguments;
    const qw_host host = {.progress = qw_meter_progress,
                          .progress_user = &s->meter,
                          .memory_limit = a->memory_limit,
                          .log = take_writing,
                          .log_user = s};
    qw_meter_begin(&s->meter, a->quiet, (double)a->time_limit);
    s->meter.phases = (1 + (a->unwrap || a->bake) + a->bake) * (a->level_count > 0 ? (int)a->level_count : 1);
    qw_status status = qw_create(&host, &s->context);
    if (status == QW_OK) status = work(s, input);
    if (status == QW_OK && !a->quiet && a->output && a->level_count == 0)
        qw_print_summary(stderr, qw_get_report(s->context), &s->notes, a->input, a->output, a->second_order);
    qw_destroy(s->context);
    return status;
}

/* One of points may look like OFF without its first line. */
bool qw_may_be_points(qw_status status, bool wraps)
{
    return status == QW_NO_FACES || status == QW_FORMAT_UNKNOWN ||
           (wraps && (status == QW_FORMAT_SYNTAX || status == QW_FORMAT_TRUNCATED || status == QW_INDEX_RANGE));
}

/* A surface, or points without faces, which are wrapped. What is wrong is said of points where it is a file of points.
 */
static int load_input(session *s, const qw_host *host, qw_arguments *a, qw_mesh **input)
{
    qw_status status = qw_load_together(a->inputs, (uint32_t)a->input_count, host, input);
    bool is_drained = false; /* a pipe is read once */
    if (status == QW_OK) return 0;
    if (a->input_count == 1 && qw_may_be_points(status, a->options.wrap)) {
        qw_mesh *points;
        int notes = s->notes.count;
        qw_status other = qw_load_points(a->input, host, &points);
        bool is_points = a->options.wrap ? other != QW_FORMAT_UNKNOWN && other != QW_FILE_EMPTY : other == QW_OK;
        is_drained = other == QW_FILE_EMPTY;
        qw_mesh_destroy(is_points ? *input : points);
        if (is_points) {
            *input = points, status = other, s->notes.count -= notes; /* those of the reading as a surface */
            memmove(s->notes.text[0], s->notes.text[notes], (size_t)s->notes.count * sizeof s->notes.text[0]);
        }
        if (status == QW_OK && !a->options.wrap) {
            take_note(s, QW_LOG_WARNING, "points without faces are wrapped at the default distance; --wrap sets it");
            a->options.wrap = 1;
        }
        if (status == QW_OK) return 0;
    }
    char sentence[512];
    snprintf(sentence, sizeof sentence, "%s%s", qw_mesh_message(*input),
             is_drained ? " (points are read from a file, not through a pipe)" : "");
    int code = qw_complain(status, sentence);
    qw_mesh_destroy(*input);
    *input = NULL;
    return code;
}

int qw_command_remesh(const qw_arguments *given)
{
    qw_arguments own = *given; /* points turn the wrap on */
    const qw_arguments *a = &own;
    session s = {.arguments = a};
    qw_mesh *input = NULL;
    int code = qw_check_paths_or_complain(a);
    if (code != 0) return code;
    const qw_host loading = {.parallel = a->options.threads == 1 ? serial : NULL,
                             .memory_limit = a->memory_limit,
                             .log = take_note,
                             .log_user = &s};
    if (!a->from_stage) {
        code = load_input(&s, &loading, &own, &input);
        if (code != 0) return code;
        if (a->keep[0] && qw_mesh_mark(input, a->keep, NULL) != QW_OK) {
            code = qw_complain(QW_ARGUMENT, qw_mesh_message(input));
            qw_mesh_destroy(input);
            return code;
        }
    }
    qw_hold_interrupts(); /* until here an interrupt simply ends the process, which has written nothing */
    qw_status status = run(&s, &input);
    qw_mesh_destroy(input);
    return status == QW_OK ? 0 : qw_complain(status, s.message);
}

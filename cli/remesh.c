/* The main job: a file in, quads and a report out. Nothing is left behind by a run that fails or is interrupted. */
#define _POSIX_C_SOURCE 200809L
#include "commands.h"
#include "progress.h"
#include "summary.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

/* The report goes to a file beside its target first, so that it appears only together with the mesh. */
typedef struct report_file {
    const char *target;      /* NULL: no report is wanted */
    char written[PATH_SIZE]; /* "": nothing is there to be renamed or removed */
} report_file;

typedef struct session {
    const qw_arguments *arguments;
    qw_context *context;
    qw_meter meter;
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
    fprintf(stderr, "%s: %s\n", names[level], message);
}

static qw_status keep(session *s, qw_status status)
{
    if (status != QW_OK) snprintf(s->message, sizeof s->message, "%s", qw_message(s->context));
    return status;
}

/* ---- the output */

/* Said before the work rather than after it. What passes here may still fail at the end, and is then said there. */
static qw_status check_target(session *s, const char *path)
{
    struct stat info;
    if (!path || strcmp(path, "-") == 0) return QW_OK;
    if (stat(path, &info) == 0 && S_ISDIR(info.st_mode)) {
        snprintf(s->message, sizeof s->message, "%.300s is a directory and cannot be written", path);
        return QW_FILE_UNWRITABLE;
    }
    char folder[PATH_SIZE];
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) + 1 : 1;
    if (length >= sizeof folder) length = sizeof folder - 1;
    memcpy(folder, slash ? path : ".", length);
    folder[length] = 0;
    if (access(folder, W_OK) == 0) return QW_OK;
    snprintf(s->message, sizeof s->message, "%.300s cannot be written: %s", path, strerror(errno));
    return QW_FILE_UNWRITABLE;
}

static void fill_report(session *s, qw_json *json)
{
    const qw_arguments *a = s->arguments;
    qw_json_begin(json, NULL, '{');
    qw_json_text(json, "program", "quadwright");
    qw_json_text(json, "version", qw_version());
    qw_json_text(json, "input", a->input ? a->input : a->from_stage);
    if (a->output) qw_json_text(json, "output", a->output);
    else qw_json_null(json, "output");
    qw_json_options(json, "options", &a->options);
    qw_json_report(json, "report", qw_get_report(s->context));
    qw_json_end(json, '}');
}

static qw_status write_text(session *s, const char *path, const char *text, size_t length)
{
    FILE *file = fopen(path, "wb");
    bool good = file && fwrite(text, 1, length, file) == length;
    if (file && fclose(file) != 0) good = false;
    if (good) return QW_OK;
    snprintf(s->message, sizeof s->message, "the report %.300s cannot be written: %s", path, strerror(errno));
    return QW_FILE_UNWRITABLE;
}

static qw_status prepare_report(session *s, report_file *report)
{
    if (!report->target) return QW_OK;
    qw_json json = {0};
    fill_report(s, &json);
    qw_status status = qw_json_failed(&json) ? QW_MEMORY : QW_OK;
    struct stat info;
    bool stream = strcmp(report->target, "-") == 0;
    bool device = !stream && stat(report->target, &info) == 0 &&
                  !S_ISREG(info.st_mode); /* /dev/stdout and the like are not renamed onto */
    if (status == QW_OK && stream) {
        if (fputs(json.text, stdout) < 0 || fflush(stdout) != 0) status = QW_FILE_UNWRITABLE;
    } else if (status == QW_OK && device) {
        status = write_text(s, report->target, json.text, json.length);
    } else if (status == QW_OK) {
        snprintf(report->written, sizeof report->written, "%s.%ld.part", report->target, (long)getpid());
        status = write_text(s, report->written, json.text, json.length);
    }
    free(json.text);
    return status;
}

static qw_status finish_report(session *s, report_file *report)
{
    if (!report->written[0]) return QW_OK;
    if (rename(report->written, report->target) == 0) {
        report->written[0] = 0;
        return QW_OK;
    }
    snprintf(s->message, sizeof s->message, "the report %.300s cannot be written: %s", report->target, strerror(errno));
    return QW_FILE_UNWRITABLE;
}

static qw_status write_results(session *s)
{
    const qw_arguments *a = s->arguments;
    report_file report = {.target = a->json};
    qw_status status = prepare_report(s, &report);
    if (status == QW_OK && a->output) status = keep(s, qw_save_mesh(s->context, a->output, a->format));
    if (status == QW_OK) status = finish_report(s, &report);
    if (report.written[0]) remove(report.written);
    return status;
}

/* ---- the run */

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

static qw_status work(session *s, qw_mesh **input)
{
    const qw_arguments *a = s->arguments;
    qw_status status;
    if (a->from_stage) {
        status = keep(s, qw_resume(s->context, a->from_stage));
    } else {
        qw_mesh_view view = qw_mesh_get(*input);
        status = keep(s, qw_set_mesh(s->context, &view));
        qw_mesh_destroy(*input); /* the context has its copy */
        *input = NULL;
    }
    if (status == QW_OK) status = run_stages(s);
    qw_meter_end(&s->meter);
    if (status == QW_OK && qw_interrupted()) {
        snprintf(s->message, sizeof s->message, "interrupted");
        status = QW_CANCELLED;
    }
    if (status == QW_CANCELLED && s->meter.late)
        snprintf(s->message, sizeof s->message, "the time limit of %lld s was reached; nothing was written",
                 (long long)a->time_limit);
    return status == QW_OK ? write_results(s) : status;
}

static size_t memory_limit(const qw_arguments *a) { return (size_t)a->memory_limit << 20; }

static qw_status run(session *s, qw_mesh **input)
{
    const qw_arguments *a = s->arguments;
    qw_host host = {.progress = qw_meter_progress, .progress_user = &s->meter, .memory_limit = memory_limit(a)};
    if (a->verbose) host.log = say_everything;
    qw_meter_begin(&s->meter, a->quiet, (double)a->time_limit);
    qw_status status = qw_create(&host, &s->context);
    if (status == QW_OK) status = work(s, input);
    if (status == QW_OK && !a->quiet && a->output)
        qw_print_summary(stderr, qw_get_report(s->context), a->input, a->output);
    qw_destroy(s->context);
    return status;
}

int qw_command_remesh(const qw_arguments *a)
{
    session s = {.arguments = a};
    qw_mesh *input = NULL;
    qw_status status = check_target(&s, a->output);
    if (status == QW_OK) status = check_target(&s, a->json);
    if (status != QW_OK) return qw_complain(status, s.message);
    const qw_host loading = {.parallel = a->options.threads == 1 ? serial : NULL, .memory_limit = memory_limit(a)};
    if (!a->from_stage) {
        int code = qw_load_or_complain(a->input, &loading, &input);
        if (code != 0) return code;
    }
    qw_hold_interrupts(); /* until here an interrupt simply ends the process, which has written nothing */
    status = run(&s, &input);
    qw_mesh_destroy(input);
    return status == QW_OK ? 0 : qw_complain(status, s.message);
}

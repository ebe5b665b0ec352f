/* Runs the models of a batch: a process each, so that a crash, a limit or a kill ends one model and is one line of the
 * report.
 *
 * What is done of a model is said by its record, a line of JSON that appears whole after the quads are written. It
 * tells the bytes and the hash of the quads, the size and time of the input and of the files that it names, and the
 * options. A model is done where all of these still agree; else, as after a kill in the middle, it is done again; but
 * results of other options are not replaced without --force. Several batches may work on shards of the same models in
 * one output folder, and only one on a shard, or on all of them.
 */
#define _GNU_SOURCE /* prctl */
#include "batch.h"
#include "commands.h"

#ifdef _WIN32

int qw_command_batch(const qw_arguments *a)
{
    (void)a;
    return qw_complain(QW_UNSUPPORTED, "batch is not there on Windows yet");
}

#else

#include "base/json.h"
#include "base/platform.h"
#include "base/report.h"
#include "density_command.h"
#include "outfit.h"
#include "system.h"

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#ifdef __linux__
#include <sys/prctl.h>
#endif

enum { MOST_JOBS = 256, MOST_NAMED = 6 };

typedef struct worker {
    pid_t process; /* 0: idle */
    size_t model;
    char key[BATCH_KEY_SIZE];
    double began;
    bool is_late; /* was killed for its time */
} worker;

typedef struct batch {
    const qw_arguments *arguments;
    batch_list list;
    worker worker[MOST_JOBS];
    uint32_t jobs, running;
    size_t next, skipped, done, failed; /* skipped: were done before */
    size_t failed_before;               /* of skipped */
    double began, said;
} batch;

/* ---- records */

/* Whether the output of a model still has the size and the hash that its record says. */
static bool is_output_whole(const batch_model *m, const char *record)
{
    char bytes[32], hash[32], now[32];
    size_t size;
    batch_member(record, "output_bytes", bytes, sizeof bytes);
    batch_member(record, "output_hash", hash, sizeof hash);
    char *text = batch_read(m->output, &size);
    if (!text) return false;
    snprintf(now, sizeof now, "%016" PRIx64, qw_hash_bytes(QW_HASH_BYTES, text, size));
    free(text);
    return strtoull(bytes, NULL, 10) == size && strcmp(hash, now) == 0;
}

/* key: of the model now. *failed: it is done, and failed. */
static bool is_done(const batch *b, const batch_model *m, const char *key, bool *failed)
{
    size_t size;
    char *record = batch_read(m->record, &size), was[BATCH_KEY_SIZE], status[32];
    if (!record) return false;
    batch_member(record, "key", was, sizeof was);
    batch_member(record, "status", status, sizeof status);
    bool is_whole = size > 2 && strcmp(record + size - 2, "}\n") == 0 && strcmp(key, was) == 0;
    bool is_ok = strcmp(status, "OK") == 0, is_final = !b->arguments->retry && strcmp(status, "KILLED") != 0;
    bool is = is_whole && (is_ok ? is_output_whole(m, record) : is_final);
    *failed = is && !is_ok;
    free(record);
    return is;
}

/* Writes the file whole or not at all: first under a fixed name beside it, which the next run overwrites if a kill left
 * it there, then by renaming. */
static bool write_whole(const char *path, const char *text, size_t size)
{
    char beside[4200];
    if (snprintf(beside, sizeof beside, "%s.part", path) >= (int)sizeof beside) return false;
    FILE *file = fopen(beside, "wb");
    if (!file) return false;
    bool is_written = fwrite(text, 1, size, file) == size;
    is_written &= fflush(file) == 0 && fsync(fileno(file)) == 0;
    is_written &= fclose(file) == 0;
    if (is_written && rename(beside, path) == 0) return true;
    remove(beside);
    return false;
}

typedef struct outcome {
    const char *key, *status, *message; /* key: of before the input was read */
    int exit_code;
    double seconds;
    const qw_run_info *run; /* NULL: of a failure */
    uint32_t level_faces[QW_MOST_LEVELS];
} outcome;

/* The first members of a model's record, which all outcomes have; the object is left open. */
static void begin_record(const qw_arguments *a, const batch_model *m, const outcome *o, qw_json *json)
{
    char settings[BATCH_KEY_SIZE];
    batch_settings_key(a, settings);
    *json = (qw_json){.is_line = true};
    qw_json_begin(json, NULL, '{');
    qw_json_text(json, "name", m->name);
    qw_json_text(json, "status", o->status);
    qw_json_whole(json, "exit_code", o->exit_code);
    qw_json_text(json, "key", o->key);
    qw_json_text(json, "settings", settings);
    qw_json_text(json, "version", qw_version());
    qw_json_real(json, "wall_seconds", o->seconds);
    qw_json_text(json, "input", m->input);
    qw_json_text(json, "message", o->message);
}

/* Writes the record of a model beside its result; false where it cannot be written. */
static bool write_record(const qw_arguments *a, const batch_model *m, const outcome *o)
{
    qw_json json;
    begin_record(a, m, o, &json);
    if (o->run) {
        size_t size;
        char *text = batch_read(m->output, &size), hash[32];
        if (!text) return free(json.text), false;
        snprintf(hash, sizeof hash, "%016" PRIx64, qw_hash_bytes(QW_HASH_BYTES, text, size));
        free(text);
        qw_json_text(&json, "output", m->output);
        qw_json_whole(&json, "output_bytes", (int64_t)size);
        qw_json_text(&json, "output_hash", hash);
        qw_json_options(&json, "options", o->run->options);
        qw_json_report(&json, "report", o->run->report);
        qw_json_quality(&json, "quality", o->run->quality);
        if (o->run->transfer) qw_json_transfer(&json, o->run->transfer);
        if (o->run->asset) qw_json_asset(&json, "asset", o->run->asset);
        if (a->level_count > 0) qw_json_begin(&json, "levels", '[');
        for (int64_t i = 0; i < a->level_count; i++) qw_json_whole(&json, NULL, o->level_faces[i]);
        if (a->level_count > 0) qw_json_end(&json, ']');
    }
    qw_json_end(&json, '}');
    bool is_written = !qw_json_failed(&json) && write_whole(m->record, json.text, json.length);
    free(json.text);
    return is_written;
}

/* ---- one model, in a process of its own */

/* Everything lives until the process ends. */
typedef struct making {
    qw_arguments *arguments; /* its own: points turn the wrap on */
    const batch_model *model;
    const char *key;
    qw_mesh *mesh;
    qw_context *context;
    qw_outfit outfit;
    qw_mesh *level[QW_MOST_LEVELS]; /* with --levels */
    char *message;
    size_t size;
} making;

static qw_status say(making *k, qw_status status, const char *message)
{
    if (status != QW_OK) snprintf(k->message, k->size, "%s", message);
    return status;
}

/* The status of what the context was asked to do, with the context's own sentence, which is read after it. */
static qw_status said(making *k, qw_status status) { return say(k, status, qw_message(k->context)); }

/* Reads the model, as points where it has no faces or a wrap is asked for, and marks the edges that are to stay. */
static qw_status load(making *k, const qw_host *host)
{
    qw_arguments *a = k->arguments;
    qw_status status = qw_load(k->model->input, host, &k->mesh);
    if (qw_may_be_points(status, a->options.wrap)) {
        qw_mesh *points;
        qw_status other = qw_load_points(k->model->input, host, &points);
        bool is_points = a->options.wrap ? other != QW_FORMAT_UNKNOWN : other == QW_OK;
        if (is_points) status = other, a->options.wrap = true;
        qw_mesh_destroy(is_points ? k->mesh : points);
        if (is_points) k->mesh = points;
    }
    if (status == QW_OK && a->keep[0]) status = qw_mesh_mark(k->mesh, a->keep, NULL);
    return say(k, status, qw_mesh_message(k->mesh));
}

/* A context with the mesh, the motion of its bones and morph targets, and the density. */
static qw_status begin(making *k, const qw_host *host)
{
    const qw_arguments *a = k->arguments;
    qw_mesh_view input = qw_mesh_get(k->mesh);
    if (qw_create(host, &k->context) != QW_OK) return say(k, QW_MEMORY, qw_status_text(QW_MEMORY));
    qw_status status = said(k, qw_set_mesh(k->context, &input));
    uint32_t count;
    const qw_attribute *attributes = qw_mesh_attributes(k->mesh, &count);
    if (status == QW_OK && !a->bare && a->options.follow_motion > 0)
        status = said(k, qw_set_motion(k->context, attributes, count));
    if (status == QW_OK && a->density) status = qw_paint_density(k->context, k->mesh, a->density, k->message, k->size);
    return status;
}

static qw_status remesh(making *k, const qw_arguments *a)
{
    k->outfit = (qw_outfit){0};
    qw_status status = qw_run(k->context, &a->options);
    return said(k, status == QW_OK ? qw_dress(k->context, a, k->mesh, &k->outfit) : status);
}

/* The levels, the coarsest first: what is said of the model is said of the finest, the last. */
static qw_status make_levels(making *k)
{
    qw_status status = QW_OK;
    for (int64_t i = k->arguments->level_count; i-- > 0 && status == QW_OK;) {
        qw_arguments one = *k->arguments;
        one.options.faces = one.level[i];
        for (int64_t j = 0; j < i; j++) qw_halve_texture(&one.asset);
        status = remesh(k, &one);
        if (status == QW_OK) status = said(k, qw_take_level(k->context, k->outfit.list, k->outfit.count, &k->level[i]));
    }
    return status;
}

static qw_status make(making *k)
{
    if (k->arguments->level_count > 0) return make_levels(k);
    return remesh(k, k->arguments);
}

static qw_status save_levels(making *k)
{
    const qw_arguments *a = k->arguments;
    const qw_mesh *level[QW_MOST_LEVELS];
    for (int64_t i = 0; i < a->level_count; i++) level[i] = k->level[i];
    return qw_save_levels(level, (uint32_t)a->level_count, a->bare ? NULL : k->mesh, k->model->output, a->format,
                          k->message, k->size);
}

static qw_status save(making *k)
{
    const qw_arguments *a = k->arguments;
    const char *path = k->model->output;
    if (a->level_count > 0) return save_levels(k);
    qw_status status = a->bake ? qw_save_asset(k->context, k->outfit.list, k->outfit.count, path, a->format)
                               : qw_save_from(k->context, k->outfit.list, k->outfit.count, a->bare ? NULL : k->mesh,
                                              path, a->format);
    return said(k, status);
}

/* Makes the quads of one model and writes them, with their picture; its outcome is kept for the record. */
static qw_status make_quads(making *k, double began)
{
    const qw_arguments *a = k->arguments;
    const batch_model *m = k->model;
    const qw_host host = {.memory_limit = a->memory_limit};
    qw_status status = load(k, &host);
    if (status == QW_OK) status = begin(k, &host);
    if (status == QW_OK) status = make(k);
    if (status != QW_OK) return status;
    qw_mesh_view input = qw_mesh_get(k->mesh);
    qw_topology topology;
    qw_quality quality;
    status = qw_measure_result(k->context, &input, &host, &topology, &quality);
    if (status != QW_OK) return snprintf(k->message, k->size, "the measures: %s", qw_status_text(status)), status;
    status = save(k);
    if (status != QW_OK) return status;
    qw_mesh_view quads;
    if (qw_get_mesh(k->context, &quads) == QW_OK) batch_draw(a, m, &input, &quads);
    qw_run_info run = {
        .size = sizeof run, .options = &a->options, .report = qw_get_report(k->context), .quality = &quality};
    if (k->outfit.has_transfer) run.transfer = &k->outfit.transfer;
    if (k->outfit.has_asset) run.asset = &k->outfit.asset;
    outcome o = {k->key, "OK", "", 0, qw_seconds_now() - began, &run, {0}};
    for (int64_t i = 0; i < a->level_count; i++) o.level_faces[i] = qw_mesh_get(k->level[i]).face_count;
    if (write_record(a, m, &o)) return QW_OK;
    snprintf(k->message, k->size, "%s: cannot be written", m->record);
    return QW_FILE_UNWRITABLE;
}

/* Ends the process; its memory goes with it. */
static _Noreturn void work(const batch *b, const batch_model *m, const char *key)
{
    char message[512] = "";
    double began = qw_seconds_now();
    qw_arguments own = *b->arguments;
    making k = {.arguments = &own, .model = m, .key = key, .message = message, .size = sizeof message};
    qw_status status = make_quads(&k, began);
    if (status != QW_OK) {
        outcome o = {key, qw_status_name(status), message, qw_status_exit_code(status), qw_seconds_now() - began, NULL,
                     {0}};
        write_record(b->arguments, m, &o);
    }
    _exit(qw_status_exit_code(status));
}

/* ---- the processes */

/* Starts a process for a model in a free place of the workers; false: there is none to be had. */
static bool start(batch *b, size_t model, const char *key)
{
    worker *w = b->worker;
    while (w->process) w++;
    const batch_model *m = &b->list.model[model];
    remove(m->record); /* an old one would be taken for that of this run */
    pid_t parent = getpid(), process = batch_make_folders(m->record) ? fork() : -1;
    if (process == 0) {
#ifdef __linux__
        prctl(PR_SET_PDEATHSIG, SIGKILL); /* no child goes on where the batch was killed */
        if (getppid() != parent) _exit(1);
#endif
        work(b, m, key);
    }
    (void)parent;
    if (process < 0) return false;
    *w = (worker){.process = process, .model = model, .began = qw_seconds_now()};
    snprintf(w->key, sizeof w->key, "%s", key);
    b->running++;
    return true;
}

/* What ends a process from outside says nothing of the model: where a whole batch is killed, as clusters do it, its
 * children may go first. Such a model is done again by the next run, a crash is not. */
static const char *name_of_end(int signal)
{
    static const int outside[] = {SIGKILL, SIGTERM, SIGINT, SIGHUP, SIGQUIT};
    for (size_t i = 0; i < sizeof outside / sizeof *outside; i++)
        if (signal == outside[i]) return "KILLED";
    return "CRASHED";
}

/* Whatever the process left: where it left no record, it was killed or crashed. */
static void settle(batch *b, worker *w, int status)
{
    const qw_arguments *a = b->arguments;
    const batch_model *m = &b->list.model[w->model];
    bool is_ok = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (!WIFEXITED(status)) {
        char message[128];
        if (w->is_late) snprintf(message, sizeof message, "the time limit of %" PRId64 " s was reached", a->time_limit);
        else
            snprintf(message, sizeof message, "the process was ended by signal %d (%s)", WTERMSIG(status),
                     strsignal(WTERMSIG(status)));
        outcome o = {w->key,
                     w->is_late ? "TIME_LIMIT" : name_of_end(WTERMSIG(status)),
                     message,
                     128 + WTERMSIG(status),
                     qw_seconds_now() - w->began,
                     NULL,
                     {0}};
        write_record(a, m, &o);
    }
    b->done++, b->failed += !is_ok;
    b->running--;
    w->process = 0;
}

/* Settles all workers that have ended, and ends those over the time limit; whether any had ended. */
static bool reap(batch *b)
{
    bool any = false;
    for (uint32_t i = 0; i < b->jobs; i++) {
        worker *w = &b->worker[i];
        int status;
        if (!w->process) continue;
        double limit = (double)b->arguments->time_limit;
        if (limit > 0 && !w->is_late && qw_seconds_now() - w->began > limit)
            w->is_late = true, kill(w->process, SIGKILL);
        if (waitpid(w->process, &status, WNOHANG) != w->process) continue;
        settle(b, w, status);
        any = true;
    }
    return any;
}

/* How many are done, have failed and are left, at most twice a second in a terminal and every half minute
   elsewhere. */
static void say_progress(batch *b, bool is_end)
{
    double now = qw_seconds_now(), pause = qw_is_terminal() ? 0.5 : 30;
    if (b->arguments->quiet || (!is_end && now - b->said < pause)) return;
    b->said = now;
    size_t all = b->list.count, done = b->done + b->skipped, left = all - done;
    double estimate = b->done ? (now - b->began) / (double)b->done * (double)left : 0;
    fprintf(stderr, "%s%zu of %zu done, %zu failed", qw_is_terminal() ? "\r" : "", done, all,
            b->failed + b->failed_before);
    if (b->skipped > 0) fprintf(stderr, "; %zu of them in an earlier run", b->skipped);
    if (b->failed_before > 0) fprintf(stderr, ", of which %zu failed", b->failed_before);
    if (left > 0 && b->done) fprintf(stderr, ", about %.0f s left", estimate);
    fputs(qw_is_terminal() && !is_end ? "   " : "\n", stderr);
    fflush(stderr);
}

static void kill_all(batch *b)
{
    for (uint32_t i = 0; i < b->jobs; i++)
        if (b->worker[i].process) kill(b->worker[i].process, SIGKILL), waitpid(b->worker[i].process, NULL, 0);
}

/* Starts the next model, or skips it where it is done; the exit code. */
static int take_next(batch *b)
{
    char key[BATCH_KEY_SIZE], message[512];
    bool failed = false;
    batch_model *m = &b->list.model[b->next];
    batch_key(b->arguments, m, key);
    m->was_done = is_done(b, m, key, &failed);
    if (m->was_done) {
        b->skipped++, b->failed_before += failed;
    } else if (!start(b, b->next, key)) {
        snprintf(message, sizeof message, "%.300s: cannot be started: %s", m->name, strerror(errno));
        return qw_complain(QW_FILE_UNWRITABLE, message);
    }
    b->next++;
    return 0;
}

/* Starts models while workers are free and settles those that end, until all are done or a signal comes. Returns
   the exit code. */
static int run(batch *b)
{
    const struct timespec moment = {0, 2000000};
    while (b->next < b->list.count || b->running > 0) {
        if (qw_interrupted()) {
            char message[128];
            snprintf(message, sizeof message, "ended by %s; started again, the batch goes on", qw_interrupted());
            kill_all(b);
            return qw_complain(QW_CANCELLED, message);
        }
        if (b->next < b->list.count && b->running < b->jobs) {
            int code = take_next(b);
            if (code != 0) return kill_all(b), code;
        } else if (!reap(b)) nanosleep(&moment, NULL);
        say_progress(b, false);
    }
    return 0;
}

/* Names the first few. */
static void say_failed(const qw_arguments *a, const batch_list *list, size_t failed)
{
    char message[1024], status[32];
    size_t used = (size_t)snprintf(message, sizeof message, "%zu of %zu models failed: ", failed, list->count),
           named = 0;
    for (size_t i = 0; i < list->count && named < MOST_NAMED; i++) {
        const batch_model *m = &list->model[i];
        char *record = batch_read(m->record, NULL);
        if (record) batch_member(record, "status", status, sizeof status);
        else snprintf(status, sizeof status, "no record");
        free(record);
        if (strcmp(status, "OK") == 0) continue;
        used += (size_t)snprintf(message + used, sizeof message - used, "%s%.80s (%s%s)", named++ ? ", " : "", m->name,
                                 status, m->was_done ? ", in an earlier run" : "");
    }
    char shard[64] = "";
    if (a->shards) snprintf(shard, sizeof shard, "-%lld-of-%lld", (long long)a->shard, (long long)a->shards);
    snprintf(message + used, sizeof message - used, "%s; %.200s/report%s.jsonl says why, --retry does them again",
             named < failed ? " and others" : "", a->output, shard);
    (void)qw_complain(QW_OK, message);
}

int qw_command_batch(const qw_arguments *arguments)
{
    qw_arguments a = *arguments;
    batch b = {.arguments = &a, .began = qw_seconds_now()};
    uint32_t cores = qw_processor_count();
    b.jobs = a.jobs ? (uint32_t)a.jobs : cores < MOST_JOBS ? cores : MOST_JOBS;
    if (a.options.threads == 0) a.options.threads = cores > b.jobs ? cores / b.jobs : 1; /* never changes a result */
    int code = batch_find(&a, &b.list);
    if (code != 0) return code;
    code = batch_lock(&a);
    if (code == 0) code = batch_require_same_options(&a, &b.list);
    qw_hold_interrupts();
    if (code == 0) code = run(&b);
    size_t failed = 0;
    if (code == 0) say_progress(&b, true);
    if (code == 0) code = batch_report(&a, &b.list, &failed);
    if (code == 0 && failed > 0) say_failed(&a, &b.list, failed);
    batch_free(&b.list);
    return code != 0 ? code : failed > 0;
}

#endif

#include "commands.h"
#include "help.h"
#include "progress.h"
#include "summary.h"
#include "system.h"
#include "without_effect.h"

#include "base/report.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What was printed may still lie in a buffer. Where an earlier write has failed and nothing is left to flush, the cause
   is what errno says since then. */
static int finish_printing(void)
{
    int before = errno;
    errno = 0;
    if (fflush(stdout) == 0 && !ferror(stdout)) return 0;
    char message[128];
    const char *cause = errno || before ? strerror(errno ? errno : before) : "an error";
    snprintf(message, sizeof message, "standard output: cannot be written: %s", cause);
    return qw_complain(QW_FILE_UNWRITABLE, message);
}

/* What was measured, as text or with --json as JSON. Returns the exit code. */
static int print_measures(const qw_arguments *a, const qw_topology *topology, const qw_quality *quality)
{
    if (!a->json) {
        qw_print_measures(stdout, topology, quality);
    } else {
        qw_json json = {0};
        qw_json_measures(&json, topology, quality);
        bool failed = qw_json_failed(&json);
        if (!failed) fputs(json.text, stdout);
        free(json.text);
        if (failed) return qw_complain(QW_MEMORY, NULL);
    }
    return finish_printing();
}

int qw_take_limit(const qw_host *host, qw_mesh **mesh)
{
    enum { SPLITS = 4 };
    qw_mesh *limit;
    qw_mesh_view view = qw_mesh_get(*mesh);
    qw_status status = qw_limit(&view, SPLITS, host, &limit);
    int code = status == QW_OK ? 0 : qw_complain(status, qw_mesh_message(limit));
    qw_mesh_destroy(*mesh);
    *mesh = limit;
    return code;
}

/* The width of gaps through which a surface is seen: a share of the diagonal of its faces' box, as of qw_mesh_visible.
 */
static double gap_of(const qw_mesh_view *m)
{
    const double share = 1.0 / 200;
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0}, sum = 0;
    size_t corners = 0;
    for (uint32_t f = 0; f < m->face_count; f++) corners += m->face_sizes ? m->face_sizes[f] : m->uniform_face_size;
    for (size_t c = 0; c < corners; c++)
        for (size_t k = 0; k < 3; k++) {
            double at = m->positions[3 * (size_t)m->corners[c] + k];
            low[k] = c && low[k] < at ? low[k] : at, high[k] = c && high[k] > at ? high[k] : at;
        }
    for (int k = 0; k < 3; k++) sum += (high[k] - low[k]) * (high[k] - low[k]);
    return share * sqrt(sum);
}

int qw_command_measure(const qw_arguments *a)
{
    const qw_host host = {.log = qw_say_warnings}, loading = {.log = a->quiet ? NULL : qw_say_warnings};
    qw_mesh *mesh = NULL, *against = NULL;
    int code = qw_load_or_complain(a->input, &loading, &mesh);
    if (code == 0 && a->limit) code = qw_take_limit(&host, &mesh);
    if (code == 0 && a->against) code = qw_load_or_complain(a->against, &loading, &against);
    if (code == 0 && a->visible && !against)
        code = qw_complain(QW_ARGUMENT, "--visible needs the surface to measure against: --against FILE");
    if (code == 0) {
        qw_mesh_view view = qw_mesh_get(mesh), surface = qw_mesh_get(against);
        qw_topology topology;
        qw_quality quality;
        double gap = a->visible ? gap_of(&surface) : 0;
        /* the sentence comes through the log */
        qw_status status = qw_measure_seen(&view, against ? &surface : NULL, gap, &host, &topology, &quality);
        code = status == QW_OK ? print_measures(a, &topology, &quality) : qw_status_exit_code(status);
    }
    qw_mesh_destroy(against);
    qw_mesh_destroy(mesh);
    return code;
}

/* The stages take and give back blocks of some megabytes over and over. Left alone, glibc maps each one anew and the
 * kernel clears its pages, which took a fifth of a run. No huge pages: docs/dev/decisions/speed.md. */
static void keep_memory(void)
{
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_TRIM_THRESHOLD, 512 << 20);
    mallopt(M_TOP_PAD, 16 << 20);
#endif
}

static int help(const char *about)
{
    char message[128];
    if (!about) qw_print_screen(stdout);
    else if (!qw_print_about(stdout, about, message, sizeof message)) return qw_complain(QW_ARGUMENT, message);
    return finish_printing();
}

int main(int argc, char **argv)
{
    qw_arguments arguments;
    char message[512];
    qw_begin_tool(&argc, &argv);
    keep_memory();
    qw_ignore_write_signals();
    qw_status status = qw_parse_arguments(argc, argv, &arguments, message, sizeof message);
    if (status != QW_OK) return qw_complain(status, message);
    if (arguments.bare_memory_limit && !arguments.quiet)
        fprintf(stderr,
                "quadwright: --memory-limit %s means %sM; say so, as numbers without a unit are bytes elsewhere\n",
                arguments.bare_memory_limit, arguments.bare_memory_limit);
    if (arguments.version || arguments.command == QW_COMMAND_VERSION) {
        printf("quadwright %s\n", qw_version());
        return finish_printing();
    }
    if (qw_takes_options(arguments.command) && !arguments.quiet) qw_say_idle(stderr, &arguments);
    switch (arguments.command) {
    case QW_COMMAND_ASSET:
    case QW_COMMAND_REMESH: return qw_command_remesh(&arguments);
    case QW_COMMAND_MEASURE: return qw_command_measure(&arguments);
    case QW_COMMAND_RENDER: return qw_command_render(&arguments);
    case QW_COMMAND_BATCH: return qw_command_batch(&arguments);
    case QW_COMMAND_VERSION: break; /* above */
    case QW_COMMAND_OPTIONS: qw_print_options(stdout); break;
    case QW_COMMAND_HELP: return help(arguments.input);
    }
    return finish_printing();
}

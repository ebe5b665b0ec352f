/* Quadwright: any triangle surface in, a clean all-quad mesh out.
 *
 * The short way:
 *     qw_options options;  qw_options_init(&options);  options.faces = 5000;
 *     qw_result *result;
 *     if (qw_remesh(&input, &options, NULL, &result) == QW_OK) { ... qw_result_mesh(result) ... }
 *     else puts(qw_result_message(result));
 *     qw_result_destroy(result);
 *
 * The long way keeps a context and goes stage by stage: qw_create, qw_set_mesh, qw_run_until or qw_run, views of the
 * result, qw_destroy. docs/pipeline.md says what each stage takes and gives.
 *
 * Failure and outcome are two things. A failure is a qw_status other than QW_OK with a sentence that names the cause
 * and the element; there is then no mesh. An outcome is a finished mesh with a qw_report: what was asked, made, mended
 * and measured.
 *
 * Nothing is global. One context must not be used from two threads at a time; two contexts may. All lengths are in the
 * units of the input unless a name says otherwise. All sizes and indices are fixed width. Strings are UTF-8 and NUL
 * terminated.
 */
#ifndef QUADWRIGHT_H
#define QUADWRIGHT_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* On Windows those who use the shared library define QW_SHARED (the CMake package does); the library's own build
   defines QW_BUILDS_SHARED. */
#if defined(_WIN32) && defined(QW_BUILDS_SHARED)
#define QW_API __declspec(dllexport)
#elif defined(_WIN32) && defined(QW_SHARED)
#define QW_API __declspec(dllimport)
#elif defined(_WIN32)
#define QW_API
#elif defined(__GNUC__)
#define QW_API __attribute__((visibility("default")))
#else
#define QW_API
#endif

#define QW_VERSION_MAJOR 0
#define QW_VERSION_MINOR 1
#define QW_VERSION_PATCH 0

/* The version of the library in use, as "0.1.0". */
QW_API const char *qw_version(void);

/* ---- failures */

typedef enum qw_status {
#define QW_ERROR(name, exit_code, text) QW_##name,
#include "quadwright/errors.def"
#undef QW_ERROR
    QW_STATUS_COUNT
} qw_status;

/* Short name ("FILE_MISSING"), meaning, and the exit code of the command line tool. Any value may be passed. */
QW_API const char *qw_status_name(qw_status status);
QW_API const char *qw_status_text(qw_status status);
QW_API int qw_status_exit_code(qw_status status);

/* ---- stages */

typedef enum qw_stage {
#define QW_STAGE(name, title, source, weight) QW_STAGE_##name,
#include "quadwright/stages.def"
#undef QW_STAGE
    QW_STAGE_COUNT
} qw_stage;

QW_API const char *qw_stage_title(qw_stage stage);

/* ---- options */

typedef struct qw_options {
    uint32_t size; /* sizeof(qw_options), set by qw_options_init; guards against a mismatched library */
#define QW_OPTION_COUNT(name, initial, least, most, unit, help) int64_t name;
#define QW_OPTION_REAL(name, initial, least, most, unit, help)  double name;
#define QW_OPTION_FLAG(name, initial, help)                     int32_t name;
#define QW_OPTION_CHOICE(name, initial, last, list, help)       int32_t name;
#include "quadwright/options.def"
#undef QW_OPTION_COUNT
#undef QW_OPTION_REAL
#undef QW_OPTION_FLAG
#undef QW_OPTION_CHOICE
} qw_options;

typedef enum qw_option_kind { QW_KIND_COUNT, QW_KIND_REAL, QW_KIND_FLAG, QW_KIND_CHOICE } qw_option_kind;

typedef struct qw_option_info {
    const char *name; /* as in qw_options, for example "edge_length" */
    qw_option_kind kind;
    double initial, least, most; /* flags: 0 or 1; choices: indices */
    const char *unit;            /* "" where there is none */
    const char *choices;         /* "a|b|c" for choices, NULL for the others */
    const char *help;
} qw_option_info;

QW_API void qw_options_init(qw_options *options);
/* sizeof(qw_options) of the library in use. */
QW_API size_t qw_options_size(void);
/* Writes a sentence that names the first wrong field into message (may be NULL) and returns QW_OPTION, or returns
 * QW_OK. */
QW_API qw_status qw_options_validate(const qw_options *options, char *message, size_t message_size);
QW_API size_t qw_option_count(void);
QW_API const qw_option_info *qw_option_at(size_t index); /* NULL past the end */
/* By name; '-' and '_' are the same. Values as text: "5000", "0.5", "on", "off", "mcf". QW_OPTION for an unknown name
 * or value. */
QW_API qw_status qw_option_set(qw_options *options, const char *name, const char *value, char *message,
                               size_t message_size);
QW_API qw_status qw_option_get(const qw_options *options, const char *name, char *value, size_t value_size);

/* ---- host */

typedef enum qw_log_level { QW_LOG_DEBUG, QW_LOG_INFO, QW_LOG_WARNING } qw_log_level;

/* Everything the library asks of its host. All members are optional: zeroed ones mean the built-in way. */
typedef struct qw_host {
    /* realloc-like: block NULL allocates, new_size 0 frees and returns NULL; NULL otherwise means no memory. Called on
       the calling thread only. */
    void *(*resize)(void *user, void *block, size_t old_size, size_t new_size);
    void *resize_user;
    size_t memory_limit; /* bytes held at once; 0: no limit */

    /* Runs task(task_user, i) for i in 0..count-1 in any order, on any threads, and returns when all are done. */
    void (*parallel)(void *user, uint32_t count, void (*task)(void *task_user, uint32_t i), void *task_user);
    void *parallel_user;

    void (*log)(void *user, qw_log_level level, const char *message); /* on the calling thread */
    void *log_user;

    /* fraction: of the whole run, 0 to 1, never falling. Return 0 to go on, anything else to cancel. The first call at
       1 only says that the run is done; further ones come where a file or a pipe takes long to be written, and those
       can cancel the writing. On the calling thread. */
    int (*progress)(void *user, qw_stage stage, double fraction);
    void *progress_user;
} qw_host;

/* ---- meshes */

/* A polygon mesh owned by somebody else. Corners of face f follow those of face f - 1. */
typedef struct qw_mesh_view {
    uint32_t size; /* sizeof(qw_mesh_view) */
    uint32_t vertex_count;
    uint32_t face_count;
    uint32_t uniform_face_size; /* corners of every face when face_sizes is NULL: 3 or 4 */
    const double *positions;    /* double[vertex_count][3], finite */
    const uint32_t *face_sizes; /* uint32_t[face_count], each at least 3; NULL: uniform_face_size */
    const uint32_t *corners; /* uint32_t[sum of face sizes], each below vertex_count, counter-clockwise from outside */
    const uint32_t *marked_edges; /* uint32_t[marked_edge_count][2], each below vertex_count: sharp where sharp_marks
                                     asks for it; may be NULL */
    uint32_t marked_edge_count;   /* 0 in results */
} qw_mesh_view;

/* ---- report */

/* The figures are one table, report.def, which says of each what it is and its unit; qw_field_at reads the table. */
typedef struct qw_topology {
#define QW_TOPOLOGY_WHOLE(name, unit, help) int64_t name;
#include "quadwright/report.def"
    int64_t valence[10]; /* interior vertices by valence; the last holds 9 and more */
} qw_topology;

/* Distances are in mean edge lengths of the quad mesh. A figure that does not apply is negative. */
typedef struct qw_quality {
#define QW_QUALITY_WHOLE(name, unit, help)  int64_t name;
#define QW_QUALITY_REAL(name, unit, help)   double name;
#define QW_QUALITY_SIGNED(name, unit, help) double name;
#include "quadwright/report.def"
} qw_quality;

typedef struct qw_stage_report {
    double seconds;
    uint64_t peak_bytes; /* most held at once while the stage ran */
} qw_stage_report;

typedef struct qw_report {
    uint32_t size; /* sizeof(qw_report) */
#define QW_REPORT_WHOLE(name, unit, help) int64_t name;
#define QW_REPORT_REAL(name, unit, help)  double name;
#include "quadwright/report.def"
    qw_topology topology; /* of the result */
    uint64_t peak_bytes;
    qw_stage_report stages[QW_STAGE_COUNT];
    uint32_t warning_count;
    char warnings[16][160];
} qw_report;

/* Members of the structs above, for hosts that list or bind them. */
typedef enum qw_record { QW_RECORD_REPORT, QW_RECORD_TOPOLOGY, QW_RECORD_QUALITY } qw_record;
typedef enum qw_field_kind { QW_FIELD_WHOLE, QW_FIELD_REAL } qw_field_kind; /* int64_t, double */

typedef struct qw_field_info {
    const char *name;
    qw_field_kind kind;
    int32_t optional; /* 1: where the figure does not apply it is negative here and null in JSON */
    size_t offset;    /* bytes from the beginning of the struct */
    const char *unit; /* "-" where there is none */
    const char *help;
} qw_field_info;

/* NULL past the end, and for a record that is none. */
QW_API const qw_field_info *qw_field_at(qw_record record, size_t index);

/* What a run did, as JSON with one name a member: the text that the command line tool writes with --json. */
typedef struct qw_run_info {
    uint32_t size;            /* sizeof(qw_run_info) */
    const char *input;        /* names of files as the user gave them; NULL: null */
    const char *output;       /* the same */
    const char *const *notes; /* char *[note_count]: what the reader of the input warned of; NULL without any */
    uint32_t note_count;
    const qw_options *options; /* NULL: null, here and below */
    const qw_report *report;
    const qw_quality *quality;
} qw_run_info;

/* Each writes at most size bytes with the final NUL, and returns the length of the whole text without it, so that a
   first call with size 0 tells how much is needed. text may be NULL then. 0: an argument is missing. */
QW_API size_t qw_run_json(const qw_run_info *run, char *text, size_t size);
QW_API size_t qw_options_json(const qw_options *options, char *text, size_t size);
QW_API size_t qw_report_json(const qw_report *report, char *text, size_t size);
QW_API size_t qw_measures_json(const qw_topology *topology, const qw_quality *quality, char *text, size_t size);

/* ---- the short way */

typedef struct qw_result qw_result;

/* Remeshes input into *result. host may be NULL. *result is set even on failure (unless memory ran out at once: then
   NULL), so that its message can be read, and is always the caller's to destroy. */
QW_API qw_status qw_remesh(const qw_mesh_view *input, const qw_options *options, const qw_host *host,
                           qw_result **result);
/* Quads begin at the corner from which a cut to the third lies nearer to the input. Zero counts after a failure. */
QW_API qw_mesh_view qw_result_mesh(const qw_result *result);
QW_API const qw_report *qw_result_report(const qw_result *result); /* never NULL for a result */
QW_API const char *qw_result_message(const qw_result *result);     /* NULL result: "out of memory"; "" on success */
QW_API void qw_result_destroy(qw_result *result);                  /* NULL is allowed */

/* ---- the long way */

typedef struct qw_context qw_context;

QW_API qw_status qw_create(const qw_host *host, qw_context **context);
QW_API void qw_destroy(qw_context *context); /* NULL is allowed */
/* The sentence that belongs to the last failure in this context, or "". */
QW_API const char *qw_message(const qw_context *context);
/* Copies the mesh. Discards every earlier stage. */
QW_API qw_status qw_set_mesh(qw_context *context, const qw_mesh_view *mesh);
/* Runs the stages up to and including last that are missing or that the options have made stale. */
QW_API qw_status qw_run_until(qw_context *context, const qw_options *options, qw_stage last);
QW_API qw_status qw_run(qw_context *context, const qw_options *options);
/* Views are valid until the next call that changes the context. QW_NOT_READY before the stage has run. */
QW_API qw_status qw_get_mesh(const qw_context *context, qw_mesh_view *mesh);
QW_API const qw_report *qw_get_report(const qw_context *context);
/* Writes the state after its last finished stage to a file, and takes it up again in a context without a mesh. */
QW_API qw_status qw_dump(qw_context *context, const char *path);
QW_API qw_status qw_resume(qw_context *context, const char *path);

/* ---- files, measuring */

typedef enum qw_format { QW_FORMAT_AUTO, QW_FORMAT_OBJ, QW_FORMAT_PLY, QW_FORMAT_OFF, QW_FORMAT_STL } qw_format;

typedef struct qw_mesh qw_mesh; /* a polygon mesh that owns its arrays */

/* Reads a file of any supported format, judged by its contents; "-" reads standard input. The mesh is the caller's.
   On failure *mesh is still set (unless memory ran out) so that qw_mesh_message can be asked. */
QW_API qw_status qw_load(const char *path, const qw_host *host, qw_mesh **mesh);
QW_API qw_status qw_load_memory(const void *bytes, size_t size, const qw_host *host, qw_mesh **mesh);
QW_API qw_mesh_view qw_mesh_get(const qw_mesh *mesh);
QW_API const char *qw_mesh_message(const qw_mesh *mesh);
QW_API void qw_mesh_destroy(qw_mesh *mesh);
/* Writes through a temporary file beside the target, so that the target is whole or untouched. "-" writes standard
   output (AUTO: OBJ). Writes OBJ, PLY (binary, doubles) and OFF. message may be NULL. */
QW_API qw_status qw_save(const qw_mesh_view *mesh, const char *path, qw_format format, char *message,
                         size_t message_size);
/* The same bytes of the mesh that qw_get_mesh shows, on the context's threads. QW_NOT_READY before there is one. */
QW_API qw_status qw_save_mesh(qw_context *context, const char *path, qw_format format);

/* Fills both. against, the surface to compare with, may be NULL: then the distances are negative. */
QW_API qw_status qw_measure(const qw_mesh_view *mesh, const qw_mesh_view *against, const qw_host *host,
                            qw_topology *topology, qw_quality *quality);

#ifdef __cplusplus
}
#endif
#endif

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
 * result, qw_destroy. docs/dev/pipeline.md says what each stage takes and gives.
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
    QW_STAGE_COUNT
} qw_stage;

QW_API const char *qw_stage_title(qw_stage stage);

/* ---- options */

/* struct qw_options, field by field, and a constant for each choice, such as QW_SYMMETRY_ANY. */
#include "quadwright/options.h"

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
/* By name; '-' and '_' are the same. Values as text: "5000", "0.5", "on", "off", "mcf"; of symmetry also a plane,
 * "NX,NY,NZ,OFFSET", which is five options. QW_OPTION for an unknown name or value. */
QW_API qw_status qw_option_set(qw_options *options, const char *name, const char *value, char *message,
                               size_t message_size);
QW_API qw_status qw_option_get(const qw_options *options, const char *name, char *value, size_t value_size);

/* ---- presets */

/* What a kind of surface wants: a row of presets.def. */
typedef struct qw_preset_info {
    const char *name;     /* "scan" */
    const char *settings; /* "smoothness=4 sharp_angle=180": options and values as text, a space between */
    const char *help;
} qw_preset_info;

QW_API size_t qw_preset_count(void);
QW_API const qw_preset_info *qw_preset_at(size_t index); /* NULL past the end */
/* Sets the options that the preset names and leaves the others, so it comes after qw_options_init and before options of
 * the caller's own. QW_OPTION and a sentence (message may be NULL) for an unknown name. */
QW_API qw_status qw_options_preset(qw_options *options, const char *name, char *message, size_t message_size);

/* ---- host */

typedef enum qw_log_level { QW_LOG_DEBUG, QW_LOG_INFO, QW_LOG_WARNING } qw_log_level;

/* What a progress function returns, here and in the bindings. */
enum { QW_GO_ON = 0, QW_CANCEL = 1 };

/* The bytes of a memory limit as people write it: "512M", "4G", "1.5G", "300000K" (powers of 1024), or bytes.
 * QW_ARGUMENT and a sentence (message may be NULL) for anything else. */
QW_API qw_status qw_memory_size(const char *text, uint64_t *bytes, char *message, size_t message_size);

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

    /* fraction: of the whole run, 0 to 1, never falling. Return QW_GO_ON to go on, QW_CANCEL (anything but 0) to
       cancel. The first call at 1 only says that the run is done; further ones come where a file or a pipe takes long
       to be written, or what is asked of the result (qw_get_provenance, qw_transfer, qw_get_field) long to be found,
       and those can cancel that. qw_unwrap and qw_bake tell how far they are themselves, from 0, as stage
       QW_STAGE_COUNT, which has a title too. On the calling thread. */
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
    /* uint32_t[marked_edge_count][2], each below vertex_count: sharp where sharp_marks asks for it; may be NULL. Of
       results that were fitted to their limit surface (fit_to) its creases, and corners as a vertex with itself. */
    const uint32_t *marked_edges;
    uint32_t marked_edge_count;
} qw_mesh_view;

/* ---- density */

/* How small quads are wanted: edges a unit of length, compared with elsewhere. Where it is 2 edges are half as long as
   where it is 1, and there are four times as many quads for the same area. Only ratios count, as the number of quads
   stays the one asked for. Finite, from QW_LEAST_DENSITY to QW_MOST_DENSITY. Between two densities edges grow by a
   quarter from quad to quad; the run-up lies where quads are larger. */
typedef float qw_density;
#define QW_LEAST_DENSITY 1e-3f
#define QW_MOST_DENSITY  1e3f
typedef enum qw_domain { QW_PER_VERTEX, QW_PER_CORNER, QW_PER_FACE } qw_domain;

/* ---- steering: a cross field, guides */

/* A cross field on the input: one direction of each cross, whose others are its quarter turns in the tangent plane. */
typedef struct qw_cross_field {
    uint32_t size;           /* sizeof(qw_cross_field) */
    qw_domain domain;        /* QW_PER_VERTEX or QW_PER_FACE */
    uint32_t count;          /* elements: all vertices or all faces of the mesh */
    const float *directions; /* float[count][3], finite, of any length; 0 0 0 where the field says nothing */
} qw_cross_field;

typedef enum qw_guide_kind {
    QW_GUIDE_DIRECTION, /* quads run along it */
    QW_GUIDE_LOOP       /* edges of the result lie on it */
} qw_guide_kind;

/* A polyline on the surface or near it: no farther than half an edge of the quads. */
#define QW_MOST_RINGS 1000
typedef struct qw_guide {
    uint32_t size; /* sizeof(qw_guide) */
    qw_guide_kind kind;
    int32_t closed;       /* 1: the last point is joined to the first */
    uint32_t point_count; /* 2 and more; 3 and more where it is closed */
    const double *points; /* double[point_count][3], finite */
    uint32_t rings;       /* of a closed loop: rings of quads wanted on each side of it, up to QW_MOST_RINGS; or 0 */
} qw_guide;

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

/* A feature curve, or a piece of one, that the quads do not follow. */
typedef struct qw_curve_note {
    double at[3];     /* the middle of one of its edges, in the coordinates of the input */
    double length;    /* in wanted edges */
    char verdict[16]; /* "merged" with a stronger curve beside it, "let go" as a loose end shorter than the quads,
                         "shortened" at an acute corner, "bent" by the integers */
} qw_curve_note;

typedef struct qw_report {
    uint32_t size; /* sizeof(qw_report) */
#define QW_REPORT_WHOLE(name, stage, unit, help) int64_t name;
#define QW_REPORT_REAL(name, stage, unit, help)  double name;
#include "quadwright/report.def"
    qw_topology topology; /* of the result */
    uint64_t peak_bytes;
    qw_stage_report stages[QW_STAGE_COUNT];
    uint32_t warning_count;
    char warnings[16][160];
    uint32_t curve_count;     /* of curves, 16 at most: the longest */
    qw_curve_note curves[16]; /* by their lengths */
} qw_report;

/* ---- where the result lies on the input */

#define QW_NO_FACE UINT32_MAX /* nothing of the input that is near faces the same way */

/* A point of the input's surface: on a triangle between three corners of a face. */
typedef struct qw_origin {
    uint32_t face;      /* of the input, as the caller counted them, whatever cleaning did; or QW_NO_FACE */
    uint32_t corner[3]; /* corners of that face, counted from 0 within it: 0, 1, 2 where it is a triangle */
    float weight[3];    /* barycentric, for these corners: 0 to 1, and 1 together */
} qw_origin;

/* A vertex lies at the nearest point that faces as the quads around it do and is of the component that they were made
 * of; a corner on the side of its own quad, where the surface has a sharp edge or an attribute a seam. */
typedef struct qw_provenance {
    uint32_t size; /* sizeof(qw_provenance) */
    uint32_t vertex_count, corner_count;
    uint32_t lost_vertices, lost_corners; /* with QW_NO_FACE */
    double farthest;           /* distance of a vertex that was found to its place on the input, at the most */
    const qw_origin *vertices; /* qw_origin[vertex_count] */
    const qw_origin *corners;  /* qw_origin[corner_count]: of the quads' corners, in their order */
} qw_provenance;

/* ---- attributes */

typedef enum qw_attribute_kind {
    QW_VALUES,  /* interpolated as they are: colours, shape keys, anything */
    QW_NORMALS, /* 3 components: interpolated, of unit length, turned to the quads' side */
    QW_UVS,     /* 2 or 3 components; charts are bounded by edges at which they differ */
    QW_WEIGHTS, /* of `components` pairs of a group and a weight: blended, the largest kept, 1 together */
    QW_LABELS   /* integers, never mixed: those of most of a quad's area, or of the nearest corner */
} qw_attribute_kind;

enum { QW_MOST_COMPONENTS = 16 };

/* Types of PLY. Colours ("color") are 0 to 1 in memory, and 0 to 255 in files where they are held as QW_UINT8. */
typedef enum qw_storage {
    QW_FLOAT32,
    QW_FLOAT64,
    QW_INT8,
    QW_UINT8,
    QW_INT16,
    QW_UINT16,
    QW_INT32,
    QW_UINT32
} qw_storage;

typedef struct qw_attribute {
    uint32_t size;    /* sizeof(qw_attribute) */
    const char *name; /* not empty */
    qw_domain domain; /* QW_UVS and QW_NORMALS: vertices or corners; QW_WEIGHTS: vertices */
    qw_attribute_kind kind;
    uint32_t components;            /* 1 to QW_MOST_COMPONENTS; QW_LABELS: 1 */
    uint32_t count;                 /* elements: vertices, corners or faces of the mesh, all of them */
    const float *values;            /* float[count][components], finite; NULL for labels */
    const uint32_t *group;          /* uint32_t[count][components]: QW_WEIGHTS only; weight 0 where there is none */
    const int32_t *labels;          /* int32_t[count]: QW_LABELS only */
    const char *const *label_names; /* char *[label_count]: names of labels 0, 1, ...; may be NULL */
    uint32_t label_count;           /* where there are names each label is below it, or -1: none */
    qw_storage storage;             /* how PLY files hold the numbers */
} qw_attribute;

/* Normals of the result for shading. */
typedef enum qw_shading {
    QW_SHADING_SMOOTH, /* by vertices: the mean of the quads around, weighted by their angles */
    QW_SHADING_SPLIT   /* by corners: the same, split by the sharp edges that were kept */
} qw_shading;

/* What was carried over. */
typedef struct qw_transfer_report {
    uint32_t size;             /* sizeof(qw_transfer_report) */
    uint32_t charts;           /* of all sets of texture coordinates */
    uint32_t straddling_quads; /* more than a tenth of which lies beyond a seam: they took the chart of most of their
                                  area */
    uint32_t filled_vertices, filled_corners, filled_faces; /* found nothing near and were filled in from neighbours */
    uint32_t dropped_weights;                               /* influences beyond the most that were asked for */
} qw_transfer_report;

/* ---- assets: texture coordinates of the result's own, and maps of what the input looks like: docs/asset.md */

typedef struct qw_asset_options {
    uint32_t size; /* sizeof(qw_asset_options), set by qw_asset_options_init */
#define QW_ASSET_COUNT(name, initial, least, most, unit, help) int64_t name;
#define QW_ASSET_REAL(name, initial, least, most, unit, help)  double name;
#include "quadwright/asset.def"
} qw_asset_options;

QW_API void qw_asset_options_init(qw_asset_options *options);
/* As qw_options_validate, qw_option_count, qw_option_at, qw_option_set and qw_option_get. */
QW_API qw_status qw_asset_options_validate(const qw_asset_options *options, char *message, size_t message_size);
QW_API size_t qw_asset_option_count(void);
QW_API const qw_option_info *qw_asset_option_at(size_t index);
QW_API qw_status qw_asset_option_set(qw_asset_options *options, const char *name, const char *value, char *message,
                                     size_t message_size);
QW_API qw_status qw_asset_option_get(const qw_asset_options *options, const char *name, char *value, size_t value_size);

/* What a map holds. Colours are sRGB, all else is linear. */
typedef enum qw_map {
    QW_MAP_COLOR,     /* base colour, with alpha where a material of the input has it */
    QW_MAP_NORMAL,    /* in tangent space, green upward: glTF's, of MikkTSpace's tangents */
    QW_MAP_ORM,       /* occlusion, roughness, metallic, of the input's materials */
    QW_MAP_EMISSION,  /* of the input's materials */
    QW_MAP_OCCLUSION, /* ambient occlusion of the input's shape */
    QW_MAP_HEIGHT,    /* of the input above the quads: 16 bits, the middle is 0, as far as height_scale of the report */
    QW_MAP_COUNT
} qw_map;
/* Instead of bits 1 << QW_MAP_...: normals, and what the input's materials, textures and colours have. */
#define QW_MAPS_OF_INPUT 0u
QW_API const char *qw_map_name(qw_map map); /* "color", "normal", ...; NULL: there is none */
/* Maps in words, as hosts take them: "input", "all", or names with commas between them, to what qw_bake takes.
   QW_ARGUMENT with a sentence for other words. */
QW_API qw_status qw_maps_named(const char *text, uint32_t *maps, char *message, size_t message_size);

typedef struct qw_image {
    uint32_t size; /* sizeof(qw_image) */
    qw_map map;
    uint32_t tile;                          /* from 0 */
    uint32_t width, height, channels, bits; /* bits: 8 or 16 of each channel */
    const void *pixels; /* uint8_t or uint16_t[height][width][channels]; the upper row, v = 1, first */
} qw_image;

/* A figure that does not apply is negative. */
typedef struct qw_asset_report {
    uint32_t size; /* sizeof(qw_asset_report) */
#define QW_MAPS_WHOLE(name, unit, help) int64_t name;
#define QW_MAPS_REAL(name, unit, help)  double name;
#include "quadwright/report.def"
} qw_asset_report;

/* ---- reports in words */

/* Members of the structs above, for hosts that list or bind them. */
typedef enum qw_record { QW_RECORD_REPORT, QW_RECORD_TOPOLOGY, QW_RECORD_QUALITY, QW_RECORD_ASSET } qw_record;
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
    const qw_transfer_report *transfer; /* NULL: nothing is said of attributes */
    const qw_asset_report *asset;       /* NULL: nothing is said of maps */
} qw_run_info;

/* Each writes at most size bytes with the final NUL, and returns the length of the whole text without it, so that a
   first call with size 0 tells how much is needed. text may be NULL then. 0: an argument is missing. */
QW_API size_t qw_run_json(const qw_run_info *run, char *text, size_t size);
QW_API size_t qw_options_json(const qw_options *options, char *text, size_t size);
QW_API size_t qw_report_json(const qw_report *report, char *text, size_t size);
QW_API size_t qw_asset_json(const qw_asset_report *report, char *text, size_t size);
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
/* As qw_get_provenance and qw_transfer; what they give is valid as long as the result. */
QW_API qw_status qw_result_provenance(qw_result *result, qw_provenance *provenance);
QW_API qw_status qw_result_transfer(qw_result *result, const qw_attribute *attributes, uint32_t count,
                                    uint32_t most_weights, const qw_attribute **transferred,
                                    qw_transfer_report *report);
QW_API void qw_result_destroy(qw_result *result); /* NULL is allowed */

/* ---- the long way */

typedef struct qw_context qw_context;

QW_API qw_status qw_create(const qw_host *host, qw_context **context);
QW_API void qw_destroy(qw_context *context); /* NULL is allowed */
/* The sentence that belongs to the last failure in this context, or "". */
QW_API const char *qw_message(const qw_context *context);
/* Copies the mesh. Discards every earlier stage. */
QW_API qw_status qw_set_mesh(qw_context *context, const qw_mesh_view *mesh);
/* Paints a density on the mesh of the context, one number for each of its vertices, in their order: copied; linear
   on faces. NULL, 0 takes it away. Beside `adaptive`, if that is set, both count. Discards the stages that depend on
   it. QW_NOT_READY before there is a mesh; QW_ARGUMENT, with the vertex named, for another count, and for densities
   that are none. */
QW_API qw_status qw_set_density(qw_context *context, const qw_density *density, uint32_t count);
/* The field that crosses are to follow, copied; NULL takes it away. Curves (sharp edges, boundaries that are aligned)
 * keep theirs. Discards the stages. QW_ARGUMENT, with the element named, where the count is not the mesh's or a
 * direction of a face stands more than 30 degrees off it; QW_NOT_FINITE; QW_NOT_READY before there is a mesh. */
QW_API qw_status qw_set_field(qw_context *context, const qw_cross_field *field);
/* The field of the last run at the vertices or faces of the input: each direction of unit length, or 0 0 0 for elements
 * without an area. Where a field of this domain was set, that one. Valid until the next call that changes the context.
 * QW_NOT_READY before the orientation field is there. */
QW_API qw_status qw_get_field(qw_context *context, qw_domain domain, qw_cross_field *field);
/* Both as files (.rosy): docs/steering.md. */
QW_API qw_status qw_load_field(qw_context *context, const char *path);
QW_API qw_status qw_save_field(qw_context *context, qw_domain domain, const char *path);
/* Guides, copied; NULL, 0 takes them away. Discards the stages. A guide that is off the surface is refused by the run,
 * which knows how large the quads are. */
QW_API qw_status qw_set_guides(qw_context *context, const qw_guide *guides, uint32_t count);
/* The same from an OBJ file of lines: docs/steering.md. */
QW_API qw_status qw_load_guides(qw_context *context, const char *path);
/* How the mesh of the context moves, which the option follow_motion heeds: out of its attributes, of which QW_WEIGHTS
 * and morph targets count, which are QW_VALUES of vertices with three components and a name that begins with "target:",
 * how far each moves a vertex. NULL, 0: it does not. Discards the stages where that is news. QW_ARGUMENT and
 * QW_NOT_FINITE as of qw_transfer; QW_NOT_READY before there is a mesh. */
QW_API qw_status qw_set_motion(qw_context *context, const qw_attribute *attributes, uint32_t count);
/* Remeshes only the faces of the mesh that are inside, 1, not those that are not, 0: copied; NULL, 0 takes it away. The
 * boundary between them stays exactly as it is, as with fix_boundary, which this implies; the result is the quads of
 * the inside, joined to the other polygons, which come last, in their order. Discards the stages. QW_NOT_READY before
 * there is a mesh; QW_ARGUMENT where the count is not the mesh's, a number is neither, or no face is inside. */
QW_API qw_status qw_set_region(qw_context *context, const uint8_t *inside, uint32_t count);
/* Runs the stages up to and including last that are missing or that the options have made stale. */
QW_API qw_status qw_run_until(qw_context *context, const qw_options *options, qw_stage last);
QW_API qw_status qw_run(qw_context *context, const qw_options *options);
/* Views are valid until the next call that changes the context. QW_NOT_READY before the stage has run. */
QW_API qw_status qw_get_mesh(const qw_context *context, qw_mesh_view *mesh);
/* Level 0 of a result that was split (the option subdivide): its vertices come first among those of the result, and
   quad f there became the quads f 4^k to (f + 1) 4^k - 1 of the result, in four at the first, second, ... corner each
   time. The result itself where it was not. */
QW_API qw_status qw_get_coarse(const qw_context *context, qw_mesh_view *mesh);
QW_API const qw_report *qw_get_report(const qw_context *context);
/* Found at the first call. Valid until the next run, mesh or qw_resume. */
QW_API qw_status qw_get_provenance(qw_context *context, qw_provenance *provenance);
/* Carries attributes of the input over to the result: *transferred is qw_attribute[count], in the same order, with the
 * same names and domains (but QW_UVS, which come by corners), valid as the provenance is. most_weights: pairs kept of
 * QW_WEIGHTS, 1 to 16; 0: as many as came in. report may be NULL. QW_ARGUMENT for wrong lengths, kinds and labels,
 * QW_NOT_FINITE; nothing is carried over then. */
QW_API qw_status qw_transfer(qw_context *context, const qw_attribute *attributes, uint32_t count, uint32_t most_weights,
                             const qw_attribute **transferred, qw_transfer_report *report);
/* Cuts the result into charts along edges of its faces, lays them flat and packs them: *uv is an attribute of the
 * result by corners, "uv", valid as the provenance is, until the next such call. Edges that are sharp, and borders
 * between faces of unlike labels in `borders` (int32_t[faces], may be NULL), are seams. report may be NULL. QW_OPTION
 * for wrong options, QW_ARGUMENT where the charts do not fit. */
QW_API qw_status qw_unwrap(qw_context *context, const qw_asset_options *options, const int32_t *borders,
                           qw_attribute *uv, qw_asset_report *report);
/* *normals is an attribute of the result, "normal", valid as the provenance is. After qw_bake QW_SHADING_SPLIT gives
 * those that the maps bend: the input's, in the mean around each vertex. */
QW_API qw_status qw_get_normals(qw_context *context, qw_shading shading, qw_attribute *normals);
/* *filled is an attribute of the result, labels "filled" by faces, valid as the provenance is: "filled" (1) where a
 * face lies in a hole that `fill_holes` closed, "surface" (0) elsewhere. */
QW_API qw_status qw_get_filled(qw_context *context, qw_attribute *filled);
/* Writes the state after its last finished stage to a file, and takes it up again in a context without a mesh. */
QW_API qw_status qw_dump(qw_context *context, const char *path);
QW_API qw_status qw_resume(qw_context *context, const char *path);

/* ---- files, measuring */

typedef enum qw_format {
    QW_FORMAT_AUTO,
    QW_FORMAT_OBJ,
    QW_FORMAT_PLY,
    QW_FORMAT_OFF,
    QW_FORMAT_STL,
    QW_FORMAT_GLB,
    QW_FORMAT_GLTF,
    /* for simulation, written only: Gmsh MSH 4.1, VTK VTU, Abaqus INP, Nastran BDF */
    QW_FORMAT_MSH,
    QW_FORMAT_VTU,
    QW_FORMAT_INP,
    QW_FORMAT_BDF
} qw_format;

typedef struct qw_mesh qw_mesh; /* a polygon mesh that owns its arrays */

/* Reads a file of any supported format, judged by its contents; "-" reads standard input. The mesh is the caller's.
   On failure *mesh is still set (unless memory ran out) so that qw_mesh_message can be asked. */
QW_API qw_status qw_load(const char *path, const qw_host *host, qw_mesh **mesh);
QW_API qw_status qw_load_memory(const void *bytes, size_t size, const qw_host *host, qw_mesh **mesh);
/* Several files as one mesh, so that they share one square of texture coordinates and one set of maps (qw_unwrap,
   qw_bake): each is an object, the label "object", named as its file is without folder and ending. Texture coordinates,
   normals, colours and materials come along, all else stays behind. */
QW_API qw_status qw_load_together(const char *const *paths, uint32_t count, const qw_host *host, qw_mesh **mesh);
/* The caller's own arrays, attributes (NULL, 0: none) and mtllib (NULL: none) as a mesh, for qw_mesh_mark,
   qw_mesh_region and qw_mesh_save. source: the mesh of the file that they come from, for what qw_save_from writes;
   NULL: none. Nothing is copied: all of it must live, and stay as it is, as long as the mesh. On failure as qw_load;
   QW_ARGUMENT, with the element named, for attributes that do not fit the mesh. */
QW_API qw_status qw_mesh_wrap(const qw_mesh_view *view, const qw_attribute *attributes, uint32_t count,
                              const char *library, const qw_mesh *source, const qw_host *host, qw_mesh **mesh);
QW_API qw_mesh_view qw_mesh_get(const qw_mesh *mesh);
/* What the file says of vertices, corners and faces beyond their positions: qw_attribute[*count], as long as the mesh.
   OBJ: "uv", "normal", "color", and the labels "object", "group", "material", "smoothing"; PLY: "uv", "normal",
   "color", and all other properties by their names; OFF: "color"; glTF: docs/attributes.md. */
QW_API const qw_attribute *qw_mesh_attributes(const qw_mesh *mesh, uint32_t *count);
/* Marks, instead of the edges that are marked, those at which attributes of these names differ between two faces:
   "uv,material,group" keeps seams of the texture and borders of materials and groups where options.keep_marks is set.
   QW_ARGUMENT where the mesh has none of a name. *edges, which may be NULL: how many are marked. */
QW_API qw_status qw_mesh_mark(qw_mesh *mesh, const char *names, uint32_t *edges);
/* The faces that have a label, as qw_set_region takes them: uint8_t[faces of the mesh] into inside. label: "arm", a
   name in any attribute of labels by faces, or "group=arm", in that one; for labels without names (PLY) their number,
   "part=3". Material, group and object names are those of OBJ. QW_ARGUMENT, with the labels that there are, where no
   face has it. */
QW_API qw_status qw_mesh_region(qw_mesh *mesh, const char *label, uint8_t *inside);
QW_API const char *qw_mesh_library(const qw_mesh *mesh); /* OBJ: its mtllib, a line each; NULL: none */
/* Writes a mesh with its attributes: the bytes of qw_save_with. */
QW_API qw_status qw_mesh_save(qw_mesh *mesh, const char *path, qw_format format);
QW_API const char *qw_mesh_message(const qw_mesh *mesh);
QW_API void qw_mesh_destroy(qw_mesh *mesh);
/* Writes through a temporary file beside the target, so that the target is whole or untouched. "-" writes standard
   output (AUTO: OBJ). Writes OBJ, PLY (binary, doubles), OFF, GLB, and glTF with its buffer in the file. message may be
   NULL. */
QW_API qw_status qw_save(const qw_mesh_view *mesh, const char *path, qw_format format, char *message,
                         size_t message_size);
/* The same bytes of the mesh that qw_get_mesh shows, on the context's threads. QW_NOT_READY before there is one. */
QW_API qw_status qw_save_mesh(qw_context *context, const char *path, qw_format format);
/* The same with attributes of the result (from qw_transfer, or the caller's own), as far as the format holds them: OBJ
   as qw_mesh_attributes tells, PLY all but weights and normals by corners, OFF "color". Faces are grouped by the labels
   of faces, in the order of the attributes. library: NULL, or the mtllib of an OBJ. */
QW_API qw_status qw_save_with(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *library,
                              const char *path, qw_format format);
/* As qw_save_with, with what the file of source holds beside its surface: the mtllib of an OBJ; nodes, materials,
   textures, images, skins, animations and all extensions of a glTF file, for GLB and glTF. The attributes are those of
   source, transferred: the labels "object" and "material" name its nodes and materials. source may be NULL. */
QW_API qw_status qw_save_from(qw_context *context, const qw_attribute *attributes, uint32_t count,
                              const qw_mesh *source, const char *path, qw_format format);
/* Levels of detail: after each run of a context with another count of options, the result with these attributes (as for
   qw_save_with; copied) as a mesh of its own, which outlives the context; then all of them, the finest first, in one
   file of glTF with a node a level, of which the first names the others (MSFT_lod). What depends on the surface alone
   is done once. source: the mesh whose attributes they have, transferred: of a glTF file its materials, textures and
   images come along, not its nodes, skins and animations, as a level is one node; else, or NULL: materials go by their
   names. A level whose maps were baked (qw_bake) keeps them, and a material of its own, and so do all of the file then.
   QW_UNSUPPORTED for other formats, which hold one mesh. */
QW_API qw_status qw_take_level(qw_context *context, const qw_attribute *attributes, uint32_t count, qw_mesh **level);
QW_API qw_status qw_save_levels(const qw_mesh *const *levels, uint32_t count, const qw_mesh *source, const char *path,
                                qw_format format, char *message, size_t message_size);
/* The same for simulation, MSH, VTU, INP or BDF, of a result that was split once: each four quads as one of second
   order with eight nodes, those of its sides on the surface. QW_ARGUMENT where it was split otherwise. */
QW_API qw_status qw_save_second_order(qw_context *context, const qw_attribute *attributes, uint32_t count,
                                      const char *path, qw_format format);
/* The limit surface of the result, or of what was split, as STEP text (AP214): a bicubic patch a quad, joined along
   their edges; closed components are solids. Best with fit_to limit. QW_ARGUMENT where polygons of the input were left
   out. */
QW_API qw_status qw_save_patches(qw_context *context, const char *path);
/* The same with large patches: the lines that leave irregular vertices straight on, and sharp edges, cut the quads into
   blocks, each of which is one B-spline surface; those on one plane, cylinder or cone of a designed part are one face
   on it. Of quads where these are no grids.
 */
typedef enum { QW_PATCHES_OF_QUADS, QW_PATCHES_OF_BLOCKS } qw_patches_from;
QW_API qw_status qw_save_patches_from(qw_context *context, const char *path, qw_patches_from from);
/* Where the result lies on the input, as JSON where the path ends in .json, else binary: docs/attributes.md. Faces in
   the order in which qw_save_with writes them with these attributes (NULL, 0: in their own). */
QW_API qw_status qw_save_provenance(qw_context *context, const qw_attribute *attributes, uint32_t count,
                                    const char *path);

/* Loads points without faces (PLY, PCD, XYZ, the vertices of an OBJ) as a soup of triangles that join each point to its
   neighbours: no surface by itself, but one for the option wrap. Attributes of the points are kept. Fails with
   QW_NO_FACES where there are fewer than three points. */
QW_API qw_status qw_load_points(const char *path, const qw_host *host, qw_mesh **mesh);
QW_API qw_status qw_load_points_memory(const void *bytes, size_t size, const qw_host *host, qw_mesh **mesh);
/* The same of the caller's points, double[point_count][3], and attributes of theirs, qw_attribute[count] or NULL; the
   mesh refers to both. */
QW_API qw_status qw_mesh_of_points(const double *positions, uint32_t point_count, const qw_attribute *attributes,
                                   uint32_t count, const qw_host *host, qw_mesh **mesh);
/* Cuts a loaded mesh to triangles of what is seen from outside, through gaps wider than this share of the diagonal of
   its box (0: 1/200), to the precision of as much: what others hide is gone, to measure against the rest. Its
   attributes are gone too. */
QW_API qw_status qw_mesh_visible(qw_mesh *mesh, double distance);
/* The mesh, of quads, with each split in four so many times (0 to QW_MOST_SPLITS) and all vertices on the limit surface
   of Catmull and Clark's rule: marked edges are infinitely sharp creases as boundaries are, a vertex marked with itself
   is a corner. As for qw_load, *limit is the caller's and tells what was wrong. QW_ARGUMENT for other polygons, and for
   edges of more than two of them. */
enum { QW_MOST_SPLITS = 8 };
QW_API qw_status qw_limit(const qw_mesh_view *cage, uint32_t times, const qw_host *host, qw_mesh **limit);
/* After qw_unwrap: what the input looks like, in maps on these texture coordinates. source: the mesh of the file that
 * the context's mesh came from, with its materials, textures and attributes; NULL: its shape alone. maps: bits, or
 * QW_MAPS_OF_INPUT. *images is qw_image[*count], by tile, then map, valid as the texture coordinates are. report may be
 * NULL. Textures that cannot be read are left out, with a warning. */
QW_API qw_status qw_bake(qw_context *context, const qw_mesh *source, uint32_t maps, const qw_image **images,
                         uint32_t *count, qw_asset_report *report);
/* After qw_unwrap and qw_bake: writes the result with these texture coordinates, normals and maps as one material. GLB
 * and glTF hold the pictures and tangents, and triangles as they were baked; beside OBJ lie an MTL and PNG files, and
 * quads stay quads. attributes: of the result, as for qw_save_with; their texture coordinates, normals and materials
 * are left out. */
QW_API qw_status qw_save_asset(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *path,
                               qw_format format);

/* Fills both. against, the surface to compare with, may be NULL: then the distances are negative. */
QW_API qw_status qw_measure(const qw_mesh_view *mesh, const qw_mesh_view *against, const qw_host *host,
                            qw_topology *topology, qw_quality *quality);
/* The result of the context's last run against its input, as its report has it: where the input was wrapped, against
 * what of it is seen from outside. Whether quads are flipped is judged by the surface that they were made of: parts
 * that were inside out are turned outward there, and where positions were mirrored at a plane of symmetry its
 * reflection is there too. */
QW_API qw_status qw_measure_result(const qw_context *context, const qw_mesh_view *against, const qw_host *host,
                                   qw_topology *topology, qw_quality *quality);
/* qw_measure against what of the surface is seen from outside, through gaps wider than this length (0: against all of
 * it). Of a wrapped result it is the row wrap_distance of its report. Fails with QW_TOO_LARGE where gaps are too narrow
 * for the surface. */
QW_API qw_status qw_measure_seen(const qw_mesh_view *mesh, const qw_mesh_view *against, double gap, const qw_host *host,
                                 qw_topology *topology, qw_quality *quality);

#ifdef __cplusplus
}
#endif
#endif

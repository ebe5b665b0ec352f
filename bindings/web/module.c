/* The C half of the WebAssembly module: sessions over the public API, and the tables of the library. core.js in the
 * package is its other half, which alone calls what is exported here.
 *
 * A session holds one surface, from a file or from arrays, with its attributes, and the context in which it is remeshed
 * as often as is wanted. Memory that JavaScript has filled is allocated by web_alloc; functions that say so take it
 * over, in failure too. Texts are UTF-8 and valid until the next call on the session. All calls come from one thread;
 * others help with the library's tasks (team.h).
 *
 * Files are written to descriptor 1, whose bytes core.js collects: there is no file system.
 */
#include "team.h"

#include "quadwright/quadwright.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define EXPORT(name)   __attribute__((export_name(#name))) name
#define IMPORT(member) __attribute__((import_module("host"), import_name(member)))

/* Of JavaScript: returns other than 0 to cancel. */
IMPORT("progress") int host_progress(int stage, double fraction);
IMPORT("note") void host_note(int level, const char *message);

enum { MOST_ATTRIBUTES = 64, MOST_NOTES = 16, NOTE_SIZE = 256 };

typedef struct session {
    qw_context *context;
    qw_mesh *file;      /* where the surface came from a file, or of points; else NULL */
    bool is_moving;     /* its attributes have said how it moves */
    bool of_points;     /* its triangles only join points: it is no surface before it is wrapped */
    qw_mesh_view input; /* of the file, or of the arrays below */
    void *array[4];     /* owned: positions, corners, face sizes, marks; each may be NULL */

    qw_attribute given[MOST_ATTRIBUTES]; /* of surfaces from arrays; name, values, group and labels are owned */
    uint32_t given_count;

    const qw_attribute *carried; /* qw_attribute[carried_count]: of the result; NULL before web_carry */
    uint32_t carried_count;
    qw_transfer_report transfer;

    qw_attribute *marked;  /* qw_attribute[carried_count]: with the marks of closed holes; NULL: none */
    qw_attribute *normals; /* of own, those that maps bend */
    qw_attribute *own;     /* qw_attribute[carried_count]: with texture coordinates of the result's own; NULL: none */
    const qw_image *image; /* qw_image[images]: maps of the result; NULL: none were baked */
    uint32_t images;
    qw_asset_report asset;
    qw_asset_options of_asset;

    qw_options options;
    char notes[MOST_NOTES][NOTE_SIZE]; /* what the reader warned of */
    uint32_t note_count;
    char message[512]; /* of the last failure, or "" */
    char *text;        /* the last report */
} session;

/* ---- hooks */

static int tell_progress(void *user, qw_stage stage, double fraction)
{
    (void)user;
    return host_progress((int)stage, fraction);
}

static void tell_note(void *user, qw_log_level level, const char *message)
{
    (void)user;
    host_note((int)level, message);
}

static void keep_note(void *user, qw_log_level level, const char *message)
{
    session *s = user;
    tell_note(NULL, level, message);
    if (level == QW_LOG_WARNING && s->note_count < MOST_NOTES)
        snprintf(s->notes[s->note_count++], NOTE_SIZE, "%s", message);
}

static qw_host host_of(session *s)
{
    return (qw_host){
        .parallel = team_run, .log = tell_note, .log_user = s, .progress = tell_progress, .progress_user = s};
}

static int fail(session *s, qw_status status, const char *message)
{
    snprintf(s->message, sizeof s->message, "%s", message);
    return (int)status;
}

static int settle(session *s, qw_status status)
{
    return fail(s, status, status == QW_OK ? "" : qw_message(s->context));
}

/* ---- memory and sessions */

void *EXPORT(web_alloc)(size_t size) { return malloc(size ? size : 1); }
void EXPORT(web_free)(void *block) { free(block); }

/* memory_limit: bytes that the context may hold at once; 0: no limit but that of the address space. NULL: no memory. */
session *EXPORT(web_open)(size_t memory_limit)
{
    session *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    qw_host host = host_of(s);
    host.memory_limit = memory_limit;
    if (qw_create(&host, &s->context) == QW_OK) return s;
    free(s);
    return NULL;
}

static void drop_result(session *s)
{
    free(s->own), free(s->marked);
    s->own = s->marked = NULL, s->image = NULL, s->images = 0;
    s->carried = NULL, s->carried_count = 0, s->transfer = (qw_transfer_report){0};
}

static void drop_surface(session *s)
{
    drop_result(s);
    qw_mesh_destroy(s->file);
    for (int i = 0; i < 4; i++) free(s->array[i]);
    for (uint32_t i = 0; i < s->given_count; i++) {
        free((void *)s->given[i].name), free((void *)s->given[i].values);
        free((void *)s->given[i].group), free((void *)s->given[i].labels);
    }
    s->file = NULL, s->of_points = s->is_moving = false, s->input = (qw_mesh_view){.size = sizeof s->input};
    memset(s->array, 0, sizeof s->array);
    s->given_count = s->note_count = 0;
}

void EXPORT(web_close)(session *s)
{
    drop_surface(s);
    qw_destroy(s->context);
    free(s->text);
    free(s);
}

const char *EXPORT(web_message)(const session *s) { return s->message; }

/* ---- the surface */

/* bytes: taken over. */
int EXPORT(web_take_file)(session *s, void *bytes, size_t size)
{
    drop_surface(s);
    qw_host host = host_of(s);
    host.log = keep_note;
    qw_status status = qw_load_memory(bytes, size, &host, &s->file);
    bool may_be_points = status == QW_NO_FACES || status == QW_FORMAT_UNKNOWN || status == QW_FORMAT_SYNTAX ||
                         status == QW_FORMAT_TRUNCATED || status == QW_INDEX_RANGE;
    qw_mesh *points = NULL;
    if (may_be_points && qw_load_points_memory(bytes, size, &host, &points) == QW_OK) {
        qw_mesh_destroy(s->file);
        s->file = points, s->of_points = true, status = QW_OK, s->note_count = 0;
    } else {
        qw_mesh_destroy(points);
    }
    free(bytes);
    if (status != QW_OK) return fail(s, status, qw_mesh_message(s->file));
    s->input = qw_mesh_get(s->file);
    return settle(s, qw_set_mesh(s->context, &s->input));
}

/* All arrays are taken over: double[vertices][3], uint32_t[corners], uint32_t[faces] or NULL, uint32_t[marks][2] or
 * NULL. face_size: of every face where sizes is NULL. */
int EXPORT(web_take_arrays)(session *s, double *positions, uint32_t vertices, uint32_t *corners, uint32_t faces,
                            uint32_t face_size, uint32_t *sizes, uint32_t *marks, uint32_t mark_count)
{
    drop_surface(s);
    s->array[0] = positions, s->array[1] = corners, s->array[2] = sizes, s->array[3] = marks;
    s->input = (qw_mesh_view){.size = sizeof s->input,
                              .vertex_count = vertices,
                              .face_count = faces,
                              .uniform_face_size = sizes ? 0 : face_size,
                              .positions = positions,
                              .face_sizes = sizes,
                              .corners = corners,
                              .marked_edges = mark_count ? marks : NULL,
                              .marked_edge_count = mark_count};
    return settle(s, qw_set_mesh(s->context, &s->input));
}

/* Points without faces: double[points][3], taken over. */
int EXPORT(web_take_points)(session *s, double *positions, uint32_t points)
{
    drop_surface(s);
    s->array[0] = positions;
    qw_host host = host_of(s);
    qw_status status = qw_mesh_of_points(positions, points, NULL, 0, &host, &s->file);
    if (status != QW_OK) return fail(s, status, qw_mesh_message(s->file));
    s->input = qw_mesh_get(s->file), s->of_points = true;
    return settle(s, qw_set_mesh(s->context, &s->input));
}

int EXPORT(web_is_points)(const session *s) { return s->of_points; }

/* The sides at which attributes of these names ("uv,material") differ become marks. */
int EXPORT(web_mark)(session *s, const char *names)
{
    if (!s->file) return fail(s, QW_ARGUMENT, "only surfaces of files have attributes to mark");
    qw_status status = qw_mesh_mark(s->file, names, NULL);
    if (status != QW_OK) return fail(s, status, qw_mesh_message(s->file));
    s->input = qw_mesh_get(s->file);
    return settle(s, qw_set_mesh(s->context, &s->input));
}

/* An attribute of a surface from arrays; name and data (floats, or int32_t where kind is QW_LABELS) are taken over, and
 * group, NULL but for QW_WEIGHTS. */
int EXPORT(web_add_attribute)(session *s, char *name, int domain, int kind, uint32_t components, uint32_t count,
                              void *data, uint32_t *group)
{
    if (s->given_count == MOST_ATTRIBUTES) {
        free(name), free(data), free(group);
        return fail(s, QW_ARGUMENT, "more than 64 attributes");
    }
    s->is_moving = false;
    qw_attribute *a = &s->given[s->given_count++];
    *a = (qw_attribute){.size = sizeof *a,
                        .name = name,
                        .domain = (qw_domain)domain,
                        .kind = (qw_attribute_kind)kind,
                        .components = components,
                        .count = count,
                        .group = group,
                        .storage = kind == QW_LABELS ? QW_INT32 : QW_FLOAT32};
    if (kind == QW_LABELS) a->labels = data;
    else a->values = data;
    return fail(s, QW_OK, "");
}

/* ---- steering: each takes over what it is given, and NULL, 0 takes away what was set */

/* float[count], a density for each vertex. */
int EXPORT(web_set_density)(session *s, float *density, uint32_t count)
{
    qw_status status = qw_set_density(s->context, density, count);
    free(density);
    return settle(s, status);
}

/* Guides one after the other: heads is uint32_t[count][4], kind, closed, number of points and rings of each; points is
 * double[all points][3]. */
int EXPORT(web_set_guides)(session *s, uint32_t *heads, uint32_t count, double *points)
{
    qw_guide *guides = calloc(count ? count : 1, sizeof *guides);
    qw_status status = QW_MEMORY;
    const double *next = points;
    for (uint32_t i = 0; guides && i < count; i++) {
        guides[i] = (qw_guide){.size = sizeof *guides,
                               .kind = (qw_guide_kind)heads[4 * i],
                               .closed = heads[4 * i + 1] != 0,
                               .point_count = heads[4 * i + 2],
                               .points = next,
                               .rings = heads[4 * i + 3]};
        next += 3 * (size_t)heads[4 * i + 2];
    }
    if (guides) status = qw_set_guides(s->context, count ? guides : NULL, count);
    free(guides), free(heads), free(points);
    return status == QW_MEMORY ? fail(s, status, qw_status_text(status)) : settle(s, status);
}

/* uint8_t[count], 1 for each face that is inside. */
int EXPORT(web_set_region)(session *s, uint8_t *inside, uint32_t count)
{
    qw_status status = qw_set_region(s->context, inside, count);
    free(inside);
    return settle(s, status);
}

static const qw_attribute *attributes_of_input(const session *s, uint32_t *count)
{
    if (s->file && s->given_count == 0) return qw_mesh_attributes(s->file, count);
    *count = s->given_count;
    return s->given;
}

/* ---- remeshing */

void EXPORT(web_reset_options)(session *s)
{
    qw_options_init(&s->options);
    qw_asset_options_init(&s->of_asset);
}

int EXPORT(web_set_option)(session *s, const char *name, const char *value)
{
    char message[256];
    qw_status status = qw_option_set(&s->options, name, value, message, sizeof message);
    return fail(s, status, status == QW_OK ? "" : message);
}

/* One of texture coordinates and maps. */
int EXPORT(web_set_asset_option)(session *s, const char *name, const char *value)
{
    char message[256];
    qw_status status = qw_asset_option_set(&s->of_asset, name, value, message, sizeof message);
    return fail(s, status, status == QW_OK ? "" : message);
}

int EXPORT(web_run)(session *s)
{
    drop_result(s);
    if (s->of_points && !s->options.wrap)
        return fail(s, QW_NO_FACES, "there are points and no faces: they become a surface with the option wrap");
    uint32_t count = 0;
    const qw_attribute *of_input = attributes_of_input(s, &count);
    bool is_new = s->options.follow_motion > 0 && !s->is_moving;
    qw_status status = is_new ? qw_set_motion(s->context, of_input, count) : QW_OK;
    s->is_moving |= is_new && status == QW_OK;
    return settle(s, status == QW_OK ? qw_run(s->context, &s->options) : status);
}

/* Carries the attributes of the input over to the result. */
int EXPORT(web_carry)(session *s)
{
    uint32_t count = 0;
    const qw_attribute *of_input = attributes_of_input(s, &count);
    if (s->carried || count == 0) return fail(s, QW_OK, "");
    qw_status status = qw_transfer(s->context, of_input, count, 0, &s->carried, &s->transfer);
    s->carried_count = status == QW_OK ? count : 0;
    return settle(s, status);
}

/* Which faces lie in holes that were closed, behind what was carried. */
int EXPORT(web_mark_filled)(session *s)
{
    if (qw_get_report(s->context)->filled_holes == 0 || s->marked) return fail(s, QW_OK, "");
    for (uint32_t i = 0; i < s->carried_count; i++)
        if (!strcmp(s->carried[i].name, "filled")) return fail(s, QW_OK, "");
    s->marked = calloc(s->carried_count + (size_t)1, sizeof *s->marked);
    if (!s->marked) return fail(s, QW_MEMORY, qw_status_text(QW_MEMORY));
    for (uint32_t i = 0; i < s->carried_count; i++) s->marked[i] = s->carried[i];
    qw_status status = qw_get_filled(s->context, &s->marked[s->carried_count]);
    if (status == QW_OK) s->carried = s->marked, s->carried_count++;
    return settle(s, status);
}

/* Texture coordinates of the result's own instead of those that were carried, and with maps the normals that these
 * bend. Labels of materials are borders of charts, unless maps will make one material of all. */
static qw_status unwrap(session *s, int bakes)
{
    uint32_t kept = 0;
    const int32_t *borders = NULL;
    s->own = calloc(s->carried_count + (size_t)2, sizeof *s->own);
    if (!s->own) return QW_MEMORY;
    for (uint32_t i = 0; i < s->carried_count; i++) {
        const qw_attribute *a = &s->carried[i];
        if (a->kind != QW_UVS && !(bakes && a->kind == QW_NORMALS)) s->own[kept++] = *a;
        if (!bakes && a->kind == QW_LABELS && a->domain == QW_PER_FACE && !strcmp(a->name, "material"))
            borders = a->labels;
    }
    qw_status status = qw_unwrap(s->context, &s->of_asset, borders, &s->own[kept++], &s->asset);
    if (status == QW_OK && bakes) s->normals = &s->own[kept++]; /* known when maps are made */
    s->carried = s->own, s->carried_count = kept;
    return status;
}

/* Of arrays the colours come along, of points too. */
static int bake(session *s, uint32_t maps)
{
    qw_mesh *source = s->given_count == 0 ? s->file : NULL;
    if (!source) {
        qw_host host = host_of(s);
        qw_status status = qw_mesh_wrap(&s->input, s->given, s->given_count, NULL, NULL, &host, &source);
        if (status != QW_OK) fail(s, status, qw_mesh_message(source)), qw_mesh_destroy(source);
        if (status != QW_OK) return (int)status;
    }
    int status = settle(s, qw_bake(s->context, source, maps, &s->image, &s->images, &s->asset));
    if (source != s->file) qw_mesh_destroy(source);
    return status == QW_OK ? settle(s, qw_get_normals(s->context, QW_SHADING_SPLIT, s->normals)) : status;
}

/* Whether maps have these names: before a run that will want them. */
int EXPORT(web_check_maps)(session *s, const char *maps)
{
    char message[256];
    uint32_t bits;
    qw_status named = qw_maps_named(maps, &bits, message, sizeof message);
    return named == QW_OK ? QW_OK : fail(s, named, message);
}

/* After web_carry; maps: their names, as the command line has them, or NULL: texture coordinates alone. */
int EXPORT(web_unwrap)(session *s, const char *maps)
{
    char message[256];
    uint32_t bits = 0;
    qw_status named = maps ? qw_maps_named(maps, &bits, message, sizeof message) : QW_OK;
    if (named != QW_OK) return fail(s, named, message);
    int status = settle(s, unwrap(s, maps != NULL));
    if (status == QW_OK && maps) status = bake(s, bits);
    if (status != QW_OK) drop_result(s);
    return status;
}

uint32_t EXPORT(web_image_count)(const session *s) { return s->images; }

/* which: 0 tile, 1 width, 2 height, 3 channels, 4 bits */
uint32_t EXPORT(web_image_number)(const session *s, uint32_t i, int which)
{
    const qw_image *m = &s->image[i];
    const uint32_t numbers[] = {m->tile, m->width, m->height, m->channels, m->bits};
    return numbers[which];
}

const char *EXPORT(web_image_name)(const session *s, uint32_t i) { return qw_map_name(s->image[i].map); }
const void *EXPORT(web_image_pixels)(const session *s, uint32_t i) { return s->image[i].pixels; }

/* ---- what came out, and what went in (of_input) */

static qw_mesh_view view_of(const session *s, int of_input)
{
    qw_mesh_view view = s->input;
    if (!of_input) qw_get_mesh(s->context, &view);
    return view;
}

uint32_t EXPORT(web_vertex_count)(const session *s, int of_input) { return view_of(s, of_input).vertex_count; }
uint32_t EXPORT(web_face_count)(const session *s, int of_input) { return view_of(s, of_input).face_count; }
uint32_t EXPORT(web_face_size)(const session *s, int of_input) { return view_of(s, of_input).uniform_face_size; }
const double *EXPORT(web_positions)(const session *s, int of_input) { return view_of(s, of_input).positions; }
const uint32_t *EXPORT(web_corners)(const session *s, int of_input) { return view_of(s, of_input).corners; }
const uint32_t *EXPORT(web_face_sizes)(const session *s, int of_input) { return view_of(s, of_input).face_sizes; }

static const qw_attribute *attribute_at(const session *s, int of_input, uint32_t i)
{
    uint32_t count = s->carried_count;
    const qw_attribute *all = s->carried;
    if (of_input) all = attributes_of_input(s, &count);
    return i < count ? &all[i] : NULL;
}

uint32_t EXPORT(web_attribute_count)(const session *s, int of_input)
{
    uint32_t count = s->carried_count;
    if (of_input) attributes_of_input(s, &count);
    return count;
}

const char *EXPORT(web_attribute_name)(const session *s, int of_input, uint32_t i)
{
    return attribute_at(s, of_input, i)->name;
}

/* which: 0 domain, 1 kind, 2 components, 3 count, 4 number of names of labels */
uint32_t EXPORT(web_attribute_number)(const session *s, int of_input, uint32_t i, int which)
{
    const qw_attribute *a = attribute_at(s, of_input, i);
    const uint32_t numbers[] = {(uint32_t)a->domain, (uint32_t)a->kind, a->components, a->count,
                                a->label_names ? a->label_count : 0};
    return numbers[which];
}

/* float[count][components], or int32_t[count] of QW_LABELS. */
const void *EXPORT(web_attribute_data)(const session *s, int of_input, uint32_t i)
{
    const qw_attribute *a = attribute_at(s, of_input, i);
    return a->kind == QW_LABELS ? (const void *)a->labels : a->values;
}

const uint32_t *EXPORT(web_attribute_group)(const session *s, int of_input, uint32_t i)
{
    return attribute_at(s, of_input, i)->group;
}

const char *EXPORT(web_attribute_label)(const session *s, int of_input, uint32_t i, uint32_t label)
{
    return attribute_at(s, of_input, i)->label_names[label];
}

/* ---- reports, files */

static const char *make_text(session *s, size_t (*write)(const void *what, char *text, size_t size), const void *what)
{
    size_t length = write(what, NULL, 0);
    free(s->text);
    s->text = malloc(length + 1);
    if (!s->text) return NULL;
    write(what, s->text, length + 1);
    return s->text;
}

static size_t write_report(const void *what, char *text, size_t size) { return qw_report_json(what, text, size); }
static size_t write_run(const void *what, char *text, size_t size) { return qw_run_json(what, text, size); }

static size_t write_asset(const void *what, char *text, size_t size) { return qw_asset_json(what, text, size); }

/* Figures of texture coordinates and maps, as JSON; NULL: no memory, or there are none. */
const char *EXPORT(web_asset_report)(session *s) { return s->own ? make_text(s, write_asset, &s->asset) : NULL; }

/* As JSON; NULL: no memory. */
const char *EXPORT(web_report)(session *s) { return make_text(s, write_report, qw_get_report(s->context)); }

/* The result against the surface: the report of the command line tool, as JSON; NULL after a failure. */
const char *EXPORT(web_measured_report)(session *s, const char *input, const char *output)
{
    qw_host host = host_of(s);
    qw_topology topology;
    qw_quality quality;
    qw_status status = qw_measure_result(s->context, &s->input, &host, &topology, &quality);
    fail(s, status, status == QW_OK ? "" : qw_status_text(status));
    if (status != QW_OK) return NULL;
    const char *notes[MOST_NOTES];
    for (uint32_t i = 0; i < s->note_count; i++) notes[i] = s->notes[i];
    qw_run_info run = {.size = sizeof run,
                       .input = input,
                       .output = output,
                       .notes = notes,
                       .note_count = s->note_count,
                       .options = &s->options,
                       .report = qw_get_report(s->context),
                       .quality = &quality};
    if (s->transfer.size) run.transfer = &s->transfer;
    if (s->own) run.asset = &s->asset;
    return make_text(s, write_run, &run);
}

/* The result as the command line tool writes it, with its attributes and maps unless bare; other formats than glTF hold
 * no pictures here. */
int EXPORT(web_save)(session *s, int format, int bare)
{
    int status = bare ? QW_OK : web_carry(s);
    if (status != QW_OK) return status;
    if (!bare && s->images && (format == QW_FORMAT_GLB || format == QW_FORMAT_GLTF))
        return settle(s, qw_save_asset(s->context, s->carried, s->carried_count, "-", (qw_format)format));
    return settle(s, qw_save_from(s->context, bare ? NULL : s->carried, bare ? 0 : s->carried_count,
                                  bare ? NULL : s->file, "-", (qw_format)format));
}

/* ---- tables */

const char *EXPORT(web_version)(void) { return qw_version(); }

int EXPORT(web_status_count)(void) { return QW_STATUS_COUNT; }
const char *EXPORT(web_status_name)(int status) { return qw_status_name((qw_status)status); }
const char *EXPORT(web_status_text)(int status) { return qw_status_text((qw_status)status); }
int EXPORT(web_status_exit_code)(int status) { return qw_status_exit_code((qw_status)status); }

const char *EXPORT(web_stage_title)(int stage) { return qw_stage_title((qw_stage)stage); }

/* Options: those of the library, and behind them those of texture coordinates and maps. */
int EXPORT(web_option_count)(int of_asset) { return (int)(of_asset ? qw_asset_option_count() : qw_option_count()); }

static const qw_option_info *option_at(int option)
{
    size_t own = qw_option_count(), i = (size_t)option;
    return i < own ? qw_option_at(i) : qw_asset_option_at(i - own);
}

/* which: 0 name, 1 unit, 2 choices (NULL where there are none), 3 help */
const char *EXPORT(web_option_text)(int option, int which)
{
    const qw_option_info *o = option_at(option);
    const char *const texts[] = {o->name, o->unit, o->choices, o->help};
    return texts[which];
}

/* which: 0 kind, 1 initial, 2 least, 3 most */
double EXPORT(web_option_number)(int option, int which)
{
    const qw_option_info *o = option_at(option);
    const double numbers[] = {(double)o->kind, o->initial, o->least, o->most};
    return numbers[which];
}

int EXPORT(web_preset_count)(void) { return (int)qw_preset_count(); }

/* which: 0 name, 1 settings, 2 help */
const char *EXPORT(web_preset_text)(int preset, int which)
{
    const qw_preset_info *p = qw_preset_at((size_t)preset);
    const char *const texts[] = {p->name, p->settings, p->help};
    return texts[which];
}

int EXPORT(web_set_preset)(session *s, const char *name)
{
    char message[256];
    qw_status status = qw_options_preset(&s->options, name, message, sizeof message);
    return fail(s, status, status == QW_OK ? "" : message);
}

/* Bytes of "4G"; below 0 where it is no such text. */
double EXPORT(web_memory_size)(const char *text)
{
    uint64_t bytes;
    return qw_memory_size(text, &bytes, NULL, 0) == QW_OK ? (double)bytes : -1;
}

/* Of record, from 0; which: 0 name, 1 unit, 2 help. NULL past the end. */
const char *EXPORT(web_field_text)(int record, int field, int which)
{
    const qw_field_info *f = qw_field_at((qw_record)record, (size_t)field);
    if (!f) return NULL;
    const char *const texts[] = {f->name, f->unit, f->help};
    return texts[which];
}

/* which: 0 kind, 1 whether it may be null */
int EXPORT(web_field_number)(int record, int field, int which)
{
    const qw_field_info *f = qw_field_at((qw_record)record, (size_t)field);
    return which ? f->optional : (int)f->kind;
}

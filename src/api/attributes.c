/* The public functions that say where the result lies on the input, and that carry attributes over. What they find lies
 * in the scope of the last stage and goes with it. */
#include "api/attributes.h"

#include "api/asset.h"

#include "products/attributes/corner_normals.h"
#include "base/constants.h"
#include "base/printable.h"
#include "base/mesh_view.h"
#include "api/context.h"
#include "io/file.h"
#include "io/number.h"
#include "io/soup.h"
#include "whole/joined.h"
#include "products/limit/cage.h"
#include "products/limit/second_order.h"
#include "geometry/bvh.h"
#include "api/loaded.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* The places of all points as the public structure tells them. */
static const qw_origin *tell(qw_env *env, const qw_source *source, const qw_source_point *point, size_t count)
{
    qw_origin *told = QW_NEW(env, qw_origin, count);
    for (size_t i = 0; i < count; i++) told[i] = qw_origin_of(source, &point[i]);
    return told;
}

/* The quads of a symmetric result, of which those from `reflected` on are reflections, cut apart at the plane: each
   side of a part lies on what the input has there, which need not be one component. */
static qw_quadmesh part_sides(qw_env *env, const qw_quadmesh *whole, uint32_t reflected)
{
    qw_quadmesh parted = *whole;
    uint32_t sides = 4 * whole->face_count, half = 4 * reflected;
    parted.twin = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t twin = whole->twin[h];
        parted.twin[h] = twin != QW_NONE && (h < half) == (twin < half) ? twin : QW_NONE;
    }
    return parted;
}

/* Where each vertex and corner of the result lies on the input, as a source of all that is carried over. */
static qw_carried *find_carried(qw_context_state *c)
{
    const qw_run_state *run = &c->run;
    const qw_quadmesh *quads = &run->finished;
    qw_quadmesh parted = *quads;
    if (c->report.symmetric) parted = part_sides(c->env, quads, run->reflected);
    qw_carried *k = QW_NEW_ZERO(c->env, qw_carried, 1);
    k->source = qw_source_build(c->env, &c->input, &run->whole.clean, run->whole.census.component);
    k->origins = qw_find_origins(c->env, &k->source, &parted);
    k->provenance = (qw_provenance){.size = sizeof k->provenance,
                                    .vertex_count = quads->vertex_count,
                                    .corner_count = 4 * quads->face_count,
                                    .lost_vertices = k->origins.lost_vertices,
                                    .lost_corners = k->origins.lost_corners,
                                    .farthest = k->origins.farthest / run->whole.clean.frame.scale};
    k->provenance.vertices = tell(c->env, &k->source, k->origins.vertex, quads->vertex_count);
    k->provenance.corners = tell(c->env, &k->source, k->origins.corner, 4 * (size_t)quads->face_count);
    if (run->joined.face_count > 0) qw_join_provenance(run, &k->provenance);
    return k;
}

typedef struct transfer_call {
    qw_context_state *c;
    const qw_attribute *attributes;
    uint32_t count, most_weights;
    const qw_attribute *transferred;
    qw_transfer_report report;
} transfer_call;

void qw_find_carried(qw_context_state *c)
{
    if (!c->carried) c->carried = find_carried(c);
}

static void carry(void *user) { qw_find_carried(((transfer_call *)user)->c); }

/* ---- labels that no quad has */

enum { MOST_UNNAMED = 1 << 20 }; /* numbers apart: more are no labels of parts */

enum seen_flag { WAS = 1, IS = 2, WAS_SEEN = 4 };

/* Warns of labels of faces of the input that no face of the result has: what they mark is smaller than a quad, or lies
   inside a wrap. */
static void warn_of_lost_labels(qw_run_state *run, const qw_attribute *was, const qw_attribute *is)
{
    int64_t least = INT32_MAX, most = INT32_MIN, lost = 0, hidden = 0, all = 0, first = 0;
    const uint8_t *outside = run->whole.clean.seen; /* NULL: all is */
    for (uint32_t f = 0; f < was->count; f++) {
        if (was->labels[f] < least) least = was->labels[f];
        if (was->labels[f] > most) most = was->labels[f];
    }
    if (was->label_names && least < 0) least = 0; /* -1 is none */
    if (most - least >= MOST_UNNAMED || most < least) return;
    uint8_t *flags = QW_NEW_ZERO(run->env, uint8_t, (size_t)(most - least) + 1);
    for (uint32_t f = 0; f < was->count; f++)
        if (was->labels[f] >= least) flags[was->labels[f] - least] |= !outside || outside[f] ? WAS | WAS_SEEN : WAS;
    for (uint32_t f = 0; f < is->count; f++)
        if (is->labels[f] >= least && is->labels[f] <= most) flags[is->labels[f] - least] |= IS;
    for (int64_t k = most; k >= least; k--) {
        uint8_t has = flags[k - least];
        all += has & WAS;
        hidden += has == WAS;
        if (has == WAS || has == (WAS | WAS_SEEN)) lost++, first = k;
    }
    qw_free(run->env, flags);
    char text[256], title[32], name[48];
    if (lost == 0) return;
    qw_printable(title, sizeof title, was->name);
    if (was->label_names) qw_printable(name, sizeof name, was->label_names[first]);
    else snprintf(name, sizeof name, "%lld", (long long)first);
    if (lost == 1) snprintf(text, sizeof text, "no quad is left of %s \"%s\"", title, name);
    else
        snprintf(text, sizeof text, "no quad is left of %lld of %lld labels \"%s\", such as \"%s\"", (long long)lost,
                 (long long)all, title, name);
    size_t used = strlen(text);
    if (hidden > 0 && hidden < lost)
        snprintf(text + used, sizeof text - used, "; of them %lld lie inside the wrap", (long long)hidden);
    else
        snprintf(text + used, sizeof text - used, "; %s",
                 hidden == 0 ? "more quads would hold it, or its borders kept"
                 : lost == 1 ? "it lies inside the wrap"
                             : "they lie inside the wrap");
    qw_warn_once(run, text);
}

/* Checks the attributes of the input and carries them to the result, and to polygons that were left out. */
static void transfer(void *user)
{
    transfer_call *call = user;
    qw_context_state *c = call->c;
    if (call->most_weights > QW_MOST_COMPONENTS)
        qw_fail(c->env, QW_ARGUMENT, -1, "%u weights a vertex are more than %d", call->most_weights,
                QW_MOST_COMPONENTS);
    qw_require_attributes(c->env, call->attributes, call->count, c->input.vertex_count,
                          c->input.face_begin[c->input.face_count], c->input.face_count);
    qw_attribute *carried = qw_transfer_attributes(c->env, &c->carried->source, &c->run.finished, &c->carried->origins,
                                                   call->attributes, call->count, call->most_weights, &call->report);
    if (c->run.joined.face_count > 0) qw_join_attributes(&c->run, call->attributes, call->count, carried);
    for (uint32_t i = 0; i < call->count; i++)
        if (carried[i].kind == QW_LABELS && carried[i].domain == QW_PER_FACE)
            warn_of_lost_labels(&c->run, &call->attributes[i], &carried[i]);
    call->transferred = carried;
}

static qw_status require_done(qw_context *context)
{
    if (context->state.done == QW_STAGE_COUNT && context->state.has_input) return QW_OK;
    return qw_refuse(context, QW_NOT_READY, "the last stage has not finished yet: there is no result to carry to");
}

qw_status qw_get_provenance(qw_context *context, qw_provenance *provenance)
{
    if (!context || !provenance) return QW_ARGUMENT;
    *provenance = (qw_provenance){.size = sizeof *provenance};
    qw_status status = require_done(context);
    if (status != QW_OK) return status;
    transfer_call call = {.c = &context->state};
    status = qw_protect_listening(context->state.env, carry, &call);
    if (status == QW_OK) *provenance = context->state.carried->provenance;
    return qw_done(context, status);
}

qw_status qw_transfer(qw_context *context, const qw_attribute *attributes, uint32_t count, uint32_t most_weights,
                      const qw_attribute **transferred, qw_transfer_report *report)
{
    if (!context || !transferred) return QW_ARGUMENT;
    *transferred = NULL;
    qw_status status = require_done(context);
    if (status != QW_OK) return status;
    transfer_call call = {&context->state, attributes, count, most_weights, NULL, {.size = sizeof call.report}};
    status = qw_protect_listening(context->state.env, carry, &call);
    if (status == QW_OK) status = qw_protect_listening(context->state.env, transfer, &call);
    if (status == QW_OK) *transferred = call.transferred;
    if (report) *report = call.report;
    return qw_done(context, status);
}

/* ---- normals */

/* With maps: those that these bend. */
static float *copy_shading(qw_context_state *c, uint32_t corners)
{
    float *normal = QW_NEW(c->env, float, 3 * (size_t)corners);
    memcpy(normal, c->asset->normal, 3 * (size_t)corners * sizeof *normal);
    return normal;
}

typedef struct normals_call {
    qw_context_state *c;
    qw_shading shading;
    qw_attribute normals;
} normals_call;

/* Normals of the result's corners or vertices, as the shading asks; kept in the context. */
static void find_normals(void *user)
{
    normals_call *call = user;
    qw_context_state *c = call->c;
    const qw_quadmesh *quads = &c->run.finished;
    const qw_joined *joined = &c->run.joined;
    bool split = call->shading == QW_SHADING_SPLIT;
    if ((unsigned)call->shading > QW_SHADING_SPLIT)
        qw_fail(c->env, QW_ARGUMENT, -1, "there is no shading %d", (int)call->shading);
    call->normals = (qw_attribute){.size = sizeof call->normals,
                                   .name = "normal",
                                   .domain = split ? QW_PER_CORNER : QW_PER_VERTEX,
                                   .kind = QW_NORMALS,
                                   .components = 3,
                                   .count = split ? 4 * quads->face_count : quads->vertex_count};
    bool is_baked = split && c->asset && c->asset->normal;
    if (joined->face_count == 0) {
        call->normals.values = is_baked ? copy_shading(c, call->normals.count)
                                        : qw_shading_normals(c->env, quads, split);
        return;
    }
    const qw_polygon_fans polygons = {.vertex_count = joined->vertex_count,
                                      .face_count = joined->face_count,
                                      .corner_count = joined->corner_count,
                                      .position = joined->position,
                                      .face_size = joined->face_size,
                                      .corner = joined->corner,
                                      .mark = quads->mark,
                                      .marked = 4 * quads->face_count};
    call->normals.count = split ? joined->corner_count : joined->vertex_count;
    call->normals.values = is_baked ? copy_shading(c, call->normals.count)
                                    : qw_polygon_shading_normals(c->env, &polygons, split);
}

qw_status qw_get_normals(qw_context *context, qw_shading shading, qw_attribute *normals)
{
    if (!context || !normals) return QW_ARGUMENT;
    *normals = (qw_attribute){.size = sizeof *normals};
    qw_status status = require_done(context);
    if (status != QW_OK) return status;
    normals_call call = {.c = &context->state, .shading = shading};
    status = qw_protect(context->state.env, find_normals, &call);
    if (status == QW_OK) *normals = call.normals;
    return qw_done(context, status);
}

/* ---- filled holes */

typedef struct filled_call {
    qw_context_state *c;
    qw_attribute filled;
} filled_call;

/* The triangles that fill holes are the last of the clean surface: qw_fill_holes. */
static void find_filled(void *user)
{
    static const char *const names[] = {"surface", "filled"};
    filled_call *call = user;
    qw_context_state *c = call->c;
    const qw_quadmesh *q = &c->run.finished;
    uint32_t n = q->face_count, hint = QW_NONE;
    int32_t *label = QW_NEW_ZERO(c->env, int32_t, n);
    call->filled = (qw_attribute){.size = sizeof call->filled,
                                  .name = "filled",
                                  .domain = QW_PER_FACE,
                                  .kind = QW_LABELS,
                                  .components = 1,
                                  .count = n,
                                  .labels = label,
                                  .label_names = names,
                                  .label_count = 2,
                                  .storage = QW_UINT8};
    if (c->report.filled_triangles == 0) return;
    qw_scope_begin(c->env);
    qw_trimesh surface = c->run.whole.clean.mesh;
    surface.component = NULL;
    const qw_bvh *tree = qw_bvh_build(c->env, &surface);
    uint32_t first = surface.face_count - (uint32_t)c->report.filled_triangles;
    for (uint32_t f = 0; f < n; f++) {
        qw_vec3 middle = qw_quad_middle(q->position, q->corner + 4 * (size_t)f);
        qw_hit hit = qw_bvh_nearest(tree, middle, qw_quad_normal(q, f), QW_SAME_SHEET, INFINITY, hint);
        label[f] = hit.face != QW_NONE && hit.face >= first;
        hint = hit.face;
        qw_heartbeat(c->env);
    }
    qw_scope_end(c->env);
}

qw_status qw_get_filled(qw_context *context, qw_attribute *filled)
{
    if (!context || !filled) return QW_ARGUMENT;
    *filled = (qw_attribute){.size = sizeof *filled};
    qw_status status = require_done(context);
    if (status != QW_OK) return status;
    filled_call call = {.c = &context->state};
    status = qw_protect_listening(context->state.env, find_filled, &call);
    if (status == QW_OK) *filled = call.filled;
    return qw_done(context, status);
}

/* ---- saving */

typedef struct save_call {
    qw_context_state *c;
    qw_mesh_view mesh;
    const qw_attribute *attributes;
    uint32_t count;
    const char *library;
    const qw_gltf_rest *gltf;
    const char *path;
    qw_format format;
    bool second_order;
} save_call;

static uint32_t corners_of(const qw_mesh_view *mesh)
{
    uint32_t sum = mesh->face_sizes ? 0 : 4 * mesh->face_count;
    for (uint32_t f = 0; mesh->face_sizes && f < mesh->face_count; f++) sum += mesh->face_sizes[f];
    return sum;
}

static void require_of_result(const save_call *call)
{
    qw_require_attributes(call->c->env, call->attributes, call->count, call->mesh.vertex_count, corners_of(&call->mesh),
                          call->mesh.face_count);
}

/* Elements whose sides would bend them too much are straighter: in positions of their own. */
static void hold_sides_back(save_call *call)
{
    qw_env *env = call->c->env;
    size_t count = 3 * (size_t)call->mesh.vertex_count;
    double *position = memcpy(QW_NEW(env, double, count), call->mesh.positions, count * sizeof(double));
    uint32_t held = qw_hold_sides_back(env, position, call->mesh.corners, call->mesh.face_count / 4,
                                       call->mesh.vertex_count);
    call->mesh.positions = position;
    if (held > 0)
        qw_log(env, QW_LOG_WARNING, "%u element%s of second order would be bent too much: their sides are straighter",
               held, held == 1 ? "" : "s");
}

/* Writes the result with the attributes that are given, in the format of the call. */
static void save_with(void *user)
{
    save_call *call = user;
    require_of_result(call);
    qw_scope_begin(call->c->env);
    if (call->second_order && call->c->run.joined.face_count == 0) hold_sides_back(call);
    const qw_carried_along along = {call->attributes, call->count, call->library, call->gltf, call->second_order};
    if (call->format >= QW_FORMAT_MSH && call->c->run.joined.face_count == 0)
        call->mesh.marked_edges = qw_list_creases(call->c->env, &call->c->run.finished, &call->mesh.marked_edge_count);
    qw_write_with(call->c->env, call->path, call->format, &call->mesh, &along);
    qw_scope_end(call->c->env);
}

static qw_status save(qw_context *context, save_call *call, void (*body)(void *user))
{
    qw_status status = require_done(context);
    if (status != QW_OK) return status;
    if (!call->path || !call->path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    qw_get_mesh(context, &call->mesh);
    return qw_done(context, qw_protect(context->state.env, body, call));
}

qw_status qw_save_with(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *library,
                       const char *path, qw_format format)
{
    if (!context) return QW_ARGUMENT;
    save_call call = {&context->state, {0}, attributes, count, library, NULL, path, format, false};
    return save(context, &call, save_with);
}

qw_status qw_save_from(qw_context *context, const qw_attribute *attributes, uint32_t count, const qw_mesh *source,
                       const char *path, qw_format format)
{
    if (!context) return QW_ARGUMENT;
    save_call call = {
        &context->state, {0},  attributes, count, source ? source->library : NULL, source ? source->gltf : NULL, path,
        format,          false};
    return save(context, &call, save_with);
}

qw_status qw_save_second_order(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *path,
                               qw_format format)
{
    if (!context) return QW_ARGUMENT;
    const qw_run_state *run = &context->state.run;
    if (format < QW_FORMAT_MSH || format > QW_FORMAT_BDF)
        return qw_refuse(context, QW_ARGUMENT, "elements of second order are MSH, VTU, INP or BDF");
    if (context->state.done == QW_STAGE_COUNT && run->finished.face_count != 4 * run->coarse.face_count)
        return qw_refuse(context, QW_ARGUMENT, "elements of second order need quads that were split once (subdivide)");
    save_call call = {&context->state, {0}, attributes, count, NULL, NULL, path, format, true};
    return save(context, &call, save_with);
}

/* ---- provenance to a file: docs/attributes.md */

/* A line of the provenance: face, corners and weights of a point on the input, or null. */
static void put_json_point(qw_file *file, const qw_origin *o, bool first)
{
    char line[256], number[QW_NUMBER_SIZE];
    int size = snprintf(line, sizeof line, first ? "\n" : ",\n");
    if (o->face == QW_NO_FACE) {
        size += snprintf(line + size, sizeof line - (size_t)size, "null");
    } else {
        size += snprintf(line + size, sizeof line - (size_t)size, "[%u, [%u, %u, %u], [", o->face, o->corner[0],
                         o->corner[1], o->corner[2]);
        for (int k = 0; k < 3; k++) {
            int digits = (int)qw_number_print(number, (double)o->weight[k]);
            size += snprintf(line + size, sizeof line - (size_t)size, "%.*s%s", digits, number, k < 2 ? ", " : "]]");
        }
    }
    qw_file_put(file, line, (size_t)size);
}

static void put_binary_point(qw_file *file, const qw_origin *o, bool first)
{
    (void)first;
    char bytes[28];
    uint32_t words[7] = {o->face, o->corner[0], o->corner[1], o->corner[2]};
    memcpy(words + 4, o->weight, sizeof o->weight);
    for (int i = 0; i < 28; i++) bytes[i] = (char)(words[i / 4] >> 8 * (i % 4));
    qw_file_put(file, bytes, sizeof bytes);
}

/* uint32_t[face_count + 1]. */
static uint32_t *corners_before(qw_env *env, const qw_mesh_view *mesh)
{
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)mesh->face_count + 1);
    begin[0] = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) begin[f + 1] = begin[f] + qw_view_face_size(mesh, f);
    return begin;
}

/* Writes where each vertex and corner comes from, as JSON where the name ends in .json, else as bytes. */
static void save_provenance(void *user)
{
    save_call *call = user;
    qw_env *env = call->c->env;
    const qw_provenance *p = &call->c->carried->provenance;
    require_of_result(call);
    qw_scope_begin(env);
    const uint32_t *order = qw_order_faces(env, call->mesh.face_count, call->attributes, call->count);
    size_t length = strlen(call->path);
    bool json = length > 5 && strcmp(call->path + length - 5, ".json") == 0;
    void (*put)(qw_file *, const qw_origin *, bool) = json ? put_json_point : put_binary_point;
    qw_file *file = qw_file_begin(env, call->path);
    char head[12] = "QWP1";
    for (int i = 0; i < 8; i++) head[4 + i] = (char)((i < 4 ? p->vertex_count : p->corner_count) >> 8 * (i % 4));
    if (json) qw_file_put(file, "{\"vertices\": [", 14);
    else qw_file_put(file, head, sizeof head);
    for (uint32_t v = 0; v < p->vertex_count; v++) put(file, &p->vertices[v], v == 0);
    if (json) qw_file_put(file, "],\n\"corners\": [", 15);
    const uint32_t *begin = corners_before(env, &call->mesh);
    for (uint32_t i = 0; i < call->mesh.face_count; i++) {
        uint32_t f = order ? order[i] : i;
        for (uint32_t c = begin[f]; c < begin[f + 1]; c++) put(file, &p->corners[c], i == 0 && c == begin[f]);
    }
    if (json) qw_file_put(file, "]}\n", 3);
    qw_file_finish(file);
    qw_scope_end(env);
}

qw_status qw_save_provenance(qw_context *context, const qw_attribute *attributes, uint32_t count, const char *path)
{
    if (!context) return QW_ARGUMENT;
    qw_provenance found;
    qw_status status = qw_get_provenance(context, &found);
    if (status != QW_OK) return status;
    save_call call = {&context->state, {0}, attributes, count, NULL, NULL, path, QW_FORMAT_AUTO, false};
    return save(context, &call, save_provenance);
}

/* The public functions that remesh: contexts, stages, dumps, and the one-shot call. Files and measuring are in files.c,
 * options in base/options.c, dumps in run/dump.c. */
#include "api/context.h"
#include "remesh.h"

#include "base/mesh_view.h"
#include "whole/kept_rims.h"
#include "io/soup.h"
#include "run/dump.h"

#include <stdlib.h>
#include <string.h>

static void *host_resize(const qw_host *host, void *block, size_t old_size, size_t new_size)
{
    if (host && host->resize) return host->resize(host->resize_user, block, old_size, new_size);
    if (new_size) return realloc(block, new_size);
    free(block);
    return NULL;
}

/* Tells the host, never less than before. The host has a progress function. */
static int tell_progress(void *user, qw_stage stage, double fraction)
{
    qw_context *context = user;
    if (fraction > context->told) context->told = fraction;
    return context->host.progress(context->host.progress_user, stage, context->told);
}

qw_status qw_create(const qw_host *host, qw_context **context)
{
    if (!context) return QW_ARGUMENT;
    *context = host_resize(host, NULL, 0, sizeof **context);
    if (!*context) return QW_MEMORY;
    memset(*context, 0, sizeof **context);
    if (host) (*context)->host = *host;
    qw_host told = (*context)->host;
    if (told.progress) told.progress = tell_progress, told.progress_user = *context;
    (*context)->state.env = qw_env_create(&told, 1);
    if ((*context)->state.env) {
        qw_forget_mesh(&(*context)->state);
        return QW_OK;
    }
    host_resize(host, *context, sizeof **context, 0);
    *context = NULL;
    return QW_MEMORY;
}

void qw_destroy(qw_context *context)
{
    if (!context) return;
    qw_host host = context->host;
    qw_env_destroy(context->state.env);
    host_resize(&host, context, sizeof *context, 0);
}

const char *qw_message(const qw_context *context)
{
    if (!context) return "no context";
    return context->message[0] ? context->message : context->status == QW_OK ? "" : qw_env_message(context->state.env);
}

qw_status qw_done(qw_context *context, qw_status status)
{
    context->message[0] = 0;
    return context->status = status;
}

qw_status qw_refuse(qw_context *context, qw_status status, const char *message)
{
    strncpy(context->message, message, sizeof context->message - 1);
    return context->status = status;
}

/* ---- taking the mesh */

typedef struct mesh_call {
    qw_context_state *state;
    const qw_mesh_view *mesh;
    uint32_t corners; /* of all faces */
    qw_clean_input copy;
} mesh_call;

static void check_mesh(void *user)
{
    mesh_call *call = user;
    qw_env *env = call->state->env;
    call->corners = qw_require_view(env, call->mesh, "mesh");
    qw_require_moderate(env, call->mesh, "mesh");
    if (call->mesh->face_count == 0) qw_fail(env, QW_NO_FACES, -1, "the mesh has no faces");
    if (call->corners > INT32_MAX)
        qw_fail(env, QW_TOO_LARGE, -1, "the mesh has %u corners; the most is %d", call->corners, INT32_MAX);
}

/* Copies the caller's mesh into the context, with its marked edges and as polygons of any size. */
static void copy_mesh(void *user)
{
    mesh_call *call = user;
    qw_env *env = call->state->env;
    const qw_mesh_view *mesh = call->mesh;
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)mesh->face_count + 1);
    begin[0] = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) begin[f + 1] = begin[f] + qw_view_face_size(mesh, f);
    double *position = QW_NEW(env, double, (size_t)3 * mesh->vertex_count);
    uint32_t *corner = QW_NEW(env, uint32_t, call->corners);
    memcpy(position, mesh->positions, (size_t)3 * mesh->vertex_count * sizeof *position);
    memcpy(corner, mesh->corners, call->corners * sizeof *corner);
    uint32_t *mark = QW_NEW(env, uint32_t, 2 * (size_t)mesh->marked_edge_count);
    if (mesh->marked_edge_count) memcpy(mark, mesh->marked_edges, 2 * (size_t)mesh->marked_edge_count * sizeof *mark);
    call->copy = (qw_clean_input){mesh->vertex_count,
                                  mesh->face_count,
                                  position,
                                  begin,
                                  corner,
                                  false,
                                  mesh->marked_edge_count,
                                  mark,
                                  NULL,
                                  NULL,
                                  0,
                                  NULL};
}

qw_status qw_set_mesh(qw_context *context, const qw_mesh_view *mesh)
{
    if (!context) return QW_ARGUMENT;
    qw_context_state *c = &context->state;
    mesh_call call = {.state = c, .mesh = mesh};
    qw_status status = qw_protect(c->env, check_mesh, &call);
    if (status == QW_OK) status = qw_protect(c->env, copy_mesh, &call);
    /* a failure leaves what the context had; only now is that let go, as the view may be of its own result */
    if (status == QW_OK) qw_replace_mesh(c, &call.copy);
    return qw_done(context, status);
}

typedef struct density_call {
    qw_context_state *state;
    const qw_density *density;
    uint32_t count;
    qw_density *copy;
} density_call;

/* Checks the densities of a call and copies them; one density everywhere is none. */
static void copy_density(void *user)
{
    density_call *call = user;
    qw_env *env = call->state->env;
    if (call->count != call->state->input.vertex_count)
        qw_fail(env, QW_ARGUMENT, -1, "there are %u densities for %u vertices", call->count,
                call->state->input.vertex_count);
    for (uint32_t v = 0; v < call->count; v++)
        if (!(call->density[v] >= QW_LEAST_DENSITY && call->density[v] <= QW_MOST_DENSITY))
            qw_fail(env, QW_ARGUMENT, v, "the density of vertex %u is %g; it must be from %g to %g", v,
                    (double)call->density[v], (double)QW_LEAST_DENSITY, (double)QW_MOST_DENSITY);
    uint32_t same = 0;
    while (same < call->count && call->density[same] == call->density[0]) same++;
    if (same == call->count) return; /* only ratios count: one density everywhere is none */
    call->copy = QW_NEW(env, qw_density, call->count);
    memcpy(call->copy, call->density, call->count * sizeof *call->copy);
}

qw_status qw_set_density(qw_context *context, const qw_density *density, uint32_t count)
{
    if (!context) return QW_ARGUMENT;
    if (!context->state.has_input)
        return qw_refuse(context, QW_NOT_READY, "there is no mesh yet: call qw_set_mesh first");
    if (!density && count > 0) return qw_refuse(context, QW_ARGUMENT, "the densities are missing");
    density_call call = {&context->state, density, count, NULL};
    qw_status status = density ? qw_protect(context->state.env, copy_density, &call) : QW_OK;
    if (status == QW_OK) qw_replace_density(&context->state, call.copy);
    return qw_done(context, status);
}

/* ---- running */

qw_status qw_run_until(qw_context *context, const qw_options *options, qw_stage last)
{
    if (!context) return QW_ARGUMENT;
    if (!options || (unsigned)last >= QW_STAGE_COUNT)
        return qw_refuse(context, QW_ARGUMENT, "options are missing or there is no such stage");
    char message[256];
    qw_status status = qw_options_validate(options, message, sizeof message);
    if (status != QW_OK) return qw_refuse(context, status, message);
    if (!context->state.has_input)
        return qw_refuse(context, QW_NOT_READY, "there is no mesh yet: call qw_set_mesh first");
    context->told = 0;
    return qw_done(context, qw_remesh_until(&context->state, options, last));
}

qw_status qw_run(qw_context *context, const qw_options *options)
{
    return qw_run_until(context, options, (qw_stage)(QW_STAGE_COUNT - 1));
}

/* ---- results */

qw_status qw_get_mesh(const qw_context *context, qw_mesh_view *mesh)
{
    if (!context || !mesh) return QW_ARGUMENT;
    *mesh = (qw_mesh_view){.size = sizeof *mesh};
    if (context->state.done < QW_STAGE_COUNT) return QW_NOT_READY;
    *mesh = qw_view_of_result(&context->state.run);
    return QW_OK;
}

typedef struct save_call {
    qw_env *env;
    const qw_mesh_view *mesh;
    const char *path;
    qw_format format;
} save_call;

static void save_mesh(void *user)
{
    save_call *call = user;
    qw_write(call->env, call->path, call->format, call->mesh);
}

qw_status qw_save_mesh(qw_context *context, const char *path, qw_format format)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    qw_mesh_view mesh;
    if (qw_get_mesh(context, &mesh) != QW_OK)
        return qw_refuse(context, QW_NOT_READY, "the last stage has not finished yet: there is no mesh to save");
    save_call call = {context->state.env, &mesh, path, format};
    return qw_done(context, qw_protect(call.env, save_mesh, &call));
}

const qw_report *qw_get_report(const qw_context *context) { return context ? &context->state.report : NULL; }

/* ---- the short way */

struct qw_result {
    qw_context *context;
    qw_host host;
};

qw_status qw_remesh(const qw_mesh_view *input, const qw_options *options, const qw_host *host, qw_result **result)
{
    if (!result) return QW_ARGUMENT;
    *result = host_resize(host, NULL, 0, sizeof **result);
    if (!*result) return QW_MEMORY;
    **result = (qw_result){NULL, host ? *host : (qw_host){0}};
    if (qw_create(host, &(*result)->context) != QW_OK) {
        qw_result_destroy(*result);
        *result = NULL;
        return QW_MEMORY;
    }
    qw_status status = qw_set_mesh((*result)->context, input);
    return status == QW_OK ? qw_run((*result)->context, options) : status;
}

qw_mesh_view qw_result_mesh(const qw_result *result)
{
    qw_mesh_view mesh = {.size = sizeof mesh};
    if (result) qw_get_mesh(result->context, &mesh);
    return mesh;
}

const qw_report *qw_result_report(const qw_result *result) { return result ? qw_get_report(result->context) : NULL; }
const char *qw_result_message(const qw_result *result)
{
    return result ? qw_message(result->context) : "out of memory";
}

qw_status qw_result_provenance(qw_result *result, qw_provenance *provenance)
{
    return result ? qw_get_provenance(result->context, provenance) : QW_ARGUMENT;
}

qw_status qw_result_transfer(qw_result *result, const qw_attribute *attributes, uint32_t count, uint32_t most_weights,
                             const qw_attribute **transferred, qw_transfer_report *report)
{
    return result ? qw_transfer(result->context, attributes, count, most_weights, transferred, report) : QW_ARGUMENT;
}

void qw_result_destroy(qw_result *result)
{
    if (!result) return;
    qw_host host = result->host;
    qw_destroy(result->context);
    host_resize(&host, result, sizeof *result, 0);
}

/* ---- dumps */

qw_status qw_dump(qw_context *context, const char *path)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    if (context->state.done == 0)
        return qw_refuse(context, QW_NOT_READY, "no stage has finished yet: there is nothing to dump");
    return qw_done(context, qw_state_write(&context->state, path));
}

qw_status qw_resume(qw_context *context, const char *path)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to read from");
    if (context->state.has_input)
        return qw_refuse(context, QW_ARGUMENT, "the context has a mesh already: resume in one of its own");
    return qw_done(context, qw_state_read(&context->state, path));
}

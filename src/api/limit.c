/* The public functions over subdivision surfaces. */
#include "api/context.h"
#include "whole/kept_rims.h"
#include "products/limit/patch_blocks.h"
#include "products/limit/patch_faces.h"
#include "products/limit/patches.h"
#include "run/stages/designed.h"

#include <string.h>

typedef struct patches_call {
    qw_context_state *c;
    const char *path;
    bool blocks;
} patches_call;

static const qw_patch_faces *find_faces(qw_context_state *c, const qw_patches *patches)
{
    uint32_t count = patches->face_count, *of_cell = QW_NEW(c->env, uint32_t, count);
    double(*middle)[3] = qw_alloc(c->env, count, sizeof *middle);
    qw_patch_middles(patches, patches->blocks, middle);
    const qw_primitive *designed = qw_find_designed(&c->run, middle, count, of_cell);
    return qw_find_patch_faces(c->env, patches, patches->blocks, designed, of_cell);
}

/* How many faces there are: blocks that lie on one plane, cylinder or cone of the part are one. */
static void say_count(qw_env *env, const qw_patches *patches)
{
    uint32_t faces = patches->faces->count;
    for (uint32_t b = 0; b < patches->blocks->count; b++) faces += patches->faces->of_block[b] == QW_NONE;
    qw_log(env, QW_LOG_INFO, "the STEP file has %u faces, of %u blocks of quads", faces, patches->blocks->count);
}

/* Writes the limit surface as STEP: a patch for each quad, or blocks and faces where these are asked for. */
static void save_patches(void *user)
{
    const patches_call *call = user;
    const qw_run_state *run = &call->c->run;
    bool is_split = run->coarse.face_count > 0;
    if (run->joined.face_count > 0)
        qw_fail(call->c->env, QW_ARGUMENT, -1, "patches are of quads alone: polygons of the input were left out");
    qw_scope_begin(call->c->env);
    const qw_quadmesh *quads = is_split ? &run->coarse : &run->finished;
    qw_patches patches = qw_make_patches(call->c->env, quads, is_split ? run->coarse_output : run->output);
    if (call->blocks) patches.blocks = qw_join_patches(call->c->env, quads, &patches);
    if (patches.blocks) patches.faces = find_faces(call->c, &patches);
    if (patches.faces) say_count(call->c->env, &patches);
    qw_file *file = qw_file_begin(call->c->env, call->path);
    qw_put_step(call->c->env, file, &patches);
    qw_file_finish(file);
    qw_scope_end(call->c->env);
}

qw_status qw_save_patches(qw_context *context, const char *path)
{
    return qw_save_patches_from(context, path, QW_PATCHES_OF_QUADS);
}

qw_status qw_save_patches_from(qw_context *context, const char *path, qw_patches_from from)
{
    if (!context) return QW_ARGUMENT;
    if (!path || !path[0]) return qw_refuse(context, QW_ARGUMENT, "there is no path to write to");
    if (context->state.done < QW_STAGE_COUNT)
        return qw_refuse(context, QW_NOT_READY, "the last stage has not finished yet: there are no patches to save");
    patches_call call = {&context->state, path, from == QW_PATCHES_OF_BLOCKS};
    return qw_done(context, qw_protect(context->state.env, save_patches, &call));
}

qw_status qw_get_coarse(const qw_context *context, qw_mesh_view *mesh)
{
    if (!context || !mesh) return QW_ARGUMENT;
    const qw_run_state *run = &context->state.run;
    *mesh = (qw_mesh_view){.size = sizeof *mesh};
    if (context->state.done < QW_STAGE_COUNT) return QW_NOT_READY;
    *mesh = qw_view_of_result(run);
    if (run->coarse.face_count == 0) return QW_OK;
    mesh->vertex_count = run->coarse.vertex_count, mesh->face_count = run->coarse.face_count;
    mesh->positions = run->coarse_output, mesh->corners = run->coarse.corner;
    mesh->marked_edges = run->creases, mesh->marked_edge_count = run->crease_count;
    return QW_OK;
}

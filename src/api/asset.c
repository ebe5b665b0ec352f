/* The public functions that give a result texture coordinates of its own. What they make lies in the scope of the last
 * stage and goes with it. */
#include "api/asset.h"

#include "base/platform.h"
#include "api/context.h"
#include "products/atlas/blocks.h"
#include "products/atlas/seen.h"
#include "whole/kept_rims.h"

#include <math.h>
#include <string.h>

typedef struct unwrap_call {
    qw_context_state *c;
    const qw_asset_options *options;
    const int32_t *borders;
} unwrap_call;

static void drop_asset(qw_context_state *c)
{
    if (!c->asset) return;
    qw_drop_maps(c);
    qw_free(c->env, c->asset->atlas.uv), qw_free(c->env, c->asset->atlas.chart), qw_free(c->env, c->asset);
    c->asset = NULL;
}

static void begin_report(qw_asset_report *r)
{
    *r = (qw_asset_report){
        .size = sizeof *r,
#define QW_MAPS_WHOLE(name, unit, help) .name = -1,
#define QW_MAPS_REAL(name, unit, help)  .name = -1,
#include "quadwright/report.def"
    };
}

static void report_atlas(qw_asset *asset, const qw_asset_options *o)
{
    const qw_atlas *a = &asset->atlas;
    qw_asset_report *r = &asset->report;
    begin_report(r);
    r->charts = a->charts, r->overlapping_charts = a->overlapping, r->tiles = a->packing.tiles;
    r->angle_stretch = a->angle, r->area_stretch = a->area, r->used = a->packing.used;
    r->seam_length = a->seam_length, r->texel_density = a->packing.scale * (double)o->texture;
}

const double *qw_scaled_positions(qw_env *env, const qw_mesh_view *view, int *exponent)
{
    size_t count = 3 * (size_t)view->vertex_count;
    double *p = QW_NEW(env, double, count), most = 0;
    for (size_t i = 0; i < count; i++) most = fmax(most, fabs(view->positions[i]));
    frexp(most, exponent);
    *exponent = -*exponent;
    for (size_t i = 0; i < count; i++) p[i] = ldexp(view->positions[i], *exponent);
    return p;
}

qw_status qw_protect_working(qw_context *context, void (*body)(void *user), void *user)
{
    double told = context->told, began = qw_seconds_now();
    qw_env *env = context->state.env;
    qw_report *report = &context->state.report;
    context->told = 0; /* it may fall, as other work begins */
    qw_env_reset_peak(env);
    qw_status status = qw_protect_listening(env, body, user);
    context->told = told;
    qw_end_work(env);
    report->seconds += qw_seconds_now() - began;
    if (qw_env_peak(env) > report->peak_bytes) report->peak_bytes = qw_env_peak(env);
    return status;
}

/* Cuts the result into charts, lays them into tiles, and keeps their coordinates as the context's asset. */
static void unwrap(void *user)
{
    unwrap_call *call = user;
    qw_context_state *c = call->c;
    const qw_asset_options *o = call->options;
    drop_asset(c);
    qw_begin_work(c->env);
    qw_asset *asset = QW_NEW_ZERO(c->env, qw_asset, 1);
    qw_scope_begin(c->env);
    qw_mesh_view view = qw_view_of_result(&c->run);
    const qw_quadmesh *quads = &c->run.finished;
    qw_atlas_mesh mesh = qw_atlas_mesh_of(c->env, &view, quads->mark, quads->mark ? 4 * quads->face_count : 0,
                                          call->borders);
    int exponent;
    mesh.position = qw_scaled_positions(c->env, &view, &exponent);
    qw_atlas_options options = {.most_stretch = o->stretch,
                                .focus = o->texel_focus,
                                .pack = {.texels = (uint32_t)o->texture,
                                         .margin = (uint32_t)o->margin,
                                         .tiles = (uint32_t)o->tiles,
                                         .scale = ldexp(o->texel_density / (double)o->texture, -exponent)}};
    if (o->unwrap_grid == 0) options.weight = qw_seam_weights(c->env, &mesh);
    const qw_mirror_plane *plane = &c->run.mirror.plane[0];
    if (c->run.mirror.is_used && !c->run.mirror.own && o->unwrap_grid == 0)
        options.mirror = qw_mirrored_corners(c->env, &mesh, plane->normal, ldexp(plane->offset, exponent));
    const qw_block_options blocks = {
        .texels = options.pack.texels, .tiles = options.pack.tiles, .per_quad = (uint32_t)o->unwrap_grid};
    asset->atlas = o->unwrap_grid > 0 ? qw_make_block_atlas(c->env, &mesh, &blocks)
                                      : qw_make_atlas(c->env, &mesh, &options);
    asset->atlas.seam_length = ldexp(asset->atlas.seam_length, -exponent);
    asset->atlas.packing.scale = ldexp(asset->atlas.packing.scale, exponent);
    qw_keep(c->env, asset->atlas.uv), qw_keep(c->env, asset->atlas.chart);
    uint32_t corners = mesh.corner_count;
    qw_scope_end(c->env);
    asset->options = *o;
    asset->uv = (qw_attribute){.size = sizeof asset->uv,
                               .name = "uv",
                               .domain = QW_PER_CORNER,
                               .kind = QW_UVS,
                               .components = 2,
                               .count = corners,
                               .values = asset->atlas.uv};
    report_atlas(asset, o);
    c->asset = asset;
}

qw_status qw_unwrap(qw_context *context, const qw_asset_options *options, const int32_t *borders, qw_attribute *uv,
                    qw_asset_report *report)
{
    char message[sizeof context->message];
    if (!context || !uv) return QW_ARGUMENT;
    *uv = (qw_attribute){.size = sizeof *uv};
    if (report) begin_report(report);
    if (context->state.done < QW_STAGE_COUNT)
        return qw_refuse(context, QW_NOT_READY, "the last stage has not finished yet: there is no result to unwrap");
    if (qw_asset_options_validate(options, message, sizeof message) != QW_OK)
        return qw_refuse(context, QW_OPTION, message);
    qw_context_state *c = &context->state;
    unwrap_call call = {c, options, borders};
    qw_status status = qw_protect_working(context, unwrap, &call);
    if (status != QW_OK) return qw_done(context, status);
    *uv = c->asset->uv;
    if (report) *report = c->asset->report;
    return qw_done(context, QW_OK);
}

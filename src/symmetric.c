/* The surface is cleaned as ever; the plane is found or given; the part on one side of it is the input of a run of its
 * own, for which the cut is a boundary, so that quads are aligned to it. What that run leaves is reflected. A second
 * run with other options goes on from what the half's context still has.
 *
 * The connectivity is that of the half twice, sewn along the cut: so it is a surface, and with its topology the whole
 * has that of the surface's half and its reflection.
 */
#include "symmetric.h"

#include "mesh/bvh.h"
#include "mesh/marks.h"
#include "quad/written.h"
#include "sizes.h"
#include "symmetry/half.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A surface is nearly symmetric if 95 % of it, reflected, lie within this share of its diagonal. */
static const double NEARLY = 0.01;
/* Vertices of the half's boundary that lie within this share of the diagonal of the plane are those of the cut. */
static const double ON_PLANE = 1e-5;
/* The share of the progress that finding and cutting take. */
static const double BEFORE_HALF = 0.05;
/* A reflected vertex goes to its own side of the surface only within this many mean edges, and by turns of a quad's
   normal of at most this cosine. */
static const double FOLLOWED = 1;
static const float LEAST_TURN = 0.5f;
enum { FOLLOW_ROUNDS = 4 };

typedef struct symmetric_call {
    qw_context *context;
    const qw_options *options;
    qw_mirror_search found; /* of find_plane */
    qw_half half;           /* of cut_surface */
    double *position;       /* double[clean vertices][3] */
} symmetric_call;

/* ---- the plane */

static bool plane_is_given(const qw_options *o) { return o->symmetry == QW_SYMMETRY_PLANE; }

static void find_plane(void *user)
{
    symmetric_call *call = user;
    qw_run_state *run = &call->context->state.run;
    const qw_options *o = call->options;
    if (plane_is_given(o)) {
        double normal[3] = {o->symmetry_x, o->symmetry_y, o->symmetry_z};
        if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
            qw_fail(run->env, QW_OPTION, -1, "the plane of symmetry has no normal: symmetry_x, _y and _z are all 0");
        call->found = (qw_mirror_search){qw_mirror_plane_of(normal, o->symmetry_offset), -1, -1};
        return;
    }
    int axis = o->symmetry == QW_SYMMETRY_AUTO ? QW_NO_AXIS : (int)o->symmetry - QW_SYMMETRY_X;
    call->found = qw_find_mirror_plane(run->env, &run->clean.mesh, &run->clean.frame, axis);
}

static void report_plane(qw_report *report, const qw_mirror_search *found, bool is_used)
{
    report->symmetric = is_used;
    report->symmetry_gap = found->gap;
    report->plane_x = is_used ? found->plane.normal[0] : 0, report->plane_y = is_used ? found->plane.normal[1] : 0;
    report->plane_z = is_used ? found->plane.normal[2] : 0, report->plane_offset = is_used ? found->plane.offset : 0;
}

/* ---- the half */

static void in_input(const qw_run_state *run, qw_vec3 point, double to[3])
{
    const qw_frame *frame = &run->clean.frame;
    double q[3] = {point.x, point.y, point.z};
    qw_leave_own_frame(&run->clean.own, point, q);
    for (int k = 0; k < 3; k++) to[k] = frame->center[k] + q[k] / frame->scale;
}

static void cut_surface(void *user)
{
    symmetric_call *call = user;
    qw_run_state *run = &call->context->state.run;
    qw_trimesh surface = run->clean.mesh;
    if (run->options.sharp_marks || run->options.keep_marks)
        qw_take_marks(run->env, run->input, &run->clean.frame, &surface);
    double *position = QW_NEW(run->env, double, 3 * (size_t)surface.vertex_count);
    for (uint32_t v = 0; v < surface.vertex_count; v++) in_input(run, surface.position[v], position + 3 * (size_t)v);
    call->half = qw_cut_half(run->env, &surface, position, &call->found.plane);
    if (call->half.face_count == 0)
        qw_fail(run->env, QW_OPTION, -1, "the whole surface lies in the plane of symmetry");
}

/* The host of the half's context is told of the share of the progress that is left. */
static int pass_progress(void *user, qw_stage stage, double fraction)
{
    const qw_host *host = &((const qw_context *)user)->host;
    return host->progress(host->progress_user, stage, BEFORE_HALF + (1 - BEFORE_HALF) * fraction);
}

static qw_status make_half_context(qw_context *context)
{
    qw_host host = context->host;
    if (context->half) return QW_OK;
    if (host.progress) host.progress = pass_progress, host.progress_user = context;
    if (host.memory_limit) {
        size_t held = qw_env_bytes(context->state.env);
        host.memory_limit = host.memory_limit > held ? host.memory_limit - held : 1;
    }
    return qw_create(&host, &context->half);
}

static qw_status set_half(symmetric_call *call)
{
    const qw_half *h = &call->half;
    qw_mesh_view view = {.size = sizeof view,
                         .vertex_count = h->vertex_count,
                         .face_count = h->face_count,
                         .uniform_face_size = 3,
                         .positions = h->position,
                         .corners = h->corner,
                         .marked_edges = h->mark,
                         .marked_edge_count = h->mark_count};
    return qw_set_mesh(call->context->half, &view);
}

static qw_options options_of_half(const symmetric_call *call)
{
    qw_options o = *call->options;
    double faces = qw_faces_wanted(&call->context->state.run, call->options);
    o.symmetry = QW_SYMMETRY_NONE;
    o.symmetry_x = o.symmetry_y = o.symmetry_z = o.symmetry_offset = 0, o.symmetry_follow = 0;
    o.vertices = 0, o.edge_length = 0, o.ratio = 0;
    o.faces = (int64_t)fmax(1, floor(faces / 2 + 0.5));
    o.align_boundary = 1; /* the cut is a boundary */
    o.min_component = 0, o.outward = 0; /* the surface is clean */
    return o;
}

/* ---- the whole */

static qw_vec3 in_frame(const qw_frame *frame, const double p[3])
{
    return qw_v3((float)((p[0] - frame->center[0]) * frame->scale), (float)((p[1] - frame->center[1]) * frame->scale),
                 (float)((p[2] - frame->center[2]) * frame->scale));
}

static void place_in_frame(const qw_run_state *run, qw_quadmesh *quads, const double *position)
{
    quads->position = QW_NEW(run->env, qw_vec3, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        quads->position[v] = in_frame(&run->clean.frame, position + 3 * (size_t)v);
}

/* Each reflected vertex goes to the nearest point of the surface that faces its way. Where that would turn a quad over,
   its vertices stay. first: the first vertex that is a reflection. */
static void follow_own_side(const qw_run_state *run, qw_quadmesh *quads, double *position, uint32_t first, float reach)
{
    qw_env *env = run->env;
    const qw_frame *frame = &run->clean.frame;
    qw_scope_begin(env);
    qw_bvh *bvh = qw_bvh_build(env, &run->clean.mesh);
    qw_vec3 *normal = qw_quadmesh_vertex_normals(env, quads), *before = QW_NEW(env, qw_vec3, quads->vertex_count);
    memcpy(before, quads->position, quads->vertex_count * sizeof *before);
    for (uint32_t v = first; v < quads->vertex_count; v++) {
        qw_break_silence(env);
        qw_hit hit = qw_bvh_nearest(bvh, before[v], normal[v], QW_SAME_SHEET, reach, QW_NONE);
        if (hit.face != QW_NONE) quads->position[v] = hit.point;
    }
    uint32_t turned = 1;
    for (int round = 0; round < FOLLOW_ROUNDS && turned > 0; round++) {
        turned = 0;
        for (uint32_t f = quads->face_count / 2; f < quads->face_count; f++) {
            const uint32_t *corner = quads->corner + 4 * (size_t)f;
            qw_vec3 now = qw_normalize(qw_quad_cross(quads->position, corner)),
                    was = qw_normalize(qw_quad_cross(before, corner));
            if (qw_dot(now, was) >= LEAST_TURN) continue;
            for (int i = 0; i < 4; i++) turned++, quads->position[corner[i]] = before[corner[i]];
        }
    }
    for (uint32_t v = first; v < quads->vertex_count; v++) {
        qw_vec3 p = quads->position[v];
        const double q[3] = {p.x, p.y, p.z};
        if (memcmp(&p, &before[v], sizeof p) == 0) continue;
        for (int k = 0; k < 3; k++) position[3 * (size_t)v + (size_t)k] = frame->center[k] + q[k] / frame->scale;
    }
    qw_scope_end(env);
}

static void require_surface(const qw_run_state *run, const qw_quadmesh *quads, const double *position)
{
    qw_quadmesh_validate(run->env, quads);
    if (qw_quadmesh_double_edges(run->env, quads, NULL) > 0)
        qw_fail(run->env, QW_INTERNAL, -1,
                "a part that the plane of symmetry cuts is a single quad wide on each side, so the two sides do not make "
                "a surface: more quads are needed");
    for (uint32_t f = 0; f < quads->face_count; f++)
        if (qw_is_degenerate(quads->corner + 4 * (size_t)f, position))
            qw_fail(run->env, QW_INTERNAL, f, "quad %u has no area at the plane of symmetry, so the result is withheld",
                    f);
}

/* The report of the half, but for what came in. */
static void take_report(symmetric_call *call)
{
    qw_report *r = &call->context->state.report, input = *r;
    *r = *qw_get_report(call->context->half);
#define KEEP(name) r->name = input.name
    KEEP(input_vertices), KEEP(input_faces), KEEP(input_triangles), KEEP(welded_vertices), KEEP(dropped_degenerate);
    KEEP(dropped_duplicate), KEEP(dropped_isolated), KEEP(dropped_components), KEEP(flipped_triangles);
    KEEP(turned_components), KEEP(split_edges), KEEP(split_vertices), KEEP(one_sided_seam_edges);
    KEEP(unfolded_vertices), KEEP(components), KEEP(boundary_loops), KEEP(euler);
#undef KEEP
    r->faces_asked = (int64_t)floor(qw_faces_wanted(&call->context->state.run, call->options) + 0.5);
    r->stages[QW_STAGE_CLEAN].seconds += input.stages[QW_STAGE_CLEAN].seconds;
    r->seconds += input.stages[QW_STAGE_CLEAN].seconds;
    uint32_t own = r->warning_count, most = sizeof r->warnings / sizeof *r->warnings;
    for (uint32_t i = 0; i < input.warning_count && own + i < most; i++)
        memcpy(r->warnings[own + i], input.warnings[i], sizeof r->warnings[0]), r->warning_count++;
    report_plane(r, &call->found, true);
}

static void make_whole(void *user)
{
    symmetric_call *call = user;
    qw_context_state *c = &call->context->state;
    qw_run_state *run = &c->run;
    const qw_run_state *half = &call->context->half->state.run;
    const qw_mirror_plane *plane = &call->context->half_plane;
    uint32_t *twin;
    double near = ON_PLANE / run->clean.frame.scale;
    qw_quadmesh quads = half->finished;
    qw_quadmesh whole = qw_mirror_quads(run->env, &quads, half->output, plane, near, &run->output, &twin);
    take_report(call);
    place_in_frame(run, &whole, run->output);
    if (call->options->symmetry_follow)
        follow_own_side(run, &whole, run->output, quads.vertex_count,
                        (float)(FOLLOWED * half->rho * run->clean.frame.scale / half->clean.frame.scale));
    require_surface(run, &whole, run->output);
    run->finished = whole;
    qw_free(run->env, twin);
}

/* ---- running */

static void warn_of_gap(qw_context_state *c, double gap)
{
    char text[sizeof c->report.warnings[0]];
    snprintf(text, sizeof text,
             "no plane of symmetry was found: about the best, the surface is off by %.2g of its diagonal in the mean", gap);
    qw_warn(&c->run, text);
}

/* Finds the plane, once for each surface. */
static qw_status require_plane(symmetric_call *call)
{
    qw_context *context = call->context;
    if (context->state.begun == context->searched) return QW_OK;
    qw_status status = qw_protect(context->state.env, find_plane, call);
    if (status != QW_OK) return status;
    bool is_used = call->options->symmetry != QW_SYMMETRY_AUTO || call->found.most <= NEARLY;
    if (!is_used) warn_of_gap(&context->state, call->found.gap);
    context->searched = context->state.begun;
    context->found = call->found, context->is_symmetric = is_used;
    qw_forget_half(context);
    return QW_OK;
}

static qw_status require_half(symmetric_call *call)
{
    qw_context *context = call->context;
    if (context->half) return QW_OK;
    qw_env *env = context->state.env;
    qw_scope_begin(env);
    qw_status status = qw_protect(env, cut_surface, call);
    if (status == QW_OK) status = make_half_context(context);
    if (status == QW_OK) status = set_half(call);
    context->half_plane = call->half.plane;
    if (status != QW_OK) qw_forget_half(context);
    qw_scope_end(env);
    return status;
}

static qw_status run_half(symmetric_call *call)
{
    qw_context *context = call->context;
    qw_options options = options_of_half(call);
    qw_status status = require_half(call);
    if (status == QW_OK) {
        status = qw_run(context->half, &options);
        if (status != QW_OK) return qw_refuse(context, status, qw_message(context->half));
        status = qw_drive_at_once(&context->state, make_whole, call);
    }
    return qw_done(context, status);
}

qw_status qw_drive_symmetric(qw_context *context, const qw_options *options, qw_stage last)
{
    symmetric_call call = {.context = context, .options = options};
    qw_status status = qw_drive(&context->state, options, QW_STAGE_CLEAN);
    if (status != QW_OK || last == QW_STAGE_CLEAN) return qw_done(context, status);
    if (context->state.done == QW_STAGE_COUNT) return qw_done(context, QW_OK);
    status = require_plane(&call);
    if (status != QW_OK) return qw_done(context, status);
    call.found = context->found;
    if (!context->is_symmetric) {
        status = qw_drive(&context->state, options, last);
        report_plane(&context->state.report, &call.found, false);
        return qw_done(context, status);
    }
    if (last + 1 != QW_STAGE_COUNT)
        return qw_refuse(context, QW_ARGUMENT, "a symmetric run has no single stages: only one side is remeshed");
    return run_half(&call);
}

void qw_forget_half(qw_context *context)
{
    qw_destroy(context->half);
    context->half = NULL;
}

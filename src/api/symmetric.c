/* The surface is cleaned as ever; the plane is found or given; the part on one side of it is the input of a run of its
 * own, for which the cut is a boundary, so that quads are aligned to it. What that run leaves is reflected. A second
 * run with other options goes on from what the half's context still has.
 *
 * The connectivity is that of the half twice, sewn along the cut: so it is a surface, and with its topology the whole
 * has that of the surface's half and its reflection.
 */
#include "api/symmetric.h"

#include "base/platform.h"
#include "base/promise.h"
#include "mesh/marks.h"
#include "demand/painted.h"
#include "quad/chords.h"
#include "quad/written.h"
#include "demand/sizes.h"
#include "symmetry/half.h"
#include "symmetry/rim.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* A surface is nearly symmetric if 95 % of it, reflected, lie within this share of its diagonal. */
static const double NEARLY = 0.01;
/* A vertex of the half's surface belongs to the cut if it lies within this share of the diagonal of the plane: the
   half's positions are in single precision. */
static const double ON_PLANE = 1e-6;
/* Share of the whole progress that is reported when the plane is found and the surface cut. */
static const double BEFORE_HALF = 0.05;
/* A reflected vertex is moved onto its own side of the surface if that is within this many mean edges and no quad's
   normal turns by more than LEAST_TURN, a cosine. */
static const double FOLLOWED = 1;
static const float LEAST_TURN = 0.5f;
/* If there is no room for both sides, this share more quads is asked for; each further attempt doubles the share. */
static const double MORE_ROOM = 0.02;
enum { FOLLOW_ROUNDS = 4, SPLIT_ROUNDS = 4, COUNT_ATTEMPTS = 5 };

typedef struct symmetric_call {
    qw_context *context;
    const qw_options *options;
    const qw_mirror_search *found; /* the plane of context->found that is used */
    qw_half half;                  /* filled by cut_surface */
    qw_density *density;           /* qw_density[half.vertex_count]; NULL: none is painted */
    int64_t faces;                 /* number of quads that the half's run is asked for */
    double before;                 /* seconds that finding planes and cutting took */
    double spent[QW_STAGE_COUNT];  /* seconds of all attempts of the half, from the working mesh on */
} symmetric_call;

/* ---- the plane */

static bool plane_is_given(const qw_options *o) { return o->symmetry == QW_SYMMETRY_PLANE; }

static void find_planes(void *user)
{
    symmetric_call *call = user;
    qw_context *context = call->context;
    qw_run_state *run = &context->state.run;
    const qw_options *o = call->options;
    if (plane_is_given(o)) {
        double normal[3] = {o->symmetry_x, o->symmetry_y, o->symmetry_z};
        if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0)
            qw_fail(run->env, QW_OPTION, -1, "the plane of symmetry has no normal: symmetry_x, _y and _z are all 0");
        context->found[0] = (qw_mirror_search){qw_mirror_plane_of(normal, o->symmetry_offset), -1, -1, -1};
        context->planes = 1;
        return;
    }
    int axis = o->symmetry == QW_SYMMETRY_AUTO ? QW_NO_AXIS : (int)o->symmetry - QW_SYMMETRY_X;
    context->planes = qw_find_mirror_planes(run->env, &run->clean.mesh, &run->clean.frame, axis, context->found);
}

static void report_plane(qw_report *report, const qw_mirror_search *found, bool is_used)
{
    report->symmetric = is_used;
    report->symmetry_gap = found->gap;
    report->symmetry_far = found->far;
    report->plane_x = is_used ? found->plane.normal[0] : 0, report->plane_y = is_used ? found->plane.normal[1] : 0;
    report->plane_z = is_used ? found->plane.normal[2] : 0, report->plane_offset = is_used ? found->plane.offset : 0;
}

/* ---- the half */

static const char ONE_SIDED[] =
    "a one-sided surface, such as a Moebius strip, cannot be made symmetric: its two sides cannot be told apart";

static bool is_one_sided(const qw_context *context) { return context->state.run.clean.counts.one_sided_seam_edges > 0; }

static void in_input(const qw_run_state *run, qw_vec3 point, double to[3])
{
    const qw_frame *frame = &run->clean.frame;
    double q[3] = {point.x, point.y, point.z};
    qw_leave_own_frame(&run->clean.own, point, q);
    for (int k = 0; k < 3; k++) to[k] = frame->center[k] + q[k] / frame->scale;
}

static qw_density *density_of_half(const qw_run_state *run, const qw_half *half)
{
    if (!run->input->density) return NULL;
    qw_density *painted = qw_painted_at_clean(run), *density = QW_NEW(run->env, qw_density, half->vertex_count);
    for (uint32_t v = 0; v < half->vertex_count; v++) {
        const qw_half_vertex *o = &half->origin[v];
        density[v] = (qw_density)((1 - o->share) * (double)painted[o->from] + o->share * (double)painted[o->to]);
    }
    return density;
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
    call->half = qw_cut_half(run->env, &surface, position, &call->found->plane);
    call->density = density_of_half(run, &call->half);
    if (is_one_sided(call->context)) qw_fail(run->env, QW_UNSUPPORTED, -1, "%s", ONE_SIDED);
    if (call->half.face_count == 0) qw_fail(run->env, QW_OPTION, -1, "the whole surface lies in the plane of symmetry");
}

/* Passes the progress of the half's context to the host, scaled to the share after BEFORE_HALF. */
static int pass_progress(void *user, qw_stage stage, double fraction)
{
    if (fraction >= 1) return 0; /* the half is done, the whole is not */
    return qw_tell_progress(user, stage, BEFORE_HALF + (1 - BEFORE_HALF) * fraction);
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
    qw_status status = qw_set_mesh(call->context->half, &view);
    memcpy(call->context->cut, h->plane.normal, sizeof h->plane.normal);
    call->context->cut[3] = h->plane.offset;
    call->context->half->state.input.cut = call->context->cut;
    if (status == QW_OK && call->density) status = qw_set_density(call->context->half, call->density, h->vertex_count);
    return status;
}

static qw_options options_of_half(const symmetric_call *call)
{
    qw_options o = *call->options;
    o.symmetry = QW_SYMMETRY_NONE;
    o.symmetry_x = o.symmetry_y = o.symmetry_z = o.symmetry_offset = 0, o.symmetry_follow = 0;
    o.vertices = 0, o.edge_length = 0, o.ratio = 0;
    o.faces = call->faces;
    if (call->options->symmetry_follow)
        o.fit = 0;                      /* vertices of the other side are moved onto the surface afterwards */
    o.align_boundary = 1;               /* the cut is a boundary */
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

/* Moves each reflected vertex to the nearest point of the surface whose normal agrees. Where that would flip a quad,
   its vertices stay. first: index of the first reflected vertex; those before it belong to the half. */
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

static void require_surface(const qw_run_state *run, const qw_census *wanted, const qw_quadmesh *quads,
                            const double *position)
{
    qw_quad_census has = qw_quadmesh_census(run->env, quads);
    qw_quadmesh_validate(run->env, quads);
    qw_log(run->env, QW_LOG_DEBUG, "sewn: %u double edges, %d components, %d loops, euler %d; wanted %d, %d, %d",
           (unsigned)has.double_edges, (int)has.components, (int)has.boundary_loops, (int)has.euler,
           (int)wanted->components, (int)wanted->boundary_loops, (int)wanted->euler);
    if (has.double_edges || has.components != wanted->components || has.boundary_loops != wanted->boundary_loops ||
        has.euler != wanted->euler)
        qw_fail(run->env, QW_INTERNAL, -1,
                "a part that the plane of symmetry cuts is too small for the two sides to keep its topology: more "
                "quads are "
                "needed, or no symmetry");
    for (uint32_t f = 0; f < quads->face_count; f++)
        if (qw_is_degenerate(quads->corner + 4 * (size_t)f, position))
            qw_fail(run->env, QW_INTERNAL, f, "quad %u has no area at the plane of symmetry, so the result is withheld",
                    f);
}

/* Takes the report of the half's run, except for what it says of the input. */
static void take_report(symmetric_call *call)
{
    qw_report *r = &call->context->state.report, input = *r;
    *r = *qw_get_report(call->context->half);
#define KEEP(name) r->name = input.name
    KEEP(input_vertices), KEEP(input_faces), KEEP(input_triangles), KEEP(welded_vertices), KEEP(sewn_junctions),
        KEEP(dropped_degenerate);
    KEEP(dropped_duplicate), KEEP(dropped_isolated), KEEP(dropped_components), KEEP(flipped_triangles);
    KEEP(turned_components), KEEP(split_edges), KEEP(split_vertices), KEEP(one_sided_seam_edges);
    KEEP(unfolded_vertices), KEEP(components), KEEP(boundary_loops), KEEP(euler);
#undef KEEP
    r->faces_asked = (int64_t)floor(qw_faces_wanted(&call->context->state.run, call->options) + 0.5);
    r->stages[QW_STAGE_CLEAN].seconds += input.stages[QW_STAGE_CLEAN].seconds + call->before;
    r->peak_bytes += qw_env_bytes(call->context->state.env);
    uint32_t own = r->warning_count, most = sizeof r->warnings / sizeof *r->warnings;
    for (uint32_t i = 0; i < input.warning_count && own + i < most; i++)
        memcpy(r->warnings[own + i], input.warnings[i], sizeof r->warnings[0]), r->warning_count++;
    report_plane(r, call->found, true);
}

/* Warns if more than a thousandth of the surface lies farther than an edge length from the reflected surface. */
static void warn_of_one_sided_detail(symmetric_call *call)
{
    qw_run_state *run = &call->context->state.run;
    const qw_run_state *half = &call->context->half->state.run;
    double edge = half->rho * run->clean.frame.scale / half->clean.frame.scale; /* in diagonals, as `far` is */
    if (call->found->far <= edge) return;
    char text[sizeof run->report->warnings[0]];
    snprintf(text, sizeof text,
             "the sides of the plane of symmetry differ by %.2g edges and more in places: what only one side has is "
             "gone, or on both",
             call->found->far / edge);
    qw_warn(run, text);
}

static qw_rim rim_of(qw_env *env, const qw_run_state *half, const qw_mirror_plane *plane)
{
    const qw_trimesh *m = &half->clean.mesh;
    double near = ON_PLANE / half->clean.frame.scale;
    uint8_t *on = QW_NEW(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double p[3];
        in_input(half, m->position[v], p);
        on[v] = fabs(qw_plane_height(plane, p)) <= near;
    }
    qw_rim rim = qw_rim_of(env, m, on);
    qw_free(env, on);
    return rim;
}

/* Splits rows of quads whose two long sides both lie on the plane, and quads all of whose sides do: sewn to their
   reflections they would share all vertices with these. */
static void split_narrow(qw_env *env, qw_quadmesh *quads, const qw_rim *rim)
{
    for (int round = 0; round < SPLIT_ROUNDS; round++) {
        uint8_t *sewn = qw_find_sewn(env, rim, quads), *on = QW_NEW_ZERO(env, uint8_t, quads->vertex_count);
        uint8_t *split = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)quads->face_count);
        bool any = false;
        for (uint32_t h = 0; h < 4 * quads->face_count; h++)
            if (sewn[h]) on[quads->corner[h]] = on[quads->corner[qw_quad_next(h)]] = 1;
        for (uint32_t h = 0; h < 4 * quads->face_count; h++) {
            const uint8_t *side = sewn + (h & ~3u);
            bool is_alone = side[0] && side[1] && side[2] && side[3];
            if ((sewn[h] && !is_alone) || !on[quads->corner[h]] || !on[quads->corner[qw_quad_next(h)]] || split[h])
                continue;
            qw_mark_chord(quads, h, split);
            any = true;
        }
        if (any) qw_split_chords(env, quads, split);
        qw_free(env, sewn), qw_free(env, on), qw_free(env, split);
        if (!any) break;
    }
}

static qw_quadmesh copy_of_half(qw_env *env, const qw_quadmesh *half)
{
    qw_quadmesh copy = {.vertex_count = half->vertex_count, .face_count = half->face_count};
    size_t sides = 4 * (size_t)half->face_count;
    copy.position = QW_NEW(env, qw_vec3, half->vertex_count);
    copy.corner = QW_NEW(env, uint32_t, sides), copy.twin = QW_NEW(env, uint32_t, sides);
    copy.kind = QW_NEW_ZERO(env, uint8_t, half->vertex_count), copy.mark = QW_NEW_ZERO(env, uint8_t, sides);
    copy.component = QW_NEW_ZERO(env, uint32_t, half->vertex_count);
    memcpy(copy.position, half->position, half->vertex_count * sizeof *copy.position);
    memcpy(copy.corner, half->corner, sides * sizeof *copy.corner);
    memcpy(copy.twin, half->twin, sides * sizeof *copy.twin);
    return copy;
}

static void make_whole(void *user)
{
    symmetric_call *call = user;
    qw_context_state *c = &call->context->state;
    qw_run_state *run = &c->run;
    const qw_run_state *half = &call->context->half->state.run;
    const qw_mirror_plane *plane = &call->context->half_plane;
    qw_env *env = run->env;
    uint32_t *twin;
    qw_rim rim = rim_of(env, half, plane);
    qw_quadmesh quads = copy_of_half(env, &half->finished);
    split_narrow(env, &quads, &rim);
    const uint8_t *sewn = qw_find_sewn(env, &rim, &quads);
    double *position = QW_NEW(env, double, 3 * (size_t)quads.vertex_count);
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        bool is_kept = v < half->finished.vertex_count &&
                       memcmp(&quads.position[v], &half->finished.position[v], sizeof *quads.position) == 0;
        if (is_kept) memcpy(position + 3 * (size_t)v, half->output + 3 * (size_t)v, 3 * sizeof *position);
        else in_input(half, quads.position[v], position + 3 * (size_t)v);
    }
    qw_quadmesh whole = qw_mirror_quads(env, &quads, position, plane, sewn, &run->output, &twin);
    take_report(call);
    warn_of_one_sided_detail(call);
    place_in_frame(run, &whole, run->output);
    if (call->options->symmetry_follow)
        follow_own_side(run, &whole, run->output, quads.vertex_count,
                        (float)(FOLLOWED * half->rho * run->clean.frame.scale / half->clean.frame.scale));
    require_surface(run, &call->context->whole, &whole, run->output);
    run->finished = whole;
    qw_free(run->env, twin);
}

/* ---- running */

static void warn_of_gap(qw_context_state *c, double gap)
{
    char text[sizeof c->report.warnings[0]];
    snprintf(text, sizeof text,
             "no plane of symmetry was found: about the best, the surface is off by %.2g of its diagonal in the mean",
             gap);
    qw_warn(&c->run, text);
}

static bool is_auto(const symmetric_call *call) { return call->options->symmetry == QW_SYMMETRY_AUTO; }

/* Whether `auto` may use the plane. */
static bool is_near(const qw_context *context, uint32_t plane)
{
    return !is_one_sided(context) && plane < context->planes && context->found[plane].most <= NEARLY;
}

static void use_plane(symmetric_call *call, uint32_t plane)
{
    call->context->plane = plane;
    call->found = &call->context->found[plane];
    qw_forget_half(call->context);
}

/* Finds planes, once for each surface. */
static qw_status require_planes(symmetric_call *call)
{
    qw_context *context = call->context;
    call->found = &context->found[context->plane];
    if (context->state.begun == context->searched) return QW_OK;
    qw_status status = qw_protect(context->state.env, find_planes, call);
    if (status != QW_OK) return status;
    context->searched = context->state.begun;
    context->clean_warnings = context->state.report.warning_count;
    use_plane(call, 0);
    if (!is_auto(call) || is_near(context, 0)) return QW_OK;
    if (is_one_sided(context)) qw_warn(&context->state.run, ONE_SIDED);
    else warn_of_gap(&context->state, call->found->gap);
    return QW_OK;
}

/* Gives the plane up: the next one found is tried, or the run goes on without symmetry and the report says why. */
static void leave_plane(symmetric_call *call, const char *reason)
{
    qw_context *context = call->context;
    qw_drive_back(&context->state);
    context->is_symmetric = is_near(context, context->plane + 1);
    use_plane(call, context->is_symmetric ? context->plane + 1 : 0);
    if (!context->is_symmetric) qw_warn(&context->state.run, reason);
}

static bool is_like(const qw_census *a, const qw_census *b)
{
    return a->components == b->components && a->boundary_loops == b->boundary_loops && a->euler == b->euler;
}

static const char *const OTHER_TOPOLOGY = "the two sides of the plane of symmetry have different holes, handles or "
                                          "parts: the result has those of one side twice";
static const char *const NOT_USED =
    "the two sides of the plane of symmetry have different holes, handles or parts: it was not used";
static const char *const NO_ROOM =
    "so few quads have no room for both sides of a part at the plane of symmetry: it was not used";
static const char *const OTHER_COUNT = "parts that the plane of symmetry cuts need at least two quads on each side: "
                                       "there are more or fewer than asked for";

static qw_status make_half(symmetric_call *call)
{
    qw_context *context = call->context;
    qw_status status = qw_protect(context->state.env, cut_surface, call);
    if (status != QW_OK) return qw_done(context, status);
    if (make_half_context(context) != QW_OK) return qw_refuse(context, QW_MEMORY, qw_status_text(QW_MEMORY));
    context->half_plane = call->half.plane, context->whole = call->half.whole;
    status = set_half(call);
    return status == QW_OK ? QW_OK : qw_refuse(context, status, qw_message(context->half));
}

static qw_status require_half(symmetric_call *call)
{
    qw_context *context = call->context;
    if (context->half) return QW_OK;
    qw_scope_begin(context->state.env);
    qw_status status = make_half(call);
    if (status != QW_OK) qw_forget_half(context);
    qw_scope_end(context->state.env);
    return status;
}

/* One attempt, whose half is asked for call->faces quads. */
static qw_status run_half_once(symmetric_call *call)
{
    qw_context *context = call->context;
    qw_options options = options_of_half(call);
    qw_status status = qw_run(context->half, &options);
    for (int s = QW_STAGE_WORKING; s < QW_STAGE_COUNT; s++)
        call->spent[s] += qw_get_report(context->half)->stages[s].seconds;
    if (status != QW_OK) return qw_refuse(context, status, qw_message(context->half));
    return qw_done(context, qw_drive_at_once(&context->state, make_whole, call));
}

/* One attempt: how many quads the half's run was asked for, and how many the whole got. Both 0: there was none. */
typedef struct count_sample {
    double asked, made;
} count_sample;

/* The next count to ask for lies between these shares of the way from one attempt to another, as the number of quads
   made does not grow linearly with the number asked for. */
static const double NEAR_FEWER = 0.2, NEAR_MORE = 0.8;

/* The next count to ask for: interpolated between an attempt with too few and one with too many quads, if there are
   both; else in proportion to the last. */
static int64_t next_count(const count_sample *fewer, const count_sample *more, double wanted)
{
    const count_sample *one = fewer->asked > 0 ? fewer : more;
    double ask = one->asked * wanted / one->made;
    if (fewer->asked > 0 && more->asked > 0) {
        double share = (wanted - fewer->made) / (more->made - fewer->made);
        ask = fewer->asked + fmin(fmax(share, NEAR_FEWER), NEAR_MORE) * (more->asked - fewer->asked);
    }
    return (int64_t)fmax(1, floor(ask + 0.5));
}

/* Runs the half until the whole has as many quads as were promised. Splitting rows, and the wider tolerance of a mesh
   of half as many quads, may lead to other counts: then more or fewer are asked for, in COUNT_ATTEMPTS attempts, of
   which the nearest is kept. An attempt without room for both sides is followed by one with more quads. */
static qw_status find_count(symmetric_call *call)
{
    qw_context_state *c = &call->context->state;
    double wanted = qw_faces_wanted(&c->run, call->options), best = HUGE_VAL;
    qw_report before = c->report;
    int64_t step = 0;
    count_sample fewer = {0, 0}, more = {0, 0};
    call->faces = (int64_t)fmax(1, floor(wanted / 2 + 0.5));
    for (int attempt = 1; attempt <= COUNT_ATTEMPTS; attempt++) {
        c->report = before;
        qw_status status = run_half_once(call);
        bool is_vain = attempt == COUNT_ATTEMPTS && best == HUGE_VAL;
        if (status != QW_OK && (status != QW_INTERNAL || is_vain)) return status;
        if (status != QW_OK) {
            /* a coarse half may have more than were asked for */
            int64_t least = call->context->half->state.run.finished.face_count;
            if (call->faces < least) call->faces = least;
            step = step ? 2 * step : (int64_t)ceil(MORE_ROOM * (double)call->faces);
            call->faces += step;
            continue;
        }
        count_sample now = {(double)call->faces, c->run.finished.face_count};
        qw_log(c->env, QW_LOG_DEBUG, "%.0f quads asked of the half make %.0f in all", now.asked, now.made);
        if (now.made >= (double)qw_least_faces(wanted, 1, 1) && now.made <= (double)qw_most_faces(wanted, 1, 1))
            return QW_OK;
        if (now.made < wanted) fewer = now;
        else more = now;
        call->faces = next_count(&fewer, &more, wanted);
        if (fabs(now.made - wanted) >= best) continue;
        best = fabs(now.made - wanted);
        qw_drive_set_aside(c);
    }
    if (is_auto(call)) return QW_INTERNAL;
    qw_drive_take_up(c);
    qw_warn(&c->run, OTHER_COUNT);
    return qw_done(call->context, QW_OK);
}

/* Seconds are those of all attempts. */
static void report_times(symmetric_call *call)
{
    qw_report *r = &call->context->state.report;
    for (int s = QW_STAGE_WORKING; s < QW_STAGE_COUNT; s++) r->stages[s].seconds = call->spent[s];
    r->seconds = 0;
    for (int s = 0; s < QW_STAGE_COUNT; s++) r->seconds += r->stages[s].seconds;
}

static qw_status run_half(symmetric_call *call)
{
    qw_status status = find_count(call);
    if (status == QW_OK) report_times(call);
    qw_drive_drop(&call->context->state);
    return status;
}

static void require_few_faces(void *user)
{
    symmetric_call *call = user;
    qw_require_few_faces(&call->context->state.run);
}

static qw_status run_whole(symmetric_call *call, qw_stage last)
{
    qw_context_state *c = &call->context->state;
    qw_status status = qw_drive(c, call->options, last);
    report_plane(&c->report, call->found, false);
    return qw_done(call->context, status);
}

/* Tries the planes until one serves or none is left. */
static qw_status run_planes(symmetric_call *call, qw_stage last)
{
    qw_context *context = call->context;
    qw_drive_back(&context->state);
    context->state.report.warning_count = context->clean_warnings;
    if (context->plane > 0) use_plane(call, 0);
    for (context->is_symmetric = true; context->is_symmetric;) {
        double begin = qw_seconds_now();
        qw_status status = require_half(call);
        if (status != QW_OK) return status;
        call->before += qw_seconds_now() - begin;
        bool is_other = !is_like(&context->whole, &context->state.run.clean_census);
        if (is_other && is_auto(call)) {
            leave_plane(call, NOT_USED);
            continue;
        }
        if (is_other) qw_warn(&context->state.run, OTHER_TOPOLOGY);
        if (last + 1 != QW_STAGE_COUNT)
            return qw_refuse(context, QW_ARGUMENT, "a symmetric run has no single stages: only one side is remeshed");
        status = run_half(call);
        if (status != QW_INTERNAL || !is_auto(call)) return status;
        leave_plane(call, NO_ROOM);
    }
    return run_whole(call, last);
}

qw_status qw_drive_symmetric(qw_context *context, const qw_options *options, qw_stage last)
{
    symmetric_call call = {.context = context, .options = options};
    if (context->state.steering.field_count || context->state.steering.guide_count)
        return qw_refuse(context, QW_UNSUPPORTED, "a cross field and guides cannot be given to a symmetric run yet");
    qw_status status = qw_drive(&context->state, options, QW_STAGE_CLEAN);
    if (status != QW_OK || last == QW_STAGE_CLEAN) return qw_done(context, status);
    if (context->state.done == QW_STAGE_COUNT) return qw_done(context, QW_OK);
    status = qw_protect(context->state.env, require_few_faces, &call);
    if (status != QW_OK) return qw_done(context, status);
    double begin = qw_seconds_now();
    status = require_planes(&call);
    call.before = qw_seconds_now() - begin;
    if (status != QW_OK) return qw_done(context, status);
    if (is_auto(&call) && !is_near(context, 0)) return run_whole(&call, last);
    return run_planes(&call, last);
}

void qw_forget_half(qw_context *context)
{
    qw_destroy(context->half);
    context->half = NULL;
}

/* The core's quads and their reflection: whole/mirror.h. */
#include "whole/mirror.h"

#include "whole/cut.h"
#include "geometry/bvh.h"
#include "geometry/chords.h"
#include "whole/written.h"
#include "whole/half.h"
#include "whole/half_rim.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Up to so many edges 99.9 % of the surface may lie off its reflection for positions to be reflected exactly. */
static const double ALIKE = 0.05;
enum { SPLIT_ROUNDS = 4 };

/* ---- the seam */

static qw_rim rim_of(const qw_run_state *run)
{
    const qw_trimesh *m = &run->clean.mesh;
    uint8_t *in = QW_NEW(run->env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) in[v] = qw_is_in_cut(run, m->position[v]);
    qw_rim rim = qw_rim_of(run->env, m, in);
    qw_free(run->env, in);
    return rim;
}

/* Marks, uint8_t[4 quads->face_count], the rows of quads whose two long sides both lie in the cut, and quads all of
   whose sides do: sewn to their reflections they would share all vertices with these. Returns whether there are any. */
static bool mark_narrow(qw_env *env, qw_quadmesh *quads, const qw_rim *rim, uint8_t *split)
{
    uint8_t *sewn = qw_find_sewn(env, rim, quads), *on = QW_NEW_ZERO(env, uint8_t, quads->vertex_count);
    bool any = false;
    for (uint32_t h = 0; h < 4 * quads->face_count; h++)
        if (sewn[h]) on[quads->corner[h]] = on[quads->corner[qw_quad_next(h)]] = 1;
    for (uint32_t h = 0; h < 4 * quads->face_count; h++) {
        const uint8_t *side = sewn + (h & ~3u);
        bool is_enclosed = side[0] && side[1] && side[2] && side[3];
        if ((sewn[h] && !is_enclosed) || !on[quads->corner[h]] || !on[quads->corner[qw_quad_next(h)]] || split[h])
            continue;
        qw_mark_chord(quads, h, split);
        any = true;
    }
    qw_free(env, sewn), qw_free(env, on);
    return any;
}

/* A copy of the quads in arrays of its own. */
static qw_quadmesh copy_of(qw_env *env, const qw_quadmesh *q)
{
    qw_quadmesh copy = {.vertex_count = q->vertex_count, .face_count = q->face_count};
    size_t sides = 4 * (size_t)q->face_count;
    copy.position = QW_NEW(env, qw_vec3, q->vertex_count);
    copy.corner = QW_NEW(env, uint32_t, sides), copy.twin = QW_NEW(env, uint32_t, sides);
    copy.kind = QW_NEW(env, uint8_t, q->vertex_count), copy.mark = QW_NEW(env, uint8_t, sides);
    copy.component = QW_NEW(env, uint32_t, q->vertex_count);
    memcpy(copy.kind, q->kind, q->vertex_count * sizeof *copy.kind);
    memcpy(copy.mark, q->mark, sides * sizeof *copy.mark);
    memcpy(copy.position, q->position, q->vertex_count * sizeof *copy.position);
    memcpy(copy.corner, q->corner, sides * sizeof *copy.corner);
    memcpy(copy.twin, q->twin, sides * sizeof *copy.twin);
    memcpy(copy.component, q->component, q->vertex_count * sizeof *copy.component);
    return copy;
}

qw_quadmesh qw_split_at_cut(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t **sewn)
{
    qw_env *env = run->env;
    qw_rim rim = rim_of(run);
    qw_quadmesh q = copy_of(env, quads);
    bool any = true;
    for (int round = 0; round < SPLIT_ROUNDS && any; round++) {
        uint8_t *split = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)q.face_count);
        any = mark_narrow(env, &q, &rim, split);
        if (any) qw_split_chords(env, &q, split);
        qw_free(env, split);
    }
    *sewn = qw_find_sewn(env, &rim, &q);
    return q;
}

/* ---- the crosses */

static qw_vec3 reflect_direction(const qw_mirror_plane *plane, qw_vec3 d)
{
    qw_vec3 n = qw_v3((float)plane->normal[0], (float)plane->normal[1], (float)plane->normal[2]);
    return qw_madd(d, -2 * qw_dot(d, n), n);
}

qw_vec3 qw_reflected_point(const qw_run_state *run, qw_vec3 p)
{
    const qw_frame *frame = &run->whole.clean.frame;
    const double at[3] = {p.x, p.y, p.z};
    double in[3], out[3];
    for (int k = 0; k < 3; k++) in[k] = frame->center[k] + at[k] / frame->scale;
    qw_reflect(&run->mirror.plane, in, out);
    for (int k = 0; k < 3; k++) out[k] = (out[k] - frame->center[k]) * frame->scale;
    return qw_v3((float)out[0], (float)out[1], (float)out[2]);
}

qw_vertex_crosses qw_crosses_of_whole(const qw_run_state *run)
{
    const qw_trimesh *core = &run->working.mesh;
    uint32_t n = core->vertex_count, sides = 3 * core->face_count;
    if (!run->mirror.is_used) return (qw_vertex_crosses){core, run->normal, run->orientation};
    qw_trimesh *whole = QW_NEW_ZERO(run->env, qw_trimesh, 1);
    qw_vec3 *normal = QW_NEW(run->env, qw_vec3, 2 * (size_t)n), *direction = QW_NEW(run->env, qw_vec3, 2 * (size_t)n);
    whole->vertex_count = 2 * n, whole->face_count = core->face_count;
    whole->position = QW_NEW(run->env, qw_vec3, 2 * (size_t)n);
    whole->corner = QW_NEW(run->env, uint32_t, 2 * (size_t)sides);
    for (uint32_t v = 0; v < n; v++) {
        whole->position[v] = qw_in_whole(run, core->position[v]);
        whole->position[n + v] = qw_reflected_point(run, whole->position[v]);
        normal[v] = run->normal[v], normal[n + v] = reflect_direction(&run->mirror.plane, normal[v]);
        direction[v] = run->orientation[v], direction[n + v] = reflect_direction(&run->mirror.plane, direction[v]);
    }
    memcpy(whole->corner, core->corner, sides * sizeof *core->corner);
    const uint8_t *single = run->mirror.single;
    uint32_t *component = single ? qw_clean_components_of_working(run) : NULL;
    for (uint32_t f = 0; f < core->face_count; f++) {
        if (single && single[component[f]]) continue;
        uint32_t *to = whole->corner + 3 * (size_t)whole->face_count++;
        for (uint32_t i = 0; i < 3; i++) to[2 - i] = n + core->corner[3 * f + i];
    }
    qw_free(run->env, component);
    return (qw_vertex_crosses){whole, normal, direction};
}

/* ---- components that are not reflected */

/* uint8_t[quads->vertex_count]; NULL: all are reflected. */
static uint8_t *find_single(const qw_run_state *run, const qw_quadmesh *quads)
{
    if (!run->mirror.single) return NULL;
    uint32_t *component = qw_clean_components(run, quads);
    uint8_t *single = QW_NEW(run->env, uint8_t, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) single[v] = run->mirror.single[component[v]];
    qw_free(run->env, component);
    return single;
}

double qw_surplus_of_core(const qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_quadmesh *apart = &run->core.small_quads;
    double all = quads->face_count + (double)apart->face_count, once = 0;
    if (!run->mirror.single) return 0;
    uint8_t *single = find_single(run, quads);
    for (uint32_t f = 0; f < quads->face_count; f++) once += single[quads->corner[4 * (size_t)f]];
    for (uint32_t f = 0; f < apart->face_count; f++)
        once += run->mirror.single[apart->component[apart->corner[4 * (size_t)f]]];
    qw_free(run->env, single);
    return (2 * all - once) / run->mirror.times - all;
}

/* ---- the whole */

/* Whether the sewn quads are a surface of the topology that the core's surface sewn to its reflection has, and all have
   an area. */
static bool is_whole(const qw_run_state *run, const qw_quadmesh *quads, const double *position)
{
    const qw_mirror *m = &run->mirror;
    qw_quad_census has = qw_quadmesh_census(run->env, quads);
    qw_quadmesh_validate(run->env, quads);
    qw_log(run->env, QW_LOG_DEBUG, "sewn: %u double edges, %d components, %d loops, euler %d; wanted %d, %d, %d",
           (unsigned)has.double_edges, (int)has.components, (int)has.boundary_loops, (int)has.euler, (int)m->components,
           (int)m->boundary_loops, (int)m->euler);
    if (has.double_edges || has.components != m->components || has.boundary_loops != m->boundary_loops ||
        has.euler != m->euler)
        return false;
    for (uint32_t f = 0; f < quads->face_count; f++)
        if (qw_is_degenerate(quads->corner + 4 * (size_t)f, position)) return false;
    return true;
}

/* Warns if more than a thousandth of the surface lies farther than an edge length from the reflected surface. */
static void warn_of_one_sided_detail(qw_run_state *run)
{
    double edge = run->rho * qw_whole_scale(run); /* in diagonals, as `far` is */
    char text[sizeof run->report->warnings[0]];
    if (run->mirror.far <= edge || run->mirror.single || qw_sides_differ(run))
        return; /* single components may be all that differs */
    snprintf(text, sizeof text,
             "the sides of the plane of symmetry differ by %.2g edges and more in places: what only one side has is "
             "gone, or on both",
             run->mirror.far / edge);
    qw_warn(run, text);
}

static void place_in_frame(const qw_run_state *run, qw_quadmesh *quads, const double *position)
{
    const qw_frame *frame = &run->whole.clean.frame;
    quads->position = QW_NEW(run->env, qw_vec3, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        double q[3];
        for (int k = 0; k < 3; k++) q[k] = (position[3 * (size_t)v + (size_t)k] - frame->center[k]) * frame->scale;
        quads->position[v] = qw_v3((float)q[0], (float)q[1], (float)q[2]);
    }
}

/* The marks of the half's quads, twice, and the kinds that follow from them: corners stay corners, but where they were
   so as curves end at the plane. */
static void carry_marks(const qw_run_state *run, qw_mirrored *m, const qw_quadmesh *half)
{
    qw_env *env = run->env;
    qw_quadmesh *q = &m->quads;
    q->mark = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)q->face_count);
    q->kind = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    uint8_t *curves = QW_NEW_ZERO(env, uint8_t, q->vertex_count), *on = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        bool is_reflection = h / 4 >= run->reflected;
        uint32_t corner = is_reflection ? (4 - (h & 3u)) & 3u : h & 3u, side = is_reflection ? 3 - (h & 3u) : h & 3u;
        uint32_t v = q->corner[h], u = half->corner[4 * m->source[h / 4] + corner];
        if (half->mark) q->mark[h] = half->mark[4 * m->source[h / 4] + side];
        if (half->kind) q->kind[v] = half->kind[u];
        on[v] |= is_reflection && v == u;
        if (q->twin[h] == QW_NONE || (q->mark[h] && h < q->twin[h]))
            curves[v] += curves[v] < 3, curves[q->corner[qw_quad_next(h)]] += curves[q->corner[qw_quad_next(h)]] < 3;
    }
    for (uint32_t v = 0; v < q->vertex_count; v++)
        if (on[v]) q->kind[v] = curves[v] == 0 ? QW_VERTEX_FREE : curves[v] == 2 ? QW_VERTEX_CURVE : QW_VERTEX_CORNER;
    qw_free(env, curves), qw_free(env, on);
}

bool qw_sides_differ(const qw_run_state *run)
{
    double edge = run->rho * qw_whole_scale(run); /* in diagonals, as `far` is */
    bool is_found = qw_finds_plane(run->options.symmetry);
    return run->mirror.is_used && (run->options.symmetry_follow || (is_found && run->mirror.far > ALIKE * edge));
}

void qw_reflect_core(qw_run_state *run, const qw_quadmesh *quads, const uint8_t *sewn, const double *position,
                     const double *own)
{
    qw_env *env = run->env;
    qw_mirrored m = qw_mirror_quads(env, quads, position, &run->mirror.plane, sewn, find_single(run, quads), own);
    run->reflected = quads->face_count;
    warn_of_one_sided_detail(run);
    place_in_frame(run, &m.quads, m.position);
    run->sides_meet = run->sides_meet && is_whole(run, &m.quads, m.position);
    carry_marks(run, &m, quads);
    run->finished = m.quads, run->output = m.position, run->source = m.source;
}

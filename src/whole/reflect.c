/* The core's quads and their reflection: whole/mirror.h. */
#include "whole/mirror.h"

#include "whole/across.h"
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

enum { SPLIT_ROUNDS = 4 };

/* ---- the seam */

static qw_rim rim_of(const qw_run_state *run)
{
    const qw_trimesh *m = &run->clean.mesh;
    uint8_t *in = QW_NEW(run->env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) in[v] = qw_cuts_at(run, m->position[v]);
    for (uint32_t h = 0; run->mirror.about && h < 3 * m->face_count; h++) /* of its component's planes */
        in[m->corner[h]] &= run->mirror.about[run->clean_census.component[h / 3]];
    qw_rim rim = qw_rim_of(run->env, m, in);
    qw_free(run->env, in);
    return rim;
}

/* Marks, uint8_t[4 quads->face_count], the rows of quads whose two long sides both lie in one plane of the cut, and
   quads all of whose sides do: sewn to their reflections they would share all vertices with these. Returns whether
   there are any. */
static bool mark_narrow(qw_env *env, qw_quadmesh *quads, const qw_rim *rim, uint8_t *split)
{
    uint8_t *sewn = qw_find_sewn(env, rim, quads), *on = QW_NEW_ZERO(env, uint8_t, quads->vertex_count);
    bool any = false;
    for (uint32_t h = 0; h < 4 * quads->face_count; h++)
        if (sewn[h]) on[quads->corner[h]] |= 1u << sewn[h], on[quads->corner[qw_quad_next(h)]] |= 1u << sewn[h];
    for (uint32_t h = 0; h < 4 * quads->face_count; h++) {
        const uint8_t *side = sewn + (h & ~3u);
        assert(sewn[h] <= QW_MOST_CUTS);
        bool is_enclosed = side[0] && side[1] && side[2] && side[3];
        uint32_t both = on[quads->corner[h]] & on[quads->corner[qw_quad_next(h)]];
        if (sewn[h] && !is_enclosed) both &= ~(1u << sewn[h]);
        if (!both || split[h]) continue;
        qw_mark_chord(quads, h, split);
        any = true;
    }
    qw_free(env, sewn), qw_free(env, on);
    return any;
}

qw_quadmesh qw_split_at_cut(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t **sewn)
{
    qw_env *env = run->env;
    qw_rim rim = rim_of(run);
    qw_quadmesh q = qw_quadmesh_copy(env, quads, 0, 0);
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

uint32_t qw_image_count(const qw_run_state *run)
{
    const qw_mirror *m = &run->mirror;
    return m->own ? 1 + m->planes : 1u << m->planes;
}

/* The planes that image i is reflected about: bit k, plane k. */
static uint32_t planes_of_image(const qw_run_state *run, uint32_t i)
{
    return run->mirror.own && i > 0 ? 1u << (i - 1) : i;
}

bool qw_image_has(const qw_run_state *run, uint32_t i, uint32_t component)
{
    return !run->mirror.about || !(planes_of_image(run, i) & ~(uint32_t)run->mirror.about[component]);
}

qw_vec3 qw_image_of(const qw_run_state *run, uint32_t i, qw_vec3 p)
{
    assert(i < qw_image_count(run));
    const qw_frame *frame = &run->whole.clean.frame;
    uint32_t planes = planes_of_image(run, i);
    p = qw_in_whole(run, p);
    double at[3] = {p.x, p.y, p.z}, in[3];
    if (i == 0) return p;
    for (int k = 0; k < 3; k++) at[k] = frame->center[k] + at[k] / frame->scale;
    for (uint32_t k = 0; planes >> k; k++) {
        if (!(planes >> k & 1)) continue;
        memcpy(in, at, sizeof in);
        qw_reflect(&run->mirror.plane[k], in, at);
    }
    for (int k = 0; k < 3; k++) at[k] = (at[k] - frame->center[k]) * frame->scale;
    return qw_v3_of_doubles(at);
}

static qw_vec3 turn_into_image(const qw_run_state *run, uint32_t i, qw_vec3 d)
{
    for (uint32_t k = 0, planes = planes_of_image(run, i); planes >> k; k++)
        if (planes >> k & 1) d = reflect_direction(&run->mirror.plane[k], d);
    return d;
}

/* Appends the triangles of image i, without those of components that it is none of. */
static void add_image(const qw_run_state *run, uint32_t i, const uint32_t *component, qw_trimesh *whole)
{
    const qw_trimesh *core = &run->working.mesh;
    bool turns = run->mirror.own ? i > 0 : (i ^ i >> 1 ^ i >> 2) & 1;
    for (uint32_t f = 0; f < core->face_count; f++) {
        if (component && !qw_image_has(run, i, component[f])) continue;
        uint32_t *to = whole->corner + 3 * (size_t)whole->face_count++;
        for (uint32_t k = 0; k < 3; k++) to[turns ? 2 - k : k] = i * core->vertex_count + core->corner[3 * f + k];
    }
}

qw_vertex_crosses qw_crosses_of_whole(const qw_run_state *run)
{
    const qw_trimesh *core = &run->working.mesh;
    uint32_t images = qw_image_count(run);
    size_t n = core->vertex_count;
    if (images == 1) return (qw_vertex_crosses){core, run->normal, run->orientation};
    qw_trimesh *whole = QW_NEW_ZERO(run->env, qw_trimesh, 1);
    qw_vec3 *normal = QW_NEW(run->env, qw_vec3, images * n), *direction = QW_NEW(run->env, qw_vec3, images * n);
    whole->vertex_count = (uint32_t)(images * n);
    whole->position = QW_NEW(run->env, qw_vec3, images * n);
    whole->corner = QW_NEW(run->env, uint32_t, 3 * images * (size_t)core->face_count);
    uint32_t *component = run->mirror.about ? qw_clean_components_of_faces(run, core) : NULL;
    for (uint32_t i = 0; i < images; i++) {
        for (size_t v = 0; v < n; v++) {
            whole->position[i * n + v] = qw_image_of(run, i, core->position[v]);
            normal[i * n + v] = turn_into_image(run, i, run->normal[v]);
            direction[i * n + v] = turn_into_image(run, i, run->orientation[v]);
        }
        add_image(run, i, component, whole);
    }
    assert(whole->face_count <= images * (size_t)core->face_count);
    qw_free(run->env, component);
    return (qw_vertex_crosses){whole, normal, direction};
}

/* ---- components that are not reflected */

uint8_t *qw_planes_of_quads(const qw_run_state *run, const qw_quadmesh *quads)
{
    if (!run->mirror.about) return NULL;
    uint32_t *component = qw_clean_components(run, quads);
    uint8_t *planes = QW_NEW(run->env, uint8_t, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) planes[v] = run->mirror.about[component[v]];
    qw_free(run->env, component);
    return planes;
}

/* uint8_t[count], 1: not reflected about plane p; NULL: all are. */
static uint8_t *single_at(qw_env *env, const uint8_t *planes, uint32_t count, uint32_t p)
{
    if (!planes) return NULL;
    uint8_t *single = QW_NEW(env, uint8_t, count);
    for (uint32_t v = 0; v < count; v++) single[v] = !(planes[v] >> p & 1);
    return single;
}

double qw_surplus_of_core(const qw_run_state *run, const qw_quadmesh *quads)
{
    double all = quads->face_count, once = 0;
    if (!run->mirror.about) return 0;
    uint8_t *planes = qw_planes_of_quads(run, quads);
    for (uint32_t f = 0; f < quads->face_count; f++) once += planes[quads->corner[4 * (size_t)f]] == 0;
    qw_free(run->env, planes);
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
    if (run->mirror.far <= edge || run->mirror.about || qw_sides_differ(run))
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
static void carry_marks(qw_env *env, qw_mirrored *m, const qw_quadmesh *half)
{
    qw_quadmesh *q = &m->quads;
    q->mark = QW_NEW_ZERO(env, uint8_t, 4 * (size_t)q->face_count);
    q->kind = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    uint8_t *curves = QW_NEW_ZERO(env, uint8_t, q->vertex_count), *on = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        bool is_reflection = h / 4 >= half->face_count;
        assert(m->source[h / 4] < half->face_count);
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
    return run->mirror.is_used && (run->options.symmetry_follow || (is_found && !qw_is_alike(run->mirror.far, edge)));
}

/* uint8_t[4 faces]: 1 where the half-edge is sewn along plane p. */
static uint8_t *sewn_along(qw_env *env, const uint8_t *sewn, uint32_t faces, uint32_t p)
{
    uint8_t *edge = QW_NEW(env, uint8_t, 4 * (size_t)faces);
    for (uint32_t h = 0; h < 4 * faces; h++) edge[h] = sewn[h] == p + 1;
    return edge;
}

/* The values of the half's vertices, carried to the vertices of both sides. */
static uint8_t *carry_planes(qw_env *env, const qw_mirrored *m, const qw_quadmesh *half, const uint8_t *planes)
{
    if (!planes) return NULL;
    uint8_t *all = QW_NEW_ZERO(env, uint8_t, m->quads.vertex_count);
    for (uint32_t h = 0; h < 4 * m->quads.face_count; h++)
        all[m->quads.corner[h]] = planes[half->corner[4 * (size_t)m->source[h / 4]]];
    return all;
}

/* Makes the sources of the quads those that their sources had before: quads of the core, as each is reflected once. */
static uint32_t *through(const uint32_t *before, const qw_mirrored *m)
{
    for (uint32_t f = 0; before && f < m->quads.face_count; f++) m->source[f] = before[m->source[f]];
    return m->source;
}

/* The quads of the core, those of all of the first plane's side: sewn to their reflections about the other planes.
 *sewn, *planes (as of qw_planes_of_quads) and *position become theirs. */
static qw_quadmesh unfold(const qw_run_state *run, const qw_quadmesh *core, const uint8_t **sewn,
                          const uint8_t **planes, const double **position, const double *own, uint32_t **source)
{
    qw_env *env = run->env;
    qw_quadmesh side = *core;
    for (uint32_t p = run->mirror.planes - 1; p > 0; p--) {
        uint8_t *edge = sewn_along(env, *sewn, side.face_count, p);
        const uint8_t *single = single_at(env, *planes, side.vertex_count, p);
        qw_mirrored m = qw_mirror_quads(env, &side, *position, &run->mirror.plane[p], edge, single,
                                        run->mirror.own ? own : NULL);
        carry_marks(env, &m, &side);
        *planes = carry_planes(env, &m, &side, *planes);
        uint8_t *next = QW_NEW(env, uint8_t, 4 * (size_t)m.quads.face_count);
        for (uint32_t h = 0; h < 4 * m.quads.face_count; h++) {
            uint32_t from = h / 4 < side.face_count ? h & 3u : 3 - (h & 3u);
            next[h] = m.quads.twin[h] == QW_NONE ? (*sewn)[4 * m.source[h / 4] + from] : 0;
        }
        qw_free(env, edge);
        if (run->mirror.own) *source = through(*source, &m);
        side = m.quads, *sewn = next, *position = m.position;
    }
    return side;
}

void qw_reflect_core(qw_run_state *run, const qw_quadmesh *core, const uint8_t *sewn, const double *position,
                     const double *own)
{
    qw_env *env = run->env;
    const uint8_t *planes = qw_planes_of_quads(run, core);
    uint32_t *source = NULL;
    qw_quadmesh side = unfold(run, core, &sewn, &planes, &position, own, &source), *quads = &side;
    const uint8_t *single = single_at(env, planes, quads->vertex_count, 0);
    qw_mirrored m = qw_mirror_quads(env, quads, position, &run->mirror.plane[0],
                                    sewn_along(env, sewn, quads->face_count, 0), single, own);
    run->reflected = quads->face_count;
    warn_of_one_sided_detail(run);
    place_in_frame(run, &m.quads, m.position);
    run->sides_meet = run->sides_meet && is_whole(run, &m.quads, m.position);
    carry_marks(env, &m, quads);
    assert(m.quads.face_count >= quads->face_count);
    if (run->mirror.own) run->reflected = core->face_count, through(source, &m);
    run->finished = m.quads, run->output = m.position, run->source = m.source;
}

qw_mirror_planes qw_planes_of_whole(const qw_run_state *run, const uint32_t *component, uint32_t count)
{
    uint8_t *of = run->mirror.own ? QW_NEW_ZERO(run->env, uint8_t, count) : NULL;
    for (uint32_t v = 0; of && v < count; v++)
        of[v] = run->mirror.own[component[v]] ? (uint8_t)(run->mirror.own[component[v]] - 1) : 0;
    return (qw_mirror_planes){of ? run->mirror.planes : 1, run->mirror.plane, of};
}

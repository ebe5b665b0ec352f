/* The connectivity of the quads is that of the core on both sides; their positions on the other side are relaxed there,
 * on what the stage SURFACE makes of that side. All of it happens on the core's side of the plane, where the other one
 * is reflected to, in the frame of the core.
 */
#include "run/stages/other_side.h"

#include "geometry/flips.h"
#include "geometry/sampled_surface.h"
#include "remesh/quads/uncovered.h"
#include "remesh/relax/fit.h"
#include "run/stages/coverage.h"
#include "run/stages/split_levels.h"
#include "run/stages/stages.h"
#include "whole/mirror.h"
#include "whole/sizes.h"
#include "base/constants.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Points of each side whose distances from the quads are compared. */
enum { JUDGED = 4096 };
/* The other side may be so much farther from its quads than the core's side is from its own, in the mean and at 99.9 %,
   and by so much of a mean edge besides. */
static const double NEARLY_AS_NEAR = 1.1, NEAR_ENOUGH = 0.02;
/* In quads, what may be uncovered besides. */
static const double UNCOVERED = 0.1;

enum { FOREIGN = 2 };

typedef struct other_side {
    const qw_run_state *run;
    qw_run_state side; /* what the run would hold, were this side the core */
    qw_quadmesh quads;
    uint32_t flipped;
    uint8_t *held; /* uint8_t[quads.vertex_count]: lies in the plane, or is FOREIGN: of no component of this side */
} other_side;

/* ---- the surface */

/* The place in the frame of the run's core. */
static qw_vec3 into_frame(const other_side *o, qw_vec3 p)
{
    const qw_frame *to = &o->run->clean.frame;
    double x[3];
    qw_place_in_input(&o->side.clean, p, x);
    for (int k = 0; k < 3; k++) x[k] = (x[k] - to->center[k]) * to->scale;
    return qw_v3((float)x[0], (float)x[1], (float)x[2]);
}

static qw_vec3 *move_all(const other_side *o, const qw_trimesh *mesh)
{
    qw_vec3 *position = QW_NEW(o->run->env, qw_vec3, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) position[v] = into_frame(o, mesh->position[v]);
    return position;
}

/* False where it is not like the core's. */
static bool prepare_surface(other_side *o)
{
    qw_run_state *side = &o->side;
    qw_report *unread = QW_NEW(o->run->env, qw_report, 1);
    *side = *o->run, *unread = *o->run->report, side->report = unread;
    if (!qw_take_other_side(side) || side->clean.own.count > 0 || o->run->clean.own.count > 0) return false;
    side->core = (qw_core){.mesh = side->clean.mesh,
                           .census = side->clean_census,
                           .area = side->area,
                           .extent = side->extent,
                           .needed = side->faces_needed};
    side->plan.ringless = 1; /* positions alone are to be found there */
    qw_prepare_surface(side);
    side->surface.position = move_all(o, &side->surface);
    side->clean.mesh.position = move_all(o, &side->clean.mesh);
    side->clean.frame = o->run->clean.frame;
    qw_build_tree(side);
    return true;
}

/* ---- the quads */

/* The component of the surface that each of the quads' lies on: that of most of its vertices (Boyer and Moore). Holds
   those of components that lie on none. Numbers the working mesh's as the surface's, those on none after all others. */
static void find_components(other_side *o, const uint32_t *component)
{
    qw_quadmesh *q = &o->quads;
    qw_env *env = o->run->env;
    uint32_t count = (uint32_t)o->run->clean_census.components, none = (uint32_t)o->side.surface_census.components;
    uint32_t *leader = QW_NEW(env, uint32_t, count);
    int64_t *lead = QW_NEW_ZERO(env, int64_t, count);
    qw_vec3 *normal = qw_quadmesh_vertex_normals(env, q);
    memset(leader, 0xff, count * sizeof *leader);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        uint32_t c = component[v];
        assert(c < count);
        bool is_reflected = !o->run->mirror.about || o->run->mirror.about[c];
        qw_hit hit = qw_bvh_nearest(o->side.tree, q->position[v], normal[v], QW_SAME_SHEET, 1, QW_NONE);
        if (!is_reflected || hit.face == QW_NONE) continue;
        uint32_t at = o->side.surface_census.component[hit.face];
        if (lead[c] == 0) leader[c] = at;
        lead[c] += leader[c] == at ? 1 : -1;
    }
    q->component = QW_NEW(env, uint32_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        uint32_t c = leader[component[v]];
        q->component[v] = c == QW_NONE ? 0 : c;
        if (c == QW_NONE) o->held[v] = FOREIGN;
    }
    if (count == 1 && none == 1) return;
    uint32_t *of_working = qw_clean_components_of_faces(o->run, &o->run->working.mesh);
    for (uint32_t f = 0; f < o->run->working.mesh.face_count; f++) {
        uint32_t c = leader[of_working[f]];
        of_working[f] = c == QW_NONE ? none : c;
    }
    o->side.working.mesh.component = of_working;
    o->side.working_tree = qw_bvh_build(env, &o->side.working.mesh);
}

/* A copy of the quads of the other side that may be moved, the seam held, and the component of each vertex. */
static void take_quads(other_side *o, const qw_quadmesh *quads, const uint8_t *sewn)
{
    qw_env *env = o->run->env;
    qw_quadmesh *q = &o->quads;
    *q = *quads;
    o->held = QW_NEW_ZERO(env, uint8_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (sewn[h]) o->held[q->corner[h]] = o->held[q->corner[qw_quad_next(h)]] = 1;
    q->position = QW_NEW(env, qw_vec3, q->vertex_count);
    q->kind = QW_NEW(env, uint8_t, q->vertex_count); /* relaxation may make corners of vertices on curves */
    memcpy(q->position, quads->position, q->vertex_count * sizeof *q->position);
    memcpy(q->kind, quads->kind, q->vertex_count * sizeof *q->kind);
    uint32_t *component = qw_clean_components(o->run, quads);
    find_components(o, component);
    qw_free(env, component);
}

/* Relaxed and fitted as the core's were; what is held is where it was. */
static void relax(other_side *o)
{
    const qw_run_state *run = o->run;
    uint8_t *flipped;
    qw_vec3 *relaxed = qw_relax(&o->side, &o->quads, o->held, &flipped).position, *was = o->quads.position;
    for (uint32_t v = 0; v < o->quads.vertex_count; v++)
        if (o->held[v]) relaxed[v] = was[v];
    for (uint32_t f = 0; f < o->quads.face_count; f++)
        o->flipped += flipped[f] == QW_FLIPPED && o->held[o->quads.corner[4 * f]] != FOREIGN;
    o->quads.position = relaxed;
    const qw_fit fit = {.tree = o->side.tree, .strength = (float)run->options.fit};
    if (run->options.fit > 0 && run->options.fit_to != QW_FIT_TO_LIMIT) qw_fit_quads(run->env, &o->quads, &fit);
}

/* ---- the judgement */

typedef struct nearness {
    double mean, far; /* in the frame */
} nearness;

/* Of points spread evenly over a surface, how far they are from the quads. */
static nearness nearness_of(qw_env *env, const qw_trimesh *m, const qw_halves *quads)
{
    qw_scope_begin(env);
    double *end = QW_NEW(env, double, m->face_count), sum = 0;
    qw_vec3 *point = QW_NEW(env, qw_vec3, JUDGED);
    for (uint32_t f = 0; f < m->face_count; f++) end[f] = sum += (double)qw_length(qw_face_cross(m, f));
    for (uint32_t i = 0; i < JUDGED; i++) {
        uint32_t f = qw_find_in(end, m->face_count, sum * (i + 0.5) / JUDGED);
        assert(f < m->face_count);
        const uint32_t *c = m->corner + 3 * (size_t)f;
        float u = (float)qw_hashed(i, 0), v = (float)qw_hashed(i, 1);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        qw_vec3 p = m->position[c[0]];
        point[i] = qw_madd(qw_madd(p, u, qw_sub(m->position[c[1]], p)), v, qw_sub(m->position[c[2]], p));
    }
    float *far = qw_distances_to_quads(env, point, JUDGED, quads);
    nearness n = {.mean = 0};
    for (uint32_t i = 0; i < JUDGED; i++) n.mean += (double)far[i] / JUDGED;
    n.far = qw_percentile(far, JUDGED, QW_NEARLY_ALL);
    qw_scope_end(env);
    return n;
}

static bool is_as_near(double other, double core, double edge)
{
    return other <= NEARLY_AS_NEAR * core + NEAR_ENOUGH * edge;
}

/* The area of a surface that is far from every quad, as a lost tip is, in quads. */
static double uncovered_area(const qw_run_state *run, const qw_trimesh *m, const qw_halves *quads)
{
    double area = 0;
    uint8_t *is_far = qw_mark_uncovered(run->env, m, quads, qw_uncovered_distance(run));
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (is_far[m->corner[h]]) area += (double)qw_length(qw_face_cross(m, h / 3)) / 6;
    qw_free(run->env, is_far);
    return qw_in_quads(run, area);
}

/* Whether a vertex lies farther from the other side than its quads may leave uncovered: as the boundary of a side may
   that is not where the core's is. */
static bool sticks_out(const other_side *o)
{
    float reach = qw_uncovered_distance(o->run);
    for (uint32_t v = 0; v < o->quads.vertex_count; v++) {
        qw_hit hit = qw_bvh_nearest(o->side.tree, o->quads.position[v], qw_v3(0, 0, 0), -1, reach, QW_NONE);
        if (hit.face == QW_NONE && o->held[v] != FOREIGN) return true;
    }
    return false;
}

/* Whether the other side is as near to its quads, with their positions there, as the core is to the quads given. */
static bool judge(const other_side *o, const qw_quadmesh *quads)
{
    const qw_run_state *run = o->run;
    qw_scope_begin(run->env);
    qw_halves of_core = qw_halve_quads(run->env, quads), of_other = qw_halve_quads(run->env, &o->quads);
    nearness core = nearness_of(run->env, &run->clean.mesh, &of_core),
             other = nearness_of(run->env, &o->side.clean.mesh, &of_other);
    qw_log(run->env, QW_LOG_DEBUG, "the other side is off by %.3f and %.3f edges, the core by %.3f and %.3f",
           other.mean / run->rho, other.far / run->rho, core.mean / run->rho, core.far / run->rho);
    bool suits = o->flipped == 0 && !sticks_out(o) && is_as_near(other.mean, core.mean, run->rho) &&
                 is_as_near(other.far, core.far, run->rho) &&
                 uncovered_area(run, &o->side.surface, &of_other) <=
                     uncovered_area(run, &run->surface, &of_core) + UNCOVERED;
    qw_scope_end(run->env);
    return suits;
}

double *qw_place_other_side(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *sewn, bool *suits)
{
    assert(run->mirror.is_used && quads->kind);
    other_side o = {.run = run};
    *suits = false;
    if (!prepare_surface(&o)) return NULL;
    take_quads(&o, quads, sewn);
    relax(&o);
    *suits = judge(&o, quads);
    double *place = QW_NEW(run->env, double, 3 * (size_t)quads->vertex_count);
    uint8_t *planes = run->mirror.own ? qw_planes_of_quads(run, quads) : NULL;
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        double p[3];
        uint32_t number = 0;
        while (planes && planes[v] >> number > 1) number++;
        qw_place_in_input(&run->clean, o.quads.position[v], p);
        qw_reflect(&run->mirror.plane[number], p, place + 3 * (size_t)v);
    }
    return place;
}

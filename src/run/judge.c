#include "run/judge.h"

#include "base/mechanisms.h"
#include "whole/mirror.h"
#include "base/promise.h"
#include "run/stages/coverage.h"
#include "geometry/flips.h"
#include "remesh/quads/quad_components.h"
#include "remesh/quads/wanted.h"
#include "whole/sizes.h"

#include <math.h>

/* Whether sizes at a point are as small already as refinements make them. */
static bool is_refined(const qw_run_state *run, qw_vec3 p)
{
    double size = 1;
    for (uint32_t i = 0, round = 0; i < run->plan.refinements; i++) {
        const qw_refinement *r = &run->refinement[i];
        if (r->round == round || qw_distance(p, r->center) >= r->radius) continue;
        round = r->round, size *= QW_REFINED_SIZE;
    }
    return size <= QW_LEAST_REFINED_SIZE && !qw_has_density(run);
}

/* Whether quads can be made smaller around any of the places that there is room for in the plan: wanted lengths are
   given at the surface's vertices, so one of them must be near and not be refined as far as it may be. */
static bool can_refine_around(const qw_run_state *run, const qw_sites *places)
{
    const qw_trimesh *s = &run->surface;
    uint32_t room = QW_MAX_REFINEMENTS - run->plan.refinements;
    for (uint32_t i = 0; i < places->count && i < room; i++) {
        qw_heartbeat(run->env);
        for (uint32_t v = 0; v < s->vertex_count; v++)
            if (qw_distance(s->position[v], places->point[i]) < (float)QW_REFINED_RADIUS * places->size[i] &&
                !is_refined(run, s->position[v]))
                return true;
    }
    return false;
}

static void set_places(const qw_run_state *run, qw_judgement *j, qw_sites places)
{
    j->places = places;
    j->verdict.places = can_refine_around(run, &places) ? places.count : 0;
}

static void judge_topology(const qw_run_state *run, qw_judgement *j)
{
    j->verdict.topology_lost = !run->topology_kept;
    if (!run->topology_kept)
        set_places(run, j, qw_find_lost_topology(run->env, &run->inversion_free, &run->extraction));
}

static void judge_count(const qw_run_state *run, qw_verdict *v)
{
    v->faces = run->simplified.face_count + qw_surplus_of_core(run, &run->simplified);
}

/* ---- after RELAX */

static float size_near(const qw_run_state *run, qw_vec3 p)
{
    const qw_trimesh *m = &run->working.mesh;
    uint32_t nearest = 0;
    for (uint32_t v = 1; v < m->vertex_count; v++)
        if (qw_length2(qw_sub(m->position[v], p)) < qw_length2(qw_sub(m->position[nearest], p))) nearest = v;
    return run->size[nearest];
}

/* The middles of the quads that are certainly flipped: other sizes around them lead to other quads. */
static qw_sites list_flipped(const qw_run_state *run, const qw_quadmesh *q, const uint8_t *flipped)
{
    qw_sites l = {0, QW_NEW(run->env, qw_vec3, QW_MOST_SITES), QW_NEW(run->env, float, QW_MOST_SITES), 0};
    for (uint32_t f = 0; f < q->face_count && l.count < QW_MOST_SITES; f++) {
        if (flipped[f] < QW_FLIPPED) continue;
        const uint32_t *c = q->corner + 4 * (size_t)f;
        qw_vec3 p = qw_lerp(q->position[c[0]], q->position[c[2]], 0.5f);
        l.point[l.count] = p;
        l.size[l.count++] = size_near(run, p);
    }
    return l;
}

/* Quads of a protrusion that is lost: a ring and a half around it. With one, six lost horns weigh less than long quads.
 */
static const double RINGS = 6;

/* What room for protrusions has left, in quads: those that are too long, and a ring and a half for each that is lost.
   More than all of them where the count is not what is promised. */
static double count_misshapen(const qw_run_state *run, const qw_quadmesh *quads)
{
    double wanted = qw_faces_with_reserve(run);
    if (!qw_is_near_count(wanted, quads->face_count, qw_times_used(run))) return wanted;
    qw_trimesh working = qw_parted_working(run);
    qw_size_fit sizes = qw_fit_of_sizes(run->env, quads, &(qw_wanted){&working, run->size, run->working_tree, NULL});
    return sizes.long_share * quads->face_count + RINGS * qw_count_lost_parts(run, quads);
}

/* What is uncovered or flipped after RELAX, and where that is. */
static void judge_coverage(const qw_run_state *run, qw_judgement *j)
{
    qw_verdict *v = &j->verdict;
    const qw_quadmesh *quads = &run->relaxed;
    qw_sites places = {0};
    if (!run->relaxed_covers) places = qw_find_uncovered(run, quads);
    v->working_vertices = run->working.mesh.vertex_count;
    v->protrusions = run->grown;
    v->lacking = run->lacking > 0 && qw_uses(run->env, QW_MECH_RETRY_PROTRUSIONS) ? run->lacking : 0;
    v->misshapen = v->lacking > 0 || run->plan.reserve > 0 ? count_misshapen(run, quads) : 0;
    v->uncovered = qw_in_quads(run, places.area);
    v->flipped = qw_count_flipped(quads, run->flipped);
    if (places.count == 0) places = list_flipped(run, quads, run->flipped);
    set_places(run, j, places);
    qw_log(run->env, QW_LOG_DEBUG, "%.2f quads uncovered, %g flipped", v->uncovered, v->flipped);
}

static void judge_sides(const qw_run_state *run, qw_verdict *v)
{
    double wanted = qw_faces_wanted(run, &run->options);
    v->sides_apart = !run->sides_meet, v->rims_flipped = run->rims_flipped;
    v->sides_unlike = run->sides_unlike;
    v->has_rings = run->options.rings > 0 && run->necks.count > 0;
    v->has_across = run->mirror.planes > 1 && !run->mirror.own;
    v->count_off = run->mirror.is_used && run->faces_wanted >= run->core.needed &&
                   !qw_is_near_count(wanted, qw_unsplit_faces(run), 1);
}

/* Without repair nothing is judged after REPAIR and RELAX, and what the attempt was like with it counts no more. */
static void forget_repair(qw_verdict *v)
{
    v->topology_lost = v->protrusions = v->places = 0;
    v->uncovered = v->flipped = v->lacking = v->misshapen = 0;
}

void qw_judge(const qw_run_state *run, qw_stage finished, qw_judgement *j)
{
    if (!run->options.repair && finished >= QW_STAGE_REPAIR) forget_repair(&j->verdict);
    switch (finished) {
    case QW_STAGE_INVERSIONS:
        j->verdict.inverted = run->inverted + run->irregular;
        j->verdict.lacks_room = run->lacks_room;
        break;
    case QW_STAGE_REPAIR:
        if (run->options.repair) judge_topology(run, j);
        break;
    case QW_STAGE_SIMPLIFY: judge_count(run, &j->verdict); break;
    case QW_STAGE_RELAX:
        if (run->options.repair) judge_coverage(run, j);
        break;
    case QW_STAGE_ASSEMBLE: judge_sides(run, &j->verdict); break;
    default: break;
    }
}

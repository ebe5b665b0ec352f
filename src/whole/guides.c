#include "whole/guides.h"

#include "base/elementary.h"
#include "base/mechanisms.h"
#include "whole/cut.h"
#include "whole/kept_rims.h"
#include "whole/motion_on.h"
#include "whole/openings.h"
#include "whole/ring_guides.h"
#include "whole/small.h"
#include "geometry/bvh.h"
#include "geometry/engrave.h"
#include "whole/sizes.h"
#include "remesh/working/working.h"
#include "base/constants.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* How far from the surface a point of a guide may lie, and twice how far from an opening that it stands for, in edges
   of the quads that the surface is fine enough for: those of the result are up to twice as long. */
static const double MOST_OFF = 1;
/* How far from a guide of direction it counts, in edges of the quads; from half of that on less and less. */
static const float REACH = 1.5f;
/* Points that are looked at on an edge's length of a guide, to see how far it is from edges. */
static const double SAMPLES = 4;

bool qw_has_guides(const qw_run_state *run, qw_guide_kind kind)
{
    for (uint32_t g = 0; g < run->steering.guide_count; g++)
        if (run->steering.guide_kind[g] == kind) return true;
    return false;
}

qw_steering qw_steering_with_joints(const qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_steering *of = run->whole.steering;
    qw_steering all = *of;
    if (of->joint_count == 0) return all;
    uint32_t drawn = of->guide_count, points = drawn > 0 ? of->guide_begin[drawn] : 0;
    all.guide_count += of->joint_count;
    all.guide_begin = QW_NEW(env, uint32_t, (size_t)all.guide_count + 1);
    all.guide_kind = QW_NEW(env, uint8_t, all.guide_count);
    all.guide_rings = QW_NEW_ZERO(env, uint32_t, all.guide_count);
    all.guide_point = QW_NEW(env, double, 3 * ((size_t)points + of->joint_begin[of->joint_count]));
    for (uint32_t g = 0; g < all.guide_count; g++) {
        bool is_joint = g >= drawn;
        all.guide_begin[g] = is_joint ? points + of->joint_begin[g - drawn] : of->guide_begin[g];
        all.guide_kind[g] = is_joint ? QW_GUIDE_JOINT : of->guide_kind[g];
        if (!is_joint) all.guide_rings[g] = of->guide_rings[g];
    }
    all.guide_begin[all.guide_count] = points + of->joint_begin[of->joint_count];
    if (points > 0) memcpy(all.guide_point, of->guide_point, 3 * (size_t)points * sizeof *all.guide_point);
    memcpy(all.guide_point + 3 * (size_t)points, of->joint_point,
           3 * (size_t)of->joint_begin[of->joint_count] * sizeof *all.guide_point);
    return all;
}

/* ---- on the surface */

/* At most so many samples of a step, however long it is. */
static const double MOST_SAMPLES = 1e6;

/* Fails where a point of a guide is further than MOST_OFF edges off the surface. */
static void require_near(const qw_run_state *run, const qw_bvh *bvh, const qw_vec3 *point, double edge)
{
    assert(edge > 0);
    const qw_steering *s = &run->steering;
    double worst = 0;
    uint32_t guide = 0, number = 0;
    for (uint32_t g = 0; g < s->guide_count; g++) {
        if (s->guide_kind[g] == QW_GUIDE_JOINT) continue; /* nobody drew it: it is let go */
        for (uint32_t i = s->guide_begin[g]; i < s->guide_begin[g + 1]; i++) {
            qw_hit hit = qw_bvh_nearest(bvh, point[i], qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
            double off = hit.face == QW_NONE ? INFINITY : sqrt((double)hit.distance2);
            if (off > worst) worst = off, guide = g, number = i - s->guide_begin[g];
        }
    }
    if (worst > MOST_OFF * edge)
        qw_fail(
            run->env, QW_ARGUMENT, guide,
            "guide %u is off the surface: its point %u lies %.4g away, and %.4g, about half an edge of the quads, is "
            "the most",
            guide, number, worst / run->clean.frame.scale, MOST_OFF * edge / run->clean.frame.scale);
}

static void keep_surface(const qw_run_state *run)
{
    const qw_trimesh *s = &run->surface;
    qw_keep(run->env, s->position), qw_keep(run->env, s->corner), qw_keep(run->env, s->twin);
    qw_keep(run->env, s->mark), qw_keep(run->env, s->point), qw_keep(run->env, run->surface_census.component);
}

static void take_surface(qw_run_state *run, const qw_trimesh *cut)
{
    run->surface = *cut;
    run->surface_census = qw_trimesh_census(run->env, cut);
    keep_surface(run);
}

void qw_engrave_guides(qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    run->report->guide_edges = 0;
    if (run->whole.steering->guide_count == 0) return;
    double edge = qw_edge_wanted(run, qw_faces_without_small(run, run->surface_faces));
    qw_scope_begin(env);
    const qw_vec3 *point = qw_guides_in_frame(run);
    const qw_bvh *bvh = qw_bvh_build(env, &run->surface);
    require_near(run, bvh, point, edge);
    qw_polylines lines = {0};
    uint32_t *number = QW_NEW(env, uint32_t, s->guide_count), *finer = QW_NEW(env, uint32_t, s->guide_count),
             *begin = QW_NEW(env, uint32_t, (size_t)s->guide_count + 1);
    uint8_t *mark = QW_NEW(env, uint8_t, s->guide_count);
    qw_vec3 *loops = QW_NEW(env, qw_vec3, (size_t)QW_FINER * s->guide_begin[s->guide_count]);
    float near = (float)(MOST_OFF / 2 * edge);
    int64_t on_rims = 0;
    begin[0] = 0;
    for (uint32_t g = 0; g < s->guide_count; g++) {
        if (s->guide_kind[g] != QW_GUIDE_LOOP) continue;
        uint32_t i = lines.count, count = qw_smooth_count(run, g);
        number[i] = g, mark[i] = qw_has_rings(run, g) ? QW_MARKS : QW_MARK_FEATURE,
        finer[i] = qw_has_rings(run, g) ? QW_FINER : 1;
        qw_smooth_guide(run, g, point, loops + begin[i]);
        int64_t rim = qw_has_rings(run, g) ? qw_mark_drawn_opening(run, loops + begin[i], count, near) : 0;
        begin[i + 1] = begin[i] + count, lines.count += rim == 0, on_rims += rim;
    }
    assert(begin[lines.count] <= (size_t)QW_FINER * s->guide_begin[s->guide_count]); /* the room for loops */
    lines.begin = begin, lines.point = loops, lines.number = number, lines.mark = mark, lines.finer = finer;
    if (lines.count > 0) {
        qw_trimesh cut = qw_engrave(env, &run->surface, bvh, &lines, (float)edge, &run->report->guide_edges, NULL);
        take_surface(run, &cut);
    }
    run->report->guide_edges += on_rims;
    qw_scope_end(env);
}

/* ---- necks */

/* At a joint so many rows fit across, by how fast movement changes in its middle: three in all. */
enum { ROWS_OF_JOINT = 2 };
/* Nothing that was drawn is nearer to a joint or a neck than so many edges, or its radius. */
static const float APART = 3;
/* Of so many quads one neck or opening takes its share: where all that are found have fewer, none is taken, as rings
   around some horns would leave no quads for the others. */
static const double QUADS_OF_NECK = 100;
/* A surface of more components is a soup, or an assembly of plain parts, in which no necks are looked for. */
enum { MOST_COMPONENTS = 8 };

/* Curves that are to be engraved, after the loops that were drawn, beside which nothing else is. */
typedef struct taking {
    qw_run_state *run;
    float edge;
    const float *size;  /* float[vertices of the surface]: wanted edges; NULL: not asked for */
    const qw_bvh *tree; /* of the surface */
    qw_vec3 *from, *to; /* steps of loops that were drawn, and of joints that were taken */
    uint32_t steps;
    qw_necks taken;
} taking;

static void add_steps(taking *t, const qw_vec3 *point, uint32_t count)
{
    for (uint32_t i = 0; i + 1 < count; i++) t->from[t->steps] = point[i], t->to[t->steps++] = point[i + 1];
}

static void take(taking *t, const qw_vec3 *point, uint32_t count, uint8_t kind)
{
    qw_necks *n = &t->taken;
    memcpy(n->point + n->begin[n->count], point, count * sizeof *point);
    n->kind[n->count++] = kind, n->begin[n->count] = n->begin[n->count - 1] + count;
}

/* The number of edges along a curve; 0: it is off the surface. *rows: how many fit across it, where movement changes
   from none to all. */
static double edges_on(const taking *t, const qw_vec3 *point, uint32_t count, double *rows)
{
    qw_env *env = t->run->env;
    double edges = 0, change = 0;
    qw_vec3 *normal = QW_NEW(env, qw_vec3, count);
    float *size = QW_NEW(env, float, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_hit hit = qw_bvh_nearest(t->tree, point[i], qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        if (hit.face == QW_NONE || sqrtf(hit.distance2) > (float)MOST_OFF * t->edge) return 0;
        normal[i] = qw_bvh_normal(t->tree, hit.face), size[i] = t->size[t->run->surface.corner[3 * (size_t)hit.face]];
        if (i > 0) edges += (double)(qw_distance(point[i - 1], point[i]) / size[i - 1]);
    }
    const qw_vec3 *moved = qw_motion_on(t->run, point, normal, count);
    for (uint32_t i = 0; i < count; i++) change += (double)(size[i] * qw_length(moved[i]));
    *rows = count / change;
    return edges;
}

/* Whether nothing lies so near to a curve of so many edges, nor nearer than its radius: rows of two nests would be
   squeezed between them. */
static bool is_free(const taking *t, const qw_vec3 *point, uint32_t count, double edges)
{
    bool is_closed = qw_distance(point[0], point[count - 1]) == 0, is_free = true;
    float length = 0;
    if (t->steps == 0) return true;
    for (uint32_t i = 0; i + 1 < count; i++) length += qw_distance(point[i], point[i + 1]);
    float radius = length / (float)(is_closed ? 2 * QW_PI : QW_PI), near = fmaxf(APART * length / (float)edges, radius);
    qw_scope_begin(t->run->env);
    const qw_curve_tree *drawn = qw_curve_tree_build(t->run->env, t->from, t->to, t->steps);
    for (uint32_t i = 0; i < count && is_free; i++)
        is_free = qw_curve_nearest(drawn, point[i], near).segment == QW_NONE;
    qw_scope_end(t->run->env);
    return is_free;
}

/* Whether a joint has room for so many edges around and rings across. */
static bool has_room(const taking *t, const qw_vec3 *point, uint32_t count)
{
    bool is_closed = qw_distance(point[0], point[count - 1]) == 0;
    double rows = 0, edges = edges_on(t, point, count, &rows);
    return edges >= (is_closed ? QW_NECK_EDGES : 0.5 * QW_NECK_EDGES) && rows >= ROWS_OF_JOINT &&
           is_free(t, point, count, edges);
}

/* Takes the loops of guides, then joints where the run follows motion and there is room beside them. */
static void take_joints(taking *t)
{
    const qw_steering *s = &t->run->steering;
    if (s->guide_count == 0) return;
    qw_env *env = t->run->env;
    const qw_vec3 *point = qw_guides_in_frame(t->run);
    float *base_target;
    bool moves = qw_follows_motion(t->run);
    if (moves) t->size = qw_wanted_size(t->run, (double)t->edge, &base_target, NULL, NULL);
    if (moves) t->tree = qw_bvh_build(env, &t->run->surface);
    for (int joints = 0; joints < 1 + moves; joints++)
        for (uint32_t g = 0; g < s->guide_count; g++) {
            const qw_vec3 *p = point + s->guide_begin[g];
            uint32_t count = s->guide_begin[g + 1] - s->guide_begin[g];
            if (!joints && s->guide_kind[g] == QW_GUIDE_LOOP) add_steps(t, p, count);
            if (joints && s->guide_kind[g] == QW_GUIDE_JOINT && t->taken.count < QW_MOST_NECKS && has_room(t, p, count))
                take(t, p, count, QW_LIMB), add_steps(t, p, count);
        }
}

/* Takes the necks that were found, if they are whole or end at the plane, and nothing taken is near. */
static void take_necks(taking *t, const qw_necks *found)
{
    for (uint32_t i = 0; i < found->count; i++) {
        const qw_vec3 *p = found->point + found->begin[i];
        uint32_t count = found->begin[i + 1] - found->begin[i];
        bool is_whole = qw_distance(p[0], p[count - 1]) == 0,
             is_cut = qw_cuts_at(t->run, p[0]) && qw_cuts_at(t->run, p[count - 1]);
        if (!is_whole && !is_cut) continue; /* it ends at a boundary of the surface */
        double length = 0;
        for (uint32_t k = 0; k + 1 < count; k++) length += (double)qw_distance(p[k], p[k + 1]);
        if (is_free(t, p, count, length / (double)t->edge)) take(t, p, count, found->kind[i]);
    }
}

static void add_steps_of(taking *t, const qw_necks *curves)
{
    for (uint32_t i = 0; i < curves->count; i++)
        add_steps(t, curves->point + curves->begin[i], curves->begin[i + 1] - curves->begin[i]);
}

/* Adds the openings, which need not be drawn. */
static void add_openings(taking *t, const qw_necks *openings)
{
    for (uint32_t i = 0; i < openings->count; i++)
        take(t, openings->point + openings->begin[i], openings->begin[i + 1] - openings->begin[i], QW_POCKET);
}

/* Draws the curves on a copy of the surface, which becomes the surface; those that cannot be drawn are let go. */
static void engrave_taken(taking *t)
{
    qw_run_state *run = t->run;
    qw_env *env = run->env;
    qw_necks *n = &t->taken;
    uint32_t *number = QW_NEW_ZERO(env, uint32_t, n->count), *finer = QW_NEW(env, uint32_t, n->count);
    uint8_t *mark = QW_NEW(env, uint8_t, n->count);
    bool *drawn = QW_NEW(env, bool, n->count);
    for (uint32_t i = 0; i < n->count; i++) finer[i] = 1, mark[i] = QW_MARKS;
    if (!t->tree && n->count > 0) t->tree = qw_bvh_build(env, &run->surface);
    while (n->count > 0) {
        const qw_polylines lines = {n->count, n->begin, n->point, number, mark, finer};
        int64_t marked;
        qw_trimesh cut = qw_engrave(env, &run->surface, t->tree, &lines, t->edge, &marked, drawn);
        qw_necks kept = {0, n->begin, n->point, n->kind};
        for (uint32_t i = 0; i < n->count; i++) {
            uint32_t from = n->begin[i], count = n->begin[i + 1] - from, to = kept.begin[kept.count];
            if (!drawn[i]) continue;
            memmove(kept.point + to, n->point + from, count * sizeof *kept.point);
            kept.kind[kept.count++] = n->kind[i], kept.begin[kept.count] = to + count;
        }
        bool all = kept.count == n->count;
        *n = kept;
        if (!all) continue;
        take_surface(run, &cut);
        return;
    }
}

static bool finds_rings(const qw_run_state *run)
{
    return run->options.rings > 0 && !run->plan.ringless && qw_uses(run->env, QW_MECH_NECKS) &&
           (run->mirror.planes <= 1 || run->mirror.own) && /* rows of a quarter come home at its planes */
           run->surface_census.components <= MOST_COMPONENTS;
}

/* Of so many curves each has its share of the quads. */
static double most_curves(const qw_run_state *run, double rho)
{
    return qw_trimesh_area(&run->surface) / (QUADS_OF_NECK * rho * rho);
}

qw_necks qw_necks_of_surface(const qw_run_state *run, double rho)
{
    qw_necks none = {0};
    if (!finds_rings(run)) return none;
    qw_scope_begin(run->env);
    bool dents = run->mirror.is_used && !run->mirror.own;
    qw_trimesh surface = run->surface; /* of dents one no finer than they need */
    if (dents) surface = qw_evenly_condensed_mesh(run->env, &run->surface, &run->surface_census, QW_CONDENSED * rho);
    qw_necks necks = qw_find_necks(run->env, &surface, rho, qw_cuts_in_frame(run), run->input.cuts, dents,
                                   run->options.rings);
    qw_keep(run->env, necks.begin), qw_keep(run->env, necks.point), qw_keep(run->env, necks.kind);
    qw_scope_end(run->env);
    return necks;
}

/* Finds openings where there is a plane of symmetry; none where quads are too few for each to have its share. Without
   a plane a surface is rarely a face or a body, and its holes are no eyes. */
static void find_openings(qw_run_state *run, double rho, qw_openings *openings)
{
    if (!run->mirror.is_used || qw_keeps_rims(run) || !qw_uses(run->env, QW_MECH_OPENINGS)) return;
    *openings = qw_find_openings(run, rho);
    if (openings->curves.count > most_curves(run, rho)) openings->curves.count = 0;
    qw_mark_openings(run, openings);
    qw_did(run->env, QW_MECH_OPENINGS, openings->curves.count);
}

bool qw_engrave_necks(qw_run_state *run, double rho, const qw_necks *found)
{
    qw_env *env = run->env;
    run->necks = (qw_necks){0};
    bool finds = finds_rings(run);
    if (!finds && !(qw_follows_motion(run) && run->whole.steering->joint_count > 0)) return false;
    qw_scope_begin(env);
    qw_necks necks = *found;
    qw_openings openings = {0};
    bool has_room = necks.count <= most_curves(run, rho);
    if (!has_room) necks.count = 0;
    if (finds && has_room) find_openings(run, rho, &openings);
    const qw_steering *s = &run->steering;
    size_t most = necks.count > 0 ? necks.begin[necks.count] : 0;
    if (openings.curves.count > 0) most += openings.curves.begin[openings.curves.count];
    if (s->guide_count > 0) most += s->guide_begin[s->guide_count];
    uint32_t curves = necks.count + openings.curves.count + s->guide_count;
    taking t = {.run = run, .edge = (float)rho, .from = QW_NEW(env, qw_vec3, most), .to = QW_NEW(env, qw_vec3, most)};
    t.taken = (qw_necks){0, QW_NEW_ZERO(env, uint32_t, (size_t)curves + 1), QW_NEW(env, qw_vec3, most),
                         QW_NEW(env, uint8_t, curves)};
    add_steps_of(&t, &openings.curves);
    take_joints(&t);
    uint32_t joints = t.taken.count;
    take_necks(&t, &necks);
    engrave_taken(&t);
    add_openings(&t, &openings.curves);
    assert(t.taken.count <= curves && t.taken.begin[t.taken.count] <= most);
    if (t.taken.count > 0) {
        run->necks = t.taken;
        qw_keep(env, run->necks.begin), qw_keep(env, run->necks.point), qw_keep(env, run->necks.kind);
    }
    qw_acted(env, QW_MECH_NECKS, finds);
    qw_kept(env, QW_MECH_NECKS, run->necks.count > joints ? run->necks.count - joints : 0);
    qw_scope_end(env);
    return run->necks.count > 0;
}

/* ---- directions */

void qw_add_guide_directions(const qw_run_state *run, qw_vec3 *asked)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    const qw_trimesh *mesh = &run->working.mesh;
    if (!qw_has_guides(run, QW_GUIDE_DIRECTION)) return;
    qw_scope_begin(env);
    const qw_vec3 *point = qw_guides_in_frame(run);
    uint32_t n = s->guide_begin[s->guide_count], count = 0;
    qw_vec3 *from = QW_NEW(env, qw_vec3, n), *to = QW_NEW(env, qw_vec3, n);
    for (uint32_t g = 0; g < s->guide_count; g++)
        for (uint32_t i = s->guide_begin[g]; i + 1 < s->guide_begin[g + 1]; i++)
            if (s->guide_kind[g] == QW_GUIDE_DIRECTION) from[count] = point[i], to[count++] = point[i + 1];
    assert(count <= n);
    const qw_curve_tree *tree = qw_curve_tree_build(env, from, to, count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        float reach = REACH * (float)run->rho;
        qw_curve_hit hit = qw_curve_nearest(tree, mesh->position[v], reach);
        if (hit.segment == QW_NONE) continue;
        qw_vec3 along = qw_normalize(qw_sub(to[hit.segment], from[hit.segment])),
                flat = qw_reject(along, run->normal[v]);
        if (qw_length2(flat) < 0.5f) continue; /* it stands on the surface here: it is another sheet's */
        asked[v] = qw_scale(qw_normalize(flat), fminf(2 * (1 - sqrtf(hit.distance2) / reach), 1));
    }
    qw_scope_end(env);
}

/* ---- what became of them */

void qw_report_guides(qw_run_state *run, const qw_quadmesh *quads)
{
    qw_env *env = run->env;
    const qw_steering *s = &run->steering;
    float worst = 0;
    run->report->guide_off = -1;
    if (!qw_has_guides(run, QW_GUIDE_LOOP)) return;
    qw_scope_begin(env);
    const qw_vec3 *point = qw_guides_in_frame(run);
    const qw_bvh *surface = qw_bvh_build(env, &run->surface);
    const qw_curve_tree *edges = qw_curve_tree_of_quads(env, quads);
    qw_vec3 *line = QW_NEW(env, qw_vec3, (size_t)QW_FINER * s->guide_begin[s->guide_count]);
    for (uint32_t g = 0; g < s->guide_count; g++) {
        qw_smooth_guide(run, g, point, line);
        for (uint32_t i = 0; s->guide_kind[g] == QW_GUIDE_LOOP && i + 1 < qw_smooth_count(run, g); i++) {
            uint32_t steps = 1 + (uint32_t)fmin(SAMPLES * (double)qw_distance(line[i], line[i + 1]) / run->rho,
                                                MOST_SAMPLES);
            for (uint32_t k = 0; k < steps; k++) {
                qw_vec3 p = qw_lerp(line[i], line[i + 1], (float)k / (float)steps);
                qw_hit hit = qw_bvh_nearest(surface, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
                worst = fmaxf(worst, qw_curve_nearest(edges, hit.point, INFINITY).distance2);
            }
        }
    }
    run->report->guide_off = sqrt((double)worst) / run->rho;
    qw_scope_end(env);
}

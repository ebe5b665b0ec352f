#include "run/stages/coverage.h"

#include "base/mechanisms.h"
#include "whole/mirror.h"
#include "base/promise.h"
#include "base/elementary.h"
#include "remesh/quads/count.h"
#include "remesh/relax/diagonals.h"
#include "remesh/quads/protrusions.h"
#include "remesh/relax/relax.h"
#include "remesh/quads/simplify.h"
#include "remesh/quads/uncovered.h"
#include "remesh/quads/wanted.h"
#include "whole/sizes.h"
#include "whole/directions.h"

#include <assert.h>
#include <math.h>

/* How often protrusions grow, as room for some may take others; how often room is made for the same ones; and rings of
   vertices around what grew that are relaxed with it. */
enum { GROWTHS = 4, ROOM_ROUNDS = 2, LOOSE_RINGS = 2 };
/* What sticks out is lost where its tip is farther from every quad than this share of its length; it grows where that,
   or so many mean edges, are missing. */
static const float LOST_TIP = 0.3f, GROWN_DISTANCE = 0.7f;
/* Of the wanted size, where no quads may go. */
static const float NONE_TO_SPARE = 0.01f;

qw_quadmesh qw_relax(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *held, uint8_t **flipped)
{
    uint8_t *turn = flipped ? QW_NEW_ZERO(run->env, uint8_t, quads->face_count) : NULL;
    if (flipped) *flipped = QW_NEW_ZERO(run->env, uint8_t, quads->face_count);
    qw_trimesh surface = qw_parted_surface(run), working = qw_parted_working(run);
    qw_relax_target target = {.tree = run->tree,
                              .mesh = &working,
                              .near = run->working_tree,
                              .size = run->size,
                              .evenness = (float)run->options.evenness,
                              .flipped = flipped ? *flipped : NULL,
                              .leaves_flips = !flipped,
                              .turn = turn,
                              .held = held,
                              .direction = run->alignment,
                              .follow = (float)qw_lines_followed(run)};
    qw_vec3 *position = qw_relax_quads(run->env, quads, &surface, &target);
    qw_quadmesh relaxed = turn ? qw_turn_quads(run->env, quads, turn) : *quads;
    relaxed.position = position;
    qw_free(run->env, turn);
    return relaxed;
}

qw_sites qw_find_uncovered(const qw_run_state *run, const qw_quadmesh *quads)
{
    qw_scope_begin(run->env);
    qw_halves halves = qw_halve_quads(run->env, quads);
    qw_sites sites = qw_uncovered_sites(run->env, &run->working.mesh, run->size, &halves, qw_uncovered_distance(run));
    qw_keep(run->env, sites.point), qw_keep(run->env, sites.size);
    qw_scope_end(run->env);
    return sites;
}

/* Makes the marked vertices around v that hang together with it unmarked. */
static void forget_piece(const qw_trimesh *m, const uint32_t *out, uint32_t v, uint8_t *marked, uint32_t *stack)
{
    assert(v < m->vertex_count);
    uint32_t deep = 0;
    marked[v] = 0, stack[deep++] = v;
    while (deep > 0) {
        uint32_t first = out[stack[--deep]], h = first;
        do {
            uint32_t ends[2] = {m->corner[qw_next(h)], m->corner[qw_prev(h)]};
            for (int i = 0; i < 2; i++)
                if (marked[ends[i]]) marked[ends[i]] = 0, stack[deep++] = ends[i];
            h = qw_around(m, h);
        } while (h != QW_NONE && h != first);
    }
}

/* What sticks out is lost where the quads end farther from its tip than that, and grows where they end farther than
   this. */
static float lost_beyond(const qw_run_state *run, uint32_t t)
{
    return fminf(LOST_TIP * run->tips.tip[t].length, qw_uncovered_distance(run));
}
static float grows_beyond(const qw_run_state *run, uint32_t t)
{
    return fminf(LOST_TIP * run->tips.tip[t].length, GROWN_DISTANCE * (float)run->rho);
}

/* How far each tip is from every quad: float[run->tips.count], in the current scope. */
static float *find_tip_distances(const qw_run_state *run, const qw_halves *quads)
{
    const qw_tip_list *tips = &run->tips;
    qw_vec3 *point = QW_NEW(run->env, qw_vec3, tips->count);
    for (uint32_t t = 0; t < tips->count; t++) point[t] = tips->tip[t].point;
    return qw_distances_to_quads(run->env, point, tips->count, quads);
}

/* Whether a vertex that is marked lies within the tip's length of it. */
static bool has_marked(const qw_trimesh *m, const uint8_t *marked, const qw_tip *tip)
{
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (marked[v] && qw_distance(m->position[v], tip->point) < tip->length) return true;
    return false;
}

uint32_t qw_count_lost_parts(const qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_trimesh *m = &run->working.mesh;
    uint32_t count = 0;
    qw_scope_begin(run->env);
    qw_halves halves = qw_halve_quads(run->env, quads);
    uint8_t *lost = qw_mark_uncovered(run->env, m, &halves, qw_uncovered_distance(run));
    const float *far = find_tip_distances(run, &halves);
    for (uint32_t t = 0; t < run->tips.count; t++)
        count += far[t] > lost_beyond(run, t) && !has_marked(m, lost, &run->tips.tip[t]);
    uint32_t *stack = NULL, *out = NULL;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (!lost[v]) continue;
        if (!stack) stack = QW_NEW(run->env, uint32_t, m->vertex_count), out = qw_trimesh_outgoing(run->env, m);
        forget_piece(m, out, v, lost, stack);
        count++;
    }
    qw_scope_end(run->env);
    return count;
}

double qw_count_flipped(const qw_quadmesh *quads, const uint8_t *flipped)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < quads->face_count; f++) count += flipped[f];
    return count;
}

/* What is wanted where, in the current scope. What sticks out has just the quads that it needs, and none to spare:
   there next to no size is wanted. */
static qw_wanted wanted_of(const qw_run_state *run)
{
    qw_trimesh *working = QW_NEW(run->env, qw_trimesh, 1);
    *working = qw_parted_working(run);
    float *size = QW_NEW(run->env, float, working->vertex_count);
    const uint32_t *tip = qw_tips_of_vertices(run->env, working, &run->tips);
    for (uint32_t v = 0; v < working->vertex_count; v++)
        size[v] = run->size[v] * (tip[v] == QW_NONE ? 1 : NONE_TO_SPARE);
    return (qw_wanted){working, size, run->working_tree ? run->working_tree : qw_bvh_build(run->env, working), NULL};
}

/* wanted: NULL: the same everywhere. *chords: quads that whole rows had. */
static qw_quadmesh fewer_quads(const qw_run_state *run, const qw_quadmesh *quads, const qw_wanted *wanted,
                               int64_t least, int64_t most, int64_t *chords)
{
    qw_simplify_counts moves = {0};
    qw_quadmesh fewer = *quads;
    if (qw_uses(run->env, QW_MECH_CHORDS_REMOVED)) fewer = qw_remove_chords(run->env, quads, wanted, least, most);
    *chords = (int64_t)quads->face_count - fewer.face_count;
    qw_did(run->env, QW_MECH_CHORDS_REMOVED, *chords);
    return qw_simplify_quads(run->env, &fewer, wanted, least, most, run->faces_wanted < run->core.needed, &moves);
}

qw_quadmesh qw_fit_count(qw_run_state *run, const qw_quadmesh *quads)
{
    double wanted = run->faces_wanted - qw_surplus_of_core(run, quads), possible = fmax(wanted, run->core.needed);
    int64_t least = qw_least_faces(possible, QW_FIT_MARGIN, qw_times_used(run)),
            most = qw_most_faces(possible, QW_FIT_MARGIN, qw_times_used(run));
    assert(least <= most);
    qw_quadmesh fitted = *quads;
    if (qw_is_near_count(wanted, fitted.face_count, qw_times_used(run))) return fitted;
    if (fitted.face_count > most) {
        int64_t chords;
        fitted = fewer_quads(run, quads, NULL, least, most, &chords);
        run->report->count_chords_removed = -chords;
        run->report->count_quads_removed = (int64_t)fitted.face_count - quads->face_count + chords;
    } else if (fitted.face_count < wanted) {
        fitted = qw_add_quads(run->env, quads, NULL, least, most);
        run->report->count_added = (int64_t)fitted.face_count - quads->face_count;
    }
    if (!qw_is_near_count(wanted, fitted.face_count, qw_times_used(run)) && fitted.face_count > wanted)
        qw_warn(run, "so few faces cannot carry the surface's parts, handles and sharp edges: there are more");
    return fitted;
}

/* Of quads: the points of the surface that are uncovered, how far each tip is, and how much is wrong in all, in quads:
   uncovered area, that of the ends of what sticks out, how many of these are lost, and flipped quads
   (qw_count_flipped). flipped: NULL: none. */
typedef struct faults {
    uint32_t uncovered, lost;
    const float *far; /* float[run->tips.count] */
    double all;
} faults;

/* Farther than this from every quad protrusions grow, also those without a tip. The frame's diagonal is 1. */
static float grown_distance(const qw_run_state *run)
{
    return fminf(fmaxf((float)QW_SEEN_IN_OUTLINE, GROWN_DISTANCE * (float)run->rho), qw_uncovered_distance(run));
}

/* What is uncovered, how far tips are from the quads, and what both amount to in quads. */
static faults find_faults(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *flipped)
{
    qw_trimesh working = qw_parted_working(run);
    qw_scope_begin(run->env);
    qw_halves halves = qw_halve_quads(run->env, quads);
    qw_sites sites = qw_uncovered_sites(run->env, &working, run->size, &halves, grown_distance(run));
    float *far = find_tip_distances(run, &halves);
    faults f = {.uncovered = sites.count, .far = far};
    qw_keep(run->env, far);
    qw_scope_end(run->env);
    double area = sites.area, lost = 0;
    for (uint32_t t = 0; t < run->tips.count; t++) {
        area += (double)(f.far[t] * run->tips.tip[t].girth);
        lost += (double)(f.far[t] / grows_beyond(run, t));
        f.lost += f.far[t] > grows_beyond(run, t);
    }
    f.all = qw_in_quads(run, area) + lost + (flipped ? qw_count_flipped(quads, flipped) : 0);
    assert(f.all >= 0);
    return f;
}

/* What of a tip is to grow where the quads end so far from it: that, and the way around the end. */
static qw_tip uncovered_end(const qw_tip *tip, float far)
{
    qw_tip end = *tip;
    end.length = fminf(tip->length, far + tip->girth / 4);
    return end;
}

/* Lets the lost tips, and what else is uncovered, grow in at most so many quads (room). Returns how many did. */
static uint32_t extrude(const qw_run_state *run, bool marked, int64_t room, qw_quadmesh *quads)
{
    faults f = find_faults(run, quads, NULL);
    qw_tip *tip = QW_NEW(run->env, qw_tip, run->tips.count);
    uint32_t count = 0;
    for (uint32_t t = 0; t < run->tips.count; t++)
        if (f.far[t] > grows_beyond(run, t)) tip[count++] = uncovered_end(&run->tips.tip[t], f.far[t]);
    qw_growth growth = {.surface = &run->working.mesh,
                        .edge = (float)run->rho,
                        .far = grown_distance(run),
                        .marked = marked,
                        .most = (uint32_t)fmin(QW_PROTRUSION_SHARE * qw_faces_with_reserve(run), (double)room),
                        .tip_count = count,
                        .tip = tip};
    return qw_extrude_protrusions(run->env, quads, &growth);
}

/* Rings of vertices by faces from those that have grown, `first` on, up to LOOSE_RINGS: uint8_t[q->vertex_count]. */
static uint8_t *find_rings(qw_env *env, const qw_quadmesh *q, uint32_t first)
{
    assert(first <= q->vertex_count);
    uint8_t *ring = QW_NEW(env, uint8_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) ring[v] = v < first ? LOOSE_RINGS + 1 : 0;
    for (uint8_t k = 0; k < LOOSE_RINGS; k++)
        for (uint32_t f = 0; f < q->face_count; f++) {
            const uint32_t *c = q->corner + 4 * (size_t)f;
            bool touches = ring[c[0]] == k || ring[c[1]] == k || ring[c[2]] == k || ring[c[3]] == k;
            for (uint32_t i = 0; touches && i < 4; i++)
                if (ring[c[i]] > k + 1) ring[c[i]] = (uint8_t)(k + 1);
        }
    return ring;
}

/* 1 for vertices that are not to move when those from `first` on have grown: the corners of caps, where three quads
   meet, as quads draw back from a tip; and all that are farther than LOOSE_RINGS. uint8_t[q->vertex_count] */
static uint8_t *hold_others(qw_env *env, const qw_quadmesh *q, uint32_t first)
{
    assert(first <= q->vertex_count);
    uint8_t *held = QW_NEW(env, uint8_t, q->vertex_count), *ring = find_rings(env, q, first);
    uint32_t *quads = QW_NEW_ZERO(env, uint32_t, q->vertex_count);
    for (uint32_t k = 0; k < 4 * q->face_count; k++) quads[q->corner[k]]++;
    for (uint32_t v = 0; v < q->vertex_count; v++) held[v] = (ring[v] == 0 && quads[v] == 3) || ring[v] > LOOSE_RINGS;
    qw_free(env, ring), qw_free(env, quads);
    return held;
}

/* The fewest and the most quads that there may be in the end. */
static int64_t least_of_all(const qw_run_state *run)
{
    return qw_least_faces(qw_faces_with_reserve(run), QW_FIT_MARGIN, qw_times_used(run));
}
static int64_t most_of_all(const qw_run_state *run)
{
    return qw_most_faces(qw_faces_with_reserve(run), QW_FIT_MARGIN, qw_times_used(run));
}

/* Whether so many faces are not too many and, where the plan keeps quads for what sticks out, not too few: what was
   kept is to be used up. */
static bool is_count_met(const qw_run_state *run, int64_t faces)
{
    return faces <= most_of_all(run) && (faces >= least_of_all(run) || run->plan.reserve == 0);
}

/* Fewer quads where `added` more would be too many, else more of them. */
static qw_quadmesh make_room(const qw_run_state *run, const qw_quadmesh *quads, const qw_wanted *wanted, int64_t added)
{
    int64_t least = least_of_all(run) - added, most = most_of_all(run) - added, chords;
    return quads->face_count > most ? fewer_quads(run, quads, wanted, least, most, &chords)
                                    : qw_add_quads(run->env, quads, wanted, least, most);
}

/* With all that is lost grown; where there would be too many quads, or too few, room is made first, the last time for
   as many as there is room. *lacking: quads that there was no room for. Returns how many grew: 0 where there is none,
   or more of it than they take. */
static uint32_t grow(const qw_run_state *run, const qw_quadmesh *quads, const qw_wanted *wanted, bool marked,
                     qw_quadmesh *result, uint8_t **flipped, double *lacking)
{
    int64_t least = least_of_all(run), most = most_of_all(run);
    qw_quadmesh from = *quads, grown = from;
    uint32_t count = extrude(run, marked, most, &grown);
    *lacking = grown.face_count > most ? grown.face_count - from.face_count : 0;
    for (int i = 0;
         i < ROOM_ROUNDS && count > 0 && !is_count_met(run, grown.face_count) && qw_uses(run->env, QW_MECH_GROWN_ROOM);
         i++) {
        qw_did(run->env, QW_MECH_GROWN_ROOM, 1);
        int64_t added = grown.face_count - from.face_count;
        from = make_room(run, quads, wanted, added);
        from = qw_relax(run, &from, NULL, NULL); /* what grows is relaxed with it once more */
        grown = from;
        int64_t room = i + 1 < ROOM_ROUNDS ? most : most - from.face_count;
        count = room > 0 ? extrude(run, marked, room, &grown) : 0;
    }
    if (count == 0 || grown.face_count > most ||
        grown.face_count < (least < quads->face_count ? least : quads->face_count))
        return 0;
    *result = qw_relax(run, &grown, hold_others(run->env, &grown, from.vertex_count), flipped);
    return count;
}

/* All grow at once; then again, for those that the room for these has taken, as long as a round leaves no more than
   QW_ROUND_GAIN of the faults. */
uint32_t qw_grow_protrusions(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped, bool marked)
{
    if (run->faces_wanted < run->core.needed || (marked && run->relaxed_covers)) return 0;
    faults before = find_faults(run, quads, *flipped);
    if (!marked) run->relaxed_covers = before.uncovered + before.lost == 0;
    if (before.uncovered + before.lost == 0) return 0;
    qw_wanted wanted = wanted_of(run);
    uint32_t all = 0;
    for (uint32_t i = 0; i < GROWTHS && before.uncovered + before.lost > 0; i++) {
        qw_quadmesh grown;
        uint8_t *grown_flipped;
        double lacking;
        uint32_t count = grow(run, quads, &wanted, marked, &grown, &grown_flipped, &lacking);
        if (i == 0 && !marked) run->lacking = lacking;
        faults after = count > 0 ? find_faults(run, &grown, grown_flipped) : before;
        if (!(after.all < before.all)) break;
        qw_log(run->env, QW_LOG_DEBUG, "%u protrusions grew, %u quads now; faults: %.2f, were %.2f", count,
               grown.face_count, after.all, before.all);
        *quads = grown, *flipped = grown_flipped;
        bool is_last = after.all > QW_ROUND_GAIN * before.all;
        all += count, before = after;
        if (!marked) run->relaxed_covers = before.uncovered + before.lost == 0;
        if (is_last) break;
    }
    return all;
}

void qw_use_up_reserve(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped)
{
    if (is_count_met(run, quads->face_count)) return;
    qw_wanted wanted = wanted_of(run);
    qw_quadmesh more = make_room(run, quads, &wanted, 0);
    *quads = qw_relax(run, &more, NULL, flipped);
}

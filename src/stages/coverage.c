#include "stages/coverage.h"

#include "core/mirror.h"
#include "base/promise.h"
#include "math/elementary.h"
#include "quad/count.h"
#include "quad/diagonals.h"
#include "quad/protrusions.h"
#include "quad/relax.h"
#include "quad/simplify.h"
#include "quad/uncovered.h"
#include "demand/sizes.h"
#include "demand/directions.h"

#include <math.h>

/* Passes in which protrusions grow: quads of the second pass may grow from those of the first. */
enum { GROWTHS = 2 };
/* A protrusion grows where the surface is farther than so many mean edges from every quad, if that is this share of the
   diagonal or more: a horn or an ear that few quads cut off may end no farther away, while what is smaller is relief.
 */
static const float GROWN_DISTANCE = 0.7f, SEEN_IN_OUTLINE = 0.025f;

qw_quadmesh qw_relax(const qw_run_state *run, const qw_quadmesh *quads, uint8_t **flipped)
{
    uint8_t *turn = QW_NEW_ZERO(run->env, uint8_t, quads->face_count);
    *flipped = QW_NEW_ZERO(run->env, uint8_t, quads->face_count);
    qw_trimesh surface = qw_parted_surface(run), working = qw_parted_working(run);
    qw_relax_target target = {.tree = run->tree,
                              .mesh = &working,
                              .size = run->size,
                              .evenness = (float)run->options.evenness,
                              .flipped = *flipped,
                              .turn = turn,
                              .direction = run->alignment,
                              .follow = (float)qw_lines_followed(run)};
    qw_vec3 *position = qw_relax_quads(run->env, quads, &surface, &target);
    qw_quadmesh relaxed = qw_turn_quads(run->env, quads, turn);
    relaxed.position = position;
    qw_free(run->env, turn);
    return relaxed;
}

qw_sites qw_find_uncovered(const qw_run_state *run, const qw_quadmesh *quads)
{
    return qw_uncovered_sites(run->env, &run->working.mesh, run->size, quads, qw_uncovered_distance(run));
}

/* Makes the marked vertices around v that hang together with it unmarked. */
static void forget_piece(const qw_trimesh *m, const uint32_t *out, uint32_t v, uint8_t *marked, uint32_t *stack)
{
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

uint32_t qw_count_lost_parts(const qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_trimesh *m = &run->working.mesh;
    uint32_t count = 0;
    qw_scope_begin(run->env);
    uint8_t *lost = qw_mark_uncovered(run->env, m, quads, qw_uncovered_distance(run));
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

static qw_quadmesh fewer_quads(const qw_run_state *run, const qw_quadmesh *quads, int64_t least, int64_t most)
{
    qw_simplify_counts moves = {0};
    qw_quadmesh fewer = qw_remove_chords(run->env, quads, least, most);
    return qw_simplify_quads(run->env, &fewer, least, most, run->faces_wanted < run->core.needed, &moves);
}

qw_quadmesh qw_fit_count(qw_run_state *run, const qw_quadmesh *quads)
{
    double wanted = run->faces_wanted - qw_surplus_of_core(run, quads), possible = fmax(wanted, run->core.needed);
    int64_t least = qw_least_faces(possible, QW_FIT_MARGIN, qw_times_used(run)),
            most = qw_most_faces(possible, QW_FIT_MARGIN, qw_times_used(run));
    qw_quadmesh fitted = *quads;
    if (qw_is_near_count(wanted, fitted.face_count, qw_times_used(run))) return fitted;
    if (fitted.face_count > most) fitted = fewer_quads(run, quads, least, most);
    else if (fitted.face_count < wanted) fitted = qw_add_quads(run->env, quads, least, most);
    if (!qw_is_near_count(wanted, fitted.face_count, qw_times_used(run)) && fitted.face_count > wanted)
        qw_warn(run, "so few faces cannot carry the surface's parts, handles and sharp edges: there are more");
    return fitted;
}

/* Farther than this from every quad protrusions grow. The frame's diagonal is 1. */
static float grown_distance(const qw_run_state *run)
{
    return fminf(fmaxf(SEEN_IN_OUTLINE, GROWN_DISTANCE * (float)run->rho), qw_uncovered_distance(run));
}

/* Faults of the quads, in quads: area from which protrusions grow, plus flipped quads (qw_count_flipped). */
static double find_faults(const qw_run_state *run, const qw_quadmesh *quads, const uint8_t *flipped,
                          uint32_t *uncovered_points)
{
    qw_trimesh working = qw_parted_working(run);
    qw_sites sites = qw_uncovered_sites(run->env, &working, run->size, quads, grown_distance(run));
    *uncovered_points = sites.count;
    return qw_in_quads(run, sites.area) + qw_count_flipped(quads, flipped);
}

uint32_t qw_grow_protrusions(qw_run_state *run, qw_quadmesh *quads, uint8_t **flipped, bool marked)
{
    float edge = (float)run->rho;
    uint32_t uncovered, all = 0, most_added = (uint32_t)(QW_PROTRUSION_SHARE * run->faces_wanted);
    double faults = find_faults(run, quads, *flipped, &uncovered);
    int64_t least = qw_least_faces(run->faces_wanted, QW_FIT_MARGIN, qw_times_used(run)),
            most = qw_most_faces(run->faces_wanted, QW_FIT_MARGIN, qw_times_used(run));
    if (run->faces_wanted < run->core.needed) return 0;
    for (int i = 0; i < GROWTHS && uncovered > 0; i++) {
        qw_quadmesh grown = *quads;
        uint8_t *grown_flipped;
        uint32_t count = qw_extrude_protrusions(run->env, &grown, &run->working.mesh, edge, grown_distance(run), marked,
                                                most_added);
        if (count == 0) break;
        if (grown.face_count > most) grown = fewer_quads(run, &grown, least, most);
        grown = qw_relax(run, &grown, &grown_flipped);
        double before = faults;
        faults = find_faults(run, &grown, grown_flipped, &uncovered);
        qw_log(run->env, QW_LOG_DEBUG, "%u protrusions grew, %u quads now; uncovered or flipped: %.2f quads, were %.2f",
               count, grown.face_count, faults, before);
        if (faults >= before) break;
        *quads = grown, *flipped = grown_flipped;
        all += count;
    }
    return all;
}

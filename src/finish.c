/* FINISH: what is done once, to the attempt that was chosen. Single quads go or are added where the count is off, what
 * is uncovered grows out of what is there, flipped quads are repaired, and nothing passes that has another topology
 * than the surface.
 */
#include "stages.h"

#include "base/promise.h"
#include "math/elementary.h"
#include "quad/count.h"
#include "quad/flip_repair.h"
#include "quad/limbs.h"
#include "quad/reach.h"
#include "quad/simplify.h"
#include "quad/topology.h"
#include "quad/written.h"

#include <math.h>

/* Protrusions grow so often: where the first quads end, the next may begin. */
enum { GROWTHS = 2 };

/* The quads as far as they are finished. */
typedef struct finishing {
    qw_run_state *run;
    qw_quadmesh quads;
    uint8_t *flipped; /* uint8_t[quads.face_count], as of qw_run_state */
} finishing;

static void set_quads(finishing *f, const qw_quadmesh *quads) { f->quads = qw_relax(f->run, quads, &f->flipped); }

static qw_quadmesh fewer_quads(const finishing *f, const qw_quadmesh *quads, int64_t least, int64_t most)
{
    qw_simplify_counts moves = {0};
    qw_quadmesh fewer = qw_remove_chords(f->run->env, quads, least, most);
    fewer = qw_simplify_quads(f->run->env, &fewer, least, most, f->run->faces_wanted < f->run->faces_needed, &moves);
    return fewer;
}

/* What no size of the quads could do: single quads go or are added, until the count is within the promise. Where fewer
   are wanted than the components need, only quads go that cost no shape, down to what they need. */
static void fit_count(finishing *f)
{
    qw_run_state *run = f->run;
    double wanted = run->faces_wanted, possible = fmax(wanted, run->faces_needed);
    double off = QW_FIT_MARGIN * qw_count_tolerance(wanted);
    int64_t least = (int64_t)qw_ceil(possible * (1 - off)), most = (int64_t)qw_floor(possible * (1 + off));
    if (qw_is_near_count(wanted, f->quads.face_count)) return;
    qw_quadmesh fitted = f->quads;
    if (fitted.face_count > most) fitted = fewer_quads(f, &f->quads, least, most);
    else if (fitted.face_count < wanted) fitted = qw_add_quads(run->env, &f->quads, least, most);
    if (!qw_is_near_count(wanted, fitted.face_count) && fitted.face_count > wanted)
        qw_warn(run, "so few faces cannot carry the surface's parts, handles and sharp edges: there are more");
    if (fitted.face_count == f->quads.face_count) return;
    if (run->options.relax) {
        set_quads(f, &fitted);
    } else {
        f->quads = fitted;
        f->flipped = QW_NEW_ZERO(run->env, uint8_t, fitted.face_count);
    }
}

/* ---- what is uncovered */

/* Uncovered area and flipped quads, in quads. */
static double find_faults(const finishing *f, double *uncovered)
{
    const qw_run_state *run = f->run;
    qw_losses losses = qw_find_unreached(run->env, &run->working.mesh, run->size, &f->quads,
                                         (float)QW_UNCOVERED_DISTANCE * (float)run->rho);
    double sum = *uncovered = losses.area / (run->rho * run->rho);
    for (uint32_t i = 0; i < f->quads.face_count; i++) sum += f->flipped[i];
    return sum;
}

/* What the integers left out grows out of what is there, as long as that leaves less uncovered; where the count would
   be missed then, quads go elsewhere. */
static void grow_protrusions(finishing *f)
{
    qw_run_state *run = f->run;
    double wanted = run->faces_wanted, uncovered, faults = find_faults(f, &uncovered);
    float edge = (float)run->rho;
    int64_t least = qw_least_faces(wanted, QW_FIT_MARGIN), most = qw_most_faces(wanted, QW_FIT_MARGIN);
    run->report->grown_limbs = 0;
    if (wanted < run->faces_needed) return;
    for (int i = 0; i < GROWTHS && uncovered > 0; i++) {
        finishing old = *f;
        qw_quadmesh grown = f->quads;
        uint32_t count = qw_grow_limbs(run->env, &grown, &run->working.mesh, edge, (float)QW_UNCOVERED_DISTANCE * edge,
                                       true, (uint32_t)(QW_PROTRUSION_SHARE * wanted));
        if (count == 0) return;
        if (grown.face_count > most) grown = fewer_quads(f, &grown, least, most);
        set_quads(f, &grown);
        double before = faults;
        faults = find_faults(f, &uncovered);
        qw_log(run->env, QW_LOG_DEBUG, "%u protrusions grew, %u quads now; uncovered or flipped: %.2f quads, were %.2f",
               count, grown.face_count, faults, before);
        if (faults >= before) {
            *f = old;
            return;
        }
        run->report->grown_limbs += count;
    }
}

/* ---- flipped quads */

static void repair_flips(finishing *f)
{
    qw_run_state *run = f->run;
    run->report->mended_quads = 0;
    if (f->quads.face_count == 0) return;
    int64_t least = qw_least_faces(run->faces_wanted, 1);
    if (least > f->quads.face_count) least = f->quads.face_count;
    qw_flip_repair repair = {.surface = &run->surface, .whole = &run->clean.mesh, .last_resort = true, .least = least};
    finishing repaired = {run, f->quads, QW_NEW(run->env, uint8_t, f->quads.face_count)};
    qw_flip_counts counts = qw_repair_flips(run->env, &repaired.quads, &repair, repaired.flipped);
    if (counts.flipped_left >= counts.flipped ||
        qw_check_topology(run->env, &repaired.quads, &run->working.mesh).broken_count > 0)
        return;
    *f = repaired;
    run->report->mended_quads = counts.flipped - counts.flipped_left;
}

/* ---- what leaves */

static void check_topology(const finishing *f)
{
    qw_topology_check check = qw_check_topology(f->run->env, &f->quads, &f->run->working.mesh);
    if (check.broken_count || f->quads.face_count == 0)
        qw_fail(f->run->env, QW_INTERNAL, -1,
                "%u of %u components did not keep their topology, so the result is withheld", check.broken_count,
                check.component_count);
}

/* The single precision of the frame means nothing below this share of its diagonal. */
static const double LEAST_DIGIT = 1e-9;

enum { MOST_PLACES = 22 }; /* a higher power of ten is no double */

/* One over the power of ten to which the output is rounded, so that it can be written in few digits. 0: it is not, as
 * that power is no double, or as the digits before the point are enough. */
static double decimal_unit(const qw_frame *frame)
{
    double least = frame->scale / LEAST_DIGIT, unit = 1;
    if (!(least > 0.1)) return 0;
    for (int places = 0; places < MOST_PLACES && unit < least; places++) unit *= 10;
    return unit >= least ? unit : 0;
}

/* Back to the coordinates of the input. */
static double *positions_of_input(const qw_run_state *run, const qw_quadmesh *quads)
{
    const qw_frame *frame = &run->clean.frame;
    uint32_t moved;
    double *output = QW_NEW(run->env, double, (size_t)3 * quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        qw_vec3 p = quads->position[v];
        double q[3] = {p.x, p.y, p.z};
        qw_leave_own_frame(&run->clean.own, p, q);
        for (int i = 0; i < 3; i++) output[3 * (size_t)v + (size_t)i] = frame->center[i] + q[i] / frame->scale;
    }
    uint32_t left = qw_settle_written(run->env, quads, decimal_unit(frame), output, &moved);
    if (moved) qw_log(run->env, QW_LOG_DEBUG, "%u vertices were drawn apart, as quads had no area", moved);
    if (left != QW_NONE && run->options.repair)
        qw_fail(run->env, QW_INTERNAL, left,
                "quad %u, of component %u, has no area in the coordinates that would be written, so the result is "
                "withheld",
                left, quads->component[quads->corner[4 * (size_t)left]]);
    return output;
}

void qw_stage_FINISH(qw_run_state *run)
{
    finishing f = {run, run->relaxed, run->flipped};
    if (run->options.repair) {
        fit_count(&f);
        if (run->options.relax) grow_protrusions(&f), repair_flips(&f);
        check_topology(&f);
    }
    run->finished = f.quads;
    run->output = positions_of_input(run, &f.quads);
}

/* The stage FINISH: what is done once, to the attempt that was chosen. Uncovered protrusions with sharp edges grow,
   flipped quads are repaired, and a result whose topology differs from the surface's is refused. */
#include "core/small.h"
#include "core/rims.h"
#include "stages/stages.h"

#include "base/promise.h"
#include "demand/guides.h"
#include "stages/lost_edges.h"
#include "stages/coverage.h"
#include "quad/fit.h"
#include "quad/flip_repair.h"
#include "quad/topology.h"
#include "quad/wanted.h"
#include "quad/written.h"
#include "demand/directions.h"

#include <math.h>

/* The quads during the stage. */
typedef struct finishing {
    qw_run_state *run;
    qw_quadmesh quads;
    uint8_t *flipped; /* uint8_t[quads.face_count], as of qw_run_state */
} finishing;

/* ---- flipped quads */

static void repair_flips(finishing *f)
{
    qw_run_state *run = f->run;
    run->report->repaired_flips = 0;
    if (f->quads.face_count == 0 || run->faces_wanted < run->apart.needed)
        return; /* too few for their shape to matter */
    int64_t least = qw_least_faces(run->faces_wanted, 1, qw_times_used(run));
    if (least > f->quads.face_count) least = f->quads.face_count;
    qw_trimesh surface = qw_parted_surface(run);
    qw_flip_repair repair = {.surface = &surface, .whole = &run->apart.rest, .last_resort = true, .least = least};
    finishing repaired = {run, f->quads, QW_NEW(run->env, uint8_t, f->quads.face_count)};
    qw_flip_counts counts = qw_repair_flips(run->env, &repaired.quads, &repair, repaired.flipped);
    if (counts.flipped_left >= counts.flipped ||
        qw_check_topology(run->env, &repaired.quads, &run->working.mesh).broken_count > 0)
        return;
    *f = repaired;
    run->report->repaired_flips = counts.flipped - counts.flipped_left;
}

/* ---- nearer to the surface */

static void fit_to_surface(finishing *f)
{
    const qw_run_state *run = f->run;
    const qw_frame *frame = &run->clean.frame;
    if (run->options.fit == 0 || f->quads.face_count == 0) return;
    double cut[4] = {0};
    for (int k = 0; run->input->cut && k < 3; k++) {
        cut[k] = run->input->cut[k];
        cut[3] -= cut[k] * frame->center[k];
    }
    if (run->input->cut) cut[3] = (cut[3] + run->input->cut[3]) * frame->scale;
    qw_trimesh surface = qw_parted_surface(run);
    qw_fit fit = {.tree = qw_bvh_build(run->env, &surface), .strength = (float)run->options.fit};
    if (run->input->cut) fit.cut = cut;
    qw_fit_quads(run->env, &f->quads, &fit);
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

/* Coordinates in the centred frame are meaningful down to this share of the box's diagonal. */
static const double LEAST_DIGIT = 1e-9;

enum { MOST_PLACES = 22 }; /* a higher power of ten is no double */

/* Reciprocal of the power of ten to which coordinates are rounded, so that they can be written with few digits. 0
   where they are not rounded: the power would be no exact double, or whole numbers are fine enough. */
static double decimal_unit(const qw_frame *frame)
{
    double least = frame->scale / LEAST_DIGIT, unit = 1;
    if (!(least > 0.1)) return 0;
    for (int places = 0; places < MOST_PLACES && unit < least; places++) unit *= 10;
    return unit >= least ? unit : 0;
}

/* Positions in the coordinates of the input. *flat: the index of a quad that has no area there, though its vertices
   were drawn apart, or QW_NONE. */
static double *positions_of_input(const qw_run_state *run, const qw_quadmesh *quads, uint32_t *flat)
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
    *flat = qw_settle_written(run->env, quads, decimal_unit(frame), output, &moved);
    if (run->rim && *flat == QW_NONE) *flat = qw_put_rims(run, quads, output);
    if (moved) qw_log(run->env, QW_LOG_DEBUG, "%u vertices were drawn apart, as quads had no area", moved);
    return output;
}

/* Sets run->finished and run->rim. */
static void join_all(finishing *f)
{
    qw_run_state *run = f->run;
    run->finished = qw_join_apart(run, &f->quads);
    run->rim = NULL;
    run->report->rim_vertices = run->report->rim_faces = 0;
    if (qw_keeps_rims(run)) run->finished = qw_fix_rims(run, &run->finished, &run->rim);
}

/* Sets run->finished and run->output. Where relaxation is off, quads may have no area; if moving single vertices
   apart does not cure that, all quads are relaxed all the same. */
static void write_positions(finishing *f)
{
    qw_run_state *run = f->run;
    uint32_t flat;
    join_all(f);
    run->output = positions_of_input(run, &run->finished, &flat);
    if (flat != QW_NONE && run->options.repair && !run->options.relax) {
        qw_warn(run, "quads had no area as they were: all were relaxed, though that was not asked for");
        f->quads = qw_relax(run, &f->quads, &f->flipped);
        join_all(f);
        run->output = positions_of_input(run, &run->finished, &flat);
    }
    if (flat != QW_NONE && run->options.repair)
        qw_fail(run->env, QW_INTERNAL, flat,
                "quad %u, of component %u, has no area in the coordinates that would be written, so the result is "
                "withheld",
                flat, run->finished.component[run->finished.corner[4 * (size_t)flat]]);
}

void qw_stage_FINISH(qw_run_state *run)
{
    finishing f = {run, run->relaxed, run->flipped};
    if (run->options.repair) {
        if (run->options.relax) {
            run->report->grown_protrusions = run->grown + qw_grow_protrusions(run, &f.quads, &f.flipped, true);
            repair_flips(&f);
            fit_to_surface(&f);
        }
        check_topology(&f);
    }
    write_positions(&f);
    qw_warn_of_rims(run);
    qw_join_left_out(run);
    qw_trimesh working = qw_parted_working(run);
    run->report->size_cv = qw_size_deviation(run->env, &f.quads, &working, run->size);
    qw_report_field_angle(run, &run->finished);
    qw_report_guides(run, &run->finished);
    qw_report_lost_edges(run, &f.quads);
}

/* The stage ASSEMBLE: the quads of the core and what was taken off before them become the whole. Components that were
   of small components, collars to the rims that stay, the reflection about the plane of symmetry, and the polygons that
   were left out are joined, in the coordinates of the input. */
#include "core/mirror.h"
#include "core/rims.h"
#include "core/small.h"
#include "stages/stages.h"

#include "base/promise.h"
#include "demand/directions.h"
#include "demand/guides.h"
#include "demand/sizes.h"
#include "math/elementary.h"
#include "quad/written.h"
#include "stages/coverage.h"

#include <math.h>
#include <stdio.h>

static const char OTHER_COUNT[] =
    "rows beside the plane of symmetry, and what is not reflected, lead to more or fewer quads than asked for";

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

/* Positions in the coordinates of the input of quads in the frame of a clean surface. *flat: the index of a quad that
   has no area there, though its vertices were drawn apart, or QW_NONE. */
static double *positions_of_input(const qw_run_state *run, const qw_clean *clean, const qw_quadmesh *quads,
                                  uint32_t *flat)
{
    const qw_frame *frame = &clean->frame;
    uint32_t moved;
    double *output = QW_NEW(run->env, double, (size_t)3 * quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        qw_place_in_input(clean, quads->position[v], output + 3 * (size_t)v);
    *flat = qw_settle_written(run->env, quads, decimal_unit(frame), output, &moved);
    if (moved) qw_log(run->env, QW_LOG_DEBUG, "%u vertices were drawn apart, as quads had no area", moved);
    return output;
}

/* The quads of the core with those of small components and, where it has a plane, their reflections. Sets
   run->finished, run->output and *flat. */
static void join_core(qw_run_state *run, const qw_quadmesh *core, uint32_t *flat)
{
    run->finished = qw_join_small(run, core);
    run->reflected = run->finished.face_count;
    if (run->mirror.is_used) {
        const uint8_t *sewn;
        qw_quadmesh quads = qw_split_at_cut(run, &run->finished, &sewn);
        const double *position = positions_of_input(run, &run->clean, &quads, flat);
        qw_reflect_core(run, &quads, sewn, position);
    }
}

/* Sets run->finished, run->rim and run->output. Returns a quad that has no area in the coordinates of the input, or
   QW_NONE. */
static uint32_t join_all(qw_run_state *run, const qw_quadmesh *core)
{
    uint32_t flat = QW_NONE;
    run->rim = NULL;
    run->report->rim_vertices = run->report->rim_faces = 0;
    join_core(run, core, &flat);
    if (!qw_keeps_rims(run)) {
        if (!run->mirror.is_used) run->output = positions_of_input(run, &run->whole.clean, &run->finished, &flat);
        return flat;
    }
    run->finished = qw_fix_rims(run, &run->finished, &run->rim);
    run->output = positions_of_input(run, &run->whole.clean, &run->finished, &flat);
    return flat == QW_NONE ? qw_put_rims(run, &run->finished, run->output) : flat;
}

/* Where relaxation is off, quads may have no area; if moving single vertices apart does not cure that, all quads are
   relaxed all the same. */
static void write_positions(qw_run_state *run)
{
    uint32_t flat = join_all(run, &run->fitted);
    if (flat != QW_NONE && run->options.repair && !run->options.relax) {
        uint8_t *flipped;
        qw_warn(run, "quads had no area as they were: all were relaxed, though that was not asked for");
        run->fitted = qw_relax(run, &run->fitted, &flipped);
        flat = join_all(run, &run->fitted);
    }
    if (flat != QW_NONE && run->mirror.is_used) run->sides_meet = 0;
    else if (flat != QW_NONE && run->options.repair)
        qw_fail(run->env, QW_INTERNAL, flat,
                "quad %u has no area in the coordinates that would be written, so the result is withheld", flat);
}

/* Rows that are split at the plane may lead to another count. */
static void warn_of_count(qw_run_state *run)
{
    double wanted = qw_faces_wanted(run, &run->options);
    if (run->mirror.is_used && !qw_is_near_count(wanted, run->finished.face_count, 1)) qw_warn(run, OTHER_COUNT);
}

/* Says how few quads would do, and what these leave out. */
static void report_what_is_lost(qw_run_state *run)
{
    qw_report *r = run->report;
    char text[sizeof r->warnings[0]];
    r->least_faces = (int64_t)qw_ceil(run->faces_needed * qw_times_used(run));
    r->lost_parts = qw_count_lost_parts(run, &run->fitted);
    if (r->faces_asked < r->least_faces) {
        snprintf(text, sizeof text,
                 "%lld quads are the fewest with all components, handles and holes; %lld were asked for",
                 (long long)r->least_faces, (long long)r->faces_asked);
        qw_warn_once(run, text);
    }
    if (r->lost_parts > 0) {
        snprintf(text, sizeof text, "%lld part%s that stick%s out %s lost in so few quads", (long long)r->lost_parts,
                 r->lost_parts == 1 ? "" : "s", r->lost_parts == 1 ? "s" : "", r->lost_parts == 1 ? "is" : "are");
        qw_warn_once(run, text);
    }
}

void qw_stage_ASSEMBLE(qw_run_state *run)
{
    write_positions(run);
    warn_of_count(run);
    report_what_is_lost(run);
    qw_warn_of_rims(run);
    qw_join_left_out(run);
    qw_report_field_angle(run, &run->finished);
    qw_report_guides(run, &run->fitted);
}

/* The stage ASSEMBLE: the quads of the core and what was taken off before them become the whole. Components that were
   of small components, collars to the rims that stay, the reflection about the plane of symmetry, and the polygons that
   were left out are joined, in the coordinates of the input. */
#include "whole/mirror.h"
#include "whole/output.h"
#include "whole/idle.h"
#include "whole/idle.h"
#include "whole/kept_rims.h"
#include "whole/small.h"
#include "run/stages/stages.h"

#include "base/mechanisms.h"
#include "base/promise.h"
#include "whole/directions.h"
#include "whole/guides.h"
#include "whole/sizes.h"
#include "base/elementary.h"
#include "run/stages/coverage.h"
#include "run/stages/designed.h"
#include "run/stages/other_side.h"
#include "run/stages/split_levels.h"

#include <assert.h>
#include <stdio.h>

static const char OTHER_COUNT[] =
    "rows beside the plane of symmetry, and what is not reflected, lead to more or fewer quads than asked for";

/* The quads of the core with those of small components and, where it has a plane, their reflections. Sets
   run->finished, run->output and *flat. */
static void join_core(qw_run_state *run, const qw_quadmesh *core, uint32_t *flat)
{
    run->finished = qw_join_small(run, core);
    run->sides_unlike = QW_SIDES_ALIKE;
    run->reflected = run->finished.face_count, run->source = NULL;
    assert(run->finished.face_count >= core->face_count);
    if (run->mirror.is_used) {
        const uint8_t *sewn;
        qw_quadmesh quads = qw_split_at_cut(run, &run->finished, &sewn);
        const double *position = qw_output_positions(run, &run->clean, &quads, flat), *own = NULL;
        bool suits = true;
        if (qw_sides_differ(run) && qw_uses(run->env, QW_MECH_OTHER_SIDE))
            own = qw_place_other_side(run, &quads, sewn, &suits);
        qw_did(run->env, QW_MECH_OTHER_SIDE, own != NULL);
        run->sides_unlike = suits ? QW_SIDES_ALIKE : QW_OTHER_SIDE_FARTHER;
        qw_reflect_core(run, &quads, sewn, position, own);
    }
}

/* Sets run->finished, run->rim and run->output. Returns a quad that has no area in the coordinates of the input, or
   QW_NONE. */
static uint32_t join_all(qw_run_state *run, const qw_quadmesh *core)
{
    uint32_t flat = QW_NONE;
    run->rim = NULL, run->rims_flipped = 0;
    run->report->rim_vertices = run->report->rim_faces = 0;
    join_core(run, core, &flat);
    bool has_rims = run->whole.steering->region || run->whole.census.boundary_loops > 0;
    /* what is withheld, or made anew, may have other rims */
    if (!qw_keeps_rims(run) || !has_rims || !run->sides_meet) {
        if (!run->mirror.is_used) run->output = qw_output_positions(run, &run->whole.clean, &run->finished, &flat);
        return flat;
    }
    run->finished = qw_fix_rims(run, &run->finished, &run->rim);
    run->output = qw_output_positions(run, &run->whole.clean, &run->finished, &flat);
    return flat == QW_NONE ? qw_put_rims(run, &run->finished, run->output) : flat;
}

static void write_positions(qw_run_state *run)
{
    uint32_t flat = join_all(run, &run->fitted);
    if (flat != QW_NONE && run->mirror.is_used) run->sides_meet = 0;
    else if (flat != QW_NONE && run->whole.steering->region && !run->plan.keeps_teeth) run->rims_flipped = 1;
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

/* Quads around what sticks out; its cap is the quad below it. */
static const double RING = 4;

/* Says how few quads would do, and what these leave out. */
static void report_what_is_lost(qw_run_state *run)
{
    qw_report *r = run->report;
    char text[sizeof r->warnings[0]];
    int64_t needed = (int64_t)qw_ceil(run->faces_needed * qw_times_used(run));
    r->least_faces = needed + (int64_t)qw_ceil(RING * run->tips.count * qw_times_used(run));
    r->lost_parts = qw_count_lost_parts(run, &run->fitted);
    if (r->faces_asked < needed) {
        snprintf(text, sizeof text,
                 "%lld quads are the fewest with all components, handles and holes; %lld were asked for",
                 (long long)needed, (long long)r->faces_asked);
        qw_warn_once(run, text);
    }
    if (r->lost_parts > 0) {
        snprintf(text, sizeof text, "%lld part%s that stick%s out %s lost in so few quads", (long long)r->lost_parts,
                 r->lost_parts == 1 ? "" : "s", r->lost_parts == 1 ? "s" : "", r->lost_parts == 1 ? "is" : "are");
        qw_warn_once(run, text);
    }
}

/* All that was taken off is put back, levels are split, and the result is reported on. */
void qw_stage_ASSEMBLE(qw_run_state *run)
{
    write_positions(run);
    warn_of_count(run);
    qw_warn_of_idle(run);
    report_what_is_lost(run);
    if (run->mirror.is_used && run->report->lost_parts > 0) run->sides_unlike = QW_PARTS_LOST;
    qw_warn_of_rims(run);
    if (!qw_fits_limit(run)) qw_make_exact(run, false, true);
    qw_make_levels(run);
    qw_join_left_out(run);
    if (run->finished.face_count == 0 && run->mirror.is_used) {
        run->sides_meet = 0; /* there may be some on the whole */
        return;
    }
    if (run->finished.face_count == 0) /* may be where few are asked for and nothing is repaired */
        qw_fail(run->env, QW_INTERNAL, -1, "no quads are left: ask for more, or for repair");
    qw_report_field_angle(run, &run->finished);
    qw_report_guides(run, &run->fitted);
}

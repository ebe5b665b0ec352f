/* The whole of Quadwright in order. A stage reads what earlier ones left in the state of the run (whole/state.h) and
 * writes its own part. After some of them the attempt is judged: the run goes on, with this attempt or with an earlier
 * one that was better, or it goes back with another plan, as run/retries.def has it. Sections and equations are the
 * paper's.
 */
#include "remesh.h"

#include "run/stages/stages.h"

/* Runs the next stage. Returns what it says; c->done is then the number of the stage to follow, which is an earlier one
   where the run goes back. */
static qw_status run_next(qw_context_state *c)
{
    switch ((qw_stage)c->done) {
        /* ---- the surface */

    case QW_STAGE_CLEAN: /* polygons, or a skin around them, become an oriented manifold surface */
        return qw_run_stage(c, qw_stage_CLEAN);
    case QW_STAGE_CORE: /* what is remeshed: all of it, or one side of a plane of symmetry */
        return qw_run_stage(c, qw_stage_CORE);
    case QW_STAGE_SURFACE: /* feature edges are marked; what is much finer than the quads is made coarser */
        return qw_run_stage(c, qw_stage_SURFACE);
        /* ---- the fields (Section 3.1) */

    case QW_STAGE_WORKING: /* sizes of the quads, and a working mesh of near-isotropic triangles (Section 3.2) */
        return qw_run_stage(c, qw_stage_WORKING);
    case QW_STAGE_HIERARCHY: /* coarser and coarser graphs of its vertices */
        return qw_run_stage(c, qw_stage_HIERARCHY);
    case QW_STAGE_ORIENTATION: /* a cross at each vertex, along the shape (Eq. 1) */
        return qw_run_stage(c, qw_stage_ORIENTATION);
    case QW_STAGE_SCALE: /* the wanted edge length at each vertex */ return qw_run_stage(c, qw_stage_SCALE);
    case QW_STAGE_POSITION: /* for the paper's flows: a lattice point at each vertex (Eq. 2) */
        return qw_run_stage(c, qw_stage_POSITION);
        /* ---- the integers (Sections 3.2 to 3.4) */

    case QW_STAGE_OFFSETS: /* how many quads each edge runs along and across (Definition 3.1) */
        return qw_run_stage(c, qw_stage_OFFSETS);
    case QW_STAGE_REGULAR: /* the same so that they close around every triangle (Eq. 3) */
        return qw_run_stage(c, qw_stage_REGULAR);
    case QW_STAGE_INVERSIONS: /* the same so that no triangle is inverted (Eq. 4) */
        return qw_run_judged_stage(c, qw_stage_INVERSIONS);
        /* ---- the quads (Sections 3.5 and 3.6) */

    case QW_STAGE_QUADS: /* zero edges are contracted, triangles paired */ return qw_run_stage(c, qw_stage_QUADS);
    case QW_STAGE_POSITIONS: /* vertex positions (Eq. 9) */ return qw_run_stage(c, qw_stage_POSITIONS);
    case QW_STAGE_REPAIR: /* what the promise forbids is repaired */
        /* back to WORKING if the topology is lost: with smaller quads there */
        return qw_run_judged_stage(c, qw_stage_REPAIR);
    case QW_STAGE_SIMPLIFY: /* needless irregular vertices are removed, the count is met */
        /* back to SCALE if it is not: with other sizes, or cones beside corners */
        return qw_run_judged_stage(c, qw_stage_SIMPLIFY);
    case QW_STAGE_RELAX: /* vertices slide on the surface until the quads are square */
        /* back to WORKING if parts are uncovered or quads flipped: smaller quads there */
        return qw_run_judged_stage(c, qw_stage_RELAX);
        /* ---- the result, of the attempt that was chosen */

    case QW_STAGE_FINISH: /* protrusions grow, flipped quads are repaired, quads are fitted to the surface */
        return qw_run_stage(c, qw_stage_FINISH);
    case QW_STAGE_ASSEMBLE: /* small components, the reflection and what was left out come back */
        /* back to WORKING if the sides do not meet, to CORE if they cannot */
        return qw_run_judged_stage(c, qw_stage_ASSEMBLE);

    case QW_STAGE_COUNT: break;
    }
    return QW_INTERNAL;
}

qw_status qw_remesh_until(qw_context_state *c, const qw_options *options, qw_stage last)
{
    qw_begin_drive(c, options, last);
    qw_status status = QW_OK;
    while (status == QW_OK && c->done <= (int)last) status = run_next(c);
    qw_end_drive(c, status);
    return status;
}

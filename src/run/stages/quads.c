/* The stages of the quads: what each takes from the run, calls and leaves in it. The work itself is in
 * src/remesh/quads and relax. */
#include "whole/mirror.h"
#include "base/mechanisms.h"
#include "run/stages/stages.h"

#include "base/promise.h"
#include "run/stages/coverage.h"
#include "remesh/offsets/embedding.h"
#include "remesh/quads/extract.h"
#include "remesh/relax/diagonals.h"
#include "remesh/quads/repair.h"
#include "remesh/quads/simplify.h"
#include "remesh/quads/topology.h"

#include <assert.h>
#include <string.h>

void qw_stage_QUADS(qw_run_state *run) { run->extraction = qw_extract_quads(run->env, &run->inversion_free); }

/* Relative residual to which vertex positions are solved; the second where they are only the start of relaxation. */
static const double EMBEDDED = 1e-4, ROUGHLY_EMBEDDED = 3e-2;

/* Least-squares positions of the quads' vertices. */
void qw_stage_POSITIONS(qw_run_state *run)
{
    assert(run->extraction.quads.face_count <= run->inversion_free.face_count);
    qw_embedding_counts c = {0};
    const qw_extraction *x = &run->extraction;
    run->embedded = x->quads;
    run->embedded.position = QW_NEW(run->env, qw_vec3, x->quads.vertex_count);
    qw_vec3 *position = qw_solve_embedding(run->env, &run->inversion_free, x->class_of,
                                           run->options.relax ? ROUGHLY_EMBEDDED : EMBEDDED, &c);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) run->embedded.position[v] = position[x->vertex_class[v]];
    qw_free(run->env, position);
    run->report->count_integers = run->embedded.face_count;
    run->report->least_squares_iterations = c.iterations;
    run->report->least_squares_residual = c.residual;
}

/* Share of the promised tolerance of the count that repairs may use up. */
static const double REPAIR_SHARE = 0.5;

/* Mends what the promise forbids, within a share of the count's tolerance. */
void qw_stage_REPAIR(qw_run_state *run)
{
    qw_repair_counts c = {0};
    int64_t most =
        (int64_t)(run->faces_wanted * (1 + REPAIR_SHARE * qw_count_tolerance(run->faces_wanted, qw_times_used(run))));
    run->repaired = run->options.repair ? qw_repair_quads(run->env, &run->embedded, most - run->embedded.face_count, &c)
                                        : run->embedded;
    run->topology_kept = qw_check_topology(run->env, &run->repaired, &run->working.mesh).broken_count == 0;
    run->report->repaired_doublets = c.doublets;
    run->report->count_repaired = (int64_t)run->repaired.face_count - run->embedded.face_count;
}

/* Rebuilds components that lost their topology from their triangles. */
static qw_quadmesh rebuild_broken(qw_run_state *run)
{
    if (run->topology_kept || !qw_uses(run->env, QW_MECH_REBUILT)) return run->repaired;
    qw_did(run->env, QW_MECH_REBUILT, 1);
    qw_topology_check check = qw_check_topology(run->env, &run->repaired, &run->working.mesh);
    run->report->fallback_components = check.broken_count;
    qw_warn(run,
            "the fields alone would have lost the topology of a component: it has more irregular vertices where it "
            "was kept");
    return qw_replace_components(run->env, &run->repaired, &run->inversion_free, &run->extraction,
                                 run->embedded.position, &check)
        .quads;
}

/* Rebuilds components that have lost their topology, and removes needless irregularity. */
void qw_stage_SIMPLIFY(qw_run_state *run)
{
    qw_simplify_counts moves = {0};
    int64_t least =
        (int64_t)(run->faces_wanted * (1 - REPAIR_SHARE * qw_count_tolerance(run->faces_wanted, qw_times_used(run))));
    run->simplified = run->repaired;
    qw_report *r = run->report;
    r->fallback_components = r->count_rebuilt = r->count_simplified = r->count_cut = 0;
    if (run->options.repair) {
        qw_quadmesh whole = rebuild_broken(run);
        run->simplified = qw_simplify_quads(run->env, &whole, NULL, least, INT64_MAX, false, &moves);
        r->count_rebuilt = (int64_t)whole.face_count - run->repaired.face_count;
        r->count_simplified = (int64_t)run->simplified.face_count - whole.face_count;
        const uint8_t *sewn;
        if (run->mirror.is_used) run->simplified = qw_split_at_cut(run, &run->simplified, &sewn);
        r->count_cut = (int64_t)run->simplified.face_count - whole.face_count - r->count_simplified;
    }
    r->repaired_pairs = moves.collapses + moves.rotations;
}

/* Fits the count, relaxes the quads, and grows protrusions that they do not cover. */
void qw_stage_RELAX(qw_run_state *run)
{
    qw_report *r = run->report;
    r->count_chords_removed = r->count_quads_removed = r->count_added = 0;
    qw_quadmesh quads = run->options.repair ? qw_fit_count(run, &run->simplified) : run->simplified;
    run->grown = 0, run->lacking = 0, run->relaxed_covers = 0, run->working_tree = NULL;
    if (run->options.relax) {
        qw_trimesh working = qw_parted_working(run);
        run->working_tree = qw_bvh_build(run->env, &working);
        run->relaxed = qw_relax(run, &quads, NULL, &run->flipped);
        if (run->options.repair && !run->lacks_room && qw_uses(run->env, QW_MECH_GROWN))
            run->grown = qw_grow_protrusions(run, &run->relaxed, &run->flipped, false);
        qw_did(run->env, QW_MECH_GROWN, run->grown);
        if (run->plan.reserve > 0) {
            qw_use_up_reserve(run, &run->relaxed, &run->flipped);
            run->relaxed_covers = 0;
        }
    } else {
        run->relaxed = quads;
        run->flipped = QW_NEW_ZERO(run->env, uint8_t, quads.face_count);
    }
    r->grown_protrusions = run->grown;
    r->count_grown = (int64_t)run->relaxed.face_count - quads.face_count;
}

/* The stage FINISH: what is done once, to the attempt that was chosen. Uncovered protrusions with sharp edges grow,
   vertices move nearer to the surface, and a result whose topology differs from the surface's is refused. */
#include "run/stages/stages.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "base/promise.h"
#include "whole/cut.h"
#include "whole/mirror.h"
#include "whole/wrapped.h"
#include "run/stages/split_levels.h"
#include "run/stages/coverage.h"
#include "remesh/relax/fit.h"
#include "remesh/quads/topology.h"
#include "remesh/quads/wanted.h"
#include "products/wrap/wrap_target.h"

#include <assert.h>

/* The quads during the stage. */
typedef struct finishing {
    qw_run_state *run;
    qw_quadmesh quads;
    uint8_t *flipped; /* uint8_t[quads.face_count], as of qw_run_state */
} finishing;

/* ---- nearer to the surface */

/* Moves vertices off the surface so that the quads lie nearer to it, unless another stage does so later. */
static void fit_to_surface(finishing *f)
{
    const qw_run_state *run = f->run;
    if (run->options.fit == 0 || f->quads.face_count == 0) return;
    if (run->options.fit_to == QW_FIT_TO_LIMIT) return; /* from where they are now: run/stages/split_levels.h */
    double *cut = qw_cuts_in_frame(run);
    qw_fit fit = {.tree = run->tree, .strength = (float)run->options.fit, .cut = cut, .cuts = run->input.cuts};
    if (run->mirror.own) fit.planes = qw_planes_of_quads(run, &f->quads);
    qw_trimesh seen;
    fit.target = (qw_fit_target){.surface = run->tree,
                                 .tree = qw_seen_of_input(f->run, &seen),
                                 .reach = (float)QW_WRAP_NEAR * run->whole.clean.wrapped,
                                 .off = (float)QW_WRAP_OFF * run->whole.clean.wrapped};
    qw_fit_quads(run->env, &f->quads, &fit);
    qw_free(run->env, cut);
}

/* ---- what leaves */

/* Where a plane of symmetry is used, more quads or no plane may help: run/retries.def. */
static void check_topology(const finishing *f)
{
    qw_topology_check check = qw_check_topology(f->run->env, &f->quads, &f->run->working.mesh);
    f->run->sides_meet = check.broken_count == 0 && f->quads.face_count > 0;
    if (!f->run->sides_meet && !f->run->mirror.is_used)
        qw_fail(f->run->env, QW_INTERNAL, -1,
                "%u of %u components did not keep their topology, so the result is withheld", check.broken_count,
                check.component_count);
}

/* Finishes the attempt that was chosen: protrusions, fit, topology. */
void qw_stage_FINISH(qw_run_state *run)
{
    assert(run->relaxed.face_count == 0 || run->flipped);
    finishing f = {run, run->relaxed, run->flipped};
    run->sides_meet = 1;
    if (run->options.repair) {
        if (run->options.relax) {
            uint32_t sharp = qw_uses(run->env, QW_MECH_GROWN_SHARP)
                                 ? qw_grow_protrusions(run, &f.quads, &f.flipped, true)
                                 : 0;
            qw_did(run->env, QW_MECH_GROWN_SHARP, sharp);
            run->report->grown_protrusions = run->grown + sharp;
            fit_to_surface(&f);
        }
        check_topology(&f);
    }
    run->fitted = f.quads;
    run->report->count_finished = (int64_t)f.quads.face_count - run->relaxed.face_count;
    qw_trimesh working = qw_parted_working(run);
    qw_size_fit sizes = qw_fit_of_sizes(run->env, &f.quads, &(qw_wanted){&working, run->size, run->working_tree, NULL});
    run->report->size_cv = sizes.deviation, run->report->long_share = sizes.long_share;
    qw_report_lost_edges(run, &f.quads);
    qw_report_edges_around(run, &f.quads);
}

/* The stages of the fields and of the integers: what each takes from the run, calls and leaves in it. The work itself
 * is in src/remesh/field, offsets, quantise and meetings.
 */
#include "base/mechanisms.h"
#include "run/stages/stages.h"

#include "base/constants.h"
#include "base/promise.h"
#include "remesh/field/alignment.h"
#include "remesh/field/girth.h"
#include "remesh/field/curvature_diffusion.h"
#include "remesh/field/plane_directions.h"
#include "paper/multiresolution.h"
#include "paper/position.h"
#include "remesh/sizes/scale.h"
#include "remesh/quantise/quantise.h"
#include "remesh/quantise/regular.h"
#include "remesh/offsets/subdivide.h"
#include "remesh/offsets/inversions.h"
#include "whole/cut.h"
#include "whole/sizes.h"
#include "whole/directions.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Radius of curvature diffusion, in edge lengths of the quads for a smoothness of 1: docs/dev/decisions/orientation.md.
 */
static const double CURVATURE_RADIUS = 0.8;
/* Above this share of squeezed triangles cones leave the quads no room; real meshes have a tenth at most. */
static const double MUCH_SQUEEZED = 0.25;
/* Offsets of a larger mean length, in lattice steps, have run away: working edges are 1.25 times as long as those of
   the quads at most, and half as long in the mean. */
static const double MEAN_OFFSET = 2;

/* Rows are let end where the logarithms of their widths differ by this, as a root of a mean square, and where that
   makes it less than this share; on surfaces of so many cones at most. */
static const double MOST_WIDE = 0.25, LESS_WIDE = 0.88;
enum { FEW_CONES = 24 };
/* See lessen: a tenth is a slope of 6 degrees. */
static const float TILTS[] = {0.1f, 0.02f, 0.005f};

/* Directions that the caller asks for take the place of those of the shape, which may be NULL. */
static qw_vec3 *with_asked(qw_env *env, qw_vec3 *of_shape, const qw_vec3 *asked, uint32_t count)
{
    qw_vec3 *direction = of_shape ? of_shape : QW_NEW_ZERO(env, qw_vec3, count);
    for (uint32_t v = 0; v < count; v++)
        if (qw_length2(asked[v]) > 0) direction[v] = asked[v];
    return direction;
}

static void free_hierarchy(qw_env *env, qw_hierarchy *h)
{
    qw_hierarchy_free(env, h);
    qw_free(env, h);
}

/* Triangles around which the crosses turn by a quarter or more. */
static uint32_t count_cones(const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *orientation)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < mesh->face_count; f++) {
        unsigned turns = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t u = mesh->corner[h], v = mesh->corner[qw_next(h)];
            qw_match m = qw_match_crosses(orientation[u], normal[u], orientation[v], normal[v]);
            turns += m.kv + 4u - m.ku;
        }
        count += (turns & 3u) != 0;
    }
    return count;
}

/* The directions count for less where rows that follow them get wider or narrower: `tilt` is by how much of their way
   there they do, as seen from the axis that the surface goes around, when they count half. */
static qw_vec3 *lessen(const qw_run_state *run, const float *slope, float tilt)
{
    uint32_t n = run->working.mesh.vertex_count;
    qw_vec3 *less = QW_NEW(run->env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++) {
        float bend = fmaxf(qw_length(run->alignment[v]), QW_LEAST_BEND), /* about the curvature, in 1 / rho */
            t = slope[v] * (float)run->rho / (tilt * bend);
        less[v] = qw_scale(run->alignment[v], 1 / (1 + t * t));
    }
    return less;
}

/* Along the lines of a turned part all rows run into its neck. Where a field of few cones has rows of very different
   width for that, other ones are tried that follow the shape less where its girth changes, so that rows may end there.
   Surfaces of many cones have them where they need them; around handles rows come home only if they follow the shape.
 */
static void let_rows_end(qw_run_state *run, const qw_hierarchy *hierarchy, const float *turn, const qw_vec3 *asked)
{
    qw_env *env = run->env;
    const qw_trimesh *mesh = &run->working.mesh;
    uint32_t cones = count_cones(mesh, run->normal, run->orientation);
    const qw_census *whole = &run->whole.census;
    bool has_handles = whole->components > (whole->euler + whole->boundary_loops) / 2;
    if (!run->alignment || asked || has_handles || cones > FEW_CONES || !qw_uses(env, QW_MECH_ROWS_END)) return;
    float *slope = QW_NEW(env, float, mesh->vertex_count), *other = QW_NEW(env, float, mesh->vertex_count);
    const float *size = run->working.target;
    double spread = qw_girth_spread(env, mesh, run->normal, run->orientation, size, slope), least = LESS_WIDE * spread;
    qw_vec3 *orientation = run->orientation, *alignment = run->alignment;
    for (size_t i = 0; i < sizeof TILTS / sizeof *TILTS && spread > MOST_WIDE; i++) {
        qw_vec3 *less = lessen(run, slope, TILTS[i]);
        qw_vec3 *o = qw_orientation_field(env, hierarchy, turn, less, (float)run->options.follow, NULL,
                                          (uint64_t)run->options.seed);
        double now = qw_girth_spread(env, mesh, run->normal, o, size, other);
        qw_log(env, QW_LOG_DEBUG, "width of rows: %.3f, with less of the shape %.3f", spread, now);
        qw_acted(env, QW_MECH_ROWS_END, 1);
        if (now < least && count_cones(mesh, run->normal, o) >= cones) least = now, orientation = o, alignment = less;
    }
    qw_kept(env, QW_MECH_ROWS_END, orientation != run->orientation);
    run->orientation = orientation, run->alignment = alignment;
    qw_free(env, slope), qw_free(env, other);
}

/* The cross at each vertex, by diffused curvature, along the surface and what was asked for. */
void qw_stage_ORIENTATION(qw_run_state *run)
{
    qw_env *env = run->env;
    qw_hierarchy *hierarchy = run->hierarchy ? run->hierarchy : qw_build_hierarchy(run);
    const qw_trimesh *mesh = &run->working.mesh;
    qw_resolution_request resolution = qw_resolution_of(run);
    float *radius = QW_NEW(env, float, mesh->vertex_count),
          edges = (float)(CURVATURE_RADIUS * qw_smoothness(&resolution) * qw_working_edges(&resolution));
    for (uint32_t v = 0; v < mesh->vertex_count; v++) radius[v] = edges * run->working.target[v] * run->smoothed[v];
    float *turn = NULL;
    if (qw_uses(env, QW_MECH_CURVATURE_DIFFUSION))
        turn = qw_diffuse_curvature(env, mesh, &hierarchy->level[0], radius,
                                    qw_has_density(run) ? run->working.target : NULL);
    qw_did(env, QW_MECH_CURVATURE_DIFFUSION, turn != NULL);
    run->alignment = NULL;
    if (run->options.follow > 0)
        run->alignment = qw_principal_directions(env, &run->surface, run->rho, mesh->position, run->normal,
                                                 mesh->vertex_count);
    if (run->alignment && qw_uses(env, QW_MECH_PLANES)) {
        uint8_t *cut = run->mirror.is_used ? qw_find_cuts(run, mesh) : NULL;
        qw_direct_rings(env, mesh, cut, run->normal, run->alignment);
        qw_free(env, cut);
    }
    qw_vec3 *asked = qw_directions_asked(run);
    if (asked) run->alignment = with_asked(env, run->alignment, asked, mesh->vertex_count);
    run->orientation = qw_orientation_field(env, hierarchy, turn, run->alignment, (float)run->options.follow, asked,
                                            (uint64_t)run->options.seed);
    let_rows_end(run, hierarchy, turn, asked);
    if (run->alignment && qw_uses(env, QW_MECH_PLANES))
        qw_direct_planes(env, mesh, run->normal, run->orientation, run->alignment);
    qw_free(env, asked), qw_free(env, turn), qw_free(env, radius);
    free_hierarchy(env, hierarchy);
    run->hierarchy = NULL;
}

void qw_stage_SCALE(qw_run_state *run)
{
    const qw_trimesh *mesh = &run->working.mesh;
    float *size = QW_NEW(run->env, float, mesh->vertex_count);
    qw_resolution_request resolution = qw_resolution_of(run);
    float edges = (float)qw_working_edges(&resolution);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) size[v] = run->working.target[v] * edges;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) size[v] *= (float)run->plan.size_factor;
    run->size = size;
}

void qw_stage_POSITION(qw_run_state *run)
{
    if (qw_is_closed_flow(&run->options)) {
        run->lattice = run->working.mesh.position;
        return;
    }
    qw_hierarchy *hierarchy = qw_build_hierarchy(run);
    run->lattice = qw_position_field(run->env, hierarchy, run->orientation, run->size);
    free_hierarchy(run->env, hierarchy);
}

/* Integers on edges, out of crosses and, in the paper's flow, lattice points. */
void qw_stage_OFFSETS(qw_run_state *run)
{
    qw_vec3 *lattice = qw_is_closed_flow(&run->options) ? NULL : run->lattice;
    qw_offset_input in = {&run->working.mesh,
                          run->normal,
                          lattice,
                          run->orientation,
                          run->size,
                          run->constraint,
                          run->direction,
                          run->nested,
                          run->options.align_boundary != 0,
                          qw_is_closed_flow(&run->options)};
    run->offsets = qw_integer_offsets(run->env, &in);
    qw_offset_counts c = qw_offset_count(&run->offsets);
    run->report->orientation_singularities = c.singular_vertices;
    run->report->position_singularities_before = c.irregular_triangles;
}

/* Whether the offsets have run away: working edges are hardly longer than those of the quads, so meaningful offsets
   are a few units long. Cutting longer ones into units would take memory and time without bound. */
static bool has_run_away(const qw_offset_mesh *m)
{
    double sum = 0;
    for (uint32_t e = 0; e < m->edge_count; e++) sum += qw_int2_norm(m->d[e]);
    return sum > MEAN_OFFSET * m->edge_count;
}

/* Of the count, what has to fit with the edge length for the count to be asked for: less means that the edge length was
 * raised. */
static const double FITS = 0.99;

/* Curves that lay on lattice lines before the offsets were regular, and do so no more. */
static void judge_bent_curves(qw_run_state *run)
{
    for (uint32_t h = 0; h < 3 * run->regular.face_count; h++) {
        uint32_t e = run->regular.edge[h];
        if (run->offsets.fixed[e] && !run->regular.fixed[e] && run->curve_outcome[h] == QW_CURVE_KEPT)
            run->curve_outcome[h] = QW_CURVE_UNBALANCED;
    }
}

/* Offsets that close around each triangle; says too whether there is less room than cones need. */
void qw_stage_REGULAR(qw_run_state *run)
{
    run->regular = qw_offset_branch(run->env, &run->offsets);
    assert(run->regular.face_count == run->working.mesh.face_count); /* not yet subdivided */
    run->curve_outcome = QW_NEW(run->env, uint8_t, 3 * (size_t)run->regular.face_count);
    memcpy(run->curve_outcome, run->curve_verdict, 3 * (size_t)run->regular.face_count);
    qw_regular_counts c;
    run->lacks_room = 0;
    if (qw_is_closed_flow(&run->options)) {
        /* where rho was raised, as the component is long and thin, fewer quads fit; repairs make up for the others */
        double fit = qw_in_quads(run, run->core.area),
               wanted = fit < FITS * run->faces_wanted ? fmax(fit, 1) : run->faces_wanted;
        qw_quantise_request request = {.quads = wanted / (run->plan.size_factor * run->plan.size_factor),
                                       .times = qw_times_used(run),
                                       .loops = run->options.loops,
                                       .follow = run->options.follow,
                                       .verdict = run->curve_outcome};
        qw_quantise_counts counts = qw_quantise(run->env, &run->regular, &request);
        c = counts.regular;
        run->lacks_room = counts.decimated_faces > QW_MOST_DECIMATED * request.quads
                              ? 2
                              : counts.decimated_faces > request.quads || counts.squeezed > MUCH_SQUEEZED;
        if (run->lacks_room && !qw_uses(run->env, QW_MECH_LACKS_ROOM)) run->lacks_room = 0;
        qw_did(run->env, QW_MECH_LACKS_ROOM, run->lacks_room > 0);
    } else {
        c = qw_make_regular(run->env, &run->regular, (qw_flow_choice)run->options.flow,
                            (qw_cost_kind)run->options.cost);
    }
    judge_bent_curves(run);
    qw_report_curves(run);
    qw_report *r = run->report;
    r->network_nodes = c.nodes, r->network_arcs = c.arcs, r->network_components = c.network_components;
    r->fixed_variables = c.fixed_variables, r->free_variables = c.free_variables,
    r->capacity_rounds = c.capacity_rounds;
    r->flow_cost = c.cost;
    r->position_singularities_after = run->irregular = qw_offset_count(&run->regular).irregular_triangles;
}

/* Splits long edges and removes inverted triangles, by single moves first, then by SAT. */
void qw_stage_INVERSIONS(qw_run_state *run)
{
    run->inversion_free = qw_offset_copy(run->env, &run->regular);
    qw_report *r = run->report;
    r->sat_calls = r->sat_conflicts = 0;
    if (qw_uses(run->env, QW_MECH_RUNAWAY) && has_run_away(&run->inversion_free)) { /* such offsets cannot be
                                                 contracted: components are rebuilt */
        qw_did(run->env, QW_MECH_RUNAWAY, 1);
        r->subdivided_edges = 0;
        r->inverted_before = r->inverted_after_greedy = r->inverted_after_sat = run->inverted =
            run->inversion_free.face_count;
        return;
    }
    r->subdivided_edges = qw_subdivide_long_edges(run->env, &run->inversion_free);
    qw_inversion_counts c = {0};
    qw_remove_inversions_greedy(run->env, &run->inversion_free, &c);
    if (run->options.sat)
        qw_remove_inversions_sat(run->env, &run->inversion_free, run->lacks_room > 1 ? QW_SAT_NEAR : QW_SAT_FAR, &c);
    r->inverted_before = c.inverted_before, r->inverted_after_greedy = c.inverted_after_greedy,
    r->inverted_after_sat = run->inverted = c.inverted_after;
    r->sat_calls = c.sat_calls, r->sat_conflicts = c.sat_conflicts;
    qw_log(run->env, QW_LOG_DEBUG, "inverted triangles: %lld, after single moves %lld, in the end %lld",
           (long long)c.inverted_before, (long long)c.inverted_after_greedy, (long long)c.inverted_after);
}

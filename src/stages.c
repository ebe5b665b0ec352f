/* What each stage takes from the run, calls and leaves in it. The work itself is in the stages' own folders. */
#include "apart.h"
#include "sizes.h"

#include "field/evening.h"
#include "field/loops.h"
#include "field/position.h"
#include "field/scale.h"
#include "integer/places.h"
#include "integer/quantise.h"
#include "integer/regular.h"
#include "integer/subdivide.h"
#include "integer/unwind.h"
#include "integer/upright.h"
#include "math/elementary.h"
#include "mesh/curves.h"
#include "quad/count.h"
#include "quad/limbs.h"
#include "quad/fold.h"
#include "quad/mend.h"
#include "quad/reach.h"
#include "quad/relax.h"
#include "quad/repair.h"
#include "quad/simplify.h"
#include "quad/topology.h"
#include "quad/untangle.h"
#include "quad/written.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double PI = 3.14159265358979323846;
/* The surface is prepared for the next half power of ten of faces, so that it serves other counts as well: 1,000,
 * 3,162, 10,000. */
static const double SURFACE_STEP = 3.16227766016838;
/* One of more than DENSE times as many triangles as it would have with edges of CONDENSED times those of the quads is
 * made as coarse as that. */
static const float CONDENSED = 0.25f;
static const double DENSE = 1.5, EQUILATERAL = 0.4330127; /* area of an equilateral triangle of edge 1 */
/* Edges of the working mesh an edge of the quads: see docs/decisions/working-mesh.md. */
static const double WORKING_EDGES_FEW = 2.5, WORKING_EDGES_SHARP = 1.6;
static const double FEW_QUADS = 250, QUADS = 1000, MANY_QUADS = 10000;
/* And at QUADS and MANY_QUADS, on a surface without sharp edges and on one with as many as a machined part. */
static const double WORKING_EDGES_SMOOTH[2] = {1.1, 0.8}, WORKING_EDGES_PART[2] = {1.2, 1.0};
/* The detail (run.h) of a part, and that from which on sharp edges are everywhere. The way around a handle or a hole
 * counts as so many edges of the quads that are sharp. */
static const double PART = 0.03, SHARP = 0.1, LOOP = 4;
static const double SMOOTHNESS_FEW = 0.75; /* of what is asked for */
/* Radii over which normals are smoothed and curvature is evened out, in the smoothness asked for: see
 * docs/decisions/orientation.md. */
static const double NORMAL_RADIUS = 0.75, CURVATURE_RADIUS = 0.8;
/* A curve that turns by more than this at a vertex has a corner there. */
static const double CORNER_ANGLE = 40.0 * 3.14159265358979323846 / 180.0;
/* And between the points of the curve so many edges of the quads to both sides: what is smaller has no room for a
 * corner. */
static const float CORNER_SPAN = 0.7f;

/* The share of squeezed triangles from which on the skeleton says little about a stiffer surface's; real meshes have a
 * tenth at most. */
static const double MUCH_SQUEEZED = 0.25;

/* Mean length of the offsets from which on they have run away. */
static const double MEAN_OFFSET = 8;

/* Where topology was lost the quads are made smaller, within so many of their sizes, so often. */
static const float REFINE_RADIUS = 3.0f;
enum { REFINE_ATTEMPTS = 1, RELEASE_RINGS = 5 };
/* A point further than this from every quad, in mean edge lengths, stands for a part that was lost; the rounds halve
   the size and more. Where the working mesh has more than REACH_VERTICES, or more than REACH_QUADS quads are asked for,
   a second one is only for as many quads as a limb has, and there is no third. */
static const float REACH = 1.5f;
static const double LOST_LIMB = 6, REACH_QUADS = 8000;
/* Of what is not reached so much (quads) may be left: a tip, as thin as a hair if it is long. */
static const double LOST_TIP = 0.25;
/* Limbs grow so often, each time by at most this share of the quads. */
static const double LIMB_SHARE = 0.3;
enum { LIMB_PASSES = 2 };
enum { REACH_ATTEMPTS = 3, REACH_ATTEMPTS_FEW = 4, REACH_ATTEMPTS_LARGE = 2, REACH_VERTICES = 12000 };

static void warn(qw_run_state *run, const char *text)
{
    qw_report *r = run->report;
    if (r->warning_count < sizeof r->warnings / sizeof *r->warnings) {
        snprintf(r->warnings[r->warning_count], sizeof r->warnings[0], "%s", text);
        r->warning_count++;
    }
    qw_log(run->env, QW_LOG_WARNING, "%s", text);
}

/* 0 where there are few quads, 1 from many on. */
static double above_few(const qw_run_state *run)
{
    return fmin(fmax(qw_ln(run->faces_wanted / FEW_QUADS) / qw_ln(QUADS / FEW_QUADS), 0), 1);
}

/* Likewise from QUADS to MANY_QUADS. */
static double up_to_many(const qw_run_state *run)
{
    return fmin(fmax(qw_ln(run->faces_wanted / QUADS) / qw_ln(MANY_QUADS / QUADS), 0), 1);
}

static double between(double from, double to, double t) { return from + (to - from) * t; }

/* Where there are few quads a limb is a few edges of the working mesh around: a finer one costs little there. Between
   sharp edges a strip is but a few edges wide at any count; where there are none, what the field has to follow is
   smoother the more quads there are. */
static double working_edges(const qw_run_state *run)
{
    double many = up_to_many(run);
    double smooth = between(WORKING_EDGES_SMOOTH[0], WORKING_EDGES_SMOOTH[1], many),
           part = between(WORKING_EDGES_PART[0], WORKING_EDGES_PART[1], many);
    double sharp = between(part, WORKING_EDGES_SHARP, fmin(run->detail / SHARP, 1));
    return between(WORKING_EDGES_FEW, between(smooth, sharp, fmin(run->detail / PART, 1)), above_few(run));
}

/* And normals smoothed over as many edges of the quads as elsewhere would know nothing of it. */
static double smoothness(const qw_run_state *run)
{
    return run->options.smoothness * (SMOOTHNESS_FEW + (1 - SMOOTHNESS_FEW) * above_few(run));
}

static double marked_length(const qw_trimesh *s)
{
    double sum = 0;
    for (uint32_t h = 0; s->mark && h < 3 * s->face_count; h++)
        if (s->mark[h]) sum += (double)qw_distance(s->position[s->corner[h]], s->position[s->corner[qw_next(h)]]) / 2;
    return sum;
}

static uint32_t open_components(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    uint8_t *is_open = QW_NEW_ZERO(env, uint8_t, (size_t)census->components);
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (mesh->twin[h] == QW_NONE && !is_open[census->component[h / 3]])
            is_open[census->component[h / 3]] = 1, count++;
    qw_free(env, is_open);
    return count;
}

/* Two ways around each handle, and one around each hole but for a component's first. */
static double loops_of(qw_env *env, const qw_trimesh *mesh, const qw_census *census)
{
    int64_t handles = census->components - (census->euler + census->boundary_loops) / 2;
    double holes = census->boundary_loops > 0 ? (double)census->boundary_loops - open_components(env, mesh, census) : 0;
    return 2 * fmax((double)handles, 0) + holes;
}

void qw_stage_CLEAN(qw_run_state *run)
{
    run->clean = qw_clean_surface(run->env, run->input, run->options.min_component);
    const qw_trimesh *mesh = &run->clean.mesh;
    const qw_clean_counts *c = &run->clean.counts;
    const qw_census *census = &run->clean_census;
    run->clean_census = qw_trimesh_census_of(run->env, mesh, run->clean.component, run->clean.components);
    run->area = qw_trimesh_area(mesh);
    run->extent = qw_total_extent(run->env, mesh, census);
    run->faces_needed = qw_faces_needed(run->env, mesh, census);
    qw_report *r = run->report;
    r->input_vertices = run->input->vertex_count, r->input_faces = run->input->face_count,
    r->input_triangles = c->triangles;
    r->welded_vertices = c->welded_vertices, r->dropped_degenerate = c->dropped_degenerate,
    r->dropped_duplicate = c->dropped_duplicate;
    r->dropped_isolated = c->dropped_isolated, r->dropped_components = c->dropped_components + c->dropped_flat,
    r->flipped_triangles = c->flipped_triangles, r->split_edges = c->split_edges;
    r->split_vertices = c->split_vertices, r->one_sided_seam_edges = c->one_sided_seam_edges,
    r->unfolded_vertices = c->unfolded_vertices;
    r->components = census->components, r->boundary_loops = census->boundary_loops, r->euler = census->euler;
    if (c->split_edges) warn(run, "edges with more than two faces were parted into sheets");
    if (c->dropped_flat) {
        char text[sizeof r->warnings[0]];
        snprintf(text, sizeof text,
                 "%lld components without an area were dropped, as their coordinates give them none: that of face %u",
                 (long long)c->dropped_flat, c->first_flat);
        warn(run, text);
    }
    if (c->one_sided_seam_edges) warn(run, "a one-sided part was cut open along a seam");
}

double qw_surface_faces(const qw_run_state *run, const qw_options *options)
{
    double least = qw_faces_wanted(run, options) * (1 - 1e-9), faces = 1;
    while (faces < least) faces *= SURFACE_STEP;
    return faces;
}

/* Marks the sharp edges. Where those above the angle that was asked for, as of noise, are longer than all edges of the
   quads together they cannot be kept, and what is tried all the same gets torn. */
static void mark_features(qw_run_state *run, double rho)
{
    double asked = run->options.sharp_angle, used = 0,
           count = fmax(qw_faces_of_rest(run, run->surface_faces), run->apart.needed);
    float speck = (float)fmin(rho, sqrt(run->apart.area / count)); /* there are as many as are needed */
    qw_report *r = run->report;
    if (run->options.sharp_marks) {
        r->feature_edges = qw_take_marks(run->env, run->input, &run->clean.frame, &run->surface);
    } else {
        r->feature_edges = qw_find_features(run->env, &run->surface, asked < 0 ? -1.0 : asked * PI / 180.0, speck,
                                            &used);
        if (asked >= 0 && marked_length(&run->surface) > 2 * run->apart.area / rho) {
            qw_free(run->env, run->surface.mark);
            r->feature_edges = qw_find_features(run->env, &run->surface, -1.0, speck, &used);
            warn(run, "so few quads have no room for all edges of that angle: a suitable one was found instead");
        }
    }
    r->sharp_angle = used * 180.0 / PI;
}

/* So many equilateral triangles would cover the surface, of the edge length given at its vertices. */
static double room_for(const qw_trimesh *s, const float *length)
{
    double room = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *c = s->corner + 3 * (size_t)f;
        double l = (length[c[0]] + length[c[1]] + length[c[2]]) / 3.0;
        room += 0.5 * qw_length(qw_face_cross(s, f)) / (EQUILATERAL * l * l);
    }
    return room;
}

/* A surface much finer than the quads is made coarser once, so that what follows, and runs for other counts, have less
 * to look at. */
static void condense(qw_run_state *run, double rho)
{
    qw_env *env = run->env;
    qw_trimesh *s = &run->surface;
    if (s->face_count <= DENSE * run->apart.area / (EQUILATERAL * CONDENSED * CONDENSED * rho * rho)) return;
    qw_scope_begin(env);
    float *plain, *length = qw_wanted_size(run, rho, &plain);
    for (uint32_t v = 0; v < s->vertex_count; v++) length[v] *= CONDENSED;
    if (s->face_count > DENSE * room_for(s, length)) {
        qw_log(env, QW_LOG_DEBUG, "condensed from %u triangles", s->face_count);
        uint8_t *mark = s->mark; /* the rest is the clean surface's, which stays */
        *s = qw_condensed_mesh(env, s, &run->surface_census, length);
        run->surface_census = qw_trimesh_census(env, s);
        qw_free(env, mark);
        qw_keep(env, s->position), qw_keep(env, s->corner), qw_keep(env, s->twin), qw_keep(env, s->mark);
        qw_keep(env, run->surface_census.component);
    }
    qw_scope_end(env);
}

void qw_stage_SURFACE(qw_run_state *run)
{
    run->rounds = qw_rounds_begin(run->env);
    run->surface_faces = qw_surface_faces(run, &run->options);
    qw_set_apart(run);
    run->surface = run->apart.rest;
    run->surface_census = run->apart.census;
    double rho = qw_edge_wanted(run, qw_faces_of_rest(run, run->surface_faces));
    mark_features(run, rho);
    condense(run, rho);
}

void qw_stage_WORKING(qw_run_state *run)
{
    qw_env *env = run->env;
    double faces = qw_faces_wanted(run, &run->options);
    run->faces_wanted = qw_faces_of_rest(run, faces);
    run->rho = qw_edge_wanted(run, run->faces_wanted);
    run->detail =
        (marked_length(&run->surface) + LOOP * loops_of(env, &run->apart.rest, &run->apart.census) * run->rho) *
        run->rho / run->apart.area;
    run->report->faces_asked = (int64_t)faces;
    double share = working_edges(run);
    float *plain, *size = qw_wanted_size(run, run->rho, &plain);
    bool has_spots = memcmp(size, plain, run->surface.vertex_count * sizeof *size) != 0;
    for (uint32_t v = 0; v < run->surface.vertex_count; v++) size[v] /= (float)share, plain[v] /= (float)share;
    run->working = qw_working_mesh(env, &run->surface, &run->surface_census, size, has_spots ? plain : NULL);
    qw_free(env, size), qw_free(env, plain);
    const qw_trimesh *mesh = &run->working.mesh;
    float *reach = QW_NEW(env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) reach[v] = run->working.target[v] * (float)(share / 2);
    qw_drop_close_curves(env, &run->working.mesh, reach);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) reach[v] *= 2 * CORNER_SPAN;
    qw_find_holds(env, mesh, run->options.align_boundary != 0, CORNER_ANGLE, reach, &run->hold, &run->direction);
    qw_free(env, reach);
    run->normal = qw_vertex_normals(env, mesh);
    qw_balance_creases(env, mesh, run->normal);
    run->smoothed = QW_NEW(env, float, mesh->vertex_count);
    qw_smooth_normals(env, mesh, run->working.target, (float)(NORMAL_RADIUS * smoothness(run) * share), run->normal,
                      run->smoothed);
    run->report->working_vertices = mesh->vertex_count;
    run->report->working_triangles = mesh->face_count;
}

void qw_stage_HIERARCHY(qw_run_state *run)
{
    run->hierarchy = QW_NEW(run->env, qw_hierarchy, 1);
    *run->hierarchy = qw_hierarchy_build(run->env, &run->working.mesh, run->normal, run->hold, run->direction);
    run->report->hierarchy_levels = run->hierarchy->level_count;
}

void qw_stage_ORIENTATION(qw_run_state *run)
{
    qw_env *env = run->env;
    const qw_trimesh *mesh = &run->working.mesh;
    float *radius = QW_NEW(env, float, mesh->vertex_count),
          edges = (float)(CURVATURE_RADIUS * smoothness(run) * working_edges(run));
    for (uint32_t v = 0; v < mesh->vertex_count; v++) radius[v] = edges * run->working.target[v] * run->smoothed[v];
    float *turn = qw_even_curvature(env, mesh, &run->hierarchy->level[0], radius);
    run->orientation = qw_orientation_field(env, run->hierarchy, turn, (uint64_t)run->options.seed);
    qw_free(env, turn), qw_free(env, radius);
}

void qw_stage_SCALE(qw_run_state *run)
{
    const qw_trimesh *mesh = &run->working.mesh;
    float *size = QW_NEW(run->env, float, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) size[v] = run->working.target[v] * (float)working_edges(run);
    if (run->options.adaptive > 0)
        qw_scale_by_curvature(run->env, mesh, run->normal, (float)run->options.adaptive, size);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) size[v] *= (float)run->rho_scale;
    run->size = size;
}

/* The integers come from the closed offsets, which need no position field. */
static bool is_closed_way(const qw_run_state *run) { return run->options.flow == QW_FLOW_CLOSED; }

void qw_stage_POSITION(qw_run_state *run)
{
    if (is_closed_way(run)) {
        uint32_t n = run->working.mesh.vertex_count;
        run->lattice = QW_NEW(run->env, qw_vec3, n);
        memcpy(run->lattice, run->working.mesh.position, n * sizeof *run->lattice);
        return;
    }
    run->lattice = qw_position_field(run->env, run->hierarchy, run->orientation, run->size);
}

void qw_stage_OFFSETS(qw_run_state *run)
{
    const qw_vec3 *lattice = is_closed_way(run) ? NULL : run->lattice;
    qw_offset_input in = {&run->working.mesh,
                          run->normal,
                          run->orientation,
                          lattice,
                          run->size,
                          run->hold,
                          run->direction,
                          run->options.align_boundary != 0,
                          is_closed_way(run) && run->corners_freed != 1};
    run->offsets = qw_integer_offsets(run->env, &in);
    qw_offset_counts c = qw_offset_count(&run->offsets);
    run->report->orientation_singularities = c.singular_vertices;
    run->report->position_singularities_before = c.irregular_triangles;
}

void qw_stage_REGULAR(qw_run_state *run)
{
    run->regular = qw_offset_branch(run->env, &run->offsets);
    qw_regular_counts c;
    run->stiff_is_vain = 0;
    if (is_closed_way(run)) {
        /* where rho was raised, as squares would be too many along the length, fewer fit; the rest is made up for after
         * repairs */
        double fit = run->apart.area / (run->rho * run->rho),
               wanted = fit < 0.99 * run->faces_wanted ? fmax(fit, 1) : run->faces_wanted;
        double quads = wanted / (run->rho_scale * run->rho_scale);
        qw_quantise_counts counts = qw_quantise(run->env, &run->regular, quads, run->way == QW_WAY_CLOSED_STIFF);
        c = counts.regular;
        /* a stiffer surface around integers that turn patches over gives them no other integers, unless lines ran
         * together over whole faces */
        run->stiff_is_vain = counts.turned_over > 0 && counts.squeezed < MUCH_SQUEEZED;
    } else {
        c = qw_make_regular(run->env, &run->regular, (qw_flow_kind)run->options.flow, (qw_cost_kind)run->options.cost);
    }
    qw_report *r = run->report;
    r->network_nodes = c.nodes, r->network_arcs = c.arcs, r->network_components = c.network_components;
    r->fixed_variables = c.fixed_variables, r->free_variables = c.free_variables,
    r->capacity_rounds = c.capacity_rounds;
    r->flow_cost = c.cost;
    r->position_singularities_after = qw_offset_count(&run->regular).irregular_triangles;
}

/* Whether the offsets have run away: edges of the working mesh are hardly longer than those of the quads, so offsets
   that mean anything are at most a few units long. To cut longer ones into units would take memory and time without
   bound. */
static bool has_run_away(const qw_offset_mesh *m)
{
    double sum = 0;
    for (uint32_t e = 0; e < m->edge_count; e++) sum += qw_int2_norm(m->d[e]);
    return sum > MEAN_OFFSET * m->edge_count;
}

/* Where another way to the integers can follow, that takes less time than large neighbourhoods and leaves nothing
   turned over as often; and so do curves that are let go, before it comes to that. */
static qw_sat_effort sat_effort(const qw_run_state *run)
{
    return is_closed_way(run) && run->way_attempts == 0 && !run->stiff_is_vain ? QW_SAT_NEAR : QW_SAT_FAR;
}

void qw_stage_UPRIGHT(qw_run_state *run)
{
    run->upright = qw_offset_copy(run->env, &run->regular);
    qw_report *r = run->report;
    r->sat_calls = r->sat_conflicts = 0;
    if (has_run_away(&run->upright)) { /* nothing can be contracted along them: another way is tried, or components are
                                          made anew */
        r->subdivided_edges = 0;
        r->inverted_before = r->inverted_after_greedy = r->inverted_after_sat = run->upright.face_count;
        return;
    }
    r->subdivided_edges = qw_subdivide_long_edges(run->env, &run->upright);
    qw_upright_counts c = {0};
    qw_upright_greedy(run->env, &run->upright, &c);
    if (run->options.sat) qw_upright_sat(run->env, &run->upright, sat_effort(run), &c);
    if (run->options.sat && c.inverted_after > 0 && qw_release_curves(run->env, &run->upright, RELEASE_RINGS) > 0) {
        qw_upright_counts again = {
            .sat_calls = c.sat_calls, .sat_solved = c.sat_solved, .sat_conflicts = c.sat_conflicts};
        qw_upright_greedy(run->env, &run->upright, &again);
        qw_upright_sat(run->env, &run->upright, sat_effort(run), &again);
        c.inverted_after = again.inverted_after, c.sat_calls = again.sat_calls, c.sat_conflicts = again.sat_conflicts;
    }
    if (run->options.sat) qw_unwind(run->env, &run->upright, &c);
    r->inverted_before = c.inverted_before, r->inverted_after_greedy = c.inverted_after_greedy,
    r->inverted_after_sat = c.inverted_after;
    r->sat_calls = c.sat_calls, r->sat_conflicts = c.sat_conflicts;
}

void qw_stage_QUADS(qw_run_state *run) { run->extraction = qw_extract_quads(run->env, &run->upright); }

/* Residuals of the places: where the quads are relaxed afterwards they only begin there. */
static const double PLACED = 1e-4, ROUGHLY_PLACED = 3e-2;

void qw_stage_POSITIONS(qw_run_state *run)
{
    qw_places_counts c = {0};
    const qw_extraction *x = &run->extraction;
    run->placed = x->quads;
    run->placed.position = QW_NEW(run->env, qw_vec3, x->quads.vertex_count);
    qw_vec3 *place = qw_solve_places(run->env, &run->upright, x->class_of, run->options.relax ? ROUGHLY_PLACED : PLACED,
                                     &c);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) run->placed.position[v] = place[x->vertex_class[v]];
    qw_free(run->env, place);
    run->report->least_squares_iterations = c.iterations;
    run->report->least_squares_residual = c.residual;
}

/* The count may be off by this much before rho is corrected and the fields below it are solved again, by no more than
 * this factor at once. */
static const double COUNT_TOLERANCE = 0.02, FEW_TOLERANCE = 0.05, FEW = 500, MOST_CORRECTION = 1.5;
/* Where components are made anew the size decides little, and attempts do not converge: single quads make up the count
 * there. */
enum { COUNT_ATTEMPTS = 4, COUNT_ATTEMPTS_ANEW = 2 };

static double count_tolerance(const qw_run_state *run)
{
    return run->faces_wanted < FEW ? FEW_TOLERANCE : COUNT_TOLERANCE;
}
static bool is_near_count(const qw_run_state *run, double quads)
{
    return fabs(quads / run->faces_wanted - 1) <= count_tolerance(run);
}

/* Repairs may add or take so much of the faces wanted: half of what the promise allows. */
static int64_t repaired_faces(const qw_run_state *run, double sign)
{
    return (int64_t)(run->faces_wanted * (1 + sign * count_tolerance(run) / 2));
}

/* Then parts are made anew wherever they are, and neither other sizes nor other integers lead to fewer quads. */
static bool is_too_few(const qw_run_state *run) { return run->faces_wanted < run->apart.needed; }

static bool has_attempts(const qw_run_state *run)
{
    bool anew = is_closed_way(run) && !run->topology_kept;
    return run->count_attempts < (anew ? COUNT_ATTEMPTS_ANEW : COUNT_ATTEMPTS) && !is_too_few(run);
}

static double count_off(const qw_run_state *run, double quads)
{
    return fmax(quads / run->faces_wanted, run->faces_wanted / fmax(quads, 1));
}

/* Another size did better: rather that one once more than quads added or taken by the dozen. */
static bool was_better(const qw_run_state *run, double quads)
{
    return run->rho_scale != run->best_scale && count_off(run, quads) > run->best_off;
}

static bool may_adjust_count(const qw_run_state *run)
{
    return is_closed_way(run) && (has_attempts(run) || was_better(run, run->repaired.face_count));
}
/* Sizes are those of the surface's vertices: where none is near, asking for smaller quads changes nothing. */
static bool can_refine_around(const qw_run_state *run, const qw_losses *losses)
{
    const qw_trimesh *s = &run->surface;
    for (uint32_t i = 0; i < losses->count; i++) {
        qw_break_silence(run->env);
        for (uint32_t v = 0; v < s->vertex_count; v++)
            if (qw_distance(s->position[v], losses->point[i]) < REFINE_RADIUS * losses->size[i]) return true;
    }
    return false;
}

static bool may_refine(const qw_run_state *run, qw_losses *losses)
{
    if (!run->options.repair || run->refine_attempts >= REFINE_ATTEMPTS || is_too_few(run)) return false;
    *losses = qw_find_losses(run->env, &run->upright, &run->extraction);
    return can_refine_around(run, losses);
}

static qw_quadmesh fewer_quads(qw_run_state *run, const qw_quadmesh *quads, int64_t least, int64_t most,
                               qw_simplify_counts *moves)
{
    qw_quadmesh fewer = qw_remove_chords(run->env, quads, least, most);
    return qw_simplify_quads(run->env, &fewer, least, most, is_too_few(run), moves);
}

/* What no size of the quads could do: single quads go or are added, until the count is within the promise. Where that
   is less than the components need, only quads go that cost no shape, down to what they need. */
static void fit_count(qw_run_state *run, qw_simplify_counts *moves)
{
    double off = 0.95 * count_tolerance(run), wanted = fmax(run->faces_wanted, run->apart.needed);
    int64_t least = (int64_t)ceil(wanted * (1 - off)), most = (int64_t)floor(wanted * (1 + off));
    if (run->repaired.face_count > most) {
        run->repaired = fewer_quads(run, &run->repaired, least, most, moves);
    } else if (run->repaired.face_count < run->faces_wanted) {
        run->repaired = qw_add_quads(run->env, &run->repaired, least, most);
    }
    if (!is_near_count(run, run->repaired.face_count) && run->repaired.face_count > run->faces_wanted)
        warn(run, "so few faces cannot carry the surface's parts, handles and sharp edges: there are more");
}

void qw_stage_REPAIR(qw_run_state *run)
{
    qw_repair_counts c = {0};
    qw_simplify_counts moves = {0};
    qw_report *r = run->report;
    const qw_trimesh *working = &run->working.mesh;
    bool repair = run->options.repair;
    run->repaired = repair
                        ? qw_repair_quads(run->env, &run->placed, repaired_faces(run, 1) - run->placed.face_count, &c)
                        : run->placed;
    r->repaired_doublets = c.doublets;
    r->repaired_pairs = r->fallback_components = 0;
    qw_topology_check check = qw_check_topology(run->env, &run->repaired, working);
    run->topology_kept = check.broken_count == 0;
    qw_losses losses;
    if (!repair || (!run->topology_kept && may_refine(run, &losses))) return;
    if (!run->topology_kept) {
        r->fallback_components = check.broken_count;
        const qw_vec3 *place = run->placed.position;
        run->repaired =
            qw_replace_components(run->env, &run->repaired, &run->upright, &run->extraction, place, &check).quads;
        warn(run, "the fields alone would have lost the topology of a component: it has more irregular vertices where "
                  "it was kept");
    }
    run->repaired = qw_simplify_quads(run->env, &run->repaired, repaired_faces(run, -1), INT64_MAX, false, &moves);
    if (!is_near_count(run, run->repaired.face_count) && !may_adjust_count(run)) fit_count(run, &moves);
    r->repaired_pairs = moves.collapses + moves.rotations;
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

static void set_relaxed(qw_run_state *run, qw_quadmesh quads, uint8_t *flipped)
{
    run->relaxed = quads, run->flipped = flipped;
    run->reach_known = false;
}

static qw_losses find_unreached(qw_run_state *run)
{
    if (!run->reach_known)
        run->unreached = qw_find_unreached(run->env, &run->working.mesh, run->size, &run->relaxed,
                                           REACH * (float)run->rho);
    run->reach_known = true;
    return run->unreached;
}

/* Of what the rounds so far made of each component the best. */
static void take_best_round(qw_run_state *run)
{
    double off = count_tolerance(run), quads = run->relaxed.face_count;
    qw_round round = {&run->surface,
                      &run->working.mesh,
                      &run->relaxed,
                      run->flipped,
                      run->rho,
                      REACH * (float)run->rho,
                      fmin(quads, ceil(run->faces_wanted * (1 - off))),
                      fmax(quads, floor(run->faces_wanted * (1 + off)))};
    qw_quadmesh best;
    uint8_t *flipped;
    if (!qw_rounds_add(run->env, &run->rounds, &round, &best, &flipped)) return;
    set_relaxed(run, best, flipped);
}

static bool goes_on(qw_run_state *run);

/* What is turned over when nothing else follows is mended where it is. */
static void mend_last(qw_run_state *run)
{
    const qw_trimesh *surface = &run->surface, *whole = &run->apart.rest;
    run->mended = 0, run->report->mended_quads = 0;
    if (!run->options.repair || !run->options.relax || run->relaxed.face_count == 0) return;
    if (!qw_has_flipped(run->env, &run->relaxed, surface, whole) || goes_on(run)) return;
    qw_quadmesh mended = run->relaxed;
    uint8_t *flipped = run->flipped;
    double least = fmin(run->relaxed.face_count, ceil(run->faces_wanted * (1 - count_tolerance(run))));
    uint32_t count = qw_mend_flipped(run->env, &mended, surface, whole, (int64_t)least, &flipped);
    if (qw_check_topology(run->env, &mended, &run->working.mesh).broken_count > 0) return;
    set_relaxed(run, mended, flipped);
    run->report->mended_quads = run->mended = count;
}

/* Twice what certainly is. */
static uint32_t count_flipped(const qw_run_state *run)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < run->relaxed.face_count; f++) count += run->flipped[f];
    return count;
}

static void relax(qw_run_state *run, const qw_quadmesh *quads)
{
    uint8_t *turn = QW_NEW_ZERO(run->env, uint8_t, quads->face_count),
            *flipped = QW_NEW_ZERO(run->env, uint8_t, quads->face_count);
    qw_relax_target target = {&run->working.mesh, run->size, (float)run->options.evenness, flipped, turn};
    qw_vec3 *position = qw_relax_quads(run->env, quads, &run->surface, &target);
    qw_quadmesh relaxed = qw_turn_quads(run->env, quads, turn);
    relaxed.position = position;
    qw_free(run->env, turn);
    set_relaxed(run, relaxed, flipped);
}

/* What is out of reach and what is turned over, in quads. */
static double find_bad(qw_run_state *run, qw_losses *losses)
{
    *losses = find_unreached(run);
    return losses->area / (run->rho * run->rho) + count_flipped(run);
}

static bool is_large(const qw_run_state *run)
{
    return run->working.mesh.vertex_count > REACH_VERTICES || run->faces_wanted > REACH_QUADS;
}

static uint32_t reach_attempts(const qw_run_state *run)
{
    if (run->faces_wanted < FEW_QUADS) return REACH_ATTEMPTS_FEW;
    return is_large(run) ? REACH_ATTEMPTS_LARGE : REACH_ATTEMPTS;
}

/* What the integers left out grows out of what is there, as long as that leaves less out of reach; where the count
 * would be missed then, quads go elsewhere. */
static void grow_limbs(qw_run_state *run)
{
    float edge = (float)run->rho;
    double off = 0.95 * count_tolerance(run), bad, before;
    int64_t least = (int64_t)ceil(run->faces_wanted * (1 - off)),
            most = (int64_t)qw_floor(run->faces_wanted * (1 + off));
    qw_losses losses;
    run->report->grown_limbs = 0;
    if (!run->options.repair || !run->options.relax || is_too_few(run)) return;
    bool last = run->settled ||
                run->reach_attempts >=
                    reach_attempts(run); /* before that, smaller quads may keep the limb and its sharp edges */
    bad = find_bad(run, &losses);
    for (int pass = 0; pass < LIMB_PASSES && losses.count > 0; pass++) {
        qw_quadmesh grown = run->relaxed, old = run->relaxed;
        uint8_t *old_flipped = run->flipped;
        uint32_t limbs = qw_grow_limbs(run->env, &grown, &run->working.mesh, edge, REACH * edge, last,
                                       (uint32_t)(LIMB_SHARE * run->faces_wanted));
        if (limbs == 0) return;
        qw_simplify_counts moves = {0};
        if (grown.face_count > most) grown = fewer_quads(run, &grown, least, most, &moves);
        relax(run, &grown);
        before = bad;
        bad = find_bad(run, &losses);
        qw_log(run->env, QW_LOG_DEBUG,
               "%u limbs grew, %u quads now; out of reach or turned over: %.2f quads, were %.2f", limbs,
               grown.face_count, bad, before);
        if (bad >= before) {
            set_relaxed(run, old, old_flipped);
            return;
        }
        run->report->grown_limbs += limbs;
    }
}

/* Back to the coordinates of the input. */
static void set_output(qw_run_state *run)
{
    const qw_frame *frame = &run->clean.frame;
    uint32_t moved, left;
    qw_join_result(run);
    run->output = QW_NEW(run->env, double, (size_t)3 * run->result.vertex_count);
    for (uint32_t v = 0; v < run->result.vertex_count; v++) {
        qw_vec3 p = run->result.position[v];
        double q[3] = {p.x, p.y, p.z};
        qw_leave_own_frame(&run->clean.own, p, q);
        for (int i = 0; i < 3; i++) run->output[3 * (size_t)v + (size_t)i] = frame->center[i] + q[i] / frame->scale;
    }
    left = qw_settle_written(run->env, &run->result, decimal_unit(frame), run->output, &moved);
    if (moved) qw_log(run->env, QW_LOG_DEBUG, "%u vertices were drawn apart, as quads had no area", moved);
    if (left != QW_NONE && run->options.repair)
        qw_fail(run->env, QW_INTERNAL, left,
                "quad %u, of component %u, has no area in the coordinates that would be written, so the result is "
                "withheld",
                left, run->result.component[run->result.corner[4 * (size_t)left]]);
}

void qw_stage_RELAX(qw_run_state *run)
{
    if (run->options.relax) relax(run, &run->repaired);
    else set_relaxed(run, run->repaired, QW_NEW_ZERO(run->env, uint8_t, run->repaired.face_count));
    grow_limbs(run);
    if (run->options.repair && run->options.relax) take_best_round(run);
    mend_last(run);
    if (run->options.repair) {
        qw_topology_check check = qw_check_topology(run->env, &run->relaxed, &run->working.mesh);
        if (check.broken_count || run->relaxed.face_count == 0)
            qw_fail(run->env, QW_INTERNAL, -1,
                    "%u of %u components did not keep their topology, so the result is withheld", check.broken_count,
                    check.component_count);
    }
    set_output(run);
}

/* ---- other attempts */

static void restart_count(qw_run_state *run)
{
    run->count_attempts = 0;
    run->best_off = INFINITY;
}

static void free_corners(qw_run_state *run)
{
    run->corners_freed = 1;
    run->corners_off = run->best_off, run->corners_scale = run->best_scale;
    run->rho_scale = run->best_scale = 1;
    restart_count(run);
}

/* What did best with cones at the corners, once more, if that did no worse than without. */
static void take_corners_back(qw_run_state *run)
{
    if (run->corners_freed != 1 || run->best_off < run->corners_off) return;
    run->corners_freed = 2;
    run->best_off = run->corners_off, run->best_scale = run->corners_scale;
}

/* A box with cones at its corners has but a few counts. Where the integers themselves are off, and not what repairs
   made of them, and there are such cones, these may lie elsewhere. */
static bool may_free_corners(const qw_run_state *run)
{
    const qw_offset_mesh *m = &run->upright;
    if (!is_closed_way(run) || run->corners_freed) return false;
    double whole = (double)qw_offset_count(m).double_area / 2;
    if (is_near_count(run, whole) || fabs(run->repaired.face_count / fmax(whole, 1) - 1) > count_tolerance(run) / 2)
        return false;
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (m->hold[v] == QW_HOLD_CORNER && m->index[v] != 0) return true;
    return false;
}

bool qw_adjust_count(qw_run_state *run, qw_stage finished)
{
    /* the integers of closed offsets have the count that they were asked for: what repairs added is to be made up for
     */
    if (is_closed_way(run) != (finished == QW_STAGE_REPAIR)) return false;
    double quads = is_closed_way(run) ? run->repaired.face_count
                                      : (double)qw_offset_count(&run->upright).double_area / 2;
    if (is_near_count(run, quads) || quads < 1 || !(is_closed_way(run) ? may_adjust_count(run) : has_attempts(run)))
        return false;
    double ratio = quads / run->faces_wanted, off = count_off(run, quads);
    run->count_attempts++;
    if (off >= run->best_off && may_free_corners(run)) {
        free_corners(run);
        return true;
    }
    if (off >= run->best_off) { /* it does not converge: the best once more */
        run->count_attempts = COUNT_ATTEMPTS;
        take_corners_back(run);
        run->rho_scale = run->best_scale;
        return true;
    }
    run->best_off = off;
    run->best_scale = run->rho_scale;
    run->rho_scale *= fmin(fmax(sqrt(ratio), 1 / MOST_CORRECTION), MOST_CORRECTION);
    return true;
}

bool qw_adjust_way(qw_run_state *run)
{
    int64_t inverted = run->report->inverted_after_sat + run->report->position_singularities_after;
    if (run->options.flow != QW_FLOW_CLOSED || run->settled || run->way_attempts >= QW_INTEGER_WAYS) return false;
    run->way_inverted[run->way] = inverted;
    if (inverted)
        qw_log(run->env, QW_LOG_DEBUG, "way %d to the integers left %lld triangles turned over", (int)run->way,
               (long long)inverted);
    /* what a stiffer surface would leave as it is, is made up for by repairs */
    if (inverted == 0 || (run->way == QW_WAY_CLOSED && run->stiff_is_vain && !has_run_away(&run->regular)))
        return false;
    run->way_attempts++;
    if (run->way_attempts < QW_INTEGER_WAYS) {
        run->way = (qw_integer_way)run->way_attempts;
        return true;
    }
    qw_integer_way best = QW_WAY_CLOSED, last = run->way;
    for (int w = 0; w < QW_INTEGER_WAYS; w++)
        if (run->way_inverted[w] < run->way_inverted[best]) best = (qw_integer_way)w;
    run->way = best;
    return best != last;
}

/* The run goes on from the working mesh. */
static void begin_round(qw_run_state *run)
{
    restart_count(run);
    run->way_attempts = run->corners_freed = 0;
    run->way = QW_WAY_CLOSED;
    run->report->refined_regions = run->refine_count;
}

/* With smaller quads around the places. */
static void refine_around(qw_run_state *run, const qw_losses *losses)
{
    run->refine_rounds++;
    for (uint32_t i = 0; i < losses->count && run->refine_count < QW_MAX_REFINEMENTS; i++)
        run->refine[run->refine_count++] = (qw_refinement){losses->point[i], REFINE_RADIUS * losses->size[i],
                                                           (uint8_t)run->refine_rounds};
    begin_round(run);
}

bool qw_adjust_refinement(qw_run_state *run)
{
    qw_losses losses;
    if (run->topology_kept || !may_refine(run, &losses)) return false;
    run->refine_attempts++;
    refine_around(run, &losses);
    return true;
}

/* The rounds take from one place what they give to another, so the last need not be the best. Made again it is the
   same: with its size and its way to the integers, as far as that had been looked for, and neither count nor way to be
   looked for once more. */
static bool make_best_again(qw_run_state *run)
{
    run->settled = 1;
    if (run->best_refine_count == run->refine_count) return false;
    run->refine_count = run->best_refine_count;
    run->rho_scale = run->best_refine_scale;
    begin_round(run);
    run->count_attempts = COUNT_ATTEMPTS;
    run->way_attempts = run->best_refine_way_attempts, run->way = run->best_refine_way;
    run->corners_freed = run->best_refine_corners;
    return true;
}

static float size_near(const qw_run_state *run, qw_vec3 p)
{
    const qw_trimesh *m = &run->working.mesh;
    uint32_t nearest = 0;
    for (uint32_t v = 1; v < m->vertex_count; v++)
        if (qw_length2(qw_sub(m->position[v], p)) < qw_length2(qw_sub(m->position[nearest], p))) nearest = v;
    return run->size[nearest];
}

/* Quads that are certainly turned over where nothing is out of reach: other sizes around them give others. */
static void list_flipped(const qw_run_state *run, qw_losses *losses)
{
    const qw_quadmesh *q = &run->relaxed;
    for (uint32_t f = 0; f < q->face_count && losses->count < QW_MOST_LOSSES; f++) {
        if (run->flipped[f] < QW_CERTAINLY_FLIPPED) continue;
        const uint32_t *c = q->corner + 4 * (size_t)f;
        qw_vec3 p = qw_lerp(q->position[c[0]], q->position[c[2]], 0.5f);
        losses->point[losses->count] = p;
        losses->size[losses->count++] = size_near(run, p);
    }
}

/* What a result is like, and whether another round follows it. */
typedef struct outlook {
    qw_losses losses;
    double bad;                      /* in quads */
    bool reached, again, best_again; /* nothing is out of reach; with other sizes; the best, if that is not this one */
} outlook;

static outlook look_ahead(qw_run_state *run)
{
    outlook o = {.again = false};
    if (!run->options.repair || run->settled || run->mended || is_too_few(run)) return o;
    o.bad = find_bad(run, &o.losses);
    o.reached = o.losses.count == 0;
    if (o.reached) list_flipped(run, &o.losses); /* into arrays that hold nothing then */
    if (o.losses.count == 0 && run->flip_attempts == 0) return o;
    bool enough = o.losses.count == 0 || (run->report->grown_limbs > 0 && o.bad < LOST_TIP) ||
                  (is_large(run) && run->reach_attempts > 0 && o.bad < LOST_LIMB);
    o.again = !enough && run->reach_attempts < reach_attempts(run) && can_refine_around(run, &o.losses);
    o.best_again = !o.again && run->rounds.count == 0;
    return o;
}

static bool goes_on(qw_run_state *run)
{
    outlook o = look_ahead(run);
    return o.again || (o.best_again && o.bad >= run->least_bad && run->best_refine_count != run->refine_count);
}

bool qw_adjust_result(qw_run_state *run)
{
    outlook o = look_ahead(run);
    if (o.losses.count == 0 && !o.best_again) return false;
    qw_log(run->env, QW_LOG_DEBUG, "%u places out of reach or turned over, %.2f quads", o.losses.count, o.bad);
    if (!o.again && run->reach_attempts == 0)
        return false; /* there is but this one, and a later run in the same context must not find any other */
    if (run->rounds.count > 0 && !o.reached)
        o.losses = qw_rounds_losses(run->env, &run->rounds, &run->working.mesh, run->size, &run->relaxed,
                                    REACH * (float)run->rho);
    if (o.bad < run->least_bad) {
        run->least_bad = o.bad;
        run->best_refine_count = run->refine_count, run->best_refine_scale = run->rho_scale;
        run->best_refine_way = run->way, run->best_refine_way_attempts = run->way_attempts,
        run->best_refine_corners = run->corners_freed;
    }
    if (!o.again) return o.best_again && make_best_again(run);
    run->reach_attempts++;
    run->flip_attempts += o.reached;
    refine_around(run, &o.losses);
    return true;
}

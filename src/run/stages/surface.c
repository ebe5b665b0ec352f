/* The stages from the input to the hierarchy: what each takes from the run, calls and leaves in it. The work itself is
 * in src/remesh/clean, features, sizes, working and field.
 */
#include "whole/cut.h"
#include "base/mechanisms.h"
#include "whole/mirror.h"
#include "whole/small.h"
#include "whole/kept_rims.h"
#include "whole/wrapped.h"
#include "whole/guides.h"
#include "whole/motion_on.h"
#include "run/stages/split_levels.h"
#include "run/stages/stages.h"

#include "remesh/features/decide.h"
#include "remesh/features/features.h"
#include "remesh/features/teeth.h"

#include "base/constants.h"
#include "geometry/long_edges.h"
#include "remesh/field/orientation.h"
#include "base/elementary.h"
#include "remesh/clean/marks.h"
#include "remesh/features/feature_points.h"
#include "remesh/features/sharpen.h"
#include "remesh/sizes/needs.h"
#include "whole/sizes.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The surface is prepared for the next half power of ten of faces, so that it serves other counts as well: 1,000,
 * 3,162, 10,000. */
static const double SURFACE_STEP = 3.16227766016838;
/* Where fewer quads are wanted a surface is coarsened (QW_CONDENSED) as for so many: protrusions may be thinner than an
   edge then. */
static const double LEAST_CONDENSED = 1000;
enum { PIECES = 32 }; /* triangles for each of that size, at most, where long ones are cut */
/* Of the mean edge: the smallest quads for which a surface is kept fine enough where quads differ in size. */
static const double SMALLER = 1.0 / 3;
/* A surface kept for quads of less than this share of the mean edge is coarsened again where quads are larger. */
static const double COARSEN_TWICE = 0.5;
/* Radius of normal smoothing, in edge lengths of the quads for a smoothness of 1: docs/dev/decisions/orientation.md. */
static const double NORMAL_RADIUS = 0.75;

/* "3 triangles": the unit is given for one. */
static void warn_of(qw_run_state *run, int64_t count, const char *unit, const char *what)
{
    char text[sizeof run->report->warnings[0]];
    snprintf(text, sizeof text, "%lld %s%s %s", (long long)count, unit, count == 1 ? "" : "s", what);
    if (count > 0) qw_warn(run, text);
}

/* Warns of what cleaning has changed. */
static void warn_of_cleaning(qw_run_state *run, const qw_clean_counts *c)
{
    char text[sizeof run->report->warnings[0]];
    warn_of(run, c->sewn_junctions, "T-junction", "sewn: edges were split at vertices of others that lie on them");
    warn_of(run, c->dropped_duplicate, "triangle", "dropped, as others have the same three vertices");
    warn_of(run, c->turned_components, "closed component",
            "turned outward, inside out in the input (with outward off they stay)");
    warn_of(run, c->flipped_alone, "triangle", "flipped to agree with its neighbours");
    if (c->split_edges) qw_warn(run, "edges with more than two faces were parted into sheets");
    snprintf(text, sizeof text,
             "%lld components without an area were dropped, as their coordinates give them none: that of face %u",
             (long long)c->dropped_flat, c->first_flat);
    if (c->dropped_flat) qw_warn(run, text);
    if (c->one_sided_seam_edges)
        qw_warn(run, "a one-sided component, such as a Moebius strip or a Klein bottle, was cut open along a seam");
}

/* The clean surface, or the skin around the input, and the report on what cleaning did. */
void qw_stage_CLEAN(qw_run_state *run)
{
    if (run->options.wrap) qw_wrap_whole(run);
    else qw_clean_inside(run);
    if (run->options.fill_holes > 0) qw_close_holes(run);
    const qw_clean_counts *c = &run->whole.clean.counts;
    const qw_census *census = &run->whole.census;
    run->whole.area = qw_trimesh_area(&run->whole.clean.mesh);
    qw_report *r = run->report;
    r->input_vertices = run->whole.input->vertex_count, r->input_faces = run->whole.input->face_count,
    r->input_triangles = c->triangles;
    r->welded_vertices = c->welded_vertices, r->sewn_junctions = c->sewn_junctions;
    r->dropped_degenerate = c->dropped_degenerate, r->dropped_duplicate = c->dropped_duplicate;
    r->dropped_isolated = c->dropped_isolated, r->dropped_components = c->dropped_components + c->dropped_flat,
    r->flipped_triangles = c->flipped_triangles, r->turned_components = c->turned_components;
    r->split_edges = c->split_edges;
    r->split_vertices = c->split_vertices, r->one_sided_seam_edges = c->one_sided_seam_edges,
    r->unfolded_vertices = c->unfolded_vertices;
    r->components = census->components, r->boundary_loops = census->boundary_loops, r->euler = census->euler;
    warn_of_cleaning(run, c);
    qw_look_for_soup(run);
}

/* What is remeshed: all of the clean surface, or one side of a plane of symmetry. */
void qw_stage_CORE(qw_run_state *run)
{
    run->input = *run->whole.input, run->steering = qw_steering_with_joints(run);
    run->clean = run->whole.clean, run->clean_census = run->whole.census;
    run->area = run->whole.area;
    run->whole.motion = qw_follows_motion(run)
                            ? qw_motion_begin(run->env, &run->whole.clean, run->whole.steering->motion)
                            : NULL;
    run->extent = qw_total_extent(run->env, &run->clean.mesh, &run->clean_census);
    run->faces_needed = qw_faces_needed(run->env, &run->clean.mesh, &run->clean_census);
    run->mirror = (qw_mirror){.times = 1};
    qw_report *r = run->report;
    r->symmetric = 0, r->symmetry_gap = r->symmetry_far = 0;
    r->plane_x = r->plane_y = r->plane_z = r->plane_offset = 0;
    qw_require_few_faces(run);
    qw_require_levels(run);
    if (run->options.symmetry != QW_SYMMETRY_NONE) qw_take_one_side(run);
}

double qw_surface_faces(const qw_run_state *run, const qw_options *options)
{
    double times = qw_times_used(run); /* a half is as fine as the whole would be */
    bool has_joints = run->whole.steering->joint_count > 0 && options->follow_motion > 0;
    /* the count decides which parts are thin, and around which joints there are rings */
    if (qw_may_be_thin(run) || has_joints) return qw_faces_wanted(run, options) / times;
    double least = qw_faces_wanted(run, options) * (1 - 1e-9), faces = 1;
    while (faces < least) faces *= SURFACE_STEP;
    return faces / times;
}

/* Puts creases that were sampled in the place of what was found of them. */
static void sharpen(qw_run_state *run, float quad_edge)
{
    qw_trimesh *s = &run->surface;
    if (qw_keeps_rims(run) || run->options.keep_marks) return; /* edges of the input that must be found again */
    if (!qw_uses(run->env, QW_MECH_SHARPEN) || !qw_sharpen(run->env, s, &run->surface_census, quad_edge)) return;
    qw_did(run->env, QW_MECH_SHARPEN, 1);
    run->surface_census = qw_trimesh_census(run->env, s);
    run->report->feature_edges = 0;
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        run->report->feature_edges += s->mark[h] && qw_stands_for_edge(s, h);
}

/* Marks the sharp edges. Where edges above the requested angle are longer in all than the edges of the quads, as
   those of noise are, quads cannot follow them and would be torn: the angle is not used. */
static void mark_features(qw_run_state *run, double rho)
{
    double asked = run->options.sharp_angle, used = 0,
           count = fmax(qw_faces_without_small(run, run->surface_faces), run->core.needed);
    float quad_edge = (float)fmin(rho,
                                  sqrt(run->core.area / count)); /* at least as many quads as the components need */
    qw_report *r = run->report;
    if (run->options.sharp_marks) {
        r->feature_edges = qw_take_marks(run->env, &run->input, &run->clean.frame, &run->surface);
    } else {
        r->feature_edges = qw_find_features(run->env, &run->surface, asked < 0 ? -1.0 : asked * QW_PI / 180.0,
                                            quad_edge, &used);
        if (asked < 0) sharpen(run, quad_edge);
        if (asked < 0 && qw_uses(run->env, QW_MECH_FEATURE_POINTS))
            r->feature_points = qw_find_points(run->env, &run->surface, quad_edge);
        qw_did(run->env, QW_MECH_FEATURE_POINTS, r->feature_points);
        if (asked >= 0 && qw_marked_length(&run->surface) > 2 * run->core.area / rho) {
            qw_free(run->env, run->surface.mark);
            r->feature_edges = qw_find_features(run->env, &run->surface, -1.0, quad_edge, &used);
            qw_warn(run, "so few quads have no room for all edges of that angle: a suitable one was found instead");
        }
    }
    if (run->options.keep_marks && !run->options.sharp_marks)
        r->feature_edges += qw_add_marks(run->env, &run->input, &run->clean.frame, &run->surface);
    r->sharp_angle = used * 180.0 / QW_PI;
}

/* uint8_t[vertices]: those that lie in a plane of the cut; NULL where there is none. */
static uint8_t *find_cut(const qw_run_state *run, const qw_trimesh *mesh)
{
    return run->mirror.is_used ? qw_find_cuts(run, mesh) : NULL;
}

/* Teeth of kept borders and of boundaries become smooth lines where they are no longer than the largest quads for which
   the surface is used. What must be found again stays as it is. */
static void smooth_teeth(qw_run_state *run, double rho)
{
    bool with_boundary = run->options.align_boundary != 0;
    if (qw_keeps_rims(run) || !(run->options.keep_marks || with_boundary) || !qw_uses(run->env, QW_MECH_TEETH)) return;
    uint8_t *cut = find_cut(run, &run->surface);
    uint32_t count = qw_smooth_teeth(run->env, &run->surface, sqrt(SURFACE_STEP) * rho, with_boundary, cut);
    qw_free(run->env, cut);
    qw_did(run->env, QW_MECH_TEETH, count);
    if (count > 0) qw_log(run->env, QW_LOG_DEBUG, "%u teeth of borders became smooth", count);
}

/* Number of equilateral triangles, of the edge length given at its vertices, that would cover the surface. */
static double room_for(const qw_trimesh *s, const float *length)
{
    double room = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *c = s->corner + 3 * (size_t)f;
        double l = (length[c[0]] + length[c[1]] + length[c[2]]) / 3.0;
        room += 0.5 * qw_length(qw_face_cross(s, f)) / (QW_EQUILATERAL_AREA * l * l);
    }
    return room;
}

/* Makes it the surface. */
static void take_condensed(qw_run_state *run, const qw_trimesh *condensed)
{
    qw_env *env = run->env;
    qw_trimesh *s = &run->surface;
    qw_log(env, QW_LOG_DEBUG, "condensed from %u triangles", s->face_count);
    *s = *condensed;
    assert(s->face_count > 0);
    run->surface_census = qw_trimesh_census(env, s);
    qw_keep(env, s->position), qw_keep(env, s->corner), qw_keep(env, s->twin), qw_keep(env, s->mark);
    qw_keep(env, s->point);
    qw_keep(env, run->surface_census.component);
}

/* Triangles of a surface that is so dense, in edges of this length, that it is worth coarsening to them. */
static double dense_for(const qw_run_state *run, double edge)
{
    return run->core.area / (QW_EQUILATERAL_AREA * edge * edge);
}

/* To what the smallest quads need, so that the sizes of quads need not be found on all that is finer still. True where
   that is so much finer than most quads need that the surface is worth coarsening again. */
static bool condense_for_sizes(qw_run_state *run, double rho)
{
    double strength = run->input.density || run->options.around > 0 ? 1 : run->options.adaptive,
           smallest = qw_pow(SMALLER, strength) / (qw_follows_motion(run) ? (double)QW_MOST_SHORTER : 1),
           edge = QW_CONDENSED * smallest * rho;
    qw_trimesh even = qw_evenly_condensed_mesh(run->env, &run->surface, &run->surface_census, edge);
    if (even.corner != run->surface.corner) take_condensed(run, &even);
    return smallest < COARSEN_TWICE;
}

/* Frees what of a surface neither the run's nor the core has. */
static void free_surface(const qw_run_state *run, const qw_trimesh *s)
{
    const qw_trimesh *kept = &run->surface, *core = &run->core.mesh;
    if (s->position != kept->position && s->position != core->position) qw_free(run->env, s->position);
    if (s->corner != kept->corner && s->corner != core->corner) qw_free(run->env, s->corner);
    if (s->twin != kept->twin && s->twin != core->twin) qw_free(run->env, s->twin);
    if (s->mark != kept->mark && s->mark != core->mark) qw_free(run->env, s->mark);
    if (s->point != kept->point && s->point != core->point) qw_free(run->env, s->point);
}

/* A surface much finer than the quads is made coarser once, so that what follows, and runs for other counts, have less
 * to look at. */
static void condense(qw_run_state *run, double rho)
{
    rho = fmin(rho, sqrt(run->core.area / LEAST_CONDENSED));
    qw_env *env = run->env;
    qw_trimesh *s = &run->surface, fine = *s;
    if (qw_has_density(run) && (!condense_for_sizes(run, rho) || run->options.around > 0)) return;
    double share = QW_CONDENSED * (qw_keeps_rims(run) ? SMALLER : 1);
    if (s->face_count <= dense_for(run, share * rho)) return;
    qw_scope_begin(env);
    float *base_target, *length = qw_wanted_size(run, rho, &base_target, NULL, NULL);
    for (uint32_t v = 0; v < s->vertex_count; v++) length[v] *= (float)QW_CONDENSED;
    if (s->face_count > room_for(s, length)) {
        qw_trimesh even = *s, condensed = qw_condensed_mesh(env, s, &run->surface_census, length);
        take_condensed(run, &condensed);
        if (even.corner != fine.corner) free_surface(run, &even);
    }
    qw_scope_end(env);
}

/* Draws the curves that are to have rings, and makes the surface coarser. As there are rarely any, they are looked for
   on the coarser one; where there are it is made anew, with them. */
static void draw_and_condense(qw_run_state *run, double rho)
{
    const qw_trimesh fine = run->surface;
    const qw_census fine_census = run->surface_census;
    run->necks = (qw_necks){0};
    condense(run, rho);
    qw_necks found = qw_necks_of_surface(run, rho);
    const qw_trimesh coarse = run->surface;
    const qw_census coarse_census = run->surface_census;
    run->surface = fine, run->surface_census = fine_census;
    if (qw_engrave_necks(run, rho, &found)) condense(run, rho);
    else run->surface = coarse, run->surface_census = coarse_census;
    free_surface(run, &fine);
    if (coarse.corner != fine.corner) free_surface(run, &coarse);
}

/* The circles around which so many edges are asked for. No edge of the surface is longer than the quads', so that sizes
   may grow from one circle to the next. */
static void find_circles(qw_run_state *run, double rho)
{
    if (run->options.around == 0) return;
    double most = run->surface.face_count + PIECES * dense_for(run, rho);
    qw_trimesh cut = qw_without_long_edges(run->env, &run->surface, (float)rho, (uint32_t)fmin(most, QW_NONE / 8));
    run->circles = qw_find_circles(run->env, &run->surface, &cut, qw_turn_of_edge(run),
                                   run->options.align_boundary != 0);
    if (cut.vertex_count == run->surface.vertex_count) return;
    run->surface = cut;
    run->surface_census = qw_trimesh_census(run->env, &cut);
}

/* The core without small components, marked with feature edges and guides, coarser where it is much finer than the
 * quads. */
void qw_stage_SURFACE(qw_run_state *run)
{
    qw_require_few_faces(run);
    run->surface_faces = qw_surface_faces(run, &run->options);
    qw_set_core(run);
    qw_prepare_surface(run);
    qw_build_tree(run);
}

void qw_prepare_surface(qw_run_state *run)
{
    run->surface = run->core.mesh;
    run->surface_census = run->core.census;
    double rho = qw_edge_wanted(run, qw_faces_without_small(run, run->surface_faces));
    mark_features(run, rho);
    smooth_teeth(run, rho);
    run->tree = NULL; /* an earlier surface's */
    run->circles = NULL;
    qw_engrave_guides(run);
    draw_and_condense(run, rho);
    find_circles(run, rho);
}

/* Half the wanted edge length of the quads at each vertex, at the resolution of the working mesh. */
static float *half_sizes(const qw_run_state *run, double share)
{
    uint32_t n = run->working.mesh.vertex_count;
    float *half = QW_NEW(run->env, float, n);
    for (uint32_t v = 0; v < n; v++) half[v] = run->working.target[v] * (float)(share / 2);
    return half;
}

void qw_set_holds(qw_run_state *run)
{
    const qw_trimesh *mesh = &run->working.mesh;
    qw_resolution_request resolution = qw_resolution_of(run);
    float *reach = half_sizes(run, qw_working_edges(&resolution));
    for (uint32_t v = 0; v < mesh->vertex_count; v++) reach[v] *= 2 * (float)QW_CORNER_SPAN;
    uint8_t *cut = find_cut(run, mesh);
    bool aligns = run->options.align_boundary != 0 || cut; /* the cut is a boundary */
    qw_find_constraints(run->env, mesh, aligns, QW_CORNER_ANGLE, reach, cut, &run->constraint, &run->direction);
    qw_free(run->env, cut), qw_free(run->env, reach);
}

/* Directions in nests. */
static void direct_nests(qw_run_state *run, const qw_nests *nests)
{
    run->nested = NULL;
    if (nests->count == 0 || !qw_uses(run->env, QW_MECH_NESTS)) return;
    run->nested = QW_NEW_ZERO(run->env, qw_vec3, run->working.mesh.vertex_count);
    int64_t count = qw_direct_nests(run->env, &run->working.mesh, nests, run->constraint, run->nested);
    qw_did(run->env, QW_MECH_NESTS, count);
    for (uint32_t i = 0; i < nests->count; i++)
        qw_log(run->env, QW_LOG_DEBUG, "nest %u: edges of %.4g, %.3g and %.3g of them to each side", i,
               (double)nests->nest[i].edge / run->clean.frame.scale,
               (double)(nests->nest[i].reach[QW_LEFT] / nests->nest[i].edge),
               (double)(nests->nest[i].reach[QW_RIGHT] / nests->nest[i].edge));
}

/* Wanted sizes, the working mesh at them, which curves it can keep, and its normals. */
void qw_stage_WORKING(qw_run_state *run)
{
    qw_require_levels(run);
    qw_require_few_faces(run); /* checked again: a run with another count may begin here */
    qw_env *env = run->env;
    double faces = qw_faces_wanted(run, &run->options);
    run->faces_wanted = qw_core_faces(run, faces);
    run->rho = qw_edge_wanted(run, run->faces_wanted);
    assert(run->rho > 0);
    run->feature_density = qw_feature_density_of(run);
    run->report->faces_asked = (int64_t)faces;
    qw_warn_of_least(run);
    qw_advise_wrap(run);
    qw_resolution_request resolution = qw_resolution_of(run);
    double share = qw_working_edges(&resolution);
    qw_nests nests;
    float *base_target, *size = qw_wanted_size(run, run->rho, &base_target, &run->tips, &nests);
    bool has_spots = memcmp(size, base_target, run->surface.vertex_count * sizeof *size) != 0;
    for (uint32_t v = 0; v < run->surface.vertex_count; v++) size[v] /= (float)share, base_target[v] /= (float)share;
    run->working = qw_working_mesh(env, &run->surface, &run->surface_census, size, has_spots ? base_target : NULL);
    qw_free(env, size), qw_free(env, base_target);
    const qw_trimesh *mesh = &run->working.mesh;
    qw_unmark_nests(env, &run->working.mesh, &nests);
    run->report->nests = 0;
    for (uint32_t i = 0; i < nests.count; i++) run->report->nests += nests.nest[i].most_rings > 0;
    float *reach = half_sizes(run, share);
    run->curve_verdict = qw_decide_curves(env, mesh, reach);
    qw_unmark_curves(&run->working.mesh, run->curve_verdict);
    qw_free(env, reach);
    qw_set_holds(run);
    direct_nests(run, &nests);
    run->normal = qw_vertex_normals(env, mesh);
    if (qw_uses(env, QW_MECH_CREASE_NORMALS)) {
        qw_balance_creases(env, mesh, run->normal);
        qw_did(env, QW_MECH_CREASE_NORMALS, mesh->mark != NULL);
    }
    run->smoothed = QW_NEW(env, float, mesh->vertex_count);
    qw_smooth_normals(env, mesh, run->working.target, (float)(NORMAL_RADIUS * qw_smoothness(&resolution) * share),
                      run->normal, run->smoothed);
    run->report->refined_regions = run->plan.refinements;
    run->report->working_vertices = mesh->vertex_count;
    run->report->working_triangles = mesh->face_count;
}

qw_hierarchy *qw_build_hierarchy(const qw_run_state *run)
{
    uint32_t n = run->working.mesh.vertex_count;
    qw_hierarchy *h = QW_NEW(run->env, qw_hierarchy, 1);
    qw_vec3 *direction = QW_NEW(run->env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++)
        direction[v] = run->nested && run->constraint[v] == QW_VERTEX_FREE && qw_length2(run->nested[v]) > 0
                           ? run->nested[v]
                           : run->direction[v];
    *h = qw_hierarchy_build(run->env, &run->working.mesh, run->normal, run->constraint, direction);
    qw_free(run->env, direction);
    return h;
}

void qw_stage_HIERARCHY(qw_run_state *run)
{
    run->hierarchy = qw_build_hierarchy(run);
    run->report->hierarchy_levels = run->hierarchy->level_count;
}

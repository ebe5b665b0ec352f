#include "whole/kept_rims.h"

#include "whole/cut.h"
#include "whole/recut.h"

#include "whole/asked.h"
#include "base/elementary.h"
#include "remesh/sizes/density.h"
#include "remesh/sizes/scale.h"
#include "geometry/bvh.h"
#include "geometry/loops.h"
#include "whole/collar.h"
#include "remesh/relax/flip_repair.h"
#include "whole/written.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* No more than this share of the quads that were asked for is given to the rims. */
static const double MOST_OF_RIMS = 0.75;
/* For every edge of a rim there are so many quads inside at least, whatever was asked for: with fewer the strips would
   have no room. 0.25 leaves flipped quads in slots, 1 takes a quarter more quads than need be. */
static const double QUADS_AN_EDGE = 0.4;
/* More than this times the quads that were asked for are worth a warning. */
static const double MOST_OVER = 1.1;
/* A rim that is cut anew has so many edges at least. */
static const double LEAST_RECUT = 4;
#define COARSEST_RIM 3.6
/* Along a rim edges of the quads are wanted that are so many times as long as the rim's own, or more where there would
   not be enough quads left for the rest; and how much longer edges may get a unit of distance from there. */
static const double RIM_EDGES[] = {1.6, 2.4, COARSEST_RIM};
static const float RIM_GRADATION = 0.4f;
/* On an edge of a rim there are no more than so many edges of quads, but where that would be more than elsewhere. */
static const double MOST_ON_AN_EDGE = 2.4;
/* The edges elsewhere may get so many times as long for it. */
static const double MOST_COARSER = 1.6;
/* Teeth of a region's rim are looked for so often, each time behind those that were left out. */
enum { TOOTH_ROUNDS = 3 };
/* Edges of the rim on either side over which its spacing is averaged. */
enum { SPACING_REACH = 4 };
/* Vertices that cleaning has welded may be so far from where they were, in diagonals. */
static const double SAME_PLACE = 4e-6;

/* The vertex of the input at the tail of half-edge h of the clean surface: of its polygon. QW_NONE where cleaning has
   put a vertex that the input does not have. */
static uint32_t input_vertex(const qw_run_state *run, uint32_t h)
{
    const qw_clean_input *in = run->whole.input;
    const qw_frame *frame = &run->whole.clean.frame;
    qw_vec3 p = run->whole.clean.mesh.position[run->whole.clean.mesh.corner[h]];
    double at[3] = {(double)p.x, (double)p.y, (double)p.z}, least = INFINITY;
    uint32_t polygon = run->whole.clean.source_face[h / 3], best = QW_NONE;
    assert(polygon < in->face_count);
    qw_leave_own_frame(&run->whole.clean.own, p, at);
    for (uint32_t i = in->face_begin[polygon]; i < in->face_begin[polygon + 1]; i++) {
        const double *q = in->position + 3 * (size_t)in->corner[i];
        double d2 = 0;
        for (int k = 0; k < 3; k++) {
            double d = (q[k] - frame->center[k]) * frame->scale - at[k];
            d2 += d * d;
        }
        if (d2 < least) least = d2, best = in->corner[i];
    }
    return least < SAME_PLACE * SAME_PLACE ? best : QW_NONE;
}

/* ---- an even number of edges */

/* Of its area, what a triangle counts that has two boundary edges, and one on whose removal the surface falls apart at
   a vertex: these are left out only where there are no others. */
static const double TWO_EDGES = 1e-3, FALLS_APART = 1e-6;

/* How good it is to leave triangle f of the clean surface out, which changes the parity of its rim: its area, times
   less where it has two boundary edges, where the surface hangs together at a vertex only without it, and where it is
   all of a component beside others; 0: it must stay. */
static double worth_of(const qw_run_state *run, const uint8_t *on_rim, uint32_t f)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    const qw_clean_input *in = run->whole.input;
    uint32_t polygon = run->whole.clean.source_face[f], edges = 0, at = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
        if (m->twin[h] == QW_NONE) edges++, at = h;
    if (in->face_begin[polygon + 1] - in->face_begin[polygon] != 3 || edges == 0) return 0;
    if (edges == 3 && run->whole.census.components == m->face_count) return 0; /* nothing would be left */
    double times = edges == 2 ? TWO_EDGES : edges == 1 && on_rim[m->corner[qw_prev(at)]] ? FALLS_APART : 1;
    return (double)qw_length(qw_face_cross(m, f)) * times;
}

/* Leaves one triangle out of every component with an odd number of boundary edges. Returns how many. */
static uint32_t leave_out_odd(qw_run_state *run)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    qw_env *env = run->env;
    uint32_t components = (uint32_t)run->whole.census.components, count = 0;
    const uint32_t *component = run->whole.census.component;
    uint32_t *edges = QW_NEW_ZERO(env, uint32_t, components), *one = QW_NEW_ZERO(env, uint32_t, components),
             *best = QW_NEW_ZERO(env, uint32_t, components);
    double *most = QW_NEW_ZERO(env, double, components);
    uint8_t *on_rim = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (m->twin[h] == QW_NONE) edges[component[h / 3]]++, one[component[h / 3]] = h, on_rim[m->corner[h]] = 1;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double worth = edges[component[f]] % 2 == 1 ? worth_of(run, on_rim, f) : 0;
        if (worth > most[component[f]]) most[component[f]] = worth, best[component[f]] = f;
    }
    for (uint32_t c = 0; c < components; c++) {
        if (edges[c] % 2 == 0) continue;
        uint32_t v = run->whole.input->corner[run->whole.input->face_begin[run->whole.clean.source_face[one[c] / 3]]];
        if (most[c] == 0)
            qw_fail(
                env, QW_ARGUMENT, v,
                "the boundary at vertex %u cannot stay as it is: it has %u edges, quads alone have an even number of "
                "them, and no triangle there can be kept",
                v, edges[c]);
        if (!run->whole.left_out) run->whole.left_out = QW_NEW_ZERO(env, uint8_t, run->whole.input->face_count);
        run->whole.left_out[run->whole.clean.source_face[best[c]]] = 1, count++;
    }
    qw_free(env, edges), qw_free(env, one), qw_free(env, best), qw_free(env, most), qw_free(env, on_rim);
    return count;
}

/* Leaves out triangles that have two edges on the rim, unless nothing else is there. Returns how many. */
static uint32_t leave_out_teeth(qw_run_state *run)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    uint8_t *none = QW_NEW_ZERO(run->env, uint8_t, m->vertex_count);
    uint32_t *tooth = QW_NEW(run->env, uint32_t, m->face_count), count = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        uint32_t edges = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) edges += m->twin[h] == QW_NONE;
        if (edges == 2 && worth_of(run, none, f) > 0) tooth[count++] = f;
    }
    if (count == m->face_count) count = 0;
    for (uint32_t i = 0; i < count; i++) run->whole.left_out[run->whole.clean.source_face[tooth[i]]] = 1;
    qw_free(run->env, none), qw_free(run->env, tooth);
    return count;
}

/* Whether the rim between the region and the rest is cut anew. */
static bool is_recut(const qw_run_state *run)
{
    bool may_be_half = run->options.symmetry != QW_SYMMETRY_NONE && run->options.symmetry != QW_SYMMETRY_AUTO;
    return run->whole.steering->region && run->options.region_rim && !may_be_half;
}

bool qw_keeps_rims(const qw_run_state *run) { return run->options.fix_boundary || run->whole.steering->region; }

static void clean_once(qw_run_state *run)
{
    qw_clean_input inside = *run->whole.input;
    inside.left_out = run->whole.left_out;
    double least = run->whole.steering->region ? 0
                                               : run->options.min_component; /* a part of a region is no component */
    run->whole.clean = qw_clean_surface(run->env, &inside, least, run->options.outward != 0);
    run->whole.census = qw_trimesh_census_of(run->env, &run->whole.clean.mesh, run->whole.clean.component,
                                             run->whole.clean.components);
}

/* Leaves out teeth of a region's rim, and those behind them. */
static void take_teeth_off(qw_run_state *run)
{
    char text[160];
    uint32_t all = 0, some = 1;
    for (int round = 0; round < TOOTH_ROUNDS && some > 0; round++) {
        all += some = leave_out_teeth(run);
        if (some > 0) clean_once(run);
    }
    snprintf(text, sizeof text,
             "%u triangles with two edges on the rim of the region stay as they are: quads there were flipped", all);
    if (all > 0) qw_warn(run, text);
}

void qw_clean_inside(qw_run_state *run)
{
    const uint8_t *region = run->whole.steering->region;
    run->whole.left_out = NULL;
    if (region) {
        run->whole.left_out = QW_NEW(run->env, uint8_t, run->whole.input->face_count);
        for (uint32_t f = 0; f < run->whole.input->face_count; f++) run->whole.left_out[f] = !region[f];
    }
    if (region && run->options.min_component > 0)
        qw_warn(run, "in a region no component is dropped, as the polygons around it would get a hole");
    clean_once(run);
    if (!qw_keeps_rims(run)) return;
    if (run->plan.keeps_teeth) take_teeth_off(run);
    while (!is_recut(run) &&
           leave_out_odd(run) > 0) { /* which may leave several components of one; each time there are fewer faces */
        clean_once(run);
        qw_heartbeat(run->env);
    }
    run->report->kept_faces = 0;
    for (uint32_t f = 0; run->whole.left_out && f < run->whole.input->face_count; f++)
        run->report->kept_faces += run->whole.left_out[f];
}

/* ---- rims that are cut anew */

/* The rims of the clean surface as vertices of the input. */
static qw_old_rims list_rims(const qw_run_state *run)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    qw_env *env = run->env;
    qw_rims rims = qw_find_rims(env, 3, m->twin, m->face_count);
    uint32_t all = rims.begin[rims.count];
    qw_old_rims old = {rims.count, rims.begin, QW_NEW(env, uint32_t, all), QW_NEW(env, uint32_t, rims.count)};
    for (uint32_t i = 0; i < all; i++) old.vertex[i] = input_vertex(run, rims.half[i]);
    for (uint32_t l = 0; l < rims.count; l++)
        old.component[l] = run->whole.census.component[rims.half[rims.begin[l]] / 3];
    return old;
}

/* uint32_t[vertices of the input]: as qw_weld_along_rims. Polygons were left out. */
static uint32_t *weld_rims(const qw_run_state *run)
{
    qw_old_rims old = list_rims(run);
    return qw_weld_along_rims(run->env, run->whole.input, run->whole.left_out, &old);
}

/* With vertices as far apart as the edges of so many quads inside are long. There is a rim. */
static qw_recut recut_for(const qw_run_state *run, const qw_old_rims *old, double inside)
{
    double edge = sqrt(run->whole.area / inside) / run->whole.clean.frame.scale;
    return qw_recut_rims(run->env, run->whole.input, run->whole.left_out, old, edge);
}

/* As it is for the count that is asked for. begin: NULL where there is no rim that is cut anew. */
static qw_recut recut_of(const qw_run_state *run)
{
    if (!is_recut(run)) return (qw_recut){0};
    qw_old_rims old = list_rims(run);
    if (old.count == 0) return (qw_recut){0};
    return recut_for(run, &old, qw_faces_inside_rims(run, qw_faces_wanted(run, &run->options)));
}

/* ---- what was left out */

qw_outside qw_list_outside(const qw_run_state *run)
{
    const qw_clean_input *in = run->whole.input;
    qw_env *env = run->env;
    qw_recut cut = recut_of(run);
    if (cut.begin) return (qw_outside){cut.face_count, cut.face_begin, cut.source, cut.corner, cut.origin};
    uint32_t corners = 0, faces = 0;
    for (uint32_t f = 0; f < in->face_count; f++)
        if (run->whole.left_out[f]) faces++, corners += in->face_begin[f + 1] - in->face_begin[f];
    qw_outside o = {0, QW_NEW(env, uint32_t, (size_t)faces + 1), QW_NEW(env, uint32_t, faces),
                    QW_NEW(env, uint32_t, corners), QW_NEW(env, uint32_t, corners)};
    o.face_begin[0] = corners = 0;
    for (uint32_t f = 0; f < in->face_count; f++) {
        if (!run->whole.left_out[f]) continue;
        for (uint32_t i = in->face_begin[f]; i < in->face_begin[f + 1]; i++, corners++)
            o.vertex[corners] = in->corner[i], o.origin[corners] = i;
        o.source[o.face_count++] = f, o.face_begin[o.face_count] = corners;
    }
    assert(o.face_count == faces && o.face_begin[faces] == corners);
    return o;
}

uint32_t qw_rim_vertices(const qw_run_state *run) { return run->whole.input->vertex_count + recut_of(run).made_count; }

/* Where a vertex of the input is, or one that was made for a rim that is cut anew. */
static const double *position_of(const qw_run_state *run, const qw_recut *cut, uint32_t id)
{
    uint32_t n = run->whole.input->vertex_count;
    return id < n ? run->whole.input->position + 3 * (size_t)id : cut->made + 3 * (size_t)(id - n);
}

/* ---- how many quads */

/* Quads that the collars take where the others have edges this long. */
static double faces_of_collars(const qw_run_state *run, const qw_rims *rims, double edge)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    double sum = 0;
    for (uint32_t l = 0; l < rims->count; l++) {
        double length = 0;
        for (uint32_t i = rims->begin[l]; i < rims->begin[l + 1]; i++)
            length += (double)qw_distance(m->position[m->corner[rims->half[i]]],
                                          m->position[m->corner[qw_next(rims->half[i])]]);
        double outer = is_recut(run) ? fmax(length / edge, LEAST_RECUT) : rims->begin[l + 1] - rims->begin[l];
        sum += qw_collar_faces(outer, fmax(fmax(length / edge, outer / COARSEST_RIM), 3));
    }
    return sum;
}

double qw_faces_inside_rims(const qw_run_state *run, double faces)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    if (!qw_keeps_rims(run)) return faces;
    qw_scope_begin(run->env);
    qw_rims rims = qw_find_rims(run->env, 3, m->twin, m->face_count);
    double low = faces * (1 - MOST_OF_RIMS), high = faces;
    for (int i = 0; i < 20 && rims.count > 0; i++) { /* the fewer quads inside, the larger they are */
        double middle = (low + high) / 2;
        if (middle + faces_of_collars(run, &rims, sqrt(run->whole.area / middle)) > faces) high = middle;
        else low = middle;
    }
    assert(low >= 0 && low <= faces);
    double edges = rims.begin[rims.count];
    if (is_recut(run) && rims.count > 0) {
        qw_old_rims old = list_rims(run);
        qw_recut cut = recut_for(run, &old, fmax(low, 1));
        edges = cut.begin[rims.count];
    }
    double least = (run->plan.keeps_teeth ? 1 : QUADS_AN_EDGE) * edges;
    qw_scope_end(run->env);
    return rims.count > 0 ? fmax(fmax(low, least), 1) : faces;
}

void qw_warn_of_least(qw_run_state *run)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    char text[sizeof run->report->warnings[0]];
    if (!qw_keeps_rims(run) || is_recut(run)) return;
    qw_scope_begin(run->env);
    qw_rims rims = qw_find_rims(run->env, 3, m->twin, m->face_count);
    double edges = rims.begin[rims.count], least = QUADS_AN_EDGE * edges;
    for (uint32_t l = 0; l < rims.count; l++) {
        double outer = rims.begin[l + 1] - rims.begin[l];
        least += qw_collar_faces(outer, fmax(outer / COARSEST_RIM, 3));
    }
    qw_scope_end(run->env);
    if (least <= MOST_OVER * (double)run->report->faces_asked) return;
    snprintf(text, sizeof text,
             "the boundary has %.0f vertices that stay, and with them there are about %.0f quads at the least%s", edges,
             least, run->whole.steering->region ? " (region_rim free cuts the rim of a region anew)" : "");
    if (run->plan.refinements == 0) qw_log(run->env, QW_LOG_INFO, "%s", text);
    qw_warn(run, text);
}

/* ---- how large they are along the rims */

/* Mean length of the edges of the clean surface's rims around each of them, by its number among all: float[]. */
static float *spacings(const qw_run_state *run, const qw_rims *rims)
{
    const qw_trimesh *m = &run->clean.mesh;
    float *spacing = QW_NEW(run->env, float, rims->begin[rims->count]);
    qw_recut cut = recut_of(run);
    for (uint32_t l = 0; l < rims->count; l++) {
        uint32_t begin = rims->begin[l], n = rims->begin[l + 1] - begin;
        float length = 0; /* of a loop that is cut anew, over its new edges */
        for (uint32_t i = 0; cut.begin && i < n; i++)
            length += qw_edge_length(m, rims->half[begin + i]) / (float)(cut.begin[l + 1] - cut.begin[l]);
        for (uint32_t i = 0; i < n; i++) {
            float sum = 0;
            uint32_t count = 2 * SPACING_REACH + 1 < n ? 2 * SPACING_REACH + 1 : n;
            for (uint32_t k = 0; k < count; k++) {
                uint32_t h = rims->half[begin + (i + n - count / 2 + k) % n];
                sum += qw_edge_length(m, h);
            }
            spacing[begin + i] = cut.begin ? length : sum / (float)count;
        }
    }
    return spacing;
}

/* Whether a boundary edge of run->surface is no rim of the input, but lies in the plane of symmetry. */
static bool is_cut(const qw_run_state *run, uint32_t h)
{
    const qw_trimesh *s = &run->surface;
    return qw_cuts_at(run, s->position[s->corner[h]]) & qw_cuts_at(run, s->position[s->corner[qw_next(h)]]);
}

/* The spacing at each rim vertex of run->surface, and infinity elsewhere: float[vertices]. NULL: there is no rim. */
static float *spacing_on_surface(const qw_run_state *run)
{
    const qw_trimesh *m = &run->clean.mesh, *s = &run->surface;
    qw_env *env = run->env;
    qw_rims rims = qw_find_rims(env, 3, m->twin, m->face_count);
    uint32_t all = rims.begin[rims.count];
    if (all == 0) return NULL;
    float *spacing = spacings(run, &rims), *at = QW_NEW(env, float, s->vertex_count);
    qw_vec3 *from = QW_NEW(env, qw_vec3, all), *to = QW_NEW(env, qw_vec3, all);
    for (uint32_t i = 0; i < all; i++)
        from[i] = m->position[m->corner[rims.half[i]]], to[i] = m->position[m->corner[qw_next(rims.half[i])]];
    const qw_curve_tree *tree = qw_curve_tree_build(env, from, to, all);
    for (uint32_t v = 0; v < s->vertex_count; v++) at[v] = INFINITY;
    bool any = false;
    for (uint32_t h = 0; h < 3 * s->face_count; h++)
        if (s->twin[h] == QW_NONE && !is_cut(run, h)) {
            uint32_t v = s->corner[h];
            any = true, at[v] = spacing[qw_curve_nearest(tree, s->position[v], INFINITY).segment];
        }
    return any ? at : NULL;
}

/* The sizes times a factor, but along the rims no more than so many of their edges, and growing from there. */
static void limit_sizes(const qw_run_state *run, const float *size, const float *spacing, double factor, double edges,
                        float *limited)
{
    const qw_trimesh *s = &run->surface;
    for (uint32_t v = 0; v < s->vertex_count; v++)
        limited[v] = fminf((float)factor * size[v], (float)edges * spacing[v]);
    qw_limit_gradation(run->env, s, limited, RIM_GRADATION);
}

/* Raises sizes near rims whose edges are much longer, to a share of those, by less the farther from there. */
static void raise_sizes(const qw_run_state *run, const float *spacing, float *size)
{
    const qw_trimesh *s = &run->surface;
    float *below = QW_NEW(run->env, float, s->vertex_count); /* minus the least size */
    for (uint32_t v = 0; v < s->vertex_count; v++)
        below[v] = spacing[v] < INFINITY ? -spacing[v] / (float)MOST_ON_AN_EDGE : 0;
    qw_limit_gradation(run->env, s, below, RIM_GRADATION);
    for (uint32_t v = 0; v < s->vertex_count; v++) size[v] = fmaxf(size[v], -below[v]);
    qw_free(run->env, below);
}

void qw_fit_rims(const qw_run_state *run, float *size)
{
    const qw_trimesh *s = &run->surface;
    qw_scope_begin(run->env);
    float *spacing = spacing_on_surface(run), *limited = QW_NEW(run->env, float, s->vertex_count);
    double count = spacing ? qw_quads_of_size(s, size) : 0;
    for (size_t i = 0; spacing && i < sizeof RIM_EDGES / sizeof *RIM_EDGES; i++) {
        double low = 1, high = MOST_COARSER;
        limit_sizes(run, size, spacing, high, RIM_EDGES[i], limited);
        if (qw_quads_of_size(s, limited) > count && i + 1 < sizeof RIM_EDGES / sizeof *RIM_EDGES) continue;
        for (int k = 0; k < 8; k++) {
            double middle = (low + high) / 2;
            limit_sizes(run, size, spacing, middle, RIM_EDGES[i], limited);
            if (qw_quads_of_size(s, limited) > count) low = middle;
            else high = middle;
        }
        memcpy(size, limited, s->vertex_count * sizeof *size);
        break;
    }
    if (spacing) raise_sizes(run, spacing, size);
    qw_scope_end(run->env);
}

/* ---- the collars */

/* Of the clean surface, by the vertices of the input; QW_NONE: one that cleaning has made. */
static qw_outer_rims rims_of_input(const qw_run_state *run, const qw_trimesh *surface)
{
    qw_outer_rims outer = qw_rims_of_surface(run->env, surface);
    qw_old_rims old = list_rims(run);
    outer.id = old.vertex;
    return outer;
}

/* The place in edges along a loop of the surface. */
static qw_vec3 point_along(const qw_outer_rims *rims, uint32_t l, double along)
{
    uint32_t begin = rims->begin[l], n = rims->begin[l + 1] - begin;
    double whole = qw_floor(along);
    uint32_t i = (uint32_t)whole % n;
    return qw_lerp(rims->position[begin + i], rims->position[begin + (i + 1) % n], (float)(along - whole));
}

/* Those that are cut anew. */
static qw_outer_rims recut_rims(const qw_run_state *run, const qw_trimesh *surface)
{
    qw_outer_rims outer = qw_rims_of_surface(run->env, surface);
    qw_recut cut = recut_of(run);
    if (!cut.begin) return outer;
    qw_vec3 *position = QW_NEW(run->env, qw_vec3, cut.begin[outer.count]);
    for (uint32_t l = 0; l < outer.count; l++)
        for (uint32_t i = cut.begin[l]; i < cut.begin[l + 1]; i++) position[i] = point_along(&outer, l, cut.along[i]);
    return (qw_outer_rims){outer.count, cut.begin, position, cut.vertex, outer.component};
}

qw_quadmesh qw_fix_rims(qw_run_state *run, const qw_quadmesh *quads, uint32_t **rim)
{
    const qw_trimesh *m = &run->whole.clean.mesh;
    qw_env *env = run->env;
    qw_quadmesh numbered = *quads;
    qw_trimesh parted = *m;
    if (!run->mirror.is_used) /* components of the core may have become one, or two, in the whole */
        numbered.component = qw_clean_components(run, quads), parted.component = run->clean_census.component;
    qw_outer_rims outer = is_recut(run) ? recut_rims(run, &parted) : rims_of_input(run, &parted);
    qw_collar collar = qw_add_collar(env, &numbered, &parted, &outer);
    assert(collar.quads.face_count >= quads->face_count);
    qw_flip_repair repair = {.surface = &parted};
    uint8_t *flipped = QW_NEW(env, uint8_t, collar.quads.face_count);
    qw_flip_counts left = qw_repair_flips(env, &collar.quads, &repair, flipped);
    if (run->whole.steering->region) run->rims_flipped = left.flipped_left + left.doubtful_left;
    qw_free(env, flipped);
    run->report->rim_vertices = 0;
    for (uint32_t v = 0; v < collar.quads.vertex_count; v++)
        run->report->rim_vertices += collar.rim[v] < run->whole.input->vertex_count;
    run->report->rim_faces = collar.added;
    *rim = collar.rim;
    return collar.quads;
}

uint8_t *qw_list_rims(const qw_run_state *run)
{
    if (!run->rim) return NULL;
    uint8_t *kept = QW_NEW(run->env, uint8_t, run->finished.vertex_count);
    for (uint32_t v = 0; v < run->finished.vertex_count; v++) kept[v] = run->rim[v] != QW_NONE;
    return kept;
}

uint32_t qw_put_rims(const qw_run_state *run, const qw_quadmesh *quads, double *output)
{
    qw_recut cut = recut_of(run);
    for (uint32_t v = 0; v < quads->vertex_count; v++)
        if (run->rim[v] != QW_NONE)
            memcpy(output + 3 * (size_t)v, position_of(run, &cut, run->rim[v]), 3 * sizeof *output);
    for (uint32_t f = 0; f < quads->face_count; f++)
        if (qw_is_degenerate(quads->corner + 4 * (size_t)f, output)) return f;
    return QW_NONE;
}

void qw_warn_of_rims(qw_run_state *run)
{
    const qw_report *r = run->report;
    char text[256];
    if (!run->rim || run->finished.face_count <= MOST_OVER * (double)r->faces_asked) return;
    snprintf(text, sizeof text,
             "the boundary has %lld vertices that stay, and %lld quads lie along it: there are %u quads, not %lld",
             (long long)r->rim_vertices, (long long)r->rim_faces, run->finished.face_count, (long long)r->faces_asked);
    qw_warn(run, text);
}

/* ---- the quads and what was left out */

/* Numbers for vertices of the input, and for those that were made, in the joined mesh. */
typedef struct numbering {
    const qw_run_state *run;
    qw_outside outside;
    qw_recut cut;
    uint32_t *same;     /* uint32_t[vertices of the input]: the least vertex that is one with each (rim_weld.h) */
    uint32_t *of_input; /* uint32_t[vertices of the input and made ones]: number in the joined mesh, or QW_NONE */
} numbering;

/* Where the number of a vertex of the input, or of a made one, is. */
static uint32_t *number_of(const numbering *n, uint32_t v)
{
    return &n->of_input[v < n->run->whole.input->vertex_count ? n->same[v] : v];
}

/* Numbers of the quads' vertices in the joined mesh: uint32_t[finished.vertex_count]. Vertices of rims that are one
   vertex of the input become one. Sets joined.vertex_count. */
static uint32_t *number_quads(qw_run_state *run, numbering *n)
{
    uint32_t *number = QW_NEW(run->env, uint32_t, run->finished.vertex_count), count = 0;
    for (uint32_t v = 0; v < run->finished.vertex_count; v++) {
        uint32_t *known = run->rim[v] != QW_NONE ? number_of(n, run->rim[v]) : NULL;
        number[v] = known && *known != QW_NONE ? *known : count++;
        if (known) *known = number[v];
    }
    run->joined.vertex_count = count;
    return number;
}

static void number_left_out(qw_run_state *run, numbering *n)
{
    qw_joined *j = &run->joined;
    uint32_t corners = n->outside.face_begin[n->outside.face_count];
    j->face_count += n->outside.face_count, j->corner_count += corners;
    for (uint32_t i = 0; i < corners; i++) {
        uint32_t *number = number_of(n, n->outside.vertex[i]);
        if (*number == QW_NONE) *number = j->vertex_count++;
    }
}

/* Fills the joined mesh: the quads first, then the polygons of the input outside of them. */
static void fill_joined(qw_run_state *run, const numbering *n, const uint32_t *number)
{
    assert(run->joined.face_count == run->finished.face_count + n->outside.face_count);
    const qw_quadmesh *q = &run->finished;
    const qw_outside *o = &n->outside;
    qw_joined *j = &run->joined;
    for (uint32_t v = 0; v < q->vertex_count; v++)
        memcpy(j->position + 3 * (size_t)number[v], run->output + 3 * (size_t)v, 3 * sizeof *j->position);
    for (uint32_t f = 0; f < q->face_count; f++) j->face_size[f] = 4;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) j->corner[h] = number[q->corner[h]];
    for (uint32_t f = 0; f < o->face_count; f++)
        j->face_size[q->face_count + f] = o->face_begin[f + 1] - o->face_begin[f];
    for (uint32_t i = 0; i < o->face_begin[o->face_count]; i++) {
        uint32_t to = *number_of(n, o->vertex[i]);
        j->corner[4 * (size_t)q->face_count + i] = to;
        memcpy(j->position + 3 * (size_t)to, position_of(run, &n->cut, o->vertex[i]), 3 * sizeof *j->position);
    }
}

void qw_join_left_out(qw_run_state *run)
{
    qw_env *env = run->env;
    qw_joined *j = &run->joined;
    *j = (qw_joined){0};
    bool joins = run->whole.left_out && run->rim;
    if (joins) j->face_count = run->finished.face_count, j->corner_count = 4 * run->finished.face_count;
    uint32_t *number = NULL;
    numbering n = {.run = run};
    if (joins) {
        n.cut = recut_of(run), n.outside = qw_list_outside(run);
        size_t all = (size_t)run->whole.input->vertex_count + n.cut.made_count;
        n.of_input = QW_NEW(env, uint32_t, all), n.same = weld_rims(run);
        memset(n.of_input, 0xff, all * sizeof *n.of_input);
        run->report->kept_faces = n.outside.face_count;
        number = number_quads(run, &n);
        number_left_out(run, &n);
    }
    j->position = QW_NEW(env, double, 3 * (size_t)j->vertex_count);
    j->face_size = QW_NEW(env, uint32_t, j->face_count), j->corner = QW_NEW(env, uint32_t, j->corner_count);
    if (joins) fill_joined(run, &n, number);
    qw_free(env, n.of_input), qw_free(env, n.same), qw_free(env, number);
}

qw_mesh_view qw_view_of_result(const qw_run_state *run)
{
    const qw_joined *j = &run->joined;
    qw_mesh_view view = {.size = sizeof view, .uniform_face_size = 4};
    if (j->face_count > 0) {
        view.vertex_count = j->vertex_count, view.face_count = j->face_count;
        view.positions = j->position, view.face_sizes = j->face_size, view.corners = j->corner;
    } else {
        view.vertex_count = run->finished.vertex_count, view.face_count = run->finished.face_count;
        view.positions = run->output, view.corners = run->finished.corner;
    }
    if (j->face_count == 0 && run->coarse.face_count == 0)
        view.marked_edges = run->creases, view.marked_edge_count = run->crease_count;
    return view;
}

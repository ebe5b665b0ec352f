/* The steps of cleaning, in their order. Welding of equal positions sees the coordinates of the file; everything after
 * it the centred frame, in double, so that huge, tiny and far coordinates are no special cases. */
#include "remesh/clean/clean.h"

#include "base/mechanisms.h"
#include "base/sets.h"
#include "remesh/clean/junctions.h"
#include "remesh/clean/own_frame.h"
#include "geometry/triangulate.h"
#include "remesh/clean/unfold.h"
#include "geometry/weld.h"

#include <assert.h>
#include <string.h>

/* Boundary vertices closer than this share of the bounding box's diagonal may be one vertex written twice. */
static const double NEAR = 1e-6;
/* How far the edges of one rim of a slit that sewing has left may lie off the vertices of the other: chords of a curve.
 */
static const double SLIT = 1e-3;

/* Marks the vertices on edges with one side; returns their number. */
static uint32_t find_open(const qw_sheets *s, const qw_edges *edges, uint8_t *open)
{
    assert(edges->begin && open);
    uint32_t count = 0;
    memset(open, 0, s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i == 1) open[v] = open[qw_side_upper(edges->side[i])] = 1;
        }
    for (uint32_t v = 0; v < s->vertex_count; v++) count += open[v];
    return count;
}

static qw_edges edges_of(qw_env *env, const qw_sheets *s)
{
    return qw_edges_build(env, 3, s->corner, s->face_count, s->vertex_count);
}

/* Edges are gathered again only where something was joined. */
static void gather_again(qw_env *env, const qw_sheets *s, qw_edges *edges)
{
    qw_edges_free(env, edges);
    *edges = edges_of(env, s);
}

/* Joins vertices at equal positions: all of them, or those on open edges. */
static void weld(qw_env *env, qw_sheets *s, const qw_clean_input *input, qw_edges *edges, qw_clean_counts *counts)
{
    uint8_t *open = NULL;
    if (!input->separate_corners) {
        open = QW_NEW(env, uint8_t, s->vertex_count);
        if (find_open(s, edges, open) == 0) return;
        s->named = QW_NEW(env, uint32_t, 3 * (size_t)s->face_count), s->names = s->vertex_count;
        memcpy(s->named, s->corner, 3 * (size_t)s->face_count * sizeof *s->named);
    }
    uint32_t welded = qw_weld_equal(env, input->position, s->vertex_count, open, s->corner, s->face_count),
             dropped = qw_drop_degenerate(s);
    counts->welded_vertices += welded, counts->dropped_degenerate += dropped;
    if (welded + dropped > 0) gather_again(env, s, edges);
}

/* Joins what is nearly at one position. */
static void weld_near(qw_env *env, qw_sheets *s, double near, const uint8_t *only, qw_edges *edges,
                      qw_clean_counts *counts)
{
    uint32_t welded = qw_weld_near(env, s->position, s->vertex_count, near, only, edges, s->corner, s->face_count);
    counts->welded_vertices += welded;
    if (welded > 0) gather_again(env, s, edges);
}

/* What is sewn is sewn whole: a boundary that runs on from vertices where edges were split may have others that lie
   somewhat further apart, of which slits would be left. */
static void close_slits(qw_env *env, qw_sheets *s, uint8_t *sewn, qw_edges *edges, qw_clean_counts *counts)
{
    uint32_t *loop = QW_NEW(env, uint32_t, s->vertex_count);
    uint8_t *only = QW_NEW_ZERO(env, uint8_t, s->vertex_count), *open = QW_NEW(env, uint8_t, s->vertex_count);
    qw_sets_begin(loop, s->vertex_count);
    find_open(s, edges, open);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i == 1) qw_join_sets(loop, v, qw_side_upper(edges->side[i]));
        }
    for (uint32_t v = 0; v < s->vertex_count; v++)
        if (sewn[v] && open[v]) only[qw_set_of(loop, v)] = 1;
    for (uint32_t v = 0; v < s->vertex_count; v++) open[v] &= only[qw_set_of(loop, v)];
    weld_near(env, s, 10 * NEAR, open, edges, counts);
    counts->sewn_junctions += qw_sew_junctions(env, s, SLIT, edges, open, sewn);
    gather_again(env, s, edges);
    qw_free(env, loop), qw_free(env, only), qw_free(env, open);
}

/* Splits edges at vertices that lie on them. */
static void sew(qw_env *env, qw_sheets *s, qw_edges *edges, qw_clean_counts *counts)
{
    if (!qw_uses(env, QW_MECH_JUNCTIONS)) return;
    uint8_t *sewn = QW_NEW_ZERO(env, uint8_t, s->vertex_count);
    counts->sewn_junctions = qw_sew_junctions(env, s, NEAR, edges, NULL, sewn);
    qw_did(env, QW_MECH_JUNCTIONS, counts->sewn_junctions);
    if (counts->sewn_junctions > 0) {
        gather_again(env, s, edges);
        close_slits(env, s, sewn, edges, counts);
    }
    qw_free(env, sewn);
}

/* ---- frame */

typedef struct box {
    double low[3], high[3];
} box;

static const box empty_box = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

typedef struct boxing {
    const qw_sheets *sheets;
    const double *position;
    box *boxes; /* box[blocks] */
} boxing;

/* The box around the corners of a block's triangles. */
static void hold_corners(void *user, uint32_t begin, uint32_t end)
{
    const boxing *a = user;
    box b = empty_box;
    for (size_t h = 3 * (size_t)begin; h < 3 * (size_t)end; h++)
        for (int k = 0; k < 3; k++) {
            double x = a->position[3 * (size_t)a->sheets->corner[h] + k];
            if (x < b.low[k]) b.low[k] = x;
            if (x > b.high[k]) b.high[k] = x;
        }
    a->boxes[begin / QW_GRAIN_LIGHT] = b;
}

/* The box around all corners; vertices without a triangle do not count. */
static box box_of_corners(qw_env *env, const qw_sheets *s, const double *position)
{
    uint32_t blocks = qw_block_count(s->face_count, QW_GRAIN_LIGHT);
    boxing a = {s, position, QW_NEW(env, box, blocks)};
    qw_parallel(env, s->face_count, QW_GRAIN_LIGHT, hold_corners, &a);
    box all = empty_box;
    for (uint32_t b = 0; b < blocks; b++)
        for (int k = 0; k < 3; k++) {
            all.low[k] = fmin(all.low[k], a.boxes[b].low[k]);
            all.high[k] = fmax(all.high[k], a.boxes[b].high[k]);
        }
    qw_free(env, a.boxes);
    return all;
}

/* The frame of the vertices that have faces. Coordinates are halved where their differences could overflow. */
static qw_frame find_frame(qw_env *env, const qw_sheets *s, const double *position)
{
    assert(position && s->corner);
    box b = box_of_corners(env, s, position);
    double half[3];
    qw_frame frame;
    double most = 0, sum = 0, longest = 0;
    for (int k = 0; k < 3; k++) {
        frame.center[k] = b.low[k] / 2 + b.high[k] / 2;
        half[k] = b.high[k] / 2 - b.low[k] / 2;
        most = fmax(most, half[k]);
        longest = fmax(longest, b.high[k] - b.low[k]);
    }
    for (int k = 0; k < 3 && most > 0; k++) sum += half[k] / most * (half[k] / most);
    frame.scale = 0.5 / sqrt(sum) / most;
    if (!(longest > 0)) qw_fail(env, QW_ONLY_DEGENERATE, -1, "all faces lie in one point");
    if (!isfinite(frame.scale))
        qw_fail(env, QW_ONLY_DEGENERATE, -1,
                "the surface is %.3g long: in double precision so little has no area; scale the input up", longest);
    return frame;
}

static double *centred_positions(qw_env *env, const qw_frame *frame, const double *position, uint32_t count)
{
    assert(frame->scale > 0 && position);
    double *p = QW_NEW(env, double, 3 * (size_t)count);
    for (size_t v = 0; v < count; v++)
        for (size_t k = 0; k < 3; k++) p[3 * v + k] = (position[3 * v + k] - frame->center[k]) * frame->scale;
    return p;
}

/* Fits the frame again, as dropped components may have left the others in a corner of it. */
static void tighten_frame(qw_env *env, qw_sheets *s, qw_frame *frame)
{
    assert(s->point && s->position);
    double *p = QW_NEW(env, double, 3 * (size_t)s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        for (size_t k = 0; k < 3; k++) p[3 * (size_t)v + k] = s->position[3 * (size_t)s->point[v] + k];
        s->point[v] = v;
    }
    qw_frame inner = find_frame(env, s, p);
    s->position = centred_positions(env, &inner, p, s->vertex_count);
    s->point_count = s->vertex_count;
    for (int k = 0; k < 3; k++) frame->center[k] += inner.center[k] / frame->scale;
    frame->scale *= inner.scale;
}

/* The largest coordinate of the frame, in its own lengths: rounding of the coordinates goes with it. */
static double offset_of(const qw_frame *frame)
{
    double offset = 1;
    for (int k = 0; k < 3; k++) offset = fmax(offset, fabs(frame->center[k]) * frame->scale);
    return offset;
}

static bool has_area(const qw_sheets *s, const qw_frame *frame)
{
    double offset = offset_of(frame);
    for (uint32_t f = 0; f < s->face_count; f++)
        if (qw_face_has_area(s, f, offset)) return true;
    return false;
}

/* ---- result */

/* The cleaned surface in single precision, out of the sheets: kept after the scope. Components that single
 * precision would flatten get frames of their own. */
static qw_clean result_of(qw_env *env, const qw_sheets *s, const qw_frame *frame, const qw_clean_counts *counts)
{
    assert(s->components <= s->face_count);
    qw_clean c = {.frame = *frame,
                  .component = s->component,
                  .components = s->components,
                  .source_face = s->source,
                  .counts = *counts};
    c.mesh = (qw_trimesh){
        .vertex_count = s->vertex_count, .face_count = s->face_count, .corner = s->corner, .twin = s->twin};
    c.mesh.position = QW_NEW(env, qw_vec3, s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        const double *p = s->position + 3 * (size_t)s->point[v];
        c.mesh.position[v] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
    }
    if (qw_uses(env, QW_MECH_OWN_FRAMES)) c.own = qw_take_own_frames(env, s, c.mesh.position);
    qw_did(env, QW_MECH_OWN_FRAMES, c.own.count);
    if (c.own.count > 0) qw_log(env, QW_LOG_DEBUG, "%u components have frames of their own", c.own.count);
    qw_keep(env, c.own.frame);
    qw_keep(env, c.mesh.position);
    qw_keep(env, c.mesh.corner);
    qw_keep(env, c.mesh.twin);
    qw_keep(env, c.source_face);
    qw_keep(env, c.component);
    return c;
}

/* Makes a manifold of the welded triangles. */
static void make_sheets(qw_env *env, qw_sheets *s, qw_edges *edges, double least_share, bool outward,
                        qw_clean_counts *counts)
{
    assert(least_share >= 0 && least_share <= 1);
    uint32_t nonmanifold;
    counts->dropped_duplicate = qw_pair_sides(env, s, edges, &nonmanifold);
    qw_edges_free(env, edges);
    counts->split_edges = nonmanifold;
    qw_progress(env, 0.7);
    qw_oriented oriented = qw_orient_sheets(env, s, outward);
    counts->flipped_triangles = oriented.triangles, counts->flipped_alone = oriented.alone;
    counts->turned_components = oriented.components, counts->one_sided_seam_edges = oriented.seams;
    uint32_t named = s->vertex_count;
    counts->split_vertices = qw_split_fans(env, s);
    counts->dropped_isolated = named + counts->split_vertices - s->vertex_count - counts->welded_vertices;
    if (least_share > 0) counts->dropped_components = qw_drop_small_components(env, s, least_share);
    uint32_t separated = nonmanifold + oriented.seams + s->apart > 0 && qw_uses(env, QW_MECH_PARALLEL_EDGES)
                             ? qw_split_parallel_edges(env, s)
                             : 0;
    qw_did(env, QW_MECH_PARALLEL_EDGES, separated);
    if (counts->dropped_components + separated > 0) {
        s->component = QW_NEW(env, uint32_t, s->face_count);
        s->components = qw_label_components(env, 3, s->twin, s->face_count, s->component);
    }
}

qw_clean qw_clean_surface(qw_env *env, const qw_clean_input *input, double least_share, bool outward)
{
    assert(input->position && input->face_begin && input->corner && least_share >= 0);
    if (input->face_count == 0) qw_fail(env, QW_NO_FACES, -1, "there is no face");
    qw_scope_begin(env);
    qw_clean_counts counts = {0};
    qw_triangles t = qw_triangulate(env, input);
    if (t.count == 0) qw_fail(env, QW_NO_FACES, -1, "no face has three corners");
    counts.triangles = t.count;
    qw_sheets s = {.vertex_count = input->vertex_count, .face_count = t.count, .corner = t.corner, .source = t.source};
    counts.dropped_degenerate = qw_drop_degenerate(&s);
    qw_edges edges = edges_of(env, &s);
    if (!input->cut) weld(env, &s, input, &edges, &counts);
    if (s.face_count == 0)
        qw_fail(env, QW_ONLY_DEGENERATE, -1, "none of %u triangles has three different corners", t.count);
    qw_progress(env, 0.3);
    qw_frame frame = find_frame(env, &s, input->position);
    s.position = centred_positions(env, &frame, input->position, s.vertex_count);
    s.point_count = s.vertex_count;
    if (!input->cut) {
        weld_near(env, &s, NEAR, NULL, &edges, &counts);
        if (s.named) qw_find_double_layers(env, &s, &edges);
        sew(env, &s, &edges, &counts);
    }
    if (counts.welded_vertices + counts.sewn_junctions == 0) s.named = NULL;
    if (!has_area(&s, &frame)) qw_fail(env, QW_ONLY_DEGENERATE, -1, "none of %u triangles has an area", t.count);
    make_sheets(env, &s, &edges, least_share, outward, &counts);
    counts.dropped_flat = qw_drop_flat_components(env, &s, offset_of(&frame), &counts.first_flat);
    if (counts.dropped_components + counts.dropped_flat > 0) tighten_frame(env, &s, &frame);
    qw_progress(env, 0.9);
    qw_clean clean = result_of(env, &s, &frame, &counts);
    if (qw_uses(env, QW_MECH_UNFOLD)) clean.counts.unfolded_vertices = qw_unfold(env, input, &frame, &clean.mesh);
    qw_did(env, QW_MECH_UNFOLD, clean.counts.unfolded_vertices);
    qw_scope_end(env);
    return clean;
}

void qw_place_in_input(const qw_clean *clean, qw_vec3 point, double place[3])
{
    const qw_frame *frame = &clean->frame;
    double q[3] = {point.x, point.y, point.z};
    qw_leave_own_frame(&clean->own, point, q);
    for (int k = 0; k < 3; k++) place[k] = frame->center[k] + q[k] / frame->scale;
}

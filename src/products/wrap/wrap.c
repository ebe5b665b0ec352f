#include "products/wrap/wrap.h"

#include "products/wrap/shrink.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

/* Cells across the longest side when the area of the skin is estimated. */
static const double COARSE = 48;
/* The same when it is asked what others hide. */
static const double FINE = 100;
/* The area of a surface over that of the faces of the cells that hold it, in the mean of all directions. */
static const double FACES_TO_AREA = 2.0 / 3;

/* A cell is at least so many steps of double precision wide. */
static const double LEAST_SPACINGS = 8;

typedef struct box {
    double low[3], high[3];
} box;

/* Of the vertices that have faces. */
static box box_of(const qw_clean_input *input)
{
    box b = {{DBL_MAX, DBL_MAX, DBL_MAX}, {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
    for (uint32_t c = 0; c < input->face_begin[input->face_count]; c++) {
        const double *p = input->position + 3 * (size_t)input->corner[c];
        for (int k = 0; k < 3; k++) b.low[k] = fmin(b.low[k], p[k]), b.high[k] = fmax(b.high[k], p[k]);
    }
    return b;
}

double qw_wrap_diagonal(const qw_clean_input *input)
{
    box b = box_of(input);
    double sum = 0, most = 0;
    for (int k = 0; k < 3; k++) most = fmax(most, b.high[k] / 2 - b.low[k] / 2);
    for (int k = 0; k < 3 && most > 0; k++) {
        double side = (b.high[k] / 2 - b.low[k] / 2) / most;
        sum += side * side;
    }
    return 2 * most * sqrt(sum);
}

/* The input's vertices in units of the lattice: double[vertex_count][3]. */
static double *in_units(qw_env *env, const qw_clean_input *input, const qw_wrap_frame *f)
{
    double *p = QW_NEW(env, double, 3 * (size_t)input->vertex_count);
    for (size_t i = 0; i < 3 * (size_t)input->vertex_count; i++)
        p[i] = (input->position[i] - f->origin[i % 3]) / f->unit;
    return p;
}

/* Leaves out triangles without extent, and those of polygons that are left out. */
static void keep_some(const qw_clean_input *input, qw_triangles *t)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < t->count; i++) {
        if (input->left_out && input->left_out[t->source[i]]) continue;
        memmove(t->corner + 3 * (size_t)kept, t->corner + 3 * (size_t)i, 3 * sizeof *t->corner);
        t->source[kept++] = t->source[i];
    }
    t->count = kept;
}

/* How far apart double precision has its numbers at the coordinate that is farthest from the origin, at most. */
static double spacing_of(const box *b)
{
    double most = 0;
    for (int k = 0; k < 3; k++) most = fmax(most, fmax(fabs(b->low[k]), fabs(b->high[k])));
    return most * DBL_EPSILON;
}

/* Vertices of the skin are rounded when they come back to the coordinates of the input: cells that are hardly wider
   than what the coordinates can tell apart would have them at one place. */
static bool is_told_apart(const box *b, double cell) { return cell >= LEAST_SPACINGS * spacing_of(b); }

static void require_told_apart(qw_env *env, const box *b, double cell)
{
    if (is_told_apart(b, cell)) return;
    qw_fail(env, QW_TOO_LARGE, -1,
            "so far from the origin coordinates are %.3g apart in double precision, too coarse for a wrap of distance "
            "%.3g: move the input to the origin, or let the distance be %.3g at least",
            spacing_of(b), 2 * cell, 2 * LEAST_SPACINGS * spacing_of(b));
}

/* The cells that the input's faces meet, and those outside; fails where the input has no extent, or too much, for
   such cells. */
static qw_filled fill(qw_env *env, const qw_clean_input *input, double cell, bool closes)
{
    qw_filled f = {.polygons = qw_triangulate(env, input)};
    keep_some(input, &f.polygons);
    if (f.polygons.count == 0) qw_fail(env, QW_NO_FACES, -1, "there is no face to wrap");
    box b = box_of(input);
    double longest = 0;
    for (int k = 0; k < 3; k++) longest = fmax(longest, b.high[k] - b.low[k]);
    if (!(longest > 0)) qw_fail(env, QW_ONLY_DEGENERATE, 0, "all vertices of the faces lie at one place");
    if (!isfinite(longest)) qw_fail(env, QW_TOO_LARGE, -1, "the coordinates are too large for a wrap");
    if (!isfinite(0x1p26 / longest)) /* a unit of the lattice is to be a normal number */
        qw_fail(env, QW_ONLY_DEGENERATE, -1,
                "the surface is %.3g long: in double precision so little has no area; scale the input up", longest);
    require_told_apart(env, &b, cell);
    qw_wrap_frame frame = qw_wrap_frame_of(env, b.low, b.high, cell);
    f.triangles = (qw_wrap_triangles){f.polygons.count, f.polygons.corner, in_units(env, input, &frame)};
    f.lattice = qw_wrap_lattice_fill(env, &frame, &f.triangles, closes);
    return f;
}

/* Cells are half as wide as the gaps; what stays open has room for three. */
qw_filled qw_wrap_fill(qw_env *env, const qw_clean_input *input, double distance)
{
    return fill(env, input, distance / 2, true);
}

double qw_wrap_load(const qw_clean_input *input, double distance)
{
    box b = box_of(input);
    double load = 1.0 / QW_MOST_CELLS;
    for (int k = 0; k < 3; k++) load *= qw_cells_across(b.high[k] - b.low[k], distance / 2);
    return load;
}

double qw_wrap_distance_for(qw_env *env, const qw_clean_input *input, double quads, double edges)
{
    qw_scope_begin(env);
    box b = box_of(input);
    double longest = 0;
    for (int k = 0; k < 3; k++) longest = fmax(longest, b.high[k] - b.low[k]);
    double cell = longest > 0 ? longest / COARSE : 1;
    qw_filled f = fill(env, input, cell, false);
    qw_skin skin = qw_skin_of_lattice(env, &f.lattice);
    double area = skin.face_count / 2.0 * FACES_TO_AREA; /* in faces of a cell: squares of lengths may overflow */
    qw_scope_end(env);
    return edges * cell * sqrt(area / quads);
}

double qw_wrap_hidden(qw_env *env, const qw_clean_input *input)
{
    qw_scope_begin(env);
    box b = box_of(input);
    double longest = 0;
    for (int k = 0; k < 3; k++) longest = fmax(longest, b.high[k] - b.low[k]);
    double share = 0;
    if (longest > 0 && isfinite(longest) && is_told_apart(&b, longest / FINE)) {
        qw_filled f = fill(env, input, longest / FINE, false);
        share = qw_hidden_area(&f.lattice, &f.triangles);
    }
    qw_scope_end(env);
    return share;
}

/* ---- the skin as an input */

/* touch: float[s->face_count], receives the distance of each triangle's middle to the input. */
static void give(qw_env *env, const qw_skin *s, const qw_wrap_target *target, const qw_triangles *polygons,
                 float *touched, qw_wrapped *w)
{
    uint32_t n = s->vertex_count, faces = s->face_count;
    double *position = QW_NEW(env, double, 3 * (size_t)n);
    uint32_t *begin = QW_NEW(env, uint32_t, (size_t)faces + 1), *corner = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    w->source = QW_NEW(env, uint32_t, faces);
    for (uint32_t v = 0; v < n; v++)
        for (int k = 0; k < 3; k++)
            position[3 * (size_t)v + (size_t)k] = s->frame.origin[k] + s->position[v].at[k] * s->frame.unit;
    memcpy(corner, s->corner, 3 * (size_t)faces * sizeof *corner);
    uint32_t hint = QW_NONE;
    for (uint32_t f = 0; f <= faces; f++) begin[f] = 3 * f;
    for (uint32_t f = 0; f < faces; f++) {
        double p[3] = {0, 0, 0};
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) p[k] += s->position[corner[3 * (size_t)f + (size_t)i]].at[k] / 3.0;
        qw_touch touch = qw_wrap_target_nearest(target, p, hint);
        assert(touch.face != QW_NONE);
        touched[f] = (float)touch.distance;
        hint = touch.face, w->source[f] = polygons->source[target->source[touch.face]];
    }
    w->skin = (qw_clean_input){
        .vertex_count = n, .face_count = faces, .position = position, .face_begin = begin, .corner = corner};
    qw_keep(env, position), qw_keep(env, begin), qw_keep(env, corner), qw_keep(env, w->source);
}

static uint8_t *seen_polygons(qw_env *env, const qw_wrap_target *target, const qw_triangles *polygons, uint32_t count)
{
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, count);
    for (uint32_t i = 0; i < polygons->count; i++) seen[polygons->source[i]] |= target->visible[i];
    return seen;
}

qw_wrapped qw_wrap(qw_env *env, const qw_clean_input *input, double distance)
{
    if (!(distance > 0)) qw_fail(env, QW_ONLY_DEGENERATE, 0, "all vertices of the faces lie at one place");
    qw_wrapped w = {.distance = distance};
    qw_scope_begin(env);
    qw_filled f = qw_wrap_fill(env, input, distance);
    qw_skin skin = qw_skin_of_lattice(env, &f.lattice);
    qw_progress(env, 0.2);
    qw_wrap_target target = qw_wrap_target_build(env, &f.lattice, &f.triangles, input->vertex_count);
    qw_shrink(env, &skin, &target);
    qw_skin_pack(&skin);
    float *touched = QW_NEW(env, float, skin.face_count);
    give(env, &skin, &target, &f.polygons, touched, &w);
    w.seen = seen_polygons(env, &target, &f.polygons, input->face_count);
    qw_keep(env, w.seen);
    w.stats = qw_wrap_stats_of(env, &f.lattice, &f.triangles, input->vertex_count, &skin, &target, touched);
    memcpy(w.origin, skin.frame.origin, sizeof w.origin), w.unit = skin.frame.unit;
    w.triangles = f.polygons.count, w.hidden = target.hidden;
    w.clusters = f.lattice.clusters, w.fragments = f.lattice.fragments;
    qw_scope_end(env);
    return w;
}

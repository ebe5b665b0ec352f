#include "whole/openings.h"

#include "base/constants.h"
#include "remesh/field/hierarchy.h"
#include "whole/cut.h"

#include <assert.h>
#include <math.h>

/* An opening has a corner where it turns by more radians than this, a little more than a pentagon does, within an
   eighth of its length or within an edge of the quads, as a jagged hem does. Round ones have no corner, slits and the
   lids of eyes two. */
static const double CORNER = 0.42 * QW_PI;
enum { CORNERS = 2, OF_LENGTH = 8 };

typedef struct opening {
    const qw_run_state *run;
    const qw_trimesh *mesh;
    const uint8_t *cuts;   /* of qw_find_cuts */
    uint32_t *half, count; /* half-edges, one after the other: uint32_t[count] */
    bool is_closed;
    double length;
} opening;

static bool lies_in_cut(const opening *o, uint32_t h)
{
    return (o->cuts[o->mesh->corner[h]] & o->cuts[o->mesh->corner[qw_next(h)]]) != 0;
}

/* The stretch of boundary through h that lies in no cut. */
static void walk(opening *o, uint32_t h, uint8_t *seen)
{
    uint32_t first = h;
    bool was_cut = false;
    o->is_closed = true;
    for (uint32_t at = qw_next_on_boundary(o->mesh, h); at != h; at = qw_next_on_boundary(o->mesh, at)) {
        bool is_cut = lies_in_cut(o, at);
        if (was_cut && !is_cut) first = at;
        was_cut = is_cut, o->is_closed &= !is_cut;
    }
    if (was_cut) first = h;
    o->count = 0, o->length = 0, h = first;
    do {
        o->half[o->count++] = h, o->length += (double)qw_edge_length(o->mesh, h), seen[h] = 1;
        h = qw_next_on_boundary(o->mesh, h);
    } while (h != first && !lies_in_cut(o, h));
}

/* uint8_t[vertices]: kinds of constraint, with the corners of all openings, which turn within `most` at the most. */
static uint8_t *find_corners(opening *o, double most)
{
    qw_env *env = o->run->env;
    const qw_trimesh *m = o->mesh;
    uint8_t *kind, *seen = QW_NEW_ZERO(env, uint8_t, 3 * m->face_count);
    qw_vec3 *direction;
    float *span = QW_NEW_ZERO(env, float, m->vertex_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] != QW_NONE || seen[h] || lies_in_cut(o, h)) continue;
        walk(o, h, seen);
        for (uint32_t i = 0; i < o->count; i++) span[m->corner[o->half[i]]] = (float)fmin(o->length / OF_LENGTH, most);
    }
    qw_find_constraints(env, m, true, CORNER, span, NULL, &kind, &direction);
    qw_free(env, span), qw_free(env, seen), qw_free(env, direction);
    return kind;
}

/* Corners nearer to one another than an eighth of the length are one; the ends of a half are none. */
static uint32_t count_corners(const opening *o, const uint8_t *kind)
{
    uint32_t corners = 0;
    double at = 0, first = 0, last = -INFINITY, near = o->length / OF_LENGTH;
    for (uint32_t i = 0; i < o->count; i++) {
        bool is_end = i == 0 && !o->is_closed;
        if (kind[o->mesh->corner[o->half[i]]] == QW_VERTEX_CORNER && !is_end && at - last > near) {
            if (corners++ == 0) first = at;
            last = at;
        }
        at += (double)qw_edge_length(o->mesh, o->half[i]);
    }
    return corners > 1 && o->is_closed && first + o->length - last <= near ? corners - 1 : corners;
}

qw_openings qw_find_openings(const qw_run_state *run, double rho)
{
    qw_env *env = run->env;
    const qw_trimesh *m = &run->surface;
    uint32_t sides = 3 * m->face_count, rims = 0;
    for (uint32_t h = 0; h < sides; h++) rims += m->twin[h] == QW_NONE;
    qw_openings found = {{0, QW_NEW_ZERO(env, uint32_t, (size_t)rims + 1), QW_NEW(env, qw_vec3, 2 * (size_t)rims),
                          QW_NEW(env, uint8_t, rims)},
                         QW_NEW(env, uint32_t, 2 * (size_t)rims)};
    opening o = {run, m, qw_find_cuts(run, m), QW_NEW(env, uint32_t, rims), 0, false, 0};
    const uint8_t *wide = find_corners(&o, INFINITY), *narrow = find_corners(&o, rho);
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, sides);
    double most = QW_NECK_RATIO * run->options.rings * 4 * QW_PI * qw_trimesh_area(m);
    qw_necks *n = &found.curves;
    for (uint32_t h = 0; h < sides; h++) {
        if (m->twin[h] != QW_NONE || seen[h] || lies_in_cut(&o, h) || (m->mark && m->mark[h])) continue;
        walk(&o, h, seen);
        double halves = o.is_closed ? 1 : 2, whole = halves * o.length;
        if (n->count == QW_MOST_NECKS || o.count < 3 || whole * whole > most ||
            halves * count_corners(&o, wide) > CORNERS || halves * count_corners(&o, narrow) > CORNERS)
            continue;
        uint32_t begin = n->begin[n->count];
        for (uint32_t i = 0; i < o.count; i++) {
            found.half[begin + i] = o.half[i];
            n->point[begin + i] = m->position[m->corner[o.half[i]]];
        }
        n->point[begin + o.count] = m->position[m->corner[qw_next(o.half[o.count - 1])]];
        if (!qw_fits_on_neck(n->point + begin, o.count + 1, rho, QW_POCKET)) continue;
        n->kind[n->count++] = QW_POCKET, n->begin[n->count] = begin + o.count + 1;
    }
    assert(n->begin[n->count] <= 2 * (size_t)rims);
    return found;
}

/* Marks edges of the boundary as a curve of a nest. */
static void mark_rim(qw_run_state *run, const uint32_t *half, uint32_t count)
{
    if (!run->surface.mark) {
        run->surface.mark = QW_NEW_ZERO(run->env, uint8_t, 3 * run->surface.face_count);
        qw_keep(run->env, run->surface.mark);
    }
    for (uint32_t i = 0; i < count; i++) run->surface.mark[half[i]] = QW_MARKS;
}

void qw_mark_openings(qw_run_state *run, const qw_openings *openings)
{
    const qw_necks *n = &openings->curves;
    for (uint32_t i = 0; i < n->count; i++)
        mark_rim(run, openings->half + n->begin[i], n->begin[i + 1] - n->begin[i] - 1);
}

int64_t qw_mark_drawn_opening(qw_run_state *run, const qw_vec3 *point, uint32_t count, float near)
{
    qw_env *env = run->env;
    const qw_trimesh *m = &run->surface;
    int64_t marked = 0;
    qw_scope_begin(env);
    const qw_curve_tree *tree = qw_curve_tree_build(env, point, point + 1, count - 1);
    opening o = {run, m, qw_find_cuts(run, m), QW_NEW(env, uint32_t, 3 * m->face_count), 0, false, 0};
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, 3 * m->face_count);
    double length = 0;
    for (uint32_t i = 0; i + 1 < count; i++) length += (double)qw_distance(point[i], point[i + 1]);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] != QW_NONE || seen[h] || lies_in_cut(&o, h)) continue;
        walk(&o, h, seen);
        bool is_along = 2 * o.length > length; /* and no small hole beside it */
        for (uint32_t i = 0; i < o.count && is_along; i++)
            is_along = qw_curve_nearest(tree, m->position[m->corner[o.half[i]]], near).segment != QW_NONE;
        if (is_along) mark_rim(run, o.half, o.count), marked += o.count;
    }
    qw_scope_end(env);
    return marked;
}

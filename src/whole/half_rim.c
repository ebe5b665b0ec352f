#include "whole/half_rim.h"

#include <assert.h>
#include <float.h>

/* ---- the surface's boundary */

static uint32_t next_of_triangles(const qw_trimesh *m, uint32_t h)
{
    uint32_t next = qw_next(h);
    while (m->twin[next] != QW_NONE) next = qw_next(m->twin[next]);
    return next;
}

/* As `cut` of an arc. An edge in several planes belongs to the first. */
static uint8_t cut_at(const qw_trimesh *m, const uint8_t *on_planes, uint32_t h)
{
    uint32_t both = on_planes[m->corner[h]] & on_planes[m->corner[qw_next(h)]];
    uint8_t first = both > 0;
    while (first > 0 && !(both >> (first - 1) & 1)) first++;
    return first;
}

/* The first half-edge of the arc that h belongs to: walks along the loop to where edges begin to lie on the same plane,
   or on none, as it; h itself if all do. */
static uint32_t begin_of_arc(const qw_trimesh *m, const uint8_t *on_planes, uint32_t h)
{
    assert(h < 3 * m->face_count);
    uint32_t begin = h;
    uint8_t cut = cut_at(m, on_planes, h), was = cut;
    for (uint32_t i = next_of_triangles(m, h); i != h; i = next_of_triangles(m, i)) {
        uint8_t is = cut_at(m, on_planes, i);
        if (is == cut && was != cut) begin = i;
        was = is;
    }
    return was == cut ? begin : h;
}

/* The point halfway along the arc that begins at `begin` and has `count` half-edges. */
static qw_vec3 middle_of_arc(const qw_trimesh *m, uint32_t begin, uint32_t count)
{
    double length = 0, half;
    uint32_t h = begin;
    for (uint32_t i = 0; i < count; i++, h = next_of_triangles(m, h)) length += (double)qw_edge_length(m, h);
    half = length / 2, h = begin;
    for (uint32_t i = 0; i + 1 < count && half > (double)qw_edge_length(m, h); i++, h = next_of_triangles(m, h))
        half -= (double)qw_edge_length(m, h);
    float edge = qw_edge_length(m, h), t = edge > 0 ? (float)half / edge : 0;
    return qw_lerp(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]], t < 1 ? t : 1);
}

typedef struct rim_builder {
    const qw_trimesh *mesh;
    const uint8_t *on_planes;
    qw_rim *rim;
    uint8_t *seen; /* uint8_t[3 face_count] */
    qw_vec3 *from, *to;
    uint32_t segments;
} rim_builder;

/* The arc from `begin`, a half-edge of the boundary. */
static void add_arc(rim_builder *b, uint32_t begin)
{
    const qw_trimesh *m = b->mesh;
    uint8_t cut = cut_at(m, b->on_planes, begin);
    uint32_t h = begin, count = 0, arc = b->rim->arc_count++;
    do {
        b->seen[h] = 1;
        b->rim->arc[b->segments] = arc;
        b->from[b->segments] = m->position[m->corner[h]], b->to[b->segments++] = m->position[m->corner[qw_next(h)]];
        count++, h = next_of_triangles(m, h);
    } while (h != begin && cut_at(m, b->on_planes, h) == cut);
    b->rim->cut[arc] = cut, b->rim->is_closed[arc] = h == begin;
    b->rim->middle[arc] = middle_of_arc(m, begin, count);
}

qw_rim qw_rim_of(qw_env *env, const qw_trimesh *surface, const uint8_t *on_planes)
{
    assert(surface->twin);
    uint32_t sides = 3 * surface->face_count, count = 0;
    for (uint32_t h = 0; h < sides; h++) count += surface->twin[h] == QW_NONE;
    qw_rim rim = {.cut = QW_NEW(env, uint8_t, count), .is_closed = QW_NEW(env, uint8_t, count)};
    rim.middle = QW_NEW(env, qw_vec3, count), rim.arc = QW_NEW(env, uint32_t, count);
    rim_builder b = {surface, on_planes, &rim, QW_NEW_ZERO(env, uint8_t, sides), .segments = 0};
    b.from = QW_NEW(env, qw_vec3, count), b.to = QW_NEW(env, qw_vec3, count);
    for (uint32_t h = 0; h < sides; h++)
        if (surface->twin[h] == QW_NONE && !b.seen[h]) add_arc(&b, begin_of_arc(surface, on_planes, h));
    if (count) rim.tree = qw_curve_tree_build(env, b.from, b.to, count);
    qw_free(env, b.seen), qw_free(env, b.from), qw_free(env, b.to);
    return rim;
}

/* ---- the quads' boundary */

static uint32_t next_of_quads(const qw_quadmesh *q, uint32_t h)
{
    uint32_t next = qw_quad_next(h);
    while (q->twin[next] != QW_NONE) next = qw_quad_next(q->twin[next]);
    return next;
}

static qw_vec3 middle_of_edge(const qw_quadmesh *q, uint32_t h)
{
    return qw_lerp(q->position[q->corner[h]], q->position[q->corner[qw_quad_next(h)]], 0.5f);
}

static float distance2(qw_vec3 a, qw_vec3 b) { return qw_length2(qw_sub(a, b)); }

/* The half-edge of the boundary that is nearest to the point, by its end or by its middle. */
static uint32_t nearest_on_boundary(const qw_quadmesh *q, qw_vec3 point, bool by_end)
{
    uint32_t best = QW_NONE;
    float least = FLT_MAX;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        if (q->twin[h] != QW_NONE) continue;
        float d = distance2(point, by_end ? q->position[q->corner[qw_quad_next(h)]] : middle_of_edge(q, h));
        if (d < least) least = d, best = h;
    }
    return best;
}

/* Gives an arc with too few edges those that are nearest to its middle. */
static void give_edges(const qw_rim *rim, uint32_t arc, qw_quadmesh *quads, uint32_t *arc_of)
{
    bool is_cut = rim->cut[arc] > 0;
    uint32_t h = nearest_on_boundary(quads, rim->middle[arc], !is_cut);
    if (h == QW_NONE) return;
    arc_of[h] = arc;
    if (is_cut) return;
    uint32_t next = next_of_quads(quads, h);
    arc_of[next] = arc;
    quads->position[quads->corner[next]] = rim->middle[arc];
}

uint8_t *qw_find_sewn(qw_env *env, const qw_rim *rim, qw_quadmesh *quads)
{
    assert(quads->twin);
    uint32_t sides = 4 * quads->face_count;
    uint8_t *sewn = QW_NEW_ZERO(env, uint8_t, sides);
    if (!rim->tree) return sewn;
    uint32_t *arc_of = QW_NEW(env, uint32_t, sides), *edges = QW_NEW_ZERO(env, uint32_t, rim->arc_count);
    for (uint32_t h = 0; h < sides; h++) {
        arc_of[h] = QW_NONE;
        if (quads->twin[h] != QW_NONE) continue;
        arc_of[h] = rim->arc[qw_curve_nearest(rim->tree, middle_of_edge(quads, h), FLT_MAX).segment];
        edges[arc_of[h]]++;
    }
    for (uint32_t a = 0; a < rim->arc_count; a++)
        if (!rim->is_closed[a] && edges[a] < (rim->cut[a] ? 1u : 2u)) give_edges(rim, a, quads, arc_of);
    for (uint32_t h = 0; h < sides; h++) sewn[h] = arc_of[h] == QW_NONE ? 0 : rim->cut[arc_of[h]];
    qw_free(env, arc_of), qw_free(env, edges);
    return sewn;
}

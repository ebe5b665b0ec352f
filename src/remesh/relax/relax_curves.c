#include "remesh/relax/relax_curves.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "base/sets.h"
#include "base/elementary.h"
#include "geometry/bvh.h"
#include "geometry/corners.h"
#include "geometry/slide.h"

#include <assert.h>
#include <string.h>

/* How far, in edge lengths, a curve or a corner may be from the vertex that seeks it. */
static const float REACH = 1.0f;
/* And how far from a vertex of the rim the boundary of its chain: in an acute corner the other side may be the nearer
 * one. */
static const float RIM_REACH = 3.0f;
/* How much farther than the nearest curve, in lengths of the shortest edge there, the curve of the chain may be: where
   quads are so thin that two curves are an edge apart, marks and chains are no guide. */
static const float DETOUR = 0.5f;

/* A kink turns by less than a corner but more than 25 degrees, cosine, and by no more for an edge of the quads to
   either side: the quads go on through it, but have a vertex there. */

/* ---- the input's curves */

typedef struct curve_set {
    const qw_trimesh *surface;
    uint32_t count;
    uint32_t *half;      /* [count] a half-edge a segment */
    qw_vec3 *from, *to;  /* [count] */
    qw_curve_ends *ends; /* [surface vertices] */
    uint32_t *label;     /* [count] union-find: segments of one curve */
} curve_set;

static bool is_segment(const qw_trimesh *surface, uint32_t h)
{
    return qw_is_curve_edge(surface, h, true) && qw_stands_for_edge(surface, h);
}

/* All segments of curves of the surface, with the ends at which curves begin. */
static curve_set collect_curves(qw_env *env, const qw_trimesh *surface)
{
    curve_set c = {.surface = surface};
    uint32_t sides = 3 * surface->face_count;
    for (uint32_t h = 0; h < sides; h++) c.count += is_segment(surface, h);
    if (c.count == 0) return c;
    c.half = QW_NEW(env, uint32_t, c.count), c.label = QW_NEW(env, uint32_t, c.count);
    c.from = QW_NEW(env, qw_vec3, c.count), c.to = QW_NEW(env, qw_vec3, c.count);
    c.ends = qw_find_curve_ends(env, surface, true);
    uint32_t count = 0;
    for (uint32_t h = 0; h < sides; h++) {
        if (!is_segment(surface, h)) continue;
        uint32_t a = surface->corner[h], b = surface->corner[qw_next(h)];
        c.from[count] = surface->position[a], c.to[count] = surface->position[b];
        c.half[count++] = h;
    }
    return c;
}

/* Marks vertices at which a curve ends, meets others or turns sharply in `corner` and, but for the turning ones, in
   `stop`. */
static void find_corners(const curve_set *c, uint8_t *corner, uint8_t *stop)
{
    assert(c->ends && corner && stop);
    const float least_cosine = (float)qw_cos(QW_CORNER_ANGLE);
    for (uint32_t v = 0; v < c->surface->vertex_count; v++) {
        corner[v] = qw_is_curve_corner(c->surface, c->ends, v, least_cosine);
        stop[v] = qw_curves_end_at(&c->ends[v]);
    }
}

/* Segments that meet where nothing stops belong to one curve. */
static void label_curves(qw_env *env, curve_set *c, const uint8_t *stop)
{
    assert(c->count > 0 && c->label && stop);
    uint32_t n = c->surface->vertex_count;
    uint32_t *last = QW_NEW(env, uint32_t, n);
    memset(last, 0xff, n * sizeof *last);
    for (uint32_t i = 0; i < c->count; i++) c->label[i] = i;
    for (uint32_t i = 0; i < c->count; i++) {
        uint32_t ends[2] = {c->surface->corner[c->half[i]], c->surface->corner[qw_next(c->half[i])]};
        for (int k = 0; k < 2; k++) {
            if (stop[ends[k]]) continue;
            if (last[ends[k]] != QW_NONE) qw_join_sets(c->label, last[ends[k]], i);
            last[ends[k]] = i;
        }
    }
    qw_free(env, last);
}

/* ---- corners */

/* Where the curve from v by way of its neighbour `to` first turns off by more than a kink; QW_NONE: before that length.
 */
static uint32_t end_of_side(const curve_set *c, uint32_t v, uint32_t to, float length)
{
    assert(c->ends && v != to);
    const qw_vec3 *p = c->surface->position;
    qw_vec3 along = qw_normalize(qw_sub(p[to], p[v]));
    for (uint32_t from = v; to != v && c->ends[to].count == 2;) {
        uint32_t after = qw_curve_beyond(c->ends, from, to);
        if (qw_dot(qw_normalize(qw_sub(p[after], p[to])), along) < (float)QW_STRAIGHT_COSINE)
            return qw_distance(p[v], p[to]) < length ? QW_NONE : to;
        from = to, to = after;
    }
    return to;
}

/* Whether a place lies beside v along one of its two curve edges. */
static bool is_beside(const curve_set *c, uint32_t v, qw_vec3 place)
{
    qw_vec3 at = c->surface->position[v], d = qw_sub(place, at);
    for (int i = 0; i < 2; i++) {
        qw_vec3 along = qw_normalize(qw_sub(c->surface->position[c->ends[v].other[i]], at));
        if (qw_dot(d, along) >= (float)QW_STRAIGHT_COSINE * qw_length(d)) return true;
    }
    return false;
}

/* Whether a vertex of the quads at a place on the curves, of that size, may take kink v: not beside another, as those
   of a circle of few edges are. */
static bool takes_kink(const curve_set *c, const uint8_t *kink, uint32_t v, qw_vec3 place, float size)
{
    uint32_t end[2];
    for (int i = 0; i < 2; i++) end[i] = end_of_side(c, v, c->ends[v].other[i], size);
    return end[0] != QW_NONE && end[1] != QW_NONE && !kink[end[0]] && !kink[end[1]] && is_beside(c, v, place);
}

/* Each marked vertex of the surface, corner or kink, takes the nearest vertex of the quads of that kind that seeks it,
   which stays there; the others stay where they are. */
static void pin(qw_env *env, const qw_quadmesh *quads, const curve_set *c, const uint8_t *mark, uint8_t kind,
                qw_curve_binding *b, const float *size, qw_vec3 *position)
{
    assert(quads->kind && size && position);
    uint32_t count = 0, n = b->surface->vertex_count;
    uint32_t *vertex = QW_NEW(env, uint32_t, n), *owner = QW_NEW(env, uint32_t, n);
    qw_vec3 *place = QW_NEW(env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++)
        if (mark[v]) owner[count] = QW_NONE, place[count] = b->surface->position[v], vertex[count++] = v;
    const qw_curve_tree *tree = qw_curve_tree_build(env, place, place, count); /* segments of no length are points */
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        if (quads->kind[v] != kind) continue;
        uint32_t hit = qw_curve_nearest(tree, position[v], REACH * size[v]).segment;
        if (hit == QW_NONE || (kind == QW_VERTEX_CURVE && !takes_kink(c, mark, vertex[hit], position[v], size[v])))
            continue;
        uint32_t other = owner[hit];
        if (other == QW_NONE || qw_distance(position[v], place[hit]) < qw_distance(position[other], place[hit]))
            owner[hit] = v;
    }
    for (uint32_t i = 0; i < count; i++) {
        if (owner[i] == QW_NONE) continue;
        position[owner[i]] = place[i];
        quads->kind[owner[i]] = QW_VERTEX_CORNER, b->edge[owner[i]] = QW_NONE;
        b->stop[vertex[i]] = 1;
    }
    qw_free(env, vertex), qw_free(env, owner), qw_free(env, place);
}

/* ---- chains */

static bool is_constrained(const qw_quadmesh *q, uint32_t h)
{
    assert(h < 4 * q->face_count);
    uint32_t a = q->corner[h], b = q->corner[qw_quad_next(h)];
    if (q->kind[a] != QW_VERTEX_CURVE || q->kind[b] != QW_VERTEX_CURVE) return false;
    return !q->twin || q->twin[h] == QW_NONE || (q->mark && (q->mark[h] & QW_MARK_FEATURE));
}

typedef struct vote {
    uint32_t label, count;
} vote;

/* The label most of each chain's vertices are nearest to, by Boyer and Moore's counting. vote[quads->vertex_count], at
 * the chains' roots.
 */
static vote *count_votes(qw_env *env, const qw_quadmesh *quads, const uint32_t *nearest, uint32_t *chain,
                         uint32_t *label)
{
    vote *votes = QW_NEW_ZERO(env, vote, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) {
        if (nearest[v] == QW_NONE) continue;
        vote *at = &votes[qw_set_of(chain, v)];
        uint32_t mine = qw_set_of(label, nearest[v]);
        if (at->count == 0) *at = (vote){mine, 1};
        else if (at->label == mine) at->count++;
        else at->count--;
    }
    return votes;
}

/* float[vertices]: the shortest edge at each. */
static float *shortest_edges(qw_env *env, const qw_quadmesh *quads, const qw_vec3 *position)
{
    float *shortest = QW_NEW(env, float, quads->vertex_count);
    for (uint32_t v = 0; v < quads->vertex_count; v++) shortest[v] = INFINITY;
    for (uint32_t h = 0; h < 4 * quads->face_count; h++) {
        uint32_t a = quads->corner[h], b = quads->corner[qw_quad_next(h)];
        float length = qw_distance(position[a], position[b]);
        shortest[a] = fminf(shortest[a], length), shortest[b] = fminf(shortest[b], length);
    }
    return shortest;
}

/* Vertices that are nearer to another curve find their own from a neighbour in the chain. */
static void follow_chains(qw_env *env, const qw_quadmesh *quads, qw_curve_binding *b, const float *reach,
                          qw_vec3 *position)
{
    uint32_t count = 0, sides = 4 * quads->face_count;
    uint32_t *constrained = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++)
        if (is_constrained(quads, h)) constrained[count++] = h;
    for (bool changed = true; changed;) {
        changed = false;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t v = quads->corner[constrained[i]], w = quads->corner[qw_quad_next(constrained[i])];
            if ((b->edge[v] == QW_NONE) == (b->edge[w] == QW_NONE)) continue;
            uint32_t from = b->edge[v] == QW_NONE ? w : v, to = from == v ? w : v, edge = b->edge[from];
            qw_vec3 place = qw_slide_bound(b, &edge, position[to]);
            if (qw_distance(place, position[to]) > reach[to]) continue;
            b->edge[to] = edge, position[to] = place;
            changed = true;
        }
    }
    qw_free(env, constrained);
}

/* Binds each vertex on a curve to the segment that its chain of edges follows, and moves it there. size: wanted, at
 * vertices. */
static void bind_vertices(qw_env *env, const qw_quadmesh *quads, curve_set *c, qw_curve_binding *b, const float *size,
                          qw_vec3 *position)
{
    uint32_t n = quads->vertex_count;
    const qw_curve_tree *tree = qw_curve_tree_build(env, c->from, c->to, c->count);
    uint32_t *nearest = QW_NEW(env, uint32_t, n), *chain = QW_NEW(env, uint32_t, n);
    float *reach = shortest_edges(env, quads, position);
    for (uint32_t v = 0; v < n; v++) {
        nearest[v] = QW_NONE, chain[v] = v;
        if (quads->kind[v] != QW_VERTEX_CURVE) continue;
        qw_curve_hit hit = qw_curve_nearest(tree, position[v], REACH * size[v]);
        nearest[v] = hit.segment;
        reach[v] = hit.segment == QW_NONE ? REACH * size[v]
                                          : fminf(sqrtf(hit.distance2) + DETOUR * reach[v], REACH * size[v]);
    }
    for (uint32_t h = 0; h < 4 * quads->face_count; h++) {
        if (!is_constrained(quads, h)) continue;
        uint32_t ends[2] = {quads->corner[h], quads->corner[qw_quad_next(h)]};
        qw_join_sets(chain, ends[0], ends[1]);
        if (!quads->twin || quads->twin[h] == QW_NONE)
            for (int i = 0; i < 2; i++) reach[ends[i]] = RIM_REACH * size[ends[i]];
    }
    vote *votes = count_votes(env, quads, nearest, chain, c->label);
    for (uint32_t v = 0; v < n; v++) {
        if (nearest[v] == QW_NONE || votes[qw_set_of(chain, v)].label != qw_set_of(c->label, nearest[v])) continue;
        b->edge[v] = c->half[nearest[v]];
        position[v] = qw_slide_bound(b, &b->edge[v], position[v]);
    }
    if (qw_uses(env, QW_MECH_CURVE_VOTES))
        follow_chains(env, quads, b, reach, position), qw_did(env, QW_MECH_CURVE_VOTES, 1);
    for (uint32_t v = 0; v < n; v++) { /* where a chain runs over several curves */
        if (nearest[v] == QW_NONE || b->edge[v] != QW_NONE) continue;
        b->edge[v] = c->half[nearest[v]];
        position[v] = qw_slide_bound(b, &b->edge[v], position[v]);
    }
}

qw_curve_binding qw_bind_curves(qw_env *env, const qw_quadmesh *quads, const qw_trimesh *surface, const float *size,
                                qw_vec3 *position)
{
    assert(quads->twin && surface->twin && size && position);
    qw_curve_binding b = {.surface = surface, .edge = QW_NEW(env, uint32_t, quads->vertex_count)};
    memset(b.edge, 0xff, quads->vertex_count * sizeof *b.edge);
    curve_set c = {0};
    if (quads->kind) c = collect_curves(env, surface);
    if (c.count == 0 && !(quads->kind && surface->point)) return b;
    b.outgoing = qw_trimesh_outgoing(env, surface);
    b.stop = QW_NEW_ZERO(env, uint8_t, surface->vertex_count);
    uint8_t *corner = QW_NEW_ZERO(env, uint8_t, surface->vertex_count);
    if (c.count > 0) find_corners(&c, corner, b.stop);
    for (uint32_t v = 0; surface->point && v < surface->vertex_count; v++) corner[v] |= surface->point[v];
    pin(env, quads, &c, corner, QW_VERTEX_CORNER, &b, size, position);
    if (c.count == 0) return b;
    label_curves(env, &c, b.stop);
    bind_vertices(env, quads, &c, &b, size, position);
    for (uint32_t v = 0; v < surface->vertex_count; v++)
        corner[v] = !corner[v] && c.ends[v].count == 2 &&
                    qw_is_curve_corner(surface, c.ends, v, (float)QW_STRAIGHT_COSINE);
    pin(env, quads, &c, corner, QW_VERTEX_CURVE, &b, size, position);
    return b;
}

qw_vec3 qw_slide_bound(const qw_curve_binding *b, uint32_t *edge, qw_vec3 p)
{
    assert(b->surface && *edge < 3 * b->surface->face_count);
    qw_surface_point place = qw_slide_on_curve(b->surface, b->outgoing, b->stop, *edge, p);
    *edge = place.half_edge;
    return place.point;
}

qw_curve_tree *qw_all_curves(qw_env *env, const qw_trimesh *s)
{
    assert(s->twin && s->face_count < QW_NONE / 3);
    uint32_t count = 0;
    qw_vec3 *from = QW_NEW(env, qw_vec3, 3 * (size_t)s->face_count),
            *to = QW_NEW(env, qw_vec3, 3 * (size_t)s->face_count);
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (s->twin[h] != QW_NONE && (!s->mark || !s->mark[h] || s->twin[h] < h)) continue;
        from[count] = s->position[s->corner[h]], to[count++] = s->position[s->corner[qw_next(h)]];
    }
    return count > 0 ? qw_curve_tree_build(env, from, to, count) : NULL;
}

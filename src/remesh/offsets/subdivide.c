/* Splits a triangle T at the middle m of its edge h: d(a, m) = d(a, b) div 2, d(m, b) is the rest, and d(m, c)
 * follows from Eq. (3) in T.
 *
 *           c                        c
 *          / \                      /|\
 *      hb /   \ hc      ->         / | \
 *        /  T  \                  / T|T'\
 *       a ----- b                a - m - b
 *           h
 */
#include "remesh/offsets/subdivide.h"

#include <assert.h>
#include <string.h>

typedef struct room {
    size_t vertices, faces, edges; /* capacities */
} room;

/* Grows on demand, by a sixteenth: few edges are long, and arena memory is not returned before the run ends. */
static size_t with_room(size_t count) { return count + count / 16 + 16; }

static void grow_vertices(qw_env *env, qw_offset_mesh *m, room *r)
{
    if (m->vertex_count < r->vertices) return;
    r->vertices = with_room(r->vertices);
#define GROW(field) m->field = qw_resize(env, m->field, r->vertices, sizeof *m->field)
    GROW(position), GROW(normal), GROW(lattice), GROW(size), GROW(constraint), GROW(direction), GROW(index);
#undef GROW
}

static void grow_faces(qw_env *env, qw_offset_mesh *m, room *r)
{
    if (m->face_count + 2 <= r->faces) return;
    r->faces = with_room(r->faces);
#define GROW(field) m->field = qw_resize(env, m->field, 3 * r->faces, sizeof *m->field)
    GROW(corner), GROW(twin), GROW(edge), GROW(rot), GROW(mark);
#undef GROW
}

static void grow_edges(qw_env *env, qw_offset_mesh *m, room *r)
{
    if (m->edge_count + 3 <= r->edges) return;
    r->edges = with_room(r->edges);
#define GROW(field) m->field = qw_resize(env, m->field, r->edges, sizeof *m->field)
    GROW(half), GROW(d), GROW(real), GROW(fixed), GROW(axis), GROW(side);
#undef GROW
}

/* A vertex in the middle of half-edge h, with the means of what its ends have. */
static uint32_t add_midpoint(qw_env *env, qw_offset_mesh *m, room *r, uint32_t h)
{
    assert(h < 3 * m->face_count);
    grow_vertices(env, m, r);
    uint32_t a = m->corner[h], b = m->corner[qw_next(h)], v = m->vertex_count++;
    m->position[v] = qw_lerp(m->position[a], m->position[b], 0.5f);
    m->normal[v] = qw_normalize(qw_add(m->normal[a], m->normal[b]));
    m->lattice[v] = qw_lerp(m->lattice[a], m->lattice[b], 0.5f);
    m->size[v] = 0.5f * (m->size[a] + m->size[b]);
    m->index[v] = 0;
    bool on_curve = m->twin[h] == QW_NONE || (m->mark[h] & QW_MARK_FEATURE);
    bool constrained = on_curve && m->constraint[a] && m->constraint[b];
    m->constraint[v] = constrained;
    m->direction[v] = constrained ? qw_normalize(qw_sub(m->position[b], m->position[a])) : qw_v3(0, 0, 0);
    return v;
}

/* An edge with this half-edge, offset and frame; its real offset is what its ends are apart. */
static uint32_t add_edge(qw_env *env, qw_offset_mesh *m, room *r, uint32_t half, qw_int2 d, uint8_t fixed, qw_vec3 axis,
                         qw_vec3 side)
{
    assert(half < 3 * m->face_count);
    grow_edges(env, m, r);
    uint32_t e = m->edge_count++;
    m->half[e] = half;
    m->d[e] = d;
    m->fixed[e] = fixed;
    m->axis[e] = axis;
    m->side[e] = side;
    uint32_t h = half, a = m->corner[h], b = m->corner[qw_next(h)];
    qw_vec3 along = qw_scale(qw_sub(m->position[b], m->position[a]), 2.0f / (m->size[a] + m->size[b]));
    m->real[e] = (qw_real2){qw_dot(along, axis), qw_dot(along, side)};
    return e;
}

/* Splits the triangle of h at vertex v on h: h keeps the half at its tail; returns the half-edge of the half at its
   head. `back` is the edge of the half at the head. along: the part of h's vector, in the triangle's frame, that the
   tail's half has. */
static uint32_t split_face(qw_env *env, qw_offset_mesh *m, room *r, uint32_t h, uint32_t v, qw_int2 along)
{
    assert(h < 3 * m->face_count && v < m->vertex_count);
    uint32_t hc = qw_next(h), hb = qw_next(hc), c = m->corner[hb], b = m->corner[hc];
    qw_vec3 axis, side;
    qw_offset_axes(m, hc, &axis, &side);
    /* in T: a->m is `along`, c->a is hb's vector; so m->c closes them */
    qw_int2 ca = qw_offset_along(m, hb), mc = {-(along.x + ca.x), -(along.y + ca.y)};
    uint32_t f = m->face_count++, g = 3 * f; /* T' = (m, b, c): g m->b, g+1 b->c (was hc), g+2 c->m */
    m->corner[g] = v, m->corner[g + 1] = b, m->corner[g + 2] = c;
    m->edge[g + 1] = m->edge[hc], m->rot[g + 1] = m->rot[hc], m->mark[g + 1] = m->mark[hc],
                m->twin[g + 1] = m->twin[hc];
    if (m->twin[hc] != QW_NONE) m->twin[m->twin[hc]] = g + 1;
    if (m->half[m->edge[hc]] == hc) m->half[m->edge[hc]] = g + 1;
    m->corner[hc] = v; /* T = (a, m, c): h a->m, hc m->c, hb c->a */
    uint32_t e = add_edge(env, m, r, hc, mc, 0, axis, side);
    m->edge[hc] = m->edge[g + 2] = e;
    m->rot[hc] = 0, m->rot[g + 2] = 2;
    m->mark[hc] = m->mark[g + 2] = m->mark[g] = 0;
    m->twin[hc] = g + 2, m->twin[g + 2] = hc;
    return g;
}

/* Splits edge e in the middle, with the triangles on both sides; its offset is shared as evenly as integers can be.
 * */
static void split_edge(qw_env *env, qw_offset_mesh *m, room *r, uint32_t e)
{
    assert(e < m->edge_count);
    uint32_t h = m->half[e], t = m->twin[h];
    grow_faces(env, m, r);
    grow_edges(env, m, r);
    uint32_t v = add_midpoint(env, m, r, h);
    qw_int2 whole = m->d[e], first = {whole.x / 2, whole.y / 2}, second = qw_int2_sub(whole, first);
    uint8_t mark = m->mark[h];
    qw_int2 along_h = qw_turn(m->rot[h], first);
    qw_int2 along_t = t == QW_NONE ? (qw_int2){0, 0} : qw_turn(m->rot[t], second);
    uint32_t g = split_face(env, m, r, h, v, along_h);
    uint32_t rest = add_edge(env, m, r, g, second, m->fixed[e], m->axis[e], m->side[e]);
    m->d[e] = first;
    m->edge[g] = rest, m->rot[g] = m->rot[h], m->mark[g] = mark;
    m->twin[g] = QW_NONE;
    if (t == QW_NONE) {
        m->twin[h] = QW_NONE;
        return;
    }
    /* across: t runs b -> m now, its new half k runs m -> a */
    uint32_t k = split_face(env, m, r, t, v, along_t);
    m->edge[t] = rest, m->edge[k] = e, m->rot[k] = m->rot[t], m->mark[k] = mark;
    m->twin[t] = g, m->twin[g] = t, m->twin[k] = h, m->twin[h] = k;
}

int64_t qw_subdivide_long_edges(qw_env *env, qw_offset_mesh *m)
{
    assert(m->d && m->rot && m->twin);
    room r = {m->vertex_count, m->face_count, m->edge_count};
    int32_t longest = 0;
    for (uint32_t e = 0; e < m->edge_count; e++) {
        int32_t l = qw_int2_norm(m->d[e]);
        if (l > longest) longest = l;
    }
    int64_t splits = 0;
    /* a split leaves pieces no longer than the longest edge about it, so lengths go down level by level */
    for (int32_t length = longest; length > 1;) {
        int32_t next = 1;
        int64_t before = splits;
        for (uint32_t e = 0; e < m->edge_count; e++) {
            int32_t l = qw_int2_norm(m->d[e]);
            if (l >= length) split_edge(env, m, &r, e), splits++;
            else if (l > next) next = l;
        }
        if (splits == before) length = next;
    }
    return splits;
}

#include "remesh/offsets/offsets.h"

#include "remesh/offsets/lattice.h"
#include "remesh/offsets/frames.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Numbers the edges, and chooses the half-edge in whose frame each one's offset is kept. */
static void number_edges(qw_env *env, qw_offset_mesh *m)
{
    uint32_t corners = 3 * m->face_count, count = 0;
    m->edge = QW_NEW(env, uint32_t, corners);
    m->half = QW_NEW(env, uint32_t, corners);
    for (uint32_t h = 0; h < corners; h++) {
        uint32_t t = m->twin[h];
        if (t != QW_NONE && t < h) {
            m->edge[h] = m->edge[t];
            continue;
        }
        /* the frame is that of the end with the lower index, so the edge runs from there where it can */
        bool forward = t == QW_NONE || m->corner[h] < m->corner[qw_next(h)];
        m->half[count] = forward ? h : t;
        m->edge[h] = count++;
    }
    m->edge_count = count;
    m->half = qw_resize(env, m->half, count, sizeof *m->half);
}

static qw_lattice lattice_of(const qw_offset_input *in, uint32_t v)
{
    qw_vec3 p = in->lattice ? in->lattice[v] : in->mesh->position[v];
    return (qw_lattice){in->mesh->position[v], in->normal[v], in->orientation[v], p, in->size[v]};
}

/* The axis of the cross at v that runs along the rings of its nest. */
static unsigned axis_along(const qw_offset_input *in, uint32_t v)
{
    unsigned best = 0;
    for (unsigned k = 1; k < 4; k++)
        if (qw_dot(qw_axis(in->orientation[v], in->normal[v], k), in->nested[v]) >
            qw_dot(qw_axis(in->orientation[v], in->normal[v], best), in->nested[v]))
            best = k;
    return best;
}

/* Quarter turns from v's frame to u's, along their edge. In a nest the rings are one axis: where they turn sharply from
   one vertex to the next, as at the corner of an eye, the nearest axes may be others. */
static unsigned turns_to(const qw_offset_input *in, uint32_t v, uint32_t u)
{
    assert(v < in->mesh->vertex_count && u < in->mesh->vertex_count);
    if (in->nested && qw_length2(in->nested[u]) > 0 && qw_length2(in->nested[v]) > 0)
        return (axis_along(in, u) + 4 - axis_along(in, v)) & 3u;
    /* always matched in the same order, so that the turns there and back are exact inverses */
    if (u < v)
        return qw_match_turns(qw_match_crosses(in->orientation[u], in->normal[u], in->orientation[v], in->normal[v]));
    return (4 -
            qw_match_turns(qw_match_crosses(in->orientation[v], in->normal[v], in->orientation[u], in->normal[u]))) &
           3u;
}

uint8_t *qw_offset_near_curves(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->constraint);
    enum { RINGS = 2 };
    uint8_t *near = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) near[v] = m->constraint[v] != QW_VERTEX_FREE;
    for (uint8_t ring = 1; ring < RINGS; ring++)
        for (uint32_t h = 0; h < 3 * m->face_count; h++) {
            uint8_t *a = &near[m->corner[h]], *b = &near[m->corner[qw_next(h)]];
            if (*a == ring && !*b) *b = (uint8_t)(ring + 1);
            if (*b == ring && !*a) *a = (uint8_t)(ring + 1);
        }
    return near;
}

/* The coordinates of the vector along h in the frame of axis o and normal n. A normal is smoothed at the scale of the
   quads, so that relief does not count; but beside a sharp edge and on a thin rim it leans so much that projections
   would be short: there the frame is turned into the planes of the triangles at h. */
static qw_real2 seen_in(const qw_trimesh *mesh, uint32_t h, qw_vec3 along, qw_vec3 o, qw_vec3 n, bool by_planes)
{
    assert(h < 3 * mesh->face_count);
    qw_vec3 side = qw_cross(n, o);
    if (!by_planes) return (qw_real2){qw_dot(along, o), qw_dot(along, side)};
    qw_real2 sum = {0, 0};
    float count = 0;
    for (int i = 0; i < 2 && h != QW_NONE; i++, h = mesh->twin[h]) {
        qw_vec3 up = qw_normalize(qw_face_cross(mesh, h / 3)), both = qw_add(n, up);
        float share = 1 / fmaxf(1 + qw_dot(n, up), 0.1f); /* the divisor is kept from 0: a triangle that faces against
                                                             its normals has no plane to turn into */
        sum.x += qw_dot(along, qw_madd(o, -share * qw_dot(o, up), both));
        sum.y += qw_dot(along, qw_madd(side, -share * qw_dot(side, up), both));
        count++;
    }
    return (qw_real2){sum.x / count, sum.y / count};
}

/* Definition 3.1 (without a position field the nearest whole numbers), in the frame of the tail of the edge's own
 * half-edge. */
static void edge_offset(const qw_offset_input *in, const uint8_t *near, qw_offset_mesh *m, uint32_t e, uint8_t *turn)
{
    assert(e < m->edge_count);
    uint32_t h = m->half[e], u = m->corner[h], v = m->corner[qw_next(h)];
    qw_lattice lu = lattice_of(in, u), lv = lattice_of(in, v);
    *turn = (uint8_t)turns_to(in, v, u);
    m->axis[e] = in->orientation[u];
    m->side[e] = qw_cross(in->normal[u], in->orientation[u]);
    /* the mean of what both ends see, as the field turns along the edge */
    qw_vec3 along = qw_scale(qw_sub(m->position[v], m->position[u]), 2.0f / (lu.h + lv.h)),
            x = qw_axis(lv.o, lv.normal, 4u - *turn);
    bool by_planes = near[u] && near[v];
    qw_real2 a = seen_in(in->mesh, h, along, lu.o, lu.normal, by_planes),
             b = seen_in(in->mesh, h, along, x, lv.normal, by_planes);
    m->real[e] = (qw_real2){0.5f * (a.x + b.x), 0.5f * (a.y + b.y)};
    if (in->lattice) {
        qw_offsets t = qw_match_lattices(&lu, &lv);
        m->d[e] = qw_int2_sub(t.tu, qw_turn(*turn, t.tv));
    } else {
        m->d[e] = (qw_int2){(int32_t)qw_round_even(m->real[e].x), (int32_t)qw_round_even(m->real[e].y)};
    }
}

/* A curve edge lies on a lattice line: its offset has no component across the axis that it is nearest to. */
static void constrain_curve_edge(const qw_offset_input *in, qw_offset_mesh *m, uint32_t e)
{
    assert(e < m->edge_count);
    uint32_t h = m->half[e], t = m->twin[h], u = m->corner[h], v = m->corner[qw_next(h)];
    bool curve = t == QW_NONE ? in->with_boundary : (m->mark[h] & QW_MARK_FEATURE) != 0;
    if (!curve) return;
    qw_vec3 along = qw_sub(m->position[v], m->position[u]);
    /* the end on the smooth part of the curve knows its direction better than a corner does */
    uint32_t judge = m->constraint[u] == QW_VERTEX_CORNER && m->constraint[v] != QW_VERTEX_CORNER ? v : u;
    qw_real2 seen = seen_in(in->mesh, h, along, in->orientation[judge], in->normal[judge], true);
    bool on_x = fabsf(seen.x) >= fabsf(seen.y);
    if (judge == v && (turns_to(in, v, u) & 1u)) on_x = !on_x;
    m->fixed[e] = on_x ? QW_FIXED_Y : QW_FIXED_X;
    if (on_x) m->d[e].y = 0;
    else m->d[e].x = 0;
}

typedef struct edge_work {
    const qw_offset_input *in;
    qw_offset_mesh *m;
    const uint8_t *near; /* uint8_t[vertex_count], of qw_offset_near_curves */
    uint8_t *turn; /* uint8_t[edge_count], quarter turns from the frame of the head of the edge's own half-edge to its
                      tail's */
} edge_work;

static void edge_block(void *user, uint32_t begin, uint32_t end)
{
    const edge_work *w = user;
    for (uint32_t e = begin; e < end; e++) {
        edge_offset(w->in, w->near, w->m, e, &w->turn[e]);
        constrain_curve_edge(w->in, w->m, e);
    }
}

qw_offset_mesh qw_integer_offsets(qw_env *env, const qw_offset_input *in)
{
    assert(in->mesh->twin && in->normal && in->orientation && in->size && in->constraint && in->direction);
    const qw_trimesh *mesh = in->mesh;
    uint32_t n = mesh->vertex_count, corners = 3 * mesh->face_count;
    qw_offset_mesh m = {.vertex_count = n,
                        .face_count = mesh->face_count,
                        .corner = mesh->corner,
                        .twin = mesh->twin,
                        .mark = mesh->mark ? mesh->mark : QW_NEW_ZERO(env, uint8_t, corners),
                        .position = mesh->position,
                        .normal = in->normal,
                        .lattice = in->lattice ? in->lattice : mesh->position};
#define COPY(to, type, from, count) (memcpy(to = QW_NEW(env, type, count), from, (size_t)(count) * sizeof(type)))
    COPY(m.size, float, in->size, n);
    COPY(m.constraint, uint8_t, in->constraint, n);
    COPY(m.direction, qw_vec3, in->direction, n);
#undef COPY
    number_edges(env, &m);
    m.d = QW_NEW(env, qw_int2, m.edge_count);
    m.real = QW_NEW(env, qw_real2, m.edge_count);
    m.axis = QW_NEW(env, qw_vec3, m.edge_count);
    m.side = QW_NEW(env, qw_vec3, m.edge_count);
    m.fixed = QW_NEW_ZERO(env, uint8_t, m.edge_count);
    uint8_t *near = qw_offset_near_curves(env, &m);
    edge_work w = {in, &m, near, QW_NEW(env, uint8_t, m.edge_count)};
    qw_parallel(env, m.edge_count, QW_GRAIN_LIGHT, edge_block, &w);
    qw_set_frames(env, &m, w.turn, in->cones_at_corners);
    qw_free(env, w.turn), qw_free(env, near);
    return m;
}

#include "geometry/quad_moves.h"

#include <assert.h>

/* The first half-edge of an open fan has no twin. */
static bool is_open(const qw_quad_edit *e, uint32_t v) { return e->mesh.twin[e->out[v]] == QW_NONE; }

uint32_t qw_valence_at(const qw_quad_edit *e, uint32_t v, bool *open)
{
    assert(v < e->mesh.vertex_count && e->out[v] != QW_NONE);
    uint32_t h = e->out[v], valence = 0;
    *open = is_open(e, v);
    do {
        valence++;
        h = qw_quad_around(&e->mesh, h);
    } while (h != QW_NONE && h != e->out[v] && valence <= QW_MAX_VALENCE);
    return h == QW_NONE && valence <= QW_MAX_VALENCE ? valence + 1 : valence;
}

static bool joined(const qw_quadmesh *m, const uint32_t *out, uint32_t a, uint32_t b)
{
    uint32_t h = out[a], prev;
    do {
        prev = qw_quad_prev(h);
        if (m->corner[qw_quad_next(h)] == b || m->corner[prev] == b) return true;
        h = m->twin[prev];
    } while (h != QW_NONE && h != out[a]);
    return false;
}

/* Those of v, at most QW_MAX_VALENCE edges, without repetition. */
static uint32_t list_neighbours(const qw_quad_edit *e, uint32_t v, uint32_t list[2 * QW_MAX_VALENCE])
{
    assert(v < e->mesh.vertex_count && e->out[v] != QW_NONE);
    const qw_quadmesh *m = &e->mesh;
    uint32_t h = e->out[v], prev, count = 0;
    do {
        prev = qw_quad_prev(h);
        uint32_t ends[2] = {m->corner[qw_quad_next(h)], m->corner[prev]};
        for (int i = 0; i < 2; i++) {
            uint32_t k = 0;
            while (k < count && list[k] != ends[i]) k++;
            if (k == count) list[count++] = ends[i];
        }
        h = m->twin[prev];
    } while (h != QW_NONE && h != e->out[v]);
    return count;
}

static bool is_listed(const uint32_t *list, uint32_t count, uint32_t v)
{
    for (uint32_t i = 0; i < count; i++)
        if (list[i] == v) return true;
    return false;
}

/* Once for each edge of c. */
static uint32_t common_neighbours(const qw_quad_edit *e, uint32_t a, uint32_t c)
{
    assert(a < e->mesh.vertex_count && c < e->mesh.vertex_count);
    const qw_quadmesh *m = &e->mesh;
    uint32_t of_a[2 * QW_MAX_VALENCE], count = list_neighbours(e, a, of_a), common = 0, h = e->out[c], prev;
    do {
        prev = qw_quad_prev(h);
        common += is_listed(of_a, count, m->corner[qw_quad_next(h)]);
        if (m->twin[prev] == QW_NONE) common += is_listed(of_a, count, m->corner[prev]);
        h = m->twin[prev];
    } while (h != QW_NONE && h != e->out[c]);
    return common;
}

static bool keeps_edges(const qw_quad_edit *e, uint32_t v)
{
    bool open;
    uint32_t valence = qw_valence_at(e, v, &open);
    return valence > (open ? 2u : 3u) && valence <= QW_MAX_VALENCE;
}

/* Collapses a quad along the diagonal from its first corner, unless the surface, a curve or a valence forbids it.
 * */
static bool collapse(qw_quad_edit *e, uint32_t h0, bool curveless)
{
    assert(h0 < 4 * e->mesh.face_count);
    qw_quadmesh *m = &e->mesh;
    uint32_t h1 = qw_quad_next(h0), h2 = qw_quad_next(h1), h3 = qw_quad_next(h2);
    uint32_t a = m->corner[h0], b = m->corner[h1], c = m->corner[h2], d = m->corner[h3];
    if (m->kind[c] > m->kind[a]) return false; /* the other way round, then */
    if (m->kind[a] && m->kind[c] && !curveless) return false;
    bool a_open, c_open;
    uint32_t a_valence = qw_valence_at(e, a, &a_open), c_valence = qw_valence_at(e, c, &c_open),
             valence = a_valence + c_valence;
    if ((a_open && c_open) || valence < 5 || valence > QW_MAX_VALENCE) return false;
    if (!keeps_edges(e, b) || !keeps_edges(e, d)) return false;
    if (b == d || joined(m, e->out, a, c) || common_neighbours(e, a, c) != 2) return false;
    uint32_t t0 = m->twin[h0], t1 = m->twin[h1], t2 = m->twin[h2], t3 = m->twin[h3];
    if ((t0 == QW_NONE && t1 == QW_NONE) || (t2 == QW_NONE && t3 == QW_NONE)) return false;
    if (qw_quad_is_small_shell(m, h0 / 4, QW_LEAST_SHELL)) return false;
    if (!m->kind[a]) qw_quad_edit_place(e, a, qw_lerp(m->position[a], m->position[c], 0.5f));
    qw_quad_edit_relabel(e, c, a);
    qw_quad_edit_glue(e, t0, t1);
    qw_quad_edit_glue(e, t2, t3);
    qw_quad_edit_remove(e, h0 / 4);
    qw_quad_edit_set_out(e, a, t1 != QW_NONE ? t1 : qw_quad_next(t0));
    qw_quad_edit_set_out(e, b, t0 != QW_NONE ? t0 : qw_quad_next(t1));
    qw_quad_edit_set_out(e, d, t2 != QW_NONE ? t2 : qw_quad_next(t3));
    return true;
}

/* The hexagon of the two quads at h, from the head of h around; its edge joins corners 0 and 3. on: to 1 and 4; back:
 * to 2 and 5. */
static bool rotate(qw_quad_edit *e, uint32_t h, bool back)
{
    qw_quadmesh *m = &e->mesh;
    assert(h < 4 * m->face_count);
    uint32_t t = m->twin[h], side[6], twin[6], v[6];
    uint8_t mark[6];
    if (t == QW_NONE || m->mark[h] || t / 4 == h / 4) return false;
    side[0] = qw_quad_next(h), side[1] = qw_quad_next(side[0]), side[2] = qw_quad_next(side[1]);
    side[3] = qw_quad_next(t), side[4] = qw_quad_next(side[3]), side[5] = qw_quad_next(side[4]);
    for (int i = 0; i < 6; i++) {
        v[i] = m->corner[side[i]], twin[i] = m->twin[side[i]], mark[i] = m->mark[side[i]];
        if (twin[i] != QW_NONE && (twin[i] / 4 == h / 4 || twin[i] / 4 == t / 4)) return false;
        for (int k = 0; k < i; k++)
            if (v[k] == v[i]) return false;
    }
    int first = back ? 2 : 1;
    bool open[6];
    if (!keeps_edges(e, v[0]) || !keeps_edges(e, v[3])) return false;
    if (qw_valence_at(e, v[first], open) >= QW_MAX_VALENCE || qw_valence_at(e, v[first + 3], open) >= QW_MAX_VALENCE)
        return false;
    if (joined(m, e->out, v[first], v[first + 3])) return false;
    for (int i = 0; i < 6; i++) open[i] = is_open(e, v[i]);
    uint32_t inner[2];
    for (int q = 0; q < 2; q++) {
        uint32_t base = q ? t & ~3u : h & ~3u;
        for (int i = 0; i < 4; i++) qw_quad_edit_put(e, &m->corner[base + (uint32_t)i], v[(first + 3 * q + i) % 6]);
        for (int i = 0; i < 3; i++) {
            int from = (first + 3 * q + i) % 6;
            qw_quad_edit_put(e, &m->twin[base + (uint32_t)i], twin[from]);
            qw_quad_edit_put_byte(e, &m->mark[base + (uint32_t)i], mark[from]);
            if (twin[from] != QW_NONE) qw_quad_edit_put(e, &m->twin[twin[from]], base + (uint32_t)i);
        }
        inner[q] = base + 3;
        qw_quad_edit_put_byte(e, &m->mark[inner[q]], 0);
    }
    qw_quad_edit_put(e, &m->twin[inner[0]], inner[1]);
    qw_quad_edit_put(e, &m->twin[inner[1]], inner[0]);
    for (int q = 0; q < 2; q++)
        for (int i = 0; i < 4; i++) {
            uint32_t k = inner[q] - 3 + (uint32_t)i, corner = m->corner[k];
            if (open[(first + 3 * q + i) % 6]) qw_quad_edit_set_out(e, corner, k);
            else qw_quad_edit_put(e, &e->out[corner], k);
        }
    return true;
}

uint32_t qw_changed_by_move(const qw_quadmesh *m, qw_quad_move mv, uint32_t v[6])
{
    assert(mv.half < 4 * m->face_count);
    if (mv.kind == QW_COLLAPSE) {
        for (uint32_t i = 0, h = mv.half; i < 4; i++, h = qw_quad_next(h)) v[i] = m->corner[h];
        return 4;
    }
    uint32_t t = m->twin[mv.half];
    if (t == QW_NONE) return 0;
    for (uint32_t i = 0, h = mv.half, g = t; i < 3; i++) {
        h = qw_quad_next(h), g = qw_quad_next(g);
        v[i] = m->corner[h], v[i + 3] = m->corner[g];
    }
    return 6;
}

bool qw_make_quad_move(qw_quad_edit *e, qw_quad_move mv, bool curveless)
{
    assert(mv.half < 4 * e->mesh.face_count);
    return mv.kind == QW_COLLAPSE ? collapse(e, mv.half, curveless) : rotate(e, mv.half, mv.kind == QW_ROTATE_BACK);
}

uint32_t qw_quad_moves_at(const qw_quad_edit *e, uint32_t v, qw_quad_move list[QW_MOVES_AT])
{
    assert(v < e->mesh.vertex_count);
    const qw_quadmesh *m = &e->mesh;
    uint32_t count = 0, first = e->out[v], h = first, left = QW_MAX_VALENCE;
    do {
        uint32_t h1 = qw_quad_next(h), h2 = qw_quad_next(h1);
        list[count++] = (qw_quad_move){h, QW_COLLAPSE}, list[count++] = (qw_quad_move){h2, QW_COLLAPSE};
        list[count++] = (qw_quad_move){h1, QW_COLLAPSE}, list[count++] = (qw_quad_move){qw_quad_next(h2), QW_COLLAPSE};
        list[count++] = (qw_quad_move){h, QW_ROTATE_ON}, list[count++] = (qw_quad_move){h, QW_ROTATE_BACK};
        list[count++] = (qw_quad_move){h1, QW_ROTATE_ON}, list[count++] = (qw_quad_move){h1, QW_ROTATE_BACK};
        list[count++] = (qw_quad_move){h2, QW_ROTATE_ON}, list[count++] = (qw_quad_move){h2, QW_ROTATE_BACK};
        h = qw_quad_around(m, h);
    } while (h != QW_NONE && h != first && --left > 0);
    return count;
}

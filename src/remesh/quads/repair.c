#include "remesh/quads/repair.h"

#include "base/mechanisms.h"
#include "geometry/chords.h"
#include "geometry/quad_edit.h"

#include <assert.h>

enum { ROUNDS = 12 };

/* ---- doublets */

/* Whether v is an inner vertex of at most three edges, which would become a doublet if it lost one. */
static bool has_no_edge_to_lose(const qw_quad_edit *e, uint32_t v)
{
    bool open;
    return qw_quad_valence(&e->mesh, e->out[v], &open) <= 3 && !open;
}

/* Closes the doublet at v, a vertex of valence 2. h0 leaves it in quad A = (v, a, x, b); the other quad is B = (v, b,
   y, a). A is removed, and v becomes x. Returns false where a or b would be the next doublet: at the tip of a
   protrusion, closing one after another would remove the whole protrusion. Rotations repair such a tip
   (remesh/quads/simplify.h). */
static bool close_doublet(qw_quad_edit *e, uint32_t v)
{
    assert(v < e->mesh.vertex_count && e->out[v] != QW_NONE);
    qw_quadmesh *m = &e->mesh;
    uint32_t h0 = e->out[v], h1 = qw_quad_next(h0), h2 = qw_quad_next(h1), h3 = qw_quad_next(h2);
    uint32_t b_out = m->twin[h3]; /* v -> b in B */
    if (b_out == QW_NONE || b_out / 4 == h0 / 4) return false;
    uint32_t x = m->corner[h2], a = m->corner[h1], b = m->corner[h3], y = m->corner[qw_quad_next(qw_quad_next(b_out))];
    if (x == v || y == x || y == v || a == b || has_no_edge_to_lose(e, a) || has_no_edge_to_lose(e, b)) return false;
    if (m->kind[v] && m->kind[x]) return false;
    uint32_t t0 = m->twin[h0], t1 = m->twin[h1], t2 = m->twin[h2], t3 = m->twin[h3];
    if (m->kind[v]) m->kind[x] = m->kind[v], m->position[x] = m->position[v];
    qw_quad_edit_relabel(e, v, x);
    qw_quad_edit_glue(e, t0, t1);
    qw_quad_edit_glue(e, t2, t3);
    qw_quad_edit_remove(e, h0 / 4);
    qw_quad_edit_set_out(e, x, b_out);
    qw_quad_edit_set_out(e, a, t0); /* t0 runs a -> v in B, and is there as v is inside */
    qw_quad_edit_set_out(e, b, t2 == QW_NONE ? qw_quad_next(b_out) : t2);
    return true;
}

/* Removes the quad at v, a vertex of valence 1: its only quad is (v, a, x, a), whose two sides at v are glued to one
   another. Its other two sides are then glued. That is done even if v lies on a curve, as such a quad is degenerate
   and every split of its chord would make another; x then gets v's position. */
static bool close_spike(qw_quad_edit *e, uint32_t v)
{
    assert(v < e->mesh.vertex_count && e->out[v] != QW_NONE);
    qw_quadmesh *m = &e->mesh;
    uint32_t h0 = e->out[v], h1 = qw_quad_next(h0), h2 = qw_quad_next(h1), h3 = qw_quad_next(h2);
    uint32_t t1 = m->twin[h1], t2 = m->twin[h2];
    if (m->twin[h0] != h3 || (t1 == QW_NONE && t2 == QW_NONE) || t1 == h2) return false;
    uint32_t a = m->corner[h1], x = m->corner[h2];
    if (m->kind[v] > m->kind[x]) m->kind[x] = m->kind[v], m->position[x] = m->position[v];
    qw_quad_edit_glue(e, t1, t2);
    qw_quad_edit_remove(e, h0 / 4);
    qw_quad_edit_set_out(e, x, t1 == QW_NONE ? qw_quad_next(t2) : t1); /* t1 runs x -> a, t2 runs a -> x */
    qw_quad_edit_set_out(e, a, t2 == QW_NONE ? qw_quad_next(t1) : t2);
    return true;
}

/* Removes vertices with one or two quads, until there are none inside. Returns how many. */
static int64_t close_doublets(qw_env *env, qw_quad_edit *e)
{
    qw_quadmesh *m = &e->mesh;
    uint8_t *dead = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    int64_t closed = 0;
    for (int64_t before = -1; before != closed;) {
        before = closed;
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            bool on_boundary;
            if (dead[v] || e->out[v] == QW_NONE) continue;
            uint32_t valence = qw_quad_valence(m, e->out[v], &on_boundary);
            if (on_boundary || valence > 2) continue;
            if (valence == 2 ? close_doublet(e, v) : close_spike(e, v)) dead[v] = 1, closed++;
        }
    }
    if (closed) qw_quad_edit_pack(e);
    qw_free(env, dead);
    return closed;
}

/* ---- double edges */

/* Whether the edge of h must be split: it is a loop, or one of several edges between its ends of which another stays
   whole. */
static bool is_in_the_way(const qw_quadmesh *m, const uint32_t *out, const uint8_t *split, uint32_t h)
{
    assert(h < 4 * m->face_count);
    uint32_t from = m->corner[h], to = m->corner[qw_quad_next(h)], whole = 0, k = out[from], back;
    if (split[h]) return false;
    if (from == to) return true;
    do {
        back = qw_quad_prev(k);
        if (m->corner[qw_quad_next(k)] == to) whole += !split[k];
        if (m->twin[back] == QW_NONE && m->corner[back] == to) whole += !split[back];
        k = m->twin[back];
    } while (k != QW_NONE && k != out[from]);
    return whole > 1;
}

/* Splits chords across double edges, so that of several edges between two vertices one stays whole. A chord of more
   than *room quads is left; *room falls by the quads added. Returns how many chords were split. */
static int64_t split_double_edges(qw_env *env, qw_quadmesh *m, int64_t *room)
{
    assert(m->twin && room);
    uint32_t sides = 4 * m->face_count;
    uint8_t *doubled = QW_NEW(env, uint8_t, sides), *split = QW_NEW_ZERO(env, uint8_t, sides);
    int64_t chords = 0;
    if (qw_quadmesh_double_edges(env, m, doubled) > 0) {
        uint32_t *out = qw_quadmesh_outgoing(env, m);
        for (uint32_t h = 0; h < sides; h++) {
            if (!doubled[h] || !is_in_the_way(m, out, split, h)) continue;
            int64_t length = qw_chord_length(m, h, *room);
            if (length > *room) continue;
            *room -= length;
            qw_mark_chord(m, h, split);
            chords++;
        }
        if (chords) qw_split_chords(env, m, split);
        qw_free(env, out);
    }
    qw_free(env, doubled), qw_free(env, split);
    return chords;
}

/* ---- double edges for which no chord has room */

enum { MOST_FAN = 32, SEPARATION_ROUNDS = 6 };

typedef struct fan {
    uint32_t count, out[MOST_FAN], to[MOST_FAN];
} fan;

static bool collect_fan(const qw_quadmesh *m, uint32_t first, fan *r)
{
    assert(first < 4 * m->face_count);
    bool open;
    r->count = qw_quad_valence(m, first, &open);
    if (open || r->count > MOST_FAN) return false;
    for (uint32_t i = 0, h = first; i < r->count; i++, h = qw_quad_around(m, h))
        r->out[i] = h, r->to[i] = m->corner[qw_quad_next(h)];
    return true;
}

/* Of the edges after i and before j of the fan, going round, the one nearest to the middle whose far vertex has not
   changed yet. An edge on a curve counts as one place farther from the middle. MOST_FAN: there is none. */
static uint32_t between(const qw_quadmesh *m, const fan *f, const uint8_t *touched, uint32_t i, uint32_t j)
{
    assert(i < f->count && j < f->count);
    uint32_t room = (j + f->count - i) % f->count, best = MOST_FAN, best_off = 2 * MOST_FAN;
    for (uint32_t k = 1; k < room; k++) {
        uint32_t at = (i + k) % f->count,
                 off = (2 * k > room ? 2 * k - room : room - 2 * k) + (m->mark[f->out[at]] ? 2 : 0);
        if (off < best_off && !touched[f->to[at]]) best = at, best_off = off;
    }
    return best;
}

/* How many edges after i and before j of the fan, going round, lie on curves. */
static uint32_t curves_between(const qw_quadmesh *m, const fan *f, uint32_t i, uint32_t j)
{
    uint32_t count = 0;
    for (i = (i + 1) % f->count; i != j; i = (i + 1) % f->count) count += m->mark[f->out[i]] != 0;
    return count;
}

/* After one edge has become two: gives its mark to `kept` and none to `other`. */
static void keep_curve(qw_quadmesh *m, uint32_t kept, uint32_t other, uint8_t mark)
{
    assert(kept < 4 * m->face_count);
    m->mark[kept] = m->mark[m->twin[kept]] = mark;
    m->mark[other] = m->mark[m->twin[other]] = 0;
}

/* Splits the fan's vertex along edges p and q. The half with curves inside, or v's if neither or both have some,
   keeps the vertex's kind and position and the marks of p and q. Where both have some, the new vertex lies on a curve
   as well. */
static void separate_fan(qw_quadmesh *m, const fan *f, uint32_t p, uint32_t q, uint8_t *touched)
{
    assert(p < f->count && q < f->count);
    uint32_t v = m->corner[f->out[0]], w = m->vertex_count;
    uint8_t mark_p = m->mark[f->out[p]], mark_q = m->mark[f->out[q]];
    bool stays = curves_between(m, f, q, p) > 0, moves = !stays && curves_between(m, f, p, q) > 0,
         both = stays && curves_between(m, f, p, q) > 0;
    qw_vec3 place = m->position[v];
    uint32_t h = 4 * qw_quad_split_vertex(m, f->out, f->count, p, (q + f->count - p) % f->count);
    if (m->kind[v] != QW_VERTEX_FREE)
        m->position[moves ? w : v] = place, m->kind[moves ? v : w] = both ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
    keep_curve(m, moves ? h + 1 : h, moves ? h : h + 1, mark_p);
    keep_curve(m, moves ? h + 2 : h + 3, moves ? h + 3 : h + 2, mark_q);
    for (uint32_t k = 0; k < 4; k++) touched[m->corner[h + k]] = 1;
}

/* Separates two edges from v to one other vertex, or the two ends of a loop: v becomes two vertices, one at each of
   them, with a quad between. */
static bool separate_at(qw_quadmesh *m, uint32_t first, uint8_t *touched)
{
    assert(first < 4 * m->face_count);
    fan f;
    uint32_t v = m->corner[first];
    if (touched[v] || !collect_fan(m, first, &f)) return false;
    for (uint32_t i = 0; i < f.count; i++)
        for (uint32_t j = i + 1; j < f.count; j++) {
            if (f.to[i] != f.to[j] || (f.to[i] == v && m->twin[f.out[i]] != f.out[j]))
                continue; /* both ends of a loop leave v */
            uint32_t p = between(m, &f, touched, i, j), q = between(m, &f, touched, j, i);
            if (p == MOST_FAN || q == MOST_FAN || f.to[p] == f.to[q] || f.to[p] == v || f.to[q] == v) continue;
            separate_fan(m, &f, p, q, touched);
            return true;
        }
    return false;
}

/* Separates double edges, no two that share a vertex in one round. Returns how many. */
static int64_t separate_double_edges(qw_env *env, qw_quad_edit *e)
{
    qw_quadmesh *m = &e->mesh;
    uint32_t sides = 4 * m->face_count, n = m->vertex_count;
    uint8_t *doubled = QW_NEW(env, uint8_t, sides);
    int64_t most = qw_quadmesh_double_edges(env, m, doubled), separated = 0;
    if (most > 0) {
        uint8_t *touched = QW_NEW_ZERO(env, uint8_t, (size_t)n + (size_t)most);
        qw_quad_edit_reserve(e, (uint32_t)most);
        for (uint32_t h = 0; h < sides && separated < most; h++) {
            if (!doubled[h]) continue;
            uint32_t a = m->corner[h], b = m->corner[qw_quad_next(h)];
            if (!touched[a] && !touched[b])
                separated += separate_at(m, e->out[a], touched) || separate_at(m, e->out[b], touched);
        }
        qw_free(env, touched);
    }
    qw_free(env, doubled);
    return separated;
}

qw_quadmesh qw_repair_quads(qw_env *env, const qw_quadmesh *mesh, int64_t room, qw_repair_counts *counts)
{
    assert(mesh->twin && counts);
    qw_scope_begin(env);
    qw_quad_edit e = qw_quad_edit_open(env, mesh);
    for (int round = 0; round < ROUNDS; round++) {
        int64_t doublets = close_doublets(env, &e),
                chords = qw_uses(env, QW_MECH_DOUBLE_EDGE_CHORDS) ? split_double_edges(env, &e.mesh, &room) : 0;
        qw_did(env, QW_MECH_DOUBLE_EDGE_CHORDS, chords);
        counts->doublets += doublets;
        counts->split_chords += chords;
        if (chords == 0) break;
        e = qw_quad_edit_open(env, &e.mesh);
    }
    for (int round = 0; round < SEPARATION_ROUNDS && qw_uses(env, QW_MECH_DOUBLE_EDGES); round++) {
        int64_t separated = separate_double_edges(env, &e);
        qw_did(env, QW_MECH_DOUBLE_EDGES, separated);
        if (separated == 0) break;
        e = qw_quad_edit_open(env, &e.mesh);
    }
    qw_quad_edit_keep(&e);
    qw_scope_end(env);
    return e.mesh;
}

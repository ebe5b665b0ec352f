#include "quad/repair.h"

#include "quad/chords.h"
#include "quad/edit.h"

enum { ROUNDS = 12 };

/* ---- doublets */

/* v has valence 2: h0 leaves it in quad A = (v, a, x, b), the other quad is B = (v, b, y, a). A goes, v becomes x. */
static bool close_doublet(qw_quad_edit *e, uint32_t v)
{
    qw_quadmesh *m = &e->mesh;
    uint32_t h0 = e->out[v], h1 = qw_quad_next(h0), h2 = qw_quad_next(h1), h3 = qw_quad_next(h2);
    uint32_t b_out = m->twin[h3]; /* v -> b in B */
    if (b_out == QW_NONE || b_out / 4 == h0 / 4) return false;
    uint32_t x = m->corner[h2], a = m->corner[h1], b = m->corner[h3], y = m->corner[qw_quad_next(qw_quad_next(b_out))];
    if (x == v || y == x || y == v || a == b) return false;
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

/* v has valence 1: its only quad is (v, a, x, a), with its two sides at v glued to one another. The quad goes, and its other two sides meet.
   It goes even if a curve holds v, as it is degenerate and would come back from every chord that is split; x then takes v's place. */
static bool close_spike(qw_quad_edit *e, uint32_t v)
{
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

/* Whether the edge of h must be split: it is a loop, or not the last of those between its ends that stay whole. */
static bool is_in_the_way(const qw_quadmesh *m, const uint32_t *out, const uint8_t *split, uint32_t h)
{
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

/* Chords until of the edges between two vertices all but one are split; but none for which there is no room. */
static int64_t split_double_edges(qw_env *env, qw_quadmesh *m, int64_t *room)
{
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

qw_quadmesh qw_repair_quads(qw_env *env, const qw_quadmesh *mesh, int64_t room, qw_repair_counts *counts)
{
    qw_scope_begin(env);
    qw_quad_edit e = qw_quad_edit_open(env, mesh);
    for (int round = 0; round < ROUNDS; round++) {
        int64_t doublets = close_doublets(env, &e), chords = split_double_edges(env, &e.mesh, &room);
        counts->doublets += doublets;
        counts->split_chords += chords;
        if (chords == 0) break;
        e = qw_quad_edit_open(env, &e.mesh);
    }
    qw_quad_edit_keep(&e);
    qw_scope_end(env);
    return e.mesh;
}

#include "quad/repair.h"

#include "quad/edit.h"

#include <assert.h>
#include <string.h>

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

/* ---- chords */

static uint32_t across(uint32_t h) { return (h & ~3u) | ((h + 2) & 3u); }

/* Length in quads of the chord through h; more than `most` where it is longer. */
static int64_t chord_length(const qw_quadmesh *m, uint32_t h, int64_t most)
{
    int64_t length = 0;
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE && length <= most;) {
            length++;
            g = m->twin[across(g)];
            if (g == h) return length; /* it closes */
        }
    return length;
}

/* Adds to `split` (uint8_t[sides]) all sides of the chord through h. */
static void mark_chord(const qw_quadmesh *m, uint32_t h, uint8_t *split)
{
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE && !(split[g] && split[across(g)]); g = m->twin[across(g)])
            split[g] = split[across(g)] = 1;
}

/* Midpoints on all split sides: new vertex of each, [sides]. */
static uint32_t *add_midpoints(qw_env *env, qw_quadmesh *m, const uint8_t *split, uint32_t extra)
{
    uint32_t sides = 4 * m->face_count, count = m->vertex_count;
    uint32_t *middle = QW_NEW(env, uint32_t, sides);
    size_t room = (size_t)m->vertex_count + sides + extra;
    m->position = qw_resize(env, m->position, room, sizeof *m->position);
    m->kind = qw_resize(env, m->kind, room, sizeof *m->kind);
    m->component = qw_resize(env, m->component, room, sizeof *m->component);
    for (uint32_t h = 0; h < sides; h++) {
        middle[h] = QW_NONE;
        if (!split[h]) continue;
        uint32_t t = m->twin[h];
        if (t != QW_NONE && t < h) {
            middle[h] = middle[t];
            continue;
        }
        uint32_t a = m->corner[h], b = m->corner[qw_quad_next(h)];
        m->position[count] = qw_lerp(m->position[a], m->position[b], 0.5f);
        bool curve = (t == QW_NONE || m->mark[h]) && m->kind[a] && m->kind[b];
        m->kind[count] = curve ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
        m->component[count] = m->component[a];
        middle[h] = count++;
    }
    m->vertex_count = count;
    return middle;
}

/* The new faces that lie along old side h, from its tail to its head: one, or two where it is split; their sides on h. */
typedef struct pieces {
    uint32_t side[2];
} pieces;

typedef struct splitting {
    qw_quadmesh fresh;
    pieces *on; /* [old sides] */
} splitting;

static uint32_t add_quad(qw_quadmesh *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    uint32_t f = m->face_count++;
    uint32_t *at = m->corner + 4 * (size_t)f;
    at[0] = a, at[1] = b, at[2] = c, at[3] = d;
    for (int i = 0; i < 4; i++) m->twin[4 * f + (uint32_t)i] = QW_NONE, m->mark[4 * f + (uint32_t)i] = 0;
    return 4 * f;
}

static void join(qw_quadmesh *m, uint32_t a, uint32_t b) { m->twin[a] = b, m->twin[b] = a; }

static void keep_face(const qw_quadmesh *m, uint32_t f, splitting *s)
{
    const uint32_t *c = m->corner + 4 * f;
    uint32_t q = add_quad(&s->fresh, c[0], c[1], c[2], c[3]);
    for (uint32_t i = 0; i < 4; i++) s->on[4 * f + i] = (pieces){{q + i, QW_NONE}};
}

/* Sides i and i + 2 are split: two quads side by side. */
static void halve_face(const qw_quadmesh *m, uint32_t f, uint32_t i, const uint32_t *middle, splitting *s)
{
    uint32_t h[4];
    for (uint32_t k = 0; k < 4; k++) h[k] = 4 * f + (i + k) % 4;
    uint32_t p = middle[h[0]], r = middle[h[2]];
    uint32_t a = add_quad(&s->fresh, m->corner[h[0]], p, r, m->corner[h[3]]);
    uint32_t b = add_quad(&s->fresh, p, m->corner[h[1]], m->corner[h[2]], r);
    join(&s->fresh, a + 1, b + 3);
    s->on[h[0]] = (pieces){{a, b}};
    s->on[h[1]] = (pieces){{b + 1, QW_NONE}};
    s->on[h[2]] = (pieces){{b + 2, a + 2}};
    s->on[h[3]] = (pieces){{a + 3, QW_NONE}};
}

/* The chord crosses itself here: four quads about a new centre. */
static void quarter_face(const qw_quadmesh *m, uint32_t f, const uint32_t *middle, splitting *s)
{
    uint32_t center = s->fresh.vertex_count++, q[4];
    const uint32_t *c = m->corner + 4 * f;
    qw_vec3 sum = {0, 0, 0};
    for (uint32_t i = 0; i < 4; i++) sum = qw_add(sum, m->position[c[i]]);
    s->fresh.position[center] = qw_scale(sum, 0.25f);
    s->fresh.kind[center] = QW_VERTEX_FREE;
    s->fresh.component[center] = m->component[c[0]];
    for (uint32_t i = 0; i < 4; i++) q[i] = add_quad(&s->fresh, c[i], middle[4 * f + i], center, middle[4 * f + (i + 3) % 4]);
    for (uint32_t i = 0; i < 4; i++) {
        join(&s->fresh, q[i] + 1, q[(i + 1) % 4] + 2);
        s->on[4 * f + i] = (pieces){{q[i], q[(i + 1) % 4] + 3}};
    }
}

static void join_faces(const qw_quadmesh *m, splitting *s)
{
    for (uint32_t h = 0; h < 4 * m->face_count; h++) {
        uint32_t t = m->twin[h];
        const uint32_t *mine = s->on[h].side;
        for (int k = 0; k < 2; k++)
            if (mine[k] != QW_NONE) s->fresh.mark[mine[k]] = m->mark[h];
        if (t == QW_NONE) continue;
        const uint32_t *theirs = s->on[t].side;
        bool two = mine[1] != QW_NONE;
        assert(two == (theirs[1] != QW_NONE));
        join(&s->fresh, mine[0], two ? theirs[1] : theirs[0]);
    }
}

static void split_chords(qw_env *env, qw_quadmesh *m, const uint8_t *split)
{
    uint32_t faces = m->face_count, added = 0;
    for (uint32_t f = 0; f < faces; f++) {
        int sides = split[4 * f] + split[4 * f + 1] + split[4 * f + 2] + split[4 * f + 3];
        added += sides == 4 ? 3 : sides == 2 ? 1 : 0;
    }
    uint32_t *middle = add_midpoints(env, m, split, faces);
    splitting s = {.fresh = *m, .on = QW_NEW(env, pieces, (size_t)4 * faces)};
    size_t sides = (size_t)4 * (faces + added);
    s.fresh.face_count = 0;
    s.fresh.corner = QW_NEW(env, uint32_t, sides);
    s.fresh.twin = QW_NEW(env, uint32_t, sides);
    s.fresh.mark = QW_NEW(env, uint8_t, sides);
    for (uint32_t f = 0; f < faces; f++) {
        const uint8_t *on = split + 4 * f;
        if (on[0] && on[1])
            quarter_face(m, f, middle, &s);
        else if (on[0] || on[1])
            halve_face(m, f, on[0] ? 0 : 1, middle, &s);
        else
            keep_face(m, f, &s);
    }
    join_faces(m, &s);
    qw_free(env, m->corner), qw_free(env, m->twin), qw_free(env, m->mark), qw_free(env, middle), qw_free(env, s.on);
    *m = s.fresh;
}

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
            int64_t length = chord_length(m, h, *room);
            if (length > *room) continue;
            *room -= length;
            mark_chord(m, h, split);
            chords++;
        }
        if (chords) split_chords(env, m, split);
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

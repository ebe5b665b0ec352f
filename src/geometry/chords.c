#include "geometry/chords.h"

#include <assert.h>
#include <string.h>

int64_t qw_chord_length(const qw_quadmesh *m, uint32_t h, int64_t most)
{
    assert(m->twin && h < 4 * m->face_count);
    int64_t length = 0;
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE && length <= most;) {
            length++;
            g = m->twin[qw_quad_across(g)];
            if (g == h) return length; /* it closes */
        }
    return length;
}

void qw_mark_chord(const qw_quadmesh *m, uint32_t h, uint8_t *split)
{
    assert(m->twin && split && h < 4 * m->face_count);
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE && !(split[g] && split[qw_quad_across(g)]);
             g = m->twin[qw_quad_across(g)])
            split[g] = split[qw_quad_across(g)] = 1;
}

/* Names the chord through side h of its quad after that, both ways. Returns its quads, those twice where it crosses
   itself, which *crosses says. */
static uint32_t name_chord(const qw_quadmesh *m, uint32_t h, uint32_t *chord, bool *crosses)
{
    uint32_t name = (h / 2 & ~1u) | (h & 1u), count = 0;
    *crosses = false;
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE; g = m->twin[qw_quad_across(g)]) {
            uint32_t at = 2 * (g / 4) + (g & 1u);
            if (chord[at] == name) break;
            chord[at] = name, count++;
            *crosses |= chord[at ^ 1u] == name;
        }
    return count;
}

uint32_t qw_crossing_quads(const qw_quadmesh *m, const uint8_t *gone, uint32_t *chord)
{
    assert(m->twin && chord);
    uint32_t sum = 0;
    memset(chord, 0xff, 2 * (size_t)m->face_count * sizeof *chord);
    for (uint32_t i = 0; i < 2 * m->face_count; i++) {
        bool crosses = false;
        if (chord[i] != QW_NONE || (gone && gone[i / 2])) continue;
        uint32_t count = name_chord(m, 4 * (i / 2) + (i & 1u), chord, &crosses);
        if (crosses) sum += count;
    }
    return sum;
}

/* Midpoints on all split sides: new vertex of each, [sides]. */
static uint32_t *add_midpoints(qw_env *env, qw_quadmesh *m, const uint8_t *split, uint32_t extra)
{
    assert(m->twin && m->kind && split);
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

/* The new faces that lie along old side h, from its tail to its head: one, or two where it is split; their sides on h.
 */
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
    assert(f < m->face_count);
    const uint32_t *c = m->corner + 4 * f;
    uint32_t q = add_quad(&s->fresh, c[0], c[1], c[2], c[3]);
    for (uint32_t i = 0; i < 4; i++) s->on[4 * f + i] = (pieces){{q + i, QW_NONE}};
}

/* Sides i and i + 2 are split: two quads side by side. */
static void halve_face(const qw_quadmesh *m, uint32_t f, uint32_t i, const uint32_t *middle, splitting *s)
{
    assert(f < m->face_count && i < 4);
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
    assert(f < m->face_count && middle);
    uint32_t center = s->fresh.vertex_count++, q[4];
    const uint32_t *c = m->corner + 4 * f;
    qw_vec3 sum = {0, 0, 0};
    for (uint32_t i = 0; i < 4; i++) sum = qw_add(sum, m->position[c[i]]);
    s->fresh.position[center] = qw_scale(sum, 0.25f);
    s->fresh.kind[center] = QW_VERTEX_FREE;
    s->fresh.component[center] = m->component[c[0]];
    for (uint32_t i = 0; i < 4; i++)
        q[i] = add_quad(&s->fresh, c[i], middle[4 * f + i], center, middle[4 * f + (i + 3) % 4]);
    for (uint32_t i = 0; i < 4; i++) {
        join(&s->fresh, q[i] + 1, q[(i + 1) % 4] + 2);
        s->on[4 * f + i] = (pieces){{q[i], q[(i + 1) % 4] + 3}};
    }
}

/* Links the new sides across the old edges, each of which has become one or two. */
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

void qw_split_chords(qw_env *env, qw_quadmesh *m, const uint8_t *split)
{
    assert(m->twin && m->kind && m->component && m->mark && split);
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
        if (on[0] && on[1]) quarter_face(m, f, middle, &s);
        else if (on[0] || on[1]) halve_face(m, f, on[0] ? 0 : 1, middle, &s);
        else keep_face(m, f, &s);
    }
    join_faces(m, &s);
    qw_free(env, m->corner), qw_free(env, m->twin), qw_free(env, m->mark), qw_free(env, middle), qw_free(env, s.on);
    *m = s.fresh;
}

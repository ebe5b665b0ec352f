#include "remesh/quads/count.h"

#include "base/mechanisms.h"
#include "base/sort.h"
#include "geometry/chords.h"
#include "geometry/quad_edit.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { CHORD_ROUNDS = 64 };
/* Each trial removal of a chord costs time in proportion to the mesh. MOST_TRIES: chords tried for one removal;
   MOST_REMOVED: removals, and as many fewer in a large mesh as QUADS_LOOKED_AT says (quads, over all removals):
   single quads are removed there instead (simplify.h). */
enum { MOST_TRIES = 64, MOST_REMOVED = 500, QUADS_LOOKED_AT = 3000000 };
/* A chord is split in a later round if its mean squared width is less than this share of the widest chord's: that one
   has been split then and is half as wide. */
static const float NARROW = 0.25f;

static float edge_length(const qw_quadmesh *m, uint32_t h)
{
    assert(h < 4 * m->face_count);
    return qw_distance(m->position[m->corner[h]], m->position[m->corner[qw_quad_next(h)]]);
}

/* Sorts by x, the largest first. */
static uint64_t key_of(float x, uint32_t index) { return (uint64_t)(UINT32_MAX - qw_float_key(x)) << 32 | index; }

/* ---- chords */

typedef struct chord {
    uint32_t length;    /* quads; 0 where it crosses itself or a face in `taken` */
    float mean_square;  /* of the edges that it runs across, over what is wanted there */
    float mean_stretch; /* of stretch_beside */
} chord;

/* How wide the quad beyond half-edge t is, along the sides next to t; 0 where there is none. */
static float width_beyond(const qw_quadmesh *m, uint32_t t)
{
    return t == QW_NONE ? 0 : qw_quad_widths(m, t / 4).of[(t & 1) ^ 1];
}

/* By how much the squared widths of the quads on both sides grow if the quad that is entered through g goes, and they
   share its width, over what is wanted there. */
static float stretch_beside(const qw_quadmesh *m, const float *wanted, uint32_t g)
{
    float width = qw_quad_widths(m, g / 4).of[g & 1],
          beside = width_beyond(m, m->twin[qw_quad_next(g)]) + width_beyond(m, m->twin[qw_quad_prev(g)]);
    return width * (beside + width / 2) / wanted[g / 4];
}

static chord mean_of(chord c)
{
    if (c.length) c.mean_square /= (float)c.length, c.mean_stretch /= (float)c.length;
    return c;
}

/* Follows the chord across h in both directions; length 0 where it is longer than `most` quads, too. visit:
   uint32_t[face_count], the stamp of the last chord that ran through each face; `stamp` is that of this one. wanted:
   float[face_count], areas. */
static chord follow(const qw_quadmesh *m, const float *wanted, uint32_t h, const uint8_t *taken, uint32_t *visit,
                    uint32_t stamp, uint32_t most)
{
    assert(h < 4 * m->face_count && taken && visit);
    chord c = {0, 0, 0};
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE;) {
            if (taken[g / 4] || visit[g / 4] == stamp || c.length == most) return (chord){0, 0, 0};
            visit[g / 4] = stamp;
            c.length++;
            c.mean_square += edge_length(m, g) * edge_length(m, g) / wanted[g / 4];
            c.mean_stretch += stretch_beside(m, wanted, g);
            g = m->twin[qw_quad_across(g)];
            if (g == h) return mean_of(c); /* it closes */
        }
    return mean_of(c);
}

/* Lists one half-edge of each chord of at most `most` quads, those across the longest edges first; `by_stretch`: those
   whose removal stretches the quads beside them most. seen: uint8_t[4 face_count], to work in. Returns how many there
   are. */
static uint32_t list_chords(const qw_quadmesh *m, const float *wanted, bool by_stretch, uint32_t most,
                            const uint8_t *taken, uint32_t *visit, uint8_t *seen, uint64_t *keys)
{
    uint32_t count = 0;
    memset(seen, 0, (size_t)4 * m->face_count);
    for (uint32_t h = 0; h < 4 * m->face_count; h++) {
        if (seen[h]) continue;
        qw_mark_chord(m, h, seen);
        chord c = follow(m, wanted, h, taken, visit, h, most);
        if (c.length) keys[count++] = key_of(by_stretch ? c.mean_stretch : c.mean_square, h);
    }
    qw_sort_u64(keys, count);
    return count;
}

/* Adds the chord's faces to `taken`. */
static void take_faces(const qw_quadmesh *m, uint32_t h, uint8_t *taken)
{
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE && !taken[g / 4]; g = m->twin[qw_quad_across(g)])
            taken[g / 4] = 1;
}

/* Splits chords lengthwise, the widest first, as long as they have no more than `room` quads together. No two of them
   share a face, and none is much narrower than the widest. Returns how many quads were added. */
static int64_t split_widest(qw_env *env, qw_quadmesh *m, const qw_wanted *w, int64_t room)
{
    assert(m->twin && room > 0);
    qw_scope_begin(env);
    const float *wanted = qw_areas_wanted_of(env, m, w);
    uint32_t sides = 4 * m->face_count, left = (uint32_t)(room < UINT32_MAX ? room : UINT32_MAX), added = 0;
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, m->face_count), *split = QW_NEW(env, uint8_t, sides);
    uint32_t *visit = QW_NEW(env, uint32_t, m->face_count);
    uint64_t *keys = QW_NEW(env, uint64_t, sides);
    memset(visit, 0xff, m->face_count * sizeof *visit);
    uint32_t count = list_chords(m, wanted, false, left, taken, visit, split, keys);
    float widest = 0;
    memset(split, 0, sides);
    memset(visit, 0xff, m->face_count * sizeof *visit);
    for (uint32_t i = 0; i < count && added < left; i++) {
        uint32_t h = (uint32_t)keys[i];
        chord c = follow(m, wanted, h, taken, visit, h, left - added);
        if (c.length == 0) continue;
        widest = fmaxf(widest, c.mean_square);
        if (c.mean_square < NARROW * widest) break;
        qw_mark_chord(m, h, split);
        take_faces(m, h, taken);
        added += c.length;
    }
    qw_quad_edit e = qw_quad_edit_open(env, m);
    if (added) qw_split_chords(env, &e.mesh, split);
    qw_quad_edit_keep(&e);
    qw_scope_end(env);
    *m = e.mesh;
    return added;
}

/* ---- chords that are removed */

/* To which of its two ends edge h of a chord is contracted; QW_NONE where that would move a curve, a corner or the
   boundary. */
static uint32_t merged_end(const qw_quadmesh *m, const uint8_t *on_boundary, uint32_t h)
{
    assert(h < 4 * m->face_count);
    uint32_t a = m->corner[h], b = m->corner[qw_quad_next(h)];
    bool curve = m->twin[h] == QW_NONE || m->mark[h];
    if (a == b || (m->twin[h] != QW_NONE && on_boundary[a] && on_boundary[b])) return QW_NONE;
    if (m->kind[a] && m->kind[b] && (!curve || (m->kind[a] == QW_VERTEX_CORNER && m->kind[b] == QW_VERTEX_CORNER)))
        return QW_NONE;
    return on_boundary[a] != on_boundary[b] ? (on_boundary[a] ? a : b) : m->kind[b] > m->kind[a] ? b : a;
}

/* What is removed with a chord. edge: a half-edge of each edge that it crosses; quad: of each of its quads the half-
   edge through which it is entered. uint32_t[face_count + 1] each. */
typedef struct row {
    uint32_t edge_count, quad_count, *edge, *quad;
} row;

/* The quads in a row through edge h, and the edges between them: to both sides until a boundary, or once around. */
static void find_row(const qw_quadmesh *m, uint32_t h, row *r)
{
    assert(h < 4 * m->face_count);
    r->edge[0] = h, r->edge_count = 1, r->quad_count = 0;
    for (int way = 0; way < 2; way++)
        for (uint32_t g = way ? m->twin[h] : h; g != QW_NONE; g = m->twin[qw_quad_across(g)]) {
            r->quad[r->quad_count++] = g;
            if (m->twin[qw_quad_across(g)] == h) return; /* it closes */
            r->edge[r->edge_count++] = qw_quad_across(g);
        }
}

/* Contracts each edge of the row to one vertex. Returns false where an edge may not be contracted or two share a
   vertex. into: uint32_t[vertex_count], to work in. */
static bool contract_edges(qw_quadmesh *m, const uint8_t *on_boundary, const row *r, uint32_t *into)
{
    assert(r->edge_count > 0 && into);
    for (uint32_t v = 0; v < m->vertex_count; v++) into[v] = QW_NONE;
    for (uint32_t i = 0; i < r->edge_count; i++) {
        uint32_t h = r->edge[i], a = m->corner[h], b = m->corner[qw_quad_next(h)], to = merged_end(m, on_boundary, h);
        if (to == QW_NONE || into[a] != QW_NONE || into[b] != QW_NONE) return false;
        into[a] = into[b] = to;
        if (m->kind[a] == m->kind[b] && on_boundary[a] == on_boundary[b])
            m->position[to] = qw_lerp(m->position[a], m->position[b], 0.5f);
    }
    for (uint32_t k = 0; k < 4 * m->face_count; k++)
        if (into[m->corner[k]] != QW_NONE) m->corner[k] = into[m->corner[k]];
    return true;
}

/* Counts the inner vertices with fewer than three edges. UINT32_MAX where a closed component has fewer quads than a
   cube. */
static uint32_t count_doublets(const qw_quad_edit *e)
{
    uint32_t count = 0;
    bool open;
    for (uint32_t v = 0; v < e->mesh.vertex_count; v++) {
        if (e->out[v] == QW_NONE || qw_quad_valence(&e->mesh, e->out[v], &open) > 2 || open) continue;
        if (qw_quad_is_small_shell(&e->mesh, e->out[v] / 4, QW_LEAST_SHELL - 1)) return UINT32_MAX;
        count++;
    }
    return count;
}

/* Removes the chord. Returns false, and leaves e unusable, where that adds doublets or double edges, or where a quad
   has no neighbour beside the chord. */
static bool remove_row(qw_quad_edit *e, const uint8_t *on_boundary, const row *r, uint32_t *into)
{
    qw_quadmesh *m = &e->mesh;
    uint32_t doublets = count_doublets(e);
    if (!contract_edges(m, on_boundary, r, into)) return false;
    for (uint32_t i = 0; i < r->quad_count; i++) {
        uint32_t g = r->quad[i], one = m->twin[qw_quad_next(g)], two = m->twin[qw_quad_prev(g)];
        if (one == QW_NONE && two == QW_NONE) return false;
        qw_quad_edit_glue(e, one, two);
        qw_quad_edit_remove(e, g / 4);
    }
    qw_quad_edit_pack(e);
    return count_doublets(e) <= doublets && qw_quadmesh_double_edges(e->env, m, NULL) == 0;
}

/* Takes the row's quads out of the wanted areas, and sets those of quads that it moves to NaN. into: of
   contract_edges. */
static void keep_wanted(const qw_quadmesh *before, const row *r, const uint32_t *into, uint8_t *taken, float *wanted)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < r->quad_count; i++) taken[r->quad[i] / 4] = 1;
    for (uint32_t f = 0; f < before->face_count; f++) {
        bool is_moved = false;
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++) is_moved |= into[before->corner[h]] != QW_NONE;
        if (!taken[f]) wanted[count++] = is_moved ? NAN : wanted[f];
    }
}

/* Removes one chord of at most `room` quads: of the MOST_TRIES that stretch the quads beside them least the first that
   can be removed. wanted: of the quads, and then of those that are left. Returns false where none can. */
static bool remove_chord(qw_env *env, qw_quadmesh *m, const qw_wanted *w, float *wanted, uint32_t room)
{
    qw_scope_begin(env);
    qw_find_areas_wanted(env, m, w, wanted);
    uint32_t sides = 4 * m->face_count;
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, m->face_count), *seen = QW_NEW(env, uint8_t, sides),
            *on_boundary = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    uint32_t *visit = QW_NEW(env, uint32_t, m->face_count), *into = QW_NEW(env, uint32_t, m->vertex_count);
    uint64_t *keys = QW_NEW(env, uint64_t, sides);
    row r = {0, 0, QW_NEW(env, uint32_t, (size_t)m->face_count + 1), QW_NEW(env, uint32_t, (size_t)m->face_count + 1)};
    memset(visit, 0xff, m->face_count * sizeof *visit);
    for (uint32_t h = 0; h < sides; h++)
        if (m->twin[h] == QW_NONE) on_boundary[m->corner[h]] = on_boundary[m->corner[qw_quad_next(h)]] = 1;
    uint32_t count = list_chords(m, wanted, true, room, taken, visit, seen, keys);
    bool found = false;
    for (uint32_t i = count, tries = MOST_TRIES; i-- > 0 && tries > 0 && !found; tries--) { /* the worst are first */
        qw_scope_begin(env);
        qw_quad_edit e = qw_quad_edit_open(env, m);
        find_row(m, (uint32_t)keys[i], &r);
        found = remove_row(&e, on_boundary, &r, into);
        if (found) {
            keep_wanted(m, &r, into, taken, wanted);
            *m = e.mesh;
            qw_quad_edit_keep(&e);
        }
        qw_scope_end(env);
    }
    if (found) {
        qw_quad_edit e = {.env = env, .mesh = *m};
        qw_quad_edit_keep(&e);
    }
    qw_scope_end(env);
    return found;
}

qw_quadmesh qw_remove_chords(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least, int64_t most)
{
    assert(mesh->twin && mesh->kind && mesh->mark && least <= most);
    qw_scope_begin(env);
    qw_quad_edit copy = qw_quad_edit_open(env, mesh);
    qw_quadmesh m = copy.mesh;
    float *area = qw_areas_wanted_of(env, &m, wanted);
    int rounds = (int)fmin(MOST_REMOVED, (double)QUADS_LOOKED_AT / fmax(m.face_count, 1));
    for (int round = 0; round < rounds && m.face_count > most; round++)
        if (!remove_chord(env, &m, wanted, area, (uint32_t)(m.face_count - least))) break;
    copy.mesh = m;
    qw_quad_edit_keep(&copy);
    qw_scope_end(env);
    return m;
}

/* ---- pairs of quads */

/* The hexagon of the two quads at an edge, from the edge's head around; the edge joins 0 and 3. Three quads about a
 * new vertex w, which is joined to every other corner, take their place. One end of the edge loses it.
 *
 *     2 --- 1 --- 0          2 --- 1 --- 0
 *     |    /      |    ->    |      \   |
 *     |   /       |          |       \  |
 *     3 --- 4 --- 5          3 --- 4 - w - 5
 */
typedef struct hexagon {
    uint32_t vertex[6], twin[6];
    uint8_t mark[6];
} hexagon;

/* The six edges around the two quads at h; false: the pair is not a plain hexagon, or something at it has been
 * changed. */
static bool find_hexagon(const qw_quadmesh *m, uint32_t h, const uint8_t *touched, hexagon *x)
{
    assert(h < 4 * m->face_count);
    uint32_t t = m->twin[h];
    if (t == QW_NONE || m->mark[h] || t / 4 == h / 4) return false;
    for (uint32_t i = 0, side = h; i < 6; i++) {
        side = qw_quad_next(i == 3 ? t : side);
        x->vertex[i] = m->corner[side], x->twin[i] = m->twin[side], x->mark[i] = m->mark[side];
        if (touched[x->vertex[i]] || (x->twin[i] != QW_NONE && (x->twin[i] / 4 == h / 4 || x->twin[i] / 4 == t / 4)))
            return false;
        for (uint32_t k = 0; k < i; k++)
            if (x->vertex[k] == x->vertex[i]) return false;
    }
    return true;
}

static bool can_lose_an_edge(const qw_quadmesh *m, uint32_t first, uint32_t *valence)
{
    bool open;
    *valence = qw_quad_valence(m, first, &open);
    return *valence > (open ? 2u : 3u);
}

/* Replaces two quads by three, around a new vertex in the middle of their hexagon. Returns whether that was
 * possible. */
static bool split_pair(qw_quad_edit *e, uint32_t h, uint8_t *touched)
{
    qw_quadmesh *m = &e->mesh;
    hexagon x;
    uint32_t valence[2];
    if (!find_hexagon(m, h, touched, &x)) return false;
    bool head = can_lose_an_edge(m, e->out[x.vertex[0]], &valence[0]),
         tail = can_lose_an_edge(m, e->out[x.vertex[3]], &valence[1]);
    if (!head && !tail) return false;
    uint32_t begin = head && (!tail || valence[0] > valence[1])
                         ? 1
                         : 0; /* the new vertex is joined to this corner and every other one */
    uint32_t w = m->vertex_count++, face[3] = {h / 4, m->twin[h] / 4, m->face_count++};
    touched[w] = 1;
    m->kind[w] = QW_VERTEX_FREE, m->component[w] = m->component[x.vertex[0]], m->position[w] = qw_v3(0, 0, 0);
    for (uint32_t j = 0; j < 3; j++) {
        uint32_t a = begin + 2 * j, b = (a + 1) % 6, c = (a + 2) % 6, base = 4 * face[j];
        uint32_t corner[4] = {x.vertex[a], x.vertex[b], x.vertex[c], w}, twin[2] = {x.twin[a], x.twin[b]};
        memcpy(m->corner + base, corner, sizeof corner);
        for (uint32_t i = 0; i < 2; i++) {
            m->twin[base + i] = twin[i], m->mark[base + i] = x.mark[i ? b : a];
            if (twin[i] != QW_NONE) m->twin[twin[i]] = base + i;
        }
        m->twin[base + 2] = 4 * face[(j + 1) % 3] + 3, m->twin[base + 3] = 4 * face[(j + 2) % 3] + 2;
        m->mark[base + 2] = m->mark[base + 3] = 0;
        touched[x.vertex[a]] = touched[x.vertex[b]] = 1;
        m->position[w] = qw_madd(qw_madd(m->position[w], 1.0f / 6, m->position[x.vertex[a]]), 1.0f / 6,
                                 m->position[x.vertex[b]]);
    }
    return true;
}

/* Splits up to `wanted` pairs of quads, the largest first, no two of them neighbours. Returns how many. */
static int64_t split_pairs(qw_env *env, qw_quadmesh *m, int64_t wanted)
{
    qw_scope_begin(env);
    uint32_t sides = 4 * m->face_count, most = (uint32_t)fmin((double)wanted, m->face_count), added = 0, count = 0;
    qw_quad_edit e = qw_quad_edit_open(env, m);
    uint64_t *keys = QW_NEW(env, uint64_t, sides);
    uint8_t *touched = QW_NEW_ZERO(env, uint8_t, (size_t)m->vertex_count + most);
    for (uint32_t h = 0; h < sides; h++) {
        if (m->twin[h] == QW_NONE || m->twin[h] < h || m->mark[h]) continue;
        float around = 0;
        for (uint32_t i = 0; i < 4; i++)
            around += edge_length(m, (h & ~3u) + i) + edge_length(m, (m->twin[h] & ~3u) + i);
        keys[count++] = key_of(around, h);
    }
    qw_sort_u64(keys, count);
    qw_quad_edit_reserve(&e, most);
    for (uint32_t i = 0; i < count && added < most; i++) added += split_pair(&e, (uint32_t)keys[i], touched);
    qw_quad_edit_keep(&e);
    qw_scope_end(env);
    *m = e.mesh;
    return added;
}

qw_quadmesh qw_add_quads(qw_env *env, const qw_quadmesh *mesh, const qw_wanted *wanted, int64_t least, int64_t most)
{
    assert(mesh->twin && mesh->kind && mesh->mark && mesh->component && least <= most);
    qw_scope_begin(env);
    qw_quad_edit copy = qw_quad_edit_open(env, mesh);
    qw_quadmesh m = copy.mesh;
    int64_t had = m.face_count;
    for (int round = 0; round < CHORD_ROUNDS && m.face_count < least && qw_uses(env, QW_MECH_CHORDS_ADDED); round++)
        if (split_widest(env, &m, wanted, most - m.face_count) == 0) break;
    qw_did(env, QW_MECH_CHORDS_ADDED, m.face_count - had), had = m.face_count;
    while (m.face_count < least && qw_uses(env, QW_MECH_PAIRS_SPLIT) && split_pairs(env, &m, least - m.face_count) > 0)
        continue;
    qw_did(env, QW_MECH_PAIRS_SPLIT, m.face_count - had);
    copy.mesh = m;
    qw_quad_edit_keep(&copy);
    qw_scope_end(env);
    return m;
}

#include "products/wrap/skin.h"

#include <assert.h>
#include <string.h>

/* ---- the boundary of cells */

/* Corners of the cells of two layers of corners at a time: number of each, or QW_NONE. */
typedef struct corners {
    qw_skin *skin;
    uint32_t across[2]; /* corners along x and y */
    uint32_t *layer[2]; /* uint32_t[across[0] across[1]]: of the lower and the upper corners */
} corners;

static uint32_t vertex_at(corners *c, const uint32_t at[3], int upper)
{
    uint32_t *slot = &c->layer[upper][(size_t)at[1] * c->across[0] + at[0]];
    qw_skin *s = c->skin;
    if (*slot != QW_NONE) return *slot;
    if (s->vertex_count == QW_NONE / 8) qw_fail(s->env, QW_TOO_LARGE, -1, "the skin of the wrap has too many vertices");
    s->position = qw_grow(s->env, s->position, &s->vertex_capacity, (size_t)s->vertex_count + 1, sizeof *s->position);
    for (int k = 0; k < 3; k++) s->position[s->vertex_count].at[k] = (int32_t)at[k] * s->frame.side;
    return *slot = s->vertex_count++;
}

/* Two triangles on the face of cell `at` on its lower or upper side along the axis, counter-clockwise from outside. */
static void add_face(corners *c, const uint32_t at[3], int axis, int upper)
{
    qw_skin *s = c->skin;
    int k = (axis + 1) % 3, l = (axis + 2) % 3;
    uint32_t v[4];
    for (int i = 0; i < 4; i++) {
        uint32_t p[3] = {at[0], at[1], at[2]};
        p[axis] += (uint32_t)upper, p[k] += i == 1 || i == 2, p[l] += i >= 2;
        v[upper ? i : 3 - i] = vertex_at(c, p, p[2] > at[2]);
        assert(v[upper ? i : 3 - i] < s->vertex_count);
    }
    size_t n = 3 * (size_t)s->face_count;
    s->corner = qw_grow(s->env, s->corner, &s->corner_capacity, n + 6, sizeof *s->corner);
    int first = (int)((at[0] + at[1] + at[2]) % 2); /* which diagonal */
    for (int i = 0; i < 3; i++) s->corner[n + (size_t)i] = v[(first + i) % 4];
    for (int i = 0; i < 3; i++) s->corner[n + 3 + (size_t)i] = v[(first + 2 + i) % 4];
    s->face_count += 2;
}

/* Of a word's cells those that are inside and have a face to what is outside. */
static uint64_t cells_with_faces(const qw_cell_set *outside, uint32_t w, uint32_t y, uint32_t z)
{
    const uint64_t *row = qw_cell_set_row(outside, y, z);
    uint64_t before = w > 0 ? row[w - 1] >> 63 : 0, after = w + 1 < outside->words ? row[w + 1] << 63 : 0;
    return ~row[w] & (row[w] << 1 | before | row[w] >> 1 | after | qw_cell_set_row(outside, y - 1, z)[w] |
                      qw_cell_set_row(outside, y + 1, z)[w] | qw_cell_set_row(outside, y, z - 1)[w] |
                      qw_cell_set_row(outside, y, z + 1)[w]);
}

/* Adds the faces between cells outside and others in layer z. */
static void add_layer(corners *c, const qw_cell_set *outside, uint32_t z)
{
    for (uint32_t y = 1; y + 1 < outside->across[1]; y++)
        for (uint32_t w = 0; w < outside->words; w++)
            for (uint64_t rest = cells_with_faces(outside, w, y, z); rest; rest &= rest - 1) {
                uint32_t at[3] = {w * 64 + (uint32_t)__builtin_ctzll(rest), y, z};
                if (at[0] >= outside->across[0]) break;
                for (int axis = 0; axis < 3; axis++)
                    for (int upper = 0; upper < 2; upper++) {
                        uint32_t next[3] = {at[0], at[1], at[2]};
                        next[axis] += upper ? 1 : UINT32_MAX;
                        if (qw_cell_set_has(outside, next[0], next[1], next[2])) add_face(c, at, axis, upper);
                    }
            }
}

static void link_all(qw_skin *s)
{
    qw_trimesh mesh = {.vertex_count = s->vertex_count, .face_count = s->face_count, .corner = s->corner};
    qw_trimesh_link(s->env, &mesh);
    s->twin = mesh.twin, s->twin_capacity = 3 * (size_t)s->face_count;
    s->out = QW_NEW(s->env, uint32_t, s->vertex_count), s->out_capacity = s->vertex_count;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        s->out[s->corner[h]] = h;
        assert(s->twin[h] != QW_NONE);
    }
}

qw_skin qw_skin_of_lattice(qw_env *env, const qw_wrap_lattice *lattice)
{
    qw_skin s = {.env = env, .frame = lattice->frame};
    corners c = {.skin = &s, .across = {lattice->frame.cells[0] + 1, lattice->frame.cells[1] + 1}};
    size_t count = (size_t)c.across[0] * c.across[1];
    for (int i = 0; i < 2; i++) {
        c.layer[i] = QW_NEW(env, uint32_t, count);
        memset(c.layer[i], 0xff, count * sizeof **c.layer);
    }
    for (uint32_t z = 1; z + 1 < lattice->frame.cells[2]; z++) {
        add_layer(&c, &lattice->outside, z);
        uint32_t *used = c.layer[0];
        c.layer[0] = c.layer[1], c.layer[1] = used;
        memset(used, 0xff, count * sizeof *used);
        qw_heartbeat(env);
    }
    qw_free(env, c.layer[0]), qw_free(env, c.layer[1]);
    link_all(&s);
    return s;
}

/* ---- around a vertex */

uint32_t qw_skin_valence(const qw_skin *s, uint32_t v)
{
    uint32_t count = 0, h = s->out[v];
    do count++, h = qw_skin_around(s, h);
    while (h != s->out[v]);
    return count;
}

uint32_t qw_skin_find(const qw_skin *s, uint32_t a, uint32_t b)
{
    uint32_t h = s->out[a];
    do {
        if (qw_skin_head(s, h) == b) return h;
        h = qw_skin_around(s, h);
    } while (h != s->out[a]);
    return QW_NONE;
}

/* ---- edits */

static void pair(qw_skin *s, uint32_t h, uint32_t t) { s->twin[h] = t, s->twin[t] = h; }

static void set_face(qw_skin *s, uint32_t first, uint32_t a, uint32_t b, uint32_t c)
{
    s->corner[first] = a, s->corner[first + 1] = b, s->corner[first + 2] = c;
    s->out[a] = first, s->out[b] = first + 1, s->out[c] = first + 2;
}

void qw_skin_flip(qw_skin *s, uint32_t h)
{
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t);
    uint32_t bc = s->twin[qw_next(h)], ca = s->twin[qw_prev(h)], ad = s->twin[qw_next(t)], db = s->twin[qw_prev(t)];
    uint32_t f = h - h % 3, g = t - t % 3;
    set_face(s, f, c, a, d), set_face(s, g, d, b, c);
    pair(s, f, ca), pair(s, f + 1, ad), pair(s, g, db), pair(s, g + 1, bc);
    pair(s, f + 2, g + 2);
}

static uint32_t new_face(qw_skin *s)
{
    size_t n = 3 * ((size_t)s->face_count + 1);
    s->corner = qw_grow(s->env, s->corner, &s->corner_capacity, n, sizeof *s->corner);
    s->twin = qw_grow(s->env, s->twin, &s->twin_capacity, n, sizeof *s->twin);
    return 3 * s->face_count++;
}

uint32_t qw_skin_reserve(qw_skin *s, qw_wrap_lattice_point at)
{
    uint32_t v = s->vertex_count;
    if (v >= QW_NONE / 8) qw_fail(s->env, QW_TOO_LARGE, -1, "the skin of the wrap has too many vertices");
    s->position = qw_grow(s->env, s->position, &s->vertex_capacity, (size_t)v + 1, sizeof *s->position);
    s->position[v] = at;
    return v;
}

uint32_t qw_skin_split(qw_skin *s, uint32_t h, qw_wrap_lattice_point at, uint32_t made[2])
{
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t), v = qw_skin_reserve(s, at);
    uint32_t bc = s->twin[qw_next(h)], ca = s->twin[qw_prev(h)], ad = s->twin[qw_next(t)], db = s->twin[qw_prev(t)];
    s->out = qw_grow(s->env, s->out, &s->out_capacity, (size_t)v + 1, sizeof *s->out);
    s->vertex_count++;
    uint32_t f = h - h % 3, g = t - t % 3, i = new_face(s), j = new_face(s);
    set_face(s, f, a, v, c), set_face(s, i, v, b, c), set_face(s, g, b, v, d), set_face(s, j, v, a, d);
    pair(s, f, j), pair(s, f + 1, i + 2), pair(s, f + 2, ca);
    pair(s, i, g), pair(s, i + 1, bc);
    pair(s, g + 1, j + 2), pair(s, g + 2, db);
    pair(s, j + 1, ad);
    made[0] = i / 3, made[1] = j / 3;
    return v;
}

bool qw_skin_can_collapse(const qw_skin *s, uint32_t h)
{
    uint32_t a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h), d = qw_skin_apex(s, s->twin[h]);
    if (qw_skin_valence(s, c) <= 3 || qw_skin_valence(s, d) <= 3) return false;
    uint32_t i = s->out[a];
    do {
        uint32_t v = qw_skin_head(s, i);
        if (v != b && v != c && v != d && qw_skin_find(s, v, b) != QW_NONE) return false;
        i = qw_skin_around(s, i);
    } while (i != s->out[a]);
    return true;
}

void qw_skin_collapse(qw_skin *s, uint32_t h)
{
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t);
    uint32_t bc = s->twin[qw_next(h)], ca = s->twin[qw_prev(h)], ad = s->twin[qw_next(t)], db = s->twin[qw_prev(t)];
    uint32_t i = h;
    do {
        uint32_t next = qw_skin_around(s, i);
        s->corner[i] = b;
        i = next;
    } while (i != h);
    pair(s, bc, ca), pair(s, ad, db);
    s->out[b] = ca, s->out[c] = bc,
    s->out[d] = ad; /* twins: ca runs from b (once a) to c, bc from c to b, ad from d to b */
    assert(s->corner[ca] == b && s->corner[bc] == c && s->corner[ad] == d);
    s->out[a] = QW_NONE;
    for (uint32_t k = 0; k < 3; k++) s->corner[h - h % 3 + k] = s->corner[t - t % 3 + k] = QW_NONE;
}

void qw_skin_pack(qw_skin *s)
{
    uint32_t *vertex = QW_NEW(s->env, uint32_t, s->vertex_count), *face = QW_NEW(s->env, uint32_t, s->face_count);
    uint32_t vertices = 0, faces = 0;
    for (uint32_t v = 0; v < s->vertex_count; v++) vertex[v] = s->out[v] == QW_NONE ? QW_NONE : vertices++;
    for (uint32_t f = 0; f < s->face_count; f++) face[f] = qw_skin_dead(s, f) ? QW_NONE : faces++;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (face[h / 3] == QW_NONE) continue;
        uint32_t to = 3 * face[h / 3] + h % 3;
        s->corner[to] = vertex[s->corner[h]], s->twin[to] = 3 * face[s->twin[h] / 3] + s->twin[h] % 3;
    }
    for (uint32_t v = 0; v < s->vertex_count; v++)
        if (vertex[v] != QW_NONE)
            s->position[vertex[v]] = s->position[v], s->out[vertex[v]] = 3 * face[s->out[v] / 3] + s->out[v] % 3;
    assert(faces % 2 == 0); /* it is closed */
    s->vertex_count = vertices, s->face_count = faces;
    qw_free(s->env, vertex), qw_free(s->env, face);
}

#include "geometry/tri_edit.h"

#include <assert.h>
#include <string.h>

_Static_assert(sizeof(qw_edit_vertex) == 32 && sizeof(qw_edit_face) <= 32, "half a cache line each");

/* Half-edges 4 f + 3 must stay below QW_NONE. */
enum { MAX_FACES = UINT32_MAX / 4 - 1 };

/* An edit with room for an eighth more than the mesh has, which is still to be filled in. */
static qw_edit make_room(qw_env *env, const qw_trimesh *mesh)
{
    assert(mesh->vertex_count == 0 || mesh->position);
    if (mesh->face_count > MAX_FACES)
        qw_fail(env, QW_TOO_LARGE, -1, "%u triangles are more than the working mesh can hold", mesh->face_count);
    qw_edit e = {.env = env, .vertex_count = mesh->vertex_count, .face_count = mesh->face_count};
    e.live_vertices = e.vertex_count;
    e.live_faces = e.face_count;
    e.vertex_capacity = (size_t)e.vertex_count + e.vertex_count / 8 + 64;
    e.face_capacity = (size_t)e.face_count + e.face_count / 8 + 128;
    e.vertex = QW_NEW(env, qw_edit_vertex, e.vertex_capacity);
    e.face = QW_NEW(env, qw_edit_face, e.face_capacity);
    return e;
}

static qw_edit_vertex opened_vertex(const qw_trimesh *mesh, uint32_t v, float target, uint32_t h)
{
    return (qw_edit_vertex){.position = mesh->position[v], .target = target, .out = 4 * (h / 3) + h % 3, .home = h};
}

/* Triangle f of a mesh as an edit keeps it, four half-edges to a face. */
static qw_edit_face opened_face(const qw_trimesh *mesh, uint32_t f)
{
    assert(f < mesh->face_count);
    qw_edit_face face = {.corner = {0}};
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t t = mesh->twin[3 * f + i];
        face.corner[i] = mesh->corner[3 * f + i];
        face.twin[i] = t == QW_NONE ? QW_NONE : 4 * (t / 3) + t % 3;
        face.mark[i] = mesh->mark ? mesh->mark[3 * f + i] : 0;
    }
    return face;
}

qw_edit qw_edit_open(qw_env *env, const qw_trimesh *mesh, const float *target, const uint32_t *outgoing)
{
    assert(mesh->twin && outgoing);
    qw_edit e = make_room(env, mesh);
    for (uint32_t v = 0; v < e.vertex_count; v++) e.vertex[v] = opened_vertex(mesh, v, target[v], outgoing[v]);
    for (uint32_t f = 0; f < e.face_count; f++) e.face[f] = opened_face(mesh, f);
    return e;
}

static uint32_t add_vertex(qw_edit *e, qw_vec3 position, float target, uint32_t home, qw_vertex_kind kind,
                           uint16_t block)
{
    e->vertex = qw_grow(e->env, e->vertex, &e->vertex_capacity, (size_t)e->vertex_count + 1, sizeof *e->vertex);
    e->vertex[e->vertex_count] = (qw_edit_vertex){
        .position = position, .target = target, .out = QW_NONE, .home = home, .block = block, .kind = (uint8_t)kind};
    e->live_vertices++;
    return e->vertex_count++;
}

static uint32_t add_face(qw_edit *e, uint32_t a, uint32_t b, uint32_t c)
{
    if (e->face_count >= MAX_FACES)
        qw_fail(e->env, QW_TOO_LARGE, -1, "the target length asks for more than %u working triangles",
                (uint32_t)MAX_FACES);
    e->face = qw_grow(e->env, e->face, &e->face_capacity, (size_t)e->face_count + 1, sizeof *e->face);
    e->face[e->face_count] = (qw_edit_face){.corner = {a, b, c}, .twin = {QW_NONE, QW_NONE, QW_NONE}};
    e->live_faces++;
    return e->face_count++;
}

/* Makes two half-edges twins, or one of them a boundary, with this mark. */
static void join(qw_edit *e, uint32_t h, uint32_t g, uint8_t mark)
{
    assert(h == QW_NONE || (h >> 2) < e->face_count);
    if (h != QW_NONE) {
        e->face[h >> 2].twin[h & 3] = g;
        e->face[h >> 2].mark[h & 3] = mark;
    }
    if (g != QW_NONE) {
        e->face[g >> 2].twin[g & 3] = h;
        e->face[g >> 2].mark[g & 3] = mark;
    }
}

/* The face of h: a -> b with apex c becomes (a, m, c), and a new face (m, b, c) is added. Returns the half-edge m -> b.
   The edge itself is left for the caller to join. */
static uint32_t split_side(qw_edit *e, uint32_t h, uint32_t m)
{
    assert(m < e->vertex_count);
    uint32_t next = qw_edit_next(h), b = qw_edit_tail(e, next), c = qw_edit_apex(e, h);
    uint32_t outer = qw_edit_twin(e, next);
    uint8_t mark = qw_edit_mark(e, next);
    uint32_t rest = 4 * add_face(e, m, b, c);
    e->face[next >> 2].corner[next & 3] = m;
    join(e, rest + 1, outer, mark);
    join(e, rest + 2, next, 0);
    if (e->vertex[b].out == next) e->vertex[b].out = rest + 1;
    return rest;
}

uint32_t qw_edit_split(qw_edit *e, uint32_t h, qw_vec3 position, float target, uint32_t home)
{
    assert(h >> 2 < e->face_count);
    uint32_t g = qw_edit_twin(e, h), b = qw_edit_head(e, h);
    uint8_t mark = qw_edit_mark(e, h);
    uint32_t m = add_vertex(e, position, target, home, qw_edit_on_curve(e, h) ? QW_VERTEX_CURVE : QW_VERTEX_FREE,
                            e->vertex[b].block);
    uint32_t rest = split_side(e, h, m);
    e->vertex[m].out = rest;
    if (g == QW_NONE) {
        join(e, h, QW_NONE, mark);
        join(e, rest, QW_NONE, mark);
        return m;
    }
    uint32_t back = split_side(e, g, m); /* g: b -> m, back: m -> a */
    join(e, h, back, mark);
    join(e, rest, g, mark);
    if (e->vertex[b].out == QW_NONE) e->vertex[b].out = g;
    return m;
}

uint32_t qw_edit_split_face(qw_edit *e, uint32_t f, qw_vec3 position, float target, uint32_t home)
{
    assert(f < e->face_count);
    uint32_t m = add_vertex(e, position, target, home, QW_VERTEX_FREE, e->vertex[e->face[f].corner[0]].block);
    qw_edit_face old = e->face[f];
    uint32_t h[3] = {4 * f, 0, 0}; /* corner[i] -> corner[i + 1], apex m */
    for (uint32_t i = 1; i < 3; i++) h[i] = 4 * add_face(e, old.corner[i], old.corner[(i + 1) % 3], m);
    e->face[f].corner[2] = m;
    for (uint32_t i = 0; i < 3; i++) {
        join(e, h[i], old.twin[i], old.mark[i]);
        join(e, h[i] + 1, h[(i + 1) % 3] + 2, 0);
        if (e->vertex[old.corner[i]].out == 4 * f + i) e->vertex[old.corner[i]].out = h[i];
    }
    e->vertex[m].out = h[0] + 2;
    return m;
}

static bool adjacent(const qw_edit *e, uint32_t a, uint32_t b)
{
    uint32_t start = e->vertex[a].out, h = start;
    do {
        if (qw_edit_head(e, h) == b || qw_edit_apex(e, h) == b) return true;
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    return false;
}

bool qw_edit_can_flip(const qw_edit *e, uint32_t h)
{
    assert((h & 3) < 3 && h >> 2 < e->face_count);
    uint32_t c = qw_edit_apex(e, h), d = qw_edit_apex(e, qw_edit_twin(e, h));
    return c != d && !adjacent(e, c, d);
}

void qw_edit_flip(qw_edit *e, uint32_t h)
{
    assert(h >> 2 < e->face_count && qw_edit_twin(e, h) != QW_NONE);
    uint32_t g = qw_edit_twin(e, h), h1 = qw_edit_next(h), h2 = qw_edit_prev(h), g1 = qw_edit_next(g),
             g2 = qw_edit_prev(g);
    uint32_t a = qw_edit_tail(e, h), b = qw_edit_tail(e, g), c = qw_edit_tail(e, h2), d = qw_edit_tail(e, g2);
    uint32_t bc = qw_edit_twin(e, h1), ca = qw_edit_twin(e, h2), ad = qw_edit_twin(e, g1), db = qw_edit_twin(e, g2);
    uint8_t bc_mark = qw_edit_mark(e, h1), ca_mark = qw_edit_mark(e, h2), ad_mark = qw_edit_mark(e, g1),
            db_mark = qw_edit_mark(e, g2);
    uint8_t mark = qw_edit_mark(e, h);
    /* h: d -> c, h1: c -> a, h2: a -> d and g: c -> d, g1: d -> b, g2: b -> c */
    e->face[h >> 2].corner[h & 3] = d;
    e->face[h >> 2].corner[h1 & 3] = c;
    e->face[h >> 2].corner[h2 & 3] = a;
    e->face[g >> 2].corner[g & 3] = c;
    e->face[g >> 2].corner[g1 & 3] = d;
    e->face[g >> 2].corner[g2 & 3] = b;
    join(e, h, g, mark);
    join(e, h1, ca, ca_mark);
    join(e, h2, ad, ad_mark);
    join(e, g1, db, db_mark);
    join(e, g2, bc, bc_mark);
    if (e->vertex[a].out == h || e->vertex[a].out == g1) e->vertex[a].out = h2;
    if (e->vertex[b].out == g || e->vertex[b].out == h1) e->vertex[b].out = g2;
    if (e->vertex[c].out == h2) e->vertex[c].out = h1;
    if (e->vertex[d].out == g2) e->vertex[d].out = g1;
}

/* Of a face that vanishes the two other edges are glued. They must not both lie on curves: the apex would be left
   without a face, or a loop of three curve edges would be flattened. */
static bool side_can_vanish(const qw_edit *e, uint32_t h)
{
    uint32_t h1 = qw_edit_next(h), h2 = qw_edit_prev(h);
    return !(qw_edit_on_curve(e, h1) && qw_edit_on_curve(e, h2));
}

/* Stamps the neighbours of v, or counts the stamped ones; returns how many are stamped. *valence: of all. */
static uint32_t sweep(qw_edit *e, uint32_t v, bool stamp, uint32_t *valence)
{
    uint32_t start = e->vertex[v].out, h = start, last, found = 0, n = 0;
    do {
        qw_edit_vertex *u = &e->vertex[qw_edit_head(e, h)];
        if (stamp) u->seen = e->round;
        found += u->seen == e->round;
        n++;
        last = h;
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    if (h == QW_NONE) {
        qw_edit_vertex *u = &e->vertex[qw_edit_apex(e, last)];
        if (stamp) u->seen = e->round;
        found += u->seen == e->round;
        n++;
    }
    *valence = n;
    return found;
}

bool qw_edit_can_collapse(qw_edit *e, uint32_t h)
{
    assert((h & 3) < 3 && h >> 2 < e->face_count);
    uint32_t v = qw_edit_tail(e, h), w = qw_edit_head(e, h), g = qw_edit_twin(e, h), v_valence, w_valence;
    if (!side_can_vanish(e, h) || (g != QW_NONE && !side_can_vanish(e, g))) return false;
    bool v_open = qw_edit_twin(e, e->vertex[v].out) == QW_NONE, w_open = qw_edit_twin(e, e->vertex[w].out) == QW_NONE;
    if (g != QW_NONE && v_open && w_open) return false; /* an inner edge between two boundary points: would pinch */
    if (++e->round == 0) {
        for (uint32_t u = 0; u < e->vertex_count; u++) e->vertex[u].seen = 0;
        e->round = 1;
    }
    sweep(e, v, true, &v_valence);
    uint32_t common = sweep(e, w, false, &w_valence);
    if (common != (g == QW_NONE ? 1 : 2)) return false;
    /* The tetrahedron is the one closed complex on which counting common neighbours is not enough. */
    return v_open || w_open || v_valence + w_valence > 6;
}

/* Turns clockwise to the half-edge without twin, or all the way round. */
static uint32_t first_out(const qw_edit *e, uint32_t h)
{
    uint32_t start = h;
    while (qw_edit_twin(e, h) != QW_NONE) {
        h = qw_edit_next(qw_edit_twin(e, h));
        if (h == start) break;
    }
    return h;
}

/* Glues the two outer neighbours of a face that vanishes; h runs along the collapsed edge. */
static void close_side(qw_edit *e, uint32_t h)
{
    assert(h >> 2 < e->face_count);
    uint32_t h1 = qw_edit_next(h), h2 = qw_edit_prev(h), x = qw_edit_tail(e, h2);
    uint32_t t1 = qw_edit_twin(e, h1), t2 = qw_edit_twin(e, h2);
    uint8_t mark = qw_edit_mark(e, h1) | qw_edit_mark(e, h2);
    if (e->vertex[x].out == h2)
        e->vertex[x].out = t1; /* not QW_NONE: x would then be on the boundary, with another `out` */
    join(e, t1, t2, mark);
    e->face[h >> 2].corner[0] = QW_NONE;
    e->live_faces--;
}

void qw_edit_collapse(qw_edit *e, uint32_t h, uint32_t gone)
{
    uint32_t v = qw_edit_tail(e, h), w = qw_edit_head(e, h), g = qw_edit_twin(e, h), kept = gone == v ? w : v;
    assert(gone == v || gone == w);
    uint32_t t1 = qw_edit_twin(e, qw_edit_next(h)), t2 = qw_edit_twin(e, qw_edit_prev(h));
    uint32_t k = e->vertex[gone].out, start = k;
    do {
        e->face[k >> 2].corner[k & 3] = kept;
        k = qw_edit_around(e, k);
    } while (k != QW_NONE && k != start);
    close_side(e, h);
    if (g != QW_NONE) close_side(e, g);
    /* t2 went from v to the apex, t1 from the apex to w. */
    uint32_t out = t2 != QW_NONE ? t2 : qw_edit_next(t1);
    assert(!qw_edit_dead(e, out >> 2));
    e->vertex[kept].out = first_out(e, out);
    e->vertex[gone].out = QW_NONE;
    e->live_vertices--;
}

/* The bits of x, ten of them, spread to every third place. */
static uint32_t spread(uint32_t x)
{
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

/* Vertices and faces to be put in order: of an edited mesh or of one that is yet to be. */
typedef struct sorting {
    const char *position, *corner; /* of the first */
    size_t position_stride, corner_stride;
    qw_vec3 low;
    float scale;
    uint32_t *order, *key; /* the vertices; their codes */
    uint32_t *vertex_rank; /* where they go */
    uint32_t *face_rank;   /* the least new corner of a face; then where it goes. QW_NONE: dead */
} sorting;

static qw_vec3 position_at(const sorting *s, uint32_t v)
{
    return *(const qw_vec3 *)(const void *)(s->position + v * s->position_stride);
}
static const uint32_t *corners_at(const sorting *s, uint32_t f)
{
    return (const uint32_t *)(const void *)(s->corner + f * s->corner_stride);
}

static void code_vertices(void *user, uint32_t begin, uint32_t end)
{
    const sorting *s = user;
    for (uint32_t i = begin; i < end; i++) {
        qw_vec3 p = qw_scale(qw_sub(position_at(s, s->order[i]), s->low), s->scale);
        s->key[i] = spread((uint32_t)p.x) | spread((uint32_t)p.y) << 1 | spread((uint32_t)p.z) << 2;
    }
}

/* The box of all vertices, as what a cell of 1024 in each direction is. */
static void find_box(sorting *s, uint32_t n)
{
    qw_vec3 low = qw_v3(INFINITY, INFINITY, INFINITY), high = qw_v3(-INFINITY, -INFINITY, -INFINITY);
    for (uint32_t i = 0; i < n; i++) {
        qw_vec3 p = position_at(s, s->order[i]);
        low = qw_v3(fminf(low.x, p.x), fminf(low.y, p.y), fminf(low.z, p.z));
        high = qw_v3(fmaxf(high.x, p.x), fmaxf(high.y, p.y), fmaxf(high.z, p.z));
    }
    s->low = low;
    s->scale = 1023.0f / fmaxf(fmaxf(high.x - low.x, high.y - low.y), fmaxf(high.z - low.z, 1e-20f));
}

/* Sorts the n vertices of s->order along the Morton curve over their bounding box; those of equal codes stay in their
 * order. Sets their ranks. */
static void sort_vertices(qw_env *env, sorting *s, uint32_t n)
{
    assert(s->order && s->vertex_rank);
    enum { DIGIT = 10, DIGITS = 1 << DIGIT };
    uint32_t *key = s->key = QW_NEW(env, uint32_t, n), *order = s->order;
    uint32_t *other_key = QW_NEW(env, uint32_t, n), *other = QW_NEW(env, uint32_t, n),
             *count = QW_NEW(env, uint32_t, DIGITS);
    find_box(s, n);
    qw_parallel(env, n, QW_GRAIN_LIGHT, code_vertices, s);
    for (uint32_t shift = 0; shift < 3 * DIGIT; shift += DIGIT) {
        memset(count, 0, DIGITS * sizeof *count);
        for (uint32_t i = 0; i < n; i++) count[key[i] >> shift & (DIGITS - 1)]++;
        for (uint32_t i = 0, sum = 0; i < DIGITS; i++) {
            uint32_t c = count[i];
            count[i] = sum;
            sum += c;
        }
        for (uint32_t i = 0; i < n; i++) {
            uint32_t at = count[key[i] >> shift & (DIGITS - 1)]++;
            other_key[at] = key[i];
            other[at] = order[i];
        }
        uint32_t *swap = key;
        key = other_key, other_key = swap;
        swap = order, order = other, other = swap;
    }
    s->order = order;
    for (uint32_t i = 0; i < n; i++) s->vertex_rank[order[i]] = i;
    qw_free(env, key), qw_free(env, other_key), qw_free(env, other), qw_free(env, count);
}

/* The least rank of each triangle's corners, by which triangles are sorted. */
static void least_corners(void *user, uint32_t begin, uint32_t end)
{
    const sorting *s = user;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *corner = corners_at(s, f), *rank = s->vertex_rank;
        s->face_rank[f] = QW_NONE;
        if (corner[0] == QW_NONE) continue;
        uint32_t a = rank[corner[0]], b = rank[corner[1]], c = rank[corner[2]], least = a < b ? a : b;
        s->face_rank[f] = least < c ? least : c;
    }
}

/* Faces in the order of their least new vertex. */
static void sort_faces(qw_env *env, const sorting *s, uint32_t vertex_count, uint32_t face_count)
{
    assert(s->face_rank && s->vertex_rank);
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)vertex_count + 1), *rank = s->face_rank;
    qw_parallel(env, face_count, QW_GRAIN_LIGHT, least_corners, (void *)(uintptr_t)s);
    for (uint32_t f = 0; f < face_count; f++)
        if (rank[f] != QW_NONE) begin[rank[f] + 1]++;
    for (uint32_t i = 0; i < vertex_count; i++) begin[i + 1] += begin[i];
    for (uint32_t f = 0; f < face_count; f++)
        if (rank[f] != QW_NONE) rank[f] = begin[rank[f]]++;
    qw_free(env, begin);
}

typedef struct packing {
    const qw_edit *from;    /* what is packed, or */
    const qw_trimesh *mesh; /* what is opened, with */
    const float *target;
    const uint32_t *outgoing;
    const uint32_t *order, *vertex_rank, *face_rank;
    qw_edit_vertex *vertex;
    qw_edit_face *face;
    uint32_t block; /* vertices a block */
} packing;

static uint32_t ranked(const packing *p, uint32_t h)
{
    return h == QW_NONE ? QW_NONE : 4 * p->face_rank[h >> 2] + (h & 3);
}

static void place_vertex(const packing *p, uint32_t i)
{
    qw_edit_vertex *to = &p->vertex[i];
    to->out = ranked(p, to->out);
    to->seen = 0;
    to->block = (uint16_t)(i / p->block % QW_EDIT_BLOCKS);
}

static void place_face(const packing *p, qw_edit_face *to)
{
    for (uint32_t i = 0; i < 3; i++) {
        to->corner[i] = p->vertex_rank[to->corner[i]];
        to->twin[i] = ranked(p, to->twin[i]);
    }
}

static void pack_vertices(void *user, uint32_t begin, uint32_t end)
{
    const packing *p = user;
    for (uint32_t i = begin; i < end; i++) {
        p->vertex[i] = p->from->vertex[p->order[i]];
        place_vertex(p, i);
    }
}

/* Moves each living face to its new place, with new numbers in it. */
static void pack_faces(void *user, uint32_t begin, uint32_t end)
{
    const packing *p = user;
    for (uint32_t f = begin; f < end; f++) {
        if (qw_edit_dead(p->from, f)) continue;
        qw_edit_face *to = &p->face[p->face_rank[f]];
        *to = p->from->face[f];
        place_face(p, to);
    }
}

static void open_vertices(void *user, uint32_t begin, uint32_t end)
{
    const packing *p = user;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t v = p->order[i];
        p->vertex[i] = opened_vertex(p->mesh, v, p->target[v], p->outgoing[v]);
        place_vertex(p, i);
    }
}

static void open_faces(void *user, uint32_t begin, uint32_t end)
{
    const packing *p = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_edit_face *to = &p->face[p->face_rank[f]];
        *to = opened_face(p->mesh, f);
        place_face(p, to);
    }
}

static uint32_t block_size(uint32_t vertex_count)
{
    uint32_t half = vertex_count / 2;
    return half < QW_EDIT_BLOCK_LEAST ? QW_EDIT_BLOCK_LEAST : half > QW_EDIT_BLOCK_MOST ? QW_EDIT_BLOCK_MOST : half;
}

static uint32_t count_blocks(uint32_t vertex_count, uint32_t size)
{
    uint32_t count = qw_block_count(vertex_count, size);
    return count < QW_EDIT_BLOCKS ? count : QW_EDIT_BLOCKS;
}

qw_edit qw_edit_open_packed(qw_env *env, const qw_trimesh *mesh, const float *target, const uint32_t *outgoing,
                            uint32_t **rank)
{
    assert(rank && outgoing);
    qw_edit e = make_room(env, mesh);
    sorting s = {.position = (const char *)mesh->position,
                 .position_stride = sizeof *mesh->position,
                 .corner = (const char *)mesh->corner,
                 .corner_stride = 3 * sizeof *mesh->corner};
    s.vertex_rank = QW_NEW(env, uint32_t, e.vertex_count);
    qw_scope_begin(env);
    s.order = QW_NEW(env, uint32_t, e.vertex_count), s.face_rank = QW_NEW(env, uint32_t, e.face_count);
    for (uint32_t v = 0; v < e.vertex_count; v++) s.order[v] = v;
    sort_vertices(env, &s, e.vertex_count);
    sort_faces(env, &s, e.vertex_count, e.face_count);
    packing p = {.mesh = mesh,
                 .target = target,
                 .outgoing = outgoing,
                 .order = s.order,
                 .vertex_rank = s.vertex_rank,
                 .face_rank = s.face_rank,
                 .vertex = e.vertex,
                 .face = e.face,
                 .block = block_size(e.vertex_count)};
    qw_parallel(env, e.vertex_count, QW_GRAIN_LIGHT, open_vertices, &p);
    qw_parallel(env, e.face_count, QW_GRAIN_LIGHT, open_faces, &p);
    qw_scope_end(env);
    e.block_count = count_blocks(e.vertex_count, p.block);
    *rank = s.vertex_rank;
    return e;
}

void qw_edit_pack(qw_edit *e)
{
    assert(e->live_vertices <= e->vertex_count && e->live_faces <= e->face_count);
    qw_env *env = e->env;
    qw_scope_begin(env);
    size_t vertex_capacity = (size_t)e->live_vertices + e->live_vertices / 2 + 64;
    size_t face_capacity = (size_t)e->live_faces + e->live_faces / 2 + 128;
    sorting s = {.position = (const char *)&e->vertex->position,
                 .position_stride = sizeof *e->vertex,
                 .corner = (const char *)e->face->corner,
                 .corner_stride = sizeof *e->face};
    s.order = QW_NEW(env, uint32_t, e->live_vertices);
    s.vertex_rank = QW_NEW(env, uint32_t, e->vertex_count), s.face_rank = QW_NEW(env, uint32_t, e->face_count);
    for (uint32_t v = 0, n = 0; v < e->vertex_count; v++)
        if (e->vertex[v].out != QW_NONE) s.order[n++] = v;
    sort_vertices(env, &s, e->live_vertices);
    sort_faces(env, &s, e->live_vertices, e->face_count);
    packing p = {.from = e,
                 .order = s.order,
                 .vertex_rank = s.vertex_rank,
                 .face_rank = s.face_rank,
                 .block = block_size(e->live_vertices),
                 .vertex = QW_NEW(env, qw_edit_vertex, vertex_capacity),
                 .face = QW_NEW(env, qw_edit_face, face_capacity)};
    qw_parallel(env, e->live_vertices, QW_GRAIN_LIGHT, pack_vertices, &p);
    qw_parallel(env, e->face_count, QW_GRAIN_LIGHT, pack_faces, &p);
    qw_keep(env, p.vertex);
    qw_keep(env, p.face);
    qw_scope_end(env);
    qw_free(env, e->vertex);
    qw_free(env, e->face);
    e->vertex = p.vertex, e->vertex_capacity = vertex_capacity, e->vertex_count = e->live_vertices;
    e->face = p.face, e->face_capacity = face_capacity, e->face_count = e->live_faces;
    e->round = 0;
    e->block_count = count_blocks(e->vertex_count, p.block);
}

qw_trimesh qw_edit_close(qw_edit *e, float **target)
{
    assert(e->vertex_count == e->live_vertices && e->face_count == e->live_faces);
    qw_env *env = e->env;
    qw_trimesh mesh = {.vertex_count = e->vertex_count, .face_count = e->face_count};
    mesh.position = QW_NEW(env, qw_vec3, e->vertex_count);
    mesh.corner = QW_NEW(env, uint32_t, (size_t)3 * e->face_count);
    mesh.twin = QW_NEW(env, uint32_t, (size_t)3 * e->face_count);
    mesh.mark = QW_NEW(env, uint8_t, (size_t)3 * e->face_count);
    *target = QW_NEW(env, float, e->vertex_count);
    for (uint32_t v = 0; v < e->vertex_count; v++) {
        mesh.position[v] = e->vertex[v].position;
        (*target)[v] = e->vertex[v].target;
    }
    uint8_t any = 0;
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t i = 0; i < 3; i++) {
            const qw_edit_face *face = &e->face[f];
            uint32_t t = face->twin[i];
            mesh.corner[3 * f + i] = face->corner[i];
            mesh.twin[3 * f + i] = t == QW_NONE ? QW_NONE : 3 * (t >> 2) + (t & 3);
            mesh.mark[3 * f + i] = face->mark[i];
            any |= face->mark[i];
        }
    if (!any) {
        qw_free(env, mesh.mark);
        mesh.mark = NULL;
    }
    return mesh;
}

uint32_t qw_edit_between(const qw_edit *e, uint32_t a, uint32_t b)
{
    assert(a < e->vertex_count && b < e->vertex_count);
    uint32_t start = e->vertex[a].out, h = start;
    do {
        if (qw_edit_head(e, h) == b) return h;
        if (qw_edit_apex(e, h) == b) return qw_edit_prev(h);
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    return QW_NONE;
}

qw_trimesh qw_edit_plain(const qw_edit *e, const uint8_t *point, uint32_t points)
{
    assert(e->live_faces == e->face_count && points <= e->vertex_count);
    qw_env *env = e->env;
    qw_trimesh m = {.vertex_count = e->vertex_count, .face_count = e->face_count};
    size_t sides = 3 * (size_t)m.face_count;
    m.position = QW_NEW(env, qw_vec3, m.vertex_count);
    m.corner = QW_NEW(env, uint32_t, sides), m.twin = QW_NEW(env, uint32_t, sides);
    m.mark = QW_NEW(env, uint8_t, sides);
    if (point) {
        m.point = QW_NEW_ZERO(env, uint8_t, m.vertex_count);
        memcpy(m.point, point, points);
    }
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v] = e->vertex[v].position;
    for (size_t h = 0; h < sides; h++) {
        const qw_edit_face *f = &e->face[h / 3];
        uint32_t t = f->twin[h % 3];
        m.corner[h] = f->corner[h % 3], m.twin[h] = t == QW_NONE ? QW_NONE : 3 * (t >> 2) + (t & 3);
        m.mark[h] = f->mark[h % 3];
    }
    qw_keep(env, m.position), qw_keep(env, m.corner), qw_keep(env, m.twin), qw_keep(env, m.mark);
    qw_keep(env, m.point);
    return m;
}

#include "remesh/quantise/decimated.h"

#include "remesh/quantise/double2.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Vertices are removed in passes, each along edges up to a length that grows by this factor: short edges first, so
   that triangles stay round. */
static const double FIRST_LENGTH = 1.0, GROWTH = 1.5;
/* A triangle is round where its doubled area is at least this share of the square of its longest side. */
static const double ROUND = 0.1;
enum { PASSES = 40, MAX_DEGREE = 24, FLIP_ROUNDS = 8 };
/* BLOCK: vertices at most. FAN: half-edges, of which more than MAX_DEGREE are too many. A removal is an edge of length
 * 0 and two triangles. */
enum { BLOCK = 2048, FAN = 32, STEPS_A_VERTEX = 3 };

typedef struct collapse {
    const qw_offset_mesh *m;
    uint32_t *corner, *edge;  /* [3F] */
    uint8_t *rot;             /* [3F] */
    uint32_t *side;           /* [2E] */
    qw_double2 *d;            /* [E] */
    uint8_t *fixed;           /* [E] */
    uint8_t *gone;            /* [F] */
    uint32_t *outgoing;       /* [V] */
    qw_decimation_step *step; /* changes of edges, in order, to be undone from the last */
    uint32_t step_count, step_capacity;
    /* [F] round of flips in which, or before which, the triangle last changed; the last round */
    uint32_t *changed, round;
    /* [V] the round in which no move of the vertex was good enough, of any length; 0: not known; NULL */
    uint32_t *idle;
    uint32_t *live, live_count; /* the edges that are left, and until the next round of flips some that are not */
    /* the fan about the vertex at hand */
    uint32_t *out;
    uint8_t *out_turn;
    uint32_t count, capacity, last_in; /* last_in: incoming boundary half-edge or QW_NONE */
    unsigned total_turn, last_turn;
} collapse;

static uint32_t across(const collapse *c, uint32_t h)
{
    uint32_t e = c->edge[h];
    return c->side[2 * e] == h ? c->side[2 * e + 1] : c->side[2 * e];
}

static qw_double2 along(const collapse *c, uint32_t h) { return qw_turned2(c->rot[h], c->d[c->edge[h]]); }

/* Collects the half-edges that leave v, from the boundary where there is one; out_turn as in qw_star. On a thread of
   its own (env is NULL) there is no more room to be had: there, and above `most`, the fan ends with one half-edge too
   many. */
static void walk_fan(qw_env *env, collapse *c, uint32_t v, uint32_t most)
{
    assert(v < c->m->vertex_count && c->outgoing[v] != QW_NONE);
    uint32_t h = c->outgoing[v], start = h, steps = 0;
    for (uint32_t t = across(c, h); t != QW_NONE && steps <= most; t = across(c, h), steps++) {
        h = qw_next(t);
        if (h == start) break;
    }
    start = h;
    unsigned turn = 0;
    c->count = 0;
    c->last_in = QW_NONE;
    c->total_turn = 0;
    do {
        if (c->count > most) return;
        if (c->count == c->capacity && !env) {
            c->count++;
            return;
        }
        if (c->count == c->capacity) {
            c->capacity = 2 * c->capacity + 32;
            c->out = qw_resize(env, c->out, c->capacity, sizeof *c->out);
            c->out_turn = qw_resize(env, c->out_turn, c->capacity, sizeof *c->out_turn);
        }
        c->out[c->count] = h;
        c->out_turn[c->count++] = (uint8_t)turn;
        uint32_t in = qw_prev(h), t = across(c, in);
        c->last_turn = turn;
        if (t == QW_NONE) {
            c->last_in = in;
            return;
        }
        turn = (turn + c->rot[t] + 2u + 4u - c->rot[in]) & 3u;
        h = t;
    } while (h != start);
    c->total_turn = turn;
}

static uint8_t seen_from(uint8_t bits, unsigned turn)
{
    return turn & 1u ? (uint8_t)((bits & QW_FIXED_X ? QW_FIXED_Y : 0) | (bits & QW_FIXED_Y ? QW_FIXED_X : 0)) : bits;
}

/* What the vertex of the fan may do: 0 nothing, 1 go anywhere, 2 go along constrained or boundary edges only. */
static int freedom(const collapse *c, uint32_t v)
{
    assert(v < c->m->vertex_count);
    if (c->m->constraint[v] == QW_VERTEX_CORNER || c->total_turn != 0) return 0;
    uint32_t constrained = 0;
    uint8_t axis = 0;
    for (uint32_t i = 0; i <= c->count; i++) {
        uint32_t h = i < c->count ? c->out[i] : c->last_in;
        if (h == QW_NONE) break;
        uint8_t bits = c->fixed[c->edge[h]];
        if (!bits) continue;
        bits = seen_from(bits, (i < c->count ? c->out_turn[i] : c->last_turn) + 4u - c->rot[h]);
        if (constrained && bits != axis) return 0;
        axis = bits;
        constrained++;
    }
    if (constrained) return constrained == 2 && axis != (QW_FIXED_X | QW_FIXED_Y) ? 2 : 0;
    return c->last_in == QW_NONE ? 1 : 2;
}

/* Whether the fan's vertex may go along its i-th edge, which its curves and the boundary say. */
static bool is_free_along(const collapse *c, uint32_t i, int freedom)
{
    uint32_t h = c->out[i], t = across(c, h);
    if (freedom == 0) return false;
    if (t == QW_NONE) return true;
    return c->last_in == QW_NONE && (freedom == 1 || c->fixed[c->edge[h]]);
}

/* Whether it can do so without spoiling the triangulation. */
static bool can_merge(const collapse *c, uint32_t i)
{
    uint32_t h = c->out[i], t = across(c, h), v = c->corner[h], to = c->corner[qw_next(h)];
    if (v == to) return false;
    for (uint32_t k = 0; k < c->count; k++) { /* no loop may arise */
        uint32_t head = c->corner[qw_next(c->out[k])];
        if (head == v || (k != i && head == to)) return false;
    }
    if (c->last_in != QW_NONE && c->corner[c->last_in] == to) return false;
    if (t != QW_NONE && t / 3 == h / 3) return false;
    uint32_t sides[4] = {qw_next(h), qw_prev(h), t == QW_NONE ? QW_NONE : qw_next(t),
                         t == QW_NONE ? QW_NONE : qw_prev(t)},
             beyond[4];
    uint32_t n = t == QW_NONE ? 2 : 4;
    for (uint32_t a = 0; a < n; a++) {
        for (uint32_t b = 0; b < a; b++)
            if (c->edge[sides[a]] == c->edge[sides[b]]) return false;
        beyond[a] = across(c, sides[a]);
    }
    for (uint32_t a = 0; a < n; a += 2) {
        if (beyond[a] == QW_NONE && beyond[a + 1] == QW_NONE) return false;
        if (beyond[a] != QW_NONE && beyond[a + 1] != QW_NONE && beyond[a] / 3 == beyond[a + 1] / 3) return false;
    }
    return true;
}

/* The smallest share that a triangle of the fan has of the square of its longest side, after the move along edge i;
   triangles that vanish aside. */
static double worst_after(const collapse *c, uint32_t i)
{
    uint32_t h = c->out[i], t = across(c, h);
    qw_double2 step = qw_turned2(4u - c->out_turn[i], along(c, h));
    double worst = INFINITY;
    for (uint32_t k = 0; k < c->count; k++) {
        uint32_t o = c->out[k];
        if (o == h || (t != QW_NONE && o / 3 == t / 3)) continue;
        qw_double2 s = qw_turned2(c->out_turn[k], step), a = along(c, o), b = along(c, qw_prev(o)),
                   far = along(c, qw_next(o));
        a.x -= s.x, a.y -= s.y, b.x += s.x, b.y += s.y;
        double longest = fmax(fmax(qw_square2(a), qw_square2(b)), qw_square2(far));
        double share = longest > 0 ? qw_cross2(b, a) / longest : -1;
        if (share < worst) worst = share;
    }
    return worst;
}

static void record(qw_env *env, collapse *c, qw_decimation_step step)
{
    if (c->step_count == c->step_capacity) {
        c->step_capacity += c->step_capacity / 2 + 256;
        c->step = qw_resize(env, c->step, c->step_capacity, sizeof *c->step);
    }
    c->step[c->step_count++] = step;
}

/* Removes the triangle of h, whose offset is zero: its other two edges become one. */
static void fold(qw_env *env, collapse *c, uint32_t h)
{
    assert(h < 3 * c->m->face_count);
    uint32_t hb = qw_next(h), hc = qw_prev(h), b = c->edge[hb], kept = c->edge[hc];
    uint32_t from = across(c, hb), to = across(c, hc);
    unsigned turn = (unsigned)(c->rot[hc] + 6 - c->rot[hb]) & 3u;
    if (from != QW_NONE) {
        c->edge[from] = kept;
        c->rot[from] = (uint8_t)((c->rot[from] + turn) & 3u);
        c->changed[from / 3] = c->round;
    }
    if (to != QW_NONE) c->changed[to / 3] = c->round;
    c->side[2 * kept] = to != QW_NONE ? to : from;
    c->side[2 * kept + 1] = to != QW_NONE ? from : QW_NONE;
    c->fixed[kept] |= seen_from(c->fixed[b], turn);
    record(env, c, (qw_decimation_step){b, {kept, QW_NONE}, {(uint8_t)turn, 0}});
    c->side[2 * b] = QW_NONE;
    c->gone[h / 3] = 1;
    uint32_t apex = c->corner[hc], end = c->corner[hb];
    c->outgoing[apex] = from != QW_NONE ? from : qw_next(to);
    c->outgoing[end] = to != QW_NONE ? to : qw_next(from);
}

/* Merges the vertex of the current fan into its i-th neighbour: the offsets around it change by the step there, and
 * the triangles at that edge fold up. */
static void merge(qw_env *env, collapse *c, uint32_t i)
{
    assert(i < c->count);
    uint32_t h = c->out[i], t = across(c, h), to = c->corner[qw_next(h)];
    qw_double2 step = qw_turned2(4u - c->out_turn[i], along(c, h));
    for (uint32_t k = 0; k < c->count; k++) {
        uint32_t o = c->out[k];
        qw_double2 s = qw_turned2(c->out_turn[k] + 4u - c->rot[o], step), *d = &c->d[c->edge[o]];
        d->x -= s.x, d->y -= s.y;
        c->corner[o] = to;
        c->changed[o / 3] = c->round;
    }
    if (c->last_in != QW_NONE) {
        qw_double2 s = qw_turned2(c->last_turn + 4u - c->rot[c->last_in], step), *d = &c->d[c->edge[c->last_in]];
        d->x += s.x, d->y += s.y;
    }
    record(env, c, (qw_decimation_step){c->edge[h], {QW_NONE, QW_NONE}, {0, 0}});
    c->side[2 * c->edge[h]] = QW_NONE;
    fold(env, c, h);
    if (t != QW_NONE) fold(env, c, t);
}

/* Whether nothing around the fan's vertex has changed since no move of it was good enough. */
static bool is_idle(const collapse *c, uint32_t v)
{
    if (!c->idle || c->idle[v] == 0) return false;
    for (uint32_t i = 0; i < c->count; i++)
        if (c->changed[c->out[i] / 3] >= c->idle[v]) return false;
    return true;
}

static bool reaches_all(const collapse *c, double length)
{
    for (uint32_t i = 0; i < c->count; i++)
        if (qw_square2(c->d[c->edge[c->out[i]]]) > length * length) return false;
    return true;
}

/* Moves v along the shortest edge along which it may move, if that is shorter than `length` and leaves no triangle
   worse than `quality`. */
static bool remove_vertex(qw_env *env, collapse *c, uint32_t v, double length, double quality, uint32_t most)
{
    assert(v < c->m->vertex_count);
    walk_fan(env, c, v, most);
    if (c->count > most) return false;
    if (is_idle(c, v)) return false;
    int free = freedom(c, v);
    double tried = -1; /* edges are tried from the shortest on; most often the first will do */
    uint32_t last = 0;
    for (;;) {
        uint32_t best = QW_NONE;
        double shortest = length * length;
        for (uint32_t i = 0; i < c->count; i++) {
            double l = qw_square2(c->d[c->edge[c->out[i]]]);
            if (l > shortest || l < tried || (l == tried && i <= last) || (l == shortest && best != QW_NONE)) continue;
            if (!is_free_along(c, i, free)) continue;
            shortest = l;
            best = i;
        }
        if (best == QW_NONE) {
            if (c->idle) c->idle[v] = reaches_all(c, length) ? c->round : 0;
            return false;
        }
        if (can_merge(c, best) && worst_after(c, best) >= quality) {
            merge(env, c, best);
            return true;
        }
        tried = shortest, last = best;
    }
}

/* ---- flips */

static double cotangent(qw_double2 u, qw_double2 v) { return (u.x * v.x + u.y * v.y) / qw_cross2(u, v); }

static void put_half(collapse *c, uint32_t from, uint32_t to, uint32_t edge, unsigned rot, uint32_t tail)
{
    uint32_t *side = c->side + 2 * (size_t)edge;
    side[side[0] == from ? 0 : 1] = to;
    c->edge[to] = edge, c->rot[to] = (uint8_t)(rot & 3u), c->corner[to] = tail;
    c->outgoing[tail] = to;
}

/* Of its diagonals squared, the least area that a triangle of a flipped pair is to have, and the cotangents by which a
   flip has to be nearer to Delaunay: rounding. */
static const double LEAST_FLIPPED = 1e-6, NOT_DELAUNAY = 1e-6;

/* Flips edge a-b to c-d where both new triangles are orientation-preserving, and either an old one was not or the old
 * pair is not Delaunay.
 *
 *       c               c
 *      / \             /|\
 *     a---b    ->     a | b
 *      \ /             \|/
 *       d               d
 */
static bool flip(qw_env *env, collapse *c, uint32_t e)
{
    assert(e < c->m->edge_count);
    uint32_t h = c->side[2 * e], t = c->side[2 * e + 1];
    if (h == QW_NONE || t == QW_NONE || c->fixed[e] || h / 3 == t / 3) return false;
    uint32_t hn = qw_next(h), hp = qw_prev(h), tn = qw_next(t), tp = qw_prev(t);
    uint32_t a = c->corner[h], b = c->corner[hn], apex = c->corner[hp], foot = c->corner[tp];
    uint32_t bc = c->edge[hn], ca = c->edge[hp], ad = c->edge[tn], db = c->edge[tp];
    if (apex == foot || bc == ca || bc == ad || bc == db || ca == ad || ca == db || ad == db) return false;
    unsigned turn = (unsigned)(c->rot[h] + 6u - c->rot[t]) & 3u; /* from the frame of t's triangle to that of h's */
    unsigned r_bc = c->rot[hn], r_ca = c->rot[hp], r_ad = c->rot[tn], r_db = c->rot[tp], r_ab = c->rot[h];
    qw_double2 v_ab = along(c, h), v_bc = along(c, hn), v_ca = along(c, hp);
    qw_double2 v_ad = qw_turned2(turn, along(c, tn)), v_db = qw_turned2(turn, along(c, tp));
    qw_double2 v_cd = {v_ca.x + v_ad.x, v_ca.y + v_ad.y}, v_cb = {-v_bc.x, -v_bc.y}, v_da = {-v_ad.x, -v_ad.y};
    double old_least = fmin(qw_cross2(v_ab, v_bc), qw_cross2(v_ad, v_db)),
           least = LEAST_FLIPPED * (qw_square2(v_ab) + qw_square2(v_cd));
    if (fmin(qw_cross2(v_cd, v_db), qw_cross2(v_cd, v_ad)) <= least) return false;
    if (old_least > least && cotangent(v_ca, v_cb) + cotangent(v_db, v_da) >= -NOT_DELAUNAY) return false;
    record(env, c,
           (qw_decimation_step){
               e, {ad, db}, {(uint8_t)((turn + r_ad + 4u - r_ab) & 3u), (uint8_t)((turn + r_db + 4u - r_ab) & 3u)}});
    put_half(c, tp, hn, db, r_db + turn, foot);
    put_half(c, hn, hp, bc, r_bc, b);
    put_half(c, hp, tn, ca, r_ca + 4u - turn, apex);
    put_half(c, tn, tp, ad, r_ad, a);
    c->d[e] = v_cd;
    c->changed[h / 3] = c->changed[t / 3] = c->round;
    c->rot[h] = 0, c->rot[t] = (uint8_t)((6u - turn) & 3u);
    c->corner[h] = apex, c->corner[t] = foot;
    return true;
}

/* Flips edges until none is left to flip or the rounds are used up. */
static void flip_edges(qw_env *env, collapse *c)
{
    for (int round = 0; round < FLIP_ROUNDS; round++) {
        uint32_t flips = 0, kept = 0, before = c->round++;
        for (uint32_t i = 0; i < c->live_count; i++) {
            uint32_t e = c->live[i], h = c->side[2 * e], t = c->side[2 * e + 1];
            if (h == QW_NONE) continue;
            c->live[kept++] = e;
            if (t == QW_NONE || (c->changed[h / 3] < before && c->changed[t / 3] < before))
                continue; /* already tested since the triangles last changed */
            flips += flip(env, c, e);
        }
        c->live_count = kept;
        if (flips == 0) break;
    }
}

/* A first pass by blocks of vertices, each by itself: those with all neighbours in their own block. Vertices come in an
   order in which neighbours are near. Removing one reads and writes only triangles of the block, and of those beyond
   them the one side that is the block's too. */
typedef struct first_pass {
    const collapse *c;
    const uint8_t *inner;     /* [V] */
    uint8_t *tried;           /* [V] 1: without success; 2: gone */
    qw_decimation_step *step; /* [STEPS_A_VERTEX * V], each block's from that of its first vertex on */
    uint32_t size;            /* of a block, in vertices */
    uint32_t *step_count;     /* [blocks] */
    uint32_t *out;            /* [blocks * FAN] */
    uint8_t *out_turn;        /* [blocks * FAN] */
} first_pass;

/* Removes the vertices of a block that touch no other block, on the way in which all removals are recorded. */
static void remove_inner(void *user, uint32_t begin, uint32_t end)
{
    const first_pass *p = user;
    uint32_t block = begin / p->size;
    collapse own = *p->c;
    own.step = p->step + (size_t)STEPS_A_VERTEX * begin, own.step_count = 0,
    own.step_capacity = STEPS_A_VERTEX * (end - begin);
    own.out = p->out + (size_t)FAN * block, own.out_turn = p->out_turn + (size_t)FAN * block, own.capacity = FAN;
    for (uint32_t v = begin; v < end; v++)
        if (p->inner[v]) p->tried[v] = remove_vertex(NULL, &own, v, FIRST_LENGTH, ROUND, MAX_DEGREE) ? 2 : 1;
    p->step_count[block] = own.step_count;
}

/* A size for which the blocks are equal and even in number: a small last block would leave the other threads idle. */
static uint32_t block_size(uint32_t vertices)
{
    uint32_t blocks = 2 * qw_block_count(vertices, 2 * BLOCK);
    return blocks > 0 ? qw_block_count(vertices, blocks) : BLOCK;
}

/* Which vertices have all their triangles' vertices in one block of `size` vertices: uint8_t[vertices]. */
static uint8_t *find_inner(qw_env *env, const collapse *c, uint32_t size)
{
    const qw_offset_mesh *m = c->m;
    uint8_t *inner = QW_NEW(env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        inner[v] = c->outgoing[v] != QW_NONE && m->constraint[v] != QW_VERTEX_CORNER;
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *k = m->corner + 3 * (size_t)f;
        uint32_t block = k[0] / size;
        if (k[1] / size != block || k[2] / size != block) inner[k[0]] = inner[k[1]] = inner[k[2]] = 0;
    }
    return inner;
}

/* Returns the state of each vertex: uint8_t[V], as first_pass.tried, 0 where it was not tried. */
static uint8_t *begin_removal(qw_env *env, collapse *c)
{
    uint32_t n = c->m->vertex_count, size = block_size(n), blocks = qw_block_count(n, size);
    first_pass p = {.c = c, .size = size, .inner = find_inner(env, c, size), .tried = QW_NEW_ZERO(env, uint8_t, n)};
    p.step = QW_NEW(env, qw_decimation_step, STEPS_A_VERTEX * (size_t)n), p.step_count = QW_NEW(env, uint32_t, blocks);
    p.out = QW_NEW(env, uint32_t, (size_t)FAN * blocks), p.out_turn = QW_NEW(env, uint8_t, (size_t)FAN * blocks);
    qw_parallel(env, n, size, remove_inner, &p);
    for (uint32_t b = 0; b < blocks; b++)
        for (uint32_t i = 0; i < p.step_count[b]; i++) record(env, c, p.step[(size_t)STEPS_A_VERTEX * size * b + i]);
    qw_free(env, p.step), qw_free(env, p.step_count), qw_free(env, p.out), qw_free(env, p.out_turn),
        qw_free(env, (void *)p.inner);
    return p.tried;
}

/* Of a vertex that is removed in the pass. Where inverted triangles are taken, vertices of many edges go last, when few
   are left: each hands its edges on to the next one, which would hand on more and more of them. */
static uint32_t most_edges(int pass)
{
    if (pass < PASSES / 2) return MAX_DEGREE;
    int first = pass < 3 * PASSES / 4 ? PASSES / 2 : 3 * PASSES / 4;
    return (uint32_t)MAX_DEGREE << (pass - first);
}

/* Removes regular vertices in passes that allow longer edges and worse triangles, one after the other. */
static void remove_vertices(qw_env *env, collapse *c)
{
    uint32_t count = 0, *left = QW_NEW(env, uint32_t, c->m->vertex_count);
    uint8_t *tried = begin_removal(env, c);
    for (uint32_t v = 0; v < c->m->vertex_count; v++)
        if (c->outgoing[v] != QW_NONE && c->m->constraint[v] != QW_VERTEX_CORNER && tried[v] != 2) left[count++] = v;
    double length = FIRST_LENGTH;
    c->idle = QW_NEW_ZERO(env, uint32_t, c->m->vertex_count);
    for (int pass = 0; pass < PASSES; pass++, length *= GROWTH) {
        /* first only round triangles may arise, then any that are not inverted, at last any at all */
        double quality = pass < PASSES / 2 ? ROUND : pass < 3 * PASSES / 4 ? 1e-3 : -INFINITY;
        uint32_t kept = 0, most = most_edges(pass);
        if (pass == PASSES / 2 || pass == 3 * PASSES / 4)
            memset(c->idle, 0, c->m->vertex_count * sizeof *c->idle); /* more is good enough now */
        for (uint32_t i = 0; i < count; i++) {
            bool again = pass > 0 || !tried[left[i]];
            if (!again || !remove_vertex(env, c, left[i], length, quality, most)) left[kept++] = left[i];
            if (i % QW_GRAIN == 0) qw_heartbeat(env);
        }
        count = kept;
        flip_edges(env, c);
    }
    qw_free(env, left), qw_free(env, tried), qw_free(env, c->idle);
}

/* ---- before and after */

/* A copy of the mesh with closed real offsets, on which vertices are removed. */
static void begin_collapse(qw_env *env, const qw_offset_mesh *m, const qw_real2 *closed, collapse *c)
{
    assert(m->face_count > 0 && m->face_count < QW_NONE / 3);
    uint32_t corners = 3 * m->face_count;
    *c = (collapse){.m = m};
    c->corner = QW_NEW(env, uint32_t, corners);
    c->edge = QW_NEW(env, uint32_t, corners);
    c->rot = QW_NEW(env, uint8_t, corners);
    c->side = QW_NEW(env, uint32_t, (size_t)2 * m->edge_count);
    c->d = QW_NEW(env, qw_double2, m->edge_count);
    c->fixed = QW_NEW(env, uint8_t, m->edge_count);
    c->gone = QW_NEW_ZERO(env, uint8_t, m->face_count);
    c->outgoing = QW_NEW(env, uint32_t, m->vertex_count);
    c->live = QW_NEW(env, uint32_t, m->edge_count);
    c->live_count = m->edge_count;
    c->changed = QW_NEW_ZERO(env, uint32_t, m->face_count);
    memcpy(c->corner, m->corner, corners * sizeof *c->corner);
    memcpy(c->edge, m->edge, corners * sizeof *c->edge);
    memcpy(c->rot, m->rot, corners);
    memcpy(c->fixed, m->fixed, m->edge_count);
    memset(c->outgoing, 0xff, m->vertex_count * sizeof *c->outgoing);
    for (uint32_t h = 0; h < corners; h++) c->outgoing[m->corner[h]] = h;
    for (uint32_t e = 0; e < m->edge_count; e++) {
        c->side[2 * e] = m->half[e], c->side[2 * e + 1] = m->twin[m->half[e]];
        c->d[e] = (qw_double2){(double)closed[e].x, (double)closed[e].y};
        c->live[e] = e;
    }
}

/* What is left as a complex, with the record of removals that bring integers back to the mesh. Kept after the
 * scope. */
static qw_decimated pack(qw_env *env, collapse *c)
{
    assert(c->step_count <= c->step_capacity);
    qw_decimated s = {0};
    const qw_offset_mesh *m = c->m;
    uint32_t *edge_number = QW_NEW(env, uint32_t, m->edge_count), *face_number = QW_NEW(env, uint32_t, m->face_count),
             at = 0;
    for (uint32_t f = 0; f < m->face_count; f++)
        if (!c->gone[f]) face_number[f] = s.complex.face_count++;
    for (uint32_t e = 0; e < m->edge_count; e++)
        edge_number[e] = c->side[2 * e] == QW_NONE ? QW_NONE : s.complex.edge_count++;
    qw_complex *k = &s.complex;
    k->edge = QW_NEW(env, uint32_t, (size_t)3 * k->face_count);
    k->rot = QW_NEW(env, uint8_t, (size_t)3 * k->face_count);
    s.corner = QW_NEW(env, uint32_t, (size_t)3 * k->face_count);
    k->side = QW_NEW(env, uint32_t, (size_t)2 * k->edge_count);
    k->d = QW_NEW(env, qw_int2, k->edge_count);
    k->real = QW_NEW(env, qw_real2, k->edge_count);
    k->fixed = QW_NEW(env, uint8_t, k->edge_count);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (c->gone[h / 3]) continue;
        k->edge[at] = edge_number[c->edge[h]], k->rot[at] = c->rot[h], s.corner[at] = c->corner[h];
        at++;
    }
    for (uint32_t e = 0; e < m->edge_count; e++) {
        uint32_t n = edge_number[e];
        if (n == QW_NONE) continue;
        for (int i = 0; i < 2; i++) {
            uint32_t h = c->side[2 * e + (uint32_t)i];
            k->side[2 * n + (uint32_t)i] = h == QW_NONE ? QW_NONE : 3 * face_number[h / 3] + h % 3;
        }
        k->fixed[n] = c->fixed[e];
        k->real[n] = (qw_real2){k->fixed[n] & QW_FIXED_X ? 0 : (float)c->d[e].x,
                                k->fixed[n] & QW_FIXED_Y ? 0 : (float)c->d[e].y};
        k->d[n] = (qw_int2){(int32_t)qw_round_even(k->real[n].x), (int32_t)qw_round_even(k->real[n].y)};
    }
    qw_keep(env, k->edge), qw_keep(env, k->rot), qw_keep(env, k->side), qw_keep(env, k->d), qw_keep(env, k->real),
        qw_keep(env, k->fixed);
    s.edge_number = edge_number, s.step = c->step, s.step_count = c->step_count, s.fine_edge_count = m->edge_count;
    qw_keep(env, s.corner), qw_keep(env, s.edge_number), qw_keep(env, s.step);
    return s;
}

qw_decimated qw_decimate(qw_env *env, const qw_offset_mesh *m, const qw_real2 *closed)
{
    assert(closed && m->twin);
    qw_scope_begin(env);
    collapse c;
    begin_collapse(env, m, closed, &c);
    remove_vertices(env, &c);
    qw_decimated s = pack(env, &c);
    qw_scope_end(env);
    return s;
}

void qw_take_back(const qw_decimation_step *step, uint32_t count, qw_int2 *d)
{
    assert(count == 0 || (step && d));
    for (uint32_t i = count; i-- > 0;) {
        qw_int2 sum = {0, 0};
        for (int k = 0; k < 2; k++)
            if (step[i].from[k] != QW_NONE) sum = qw_int2_add(sum, qw_turn(step[i].turn[k], d[step[i].from[k]]));
        d[step[i].edge] = sum;
    }
}

void qw_decimated_expand(const qw_decimated *s, const qw_int2 *d, qw_int2 *fine)
{
    assert(d && fine);
    for (uint32_t e = 0; e < s->fine_edge_count; e++)
        if (s->edge_number[e] != QW_NONE) fine[e] = d[s->edge_number[e]];
    qw_take_back(s->step, s->step_count, fine);
}

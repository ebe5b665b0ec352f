/* A protrusion is cut into rings at levels of its distance from where the quads end: Dijkstra along the edges of the
 * surface. A level's curve around the way to the tip is traced from triangle to triangle, and four points on it, a
 * quarter of its length apart, are turned to fit those of the ring below. */
#include "remesh/quads/protrusions.h"

#include "base/elementary.h"
#include "geometry/bvh.h"
#include "remesh/quads/uncovered.h"
#include "solve/queue.h"

#include <assert.h>
#include <math.h>

#include <string.h>

/* A vertex of the surface is covered if a quad is nearer than this share of the wanted edge length. */
static const float NEAR = 0.5f;
/* Quads are about as long along a protrusion as it is wide, and at least so many wanted edge lengths. */
static const float LEAST_LENGTH = 0.75f;
/* A protrusion grows from a quad no farther than so many edge lengths from where it begins, whose normal points along
   it. */
static const float FARTHEST = 2.5f;
enum { MOST_RINGS = 24, TURNS = 32 };

typedef struct protrusions {
    qw_env *env;
    const qw_trimesh *surface;
    const uint32_t *out;       /* a half-edge that leaves each vertex */
    uint8_t *open;             /* uint8_t[vertices]: 1: part of a protrusion */
    const uint32_t *component; /* of each face of the surface, as the quads' vertices have it */
    uint8_t *seen;             /* uint8_t[vertices] */
    float *level;              /* float[vertices], distance from the quads' end along edges; 0 outside */
    uint32_t *below;           /* uint32_t[vertices], the half-edge that comes up from the vertex before */
    uint32_t *member;          /* the protrusion's vertices */
    uint32_t count;
    qw_queue queue;
    qw_vec3 *loop; /* points of a level's curve */
    float *along;  /* their distance along it */
    size_t capacity, along_capacity;
    uint32_t loop_count;
    float edge;
} protrusions;

static void add_member(protrusions *l, uint32_t v)
{
    if (!l->open[v] || l->seen[v]) return;
    l->seen[v] = 1;
    l->member[l->count++] = v;
}

/* Collects the uncovered component of v. Returns whether it is a disc that no boundary touches (V - E + F = 1 of
   everything with a vertex in it) and has marked edges, or none, as is wanted. */
static bool take_protrusion(protrusions *l, uint32_t v, bool marked)
{
    assert(v < l->surface->vertex_count);
    const qw_trimesh *m = l->surface;
    int64_t twice_edges = 0, thrice_faces = 0;
    bool whole = true, has_marks = false;
    l->count = 0;
    add_member(l, v);
    for (uint32_t i = 0; i < l->count; i++) {
        uint32_t first = l->out[l->member[i]], h = first;
        do {
            uint32_t w = m->corner[qw_next(h)], apex = m->corner[qw_prev(h)];
            twice_edges += l->open[w] ? 1 : 2;
            thrice_faces += 6 / (1 + l->open[w] + l->open[apex]);
            add_member(l, w);
            add_member(l, apex);
            has_marks |= m->mark && m->mark[h];
            h = qw_around(m, h);
        } while (h != QW_NONE && h != first);
        whole &= h != QW_NONE;
    }
    return whole && has_marks == marked && (int64_t)l->count - twice_edges / 2 + thrice_faces / 6 == 1;
}

/* Levels of the members, and the highest of them. */
static uint32_t find_levels(protrusions *l)
{
    assert(l->count > 0);
    const qw_trimesh *m = l->surface;
    uint32_t tip = QW_NONE, v;
    l->queue.last = 0;
    for (uint32_t i = 0; i < l->count; i++) l->level[l->member[i]] = INFINITY;
    for (uint32_t i = 0; i < l->count; i++) {
        v = l->member[i];
        uint32_t first = l->out[v], h = first;
        do {
            uint32_t w = m->corner[qw_next(h)];
            float d = qw_distance(m->position[v], m->position[w]);
            if (!l->open[w] && d < l->level[v]) l->level[v] = d, l->below[v] = m->twin[h];
            h = qw_around(m, h);
        } while (h != first);
        if (l->level[v] < INFINITY) qw_queue_put(&l->queue, v, (int64_t)(l->level[v] / l->edge * QW_QUEUE_UNIT));
    }
    while ((v = qw_queue_take(&l->queue)) != QW_NONE) {
        tip = v;
        uint32_t first = l->out[v], h = first;
        do {
            uint32_t w = m->corner[qw_next(h)];
            float d = l->level[v] + qw_distance(m->position[v], m->position[w]);
            if (l->open[w] && d < l->level[w]) {
                l->level[w] = d, l->below[w] = h;
                qw_queue_put(&l->queue, w, (int64_t)(d / l->edge * QW_QUEUE_UNIT));
            }
            h = qw_around(m, h);
        } while (h != first);
    }
    return tip;
}

static float level_of(const protrusions *l, uint32_t v) { return l->open[v] ? l->level[v] : 0; }

/* Where the half-edge h, which goes up through level t, meets it. */
static qw_vec3 crossing(const protrusions *l, uint32_t h, float t)
{
    const qw_trimesh *m = l->surface;
    assert(h < 3 * m->face_count);
    uint32_t a = m->corner[h], b = m->corner[qw_next(h)];
    float low = level_of(l, a), high = level_of(l, b);
    return qw_lerp(m->position[a], m->position[b], high > low ? (t - low) / (high - low) : 0.5f);
}

static void add_point(protrusions *l, qw_vec3 p)
{
    l->loop = qw_grow(l->env, l->loop, &l->capacity, l->loop_count + 2, sizeof *l->loop);
    l->along = qw_grow(l->env, l->along, &l->along_capacity, l->loop_count + 2, sizeof *l->along);
    l->along[l->loop_count] = l->loop_count ? l->along[l->loop_count - 1] + qw_distance(p, l->loop[l->loop_count - 1])
                                            : 0;
    l->loop[l->loop_count++] = p;
}

/* The curve of level t > 0 around the way to the tip, with the tip on its left; it ends where it begins. */
static void trace(protrusions *l, uint32_t tip, float t)
{
    assert(tip < l->surface->vertex_count);
    const qw_trimesh *m = l->surface;
    uint32_t up = l->below[tip], first;
    while (level_of(l, m->corner[up]) >= t) up = l->below[m->corner[up]];
    first = up;
    l->loop_count = 0;
    do {
        add_point(l, crossing(l, up, t));
        uint32_t down = m->twin[up], apex = m->corner[qw_prev(down)];
        up = level_of(l, apex) >= t ? qw_next(down) : qw_prev(down);
    } while (up != first);
    add_point(l, l->loop[0]);
}

static float girth(const protrusions *l) { return l->along[l->loop_count - 1]; }

/* s: a share of the way around, any. */
static qw_vec3 on_loop(const protrusions *l, float s)
{
    assert(l->loop_count > 1);
    float at = (s - (float)qw_floor(s)) * girth(l);
    uint32_t low = 0, high = l->loop_count - 1;
    while (high - low > 1) {
        uint32_t middle = (low + high) / 2;
        *(l->along[middle] <= at ? &low : &high) = middle;
    }
    float step = l->along[high] - l->along[low];
    return qw_lerp(l->loop[low], l->loop[high], step > 0 ? fminf((at - l->along[low]) / step, 1) : 0);
}

static qw_vec3 mean4(const qw_vec3 *p) { return qw_scale(qw_add(qw_add(p[0], p[1]), qw_add(p[2], p[3])), 0.25f); }

/* Chooses four points on the loop, a quarter of its length apart, in the order of those of `ring`, and turned around
   the loop so that they lie nearest to these. */
static void next_ring(const protrusions *l, const qw_vec3 ring[4], qw_vec3 next[4])
{
    float least = INFINITY;
    qw_vec3 center = mean4(ring);
    for (int turn = 0; turn < TURNS; turn++) {
        qw_vec3 p[4];
        float sum = 0;
        for (int k = 0; k < 4; k++) p[k] = on_loop(l, (float)turn / TURNS + 0.25f * (float)k);
        qw_vec3 moved = qw_sub(mean4(p), center);
        for (int k = 0; k < 4; k++) sum += qw_length2(qw_sub(qw_sub(p[k], ring[k]), moved));
        if (sum < least) least = sum, memcpy(next, p, sizeof p);
    }
}

static qw_vec3 loop_center(const protrusions *l)
{
    qw_vec3 p[4];
    for (int k = 0; k < 4; k++) p[k] = on_loop(l, 0.25f * (float)k);
    return mean4(p);
}

static bool meets_itself(const qw_quadmesh *q, uint32_t f)
{
    const uint32_t *t = q->twin + 4 * (size_t)f;
    return t[0] / 4 == f || t[1] / 4 == f || t[2] / 4 == f || t[3] / 4 == f;
}

/* The quad of the protrusion's own component from which it grows. It begins at point `base`, in direction `way`. */
static uint32_t quad_below(const protrusions *l, const qw_quadmesh *q, const uint8_t *taken, qw_vec3 base, qw_vec3 way)
{
    uint32_t best = QW_NONE, component = l->component[l->out[l->member[0]] / 3];
    float least = FARTHEST * l->edge;
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * (size_t)f;
        qw_vec3 p[4] = {q->position[c[0]], q->position[c[1]], q->position[c[2]], q->position[c[3]]};
        float d = qw_distance(mean4(p), base);
        if (d >= least || taken[f] || meets_itself(q, f) || (q->component && q->component[c[0]] != component) ||
            qw_dot(qw_quad_normal(q, f), way) < QW_SAME_SHEET * qw_length(way))
            continue;
        least = d;
        best = f;
    }
    return best;
}

/* Replaces face f by a tube of n rings with f as its cap; ring: positions from below. The arrays must have room. */
static void extrude(qw_quadmesh *q, uint32_t f, const qw_vec3 (*ring)[4], uint32_t n)
{
    assert(f < q->face_count && n > 0);
    uint32_t below[4], twin[4];
    uint8_t mark[4];
    for (uint32_t k = 0; k < 4; k++)
        below[k] = q->corner[4 * f + k], twin[k] = q->twin[4 * f + k], mark[k] = q->mark ? q->mark[4 * f + k] : 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t side = q->face_count, above[4];
        for (uint32_t k = 0; k < 4; k++) {
            above[k] = q->vertex_count++;
            q->position[above[k]] = ring[i][k];
            if (q->kind) q->kind[above[k]] = QW_VERTEX_FREE;
            if (q->component) q->component[above[k]] = q->component[below[k]];
        }
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t h = 4 * (side + k), top = i + 1 < n ? 4 * (side + 4 + k) : 4 * f + k;
            uint32_t corner[4] = {below[k], below[(k + 1) % 4], above[(k + 1) % 4], above[k]};
            uint32_t other[4] = {twin[k], 4 * (side + (k + 1) % 4) + 3, top, 4 * (side + (k + 3) % 4) + 1};
            memcpy(q->corner + h, corner, sizeof corner);
            memcpy(q->twin + h, other, sizeof other);
            if (twin[k] != QW_NONE) q->twin[twin[k]] = h;
            if (q->mark) q->mark[h] = mark[k], q->mark[h + 1] = q->mark[h + 2] = q->mark[h + 3] = 0;
        }
        for (uint32_t k = 0; k < 4; k++) twin[k] = 4 * (side + k) + 2, mark[k] = 0;
        memcpy(below, above, sizeof below);
        q->face_count += 4;
    }
    for (uint32_t k = 0; k < 4; k++) {
        q->corner[4 * f + k] = below[k], q->twin[4 * f + k] = twin[k];
        if (q->mark) q->mark[4 * f + k] = 0;
    }
}

/* The first ring lies at BASE_LEVEL of the protrusion's height. The last lies CAP_BELOW_TIP of a ring's length, or of
   the height, below the tip, so that its cap lies across the tip. */
static const float BASE_LEVEL = 0.1f, CAP_BELOW_TIP = 0.35f;

/* Covers the protrusion that was taken with at most `most` quads. Returns whether it did. */
static bool grow(protrusions *l, qw_quadmesh *q, uint8_t *taken, uint32_t most)
{
    if (most < 4) return false;
    uint32_t tip = find_levels(l);
    if (tip == QW_NONE) return false; /* it ends nowhere */
    float height = l->level[tip], width = 0;
    if (!(height > 0)) return false;
    for (int i = 1; i < 4; i++) trace(l, tip, height * 0.25f * (float)i), width += girth(l) / 12;
    qw_vec3 far = loop_center(l);
    trace(l, tip, height * BASE_LEVEL);
    qw_vec3 base = loop_center(l);
    uint32_t f = quad_below(l, q, taken, base, qw_sub(far, base));
    if (f == QW_NONE) return false;
    qw_vec3 ring[MOST_RINGS + 1][4];
    for (uint32_t k = 0; k < 4; k++) ring[0][k] = q->position[q->corner[4 * f + k]];
    float length = fmaxf(width, LEAST_LENGTH * l->edge), gap = qw_distance(mean4(ring[0]), base);
    uint32_t n = (uint32_t)fminf(fmaxf((float)qw_round_away((gap + height) / length), 1), MOST_RINGS);
    if (n > most / 4) n = most / 4;
    if (n == 0) return false;
    float end = height - CAP_BELOW_TIP * fminf(length, height);
    for (uint32_t i = 1; i <= n; i++) {
        trace(l, tip, end * (float)i / (float)n);
        next_ring(l, ring[i - 1], ring[i]);
    }
    extrude(q, f, (const qw_vec3(*)[4])(ring + 1), n);
    taken[f] = 1;
    return true;
}

static void *longer(qw_env *env, const void *from, size_t count, size_t more, size_t size)
{
    if (!from) return NULL;
    void *to = qw_alloc_zero(env, count + more, size);
    memcpy(to, from, count * size);
    return to;
}

/* Opens what lies within `length` of a tip along edges (Dijkstra): a protrusion that the quads leave out. Pieces that
 * have grown, or are another's, stay as they are. */
static void open_tip(protrusions *l, uint32_t from, float length)
{
    const qw_trimesh *m = l->surface;
    l->queue.last = 0, l->level[from] = 0;
    qw_queue_put(&l->queue, from, 0);
    for (uint32_t v; (v = qw_queue_take(&l->queue)) != QW_NONE;) {
        uint32_t first = l->out[v], h = first;
        l->open[v] = 1;
        do {
            uint32_t w = m->corner[qw_next(h)];
            float d = l->level[v] + qw_distance(m->position[v], m->position[w]);
            if (!l->open[w] && !l->seen[w] && d <= length && (!qw_queue_has(&l->queue, w) || d < l->level[w])) {
                l->level[w] = d;
                qw_queue_put(&l->queue, w, (int64_t)(d / l->edge * QW_QUEUE_UNIT));
            }
            h = qw_around(m, h);
        } while (h != QW_NONE && h != first);
    }
}

/* Those tips grow that are discs and near enough to a quad. */
static uint32_t grow_tips(protrusions *l, qw_quadmesh *q, uint8_t *taken, const qw_growth *g)
{
    uint32_t before = q->face_count, grown = 0;
    const qw_bvh *tree = g->tip_count > 0 ? qw_bvh_build(l->env, l->surface) : NULL;
    l->open = QW_NEW_ZERO(l->env, uint8_t, l->surface->vertex_count);
    for (uint32_t t = 0; t < g->tip_count; t++) {
        qw_heartbeat(l->env);
        qw_hit hit = qw_bvh_nearest(tree, g->tip[t].point, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        if (hit.face == QW_NONE) continue;
        int nearest = hit.weight[1] > hit.weight[0];
        if (hit.weight[2] > hit.weight[nearest]) nearest = 2;
        uint32_t from = l->surface->corner[3 * (size_t)hit.face + (uint32_t)nearest];
        if (l->seen[from]) continue; /* part of another */
        open_tip(l, from, g->tip[t].length);
        bool grows = take_protrusion(l, from, g->marked) && grow(l, q, taken, g->most - (q->face_count - before));
        for (uint32_t i = 0; i < l->count; i++) l->open[l->member[i]] = 0, l->seen[l->member[i]] = grows;
        grown += grows;
    }
    return grown;
}

uint32_t qw_extrude_protrusions(qw_env *env, qw_quadmesh *quads, const qw_growth *g)
{
    const qw_trimesh *surface = g->surface;
    assert(quads->twin && surface->twin && g->edge > 0 && g->far > 0);
    uint32_t n = surface->vertex_count, before = quads->face_count, most = g->most;
    qw_quadmesh q = *quads;
    size_t vertices = q.vertex_count, sides = (size_t)4 * q.face_count;
    q.position = longer(env, q.position, vertices, most, sizeof *q.position);
    q.kind = longer(env, q.kind, vertices, most, sizeof *q.kind);
    q.component = longer(env, q.component, vertices, most, sizeof *q.component);
    q.corner = longer(env, q.corner, sides, (size_t)4 * most, sizeof *q.corner);
    q.twin = longer(env, q.twin, sides, (size_t)4 * most, sizeof *q.twin);
    q.mark = longer(env, q.mark, sides, (size_t)4 * most, sizeof *q.mark);
    qw_scope_begin(env);
    protrusions l = {.env = env, .surface = surface, .out = qw_trimesh_outgoing(env, surface), .edge = g->edge};
    l.seen = QW_NEW_ZERO(env, uint8_t, n), l.level = QW_NEW(env, float, n), l.below = QW_NEW(env, uint32_t, n),
    l.member = QW_NEW(env, uint32_t, n);
    uint32_t *component = QW_NEW(env, uint32_t, surface->face_count);
    qw_label_components(env, 3, surface->twin, surface->face_count, component);
    l.component = component;
    l.queue = qw_queue_create(env, n);
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, (size_t)q.face_count + most);
    uint32_t grown = grow_tips(&l, &q, taken, g);
    qw_halves halves = qw_halve_quads(env, quads);
    const uint8_t *lost = qw_mark_uncovered(env, surface, &halves, g->far);
    l.open = qw_mark_uncovered(env, surface, &halves, NEAR * g->edge);
    for (uint32_t v = 0; v < n; v++)
        if (lost[v] && !l.seen[v] && take_protrusion(&l, v, g->marked)) {
            qw_heartbeat(env);
            grown += grow(&l, &q, taken, most - (q.face_count - before));
        }
    qw_scope_end(env);
    *quads = q;
    return grown;
}

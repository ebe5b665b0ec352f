#include "products/wrap/hole_fill.h"

#include "geometry/trimesh.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    MOST_EXACT = 100, /* edges of a loop whose smallest fill is found; of longer ones ears are cut */
    LEVELS = 24,      /* each halves the longest edges */
    SWEEPS = 30,      /* of smoothing, after each level */
    FLIP_SWEEPS = 4,
    MOST_VERTICES = 1 << 20
};
static const float LONG = 1.4f;    /* mean edges of the loop: longer edges of the fill are split */
static const float JOINED = 1e30f; /* area of a triangle that has an edge that the surface has already */

/* ---- the smallest fill */

static float triangle_area(const qw_hole_rim *r, uint32_t a, uint32_t b, uint32_t c)
{
    return 0.5f * qw_length(qw_cross(qw_sub(r->position[b], r->position[a]), qw_sub(r->position[c], r->position[a])));
}

/* Whether two vertices that are no neighbours on the rim are joined already. */
static bool is_taken(const qw_hole_rim *r, uint32_t a, uint32_t b)
{
    return (a + 1) % r->count != b && (b + 1) % r->count != a && r->is_joined(r->user, a, b);
}

static float cost_of(const qw_hole_rim *r, uint32_t a, uint32_t b, uint32_t c)
{
    bool taken = is_taken(r, a, b) || is_taken(r, b, c) || is_taken(r, a, c);
    return triangle_area(r, a, b, c) + (taken ? JOINED : 0);
}

static void add_triangle(qw_env *env, qw_hole_fill *p, uint32_t a, uint32_t b, uint32_t c)
{
    size_t n = 3 * (size_t)p->face_count++;
    p->corner = qw_grow(env, p->corner, &p->corner_capacity, n + 3, sizeof *p->corner);
    p->corner[n] = a, p->corner[n + 1] = b, p->corner[n + 2] = c;
}

/* By dynamic programming over the spans of the loop: cost[a n + b] of the polygon a, a + 1 ... b. False where every
 * fill needs an edge that the surface has. */
static bool smallest_fill(qw_env *env, const qw_hole_rim *r, qw_hole_fill *p)
{
    uint32_t n = r->count, *apex = QW_NEW_ZERO(env, uint32_t, (size_t)n * n),
             *stack = QW_NEW(env, uint32_t, 2 * (size_t)n);
    float *cost = QW_NEW_ZERO(env, float, (size_t)n *n);
    for (uint32_t span = 2; span < n; span++)
        for (uint32_t a = 0; a + span < n; a++) {
            uint32_t b = a + span;
            float least = INFINITY;
            for (uint32_t m = a + 1; m < b; m++) {
                float c = cost[a * n + m] + cost[m * n + b] + cost_of(r, a, m, b);
                if (c < least) least = c, apex[a * n + b] = m;
            }
            cost[a * n + b] = least;
        }
    bool found = cost[n - 1] < JOINED;
    uint32_t count = 0;
    if (found) stack[count++] = 0, stack[count++] = n - 1;
    while (count > 0) {
        uint32_t b = stack[--count], a = stack[--count], m = apex[a * n + b];
        if (b - a < 2) continue;
        add_triangle(env, p, a, m, b);
        stack[count++] = a, stack[count++] = m, stack[count++] = m, stack[count++] = b;
        assert(count <= 2 * n);
    }
    qw_free(env, apex), qw_free(env, stack), qw_free(env, cost);
    return found;
}

/* Cuts the ear with the shortest new edge, again and again. False where none is left without an edge of the surface. */
static bool cut_ears(qw_env *env, const qw_hole_rim *r, qw_hole_fill *p)
{
    uint32_t n = r->count, *left = QW_NEW(env, uint32_t, n);
    for (uint32_t i = 0; i < n; i++) left[i] = i;
    bool found = true;
    while (n > 3 && found) {
        uint32_t best = QW_NONE;
        float least = INFINITY;
        for (uint32_t i = 0; i < n; i++) {
            uint32_t a = left[(i + n - 1) % n], c = left[(i + 1) % n];
            float length = qw_distance(r->position[a], r->position[c]);
            if (length < least && !is_taken(r, a, c)) least = length, best = i;
        }
        found = best != QW_NONE;
        if (!found) break;
        add_triangle(env, p, left[(best + n - 1) % n], left[best], left[(best + 1) % n]);
        memmove(left + best, left + best + 1, (n - best - 1) * sizeof *left);
        n--;
        qw_heartbeat(env);
    }
    assert(!found || n == 3);
    if (found) add_triangle(env, p, left[0], left[1], left[2]);
    qw_free(env, left);
    return found;
}

static uint32_t add_vertex(qw_env *env, qw_hole_fill *p, qw_vec3 at)
{
    p->position = qw_grow(env, p->position, &p->vertex_capacity, (size_t)p->vertex_count + 1, sizeof *p->position);
    p->position[p->vertex_count] = at;
    return p->vertex_count++;
}

/* A vertex in the middle, joined to all: no edge of it is there already. */
static void fan(qw_env *env, const qw_hole_rim *r, qw_hole_fill *p)
{
    qw_vec3 sum = {0, 0, 0};
    p->face_count = 0;
    for (uint32_t i = 0; i < r->count; i++) sum = qw_add(sum, r->position[i]);
    uint32_t middle = add_vertex(env, p, qw_scale(sum, 1.0f / (float)r->count));
    for (uint32_t i = 0; i < r->count; i++) add_triangle(env, p, i, (i + 1) % r->count, middle);
}

/* ---- refinement */

static uint32_t tail(const qw_hole_fill *p, uint32_t h) { return p->corner[h]; }
static uint32_t head(const qw_hole_fill *p, uint32_t h) { return p->corner[qw_next(h)]; }
static uint32_t apex(const qw_hole_fill *p, uint32_t h) { return p->corner[qw_prev(h)]; }
static float length(const qw_hole_fill *p, uint32_t h)
{
    return qw_distance(p->position[tail(p, h)], p->position[head(p, h)]);
}

static void pair(qw_hole_fill *p, uint32_t h, uint32_t t)
{
    p->twin[h] = t;
    if (t != QW_NONE) p->twin[t] = h;
}

static void set_corners(qw_hole_fill *p, uint32_t f, uint32_t a, uint32_t b, uint32_t c)
{
    p->corner[f] = a, p->corner[f + 1] = b, p->corner[f + 2] = c;
}

static void flip(qw_hole_fill *p, uint32_t h)
{
    uint32_t t = p->twin[h], a = tail(p, h), b = head(p, h), c = apex(p, h), d = apex(p, t);
    uint32_t bc = p->twin[qw_next(h)], ca = p->twin[qw_prev(h)], ad = p->twin[qw_next(t)], db = p->twin[qw_prev(t)];
    uint32_t f = h - h % 3, g = t - t % 3;
    set_corners(p, f, c, a, d), set_corners(p, g, d, b, c);
    pair(p, f, ca), pair(p, f + 1, ad), pair(p, g, db), pair(p, g + 1, bc), pair(p, f + 2, g + 2);
}

static uint32_t new_face(qw_env *env, qw_hole_fill *p)
{
    uint32_t f = 3 * p->face_count;
    add_triangle(env, p, 0, 0, 0);
    p->twin = qw_grow(env, p->twin, &p->twin_capacity, 3 * (size_t)p->face_count, sizeof *p->twin);
    return f;
}

/* At its middle; an edge of the loop is not split. */
static void split(qw_env *env, qw_hole_fill *p, uint32_t h)
{
    uint32_t t = p->twin[h], a = tail(p, h), b = head(p, h), c = apex(p, h), d = apex(p, t);
    uint32_t bc = p->twin[qw_next(h)], ca = p->twin[qw_prev(h)], ad = p->twin[qw_next(t)], db = p->twin[qw_prev(t)];
    uint32_t v = add_vertex(env, p, qw_lerp(p->position[a], p->position[b], 0.5f));
    uint32_t f = h - h % 3, g = t - t % 3, i = new_face(env, p), j = new_face(env, p);
    set_corners(p, f, a, v, c), set_corners(p, i, v, b, c), set_corners(p, g, b, v, d), set_corners(p, j, v, a, d);
    pair(p, f, j), pair(p, f + 1, i + 2), pair(p, f + 2, ca), pair(p, i, g), pair(p, i + 1, bc);
    pair(p, g + 1, j + 2), pair(p, g + 2, db), pair(p, j + 1, ad);
}

/* The cosine of the angle at c of the triangle abc. */
static float cosine_at(const qw_hole_fill *p, uint32_t a, uint32_t b, uint32_t c)
{
    qw_vec3 u = qw_normalize(qw_sub(p->position[a], p->position[c])),
            v = qw_normalize(qw_sub(p->position[b], p->position[c]));
    return qw_dot(u, v);
}

/* Whether the angles across an edge are more than two right ones in all, and the other diagonal joins no two vertices
 * of the loop, which the surface may join already, nor two that are joined in the fill. */
static bool wants_flip(const qw_hole_fill *p, uint32_t h, uint32_t rim)
{
    uint32_t t = p->twin[h];
    if (t == QW_NONE || h > t) return false;
    uint32_t a = tail(p, h), b = head(p, h), c = apex(p, h), d = apex(p, t);
    if (c == d || (c < rim && d < rim)) return false;
    if (cosine_at(p, a, b, c) + cosine_at(p, a, b, d) > -1e-4f) return false;
    uint32_t first = qw_prev(h), i = first, side = 0; /* around c, both ways up to the rim */
    for (int way = 0; way < 2; way++)
        for (i = first, side = 0; i != QW_NONE && side < 1000; side++) {
            if (head(p, i) == d || apex(p, i) == d) return false;
            i = way == 0 ? p->twin[qw_prev(i)] : p->twin[i] == QW_NONE ? QW_NONE : qw_next(p->twin[i]);
            if (i == first) break;
        }
    return true;
}

static void flip_all(qw_hole_fill *p, uint32_t rim)
{
    for (int sweep = 0; sweep < FLIP_SWEEPS; sweep++)
        for (uint32_t h = 0; h < 3 * p->face_count; h++)
            if (wants_flip(p, h, rim)) flip(p, h);
}

/* ---- smoothing */

/* The mean of the neighbours of each vertex less its own value, of values at the fill and constant ones beside the
 * loop. */
static void umbrella(const qw_hole_fill *p, const qw_hole_rim *r, const qw_vec3 *value, bool with_beside, qw_vec3 *to,
                     uint32_t *degree)
{
    memset(to, 0, p->vertex_count * sizeof *to), memset(degree, 0, p->vertex_count * sizeof *degree);
    for (uint32_t h = 0; h < 3 * p->face_count; h++) {
        uint32_t a = tail(p, h), b = head(p, h); /* each inner edge comes twice, with its ends exchanged */
        to[a] = qw_add(to[a], value[b]), degree[a]++;
        if (p->twin[h] == QW_NONE) to[b] = qw_add(to[b], value[a]), degree[b]++;
    }
    for (uint32_t v = 0; v < p->vertex_count; v++) {
        if (with_beside && v < r->count) to[v] = qw_add(to[v], r->beside[v]), degree[v] += r->degree[v];
        to[v] = qw_sub(qw_scale(to[v], 1.0f / (float)degree[v]), value[v]);
    }
}

/* Steps towards a fill whose second differences vanish and that goes on at the loop as the surface does. */
static void smooth(qw_env *env, qw_hole_fill *p, const qw_hole_rim *r)
{
    qw_vec3 *first = QW_NEW(env, qw_vec3, p->vertex_count), *second = QW_NEW(env, qw_vec3, p->vertex_count);
    uint32_t *degree = QW_NEW(env, uint32_t, p->vertex_count);
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        umbrella(p, r, p->position, true, first, degree);
        umbrella(p, r, first, false, second, degree);
        for (uint32_t v = r->count; v < p->vertex_count; v++) {
            assert(degree[v] > 0);
            float scale = 1.0f + 1.0f / (float)degree[v];
            p->position[v] = qw_madd(p->position[v], -0.5f / scale, second[v]);
        }
        qw_heartbeat(env);
    }
    qw_free(env, first), qw_free(env, second), qw_free(env, degree);
}

static void link(qw_env *env, qw_hole_fill *p)
{
    qw_trimesh mesh = {.vertex_count = p->vertex_count, .face_count = p->face_count, .corner = p->corner};
    qw_trimesh_link(env, &mesh);
    p->twin = mesh.twin, p->twin_capacity = 3 * (size_t)p->face_count;
}

static double area_of(const qw_hole_fill *p)
{
    double sum = 0;
    for (uint32_t f = 0; f < p->face_count; f++)
        sum += 0.5 * (double)qw_length(qw_triangle_cross(p->position, p->corner + 3 * (size_t)f));
    return sum;
}

qw_hole_fill qw_make_hole_fill(qw_env *env, const qw_hole_rim *rim)
{
    assert(rim->count >= 3);
    qw_hole_fill p = {0};
    float mean = 0;
    for (uint32_t i = 0; i < rim->count; i++) {
        add_vertex(env, &p, rim->position[i]);
        mean += qw_distance(rim->position[i], rim->position[(i + 1) % rim->count]) / (float)rim->count;
    }
    bool found = rim->count <= MOST_EXACT ? smallest_fill(env, rim, &p) : cut_ears(env, rim, &p);
    if (!found) fan(env, rim, &p);
    link(env, &p);
    p.area = area_of(&p);
    for (int level = 0; level < LEVELS; level++) {
        uint32_t count = 3 * p.face_count, before = p.vertex_count;
        float longest = 0;
        for (uint32_t h = 0; h < count; h++)
            if (p.twin[h] != QW_NONE) longest = fmaxf(longest, length(&p, h));
        float limit = fmaxf(LONG * mean, 0.5f * longest);
        for (uint32_t h = 0; h < count && p.vertex_count < MOST_VERTICES; h++)
            if (p.twin[h] != QW_NONE && h < p.twin[h] && length(&p, h) > limit) split(env, &p, h);
        if (p.vertex_count == before && level > 0) break;
        flip_all(&p, rim->count);
        smooth(env, &p, rim);
    }
    return p;
}

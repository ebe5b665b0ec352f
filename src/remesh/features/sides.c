#include "remesh/features/sides.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "geometry/polygons.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Lengths in local edges. A plane reaches one ring of triangles beyond its vertices, and so lies off a band of two
 * edges whose middle is REACH from its own. */
static const float FITTED = 1.5f, REACH = 3.25f;
/* Spread of the normals around a vertex above which it is rough, radians: a turn of 20 degrees in an edge. */
static const float ROUGH = 0.12f;
/* The same of a plane that is bent. */
static const float BENT = 0.25f;
/* What a plane costs a vertex: its spread, the vertex's distance from its plane, and how far away it is. */
static const float SPREAD_COST = 4, PLANE_COST = 1, FAR_COST = 0.02f;
/* Length of an edge, as a share of the longest of its triangle: in between for equilateral and right-angled ones. */
static const float TO_EDGE = 0.85f;
/* Mean unevenness (spread over turn) of what is tried first, above which the rest is not looked at, and the most that
 * one place counts. */
static const double UNEVEN = 0.09, MOST_UNEVEN = 0.3;
enum { AGREE_ROUNDS = 2, MOST_TRIED = 4096, MOST_SEEDS = 192 };
enum { EDGE_ROUNDS = 2, NEAR_RINGS = 8, OWN_RINGS = 3 };

/* Of a triangle: its normal times twice its area, twice its area, and that times its edge. */
typedef struct face_size {
    qw_vec3 cross;
    float area, edge;
} face_size;

typedef struct side_task {
    qw_sides *s;
    face_size *face; /* face_size[face_count] */
    qw_vec3 *cross;  /* qw_vec3[vertex_count]: sum of the triangles' normals times areas */
    float *area;     /* float[vertex_count]: of the triangles around */
    const uint8_t *near;
    const float *from;
    float *to;
    uint32_t *next;
} side_task;

/* ---- neighbourhoods */

/* Where a vertex of the ball stands, or QW_NONE where it would. By multiplicative hashing (Knuth 6.4). */
static uint32_t *slot_of(qw_vertex_ball *ball, uint32_t v)
{
    uint32_t at = (v * 2654435769u) >> (32 - QW_BALL_BITS);
    while (ball->slot[at] != QW_NONE && ball->vertex[ball->slot[at]] != v) at = (at + 1) % (1u << QW_BALL_BITS);
    return &ball->slot[at];
}

void qw_collect_ball(const qw_sides *s, uint32_t v, float radius, const uint8_t *barred, qw_vertex_ball *ball)
{
    assert(v < s->mesh->vertex_count && ball);
    const qw_trimesh *mesh = s->mesh;
    qw_vec3 middle = mesh->position[v];
    float far2 = radius * radius;
    memset(ball->slot, 0xff, sizeof ball->slot);
    *slot_of(ball, v) = 0, ball->vertex[0] = v, ball->count = 1;
    for (uint32_t i = 0; i < ball->count; i++) {
        uint32_t start = s->outgoing[ball->vertex[i]], h = start;
        do {
            uint32_t in = qw_prev(h), twin = mesh->twin[in], ways[2] = {h, in}; /* the second where the fan ends */
            for (int k = 0; k < 1 + (twin == QW_NONE); k++) {
                if (ball->count == QW_BALL) return;
                uint32_t w = mesh->corner[k ? in : qw_next(h)], *slot = slot_of(ball, w);
                if (*slot != QW_NONE || (barred && barred[ways[k]]) ||
                    qw_length2(qw_sub(mesh->position[w], middle)) > far2)
                    continue;
                *slot = ball->count, ball->vertex[ball->count++] = w;
            }
            h = twin;
        } while (h != QW_NONE && h != start);
    }
}

/* ---- vertices alone */

static float longest_side(const qw_trimesh *mesh, uint32_t f)
{
    const uint32_t *c = mesh->corner + 3 * (size_t)f;
    qw_vec3 a = mesh->position[c[0]], b = mesh->position[c[1]], d = mesh->position[c[2]];
    return sqrtf(fmaxf(fmaxf(qw_length2(qw_sub(a, b)), qw_length2(qw_sub(b, d))), qw_length2(qw_sub(d, a))));
}

static void measure_faces(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_vec3 cross = qw_face_cross(t->s->mesh, f);
        float area = qw_length(cross);
        t->face[f] = (face_size){cross, area, area * TO_EDGE * longest_side(t->s->mesh, f)};
    }
}

/* For each vertex, over the triangles around it: sum of cross products, area, mean edge, and whether their normals
 * disagree. */
static void sum_rings(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    const qw_sides *s = t->s;
    for (uint32_t v = begin; v < end; v++) {
        qw_vec3 cross = {0, 0, 0};
        float area = 0, edge = 0;
        uint32_t start = s->outgoing[v], h = start;
        do {
            const face_size *f = &t->face[h / 3];
            cross = qw_add(cross, f->cross), area += f->area, edge += f->edge;
            h = qw_around(s->mesh, h);
        } while (h != QW_NONE && h != start);
        t->cross[v] = cross, t->area[v] = area;
        s->edge[v] = area > 0 ? edge / area : 0;
        s->rough[v] = qw_length(cross) < area * (1 - 0.5f * ROUGH * ROUGH);
    }
}

/* One round of averaging over neighbours. */
static void average_edges(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    const qw_sides *s = t->s;
    for (uint32_t v = begin; v < end; v++) {
        float sum = t->area[v] * t->from[v], area = t->area[v];
        uint32_t start = s->outgoing[v], h = start;
        do {
            uint32_t w = s->mesh->corner[qw_next(h)];
            sum += t->area[w] * t->from[w], area += t->area[w];
            h = qw_around(s->mesh, h);
        } while (h != QW_NONE && h != start);
        t->to[v] = area > 0 ? sum / area : 0;
    }
}

static void find_edges(qw_env *env, side_task *t)
{
    uint32_t n = t->s->mesh->vertex_count;
    float *other = QW_NEW(env, float, n);
    for (int i = 0; i < EDGE_ROUNDS; i++) {
        t->from = t->s->edge, t->to = other;
        qw_parallel(env, n, QW_GRAIN, average_edges, t);
        other = t->s->edge, t->s->edge = t->to;
    }
}

/* uint8_t[vertex_count]: so many rings and fewer away from rough vertices, counted down: 0 beyond. */
static uint8_t *find_near(qw_env *env, const qw_sides *s)
{
    const qw_trimesh *mesh = s->mesh;
    uint32_t n = mesh->vertex_count, count = 0, *queue = QW_NEW(env, uint32_t, n);
    uint8_t *near = QW_NEW_ZERO(env, uint8_t, n), rings = NEAR_RINGS;
    for (uint32_t v = 0; v < n; v++)
        if (s->rough[v]) near[v] = rings, queue[count++] = v;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t v = queue[i], h = s->outgoing[v];
        if (near[v] == 1) break;
        do {
            uint32_t w = mesh->corner[qw_next(h)];
            if (!near[w]) near[w] = near[v] - 1, queue[count++] = w;
            h = qw_around(mesh, h);
        } while (h != QW_NONE && h != s->outgoing[v]);
    }
    return near;
}

/* ---- planes */

/* The plane fitted to what lies near v, and how far normals there spread. */
static qw_side_plane plane_at(const side_task *t, uint32_t v, qw_vertex_ball *ball)
{
    assert(v < t->s->mesh->vertex_count);
    qw_collect_ball(t->s, v, FITTED * t->s->edge[v], NULL, ball);
    qw_vec3 cross = {0, 0, 0}, point = {0, 0, 0}, middle = t->s->mesh->position[v];
    float area = 0, apart = 0;
    for (uint32_t i = 0; i < ball->count; i++) {
        uint32_t w = ball->vertex[i];
        cross = qw_add(cross, t->cross[w]), apart += qw_length(t->cross[w]), area += t->area[w];
        point = qw_madd(point, t->area[w], qw_sub(t->s->mesh->position[w], middle));
    }
    if (!(apart > 0)) return (qw_side_plane){0};
    float together = fminf(qw_length(cross) / apart, 1);
    return (qw_side_plane){
        .point = qw_madd(middle, 1 / area, point), .normal = qw_normalize(cross), .spread = sqrtf(2 - 2 * together)};
}

static void make_planes(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    qw_vertex_ball ball;
    for (uint32_t v = begin; v < end; v++) t->s->plane[v] = t->near[v] ? plane_at(t, v, &ball) : (qw_side_plane){0};
}

static float cost_of(const qw_sides *s, uint32_t v, uint32_t c)
{
    const qw_side_plane *p = &s->plane[c];
    if (qw_length2(p->normal) == 0) return INFINITY;
    qw_vec3 d = qw_scale(qw_sub(s->mesh->position[v], p->point), 1 / s->edge[v]);
    float off = qw_dot(d, p->normal);
    return SPREAD_COST * p->spread * p->spread + PLANE_COST * off * off + FAR_COST * qw_length2(d);
}

/* The plane for v of those around it; less_like: their normals must differ by 40 degrees from that plane's. */
static uint32_t best_around(const qw_sides *s, uint32_t v, const qw_vertex_ball *ball, uint32_t less_like)
{
    assert(v < s->mesh->vertex_count);
    float least = INFINITY;
    uint32_t best = QW_NONE;
    for (uint32_t i = 0; i < ball->count; i++) {
        uint32_t c = ball->vertex[i];
        if (less_like != QW_NONE && qw_dot(s->plane[c].normal, s->plane[less_like].normal) > (float)QW_SHARP_COSINE)
            continue;
        float cost = less_like == QW_NONE ? cost_of(s, v, c) : s->plane[c].spread;
        if (cost < least) least = cost, best = c;
    }
    return best;
}

/* Chooses for each vertex near a band the plane that it belongs to: its own, or one nearby that costs less. */
static void choose_sides(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    const qw_sides *s = t->s;
    qw_vertex_ball ball;
    for (uint32_t v = begin; v < end; v++) {
        s->side[v] = v;
        if (t->near[v] < NEAR_RINGS - OWN_RINGS) continue;
        qw_collect_ball(s, v, REACH * s->edge[v], NULL, &ball);
        uint32_t best = best_around(s, v, &ball, QW_NONE);
        if (best != QW_NONE) s->side[v] = best;
    }
}

/* A vertex that shares its side with fewer than a third of those around takes the best of theirs: a line that went
 * around it would be a tooth. */
static void agree(void *user, uint32_t begin, uint32_t end)
{
    const side_task *t = user;
    const qw_sides *s = t->s;
    for (uint32_t v = begin; v < end; v++) {
        uint32_t start = s->outgoing[v], h = start, all = 0, same = 0, best = s->side[v];
        t->next[v] = best;
        if (t->near[v] < NEAR_RINGS - OWN_RINGS) continue;
        float least = INFINITY;
        do {
            uint32_t c = s->side[s->mesh->corner[qw_next(h)]];
            bool is_same = qw_dot(s->plane[c].normal, s->plane[s->side[v]].normal) > (float)QW_STRAIGHT_COSINE;
            float cost = cost_of(s, v, c);
            all++, same += is_same;
            if (!is_same && cost < least) least = cost, best = c;
            h = qw_around(s->mesh, h);
        } while (h != QW_NONE && h != start);
        if (3 * same < all) t->next[v] = best;
    }
}

static void agree_on_sides(qw_env *env, side_task *t)
{
    uint32_t n = t->s->mesh->vertex_count;
    uint32_t *next = QW_NEW(env, uint32_t, n);
    for (int i = 0; i < AGREE_ROUNDS; i++) {
        t->next = next;
        qw_parallel(env, n, QW_GRAIN, agree, t);
        next = t->s->side, t->s->side = t->next;
    }
}

/* ---- a few first */

/* Of places where the surface is bent. */
typedef struct bends {
    double uneven; /* sum: spread of the two sides there, as a share of their turn */
    uint32_t bent; /* how many there are */
} bends;

static double angle_between(qw_vec3 n, qw_vec3 m) { return qw_acos(fmin(fmax((double)qw_dot(n, m), -1), 1)); }

/* Adds what the surface is like at v: whether two planes of small spread meet there, as beside a sampled crease. */
static void try_at(const side_task *t, uint32_t v, bends *sum)
{
    qw_vertex_ball around, ball;
    const qw_sides *s = t->s;
    qw_collect_ball(s, v, REACH * s->edge[v], NULL, &around);
    for (uint32_t i = 0; i < around.count; i++) {
        uint32_t c = around.vertex[i];
        if (qw_length2(s->plane[c].normal) == 0) s->plane[c] = plane_at(t, c, &ball);
    }
    uint32_t a = best_around(s, v, &around, QW_NONE), b = a == QW_NONE ? a : best_around(s, v, &around, a);
    double turn = b == QW_NONE ? 0 : angle_between(s->plane[a].normal, s->plane[b].normal);
    sum->bent++;
    sum->uneven += turn > 0 ? fmin(0.5 * (double)(s->plane[a].spread + s->plane[b].spread) / turn, MOST_UNEVEN)
                            : MOST_UNEVEN;
}

/* Whether sampled creases are worth looking for: tries rough vertices spread over the surface, until enough of them
 * are bent that more could not change what they say. */
static bool seems_banded(const side_task *t)
{
    const qw_sides *s = t->s;
    uint32_t n = s->mesh->vertex_count, rough = 0, seen = 0;
    qw_vertex_ball ball;
    bends sum = {0};
    for (uint32_t v = 0; v < n; v++) rough += s->rough[v];
    uint32_t step = rough / MOST_TRIED + 1;
    for (uint32_t v = 0; v < n && sum.bent < MOST_SEEDS && sum.uneven <= UNEVEN * MOST_SEEDS; v++) {
        if (!s->rough[v] || seen++ % step != 0) continue;
        s->plane[v] = plane_at(t, v, &ball);
        if (s->plane[v].spread > BENT) try_at(t, v, &sum);
    }
    return sum.bent > 0 && sum.uneven <= UNEVEN * sum.bent;
}

bool qw_find_sides(qw_env *env, const qw_trimesh *mesh, qw_sides *sides)
{
    assert(mesh->twin);
    uint32_t n = mesh->vertex_count;
    *sides = (qw_sides){.mesh = mesh, .outgoing = qw_trimesh_outgoing(env, mesh)};
    sides->edge = QW_NEW(env, float, n), sides->rough = QW_NEW(env, uint8_t, n);
    side_task t = {.s = sides, .cross = QW_NEW(env, qw_vec3, n), .area = QW_NEW(env, float, n)};
    t.face = QW_NEW(env, face_size, mesh->face_count);
    qw_parallel(env, mesh->face_count, QW_GRAIN, measure_faces, &t);
    qw_parallel(env, n, QW_GRAIN, sum_rings, &t);
    qw_free(env, t.face);
    if (!memchr(sides->rough, 1, n)) return false;
    find_edges(env, &t);
    sides->plane = QW_NEW_ZERO(env, qw_side_plane, n), sides->side = QW_NEW(env, uint32_t, n);
    if (!seems_banded(&t)) return false;
    t.near = find_near(env, sides);
    qw_parallel(env, n, QW_GRAIN, make_planes, &t);
    qw_parallel(env, n, QW_GRAIN, choose_sides, &t);
    agree_on_sides(env, &t);
    return true;
}

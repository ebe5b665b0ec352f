#include "remesh/quads/rod.h"

#include "base/elementary.h"
#include "solve/queue.h"

#include <math.h>
#include <string.h>

/* Where a ring is. */
typedef struct section {
    double around; /* length of the line at its distance */
    qw_vec3 middle, along;
} section;

typedef struct rod {
    qw_env *env;
    const qw_trimesh *part;
    double *distance; /* double[vertices]: along edges from the one end, in the length of the rod */
    uint32_t end[2];  /* vertices */
    uint32_t rings;
    section *ring; /* section[rings] */
} rod;

/* Sets the distances from a vertex, along edges, in units; returns the farthest vertex. outgoing: of
   qw_trimesh_outgoing. */
static uint32_t measure_from(rod *r, const uint32_t *outgoing, uint32_t from, double unit)
{
    const qw_trimesh *m = r->part;
    uint32_t far = from;
    qw_queue queue = qw_queue_create(r->env, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) r->distance[v] = INFINITY;
    r->distance[from] = 0;
    qw_queue_put(&queue, from, 0);
    for (uint32_t v; (v = qw_queue_take(&queue)) != QW_NONE; far = v) {
        uint32_t h = outgoing[v];
        do {
            uint32_t w = m->corner[qw_next(h)];
            double d = r->distance[v] + qw_floor(1 + (double)qw_edge_length(m, h) / unit);
            if (d < r->distance[w]) r->distance[w] = d, qw_queue_put(&queue, w, (int64_t)d);
            h = qw_around(m, h);
        } while (h != outgoing[v]);
    }
    return far;
}

/* The distance of a ring, in rods: the first and the last are not quite at the ends, where lines are no loops. */
static double place_of(const rod *r, uint32_t i)
{
    double least = 0.25;
    return fmin(fmax(i, least), r->rings - 1 - least) / (r->rings - 1);
}

/* Whether no line between the first ring and the last one is in several pieces: nothing but the end is farthest. */
static bool is_rod(const rod *r, const uint32_t *outgoing)
{
    const qw_trimesh *m = r->part;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        uint32_t h = outgoing[v];
        bool is_highest = r->distance[v] < place_of(r, r->rings - 1);
        do {
            is_highest &= r->distance[m->corner[qw_next(h)]] < r->distance[v];
            h = qw_around(m, h);
        } while (is_highest && h != outgoing[v]);
        if (is_highest) return false;
    }
    return true;
}

/* Where the line at this distance crosses the triangle; false: it does not. */
static bool cross(const rod *r, uint32_t f, double at, qw_vec3 p[2])
{
    const qw_trimesh *m = r->part;
    int found = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        double a = r->distance[m->corner[h]], b = r->distance[m->corner[qw_next(h)]];
        if ((a < at) == (b < at) || found == 2) continue;
        p[found++] = qw_lerp(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]],
                             (float)((at - a) / (b - a)));
    }
    return found == 2;
}

static void find_middles(rod *r)
{
    const qw_trimesh *m = r->part;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double low = INFINITY, high = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            low = fmin(low, r->distance[m->corner[h]]), high = fmax(high, r->distance[m->corner[h]]);
        uint32_t first = (uint32_t)qw_floor(low * (r->rings - 1)), last = (uint32_t)qw_floor(high * (r->rings - 1)) + 1;
        for (uint32_t i = first; i <= last && i < r->rings; i++) {
            qw_vec3 p[2];
            if (!cross(r, f, place_of(r, i), p)) continue;
            float w = qw_distance(p[0], p[1]);
            r->ring[i].around += (double)w;
            r->ring[i].middle = qw_madd(r->ring[i].middle, w, qw_lerp(p[0], p[1], 0.5f));
        }
    }
    for (uint32_t i = 0; i < r->rings; i++)
        r->ring[i].middle = qw_scale(r->ring[i].middle, 1 / (float)r->ring[i].around);
}

/* Directions along the rod, and the first and the last ring at its ends. */
static void set_planes(rod *r)
{
    section *ring = r->ring;
    uint32_t n = r->rings;
    for (uint32_t i = 0; i < n; i++)
        ring[i].along = qw_normalize(qw_sub(ring[i + 1 < n ? i + 1 : i].middle, ring[i > 0 ? i - 1 : i].middle));
    for (int e = 0; e < 2; e++) {
        section *last = &ring[e ? n - 1 : 0];
        float beyond = qw_dot(qw_sub(r->part->position[r->end[e]], last->middle), last->along);
        last->middle = qw_madd(last->middle, e ? fmaxf(beyond, 0) : fminf(beyond, 0), last->along);
    }
}

/* Rings are not twisted against one another. */
static void place(const rod *r, const qw_bvh *tree, qw_vec3 *position)
{
    qw_vec3 out = qw_sub(r->part->position[r->end[0]], r->ring[0].middle);
    for (uint32_t i = 0; i < r->rings; i++) {
        const section *ring = &r->ring[i];
        out = qw_reject(out, ring->along);
        if (qw_length2(out) == 0) out = qw_any_orthogonal(ring->along);
        out = qw_normalize(out);
        qw_vec3 side = qw_cross(ring->along, out);
        for (int k = 0; k < 4; k++) {
            float reach = (float)(ring->around / 4) * (k < 2 ? 1 : -1); /* to the corner of a square is less */
            qw_vec3 p = qw_madd(ring->middle, reach, k % 2 ? side : out);
            position[4 * i + (uint32_t)k] = qw_bvh_nearest(tree, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).point;
        }
    }
}

static qw_quadmesh join_rings(const rod *r, const qw_bvh *tree)
{
    uint32_t n = r->rings, vertices = 4 * n, faces = 4 * (n - 1) + 2;
    qw_quadmesh q = {.vertex_count = vertices,
                     .face_count = faces,
                     .position = QW_NEW(r->env, qw_vec3, vertices),
                     .corner = QW_NEW(r->env, uint32_t, 4 * (size_t)faces),
                     .kind = QW_NEW_ZERO(r->env, uint8_t, vertices),
                     .mark = QW_NEW_ZERO(r->env, uint8_t, 4 * (size_t)faces),
                     .component = QW_NEW_ZERO(r->env, uint32_t, vertices)};
    double volume = 0;
    for (uint32_t f = 0; f < r->part->face_count; f++)
        volume += (double)qw_dot(r->part->position[r->part->corner[3 * (size_t)f]], qw_face_cross(r->part, f));
    place(r, tree, q.position);
    for (uint32_t f = 0; f < faces; f++) {
        uint32_t i = f / 4 * 4, k = f % 4, next = (k + 1) % 4, last = 4 * (n - 1);
        uint32_t side[4] = {i + k, i + next, i + 4 + next, i + 4 + k}, near[4] = {3, 2, 1, 0},
                 far[4] = {last, last + 1, last + 2, last + 3};
        const uint32_t *c = f + 2 < faces ? side : f + 1 < faces ? near : far;
        for (uint32_t j = 0; j < 4; j++) q.corner[4 * f + j] = c[volume < 0 ? 3 - j : j];
    }
    qw_quadmesh_link(r->env, &q);
    return q;
}

qw_quadmesh qw_make_rod(qw_env *env, const qw_trimesh *part, const qw_bvh *tree, double quads)
{
    rod r = {.env = env, .part = part, .distance = QW_NEW(env, double, part->vertex_count)};
    const uint32_t *outgoing = qw_trimesh_outgoing(env, part);
    double unit = sqrt(qw_trimesh_area(part)) / QW_QUEUE_UNIT;
    r.rings = 1 + (uint32_t)fmax(qw_floor((quads - 2) / 4), 1);
    r.end[0] = measure_from(&r, outgoing, 0, unit);
    r.end[1] = measure_from(&r, outgoing, r.end[0], unit);
    double length = r.distance[r.end[1]];
    for (uint32_t v = 0; v < part->vertex_count; v++) r.distance[v] /= length;
    if (!is_rod(&r, outgoing)) return (qw_quadmesh){0};
    r.ring = QW_NEW_ZERO(env, section, r.rings);
    find_middles(&r);
    set_planes(&r);
    return join_rings(&r, tree);
}

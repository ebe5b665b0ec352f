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
    const uint32_t *outgoing; /* of qw_trimesh_outgoing */
    double *distance;         /* double[vertices]: along edges from the one end, in the length of the rod */
    uint32_t end[2];          /* vertices */
    /* of one that is closed to a ring, else NULL: uint8_t[faces]: that lie across the line where it is cut;
       uint8_t[vertices]: theirs on that side from which distances are measured */
    uint8_t *across, *first;
    uint32_t rings;
    section *ring; /* section[rings] */
} rod;

/* The distance at the tail of h, with one length of the rod more where the face of h reaches across the cut. */
static double distance_at(const rod *r, uint32_t h)
{
    uint32_t v = r->part->corner[h];
    return r->distance[v] + (r->across && r->across[h / 3] && r->first[v] ? 1 : 0);
}

/* Sets the distances along edges, in units, from those vertices that have one; returns the farthest vertex. */
static uint32_t measure(rod *r, double unit)
{
    const qw_trimesh *m = r->part;
    uint32_t far = 0;
    qw_queue queue = qw_queue_create(r->env, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (r->distance[v] < INFINITY) qw_queue_put(&queue, v, (int64_t)r->distance[v]);
    for (uint32_t v; (v = qw_queue_take(&queue)) != QW_NONE; far = v) {
        uint32_t h = r->outgoing[v];
        do {
            uint32_t w = m->corner[qw_next(h)];
            double d = r->distance[v] + qw_floor(1 + (double)qw_edge_length(m, h) / unit);
            bool is_cut = r->across && r->across[h / 3] && r->first[v] && !r->first[w];
            if (d < r->distance[w] && !is_cut) r->distance[w] = d, qw_queue_put(&queue, w, (int64_t)d);
            h = qw_around(m, h);
        } while (h != r->outgoing[v]);
    }
    return far;
}

static uint32_t measure_from(rod *r, uint32_t from, double unit)
{
    for (uint32_t v = 0; v < r->part->vertex_count; v++) r->distance[v] = INFINITY;
    r->distance[from] = 0;
    return measure(r, unit);
}

/* Marks the faces along the line at a distance that crosses face f. */
static void follow_line(const rod *r, double at, uint32_t f, uint8_t mark, uint8_t *line)
{
    const qw_trimesh *m = r->part;
    while (line[f] != mark) {
        uint32_t h = 3 * f;
        while (r->distance[m->corner[h]] < at || r->distance[m->corner[qw_next(h)]] >= at) h++;
        line[f] = mark;
        f = m->twin[h] / 3;
    }
}

/* One that is closed is cut along one of the two lines half-way between two vertices that lie across from one another,
   and measured from there. Returns its length; 0: there are not two lines. */
static double cut_ring(rod *r, double unit)
{
    const qw_trimesh *m = r->part;
    uint32_t far = measure_from(r, measure_from(r, 0, unit), unit);
    double at = qw_floor(r->distance[far] / 2), *before = QW_NEW(r->env, double, m->vertex_count), sum = 0, count = 0;
    uint8_t *line = QW_NEW_ZERO(r->env, uint8_t, m->face_count), lines = 0;
    memcpy(before, r->distance, m->vertex_count * sizeof *before);
    for (uint32_t f = 0; f < m->face_count && lines < 3; f++) {
        int above = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) above += before[m->corner[h]] >= at;
        if (above % 3 > 0 && !line[f]) follow_line(r, at, f, ++lines, line);
    }
    if (lines != 2) return 0;
    r->across = line, r->first = QW_NEW_ZERO(r->env, uint8_t, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) r->distance[v] = INFINITY;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        uint32_t v = m->corner[h];
        line[h / 3] = line[h / 3] == 1;
        if (line[h / 3] && before[v] >= at) r->first[v] = 1, r->distance[v] = before[v] - at;
    }
    measure(r, unit);
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (line[h / 3] && !r->first[m->corner[h]])
            sum += r->distance[m->corner[h]] + at - before[m->corner[h]], count++;
    return sum / count;
}

/* The distance of a ring, in rods: the first and the last are not quite at the ends, where lines are no loops. */
static double place_of(const rod *r, uint32_t i)
{
    double least = 0.25;
    if (r->across) return (i + 0.5) / r->rings;
    return fmin(fmax(i, least), r->rings - 1 - least) / (r->rings - 1);
}

/* Whether no line between the first ring and the last one is in several pieces: nothing but the end is farthest. */
static bool is_rod(const rod *r)
{
    const qw_trimesh *m = r->part;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        uint32_t h = r->outgoing[v];
        bool is_highest = r->distance[v] < place_of(r, r->rings - 1);
        do {
            is_highest &= distance_at(r, qw_next(h)) < distance_at(r, h);
            h = qw_around(m, h);
        } while (is_highest && h != r->outgoing[v]);
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
        double a = distance_at(r, h), b = distance_at(r, qw_next(h));
        if ((a < at) == (b < at) || found == 2) continue;
        p[found++] = qw_lerp(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]],
                             (float)((at - a) / (b - a)));
    }
    return found == 2;
}

/* False where one meets no face. */
static bool find_middles(rod *r)
{
    const qw_trimesh *m = r->part;
    uint32_t all = r->across ? 2 * r->rings : r->rings; /* what looks over the cut may have rings beyond it */
    for (uint32_t f = 0; f < m->face_count; f++) {
        double low = INFINITY, high = 0;
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++)
            low = fmin(low, distance_at(r, h)), high = fmax(high, distance_at(r, h));
        uint32_t last = (uint32_t)qw_floor(high * r->rings) + 1;
        for (uint32_t i = (uint32_t)qw_floor(low * (r->rings - 1)); i <= last && i < all; i++) {
            qw_vec3 p[2];
            section *ring = &r->ring[i % r->rings];
            if (!cross(r, f, place_of(r, i), p)) continue;
            float w = qw_distance(p[0], p[1]);
            ring->around += (double)w;
            ring->middle = qw_madd(ring->middle, w, qw_lerp(p[0], p[1], 0.5f));
        }
    }
    for (uint32_t i = 0; i < r->rings; i++) {
        if (!(r->ring[i].around > 0)) return false;
        r->ring[i].middle = qw_scale(r->ring[i].middle, 1 / (float)r->ring[i].around);
    }
    return true;
}

/* Directions along the rod, and the first and the last ring at its ends. */
static void set_planes(rod *r)
{
    section *ring = r->ring;
    uint32_t n = r->rings;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t next = i + 1 < n ? i + 1 : r->across ? 0 : i, before = i > 0 ? i - 1 : r->across ? n - 1 : i;
        ring[i].along = qw_normalize(qw_sub(ring[next].middle, ring[before].middle));
    }
    for (int e = 0; e < 2 && !r->across; e++) {
        section *last = &ring[e ? n - 1 : 0];
        float beyond = qw_dot(qw_sub(r->part->position[r->end[e]], last->middle), last->along);
        last->middle = qw_madd(last->middle, e ? fmaxf(beyond, 0) : fminf(beyond, 0), last->along);
    }
}

/* Rings are not twisted against one another. Returns by how many quarters the first is turned against the last. */
static uint32_t place(const rod *r, const qw_bvh *tree, qw_vec3 *position)
{
    qw_vec3 out = r->across ? qw_any_orthogonal(r->ring[0].along)
                            : qw_sub(r->part->position[r->end[0]], r->ring[0].middle);
    qw_vec3 first[4] = {{0, 0, 0}};
    uint32_t turned = 0;
    for (uint32_t i = 0; i <= r->rings; i++) {
        const section *ring = &r->ring[i % r->rings];
        out = qw_reject(out, ring->along);
        if (qw_length2(out) == 0) out = qw_any_orthogonal(ring->along);
        out = qw_normalize(out);
        qw_vec3 side = qw_cross(ring->along, out);
        for (uint32_t k = 0; k < 4; k++) {
            qw_vec3 way = qw_scale(k % 2 ? side : out, k < 2 ? 1.0f : -1.0f);
            if (i == 0) first[k] = way;
            if (i == r->rings) turned = qw_dot(out, first[k]) > qw_dot(out, first[turned]) ? k : turned;
            if (i == r->rings) continue;
            float reach = (float)(ring->around / 4); /* to the corner of a square is less */
            qw_vec3 p = qw_madd(ring->middle, reach, way);
            position[4 * i + k] = qw_bvh_nearest(tree, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).point;
        }
    }
    return turned;
}

/* The quads of a rod between its rings, and of its ends; turned over where the part is inside out. */
static qw_quadmesh join_rings(const rod *r, const qw_bvh *tree)
{
    uint32_t n = r->rings, vertices = 4 * n, faces = r->across ? 4 * n : 4 * (n - 1) + 2;
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
    uint32_t turned = place(r, tree, q.position);
    for (uint32_t f = 0; f < faces; f++) {
        uint32_t i = f / 4 * 4, k = f % 4, next = (k + 1) % 4, last = 4 * (n - 1), by = i == last ? turned : 0;
        uint32_t j = (i + 4) % vertices;
        uint32_t side[4] = {i + k, i + next, j + (next + by) % 4, j + (k + by) % 4}, near[4] = {3, 2, 1, 0},
                 far[4] = {last, last + 1, last + 2, last + 3};
        const uint32_t *c = r->across || f + 2 < faces ? side : f + 1 < faces ? near : far;
        for (j = 0; j < 4; j++) q.corner[4 * f + j] = c[volume < 0 ? 3 - j : j];
    }
    qw_quadmesh_link(r->env, &q);
    return q;
}

qw_quadmesh qw_make_rod(qw_env *env, const qw_trimesh *part, const qw_bvh *tree, bool is_ring, double quads)
{
    rod r = {.env = env, .part = part, .distance = QW_NEW(env, double, part->vertex_count)};
    r.outgoing = qw_trimesh_outgoing(env, part);
    double unit = sqrt(qw_trimesh_area(part)) / QW_QUEUE_UNIT, length;
    r.rings = is_ring ? (uint32_t)fmax(qw_floor(quads / 4), 3) : 1 + (uint32_t)fmax(qw_floor((quads - 2) / 4), 1);
    if (is_ring) {
        length = cut_ring(&r, unit);
    } else {
        r.end[0] = measure_from(&r, 0, unit), r.end[1] = measure_from(&r, r.end[0], unit);
        length = r.distance[r.end[1]];
    }
    for (uint32_t v = 0; v < part->vertex_count; v++) r.distance[v] /= length;
    if (length == 0 || !is_rod(&r)) return (qw_quadmesh){0};
    r.ring = QW_NEW_ZERO(env, section, r.rings);
    if (!find_middles(&r)) return (qw_quadmesh){0};
    set_planes(&r);
    return join_rings(&r, tree);
}

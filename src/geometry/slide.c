#include "geometry/slide.h"

#include <assert.h>

/* Steps of a walk, and faces looked at around one vertex. Far beyond what a slide within a working edge takes; they
   bound the time on hubs of ten thousand slivers. */
enum { MAX_STEPS = 400, MAX_FAN = 96 };

/* Where on a triangle the nearest point lies: corner i, edge i (from corner i), or inside. */
typedef enum region { CORNER_0, CORNER_1, CORNER_2, EDGE_0, EDGE_1, EDGE_2, INSIDE } region;

/* By the Voronoi regions of the triangle (Ericson, Real-Time Collision Detection, 5.1.5). Whatever rounding does to a
   sliver, the answer is a point of it. */
static qw_vec3 nearest_in_triangle(qw_vec3 a, qw_vec3 b, qw_vec3 c, qw_vec3 p, region *where)
{
    qw_vec3 ab = qw_sub(b, a), ac = qw_sub(c, a), ap = qw_sub(p, a), bp = qw_sub(p, b), cp = qw_sub(p, c);
    float d1 = qw_dot(ab, ap), d2 = qw_dot(ac, ap), d3 = qw_dot(ab, bp), d4 = qw_dot(ac, bp), d5 = qw_dot(ab, cp),
          d6 = qw_dot(ac, cp);
    *where = CORNER_0;
    if (d1 <= 0 && d2 <= 0) return a;
    *where = CORNER_1;
    if (d3 >= 0 && d4 <= d3) return b;
    *where = CORNER_2;
    if (d6 >= 0 && d5 <= d6) return c;
    float va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    *where = EDGE_0;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return qw_madd(a, d1 > d3 ? d1 / (d1 - d3) : 0, ab);
    *where = EDGE_2;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return qw_madd(a, d2 > d6 ? d2 / (d2 - d6) : 0, ac);
    *where = EDGE_1;
    float e = d4 - d3, g = d5 - d6;
    if (va <= 0 && e >= 0 && g >= 0) return qw_madd(b, e + g > 0 ? e / (e + g) : 0, qw_sub(c, b));
    *where = INSIDE;
    float sum = va + vb + vc;
    if (!(sum > 0)) return a;
    return qw_madd(qw_madd(a, vb / sum, ab), vc / sum, ac);
}

float qw_triangle_distance2(qw_vec3 a, qw_vec3 b, qw_vec3 c, qw_vec3 p)
{
    region where;
    return qw_length2(qw_sub(p, nearest_in_triangle(a, b, c, p, &where)));
}

static qw_surface_point point_in_face(const qw_trimesh *mesh, uint32_t f, qw_vec3 p, region *where)
{
    const uint32_t *c = mesh->corner + 3 * (size_t)f;
    qw_vec3 q = nearest_in_triangle(mesh->position[c[0]], mesh->position[c[1]], mesh->position[c[2]], p, where);
    return (qw_surface_point){3 * f, qw_length2(qw_sub(p, q)), q};
}

/* By this share a step has to come nearer: the margin keeps rounding from sending a walk round in circles. */
static const float NEARER = 1e-5f;

/* The best face around a vertex, or `best` where none is better. */
static qw_surface_point best_around(const qw_trimesh *mesh, uint32_t start, qw_vec3 p, qw_surface_point best,
                                    region *where)
{
    assert(start < 3 * mesh->face_count);
    uint32_t h = start, left = MAX_FAN;
    do {
        region r;
        qw_surface_point there = point_in_face(mesh, h / 3, p, &r);
        if (there.distance2 < best.distance2) best = there, *where = r;
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != start && --left);
    return best;
}

qw_surface_point qw_slide_on_surface(const qw_trimesh *mesh, const uint32_t *outgoing, uint32_t from, qw_vec3 p,
                                     float enough2)
{
    assert(outgoing && mesh->twin && enough2 >= 0);
    region where;
    qw_surface_point here = point_in_face(mesh, from / 3, p, &where);
    for (uint32_t step = 0; step < MAX_STEPS && where != INSIDE && here.distance2 > enough2; step++) {
        qw_surface_point next = here;
        region there = INSIDE;
        uint32_t f = here.half_edge;
        if (where >= EDGE_0) {
            uint32_t t = mesh->twin[f + (where - EDGE_0)];
            if (t != QW_NONE) next = point_in_face(mesh, t / 3, p, &there);
        } else {
            next = best_around(mesh, outgoing[mesh->corner[f + where]], p, here, &there);
        }
        if (!(next.distance2 < here.distance2 * (1 - NEARER))) break;
        here = next;
        where = there;
    }
    return here;
}

static bool on_curve(const qw_trimesh *mesh, uint32_t h)
{
    return mesh->twin[h] == QW_NONE || (mesh->mark && mesh->mark[h]);
}

/* The other curve edge at a vertex v of half-edge h, as a half-edge of either direction; h where there is none. */
static uint32_t other_curve_edge(const qw_trimesh *mesh, const uint32_t *outgoing, uint32_t h, uint32_t v)
{
    assert(h < 3 * mesh->face_count && v < mesh->vertex_count);
    uint32_t start = outgoing[v], k = start, same = mesh->twin[h];
    do {
        uint32_t in = qw_prev(k); /* both edges of the face at v: the last of an open fan is seen as `in` only */
        if (on_curve(mesh, k) && k != h && k != same) return k;
        if (on_curve(mesh, in) && in != h && in != same) return in;
        k = mesh->twin[in];
    } while (k != QW_NONE && k != start);
    return h;
}

static qw_surface_point point_on_edge(const qw_trimesh *mesh, uint32_t h, qw_vec3 p, float *t)
{
    qw_vec3 a = mesh->position[mesh->corner[h]], d = qw_sub(mesh->position[mesh->corner[qw_next(h)]], a);
    float along = qw_dot(qw_sub(p, a), d), length2 = qw_length2(d);
    *t = along <= 0 || length2 <= 0 ? 0 : along >= length2 ? 1 : along / length2;
    qw_vec3 q = qw_madd(a, *t, d);
    return (qw_surface_point){h, qw_length2(qw_sub(p, q)), q};
}

qw_surface_point qw_slide_on_curve(const qw_trimesh *mesh, const uint32_t *outgoing, const uint8_t *stop, uint32_t from,
                                   qw_vec3 p)
{
    assert(outgoing && mesh->twin && stop);
    float t;
    qw_surface_point here = point_on_edge(mesh, from, p, &t);
    for (uint32_t step = 0; step < MAX_STEPS; step++) {
        if (t > 0 && t < 1) break;
        uint32_t h = here.half_edge, v = mesh->corner[t <= 0 ? h : qw_next(h)];
        if (stop[v]) break;
        qw_surface_point next = point_on_edge(mesh, other_curve_edge(mesh, outgoing, h, v), p, &t);
        if (!(next.distance2 < here.distance2 * (1 - NEARER))) break;
        here = next;
    }
    return here;
}

qw_surface_point qw_slide_from_corner(const qw_trimesh *mesh, const uint32_t *outgoing, const uint8_t *stop, uint32_t v,
                                      qw_vec3 p)
{
    assert(outgoing && mesh->twin && stop && v < mesh->vertex_count);
    qw_surface_point best = {outgoing[v], INFINITY, mesh->position[v]};
    uint32_t start = outgoing[v], h = start;
    do {
        uint32_t sides[2] = {h, qw_prev(h)};
        for (int i = 0; i < 2; i++) {
            if (!on_curve(mesh, sides[i])) continue;
            qw_surface_point there = qw_slide_on_curve(mesh, outgoing, stop, sides[i], p);
            if (there.distance2 < best.distance2) best = there;
        }
        h = qw_around(mesh, h);
    } while (h != QW_NONE && h != start);
    return best;
}

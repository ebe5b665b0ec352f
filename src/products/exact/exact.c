#include "products/exact/exact.h"

#include "base/mechanisms.h"
#include "base/constants.h"
#include "products/exact/ease.h"
#include "products/limit/fit_shape.h"
#include "geometry/go_back.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { STEPS = 12 };
/* In edges: how far from the curve that it is on a vertex may be, and how far one may go. */
static const float REACH = 0.5f, MOST = 0.25f;
/* In the frame: a place on two primitives is found where a step is shorter. */
static const double DONE = 1e-13;
/* Square of the sine of the angle between primitives below which they have no clear curve in common. Sine of the turn
   below which an edge of the surface is none on which quads have a curve. */
static const double TANGENT = 1e-3, BLUNT = 0.34;
/* By how much the least sine of a bad quad may fall. */
static const double WORSE = 0.05;

typedef struct holding {
    qw_env *env;
    qw_quadmesh *quads;
    const qw_exact *exact;
    qw_primitive *item; /* of the surface, then planes of its boundaries */
    uint32_t item_count;
    uint32_t *rim;               /* uint32_t[3 faces of the surface]: the plane of a boundary half-edge, or QW_NONE */
    const qw_curve_tree *curves; /* edges where quads have a curve */
    uint32_t (*pair)[2];         /* of each segment */
    uint32_t (*of)[2];           /* as of qw_held */
    float *edge;
    double *place;
    const qw_vec3 *normal; /* qw_vec3[vertices]: of the quads at first */
    uint8_t *on_curve;     /* uint8_t[vertices]: 1: on boundaries and marked edges */
    float most;            /* in edges: how far a vertex may be from what it is of */
    qw_vec3 *looked;       /* qw_vec3[vertices]: where the triangle was looked up whose primitive it is of */
} holding;

/* ---- boundaries */

/* The plane of `count` half-edges of the boundary from h on. */
static void add_rim(holding *w, uint32_t h, uint32_t count)
{
    assert(h < 3 * w->exact->surface->face_count);
    const qw_trimesh *s = w->exact->surface;
    if (count < 3) return;
    double *point = QW_NEW(w->env, double, 3 * ((size_t)count + 1));
    uint32_t k = 0, last = h;
    for (uint32_t at = h; k < count; at = qw_next_on_boundary(s, at)) {
        memcpy(point + 3 * (size_t)k++, w->exact->position + 3 * (size_t)s->corner[at], 3 * sizeof *point);
        last = at;
    }
    memcpy(point + 3 * (size_t)k, w->exact->position + 3 * (size_t)s->corner[qw_next(last)], 3 * sizeof *point);
    qw_primitive plane;
    if (qw_fit_primitive(&plane, QW_PLANE, point, count + 1, NULL) <= QW_OFF_PRIMITIVE) {
        for (uint32_t i = 0, at = h; i < count; i++, at = qw_next_on_boundary(s, at)) w->rim[at] = w->item_count;
        w->item[w->item_count++] = plane;
    }
    qw_free(w->env, point);
}

/* The runs of a loop of boundary edges, ring[count], each of one cylinder or cone. */
static void add_rims_of(holding *w, const uint32_t *ring, uint32_t count)
{
    const uint32_t *of = w->exact->found->of_face;
    uint32_t start = 0;
    while (start + 1 < count && of[ring[start] / 3] == of[ring[(start + count - 1) % count] / 3]) start++;
    for (uint32_t i = 0, length; i < count; i += length) {
        uint32_t first = ring[(start + i) % count], on = of[first / 3];
        for (length = 1; i + length < count && of[ring[(start + i + length) % count] / 3] == on;) length++;
        if (on != QW_NONE && w->item[on].kind != QW_PLANE) add_rim(w, first, length);
    }
}

/* Walks around each loop of the boundary once and adds the rims of primitives on it. */
static void find_rims(holding *w)
{
    const qw_trimesh *s = w->exact->surface;
    uint32_t sides = 3 * s->face_count, *ring = QW_NEW(w->env, uint32_t, sides);
    uint8_t *seen = QW_NEW_ZERO(w->env, uint8_t, sides);
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t count = 0;
        if (s->twin[h] != QW_NONE) continue;
        for (uint32_t at = h; !seen[at]; at = qw_next_on_boundary(s, at)) seen[at] = 1, ring[count++] = at;
        if (count > 0) add_rims_of(w, ring, count);
    }
    qw_free(w->env, seen), qw_free(w->env, ring);
}

/* ---- where vertices belong */

static bool is_curve(const holding *w, uint32_t h)
{
    assert(h < 3 * w->exact->surface->face_count);
    const qw_trimesh *s = w->exact->surface;
    uint32_t twin = s->twin[h], own = w->exact->found->of_face[h / 3];
    if (twin == QW_NONE) return own != QW_NONE;
    uint32_t other = w->exact->found->of_face[twin / 3];
    if (twin < h || own == other) return false;
    qw_vec3 a = qw_normalize(qw_face_cross(s, h / 3)), b = qw_normalize(qw_face_cross(s, twin / 3));
    return (double)qw_length(qw_cross(a, b)) > BLUNT || qw_dot(a, b) < 0;
}

/* The edges of the surface that are curves, with what lies on both sides; NULL where none is. */
static const qw_curve_tree *list_curves(const holding *w, uint32_t (**pair)[2])
{
    const qw_trimesh *s = w->exact->surface;
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) count += is_curve(w, h);
    if (count == 0) return NULL;
    qw_vec3 *from = QW_NEW(w->env, qw_vec3, count), *to = QW_NEW(w->env, qw_vec3, count);
    *pair = qw_alloc(w->env, count, sizeof **pair);
    count = 0;
    for (uint32_t h = 0; h < 3 * s->face_count; h++) {
        if (!is_curve(w, h)) continue;
        uint32_t twin = s->twin[h];
        from[count] = s->position[s->corner[h]], to[count] = s->position[s->corner[qw_next(h)]];
        (*pair)[count][0] = w->exact->found->of_face[h / 3];
        (*pair)[count++][1] = twin == QW_NONE ? w->rim[h] : w->exact->found->of_face[twin / 3];
    }
    return qw_curve_tree_build(w->env, from, to, count);
}

/* uint8_t[vertices]: 1 on boundaries and marked edges. */
static uint8_t *mark_curves(const holding *w)
{
    const qw_quadmesh *q = w->quads;
    uint8_t *on = QW_NEW_ZERO(w->env, uint8_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++)
        if (q->twin[h] == QW_NONE || (q->mark && q->mark[h])) on[q->corner[h]] = on[q->corner[qw_quad_next(h)]] = 1;
    return on;
}

static void order_pair(uint32_t pair[2])
{
    if (pair[0] == QW_NONE) pair[0] = pair[1], pair[1] = QW_NONE;
}

static bool is_round(const holding *w, uint32_t item) { return item != QW_NONE && w->item[item].kind != QW_PLANE; }

/* Corners that are none: where a coarse circle bends from one edge of the surface to the next, both of which lie
   between the same two primitives, one of them round. quads->kind becomes a copy in which they are vertices of the
   curve. */
static void forget_bends(holding *w)
{
    qw_quadmesh *q = w->quads;
    if (!q->kind || !w->curves || w->exact->surface->point) return; /* points that are marked stay corners */
    uint32_t n = q->vertex_count, (*pair)[2] = qw_alloc(w->env, n, sizeof *pair);
    uint8_t *edges = QW_NEW_ZERO(w->env, uint8_t, n), *differs = QW_NEW_ZERO(w->env, uint8_t, n);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t twin = q->twin[h], end[2] = {q->corner[h], q->corner[qw_quad_next(h)]};
        if (twin != QW_NONE && (twin < h || !q->mark || !q->mark[h])) continue;
        if (q->kind[end[0]] != QW_VERTEX_CORNER && q->kind[end[1]] != QW_VERTEX_CORNER) continue;
        qw_vec3 middle = qw_lerp(q->position[end[0]], q->position[end[1]], 0.5f);
        uint32_t segment = qw_curve_nearest(w->curves, middle, REACH * w->edge[end[0]]).segment;
        for (int k = 0; k < 2; k++) {
            uint32_t *own = pair[end[k]], *of = segment == QW_NONE ? NULL : w->pair[segment];
            if (edges[end[k]] == 0 && of) memcpy(own, of, sizeof *pair);
            differs[end[k]] |= !of || ((own[0] != of[0] || own[1] != of[1]) && (own[0] != of[1] || own[1] != of[0]));
            if (edges[end[k]] < 3) edges[end[k]]++;
        }
    }
    uint8_t *kind = memcpy(QW_NEW(w->env, uint8_t, n), q->kind, n);
    for (uint32_t v = 0; v < n; v++)
        if (kind[v] == QW_VERTEX_CORNER && edges[v] == 2 && !differs[v] &&
            (is_round(w, pair[v][0]) || is_round(w, pair[v][1])))
            kind[v] = QW_VERTEX_CURVE;
    q->kind = kind;
}

/* The triangle nearest to `at`, for vertex v. */
static qw_hit nearest_face(const holding *w, uint32_t v, qw_vec3 at, uint32_t *hint)
{
    const qw_quadmesh *q = w->quads;
    uint32_t part = q->component ? q->component[v] : QW_NONE;
    qw_hit hit = qw_bvh_nearest_of(w->exact->tree, part, at, w->normal[v], QW_SAME_SHEET, REACH * w->edge[v], *hint);
    if (hit.face != QW_NONE) *hint = hit.face;
    return hit;
}

/* A corner is a vertex of the surface: there exactly. */
static void place_corner(const holding *w, uint32_t v, uint32_t face)
{
    assert(v < w->quads->vertex_count);
    for (uint32_t i = 0; face != QW_NONE && i < 3; i++) {
        const double *p = w->exact->position + 3 * (size_t)w->exact->surface->corner[3 * (size_t)face + i];
        double far = 0, *place = w->place + 3 * (size_t)v;
        for (int k = 0; k < 3; k++) far = fmax(far, fabs(p[k] - place[k]));
        if (far < QW_SAME_VERTEX) memcpy(place, p, 3 * sizeof *place);
    }
}

/* Finds for each vertex the primitives that it is to lie on: one, two on a curve, none where it stays. */
static void find_places(holding *w)
{
    const qw_quadmesh *q = w->quads;
    uint32_t hint = QW_NONE;
    w->on_curve = mark_curves(w), w->normal = qw_quadmesh_vertex_normals(w->env, q);
    w->looked = QW_NEW(w->env, qw_vec3, q->vertex_count);
    memcpy(w->looked, q->position, q->vertex_count * sizeof *w->looked);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        w->of[v][0] = w->of[v][1] = QW_NONE;
        if (w->exact->stays && w->exact->stays[v]) continue;
        if (q->kind && q->kind[v] == QW_VERTEX_CORNER) {
            qw_hit hit = qw_bvh_nearest(w->exact->tree, q->position[v], qw_v3(0, 0, 0), -1, (float)QW_SAME_VERTEX,
                                        hint);
            place_corner(w, v, hit.face);
        } else if (w->on_curve[v]) {
            if (!w->curves) continue;
            qw_curve_hit hit = qw_curve_nearest(w->curves, q->position[v], REACH * w->edge[v]);
            if (hit.segment == QW_NONE) continue;
            memcpy(w->of[v], w->pair[hit.segment], sizeof w->of[v]);
            order_pair(w->of[v]);
        } else {
            qw_hit hit = nearest_face(w, v, q->position[v], &hint);
            if (hit.face != QW_NONE) w->of[v][0] = w->exact->found->of_face[hit.face];
        }
        qw_heartbeat(w->env);
    }
}

/* Where only planes count: vertices stay free whose neighbours are on anything else. */
static void keep_to_planes(holding *w)
{
    const qw_quadmesh *q = w->quads;
    uint8_t *mixed = QW_NEW_ZERO(w->env, uint8_t, q->vertex_count);
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * (size_t)f;
        for (int i = 0; i < 4; i++)
            for (int j = 0; j < 4; j++) {
                uint32_t own = w->of[c[i]][0], other = w->of[c[j]][0], second = w->of[c[j]][1];
                bool is_fixed = q->kind && q->kind[c[j]] == QW_VERTEX_CORNER;
                if (!is_fixed && own != other && own != second) mixed[c[i]] = 1;
            }
    }
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        bool is_free = w->of[v][1] == QW_NONE; /* a crease lies in the planes of its vertices */
        if (is_free && mixed[v]) w->of[v][0] = QW_NONE;
        for (int k = 0; k < 2; k++)
            if (w->of[v][k] != QW_NONE && w->item[w->of[v][k]].kind != QW_PLANE) w->of[v][k] = QW_NONE;
        order_pair(w->of[v]);
    }
}

/* ---- onto them */

/* The nearest point of what both primitives have in common, by Newton's steps; of the first alone where they touch. */
static void project(const holding *w, uint32_t v, double p[3])
{
    const uint32_t *of = w->of[v];
    for (int step = 0; step < STEPS; step++) {
        double g[2][3], d[2] = {0}, share[2] = {0};
        for (int k = 0; k < 2 && of[k] != QW_NONE; k++) d[k] = qw_primitive_distance(&w->item[of[k]], p, g[k]);
        if (fabs(d[0]) + fabs(d[1]) < DONE) return;
        share[0] = d[0];
        if (of[1] != QW_NONE) {
            double c = qw_dot_doubles(g[0], g[1]), s = 1 - c * c;
            if (s > TANGENT) share[0] = (d[0] - c * d[1]) / s, share[1] = (d[1] - c * d[0]) / s;
            for (int k = 0; k < 3; k++) p[k] -= share[1] * g[1][k];
        }
        for (int k = 0; k < 3; k++) p[k] -= share[0] * g[0][k];
    }
}

/* A vertex that went on may have left its primitive: it belongs to what is nearest now. */
static void look_again(const holding *w, uint32_t v, uint32_t *hint)
{
    assert(v < w->quads->vertex_count);
    double *p = w->place + 3 * (size_t)v;
    qw_vec3 at = qw_v3_of_doubles(p);
    bool is_free = w->of[v][0] != QW_NONE && w->of[v][1] == QW_NONE && !w->on_curve[v];
    if (!is_free || memcmp(&at, &w->looked[v], sizeof at) == 0) return;
    w->looked[v] = at;
    qw_hit hit = nearest_face(w, v, at, hint);
    if (hit.face == QW_NONE) return;
    w->of[v][0] = w->exact->found->of_face[hit.face];
    if (w->of[v][0] == QW_NONE) p[0] = (double)hit.point.x, p[1] = (double)hit.point.y, p[2] = (double)hit.point.z;
}

static void put_one(void *user, uint32_t v, double p[3]) { project(user, v, p); }

/* Puts all vertices on what they are held by, if that is near enough; else they are let go. */
static void project_all(void *user)
{
    const holding *w = user;
    uint32_t hint = QW_NONE;
    for (uint32_t v = 0; v < w->quads->vertex_count; v++) look_again(w, v, &hint);
    for (uint32_t v = 0; v < w->quads->vertex_count; v++) {
        double p[3], *place = w->place + 3 * (size_t)v, far = 0;
        if (w->of[v][0] == QW_NONE) continue;
        memcpy(p, place, sizeof p);
        project(w, v, p);
        for (int k = 0; k < 3; k++) far = fmax(far, fabs(p[k] - place[k]));
        if (far <= (double)(w->most * w->edge[v])) memcpy(place, p, sizeof p);
        else w->of[v][0] = w->of[v][1] = QW_NONE;
    }
}

/* The quads' positions from the places, but where corners would turn over: places from these there. */
static uint32_t settle(holding *w)
{
    qw_quadmesh *q = w->quads;
    uint32_t n = q->vertex_count, count = 0;
    const qw_vec3 *before = q->position;
    qw_vec3 *wanted = QW_NEW(w->env, qw_vec3, n), *now = QW_NEW(w->env, qw_vec3, n);
    for (uint32_t v = 0; v < n; v++) {
        const double *p = w->place + 3 * (size_t)v;
        now[v] = wanted[v] = qw_v3_of_doubles(p);
    }
    q->position = now;
    qw_hold_back_flips(w->env, q, before);
    for (uint32_t v = 0; v < n; v++) {
        double *p = w->place + 3 * (size_t)v;
        bool is_held = memcmp(&now[v], &wanted[v], sizeof *now) != 0;
        if (is_held) p[0] = (double)now[v].x, p[1] = (double)now[v].y, p[2] = (double)now[v].z;
        else count += w->of[v][0] != QW_NONE;
    }
    return count;
}

/* No quad is made bad for what a vertex lies on. */
static void take_back(holding *w, const double *first)
{
    uint8_t *back = QW_NEW(w->env, uint8_t, w->quads->vertex_count);
    qw_undo_bad(w->env, w->quads, w->place, first, WORSE, back);
    for (uint32_t v = 0; v < w->quads->vertex_count; v++)
        if (back[v]) w->of[v][0] = w->of[v][1] = QW_NONE;
}

static bool has_rounds(const qw_primitives *found)
{
    for (uint32_t i = 0; i < found->count; i++)
        if (found->item[i].kind != QW_PLANE) return true;
    return false;
}

uint32_t qw_put_on_primitives(qw_env *env, qw_quadmesh *quads, double *place, const qw_exact *exact)
{
    assert(quads->twin && quads->position && exact->found->of_face);
    uint32_t n = quads->vertex_count, sides = 3 * exact->surface->face_count;
    qw_vec3 *position = QW_NEW(env, qw_vec3, n);
    qw_scope_begin(env);
    holding w = {
        .env = env, .quads = quads, .exact = exact, .place = place, .most = MOST, .item_count = exact->found->count};
    w.item = QW_NEW(env, qw_primitive, exact->found->count + sides);
    memcpy(w.item, exact->found->item, exact->found->count * sizeof *w.item);
    w.rim = QW_NEW(env, uint32_t, sides);
    memset(w.rim, 0xff, sides * sizeof *w.rim);
    w.edge = qw_edges_around(env, quads);
    w.of = qw_alloc(env, n, sizeof *w.of);
    find_rims(&w);
    w.curves = list_curves(&w, &w.pair);
    uint8_t *kind = quads->kind;
    forget_bends(&w);
    find_places(&w);
    if (exact->planes_only) keep_to_planes(&w);
    double *first = QW_NEW(env, double, 3 * (size_t)n);
    memcpy(first, place, 3 * (size_t)n * sizeof *first);
    project_all(&w);
    double *put = QW_NEW(env, double, 3 * (size_t)n);
    memcpy(put, place, 3 * (size_t)n * sizeof *put);
    if (exact->evens && has_rounds(exact->found) && qw_uses(env, QW_MECH_EVEN_ROWS)) {
        qw_did(env, QW_MECH_EVEN_ROWS, 1);
        w.most = 1; /* what goes along with circles is off as far as these turn */
        qw_even_circles(env, quads, &(qw_held){w.item, w.of, w.edge, w.place, project_all, put_one, &w});
        project_all(&w);
    }
    qw_undo_bad(env, quads, place, put, WORSE, NULL);
    take_back(&w, first);
    uint32_t count = settle(&w);
    memcpy(position, quads->position, n * sizeof *position);
    qw_scope_end(env);
    quads->position = position, quads->kind = kind;
    return count;
}

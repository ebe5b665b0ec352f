#include "remesh/quads/minimal.h"

#include "base/axes.h"
#include "geometry/flips.h"
#include "geometry/parts.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A component whose area is below that of so many quads of the wanted size gets as few quads as its topology allows.
   OPEN: with a boundary; CLOSED: without. */
static const double SHARE_OPEN = 1.5, SHARE_CLOSED = 6;
/* Least area of a quad, as a share of the surface that it replaces. None of its corners may be inverted either. */
static const float LEAST_AREA = 0.02f;
/* A ray from the middle of a component's bounding box to a corner of the box that meets no triangle ends at this
   share of its length. */
static const float INSIDE = 0.6f;
enum { LISTEN = 1024 };

/* One connected component of the surface. */
typedef struct piece {
    const qw_trimesh *mesh;
    const uint32_t *face; /* uint32_t[count] */
    uint32_t number, count, vertices, boundary;
    double area;
    qw_vec3 cross; /* sum of the cross products of its faces */
} piece;

typedef struct making {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_census *census;
    qw_parts parts;
    uint32_t *vertices; /* uint32_t[components]: of each */
    float mean_edge;    /* of all quads of the result, about */
    qw_vec3 *loop;      /* the boundary of one component */
    size_t loop_room;
    qw_quadmesh quads;
    size_t vertex_room, kind_room, component_room, corner_room, twin_room, mark_room;
} making;

/* ---- pieces */

static void count_vertices(making *m)
{
    uint8_t *seen = QW_NEW_ZERO(m->env, uint8_t, m->mesh->vertex_count);
    m->vertices = QW_NEW_ZERO(m->env, uint32_t, (size_t)m->census->components);
    for (uint32_t h = 0; h < 3 * m->mesh->face_count; h++) {
        uint32_t v = m->mesh->corner[h];
        if (!seen[v]) seen[v] = 1, m->vertices[m->census->component[h / 3]]++;
    }
    qw_free(m->env, seen);
}

static piece piece_of(const making *m, uint32_t c)
{
    assert(c < m->census->components);
    piece p = {.mesh = m->mesh,
               .face = m->parts.face + m->parts.begin[c],
               .number = c,
               .count = m->parts.begin[c + 1] - m->parts.begin[c],
               .vertices = m->vertices[c]};
    for (uint32_t i = 0; i < p.count; i++) {
        qw_vec3 cross = qw_face_cross(m->mesh, p.face[i]);
        p.area += 0.5 * qw_length(cross);
        p.cross = qw_add(p.cross, cross);
        for (uint32_t h = 3 * p.face[i]; h < 3 * p.face[i] + 3; h++) p.boundary += m->mesh->twin[h] == QW_NONE;
    }
    return p;
}

/* Vertices less edges plus faces. */
static int64_t euler_of(const piece *p)
{
    return (int64_t)p->vertices + p->count - ((int64_t)3 * p->count + p->boundary) / 2;
}

/* ---- quads of their own vertices */

static void add_vertices(making *m, uint32_t component, uint32_t count, const qw_vec3 *position)
{
    qw_quadmesh *q = &m->quads;
    size_t n = (size_t)q->vertex_count + count;
    q->position = qw_grow(m->env, q->position, &m->vertex_room, n, sizeof *q->position);
    q->kind = qw_grow(m->env, q->kind, &m->kind_room, n, sizeof *q->kind);
    q->component = qw_grow(m->env, q->component, &m->component_room, n, sizeof *q->component);
    for (uint32_t i = 0; i < count; i++, q->vertex_count++) {
        q->position[q->vertex_count] = position[i];
        q->kind[q->vertex_count] = QW_VERTEX_FREE;
        q->component[q->vertex_count] = component;
    }
}

static void add_faces(making *m, uint32_t count, const uint32_t (*corner)[4], const uint32_t *twin, uint32_t vertex)
{
    assert(vertex <= m->quads.vertex_count && corner);
    qw_quadmesh *q = &m->quads;
    size_t n = 4 * ((size_t)q->face_count + count), at = 4 * (size_t)q->face_count;
    q->corner = qw_grow(m->env, q->corner, &m->corner_room, n, sizeof *q->corner);
    q->twin = qw_grow(m->env, q->twin, &m->twin_room, n, sizeof *q->twin);
    q->mark = qw_grow(m->env, q->mark, &m->mark_room, n, sizeof *q->mark);
    for (uint32_t h = 0; h < 4 * count; h++) {
        q->corner[at + h] = vertex + corner[h / 4][h % 4];
        q->twin[at + h] = twin ? (uint32_t)at + twin[h] : QW_NONE;
        q->mark[at + h] = 0;
    }
    q->face_count += count;
}

/* ---- whether they are flipped */

/* Whether any triangle of the piece faces against a half of the quad: else nothing can be flipped, and no tree is
   needed. */
static bool has_opposite(const piece *p, const qw_vec3 *position, const uint32_t *corner)
{
    const uint32_t halves[6] = {corner[0], corner[1], corner[2], corner[0], corner[2], corner[3]};
    qw_vec3 one = qw_triangle_cross(position, halves), two = qw_triangle_cross(position, halves + 3);
    for (uint32_t i = 0; i < p->count; i++) {
        qw_vec3 cross = qw_face_cross(p->mesh, p->face[i]);
        if (qw_dot(cross, one) < 0 || qw_dot(cross, two) < 0) return true;
    }
    return false;
}

/* corner: into position. */
static bool is_any_flipped(making *m, const piece *p, const qw_vec3 *position, uint32_t count,
                           const uint32_t (*corner)[4])
{
    assert(count > 0 && m->mean_edge > 0);
    bool any = false;
    if (count == 1 && !has_opposite(p, position, corner[0])) return false;
    qw_scope_begin(m->env);
    qw_trimesh part = qw_take_part(m->env, &m->parts, p->number);
    qw_flip_judge judge = {.surface = &part, .tree = qw_bvh_build(m->env, &part), .edge = m->mean_edge};
    for (uint32_t f = 0; f < count && !any; f++) any = qw_flip_of_quad(&judge, position, corner[f]) != QW_NOT_FLIPPED;
    qw_scope_end(m->env);
    return any;
}

/* ---- discs */

/* The boundary in order, the surface on its left; false where it is more than one loop. */
static bool walk_boundary(making *m, const piece *p)
{
    assert(p->boundary > 0);
    uint32_t first = QW_NONE, n = 0;
    for (uint32_t i = 0; i < 3 * p->count && first == QW_NONE; i++)
        if (p->mesh->twin[3 * p->face[i / 3] + i % 3] == QW_NONE) first = 3 * p->face[i / 3] + i % 3;
    m->loop = qw_grow(m->env, m->loop, &m->loop_room, p->boundary, sizeof *m->loop);
    uint32_t h = first;
    do {
        if (n == p->boundary) return false;
        m->loop[n++] = p->mesh->position[p->mesh->corner[h]];
        h = qw_next(h);
        while (p->mesh->twin[h] != QW_NONE) h = qw_next(p->mesh->twin[h]);
    } while (h != first);
    return n == p->boundary;
}

static uint32_t furthest(const qw_vec3 *loop, uint32_t n, qw_vec3 from)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < n; i++)
        if (qw_length2(qw_sub(loop[i], from)) > qw_length2(qw_sub(loop[best], from))) best = i;
    return best;
}

/* The vertex of the loop after a and before b that is farthest from the line between these two; the middle of the
   edge from a to b where they are neighbours. */
static qw_vec3 bulge(const qw_vec3 *loop, uint32_t n, uint32_t a, uint32_t b)
{
    assert(a < n && b < n && a != b);
    qw_vec3 along = qw_normalize(qw_sub(loop[b], loop[a])), best = qw_lerp(loop[a], loop[b], 0.5f);
    float most = -1;
    for (uint32_t i = (a + 1) % n; i != b; i = (i + 1) % n) {
        float d2 = qw_length2(qw_reject(qw_sub(loop[i], loop[a]), along));
        if (d2 > most) most = d2, best = loop[i];
    }
    return best;
}

/* For rounding errors: a half of a disc's quad may face away by this share of the disc's area, and a ray may pass a
   triangle's side by so much, in barycentric coordinates. */
static const float TURNED_OVER = 1e-3f, RAY_OUTSIDE = 1e-4f;

/* Whether no half of the quad, whichever diagonal cuts it, faces away from n; halves without area are allowed. */
static bool faces_along(const qw_vec3 *q, qw_vec3 n, double area)
{
    float least = INFINITY;
    for (int i = 0; i < 4; i++) {
        qw_vec3 a = qw_sub(q[(i + 1) % 4], q[i]), b = qw_sub(q[(i + 3) % 4], q[i]);
        least = fminf(least, qw_dot(qw_cross(a, b), n));
    }
    qw_vec3 whole = qw_quad_cross(q, (const uint32_t[]){0, 1, 2, 3});
    return least >= -TURNED_OVER * (float)area && 0.5f * qw_dot(whole, n) > LEAST_AREA * (float)area;
}

static bool make_disc(making *m, const piece *p, uint32_t component)
{
    static const uint32_t corner[1][4] = {{0, 1, 2, 3}};
    if (!walk_boundary(m, p)) return false;
    uint32_t n = p->boundary, a = furthest(m->loop, n, m->loop[0]), b = furthest(m->loop, n, m->loop[a]);
    if (a == b) return false;
    qw_vec3 q[4] = {m->loop[a], bulge(m->loop, n, a, b), m->loop[b], bulge(m->loop, n, b, a)};
    if (!faces_along(q, qw_normalize(p->cross), p->area) || is_any_flipped(m, p, q, 1, corner)) return false;
    uint32_t vertex = m->quads.vertex_count;
    add_vertices(m, component, 4, q);
    add_faces(m, 1, corner, NULL, vertex);
    return true;
}

/* ---- spheres */

/* The corners of a box by the bits of their numbers: x, y, z; its sides outward. */
static const uint32_t BOX[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

/* The twin of each side of BOX turned the given way: uint32_t[24]. */
static void link_box(const uint32_t (*box)[4], uint32_t *twin)
{
    for (uint32_t h = 0; h < 24; h++)
        for (uint32_t g = 0; g < 24; g++)
            if (box[h / 4][h % 4] == box[g / 4][(g + 1) % 4] && box[g / 4][g % 4] == box[h / 4][(h + 1) % 4])
                twin[h] = g;
}

/* How far along d from `from` the furthest triangle is, in lengths of d; -1 where there is none. */
static float reach_of(const piece *p, qw_vec3 from, qw_vec3 d)
{
    float most = -1;
    for (uint32_t i = 0; i < p->count; i++) {
        const uint32_t *c = p->mesh->corner + 3 * (size_t)p->face[i];
        qw_vec3 a = qw_sub(p->mesh->position[c[0]], from), u = qw_sub(p->mesh->position[c[1]], p->mesh->position[c[0]]),
                v = qw_sub(p->mesh->position[c[2]], p->mesh->position[c[0]]), w = qw_cross(d, v);
        float det = qw_dot(u, w);
        if (fabsf(det) < 1e-30f) continue;
        qw_vec3 s = qw_scale(a, -1), r = qw_cross(s, u);
        float x = qw_dot(s, w) / det, y = qw_dot(d, r) / det, t = qw_dot(v, r) / det;
        if (x >= -RAY_OUTSIDE && y >= -RAY_OUTSIDE && x + y <= 1 + RAY_OUTSIDE) most = fmaxf(most, t);
    }
    return most;
}

static float lesser(float a, float b) { return b < a ? b : a; }
static float greater(float a, float b) { return b > a ? b : a; }

typedef struct axes {
    qw_vec3 axis[3]; /* orthonormal, right-handed */
} axes;

/* Sets the points where the lines from the middle of the box along these axes around the piece to its corners leave
   the surface. */
static void find_corners(const piece *p, const axes *a, qw_vec3 *corner)
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t i = 0; i < 3 * p->count; i++) {
        qw_vec3 q = p->mesh->position[p->mesh->corner[3 * p->face[i / 3] + i % 3]];
        for (int k = 0; k < 3; k++) {
            float x = qw_dot(q, a->axis[k]);
            low[k] = lesser(low[k], x), high[k] = greater(high[k], x);
        }
    }
    qw_vec3 middle = {0, 0, 0};
    for (int k = 0; k < 3; k++) middle = qw_madd(middle, low[k] + 0.5f * (high[k] - low[k]), a->axis[k]);
    for (uint32_t i = 0; i < 8; i++) {
        qw_vec3 d = {0, 0, 0};
        for (int k = 0; k < 3; k++) d = qw_madd(d, (i >> k & 1 ? 0.5f : -0.5f) * (high[k] - low[k]), a->axis[k]);
        float t = reach_of(p, middle, d);
        corner[i] = qw_madd(middle, t > 0 ? t : INSIDE, d);
    }
}

static double volume_of(const piece *p)
{
    assert(p->count > 0);
    qw_vec3 from = p->mesh->position[p->mesh->corner[3 * (size_t)p->face[0]]];
    double sum = 0;
    for (uint32_t i = 0; i < p->count; i++) {
        qw_vec3 a = qw_sub(p->mesh->position[p->mesh->corner[3 * (size_t)p->face[i]]], from);
        sum += (double)qw_dot(a, qw_face_cross(p->mesh, p->face[i]));
    }
    return sum;
}

/* Axes along which a piece is spread out most and least, about its centre. */
static axes principal_axes(const piece *p)
{
    double area = 0, m[3][3] = {{0}}, axis[3][3];
    qw_vec3 middle = {0, 0, 0};
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t i = 0; i < p->count; i++) {
            const uint32_t *c = p->mesh->corner + 3 * (size_t)p->face[i];
            const qw_vec3 *x = p->mesh->position;
            qw_vec3 q = qw_scale(qw_add(qw_add(x[c[0]], x[c[1]]), x[c[2]]), 1.0f / 3);
            float w = qw_length(qw_face_cross(p->mesh, p->face[i]));
            if (pass == 0) area += (double)w, middle = qw_madd(middle, w, q);
            if (pass == 0) continue;
            qw_vec3 d = qw_madd(q, -1 / (float)area, middle);
            double at[3] = {(double)d.x, (double)d.y, (double)d.z};
            for (int k = 0; k < 9; k++) m[k / 3][k % 3] += (double)w * at[k / 3] * at[k % 3];
        }
    qw_principal_axes(m, axis);
    axes a;
    for (int k = 0; k < 2; k++) a.axis[k] = qw_v3((float)axis[k][0], (float)axis[k][1], (float)axis[k][2]);
    a.axis[2] = qw_cross(a.axis[0], a.axis[1]);
    return a;
}

/* The axes turned by an eighth about one of them. */
static axes turned_about(axes a, int k)
{
    qw_vec3 u = a.axis[(k + 1) % 3], v = a.axis[(k + 2) % 3];
    a.axis[(k + 1) % 3] = qw_scale(qw_add(u, v), 0.70710678f);
    a.axis[(k + 2) % 3] = qw_scale(qw_sub(v, u), 0.70710678f);
    return a;
}

/* Along the coordinates first, then along the piece's own axes, then across these. */
enum { AXES = 5 };
static axes choose_axes(const piece *p, int number)
{
    if (number == 0) return (axes){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    axes a = principal_axes(p);
    return number == 1 ? a : turned_about(a, number - 2);
}

/* Whether the eight corners make a box that is neither turned over nor flipped against the piece. */
static bool is_sound_box(making *m, const piece *p, const qw_vec3 *corner, const uint32_t (*box)[4])
{
    qw_vec3 middle = {0, 0, 0};
    for (int i = 0; i < 8; i++) middle = qw_madd(middle, 0.125f, corner[i]);
    for (int f = 0; f < 6; f++) {
        qw_vec3 q[4], n = {0, 0, 0};
        for (int i = 0; i < 4; i++) q[i] = corner[BOX[f][i]], n = qw_add(n, qw_sub(q[i], middle));
        if (!faces_along(q, qw_normalize(n), p->area / 6)) return false;
    }
    return !is_any_flipped(m, p, corner, 6, box);
}

static bool make_sphere(making *m, const piece *p, uint32_t component)
{
    qw_vec3 corner[8];
    uint32_t box[6][4], twin[24], vertex = m->quads.vertex_count;
    bool inward = volume_of(p) < 0, is_sound = false;
    for (int i = 0; i < 24; i++) box[i / 4][i % 4] = BOX[i / 4][inward ? 3 - i % 4 : i % 4];
    for (int k = 0; k < AXES && !is_sound; k++) {
        axes a = choose_axes(p, k);
        find_corners(p, &a, corner);
        is_sound = is_sound_box(m, p, corner, box);
    }
    if (!is_sound) return false;
    link_box(box, twin);
    add_vertices(m, component, 8, corner);
    add_faces(m, 6, box, twin, vertex);
    return true;
}

/* ---- all */

static bool make_piece(making *m, const piece *p, uint32_t component, double edge)
{
    double share = p->area / (edge * edge);
    if (p->boundary > 0) return share < SHARE_OPEN && euler_of(p) == 1 && make_disc(m, p, component);
    return share < SHARE_CLOSED && euler_of(p) == 2 && make_sphere(m, p, component);
}

/* The mean edge if all components were so small, or had quads of length `edge`. Sets the one of the largest area. */
static double find_mean_edge(const making *m, double edge, uint32_t *largest)
{
    double most = -1, sum = 0, quads = 0;
    for (uint32_t c = 0; c < m->census->components; c++) {
        piece p = piece_of(m, c);
        double least = p.boundary > 0 ? QW_MINIMAL_OPEN : QW_MINIMAL_CLOSED,
               count = fmax(p.area / (edge * edge), least);
        if (p.area > most) most = p.area, *largest = c;
        sum += sqrt(p.area * count), quads += count;
    }
    return sum / quads;
}

static void make_all(making *m, double edge, qw_minimal *minimal)
{
    uint32_t n = (uint32_t)m->census->components, largest = 0;
    m->mean_edge = (float)find_mean_edge(m, edge, &largest);
    for (uint32_t c = 0; c < n; c++) {
        if (c % LISTEN == 0) qw_break_silence(m->env);
        piece p = piece_of(m, c);
        minimal->made[c] = c != largest && make_piece(m, &p, c, edge);
        minimal->count += minimal->made[c];
    }
}

qw_minimal qw_make_minimal(qw_env *env, const qw_trimesh *mesh, const qw_census *census, double edge, uint32_t least)
{
    assert(edge > 0 && least > 0);
    qw_minimal minimal = {.made = QW_NEW_ZERO(env, uint8_t, (size_t)census->components)};
    if (census->components <= least) return minimal;
    qw_scope_begin(env);
    making m = {.env = env, .mesh = mesh, .census = census};
    m.parts = qw_sort_parts(env, mesh, census->component, (uint32_t)census->components);
    count_vertices(&m);
    make_all(&m, edge, &minimal);
    if (minimal.count >= least) {
        const qw_quadmesh *q = &m.quads;
        qw_keep(env, q->position), qw_keep(env, q->kind), qw_keep(env, q->component);
        qw_keep(env, q->corner), qw_keep(env, q->twin), qw_keep(env, q->mark);
        minimal.quads = *q;
    } else {
        memset(minimal.made, 0, (size_t)census->components);
        minimal.count = 0;
    }
    qw_scope_end(env);
    return minimal;
}

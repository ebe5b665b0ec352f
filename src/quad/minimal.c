#include "quad/minimal.h"

#include <assert.h>
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
    uint32_t count, vertices, boundary;
    double area;
    qw_vec3 cross; /* sum of the cross products of its faces */
} piece;

typedef struct making {
    qw_env *env;
    const qw_trimesh *mesh;
    const qw_census *census;
    uint32_t *face, *begin; /* faces by component: uint32_t[face_count], uint32_t[components + 1] */
    uint32_t *vertices;     /* uint32_t[components]: of each */
    qw_vec3 *loop;          /* the boundary of one component */
    size_t loop_room;
    qw_quadmesh quads;
    size_t vertex_room, kind_room, component_room, corner_room, twin_room, mark_room;
} making;

/* ---- pieces */

static void sort_faces(making *m)
{
    uint32_t n = (uint32_t)m->census->components;
    const uint32_t *of = m->census->component;
    m->face = QW_NEW(m->env, uint32_t, m->mesh->face_count), m->begin = QW_NEW_ZERO(m->env, uint32_t, (size_t)n + 1);
    for (uint32_t f = 0; f < m->mesh->face_count; f++) m->begin[of[f] + 1]++;
    for (uint32_t c = 0; c < n; c++) m->begin[c + 1] += m->begin[c];
    for (uint32_t f = 0; f < m->mesh->face_count; f++) m->face[m->begin[of[f]]++] = f;
    for (uint32_t c = n; c > 0; c--) m->begin[c] = m->begin[c - 1];
    m->begin[0] = 0;
}

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
               .face = m->face + m->begin[c],
               .count = m->begin[c + 1] - m->begin[c],
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
    if (!faces_along(q, qw_normalize(p->cross), p->area)) return false;
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

/* Sets the points where the lines from the middle of the bounding box to its corners leave the surface. */
static void find_corners(const piece *p, qw_vec3 *corner)
{
    qw_vec3 low = qw_v3(INFINITY, INFINITY, INFINITY), high = qw_scale(low, -1);
    for (uint32_t i = 0; i < 3 * p->count; i++) {
        qw_vec3 q = p->mesh->position[p->mesh->corner[3 * p->face[i / 3] + i % 3]];
        low = qw_v3(lesser(low.x, q.x), lesser(low.y, q.y), lesser(low.z, q.z));
        high = qw_v3(greater(high.x, q.x), greater(high.y, q.y), greater(high.z, q.z));
    }
    qw_vec3 middle = qw_lerp(low, high, 0.5f);
    for (uint32_t i = 0; i < 8; i++) {
        qw_vec3 d = qw_v3((i & 1 ? high : low).x - middle.x, (i & 2 ? high : low).y - middle.y,
                          (i & 4 ? high : low).z - middle.z);
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

static bool make_sphere(making *m, const piece *p, uint32_t component)
{
    qw_vec3 corner[8], middle = {0, 0, 0};
    uint32_t box[6][4], twin[24], vertex = m->quads.vertex_count;
    find_corners(p, corner);
    for (int i = 0; i < 8; i++) middle = qw_madd(middle, 0.125f, corner[i]);
    for (int f = 0; f < 6; f++) {
        qw_vec3 q[4], n = {0, 0, 0};
        for (int i = 0; i < 4; i++) q[i] = corner[BOX[f][i]], n = qw_add(n, qw_sub(q[i], middle));
        if (!faces_along(q, qw_normalize(n), p->area / 6)) return false;
    }
    bool inward = volume_of(p) < 0;
    for (int i = 0; i < 24; i++) box[i / 4][i % 4] = BOX[i / 4][inward ? 3 - i % 4 : i % 4];
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

static void make_all(making *m, double edge, qw_minimal *minimal)
{
    uint32_t n = (uint32_t)m->census->components, largest = 0;
    double most = -1;
    for (uint32_t c = 0; c < n; c++) {
        double area = piece_of(m, c).area;
        if (area > most) most = area, largest = c;
    }
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
    sort_faces(&m);
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

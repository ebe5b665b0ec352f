#include "remesh/quads/extract.h"

#include "base/sets.h"
#include "remesh/field/hierarchy.h"
#include "remesh/offsets/embedding.h"

#include <assert.h>
#include <string.h>

/* ---- adjacency through triangles without area */

static bool is_zero_edge(const qw_offset_mesh *m, uint32_t h) { return qw_int2_is_zero(m->d[m->edge[h]]); }

/* In a triangle of area 0 with exactly one zero edge, the other edge that coincides with h; QW_NONE where there is
 * none. */
static uint32_t across_flat(const qw_offset_mesh *m, uint32_t h)
{
    uint32_t a = qw_next(h), b = qw_prev(h);
    bool za = is_zero_edge(m, a), zb = is_zero_edge(m, b);
    return za == zb ? QW_NONE : za ? b : a;
}

/* The half-edge on the far side of h among triangles with area, or QW_NONE at the boundary (*curve: whether a marked
 * edge was crossed). */
static uint32_t far_side(const qw_offset_mesh *m, const uint8_t *has_area, uint32_t h, uint8_t *mark)
{
    assert(h < 3 * m->face_count);
    uint32_t limit = 3 * m->face_count;
    *mark |= m->mark[h];
    for (uint32_t t = m->twin[h]; t != QW_NONE && limit-- > 0;) {
        *mark |= m->mark[t];
        if (has_area[t / 3]) return t;
        uint32_t on = across_flat(m, t);
        if (on == QW_NONE) return QW_NONE;
        *mark |= m->mark[on];
        t = m->twin[on];
    }
    return QW_NONE;
}

static uint32_t hypotenuse_of(const qw_offset_mesh *m, uint32_t f)
{
    assert(f < m->face_count);
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        qw_int2 d = m->d[m->edge[h]];
        if (d.x && d.y) return h;
    }
    return QW_NONE;
}

/* ---- pairing: quad q has the legs of two triangles as its half-edges */

typedef struct pairing {
    uint32_t count;
    uint32_t *leg;     /* [4 count] half-edge of the triangles that is half-edge 4 q + i of the quads */
    uint32_t *quad_of; /* [3F] half-edge of the quads that stands for a leg, or QW_NONE */
    int64_t unpaired;
} pairing;

/* Joins triangles of half a quad across their hypotenuses. Triangles without a partner are counted. */
static pairing pair_triangles(qw_env *env, const qw_offset_mesh *m, const uint8_t *has_area)
{
    pairing p = {.leg = QW_NEW(env, uint32_t, (size_t)2 * m->face_count + 4),
                 .quad_of = QW_NEW(env, uint32_t, (size_t)3 * m->face_count)};
    memset(p.quad_of, 0xff, (size_t)3 * m->face_count * sizeof *p.quad_of);
    uint8_t *paired = QW_NEW_ZERO(env, uint8_t, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) {
        if (!has_area[f] || paired[f]) continue;
        uint8_t mark = 0;
        uint32_t h = hypotenuse_of(m, f), t = h == QW_NONE ? QW_NONE : far_side(m, has_area, h, &mark);
        if (t == QW_NONE || t / 3 == f || paired[t / 3] || hypotenuse_of(m, t / 3) != t) {
            p.unpaired++;
            continue;
        }
        paired[f] = paired[t / 3] = 1;
        uint32_t *leg = p.leg + 4 * (size_t)p.count;
        leg[0] = qw_next(h), leg[1] = qw_prev(h), leg[2] = qw_next(t), leg[3] = qw_prev(t);
        for (uint32_t i = 0; i < 4; i++) p.quad_of[leg[i]] = 4 * p.count + i;
        p.count++;
    }
    qw_free(env, paired);
    return p;
}

/* Twins and marks of the quads' sides, by way of the triangles without area between them. */
static void link_quads(qw_env *env, const qw_offset_mesh *m, const uint8_t *has_area, const pairing *p, qw_quadmesh *q)
{
    assert(p->count <= m->face_count);
    q->twin = QW_NEW(env, uint32_t, (size_t)4 * p->count);
    q->mark = QW_NEW_ZERO(env, uint8_t, (size_t)4 * p->count);
    memset(q->twin, 0xff, (size_t)4 * p->count * sizeof *q->twin);
    for (uint32_t k = 0; k < 4 * p->count; k++) {
        uint8_t mark = 0;
        uint32_t t = far_side(m, has_area, p->leg[k], &mark);
        uint32_t other = t == QW_NONE ? QW_NONE : p->quad_of[t];
        q->mark[k] = mark;
        if (other != QW_NONE && other != k) q->twin[k] = other;
    }
    /* the two crossings disagree only where a triangle was inverted; such sides are left open */
    for (uint32_t k = 0; k < 4 * p->count; k++)
        if (q->twin[k] != QW_NONE && q->twin[q->twin[k]] != k) q->twin[k] = QW_NONE;
}

/* ---- vertices: one a fan */

/* Gives each fan of quads a vertex of its own. vertex_class: uint32_t[sides], receives the class of each. Returns
 * their number. */
static uint32_t number_fans(const qw_offset_mesh *m, const pairing *p, const uint32_t *class_of, qw_quadmesh *q,
                            uint32_t *vertex_class)
{
    assert(q->corner && class_of && vertex_class);
    uint32_t count = 0, sides = 4 * p->count;
    memset(q->corner, 0xff, sides * sizeof *q->corner);
    for (uint32_t k = 0; k < sides; k++) {
        if (q->corner[k] != QW_NONE) continue;
        uint32_t first = k, h = k;
        while (q->twin[first] != QW_NONE) { /* clockwise to where the fan begins */
            first = qw_quad_next(q->twin[first]);
            if (first == k) break;
        }
        h = first;
        do {
            q->corner[h] = count;
            h = q->twin[qw_quad_prev(h)];
        } while (h != QW_NONE && h != first && q->corner[h] == QW_NONE);
        vertex_class[count++] = class_of[m->corner[p->leg[k]]];
    }
    return count;
}

/* ---- corners that no quad is left at */

typedef struct lost_corners {
    const qw_offset_mesh *m;
    const uint32_t *class_of;
    uint8_t *kind;    /* [vertices]: bits of each class */
    uint32_t *corner; /* [vertices]: the lost corner from which each was reached, or QW_NONE */
    uint8_t *ring;    /* [vertices] */
    uint32_t *taker;  /* [vertices]: of each lost corner the class that takes it, or QW_NONE */
    uint32_t left;
} lost_corners;

/* HAS_CORNER: of a class without quads; the search begins there. */
enum content_flag { HAS_QUADS = 1, HAS_CORNER = 2 };
enum { MOST_CORNER_RINGS = 12 };

/* Finds the corners whose class has no quads, and so would be lost: one a class. */
static void find_lost(lost_corners *l, const uint32_t *vertex_class, uint32_t count)
{
    const qw_offset_mesh *m = l->m;
    for (uint32_t k = 0; k < count; k++) l->kind[vertex_class[k]] = HAS_QUADS;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        l->corner[v] = l->taker[v] = QW_NONE;
        if (m->constraint[v] != QW_VERTEX_CORNER) continue;
        uint8_t *kind = &l->kind[l->class_of[v]];
        if (*kind == 0) l->corner[v] = v, l->left++; /* one a class, or its takers would become one */
        *kind |= HAS_CORNER;
    }
}

/* Lets a lost corner spread from one vertex to the next through classes without quads; the first class with quads
 * and no corner takes it. */
static void reach_across(lost_corners *l, uint32_t from, uint32_t to, uint32_t ring)
{
    uint32_t corner = l->corner[from], c = l->class_of[to];
    if (corner == QW_NONE || l->ring[from] > ring || l->corner[to] != QW_NONE || l->taker[corner] != QW_NONE) return;
    if (!(l->kind[c] & HAS_QUADS)) {
        l->corner[to] = corner, l->ring[to] = (uint8_t)(ring + 1);
    } else if (!(l->kind[c] & HAS_CORNER)) {
        l->kind[c] |= HAS_CORNER;
        l->taker[corner] = c;
        l->left--;
    }
}

/* Moves each corner whose class has no quads any more, as where cones have met at the tip of a pyramid, to the
   nearest class beside it that has quads and no corner. */
static void keep_corners(qw_env *env, const qw_offset_mesh *m, uint32_t *class_of, uint32_t *vertex_class,
                         uint32_t count)
{
    if (!memchr(m->constraint, QW_VERTEX_CORNER, m->vertex_count)) return;
    qw_scope_begin(env);
    uint32_t n = m->vertex_count;
    lost_corners l = {m,
                      class_of,
                      QW_NEW_ZERO(env, uint8_t, n),
                      QW_NEW(env, uint32_t, n),
                      QW_NEW_ZERO(env, uint8_t, n),
                      QW_NEW(env, uint32_t, n),
                      0};
    find_lost(&l, vertex_class, count);
    bool any = l.left > 0;
    for (uint32_t ring = 0; ring < MOST_CORNER_RINGS && l.left > 0; ring++)
        for (uint32_t h = 0; h < 3 * m->face_count; h++) {
            reach_across(&l, m->corner[h], m->corner[qw_next(h)], ring);
            reach_across(&l, m->corner[qw_next(h)], m->corner[h], ring);
        }
    if (any) {
        uint32_t *root = QW_NEW(env, uint32_t, n);
        qw_sets_begin(root, n);
        for (uint32_t v = 0; v < n; v++)
            if (l.taker[v] != QW_NONE) qw_join_sets(root, class_of[v], l.taker[v]);
        for (uint32_t v = 0; v < n; v++) class_of[v] = qw_set_of(root, class_of[v]);
        for (uint32_t k = 0; k < count; k++) vertex_class[k] = class_of[vertex_class[k]];
    }
    qw_scope_end(env);
}

/* Positions and kinds of the quads' vertices: the mean of the most constrained members of each class. */
static void place_vertices(qw_env *env, const qw_offset_mesh *m, const uint32_t *class_of, const uint32_t *vertex_class,
                           qw_quadmesh *q)
{
    assert(m->constraint && class_of);
    uint32_t n = m->vertex_count;
    qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, n);
    uint32_t *members = QW_NEW_ZERO(env, uint32_t, n);
    uint8_t *kind = QW_NEW_ZERO(env, uint8_t, n);
    for (uint32_t v = 0; v < n; v++) {
        uint32_t c = class_of[v];
        if (m->constraint[v] < kind[c]) continue; /* the most constrained members decide the position */
        if (m->constraint[v] > kind[c]) kind[c] = m->constraint[v], sum[c] = qw_v3(0, 0, 0), members[c] = 0;
        sum[c] = qw_add(sum[c], m->position[v]);
        members[c]++;
    }
    q->position = QW_NEW(env, qw_vec3, q->vertex_count);
    q->kind = QW_NEW(env, uint8_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        uint32_t c = vertex_class[v];
        q->position[v] = qw_scale(sum[c], 1.0f / (float)members[c]);
        q->kind[v] = kind[c];
    }
    qw_free(env, sum), qw_free(env, members), qw_free(env, kind);
}

/* The component of the surface that each vertex came from; numbered as on the mesh before any edge was split. */
static void label_vertices(qw_env *env, const qw_offset_mesh *m, const pairing *p, qw_quadmesh *q)
{
    qw_trimesh view = {.vertex_count = m->vertex_count,
                       .face_count = m->face_count,
                       .position = m->position,
                       .corner = m->corner,
                       .twin = m->twin};
    qw_census census = qw_trimesh_census(env, &view);
    q->component = QW_NEW_ZERO(env, uint32_t, q->vertex_count);
    for (uint32_t k = 0; k < 4 * p->count; k++) q->component[q->corner[k]] = census.component[p->leg[k] / 3];
    qw_free(env, census.component);
}

/* Quads out of triangles of half a quad's area; what has none vanishes. In the current scope. */
qw_extraction qw_extract_quads(qw_env *env, const qw_offset_mesh *m)
{
    assert(m->face_count > 0 && m->edge_count > 0);
    assert(m->face_count < QW_NONE / 4);
    qw_extraction x = {.class_of = qw_offset_classes(env, m)};
    uint8_t *has_area = QW_NEW(env, uint8_t, m->face_count);
    for (uint32_t f = 0; f < m->face_count; f++) has_area[f] = qw_offset_det(m, f) > 0;
    pairing p = pair_triangles(env, m, has_area);
    qw_quadmesh *q = &x.quads;
    q->face_count = p.count;
    x.unpaired = p.unpaired;
    link_quads(env, m, has_area, &p, q);
    q->corner = QW_NEW(env, uint32_t, (size_t)4 * p.count);
    x.vertex_class = QW_NEW(env, uint32_t, (size_t)4 * p.count);
    q->vertex_count = number_fans(m, &p, x.class_of, q, x.vertex_class);
    keep_corners(env, m, x.class_of, x.vertex_class, q->vertex_count);
    place_vertices(env, m, x.class_of, x.vertex_class, q);
    label_vertices(env, m, &p, q);
    qw_free(env, has_area), qw_free(env, p.leg), qw_free(env, p.quad_of);
    return x;
}

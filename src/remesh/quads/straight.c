#include "remesh/quads/straight.h"

#include "base/axes.h"
#include "base/constants.h"
#include "base/elementary.h"
#include "geometry/box_tree.h"
#include "geometry/loops.h"
#include "geometry/tri_edit.h"
#include "remesh/quads/pair.h"
#include "remesh/quads/quad_components.h"
#include "remesh/quads/rod.h"
#include "remesh/quads/simplify.h"
#include "remesh/working/working.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { PAIRINGS = 3 };
/* Of a quad's share of the surface: the least area that a box's side or a disc may have, and by how much a corner's
   triangle may face the other way, for rounding. */
static const float LEAST_AREA = 0.02f, TURNED_OVER = 1e-3f;
/* Rods that wind too much for their quads get more, so many times as many at most. */
static const double MORE_RINGS = 1.25, MOST_RINGS = 2;
/* Of the way from the middle of the box around what is bent to a corner of it. */
static const float INSIDE = 0.6f;

typedef struct making {
    qw_env *env;
    const qw_trimesh *part;
    const qw_straight *plan;
    qw_census census;
    double area;
    const qw_bvh *tree;
} making;

/* ---- the judge */

/* The worst of the quads, or QW_FLIPPED where they have not the topology of the component. */
static qw_flip judge(const making *m, const qw_quadmesh *q)
{
    if (q->face_count == 0) return QW_FLIPPED;
    qw_quad_census census = qw_quadmesh_census(m->env, q);
    bool is_sound = (census.euler != 2 || q->face_count >= QW_LEAST_SHELL) && census.double_edges == 0 &&
                    census.degenerate_faces == 0 && census.components == 1 &&
                    census.boundary_loops == m->census.boundary_loops && census.euler == m->census.euler;
    qw_flip_judge flips = {.surface = m->part, .tree = m->tree, .edge = (float)sqrt(m->area / q->face_count)};
    qw_flip worst = is_sound ? QW_NOT_FLIPPED : QW_FLIPPED;
    for (uint32_t f = 0; f < q->face_count && worst < QW_FLIPPED; f++) {
        qw_flip flip = qw_flip_of_quad(&flips, q->position, q->corner + 4 * (size_t)f);
        if (flip > worst) worst = flip;
    }
    return worst;
}

/* Whether each quad has an area, and no corner that is inverted; one without area is allowed. */
static bool are_convex(const making *m, const qw_quadmesh *q)
{
    float share = (float)(m->area / q->face_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        qw_vec3 p = q->position[q->corner[h]], all = qw_quad_cross(q->position, q->corner + (h & ~3u)),
                n = qw_normalize(all);
        qw_vec3 cross = qw_cross(qw_sub(q->position[q->corner[qw_quad_next(h)]], p),
                                 qw_sub(q->position[q->corner[qw_quad_prev(h)]], p));
        if (qw_dot(cross, n) < -TURNED_OVER * share || 0.5f * qw_length(all) <= LEAST_AREA * share) return false;
    }
    return true;
}

/* ---- the fewest quads */

/* Of their own few vertices. */
static qw_quadmesh few_quads(qw_env *env, const qw_vec3 *position, uint32_t vertices, const uint32_t (*corner)[4],
                             uint32_t faces)
{
    uint32_t sides = 4 * faces;
    qw_quadmesh q = {vertices,
                     faces,
                     QW_NEW(env, qw_vec3, vertices),
                     QW_NEW(env, uint32_t, sides),
                     QW_NEW(env, uint32_t, sides),
                     QW_NEW_ZERO(env, uint8_t, vertices),
                     QW_NEW_ZERO(env, uint8_t, sides),
                     QW_NEW_ZERO(env, uint32_t, vertices)};
    memcpy(q.position, position, vertices * sizeof *position);
    memcpy(q.corner, corner, sides * sizeof *q.corner);
    memset(q.twin, 0xff, sides * sizeof *q.twin);
    for (uint32_t h = 0; h < sides; h++)
        for (uint32_t g = 0; g < sides; g++)
            if (q.corner[h] == q.corner[qw_quad_next(g)] && q.corner[g] == q.corner[qw_quad_next(h)]) q.twin[h] = g;
    return q;
}

/* The vertex of a loop between two of them that is furthest from the line through both, or from both where they are
   one. */
static uint32_t furthest(const qw_vec3 *loop, uint32_t n, uint32_t a, uint32_t b)
{
    qw_vec3 along = qw_normalize(qw_sub(loop[b], loop[a]));
    uint32_t best = (a + 1) % n;
    float most = -1;
    for (uint32_t i = (a + 1) % n; i != b; i = (i + 1) % n) {
        float d2 = qw_length2(qw_reject(qw_sub(loop[i], loop[a]), along));
        if (d2 > most) most = d2, best = i;
    }
    return best;
}

/* Across the two vertices that are furthest apart, about. */
static qw_quadmesh make_disc(const making *m)
{
    static const uint32_t corner[1][4] = {{0, 1, 2, 3}};
    qw_rims rims = qw_find_rims(m->env, 3, m->part->twin, m->part->face_count);
    uint32_t n = rims.begin[1];
    qw_vec3 *loop = QW_NEW(m->env, qw_vec3, n);
    for (uint32_t i = 0; i < n; i++) loop[i] = m->part->position[m->part->corner[rims.half[i]]];
    uint32_t a = furthest(loop, n, 0, 0), b = furthest(loop, n, a, a), left = furthest(loop, n, a, b),
             right = furthest(loop, n, b, a);
    qw_vec3 p[4] = {loop[a], loop[left], loop[b], loop[right]};
    if (left == b) p[1] = qw_lerp(loop[a], loop[b], 0.5f); /* neighbours: the middle of their edge */
    if (right == a) p[3] = qw_lerp(loop[a], loop[b], 0.5f);
    return few_quads(m->env, p, 4, corner, 1);
}

/* Axes along which the component is spread out most and least, about its centre. */
static void principal_axes(const making *m, qw_vec3 axis[3])
{
    double area = 0, moment[3][3] = {{0}}, rows[3][3];
    qw_vec3 middle = {0, 0, 0};
    const qw_vec3 *x = m->part->position;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t f = 0; f < m->part->face_count; f++) {
            const uint32_t *c = m->part->corner + 3 * (size_t)f;
            qw_vec3 q = qw_scale(qw_add(qw_add(x[c[0]], x[c[1]]), x[c[2]]), 1.0f / 3);
            float w = qw_length(qw_face_cross(m->part, f));
            if (pass == 0) area += (double)w, middle = qw_madd(middle, w, q);
            if (pass == 0) continue;
            double at[3];
            qw_to_doubles(qw_madd(q, -1 / (float)area, middle), at);
            for (int k = 0; k < 9; k++) moment[k / 3][k % 3] += (double)w * at[k / 3] * at[k % 3];
        }
    qw_principal_axes(moment, rows);
    axis[0] = qw_v3_of_doubles(rows[0]), axis[1] = qw_v3_of_doubles(rows[1]), axis[2] = qw_cross(axis[0], axis[1]);
}

/* The points of the component that are nearest to the corners of the box around it along these axes; or, of what is
   bent, these corners themselves, nearer to the middle. */
static void find_corners(const making *m, const qw_vec3 axis[3], bool is_bent, qw_vec3 corner[8])
{
    float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t v = 0; v < m->part->vertex_count; v++)
        for (int k = 0; k < 3; k++) {
            float x = qw_dot(m->part->position[v], axis[k]);
            low[k] = fminf(low[k], x), high[k] = fmaxf(high[k], x);
        }
    for (uint32_t i = 0; i < 8; i++) {
        qw_vec3 p = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            float way = (i >> k & 1 ? 0.5f : -0.5f) * (high[k] - low[k]), middle = 0.5f * (low[k] + high[k]);
            p = qw_madd(p, middle + (is_bent ? INSIDE * way : way), axis[k]);
        }
        corner[i] = is_bent ? p : qw_bvh_nearest(m->tree, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE).point;
    }
}

/* A box along the coordinates, or along the component's own axes, facing out or, of what is inside out, in. */
static qw_quadmesh make_box(const making *m, bool by_own_axes, bool inward, bool is_bent)
{
    /* the corners by the bits of their numbers: x, y, z; sides outward */
    static const uint32_t BOX[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    qw_vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, corner[8];
    uint32_t box[6][4];
    for (int i = 0; i < 24; i++) box[i / 4][i % 4] = BOX[i / 4][inward ? 3 - i % 4 : i % 4];
    if (by_own_axes) principal_axes(m, axis);
    find_corners(m, axis, is_bent, corner);
    return few_quads(m->env, corner, 8, box, 6);
}

/* The variants of the fewest quads, by number, two by two with the axes; no faces: there is none. */
enum { LEAST_VARIANTS = 8 };
static qw_quadmesh make_least(const making *m, int variant)
{
    qw_quadmesh q = {0};
    if (m->census.boundary_loops == 1 && m->census.euler == 1 && variant == 0) q = make_disc(m);
    if (m->census.boundary_loops == 0 && m->census.euler == 2) q = make_box(m, variant & 1, variant & 2, variant & 4);
    return q.face_count > 0 && are_convex(m, &q) ? q : (qw_quadmesh){0};
}

/* ---- pairs */

static uint32_t farthest_from(const qw_edit *e, uint32_t v)
{
    uint32_t far = v;
    for (uint32_t u = 0; u < e->vertex_count; u++)
        if (qw_distance(e->vertex[u].position, e->vertex[v].position) >
            qw_distance(e->vertex[far].position, e->vertex[v].position))
            far = u;
    return far;
}

/* Twice as many triangles as quads, of one size, paired; of a needle, which would be cut into a crowd, no more than so
   many quads in a row are long. The two ends stay where they are when quads are thinned out. */
static qw_quadmesh pair_once(const making *m, double quads)
{
    qw_env *env = m->env;
    qw_box box = qw_box_of(m->part->position, (int)m->part->vertex_count);
    float edge = (float)sqrt(m->area / (2 * (double)QW_EQUILATERAL_AREA * quads));
    for (int k = 0; k < 3; k++) edge = fmaxf(edge, (box.hi[k] - box.lo[k]) / (float)quads);
    float *size = QW_NEW(env, float, m->part->vertex_count);
    for (uint32_t v = 0; v < m->part->vertex_count; v++) size[v] = edge;
    qw_working working = qw_coarsest_mesh(env, m->part, &m->census, size);
    qw_edit e = qw_edit_open(env, &working.mesh, working.target, qw_trimesh_outgoing(env, &working.mesh));
    for (uint32_t v = 0; v < e.vertex_count; v++) e.vertex[v].home = 0; /* the component */
    uint32_t one = farthest_from(&e, 0), other = farthest_from(&e, one);
    e.vertex[one].kind = e.vertex[other].kind = QW_VERTEX_CORNER;
    uint32_t *vertex_of;
    qw_pair_counts pairs = {0};
    return qw_pair_triangles(env, &e, NULL, &vertex_of, &pairs);
}

/* Working meshes of few triangles have more than they are asked for, so it takes a few attempts. Thinning out quads
   that are paired already costs the part its ends. */
static qw_quadmesh pair_to_count(const making *m, double quads)
{
    double asked = quads;
    qw_quadmesh paired = pair_once(m, asked);
    for (int i = 1; i < PAIRINGS && paired.face_count > quads; i++) {
        asked *= quads / paired.face_count;
        qw_quadmesh next = pair_once(m, asked);
        if (next.face_count < paired.face_count) paired = next;
    }
    return paired;
}

/* Thinned out at any price, without loss of shape, or not at all. */
enum { PAIR_VARIANTS = 3 };
static qw_quadmesh thin_out(const making *m, const qw_quadmesh *paired, double quads, int variant)
{
    qw_simplify_counts moves = {0};
    int64_t most = (int64_t)fmax(qw_floor(quads), m->census.euler == 2 ? QW_LEAST_SHELL : QW_LEAST_OPEN);
    return variant == 2 ? *paired : qw_simplify_quads(m->env, paired, NULL, most, most, variant == 1, &moves);
}

/* ---- all */

typedef struct best {
    qw_quadmesh quads;
    qw_flip worst;
    float area; /* of two that are as good the larger one lies nearer to the surface: quads cut off what they miss */
} best;

/* Returns whether the best is good enough. */
static bool offer(const making *m, best *b, const qw_quadmesh *quads)
{
    qw_flip worst = judge(m, quads);
    float area = 0;
    for (uint32_t f = 0; f < quads->face_count; f++)
        area += 0.5f * qw_length(qw_quad_cross(quads->position, quads->corner + 4 * (size_t)f));
    if (worst < b->worst || (worst == b->worst && worst < QW_FLIPPED && area > b->area))
        *b = (best){*quads, worst, area};
    return b->worst <= m->plan->enough;
}

qw_quadmesh qw_make_straight(qw_env *env, const qw_trimesh *part, const qw_straight *plan, qw_flip *worst)
{
    assert(part->face_count > 0 && plan->enough < QW_FLIPPED);
    qw_scope_begin(env);
    making m = {env, part, plan, qw_trimesh_census(env, part), qw_trimesh_area(part), qw_bvh_build(env, part)};
    best b = {.worst = QW_FLIPPED};
    bool is_done = false;
    for (int i = 0; plan->is_least && i < LEAST_VARIANTS && (i & 1 || !is_done); i++) {
        qw_quadmesh least = make_least(&m, i);
        is_done |= offer(&m, &b, &least);
    }
    /* fields make a thick ring well, but nothing that winds in few quads */
    bool is_ring = m.census.euler == 0;
    bool may_be_rod = !plan->is_least && m.census.boundary_loops == 0 && (m.census.euler == 2 || is_ring);
    for (double rings = 1; may_be_rod && !is_done && rings <= MOST_RINGS; rings *= MORE_RINGS) {
        qw_quadmesh rod = qw_make_rod(env, part, m.tree, is_ring, rings * plan->quads);
        is_done = rod.face_count > 0 && (!is_ring || are_convex(&m, &rod)) && offer(&m, &b, &rod);
    }
    if (!plan->is_least && !is_done) {
        qw_heartbeat(env);
        qw_quadmesh paired = pair_to_count(&m, plan->quads);
        for (int i = 0; i < PAIR_VARIANTS && !is_done; i++) {
            qw_quadmesh thinned = thin_out(&m, &paired, plan->quads, i);
            is_done = offer(&m, &b, &thinned);
        }
    }
    if (b.worst < QW_FLIPPED) qw_keep_quads(env, &b.quads);
    qw_scope_end(env);
    for (uint32_t v = 0; v < b.quads.vertex_count; v++) b.quads.kind[v] = QW_VERTEX_FREE;
    *worst = b.worst;
    return b.quads;
}

/* The distance d of the surface from the quads, in their normals' direction, is to be met by a function h that is
 * linear on the two triangles of each quad: the integral of (d - h)^2 is least. With the rule of edges' middles, which
 * is exact for the square of h, the sum runs over the sides and the diagonals of the quads; at the vertices d is 0 and
 * counts nothing. On a surface of constant curvature, of which quads with an edge e lie up to k e^2 / 4 beneath,
 * vertices rise by k e^2 / 6, and a fourth of the mean distance is left.
 *
 * The matrix is that of the masses of linear elements, so a few damped Jacobi steps solve it. */
#include "remesh/relax/fit.h"

#include "geometry/go_back.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    STEPS = 2 /* of Jacobi: the first takes the mean of what the surface is away around a vertex */
};
/* Eigenvalues of the scaled matrix lie between 1/2 and 2. */
static const float DAMPING = 0.5f;
/* In mean edges around: a surface farther away than this is no part of what the quad stands for, and no vertex rises by
   more. */
static const float MOST = 0.25f;
/* In the frame, of whose box the diagonal is 1: boundary vertices no farther from the cut lie on it. */
static const double ON_CUT = 1e-5;

/* A side or a diagonal of a quad, with what the surface is away at its middle. */
typedef struct link {
    uint32_t end[2];
    float share[2]; /* by how much the middle rises where an end rises by 1 */
    float weight;   /* a third of the area of the triangles beside it */
    float away;     /* at the middle */
    float most;     /* of what is thin: the largest of some places of the link */
    bool is_thin;   /* the surface has a second side close behind, through which the quads may not reach */
} link;

typedef struct fitting {
    qw_quadmesh *quads;
    const qw_fit *fit;
    qw_vec3 *normal;       /* qw_vec3[vertices]: the direction in which each may move; 0: it stays */
    const qw_vec3 *facing; /* qw_vec3[vertices]: unit normals */
    link *links;
    uint32_t link_count;
    uint32_t *begin, *of;      /* the links at each vertex: of[begin[v] .. begin[v + 1]) */
    float *edge, *rise, *next; /* float[vertices]: mean edge around, wanted rise */
} fitting;

static float triangle_area(const qw_quadmesh *q, uint32_t a, uint32_t b, uint32_t c)
{
    return 0.5f * qw_length(qw_cross(qw_sub(q->position[b], q->position[a]), qw_sub(q->position[c], q->position[a])));
}

/* The areas of the two triangles of a quad: on half-edges 0 and 1, on 2 and 3. */
static void areas_of(const qw_quadmesh *q, uint32_t f, float area[2])
{
    const uint32_t *c = q->corner + 4 * (size_t)f;
    area[0] = triangle_area(q, c[0], c[1], c[2]), area[1] = triangle_area(q, c[0], c[2], c[3]);
}

static void add_link(fitting *t, uint32_t a, uint32_t b, float area)
{
    t->links[t->link_count++] = (link){.end = {a, b}, .weight = area / 3};
}

/* Sides once, with the triangles of both quads; diagonals. */
static void list_links(fitting *t)
{
    const qw_quadmesh *q = t->quads;
    for (uint32_t f = 0; f < q->face_count; f++) {
        float own[2], other[2];
        areas_of(q, f, own);
        for (uint32_t i = 0; i < 4; i++) {
            uint32_t h = 4 * f + i, twin = q->twin[h];
            if (twin != QW_NONE && twin < h) continue;
            float area = own[i / 2];
            if (twin != QW_NONE) areas_of(q, twin / 4, other), area += other[twin % 4 / 2];
            add_link(t, q->corner[h], q->corner[qw_quad_next(h)], area);
        }
        add_link(t, q->corner[4 * (size_t)f], q->corner[4 * (size_t)f + 2], own[0] + own[1]);
    }
}

static void gather_links(qw_env *env, fitting *t)
{
    uint32_t n = t->quads->vertex_count;
    t->begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2), t->of = QW_NEW(env, uint32_t, 2 * (size_t)t->link_count);
    for (uint32_t l = 0; l < t->link_count; l++)
        for (int k = 0; k < 2; k++) t->begin[t->links[l].end[k] + 2]++;
    for (uint32_t v = 0; v < n; v++) t->begin[v + 2] += t->begin[v + 1];
    for (uint32_t l = 0; l < t->link_count; l++)
        for (int k = 0; k < 2; k++) t->of[t->begin[t->links[l].end[k] + 1]++] = l;
}

/* How far the target lies above a place of a link, from 0 at one end to 1 at the other; false: it is not near. */
static bool away_at(const fitting *t, link *l, float along, qw_vec3 up, uint32_t hint[2], float *away)
{
    uint32_t a = l->end[0], b = l->end[1], part = t->quads->component ? t->quads->component[a] : QW_NONE;
    qw_vec3 place = qw_lerp(t->quads->position[a], t->quads->position[b], along);
    float reach = MOST * 0.5f * (t->edge[a] + t->edge[b]);
    qw_hit hit = qw_bvh_nearest_of(t->fit->tree, part, place, up, QW_SAME_SHEET, reach, hint[0]);
    if (hit.face == QW_NONE) return false;
    hint[0] = hit.face;
    qw_vec3 target = qw_target_place(&t->fit->target, hit.point, up, &hint[1], &l->is_thin);
    *away = qw_dot(qw_sub(target, place), up);
    return true;
}

/* How far the surface lies above the middle of each link, and how much of that a move of each end makes up for. */
static void measure_links(void *user, uint32_t begin, uint32_t end)
{
    assert(end <= ((const fitting *)user)->link_count);
    const fitting *t = user;
    uint32_t hint[2] = {QW_NONE, QW_NONE};
    for (uint32_t i = begin; i < end; i++) {
        link *l = &t->links[i];
        uint32_t a = l->end[0], b = l->end[1];
        if (!t->fit->target.tree && qw_length2(t->normal[a]) == 0 && qw_length2(t->normal[b]) == 0) continue;
        qw_vec3 up = qw_normalize(qw_add(t->facing[a], t->facing[b]));
        if (!away_at(t, l, 0.5f, up, hint, &l->away)) {
            l->weight = 0;
            continue;
        }
        l->share[0] = 0.5f * qw_dot(t->normal[a], up), l->share[1] = 0.5f * qw_dot(t->normal[b], up);
        l->most = l->away;
        for (int side = 0; side < 2 && l->is_thin; side++) {
            float away;
            if (away_at(t, l, side ? 0.75f : 0.25f, up, hint, &away)) l->most = fmaxf(l->most, away), l->is_thin = true;
        }
    }
}

/* One damped step of all vertices along their normals, within MOST edges. */
static void jacobi_block(void *user, uint32_t begin, uint32_t end)
{
    const fitting *t = user;
    for (uint32_t v = begin; v < end; v++) {
        float diagonal = 0, lack = 0;
        for (uint32_t i = t->begin[v]; i < t->begin[v + 1]; i++) {
            const link *l = &t->links[t->of[i]];
            int own = l->end[0] != v;
            float is = l->share[0] * t->rise[l->end[0]] + l->share[1] * t->rise[l->end[1]];
            diagonal += l->weight * l->share[own] * l->share[own];
            lack += l->weight * l->share[own] * (l->away - is);
        }
        float most = MOST * t->edge[v];
        t->next[v] = diagonal > 0 ? fminf(fmaxf(t->rise[v] + DAMPING * lack / diagonal, -most), most) : 0;
    }
}

static void solve(qw_env *env, fitting *t)
{
    for (int step = 0; step < STEPS; step++) {
        qw_parallel(env, t->quads->vertex_count, QW_GRAIN_HEAVY, jacobi_block, t);
        float *swap = t->rise;
        t->rise = t->next, t->next = swap;
    }
}

/* The quads of each side of what is thin, as a sheet, stay on their side of it: on the outside of a bend their vertices
 * rise until the middles of their edges are there too, on the inside they stay on the sheet. The mean of both would be
 * the sheet, and the two sides would cross wherever their vertices are not the same. Vertices on curves do so too. */
static void part_sides(fitting *t)
{
    for (uint32_t v = 0; v < t->quads->vertex_count; v++) {
        float least = 0, most = MOST * t->edge[v];
        bool is_thin = false;
        for (uint32_t i = t->begin[v]; i < t->begin[v + 1]; i++) {
            const link *l = &t->links[t->of[i]];
            if (!l->is_thin || l->weight == 0) continue;
            float turn = qw_dot(t->facing[l->end[0]], t->facing[l->end[1]]),
                  share = sqrtf(fmaxf(0.5f + 0.5f * turn, 0.25f));
            is_thin = true, least = fmaxf(least, l->most / share);
        }
        if (is_thin) t->rise[v] = fminf(least, most), t->normal[v] = t->facing[v];
    }
}

/* ---- what may move */

/* float[vertices]: the mean length of the links at each. */
static float *mean_edges(qw_env *env, const fitting *t)
{
    uint32_t n = t->quads->vertex_count;
    float *edge = QW_NEW(env, float, n);
    for (uint32_t v = 0; v < n; v++) {
        double sum = 0;
        for (uint32_t i = t->begin[v]; i < t->begin[v + 1]; i++) {
            const link *l = &t->links[t->of[i]];
            sum += (double)qw_distance(t->quads->position[l->end[0]], t->quads->position[l->end[1]]);
        }
        uint32_t count = t->begin[v + 1] - t->begin[v];
        edge[v] = count ? (float)(sum / count) : 0;
    }
    return edge;
}

/* The plane in which both ends lie, of those of their component; NULL: none. */
static const double *cut_at(const qw_fit *fit, const qw_quadmesh *q, uint32_t from, uint32_t to)
{
    qw_vec3 a = q->position[from], b = q->position[to];
    for (uint32_t i = 0; i < fit->cuts; i++) {
        if (fit->planes && !(fit->planes[from] >> i & 1)) continue;
        const double *n = fit->cut + 4 * (size_t)i;
        double up = n[0] * (double)a.x + n[1] * (double)a.y + n[2] * (double)a.z - n[3],
               other = n[0] * (double)b.x + n[1] * (double)b.y + n[2] * (double)b.z - n[3];
        if (fabs(up) < ON_CUT && fabs(other) < ON_CUT) return n;
    }
    return NULL;
}

/* Its normal; 0 where the vertex stays: on curves, boundaries and at corners. Where it lies on the boundary along the
   cut alone, what the normal has within the plane. */
static qw_vec3 *directions(qw_env *env, const qw_quadmesh *q, const qw_vec3 *facing, const qw_fit *fit)
{
    assert(q->twin && facing);
    qw_vec3 *direction = QW_NEW(env, qw_vec3, q->vertex_count), none = qw_v3(0, 0, 0);
    uint8_t *cuts = QW_NEW_ZERO(env, uint8_t, q->vertex_count); /* sides at a vertex that lie in the cut */
    const double **plane = QW_NEW_ZERO(env, const double *, q->vertex_count); /* in which they do */
    memcpy(direction, facing, q->vertex_count * sizeof *direction);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t a = q->corner[h], b = q->corner[qw_quad_next(h)];
        bool is_open = q->twin[h] == QW_NONE, is_marked = q->mark && q->mark[h];
        const double *cut = is_open && !is_marked ? cut_at(fit, q, a, b) : NULL;
        if (cut) cuts[a]++, cuts[b]++, plane[a] = plane[b] = cut;
        else if (is_open || is_marked) direction[a] = direction[b] = none;
    }
    for (uint32_t v = 0; v < q->vertex_count; v++) {
        bool is_free = !q->kind || q->kind[v] == QW_VERTEX_FREE || (q->kind[v] == QW_VERTEX_CURVE && cuts[v] == 2);
        if (!is_free) direction[v] = none;
        if (cuts[v] != 2 || qw_length2(direction[v]) == 0) continue;
        qw_vec3 normal = qw_v3_of_doubles(plane[v]);
        direction[v] = qw_normalize(qw_madd(direction[v], -qw_dot(direction[v], normal), normal));
    }
    return direction;
}

void qw_fit_quads(qw_env *env, qw_quadmesh *quads, const qw_fit *fit)
{
    assert(quads->twin && fit->tree && fit->strength >= 0 && fit->strength <= 1);
    uint32_t n = quads->vertex_count;
    if (fit->strength == 0 || n == 0) return;
    qw_vec3 *before = quads->position;
    quads->position = QW_NEW(env, qw_vec3, n);
    memcpy(quads->position, before, n * sizeof *before);
    qw_scope_begin(env);
    if (fit->target.tree) qw_put_curves_on_target(env, quads, &fit->target);
    fitting t = {.quads = quads, .fit = fit, .facing = qw_quadmesh_vertex_normals(env, quads)};
    t.normal = directions(env, quads, t.facing, fit);
    t.links = QW_NEW(env, link, 5 * (size_t)quads->face_count);
    list_links(&t);
    gather_links(env, &t);
    t.edge = mean_edges(env, &t), t.rise = QW_NEW_ZERO(env, float, n), t.next = QW_NEW_ZERO(env, float, n);
    qw_parallel(env, t.link_count, QW_GRAIN_HEAVY, measure_links, &t);
    solve(env, &t);
    part_sides(&t);
    for (uint32_t v = 0; v < n; v++)
        quads->position[v] = qw_madd(quads->position[v], fit->strength * t.rise[v], t.normal[v]);
    qw_hold_back_flips(env, quads, before);
    qw_scope_end(env);
}

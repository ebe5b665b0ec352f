/* A polyline is cut into steps of half an edge of the quads. The end of each step is projected onto the surface and
 * becomes a vertex; between two such vertices the surface is cut by the plane through both that stands on it: from a
 * vertex the walk goes on to where the plane leaves the ring of triangles around it, and splits the edge there, which
 * makes the edge that is to be marked. */
#include "geometry/engrave.h"

#include "geometry/tri_edit.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Steps an edge of the quads. */
static const float STEPS = 2;
/* A point that is nearer to a vertex or edge than this share of the edges there, or of the quads' edge, is moved to it:
   slivers would be the price of more accuracy. */
static const double SNAP = 0.05, SNAP_QUADS = 0.02;
/* A walk between two ends that crosses more edges than this has lost its way. */
enum { MOST_CROSSED = 100000, MOST_WALKED = 1000 };
/* In how many pieces a step is tried. */
enum { MOST_PIECES = 16, MOST_SHEETS = 8 };

typedef struct graver {
    qw_env *env;
    qw_edit e;
    const qw_bvh *bvh;
    double snap, longest; /* lengths: below which two points are one; of the polyline's longest step */
    uint32_t *chain;      /* uint32_t[2 links]: vertices of edges that a walk has found, to be marked if it arrives */
    size_t links, chain_capacity;
    int64_t marked;
    uint32_t number, point; /* of the polyline and of the point that was left last, for messages */
    uint8_t mark;           /* of its edges */
} graver;

static qw_vec3 at(const graver *g, uint32_t v) { return g->e.vertex[v].position; }

/* ---- a vertex where a step ends */

/* A point lies in a triangle up to this share of it outside: rounding. */
static const double OUTSIDE = 1e-5;
/* Shares of a side that a point on it keeps from the ends, so that none of the halves is without length: where a stop
   was snapped to the side, and where a cut crosses it. */
static const float KEPT_FROM_ENDS = 0.01f;
static const double KEPT_FROM_END = 1e-3;
static const uint32_t MOST_PIECES_A_STEP = 1000000; /* of a step, however long it is */

/* Barycentric coordinates in the plane of the face, in double. */
static void weights_in(const graver *g, uint32_t f, qw_vec3 p, double w[3])
{
    assert(f < g->e.face_count);
    const uint32_t *c = g->e.face[f].corner;
    double q[3][3], n[3], sum = 0;
    for (int i = 0; i < 3; i++) {
        qw_vec3 d = qw_sub(at(g, c[i]), p);
        q[i][0] = (double)d.x, q[i][1] = (double)d.y, q[i][2] = (double)d.z;
    }
    double a[3], b[3];
    for (int k = 0; k < 3; k++) a[k] = q[1][k] - q[0][k], b[k] = q[2][k] - q[0][k];
    for (int k = 0; k < 3; k++) n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    for (int i = 0; i < 3; i++) {
        const double *r = q[(i + 1) % 3], *s = q[(i + 2) % 3];
        w[i] = 0;
        for (int k = 0; k < 3; k++) w[i] += n[k] * (r[(k + 1) % 3] * s[(k + 2) % 3] - r[(k + 2) % 3] * s[(k + 1) % 3]);
        sum += w[i];
    }
    for (int i = 0; i < 3; i++) w[i] = sum > 0 ? w[i] / sum : 1.0 / 3;
}

/* The piece of face f of the surface in which the point lies: pieces lie in one plane. */
static uint32_t find_piece(const graver *g, uint32_t f, qw_vec3 p, double w[3])
{
    for (int step = 0; step < MOST_WALKED; step++) {
        weights_in(g, f, p, w);
        uint32_t least = w[0] < w[1] ? (w[0] < w[2] ? 0 : 2) : (w[1] < w[2] ? 1 : 2);
        uint32_t over = qw_edit_twin(&g->e, 4 * f + (least + 1) % 3);
        if (w[least] >= -OUTSIDE || over == QW_NONE) break;
        f = over >> 2;
    }
    return f;
}

static double shortest_side(const graver *g, uint32_t f)
{
    const uint32_t *c = g->e.face[f].corner;
    qw_vec3 p = at(g, c[0]), q = at(g, c[1]), r = at(g, c[2]);
    return (double)fminf(fminf(qw_distance(p, q), qw_distance(q, r)), qw_distance(r, p));
}

/* The vertex at a point of the surface: one that is there, or a new one. */
static uint32_t vertex_at(graver *g, const qw_hit *hit)
{
    assert(hit->face < g->e.face_count);
    double w[3];
    uint32_t f = find_piece(g, hit->face, hit->point, w);
    qw_edit *e = &g->e;
    const uint32_t *c = e->face[f].corner;
    double snap = fmin(g->snap, SNAP * shortest_side(g, f));
    for (int i = 0; i < 3; i++)
        if ((double)qw_distance(at(g, c[i]), hit->point) <= snap) return c[i];
    for (uint32_t i = 0; i < 3; i++) {
        qw_vec3 a = at(g, c[i]), ab = qw_sub(at(g, c[(i + 1) % 3]), a);
        float t = qw_dot(qw_sub(hit->point, a), ab) / fmaxf(qw_length2(ab), 1e-30f);
        qw_vec3 p = qw_madd(a, fminf(fmaxf(t, KEPT_FROM_ENDS), 1 - KEPT_FROM_ENDS), ab);
        if ((double)qw_distance(p, hit->point) <= snap) return qw_edit_split(e, 4 * f + i, p, 0, 0);
    }
    return qw_edit_split_face(e, f, hit->point, 0, 0);
}

/* ---- from one vertex to the next */

static void mark_edge(graver *g, uint32_t h)
{
    uint32_t t = qw_edit_twin(&g->e, h);
    if (t == QW_NONE) return;
    g->marked += !qw_edit_mark(&g->e, h);
    g->e.face[h >> 2].mark[h & 3] |= g->mark, g->e.face[t >> 2].mark[t & 3] |= g->mark;
}

/* The plane through the two ends of a step. */
typedef struct cut {
    qw_vec3 origin, normal, along;
} cut;

static double side_of(const cut *c, qw_vec3 p)
{
    qw_vec3 d = qw_sub(p, c->origin);
    return (double)d.x * (double)c->normal.x + (double)d.y * (double)c->normal.y + (double)d.z * (double)c->normal.z;
}

/* Where the plane leaves the triangles around a vertex. */
typedef struct exit_point {
    uint32_t half;   /* the edge that is crossed */
    double t;        /* where on it, from its tail */
    double progress; /* along the step */
} exit_point;

/* The way on from u, farthest along the step; not back to `from`, nor into an edge at which `from` lies. */
static exit_point find_exit(const graver *g, const cut *c, uint32_t u, uint32_t from)
{
    assert(u < g->e.vertex_count);
    const qw_edit *e = &g->e;
    exit_point best = {QW_NONE, 0, -INFINITY};
    uint32_t start = e->vertex[u].out, h = start;
    do {
        uint32_t across = qw_edit_next(h), p = qw_edit_tail(e, across), q = qw_edit_head(e, across);
        double sp = side_of(c, at(g, p)), sq = side_of(c, at(g, q));
        if (p != from && q != from && (sp <= 0) != (sq <= 0)) {
            double t = sp / (sp - sq);
            qw_vec3 x = qw_lerp(at(g, p), at(g, q), (float)t);
            double progress = (double)qw_dot(qw_normalize(qw_sub(x, at(g, u))), c->along);
            if (progress > best.progress) best = (exit_point){across, t, progress};
        }
        h = qw_edit_around(e, h);
    } while (h != QW_NONE && h != start);
    return best;
}

/* The vertex at an exit: an end of the edge where it is near enough, or a new one on it. */
static uint32_t take_exit(graver *g, const exit_point *x, uint32_t from)
{
    assert(x->half >> 2 < g->e.face_count);
    qw_edit *e = &g->e;
    uint32_t p = qw_edit_tail(e, x->half), q = qw_edit_head(e, x->half);
    double length = (double)qw_distance(at(g, p), at(g, q)), share = fmin(SNAP, g->snap / fmax(length, 1e-30));
    if (x->t <= share && p != from) return p;
    if (x->t >= 1 - share && q != from) return q;
    double t = fmin(fmax(x->t, KEPT_FROM_END), 1 - KEPT_FROM_END);
    return qw_edit_split(e, x->half, qw_lerp(at(g, p), at(g, q), (float)t), 0, 0);
}

static void add_link(graver *g, uint32_t u, uint32_t w)
{
    g->chain = qw_grow(g->env, g->chain, &g->chain_capacity, g->links + 1, 2 * sizeof *g->chain);
    g->chain[2 * g->links] = u, g->chain[2 * g->links + 1] = w;
    g->links++;
}

/* Adds a chain of edges from u to w to the links. Where the surface folds between them, `up` is the way to the fold.
   Returns false where the plane leads elsewhere. */
static bool walk(graver *g, uint32_t u, uint32_t w, qw_vec3 up, bool folds)
{
    assert(u < g->e.vertex_count && w < g->e.vertex_count);
    qw_vec3 along = qw_sub(at(g, w), at(g, u));
    cut c = {at(g, u), qw_normalize(qw_cross(along, up)), folds ? up : qw_normalize(along)};
    double limit = 3 * fmax((double)qw_length(along), folds ? g->longest : 0) + g->snap, walked = 0;
    uint32_t from = QW_NONE;
    for (int crossed = 0; u != w && crossed < MOST_CROSSED && walked <= limit; crossed++) {
        uint32_t h = qw_edit_between(&g->e, u, w);
        if (h != QW_NONE) {
            add_link(g, u, w);
            return true;
        }
        exit_point x = find_exit(g, &c, u, from);
        if (x.half == QW_NONE || (from == QW_NONE && x.progress <= 0)) return false;
        uint32_t to = take_exit(g, &x, from);
        if (qw_edit_between(&g->e, u, to) == QW_NONE) return false;
        add_link(g, u, to);
        walked += (double)qw_distance(at(g, u), at(g, to));
        from = u, u = to;
    }
    return u == w;
}

/* ---- whole polylines */

/* Where a step begins or ends. */
typedef struct stop {
    uint32_t vertex;
    qw_vec3 point, normal; /* of the polyline; of the surface there */
    qw_vec3 came;          /* the way from the stop before */
} stop;

static stop stop_at(graver *g, qw_vec3 p, const qw_vec3 *normal)
{
    qw_hit hit = qw_bvh_nearest(g->bvh, p, qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
    return (stop){.vertex = vertex_at(g, &hit), .point = p, .normal = normal[hit.face]};
}

/* In a plane that stands on the surface as at both stops, or as at one of them. Where the surface may fold back between
   them, as at the corner of a mouth, also in the plane in which the line came. */
static bool walk_between(graver *g, const stop *from, stop *to, bool folds)
{
    to->came = qw_normalize(qw_sub(at(g, to->vertex), at(g, from->vertex)));
    const qw_vec3 up[] = {qw_normalize(qw_add(from->normal, to->normal)), from->normal, to->normal, from->came};
    size_t links = g->links;
    for (int i = 0; i < 3 + folds; i++) {
        g->links = links;
        if (walk(g, from->vertex, to->vertex, up[i], i == 3)) return true;
    }
    return false;
}

/* Whether all links are still edges: a later one may have split an earlier one. */
static bool has_links(const graver *g)
{
    for (size_t i = 0; i < g->links; i++)
        if (qw_edit_between(&g->e, g->chain[2 * i], g->chain[2 * i + 1]) == QW_NONE) return false;
    return true;
}

/* One step by way of so many stops. Marks nothing where one of them cannot be reached. */
static bool draw_in(graver *g, uint32_t pieces, bool folds, const stop *from, stop *to, const qw_vec3 *normal)
{
    assert(pieces > 0);
    stop now = *from;
    g->links = 0;
    for (uint32_t k = 1; k <= pieces; k++) {
        stop next = k < pieces ? stop_at(g, qw_lerp(from->point, to->point, (float)k / (float)pieces), normal) : *to;
        if (!walk_between(g, &now, &next, folds)) return false;
        now = next;
    }
    if (!has_links(g)) return false;
    to->came = now.came;
    for (size_t i = 0; i < g->links; i++) mark_edge(g, qw_edit_between(&g->e, g->chain[2 * i], g->chain[2 * i + 1]));
    return true;
}

/* In smaller pieces where the straight way fails, as over sharp edges. */
static bool draw_step(graver *g, const stop *from, stop *to, const qw_vec3 *normal)
{
    for (int folds = 0; folds < 2; folds++)
        for (uint32_t pieces = 1; pieces <= MOST_PIECES; pieces *= 2)
            if (draw_in(g, pieces, folds, from, to, normal)) return true;
    return false;
}

/* The vertices in the place of v, v first, no more than MOST_SHEETS. Returns how many. */
static uint32_t sheets_at(const graver *g, uint32_t v, uint32_t sheet[MOST_SHEETS])
{
    uint32_t count = 1;
    sheet[0] = v;
    for (uint32_t u = 0; u < g->e.vertex_count && count < MOST_SHEETS; u++)
        if (u != v && qw_distance(at(g, u), at(g, v)) == 0) sheet[count++] = u;
    return count;
}

/* One step, where it fails from and to the other sheets that meet at its ends: of several that are as near to a point,
   any may have been found. */
static bool draw_on_a_sheet(graver *g, stop from, stop *to, const qw_vec3 *normal)
{
    if (draw_step(g, &from, to, normal)) return true;
    uint32_t start[MOST_SHEETS], end[MOST_SHEETS], starts = sheets_at(g, from.vertex, start),
                                                   ends = sheets_at(g, to->vertex, end);
    for (uint32_t i = 1; i < starts * ends; i++) {
        from.vertex = start[i / ends], to->vertex = end[i % ends];
        qw_heartbeat(g->env);
        if (draw_step(g, &from, to, normal)) return true;
    }
    return false;
}

/* Draws a line from point to point into the surface, in pieces no longer than `step`; false where it cannot. */
static bool engrave_one(graver *g, const qw_vec3 *point, uint32_t count, uint32_t finer, const qw_vec3 *normal,
                        float step)
{
    assert(count > 0 && finer > 0 && step > 0);
    stop first = stop_at(g, point[0], normal), now = first;
    bool is_closed = qw_distance(point[0], point[count - 1]) == 0;
    g->longest = 0;
    for (uint32_t i = 1; i < count; i++) g->longest = fmax(g->longest, (double)qw_distance(point[i - 1], point[i]));
    for (uint32_t i = 1; i < count; i++) {
        g->point = (i - 1) / finer;
        uint32_t pieces = 1 + (uint32_t)fminf(qw_distance(point[i - 1], point[i]) / step, (float)MOST_PIECES_A_STEP);
        for (uint32_t k = 1; k <= pieces; k++) {
            qw_heartbeat(g->env);
            stop next = stop_at(g, qw_lerp(point[i - 1], point[i], (float)k / (float)pieces), normal);
            if (is_closed && i + 1 == count && k == pieces)
                next = first; /* found again it might be a vertex beside it */
            if (!draw_on_a_sheet(g, now, &next, normal)) return false;
            now = next;
        }
    }
    return true;
}

qw_trimesh qw_engrave(qw_env *env, const qw_trimesh *surface, const qw_bvh *bvh, const qw_polylines *lines,
                      float length, int64_t *marked, bool *drawn)
{
    assert(surface->twin && length > 0);
    qw_scope_begin(env);
    const float *target = QW_NEW_ZERO(env, float, surface->vertex_count);
    const qw_vec3 *normal = qw_face_normals(env, surface);
    graver g = {.env = env, .bvh = bvh, .snap = SNAP_QUADS * (double)length};
    g.e = qw_edit_open(env, surface, target, qw_trimesh_outgoing(env, surface));
    for (uint32_t i = 0; i < lines->count; i++) {
        g.number = lines->number[i], g.mark = lines->mark[i];
        bool goes_on = engrave_one(&g, lines->point + lines->begin[i], lines->begin[i + 1] - lines->begin[i],
                                   lines->finer[i], normal, length / STEPS);
        if (drawn) drawn[i] = goes_on;
        else if (!goes_on)
            qw_fail(env, QW_ARGUMENT, g.number,
                    "guide %u cannot be drawn on the surface: from its point %u the next cannot be reached straight "
                    "on, as they lie on different sheets, or a boundary is between them",
                    g.number, g.point);
    }
    *marked = g.marked;
    qw_trimesh m = qw_edit_plain(&g.e, surface->point, surface->vertex_count);
    qw_scope_end(env);
    return m;
}

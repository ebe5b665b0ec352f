/* Open edges lie in a tree of boxes, which each vertex on one of them asks for those that it lies on. All these edges
 * are split at first; those of which that closes no part, or gives one three sides, are taken back until none is left.
 */
#include "remesh/clean/junctions.h"

#include "base/sort.h"
#include "geometry/box_tree.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

/* Boxes grow by so many tolerances, as they are in single precision. */
static const double GROWN = 4;
/* Edges asked, for each open edge, in all: many long edges side by side would take the square of their number. */
static const uint64_t MOST_ASKED = 256;
enum { ROUNDS = 8 };
/* Sheets slid along one another are cut differently, and their faces need not lie in one plane where they are curved;
   those that agree may be a thin blade of which each side was cut by itself. */
static const qw_fold_limits slid_rims = {0.985, 0.5}; /* 10 and 60 degrees */

typedef struct open_edge {
    uint32_t half, from, to;
    uint32_t begin, end; /* of its splits */
    bool kept;
} open_edge;

typedef struct sewing {
    qw_env *env;
    const qw_sheets *sheets;
    const uint8_t *only; /* of the call */
    double tolerance;
    open_edge *edge; /* open_edge[edges] */
    uint32_t edges;
    uint64_t *along;  /* uint64_t[2 edges]: vertex << 32 | an edge of it, sorted */
    qw_box_tree tree; /* its primitives are the edges, in their order */
    uint64_t *split;  /* uint64_t[splits]: edge << 32 | vertex */
    size_t splits, room;
    uint64_t asked;
} sewing;

static const double *point_of(const sewing *w, uint32_t v) { return w->sheets->position + 3 * (size_t)v; }

/* ---- open edges */

static uint32_t count_open(const qw_edges *edges, uint32_t vertex_count)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            count += end - i == 1;
        }
    return count;
}

/* Lists the edges with one triangle, and sorts them by their ends, both ways round. */
static void find_open_edges(sewing *w, const qw_edges *edges)
{
    const qw_sheets *s = w->sheets;
    w->edge = QW_NEW(w->env, open_edge, count_open(edges, s->vertex_count));
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            uint32_t h = qw_side_half(edges->side[i]);
            if (end - i == 1 && (!w->only || (w->only[s->corner[h]] && w->only[s->corner[qw_next(h)]])))
                w->edge[w->edges++] = (open_edge){.half = h, .from = s->corner[h], .to = s->corner[qw_next(h)]};
        }
}

static void list_along(sewing *w)
{
    w->along = QW_NEW(w->env, uint64_t, 2 * (size_t)w->edges);
    for (uint32_t e = 0; e < w->edges; e++) {
        w->along[2 * (size_t)e] = (uint64_t)w->edge[e].from << 32 | e;
        w->along[2 * (size_t)e + 1] = (uint64_t)w->edge[e].to << 32 | e;
    }
    qw_sort_u64(w->along, 2 * (size_t)w->edges);
}

static qw_vec3 single(const double *p) { return qw_v3((float)p[0], (float)p[1], (float)p[2]); }

/* Puts the edges into the order of the tree. */
static void build_tree(sewing *w)
{
    qw_box *box = QW_NEW(w->env, qw_box, w->edges);
    float grown = (float)(GROWN * w->tolerance);
    for (uint32_t e = 0; e < w->edges; e++) {
        qw_vec3 ends[2] = {single(point_of(w, w->edge[e].from)), single(point_of(w, w->edge[e].to))};
        box[e] = qw_box_of(ends, 2);
        for (int k = 0; k < 3; k++) box[e].lo[k] -= grown, box[e].hi[k] += grown;
    }
    uint32_t *order = QW_NEW(w->env, uint32_t, w->edges);
    open_edge *given = w->edge;
    w->tree = qw_box_tree_build(w->env, box, w->edges, order);
    qw_free(w->env, box);
    w->edge = QW_NEW(w->env, open_edge, w->edges);
    for (uint32_t i = 0; i < w->edges; i++) w->edge[i] = given[order[i]];
    qw_free(w->env, order), qw_free(w->env, given);
}

/* ---- vertices on them */

/* How far along the edge a point lies, of its length, and *off: its squared distance from the line. */
static double place_on(const sewing *w, const open_edge *e, const double *p, double *off)
{
    const double *a = point_of(w, e->from), *b = point_of(w, e->to);
    double length2 = 0, along = 0, t;
    for (int k = 0; k < 3; k++) length2 += (b[k] - a[k]) * (b[k] - a[k]), along += (b[k] - a[k]) * (p[k] - a[k]);
    t = length2 > 0 ? along / length2 : 0;
    *off = 0;
    for (int k = 0; k < 3; k++) {
        double d = p[k] - a[k] - t * (b[k] - a[k]);
        *off += d * d;
    }
    return t;
}

static double distance2(const double *p, const double *q)
{
    double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
    return x * x + y * y + z * z;
}

/* The first of the open edges from v, in `along`. */
static size_t first_along(const sewing *w, uint32_t v)
{
    assert(v < w->sheets->vertex_count);
    size_t begin = 0, end = 2 * (size_t)w->edges;
    while (begin < end) {
        size_t middle = begin + (end - begin) / 2;
        if (w->along[middle] >> 32 < v) begin = middle + 1;
        else end = middle;
    }
    return begin;
}

/* Whether vertex v lies inside edge e, which another open edge from v goes along, whose face goes on from that of e: no
   sliver that comes from an end of e and would be folded into it. */
static bool lies_on(const sewing *w, const open_edge *e, uint32_t v)
{
    assert(v < w->sheets->vertex_count);
    double near2 = w->tolerance * w->tolerance, off;
    const double *p = point_of(w, v);
    if (v == e->from || v == e->to) return false;
    double t = place_on(w, e, p, &off);
    if (!(t > 0 && t < 1) || off > near2 || v == w->sheets->corner[qw_prev(e->half)]) return false;
    if (distance2(p, point_of(w, e->from)) <= near2 || distance2(p, point_of(w, e->to)) <= near2) return false;
    for (size_t i = first_along(w, v); i < 2 * (size_t)w->edges && w->along[i] >> 32 == v; i++) {
        const open_edge *other = &w->edge[(uint32_t)w->along[i]];
        place_on(w, e, point_of(w, other->from == v ? other->to : other->from), &off);
        uint32_t apex = w->sheets->corner[qw_prev(other->half)];
        if (off <= near2 && apex != e->from && apex != e->to && !qw_are_layered(w->sheets, e->half, other->half) &&
            !qw_fold_back(w->sheets, e->half, other->half, &slid_rims))
            return true;
    }
    return false;
}

static void add_split(sewing *w, uint32_t e, uint32_t v)
{
    w->split = qw_grow(w->env, w->split, &w->room, w->splits + 1, sizeof *w->split);
    w->split[w->splits++] = (uint64_t)e << 32 | v;
}

static bool is_outside(const qw_box_node *n, const double *p)
{
    for (int k = 0; k < 3; k++)
        if (fabs(p[k] - (double)n->centre[k]) > (double)n->half[k]) return true;
    return false;
}

/* Notes a split of each open edge that vertex v lies on, by the tree of boxes around the edges. */
static void ask_edges(sewing *w, uint32_t v)
{
    assert(v < w->sheets->vertex_count);
    uint32_t stack[QW_BOX_STACK], top = 0;
    const double *p = point_of(w, v);
    stack[top++] = 0;
    while (top > 0) {
        const qw_box_node *n = &w->tree.nodes[stack[--top]];
        if (is_outside(n, p)) continue;
        w->asked += n->count;
        for (uint32_t i = n->first; i < n->first + n->count; i++)
            if (lies_on(w, &w->edge[i], v)) add_split(w, i, v);
        assert(top + 2 <= QW_BOX_STACK);
        if (n->count == 0) stack[top++] = n->first + 1, stack[top++] = n->first;
    }
}

/* Orders the splits of an edge by their places. */
static void order_splits(const sewing *w, open_edge *e)
{
    double off;
    for (uint32_t i = e->begin; i < e->end; i++) {
        uint32_t v = (uint32_t)w->split[i];
        double t = place_on(w, e, point_of(w, v), &off);
        w->split[i] = (uint64_t)(t * UINT32_MAX) << 32 | v;
    }
    qw_sort_u64(w->split + e->begin, e->end - e->begin);
}

/* Every vertex of an open edge asks once, in the order of the tree: what one has looked at is what the next will. False
   where there are too many edges to ask. */
static bool ask_all(sewing *w)
{
    uint8_t *has_asked = QW_NEW_ZERO(w->env, uint8_t, w->sheets->vertex_count);
    for (uint32_t i = 0; i < w->edges; i++) {
        const uint32_t ends[2] = {w->edge[i].from, w->edge[i].to};
        qw_heartbeat(w->env);
        for (int k = 0; k < 2; k++) {
            if (!has_asked[ends[k]]) ask_edges(w, ends[k]);
            has_asked[ends[k]] = 1;
        }
        if (w->asked > MOST_ASKED * ((uint64_t)w->edges + MOST_ASKED)) return false;
    }
    qw_free(w->env, has_asked);
    return true;
}

/* Finds all vertices that lie on open edges, an edge's in the order along it. False: none, or there would be too
 * many questions. */
static bool find_splits(sewing *w)
{
    if (!ask_all(w)) return false;
    qw_sort_u64(w->split, w->splits);
    for (uint32_t i = 0, end; i < w->splits; i = end) {
        open_edge *e = &w->edge[w->split[i] >> 32];
        for (end = i; end < w->splits && w->split[end] >> 32 == w->split[i] >> 32;) end++;
        e->begin = i, e->end = end, e->kept = true;
    }
    for (uint32_t e = 0; e < w->edges; e++)
        if (w->edge[e].kept) order_splits(w, &w->edge[e]);
    return w->splits > 0;
}

/* ---- the surface with them */

/* of: uint32_t[3 face_count], the split edge that each half-edge is a part of, or QW_NONE. */
typedef struct pieces {
    uint32_t *corner, *source, *of, *sheet;
    uint32_t *named, names; /* as those of the sheets */
    uint32_t count;
} pieces;

static void put(pieces *p, uint32_t at, uint32_t a, uint32_t b, uint32_t c)
{
    p->corner[3 * (size_t)at] = a, p->corner[3 * (size_t)at + 1] = b, p->corner[3 * (size_t)at + 2] = c;
}

/* Splits the edge that half-edge h of the pieces is: the face becomes a fan around the corner opposite, of which it
   stays the first. Returns the half-edge that the one after h has become. */
static uint32_t split_at(const sewing *w, pieces *p, uint32_t number, uint32_t h)
{
    assert(h < 3 * p->count);
    const open_edge *e = &w->edge[number];
    uint32_t f = h / 3, from = p->corner[h], to = p->corner[qw_next(h)], apex = p->corner[qw_prev(h)];
    uint32_t last_of = p->of[qw_next(h)], first_of = p->of[qw_prev(h)], source = p->source[f], at = f;
    const uint32_t is_named[3] = {p->named ? p->named[h] : 0, p->named ? p->named[qw_next(h)] : 0,
                                  p->named ? p->named[qw_prev(h)] : 0};
    for (uint32_t i = e->begin; i <= e->end; i++) {
        uint32_t v = i < e->end ? (uint32_t)w->split[i] : to;
        put(p, at, from, v, apex);
        p->source[at] = source;
        if (p->sheet) p->sheet[at] = p->sheet[f];
        p->of[3 * (size_t)at] = number;
        p->of[3 * (size_t)at + 1] = v == to ? last_of : QW_NONE;
        p->of[3 * (size_t)at + 2] = at == f ? first_of : QW_NONE;
        if (p->named) {
            p->named[3 * (size_t)at] = i > e->begin ? p->names++ : is_named[0];
            p->named[3 * (size_t)at + 1] = v == to ? is_named[1] : p->names;
            p->named[3 * (size_t)at + 2] = is_named[2];
        }
        from = v;
        if (i < e->end) at = p->count++;
    }
    return 3 * at + 1;
}

/* at: uint32_t[3 face_count] of the sheets: open edge of each half-edge, or QW_NONE. */
static void split_faces(const sewing *w, const uint32_t *at, pieces *p)
{
    const qw_sheets *s = w->sheets;
    memcpy(p->corner, s->corner, 3 * (size_t)s->face_count * sizeof *p->corner);
    memcpy(p->source, s->source, s->face_count * sizeof *p->source);
    if (p->sheet) memcpy(p->sheet, s->sheet, s->face_count * sizeof *p->sheet);
    memset(p->of, 0xff, 3 * (size_t)(s->face_count + w->splits) * sizeof *p->of);
    if (p->named) memcpy(p->named, s->named, 3 * (size_t)s->face_count * sizeof *p->named);
    p->names = s->names;
    p->count = s->face_count;
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t now[3] = {3 * f, 3 * f + 1, 3 * f + 2};
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t e = at[3 * (size_t)f + i];
            if (e == QW_NONE || !w->edge[e].kept) continue;
            uint32_t next = qw_next(now[i]), prev = qw_prev(now[i]), moved = split_at(w, p, e, now[i]);
            for (uint32_t k = i + 1; k < 3; k++)
                now[k] = now[k] == next ? moved : now[k] == prev ? now[i] / 3 * 3 + 2 : now[k];
        }
    }
}

/* Takes back the splits of edges of which no part is closed now, or one has more than two sides. Returns whether there
   are any. closed: uint8_t[edges]: 1 yes, 2 nonmanifold. */
static bool take_back(sewing *w, const pieces *p, uint8_t *closed)
{
    qw_edges edges = qw_edges_build(w->env, 3, p->corner, p->count, w->sheets->vertex_count);
    qw_sheets cut = *w->sheets;
    cut.corner = p->corner, cut.named = p->named, cut.sheet = p->sheet;
    memset(closed, 0, w->edges);
    for (uint32_t v = 0; v < w->sheets->vertex_count; v++)
        for (uint32_t i = edges.begin[v], end; i < edges.begin[v + 1]; i = end) {
            end = qw_edge_end(&edges, i, edges.begin[v + 1]);
            if (end - i == 2 && qw_stay_apart(&cut, qw_side_half(edges.side[i]), qw_side_half(edges.side[i + 1])))
                continue;
            for (uint32_t k = i; k < end && end - i > 1; k++) {
                uint32_t e = p->of[qw_side_half(edges.side[k])];
                if (e != QW_NONE) closed[e] |= end - i > 2 ? 2 : 1;
            }
        }
    qw_edges_free(w->env, &edges);
    bool any = false;
    for (uint32_t e = 0; e < w->edges; e++)
        if (w->edge[e].kept && closed[e] != 1) w->edge[e].kept = false, any = true;
    return any;
}

/* Splits triangles at the vertices that lie on their open edges, in rounds, until no split is taken back. Returns
 * how many splits stay. */
static uint32_t sew(sewing *w, qw_sheets *s, uint8_t *is_sewn)
{
    size_t faces = s->face_count + w->splits;
    if (faces >= QW_NONE / 3) return 0;
    uint32_t *at = QW_NEW(w->env, uint32_t, 3 * (size_t)s->face_count), sewn = 0;
    memset(at, 0xff, 3 * (size_t)s->face_count * sizeof *at);
    for (uint32_t e = 0; e < w->edges; e++) at[w->edge[e].half] = e;
    pieces p = {QW_NEW(w->env, uint32_t, 3 * faces),
                QW_NEW(w->env, uint32_t, faces),
                QW_NEW(w->env, uint32_t, 3 * faces),
                s->sheet ? QW_NEW(w->env, uint32_t, faces) : NULL,
                s->named ? QW_NEW(w->env, uint32_t, 3 * faces) : NULL,
                0,
                0};
    uint8_t *closed = QW_NEW(w->env, uint8_t, w->edges);
    bool settled = false;
    for (int round = 0; round < ROUNDS && !settled; round++) {
        split_faces(w, at, &p);
        settled = !take_back(w, &p, closed);
    }
    for (uint32_t e = 0; e < w->edges && settled; e++)
        for (uint32_t i = w->edge[e].begin; w->edge[e].kept && i < w->edge[e].end; i++)
            is_sewn[(uint32_t)w->split[i]] = is_sewn[w->edge[e].from] = is_sewn[w->edge[e].to] = 1, sewn++;
    if (sewn == 0) return 0;
    s->face_count = p.count, s->corner = p.corner, s->source = p.source, s->named = p.named, s->names = p.names;
    s->sheet = p.sheet, qw_keep(w->env, p.sheet);
    qw_keep(w->env, p.corner), qw_keep(w->env, p.source), qw_keep(w->env, p.named);
    return sewn;
}

uint32_t qw_sew_junctions(qw_env *env, qw_sheets *s, double tolerance, const qw_edges *edges, const uint8_t *only,
                          uint8_t *is_sewn)
{
    assert(tolerance > 0 && !s->twin && !s->point);
    uint32_t sewn = 0;
    qw_scope_begin(env);
    sewing w = {.env = env, .sheets = s, .only = only, .tolerance = tolerance};
    find_open_edges(&w, edges);
    if (w.edges > 0) {
        build_tree(&w);
        list_along(&w);
        if (find_splits(&w)) sewn = sew(&w, s, is_sewn);
    }
    qw_scope_end(env);
    return sewn;
}

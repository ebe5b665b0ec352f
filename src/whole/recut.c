#include "whole/recut.h"

#include "base/constants.h"
#include "base/sort.h"
#include "base/elementary.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* Attempts; in the last all arcs keep their vertices whose polygons were not sound. */
enum { CUTS = 6, LEAST_LOOP = 4 };
/* A new vertex this near to an old one, in spacings, is that. */
static const double NEAR = 0.25;
/* Cosine between the normals of a polygon before and after, at least; and the least of its area that is one, in squared
   lengths of its longest side. */
static const double TURNED = 0.3, FLAT = 1e-4;

/* From corner to corner of a rim, or all of it. */
typedef struct arc {
    uint32_t loop, first, edges; /* first: number of its first vertex in the loop */
    bool closed, keeps;          /* keeps: all vertices stay */
    bool bad;                    /* a polygon beyond it was not sound */
    uint32_t wanted;             /* edges */
    double length;
} arc;

typedef struct cutting {
    qw_env *env;
    const qw_clean_input *input;
    const uint8_t *left_out;
    const qw_old_rims *old;
    double edge;
    uint32_t *same;             /* uint32_t[input->vertex_count]: the least vertex that is one with it (rim_weld.h) */
    uint32_t *on_rim, *another; /* on_rim: uint32_t[input->vertex_count], another: uint32_t[rim vertices]: the rim
                                   vertices that are at a vertex, one by one; QW_NONE: no more */
    uint8_t *shared;            /* uint8_t[rim vertices]: polygons beyond the edge that leaves each */
    uint32_t *loop_of;          /* uint32_t[rim vertices] */
    uint32_t *arc_of;           /* uint32_t[rim vertices]: the arc that this edge is of */
    arc *arcs;
    uint32_t arc_count;
    /* of a cut */
    uint32_t *to; /* uint32_t[rim vertices]: the vertex in cut.vertex that each becomes */
    qw_recut cut;
    size_t vertex_room, along_room, made_room, corner_room, origin_room, begin_room, source_room;
    uint32_t vertex_count, corner_count;
} cutting;

static const double *position_of(const cutting *c, uint32_t id)
{
    uint32_t n = c->input->vertex_count;
    return id < n ? c->input->position + 3 * (size_t)id : c->cut.made + 3 * (size_t)(id - n);
}

static double distance(const double *p, const double *q)
{
    double d2 = 0;
    for (int k = 0; k < 3; k++) d2 += (p[k] - q[k]) * (p[k] - q[k]);
    return sqrt(d2);
}

/* ---- the rims as they are */

static uint32_t next_on_rim(const cutting *c, uint32_t i)
{
    uint32_t l = c->loop_of[i];
    return i + 1 < c->old->begin[l + 1] ? i + 1 : c->old->begin[l];
}

static uint32_t vertex_at(const cutting *c, uint32_t i)
{
    return c->old->vertex[i] == QW_NONE ? QW_NONE : c->same[c->old->vertex[i]];
}

/* The rim edge that runs from `to` to `from`, as seen from beyond, by its first rim vertex; or QW_NONE. */
static uint32_t rim_edge(const cutting *c, uint32_t from, uint32_t to)
{
    uint32_t i = c->on_rim[to];
    while (i != QW_NONE && vertex_at(c, next_on_rim(c, i)) != from) i = c->another[i];
    return i;
}

/* Where each vertex of the input is on the old rims, and which rim edges are shared by two polygons that are left
 * out. */
static void index_rims(cutting *c)
{
    uint32_t all = c->old->begin[c->old->count];
    c->on_rim = QW_NEW(c->env, uint32_t, c->input->vertex_count);
    memset(c->on_rim, 0xff, c->input->vertex_count * sizeof *c->on_rim);
    c->another = QW_NEW(c->env, uint32_t, all), c->loop_of = QW_NEW(c->env, uint32_t, all);
    c->shared = QW_NEW_ZERO(c->env, uint8_t, all), c->arc_of = QW_NEW(c->env, uint32_t, all);
    for (uint32_t l = 0; l < c->old->count; l++)
        for (uint32_t i = c->old->begin[l]; i < c->old->begin[l + 1]; i++) {
            uint32_t v = vertex_at(c, i);
            c->loop_of[i] = l, c->another[i] = QW_NONE;
            if (v != QW_NONE) c->another[i] = c->on_rim[v], c->on_rim[v] = i;
        }
    const qw_clean_input *in = c->input;
    for (uint32_t f = 0; f < in->face_count; f++) {
        if (!c->left_out[f]) continue;
        uint32_t begin = in->face_begin[f], n = in->face_begin[f + 1] - begin;
        for (uint32_t k = 0; k < n; k++) {
            uint32_t i = rim_edge(c, c->same[in->corner[begin + k]], c->same[in->corner[begin + (k + 1) % n]]);
            if (i != QW_NONE && c->shared[i] < 2) c->shared[i]++;
        }
    }
}

static uint32_t before_on_rim(const cutting *c, uint32_t i)
{
    uint32_t l = c->loop_of[i];
    return (i > c->old->begin[l] ? i : c->old->begin[l + 1]) - 1;
}

/* The point of the rim QW_CORNER_SPAN new edges after rim vertex i, or before it (way -1); no farther than all around.
 */
static void point_away(const cutting *c, uint32_t i, int way, double p[3])
{
    double left = QW_CORNER_SPAN * c->edge;
    memcpy(p, position_of(c, vertex_at(c, i)), 3 * sizeof *p);
    for (uint32_t now = i; left > 0;) {
        uint32_t next = way > 0 ? next_on_rim(c, now) : before_on_rim(c, now), v = vertex_at(c, next);
        if (v == QW_NONE || next == i) return;
        const double *q = position_of(c, v);
        double length = distance(p, q), share = length > left ? left / length : 1;
        for (int k = 0; k < 3; k++) p[k] += share * (q[k] - p[k]);
        left -= length, now = next;
    }
}

static bool turns(const double *p, const double *q, const double *r)
{
    double dot = 0;
    for (int k = 0; k < 3; k++) dot += (q[k] - p[k]) * (r[k] - q[k]);
    return dot < qw_cos(QW_CORNER_ANGLE) * distance(p, q) * distance(q, r);
}

/* Where a rim turns by more than a corner does, at the vertex and as far around as new edges are long (teeth are no
   corners), where rims meet, and where no polygon, or more than one, lies beyond.
 */
static bool is_node(const cutting *c, uint32_t before, uint32_t i)
{
    uint32_t next = next_on_rim(c, i), v = vertex_at(c, i);
    if (v == QW_NONE || vertex_at(c, before) == QW_NONE || vertex_at(c, next) == QW_NONE) return true;
    if (c->another[i] != QW_NONE || c->on_rim[v] != i) return true;
    if (c->shared[before] != 1 || c->shared[i] != 1) return true;
    const double *q = position_of(c, v);
    double far_before[3], far_after[3];
    point_away(c, i, -1, far_before), point_away(c, i, 1, far_after);
    return turns(position_of(c, vertex_at(c, before)), q, position_of(c, vertex_at(c, next))) &&
           turns(far_before, q, far_after);
}

static double edge_length(const cutting *c, uint32_t i)
{
    uint32_t a = vertex_at(c, i), b = vertex_at(c, next_on_rim(c, i));
    return a == QW_NONE || b == QW_NONE ? 0 : distance(position_of(c, a), position_of(c, b));
}

static void end_arc(cutting *c, const arc *a)
{
    c->arcs[c->arc_count] = *a;
    arc *made = &c->arcs[c->arc_count++];
    double edges = qw_floor(a->length / c->edge + 0.5);
    made->wanted = (uint32_t)fmin(fmax(edges, a->closed ? LEAST_LOOP : 1), 1e9);
}

/* A rim without a node is one arc from its first vertex on. */
static void part_loop(cutting *c, uint32_t l)
{
    uint32_t begin = c->old->begin[l], n = c->old->begin[l + 1] - begin, start = 0;
    while (start < n && !is_node(c, begin + (start + n - 1) % n, begin + start)) start++;
    bool closed = start == n;
    arc a = {.loop = l, .first = closed ? 0 : start, .closed = closed};
    for (uint32_t k = 0; k < n; k++) {
        uint32_t i = begin + ((closed ? 0 : start) + k) % n;
        c->arc_of[i] = c->arc_count;
        a.edges++, a.length += edge_length(c, i), a.keeps |= c->shared[i] != 1;
        uint32_t next = next_on_rim(c, i);
        if (k + 1 < n && !(!closed && is_node(c, i, next))) continue;
        end_arc(c, &a);
        a = (arc){.loop = l, .first = next - begin};
    }
    assert(a.edges == 0); /* each edge of the rim is in an arc */
}

/* Edges that an arc gets. */
static uint32_t edges_of(const arc *a) { return a->keeps && a->wanted < a->edges ? a->edges : a->wanted; }

/* A loop of several arcs has as many edges as one of one arc at the least: of two, they would be one. */
static void lengthen_loops(cutting *c)
{
    for (uint32_t i = 0, next; i < c->arc_count; i = next) {
        uint32_t sum = 0;
        for (next = i; next < c->arc_count && c->arcs[next].loop == c->arcs[i].loop; next++)
            sum += edges_of(&c->arcs[next]);
        for (; sum < LEAST_LOOP; sum++) {
            arc *best = &c->arcs[i];
            for (uint32_t k = i; k < next; k++)
                if (c->arcs[k].length * edges_of(best) > best->length * edges_of(&c->arcs[k])) best = &c->arcs[k];
            best->wanted = edges_of(best) + 1;
        }
    }
}

/* ---- new vertices */

static void add_vertex(cutting *c, uint32_t id, double along)
{
    c->cut.vertex = qw_grow(c->env, c->cut.vertex, &c->vertex_room, (size_t)c->vertex_count + 1, sizeof(uint32_t));
    c->cut.along = qw_grow(c->env, c->cut.along, &c->along_room, (size_t)c->vertex_count + 1, sizeof(double));
    c->cut.vertex[c->vertex_count] = id, c->cut.along[c->vertex_count++] = along;
}

/* On the edge that leaves rim vertex i, a share of the way along it. */
static uint32_t make_vertex(cutting *c, uint32_t i, double share)
{
    double p[3], q[3];
    memcpy(p, position_of(c, c->old->vertex[i]), sizeof p);
    memcpy(q, position_of(c, c->old->vertex[next_on_rim(c, i)]), sizeof q);
    c->cut.made = qw_grow(c->env, c->cut.made, &c->made_room, 3 * ((size_t)c->cut.made_count + 1), sizeof(double));
    for (int k = 0; k < 3; k++) c->cut.made[3 * (size_t)c->cut.made_count + (size_t)k] = p[k] + share * (q[k] - p[k]);
    return c->input->vertex_count + c->cut.made_count++;
}

static uint32_t rim_index(const cutting *c, const arc *a, uint32_t k)
{
    uint32_t begin = c->old->begin[a->loop], n = c->old->begin[a->loop + 1] - begin;
    return begin + (a->first + k) % n;
}

/* All vertices of the arc stay; its long edges are parted so that it gets `wanted` edges, if that is more. */
static void part_edges(cutting *c, const arc *a)
{
    uint32_t more = a->wanted > a->edges ? a->wanted - a->edges : 0;
    double passed = 0, whole = fmax(a->length, 1e-300);
    for (uint32_t k = 0, given = 0; k < a->edges; k++) {
        uint32_t i = rim_index(c, a, k);
        passed += edge_length(c, i);
        uint32_t upto = k + 1 == a->edges ? more : (uint32_t)(more * (passed / whole)), parts = upto - given + 1;
        if (c->old->vertex[i] == QW_NONE || c->old->vertex[next_on_rim(c, i)] == QW_NONE) parts = 1;
        assert(upto >= given);
        c->to[i] = c->vertex_count;
        add_vertex(c, c->old->vertex[i] == QW_NONE ? QW_NONE : c->same[c->old->vertex[i]], a->first + k);
        for (uint32_t j = 1; j < parts; j++)
            add_vertex(c, make_vertex(c, i, (double)j / parts), a->first + k + (double)j / parts);
        given = upto;
    }
}

/* As many edges as wanted, all as long; near an old vertex they end there. */
static void space_out(cutting *c, const arc *a)
{
    assert(a->wanted > 0 && a->wanted < a->edges);
    double step = a->length / a->wanted, passed = 0, length = edge_length(c, rim_index(c, a, 0));
    uint32_t k = 0, first = c->vertex_count, last_old = 0;
    add_vertex(c, c->same[c->old->vertex[rim_index(c, a, 0)]], a->first);
    for (uint32_t j = 1; j < a->wanted; j++) {
        double at = j * step;
        while (k + 1 < a->edges && passed + length < at) {
            passed += length, k++;
            length = edge_length(c, rim_index(c, a, k));
        }
        double share = length > 0 ? fmin(fmax((at - passed) / length, 0), 1) : 0;
        uint32_t near = share < 0.5 ? k : k + 1;
        bool snaps = near > last_old && near < a->edges && fabs(at - passed - (share < 0.5 ? 0 : length)) < NEAR * step;
        if (snaps) add_vertex(c, c->same[c->old->vertex[rim_index(c, a, near)]], a->first + near), last_old = near;
        else add_vertex(c, make_vertex(c, rim_index(c, a, k), share), a->first + k + share);
    }
    /* each old vertex becomes the nearest new one */
    passed = 0;
    for (k = 0; k < a->edges; k++) {
        uint32_t j = (uint32_t)(passed / step + 0.5);
        c->to[rim_index(c, a, k)] = first + j; /* that of the next arc, or the first again, where j is the last */
        if (j >= a->wanted && a->closed) c->to[rim_index(c, a, k)] = first;
        passed += edge_length(c, rim_index(c, a, k));
    }
}

/* The vertices of the new rims, arc by arc: those of the input where an arc keeps them, else spaced out evenly. */
static void make_vertices(cutting *c)
{
    c->vertex_count = 0, c->cut.made_count = 0;
    for (uint32_t i = 0; i < c->arc_count; i++) {
        const arc *a = &c->arcs[i];
        if (i == 0 || a->loop != c->arcs[i - 1].loop) c->cut.begin[a->loop] = c->vertex_count;
        if (a->keeps || a->wanted >= a->edges) part_edges(c, a);
        else space_out(c, a);
    }
    c->cut.begin[c->old->count] = c->vertex_count;
    for (uint32_t i = 0; i < c->old->begin[c->old->count]; i++) { /* beyond the last of a loop is its first */
        uint32_t l = c->loop_of[i];
        assert(c->to[i] >= c->cut.begin[l]);
        if (c->to[i] >= c->cut.begin[l + 1]) c->to[i] = c->cut.begin[l];
    }
}

/* ---- polygons */

static void add_corner(cutting *c, uint32_t first, uint32_t id, uint32_t origin)
{
    if (c->corner_count > first && c->cut.corner[c->corner_count - 1] == id) return;
    c->cut.corner = qw_grow(c->env, c->cut.corner, &c->corner_room, (size_t)c->corner_count + 1, sizeof(uint32_t));
    c->cut.origin = qw_grow(c->env, c->cut.origin, &c->origin_room, (size_t)c->corner_count + 1, sizeof(uint32_t));
    c->cut.corner[c->corner_count] = id, c->cut.origin[c->corner_count++] = origin;
}

static void end_face(cutting *c, uint32_t source)
{
    uint32_t faces = c->cut.face_count + 1;
    c->cut.face_begin = qw_grow(c->env, c->cut.face_begin, &c->begin_room, (size_t)faces + 1, sizeof(uint32_t));
    c->cut.source = qw_grow(c->env, c->cut.source, &c->source_room, faces, sizeof(uint32_t));
    c->cut.face_begin[faces] = c->corner_count, c->cut.source[faces - 1] = source, c->cut.face_count = faces;
}

/* The rim vertex at a corner of a polygon; where several are, that whose rim edge the polygon has beside it. */
static uint32_t rim_vertex_of(const cutting *c, uint32_t v, uint32_t before, uint32_t after)
{
    uint32_t i = rim_edge(c, v, after), k;
    if (i != QW_NONE) return next_on_rim(c, i);
    k = rim_edge(c, before, v);
    return k != QW_NONE ? k : c->on_rim[v];
}

/* Edges of a polygon that are parted now: how many, and of the last one at which corner it begins, and its pieces. */
typedef struct parting {
    uint32_t edges, begin, pieces;
} parting;

/* The corners of polygon f as they are after the cut, from c->corner_count on; returns how many there are. */
static uint32_t cut_corners(cutting *c, uint32_t f, parting *p)
{
    const qw_clean_input *in = c->input;
    uint32_t begin = in->face_begin[f], n = in->face_begin[f + 1] - begin, first = c->corner_count;
    *p = (parting){0, 0, 1};
    for (uint32_t k = 0; k < n; k++) {
        uint32_t v = c->same[in->corner[begin + k]], before = c->same[in->corner[begin + (k + n - 1) % n]],
                 after = c->same[in->corner[begin + (k + 1) % n]], i = rim_edge(c, v, after);
        uint32_t rim = c->on_rim[v] == QW_NONE ? QW_NONE : rim_vertex_of(c, v, before, after);
        add_corner(c, first, rim == QW_NONE ? in->corner[begin + k] : c->cut.vertex[c->to[rim]], begin + k);
        if (i == QW_NONE || c->shared[i] != 1) continue;
        uint32_t l = c->loop_of[i], low = c->to[i], high = c->to[next_on_rim(c, i)], count;
        uint32_t all = c->cut.begin[l + 1] - c->cut.begin[l], base = c->cut.begin[l];
        count = (high + all - low) % all; /* edges of the new rim from low to high */
        if (count > 1) p->begin = c->corner_count - 1 - first, p->pieces = count, p->edges++;
        for (uint32_t j = count; j-- > 1;)
            add_corner(c, first, c->cut.vertex[base + (low - base + j) % all],
                       begin + (2 * j > count ? k : (k + 1) % n));
    }
    while (c->corner_count > first + 1 && c->cut.corner[c->corner_count - 1] == c->cut.corner[first]) c->corner_count--;
    assert(c->corner_count > first);
    return c->corner_count - first;
}

/* The area vector of a polygon, and its longest edge. */
static void normal_of(const cutting *c, const uint32_t *corner, uint32_t n, double normal[3], double *longest)
{
    assert(n >= 3);
    const double *o = position_of(c, corner[0]);
    memset(normal, 0, 3 * sizeof *normal), *longest = 0;
    for (uint32_t k = 0; k < n; k++) {
        const double *p = position_of(c, corner[k]), *q = position_of(c, corner[(k + 1) % n]);
        *longest = fmax(*longest, distance(p, q));
        for (int i = 0; i < 3; i++) {
            int y = (i + 1) % 3, z = (i + 2) % 3;
            normal[i] += ((p[y] - o[y]) * (q[z] - o[z]) - (p[z] - o[z]) * (q[y] - o[y])) / 2;
        }
    }
}

/* Whether it faces as the polygon of the input did, and has an area. */
static bool is_sound(const cutting *c, const uint32_t *corner, uint32_t n, const double before[3])
{
    double now[3], longest, dot = 0, is = 0, was = 0;
    normal_of(c, corner, n, now, &longest);
    for (int k = 0; k < 3; k++) dot += now[k] * before[k], is += now[k] * now[k], was += before[k] * before[k];
    return was == 0 || (sqrt(is) > FLAT * longest * longest && dot > TURNED * sqrt(is) * sqrt(was));
}

/* Triangles from the corner after a parted edge to its pieces, and what is left of the polygon, whose n corners lie
   from `first` on. */
static void fan_out(cutting *c, uint32_t first, uint32_t n, const parting *p, uint32_t source)
{
    uint32_t *corner = QW_NEW(c->env, uint32_t, n), *origin = QW_NEW(c->env, uint32_t, n), apex = p->pieces + 1;
    assert(p->pieces > 1 && apex < n);
    for (uint32_t k = 0; k < n; k++) { /* from the beginning of the edge on */
        corner[k] = c->cut.corner[first + (p->begin + k) % n];
        origin[k] = c->cut.origin[first + (p->begin + k) % n];
    }
    c->corner_count = first;
    for (uint32_t k = 0; k < p->pieces; k++) {
        uint32_t begin = c->corner_count;
        add_corner(c, begin, corner[k], origin[k]), add_corner(c, begin, corner[k + 1], origin[k + 1]);
        add_corner(c, begin, corner[apex], origin[apex]);
        end_face(c, source);
    }
    uint32_t begin = c->corner_count;
    for (uint32_t k = apex; k <= n && apex + 1 < n; k++) add_corner(c, begin, corner[k % n], origin[k % n]);
    if (apex + 1 < n) end_face(c, source);
    qw_free(c->env, corner), qw_free(c->env, origin);
}

/* All arcs that end at or run along the polygon. */
static void blame(cutting *c, uint32_t f)
{
    const qw_clean_input *in = c->input;
    for (uint32_t k = in->face_begin[f]; k < in->face_begin[f + 1]; k++)
        for (uint32_t i = c->on_rim[c->same[in->corner[k]]]; i != QW_NONE; i = c->another[i]) {
            uint32_t begin = c->old->begin[c->loop_of[i]],
                     before = i > begin ? i - 1 : c->old->begin[c->loop_of[i] + 1] - 1;
            c->arcs[c->arc_of[i]].bad = c->arcs[c->arc_of[before]].bad = true;
        }
}

/* Cuts polygon f, which lies beside a rim, to the new one; blames the arcs where that leaves it unsound. */
static void cut_polygon(cutting *c, uint32_t f)
{
    assert(f < c->input->face_count);
    const qw_clean_input *in = c->input;
    uint32_t begin = in->face_begin[f], size = in->face_begin[f + 1] - begin, first = c->corner_count;
    double before[3], longest;
    parting p;
    normal_of(c, in->corner + begin, size, before, &longest);
    uint32_t n = cut_corners(c, f, &p), from = c->cut.face_count;
    if (n < 3) { /* its side along the rim is a point now */
        c->corner_count = first;
        return;
    }
    if (p.edges == 1 && p.pieces + 1 < n) fan_out(c, first, n, &p, f);
    else end_face(c, f);
    bool changed = n != size || p.edges > 0;
    for (uint32_t k = 0; k < n && !changed; k++) changed = c->cut.corner[first + k] != c->same[in->corner[begin + k]];
    for (uint32_t g = from; changed && g < c->cut.face_count; g++)
        if (!is_sound(c, c->cut.corner + c->cut.face_begin[g], c->cut.face_begin[g + 1] - c->cut.face_begin[g], before))
            blame(c, f);
}

static uint64_t edge_key(const cutting *c, uint32_t g, uint32_t k)
{
    const uint32_t *corner = c->cut.corner + c->cut.face_begin[g];
    uint32_t n = c->cut.face_begin[g + 1] - c->cut.face_begin[g];
    return (uint64_t)corner[k] << 32 | corner[(k + 1) % n];
}

/* Where two polygons have an edge the same way, or one is left of two that were folded onto one another. */
static void blame_doubles(cutting *c)
{
    uint32_t sides = c->corner_count;
    uint64_t *key = QW_NEW(c->env, uint64_t, sides);
    for (uint32_t g = 0, to = 0; g < c->cut.face_count; g++)
        for (uint32_t k = 0; k < c->cut.face_begin[g + 1] - c->cut.face_begin[g]; k++) key[to++] = edge_key(c, g, k);
    qw_sort_u64(key, sides);
    for (uint32_t g = 0; g < c->cut.face_count; g++)
        for (uint32_t k = 0; k < c->cut.face_begin[g + 1] - c->cut.face_begin[g]; k++) {
            uint64_t one = edge_key(c, g, k);
            size_t low = qw_first_not_below(key, sides, one);
            if (low + 1 < sides && key[low + 1] == one) blame(c, c->cut.source[g]);
        }
    qw_free(c->env, key);
}

/* ---- all */

/* One edge more where those of a component are an odd number: on its longest arc that may have one. */
static void even_out(cutting *c)
{
    uint32_t most = 0;
    for (uint32_t l = 0; l < c->old->count; l++) most = c->old->component[l] > most ? c->old->component[l] : most;
    uint32_t *edges = QW_NEW_ZERO(c->env, uint32_t, (size_t)most + 1);
    arc **longest = QW_NEW_ZERO(c->env, arc *, (size_t)most + 1);
    for (uint32_t i = 0; i < c->arc_count; i++) {
        arc *a = &c->arcs[i];
        uint32_t p = c->old->component[a->loop];
        edges[p] += edges_of(a);
        if (a->length > 0 && (!longest[p] || a->length > longest[p]->length)) longest[p] = a;
    }
    for (uint32_t p = 0; p <= most; p++) {
        arc *a = longest[p];
        if (edges[p] % 2 == 0 || !a) continue;
        a->wanted = edges_of(a) + 1;
    }
    qw_free(c->env, edges), qw_free(c->env, longest);
}

/* Cuts all polygons beside the rims for the vertices that arcs want now. Returns whether all are sound; else the arcs
 * beside those that are not are marked as bad, to be cut otherwise next time. */
static bool cut_once(cutting *c)
{
    bool sound = true;
    c->cut.face_count = c->corner_count = 0;
    even_out(c);
    make_vertices(c);
    for (uint32_t i = 0; i < c->arc_count; i++) c->arcs[i].bad = false;
    for (uint32_t f = 0; f < c->input->face_count; f++)
        if (c->left_out[f]) cut_polygon(c, f);
    blame_doubles(c);
    for (uint32_t i = 0; i < c->arc_count; i++) sound &= !c->arcs[i].bad || c->arcs[i].keeps;
    return sound;
}

qw_recut qw_recut_rims(qw_env *env, const qw_clean_input *input, const uint8_t *left_out, const qw_old_rims *rims,
                       double edge)
{
    assert(edge > 0 && rims->count > 0 && left_out);
    uint32_t all = rims->begin[rims->count];
    cutting c = {.env = env, .input = input, .left_out = left_out, .old = rims, .edge = edge};
    c.same = qw_weld_along_rims(env, input, left_out, rims);
    index_rims(&c);
    c.arcs = QW_NEW_ZERO(env, arc, all), c.to = QW_NEW(env, uint32_t, all);
    c.cut.begin = QW_NEW(env, uint32_t, (size_t)rims->count + 1);
    c.cut.face_begin = qw_grow(env, NULL, &c.begin_room, 1, sizeof(uint32_t));
    c.cut.face_begin[0] = 0;
    for (uint32_t l = 0; l < rims->count; l++) part_loop(&c, l);
    lengthen_loops(&c);
    for (int cut = 1; !cut_once(&c) && cut <= CUTS; cut++)
        for (uint32_t i = 0; i < c.arc_count; i++) {
            arc *a = &c.arcs[i];
            if (!a->bad) continue;
            a->wanted *= 2;
            a->keeps |= a->wanted >= a->edges || cut + 1 == CUTS;
        }
    return c.cut;
}

/* Triangulation of polygons: quads along the better diagonal, larger polygons by ear clipping in the plane of their
 * area vector.
 *
 * An ear is a corner that turns left and whose triangle holds no other reflex corner of what is left of the polygon.
 * After an ear the search goes on one corner further, so that a convex polygon falls into balanced triangles and not
 * into a fan of slivers. A corner is never cut off where only two polygons meet that also share both edges there (a
 * doublet): if both did so, the two triangles would be one. Where nothing is left but flat corners (collinear
 * polygons), or no corner qualifies (polygons that cross themselves), the demands are lowered: the number of triangles
 * and their edges to the neighbours are right in any case. */
#include "geometry/triangulate.h"

#include "base/sort.h"
#include "base/vec.h"

#include <assert.h>
#include <math.h>

typedef struct point {
    double x, y;
} point;

typedef struct ring {
    uint32_t *next, *previous; /* uint32_t[n] */
    point *p;                  /* point[n]: the polygon, seen against its area vector */
    uint8_t *reflex;           /* uint8_t[n]: turns right or not at all */
    uint32_t *reflex_list;     /* uint32_t[n]: those that were so at first; the others never become so */
    uint32_t reflex_count;
    double flat;     /* twice the area below which a corner counts as flat */
    uint64_t budget; /* tests left for this polygon */
} ring;

/* Polygons with many thousands of corners, most of them reflex, would take quadratic time or worse. Past so many tests
   ears are cut without looking whether others lie inside: overlapping triangles, but the right topology. */
static const uint64_t EAR_TESTS = 200u * 1000 * 1000;

static void difference(const double *a, const double *b, double *d)
{
    for (int k = 0; k < 3; k++) d[k] = a[k] - b[k];
}

/* Cosine between the normals of the two triangles on either side of the diagonal from a to c. */
static double diagonal_flatness(const double *a, const double *b, const double *c, const double *d)
{
    double ab[3], ac[3], ad[3], left[3], right[3];
    difference(b, a, ab);
    difference(c, a, ac);
    difference(d, a, ad);
    qw_cross_doubles(ab, ac, left);
    qw_cross_doubles(ac, ad, right);
    double scale = sqrt(qw_dot_doubles(left, left) * qw_dot_doubles(right, right));
    return scale > 0 ? qw_dot_doubles(left, right) / scale : 0;
}

static double distance2(const double *a, const double *b)
{
    double d[3];
    difference(a, b, d);
    return qw_dot_doubles(d, d);
}

/* Squared lengths that differ by less than this share are equal. */
static const double EQUAL = 1e-6;
/* A polygon whose area is below this share of its squared extent has no plane; a corner whose area is below FLAT of it
   is straight. */
static const double LEAST_AREA = 1e-12, FLAT = 1e-14;

/* How far the way from a to c leads along a direction that is none of a model's own. */
static double slant(const double *a, const double *c)
{
    return fabs(0.71 * (c[0] - a[0]) + 0.53 * (c[1] - a[1]) + 0.46 * (c[2] - a[2]));
}

/* Whether the diagonal from corner 1 to corner 3 is better than the one from 0 to 2: the one that cuts off no doublet,
   else leaves no fold, else the shorter. Of equal ones, with a margin, their directions choose: the quads of a grid are
   all cut alike, and so are two that lie on one another, whatever their first corners and orientations. */
static bool cut_from_1_to_3(const double *position, const uint8_t *doublet, const uint32_t *corner)
{
    bool at_even = doublet[corner[0]] || doublet[corner[2]], at_odd = doublet[corner[1]] || doublet[corner[3]];
    if (at_even != at_odd) return at_odd;
    const double *p[4];
    for (int i = 0; i < 4; i++) p[i] = position + 3 * (size_t)corner[i];
    double even = diagonal_flatness(p[0], p[1], p[2], p[3]), odd = diagonal_flatness(p[1], p[2], p[3], p[0]);
    if ((even > 0) != (odd > 0)) return odd > 0;
    double odd_length = distance2(p[1], p[3]), even_length = distance2(p[0], p[2]), margin = EQUAL * even_length;
    if (fabs(odd_length - even_length) > margin) return odd_length < even_length;
    return slant(p[1], p[3]) > slant(p[0], p[2]);
}

static uint32_t *emit(uint32_t *out, uint32_t a, uint32_t b, uint32_t c)
{
    out[0] = a;
    out[1] = b;
    out[2] = c;
    return out + 3;
}

/* ---- ear clipping */

static double turn(const point *a, const point *b, const point *c)
{
    return (b->x - a->x) * (c->y - a->y) - (b->y - a->y) * (c->x - a->x);
}

/* Projects the polygon on the plane orthogonal to its area vector (Newell). False where it has none. */
static bool project(const double *position, const uint32_t *corner, uint32_t n, ring *r)
{
    const double *origin = position + 3 * (size_t)corner[0];
    double area[3] = {0, 0, 0}, u[3], w[3], extent = 0;
    for (uint32_t i = 1; i + 1 < n; i++) {
        double a[3], b[3], c[3];
        difference(position + 3 * (size_t)corner[i], origin, a);
        difference(position + 3 * (size_t)corner[i + 1], origin, b);
        qw_cross_doubles(a, b, c);
        for (int k = 0; k < 3; k++) area[k] += c[k];
        extent = fmax(extent, fmax(qw_dot_doubles(a, a), qw_dot_doubles(b, b)));
    }
    double size = sqrt(qw_dot_doubles(area, area));
    if (!(size > LEAST_AREA * extent) || !isfinite(size)) return false;
    for (int k = 0; k < 3; k++) area[k] /= size;
    int axis = 0; /* along which the normal is shortest */
    for (int k = 1; k < 3; k++)
        if (fabs(area[k]) < fabs(area[axis])) axis = k;
    double e[3] = {axis == 0, axis == 1, axis == 2};
    qw_cross_doubles(area, e, u);
    double length = sqrt(qw_dot_doubles(u, u));
    for (int k = 0; k < 3; k++) u[k] /= length;
    qw_cross_doubles(area, u, w);
    for (uint32_t i = 0; i < n; i++) {
        double a[3];
        difference(position + 3 * (size_t)corner[i], origin, a);
        r->p[i] = (point){qw_dot_doubles(a, u), qw_dot_doubles(a, w)};
    }
    r->flat = FLAT * extent;
    return true;
}

/* Links the corners of a polygon to a ring and lists the reflex ones. */
static void begin_ring(ring *r, uint32_t n)
{
    assert(n >= 3);
    r->reflex_count = 0;
    r->budget = EAR_TESTS;
    for (uint32_t i = 0; i < n; i++) {
        r->next[i] = i + 1 < n ? i + 1 : 0;
        r->previous[i] = i > 0 ? i - 1 : n - 1;
    }
    for (uint32_t i = 0; i < n; i++) {
        r->reflex[i] = turn(&r->p[r->previous[i]], &r->p[i], &r->p[r->next[i]]) <= r->flat;
        if (r->reflex[i]) r->reflex_list[r->reflex_count++] = i;
    }
}

static bool same_point(const point *a, const point *b) { return a->x == b->x && a->y == b->y; }

/* Whether the triangle cut off at corner b is free of other corners. Only corners that are still reflex can be in the
   way; those at the triangle's own corners (polygons that touch themselves, as around a hole) are not. */
static bool ear_is_empty(ring *r, uint32_t b)
{
    const point *pa = &r->p[r->previous[b]], *pb = &r->p[b], *pc = &r->p[r->next[b]];
    uint32_t kept = 0;
    bool empty = true;
    for (uint32_t k = 0; k < r->reflex_count; k++) {
        uint32_t i = r->reflex_list[k];
        if (!r->reflex[i]) continue; /* cut off or convex by now: leave the list */
        r->reflex_list[kept++] = i;
        const point *q = &r->p[i];
        if (!empty || same_point(q, pa) || same_point(q, pb) || same_point(q, pc)) continue;
        empty = turn(pa, pb, q) < 0 || turn(pb, pc, q) < 0 || turn(pc, pa, q) < 0;
    }
    r->budget -= r->budget < r->reflex_count ? r->budget : r->reflex_count;
    r->reflex_count = kept;
    return empty;
}

/* What a corner must be to be cut: 0 a real ear, 1 a flat corner will do, 2 anything. */
static bool may_cut(ring *r, uint32_t b, bool doublet, int demand)
{
    if (demand == 2) return true;
    if (doublet) return false;
    double t = turn(&r->p[r->previous[b]], &r->p[b], &r->p[r->next[b]]);
    if (demand == 0 ? t <= r->flat : t < -r->flat) return false;
    return r->budget == 0 || ear_is_empty(r, b);
}

static void update_reflex(ring *r, uint32_t i)
{
    if (r->reflex[i]) r->reflex[i] = turn(&r->p[r->previous[i]], &r->p[i], &r->p[r->next[i]]) <= r->flat;
}

/* Cuts ears off a plane polygon until a triangle is left. Where no ear may be cut less is demanded. Returns the end
 * of what was written to `out`. */
static uint32_t *clip_ears(ring *r, const uint8_t *doublet, const uint32_t *corner, uint32_t n, uint32_t *out)
{
    assert(n >= 3 && out);
    uint32_t b = 0, left = n, tried = 0;
    int demand = 0;
    begin_ring(r, n);
    while (left > 3) {
        uint32_t before = r->previous[b], after = r->next[b];
        if (!may_cut(r, b, doublet[corner[b]], demand)) {
            b = after;
            if (++tried >= left) {
                demand++;
                tried = 0;
            }
            if (r->budget > 0) r->budget--;
            continue;
        }
        out = emit(out, corner[before], corner[b], corner[after]);
        r->next[before] = after;
        r->previous[after] = before;
        r->reflex[b] = 0;
        update_reflex(r, before);
        update_reflex(r, after);
        b = r->next[after];
        left--;
        demand = 0;
        tried = 0;
    }
    return emit(out, corner[r->previous[b]], corner[b], corner[r->next[b]]);
}

/* ---- faces */

/* Corners of a polygon, 0 where it is left out. */
static uint32_t size_of(const qw_clean_input *input, uint32_t f)
{
    return input->left_out && input->left_out[f] ? 0 : input->face_begin[f + 1] - input->face_begin[f];
}

/* Doublets: uint8_t[vertex_count]. The two neighbours of a corner in its polygon are kept for the first of a vertex's
   polygons and compared with those in the second. */
static uint8_t *find_doublets(qw_env *env, const qw_clean_input *input)
{
    uint8_t *polygons = QW_NEW_ZERO(env, uint8_t, input->vertex_count); /* 3: more than two, or no doublet */
    uint64_t *neighbours = QW_NEW(env, uint64_t, input->vertex_count);
    for (uint32_t f = 0; f < input->face_count; f++) {
        const uint32_t *corner = input->corner + input->face_begin[f];
        uint32_t n = size_of(input, f);
        for (uint32_t i = 0; n >= 3 && i < n; i++) {
            uint32_t v = corner[i], a = corner[i > 0 ? i - 1 : n - 1], b = corner[i + 1 < n ? i + 1 : 0];
            uint64_t pair = qw_pair_key(a, b);
            if (polygons[v] == 0) neighbours[v] = pair;
            polygons[v] = polygons[v] == 0 ? 1 : polygons[v] == 1 && neighbours[v] == pair ? 2 : 3;
        }
    }
    for (uint32_t v = 0; v < input->vertex_count; v++) polygons[v] = polygons[v] == 2;
    qw_free(env, neighbours);
    return polygons;
}

/* A polygon as triangles: along the better diagonal, by ears, or, where it has no plane, as a fan. Returns the end
 * of what was written. */
static uint32_t *triangulate_face(const double *position, const uint8_t *doublet, const uint32_t *corner, uint32_t n,
                                  ring *r, uint32_t *out)
{
    assert(corner && out);
    if (n == 3) return emit(out, corner[0], corner[1], corner[2]);
    if (n == 4) {
        uint32_t s = cut_from_1_to_3(position, doublet, corner);
        out = emit(out, corner[s], corner[s + 1], corner[s + 2]);
        return emit(out, corner[s], corner[s + 2], corner[(s + 3) % 4]);
    }
    if (project(position, corner, n, r)) return clip_ears(r, doublet, corner, n, out);
    for (uint32_t i = 1; i + 1 < n; i++) out = emit(out, corner[0], corner[i], corner[i + 1]);
    return out;
}

qw_triangles qw_triangulate(qw_env *env, const qw_clean_input *input)
{
    uint64_t count = 0;
    uint32_t largest = 0;
    for (uint32_t f = 0; f < input->face_count; f++) {
        uint32_t n = size_of(input, f);
        if (n >= 3) count += n - 2;
        if (n > largest) largest = n;
    }
    if (count >= QW_NONE / 3)
        qw_fail(env, QW_TOO_LARGE, -1, "%llu triangles are more than can be addressed", (unsigned long long)count);
    qw_triangles t = {.count = (uint32_t)count};
    t.corner = QW_NEW(env, uint32_t, 3 * count);
    t.source = QW_NEW(env, uint32_t, count);
    qw_scope_begin(env);
    const uint8_t *doublet = largest > 3 ? find_doublets(env, input) : NULL;
    if (largest <= 4) largest = 0; /* no ring needed */
    ring r = {.next = QW_NEW(env, uint32_t, largest),
              .previous = QW_NEW(env, uint32_t, largest),
              .p = QW_NEW(env, point, largest),
              .reflex = QW_NEW(env, uint8_t, largest),
              .reflex_list = QW_NEW(env, uint32_t, largest)};
    uint32_t *out = t.corner;
    for (uint32_t f = 0; f < input->face_count; f++) {
        uint32_t begin = input->face_begin[f], n = size_of(input, f);
        if (n < 3) continue;
        size_t first = (size_t)(out - t.corner) / 3;
        out = triangulate_face(input->position, doublet, input->corner + begin, n, &r, out);
        for (uint32_t i = 0; i + 2 < n; i++) t.source[first + i] = f;
    }
    assert((size_t)(out - t.corner) == 3 * count);
    qw_scope_end(env);
    return t;
}

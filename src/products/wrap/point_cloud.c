#include "products/wrap/point_cloud.h"

#include "base/axes.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    NEAREST = 24,    /* neighbours that are looked at */
    PLANE = 12,      /* of them, those that the tangent plane is fitted to */
    MOST_SIDES = 16, /* of a Voronoi cell */
    LEAF = 8,
    DEPTH = 64
};
/* Of the distance of the neighbour number PLANE: a Voronoi cell is cut off there, so that no triangle spans a gap. */
static const double REACH = 1.0;

/* ---- the nearest points: a tree that halves the points along the longest side of their box */

typedef struct tree {
    const double *position; /* double[points][3]: no coordinate above 1 */
    uint32_t *order;        /* uint32_t[count]: one point of each place; the range of a node is halved at its middle */
    uint8_t *axis;          /* uint8_t[count]: at the middle of each range */
    uint32_t count;
} tree;

static double at(const tree *t, uint32_t i, int axis) { return t->position[3 * (size_t)t->order[i] + (size_t)axis]; }

static bool before(const tree *t, uint32_t a, uint32_t b, int axis)
{
    double x = t->position[3 * (size_t)a + (size_t)axis], y = t->position[3 * (size_t)b + (size_t)axis];
    return x < y || (x == y && a < b);
}

/* Brings the point that belongs there to `middle`, smaller ones before it and larger ones after (Hoare's selection). */
static void select_middle(tree *t, uint32_t begin, uint32_t end, uint32_t middle, int axis)
{
    int64_t low = begin, high = (int64_t)end - 1;
    while (low < high) {
        uint32_t pivot = t->order[middle];
        int64_t i = low, j = high;
        while (i <= j) {
            while (before(t, t->order[i], pivot, axis)) i++;
            while (before(t, pivot, t->order[j], axis)) j--;
            if (i > j) break;
            uint32_t other = t->order[i];
            t->order[i++] = t->order[j], t->order[j--] = other;
        }
        if (j < middle) low = i;
        if (middle < i) high = j;
    }
}

typedef struct span {
    uint32_t begin, end;
} span;

static int longest_axis(const tree *t, span s)
{
    double low[3], high[3];
    int axis = 0;
    for (int k = 0; k < 3; k++) {
        low[k] = high[k] = at(t, s.begin, k);
        for (uint32_t i = s.begin + 1; i < s.end; i++)
            low[k] = fmin(low[k], at(t, i, k)), high[k] = fmax(high[k], at(t, i, k));
        if (high[k] - low[k] > high[axis] - low[axis]) axis = k;
    }
    return axis;
}

/* The coordinates times a power of two that brings the largest below 1, so that no square of a distance overflows. */
static double *scaled(qw_env *env, const double *position, uint32_t count)
{
    double *p = QW_NEW(env, double, 3 * (size_t)count), most = 0;
    int exponent;
    for (size_t i = 0; i < 3 * (size_t)count; i++) most = fmax(most, fabs(position[i]));
    frexp(most, &exponent);
    for (size_t i = 0; i < 3 * (size_t)count; i++) p[i] = ldexp(position[i], -exponent);
    return p;
}

typedef struct place {
    double at[3];
    uint32_t point;
} place;

static int by_place(const void *a, const void *b)
{
    const place *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->at[k] != y->at[k]) return x->at[k] < y->at[k] ? -1 : 1;
    return x->point < y->point ? -1 : x->point > y->point;
}

/* The first point of each place, as scanners write thousands at 0 0 0 where they have seen nothing. Returns how many.
 */
static uint32_t list_places(qw_env *env, const double *position, uint32_t count, uint32_t *first)
{
    qw_scope_begin(env);
    place *list = QW_NEW(env, place, count);
    uint32_t places = 0;
    for (uint32_t i = 0; i < count; i++) {
        memcpy(list[i].at, position + 3 * (size_t)i, sizeof list[i].at);
        list[i].point = i;
    }
    qsort(list, count, sizeof *list, by_place);
    for (uint32_t i = 0; i < count; i++) {
        bool is_again = true;
        for (int k = 0; k < 3; k++) is_again = is_again && i > 0 && list[i].at[k] == list[i - 1].at[k];
        if (!is_again) first[places++] = list[i].point;
    }
    qw_scope_end(env);
    return places;
}

/* position: as of the tree. */
static tree grow_tree(qw_env *env, const double *position, uint32_t count)
{
    tree t = {position, QW_NEW(env, uint32_t, count), QW_NEW_ZERO(env, uint8_t, count), 0};
    span stack[DEPTH];
    int depth = 0;
    count = t.count = list_places(env, position, count, t.order);
    stack[depth++] = (span){0, count};
    while (depth > 0) {
        span s = stack[--depth];
        if (s.end - s.begin <= LEAF) continue;
        uint32_t middle = s.begin + (s.end - s.begin) / 2;
        t.axis[middle] = (uint8_t)longest_axis(&t, s);
        select_middle(&t, s.begin, s.end, middle, t.axis[middle]);
        stack[depth++] = (span){s.begin, middle}, stack[depth++] = (span){middle + 1, s.end};
        assert(depth < DEPTH);
        qw_break_silence(env);
    }
    return t;
}

typedef struct nearest {
    double distance2[NEAREST];
    uint32_t point[NEAREST];
    int count;
} nearest;

/* Others at the same place do not count. */
static void offer(const tree *t, const double p[3], uint32_t point, nearest *n)
{
    const double *q = t->position + 3 * (size_t)point;
    double d2 = (q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1]) + (q[2] - p[2]) * (q[2] - p[2]);
    if (!(d2 > 0) || (n->count == NEAREST && d2 >= n->distance2[NEAREST - 1])) return;
    int i = n->count < NEAREST ? n->count++ : NEAREST - 1;
    for (; i > 0 && (n->distance2[i - 1] > d2 || (n->distance2[i - 1] == d2 && n->point[i - 1] > point)); i--)
        n->distance2[i] = n->distance2[i - 1], n->point[i] = n->point[i - 1];
    n->distance2[i] = d2, n->point[i] = point;
}

static void find_nearest(const tree *t, const double p[3], nearest *n)
{
    struct {
        span s;
        double far2; /* no point of the span is nearer */
    } stack[DEPTH];
    int depth = 0;
    n->count = 0;
    stack[depth].s = (span){0, t->count}, stack[depth++].far2 = 0;
    while (depth > 0) {
        span s = stack[--depth].s;
        if (n->count == NEAREST && stack[depth].far2 > n->distance2[NEAREST - 1]) continue;
        if (s.end - s.begin <= LEAF) {
            for (uint32_t i = s.begin; i < s.end; i++) offer(t, p, t->order[i], n);
            continue;
        }
        uint32_t middle = s.begin + (s.end - s.begin) / 2;
        double off = p[t->axis[middle]] - at(t, middle, t->axis[middle]), far2 = fmax(stack[depth].far2, off * off);
        span low = {s.begin, middle}, high = {middle + 1, s.end};
        double near2 = stack[depth].far2;
        offer(t, p, t->order[middle], n);
        stack[depth].s = off < 0 ? high : low, stack[depth++].far2 = far2;
        stack[depth].s = off < 0 ? low : high, stack[depth++].far2 = near2;
    }
}

/* ---- the star of a point */

/* Two axes of the plane in which the neighbours lie most nearly. */
static void tangent_axes(const double *position, const double p[3], const nearest *n, double x[3], double y[3])
{
    double m[3][3] = {{0}}, axis[3][3];
    int count = n->count < PLANE ? n->count : PLANE, flat = 0;
    double scale = 1 / n->distance2[count - 1];
    for (int i = 0; i < count; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                const double *q = position + 3 * (size_t)n->point[i];
                m[a][b] += (q[a] - p[a]) * (q[b] - p[b]) * scale;
            }
    qw_principal_axes(m, axis);
    for (int k = 1; k < 3; k++)
        if (m[k][k] < m[flat][flat]) flat = k;
    memcpy(x, axis[(flat + 1) % 3], 3 * sizeof *x), memcpy(y, axis[(flat + 2) % 3], 3 * sizeof *y);
}

typedef struct side {
    double x, y;     /* the corner where the side begins */
    uint32_t beyond; /* the point on its other side, or QW_NONE: the cell was cut off there */
} side;

/* Takes from the cell, about 0, what is nearer to (x, y). */
static int cut_cell(side *cell, int count, double x, double y, uint32_t point)
{
    side kept[MOST_SIDES + 2];
    double half = (x * x + y * y) / 2;
    int n = 0;
    for (int i = 0; i < count; i++) {
        const side *a = &cell[i], *b = &cell[(i + 1) % count];
        double from = a->x * x + a->y * y - half, to = b->x * x + b->y * y - half; /* above 0: beyond */
        if (from <= 0) kept[n++] = *a;
        if ((from <= 0) != (to <= 0)) {
            double t = from / (from - to);
            kept[n++] = (side){a->x + t * (b->x - a->x), a->y + t * (b->y - a->y), from <= 0 ? point : a->beyond};
        }
        if (n > MOST_SIDES) return count; /* no room: the cell stays as it is */
    }
    memcpy(cell, kept, (size_t)n * sizeof *cell);
    return n;
}

typedef struct starring {
    qw_env *env;
    const tree *tree;
    uint32_t *star; /* uint32_t[count][MOST_SIDES]: neighbours in their order, QW_NONE: a gap, or behind the last */
} starring;

static void star_of(const starring *s, uint32_t point, uint32_t *star)
{
    const double *position = s->tree->position, *p = position + 3 * (size_t)point;
    nearest n;
    double x[3], y[3];
    side cell[MOST_SIDES + 2];
    for (int i = 0; i < MOST_SIDES; i++) star[i] = QW_NONE;
    find_nearest(s->tree, p, &n);
    if (n.count < 2) return;
    tangent_axes(position, p, &n, x, y);
    double reach = REACH * sqrt(n.distance2[(n.count < PLANE ? n.count : PLANE) - 1]);
    int count = 4;
    for (int i = 0; i < 4; i++) cell[i] = (side){i == 0 || i == 3 ? -reach : reach, i < 2 ? -reach : reach, QW_NONE};
    for (int i = 0; i < n.count; i++) {
        double d[3], u = 0, v = 0;
        for (int k = 0; k < 3; k++) d[k] = position[3 * (size_t)n.point[i] + (size_t)k] - p[k];
        for (int k = 0; k < 3; k++) u += d[k] * x[k], v += d[k] * y[k];
        if (u * u + v * v > 0.25 * n.distance2[i]) count = cut_cell(cell, count, u, v, n.point[i]);
    }
    for (int i = 0; i < count && i < MOST_SIDES; i++) star[i] = cell[i].beyond;
}

static void star_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    const starring *s = user;
    (void)block;
    for (uint32_t p = begin; p < end; p++) {
        if (p % 32 == 0 && !qw_listen(s->env)) return;
        star_of(s, s->tree->order[p], s->star + (size_t)s->tree->order[p] * MOST_SIDES);
    }
}

/* ---- triangles, each once */

typedef struct corner3 {
    uint32_t v[3];
} corner3;

static int by_corners(const void *a, const void *b)
{
    const corner3 *x = a, *y = b;
    for (int k = 0; k < 3; k++)
        if (x->v[k] != y->v[k]) return x->v[k] < y->v[k] ? -1 : 1;
    return 0;
}

static corner3 in_order(uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    if (c < low) return (corner3){{c, low, high}};
    return c < high ? (corner3){{low, c, high}} : (corner3){{low, high, c}};
}

static size_t triangles_at(const uint32_t *star, uint32_t p, corner3 *to)
{
    size_t count = 0;
    int sides = MOST_SIDES;
    while (sides > 0 && star[sides - 1] == QW_NONE) sides--;
    for (int i = 0; i < sides; i++) {
        uint32_t a = star[i], b = star[(i + 1) % sides];
        if (a == QW_NONE || b == QW_NONE || a == b) continue;
        if (to) to[count] = in_order(p, a, b);
        count++;
    }
    return count;
}

uint32_t qw_triangles_of_points(qw_env *env, const double *position, uint32_t count, uint32_t **corner)
{
    qw_scope_begin(env);
    tree t = grow_tree(env, scaled(env, position, count), count);
    starring s = {env, &t, QW_NEW(env, uint32_t, (size_t)count * MOST_SIDES)};
    memset(s.star, 0xff, (size_t)count * MOST_SIDES * sizeof *s.star); /* QW_NONE: points at the place of another */
    qw_parallel(env, t.count, QW_GRAIN_HEAVY, star_block, &s);
    qw_break_silence(env);
    size_t all = 0, kept = 0, at_once = 0;
    for (uint32_t p = 0; p < count; p++) all += triangles_at(s.star + (size_t)p * MOST_SIDES, p, NULL);
    corner3 *list = QW_NEW(env, corner3, all);
    for (uint32_t p = 0; p < count; p++) at_once += triangles_at(s.star + (size_t)p * MOST_SIDES, p, list + at_once);
    assert(at_once == all);
    qsort(list, all, sizeof *list, by_corners);
    for (size_t i = 0; i < all; i++)
        if (kept == 0 || by_corners(&list[i], &list[kept - 1]) != 0) list[kept++] = list[i];
    if (kept == 0) qw_fail(env, QW_ONLY_DEGENERATE, -1, "no three of the points make a triangle");
    if (kept > INT32_MAX / 3) qw_fail(env, QW_TOO_LARGE, -1, "the points make too many triangles");
    *corner = QW_NEW(env, uint32_t, 3 * kept);
    for (size_t i = 0; i < kept; i++) memcpy(*corner + 3 * i, list[i].v, sizeof list[i].v);
    qw_keep(env, *corner);
    qw_scope_end(env);
    return (uint32_t)kept;
}

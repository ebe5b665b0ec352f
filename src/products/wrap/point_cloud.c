#include "products/wrap/point_cloud.h"

#include "base/axes.h"
#include "base/hash.h"
#include "base/sort.h"
#include "geometry/box_tree.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum {
    NEAREST = 24,    /* neighbours that are looked at */
    PLANE = 12,      /* of them, those that the tangent plane is fitted to */
    WIDE = 48,       /* neighbours of points that may be noise */
    FLATTENINGS = 2, /* rounds */
    MOST_SIDES = 16  /* of a Voronoi cell */
};
/* Where points are noise, they lie as far off the plane of few neighbours as off that of many: at least so much of it,
   as squares. It is a sixteenth where the surface bends, a quarter at an edge. */
static const double NOISE = 0.5;
/* Of the distance of the neighbour number PLANE: a Voronoi cell is cut off there, so that no triangle spans a gap. */
static const double REACH = 1.0;

/* ---- the nearest points */

typedef struct tree {
    const double *position; /* double[points][3]: no coordinate above 1 */
    uint32_t *place;        /* uint32_t[points]: the first point at the place of each */
    uint32_t *order;        /* uint32_t[boxes.count]: one point of each place, in the order of the leaves */
    qw_box_tree boxes;      /* of the points in single precision */
    double slack;           /* how much nearer than its box a point may be, for the rounding */
} tree;

/* The coordinates times 2 to the -exponent, which brings the largest below 1, so that no square of a distance
   overflows. */
static double *scaled(qw_env *env, const double *position, uint32_t count, int *exponent)
{
    double *p = QW_NEW(env, double, 3 * (size_t)count), most = 0;
    for (size_t i = 0; i < 3 * (size_t)count; i++) most = fmax(most, fabs(position[i]));
    frexp(most, exponent);
    for (size_t i = 0; i < 3 * (size_t)count; i++) p[i] = ldexp(position[i], -*exponent);
    return p;
}

/* position: as of the tree. Of each place the first point, as scanners write thousands at 0 0 0 where they have seen
 * nothing. */
static tree grow_tree(qw_env *env, const double *position, uint32_t count)
{
    tree t = {position, qw_find_places(env, position, count, NULL), QW_NEW(env, uint32_t, count), {0}, 0};
    qw_scope_begin(env);
    uint32_t *place = QW_NEW(env, uint32_t, count), places = 0;
    qw_box *boxes = QW_NEW(env, qw_box, count);
    for (uint32_t i = 0; i < count; i++) {
        if (t.place[i] != i) continue;
        const double *p = position + 3 * (size_t)i;
        qw_vec3 at = {(float)p[0], (float)p[1], (float)p[2]};
        place[places] = i, boxes[places++] = qw_box_of(&at, 1);
    }
    t.boxes = qw_box_tree_build(env, boxes, places, t.order);
    for (uint32_t i = 0; i < places; i++) t.order[i] = place[t.order[i]];
    t.slack = sqrt((double)t.boxes.slack2);
    qw_keep(env, t.boxes.nodes);
    qw_scope_end(env);
    return t;
}

typedef struct nearest {
    double distance2[WIDE];
    uint32_t point[WIDE];
    int count, most;
} nearest;

/* Others at the same place do not count. */
static void offer(const tree *t, const double p[3], uint32_t point, nearest *n)
{
    const double *q = t->position + 3 * (size_t)point;
    double d2 = (q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1]) + (q[2] - p[2]) * (q[2] - p[2]);
    if (!(d2 > 0) || (n->count == n->most && d2 >= n->distance2[n->most - 1])) return;
    int i = n->count < n->most ? n->count++ : n->most - 1;
    for (; i > 0 && (n->distance2[i - 1] > d2 || (n->distance2[i - 1] == d2 && n->point[i - 1] > point)); i--)
        n->distance2[i] = n->distance2[i - 1], n->point[i] = n->point[i - 1];
    n->distance2[i] = d2, n->point[i] = point;
}

/* The squared distance of a point from the box of a node. */
static double distance2_of(const qw_box_node *node, const double p[3])
{
    double sum = 0;
    for (int k = 0; k < 3; k++) {
        double outside = fmax(fabs(p[k] - (double)node->centre[k]) - (double)node->half[k], 0);
        sum += outside * outside;
    }
    return sum;
}

/* The `most` points nearest to p, into *n, the nearest first. */
static void find_nearest(const tree *t, const double p[3], int most, nearest *n)
{
    struct {
        uint32_t node;
        double far2; /* no point of it is nearer */
    } stack[QW_BOX_STACK];
    int depth = 0;
    n->count = 0, n->most = most;
    stack[depth].node = 0, stack[depth++].far2 = 0;
    while (depth > 0) {
        const qw_box_node *node = &t->boxes.nodes[stack[--depth].node];
        double reach = n->count < most ? INFINITY : sqrt(n->distance2[most - 1]) + t->slack;
        if (stack[depth].far2 > reach * reach) continue;
        for (uint32_t i = node->first; i < node->first + node->count; i++) offer(t, p, t->order[i], n);
        if (node->count > 0) continue;
        double left = distance2_of(&t->boxes.nodes[node->first], p),
               right = distance2_of(&t->boxes.nodes[node->first + 1], p);
        bool is_left = left <= right; /* the nearer is looked at first */
        stack[depth].node = node->first + is_left, stack[depth++].far2 = fmax(left, right);
        stack[depth].node = node->first + !is_left, stack[depth++].far2 = fmin(left, right);
        assert(depth < QW_BOX_STACK);
    }
}

/* ---- the star of a point */

/* The plane in which p and its nearest neighbours, so many of them at most, lie most nearly. */
typedef struct plane {
    double axis[3][3]; /* the last is its normal */
    double spread[2];  /* mean squares: along the second axis, along the normal */
    double off;        /* of p along the normal */
} plane;

/* The plane through p and the first `count` of its nearest: axes with the normal last, spread across it, how far p
   is off. */
static plane fit_plane(const double *position, const double p[3], const nearest *n, int count)
{
    double m[3][3] = {{0}}, axis[3][3], mean[3] = {0};
    if (n->count < count) count = n->count;
    assert(count > 0 && n->distance2[count - 1] > 0);
    double scale = 1 / n->distance2[count - 1];
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) mean[k] += (position[3 * (size_t)n->point[i] + (size_t)k] - p[k]) / (count + 1);
    for (int i = -1; i < count; i++)
        for (int a = 0; a < 3; a++)
            for (int b = 0; b < 3; b++) {
                const double *q = i < 0 ? p : position + 3 * (size_t)n->point[i];
                m[a][b] += (q[a] - p[a] - mean[a]) * (q[b] - p[b] - mean[b]) * scale;
            }
    qw_principal_axes(m, axis);
    int by[3] = {0, 1, 2}; /* the widest first */
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++)
            if (m[by[k]][by[k]] < m[by[k + 1]][by[k + 1]]) by[k] ^= by[k + 1], by[k + 1] ^= by[k], by[k] ^= by[k + 1];
    plane s = {.off = 0};
    for (int k = 0; k < 3; k++) memcpy(s.axis[k], axis[by[k]], sizeof s.axis[k]);
    for (int k = 0; k < 2; k++) s.spread[k] = m[by[k + 1]][by[k + 1]] / (scale * (count + 1));
    for (int k = 0; k < 3; k++) s.off -= mean[k] * s.axis[2][k];
    return s;
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
    assert(n <= MOST_SIDES);
    memcpy(cell, kept, (size_t)n * sizeof *cell);
    return n;
}

typedef struct starring {
    qw_env *env;
    const tree *tree;
    uint32_t *star; /* uint32_t[count][MOST_SIDES]: neighbours in their order, QW_NONE: a gap, or behind the last */
} starring;

/* The points around one whose Voronoi cells touch its own in the plane that fits them there, into
   star[MOST_SIDES]. */
static void star_of(const starring *s, uint32_t point, uint32_t *star)
{
    const double *position = s->tree->position, *p = position + 3 * (size_t)point;
    nearest n;
    side cell[MOST_SIDES + 2];
    for (int i = 0; i < MOST_SIDES; i++) star[i] = QW_NONE;
    find_nearest(s->tree, p, NEAREST, &n);
    if (n.count < 2) return;
    const plane at = fit_plane(position, p, &n, PLANE);
    double reach = REACH * sqrt(n.distance2[(n.count < PLANE ? n.count : PLANE) - 1]);
    int count = 4;
    for (int i = 0; i < 4; i++) cell[i] = (side){i == 0 || i == 3 ? -reach : reach, i < 2 ? -reach : reach, QW_NONE};
    for (int i = 0; i < n.count; i++) {
        double d[3], u = 0, v = 0;
        for (int k = 0; k < 3; k++) d[k] = position[3 * (size_t)n.point[i] + (size_t)k] - p[k];
        for (int k = 0; k < 3; k++) u += d[k] * at.axis[0][k], v += d[k] * at.axis[1][k];
        if (u * u + v * v > 0.25 * n.distance2[i]) count = cut_cell(cell, count, u, v, n.point[i]);
    }
    for (int i = 0; i < count && i < MOST_SIDES; i++) star[i] = cell[i].beyond;
}

static void star_block(void *user, uint32_t begin, uint32_t end)
{
    const starring *s = user;
    for (uint32_t p = begin; p < end; p++) {
        if (p % 32 == 0 && !qw_listen(s->env)) return;
        star_of(s, s->tree->order[p], s->star + (size_t)s->tree->order[p] * MOST_SIDES);
    }
}

/* ---- noise */

typedef struct flattening {
    qw_env *env;
    const tree *tree;
    double *to; /* double[points][3] */
} flattening;

/* Points that are noise go to the plane of many neighbours: what is thinner than the points are apart becomes one
   sheet. What is no plane even so, as a rod, stays. */
static void flatten_block(void *user, uint32_t begin, uint32_t end)
{
    const flattening *f = user;
    const double *position = f->tree->position;
    for (uint32_t i = begin; i < end; i++) {
        if (i % 32 == 0 && !qw_listen(f->env)) return;
        uint32_t point = f->tree->order[i];
        const double *p = position + 3 * (size_t)point;
        nearest n;
        find_nearest(f->tree, p, WIDE, &n);
        if (n.count < WIDE) continue;
        const plane few = fit_plane(position, p, &n, PLANE), many = fit_plane(position, p, &n, WIDE);
        if (few.spread[1] < NOISE * many.spread[1] || many.spread[1] > NOISE * many.spread[0]) continue;
        for (int k = 0; k < 3; k++) f->to[3 * (size_t)point + (size_t)k] -= many.off * many.axis[2][k];
    }
}

double *qw_flatten_points(qw_env *env, const double *position, uint32_t count)
{
    double *flat = QW_NEW(env, double, 3 * (size_t)count);
    int exponent;
    qw_scope_begin(env);
    double *from = scaled(env, position, count, &exponent), *to = QW_NEW(env, double, 3 * (size_t)count);
    for (int round = 0; round < FLATTENINGS; round++) {
        tree t = grow_tree(env, from, count);
        memcpy(to, from, 3 * (size_t)count * sizeof *to);
        qw_parallel(env, t.boxes.count, QW_GRAIN_HEAVY, flatten_block, &(flattening){env, &t, to});
        qw_heartbeat(env);
        for (uint32_t i = 0; i < count; i++)
            memcpy(from + 3 * (size_t)i, to + 3 * (size_t)t.place[i], 3 * sizeof *from);
    }
    for (size_t i = 0; i < 3 * (size_t)count; i++)
        flat[i] = from[i] == ldexp(position[i], -exponent) ? position[i] : ldexp(from[i], exponent);
    qw_scope_end(env);
    return flat;
}

/* ---- triangles, each once */

/* The triangles at a point by their lowest corners: counts them in first, or adds the other two corners to its keys. */
static void add_triangles(const uint32_t *star, uint32_t p, uint32_t *first, uint64_t *key)
{
    int sides = MOST_SIDES;
    while (sides > 0 && star[sides - 1] == QW_NONE) sides--;
    for (int i = 0; i < sides; i++) {
        uint32_t a = star[i], b = star[(i + 1) % sides];
        if (a == QW_NONE || b == QW_NONE || a == b) continue;
        uint32_t low = a < b ? (p < a ? p : a) : (p < b ? p : b);
        if (!key) first[low]++;
        else key[first[low]++] = low == p ? qw_pair_key(a, b) : qw_pair_key(p, low == a ? b : a);
    }
}

uint32_t qw_triangles_of_points(qw_env *env, const double *position, uint32_t count, uint32_t **corner)
{
    qw_scope_begin(env);
    int exponent;
    tree t = grow_tree(env, scaled(env, position, count, &exponent), count);
    starring s = {env, &t, QW_NEW(env, uint32_t, (size_t)count * MOST_SIDES)};
    memset(s.star, 0xff, (size_t)count * MOST_SIDES * sizeof *s.star); /* QW_NONE: points at the place of another */
    qw_parallel(env, t.boxes.count, QW_GRAIN_HEAVY, star_block, &s);
    qw_heartbeat(env);
    size_t kept = 0, all = 0;
    uint32_t *first = QW_NEW_ZERO(env, uint32_t, count);
    for (uint32_t p = 0; p < count; p++) add_triangles(s.star + (size_t)p * MOST_SIDES, p, first, NULL);
    for (uint32_t p = 0; p < count; p++) {
        size_t here = first[p];
        first[p] = (uint32_t)all, all += here;
        if (all > UINT32_MAX) qw_fail(env, QW_TOO_LARGE, -1, "the points make too many triangles");
    }
    if (all == 0) qw_fail(env, QW_ONLY_DEGENERATE, -1, "no three of the points make a triangle");
    uint64_t *key = QW_NEW(env, uint64_t, all);
    for (uint32_t p = 0; p < count; p++) add_triangles(s.star + (size_t)p * MOST_SIDES, p, first, key);
    *corner = QW_NEW(env, uint32_t, 3 * all);
    for (uint32_t p = 0, begin = 0; p < count; begin = first[p++]) {
        size_t here = qw_sort_once(key + begin, first[p] - begin);
        for (size_t i = 0; i < here; i++, kept++) {
            uint32_t *c = *corner + 3 * kept;
            c[0] = p, c[1] = (uint32_t)(key[begin + i] >> 32), c[2] = (uint32_t)key[begin + i];
        }
    }
    assert(kept > 0 && kept <= all);
    if (kept > INT32_MAX / 3) qw_fail(env, QW_TOO_LARGE, -1, "the points make too many triangles");
    *corner = qw_resize(env, *corner, 3 * kept, sizeof **corner);
    qw_keep(env, *corner);
    qw_scope_end(env);
    return (uint32_t)kept;
}

/* A second opinion on whether a triangle mesh with whole coordinates intersects itself, which shares nothing with
 * src/products/wrap: pairs by a sweep along x, then the point in which the line of an edge meets the plane of a
 * triangle, as a fraction, against the triangle's sides; all in integers of 128 bits. */
#ifndef QW_TESTS_SKIN_CHECK_H
#define QW_TESTS_SKIN_CHECK_H

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef __int128 wide;
typedef struct whole3 {
    wide c[3];
} whole3;

static inline whole3 whole_difference(const int32_t *a, const int32_t *b)
{
    return (whole3){{(wide)a[0] - b[0], (wide)a[1] - b[1], (wide)a[2] - b[2]}};
}
static inline whole3 whole_cross(whole3 a, whole3 b)
{
    return (whole3){
        {a.c[1] * b.c[2] - a.c[2] * b.c[1], a.c[2] * b.c[0] - a.c[0] * b.c[2], a.c[0] * b.c[1] - a.c[1] * b.c[0]}};
}
static inline wide whole_dot(whole3 a, whole3 b) { return a.c[0] * b.c[0] + a.c[1] * b.c[1] + a.c[2] * b.c[2]; }

/* Whether the closed polygon of the points of the segment that lie in the triangle is not empty, in a plane where axis
 * k is left out: the segment is cut by the three sides. low, high: the part that is left, as fractions over `over`. */
static inline bool flat_meets(const int32_t *p, const int32_t *q, const int32_t *t[3], whole3 normal)
{
    int k = 0;
    for (int i = 1; i < 3; i++) {
        wide a = normal.c[i] < 0 ? -normal.c[i] : normal.c[i], b = normal.c[k] < 0 ? -normal.c[k] : normal.c[k];
        if (a > b) k = i;
    }
    int u = (k + 1) % 3, v = (k + 2) % 3, sign = normal.c[k] < 0 ? -1 : 1;
    /* the parameter of the segment runs from low[0]/low[1] to high[0]/high[1], denominators above 0 */
    wide low[2] = {0, 1}, high[2] = {1, 1};
    for (int i = 0; i < 3; i++) {
        const int32_t *a = t[i], *b = t[(i + 1) % 3];
        wide at_p = sign * ((wide)(b[u] - a[u]) * (p[v] - a[v]) - (wide)(b[v] - a[v]) * (p[u] - a[u]));
        wide at_q = sign * ((wide)(b[u] - a[u]) * (q[v] - a[v]) - (wide)(b[v] - a[v]) * (q[u] - a[u]));
        if (at_p < 0 && at_q < 0) return false;
        if (at_p >= 0 && at_q >= 0) continue;
        wide over = at_p - at_q, at = at_p;
        if (over < 0) over = -over, at = -at;
        if (at_p < 0 && at * low[1] > low[0] * over) low[0] = at, low[1] = over;
        if (at_q < 0 && at * high[1] < high[0] * over) high[0] = at, high[1] = over;
    }
    return low[0] * high[1] <= high[0] * low[1];
}

static inline bool edge_meets(const int32_t *p, const int32_t *q, const int32_t *t[3])
{
    whole3 normal = whole_cross(whole_difference(t[1], t[0]), whole_difference(t[2], t[0]));
    wide from = whole_dot(normal, whole_difference(p, t[0])), to = whole_dot(normal, whole_difference(q, t[0]));
    if ((from > 0 && to > 0) || (from < 0 && to < 0)) return false;
    if (from == 0 && to == 0) return flat_meets(p, q, t, normal);
    wide over = from - to; /* the point is p + (q - p) from / over */
    for (int i = 0; i < 3; i++) {
        whole3 side = whole_difference(t[(i + 1) % 3], t[i]);
        whole3 a = whole_difference(p, t[i]), b = whole_difference(q, p);
        /* normal . (side x (a + b from / over)) must not be below 0 */
        wide first = whole_dot(whole_cross(normal, side), a), second = whole_dot(whole_cross(normal, side), b);
        long double value = (long double)first + (long double)second * (long double)from / (long double)over;
        long double doubt = ((first < 0 ? -(long double)first : (long double)first) +
                             (second < 0 ? -(long double)second : (long double)second)) *
                            1e-12L;
        if (value < -doubt) return false;
        if (value <= doubt) { /* too near: by the volumes of edge and side, exactly */
            whole3 edge = whole_cross(whole_difference(q, p), whole_difference(t[i], p));
            wide volume = whole_dot(edge, whole_difference(t[(i + 1) % 3], p));
            if (over < 0 ? volume < 0 : volume > 0) return false;
        }
    }
    return true;
}

/* Whether two triangles have more in common than their corners of the same number. */
static inline bool pair_meets(const int32_t *position, const uint32_t *a, const uint32_t *b)
{
    const int32_t *p[3], *q[3];
    int common = 0, of_a = 0, of_b = 0;
    for (int i = 0; i < 3; i++) p[i] = position + 3 * (size_t)a[i], q[i] = position + 3 * (size_t)b[i];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            if (a[i] == b[j]) common++, of_a |= 1 << i, of_b |= 1 << j;
    if (common == 3) return true;
    if (common == 2) {
        int i = of_a == 3 ? 2 : of_a == 5 ? 1 : 0, j = of_b == 3 ? 2 : of_b == 5 ? 1 : 0;
        whole3 n = whole_cross(whole_difference(p[1], p[0]), whole_difference(p[2], p[0]));
        whole3 m = whole_cross(whole_difference(q[1], q[0]), whole_difference(q[2], q[0]));
        if (whole_dot(n, whole_difference(q[j], p[i])) != 0) return false;
        bool same = a[(i + 1) % 3] == b[(j + 1) % 3]; /* the common edge runs alike in both */
        int sign = 0;
        for (int k = 0; k < 3 && !sign; k++)
            if (n.c[k] != 0 && m.c[k] != 0) sign = (n.c[k] > 0) == (m.c[k] > 0) ? 1 : -1;
        return same ? sign > 0 : sign < 0;
    }
    for (int i = 0; i < 3; i++) { /* edges from corner i to i + 1 that hold no common corner */
        if (!(of_a >> i & 1) && !(of_a >> (i + 1) % 3 & 1) && edge_meets(p[i], p[(i + 1) % 3], q)) return true;
        if (!(of_b >> i & 1) && !(of_b >> (i + 1) % 3 & 1) && edge_meets(q[i], q[(i + 1) % 3], p)) return true;
    }
    return false;
}

typedef struct sweep_item {
    int32_t low[3], high[3];
    uint32_t face;
} sweep_item;

static inline int by_low(const void *a, const void *b)
{
    const sweep_item *x = a, *y = b;
    if (x->low[0] != y->low[0]) return x->low[0] < y->low[0] ? -1 : 1;
    return x->face < y->face ? -1 : 1;
}

/* How many pairs of triangles intersect. */
static inline int64_t count_intersections(const int32_t *position, const uint32_t *corner, uint32_t faces)
{
    sweep_item *item = malloc((faces + 1) * sizeof *item);
    int64_t count = 0;
    for (uint32_t f = 0; f < faces; f++) {
        item[f].face = f;
        for (int k = 0; k < 3; k++) {
            item[f].low[k] = INT32_MAX, item[f].high[k] = INT32_MIN;
            for (int i = 0; i < 3; i++) {
                int32_t at = position[3 * (size_t)corner[3 * (size_t)f + (size_t)i] + (size_t)k];
                if (at < item[f].low[k]) item[f].low[k] = at;
                if (at > item[f].high[k]) item[f].high[k] = at;
            }
        }
    }
    qsort(item, faces, sizeof *item, by_low);
    for (uint32_t i = 0; i < faces; i++)
        for (uint32_t j = i + 1; j < faces && item[j].low[0] <= item[i].high[0]; j++) {
            if (item[j].low[1] > item[i].high[1] || item[j].high[1] < item[i].low[1]) continue;
            if (item[j].low[2] > item[i].high[2] || item[j].high[2] < item[i].low[2]) continue;
            count += pair_meets(position, corner + 3 * (size_t)item[i].face, corner + 3 * (size_t)item[j].face);
        }
    free(item);
    return count;
}

#endif

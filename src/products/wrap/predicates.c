#include "products/wrap/predicates.h"

#include <assert.h>
#include <math.h>

/* Of the sum of three products, each rounded once and added twice: relative to the sum of their sizes. */
static const double ROUNDING = 8.0 / 9007199254740992.0;

/* ---- orientations */

void qw_exact_normal(const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b, const qw_wrap_lattice_point *c,
                     double normal[3])
{
    double u[3], v[3];
    for (int k = 0; k < 3; k++) u[k] = (double)(b->at[k] - a->at[k]), v[k] = (double)(c->at[k] - a->at[k]);
    for (int k = 0; k < 3; k++) {
        int l = (k + 1) % 3, m = (k + 2) % 3;
        normal[k] = u[l] * v[m] - u[m] * v[l];
    }
}

/* The sign of the scalar product of a vector as of qw_exact_normal and a difference of two points. */
static int sign_along(const double normal[3], const double to[3])
{
    double x = normal[0] * to[0], y = normal[1] * to[1], z = normal[2] * to[2], sum = x + y + z;
    double doubt = (fabs(x) + fabs(y) + fabs(z)) * ROUNDING;
    if (sum > doubt) return 1;
    if (sum < -doubt) return -1;
    __int128 exact = 0;
    for (int k = 0; k < 3; k++) exact += (__int128)(int64_t)normal[k] * (int64_t)to[k];
    return (exact > 0) - (exact < 0);
}

/* On which side of a plane through `origin` a point lies. */
static int side_of(const double normal[3], const qw_wrap_lattice_point *origin, const qw_wrap_lattice_point *p)
{
    double to[3];
    for (int k = 0; k < 3; k++) to[k] = (double)(p->at[k] - origin->at[k]);
    return sign_along(normal, to);
}

/* The sign of det(b - a, c - a, d - a): 1 where d is on the side of the triangle abc from which it runs
 * counter-clockwise, 0 where the four lie in a plane. */
static int orient(const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b, const qw_wrap_lattice_point *c,
                  const qw_wrap_lattice_point *d)
{
    double normal[3];
    qw_exact_normal(a, b, c, normal);
    return side_of(normal, a, d);
}

/* ---- in a plane: one axis is left out, along which the plane's normal is longest */

static int longest_axis(const double normal[3])
{
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(normal[k]) > fabs(normal[axis])) axis = k;
    assert(normal[axis] != 0);
    return axis;
}

/* Orientation of three points as seen along the axis: products are below 2^50. */
static int turn(int axis, const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b,
                const qw_wrap_lattice_point *c)
{
    int k = (axis + 1) % 3, l = (axis + 2) % 3;
    int64_t area = (int64_t)(b->at[k] - a->at[k]) * (c->at[l] - a->at[l]) -
                   (int64_t)(b->at[l] - a->at[l]) * (c->at[k] - a->at[k]);
    return (area > 0) - (area < 0);
}

/* Whether p, which is on the line ab, lies between its ends. */
static bool between(const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b, const qw_wrap_lattice_point *p)
{
    for (int k = 0; k < 3; k++)
        if ((p->at[k] < a->at[k] && p->at[k] < b->at[k]) || (p->at[k] > a->at[k] && p->at[k] > b->at[k])) return false;
    return true;
}

/* Closed segments ab and cd of one plane. */
static bool segments_meet(int axis, const qw_wrap_lattice_point *a, const qw_wrap_lattice_point *b,
                          const qw_wrap_lattice_point *c, const qw_wrap_lattice_point *d)
{
    int s = turn(axis, a, b, c), t = turn(axis, a, b, d), u = turn(axis, c, d, a), v = turn(axis, c, d, b);
    if (s * t < 0 && u * v < 0) return true;
    return (s == 0 && between(a, b, c)) || (t == 0 && between(a, b, d)) || (u == 0 && between(c, d, a)) ||
           (v == 0 && between(c, d, b));
}

static bool flat_segment_meets(int axis, const qw_wrap_lattice_point segment[2],
                               const qw_wrap_lattice_point triangle[3])
{
    int s[3];
    for (int i = 0; i < 3; i++) s[i] = turn(axis, &triangle[i], &triangle[(i + 1) % 3], &segment[0]);
    if (s[0] >= 0 && s[1] >= 0 && s[2] >= 0) return true;
    if (s[0] <= 0 && s[1] <= 0 && s[2] <= 0) return true;
    for (int i = 0; i < 3; i++)
        if (segments_meet(axis, &segment[0], &segment[1], &triangle[i], &triangle[(i + 1) % 3])) return true;
    return false;
}

/* ---- segments and triangles */

/* Whether a segment meets a triangle, exactly, ends and rims included. */
static bool segment_meets(const qw_wrap_lattice_point segment[2], const qw_wrap_lattice_point triangle[3],
                          const double normal[3])
{
    int from = side_of(normal, &triangle[0], &segment[0]), to = side_of(normal, &triangle[0], &segment[1]);
    if (from * to > 0) return false;
    if (from == 0 && to == 0) return flat_segment_meets(longest_axis(normal), segment, triangle);
    int left = 0, right = 0;
    for (int i = 0; i < 3; i++) {
        int side = orient(&segment[0], &segment[1], &triangle[i], &triangle[(i + 1) % 3]);
        left += side > 0, right += side < 0;
    }
    return left == 0 || right == 0;
}

/* Whether a line of the plane of `a` through one of its edges, seen along the axis, has all of b strictly on the other
 * side: b lies beyond a wall then. Corners of b before `from` are the surface's own first corners and may lie on it. */
static bool wall_parts(int axis, const qw_wrap_lattice_point a[3], const qw_wrap_lattice_point b[3], int shared)
{
    for (int i = 0; i < 3; i++) {
        const qw_wrap_lattice_point *p = &a[i], *q = &a[(i + 1) % 3], *r = &a[(i + 2) % 3];
        bool holds_shared = i == 0 || i == 2; /* the edges at corner 0 */
        if (shared == 1 && !holds_shared) continue;
        int mine = turn(axis, p, q, r);
        if (mine == 0) return false;
        bool beyond = true;
        for (int j = shared; j < 3 && beyond; j++) beyond = turn(axis, p, q, &b[j]) == -mine;
        if (beyond) return true;
    }
    return false;
}

/* Whether a plane that holds `a`, or one through an edge of it, parts the two. */
static bool is_parted(const qw_wrap_lattice_point a[3], const double normal[3], const qw_wrap_lattice_point b[3],
                      int shared)
{
    int side = side_of(normal, &a[0], &b[shared]);
    bool same = side != 0;
    for (int j = shared + 1; j < 3 && same; j++) same = side_of(normal, &a[0], &b[j]) == side;
    return same || wall_parts(longest_axis(normal), a, b, shared);
}

static bool edges_meet(const qw_wrap_lattice_point a[3], const qw_wrap_lattice_point b[3], const double normal[3],
                       int shared)
{
    for (int i = shared; i < 3; i++) { /* of a: with one corner shared only the edge across */
        const qw_wrap_lattice_point edge[2] = {a[i], a[(i + 1) % 3]};
        if (shared == 1 && i == 2) break;
        if (segment_meets(edge, b, normal)) return true;
    }
    return false;
}

bool qw_triangles_collide(const qw_wrap_lattice_point a[3], const qw_wrap_lattice_point b[3], int shared)
{
    double of_a[3], of_b[3];
    qw_exact_normal(&a[0], &a[1], &a[2], of_a);
    if (shared == 2) { /* only where one is folded onto the other */
        if (side_of(of_a, &a[0], &b[2]) != 0) return false;
        int axis = longest_axis(of_a);
        return turn(axis, &a[0], &a[1], &a[2]) == turn(axis, &b[0], &b[1], &b[2]);
    }
    qw_exact_normal(&b[0], &b[1], &b[2], of_b);
    if (is_parted(a, of_a, b, shared) || is_parted(b, of_b, a, shared)) return false;
    return edges_meet(a, b, of_b, shared) || edges_meet(b, a, of_a, shared);
}

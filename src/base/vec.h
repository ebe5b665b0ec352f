/* Small vectors. Single precision: geometry lives in a centred frame where the bounding box has diagonal 1. */
#pragma once

#include "base/elementary.h"

#include <float.h>
#include <math.h>

typedef struct qw_vec3 {
    float x, y, z;
} qw_vec3;

static inline qw_vec3 qw_v3(float x, float y, float z) { return (qw_vec3){x, y, z}; }
static inline qw_vec3 qw_add(qw_vec3 a, qw_vec3 b) { return (qw_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline qw_vec3 qw_sub(qw_vec3 a, qw_vec3 b) { return (qw_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline qw_vec3 qw_scale(qw_vec3 a, float s) { return (qw_vec3){a.x * s, a.y * s, a.z * s}; }
/* a + s b */
static inline qw_vec3 qw_madd(qw_vec3 a, float s, qw_vec3 b)
{
    return (qw_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline float qw_dot(qw_vec3 a, qw_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline qw_vec3 qw_v3_of_doubles(const double p[3]) { return qw_v3((float)p[0], (float)p[1], (float)p[2]); }

static inline void qw_to_doubles(qw_vec3 p, double to[3])
{
    to[0] = (double)p.x, to[1] = (double)p.y, to[2] = (double)p.z;
}

static inline double qw_dot_doubles(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void qw_cross_doubles(const double a[3], const double b[3], double to[3])
{
    for (int k = 0; k < 3; k++) to[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}
/* Zero stays zero. */
static inline void qw_unit_doubles(double v[3])
{
    double l = sqrt(qw_dot_doubles(v, v));
    for (int k = 0; k < 3; k++) v[k] = l > 0 ? v[k] / l : 0;
}
static inline double qw_distance2_doubles(const double a[3], const double b[3])
{
    double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}
/* The square of twice the area of triangle a b c; and up to which share of its longest side, squared, twice the area
   may be a rounding error. */
static inline double qw_cross2_doubles(const double a[3], const double b[3], const double c[3])
{
    double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]}, n[3];
    qw_cross_doubles(u, v, n);
    return qw_dot_doubles(n, n);
}
static const double QW_CROSS_CERTAIN = 16 * DBL_EPSILON;
static inline qw_vec3 qw_cross(qw_vec3 a, qw_vec3 b)
{
    return (qw_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline float qw_length2(qw_vec3 a) { return qw_dot(a, a); }
static inline float qw_length(qw_vec3 a) { return sqrtf(qw_dot(a, a)); }
static inline float qw_distance(qw_vec3 a, qw_vec3 b) { return qw_length(qw_sub(a, b)); }
/* The squared distance of p to the segment from a to b. */
static inline float qw_distance2_to_segment(qw_vec3 p, qw_vec3 a, qw_vec3 b)
{
    qw_vec3 along = qw_sub(b, a);
    float length2 = qw_length2(along), t = length2 > 0 ? qw_dot(qw_sub(p, a), along) / length2 : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return qw_length2(qw_sub(p, qw_madd(a, t, along)));
}
/* Unit vector along a, or zero where a is too short to have a direction. */
static inline qw_vec3 qw_normalize(qw_vec3 a)
{
    float l = qw_length(a);
    return l > 1e-30f ? qw_scale(a, 1.0f / l) : (qw_vec3){0, 0, 0};
}
static inline qw_vec3 qw_lerp(qw_vec3 a, qw_vec3 b, float t) { return qw_madd(qw_scale(a, 1.0f - t), t, b); }
/* a without its part along the unit vector n */
static inline qw_vec3 qw_reject(qw_vec3 a, qw_vec3 n) { return qw_madd(a, -qw_dot(a, n), n); }
/* Between two directions of any length, in [0, pi]; and as seen from a point. They get unit length first: the square of
   a cross product of short edges is below single precision. */
static inline double qw_angle_between(qw_vec3 a, qw_vec3 b)
{
    qw_vec3 u = qw_normalize(a), v = qw_normalize(b);
    return qw_atan2(qw_length(qw_cross(u, v)), qw_dot(u, v));
}
static inline double qw_angle_at(qw_vec3 at, qw_vec3 a, qw_vec3 b)
{
    return qw_angle_between(qw_sub(a, at), qw_sub(b, at));
}
/* Any unit vector orthogonal to the unit vector n; continuous but on one half line. */
static inline qw_vec3 qw_any_orthogonal(qw_vec3 n)
{
    qw_vec3 axis = fabsf(n.x) < fabsf(n.y) ? (fabsf(n.x) < fabsf(n.z) ? qw_v3(1, 0, 0) : qw_v3(0, 0, 1))
                                           : (fabsf(n.y) < fabsf(n.z) ? qw_v3(0, 1, 0) : qw_v3(0, 0, 1));
    return qw_normalize(qw_reject(axis, n));
}

#include "exact/primitive.h"

#include "math/axes.h"
#include "math/vec.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { STEPS = 12, UNKNOWNS = 6 };
/* A first guess farther off than this share of the points' extent is not refined. */
static const double NO_GUESS = 0.05;
/* Least pivot of the normal equations, as a share of the largest entry. */
static const double SINGULAR = 1e-13;
/* A step that leaves more than this share of the largest distance is the last. */
static const double ENOUGH = 0.5;

static bool normalize(double a[3])
{
    double length = sqrt(qw_dot_doubles(a, a));
    if (!(length > 1e-30)) return false;
    for (int k = 0; k < 3; k++) a[k] /= length;
    return true;
}

/* Two unit vectors that make a right-handed frame with a unit vector. */
static void frame_of(const double axis[3], double u[3], double v[3])
{
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(axis[k]) < fabs(axis[least])) least = k;
    for (int k = 0; k < 3; k++) u[k] = (k == least) - axis[least] * axis[k];
    normalize(u);
    v[0] = axis[1] * u[2] - axis[2] * u[1], v[1] = axis[2] * u[0] - axis[0] * u[2];
    v[2] = axis[0] * u[1] - axis[1] * u[0];
}

static double cosine_of(const qw_primitive *p) { return sqrt(1 - p->sine * p->sine); }

double qw_primitive_distance(const qw_primitive *primitive, const double p[3], double gradient[3])
{
    const double *a = primitive->axis;
    double q[3], away[3];
    for (int k = 0; k < 3; k++) q[k] = p[k] - primitive->point[k];
    double z = qw_dot_doubles(q, a);
    if (primitive->kind == QW_PLANE) {
        memcpy(gradient, a, 3 * sizeof *a);
        return z;
    }
    for (int k = 0; k < 3; k++) away[k] = q[k] - z * a[k];
    double rho = sqrt(qw_dot_doubles(away, away)), cosine = cosine_of(primitive);
    for (int k = 0; k < 3; k++) gradient[k] = (rho > 0 ? cosine * away[k] / rho : 0) - primitive->sine * a[k];
    return (rho - primitive->radius) * cosine - z * primitive->sine;
}

static double largest_distance(const qw_primitive *p, const double *point, uint32_t count)
{
    double largest = 0, gradient[3];
    for (uint32_t i = 0; i < count; i++)
        largest = fmax(largest, fabs(qw_primitive_distance(p, point + 3 * (size_t)i, gradient)));
    return largest;
}

/* Solves the n equations of a positive matrix in place; false where it is singular. */
static bool solve(uint32_t n, double m[UNKNOWNS][UNKNOWNS], double b[UNKNOWNS])
{
    double largest = 0;
    for (uint32_t i = 0; i < n; i++) largest = fmax(largest, m[i][i]);
    for (uint32_t i = 0; i < n; i++) {
        if (!(m[i][i] > SINGULAR * largest)) return false;
        for (uint32_t j = i + 1; j < n; j++) {
            double share = m[j][i] / m[i][i];
            for (uint32_t k = i; k < n; k++) m[j][k] -= share * m[i][k];
            b[j] -= share * b[i];
        }
    }
    for (uint32_t i = n; i-- > 0;) {
        for (uint32_t k = i + 1; k < n; k++) b[i] -= m[i][k] * b[k];
        b[i] /= m[i][i];
    }
    return true;
}

static void add_row(uint32_t n, const double row[UNKNOWNS], double right, double m[UNKNOWNS][UNKNOWNS],
                    double b[UNKNOWNS])
{
    for (uint32_t i = 0; i < n; i++) {
        for (uint32_t j = 0; j < n; j++) m[i][j] += row[i] * row[j];
        b[i] += row[i] * right;
    }
}

/* How the distance of a point changes as the axis shifts and tilts along u and v, the radius grows and the cone opens;
   its value. */
static double derivatives(const qw_primitive *p, const double u[3], const double v[3], const double at[3],
                          double row[UNKNOWNS])
{
    double q[3], cosine = cosine_of(p);
    for (int k = 0; k < 3; k++) q[k] = at[k] - p->point[k];
    double x = qw_dot_doubles(q, u), y = qw_dot_doubles(q, v), z = qw_dot_doubles(q, p->axis),
           rho = sqrt(x * x + y * y), least = 1e-12;
    double ex = x / fmax(rho, least), ey = y / fmax(rho, least);
    row[0] = -ex * cosine, row[1] = -ey * cosine;
    row[2] = -z * ex * cosine - x * p->sine, row[3] = -z * ey * cosine - y * p->sine;
    row[4] = -cosine;
    row[5] = -(rho - p->radius) * p->sine - z * cosine;
    return (rho - p->radius) * cosine - z * p->sine;
}

/* One step of Gauss and Newton. */
static bool improve(qw_primitive *p, const double *point, uint32_t count)
{
    uint32_t n = p->kind == QW_CONE ? 6 : 5;
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, b[UNKNOWNS] = {0}, row[UNKNOWNS], u[3], v[3];
    frame_of(p->axis, u, v);
    for (uint32_t i = 0; i < count; i++) {
        double d = derivatives(p, u, v, point + 3 * (size_t)i, row);
        add_row(n, row, -d, m, b);
    }
    if (!solve(n, m, b)) return false;
    for (int k = 0; k < 3; k++) {
        p->point[k] += b[0] * u[k] + b[1] * v[k];
        p->axis[k] += b[2] * u[k] + b[3] * v[k];
    }
    p->radius += b[4];
    if (n == 6) p->sine = p->sine * sqrt(fmax(0, 1 - b[5] * b[5])) + cosine_of(p) * b[5];
    return normalize(p->axis) && p->radius > 0 && fabs(p->sine) < 1;
}

static void middle_of(const double *point, uint32_t count, double middle[3])
{
    memset(middle, 0, 3 * sizeof *middle);
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) middle[k] += point[3 * (size_t)i + (size_t)k] / count;
}

/* The principal axis of the vectors, about their mean, along which they are least, or most, spread. */
static void spread_axis(const double *vector, uint32_t count, double axis[3])
{
    double mean[3], m[3][3] = {{0}}, axes[3][3];
    middle_of(vector, count, mean);
    for (uint32_t i = 0; i < count; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                m[j][k] += (vector[3 * (size_t)i + (size_t)j] - mean[j]) *
                           (vector[3 * (size_t)i + (size_t)k] - mean[k]);
    qw_principal_axes(m, axes);
    int least = 0;
    for (int k = 1; k < 3; k++)
        if (m[k][k] < m[least][least]) least = k;
    memcpy(axis, axes[least], 3 * sizeof *axis);
}

static double extent_of(const double *point, uint32_t count, const double middle[3])
{
    double most = 0;
    for (uint32_t i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) most = fmax(most, fabs(point[3 * (size_t)i + (size_t)k] - middle[k]));
    return most;
}

/* The line of radii over heights that comes nearest to the points. */
static void guess_slope(qw_primitive *p, const double *point, uint32_t count)
{
    double n = count, z1 = 0, z2 = 0, r1 = 0, rz = 0;
    for (uint32_t i = 0; i < count; i++) {
        double q[3];
        for (int k = 0; k < 3; k++) q[k] = point[3 * (size_t)i + (size_t)k] - p->point[k];
        double z = qw_dot_doubles(q, p->axis), r = sqrt(fmax(0, qw_dot_doubles(q, q) - z * z));
        z1 += z, z2 += z * z, r1 += r, rz += r * z;
    }
    double spread = n * z2 - z1 * z1, slope = spread > 0 ? (n * rz - z1 * r1) / spread : 0;
    p->radius = (r1 - slope * z1) / n;
    p->sine = slope / sqrt(1 + slope * slope);
}

/* The circle about an axis of this direction, whose squared radius may change along it: x^2 + y^2 = 2 a x + 2 b y + c
   + d z. p->axis and p->kind are set; p->point is the middle of the points. */
static bool guess_circle(qw_primitive *p, const double *point, uint32_t count)
{
    uint32_t n = p->kind == QW_CONE ? 4 : 3;
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, b[UNKNOWNS] = {0}, u[3], v[3];
    frame_of(p->axis, u, v);
    for (uint32_t i = 0; i < count; i++) {
        double q[3];
        for (int k = 0; k < 3; k++) q[k] = point[3 * (size_t)i + (size_t)k] - p->point[k];
        double x = qw_dot_doubles(q, u), y = qw_dot_doubles(q, v), z = qw_dot_doubles(q, p->axis),
               row[UNKNOWNS] = {2 * x, 2 * y, 1, z};
        add_row(n, row, x * x + y * y, m, b);
    }
    if (!solve(n, m, b)) return false;
    double square = b[2] + b[0] * b[0] + b[1] * b[1];
    if (!(square > 0)) return false;
    for (int k = 0; k < 3; k++) p->point[k] += b[0] * u[k] + b[1] * v[k];
    p->radius = sqrt(square);
    if (p->kind == QW_CONE) guess_slope(p, point, count);
    return true;
}

double qw_refine_primitive(qw_primitive *p, const double *point, uint32_t count)
{
    if (p->kind == QW_PLANE) {
        middle_of(point, count, p->point);
        double was[3];
        memcpy(was, p->axis, sizeof was);
        spread_axis(point, count, p->axis);
        double sign = qw_dot_doubles(was, p->axis) < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++) p->axis[k] *= sign;
        return largest_distance(p, point, count);
    }
    double best = largest_distance(p, point, count);
    for (int step = 0; step < STEPS; step++) {
        qw_primitive next = *p;
        if (!improve(&next, point, count)) break;
        double largest = largest_distance(&next, point, count);
        if (!(largest < best)) break;
        bool is_done = largest > ENOUGH * best && step > 2;
        *p = next, best = largest;
        if (is_done) break;
    }
    return best;
}

double qw_fit_primitive(qw_primitive *p, qw_primitive_kind kind, const double *point, uint32_t count,
                        const double *normal, uint32_t normals)
{
    assert(kind < QW_PRIMITIVE_KINDS && point);
    if (count <= qw_primitive_freedom(kind)) return INFINITY;
    *p = (qw_primitive){.kind = kind};
    if (kind == QW_PLANE) return qw_refine_primitive(p, point, count);
    middle_of(point, count, p->point);
    spread_axis(normal, normals, p->axis);
    double extent = extent_of(point, count, p->point);
    if (!guess_circle(p, point, count) || !(largest_distance(p, point, count) <= NO_GUESS * extent)) return INFINITY;
    return qw_refine_primitive(p, point, count);
}

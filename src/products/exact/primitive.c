#include "products/exact/primitive.h"

#include "base/axes.h"
#include "base/vec.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { STEPS = 12, UNKNOWNS = 7, LINE = 6, LINE_STEPS = 8 };
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

/* The length of q, and its direction. */
static double distance_along(const double q[3], double direction[3])
{
    double length = sqrt(qw_dot_doubles(q, q));
    for (int k = 0; k < 3; k++) direction[k] = length > 0 ? q[k] / length : 0;
    return length;
}

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
    if (primitive->kind == QW_SPHERE) return distance_along(q, gradient) - primitive->radius;
    for (int k = 0; k < 3; k++) away[k] = q[k] - z * a[k];
    double rho = sqrt(qw_dot_doubles(away, away)), cosine = cosine_of(primitive);
    if (primitive->kind == QW_TORUS) {
        for (int k = 0; k < 3; k++) q[k] = z * a[k] + (rho > 0 ? (1 - primitive->radius / rho) * away[k] : 0);
        return distance_along(q, gradient) - primitive->tube;
    }
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
    assert(n > 0 && n <= UNKNOWNS);
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

/* How the distance of a point, (x, y, z) in the frame of the axis, rho from it, changes as the axis shifts and tilts
   along u and v, the radius grows and the cone opens; its value. */
static double derive_cone(const qw_primitive *p, const double at[3], double rho, double row[UNKNOWNS])
{
    double cosine = cosine_of(p), ex = at[0] / rho, ey = at[1] / rho, z = at[2];
    row[0] = -ex * cosine, row[1] = -ey * cosine;
    row[2] = -z * ex * cosine - at[0] * p->sine, row[3] = -z * ey * cosine - at[1] * p->sine;
    row[4] = -cosine;
    row[5] = -(rho - p->radius) * p->sine - z * cosine;
    return (rho - p->radius) * cosine - z * p->sine;
}

/* The same of a torus, whose sixth is its shift along the axis, the seventh its tube's radius. */
static double derive_torus(const qw_primitive *p, const double at[3], double rho, double row[UNKNOWNS])
{
    double ex = at[0] / rho, ey = at[1] / rho, out = rho - p->radius, z = at[2], from = sqrt(out * out + z * z);
    if (from > 0) out /= from, z /= from;
    row[0] = -out * ex, row[1] = -out * ey;
    row[2] = -out * at[2] * ex + z * at[0], row[3] = -out * at[2] * ey + z * at[1];
    row[4] = -out, row[5] = -z, row[6] = -1;
    return from - p->tube;
}

/* The same of a sphere as it shifts along u, v and the axis and grows. */
static double derive_sphere(const qw_primitive *p, const double at[3], double row[UNKNOWNS])
{
    double length = distance_along(at, row);
    for (int k = 0; k < 3; k++) row[k] = -row[k];
    row[3] = -1;
    return length - p->radius;
}

static double derivatives(const qw_primitive *p, const double u[3], const double v[3], const double point[3],
                          double row[UNKNOWNS])
{
    double q[3], least = 1e-12;
    for (int k = 0; k < 3; k++) q[k] = point[k] - p->point[k];
    const double at[3] = {qw_dot_doubles(q, u), qw_dot_doubles(q, v), qw_dot_doubles(q, p->axis)};
    if (p->kind == QW_SPHERE) return derive_sphere(p, at, row);
    double rho = fmax(sqrt(at[0] * at[0] + at[1] * at[1]), least);
    return p->kind == QW_TORUS ? derive_torus(p, at, rho, row) : derive_cone(p, at, rho, row);
}

/* Changes it by the unknowns; false where it is none then. */
static bool change(qw_primitive *p, const double u[3], const double v[3], const double b[UNKNOWNS])
{
    bool is_sphere = p->kind == QW_SPHERE, is_torus = p->kind == QW_TORUS;
    double along = is_sphere ? b[2] : is_torus ? b[5] : 0;
    for (int k = 0; k < 3; k++) p->point[k] += b[0] * u[k] + b[1] * v[k] + along * p->axis[k];
    for (int k = 0; k < 3 && !is_sphere; k++) p->axis[k] += b[2] * u[k] + b[3] * v[k];
    p->radius += is_sphere ? b[3] : b[4];
    if (is_torus) p->tube += b[6];
    if (p->kind == QW_CONE) p->sine = p->sine * sqrt(fmax(0, 1 - b[5] * b[5])) + cosine_of(p) * b[5];
    return normalize(p->axis) && p->radius > 0 && fabs(p->sine) < 1 && p->tube >= 0;
}

/* One step of Gauss and Newton. */
static bool improve(qw_primitive *p, const double *point, uint32_t count)
{
    uint32_t n = qw_primitive_freedom(p->kind);
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, b[UNKNOWNS] = {0}, row[UNKNOWNS], u[3], v[3];
    frame_of(p->axis, u, v);
    for (uint32_t i = 0; i < count; i++) {
        double d = derivatives(p, u, v, point + 3 * (size_t)i, row);
        add_row(n, row, -d, m, b);
    }
    return solve(n, m, b) && change(p, u, v, b);
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
    assert(count > 0);
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

/* The line that meets all normals, as the axis of a torus does: the least eigenvector of the sum of their coordinates
   (moment, direction), by inverse iteration. p->point is the middle of the points, and goes onto the line. */
static bool guess_axis(qw_primitive *p, const qw_facing *facing, double extent)
{
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, x[UNKNOWNS] = {1, 0.7, 0.5, 0.4, 0.3, 0.2}, unused[UNKNOWNS], trace = 0;
    for (uint32_t i = 0; i < facing->count; i++) {
        const double *n = facing->normal + 3 * (size_t)i, *at = facing->middle + 3 * (size_t)i;
        double row[UNKNOWNS], q[3];
        for (int k = 0; k < 3; k++) q[k] = (at[k] - p->point[k]) / extent, row[3 + k] = n[k];
        qw_cross_doubles(q, n, row);
        add_row(LINE, row, 0, m, unused);
    }
    for (int i = 0; i < LINE; i++) trace += m[i][i];
    for (int i = 0; i < LINE; i++) m[i][i] += 1e-9 * trace;
    for (int step = 0; step < LINE_STEPS; step++) {
        double copy[UNKNOWNS][UNKNOWNS], largest = 0;
        memcpy(copy, m, sizeof copy);
        if (!solve(LINE, copy, x)) return false;
        for (int i = 0; i < LINE; i++) largest = fmax(largest, fabs(x[i]));
        for (int i = 0; i < LINE; i++) x[i] /= largest;
    }
    double square = qw_dot_doubles(x, x), foot[3];
    if (!(square > 1e-12)) return false;
    qw_cross_doubles(x, x + 3, foot);
    for (int k = 0; k < 3; k++) p->axis[k] = x[k] / sqrt(square), p->point[k] += extent * foot[k] / square;
    return true;
}

/* The circle in the half plane beside the axis that comes nearest to the points. */
static bool guess_tube(qw_primitive *p, const double *point, uint32_t count)
{
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, b[UNKNOWNS] = {0};
    for (uint32_t i = 0; i < count; i++) {
        double q[3];
        for (int k = 0; k < 3; k++) q[k] = point[3 * (size_t)i + (size_t)k] - p->point[k];
        double z = qw_dot_doubles(q, p->axis), square = qw_dot_doubles(q, q), rho = sqrt(fmax(0, square - z * z)),
               row[UNKNOWNS] = {2 * rho, 2 * z, 1};
        add_row(3, row, square, m, b);
    }
    if (!solve(3, m, b)) return false;
    double square = b[2] + b[0] * b[0] + b[1] * b[1];
    if (!(square > 0) || !(b[0] > 0)) return false;
    for (int k = 0; k < 3; k++) p->point[k] += b[1] * p->axis[k];
    p->radius = b[0], p->tube = sqrt(square);
    return true;
}

/* The sphere that fits the points best by squares of distances, a linear problem; false: there is none. */
static bool guess_sphere(qw_primitive *p, const double *point, uint32_t count)
{
    double m[UNKNOWNS][UNKNOWNS] = {{0}}, b[UNKNOWNS] = {0};
    for (uint32_t i = 0; i < count; i++) {
        double row[UNKNOWNS], q[3];
        for (int k = 0; k < 3; k++) q[k] = point[3 * (size_t)i + (size_t)k] - p->point[k], row[k] = 2 * q[k];
        row[3] = 1;
        add_row(4, row, qw_dot_doubles(q, q), m, b);
    }
    if (!solve(4, m, b)) return false;
    double square = b[3] + qw_dot_doubles(b, b);
    if (!(square > 0)) return false;
    for (int k = 0; k < 3; k++) p->point[k] += b[k], p->axis[k] = k == 2;
    p->radius = sqrt(square);
    return true;
}

double qw_fit_primitive(qw_primitive *p, qw_primitive_kind kind, const double *point, uint32_t count,
                        const qw_facing *facing)
{
    assert(kind < QW_PRIMITIVE_KINDS && point && (facing || kind == QW_PLANE || kind == QW_SPHERE));
    if (count <= qw_primitive_freedom(kind)) return INFINITY;
    *p = (qw_primitive){.kind = kind};
    if (kind == QW_PLANE) return qw_refine_primitive(p, point, count);
    middle_of(point, count, p->point);
    double extent = extent_of(point, count, p->point);
    if (kind == QW_SPHERE) {
        if (!guess_sphere(p, point, count)) return INFINITY;
    } else if (kind == QW_TORUS) {
        if (!guess_axis(p, facing, extent) || !guess_tube(p, point, count)) return INFINITY;
    } else {
        spread_axis(facing->normal, facing->count, p->axis);
        if (!guess_circle(p, point, count)) return INFINITY;
    }
    if (!(largest_distance(p, point, count) <= NO_GUESS * extent)) return INFINITY;
    return qw_refine_primitive(p, point, count);
}

#include "remesh/features/side_fit.h"

#include <assert.h>
#include <string.h>

enum { TERMS = QW_FIT_TERMS, PLANE = 3, TROUGH = 4, RINGS = 8, STEPS = 6 };
/* How far vertices are taken from, in edges, and how many there must be before near ones are left out. */
static const float REACH = 4.5f;
enum { ENOUGH = 2 * TERMS };
/* The simplest of plane, trough and quadric serves that is off by no more than so many times as much as the quadric, in
 * squares by degree of freedom: what noise has bent must not be extrapolated. */
static const double BENT = 3;
/* Added to the squares of the terms, as shares of the number of points: so that few points, or points in a row, have an
 * answer, and the flattest of all. */
static const double TILT_PRICE = 1e-6, BOW_PRICE = 0.02;
/* The same where sides meet: of their gradients, about 1. Sides at 40 degrees are off by a hundredth after a step. */
static const double PARALLEL = 1e-3;

typedef double equations[TERMS][TERMS + 1];

/* The first so many terms; the others are 0. Positive definite: no pivots. */
static void solve_terms(const equations all, int terms, double *x)
{
    assert(terms > 0 && terms <= TERMS);
    equations m;
    memcpy(m, all, sizeof m);
    for (int i = 0; i < terms; i++) m[i][i] += (i < PLANE ? TILT_PRICE : BOW_PRICE) * all[0][0];
    for (int i = 0; i < terms; i++)
        for (int k = i + 1; k < terms; k++) {
            double f = m[k][i] / m[i][i];
            for (int j = i; j <= TERMS; j++) m[k][j] -= f * m[i][j];
        }
    for (int i = TERMS - 1; i >= 0; i--) {
        x[i] = 0;
        if (i >= terms) continue;
        x[i] = m[i][TERMS];
        for (int j = i + 1; j < terms; j++) x[i] -= m[i][j] * x[j];
        x[i] /= m[i][i];
    }
}

static void add_point(equations m, const qw_side_fit *q, qw_vec3 p)
{
    qw_vec3 d = qw_scale(qw_sub(p, q->origin), 1 / q->unit);
    double x = (double)qw_dot(d, q->x), y = (double)qw_dot(d, q->y), z = (double)qw_dot(d, q->n);
    double t[TERMS + 1] = {1, x, y, x * x, x * y, y * y, z};
    for (int i = 0; i < TERMS; i++)
        for (int j = 0; j <= TERMS; j++) m[i][j] += t[i] * t[j];
}

/* Height, and its gradient. */
static double height_at(const qw_side_fit *q, const double p[3], double g[3])
{
    const double X[3] = {(double)q->x.x, (double)q->x.y, (double)q->x.z},
                 Y[3] = {(double)q->y.x, (double)q->y.y, (double)q->y.z},
                 N[3] = {(double)q->n.x, (double)q->n.y, (double)q->n.z},
                 o[3] = {(double)q->origin.x, (double)q->origin.y, (double)q->origin.z}, u = (double)q->unit;
    double x = 0, y = 0, z = 0;
    for (int k = 0; k < 3; k++) {
        double d = (p[k] - o[k]) / u;
        x += d * X[k], y += d * Y[k], z += d * N[k];
    }
    const double *t = q->term;
    double gx = t[1] + 2 * t[3] * x + t[4] * y, gy = t[2] + t[4] * x + 2 * t[5] * y;
    for (int k = 0; k < 3; k++) g[k] = N[k] - gx * X[k] - gy * Y[k];
    return u * (z - (t[0] + t[1] * x + t[2] * y + t[3] * x * x + t[4] * x * y + t[5] * y * y));
}

double qw_height_over(const qw_side_fit *fit, qw_vec3 point)
{
    double p[3] = {(double)point.x, (double)point.y, (double)point.z}, g[3];
    return height_at(fit, p, g);
}

qw_vec3 qw_normal_of(const qw_side_fit *fit, qw_vec3 point)
{
    double p[3] = {(double)point.x, (double)point.y, (double)point.z}, g[3];
    height_at(fit, p, g);
    return qw_normalize(qw_v3_of_doubles(g));
}

/* Keeps of the vertices found those from the highest ring on that are enough together. */
static void keep_outer(qw_vertex_ball *ball, const uint8_t *ring)
{
    uint32_t count[RINGS + 1] = {0}, from = RINGS, kept = 0;
    for (uint32_t i = 0; i < ball->count; i++)
        for (uint32_t r = 0; r <= ring[ball->vertex[i]]; r++) count[r]++;
    while (from > 0 && count[from] < ENOUGH) from--;
    for (uint32_t i = 0; i < ball->count; i++)
        if (ring[ball->vertex[i]] >= from) ball->vertex[kept++] = ball->vertex[i];
    ball->count = kept;
}

static void fit_terms(const qw_vertex_ball *ball, const qw_vec3 *position, int terms, qw_side_fit *q)
{
    equations m = {{0}};
    for (uint32_t i = 0; i < ball->count; i++) add_point(m, q, position[ball->vertex[i]]);
    solve_terms((const double(*)[TERMS + 1]) m, terms, q->term);
}

/* Sum of squares, by degree of freedom. */
static double off_fit(const qw_vertex_ball *ball, const qw_vec3 *position, int terms, const qw_side_fit *q)
{
    double sum = 0;
    for (uint32_t i = 0; i < ball->count; i++) {
        double height = qw_height_over(q, position[ball->vertex[i]]);
        sum += height * height;
    }
    return sum / ((int)ball->count > terms ? (int)ball->count - terms : 1);
}

/* Turns the axes so that the quadric bends most along x: by half the angle that twice its bows have. */
static void turn_to_bow(qw_side_fit *q)
{
    double half = 0.5 * (q->term[3] - q->term[5]), twist = 0.5 * q->term[4], spread = sqrt(half * half + twist * twist);
    if (q->term[3] + q->term[5] < 0) half = -half, twist = -twist; /* most, whatever its sign */
    double along = half >= 0 ? half + spread : twist, across = half >= 0 ? twist : spread - half;
    qw_vec3 x = qw_normalize(qw_madd(qw_scale(q->x, (float)along), (float)across, q->y));
    if (qw_length2(x) > 0) q->x = x, q->y = qw_cross(q->n, x);
}

qw_side_fit qw_fit_side(const qw_sides *s, uint32_t v, const uint8_t *barred, const uint8_t *ring)
{
    assert(v < s->mesh->vertex_count && s->edge[v] > 0);
    const qw_vec3 *position = s->mesh->position;
    qw_side_fit q = {.origin = position[v], .n = s->plane[s->side[v]].normal, .unit = s->edge[v]};
    q.x = qw_any_orthogonal(q.n), q.y = qw_cross(q.n, q.x);
    qw_vertex_ball ball;
    qw_collect_ball(s, v, REACH * q.unit, barred, &ball);
    keep_outer(&ball, ring);
    qw_side_fit simple = q;
    fit_terms(&ball, position, PLANE, &simple);
    if (ball.count <= TERMS) return simple;
    fit_terms(&ball, position, TERMS, &q);
    double most = BENT * off_fit(&ball, position, TERMS, &q);
    if (off_fit(&ball, position, PLANE, &simple) <= most) return simple;
    simple = q;
    turn_to_bow(&simple);
    fit_terms(&ball, position, TROUGH, &simple);
    return off_fit(&ball, position, TROUGH, &simple) <= most ? simple : q;
}

/* One Newton step of least length: a, x: room for the equations of so many sides. */
static void step_to(const qw_side_fit *const *fit, int count, double p[3])
{
    assert(count >= 1 && count <= 3);
    double f[3], g[3][3], a[3][4];
    for (int i = 0; i < count; i++) f[i] = height_at(fit[i], p, g[i]);
    for (int i = 0; i < count; i++) {
        for (int j = 0; j < count; j++) a[i][j] = g[i][0] * g[j][0] + g[i][1] * g[j][1] + g[i][2] * g[j][2];
        a[i][i] += PARALLEL;
        a[i][count] = f[i];
    }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < count; k++) {
            if (k == i) continue;
            double r = a[k][i] / a[i][i];
            for (int j = i; j <= count; j++) a[k][j] -= r * a[i][j];
        }
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) p[k] -= a[i][count] / a[i][i] * g[i][k];
}

qw_vec3 qw_meet_sides(const qw_side_fit *const *fit, int count, qw_vec3 from)
{
    assert(count >= 1 && count <= 3);
    double p[3] = {(double)from.x, (double)from.y, (double)from.z};
    for (int step = 0; step < STEPS; step++) step_to(fit, count, p);
    return qw_v3_of_doubles(p);
}

/* Hostile surfaces: thin, long, nested, touching, torn, folded, far away. Each is made anew for each test, from the
 * shapes of shapes.h where it can be. */
#ifndef QW_TESTS_TORTURE_SHAPES_H
#define QW_TESTS_TORTURE_SHAPES_H

#include "random.h"
#include "shapes.h"

static const double TORTURE_TURN = 6.283185307179586;

/* ---- changes to shapes */

static inline shape torture_empty(uint32_t vertices, uint32_t faces)
{
    return (shape){0, 0, malloc((size_t)vertices * 3 * sizeof(double)), malloc((size_t)faces * 3 * sizeof(uint32_t))};
}

static inline uint32_t torture_point(shape *s, double x, double y, double z)
{
    double *p = s->position + 3 * (size_t)s->vertex_count;
    p[0] = x, p[1] = y, p[2] = z;
    return s->vertex_count++;
}

static inline shape torture_stretched(shape s, double x, double y, double z)
{
    for (uint32_t v = 0; v < s.vertex_count; v++)
        s.position[3 * v] *= x, s.position[3 * v + 1] *= y, s.position[3 * v + 2] *= z;
    return s;
}

static inline shape torture_moved(shape s, double x, double y, double z)
{
    for (uint32_t v = 0; v < s.vertex_count; v++)
        s.position[3 * v] += x, s.position[3 * v + 1] += y, s.position[3 * v + 2] += z;
    return s;
}

/* b is freed; turned: its faces are flipped. */
static inline shape torture_joined(shape a, shape b, bool turned)
{
    shape s = torture_empty(a.vertex_count + b.vertex_count, a.face_count + b.face_count);
    memcpy(s.position, a.position, (size_t)a.vertex_count * 3 * sizeof(double));
    memcpy(s.position + 3 * (size_t)a.vertex_count, b.position, (size_t)b.vertex_count * 3 * sizeof(double));
    s.vertex_count = a.vertex_count + b.vertex_count;
    for (uint32_t f = 0; f < a.face_count; f++)
        shape_triangle(&s, a.corner[3 * f], a.corner[3 * f + 1], a.corner[3 * f + 2]);
    for (uint32_t f = 0; f < b.face_count; f++) {
        const uint32_t *c = b.corner + 3 * (size_t)f;
        uint32_t n = a.vertex_count;
        shape_triangle(&s, n + c[0], n + c[turned ? 2 : 1], n + c[turned ? 1 : 2]);
    }
    shape_free(&a), shape_free(&b);
    return s;
}

static inline double torture_random(uint64_t *state) /* 0 to 1 */
{
    random_step(state);
    return (double)(*state >> 33) / 2147483648.0;
}

/* Every triangle with vertices of its own, each off by up to `noise`. */
static inline shape torture_torn(shape a, double noise)
{
    shape s = torture_empty(3 * a.face_count, a.face_count);
    uint64_t state = 1;
    for (uint32_t h = 0; h < 3 * a.face_count; h++) {
        const double *p = a.position + 3 * (size_t)a.corner[h];
        double q[3];
        for (int i = 0; i < 3; i++) q[i] = p[i] + noise * (2 * torture_random(&state) - 1);
        torture_point(&s, q[0], q[1], q[2]);
    }
    for (uint32_t f = 0; f < a.face_count; f++) shape_triangle(&s, 3 * f, 3 * f + 1, 3 * f + 2);
    shape_free(&a);
    return s;
}

/* ---- thin and long */

static inline shape torture_plate(int k) { return torture_stretched(shape_cube(k), 1, 1, 0.001); }
static inline shape torture_foil(int k) { return torture_stretched(shape_cube(k), 1, 1, 1e-6); }
static inline shape torture_needle(int k) { return torture_stretched(shape_cube(k), 1000, 1, 1); }
static inline shape torture_hair(int k) { return torture_stretched(shape_sphere(k), 1e4, 1, 1); }
static inline shape torture_ribbon(int k) { return torture_stretched(shape_disc(k), 1000, 1, 0); }
static inline shape torture_wire_ring(int k)
{
    shape s = shape_torus(k);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, r = hypot(p[0], p[1]), thin = 1 + 0.005 * (r - 1) / 0.4;
        p[0] *= thin / r, p[1] *= thin / r, p[2] *= 0.005 / 0.4;
    }
    return s;
}

static inline bool torture_is_frame(int x, int y, int z) { return z == 0 && !(x == 1 && y == 1); }
static inline shape torture_pinhole(int k) /* a hole a thousandth as wide as the plate */
{
    shape s = shape_of_cells(3, 3, 1, k, torture_is_frame);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        for (int i = 0; i < 2; i++) {
            double *x = s.position + 3 * (size_t)v + i;
            *x = *x < 1 ? *x : *x < 2 ? 1 + 0.003 * (*x - 1) : 1.003 + (*x - 2);
        }
    return s;
}

static inline bool torture_is_comb(int x, int y, int z) { return z == 0 && (y == 0 || x % 2 == 0); }
static inline shape torture_comb(int k)
{
    return torture_stretched(shape_of_cells(41, 6, 1, k, torture_is_comb), 0.05, 1, 0.5);
}

static inline void torture_at_spiral(double u, double v, double p[3])
{
    double a = 5 * TORTURE_TURN * u, r = 0.2 + 0.1 * u;
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = 0.5 * v;
}
static inline shape torture_spiral(int k)
{
    return shape_of_sheet(&(shape_sheet){40 * k, k, false, false, false, torture_at_spiral});
}

static inline shape torture_columns(int k) /* every other column a millionth as wide: slivers */
{
    shape s = shape_of_sheet(&(shape_sheet){2 * k, k, false, false, false, shape_at_disc});
    for (int j = 0; j <= k; j++)
        for (int i = 0; i <= 2 * k; i++) {
            double *p = s.position + 3 * (size_t)(j * (2 * k + 1) + i);
            p[0] = (i / 2 + (i % 2) * 1e-6) / k, p[1] = (double)j / k, p[2] = 0.2 * sin(3 * p[0]);
        }
    return s;
}

static inline shape torture_sliver(int k)
{
    (void)k;
    shape s = torture_empty(3, 1);
    shape_triangle(&s, torture_point(&s, 0, 0, 0), torture_point(&s, 1, 0, 0), torture_point(&s, 0.3, 1e-6, 0));
    return s;
}

static inline shape torture_wisp(int k) /* a triangle a billionth as high as long */
{
    (void)k;
    shape s = torture_empty(3, 1);
    shape_triangle(&s, torture_point(&s, 0, 0, 0), torture_point(&s, 1, 0, 0), torture_point(&s, 0.5, 1e-9, 0));
    return s;
}

static inline shape torture_rail(int k) { return torture_stretched(shape_cube(k), 1e4, 1, 1); }

/* ---- points and folds */

static inline shape torture_cone(int k)
{
    shape s = torture_empty((uint32_t)(6 * k + 2), (uint32_t)(12 * k));
    uint32_t n = (uint32_t)(6 * k), top = torture_point(&s, 0, 0, 10), foot = torture_point(&s, 0, 0, 0);
    for (uint32_t i = 0; i < n; i++) torture_point(&s, cos(TORTURE_TURN * i / n), sin(TORTURE_TURN * i / n), 0);
    for (uint32_t i = 0; i < n; i++)
        shape_triangle(&s, 2 + i, 2 + (i + 1) % n, top), shape_triangle(&s, 2 + (i + 1) % n, 2 + i, foot);
    return s;
}

static inline void torture_at_cusp(double u, double v, double p[3])
{
    double r = 3 * v * v * v * (1 - v), a = TORTURE_TURN * u;
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = 2 * v;
}
static inline shape torture_cusp(int k)
{
    return shape_of_sheet(&(shape_sheet){3 * k, 6 * k, true, false, false, torture_at_cusp});
}

static inline shape torture_hedgehog(int k)
{
    shape s = shape_sphere(k);
    for (uint32_t v = 0; v < s.vertex_count; v += 7)
        for (int i = 0; i < 3; i++) s.position[3 * v + (uint32_t)i] *= 2;
    return s;
}

static inline void torture_at_fold(double u, double v, double p[3])
{
    double x = fabs(2 * u - 1);
    p[0] = x, p[1] = v, p[2] = u < 0.5 ? 0 : 1e-4 * x;
}
static inline shape torture_fold(int k)
{
    return shape_of_sheet(&(shape_sheet){2 * k, k, false, false, false, torture_at_fold});
}

static inline shape torture_noise(int k)
{
    shape s = shape_sphere(k);
    uint64_t state = 3;
    for (uint32_t i = 0; i < 3 * s.vertex_count; i++) s.position[i] += 0.15 * (torture_random(&state) - 0.5);
    return s;
}

static inline shape torture_wheel(int k) /* all triangles about one vertex */
{
    uint32_t n = (uint32_t)(40 * k);
    shape s = torture_empty(n + 1, n);
    uint32_t hub = torture_point(&s, 0, 0, 0.3);
    for (uint32_t i = 0; i < n; i++) torture_point(&s, cos(TORTURE_TURN * i / n), sin(TORTURE_TURN * i / n), 0);
    for (uint32_t i = 0; i < n; i++) shape_triangle(&s, hub, 1 + i, 1 + (i + 1) % n);
    return s;
}

/* ---- many parts, many handles */

static inline bool torture_is_sponge(int x, int y, int z)
{
    for (; x || y || z; x /= 3, y /= 3, z /= 3)
        if ((x % 3 == 1) + (y % 3 == 1) + (z % 3 == 1) > 1) return false;
    return true;
}
static inline shape torture_sponge(int k) { return shape_of_cells(3, 3, 3, k, torture_is_sponge); }
static inline shape torture_sponge_2(int k) { return shape_of_cells(9, 9, 9, k, torture_is_sponge); }

static inline bool torture_is_grating(int x, int y, int z) { return z == 0 && !(x % 2 == 1 && y % 2 == 1); }
static inline shape torture_grating(int k) { return shape_of_cells(23, 23, 1, k, torture_is_grating); } /* genus 121 */

static inline shape torture_shells(int k)
{
    shape s = torture_joined(shape_sphere(k), torture_stretched(shape_sphere(k), 0.99, 0.99, 0.99), true);
    return torture_joined(s, torture_stretched(shape_sphere(k), 0.98, 0.98, 0.98), false);
}

static inline void torture_at_tube(double u, double v, double p[3])
{
    double a = TORTURE_TURN * u;
    p[0] = cos(a), p[1] = sin(a), p[2] = 2 * v;
}
static inline shape torture_tube(int k)
{
    return shape_of_sheet(&(shape_sheet){6 * k, 2 * k, true, false, false, torture_at_tube});
}
static inline shape torture_sleeves(int k)
{
    return torture_joined(torture_tube(k), torture_stretched(torture_tube(k), 0.995, 0.995, 1), false);
}

static inline shape torture_fragments(int k) /* tetrahedra, of sizes from 1 to 1/8 */
{
    shape s = torture_empty((uint32_t)(4 * k * k), (uint32_t)(4 * k * k));
    for (int i = 0; i < k * k; i++) {
        double x = 2 * (i % k), y = 2 * (i / k), r = ldexp(1, -(i % 4));
        uint32_t a = torture_point(&s, x, y, 0), b = torture_point(&s, x + r, y, 0), c = torture_point(&s, x, y + r, 0);
        uint32_t d = torture_point(&s, x, y, r);
        shape_triangle(&s, a, c, b), shape_triangle(&s, a, b, d), shape_triangle(&s, b, c, d),
            shape_triangle(&s, c, a, d);
    }
    return s;
}

/* A cube and another, smaller by the factor, three cubes away. */
static inline shape torture_cube_and(int k, double factor)
{
    return torture_joined(shape_cube(k),
                          torture_moved(torture_stretched(shape_cube(k), factor, factor, factor), 3, 0, 0), false);
}
static inline shape torture_fragment(int k) { return torture_cube_and(k, 1e-7); }
static inline shape torture_mote(int k) { return torture_cube_and(k, 1e-11); }

static inline shape torture_confetti(int k) /* single triangles in all directions */
{
    shape s = torture_empty((uint32_t)(3 * k * k), (uint32_t)(k * k));
    uint64_t state = 5;
    for (int i = 0; i < k * k; i++) {
        double at[3];
        for (int j = 0; j < 3; j++) at[j] = k * torture_random(&state);
        for (int c = 0; c < 3; c++)
            torture_point(&s, at[0] + torture_random(&state), at[1] + torture_random(&state),
                          at[2] + torture_random(&state));
        shape_triangle(&s, (uint32_t)(3 * i), (uint32_t)(3 * i + 1), (uint32_t)(3 * i + 2));
    }
    return s;
}

/* ---- touching, torn, turned */

static inline shape torture_soup(int k) /* any three of few points */
{
    shape s = torture_empty(64, (uint32_t)(k * k));
    uint64_t state = 7;
    for (int i = 0; i < 64; i++) torture_point(&s, i % 4, i / 4 % 4, i / 16);
    for (int i = 0; i < k * k; i++)
        shape_triangle(&s, (uint32_t)(64 * torture_random(&state)), (uint32_t)(64 * torture_random(&state)),
                       (uint32_t)(64 * torture_random(&state)));
    return s;
}

static inline bool torture_is_stair(int x, int y, int z) { return x == y && z == 0; }
static inline bool torture_is_diagonal(int x, int y, int z) { return x == y && y == z; }
static inline shape torture_edge_to_edge(int k) { return shape_of_cells(3, 3, 1, k, torture_is_stair); }
static inline shape torture_tip_to_tip(int k) { return shape_of_cells(3, 3, 3, k, torture_is_diagonal); }
static inline shape torture_wall_to_wall(int k)
{
    return torture_joined(shape_cube(k), torture_moved(shape_cube(k), 1, 0, 0), false);
}
static inline shape torture_crossing(int k)
{
    return torture_joined(shape_sphere(k), torture_moved(shape_sphere(k), 0.5, 0.3, 0.2), false);
}

static inline shape torture_book(int k) /* pages about one spine */
{
    shape s = torture_empty((uint32_t)(2 * (k + 1)), (uint32_t)(2 * k));
    uint32_t a = torture_point(&s, 0, 0, 0), b = torture_point(&s, 0, 0, 1);
    for (int i = 0; i < k; i++) {
        double x = cos(3 * (double)i / k), y = sin(3 * (double)i / k);
        uint32_t c = torture_point(&s, x, y, 1), d = torture_point(&s, x, y, 0);
        shape_triangle(&s, a, d, c), shape_triangle(&s, a, c, b);
    }
    return s;
}

static inline shape torture_cracks(int k) { return torture_torn(shape_sphere(k), 1e-7); }
static inline shape torture_inverted(int k)
{
    shape s = shape_torus(k);
    for (uint32_t f = 0; f < s.face_count; f += 3) {
        uint32_t c = s.corner[3 * f];
        s.corner[3 * f] = s.corner[3 * f + 1], s.corner[3 * f + 1] = c;
    }
    return s;
}
static inline shape torture_inside_out(int k) { return torture_stretched(shape_double_frame(k), -1, 1, 1); }

static inline shape torture_doubled(int k) /* every face twice, one of the two turned, and faces without an area */
{
    shape a = shape_cube(k), b = shape_cube(k), s = torture_joined(a, b, true);
    for (uint32_t f = s.face_count / 2; f < s.face_count; f++) {
        for (int i = 0; i < 3; i++) s.corner[3 * f + (uint32_t)i] -= s.vertex_count / 2;
        if (f % 5 == 0) s.corner[3 * f] = s.corner[3 * f + 1];
    }
    return s;
}

/* ---- coordinates */

static inline shape torture_far(int k)
{
    shape s = shape_sphere(k);
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * v] += 0.01 * (v % 2);
    return torture_moved(s, 1e7, -1e7, 1e7);
}
static inline shape torture_tiny(int k) { return torture_stretched(shape_double_frame(k), 1e-9, 1e-9, 1e-9); }
static inline shape torture_least(int k) { return torture_stretched(shape_torus(k), 1e-300, 1e-300, 1e-300); }
static inline shape torture_huge(int k) { return torture_stretched(shape_torus(k), 5e299, 5e299, 5e299); }

#endif

/* Whether quads follow the shape, on surfaces whose directions, patches and chords are known. */
#include "products/measure/base_complex.h"
#include "geometry/curvature.h"
#include "products/measure/measure.h"
#include "products/measure/follow.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdio.h>
#include <string.h>

#include "suite.h"
#include "unit_shapes.h"

enum { MOST = 70000 };
static const double pi = 3.141592653589793;

/* A polygon mesh that is being put together. */
typedef struct maker {
    double point[3 * MOST];
    uint32_t corner[4 * MOST], vertices, faces, sides;
} maker;
static maker quads, surface;

static uint32_t add_point(maker *m, double x, double y, double z)
{
    double *p = m->point + 3 * (size_t)m->vertices;
    p[0] = x, p[1] = y, p[2] = z;
    assert_true(m->vertices < MOST - 1);
    return m->vertices++;
}

static void add_quad(maker *m, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    const uint32_t two[2][3] = {{a, b, c}, {a, c, d}}, one[4] = {a, b, c, d};
    if (m->sides == 4) memcpy(m->corner + 4 * (size_t)m->faces++, one, sizeof one);
    else memcpy(m->corner + 3 * (size_t)m->faces, two, sizeof two), m->faces += 2;
}

static qw_mesh_view view_of(const maker *m)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = m->vertices,
                          .face_count = m->faces,
                          .uniform_face_size = m->sides,
                          .positions = m->point,
                          .corners = m->corner};
}

/* rows x columns quads; a wrapped direction ends where it begins. */
static void add_grid(maker *m, uint32_t first, uint32_t rows, uint32_t columns, bool wrap_rows, bool wrap_columns)
{
    uint32_t width = wrap_columns ? columns : columns + 1, height = wrap_rows ? rows : rows + 1;
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < columns; j++) {
            uint32_t below = first + i * width, above = first + (i + 1) % height * width, right = (j + 1) % width;
            add_quad(m, below + j, below + right, above + right, above + j);
        }
}

static void begin(maker *m, uint32_t sides) { m->vertices = m->faces = 0, m->sides = sides; }

/* Around the z axis, radius 1, open, height 4. turn: of the first vertices, in steps. */
static void make_tube(maker *m, uint32_t sides, uint32_t rows, uint32_t around, double turn)
{
    begin(m, sides);
    for (uint32_t i = 0; i <= rows; i++)
        for (uint32_t j = 0; j < around; j++) {
            double a = 2 * pi * (j + turn) / around;
            add_point(m, cos(a), sin(a), 4.0 * i / rows - 2);
        }
    add_grid(m, 0, rows, around, false, true);
}

/* A square of n x n quads of that size on the tube's wall, at an angle to its axis. */
static void make_slanted(uint32_t n, double size, double degrees)
{
    double c = cos(degrees * pi / 180) * size, s = sin(degrees * pi / 180) * size;
    begin(&quads, 4);
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            double u = j - 0.5 * n, v = i - 0.5 * n, a = c * u - s * v;
            add_point(&quads, cos(a), sin(a), s * u + c * v);
        }
    add_grid(&quads, 0, n, n, false, false);
}

static void make_torus(maker *m, uint32_t sides, uint32_t rows, uint32_t around)
{
    begin(m, sides);
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < around; j++) {
            double a = 2 * pi * i / rows, b = 2 * pi * j / around, r = 1 + 0.4 * cos(b);
            add_point(m, r * cos(a), r * sin(a), 0.4 * sin(b));
        }
    add_grid(m, 0, rows, around, true, true);
}

/* The faces of a tetrahedron in three quads each, n x n quads in each of these, drawn onto an ellipsoid. Points of
   edges are found again by their places. */
static uint32_t point_at(maker *m, const double p[3])
{
    double l = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), q[3] = {p[0] / l, 0.7 * p[1] / l, 0.5 * p[2] / l};
    for (uint32_t v = 0; v < m->vertices; v++) {
        const double *o = m->point + 3 * (size_t)v;
        if (fabs(o[0] - q[0]) + fabs(o[1] - q[1]) + fabs(o[2] - q[2]) < 1e-9) return v;
    }
    return add_point(m, q[0], q[1], q[2]);
}

static void add_patch(maker *m, uint32_t n, const double p[4][3])
{
    uint32_t number[32][32];
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            double u = (double)j / n, v = (double)i / n, q[3];
            for (int k = 0; k < 3; k++)
                q[k] = (1 - v) * ((1 - u) * p[0][k] + u * p[1][k]) + v * ((1 - u) * p[3][k] + u * p[2][k]);
            number[i][j] = point_at(m, q);
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++)
            add_quad(m, number[i][j], number[i][j + 1], number[i + 1][j + 1], number[i + 1][j]);
}

static void make_ellipsoid(maker *m, uint32_t sides, uint32_t n)
{
    static const double tip[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    static const int face[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    begin(m, sides);
    for (int f = 0; f < 4; f++)
        for (int c = 0; c < 3; c++) {
            const double *a = tip[face[f][c]], *b = tip[face[f][(c + 1) % 3]], *d = tip[face[f][(c + 2) % 3]];
            double p[4][3];
            for (int k = 0; k < 3; k++) {
                p[0][k] = a[k], p[1][k] = (a[k] + b[k]) / 2, p[2][k] = (a[k] + b[k] + d[k]) / 3;
                p[3][k] = (a[k] + d[k]) / 2;
            }
            add_patch(m, n, p);
        }
}

typedef struct outcome {
    qw_env *env;
    qw_mesh_view mesh, against;
    qw_topology t;
    qw_quality q;
} outcome;

static void body(void *user)
{
    outcome *o = user;
    qw_measure_mesh(o->env, &o->mesh, o->against.size ? &o->against : NULL, NULL, &o->t, &o->q);
}

static qw_quality measure(uint32_t threads, bool compare)
{
    outcome o = {.env = qw_env_create(NULL, threads), .mesh = view_of(&quads)};
    if (compare) o.against = view_of(&surface);
    assert_int_equal(qw_protect(o.env, body, &o), QW_OK);
    assert_int_equal(qw_env_bytes(o.env), 0);
    qw_env_destroy(o.env);
    return o.q;
}

static void near(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.12g is not %.12g", a, b);
}

/* ---- patches and chords */

static void test_grids(void **state)
{
    (void)state;
    make_torus(&quads, 4, 12, 7);
    qw_quality q = measure(1, false);
    assert_true(q.patches == 1 && q.chords == 19 && q.crossing == 0); /* nothing is irregular */
    near(q.patch_share, 1.0 / 84, 1e-12);
    near(q.chord_max, 12 / sqrt(84), 1e-12);
    near(q.simple, 1, 1e-12);
    make_tube(&quads, 4, 5, 9, 0);
    q = measure(1, false);
    assert_true(q.patches == 1 && q.chords == 14 && q.crossing == 0); /* a boundary without corners */
    make_slanted(6, 0.1, 10);
    q = measure(1, false);
    assert_true(q.patches == 1 && q.chords == 12 && q.crossing == 0);
    assert_true(q.follow < 0 && q.follow10 < 0 && q.follow30 < 0 && q.mirror < 0);
}

/* Lines leave the eight corners of a cube and the centres of the faces and edges of a tetrahedron. */
/* On a tube of 5 rows of 9: a ring, a mark that ends at both its ends, a corner. */
static void test_creases(void **state)
{
    (void)state;
    uint32_t marks[9][2], single[1][2] = {{9, 18}}, corner[1][2] = {{18, 18}};
    for (uint32_t j = 0; j < 9; j++) marks[j][0] = 18 + j, marks[j][1] = 18 + (j + 1) % 9;
    const struct {
        const uint32_t *marks;
        uint32_t count;
        double patches;
    } rows[] = {{marks[0], 9, 2}, {single[0], 1, 3}, {corner[0], 1, 2}};
    make_tube(&quads, 4, 5, 9, 0);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        outcome o = {.env = qw_env_create(NULL, 1), .mesh = view_of(&quads)};
        o.mesh.marked_edges = rows[i].marks, o.mesh.marked_edge_count = rows[i].count;
        assert_int_equal(qw_protect(o.env, body, &o), QW_OK);
        qw_env_destroy(o.env);
        near(o.q.patches, rows[i].patches, 0);
    }
}

static void test_irregular(void **state)
{
    (void)state;
    make_ellipsoid(&quads, 4, 1);
    qw_quality q = measure(1, false);
    assert_int_equal(quads.faces, 12);
    assert_true(q.patches == 12 && q.chords == 4 && q.crossing == 0); /* a ring of six quads around each tip */
    near(q.chord_max, 6 / sqrt(12), 1e-12);
    make_ellipsoid(&quads, 4, 5);
    q = measure(1, false);
    assert_true(q.patches == 12 && q.chords == 20 && q.crossing == 0);
    near(q.chord_max, 30 / sqrt(300), 1e-12);
}

/* Two grids joined along an L: around the inner corner three quads meet. One strip goes around it and over itself. */
static void test_crossing(void **state)
{
    (void)state;
    begin(&quads, 4);
    for (int i = 0; i < 7; i++) add_point(&quads, cos(i * pi / 3), sin(i * pi / 3), 0);
    /* three quads around a vertex of valence 3: every strip turns past the vertex once */
    uint32_t centre = add_point(&quads, 0, 0, 0);
    for (uint32_t i = 0; i < 3; i++) add_quad(&quads, centre, 2 * i, 2 * i + 1, (2 * i + 2) % 6);
    quads.vertices = 8;
    qw_quality q = measure(1, false);
    assert_true(q.patches == 3 && q.chords == 3 && q.crossing == 0);
    near(q.chord_max, 2 / sqrt(3), 1e-12);
    /* a single quad whose opposite edges lead back into it at a right angle: a strip that crosses itself at once */
    begin(&quads, 4);
    for (int i = 0; i < 9; i++) add_point(&quads, i, i * i, 0);
    add_quad(&quads, 0, 1, 2, 3); /* left through 1-2 and 3-0, below through 0-1, above through 2-3 */
    add_quad(&quads, 2, 1, 4, 5); /* right of it */
    add_quad(&quads, 5, 4, 6, 7);
    add_quad(&quads, 7, 6, 3, 2); /* comes back over the top */
    q = measure(1, false);
    assert_true(q.crossing == 1);
    near(q.chord_max, 5 / sqrt(4), 1e-12); /* three quads, and the first twice */
    assert_true(q.simple > 0 && q.simple < 1);
}

/* ---- follow */

static void test_cylinder(void **state)
{
    (void)state;
    make_tube(&surface, 3, 60, 96, 0);
    const double angles[] = {0, 7, 15, 25, 38, 45};
    for (int i = 0; i < 6; i++) {
        make_slanted(10, 0.17, angles[i]);
        qw_quality q = measure(2, true);
        near(q.follow, angles[i], 0.3);
        near(q.follow10, angles[i] < 10, 1e-9);
        near(q.follow30, angles[i] > 30, 1e-9);
    }
    make_tube(&quads, 4, 20, 24, 0);
    qw_quality q = measure(2, true);
    near(q.follow, 0, 0.3);
}

/* A ball has no direction, nor has a plane; the curved side of the surface that faces away does not count. */
static void test_unclear(void **state)
{
    (void)state;
    begin(&surface, 3);
    begin(&quads, 4);
    for (uint32_t i = 0; i <= 20; i++)
        for (uint32_t j = 0; j <= 20; j++) add_point(&quads, i, j, 0), add_point(&surface, i, j, 0);
    add_grid(&quads, 0, 20, 20, false, false);
    add_grid(&surface, 0, 20, 20, false, false);
    qw_quality q = measure(2, true);
    assert_true(q.follow < 0 && q.follow10 < 0 && q.follow30 < 0);
    near(q.mirror, 0, 1e-6);
}

/* ---- mirror */

static void test_mirror(void **state)
{
    (void)state;
    make_tube(&surface, 3, 60, 96, 0);
    make_tube(&quads, 4, 15, 24, 0);
    near(measure(2, true).mirror, 0, 1e-4);
    /* turned by an eighth of an edge, a vertex comes out a quarter of an edge beside another; edges along the tube are
       4 / 15 long, those around it 2 sin(pi / 24) */
    make_tube(&quads, 4, 15, 24, 0.125);
    double around = 2 * sin(pi / 24),
           edge = (around * 16 * 24 + 4.0 / 15 * 15 * 24 + around * 14 * 24 + 96) / (4 * 15 * 24);
    near(measure(2, true).mirror, 2 * sin(pi / 96) / edge, 2e-3);
    surface.point[0] += 1; /* a thorn of one vertex hardly has area */
    assert_true(measure(2, true).mirror > 0);
    for (uint32_t v = 0; v < surface.vertices; v++) { /* bent and tapered, it has no plane */
        double *p = surface.point + 3 * (size_t)v;
        p[0] = p[0] * (1 + 0.2 * p[2]) + 0.3 * p[1] * p[2], p[1] += 0.2 * p[2] * p[2] * p[2];
    }
    assert_true(measure(2, true).mirror < 0);
}

/* ---- against another implementation */

typedef struct known {
    double follow, follow10, follow30;
    double mirror;
} known;

static void compare(known k)
{
    qw_quality q = measure(1, true);
    near(q.follow, k.follow, 0.25);
    near(q.follow10, k.follow10, 0.015);
    near(q.follow30, k.follow30, 0.015);
    near(q.mirror, k.mirror, 0.01);
    for (uint32_t threads = 2; threads < 5; threads++) {
        qw_quality again = measure(threads, true);
        assert_memory_equal(&q, &again, sizeof q);
    }
}

/* The figures on the right are another program's, with 12,000 samples at random. */
static void test_other_program(void **state)
{
    (void)state;
    make_ellipsoid(&surface, 3, 24);
    make_ellipsoid(&quads, 4, 7);
    compare((known){24.73, 0.0052, 0.2405, 0.4133});
    make_torus(&surface, 3, 120, 60);
    begin(&quads, 4);
    for (uint32_t i = 0; i < 40; i++)
        for (uint32_t j = 0; j < 16; j++) { /* wound around the torus */
            double a = 2 * pi * i / 40, b = 2 * pi * (j + 0.4 * i) / 16, r = 1 + 0.4 * cos(b);
            add_point(&quads, r * cos(a), r * sin(a), 0.4 * sin(b));
        }
    add_grid(&quads, 0, 40, 16, true, true);
    compare((known){5.635, 0.907, 0, 0.2317});
}

/* Two ridges and two valleys meet at right angles: of the tensor's sums over the axes' squares all three cancel, and
   the directions are as clear as they can be. */
static void test_saddle(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_fan(env, 4);
    for (uint32_t i = 0; i < 4; i++)
        m.position[i + 1] = qw_v3(i == 0 || i == 3 ? 1 : -1, i < 2 ? 1 : -1, i % 2 ? -0.5f : 0.5f);
    qw_vec3 normal[4];
    for (uint32_t f = 0; f < 4; f++) normal[f] = qw_normalize(qw_face_cross(&m, f));
    const qw_ball_curvature *c = qw_ball_curvature_of(env, &m, normal, QW_BALL_UNMARKED, 3.5); /* a piece an edge */
    qw_principal p = qw_ball_curvature_at(c, qw_v3(0, 0, 0), qw_v3(0, 0, 1));
    assert_true(p.weight > 0.5f);
    near(fabs((double)p.direction.x), sqrt(0.5), 1e-3);
    near(fabs((double)p.direction.y), sqrt(0.5), 1e-3);
    qw_env_destroy(env);
}

/* ---- quad by quad */

typedef struct angles {
    qw_env *env;
    uint32_t quad[100];
    float angle[100], weight[100];
} angles;

static void angles_body(void *user)
{
    angles *a = user;
    qw_mesh_view mesh = view_of(&quads), against = view_of(&surface);
    qw_find_quad_angles(a->env, &mesh, &against, a->quad, 100, a->angle, a->weight);
}

static void test_quad_angles(void **state)
{
    (void)state;
    static angles a;
    make_tube(&surface, 3, 60, 96, 0);
    make_slanted(10, 0.17, 20);
    a.env = qw_env_create(NULL, 2);
    for (uint32_t i = 0; i < 100; i++) a.quad[i] = i;
    assert_int_equal(qw_protect(a.env, angles_body, &a), QW_OK);
    qw_env_destroy(a.env);
    for (int i = 0; i < 100; i++) {
        near((double)a.angle[i], 20, 1);
        assert_true(a.weight[i] > 0.2f && a.weight[i] < 0.7f); /* k1 h with h = sqrt(area / 100) */
    }
}

QW_TEST_SUITE(shape)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_creases),  cmocka_unit_test(test_grids),         cmocka_unit_test(test_irregular),
        cmocka_unit_test(test_crossing), cmocka_unit_test(test_cylinder),      cmocka_unit_test(test_unclear),
        cmocka_unit_test(test_mirror),   cmocka_unit_test(test_other_program), cmocka_unit_test(test_quad_angles),
        cmocka_unit_test(test_saddle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Measures of hand-made meshes whose figures are known. */
#include "faults.h"
#include "random.h"
#include "shapes.h"
#include "suite.h"
#include "products/measure/measure.h"

#include "products/measure/distance.h"
#include "geometry/effort.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 40000 };
static double points[2][3 * MOST];
static uint32_t indices[2][4 * MOST];

typedef struct outcome {
    qw_mesh_view mesh, against;
    bool compare;
    uint32_t threads;
    qw_topology t;
    qw_quality q;
    qw_env *env;
} outcome;

static void body(void *user)
{
    outcome *o = user;
    qw_measure_mesh(o->env, &o->mesh, o->compare ? &o->against : NULL, NULL, &o->t, &o->q);
}

static qw_status try_measure(outcome *o)
{
    o->env = qw_env_create(NULL, o->threads ? o->threads : 2);
    qw_status status = qw_protect(o->env, body, o);
    size_t bytes = qw_env_bytes(o->env);
    qw_env_destroy(o->env);
    assert_int_equal(bytes, 0);
    return status;
}

static outcome measure(qw_mesh_view mesh, const qw_mesh_view *against)
{
    outcome o = {.mesh = mesh, .compare = against != NULL};
    if (against) o.against = *against;
    assert_int_equal(try_measure(&o), QW_OK);
    return o;
}

static qw_mesh_view view(const double *p, uint32_t vertices, const uint32_t *c, uint32_t faces, uint32_t size)
{
    return (qw_mesh_view){.size = sizeof(qw_mesh_view),
                          .vertex_count = vertices,
                          .face_count = faces,
                          .uniform_face_size = size,
                          .positions = p,
                          .corners = c};
}

/* A grid of n by m quads; wrap joins its ends. twist: the second end upside down. */
static uint32_t grid(uint32_t *c, uint32_t n, uint32_t m, bool wrap_i, bool wrap_j, bool twist)
{
    uint32_t rows = wrap_i ? n : n + 1, columns = wrap_j ? m : m + 1, k = 0;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++)
            for (int q = 0; q < 4; q++) {
                uint32_t x = i + (q == 1 || q == 2), y = (j + (q >= 2)) % columns;
                if (twist && x == rows) y = columns - 1 - y;
                c[k++] = (x % rows) * columns + y;
            }
    return n * m;
}

static qw_mesh_view torus(int slot, uint32_t n, uint32_t m, double big, double small)
{
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < m; j++) {
            double a = 6.283185307179586 * i / n, b = 6.283185307179586 * j / m, *p = points[slot] + 3 * (i * m + j);
            p[0] = (big + small * cos(b)) * cos(a), p[1] = (big + small * cos(b)) * sin(a), p[2] = small * sin(b);
        }
    return view(points[slot], n * m, indices[slot], grid(indices[slot], n, m, true, true, false), 4);
}

/* The unit cube, each side n by n quads, corners and edges shared. */
static qw_mesh_view cube(int slot, uint32_t n) { return shape_cube_of_quads(n, points[slot], indices[slot]); }

static void assert_sound(const qw_topology *t)
{
    assert_int_equal(t->degenerate_faces + t->duplicate_faces + t->nonmanifold_edges + t->nonmanifold_vertices +
                         t->inconsistent_edges + t->isolated_vertices,
                     0);
}

static void near(double a, double b, double tolerance)
{
    if (!(fabs(a - b) <= tolerance)) fail_msg("%.12g is not %.12g", a, b);
}

static void test_cube(void **state)
{
    (void)state;
    outcome o = measure(cube(0, 5), NULL);
    assert_sound(&o.t);
    assert_int_equal(o.t.vertices, 152);
    assert_int_equal(o.t.edges, 300);
    assert_int_equal(o.t.quads, 150);
    assert_int_equal(o.t.euler, 2);
    assert_int_equal(o.t.components, 1);
    assert_int_equal(o.t.boundary_loops, 0);
    assert_int_equal(o.t.irregular, 8);
    assert_int_equal(o.t.valence[3], 8);
    assert_int_equal(o.t.valence[4], 144);
    near(o.q.angle_rms, 0, 1e-9);
    near(o.q.angle_p99, 0, 1e-9);
    near(o.q.area_cv, 0, 1e-7);
    near(o.q.mean_edge, 0.2, 1e-12);
    near(o.q.min_scaled_jacobian, 1, 1e-12);
    assert_int_equal(o.q.negative_corners, 0);
    assert_true(o.q.flipped_faces < 0 && o.q.hausdorff < 0 && o.q.sharp_mean < 0);
}

static void test_two_quads(void **state)
{
    (void)state;
    double p[18] = {0, 0, 0, 1, 0, 0, 3, 0, 0, 0, 1, 0, 1, 1, 0, 3, 1, 0};
    uint32_t c[8] = {0, 1, 4, 3, 1, 2, 5, 4};
    outcome o = measure(view(p, 6, c, 2, 4), NULL);
    assert_sound(&o.t);
    assert_int_equal(o.t.edges, 7);
    assert_int_equal(o.t.boundary_edges, 6);
    assert_int_equal(o.t.boundary_loops, 1);
    assert_int_equal(o.t.euler, 1);
    assert_int_equal(o.t.irregular, 0);
    assert_int_equal(o.t.irregular_boundary, 4);
    near(o.q.mean_edge, 10.0 / 8, 1e-12);
    near(o.q.area_cv, 0.5 / 1.5, 1e-12); /* areas 1 and 2 */
    near(o.q.edge_cv, sqrt((6 * 0.0625 + 2 * 0.5625) / 8) / 1.25, 1e-12);
    c[4] = 2, c[5] = 1, c[6] = 4, c[7] = 5; /* the second the other way round */
    o = measure(view(p, 6, c, 2, 4), NULL);
    assert_int_equal(o.t.inconsistent_edges, 1);
    assert_int_equal(o.t.nonmanifold_edges, 0);
    assert_int_equal(o.t.nonmanifold_vertices, 0);
}

static void test_angles(void **state)
{
    (void)state;
    double rhombus[12] = {0, 0, 0, 1, 0, 0, 1.5, sqrt(0.75), 0, 0.5, sqrt(0.75), 0}; /* 60 and 120 degrees */
    uint32_t c[4] = {0, 1, 2, 3};
    outcome o = measure(view(rhombus, 4, c, 1, 4), NULL);
    near(o.q.angle_rms, 30, 1e-9);
    near(o.q.angle_p99, 30, 1e-5);
    near(o.q.min_scaled_jacobian, sqrt(0.75), 1e-12);
    double dart[12] = {0, 0, 0, 2, 0, 0, 0.5, 0.5, 0, 0, 2, 0}; /* folded inwards at the third corner */
    o = measure(view(dart, 4, c, 1, 4), NULL);
    assert_int_equal(o.q.negative_corners, 1);
    assert_true(o.q.min_scaled_jacobian < 0);
}

static void test_torus_and_band(void **state)
{
    (void)state;
    outcome o = measure(torus(0, 24, 12, 2, 0.7), NULL);
    assert_sound(&o.t);
    assert_int_equal(o.t.euler, 0);
    assert_int_equal(o.t.irregular, 0);
    assert_int_equal(o.t.components, 1);
    uint32_t faces = grid(indices[0], 12, 3, true, false, false); /* an open cylinder, of whatever shape */
    o = measure(view(points[0], 48, indices[0], faces, 4), NULL);
    assert_sound(&o.t);
    assert_int_equal(o.t.euler, 0);
    assert_int_equal(o.t.boundary_loops, 2);
    assert_int_equal(o.t.boundary_edges, 24);
    faces = grid(indices[0], 12, 3, true, false,
                 true); /* a Moebius band: one loop, one seam that no orientation mends */
    o = measure(view(points[0], 48, indices[0], faces, 4), NULL);
    assert_int_equal(o.t.euler, 0);
    assert_int_equal(o.t.boundary_loops, 1);
    assert_int_equal(o.t.nonmanifold_edges + o.t.nonmanifold_vertices, 0);
    assert_int_equal(o.t.inconsistent_edges, 3);
}

static void test_broken(void **state)
{
    (void)state;
    double p[39] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, -1, 0, 0, -1, -1, 0, 0, -1,
                    0, 0, 0, 1, 1, 0, 1, 5, 5, 5, 2, 0, 0,  2, 1, 0,  9,  9, 9};
    uint32_t bow_tie[8] = {0, 1, 2, 3, 0, 4, 5, 6};
    outcome o = measure(view(p, 7, bow_tie, 2, 4), NULL);
    assert_int_equal(o.t.nonmanifold_vertices, 1);
    assert_int_equal(o.t.components, 2);
    assert_int_equal(o.t.boundary_loops, 2);
    assert_int_equal(o.t.euler, 2); /* two discs: the vertex counts once a fan */
    uint32_t book[12] = {0, 1, 2, 3, 0, 6, 5, 1, 0, 1, 8, 7};
    o = measure(view(p, 9, book, 3, 4), NULL);
    assert_int_equal(o.t.nonmanifold_edges, 1);
    assert_int_equal(o.t.inconsistent_edges, 1);
    assert_int_equal(o.t.components, 1);
    assert_int_equal(o.t.isolated_vertices, 1);
    uint32_t twice[12] = {0, 1, 2, 3, 2, 3, 0, 1, 0, 1, 1, 3};
    o = measure(view(p, 4, twice, 3, 4), NULL);
    assert_int_equal(o.t.duplicate_faces, 1);
    assert_int_equal(o.t.degenerate_faces, 1);
    uint32_t sizes[3] = {4, 3, 5}, mixed[12] = {0, 1, 2, 3, 1, 10, 2, 0, 4, 5, 6, 1};
    qw_mesh_view m = view(p, 13, mixed, 3, 0);
    m.face_sizes = sizes;
    o = measure(m, &m);
    assert_int_equal(o.t.quads, 1);
    assert_int_equal(o.t.triangles, 1);
    assert_int_equal(o.t.other_polygons, 1);
    near(o.q.hausdorff, 0, 1e-6);
    mixed[7] = 13;
    outcome bad = {.mesh = m};
    assert_int_equal(try_measure(&bad), QW_INDEX_RANGE);
    o = measure(view(p, 3, NULL, 0, 4), NULL);
    assert_int_equal(o.t.components, 0);
    assert_int_equal(o.t.isolated_vertices, 3);
}

static void test_distances(void **state)
{
    (void)state;
    qw_mesh_view fine = cube(0, 20), coarse = cube(1, 4);
    outcome o = measure(coarse, &fine);
    near(o.q.hausdorff, 0, 1e-5);
    near(o.q.sharp_mean, 0, 1e-5);
    near(o.q.sharp_p95, 0, 1e-5);
    assert_int_equal(o.q.flipped_faces, 0);
    for (uint32_t i = 0; i < 3 * coarse.vertex_count; i++) /* inset by 0.1, edges of 0.2 */
        points[1][i] = 0.8 * (points[1][i] - 0.5) + 0.5;
    o = measure(coarse, &fine);
    near(o.q.mean_edge, 0.2, 1e-12);
    near(o.q.out_to_in_mean, 0.5, 1e-5);
    near(o.q.hausdorff, sqrt(3) * 0.5, 1e-5); /* at the corners */
    assert_true(o.q.in_to_out_mean > 0.5 && o.q.in_to_out_mean < 0.6);
    near(o.q.chamfer, 0.5 * (o.q.in_to_out_mean + o.q.out_to_in_mean), 1e-12);
    near(o.q.sharp_mean, 0.5 * (0.8 * sqrt(2) + 0.2 * 1.5), 0.02); /* 0.1 sqrt(2) away but near the corners */
    assert_true(o.q.sharp_p95 >= o.q.sharp_mean && o.q.sharp_p95 <= sqrt(3) * 0.5 + 1e-5);
    for (uint32_t k = 0; k < 2; k++) { /* turn two faces over: vertices 1 and 3 change places */
        uint32_t *c = indices[1] + 4 * 7 * k, t = c[1];
        c[1] = c[3], c[3] = t;
    }
    assert_int_equal(measure(coarse, &fine).q.flipped_faces, 2);
}

/* An arrowhead that begins at its inner corner's neighbour, as one polygon and as the quads that cover it: a fan would
 * cover more. */
static void test_concave(void **state)
{
    (void)state;
    double p[21] = {0, 0, 0,    4, 0, 0, 4, 4, 0, 3.9, 0.1,
                    0, 2, 0.08, 0, 0, 0, 1, 4, 4, 1}; /* the last two are not used */
    uint32_t whole[5] = {2, 3, 4, 0, 1}, parts[8] = {0, 1, 3, 4, 1, 2, 3, 3};
    qw_mesh_view polygon = view(p, 7, whole, 1, 0), pieces = view(p, 7, parts, 2, 0);
    uint32_t five = 5, sizes[2] = {4, 3};
    polygon.face_sizes = &five;
    pieces.face_sizes = sizes;
    outcome o = measure(pieces, &polygon);
    near(o.q.hausdorff, 0, 1e-5);
    assert_int_equal(o.q.flipped_faces, 0);
}

/* A thin plate whose sides passed through each other: for both the nearest input is the other side, yet they are not
   flipped, since their own is within an edge length. The faces of its rim, two in each of 24 columns, are flipped.
 */
static void test_thin(void **state)
{
    (void)state;
    qw_mesh_view fine = cube(0, 20), coarse = cube(1, 6);
    for (uint32_t v = 0; v < fine.vertex_count; v++) points[0][3 * v + 2] *= 0.02;
    for (uint32_t v = 0; v < coarse.vertex_count; v++) {
        double *z = &points[1][3 * v + 2];
        *z = *z > 0.9 ? 0.008 : *z < 0.1 ? 0.012 : 0.01;
    }
    assert_int_equal(measure(coarse, &fine).q.flipped_faces, 48);
}

static void test_frames(void **state)
{
    (void)state;
    const double scales[5] = {1, 1e-30, 1e30, 1e-150, 3.7}, shifts[5] = {0, 1e-29, 0, -2e-150, 1e6};
    outcome first = {0};
    for (int i = 0; i < 5; i++) {
        qw_mesh_view fine = torus(0, 90, 40, 2, 0.7), coarse = torus(1, 31, 12, 2, 0.7);
        for (int s = 0; s < 2; s++)
            for (uint32_t k = 0; k < 3 * (s ? coarse.vertex_count : fine.vertex_count); k++)
                points[s][k] = points[s][k] * scales[i] + shifts[i];
        outcome o = measure(coarse, &fine);
        if (i == 0) first = o;
        assert_memory_equal(&o.t, &first.t, sizeof o.t);
        near(o.q.mean_edge / scales[i], first.q.mean_edge, 1e-8);
        near(o.q.angle_rms, first.q.angle_rms, 1e-6);
        near(o.q.area_cv, first.q.area_cv, 1e-8);
        near(o.q.hausdorff, first.q.hausdorff, 1e-4);
        near(o.q.chamfer, first.q.chamfer, 1e-5);
        assert_true(o.q.chamfer > 0.01 && o.q.flipped_faces == 0 && o.q.sharp_mean < 0);
    }
}

static void test_threads(void **state)
{
    (void)state;
    outcome first = {
        .mesh = torus(1, 130, 50, 2, 0.7), .against = torus(0, 90, 40, 2, 0.8), .compare = true, .threads = 1};
    assert_int_equal(try_measure(&first), QW_OK);
    for (uint32_t threads = 2; threads < 5; threads++) {
        outcome o = {.mesh = first.mesh, .against = first.against, .compare = true, .threads = threads};
        assert_int_equal(try_measure(&o), QW_OK);
        assert_memory_equal(&o.q, &first.q, sizeof o.q);
        assert_memory_equal(&o.t, &first.t, sizeof o.t);
    }
}

static int by_value(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void test_percentile(void **state)
{
    (void)state;
    float values[129], sorted[129];
    for (int i = 0; i <= 100; i++) values[(i * 37) % 101] = (float)i * 1e-3f;
    near(qw_percentile(values, 101, 0.5), 0.05, 1e-7);
    near(qw_percentile(values, 101, 0.995), 0.0995, 1e-7);
    near(qw_percentile(values, 101, 1), 0.1, 1e-7);
    near(qw_percentile(values, 1, 0.3), values[0], 0);
    for (uint32_t i = 0; i <= 128; i++) { /* of all sizes, and alike but for the last bits */
        uint32_t bits = i < 50 ? (i * 2654435761u) % 0x7f000000u : 0x3f800000u + i * 37 % 8;
        memcpy(&values[i], &bits, sizeof bits);
    }
    memcpy(sorted, values, sizeof values);
    qsort(sorted, 129, sizeof *sorted, by_value);
    for (int i = 0; i <= 128; i++) assert_true(qw_percentile(values, 129, i / 128.0) == sorted[i]);
}

/* A mesh of triangles has no quads to judge, but distances; without an area there are none either. */
static void test_triangles(void **state)
{
    (void)state;
    double p[12] = {0, 0, 0, 2, 0, 0, 0, 2, 0, 1, 0, 0};
    uint32_t c[3] = {0, 1, 2}, flat[3] = {0, 1, 3};
    qw_mesh_view one = view(p, 4, c, 1, 3), none = view(p, 4, flat, 1, 3);
    outcome o = measure(one, &one);
    assert_true(o.q.angle_rms < 0 && o.q.area_cv < 0);
    near(o.q.mean_edge, (4 + sqrt(8)) / 3, 1e-12);
    near(o.q.hausdorff, 0, 1e-6);
    o = measure(one, &none);
    assert_true(o.q.hausdorff < 0 && o.q.flipped_faces < 0);
}

/* Every allocation fails once; nothing leaks, which the counter of held bytes and the sanitizer see. */
static void test_no_memory(void **state)
{
    (void)state;
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE, .is_lasting = true};
    qw_host host = faults_host(&f);
    outcome o = {.mesh = cube(1, 1), .against = cube(0, 1), .compare = true};
    for (int n = 0;; n++) {
        f.allocations = FAULTS_NONE;
        o.env = qw_env_create(&host, 1);
        f.allocations = n;
        qw_status status = qw_protect(o.env, body, &o);
        assert_int_equal(qw_env_bytes(o.env), 0);
        qw_env_destroy(o.env);
        if (status == QW_OK) break;
        assert_int_equal(status, QW_MEMORY);
    }
}

static void test_effort(void **state)
{
    (void)state;
    enum { MANY = 200000 };
    qw_probes few = {40 * 64, 64}, some = {500 * 64, 64}, all = {5000000, 1}, none = {0};
    assert_int_equal(qw_affordable(&few, MANY), MANY);
    assert_int_equal(qw_affordable_step(&few, 5000000), 1);
    assert_int_equal(qw_affordable(&some, MANY), MANY / 5);
    assert_int_equal(qw_affordable_step(&some, MANY), 5);
    assert_int_equal(qw_affordable(&some, QW_EFFORT_AT_LEAST / 500), QW_EFFORT_AT_LEAST / 500);
    assert_int_equal(qw_affordable(&all, MANY), QW_LEAST_SAMPLES);
    assert_int_equal(qw_affordable(&all, 7), 7);
    assert_int_equal(qw_affordable_step(&none, 0), 1);
    uint32_t i, count = 0, seen = 0;
    for (; qw_next_probe(&none, 10, &i); count++) seen |= 1u << i;
    assert_int_equal(count, QW_PROBES);
    assert_int_equal(seen, (1 << 10) - 1);
    assert_false(qw_next_probe(&(qw_probes){0}, 0, &i) || qw_next_probe(&all, 10, &i));
}

/* Each point is in the boxes of nearly all triangles: the few samples that can be afforded measure what all would. */
static void test_soup(void **state)
{
    (void)state;
    enum { FACES = 3000 };
    uint64_t seed = 1;
    for (uint32_t f = 0; f < FACES; f++) {
        for (uint32_t k = 0; k < 9; k++) {
            double x = (double)(random_bits(&seed) >> 11) * 0x1p-53;
            points[0][12 * f + k] = points[1][9 * f + k] = x;
        }
        for (uint32_t k = 0; k < 3; k++) {
            points[0][12 * f + 9 + k] = (points[0][12 * f + k] + points[0][12 * f + 6 + k]) / 2;
            indices[1][3 * f + k] = 3 * f + k;
        }
        for (uint32_t k = 0; k < 4; k++) indices[0][4 * f + k] = 4 * f + k;
    }
    qw_mesh_view against = view(points[1], 3 * FACES, indices[1], FACES, 3);
    outcome o = measure(view(points[0], 4 * FACES, indices[0], FACES, 4), &against);
    assert_true(o.q.out_to_in_mean < 1e-4 && o.q.in_to_out_mean < 1e-4 && o.q.hausdorff < 1e-3);
}

QW_TEST_SUITE(measure)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_cube),           cmocka_unit_test(test_two_quads),  cmocka_unit_test(test_angles),
        cmocka_unit_test(test_torus_and_band), cmocka_unit_test(test_broken),     cmocka_unit_test(test_distances),
        cmocka_unit_test(test_concave),        cmocka_unit_test(test_thin),       cmocka_unit_test(test_frames),
        cmocka_unit_test(test_threads),        cmocka_unit_test(test_percentile), cmocka_unit_test(test_triangles),
        cmocka_unit_test(test_effort),         cmocka_unit_test(test_soup),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* One thread makes the allocations that fail. */
QW_TEST_SUITE(measure_memory)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

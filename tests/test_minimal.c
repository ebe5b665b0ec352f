/* Components made straight from their triangles: topology, orientation, and when they are left to the fields. */
#include "remesh/quads/straight.h"
#include "quadwright/quadwright.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "random.h"
#include "suite.h"

#include "torture_shapes.h"

static qw_trimesh surface_of(qw_env *env, const shape *s)
{
    qw_trimesh m = {.vertex_count = s->vertex_count, .face_count = s->face_count};
    m.position = QW_NEW(env, qw_vec3, m.vertex_count), m.corner = QW_NEW(env, uint32_t, 3 * (size_t)m.face_count);
    m.twin = QW_NEW(env, uint32_t, 3 * (size_t)m.face_count);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        const double *p = s->position + 3 * (size_t)v;
        m.position[v] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
    }
    memcpy(m.corner, s->corner, 3 * (size_t)m.face_count * sizeof *m.corner);
    qw_trimesh_link(env, &m);
    return m;
}

/* How many quads a shape gets by a plan; checks what is made. */
static uint32_t made_of(shape s, qw_straight plan)
{
    qw_env *env = qw_env_create(NULL, 1);
    qw_scope_begin(env);
    qw_trimesh m = surface_of(env, &s);
    qw_census census = qw_trimesh_census(env, &m);
    qw_flip worst;
    qw_quadmesh q = qw_make_straight(env, &m, &plan, &worst);
    if (q.face_count > 0) {
        qw_quadmesh_validate(env, &q);
        qw_quad_census made = qw_quadmesh_census(env, &q);
        assert_true(made.components == 1 && made.boundary_loops == census.boundary_loops);
        assert_true(made.euler == census.euler && made.degenerate_faces + made.double_edges == 0);
        assert_int_equal(worst, QW_NOT_FLIPPED);
    }
    shape_free(&s);
    qw_scope_end(env);
    qw_env_destroy(env);
    return q.face_count;
}

static uint32_t fewest_of(shape s) { return made_of(s, (qw_straight){1, QW_NOT_FLIPPED, true}); }

static void makes_discs_and_spheres(void **state)
{
    (void)state;
    assert_int_equal(fewest_of(shape_cube(1)), 6);
    assert_int_equal(fewest_of(shape_cube(3)), 6);
    assert_int_equal(fewest_of(shape_sphere(4)), 6);
    assert_int_equal(fewest_of(shape_tetrahedron(1)), 6);
    assert_int_equal(fewest_of(shape_one_triangle(1)), 1);
    assert_int_equal(fewest_of(shape_disc(4)), 1);
    assert_int_equal(fewest_of(shape_torus(4)), 0);
    assert_int_equal(fewest_of(shape_annulus(4)), 0);
}

/* Three rings of four vertices, as far from the axis as `seed` says, and two ends. */
static shape lump(uint64_t *seed)
{
    shape s = {14, 24, malloc(42 * sizeof(double)), malloc(72 * sizeof(uint32_t))};
    for (uint32_t v = 0; v < 12; v++) {
        double far = (v / 4 == 1 ? 1 : 0.8) * (0.6 + 0.6 * (double)(random_bits(seed) >> 11) / 0x1p53);
        double *p = s.position + 3 * (size_t)v;
        p[0] = v % 2 ? 0 : v % 4 ? -far : far, p[1] = v % 2 ? v % 4 == 1 ? far : -far : 0, p[2] = 0.6 * (v / 4) - 0.6;
    }
    const double ends[6] = {0, 0, -1.1, 0, 0, 1.1};
    memcpy(s.position + 36, ends, sizeof ends);
    for (uint32_t k = 0; k < 4; k++) {
        const uint32_t n = (k + 1) % 4, strip[18] = {12,    n,     k,     k,     n,     n + 4, k,  n + 4, k + 4,
                                                     k + 4, n + 4, n + 8, k + 4, n + 8, k + 8, 13, k + 8, n + 8};
        memcpy(s.corner + 18 * (size_t)k, strip, sizeof strip);
    }
    return s;
}

/* A sphere of four or five quads has vertices of two edges, and would be withheld in the end. */
static void spheres_have_six_quads(void **state)
{
    (void)state;
    uint64_t seed = 7;
    uint32_t made = 0;
    for (int i = 0; i < 500; i++) {
        uint32_t n = made_of(lump(&seed), (qw_straight){6, QW_NOT_FLIPPED, false});
        assert_true(n == 0 || n >= 6);
        made += n > 0;
    }
    print_message("%u of 500 were made\n", made);
    assert_true(made > 100);
}

/* A needle is not cut into a crowd of triangles as wide as it is for a few quads. */
static void needles_take_no_crowd(void **state)
{
    (void)state;
    double position[] = {0, 0, 0, 1, 0, 0, 0.5, 1e-6, 0, 0.4, -1e-6, 0};
    uint32_t corner[] = {0, 1, 2, 0, 3, 1};
    const shape needle = {4, 2, position, corner};
    qw_env *env = qw_env_create(NULL, 1);
    qw_scope_begin(env);
    qw_trimesh m = surface_of(env, &needle);
    qw_flip worst;
    qw_make_straight(env, &m, &(qw_straight){20, QW_NOT_FLIPPED, false}, &worst);
    assert_true(qw_env_peak(env) < 1000000);
    qw_scope_end(env);
    qw_env_destroy(env);
}

/* The quads of a cube are its sides, facing out; of one that is inside out they face in. */
static void keeps_the_side(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_scope_begin(env);
        shape s = shape_cube(1);
        qw_trimesh m = surface_of(env, &s);
        for (uint32_t f = 0; f < m.face_count && turned; f++) {
            uint32_t *c = m.corner + 3 * (size_t)f, first = c[0];
            c[0] = c[1], c[1] = first;
        }
        qw_trimesh_link(env, &m);
        qw_flip worst;
        qw_quadmesh q = qw_make_straight(env, &m, &(qw_straight){1, QW_NOT_FLIPPED, true}, &worst);
        assert_int_equal(q.face_count, 6);
        for (uint32_t f = 0; f < 6; f++) {
            qw_vec3 out = qw_sub(qw_quad_middle(q.position, q.corner + 4 * (size_t)f), qw_v3(0.5f, 0.5f, 0.5f));
            assert_true(fabsf(qw_dot(out, qw_quad_normal(&q, f)) - (turned ? -0.5f : 0.5f)) < 1e-3f);
        }
        shape_free(&s);
        qw_scope_end(env);
        qw_env_destroy(env);
    }
}

/* Twenty times twenty fragments and single triangles at few quads: as many components come out as went in, and the
   stages see next to none of them. */
static void takes_the_burden_from_the_stages(void **state)
{
    (void)state;
    shape (*const make[])(int k) = {torture_fragments, torture_confetti};
    for (int i = 0; i < 2; i++) {
        shape s = make[i](20);
        qw_mesh_view view = shape_view(&s);
        qw_options options;
        qw_options_init(&options);
        options.faces = 20;
        qw_result *result;
        assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
        const qw_report *report = qw_result_report(result);
        assert_int_equal(report->topology.components, 400);
        assert_int_equal(report->topology.boundary_loops, i == 0 ? 0 : 400);
        assert_int_equal(report->topology.euler, i == 0 ? 800 : 400);
        assert_int_equal(report->topology.degenerate_faces + report->topology.duplicate_faces, 0);
        assert_int_equal(report->faces_asked, 20);
        assert_true(report->working_triangles < 40 * 400); /* of all: at least 40 each */
        qw_result_destroy(result);
        shape_free(&s);
    }
}

QW_TEST_SUITE(minimal)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(makes_discs_and_spheres),
        cmocka_unit_test(spheres_have_six_quads),
        cmocka_unit_test(keeps_the_side),
        cmocka_unit_test(needles_take_no_crowd),
        cmocka_unit_test(takes_the_burden_from_the_stages),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

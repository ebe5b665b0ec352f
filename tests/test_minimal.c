/* Components made straight from their triangles: topology, orientation, and when they are left to the fields. */
#include "remesh/quads/minimal.h"
#include "quadwright/quadwright.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

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

/* n of a shape in a row, and one of twice the size before them. */
static shape row_of(shape (*make)(int k), int k, int n)
{
    shape all = torture_stretched(make(k), 2, 2, 2);
    for (int i = 0; i < n; i++) all = torture_joined(all, torture_moved(make(k), 5 + 3 * i, 0, 0), false);
    return all;
}

/* How many components are made, where so many are there besides the largest; checks what is made. */
static uint32_t count_made(shape (*make)(int k), int k, double edge)
{
    enum { COPIES = 5 };
    qw_env *env = qw_env_create(NULL, 1);
    qw_scope_begin(env);
    shape s = row_of(make, k, COPIES);
    qw_trimesh m = surface_of(env, &s);
    qw_census census = qw_trimesh_census(env, &m);
    qw_minimal minimal = qw_make_minimal(env, &m, &census, edge, 1);
    uint32_t count = minimal.count;
    assert_int_equal(minimal.made[0], 0); /* the largest */
    if (count > 0) {
        const qw_quadmesh *q = &minimal.quads;
        qw_quadmesh_validate(env, q);
        qw_quad_census made = qw_quadmesh_census(env, q);
        bool open = census.boundary_loops > 0;
        assert_int_equal(made.components, count);
        assert_int_equal(made.boundary_loops, open ? count : 0);
        assert_int_equal(made.euler, open ? count : 2 * count);
        assert_int_equal(made.degenerate_faces + made.double_edges, 0);
        assert_int_equal(made.faces, count * (open ? QW_MINIMAL_OPEN : QW_MINIMAL_CLOSED));
    }
    shape_free(&s);
    qw_scope_end(env);
    qw_env_destroy(env);
    return count;
}

static void makes_discs_and_spheres(void **state)
{
    (void)state;
    assert_int_equal(count_made(shape_cube, 1, 2), 5);
    assert_int_equal(count_made(shape_cube, 3, 2), 5);
    assert_int_equal(count_made(shape_sphere, 4, 3), 5);
    assert_int_equal(count_made(shape_tetrahedron, 1, 3), 5);
    assert_int_equal(count_made(shape_one_triangle, 1, 9), 5);
    assert_int_equal(count_made(shape_disc, 4, 9), 5);
}

static void leaves_others(void **state)
{
    (void)state;
    assert_int_equal(count_made(shape_torus, 4, 100), 0);
    assert_int_equal(count_made(shape_annulus, 4, 100), 0);
    assert_int_equal(count_made(shape_cube, 1, 0.5), 0); /* more than six quads are its due */
}

/* The quads of a cube are its sides, facing out; of one that is inside out they face in. */
static void keeps_the_side(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_scope_begin(env);
        shape s = torture_joined(torture_stretched(shape_cube(1), 2, 2, 2), torture_moved(shape_cube(1), 9, 0, 0),
                                 turned);
        qw_trimesh m = surface_of(env, &s);
        qw_census census = qw_trimesh_census(env, &m);
        qw_minimal minimal = qw_make_minimal(env, &m, &census, 2, 1);
        assert_int_equal(minimal.count, 1);
        for (uint32_t f = 0; f < 6; f++) {
            qw_vec3 out = {0, 0, 0}, n = qw_quad_normal(&minimal.quads, f);
            for (int i = 0; i < 4; i++)
                out = qw_madd(out, 0.25f, minimal.quads.position[minimal.quads.corner[4 * f + (uint32_t)i]]);
            out = qw_sub(out, qw_v3(9.5f, 0.5f, 0.5f));
            assert_true(fabsf(qw_dot(out, n) - (turned ? -0.5f : 0.5f)) < 1e-3f);
        }
        shape_free(&s);
        qw_scope_end(env);
        qw_env_destroy(env);
    }
}

/* Twenty times twenty crumbs and single triangles at few quads: as many components come out as went in, and the stages
   see next to none of them. */
static void takes_the_burden_from_the_stages(void **state)
{
    (void)state;
    shape (*const make[])(int k) = {torture_specks, torture_confetti};
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
        cmocka_unit_test(leaves_others),
        cmocka_unit_test(keeps_the_side),
        cmocka_unit_test(takes_the_burden_from_the_stages),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

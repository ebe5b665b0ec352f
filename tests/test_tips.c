/* What sticks out of surfaces of which that is known. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/sizes/tips.h"
#include "base/elementary.h"

enum { HORNS = 5 };
static const float HEIGHT = 0.5f, WIDTH = 0.16f; /* of a horn; its half angle at the centre of the ball, radians */

/* Directions of the horns, none near another. */
static qw_vec3 horn(int i)
{
    static const float d[HORNS][3] = {{0, 0, 1}, {1, 0, 0}, {-0.6f, 0.8f, 0}, {0, -1, 0}, {-0.6f, 0, -0.8f}};
    return qw_v3(d[i][0], d[i][1], d[i][2]);
}

/* A ball of radius 1 with rods that end round. */
static qw_trimesh horned(qw_env *env)
{
    qw_trimesh m = unit_sphere(env, 6);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        for (int i = 0; i < HORNS; i++) {
            float c = qw_dot(m.position[v], horn(i)), angle = acosf(fmaxf(fminf(c, 1), -1));
            if (angle >= WIDTH) continue;
            float up = HEIGHT * sqrtf(1 - angle / WIDTH * (angle / WIDTH)); /* half an ellipsoid */
            m.position[v] = qw_madd(m.position[v], up, horn(i));
        }
    return m;
}

static qw_tip_list find(qw_env *env, const qw_trimesh *m, float edge)
{
    qw_surface_cells cells = qw_cells_of_surface(env, m, edge);
    return qw_find_tips(env, &cells, edge, 0.2f);
}

static void horns_are_found(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = horned(env);
    for (float edge = 0.15f; edge < 0.4f; edge *= 1.3f) {
        qw_tip_list tips = find(env, &m, edge);
        assert_int_equal(tips.count, HORNS);
        bool seen[HORNS] = {false};
        for (uint32_t t = 0; t < tips.count; t++) {
            int nearest = 0;
            for (int i = 1; i < HORNS; i++)
                if (qw_dot(tips.tip[t].point, horn(i)) > qw_dot(tips.tip[t].point, horn(nearest))) nearest = i;
            assert_false(seen[nearest]);
            seen[nearest] = true;
            assert_true(qw_distance(tips.tip[t].point, qw_scale(horn(nearest), 1 + HEIGHT)) < 0.25f * HEIGHT);
            assert_true(tips.tip[t].length > 0.7f * HEIGHT && tips.tip[t].length < 2 * HEIGHT);
            assert_true(tips.tip[t].girth < 2 * (float)QW_PI * 2 * WIDTH);
            if (t > 0)
                assert_true(tips.tip[t].length * tips.tip[t].girth <= tips.tip[t - 1].length * tips.tip[t - 1].girth);
        }
    }
    qw_env_destroy(env);
}

/* The same bytes at any number of threads. */
static void threads_do_not_matter(void **state)
{
    (void)state;
    qw_tip_list list[2];
    qw_env *env[2];
    for (int i = 0; i < 2; i++) {
        env[i] = qw_env_create(NULL, i ? 3 : 1);
        qw_trimesh m = horned(env[i]);
        list[i] = find(env[i], &m, 0.2f);
    }
    assert_int_equal(list[0].count, list[1].count);
    assert_memory_equal(list[0].tip, list[1].tip, list[0].count * sizeof *list[0].tip);
    for (int i = 0; i < 2; i++) qw_env_destroy(env[i]);
}

/* A tube lies on both sides of each of its points, an open one ends at a boundary, a ball and a box are blunt; bumps
   are relief. */
static void nothing_sticks_out(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh bumpy = horned(env), others[] = {unit_torus(env, 120, 24, 0.1f), unit_cylinder(env, 24, 80, 9),
                                                unit_sphere(env, 5), unit_cube(env, 5)};
    for (uint32_t v = 0; v < bumpy.vertex_count; v++)
        bumpy.position[v] = qw_madd(bumpy.position[v], -0.8f,
                                    qw_sub(bumpy.position[v], qw_normalize(bumpy.position[v])));
    for (float edge = 0.1f; edge < 0.5f; edge *= 1.5f) {
        for (int i = 0; i < 4; i++) assert_int_equal(find(env, &others[i], edge).count, 0);
        assert_int_equal(find(env, &bumpy, edge).count, 0);
    }
    qw_env_destroy(env);
}

/* Another mesh of the surface says which of its vertices belong to which tip. */
static void vertices_belong_to_tips(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = horned(env);
    qw_tip_list tips = find(env, &m, 0.2f);
    uint32_t *of = qw_tips_of_vertices(env, &m, &tips), inside = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        if (qw_length(m.position[v]) > 1 + 0.5f * HEIGHT) assert_int_not_equal(of[v], QW_NONE);
        if (of[v] == QW_NONE) continue;
        assert_true(qw_distance(m.position[v], tips.tip[of[v]].point) <= 1.001f * tips.tip[of[v]].length);
        inside++;
    }
    assert_true(inside > 0 && inside < m.vertex_count / 4);
    qw_env_destroy(env);
}

QW_TEST_SUITE(tips)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(horns_are_found),
        cmocka_unit_test(threads_do_not_matter),
        cmocka_unit_test(nothing_sticks_out),
        cmocka_unit_test(vertices_belong_to_tips),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

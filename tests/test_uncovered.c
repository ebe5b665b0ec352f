/* What the quads don't reach, on sheets that cover part of a plane; and what integers make vanish, on strips and closed
 * shapes. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/collapse.h"
#include "remesh/quads/uncovered.h"

/* One row of n quads over the unit square from x = 0 to x = width. */
static qw_quadmesh ribbon(qw_env *env, uint32_t n, float width)
{
    qw_quadmesh q = {.vertex_count = 2 * n + 2, .face_count = n};
    q.position = QW_NEW(env, qw_vec3, q.vertex_count), q.corner = QW_NEW(env, uint32_t, 4 * n);
    for (uint32_t i = 0; i <= n; i++) {
        float x = width * (float)i / (float)n;
        q.position[2 * i] = qw_v3(x, 0, 0), q.position[2 * i + 1] = qw_v3(x, 1, 0);
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t *c = q.corner + 4 * i;
        c[0] = 2 * i, c[1] = 2 * i + 2, c[2] = 2 * i + 3, c[3] = 2 * i + 1;
    }
    return q;
}

static void finds_just_what_is_far(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh surface = unit_grid(env, 40, 40, false, false);
    float *size = QW_NEW(env, float, surface.vertex_count);
    for (uint32_t v = 0; v < surface.vertex_count; v++) size[v] = 0.1f;
    qw_quadmesh ten = ribbon(env, 10, 1), five = ribbon(env, 5, 0.5f), no = {0};
    qw_halves all = qw_halve_quads(env, &ten), half = qw_halve_quads(env, &five), none = qw_halve_quads(env, &no);
    assert_int_equal(qw_uncovered_sites(env, &surface, size, &all, 0.1f).count, 0);
    qw_sites l = qw_uncovered_sites(env, &surface, size, &half, 0.15f);
    assert_true(l.count > 0);
    for (uint32_t i = 0; i < l.count; i++) {
        assert_true(l.point[i].x > 0.5f + 0.15f - 1e-5f);
        assert_true(l.size[i] == 0.1f);
        for (uint32_t j = 0; j < i; j++) assert_true(qw_distance(l.point[i], l.point[j]) >= 0.05f);
    }
    for (uint32_t v = 0; v < surface.vertex_count; v++) { /* each far one has a place that speaks for it */
        if (surface.position[v].x < 0.5f + 0.15f + 1e-5f) continue;
        bool spoken_for = false;
        for (uint32_t i = 0; i < l.count; i++) spoken_for |= qw_distance(l.point[i], surface.position[v]) < 0.05f;
        assert_true(spoken_for);
    }
    assert_int_equal(qw_uncovered_sites(env, &surface, size, &half, 0.6f).count, 0);
    assert_int_equal(qw_uncovered_sites(env, &surface, size, &none, 1).count, 0);
    qw_env_destroy(env);
}

/* The finder over a whole surface, as if it were a decimated complex. */
static uint32_t collapsed(qw_env *env, const qw_trimesh *mesh, const qw_int2 *place, const qw_int2 *chosen)
{
    unit_rng before = {3}, after = {3};
    qw_offset_mesh m = unit_offsets(env, mesh, place, &before), k = unit_offsets(env, mesh, chosen, &after);
    qw_decimated s = {.complex = qw_complex_of(env, &m), .corner = m.corner};
    qw_collapse_finder finder = qw_collapse_finder_make(env, &s);
    return qw_find_collapsed(&finder, k.d);
}

static void contracted_discs_stay_and_bands_vanish(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    enum { NX = 6, NY = 2 };
    qw_trimesh m = unit_grid(env, NX, NY, false, false);
    qw_int2 place[(NX + 1) * (NY + 1)], chosen[(NX + 1) * (NY + 1)];
    for (int v = 0; v < (NX + 1) * (NY + 1); v++) place[v] = (qw_int2){v % (NX + 1), v / (NX + 1)};
    assert_int_equal(collapsed(env, &m, place, place), 0);
    memcpy(chosen, place, sizeof place);
    chosen[NX + 3].x++; /* an inner vertex onto the next: a disc */
    assert_int_equal(collapsed(env, &m, place, chosen), 0);
    memcpy(chosen, place, sizeof place);
    chosen[1].y = chosen[NX + 2].y = chosen[2 * NX + 3].y = 1; /* the strip has no width there: its sides meet */
    assert_int_equal(collapsed(env, &m, place, chosen), 1);
    memset(chosen, 0, sizeof chosen); /* all of it is one vertex: the boundary is gone */
    assert_int_equal(collapsed(env, &m, place, chosen), 1);
    qw_env_destroy(env);
}

/* Around a vertex the real offsets turn by its valence, so that a cube's corners have 3; nothing vanishes at its own
 * size, all does at none. */
static void cones_of_a_cube(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_offset_mesh m = unit_solve(env, unit_cube(env, 3), 0.25f, true).offsets;
    qw_decimated s = {.complex = qw_complex_of(env, &m), .corner = m.corner};
    qw_collapse_finder finder = qw_collapse_finder_make(env, &s);
    uint32_t threes = 0, fours = 0;
    for (uint32_t v = 0; v < finder.vertex_count; v++)
        threes += finder.valence[v] == 3, fours += finder.valence[v] == 4;
    assert_int_equal(threes, 8);
    assert_int_equal(fours, finder.vertex_count - 8);
    qw_int2 *d = QW_NEW_ZERO(env, qw_int2, m.edge_count);
    assert_int_equal(qw_find_collapsed(&finder, d), 1);
    qw_env_destroy(env);
}

QW_TEST_SUITE(uncovered)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_just_what_is_far),
        cmocka_unit_test(contracted_discs_stay_and_bands_vanish),
        cmocka_unit_test(cones_of_a_cube),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

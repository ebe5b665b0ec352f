/* Quads added and taken away for the count, on random meshes that simplification has made irregular: the topology
 * stays, whatever is asked for. */
#include "suite.h"
#include "unit_shapes.h"

#include "base/promise.h"
#include "remesh/quads/count.h"
#include "remesh/quads/repair.h"
#include "remesh/quads/simplify.h"

/* An irregular mesh, open or closed, some of its edges on curves. */
static qw_quadmesh random_quads(qw_env *env, unit_rng *r)
{
    bool wrap_u = unit_random(r, 2), wrap_v = wrap_u && unit_random(r, 2);
    uint32_t nu = 5 + unit_random(r, 6), nv = 5 + unit_random(r, 6);
    qw_quadmesh q = unit_quads(env, nu, nv, wrap_u, wrap_v);
    for (uint32_t h = 0; h < 4 * q.face_count; h++)
        if (q.twin[h] != QW_NONE && q.twin[h] < h && unit_random(r, 30) == 0) {
            q.mark[h] = q.mark[q.twin[h]] = 1;
            for (int i = 0; i < 2; i++) {
                uint32_t v = q.corner[i ? qw_quad_next(h) : h];
                if (q.kind[v] == QW_VERTEX_FREE) q.kind[v] = QW_VERTEX_CURVE;
            }
        }
    qw_simplify_counts counts = {0};
    return qw_simplify_quads(env, &q, NULL, 0, q.face_count - 3, false, &counts);
}

static void adds_to_any_count(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {77};
    for (int round = 0; round < 200; round++) {
        qw_scope_begin(env);
        qw_quadmesh q = random_quads(env, &r);
        int64_t least = q.face_count + 1 + unit_random(&r, round % 4 ? 12 : 300), most = least + unit_random(&r, 6);
        qw_quadmesh more = qw_add_quads(env, &q, NULL, least, most);
        unit_assert_kept(env, &q, &more);
        assert_true(more.face_count >= least && more.face_count <= most);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* All vertices lie on curves and no chord has room: only pairs of quads are left. */
static void pairs_become_three(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint32_t n = 3; n < 12; n++)
        for (uint32_t more = 1; more < n; more++) {
            qw_scope_begin(env);
            qw_quadmesh q = unit_quads(env, n, n, n % 2, n % 2);
            for (uint32_t v = 0; v < q.vertex_count; v++)
                if (q.kind[v] == QW_VERTEX_FREE) q.kind[v] = QW_VERTEX_CURVE;
            int64_t count = q.face_count + more;
            qw_quadmesh m = qw_add_quads(env, &q, NULL, count, count);
            unit_assert_kept(env, &q, &m);
            assert_int_equal(m.face_count, count);
            qw_scope_end(env);
        }
    qw_env_destroy(env);
}

static void removes_towards_any_count(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {78};
    uint32_t reached = 0, fewer = 0;
    for (int round = 0; round < 200; round++) {
        qw_scope_begin(env);
        qw_quadmesh q = random_quads(env, &r);
        int64_t most = q.face_count - 1 - unit_random(&r, q.face_count / 2), least = most - unit_random(&r, 6);
        qw_quadmesh rows = qw_remove_chords(env, &q, NULL, least, most);
        unit_assert_kept(env, &q, &rows);
        assert_true(rows.face_count >= least && rows.face_count <= q.face_count);
        fewer += rows.face_count < q.face_count;
        qw_simplify_counts counts = {0};
        qw_quadmesh all = qw_simplify_quads(env, &rows, NULL, least, most, false, &counts);
        unit_assert_kept(env, &q, &all);
        assert_true(all.face_count >= least && all.face_count <= rows.face_count);
        reached += all.face_count <= most;
        qw_scope_end(env);
    }
    assert_true(fewer > 50 && reached > 150);
    qw_env_destroy(env);
}

/* Of two halves of a sheet the one with rows half as wide keeps them where they are wanted so. */
static void rows_go_where_they_are_too_narrow(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh q = unit_quads(env, 16, 4, false, false);
    for (uint32_t v = 0; v < q.vertex_count; v++)
        if (q.position[v].x < 8) q.position[v].x = 4 + q.position[v].x / 2;
    qw_trimesh plate = unit_grid(env, 32, 8, false, false);
    float *size = QW_NEW(env, float, plate.vertex_count);
    for (uint32_t v = 0; v < plate.vertex_count; v++) {
        qw_vec3 *p = &plate.position[v];
        *p = qw_v3(4 + 12 * p->x, 4 * p->y, 0);
        size[v] = p->x < 8 ? 0.25f : 1;
    }
    qw_wanted wanted = {&plate, size, NULL, NULL};
    qw_quadmesh fewer[2] = {qw_remove_chords(env, &q, NULL, 60, 60), qw_remove_chords(env, &q, &wanted, 60, 60)};
    for (int i = 0; i < 2; i++) {
        uint32_t wide = 0;
        assert_int_equal(fewer[i].face_count, 60);
        for (uint32_t v = 0; v < fewer[i].vertex_count; v++) wide += fewer[i].position[v].x > 8.1f;
        assert_int_equal(wide, i ? 35 : 40);
    }
    qw_env_destroy(env);
}

/* A strip one quad wide, all of whose vertices lie on the boundary, goes down to two quads and up again by chords
 * alone. */
static void strips_have_any_count(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh strip = unit_quads(env, 40, 1, false, false), few = qw_remove_chords(env, &strip, NULL, 2, 2);
    unit_assert_kept(env, &strip, &few);
    assert_int_equal(few.face_count, 2);
    qw_quadmesh many = qw_add_quads(env, &few, NULL, 101, 101);
    unit_assert_kept(env, &strip, &many);
    assert_int_equal(many.face_count, 101);
    qw_env_destroy(env);
}

/* Double edges are left at open ends alone, where there is no fan to split. */
static void assert_on_rims(qw_env *env, const qw_quadmesh *m)
{
    uint8_t *doubled = QW_NEW(env, uint8_t, 4 * m->face_count), *rim = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    qw_quadmesh_double_edges(env, m, doubled);
    for (uint32_t h = 0; h < 4 * m->face_count; h++)
        if (m->twin[h] == QW_NONE) rim[m->corner[h]] = rim[m->corner[qw_quad_next(h)]] = 1;
    for (uint32_t h = 0; h < 4 * m->face_count; h++)
        if (doubled[h]) assert_true(rim[m->corner[h]] && rim[m->corner[qw_quad_next(h)]]);
}

/* Tubes one or two quads around, with curves on them: no chord may be split, so that vertices must. */
static void double_edges_are_separated(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {79};
    for (int round = 0; round < 200; round++) {
        qw_scope_begin(env);
        uint32_t around = 1 + unit_random(&r, 2),
                 along = 8 + unit_random(&r, 12); /* in turn: the order of arguments is the compiler's */
        bool closed = unit_random(&r, 2);
        qw_quadmesh q = unit_quads(env, around, along, true, closed);
        for (uint32_t h = 0; h < 4 * q.face_count; h++)
            if (q.twin[h] != QW_NONE && q.twin[h] < h && unit_random(&r, 10) == 0) {
                q.mark[h] = q.mark[q.twin[h]] = 1;
                q.kind[q.corner[h]] = q.kind[q.corner[qw_quad_next(h)]] = QW_VERTEX_CURVE;
            }
        qw_quad_census before = qw_quadmesh_census(env, &q);
        assert_true(before.double_edges > 0);
        qw_repair_counts counts = {0};
        qw_quadmesh mesh = qw_repair_quads(env, &q, 0, &counts);
        assert_int_equal(counts.split_chords, 0);
        qw_quadmesh_validate(env, &mesh);
        qw_quad_census after = qw_quadmesh_census(env, &mesh);
        assert_int_equal(after.euler, before.euler);
        assert_int_equal(after.components, before.components);
        assert_int_equal(after.boundary_loops, before.boundary_loops);
        assert_true(after.double_edges < before.double_edges);
        if (closed) assert_int_equal(after.double_edges, 0);
        assert_on_rims(env, &mesh);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

static bool joins_same(const qw_quadmesh *m, uint32_t g, uint32_t h)
{
    uint32_t a = m->corner[g], b = m->corner[qw_quad_next(g)], c = m->corner[h], d = m->corner[qw_quad_next(h)];
    return (a == c && b == d) || (a == d && b == c);
}

/* Against every pair of edges, in tubes and rings cut open along some of them, with some vertices made one. */
static void double_edges_are_those_of_all_pairs(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {83};
    for (int round = 0; round < 300; round++) {
        qw_scope_begin(env);
        uint32_t around = 1 + unit_random(&r, 4), along = 1 + unit_random(&r, 5);
        qw_quadmesh q = unit_quads(env, around, along, true, unit_random(&r, 2));
        uint32_t sides = 4 * q.face_count, one = unit_random(&r, q.vertex_count),
                 other = unit_random(&r, q.vertex_count);
        for (uint32_t h = 0; h < sides; h++) {
            if (q.corner[h] == one) q.corner[h] = other;
            if (q.twin[h] != QW_NONE && unit_random(&r, 8) == 0) q.twin[h] = q.twin[q.twin[h]] = QW_NONE;
        }
        uint8_t *doubled = QW_NEW(env, uint8_t, sides);
        int64_t count = qw_quadmesh_double_edges(env, &q, doubled);
        for (uint32_t h = 0; h < sides; h++) {
            bool loop = q.corner[h] == q.corner[qw_quad_next(h)], again = loop, any = loop;
            for (uint32_t g = 0; g < sides; g++) {
                if (g == h || g == q.twin[h] || !joins_same(&q, g, h)) continue;
                any = true;
                again |= g < h && (q.twin[g] == QW_NONE || g < q.twin[g]);
            }
            assert_int_equal(doubled[h], any);
            if (q.twin[h] == QW_NONE || h < q.twin[h]) count -= again;
        }
        assert_int_equal(count, 0);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* However few quads are wanted, also where a part of one is left for what is inside of rims. */
static void bounds_hold_a_whole_number(void **state)
{
    (void)state;
    for (int i = 1; i < 3000; i++) {
        double wanted = i * 0.37;
        for (double share = 0.5; share <= 1; share += 0.25) {
            int64_t least = qw_least_faces(wanted, share, 1), most = qw_most_faces(wanted, share, 1);
            assert_true(least <= most && least > 0);
            assert_true(most - wanted < 1 || qw_is_near_count(wanted, (double)most, 1));
        }
    }
}

QW_TEST_SUITE(count)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(double_edges_are_separated),
        cmocka_unit_test(double_edges_are_those_of_all_pairs),
        cmocka_unit_test(adds_to_any_count),
        cmocka_unit_test(pairs_become_three),
        cmocka_unit_test(removes_towards_any_count),
        cmocka_unit_test(strips_have_any_count),
        cmocka_unit_test(rows_go_where_they_are_too_narrow),
        cmocka_unit_test(bounds_hold_a_whole_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The moves that take irregular vertices away, one by one on random quad meshes and all together. */
#include "suite.h"
#include "unit_shapes.h"

#include "base/sets.h"
#include "remesh/quads/count.h"
#include "remesh/quads/simplify.c" /* the moves themselves */
#include "remesh/quads/topology.h"

static qw_quadmesh random_quads(qw_env *env, unit_rng *r)
{
    bool wrap_u = unit_random(r, 2), wrap_v = wrap_u && unit_random(r, 2);
    uint32_t nu = 3 + unit_random(r, 4), nv = 3 + unit_random(r, 4);
    return unit_quads(env, nu, nv, wrap_u, wrap_v);
}

static simplifier open_simplifier(qw_env *env, const qw_quadmesh *q)
{
    simplifier s = {.e = qw_quad_edit_open(env, q)};
    s.e.keeps_journal = true;
    s.stamp = QW_NEW_ZERO(env, uint32_t, q->vertex_count), s.face_stamp = QW_NEW_ZERO(env, uint32_t, q->face_count);
    s.fresh = QW_NEW_ZERO(env, bool, q->vertex_count);
    s.chord = QW_NEW(env, uint32_t, 2 * (size_t)q->face_count);
    return s;
}

static qw_quadmesh packed(qw_env *env, const simplifier *s)
{
    qw_quad_edit copy = qw_quad_edit_open(env, &s->e.mesh);
    memcpy(copy.gone, s->e.gone, s->e.mesh.face_count);
    qw_quad_edit_pack(&copy);
    return copy.mesh;
}

/* One outgoing half-edge of each vertex that has one, the first at a boundary. */
static void assert_outs(const qw_quad_edit *e)
{
    const qw_quadmesh *m = &e->mesh;
    for (uint32_t h = 0; h < 4 * m->face_count; h++) {
        if (e->gone[h / 4]) continue;
        uint32_t out = e->out[m->corner[h]];
        assert_true(!e->gone[out / 4] && m->corner[out] == m->corner[h]);
        if (m->twin[h] == QW_NONE) assert_int_equal(out, h);
    }
}

static qw_quad_move random_move(const simplifier *s, unit_rng *r)
{
    uint32_t h;
    do h = unit_random(r, 4 * s->e.mesh.face_count);
    while (s->e.gone[h / 4]);
    return (qw_quad_move){h, (uint8_t)unit_random(r, 3)};
}

/* Quads of chords that cross themselves, by sets of the directions of quads that are joined across edges. */
static uint32_t crossing_of(qw_env *env, const qw_quad_edit *e)
{
    uint32_t n = 2 * e->mesh.face_count, sum = 0;
    uint32_t *set = QW_NEW(env, uint32_t, n);
    qw_sets_begin(set, n);
    uint8_t *crosses = QW_NEW_ZERO(env, uint8_t, n);
    for (uint32_t h = 0; h < 4 * e->mesh.face_count; h++) {
        uint32_t t = e->mesh.twin[h];
        if (!e->gone[h / 4] && t != QW_NONE) qw_join_sets(set, h / 4 * 2 + h % 2, t / 4 * 2 + t % 2);
    }
    for (uint32_t i = 0; i < n; i += 2)
        if (qw_set_of(set, i) == qw_set_of(set, i + 1)) crosses[qw_set_of(set, i)] = 1;
    for (uint32_t i = 0; i < n; i++) sum += !e->gone[i / 2] && crosses[qw_set_of(set, i)];
    return sum;
}

/* Random moves upon random moves: what is legal keeps the topology, what is not changes nothing, and all can be taken
 * back. */
static void moves_keep_topology(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {51};
    uint32_t made[3] = {0}, refused[3] = {0}, crossed = 0;
    for (int round = 0; round < 300; round++) {
        qw_scope_begin(env);
        qw_quadmesh q = random_quads(env, &r);
        for (uint32_t h = 0; h < 4 * q.face_count; h++)
            if (q.twin[h] != QW_NONE && q.twin[h] < h && unit_random(&r, 12) == 0) {
                q.mark[h] = q.mark[q.twin[h]] = 1;
                q.kind[q.corner[h]] = q.kind[q.corner[qw_quad_next(h)]] = QW_VERTEX_CURVE;
            }
        simplifier s = open_simplifier(env, &q);
        for (int k = 0; k < 40; k++) {
            qw_quad_move mv = random_move(&s, &r);
            size_t writes = s.e.writes;
            uint32_t faces = s.e.live_faces;
            bool legal = make(&s, mv);
            *(legal ? &made[mv.kind] : &refused[mv.kind]) += 1;
            if (!legal) assert_int_equal(s.e.writes, writes);
            assert_int_equal(s.e.live_faces, faces - (legal && mv.kind == QW_COLLAPSE));
            assert_outs(&s.e);
            if (k % 8 == 7) {
                qw_quadmesh now = packed(env, &s);
                unit_assert_kept(env, &q, &now);
                uint32_t crossing = crossing_of(env, &s.e);
                assert_int_equal(qw_crossing_quads(&s.e.mesh, s.e.gone, s.chord), crossing);
                crossed += crossing > 0;
            }
        }
        qw_quad_edit_undo(&s.e, 0);
        assert_int_equal(s.e.live_faces, q.face_count);
        assert_memory_equal(s.e.mesh.corner, q.corner, 4 * q.face_count * sizeof *q.corner);
        assert_memory_equal(s.e.mesh.twin, q.twin, 4 * q.face_count * sizeof *q.twin);
        assert_memory_equal(s.e.mesh.mark, q.mark, 4 * q.face_count);
        assert_memory_equal(s.e.mesh.position, q.position, q.vertex_count * sizeof *q.position);
        assert_outs(&s.e);
        qw_scope_end(env);
    }
    assert_true(crossed > 100);
    for (int k = 0; k < 3; k++) assert_true(made[k] > 100 && refused[k] > 100);
    qw_env_destroy(env);
}

/* Marks and boundary are chains of the same vertices before and after: the same number of marked sides but where two
 * were glued. */
static int64_t marks_of(const qw_quadmesh *m)
{
    int64_t n = 0;
    for (uint32_t h = 0; h < 4 * m->face_count; h++) n += m->mark[h] != 0;
    return n;
}

static uint32_t inverted(const qw_quadmesh *m)
{
    uint32_t n = 0;
    for (uint32_t h = 0; h < 4 * m->face_count; h++) {
        qw_vec3 p = m->position[m->corner[h]];
        qw_vec3 a = qw_sub(m->position[m->corner[qw_quad_next(h)]], p),
                b = qw_sub(m->position[m->corner[qw_quad_prev(h)]], p);
        n += qw_cross(a, b).z <= 0;
    }
    return n;
}

/* A plate spoilt by legal rotations is never worse after, seldom irregular, and has no corner inverted that it need
 * not have. */
static void repairs_plates(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {52};
    int64_t spoilt = 0, left = 0;
    qw_simplify_counts all = {0};
    for (int round = 0; round < 200; round++) {
        qw_scope_begin(env);
        qw_quadmesh q = unit_quads(env, 9, 9, false, false);
        for (uint32_t h = 0; h < 4 * q.face_count && round % 3 == 0; h++) { /* a curve through the middle */
            uint32_t a = q.corner[h], b = q.corner[qw_quad_next(h)];
            if (a % 10 == 4 && b % 10 == 4) q.mark[h] = 1, q.kind[a] = q.kind[b] = QW_VERTEX_CURVE;
        }
        simplifier s = open_simplifier(env, &q);
        uint32_t wanted = 1 + (uint32_t)round / 20;
        for (uint32_t k = 0, tries = 0; k < wanted && tries < 400; tries++) {
            qw_quad_move mv = random_move(&s, &r);
            size_t writes = s.e.writes;
            if (mv.kind == QW_COLLAPSE || !make(&s, mv)) continue;
            uint32_t v[6], n = qw_changed_by_move(&s.e.mesh, mv, v);
            vertices core = {0};
            s.round++;
            for (uint32_t i = 0; i < n; i++) add(&s, &core, v[i]);
            smooth(&s, &core);
            qw_quadmesh now = packed(env, &s);
            if (inverted(&now)) qw_quad_edit_undo(&s.e, writes);
            else k++;
        }
        qw_quadmesh bad = packed(env, &s);
        qw_simplify_counts c = {0};
        qw_quadmesh good = qw_simplify_quads(env, &bad, NULL, 78, INT64_MAX, false, &c);
        unit_assert_kept(env, &bad, &good);
        int64_t before = qw_quadmesh_census(env, &bad).irregular, after = qw_quadmesh_census(env, &good).irregular;
        assert_int_equal(marks_of(&good), marks_of(&bad));
        assert_int_equal(inverted(&good), 0);
        assert_true(good.face_count >= 78);
        spoilt += before, left += after;
        all.collapses += c.collapses, all.rotations += c.rotations;
        qw_scope_end(env);
    }
    assert_true(left * 4 < spoilt);
    assert_true(all.collapses > 10 && all.rotations > 100);
    qw_env_destroy(env);
}

/* Pairs go from tori that moves have spoilt. Where one may go though more rows cross themselves then, more are left in
 * the end that do. */
static void rows_do_not_cross_more(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {53};
    int64_t spoilt = 0, left = 0, crossing[2] = {0};
    for (int round = 0; round < 300; round++) {
        qw_scope_begin(env);
        qw_quadmesh q = unit_quads(env, 9, 9, true, true);
        simplifier s = open_simplifier(env, &q);
        for (int k = 0; k < 3 + round % 8; k++) {
            qw_quad_move mv = random_move(&s, &r);
            if (mv.kind != QW_COLLAPSE) make(&s, mv);
        }
        qw_quadmesh bad = packed(env, &s);
        spoilt += qw_quadmesh_census(env, &bad).irregular;
        for (int pairs_go = 0; pairs_go < 2; pairs_go++) {
            qw_simplify_counts c = {0};
            simplifier t = make_simplifier(env, &bad, NULL, 78);
            if (pairs_go) t.looks = 0;
            simplify(&t, &c);
            qw_quadmesh good = packed(env, &t);
            crossing[pairs_go] += crossing_of(env, &t.e);
            left += qw_quadmesh_census(env, &good).irregular;
        }
        qw_scope_end(env);
    }
    print_message("quads in rows that cross themselves: %lld, %lld where pairs go all the same\n",
                  (long long)crossing[0], (long long)crossing[1]);
    assert_true(crossing[0] < crossing[1]);
    assert_true(left < spoilt);
    qw_env_destroy(env);
}

/* What is regular already stays as it is, to the byte. */
static void leaves_regular_alone(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (int k = 0; k < 3; k++) {
        qw_quadmesh q = unit_quads(env, 6, 5, k > 0, k > 1);
        qw_simplify_counts c = {0};
        qw_quadmesh same = qw_simplify_quads(env, &q, NULL, 0, INT64_MAX, false, &c);
        assert_int_equal(c.collapses + c.rotations, 0);
        assert_memory_equal(same.corner, q.corner, 4 * q.face_count * sizeof *q.corner);
        assert_memory_equal(same.position, q.position, q.vertex_count * sizeof *q.position);
    }
    qw_env_destroy(env);
}

/* However few quads are asked for, a sphere keeps as many as a cube, even where many of its vertices have two edges. */
static void shells_keep_six(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {71};
    qw_trimesh sphere = unit_tetrahedron(env);
    for (int round = 0; round < 3000; round++) {
        qw_scope_begin(env);
        qw_quadmesh m = unit_quad_sphere(env, &r, QW_LEAST_SHELL + unit_random(&r, 8));
        assert_int_equal(qw_check_topology(env, &m, &sphere).broken_count, 0);
        qw_simplify_counts counts = {0};
        qw_quadmesh few = qw_simplify_quads(env, &m, NULL, 1, 1, false, &counts);
        assert_int_equal(qw_check_topology(env, &few, &sphere).broken_count, 0);
        few = qw_remove_chords(env, &m, NULL, 1, 1);
        assert_int_equal(qw_check_topology(env, &few, &sphere).broken_count, 0);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(simplify)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moves_keep_topology),    cmocka_unit_test(repairs_plates),
        cmocka_unit_test(rows_do_not_cross_more), cmocka_unit_test(leaves_regular_alone),
        cmocka_unit_test(shells_keep_six),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The last resort for quads that are turned over: they go, by other places or by other quads, and nothing else changes.
 */
#include "suite.h"
#include "unit_bed.h"

#include "quad/mend.h"
#include "quad/moves.h"

enum { MOVES = 60 };

static uint32_t mend(qw_env *env, qw_quadmesh *quads, const qw_trimesh *surface, int64_t least)
{
    uint8_t *flipped = QW_NEW_ZERO(env, uint8_t, quads->face_count);
    return qw_mend_flipped(env, quads, surface, surface, least, &flipped);
}

/* Quads that face down. */
static uint32_t count_down(const qw_quadmesh *q)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * f;
        count +=
            qw_cross(qw_sub(q->position[c[2]], q->position[c[0]]), qw_sub(q->position[c[3]], q->position[c[1]])).z <= 0;
    }
    return count;
}

static void assert_same_shape(qw_env *env, const qw_quadmesh *a, const qw_quadmesh *b)
{
    qw_quadmesh_validate(env, b);
    qw_quad_census x = qw_quadmesh_census(env, a), y = qw_quadmesh_census(env, b);
    assert_int_equal(x.euler, y.euler);
    assert_int_equal(x.boundary_loops, y.boundary_loops);
    assert_int_equal(x.components, y.components);
    assert_int_equal(y.degenerate_faces + y.double_edges, 0);
}

static void leaves_what_is_upright(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    unit_rng r = {3};
    for (uint32_t v = 0; v < b.quads.vertex_count; v++)
        if (b.quads.kind[v] == QW_VERTEX_FREE)
            b.quads.position[v] = qw_add(b.quads.position[v], qw_v3(0.6f * unit_real(&r), 0.6f * unit_real(&r), 0));
    qw_quadmesh before = b.quads;
    assert_false(qw_has_flipped(env, &b.quads, &b.surface, &b.surface));
    assert_int_equal(mend(env, &b.quads, &b.surface, 0), 0);
    assert_memory_equal(&before, &b.quads, sizeof before);
    qw_env_destroy(env);
}

/* Blocks of vertices are mirrored, in the middle and at a corner of the sheet, where the rim has to leave its curve or
 * to go back. */
static void turns_blocks_upright(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint32_t at = 0; at <= 4; at += 4) {
        unit_bed b = unit_make_bed(env);
        qw_quadmesh before = b.quads;
        qw_vec3 *old = QW_NEW(env, qw_vec3, b.quads.vertex_count);
        for (uint32_t y = at; y < at + 2; y++)
            for (uint32_t x = at; x < at + 2; x++)
                b.quads.position[unit_bed_at(x, y)].x = (float)(2 * at + 1) - (float)x;
        memcpy(old, b.quads.position, b.quads.vertex_count * sizeof *old);
        assert_true(count_down(&b.quads) > 0);
        assert_true(qw_has_flipped(env, &b.quads, &b.surface, &b.surface));
        assert_true(mend(env, &b.quads, &b.surface, b.quads.face_count) > 0);
        assert_int_equal(count_down(&b.quads), 0);
        assert_same_shape(env, &before, &b.quads);
        for (uint32_t v = 0; v < b.quads.vertex_count; v++) /* what is far away stays */
            if (v % (BED + 1) > at + 6 || v / (BED + 1) > at + 6)
                assert_true(qw_distance(old[v], b.quads.position[v]) == 0);
    }
    qw_env_destroy(env);
}

/* Random moves leave quads that no places could ever set upright: other moves have to follow, but no more than so many
 * quads go. */
static void changes_what_no_place_would_mend(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {11};
    uint32_t before = 0, left = 0;
    for (int round = 0; round < 12; round++) {
        qw_scope_begin(env);
        unit_bed b = unit_make_bed(env);
        qw_quad_edit e = qw_quad_edit_open(env, &b.quads);
        for (int i = 0; i < MOVES; i++) { /* about the middle */
            uint32_t h = 4 * (BED * (5 + unit_random(&r, 3)) + 5 + unit_random(&r, 3)) + unit_random(&r, 4);
            qw_make_quad_move(&e, (qw_quad_move){h, (uint8_t)(1 + unit_random(&r, 2))}, false);
        }
        qw_quad_edit_pack(&e);
        qw_quadmesh quads = e.mesh, first = e.mesh;
        before += qw_has_flipped(env, &quads, &b.surface, &b.surface);
        mend(env, &quads, &b.surface, quads.face_count - 3);
        left += qw_has_flipped(env, &quads, &b.surface, &b.surface);
        assert_true(quads.face_count >= first.face_count - 3);
        assert_same_shape(env, &first, &quads);
        qw_scope_end(env);
    }
    assert_true(before >= 6);
    assert_int_equal(left, 0);
    qw_env_destroy(env);
}

QW_TEST_SUITE(mend)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(leaves_what_is_upright),
        cmocka_unit_test(turns_blocks_upright),
        cmocka_unit_test(changes_what_no_place_would_mend),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

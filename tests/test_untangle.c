/* Flipped quads in a sheet that is turned over in places: they come upright, and nothing else moves. */
#include "suite.h"
#include "unit_bed.h"

static uint32_t untangle(qw_env *env, unit_bed *b)
{
    qw_untangling u = unit_untangling(env, b, NULL);
    return qw_untangle_quads(env, &u);
}

static void leaves_what_is_upright(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    unit_rng r = {3};
    for (uint32_t v = 0; v < b.quads.vertex_count; v++)
        if (b.quads.kind[v] == QW_VERTEX_FREE)
            b.position[v] = qw_add(b.position[v], qw_v3(0.3f * unit_real(&r), 0.3f * unit_real(&r), 0));
    qw_vec3 *before = QW_NEW(env, qw_vec3, b.quads.vertex_count);
    memcpy(before, b.position, b.quads.vertex_count * sizeof *before);
    assert_int_equal(untangle(env, &b), 0);
    assert_memory_equal(before, b.position, b.quads.vertex_count * sizeof *before);
    qw_env_destroy(env);
}

/* Blocks of vertices inside are turned round their middle by half a turn and mirrored. */
static void turns_blocks_upright(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint32_t wide = 2; wide <= 5; wide++) {
        unit_bed b = unit_make_bed(env);
        for (uint32_t y = 4; y < 4 + wide; y++)
            for (uint32_t x = 4; x < 4 + wide; x++) b.position[unit_bed_at(x, y)].x = (float)(7 + wide) - (float)x;
        assert_true(unit_least_corner(&b) < 0);
        assert_int_equal(untangle(env, &b), 0);
        assert_true(unit_least_corner(&b) > 0);
        for (uint32_t v = 0; v < b.quads.vertex_count; v++) {
            if (b.quads.kind[v] == QW_VERTEX_CORNER) assert_true(qw_distance(b.position[v], b.quads.position[v]) == 0);
            if (b.quads.kind[v] == QW_VERTEX_CURVE)
                assert_true(b.position[v].x * b.position[v].y * (BED - b.position[v].x) * (BED - b.position[v].y) == 0);
            assert_true(fabsf(b.position[v].z) < 1e-6f);
        }
    }
    qw_env_destroy(env);
}

/* The corners of the sheet have been taken across it, along the border: they have to move as well. */
static void moves_corners_if_need_be(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    b.position[unit_bed_at(0, 0)] = qw_v3(4, 0, 0), b.position[unit_bed_at(1, 0)] = qw_v3(3, 0, 0),
                              b.position[unit_bed_at(0, 1)] = qw_v3(4, 0, 0);
    b.position[unit_bed_at(1, 1)] = qw_v3(3, 0.5f, 0);
    uint32_t left = untangle(env, &b);
    assert_int_equal(left, 0);
    uint32_t turned = 0;
    for (uint32_t f = 0; f < b.quads.face_count; f++) {
        const uint32_t *c = b.quads.corner + 4 * f;
        turned += qw_cross(qw_sub(b.position[c[2]], b.position[c[0]]), qw_sub(b.position[c[3]], b.position[c[1]])).z <=
                  0;
    }
    assert_int_equal(turned, 0);
    qw_env_destroy(env);
}

/* A triangle beside the sheet that faces the other way, as scans have them. */
static void add_stray(qw_env *env, unit_bed *b, qw_vec3 middle)
{
    qw_trimesh *m = &b->surface, old = *m;
    m->vertex_count += 3, m->face_count++;
    m->position = QW_NEW(env, qw_vec3, m->vertex_count);
    m->corner = QW_NEW(env, uint32_t, 3 * m->face_count), m->twin = QW_NEW(env, uint32_t, 3 * m->face_count);
    memcpy(m->position, old.position, old.vertex_count * sizeof *m->position);
    memcpy(m->corner, old.corner, 3 * old.face_count * sizeof *m->corner),
        memcpy(m->twin, old.twin, 3 * old.face_count * sizeof *m->twin);
    const qw_vec3 corner[3] = {{0, 0.1f, 0}, {0.1f, 0, 0}, {0, 0, 0}};
    for (uint32_t i = 0; i < 3; i++) {
        m->position[old.vertex_count + i] = qw_add(middle, corner[i]);
        m->corner[3 * old.face_count + i] = old.vertex_count + i, m->twin[3 * old.face_count + i] = QW_NONE;
    }
    if (old.mark) {
        m->mark = QW_NEW_ZERO(env, uint8_t, 3 * m->face_count);
        memcpy(m->mark, old.mark, 3 * old.face_count);
    }
}

/* A quad that faces against all beside it is turned over, though a single triangle below the sheet faces as it does. */
static void is_not_fooled_by_strays(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    add_stray(env, &b, qw_v3(4.5f, 4.5f, -0.05f));
    b.position[unit_bed_at(4, 4)].x = b.position[unit_bed_at(4, 5)].x = 4.6f,
                              b.position[unit_bed_at(5, 4)].x = b.position[unit_bed_at(5, 5)].x = 4.4f;
    assert_true(unit_least_corner(&b) < 0);
    assert_int_equal(untangle(env, &b), 0);
    assert_true(unit_least_corner(&b) > 0);
    qw_env_destroy(env);
}

QW_TEST_SUITE(untangle)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(leaves_what_is_upright),
        cmocka_unit_test(turns_blocks_upright),
        cmocka_unit_test(moves_corners_if_need_be),
        cmocka_unit_test(is_not_fooled_by_strays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

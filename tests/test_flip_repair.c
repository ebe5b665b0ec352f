/* Flip repair on a sheet of quads that was spoiled in places: flipped quads and inverted corners go, and nothing else
 * changes. */
#include "suite.h"
#include "unit_bed.h"

static qw_flip_counts repair_bed(qw_env *env, unit_bed *b, uint8_t *flipped)
{
    qw_quadmesh now = b->quads;
    now.position = b->position;
    b->curves.surface = &b->surface; /* the bed has moved since */
    qw_flip_repair repair = {.surface = &b->surface, .curves = &b->curves, .ground = b->ground};
    return qw_repair_flips(env, &now, &repair, flipped ? flipped : QW_NEW(env, uint8_t, now.face_count));
}

/* Quads flipped, or perhaps so, that are left. */
static uint32_t untangle(qw_env *env, unit_bed *b)
{
    qw_flip_counts c = repair_bed(env, b, NULL);
    return c.flipped_left + c.doubtful_left;
}

/* Inverted corners that are left; the flags are those of the quads as they are. */
static uint32_t open_corners(qw_env *env, unit_bed *b)
{
    uint8_t *flipped = QW_NEW(env, uint8_t, b->quads.face_count);
    qw_flip_counts c = repair_bed(env, b, flipped);
    qw_flip_judge judge = {.surface = &b->surface, .tree = qw_bvh_build(env, &b->surface), .edge = 1};
    for (uint32_t f = 0; f < b->quads.face_count; f++)
        assert_int_equal(flipped[f], qw_flip_of_quad(&judge, b->position, b->quads.corner + 4 * f));
    return c.inverted_left;
}

static qw_vec3 *copy_of(qw_env *env, const unit_bed *b)
{
    qw_vec3 *p = QW_NEW(env, qw_vec3, b->quads.vertex_count);
    memcpy(p, b->position, b->quads.vertex_count * sizeof *p);
    return p;
}

static uint32_t moved(const unit_bed *b, const qw_vec3 *from)
{
    uint32_t count = 0;
    for (uint32_t v = 0; v < b->quads.vertex_count; v++) count += qw_distance(b->position[v], from[v]) > 0;
    return count;
}

static void leaves_what_is_not_flipped(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    unit_rng r = {3};
    for (uint32_t v = 0; v < b.quads.vertex_count; v++)
        if (b.quads.kind[v] == QW_VERTEX_FREE)
            b.position[v] = qw_add(b.position[v], qw_v3(0.3f * unit_real(&r), 0.3f * unit_real(&r), 0));
    qw_vec3 *before = copy_of(env, &b);
    assert_int_equal(open_corners(env, &b), 0);
    assert_int_equal(moved(&b, before), 0);
    qw_env_destroy(env);
}

/* One vertex anywhere, as far away as one and a half edges: all is open again, on the sheet, curve vertices on the
   border and its corners where they were; two rings away nothing has moved. */
static void opens_what_one_vertex_inverts(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {7};
    int inverted = 0;
    for (int i = 0; i < 100; i++) {
        unit_bed b = unit_make_bed(env);
        uint32_t x = 1 + unit_random(&r, BED - 1), y = 1 + unit_random(&r, BED - 1), v = unit_bed_at(x, y);
        qw_vec3 *before = copy_of(env, &b);
        qw_vec3 to = qw_add(b.position[v], qw_v3(1.5f * unit_real(&r), 1.5f * unit_real(&r), 0));
        b.position[v] = qw_v3(fminf(fmaxf(to.x, 0), BED), fminf(fmaxf(to.y, 0), BED), 0);
        inverted += unit_least_corner(&b) <= 0;
        assert_int_equal(open_corners(env, &b), 0);
        assert_true(unit_least_corner(&b) > 0);
        for (uint32_t w = 0; w < b.quads.vertex_count; w++) {
            qw_vec3 p = b.position[w];
            if (b.quads.kind[w] == QW_VERTEX_CORNER) assert_true(qw_distance(p, before[w]) == 0);
            if (b.quads.kind[w] == QW_VERTEX_CURVE) assert_true(p.x * p.y * (BED - p.x) * (BED - p.y) == 0);
            assert_true(fabsf(p.z) < 1e-6f);
            if (abs((int)(w % (BED + 1)) - (int)x) > 3 || abs((int)(w / (BED + 1)) - (int)y) > 3)
                assert_true(qw_distance(p, before[w]) == 0);
        }
    }
    assert_true(inverted > 40);
    qw_env_destroy(env);
}

/* A corner has passed its neighbour on the border, and that is a corner too: it goes along the border, the others stay.
 */
static void moves_corners_if_need_be(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    uint32_t v = unit_bed_at(5, 0);
    for (uint32_t x = 4; x <= 6; x++)
        b.quads.kind[unit_bed_at(x, 0)] = QW_VERTEX_CORNER, b.curves.edge[unit_bed_at(x, 0)] = QW_NONE;
    qw_vec3 *before = copy_of(env, &b);
    b.position[v] = qw_v3(6.15f, 0, 0);
    assert_true(unit_least_corner(&b) < 0);
    assert_int_equal(open_corners(env, &b), 0);
    assert_true(b.position[v].x > 4 && b.position[v].x < 6 && b.position[v].y == 0);
    assert_true(qw_distance(b.position[unit_bed_at(4, 0)], before[unit_bed_at(4, 0)]) == 0);
    assert_true(qw_distance(b.position[unit_bed_at(6, 0)], before[unit_bed_at(6, 0)]) == 0);
    qw_env_destroy(env);
}

/* Corners, and no curve to move along: it says so and leaves all as it is. */
static void leaves_what_it_cannot_open(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    for (uint32_t h = 0; h < 3 * b.surface.face_count; h++) /* so that the sheet has no border */
        if (b.surface.twin[h] == QW_NONE) b.surface.twin[h] = h;
    memset(b.quads.kind, QW_VERTEX_CORNER, b.quads.vertex_count);
    for (uint32_t v = 0; v < b.quads.vertex_count; v++) b.curves.edge[v] = QW_NONE;
    b.position[unit_bed_at(5, 5)] = qw_v3(6.5f, 5.5f, 0);
    qw_vec3 *before = copy_of(env, &b);
    assert_true(open_corners(env, &b) > 0);
    assert_int_equal(moved(&b, before), 0);
    qw_env_destroy(env);
}

/* A quad that untangling left with its back to the surface is turned. */
static void clears_flipped_quads(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    b.position[unit_bed_at(5, 5)].x = b.position[unit_bed_at(5, 6)].x = 5.6f,
                              b.position[unit_bed_at(6, 5)].x = b.position[unit_bed_at(6, 6)].x = 5.4f;
    assert_true(unit_least_corner(&b) < 0);
    assert_int_equal(open_corners(env, &b), 0);
    assert_true(unit_least_corner(&b) > 0);
    qw_env_destroy(env);
}

/* How far the middles of quads and of their sides are from the sheet, at most. */
static float farthest(const unit_bed *b, const qw_bvh *tree)
{
    float most = 0;
    for (uint32_t f = 0; f < b->quads.face_count; f++) {
        qw_vec3 middle = {0, 0, 0};
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
            qw_vec3 p = b->position[b->quads.corner[h]],
                    side = qw_lerp(p, b->position[b->quads.corner[qw_quad_next(h)]], 0.5f);
            most = fmaxf(most, qw_distance(side, qw_bvh_nearest(tree, side, side, -1, INFINITY, QW_NONE).point));
            middle = qw_madd(middle, 0.25f, p);
        }
        most = fmaxf(most, qw_distance(middle, qw_bvh_nearest(tree, middle, middle, -1, INFINITY, QW_NONE).point));
    }
    return most;
}

static void fold(qw_vec3 *p, uint32_t count, float height)
{
    for (uint32_t v = 0; v < count; v++) p[v].z = height * fmaxf(0, 1 - 2 * fabsf(p[v].x - BED / 2));
}

/* A sheet with a thin fold, over which its quads go too, and four of the vertices near its ridge are anywhere: what
 * opens their corners does not leave the fold. */
static void keeps_the_shape(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {11};
    int opened = 0;
    for (int i = 0; i < 300; i++) {
        unit_bed b = unit_make_bed(env);
        float height = 1 + 0.8f * unit_real(&r);
        fold(b.surface.position, b.surface.vertex_count, height);
        fold(b.position, b.quads.vertex_count, height);
        const qw_bvh *tree = qw_bvh_build(env, &b.surface);
        uint32_t x = BED / 2 - 1 + unit_random(&r, 3), y = 2 + unit_random(&r, BED - 3);
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t v = unit_bed_at(x + k % 2, y + k / 2);
            qw_vec3 to = qw_add(b.position[v], qw_v3(1.5f * unit_real(&r), 1.5f * unit_real(&r), 0));
            b.position[v] = qw_bvh_nearest(tree, to, to, -1, INFINITY, QW_NONE).point;
        }
        qw_vec3 *old = copy_of(env, &b);
        float before = farthest(&b, tree), mean = unit_mean_edge(&b);
        repair_bed(env, &b, NULL);
        opened += moved(&b, old) > 0;
        assert_true(farthest(&b, tree) <= fmaxf(before, 0.2f * mean) * (1 + 1e-4f));
    }
    assert_true(opened > 200);
    qw_env_destroy(env);
}

/* Blocks of vertices inside are turned round their middle by half a turn and mirrored. */
static void flips_blocks_of_the_sheet_back(void **state)
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
static void moves_corners_far_if_need_be(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    b.position[unit_bed_at(0, 0)] = qw_v3(4, 0, 0), b.position[unit_bed_at(1, 0)] = qw_v3(3, 0, 0),
                              b.position[unit_bed_at(0, 1)] = qw_v3(4, 0, 0);
    b.position[unit_bed_at(1, 1)] = qw_v3(3, 0.5f, 0);
    uint32_t left = untangle(env, &b);
    assert_int_equal(left, 0);
    uint32_t inverted = 0;
    for (uint32_t f = 0; f < b.quads.face_count; f++) {
        const uint32_t *c = b.quads.corner + 4 * f;
        inverted +=
            qw_cross(qw_sub(b.position[c[2]], b.position[c[0]]), qw_sub(b.position[c[3]], b.position[c[1]])).z <= 0;
    }
    assert_int_equal(inverted, 0);
    qw_env_destroy(env);
}

/* A triangle beside the sheet that faces the other way, as scans have them. */
static void add_lone_triangle(qw_env *env, unit_bed *b, qw_vec3 middle)
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

/* A quad that faces against all beside it is flipped, though a single triangle below the sheet faces as it does. */
static void is_not_fooled_by_lone_triangles(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_bed b = unit_make_bed(env);
    add_lone_triangle(env, &b, qw_v3(4.5f, 4.5f, -0.05f));
    b.position[unit_bed_at(4, 4)].x = b.position[unit_bed_at(4, 5)].x = 4.6f,
                              b.position[unit_bed_at(5, 4)].x = b.position[unit_bed_at(5, 5)].x = 4.4f;
    assert_true(unit_least_corner(&b) < 0);
    assert_int_equal(untangle(env, &b), 0);
    assert_true(unit_least_corner(&b) > 0);
    qw_env_destroy(env);
}

/* Whether a strip from y = 0 to `high` is flipped over a triangle of which the tip is at y = `tip`. */
static qw_flip flip_of_strip(qw_env *env, float high, float tip)
{
    qw_vec3 strip[4] = {qw_v3(0, 0, 0), qw_v3(1, 0, 0), qw_v3(1, high, 0), qw_v3(0, high, 0)},
            place[3] = {qw_v3(0, 0, 0), qw_v3(1, 0, 0), qw_v3(0.5f, tip, 0)};
    uint32_t corner[3] = {0, 1, 2};
    qw_trimesh surface = {.vertex_count = 3, .face_count = 1, .position = place, .corner = corner};
    qw_trimesh_link(env, &surface);
    qw_flip_judge judge = {.surface = &surface, .tree = qw_bvh_build(env, &surface), .edge = 0.1f};
    return qw_flip_of_quad(&judge, strip, (const uint32_t[4]){0, 1, 2, 3});
}

/* A needle's sides are those of rounding, of the surface as of the quads. */
static void what_has_no_side_is_not_flipped(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    static const float THIN = 1e-9f;
    assert_int_equal(flip_of_strip(env, 0.3f, 1), QW_NOT_FLIPPED);
    assert_int_equal(flip_of_strip(env, 0.3f, -1), QW_FLIPPED);
    assert_int_equal(flip_of_strip(env, 0.3f, -THIN), QW_NOT_FLIPPED);
    assert_int_equal(flip_of_strip(env, -THIN, 1), QW_NOT_FLIPPED);
    qw_env_destroy(env);
}

QW_TEST_SUITE(flip_repair)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(leaves_what_is_not_flipped),
        cmocka_unit_test(opens_what_one_vertex_inverts),
        cmocka_unit_test(moves_corners_if_need_be),
        cmocka_unit_test(leaves_what_it_cannot_open),
        cmocka_unit_test(clears_flipped_quads),
        cmocka_unit_test(keeps_the_shape),
        cmocka_unit_test(flips_blocks_of_the_sheet_back),
        cmocka_unit_test(moves_corners_far_if_need_be),
        cmocka_unit_test(is_not_fooled_by_lone_triangles),
        cmocka_unit_test(what_has_no_side_is_not_flipped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

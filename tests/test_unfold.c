/* Folds in flat places: smoothed out where the surface stays the same set of points, left where they are shape. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/clean/unfold.h"
#include "quadwright/quadwright.h"

enum { CELLS = 6 };

static uint32_t unfold(qw_env *env, qw_trimesh *m)
{
    qw_clean_input none = {.mark_count = 0};
    return qw_unfold(env, &none, NULL, m);
}

/* Flat, of cells one wide, with one inner vertex somewhere else. */
static qw_trimesh folded_sheet(qw_env *env, uint32_t v, qw_vec3 to)
{
    qw_trimesh m = unit_grid(env, CELLS, CELLS, false, false);
    for (uint32_t i = 0; i < m.vertex_count; i++) m.position[i] = qw_scale(m.position[i], CELLS);
    m.position[v] = to;
    return m;
}

static bool is_face_up(const qw_trimesh *m)
{
    for (uint32_t f = 0; f < m->face_count; f++)
        if (qw_face_cross(m, f).z <= 0) return false;
    return true;
}

/* A vertex anywhere within two cells, the sheet turned any way: nothing is folded any more. */
static void smooths_out_folds(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {5};
    uint32_t folded = 0, unfolded = 0, v = 3 * (CELLS + 1) + 3;
    for (int i = 0; i < 500; i++) {
        qw_vec3 to = qw_v3(3 + 2 * unit_real(&r), 3 + 2 * unit_real(&r), 0);
        qw_trimesh m = folded_sheet(env, v, to), before = folded_sheet(env, v, qw_v3(3, 3, 0));
        bool face_up = is_face_up(&m);
        qw_vec3 axis = unit_direction(&r), other = qw_any_orthogonal(axis), third = qw_cross(axis, other);
        for (uint32_t w = 0; w < m.vertex_count; w++) {
            qw_vec3 p = m.position[w];
            m.position[w] = qw_add(qw_scale(other, p.x), qw_scale(third, p.y));
        }
        uint32_t moved = unfold(env, &m), elsewhere = 0;
        for (uint32_t w = 0; w < m.vertex_count; w++) {
            qw_vec3 p = m.position[w];
            m.position[w] = qw_v3(qw_dot(p, other), qw_dot(p, third), qw_dot(p, axis));
            assert_true(fabsf(m.position[w].z) < 1e-4f);
            elsewhere += qw_distance(m.position[w], w == v ? to : before.position[w]) > 1e-4f;
        }
        assert_true(moved <= 1 && elsewhere == moved); /* a neighbour may be the one that moves */
        if (face_up) assert_int_equal(moved, 0);
        if (moved > 0) assert_true(is_face_up(&m));
        folded += !face_up, unfolded += moved;
    }
    assert_true(folded > 300 &&
                unfolded + folded / 50 >= folded); /* but where a triangle is face down by next to nothing */
    qw_env_destroy(env);
}

/* The same folds where the ring is not flat, or the sheet has no thickness but two sides, of which the lower lies face
 * down everywhere. */
static void leaves_shapes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint32_t v = 3 * (CELLS + 1) + 3;
    qw_trimesh m = folded_sheet(env, v, qw_v3(3.8f, 2.6f, 0));
    assert_false(is_face_up(&m));
    m.position[v + 1].z = 0.05f;
    assert_int_equal(unfold(env, &m), 0);
    m.position[v + 1].z = 0;
    assert_int_equal(unfold(env, &m), 1);
    for (uint32_t n = 3; n < 9; n++)
        for (uint32_t below = 0; below < 2;
             below++) { /* a fan of n triangles, and below it the same, or one with its middle at the rim */
            qw_trimesh s = unit_mesh(env, n + 1 + below, 2 * n - 2 * !below);
            s.position[0] = qw_v3(0.1f, 0.2f, 0);
            if (below) s.position[n + 1] = qw_v3(-0.1f, 0.1f, 0);
            for (uint32_t i = 0, f = 0; i < n; i++) {
                float a = 6.2831853f * (float)i / (float)n;
                s.position[1 + i] = qw_v3(cosf(a), sinf(a), 0);
                unit_face(&s, f++, 0, 1 + i, 1 + (i + 1) % n);
                if (below) unit_face(&s, f++, n + 1, 1 + (i + 1) % n, 1 + i);
                if (!below && i > 0 && i + 1 < n) unit_face(&s, f++, 1, 2 + i, 1 + i);
            }
            qw_trimesh_link(env, &s);
            assert_int_equal(unfold(env, &s), 0);
        }
    unit_rng r = {3};
    for (int i = 0; i < 200; i++) { /* two sheets with one rim, and inner vertices of their own */
        qw_trimesh s = unit_mesh(env, 2 * (CELLS + 1) * (CELLS + 1), 4 * CELLS * CELLS);
        for (uint32_t w = 0; w < s.vertex_count; w++) {
            uint32_t x = w % (CELLS + 1), y = w / (CELLS + 1) % (CELLS + 1);
            bool inner = x > 0 && y > 0 && x < CELLS && y < CELLS;
            s.position[w] = qw_v3((float)x + (inner ? 0.25f * unit_real(&r) : 0),
                                  (float)y + (inner ? 0.25f * unit_real(&r) : 0), 0);
        }
        for (uint32_t f = 0; f < s.face_count; f++) {
            uint32_t cell = f / 2 % (CELLS * CELLS), x = cell % CELLS, y = cell / CELLS, corner[4];
            for (uint32_t k = 0; k < 4; k++) {
                uint32_t cx = x + (k == 1 || k == 2), cy = y + (k > 1);
                bool inner = cx > 0 && cy > 0 && cx < CELLS && cy < CELLS;
                corner[k] = (inner && f >= s.face_count / 2 ? (CELLS + 1) * (CELLS + 1) : 0) + cy * (CELLS + 1) + cx;
            }
            uint32_t turn = x + y == CELLS - 1; /* no triangle has all of its corners on the rim */
            uint32_t a = corner[turn], b = corner[turn + 1 + f % 2], d = corner[(turn + 2 + f % 2) % 4];
            unit_face(&s, f, a, f >= s.face_count / 2 ? d : b, f >= s.face_count / 2 ? b : d);
        }
        qw_trimesh_link(env, &s);
        assert_int_equal(unfold(env, &s), 0);
    }
    qw_env_destroy(env);
}

/* Folds over folds, vertices on one another and on lines, all but for rounding: what moves stays in the plane, inside
 * the sheet. */
static void survives_any_sheet(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {9};
    uint32_t moved = 0;
    for (int i = 0; i < 2000; i++) {
        qw_scope_begin(env);
        qw_trimesh m = folded_sheet(env, 0, qw_v3(0, 0, 0));
        uint32_t steps = 1 + unit_random(&r, 4);
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            qw_vec3 *p = &m.position[v];
            float rounding = unit_random(&r, 2) ? 1e-6f : 0;
            if (unit_random(&r, 3) == 0) p->x = fmodf(p->x + (float)unit_random(&r, 2 * steps) / (float)steps, CELLS);
            if (unit_random(&r, 3) == 0) p->y = fmodf(p->y + (float)unit_random(&r, 2 * steps) / (float)steps, CELLS);
            *p = qw_add(*p, qw_v3(rounding * unit_real(&r), rounding * unit_real(&r), 0));
        }
        moved += unfold(env, &m);
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            qw_vec3 p = m.position[v];
            assert_true(fabsf(p.z) < 1e-4f && p.x > -0.01f && p.y > -0.01f && p.x < CELLS + 0.01f &&
                        p.y < CELLS + 0.01f);
        }
        qw_scope_end(env);
    }
    assert_true(moved > 100);
    qw_env_destroy(env);
}

/* A mark that ends at the vertex holds it, one that ends elsewhere does not. */
static void leaves_marked_vertices(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    const qw_frame frame = {{0, 0, 0}, 1};
    for (uint32_t first = 0; first < 2; first++) {
        uint32_t v = 3 * (CELLS + 1) + 3, mark[2] = {v + first, 0};
        qw_trimesh m = folded_sheet(env, v, qw_v3(3.8f, 2.6f, 0));
        double *position = QW_NEW(env, double, 3 * (size_t)m.vertex_count);
        for (uint32_t w = 0; w < m.vertex_count; w++)
            position[3 * (size_t)w] = (double)m.position[w].x, position[3 * (size_t)w + 1] = (double)m.position[w].y,
                         position[3 * (size_t)w + 2] = (double)m.position[w].z;
        qw_clean_input input = {.vertex_count = m.vertex_count, .position = position, .mark_count = 1, .mark = mark};
        assert_int_equal(qw_unfold(env, &input, &frame, &m), first);
    }
    qw_env_destroy(env);
}

/* Nothing is left of the fold: eight irregular vertices and right angles, as of any cube. */
static void makes_a_cube_of_a_folded_one(void **state)
{
    (void)state;
    qw_mesh *mesh;
    assert_int_equal(qw_load(QW_TEST_DATA "/regress/folded_cube.obj", NULL, &mesh), QW_OK);
    qw_mesh_view view = qw_mesh_get(mesh);
    qw_options options;
    qw_options_init(&options);
    options.faces = 600;
    qw_result *result;
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
    const qw_report *report = qw_result_report(result);
    assert_int_equal(report->unfolded_vertices, 1);
    assert_int_equal(report->topology.irregular, 8);
    assert_true(report->angle_rms < 0.5);
    qw_result_destroy(result);
    qw_mesh_destroy(mesh);
}

QW_TEST_SUITE(unfold)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(smooths_out_folds),
        cmocka_unit_test(leaves_shapes),
        cmocka_unit_test(survives_any_sheet),
        cmocka_unit_test(leaves_marked_vertices),
        cmocka_unit_test(makes_a_cube_of_a_folded_one),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

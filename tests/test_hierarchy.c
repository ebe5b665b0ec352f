/* Levels of the hierarchy against what they are made from, and the holds on small curves drawn by hand. */
#include "suite.h"
#include "unit_shapes.h"

static float weight_between(const qw_level *level, uint32_t u, uint32_t v)
{
    for (uint32_t i = level->begin[u]; i < level->begin[u + 1]; i++)
        if (level->neighbour[i] == v) return level->weight[i];
    return 0;
}

static void check_graph(qw_env *env, const qw_level *level)
{
    uint32_t *seen = QW_NEW(env, uint32_t, level->vertex_count);
    memset(seen, 0xff, level->vertex_count * sizeof *seen);
    for (uint32_t v = 0; v < level->vertex_count; v++) {
        assert_true(fabsf(qw_length(level->normal[v]) - 1) < 1e-4f);
        assert_true(level->begin[v] <= level->begin[v + 1]);
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
            uint32_t u = level->neighbour[i];
            assert_true(u < level->vertex_count && u != v);
            assert_int_not_equal(seen[u], v);
            seen[u] = v;
            assert_true(level->weight[i] > 0 && level->weight[i] == weight_between(level, u, v));
        }
    }
}

static void check_colors(qw_env *env, const qw_level *level)
{
    uint32_t *color = QW_NEW(env, uint32_t, level->vertex_count);
    memset(color, 0xff, level->vertex_count * sizeof *color);
    assert_int_equal(level->color_begin[0], 0);
    assert_int_equal(level->color_begin[level->color_count], level->vertex_count);
    for (uint32_t c = 0; c < level->color_count; c++) {
        assert_true(level->color_begin[c] < level->color_begin[c + 1]);
        for (uint32_t i = level->color_begin[c]; i < level->color_begin[c + 1]; i++) {
            assert_int_equal(color[level->by_color[i]], QW_NONE);
            color[level->by_color[i]] = c;
        }
    }
    for (uint32_t v = 0; v < level->vertex_count; v++)
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++)
            assert_int_not_equal(color[v], color[level->neighbour[i]]);
}

/* Weights between coarse vertices are the sums of those between their children. */
static void check_weights(const qw_level *fine, const qw_level *coarse)
{
    double between = 0, above = 0;
    for (uint32_t v = 0; v < fine->vertex_count; v++)
        for (uint32_t i = fine->begin[v]; i < fine->begin[v + 1]; i++) {
            uint32_t a = fine->parent[v], b = fine->parent[fine->neighbour[i]];
            if (a == b) continue;
            between += fine->weight[i];
            assert_true(weight_between(coarse, a, b) >= fine->weight[i]);
        }
    for (uint32_t i = 0; i < coarse->begin[coarse->vertex_count]; i++) above += coarse->weight[i];
    assert_true(fabs(between - above) < 1e-3);
}

static void check_parents(qw_env *env, const qw_level *fine, const qw_level *coarse)
{
    uint32_t *children = QW_NEW_ZERO(env, uint32_t, coarse->vertex_count),
             *first = QW_NEW(env, uint32_t, coarse->vertex_count);
    double *area = QW_NEW_ZERO(env, double, coarse->vertex_count);
    uint8_t *constraint = QW_NEW_ZERO(env, uint8_t, coarse->vertex_count);
    for (uint32_t v = 0; v < fine->vertex_count; v++) {
        uint32_t c = fine->parent[v];
        assert_true(c < coarse->vertex_count);
        if (children[c]) assert_true(weight_between(fine, first[c], v) > 0);
        first[c] = v;
        children[c]++;
        area[c] += fine->area[v];
        if (fine->constraint[v] > constraint[c]) constraint[c] = fine->constraint[v];
    }
    for (uint32_t c = 0; c < coarse->vertex_count; c++) {
        assert_in_range(children[c], 1, 2);
        assert_true(fabs(area[c] - coarse->area[c]) <= 1e-5 * area[c]);
        assert_int_equal(constraint[c], coarse->constraint[c]);
    }
}

static void check(qw_env *env, qw_trimesh mesh)
{
    qw_scope_begin(env);
    uint8_t *constraint;
    qw_vec3 *direction, *normal = qw_vertex_normals(env, &mesh);
    qw_find_constraints(env, &mesh, true, 0.7, NULL, NULL, &constraint, &direction);
    qw_hierarchy h = qw_hierarchy_build(env, &mesh, normal, constraint, direction);
    double whole = qw_trimesh_area(&mesh);
    assert_int_equal(h.level[0].vertex_count, mesh.vertex_count);
    assert_memory_equal(h.level[0].constraint, constraint, mesh.vertex_count);
    for (uint32_t l = 0; l < h.level_count; l++) {
        const qw_level *level = &h.level[l];
        double area = 0;
        for (uint32_t v = 0; v < level->vertex_count; v++) area += level->area[v];
        assert_true(fabs(area - whole) < 1e-4 * whole);
        check_graph(env, level);
        check_colors(env, level);
        assert_int_equal(level->parent == NULL, l + 1 == h.level_count);
        if (!level->parent) continue;
        assert_true(h.level[l + 1].vertex_count < level->vertex_count);
        check_weights(level, &h.level[l + 1]);
        check_parents(env, level, &h.level[l + 1]);
    }
    qw_scope_end(env);
}

static void levels_of_all_kinds_of_meshes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    check(env, unit_sphere(env, 4));
    check(env, unit_torus(env, 60, 20, 0.4f));
    check(env, unit_grid(env, 31, 17, false, false));
    check(env, unit_cylinder(env, 24, 9, 2));
    check(env, unit_cube(env, 4));
    check(env, unit_double_torus(env, 2));
    check(env, unit_triangle(env));
    check(env, unit_fan(env, 3));
    check(env, unit_fan(env, 60)); /* one vertex that neighbours all */
    qw_trimesh islands = unit_triangle(env);
    for (int i = 0; i < 6; i++) islands = unit_both(env, &islands, &islands);
    check(env, islands); /* 64 triangles that touch nothing */
    qw_trimesh sphere = unit_sphere(env, 2), mixed = unit_both(env, &sphere, &islands);
    check(env, mixed);
    qw_env_destroy(env);
}

static void coarsens_to_few(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_sphere(env, 5);
    qw_hierarchy h = qw_hierarchy_build(env, &m, qw_vertex_normals(env, &m), NULL, NULL);
    assert_true(h.level[h.level_count - 1].vertex_count <= 24);
    assert_true(h.level_count <= 14); /* 10242 vertices: halving needs 9 */
    qw_env_destroy(env);
}

/* On every level a corner is where it was, and a vertex of a straight curve lies on it and knows its direction. */
static void constraints_survive(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_cube(env, 4);
    uint8_t *constraint;
    qw_vec3 *direction;
    qw_find_constraints(env, &m, true, 0.7, NULL, NULL, &constraint, &direction);
    qw_hierarchy h = qw_hierarchy_build(env, &m, qw_vertex_normals(env, &m), constraint, direction);
    uint32_t first = 0;
    for (uint32_t l = 0; l < h.level_count; l++) {
        const qw_level *level = &h.level[l];
        uint32_t corners = 0;
        for (uint32_t v = 0; v < level->vertex_count; v++) {
            const float *p = &level->position[v].x, *d = &level->direction[v].x;
            int along = 0, at_end = 0;
            for (int k = 0; k < 3; k++) along += fabsf(fabsf(d[k]) - 1) < 1e-5f, at_end += p[k] == 0.0f || p[k] == 1.0f;
            corners += level->constraint[v] == QW_VERTEX_CORNER;
            if (level->constraint[v] == QW_VERTEX_CORNER) assert_int_equal(at_end, 3);
            if (level->constraint[v] != QW_VERTEX_CURVE) continue;
            assert_int_equal(along, 1);
            for (int k = 0; k < 3; k++)
                if (d[k] == 0) assert_true(p[k] == 0.0f || p[k] == 1.0f);
        }
        if (l == 0) first = corners;
        if (level->vertex_count > 100) assert_int_equal(corners, first);
    }
    assert_int_equal(first, 8);
    qw_env_destroy(env);
}

typedef struct mean {
    const qw_level *level;
    float *value;
} mean;

static void take_mean(void *user, uint32_t v)
{
    const mean *m = user;
    const qw_level *level = m->level;
    float sum = 0.3f * m->value[v];
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++)
        sum += level->weight[i] * sinf(m->value[level->neighbour[i]]);
    m->value[v] = sum;
}

static void any_thread_count(void **state)
{
    (void)state;
    static const uint32_t threads[] = {1, 2, 3, 8};
    float *first = NULL;
    uint32_t n = 0;
    for (int t = 0; t < 4; t++) {
        qw_env *env = qw_env_create(NULL, threads[t]);
        qw_trimesh m = unit_torus(env, 160, 60, 0.4f);
        qw_hierarchy h = qw_hierarchy_build(env, &m, qw_vertex_normals(env, &m), NULL, NULL);
        n = m.vertex_count;
        mean job = {&h.level[0], QW_NEW(env, float, n)};
        for (uint32_t v = 0; v < n; v++) job.value[v] = (float)(v % 17);
        for (int s = 0; s < 20; s++) qw_level_sweep(env, &h.level[0], take_mean, &job);
        if (t == 0) memcpy(first = malloc(n * sizeof *first), job.value, n * sizeof *first);
        assert_memory_equal(first, job.value, n * sizeof *first);
        qw_env_destroy(env);
    }
    free(first);
}

/* ---- holds */

/* A strip of two rows of squares, n long, with its middle line marked from column a to column b and bent by `bend` at
 * column k. */
static qw_trimesh strip(qw_env *env, uint32_t n, uint32_t a, uint32_t b, uint32_t k, float bend)
{
    qw_trimesh m = unit_grid(env, n, 2, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float x = (float)(v % (n + 1)), y = (float)(v / (n + 1)), past = x - (float)k;
        m.position[v] = past <= 0 ? qw_v3(x, y, 0) : qw_v3((float)k + past * cosf(bend), y, past * sinf(bend));
    }
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        uint32_t u = m.corner[h], v = m.corner[qw_next(h)], low = u < v ? u : v, high = u + v - low;
        bool on_line = low / (n + 1) == 1 && high == low + 1;
        if (on_line && low % (n + 1) >= a && high % (n + 1) <= b) m.mark[h] = QW_MARK_FEATURE;
    }
    return m;
}

static void constraints_by_hand(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint8_t *constraint;
    qw_vec3 *direction;
    uint32_t row = 7; /* the middle row is 7..13 */

    qw_trimesh m = strip(env, 6, 1, 5, 6, 0);
    qw_find_constraints(env, &m, false, 0.7, NULL, NULL, &constraint, &direction);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        bool on = v > row + 1 && v < row + 5, end = v == row + 1 || v == row + 5;
        assert_int_equal(constraint[v], on ? QW_VERTEX_CURVE : end ? QW_VERTEX_CORNER : QW_VERTEX_FREE);
        assert_true(on ? fabsf(fabsf(direction[v].x) - 1) < 1e-6f : qw_length2(direction[v]) == 0);
    }

    /* a bend under the limit is smooth, its tangent halves the angle; over it, a corner */
    m = strip(env, 6, 0, 6, 3, 0.6f);
    qw_find_constraints(env, &m, false, 0.7, NULL, NULL, &constraint, &direction);
    assert_int_equal(constraint[row + 3], QW_VERTEX_CURVE);
    assert_true(fabsf(fabsf(qw_dot(direction[row + 3], qw_v3(cosf(0.3f), 0, sinf(0.3f)))) - 1) < 1e-5f);
    m = strip(env, 6, 0, 6, 3, 0.8f);
    qw_find_constraints(env, &m, false, 0.7, NULL, NULL, &constraint, &direction);
    assert_int_equal(constraint[row + 3], QW_VERTEX_CORNER);
    assert_true(qw_length2(direction[row + 3]) == 0);

    /* with the boundary: its corners are corners, the marked line meets it at corners (three curve edges) */
    m = strip(env, 6, 0, 6, 6, 0);
    qw_find_constraints(env, &m, true, 0.7, NULL, NULL, &constraint, &direction);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        uint32_t x = v % 7, y = v / 7;
        bool side = x == 0 || x == 6;
        assert_int_equal(constraint[v], side ? QW_VERTEX_CORNER : QW_VERTEX_CURVE);
        if (!side && y != 1) assert_true(fabsf(direction[v].x) == 1.0f);
    }
    memset(m.mark, 0, 3 * m.face_count);
    qw_find_constraints(env, &m, false, 0.7, NULL, NULL, &constraint, &direction);
    for (uint32_t v = 0; v < m.vertex_count; v++) assert_int_equal(constraint[v], QW_VERTEX_FREE);
    m.mark = NULL;
    qw_find_constraints(env, &m, true, 0.7, NULL, NULL, &constraint, &direction);
    assert_int_equal(constraint[row + 3], QW_VERTEX_FREE);
    assert_int_equal(constraint[row], QW_VERTEX_CURVE);
    qw_env_destroy(env);
}

/* A tooth of the rim is corners for what is smaller than it, and a line for what is larger; the corners of the strip
 * are corners for both. */
static void teeth_are_no_corners_from_afar(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = strip(env, 6, 0, 6, 6, 0);
    m.mark = NULL;
    m.position[3].y += m.position[3].y > m.position[10].y ? 0.6f : -0.6f;
    float *span = QW_NEW(env, float, m.vertex_count);
    const float spans[] = {0.3f, 3};
    for (int i = 0; i < 2; i++) {
        uint8_t *constraint;
        qw_vec3 *direction;
        for (uint32_t v = 0; v < m.vertex_count; v++) span[v] = spans[i];
        qw_find_constraints(env, &m, true, 0.7, span, NULL, &constraint, &direction);
        assert_int_equal(constraint[3], i == 0 ? QW_VERTEX_CORNER : QW_VERTEX_CURVE);
        if (i == 1) assert_true(fabsf(direction[3].x) > 0.99f);
        assert_int_equal(constraint[0], QW_VERTEX_CORNER);
        assert_int_equal(constraint[6], QW_VERTEX_CORNER);
    }
    qw_env_destroy(env);
}

static void leaves_nothing_behind(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_sphere(env, 4);
    qw_vec3 *normal = qw_vertex_normals(env, &m);
    size_t before = qw_env_bytes(env);
    qw_hierarchy h = qw_hierarchy_build(env, &m, normal, NULL, NULL);
    assert_true(h.level_count > 4);
    qw_hierarchy_free(env, &h);
    assert_true(qw_env_bytes(env) == before);
    qw_env_destroy(env);
}

QW_TEST_SUITE(hierarchy)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_of_all_kinds_of_meshes), cmocka_unit_test(coarsens_to_few),
        cmocka_unit_test(constraints_survive),           cmocka_unit_test(any_thread_count),
        cmocka_unit_test(constraints_by_hand),           cmocka_unit_test(teeth_are_no_corners_from_afar),
        cmocka_unit_test(leaves_nothing_behind),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Curves that are too close to a stronger one lose their marks, others keep all of theirs. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/features/decide.h"
#include "remesh/features/graph.h"
#include "geometry/corners.h"
#include "remesh/features/teeth.h"

/* A grid over the unit square times (1, height), each vertex a fold of its own depth so that edges have an angle. */
static qw_trimesh grid(qw_env *env, uint32_t nu, uint32_t nv, float height)
{
    qw_trimesh m = unit_grid(env, nu, nv, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].y *= height;
    return m;
}

static uint32_t find_half(const qw_trimesh *m, uint32_t u, uint32_t v)
{
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (m->corner[h] == u && m->corner[qw_next(h)] == v) return h;
    return QW_NONE;
}

static uint32_t vertex_at(const qw_trimesh *m, float x, float y)
{
    uint32_t best = 0;
    for (uint32_t v = 1; v < m->vertex_count; v++)
        if (qw_distance(m->position[v], qw_v3(x, y, 0)) < qw_distance(m->position[best], qw_v3(x, y, 0))) best = v;
    return best;
}

/* Marks the edges between two points, in so many steps. Returns their number. */
static uint32_t mark(qw_trimesh *m, float x0, float y0, float x1, float y1, uint32_t steps)
{
    uint32_t u = vertex_at(m, x0, y0);
    for (uint32_t i = 1; i <= steps; i++) {
        float t = (float)i / (float)steps;
        uint32_t v = vertex_at(m, x0 + t * (x1 - x0), y0 + t * (y1 - y0)), h = find_half(m, u, v);
        assert_true(h != QW_NONE && m->twin[h] != QW_NONE);
        m->mark[h] = m->mark[m->twin[h]] = QW_MARK_FEATURE;
        u = v;
    }
    return steps;
}

static uint32_t marked(const qw_trimesh *m)
{
    uint32_t count = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!m->mark[h]) continue;
        assert_int_equal(m->mark[h], m->mark[m->twin[h]]);
        count++;
    }
    return count / 2;
}

static int64_t drop(qw_env *env, qw_trimesh *m, float least)
{
    float *size = QW_NEW(env, float, m->vertex_count);
    for (uint32_t v = 0; v < m->vertex_count; v++) size[v] = 2.5f * least; /* two fifths of it */
    uint32_t before = marked(m);
    const uint8_t *verdict = qw_decide_curves(env, m, size);
    int64_t dropped = qw_unmark_curves(m, verdict);
    assert_true(qw_are_verdicts_of(m, verdict));
    assert_int_equal(before - dropped, marked(m));
    qw_trimesh_validate(env, m);
    return dropped;
}

/* A valley along y = 0.5 so that lines in x have an angle, more at the middle. */
static void fold(qw_trimesh *m)
{
    for (uint32_t v = 0; v < m->vertex_count; v++) m->position[v].z = 0.1f * fabsf(m->position[v].y - 0.5f);
}

static void keeps_what_has_room(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 20, 20, 1);
    mark(&m, 0.2f, 0.5f, 0.8f, 0.5f, 12), mark(&m, 0.2f, 0.6f, 0.8f, 0.6f, 12);
    mark(&m, 0.5f, 0.2f, 0.5f, 0.8f, 12);      /* across both */
    assert_int_equal(drop(env, &m, 0.06f), 0); /* two rows apart: 0.1 */
    qw_env_destroy(env);
}

static void drops_the_weaker_of_two(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (int weaker = 0; weaker < 2; weaker++) {
        qw_trimesh m = grid(env, 20, 20, 1);
        uint32_t lines[2];
        lines[0] = mark(&m, weaker == 0 ? 0.3f : 0.2f, 0.5f, 0.8f, 0.5f, weaker == 0 ? 10 : 12);
        lines[1] = mark(&m, weaker == 1 ? 0.3f : 0.2f, 0.55f, 0.8f, 0.55f, weaker == 1 ? 10 : 12);
        for (uint32_t v = 0; v < m.vertex_count; v++) /* both are equally sharp folds */
            m.position[v].z = m.position[v].y > 0.48f && m.position[v].y < 0.57f ? 0.02f : 0;
        assert_int_equal(drop(env, &m, 0.06f), lines[weaker]);
        uint32_t h = find_half(&m, vertex_at(&m, 0.5f, weaker ? 0.5f : 0.55f),
                               vertex_at(&m, 0.55f, weaker ? 0.5f : 0.55f));
        assert_true(h != QW_NONE && m.mark[h]);
    }
    qw_env_destroy(env);
}

static void drops_beside_the_boundary(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 20, 20, 1);
    uint32_t line = mark(&m, 0.2f, 0.05f, 0.8f, 0.05f, 12);
    assert_int_equal(drop(env, &m, 0.06f), line);
    qw_env_destroy(env);
}

/* The diagonal and the middle line of a flattened grid, from one corner at 11 degrees: an acute corner, which is for
 * remesh/quantise/acute_corners.h. */
static void leaves_acute_corners_alone(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 40, 40, 0.2f);
    mark(&m, 0.1f, 0.02f, 0.9f, 0.02f, 32);
    uint32_t u = vertex_at(&m, 0.1f, 0.02f);
    bool diagonal = find_half(&m, u, vertex_at(&m, 0.125f, 0.025f)) != QW_NONE;
    if (!diagonal) { /* the grid is cut the other way: mirror it */
        for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].y = 0.2f - m.position[v].y;
        memset(m.mark, 0, 3 * m.face_count);
        mark(&m, 0.1f, 0.02f, 0.9f, 0.02f, 32);
    }
    mark(&m, 0.1f, 0.02f, 0.8f, 0.16f, 28);
    const float least = 0.012f; /* the width two columns from the tip is 0.01 */
    assert_int_equal(drop(env, &m, least), 0);
    qw_env_destroy(env);
}

static void drops_short_pieces(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 20, 20, 1);
    fold(&m);
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].z = 0;
    uint32_t line = mark(&m, 0.2f, 0.05f, 0.8f, 0.05f, 12);
    uint32_t stub = mark(&m, 0.5f, 0.05f, 0.5f, 0.1f, 1); /* hangs on the line that goes */
    mark(&m, 0.2f, 0.5f, 0.8f, 0.5f, 12);
    assert_int_equal(drop(env, &m, 0.06f), line + stub);
    qw_env_destroy(env);
}

static void nothing_marked(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 5, 5, 1);
    assert_int_equal(drop(env, &m, 1), 0);
    m.mark = NULL;
    float size[36];
    for (int v = 0; v < 36; v++) size[v] = 1;
    const uint8_t *verdict = qw_decide_curves(env, &m, size);
    for (uint32_t h = 0; h < 3 * m.face_count; h++)
        assert_int_equal(verdict[h], m.twin[h] == QW_NONE ? QW_CURVE_KEPT : QW_CURVE_NONE);
    qw_env_destroy(env);
}

/* The boundary of a square turns at four vertices; a line across its middle ends at two. */
static void corners_by_degree_and_angle(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 8, 8, 1);
    mark(&m, 0.25f, 0.5f, 0.75f, 0.5f, 4);
    const qw_curve_ends *marks = qw_find_curve_ends(env, &m, false), *all = qw_find_curve_ends(env, &m, true);
    uint32_t square[4] = {vertex_at(&m, 0, 0), vertex_at(&m, 1, 0), vertex_at(&m, 1, 1), vertex_at(&m, 0, 1)};
    uint32_t ends[2] = {vertex_at(&m, 0.25f, 0.5f), vertex_at(&m, 0.75f, 0.5f)}, middle = vertex_at(&m, 0.5f, 0.5f);
    uint32_t sharp = 0, ending = 0, among_marks = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        sharp += qw_is_curve_corner(&m, all, v, 0.766f);
        ending += qw_curves_end_at(&all[v]);
        among_marks += qw_is_curve_corner(&m, marks, v, 0.766f);
    }
    assert_int_equal(sharp, 6);
    assert_int_equal(ending, 2);
    assert_int_equal(among_marks, 2);
    for (int i = 0; i < 4; i++) {
        assert_true(qw_is_curve_corner(&m, all, square[i], 0.766f));
        assert_false(qw_is_curve_corner(&m, all, square[i], -0.5f)); /* a right angle is less than 120 degrees */
        assert_int_equal(marks[square[i]].count, 0);
    }
    assert_int_equal(marks[ends[0]].count, 1);
    assert_int_equal(marks[middle].count, 2);
    assert_false(qw_is_curve_corner(&m, all, middle, 0.766f));
    assert_int_equal(qw_curve_beyond(all, marks[middle].other[0], middle), marks[middle].other[1]);
    qw_env_destroy(env);
}

/* A staircase of marked edges becomes straight where its steps are smaller than the quads, and no triangle is turned
   over; the corner of a line that goes straight on both sides, and stairs of long steps, stay. */
static void teeth_become_smooth(void **state)
{
    (void)state;
    enum { N = 20 };
    for (int is_small = 0; is_small < 2; is_small++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_trimesh m = grid(env, N, N, 1);
        m.mark = QW_NEW_ZERO(env, uint8_t, 3 * (size_t)m.face_count);
        float step = 1.0f / N;
        for (int i = 2; i < 14; i++) {
            float x = (float)i * step, y = (float)(i + 3) * step;
            mark(&m, x, y, x + step, y, 1), mark(&m, x + step, y, x + step, y + step, 1);
        }
        mark(&m, 0.5f, 0.2f, 0.9f, 0.2f, 8), mark(&m, 0.9f, 0.2f, 0.9f, 0.6f, 8);
        const qw_vec3 *before = m.position;
        uint32_t teeth = qw_smooth_teeth(env, &m, is_small ? 1.5 * (double)step : 0.5 * (double)step, false, NULL),
                 moved = 0;
        assert_int_equal(teeth, is_small ? 21 : 0);
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            if (qw_distance(m.position[v], before[v]) == 0) continue;
            float off = (m.position[v].y - m.position[v].x - 2.5f * step) / sqrtf(2);
            moved++;
            if (before[v].x > 4 * step && before[v].x < 12 * step) assert_true(fabsf(off) < 0.25f * step); /* 0.35 */
        }
        assert_true(moved >= teeth && moved < 30);
        for (uint32_t f = 0; f < m.face_count; f++)
            assert_true(qw_dot(qw_face_cross(&m, f), qw_triangle_cross(before, m.corner + 3 * (size_t)f)) > 0);
        qw_env_destroy(env);
    }
}

/* A bent sheet whose rim goes down in steps of a cell, which are smaller than the quads: only its four corners are
   irregular, where quads that followed the steps would be so at each. */
static void rims_in_teeth_become_smooth(void **state)
{
    (void)state;
    enum { N = 60 };
    static double position[3 * (N + 1) * (N + 1)];
    static uint32_t corner[6 * N * N];
    qw_mesh_view view = {.size = sizeof view, .uniform_face_size = 3, .positions = position, .corners = corner};
    for (uint32_t j = 0; j <= N; j++)
        for (uint32_t i = 0; i <= N; i++) {
            double *p = position + 3 * (size_t)view.vertex_count++;
            p[0] = i / (double)N, p[1] = j / (double)N, p[2] = 0.3 * p[0] * p[1];
        }
    for (uint32_t j = 0; j < N; j++)
        for (uint32_t i = 0; i < N && 5 * (2 * i + 3 * j) < 18 * N; i++) {
            uint32_t a = j * (N + 1) + i, d = a + N + 1, *c = corner + 3 * (size_t)view.face_count;
            c[0] = a, c[1] = a + 1, c[2] = d + 1, c[3] = a, c[4] = d + 1, c[5] = d;
            view.face_count += 2;
        }
    qw_options o;
    qw_options_init(&o);
    o.faces = 700;
    qw_result *result;
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    qw_mesh_view quads = qw_result_mesh(result);
    qw_topology topology;
    qw_quality quality;
    assert_int_equal(qw_measure(&quads, &view, NULL, &topology, &quality), QW_OK);
    assert_true(topology.irregular_boundary <= 8); /* 56 where each step was followed */
    assert_true(quality.angle_rms < 8);            /* 15.4 */
    assert_true(quality.hausdorff < 0.75);
    qw_result_destroy(result);
}

/* A vertex of a strap, 10 long, 1 wide and 0.16 thick, of so many a section: three edges of its rounded rims, 0.04
   apart, turn by more than 40 degrees. */
static void strap_vertex(uint32_t i, uint32_t sides, uint32_t j, uint32_t rings, double p[3])
{
    double a = 6.283185307179586 * i / sides, c = cos(a), s = sin(a);
    p[0] = 10.0 * j / rings;
    p[1] = fabs(c) > 1e-9 ? copysign(0.5 * pow(fabs(c), 0.6), c) : 0;
    p[2] = fabs(s) > 1e-9 ? copysign(0.08 * pow(fabs(s), 0.6), s) : 0;
}

/* Where there is no room for all three, one of them stays, and no row of slivers is left between two. */
static void rounded_rims_leave_no_slivers(void **state)
{
    (void)state;
    enum { SIDES = 20, RINGS = 60, ENDS = SIDES * (RINGS + 1) };
    static double position[3 * (ENDS + 2)];
    static uint32_t corner[6 * SIDES * (RINGS + 1)];
    static const int64_t counts[] = {120, 200, 300};
    qw_mesh_view view = {.size = sizeof view, .uniform_face_size = 3, .positions = position, .corners = corner};
    for (uint32_t j = 0; j <= RINGS; j++)
        for (uint32_t i = 0; i < SIDES; i++) strap_vertex(i, SIDES, j, RINGS, position + 3 * view.vertex_count++);
    view.vertex_count += 2, position[3 * (ENDS + 1)] = 10;
    for (uint32_t j = 0; j <= RINGS; j++)
        for (uint32_t i = 0; i < SIDES; i++) {
            uint32_t n = (i + 1) % SIDES, a = j * SIDES + i, b = j * SIDES + n, *c = corner + 3 * view.face_count;
            const uint32_t wall[6] = {a, a + SIDES, b + SIDES, a, b + SIDES, b}, ends[6] = {i, n, ENDS, b, a, ENDS + 1};
            memcpy(c, j < RINGS ? wall : ends, sizeof wall);
            view.face_count += 2;
        }
    double sum = 0;
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        qw_options o;
        qw_options_init(&o);
        o.faces = counts[i];
        qw_result *result;
        assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
        sum += qw_result_report(result)->area_cv / 3;
        qw_result_destroy(result);
    }
    if (sum > 0.5) fail_msg("areas off by %g", sum); /* 1.0 with slivers, 0.29 without */
}

/* Two lines that cross, one of them beside a longer one for half of its length: arcs from node to node, each with one
   verdict, and with the lengths that were marked. */
static void arcs_have_one_verdict_each(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = grid(env, 20, 20, 1);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        m.position[v].z = m.position[v].y > 0.48f && m.position[v].y < 0.57f ? 0.02f : 0;
    mark(&m, 0.1f, 0.5f, 0.9f, 0.5f, 16), mark(&m, 0.5f, 0.55f, 0.75f, 0.55f, 5), mark(&m, 0.3f, 0.2f, 0.3f, 0.8f, 12);
    float *least = QW_NEW(env, float, m.vertex_count);
    for (uint32_t v = 0; v < m.vertex_count; v++) least[v] = 0.15f;
    uint8_t *verdict = qw_decide_curves(env, &m, least);
    qw_feature_graph g = qw_feature_graph_build(env, &m, verdict, QW_ALL_CURVES);
    uint32_t of[QW_CURVE_VERDICTS] = {0}, edges = 0;
    float kept = 0, given_up = 0;
    for (uint32_t i = 0; i < g.arc_count; i++) {
        const qw_feature_arc *arc = &g.arc[i];
        uint8_t one = verdict[g.half[arc->begin]];
        for (uint32_t k = arc->begin; k < arc->begin + arc->count; k++) {
            assert_int_equal(verdict[g.half[k]], one);
            assert_int_equal(g.arc_of[g.half[k]], i);
        }
        for (int k = 0; k < 2; k++) assert_true(arc->node[k] != QW_NONE && g.degree[arc->node[k]] > 0);
        of[one]++, edges += arc->count;
        *(one == QW_CURVE_KEPT ? &kept : &given_up) += arc->length;
    }
    assert_int_equal(edges, 80 + 16 + 5 + 12);
    assert_int_equal(of[QW_CURVE_KEPT], 4 + 3); /* the sides of the square, and the cross but for its short arm */
    assert_int_equal(of[QW_CURVE_MERGED], 1);
    assert_int_equal(of[QW_CURVE_LET_GO], 1);
    assert_true(fabsf(given_up - 0.25f - 0.2f) < 1e-4f && kept > 4 + 0.6f + 0.6f - 1e-4f);
    qw_feature_graph only = qw_feature_graph_build(env, &m, verdict, QW_VERDICT_BIT(QW_CURVE_MERGED));
    assert_int_equal(only.arc_count, 1);
    assert_int_equal(only.arc[0].count, 5);
    qw_env_destroy(env);
}

QW_TEST_SUITE(curves)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(keeps_what_has_room),         cmocka_unit_test(drops_the_weaker_of_two),
        cmocka_unit_test(drops_beside_the_boundary),   cmocka_unit_test(leaves_acute_corners_alone),
        cmocka_unit_test(drops_short_pieces),          cmocka_unit_test(nothing_marked),
        cmocka_unit_test(corners_by_degree_and_angle), cmocka_unit_test(teeth_become_smooth),
        cmocka_unit_test(rims_in_teeth_become_smooth), cmocka_unit_test(rounded_rims_leave_no_slivers),
        cmocka_unit_test(arcs_have_one_verdict_each),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

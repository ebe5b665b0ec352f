/* Subdivision and limit surfaces: rules against known positions, connectivity, the fit of a limit surface, and whole
 * runs that are split. */
#include "suite.h"

#include "unit_shapes.h"
#include "shapes.h"

#include "products/limit/cage.h"
#include "products/limit/fit_limit.h"
#include "products/limit/jacobian.h"
#include "products/limit/second_order.h"
#include "products/limit/patch_blocks.h"
#include "products/limit/patches.h"
#include "products/limit/stencils.h"

#include <stdio.h>

/* ---- rules */

static void rows_sum_to_one(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {7};
    qw_quadmesh q = unit_quad_sphere(env, &r, 60);
    qw_stencils rows[3] = {qw_split_stencils(env, &q), qw_limit_stencils(env, &q)};
    qw_quadmesh fine = qw_split_quads(env, &q);
    qw_stencils last = qw_limit_stencils(env, &fine);
    rows[2] = qw_stencils_product(env, &last, &rows[0]);
    for (int k = 0; k < 3; k++)
        for (uint32_t i = 0; i < rows[k].row_count; i++) {
            double sum = 0;
            for (size_t e = rows[k].first[i]; e < rows[k].first[i + 1]; e++) sum += rows[k].value[e];
            assert_true(fabs(sum - 1) < 1e-12);
        }
    /* the limit of a vertex is the same before and after a split */
    for (uint32_t v = 0; v < q.vertex_count; v++) q.position[v] = unit_direction(&r);
    qw_vec3 *before = QW_NEW(env, qw_vec3, q.vertex_count), *after = QW_NEW(env, qw_vec3, fine.vertex_count);
    qw_stencils_place(env, &rows[1], q.position, before), qw_stencils_place(env, &rows[2], q.position, after);
    for (uint32_t v = 0; v < q.vertex_count; v++) assert_true(qw_distance(before[v], after[v]) < 1e-6f);
    qw_env_destroy(env);
}

static void expect_split(qw_env *env, const qw_quadmesh *q)
{
    qw_quadmesh fine = qw_split_quads(env, q);
    qw_quad_census was = qw_quadmesh_census(env, q), is = qw_quadmesh_census(env, &fine);
    qw_quadmesh_validate(env, &fine);
    assert_int_equal(is.faces, 4 * was.faces);
    assert_int_equal(is.vertices, was.vertices + was.edges + was.faces);
    assert_true(is.euler == was.euler && is.components == was.components && is.boundary_loops == was.boundary_loops);
    assert_int_equal(is.irregular, was.irregular);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) assert_int_equal(fine.corner[4 * h], q->corner[h]);
}

static void splits_keep_the_topology(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {3};
    qw_quadmesh sheet = unit_sheet(env, 3, 4), torus = unit_quads(env, 5, 4, true, true),
                ball = unit_quad_sphere(env, &r, 40);
    expect_split(env, &sheet), expect_split(env, &torus), expect_split(env, &ball);
    qw_env_destroy(env);
}

/* A plane stays one, evenly cut: with corners held its border is a straight B-spline. */
static void planes_stay(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh q = unit_sheet(env, 4, 4);
    qw_stencils rows = qw_split_stencils(env, &q);
    qw_quadmesh fine = qw_split_quads(env, &q);
    qw_stencils_place(env, &rows, q.position, fine.position);
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        assert_true(fine.position[v].z == 0);
        if (q.kind[v] != QW_VERTEX_FREE) continue;
        assert_true(qw_distance(fine.position[v], q.position[v]) < 1e-6f);
    }
    assert_true(qw_distance(fine.position[0], q.position[0]) == 0);
    qw_env_destroy(env);
}

static void marks_make_creases_and_corners(void **state)
{
    (void)state;
    double position[3 * 8];
    uint32_t corner[24], all[24][2], edges = 0;
    qw_mesh_view cube = shape_cube_of_quads(1, position, corner);
    for (uint32_t h = 0; h < 24; h++) {
        uint32_t a = corner[h], b = corner[h % 4 == 3 ? h - 3 : h + 1];
        if (a < b) all[edges][0] = a, all[edges++][1] = b;
    }
    assert_int_equal(edges, 12);
    qw_mesh *limit;
    for (uint32_t times = 0; times < 4; times++) { /* without marks: half way in from each corner */
        assert_int_equal(qw_limit(&cube, times, NULL, &limit), QW_OK);
        qw_mesh_view m = qw_mesh_get(limit);
        assert_int_equal(m.face_count, 6u << (2 * times));
        for (int i = 0; i < 24; i++) assert_true(fabs((m.positions[i] - 0.5) - 0.5 * (position[i] - 0.5)) < 1e-12);
        qw_mesh_destroy(limit);
    }
    cube.marked_edges = all[0], cube.marked_edge_count = edges; /* all: corners, so that the cube stays */
    assert_int_equal(qw_limit(&cube, 2, NULL, &limit), QW_OK);
    assert_memory_equal(qw_mesh_get(limit).positions, position, sizeof position);
    qw_mesh_destroy(limit);
    const uint32_t one[1][2] = {{3, 3}};
    cube.marked_edges = one[0], cube.marked_edge_count = 1; /* one corner */
    assert_int_equal(qw_limit(&cube, 2, NULL, &limit), QW_OK);
    assert_memory_equal(qw_mesh_get(limit).positions + 9, position + 9, 3 * sizeof *position);
    assert_memory_not_equal(qw_mesh_get(limit).positions, position, 3 * sizeof *position);
    qw_mesh_destroy(limit);
    uint32_t far_edge[1][2] = {{0, 0}}; /* the corner across the cube is no neighbour */
    for (uint32_t v = 1; v < 8; v++)
        if (fabs(position[3 * v] - position[0]) + fabs(position[3 * v + 1] - position[1]) +
                fabs(position[3 * v + 2] - position[2]) >
            2.5)
            far_edge[0][1] = v;
    cube.marked_edges = far_edge[0];
    assert_int_equal(qw_limit(&cube, 2, NULL, &limit), QW_ARGUMENT);
    assert_non_null(strstr(qw_mesh_message(limit), "is no edge"));
    qw_mesh_destroy(limit);
}

static void other_meshes_are_refused(void **state)
{
    (void)state;
    shape s = shape_cube(2);
    qw_mesh_view view = shape_view(&s);
    qw_mesh *limit;
    assert_int_equal(qw_limit(&view, 1, NULL, &limit), QW_ARGUMENT);
    assert_non_null(strstr(qw_mesh_message(limit), "is no quad"));
    qw_mesh_destroy(limit);
    shape_free(&s);
    double position[3 * 8];
    uint32_t corner[24];
    view = shape_cube_of_quads(1, position, corner);
    assert_int_equal(qw_limit(&view, QW_MOST_SPLITS + 1, NULL, &limit), QW_ARGUMENT);
    qw_mesh_destroy(limit);
    assert_int_equal(qw_limit(&view, 1, NULL, NULL), QW_ARGUMENT);
}

/* ---- the fit */

/* Distances of the limit surface, split once more, from the unit sphere: mean and largest. */
static void off_sphere(qw_env *env, const qw_quadmesh *q, double *mean, double *most)
{
    qw_quadmesh fine = qw_split_quads(env, q);
    qw_stencils once = qw_split_stencils(env, q), last = qw_limit_stencils(env, &fine);
    qw_stencils_place(env, &once, q->position, fine.position);
    qw_vec3 *at = QW_NEW(env, qw_vec3, fine.vertex_count);
    qw_stencils_place(env, &last, fine.position, at);
    *mean = *most = 0;
    for (uint32_t v = 0; v < fine.vertex_count; v++) {
        double off = fabs((double)qw_length(at[v]) - 1);
        *mean += off / fine.vertex_count, *most = fmax(*most, off);
    }
}

static void limits_lie_on_a_sphere(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = unit_sphere(env, 4);
    double position[3 * 56];
    uint32_t corner[4 * 54], faces = 54;
    qw_mesh_view view = shape_cube_of_quads(3, position, corner);
    qw_quadmesh cage = {.vertex_count = view.vertex_count, .face_count = faces, .corner = corner};
    cage.position = QW_NEW(env, qw_vec3, cage.vertex_count);
    cage.component = QW_NEW_ZERO(env, uint32_t, cage.vertex_count);
    cage.twin = QW_NEW(env, uint32_t, 4 * (size_t)faces);
    for (uint32_t h = 0; h < 4 * faces; h++)
        for (uint32_t t = 0; t < 4 * faces; t++)
            if (corner[h] == corner[qw_quad_next(t)] && corner[t] == corner[qw_quad_next(h)]) cage.twin[h] = t;
    for (uint32_t v = 0; v < cage.vertex_count; v++) {
        const double *p = position + 3 * (size_t)v;
        cage.position[v] = qw_normalize(qw_v3((float)p[0] - 0.5f, (float)p[1] - 0.5f, (float)p[2] - 0.5f));
    }
    qw_quadmesh_validate(env, &cage);
    qw_bvh *tree = qw_bvh_build(env, &m);
    const qw_shape target = {.tree = tree, .surface = &m};
    double mean[2], most[2];
    off_sphere(env, &cage, &mean[0], &most[0]);
    const qw_limit_fit fit = {&target, NULL};
    qw_fit_limit(env, &cage, &fit);
    off_sphere(env, &cage, &mean[1], &most[1]);
    assert_true(mean[0] > 0.02 && mean[1] < 0.1 * mean[0] && most[1] < 0.2 * most[0]);
    qw_env_destroy(env);
}

/* ---- patches */

/* Patches of regular quads are the limit surface: at their corners and in their middles. */
static void regular_patches_are_exact(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {11};
    qw_quadmesh q = unit_quads(env, 6, 5, true, true), fine = qw_split_quads(env, &q);
    size_t n = q.vertex_count;
    double *at = QW_NEW(env, double, 3 * n), *once = QW_NEW(env, double, 3 * (size_t)fine.vertex_count),
           *limit = QW_NEW(env, double, 3 * (size_t)fine.vertex_count);
    for (size_t i = 0; i < 3 * n; i++) at[i] = (double)unit_real(&r);
    qw_stencils split = qw_split_stencils(env, &q), last = qw_limit_stencils(env, &fine);
    qw_stencils_apply(env, &split, at, once), qw_stencils_apply(env, &last, once, limit);
    double huge = 0x1p900; /* whose square is beyond double precision */
    qw_patches p = qw_make_patches(env, &q, at);
    double tolerance = p.tolerance;
    for (size_t i = 0; i < 3 * n; i++) at[i] *= huge;
    assert_true(fabs(qw_make_patches(env, &q, at).tolerance - tolerance * huge) <= 1e-12 * tolerance * huge);
    for (size_t i = 0; i < 3 * n; i++) at[i] /= huge;
    assert_true(p.shell_count == 1 && p.is_closed[0] && p.edge_count == 2 * q.face_count);
    static const double middle[4] = {0.125, 0.375, 0.375, 0.125};
    for (uint32_t f = 0; f < q.face_count; f++)
        for (int k = 0; k < 3; k++) {
            double sum = 0;
            for (int i = 0; i < 16; i++) sum += middle[i / 4] * middle[i % 4] * p.point[3 * p.face[f][i] + (uint32_t)k];
            assert_true(fabs(sum - limit[3 * fine.corner[16 * f + 2] + (uint32_t)k]) < 1e-12);
            assert_true(fabs(p.point[3 * p.face[f][0] + (uint32_t)k] - limit[3 * q.corner[4 * f] + (uint32_t)k]) <
                        1e-12);
        }
    qw_env_destroy(env);
}

/* Sides of patches are the points of the edges that they name, in the direction that is told. */
static void patches_meet_at_their_edges(void **state)
{
    (void)state;
    static const int sides[4][4] = {{0, 4, 8, 12}, {12, 13, 14, 15}, {15, 11, 7, 3}, {3, 2, 1, 0}};
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh meshes[2] = {unit_quad_sphere(env, &(unit_rng){5}, 40), unit_sheet(env, 3, 2)};
    for (int m = 0; m < 2; m++) {
        const qw_quadmesh *q = &meshes[m];
        double *at = QW_NEW(env, double, 3 * (size_t)q->vertex_count);
        for (uint32_t i = 0; i < 3 * q->vertex_count; i++) at[i] = (double)(&q->position[i / 3].x)[i % 3];
        qw_patches p = qw_make_patches(env, q, at);
        assert_int_equal(p.is_closed[0], m == 0);
        for (uint32_t f = 0; f < q->face_count; f++)
            for (int k = 0; k < 4; k++)
                for (int i = 0; i < 4; i++)
                    assert_int_equal(p.face[f][sides[k][i]], p.edge[p.side[f][k]][p.is_along[f][k] ? i : 3 - i]);
    }
    qw_env_destroy(env);
}

/* The points of blocks at their sides are those of the edges that they name; the quads are all there. */
static void expect_blocks(qw_env *env, const qw_quadmesh *q, uint32_t blocks, uint32_t edges)
{
    double *at = QW_NEW(env, double, 3 * (size_t)q->vertex_count);
    for (uint32_t i = 0; i < 3 * q->vertex_count; i++) at[i] = (double)(&q->position[i / 3].x)[i % 3];
    qw_patches p = qw_make_patches(env, q, at);
    const qw_patch_blocks *b = qw_join_patches(env, q, &p);
    assert_non_null(b);
    assert_int_equal(b->count, blocks);
    assert_int_equal(b->edge_count, edges);
    uint32_t quads = 0;
    for (uint32_t f = 0; f < b->count; f++) {
        uint32_t m = b->span[f][0], n = b->span[f][1], rows = 2 * m + 2, columns = 2 * n + 2;
        const uint32_t *point = b->point + b->first[f];
        quads += m * n;
        assert_int_equal(b->first[f + 1] - b->first[f], rows * columns);
        for (int k = 0; k < 4; k++) {
            uint32_t first = b->edge_first[b->side[f][k]], count = b->edge_first[b->side[f][k] + 1] - first;
            assert_int_equal(count, k % 2 ? columns : rows);
            for (uint32_t i = 0; i < count; i++) {
                uint32_t back = count - 1 - i,
                         r = k == 0   ? i
                             : k == 1 ? rows - 1
                             : k == 2 ? back
                                      : 0,
                         c = k == 0   ? 0
                             : k == 1 ? i
                             : k == 2 ? columns - 1
                                      : back;
                assert_int_equal(point[r * columns + c], b->edge_point[first + (b->is_along[f][k] ? i : back)]);
            }
        }
    }
    assert_int_equal(quads, q->face_count);
}

static void patches_join_to_blocks(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh sheet = unit_sheet(env, 5, 3), ring = unit_quads(env, 8, 3, true, false), torus;
    expect_blocks(env, &sheet, 1, 4);
    for (uint32_t h = 0; h < 4 * sheet.face_count; h++) { /* a sharp edge cuts it in two */
        qw_vec3 a = sheet.position[sheet.corner[h]], b = sheet.position[sheet.corner[qw_quad_next(h)]];
        if (fabsf(a.x - 0.4f) < 1e-6f && fabsf(b.x - 0.4f) < 1e-6f) sheet.mark[h] = QW_MARK_FEATURE;
    }
    expect_blocks(env, &sheet, 2, 7);
    expect_blocks(env, &ring, 2, 6);
    torus = unit_quads(env, 8, 5, true, true);
    expect_blocks(env, &torus, 4, 8);
    qw_env_destroy(env);
}

/* A vertex that was pulled over a neighbour goes back, a boundary's along the boundary; what is good stays. */
static void bad_quads_are_raised(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_grid(env, 12, 12, false, false);
    qw_quadmesh q = unit_sheet(env, 6, 6);
    const qw_curve_tree *curves = NULL;
    qw_vec3 from[4] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},
            to[4] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 0}};
    curves = qw_curve_tree_build(env, from, to, 4);
    const qw_shape target = {qw_bvh_build(env, &m), curves, from, to, &m};
    assert_int_equal(qw_raise_jacobians(env, &q, &target, NULL, 0.3f), 0);
    q.position[2 * 7 + 2].x += 0.15f, q.position[2 * 7 + 2].y += 0.15f; /* nearly onto the next */
    q.position[4].x += 0.16f;
    uint32_t low = 0;
    for (uint32_t f = 0; f < q.face_count; f++) low += qw_scaled_jacobian(q.position, q.corner + 4 * f) < 0.3f;
    assert_true(low > 1);
    qw_vec3 far_off = q.position[5 * 7 + 5];
    assert_int_equal(qw_raise_jacobians(env, &q, &target, NULL, 0.3f), low);
    for (uint32_t f = 0; f < q.face_count; f++) assert_true(qw_scaled_jacobian(q.position, q.corner + 4 * f) >= 0.3f);
    assert_true(q.position[4].y == 0);
    assert_memory_equal(&far_off, &q.position[5 * 7 + 5], sizeof far_off);
    qw_env_destroy(env);
}

/* Two squares side by side, split once: 0 to 5 are corners, 6 to 12 lie on sides, 13 and 14 in the middle. A side that
   bulges by 0.8 over one of them bends it; one that bulges by 0.1 does not. */
static void sides_of_second_order_are_held_back(void **state)
{
    (void)state;
    static const double flat[15][3] = {{0, 0},   {1, 0},   {2, 0},   {0, 1},     {1, 1},
                                       {2, 1},   {0.5, 0}, {1, 0.5}, {0.5, 1},   {0, 0.5},
                                       {1.5, 0}, {2, 0.5}, {1.5, 1}, {0.5, 0.5}, {1.5, 0.5}};
    static const uint32_t corner[32] = {0, 6,  13, 9, 1, 7,  13, 6,  4, 8,  13, 7,  3, 9, 13, 8,
                                        1, 10, 14, 7, 2, 11, 14, 10, 5, 12, 14, 11, 4, 7, 14, 12};
    qw_env *env = qw_env_create(NULL, 1);
    double at[15][3];
    memcpy(at, flat, sizeof at);
    at[7][0] = 1.1;
    assert_int_equal(qw_hold_sides_back(env, at[0], corner, 2, 15), 0);
    assert_true(at[7][0] == 1.1);
    at[7][0] = 1.8;
    assert_int_equal(qw_hold_sides_back(env, at[0], corner, 2, 15), 1);
    assert_true(fabs(at[7][0] - 1.4) < 1e-12 && at[7][1] == 0.5);
    assert_int_equal(qw_hold_sides_back(env, at[0], corner, 2, 15), 0);
    qw_env_destroy(env);
}

QW_TEST_SUITE(limit)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sides_of_second_order_are_held_back),
        cmocka_unit_test(bad_quads_are_raised),
        cmocka_unit_test(patches_join_to_blocks),
        cmocka_unit_test(rows_sum_to_one),
        cmocka_unit_test(splits_keep_the_topology),
        cmocka_unit_test(planes_stay),
        cmocka_unit_test(marks_make_creases_and_corners),
        cmocka_unit_test(other_meshes_are_refused),
        cmocka_unit_test(limits_lie_on_a_sphere),
        cmocka_unit_test(regular_patches_are_exact),
        cmocka_unit_test(patches_meet_at_their_edges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

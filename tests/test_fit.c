/* Vertices that leave the surface: how near the quads come to it, and what stays where it was. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/relax/fit.h"

enum { QUADS = 12, FINE = 96 }; /* along a side of the unit square */

static float bowl(float x, float y) { return 0.6f * ((x - 0.5f) * (x - 0.5f) + (y - 0.5f) * (y - 0.5f)); }

/* The surface above the unit square, in triangles. */
static qw_trimesh fine_bowl(qw_env *env)
{
    qw_trimesh m = unit_grid(env, FINE, FINE, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].z = bowl(m.position[v].x, m.position[v].y);
    return m;
}

static qw_quadmesh on_bowl(qw_env *env)
{
    qw_quadmesh q = unit_sheet(env, QUADS, QUADS);
    for (uint32_t v = 0; v < q.vertex_count; v++) q.position[v].z = bowl(q.position[v].x, q.position[v].y);
    return q;
}

/* The mean height of the bowl above the quads, and of its absolute value; inside: quads that touch no boundary only. */
static void heights(const qw_quadmesh *q, double *mean, double *absolute)
{
    enum { CUTS = 8 };
    uint32_t count = 0;
    *mean = *absolute = 0;
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * (size_t)f;
        bool inside = true;
        for (int i = 0; i < 4; i++) inside &= q->kind[c[i]] == QW_VERTEX_FREE;
        for (int i = 0; inside && i < CUTS * CUTS; i++) {
            float u = ((float)(i % CUTS) + 0.5f) / CUTS, v = ((float)(i / CUTS) + 0.5f) / CUTS;
            qw_vec3 a = q->position[c[0]], ab = qw_sub(q->position[c[u > v ? 1 : 3]], a),
                    ac = qw_sub(q->position[c[2]], a);
            qw_vec3 p = qw_madd(qw_madd(a, fabsf(u - v), ab), fminf(u, v), ac);
            double above = (double)(bowl(p.x, p.y) - p.z);
            *mean += above, *absolute += fabs(above), count++;
        }
    }
    *mean /= count, *absolute /= count;
}

static void quads_come_nearer(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = fine_bowl(env);
    qw_bvh *tree = qw_bvh_build(env, &m);
    double mean[3], absolute[3];
    for (int half = 0; half < 3; half++) {
        qw_quadmesh q = on_bowl(env), before = q;
        qw_fit_quads(env, &q, &(qw_fit){.tree = tree, .strength = (float)half / 2});
        heights(&q, &mean[half], &absolute[half]);
        for (uint32_t v = 0; v < q.vertex_count; v++) { /* the rim stays bit for bit, and all does at 0 */
            bool stays = half == 0 || q.kind[v] != QW_VERTEX_FREE;
            assert_int_equal(memcmp(&q.position[v], &before.position[v], sizeof q.position[v]) == 0, stays);
        }
    }
    assert_true(mean[0] < 0 && fabs(absolute[0] + mean[0]) < 1e-6); /* all of the quads lies on one side */
    assert_true(fabs(mean[2]) < 0.1 * absolute[0]);                 /* then it is even */
    assert_true(absolute[2] < 0.4 * absolute[0]);
    assert_true(absolute[1] < 0.8 * absolute[0] && absolute[1] > absolute[2]);
    qw_env_destroy(env);
}

/* Vertices on sharp edges stay; those on the cut of a symmetric surface move within it. */
static void curves_stay_and_cuts_slide(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = fine_bowl(env);
    qw_bvh *tree = qw_bvh_build(env, &m);
    qw_quadmesh q = on_bowl(env), before = q;
    const double cut[4] = {0, 1, 0, 0}; /* y = 0 */
    for (uint32_t h = 0; h < 4 * q.face_count; h++) {
        qw_vec3 a = q.position[q.corner[h]], b = q.position[q.corner[qw_quad_next(h)]];
        if (fabsf(a.x - 0.5f) < 1e-6f && fabsf(b.x - 0.5f) < 1e-6f) q.mark[h] = QW_MARK_FEATURE;
    }
    qw_fit_quads(env, &q, &(qw_fit){.tree = tree, .strength = 1, .cut = cut, .cuts = 1});
    uint32_t slid = 0;
    for (uint32_t v = 0; v < q.vertex_count; v++) {
        qw_vec3 p = before.position[v];
        bool moved = memcmp(&p, &q.position[v], sizeof p) != 0, sharp = fabsf(p.x - 0.5f) < 1e-6f;
        if (sharp || q.kind[v] == QW_VERTEX_CORNER || (q.kind[v] == QW_VERTEX_CURVE && p.y > 0)) assert_false(moved);
        if (p.y == 0 && moved) assert_true(q.position[v].y == 0), slid++;
    }
    assert_int_equal(slid, QUADS - 2); /* all of that side but its ends and the sharp edge's */
    qw_env_destroy(env);
}

/* A surface that is nowhere near moves nothing; a quad that would turn over stays. */
static void what_is_far_moves_nothing(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = fine_bowl(env);
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].z += 1;
    qw_quadmesh q = on_bowl(env), before = q;
    qw_fit_quads(env, &q, &(qw_fit){.tree = qw_bvh_build(env, &m), .strength = 1});
    assert_memory_equal(q.position, before.position, q.vertex_count * sizeof *q.position);
    qw_env_destroy(env);
}

QW_TEST_SUITE(fit)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quads_come_nearer),
        cmocka_unit_test(curves_stay_and_cuts_slide),
        cmocka_unit_test(what_is_far_moves_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

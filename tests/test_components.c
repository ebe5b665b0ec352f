/* Parts of a decimated complex by what they must share out; integers chosen component by component against those chosen
 * for the whole at once. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/closed.h"
#include "remesh/quantise/search.h"

enum { COMBS = 5 };

typedef struct split {
    qw_offset_mesh m;
    qw_real2 *closed;
    qw_decimated decimated;
    qw_components components;
} split;

static split split_of(qw_env *env, qw_trimesh mesh, float rho)
{
    split s = {.m = unit_solve(env, mesh, rho, true).offsets};
    float *stiffness = QW_NEW(env, float, s.m.edge_count);
    qw_closed_counts counts;
    s.closed = qw_closed_offsets(env, &s.m, 0, stiffness, &counts);
    s.decimated = qw_decimate(env, &s.m, s.closed);
    s.components = qw_split_components(env, &s.decimated, &s.m);
    return s;
}

/* Combs of different sizes. */
static qw_trimesh combs(qw_env *env)
{
    static const float scale[COMBS] = {1, 0.86f, 0.77f, 0.7f, 0.63f};
    qw_trimesh all = {0};
    for (int i = 0; i < COMBS; i++) {
        qw_trimesh comb = unit_slab(env, 5, 3, "#.#.##.#.######");
        for (int l = 0; l < 2; l++) comb = unit_quarter(env, &comb);
        for (uint32_t v = 0; v < comb.vertex_count; v++) comb.position[v] = qw_scale(comb.position[v], scale[i]);
        all = i ? unit_both(env, &all, &comb) : comb;
    }
    return all;
}

/* Each edge and triangle of the whole is in one component, as it was; what meets in the whole meets in the component.
 */
static void components_share_out_the_whole(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    split s = split_of(env, combs(env), 0.25f);
    const qw_complex *whole = &s.decimated.complex;
    assert_int_equal(s.components.count, COMBS);
    uint8_t *met = QW_NEW_ZERO(env, uint8_t, whole->edge_count);
    uint32_t faces = 0;
    for (uint32_t p = 0; p < COMBS; p++) {
        const qw_component *component = &s.components.component[p];
        const qw_complex *c = &component->decimated.complex;
        faces += c->face_count;
        for (uint32_t e = 0; e < c->edge_count; e++) {
            uint32_t w = component->edge[e];
            assert_false(met[w]);
            met[w] = 1;
            assert_true(c->real[e].x == whole->real[w].x && c->real[e].y == whole->real[w].y &&
                        c->fixed[e] == whole->fixed[w]);
            for (uint32_t i = 0; i < 2; i++) {
                uint32_t h = c->side[2 * e + i], of_whole = whole->side[2 * w + i];
                assert_int_equal(h == QW_NONE, of_whole == QW_NONE);
                if (h == QW_NONE) continue;
                assert_int_equal(c->edge[h], e);
                assert_int_equal(c->rot[h], whole->rot[of_whole]);
                assert_int_equal(s.components.of_vertex[s.decimated.corner[of_whole]], p);
                assert_true(component->decimated.corner[h] < component->vertex_count);
            }
        }
    }
    assert_int_equal(faces, whole->face_count);
    for (uint32_t e = 0; e < whole->edge_count; e++) assert_true(met[e]);
    qw_env_destroy(env);
}

static double score_of(const qw_search_result *r) { return r->rounding_cost + r->inverted + r->collapsed; }

/* The whole's integers are closed, come to the count and stay near the size asked for, with costs and faults about as
 * where one size is taken for all. */
static void components_do_as_well_as_the_whole(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    split s = split_of(env, combs(env), 0.25f);
    qw_complex c = s.decimated.complex;
    qw_component as_one = {
        .decimated = s.decimated, .vertex_count = s.m.vertex_count, .edge = QW_NEW(env, uint32_t, c.edge_count)};
    as_one.decimated.complex.weight = QW_NEW(env, float, c.edge_count);
    for (uint32_t e = 0; e < c.edge_count; e++) as_one.edge[e] = e, as_one.decimated.complex.weight[e] = 1;
    qw_components one = {1, &as_one, NULL};
    double cut[COMBS] = {0}, area = 0;
    for (uint32_t h = 0; h < 3 * c.face_count; h += 3) {
        qw_real2 a = qw_turn_real(c.rot[h], c.real[c.edge[h]]), b = qw_turn_real(c.rot[h + 1], c.real[c.edge[h + 1]]);
        area += ((double)a.x * (double)b.y - (double)a.y * (double)b.x) / 2;
    }
    double score = 0, score_as_one = 0;
    for (double quads = 60; quads < 5000; quads *= 1.17) {
        qw_scope_begin(env);
        c.d = QW_NEW(env, qw_int2, c.edge_count);
        qw_search_request request = {.quads = quads, .times = 1, .size = sqrt(quads / area), .effort = 1, .cut = cut};
        qw_search_result whole = qw_search_integers(env, &one, &request, c.d),
                         found = qw_search_integers(env, &s.components, &request, c.d);
        double sum = 0;
        for (uint32_t f = 0; f < c.face_count; f++) {
            assert_true(qw_int2_is_zero(qw_complex_residual(&c, f)));
            sum += (double)qw_int2_det(qw_turn(c.rot[3 * f], c.d[c.edge[3 * f]]),
                                       qw_turn(c.rot[3 * f + 1], c.d[c.edge[3 * f + 1]])) /
                   2;
        }
        if (fabs(sum / quads - 1) > (quads < 500 ? 0.05 : 0.02))
            fail_msg("%.0f quads asked for, %.0f found", quads, sum);
        for (uint32_t p = 0; p < COMBS; p++) assert_true(fabs(found.scale[p] / request.size - 1) < 0.031);
        score += score_of(&found), score_as_one += score_of(&whole);
        qw_scope_end(env);
    }
    assert_true(score < 1.05 * score_as_one);
    qw_env_destroy(env);
}

QW_TEST_SUITE(components)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(components_share_out_the_whole),
        cmocka_unit_test(components_do_as_well_as_the_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

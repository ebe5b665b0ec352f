/* Rounds that each lose another component's half: the best has all of both, whatever order a round's working mesh has
 * its components in. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quads/quad_components.h"
#include "remesh/quads/uncovered.h"
#include "remesh/quads/rounds.h"
#include "geometry/flips.h"

enum { AROUND = 24, ALONG = 12, FACES = AROUND * ALONG };

/* Two rings side by side; the working mesh is their quads cut in two. `second_first`: the one at x = 9 has the lower
 * numbers. */
typedef struct rings {
    qw_quadmesh quads;
    qw_trimesh working;
    uint8_t *flipped;
} rings;

static qw_quadmesh ring_at(qw_env *env, float x, uint32_t component)
{
    qw_quadmesh q = unit_quads(env, AROUND, ALONG, true, true);
    for (uint32_t v = 0; v < q.vertex_count; v++) q.position[v].x += x, q.component[v] = component;
    return q;
}

static rings rings_of(qw_env *env, bool second_first)
{
    qw_quadmesh a = ring_at(env, second_first ? 9 : 0, 0), b = ring_at(env, second_first ? 0 : 9, 1);
    static const uint8_t wanted[] = {1, 1};
    rings r = {.quads = qw_pick_components(env, &a, wanted, &b)};
    qw_append_quads(&r.quads, &b);
    r.flipped = QW_NEW_ZERO(env, uint8_t, r.quads.face_count);
    r.working = unit_mesh(env, r.quads.vertex_count, 2 * r.quads.face_count);
    memcpy(r.working.position, r.quads.position, r.quads.vertex_count * sizeof *r.quads.position);
    for (uint32_t f = 0; f < r.quads.face_count; f++) {
        const uint32_t *c = r.quads.corner + 4 * f;
        unit_face(&r.working, 2 * f, c[0], c[1], c[2]), unit_face(&r.working, 2 * f + 1, c[0], c[2], c[3]);
    }
    qw_trimesh_link(env, &r.working);
    return r;
}

/* The half of the ring near x that has y > 0.1 goes to one point. */
static void lose_half(rings *r, float x)
{
    for (uint32_t v = 0; v < r->quads.vertex_count; v++)
        if (fabsf(r->quads.position[v].x - x) < 4 && r->quads.position[v].y > 0.1f)
            r->quads.position[v] = qw_v3(x + 1.5f, 0, 0);
}

static qw_round round_of(const rings *r, const qw_trimesh *surface, double least, double most)
{
    return (qw_round){surface, &r->working, &r->quads, r->flipped, 0.4, 0.5f, least, most};
}

static bool covers_all(qw_env *env, const qw_trimesh *surface, const qw_quadmesh *quads)
{
    qw_halves halves = qw_halve_quads(env, quads);
    const uint8_t *uncovered = qw_mark_uncovered(env, surface, &halves, 0.5f);
    for (uint32_t v = 0; v < surface->vertex_count; v++)
        if (uncovered[v]) return false;
    return true;
}

static void takes_the_best_of_each_component(void **state)
{
    (void)state;
    for (int swapped = 0; swapped < 2; swapped++) {
        qw_env *env = qw_env_create(NULL, 2);
        qw_trimesh surface = rings_of(env, false).working;
        rings first = rings_of(env, false), second = rings_of(env, swapped);
        lose_half(&first, 9), lose_half(&second, 0);
        qw_rounds rounds = qw_rounds_begin(env);
        qw_round round = round_of(&first, &surface, 2 * FACES, 2 * FACES);
        qw_quadmesh best;
        uint8_t *flipped;
        qw_scope_begin(env);
        assert_true(qw_rounds_add(env, &rounds, &round, &best, &flipped));
        assert_false(covers_all(env, &surface, &best));
        float *size = QW_NEW(env, float, first.working.vertex_count);
        for (uint32_t v = 0; v < first.working.vertex_count; v++) size[v] = 0.4f;
        qw_sites uncovered = qw_rounds_uncovered(env, &rounds, &first.working, size, &best, 0.5f);
        assert_true(uncovered.count > 0);
        for (uint32_t i = 0; i < uncovered.count; i++) assert_true(uncovered.point[i].x > 4);
        qw_scope_end(env); /* the rounds stay */
        round = round_of(&second, &surface, 2 * FACES, 2 * FACES);
        assert_true(qw_rounds_add(env, &rounds, &round, &best, &flipped));
        assert_true(covers_all(env, &surface, &best));
        assert_int_equal(best.face_count, 2 * FACES);
        qw_quadmesh_validate(env, &best);
        assert_int_equal(qw_check_topology(env, &best, &second.working).broken_count,
                         0); /* numbered as its components are */
        for (uint32_t v = 0; v < best.vertex_count; v++)
            assert_int_equal(best.component[v], (best.position[v].x > 4) != swapped);
        assert_int_equal(qw_rounds_uncovered(env, &rounds, &second.working, size, &best, 0.5f).count, 0);
        qw_env_destroy(env);
    }
}

/* Quads that would be too many are not taken, and where nothing was lost in the first round there is nothing to choose
 * from. */
static void keeps_the_count(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh surface = rings_of(env, false).working;
    rings all = rings_of(env, false), first = rings_of(env, false);
    qw_rounds rounds = qw_rounds_begin(env);
    qw_quadmesh best;
    uint8_t *flipped;
    qw_round round = round_of(&all, &surface, 2 * FACES, 2 * FACES);
    assert_false(qw_rounds_add(env, &rounds, &round, &best, &flipped));
    assert_int_equal(rounds.count, 0);
    all.flipped[1] = QW_FLIPPED; /* but what is flipped in the first may be right in the next */
    assert_true(qw_rounds_add(env, &rounds, &round, &best, &flipped));
    assert_int_equal(rounds.count, 1);
    all.flipped[1] = 0;
    rounds = qw_rounds_begin(env);
    lose_half(&first, 9);
    round = round_of(&first, &surface, 2 * FACES, 2 * FACES);
    assert_true(qw_rounds_add(env, &rounds, &round, &best, &flipped));
    qw_quadmesh fine = unit_quads(env, 2 * AROUND, ALONG, true, true),
                coarse = ring_at(env, 0, 0); /* a round with more quads on the second ring, all of it there */
    static const uint8_t wanted[] = {1, 1};
    for (uint32_t v = 0; v < fine.vertex_count; v++) fine.position[v].x += 9, fine.component[v] = 1;
    all.quads = qw_pick_components(env, &coarse, wanted, &fine);
    qw_append_quads(&all.quads, &fine);
    all.flipped = QW_NEW_ZERO(env, uint8_t, all.quads.face_count);
    for (int more = 0; more < 2; more++) {
        qw_rounds again = rounds;
        round = round_of(&all, &surface, 2 * FACES, more ? 3 * FACES : 2 * FACES);
        assert_true(qw_rounds_add(env, &again, &round, &best, &flipped));
        assert_int_equal(best.face_count, more ? 3 * FACES : 2 * FACES);
        assert_int_equal(covers_all(env, &surface, &best), more);
        rounds = qw_rounds_begin(env);
        round = round_of(&first, &surface, 2 * FACES, 2 * FACES);
        assert_true(qw_rounds_add(env, &rounds, &round, &best, &flipped));
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(rounds)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(takes_the_best_of_each_component),
        cmocka_unit_test(keeps_the_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Places around which the lattice goes too few times: found on cones of valence 5 whose offsets were shifted and made
 * orientation-preserving again, and repaired there. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/offsets/subdivide.h"
#include "remesh/offsets/turning_numbers.h"
#include "solve/sat.h"

#include <cmocka.h>

enum { SECTORS = 5, SIDE = 6, ROUNDS = 4000 };

/* A vertex of a sector's quarter of a lattice, x and y from 0 to SIDE; what lies on its y axis is on the next one's x
 * axis. */
static uint32_t vertex_at(uint32_t sector, uint32_t x, uint32_t y)
{
    if (x == 0 && y == 0) return 0;
    if (x == 0) sector = (sector + 1) % SECTORS, x = y, y = 0;
    return 1 + (sector * SIDE + x - 1) * (SIDE + 1) + y;
}

typedef struct cone {
    qw_trimesh mesh;
    qw_int2 *along; /* [half-edges] in the frame of their sector */
} cone;

/* Two edges of the mesh are one of the lattice. */
static qw_int2 place_of(qw_int2 p) { return (qw_int2){(p.x + 1) / 2, (p.y + 1) / 2}; }

static void add_corner(cone *c, uint32_t f, uint32_t i, uint32_t sector, qw_int2 p, qw_int2 next)
{
    uint32_t h = 3 * f + i, v = vertex_at(sector, (uint32_t)p.x, (uint32_t)p.y);
    float angle = 6.2831853f * ((float)sector + atan2f((float)p.y, (float)p.x) / 1.5707963f) / SECTORS,
          r = hypotf((float)p.x, (float)p.y);
    c->mesh.corner[h] = v;
    c->mesh.position[v] = qw_v3(r * cosf(angle), r * sinf(angle), 0);
    c->along[h] = qw_int2_sub(place_of(next), place_of(p));
}

static cone make_cone(qw_env *env)
{
    cone c = {unit_mesh(env, 1 + SECTORS * SIDE * (SIDE + 1), 2 * SECTORS * SIDE * SIDE), NULL};
    c.along = QW_NEW(env, qw_int2, 3 * c.mesh.face_count);
    uint32_t f = 0;
    for (uint32_t s = 0; s < SECTORS; s++)
        for (int32_t x = 0; x < SIDE; x++)
            for (int32_t y = 0; y < SIDE; y++) {
                qw_int2 p[4] = {{x, y}, {x + 1, y}, {x + 1, y + 1}, {x, y + 1}};
                for (uint32_t half = 0; half < 2; half++, f++)
                    for (uint32_t i = 0; i < 3; i++) {
                        static const uint32_t corner[2][3] = {{0, 1, 2}, {0, 2, 3}};
                        add_corner(&c, f, i, s, p[corner[half][i]], p[corner[half][(i + 1) % 3]]);
                    }
            }
    qw_trimesh_link(env, &c.mesh);
    return c;
}

static uint32_t sector_of(uint32_t h) { return h / 3 / (2 * SIDE * SIDE); }

static qw_offset_mesh cone_offsets(qw_env *env, const cone *c)
{
    qw_offset_mesh m = unit_offsets(env, &c->mesh, NULL, NULL);
    for (uint32_t e = 0; e < m.edge_count; e++) m.d[e] = qw_turn(4u - m.rot[m.half[e]], c->along[m.half[e]]);
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        uint32_t own = sector_of(m.half[m.edge[h]]),
                 here = sector_of(h); /* the next sector's frame is a quarter turn ahead */
        m.rot[h] = (m.rot[h] + (own == here ? 0u : (here + 1) % SECTORS == own ? 1u : 3u)) & 3u;
        assert_true(qw_int2_is_zero(qw_int2_sub(qw_offset_along(&m, h), c->along[h])));
    }
    m.index[0] = -1;
    return m;
}

/* Shifts the corners of some sectors next to the cone by one step together; what gets long is split. */
static void shift(qw_env *env, qw_offset_mesh *m, unit_rng *r)
{
    static const qw_int2 steps[8] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
    uint32_t *out = qw_offset_outgoing(env, m), first = unit_random(r, SECTORS), wide = 1 + unit_random(r, 3),
             step = unit_random(r, 8);
    uint32_t reach = 1 + unit_random(r, 3);
    uint8_t *moved = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    qw_star star = {0};
    for (uint32_t k = 0; k < wide; k++)
        for (uint32_t x = 0; x <= reach; x++)
            for (uint32_t y = 0; y <= reach; y++) {
                uint32_t v = vertex_at((first + k) % SECTORS, x, y);
                if (v == 0 || moved[v]) continue;
                moved[v] = 1;
                qw_star_at(env, m, out[v], &star);
                uint32_t sector = sector_of(star.out[0]),
                         turns = (sector + SECTORS - first + 1) % SECTORS; /* from the one before the first */
                qw_star_move(m, &star, qw_turn(8u - turns, steps[step]));
            }
}

static void turning_numbers_are_repaired(void **state)
{
    (void)state;
    if (!qw_sat_available()) skip();
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {7};
    uint32_t found = 0, repaired = 0;
    for (int round = 0; round < ROUNDS; round++) {
        qw_scope_begin(env);
        cone c = make_cone(env);
        qw_offset_mesh m = cone_offsets(env, &c);
        uint8_t *mark = QW_NEW(env, uint8_t, m.vertex_count);
        assert_int_equal(qw_find_low_turning_numbers(env, &m, mark), 0);
        shift(env, &m, &r);
        if (round % 2) shift(env, &m, &r);
        qw_subdivide_long_edges(env, &m);
        mark = QW_NEW(env, uint8_t, m.vertex_count);
        qw_inversion_counts counts = {0};
        qw_remove_inversions_greedy(env, &m, &counts);
        qw_remove_inversions_sat(env, &m, QW_SAT_FAR, &counts);
        uint32_t before = counts.inverted_after ? 0 : qw_find_low_turning_numbers(env, &m, mark);
        if (before > 0) {
            uint32_t after = qw_repair_turning_numbers(env, &m, &counts);
            qw_offset_counts left = qw_offset_count(&m);
            qw_offset_validate(env, &m);
            assert_int_equal(left.inverted_triangles + left.irregular_triangles + left.long_edges, 0);
            assert_true(after <= before);
            assert_int_equal(qw_find_low_turning_numbers(env, &m, mark), after);
            found += before, repaired += before - after;
        }
        qw_scope_end(env);
    }
    print_message("%u places wound too little, %u repaired\n", found, repaired);
    assert_true(found > 10);
    assert_true(2 * repaired > found);
    qw_env_destroy(env);
}

QW_TEST_SUITE(turning_numbers)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(turning_numbers_are_repaired)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

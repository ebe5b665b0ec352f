/* Adjacency, census and normals on small surfaces; the validator against each invariant broken by hand. */
#include "random.h"
#include "suite.h"
#include "geometry/edges.h"
#include "geometry/trimesh.h"

#include "base/sort.h"
#include "remesh/sizes/needs.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* A tetrahedron, outward; and a disc of four triangles around vertex 4. */
static const uint32_t tetra[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
static const uint32_t disc[] = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4};
static const float tetra_position[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const float disc_position[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5f, 0.5f, 0};

static qw_trimesh copy(qw_env *env, const uint32_t *corner, uint32_t faces, const float *position, uint32_t vertices)
{
    qw_trimesh m = {.vertex_count = vertices, .face_count = faces};
    m.position = QW_NEW(env, qw_vec3, vertices);
    m.corner = QW_NEW(env, uint32_t, 3 * faces);
    memcpy(m.position, position, vertices * sizeof(qw_vec3));
    memcpy(m.corner, corner, 3 * faces * sizeof(uint32_t));
    return m;
}

static qw_trimesh linked_tetra(qw_env *env)
{
    qw_trimesh m = copy(env, tetra, 4, tetra_position, 4);
    qw_trimesh_link(env, &m);
    return m;
}

static qw_trimesh linked_disc(qw_env *env)
{
    qw_trimesh m = copy(env, disc, 4, disc_position, 5);
    qw_trimesh_link(env, &m);
    return m;
}

typedef struct call {
    qw_env *env;
    qw_trimesh *mesh;
} call;

static void validate(void *user)
{
    call *c = user;
    qw_trimesh_validate(c->env, c->mesh);
}

static void link_mesh(void *user)
{
    call *c = user;
    qw_trimesh_link(c->env, c->mesh);
}

static void expect(qw_env *env, qw_trimesh *m, void (*body)(void *user), qw_status status, int64_t element)
{
    call c = {.env = env, .mesh = m};
    assert_int_equal(qw_protect(env, body, &c), status);
    if (status != QW_OK) assert_int_equal(qw_env_element(env), element);
}

static void sorts(void **state)
{
    (void)state;
    uint64_t x[300], seed = 1;
    for (size_t n = 0; n <= 300; n++) {
        uint64_t sum = 0, sum_after = 0;
        for (size_t i = 0; i < n; i++) {
            random_step(&seed);
            sum += x[i] = seed >> (n % 60);
        }
        qw_sort_u64(x, n);
        for (size_t i = 0; i < n; i++) {
            sum_after += x[i];
            if (i > 0) assert_true(x[i - 1] <= x[i]);
        }
        assert_true(sum == sum_after);
    }
}

/* Rising, falling, equal, and what splits badly where the middle of three items is taken (Musser 1997). */
static void sorts_in_order(void **state)
{
    (void)state;
    enum { COUNT = 4000, HALF = COUNT / 2 };
    static uint64_t x[COUNT];
    for (int kind = 0; kind < 4; kind++) {
        bool seen[COUNT + 1] = {false};
        for (uint64_t i = 0; i < COUNT; i++) {
            uint64_t bad = i < HALF ? (i % 2 ? HALF + i + (HALF % 2) : i + 1) : 2 * (i - HALF + 1);
            x[i] = kind == 0 ? i : kind == 1 ? COUNT - i : kind == 2 ? 7 : bad;
        }
        qw_sort_u64(x, COUNT);
        for (uint64_t i = 0; i < COUNT; i++) {
            assert_true(i == 0 || x[i - 1] <= x[i]);
            assert_true(x[i] <= COUNT && (kind == 2 || !seen[x[i]]));
            seen[x[i]] = true;
        }
    }
}

static void groups_sides_by_edge(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    const uint32_t corner[] = {0, 1, 2, 1, 0, 3, 0, 1, 4, 2, 2, 0};
    qw_edges e = qw_edges_build(env, 3, corner, 4, 5);
    assert_int_equal(e.begin[5], 9); /* the last face repeats a vertex */
    assert_int_equal(qw_edge_end(&e, e.begin[0], e.begin[1]) - e.begin[0], 3);
    assert_int_equal(qw_side_upper(e.side[0]), 1);
    assert_int_equal(qw_side_half(e.side[0]), 0);
    assert_int_equal(qw_side_half(e.side[1]), 3);
    assert_int_equal(qw_side_half(e.side[2]), 6);
    qw_env_destroy(env);
}

static void links(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = linked_tetra(env);
    for (uint32_t h = 0; h < 12; h++) {
        assert_int_equal(m.twin[m.twin[h]], h);
        assert_int_equal(m.corner[m.twin[h]], m.corner[qw_next(h)]);
        assert_int_equal(qw_prev(qw_next(h)), h);
    }
    expect(env, &m, validate, QW_OK, 0);
    qw_trimesh d = linked_disc(env);
    for (uint32_t f = 0; f < 4; f++) assert_int_equal(d.twin[3 * f], QW_NONE);
    expect(env, &d, validate, QW_OK, 0);
    qw_env_destroy(env);
}

static void refuses_to_link(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    static const uint32_t three[] = {0, 1, 2, 1, 0, 3, 0, 1, 4}, same[] = {0, 1, 2, 0, 1, 3}, repeat[] = {0, 1, 1};
    qw_trimesh m = copy(env, three, 3, disc_position, 5);
    expect(env, &m, link_mesh, QW_INTERNAL, 0);
    m = copy(env, same, 2, disc_position, 4);
    expect(env, &m, link_mesh, QW_INTERNAL, 0);
    m = copy(env, repeat, 1, disc_position, 2);
    expect(env, &m, link_mesh, QW_INTERNAL, 0);
    qw_env_destroy(env);
}

static void validator_sees_broken_half_edges(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = linked_tetra(env);
    m.corner[4] = 4;
    expect(env, &m, validate, QW_INTERNAL, 1);
    m = linked_tetra(env);
    m.corner[1] = m.corner[0];
    expect(env, &m, validate, QW_INTERNAL, 0);
    assert_non_null(strstr(qw_env_message(env), "repeats"));
    m = linked_tetra(env);
    m.twin[2] = 12;
    expect(env, &m, validate, QW_INTERNAL, 2);
    m = linked_tetra(env);
    m.twin[m.twin[5]] = QW_NONE; /* one-sided */
    qw_status status = qw_protect(env, validate, &(call){env, &m});
    assert_int_equal(status, QW_INTERNAL);
    m = linked_disc(env);
    m.twin[0] = 3; /* mutual, but not the same edge */
    m.twin[3] = 0;
    expect(env, &m, validate, QW_INTERNAL, 0);
    m = linked_tetra(env);
    m.mark = QW_NEW_ZERO(env, uint8_t, 12);
    expect(env, &m, validate, QW_OK, 0);
    m.mark[0] = QW_MARK_FEATURE;
    expect(env, &m, validate, QW_INTERNAL, 0);
    m.mark[m.twin[0]] = QW_MARK_FEATURE;
    expect(env, &m, validate, QW_OK, 0);
    qw_env_destroy(env);
}

static void validator_sees_broken_vertices(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    static const uint32_t bow_tie[] = {0, 1, 2, 2, 3, 4};
    qw_trimesh m = copy(env, bow_tie, 2, disc_position, 5);
    qw_trimesh_link(env, &m);
    expect(env, &m, validate, QW_INTERNAL, 2);
    static const uint32_t lonely[] = {0, 1, 3};
    m = copy(env, lonely, 1, disc_position, 4);
    qw_trimesh_link(env, &m);
    expect(env, &m, validate, QW_INTERNAL, 2);
    m = linked_tetra(env);
    m.position[1].y = NAN;
    expect(env, &m, validate, QW_INTERNAL, 1);
    /* Two triangles glued along two sides: edges 0-1 of both are different edges between the same vertices. */
    static const uint32_t facing[] = {0, 1, 2, 1, 0, 2};
    m = copy(env, facing, 2, disc_position, 3);
    qw_trimesh_link(env, &m);
    m.twin[0] = m.twin[3] = QW_NONE;
    expect(env, &m, validate, QW_INTERNAL, 0);
    qw_env_destroy(env);
}

static void takes_a_census(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = linked_tetra(env);
    qw_census c = qw_trimesh_census(env, &m);
    assert_int_equal(c.edges, 6);
    assert_int_equal(c.euler, 2);
    assert_int_equal(c.components, 1);
    assert_int_equal(c.boundary_loops, 0);
    assert_true(qw_faces_needed(env, &m, &c) == 6);
    m = linked_disc(env);
    c = qw_trimesh_census(env, &m);
    assert_int_equal(c.edges, 8);
    assert_int_equal(c.euler, 1);
    assert_int_equal(c.boundary_loops, 1);
    /* A ring of eight triangles, and a lone one. */
    uint32_t ring[27];
    float position[33] = {0};
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t j = (i + 1) % 4;
        const uint32_t two[] = {i, j, 4 + i, 4 + i, j, 4 + j};
        memcpy(ring + 6 * i, two, sizeof two);
    }
    ring[24] = 8, ring[25] = 9, ring[26] = 10;
    m = copy(env, ring, 9, position, 11);
    qw_trimesh_link(env, &m);
    c = qw_trimesh_census(env, &m);
    assert_int_equal(c.components, 2);
    assert_int_equal(c.boundary_loops, 3);
    assert_int_equal(c.euler, 1);
    assert_int_equal(c.component[0], 0);
    assert_int_equal(c.component[7], 0);
    assert_int_equal(c.component[8], 1);
    assert_true(qw_faces_needed(env, &m, &c) == 4); /* three around the ring, and one */
    /* A torus of seven vertices; quads need five. */
    uint32_t torus[42];
    for (uint32_t i = 0; i < 7; i++) {
        const uint32_t two[] = {i, (i + 1) % 7, (i + 3) % 7, i, (i + 3) % 7, (i + 2) % 7};
        memcpy(torus + 6 * i, two, sizeof two);
    }
    m = copy(env, torus, 14, position, 7);
    qw_trimesh_link(env, &m);
    c = qw_trimesh_census(env, &m);
    assert_int_equal(c.euler, 0);
    assert_true(qw_faces_needed(env, &m, &c) == 5);
    qw_env_destroy(env);
}

static void goes_around_vertices(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = linked_disc(env);
    const uint32_t *outgoing = qw_trimesh_outgoing(env, &m);
    for (uint32_t v = 0; v < 4; v++) {
        assert_int_equal(m.twin[outgoing[v]], QW_NONE);
        uint32_t second = qw_around(&m, outgoing[v]);
        assert_int_equal(m.corner[second], v);
        assert_int_equal(m.corner[qw_next(second)], 4);
        assert_int_equal(qw_around(&m, second), QW_NONE);
    }
    uint32_t h = outgoing[4], count = 0, met = 0;
    do {
        uint32_t w = m.corner[qw_next(h)];
        met |= 1u << w;
        h = qw_around(&m, h);
        assert_int_equal(m.corner[qw_next(h)], (w + 1) % 4); /* counter-clockwise */
        count++;
    } while (h != outgoing[4]);
    assert_int_equal(count, 4);
    assert_int_equal(met, 15);
    qw_env_destroy(env);
}

static void computes_normals(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = linked_disc(env);
    assert_float_equal(qw_trimesh_area(&m), 1, 1e-6);
    const qw_vec3 *f = qw_face_normals(env, &m), *v = qw_vertex_normals(env, &m);
    for (int i = 0; i < 4; i++) assert_float_equal(f[i].z, 1, 1e-6);
    for (int i = 0; i < 5; i++) assert_float_equal(v[i].z, 1, 1e-6);
    m.position[4] = qw_v3(0.5f, 0, 0); /* the first face is flat now */
    f = qw_face_normals(env, &m);
    assert_float_equal(qw_length(f[0]), 0, 0);
    m = linked_tetra(env);
    v = qw_vertex_normals(env, &m);
    qw_vec3 corner = qw_normalize(qw_v3(-1, -1, -1));
    assert_float_equal(qw_distance(v[0], corner), 0, 1e-6);
    qw_env_destroy(env);
}

/* The angle does not depend on how long the sides are, down to where the square of their cross product is below what
   single precision holds: needles have such corners. */
static void angles_of_short_sides(void **state)
{
    (void)state;
    for (float length = 1; length > 1e-15f; length *= 0.01f) {
        qw_vec3 o = qw_v3(0, 0, 0), a = qw_v3(length, 0, 0), b = qw_v3(0, length, 0), c = qw_v3(-length, length, 0);
        assert_true(fabs(qw_angle_at(o, a, b) - 1.5707963) < 1e-6 && fabs(qw_angle_at(o, a, c) - 2.3561945) < 1e-6);
    }
}

QW_TEST_SUITE(trimesh)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(angles_of_short_sides),
        cmocka_unit_test(sorts),
        cmocka_unit_test(sorts_in_order),
        cmocka_unit_test(groups_sides_by_edge),
        cmocka_unit_test(links),
        cmocka_unit_test(refuses_to_link),
        cmocka_unit_test(validator_sees_broken_half_edges),
        cmocka_unit_test(validator_sees_broken_vertices),
        cmocka_unit_test(takes_a_census),
        cmocka_unit_test(goes_around_vertices),
        cmocka_unit_test(computes_normals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

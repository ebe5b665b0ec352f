/* Protrusions that grow out of a flat sheet of quads: spikes of a plane that the quads know nothing of. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quads/protrusions.h"

enum { SIDE = 8, FINE = 80 };
static const float HEIGHT = 4, RADIUS = 0.45f;

static float spike(float x, float y, float at_x, float at_y)
{
    return fmaxf(0, HEIGHT * (1 - hypotf(x - at_x, y - at_y) / RADIUS));
}

/* A plane of SIDE by SIDE with a spike at (x, y) and another at (x + 3, y), on a fine grid. */
static qw_trimesh spiked(qw_env *env, float x, float y)
{
    qw_trimesh m = unit_grid(env, FINE, FINE, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        qw_vec3 *p = &m.position[v];
        *p = qw_v3(p->x * SIDE, p->y * SIDE, 0);
        p->z = spike(p->x, p->y, x, y) + spike(p->x, p->y, x + 3, y);
    }
    return m;
}

static qw_quadmesh sheet(qw_env *env) { return unit_quads(env, SIDE, SIDE, false, false); }

static uint32_t grow(qw_env *env, qw_quadmesh *quads, const qw_trimesh *surface, bool marked, uint32_t most)
{
    qw_growth growth = {.surface = surface, .edge = 1, .far = 1.5f, .marked = marked, .most = most};
    return qw_extrude_protrusions(env, quads, &growth);
}

static float distance_to(const qw_quadmesh *q, qw_vec3 p)
{
    float least = INFINITY;
    for (uint32_t v = 0; v < q->vertex_count; v++) least = fminf(least, qw_distance(q->position[v], p));
    return least;
}

static void two_spikes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh surface = spiked(env, 2.5f, 4.3f);
    qw_quadmesh quads = sheet(env), grown = quads;
    qw_quad_census before = qw_quadmesh_census(env, &quads);
    assert_int_equal(grow(env, &grown, &surface, false, 200), 2);
    qw_quadmesh_validate(env, &grown);
    qw_quad_census after = qw_quadmesh_census(env, &grown);
    assert_int_equal(after.components, before.components);
    assert_int_equal(after.euler, before.euler);
    assert_int_equal(after.boundary_loops, before.boundary_loops);
    assert_int_equal(after.degenerate_faces, 0);
    assert_int_equal(after.double_edges, 0);
    assert_int_equal(after.irregular, 16); /* four at the foot of each and four at its tip */
    uint32_t added = grown.face_count - quads.face_count;
    assert_int_equal(added, grown.vertex_count - quads.vertex_count);
    assert_true(added % 8 == 0 && added >= 24 && added <= 64);
    for (uint32_t v = quads.vertex_count; v < grown.vertex_count;
         v++) { /* on the surface, as closely as its grid follows the spike */
        qw_vec3 p = grown.position[v];
        assert_true(fabsf(p.z - spike(p.x, p.y, 2.5f, 4.3f) - spike(p.x, p.y, 5.5f, 4.3f)) < 0.6f);
    }
    assert_true(distance_to(&grown, qw_v3(2.5f, 4.3f, HEIGHT)) < 0.8f);
    assert_true(distance_to(&grown, qw_v3(5.5f, 4.3f, HEIGHT)) < 0.8f);
    for (uint32_t f = quads.face_count; f < grown.face_count;
         f++) { /* outside is outside: sides look away from the axis */
        const uint32_t *c = grown.corner + 4 * f;
        qw_vec3 p = qw_lerp(grown.position[c[0]], grown.position[c[2]], 0.5f),
                axis = qw_v3(p.x < 4 ? 2.5f : 5.5f, 4.3f, p.z);
        assert_true(qw_dot(qw_quad_normal(&grown, f), qw_sub(p, axis)) > 0);
    }
    assert_int_equal(grow(env, &grown, &surface, false, 200), 0); /* nothing is left uncovered any more */
    qw_env_destroy(env);
}

static qw_trimesh both(qw_env *env, const qw_trimesh *a, const qw_trimesh *b)
{
    qw_trimesh m = unit_mesh(env, a->vertex_count + b->vertex_count, a->face_count + b->face_count);
    memcpy(m.position, a->position, a->vertex_count * sizeof *m.position);
    memcpy(m.position + a->vertex_count, b->position, b->vertex_count * sizeof *m.position);
    for (uint32_t h = 0; h < 3 * m.face_count; h++)
        m.corner[h] = h < 3 * a->face_count ? a->corner[h] : b->corner[h - 3 * a->face_count] + a->vertex_count;
    qw_trimesh_link(env, &m);
    return m;
}

/* The spikes go through another sheet, whose quads are nearer to what is left uncovered: they grow out of their own. */
static void through_another(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh ground = spiked(env, 2.5f, 4.3f), skin = unit_grid(env, FINE, FINE, false, false);
    for (uint32_t v = 0; v < skin.vertex_count; v++)
        skin.position[v] = qw_v3(skin.position[v].x * SIDE, skin.position[v].y * SIDE, 0.4f);
    qw_trimesh surface = both(env, &ground, &skin);
    qw_quadmesh lower = sheet(env), upper = sheet(env), quads = lower;
    uint32_t n = lower.vertex_count, f = lower.face_count;
    quads.vertex_count = 2 * n, quads.face_count = 2 * f;
    quads.position = QW_NEW(env, qw_vec3, 2 * n), quads.kind = QW_NEW_ZERO(env, uint8_t, 2 * n),
    quads.component = QW_NEW(env, uint32_t, 2 * n);
    quads.corner = QW_NEW(env, uint32_t, 8 * f), quads.twin = QW_NEW(env, uint32_t, 8 * f),
    quads.mark = QW_NEW_ZERO(env, uint8_t, 8 * f);
    for (uint32_t v = 0; v < n; v++) {
        quads.position[v] = lower.position[v], quads.position[n + v] = qw_add(upper.position[v], qw_v3(0, 0, 0.4f));
        quads.component[v] = 0, quads.component[n + v] = 1;
    }
    for (uint32_t h = 0; h < 4 * f; h++) {
        quads.corner[h] = lower.corner[h], quads.corner[4 * f + h] = upper.corner[h] + n;
        quads.twin[h] = lower.twin[h],
        quads.twin[4 * f + h] = upper.twin[h] == QW_NONE ? QW_NONE : upper.twin[h] + 4 * f;
    }
    qw_quadmesh grown = quads;
    assert_int_equal(grow(env, &grown, &surface, false, 200), 2);
    qw_quadmesh_validate(env, &grown);
    for (uint32_t v = 2 * n; v < grown.vertex_count; v++) assert_int_equal(grown.component[v], 0);
    for (uint32_t h = 4 * f; h < 8 * f; h++) assert_int_equal(grown.corner[h], quads.corner[h]);
    qw_env_destroy(env);
}

static void room_for_fewer(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh surface = spiked(env, 2.5f, 4.3f);
    static const uint32_t room[][3] = {{0, 0, 0}, {3, 0, 0}, {4, 1, 4}, {11, 1, 8}}; /* room, protrusions, quads */
    for (size_t i = 0; i < sizeof room / sizeof *room; i++) {
        qw_quadmesh grown = sheet(env);
        uint32_t before = grown.face_count;
        assert_int_equal(grow(env, &grown, &surface, false, room[i][0]), room[i][1]);
        assert_int_equal(grown.face_count - before, room[i][2]);
        qw_quadmesh_validate(env, &grown);
    }
    qw_env_destroy(env);
}

/* A spike that the border cuts, and spikes with a sharp edge. */
static void not_at_curves(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh cut = spiked(env, 8, 4.3f), sharp = spiked(env, 2.5f, 4.3f);
    qw_quadmesh grown = sheet(env);
    assert_int_equal(grow(env, &grown, &cut, false, 200), 0);
    uint32_t h = 0;
    while (qw_distance(sharp.position[sharp.corner[h]], qw_v3(2.5f, 4.3f, HEIGHT)) > 1) h++;
    sharp.mark[h] = sharp.mark[sharp.twin[h]] = QW_MARK_FEATURE;
    assert_int_equal(grow(env, &grown, &sharp, false, 200), 1);
    grown = sheet(env);
    assert_int_equal(grow(env, &grown, &sharp, true, 200), 1); /* the other */
    qw_env_destroy(env);
}

/* What is a tube from one border to the other, or closed by itself, is no protrusion. */
static void not_what_is_no_disc(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh others[2] = {unit_sphere(env, 3), unit_torus(env, 24, 16, 0.3f)};
    for (int i = 0; i < 2; i++) {
        for (uint32_t v = 0; v < others[i].vertex_count; v++)
            others[i].position[v] = qw_add(others[i].position[v], qw_v3(0, 0, 20));
        qw_quadmesh grown = sheet(env);
        assert_int_equal(grow(env, &grown, &others[i], false, 200), 0);
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(grow)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_spikes),    cmocka_unit_test(through_another),     cmocka_unit_test(room_for_fewer),
        cmocka_unit_test(not_at_curves), cmocka_unit_test(not_what_is_no_disc),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The connection Laplacian against what it must be on any level, the field that is solved on it, normals at the scale
 * of the quads, and corners too sharp for a cross. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/field/connection.h"
#include "remesh/field/curvature_diffusion.h"

static const double PI = 3.14159265358979;

static float *all(qw_env *env, uint32_t n, float x)
{
    float *list = QW_NEW(env, float, n);
    for (uint32_t v = 0; v < n; v++) list[v] = x;
    return list;
}

typedef struct posed {
    qw_hierarchy hierarchy;
    qw_connection connection;
} posed;

static posed *pose(qw_env *env, const qw_trimesh *mesh, bool constrained)
{
    posed *p = QW_NEW(env, posed, 1);
    uint8_t *constraint = NULL;
    qw_vec3 *direction = NULL;
    if (constrained) qw_find_constraints(env, mesh, true, 0.7, NULL, NULL, &constraint, &direction);
    p->hierarchy = qw_hierarchy_build(env, mesh, qw_vertex_normals(env, mesh), constraint, direction);
    p->connection = qw_connection_build(env, &p->hierarchy, NULL, NULL, 0, NULL);
    return p;
}

static qw_phasor random_unit(unit_rng *r)
{
    double t = PI * unit_real(r);
    return (qw_phasor){(float)cos(t), (float)sin(t)};
}

/* What going there and back turns by is nothing. */
static void is_hermitian(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_cube(env, 4), unit_cylinder(env, 60, 40, 2)};
    for (int m = 0; m < 3; m++) {
        const qw_connection *c = &pose(env, &meshes[m], m > 0)->connection;
        assert_true(c->level_count > 4);
        for (uint32_t l = 0; l < c->level_count; l++) {
            const qw_level *g = c->level[l].level;
            const qw_phasor *link = c->level[l].link;
            for (uint32_t v = 0; v < g->vertex_count; v++)
                for (uint32_t i = g->begin[v]; i < g->begin[v + 1]; i++) {
                    uint32_t u = g->neighbour[i], j = g->begin[u];
                    while (g->neighbour[j] != v) j++;
                    float tolerance = 1e-4f * (1 + g->weight[i]);
                    assert_true(fabsf(link[i].re - link[j].re) < tolerance &&
                                fabsf(link[i].im + link[j].im) < tolerance);
                    if (l == 0) assert_true(hypotf(link[i].re, link[i].im) < 1.0001f);
                }
        }
    }
    qw_env_destroy(env);
}

/* Carrying a cross around every triangle of a closed surface turns it by the total curvature, 2 pi times Euler's
   number, four times over. */
static void turns_by_the_curvature(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_torus(env, 70, 30, 0.4f), unit_double_torus(env, 4)};
    const double euler[] = {2, 0, -2};
    for (int m = 0; m < 3; m++) {
        const qw_connection_level *c = &pose(env, &meshes[m], false)->connection.level[0];
        double sum = 0;
        for (uint32_t f = 0; f < meshes[m].face_count; f++) {
            qw_phasor turn = {1, 0};
            for (uint32_t h = 3 * f; h < 3 * f + 3; h++) { /* from the tail of h to its head */
                uint32_t u = meshes[m].corner[h], v = meshes[m].corner[qw_next(h)], i = c->level->begin[v];
                while (c->level->neighbour[i] != u) i++;
                turn = qw_phasor_mul(turn, c->link[i]);
            }
            sum += atan2(turn.im, turn.re);
        }
        if (m < 2) assert_float_equal(sum, 8 * PI * euler[m], 1e-2);
        /* at the slab's edges a triangle holds more curvature than a turn shows */
        assert_float_equal(remainder(sum, 2 * PI), 0, 1e-2);
    }
    qw_env_destroy(env);
}

/* The energy of a coarse level is the energy below it of the crosses that it stands for. */
static void coarse_energy_is_exact(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {7};
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_cube(env, 4), unit_cylinder(env, 60, 40, 2)};
    for (int m = 0; m < 3; m++) {
        const qw_connection *c = &pose(env, &meshes[m], m > 0)->connection;
        for (uint32_t l = 0; l + 1 < c->level_count; l++) {
            const qw_connection_level *fine = &c->level[l], *coarse = &c->level[l + 1];
            uint32_t n = fine->level->vertex_count, k = coarse->level->vertex_count;
            qw_phasor *z = QW_NEW(env, qw_phasor, k), *below = QW_NEW(env, qw_phasor, n);
            for (uint32_t v = 0; v < k; v++) z[v] = random_unit(&r);
            for (uint32_t v = 0; v < n; v++)
                below[v] = fine->diagonal[v] > 0 ? qw_phasor_mul(fine->along[v], z[fine->level->parent[v]])
                                                 : (qw_phasor){1, 0};
            double a = qw_connection_energy(fine, below), b = qw_connection_energy(coarse, z);
            assert_true(fabs(a - b) < 1e-3 * (1 + fabs(a)));
        }
    }
    qw_env_destroy(env);
}

static qw_phasor *as_complex(qw_env *env, const qw_connection *c, const qw_vec3 *o)
{
    const qw_level *level = c->level[0].level;
    qw_phasor *z = QW_NEW(env, qw_phasor, level->vertex_count);
    for (uint32_t v = 0; v < level->vertex_count; v++) {
        z[v] = (qw_phasor){qw_dot(o[v], c->axis[v]), qw_dot(o[v], qw_cross(level->normal[v], c->axis[v]))};
        for (int i = 0; i < 2; i++) z[v] = qw_phasor_mul(z[v], z[v]);
        if (c->level[0].diagonal[v] == 0) z[v] = (qw_phasor){1, 0};
    }
    return z;
}

/* Gauss-Seidel on the finest level alone, from chance. */
static qw_phasor *single_level(qw_env *env, const qw_connection_level *c, unit_rng *r, int sweeps)
{
    uint32_t n = c->level->vertex_count;
    qw_phasor *z = QW_NEW(env, qw_phasor, n);
    for (uint32_t v = 0; v < n; v++) z[v] = c->diagonal[v] > 0 ? random_unit(r) : (qw_phasor){1, 0};
    for (int s = 0; s < sweeps; s++)
        for (uint32_t v = 0; v < n; v++) {
            if (c->diagonal[v] == 0) continue;
            qw_phasor sum = c->pull[v];
            for (uint32_t i = c->level->begin[v]; i < c->level->begin[v + 1]; i++)
                sum = qw_phasor_add(sum, qw_phasor_mul(c->link[i], z[c->level->neighbour[i]]));
            z[v] = qw_phasor_unit(sum);
        }
    return z;
}

static void levels_find_less_energy(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {11};
    qw_trimesh meshes[] = {unit_sphere(env, 5), unit_torus(env, 110, 50, 0.4f), unit_cube(env, 4)};
    for (int m = 0; m < 3; m++) {
        posed *p = pose(env, &meshes[m], m == 2);
        const qw_connection_level *c = &p->connection.level[0];
        double solved = qw_connection_energy(
            c, as_complex(env, &p->connection, qw_orientation_field(env, &p->hierarchy, NULL, NULL, 0, NULL, 0)));
        for (int i = 0; i < 3; i++) assert_true(solved <= qw_connection_energy(c, single_level(env, c, &r, 60)) + 1e-3);
    }
    qw_env_destroy(env);
}

/* No field on these has fewer singularities: eight of a quarter turn on a sphere and at the corners of a cube, none on
 * a torus. */
static void singularities_are_fewest(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh meshes[] = {unit_sphere(env, 5), unit_torus(env, 110, 36, 0.3f), unit_cube(env, 4)};
    const int64_t fewest[] = {8, 0, 8};
    for (int m = 0; m < 3; m++) {
        unit_fields u = unit_solve(env, meshes[m], 0.15f, true);
        assert_int_equal(qw_offset_count(&u.offsets).singular_vertices, fewest[m]);
    }
    qw_env_destroy(env);
}

static void same_on_any_threads(void **state)
{
    (void)state;
    static const uint32_t threads[] = {1, 2, 3, 8};
    qw_vec3 *first = NULL;
    for (int t = 0; t < 4; t++) {
        qw_env *env = qw_env_create(NULL, threads[t]);
        qw_trimesh m = unit_torus(env, 160, 90, 0.4f);
        qw_vec3 *normal = qw_vertex_normals(env, &m);
        qw_smooth_normals(env, &m, NULL, 0.1f, normal, NULL);
        qw_hierarchy h = qw_hierarchy_build(env, &m, normal, NULL, NULL);
        float *turn = qw_diffuse_curvature(env, &m, &h.level[0], all(env, m.vertex_count, 0.2f), NULL);
        qw_vec3 *o = qw_orientation_field(env, &h, turn, NULL, 0, NULL, 5);
        size_t bytes = m.vertex_count * sizeof *o;
        if (t == 0) memcpy(first = malloc(2 * bytes), normal, bytes), memcpy(first + m.vertex_count, o, bytes);
        assert_memory_equal(first, normal, bytes);
        assert_memory_equal(first + m.vertex_count, o, bytes);
        qw_env_destroy(env);
    }
    free(first);
}

/* Over a time in which heat crosses the surface many times, all normals of a rough plane become one. */
static void normals_reach_far(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {5};
    qw_trimesh m = unit_grid(env, 60, 60, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        m.position[v].z = 0.1f * m.position[v].x * m.position[v].x + 0.005f * unit_real(&r);
    qw_vec3 *normal = qw_vertex_normals(env, &m);
    qw_smooth_normals(env, &m, NULL, 5, normal, NULL);
    for (uint32_t v = 0; v < m.vertex_count; v++) assert_true(qw_distance(normal[v], normal[0]) < 0.02f);
    qw_env_destroy(env);
}

/* ---- curvature diffused */

static qw_level finest(qw_env *env, const qw_trimesh *m, bool constrained)
{
    uint8_t *constraint = NULL;
    qw_vec3 *direction = NULL;
    if (constrained) qw_find_constraints(env, m, true, 0.7, NULL, NULL, &constraint, &direction);
    return qw_hierarchy_build(env, m, qw_vertex_normals(env, m), constraint, direction).level[0];
}

static uint32_t slot_of(const qw_level *level, uint32_t from, uint32_t to)
{
    uint32_t i = level->begin[to];
    while (level->neighbour[i] != from) i++;
    return i;
}

/* What a triangle's curvature rises by. */
static double rise(const qw_trimesh *m, const qw_level *level, const float *turn, uint32_t f)
{
    double sum = 0;
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) sum += turn[slot_of(level, m->corner[h], m->corner[qw_next(h)])];
    return sum;
}

static double curvature_of(const qw_trimesh *m, const qw_level *level, uint32_t f)
{
    const uint32_t *c = m->corner + 3 * (size_t)f;
    qw_vec3 a = level->normal[c[0]], b = level->normal[c[1]], n = level->normal[c[2]];
    return 2 * atan2(qw_dot(a, qw_cross(b, n)), 1 + qw_dot(a, b) + qw_dot(b, n) + qw_dot(n, a));
}

/* What leaves one triangle comes to another, and curvatures of a rough torus become smaller. */
static void curvature_is_diffused(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = unit_torus(env, 100, 40, 0.4f);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        m.position[v].z += 0.05f * sinf(9 * m.position[v].x) * sinf(9 * m.position[v].y);
    qw_level level = finest(env, &m, false);
    float *turn = qw_diffuse_curvature(env, &m, &level, all(env, m.vertex_count, 0.3f), NULL);
    double before = 0, after = 0, sum = 0, most = 0;
    for (uint32_t f = 0; f < m.face_count; f++) {
        double k = curvature_of(&m, &level, f), up = rise(&m, &level, turn, f);
        before += k * k, after += (k + up) * (k + up), sum += up;
        most = fmax(most, fabs(up));
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            uint32_t u = m.corner[h], v = m.corner[qw_next(h)];
            assert_true(turn[slot_of(&level, u, v)] == -turn[slot_of(&level, v, u)]);
        }
    }
    assert_true(most > 1e-3 && after < 0.1 * before);
    assert_float_equal(sum, 0, 1e-3);
    turn = qw_diffuse_curvature(env, &m, &level, all(env, m.vertex_count, 0), NULL);
    for (uint32_t i = 0; i < level.begin[m.vertex_count]; i++) assert_true(turn[i] == 0);
    qw_env_destroy(env);
}

/* On a sheet of equilateral triangles, nearly flat, the curvature of waves falls to 1 / (1 + (k r)^2), k being their
 * wave number and r the radius; none where that is 0. */
static void waves_fall_by_their_length(void **state)
{
    (void)state;
    static const float edges[] = {2, 4, 6}; /* of radius */
    for (int i = 0; i < 3; i++) {
        qw_env *env = qw_env_create(NULL, 2);
        qw_trimesh m = unit_grid(env, 120, 120, false, false);
        float edge = 1.0f / 120, k = (float)(2 * PI / (40 * edge));
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            qw_vec3 p = m.position[v];
            float x = p.x - 0.5f * p.y, y = 0.8660254f * p.y; /* the grid's diagonals are the short ones then */
            m.position[v] = qw_v3(x, y, 0.02f * edge * cosf(k * x) * cosf(k * y));
        }
        qw_level level = finest(env, &m, false);
        float *radius = all(env, m.vertex_count, edges[i] * edge);
        for (uint32_t v = 0; v < m.vertex_count; v++)
            if (m.position[v].y > 0.7f) radius[v] = 0;
        float *turn = qw_diffuse_curvature(env, &m, &level, radius, NULL);
        double before = 0, after = 0;
        for (uint32_t f = 0; f < m.face_count; f++) {
            qw_vec3 p = m.position[m.corner[3 * f]];
            double was = curvature_of(&m, &level, f), up = rise(&m, &level, turn, f);
            if (p.y > 0.72f) assert_true(up == 0);
            float x = p.x + p.y / 1.7320508f;
            if (x < 0.2f || x > 0.8f || p.y < 0.2f || p.y > 0.5f) continue; /* far from boundaries */
            before += was * was, after += was * (was + up);
        }
        double wave = 2 * k * edges[i] * edge; /* the curvature's waves are half as long */
        assert_float_equal(after / before, 1 / (1 + wave * wave), 0.06);
        qw_env_destroy(env);
    }
}

/* Nothing flows across marked edges, boundaries or beside corners: each side of a cube, bulged, keeps its own. */
static void curvature_stays_between_marks(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = unit_cube(env, 4);
    qw_level level = finest(env, &m, true);
    unit_rng r = {3};
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        qw_vec3 lean = qw_v3(unit_real(&r), 0, 0);
        lean.y = unit_real(&r), lean.z = unit_real(&r);
        level.normal[v] = qw_normalize(qw_madd(level.normal[v], 0.2f, lean));
    }
    float *turn = qw_diffuse_curvature(env, &m, &level, all(env, m.vertex_count, 0.5f), NULL);
    double sum[6] = {0}, most = 0;
    for (uint32_t f = 0; f < m.face_count; f++) {
        qw_vec3 n = qw_face_cross(&m, f);
        int axis = fabsf(n.x) > fabsf(n.y) && fabsf(n.x) > fabsf(n.z) ? 0 : fabsf(n.y) > fabsf(n.z) ? 1 : 2;
        double up = rise(&m, &level, turn, f);
        sum[2 * axis + ((axis == 0 ? n.x : axis == 1 ? n.y : n.z) > 0)] += up;
        most = fmax(most, fabs(up));
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            bool at_corner = level.constraint[m.corner[h]] == QW_VERTEX_CORNER ||
                             level.constraint[m.corner[qw_next(h)]] == QW_VERTEX_CORNER;
            if (at_corner || m.mark[h]) assert_true(turn[slot_of(&level, m.corner[h], m.corner[qw_next(h)])] == 0);
        }
    }
    assert_true(most > 1e-3);
    for (int i = 0; i < 6; i++) assert_float_equal(sum[i], 0, 1e-4);
    qw_env_destroy(env);
}

static uint32_t singularities(qw_env *env, const qw_trimesh *m, float radius)
{
    qw_vec3 *normal = qw_vertex_normals(env, m);
    qw_hierarchy h = qw_hierarchy_build(env, m, normal, NULL, NULL);
    float *size = all(env, m->vertex_count, 1),
          *turn = qw_diffuse_curvature(env, m, &h.level[0], all(env, m->vertex_count, radius), NULL);
    qw_vec3 *o = qw_orientation_field(env, &h, turn, NULL, 0, NULL, 1);
    uint8_t *constraint = QW_NEW_ZERO(env, uint8_t, m->vertex_count);
    qw_vec3 *direction = QW_NEW_ZERO(env, qw_vec3, m->vertex_count);
    qw_offset_input in = {m, normal, NULL, o, size, constraint, direction, NULL, false, false};
    qw_offset_mesh offsets = qw_integer_offsets(env, &in);
    return (uint32_t)qw_offset_count(&offsets).singular_vertices;
}

/* A bump steep enough for singularities has none where it is smaller than what is evened. */
static void bumps_need_no_singularities(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = unit_grid(env, 80, 80, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float x = m.position[v].x - 0.5f, y = m.position[v].y - 0.5f;
        m.position[v].z = 0.4f * expf(-(x * x + y * y) / 0.02f);
    }
    assert_true(singularities(env, &m, 0) > 0);
    assert_int_equal((int)singularities(env, &m, 0.3f), 0);
    qw_env_destroy(env);
}

/* A right triangle with one corner of so many degrees, in n rows. */
static qw_trimesh corner_piece(qw_env *env, uint32_t n, double degrees)
{
    qw_trimesh m = unit_mesh(env, (n + 1) * (n + 2) / 2, n * n);
    uint32_t f = 0;
    for (uint32_t y = 0, v = 0; y <= n; y++)
        for (uint32_t x = 0; x <= y; x++, v++) {
            m.position[v] = qw_v3((float)y / (float)n, (float)(tan(degrees * PI / 180) * x / n), 0);
            if (y == n) continue;
            uint32_t down = v + y + 1;
            unit_face(&m, f++, v, down, down + 1);
            if (x < y) unit_face(&m, f++, v, down + 1, v + 1);
        }
    qw_trimesh_link(env, &m);
    return m;
}

/* Three corners of a quad around a disc leave one cone inside. Were the sharp one none, both of its sides would be on
 * one line. */
static void sharp_corners_turn(void **state)
{
    (void)state;
    static const double degrees[] = {25, 30, 35, 40, 44, 45, 46, 50, 60};
    for (int i = 0; i < 9; i++) {
        qw_env *env = qw_env_create(NULL, 1);
        unit_fields u = unit_solve(env, corner_piece(env, 24, degrees[i]), 0.08f, true);
        assert_int_equal(qw_offset_count(&u.offsets).index_sum, 1);
        qw_env_destroy(env);
    }
}

QW_TEST_SUITE(orientation)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(is_hermitian),
        cmocka_unit_test(turns_by_the_curvature),
        cmocka_unit_test(coarse_energy_is_exact),
        cmocka_unit_test(levels_find_less_energy),
        cmocka_unit_test(singularities_are_fewest),
        cmocka_unit_test(same_on_any_threads),
        cmocka_unit_test(normals_reach_far),
        cmocka_unit_test(sharp_corners_turn),
        cmocka_unit_test(curvature_is_diffused),
        cmocka_unit_test(curvature_stays_between_marks),
        cmocka_unit_test(bumps_need_no_singularities),
        cmocka_unit_test(waves_fall_by_their_length),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

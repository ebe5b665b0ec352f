/* Crosses and lattices against brute force; both fields on surfaces where the answer is known; the sum of indices. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/sizes/small_loops.h"
#include "remesh/sizes/scale.h"

#define CASES 20000

/* ---- rosy.h */

/* The energy of Eq. (1): sum over the edges of the squared angle (radians) between the matched axes. */
static double orientation_energy(const qw_level *level, const qw_vec3 *orientation)
{
    double energy = 0;
    for (uint32_t u = 0; u < level->vertex_count; u++)
        for (uint32_t i = level->begin[u]; i < level->begin[u + 1]; i++) {
            uint32_t v = level->neighbour[i];
            qw_match m = qw_match_crosses(orientation[u], level->normal[u], orientation[v], level->normal[v]);
            qw_vec3 a = qw_axis(orientation[u], level->normal[u], m.ku),
                    b = qw_axis(orientation[v], level->normal[v], m.kv);
            double angle = qw_angle_between(a, b);
            energy += level->weight[i] * angle * angle;
        }
    return energy / 2;
}

static void turns_form_a_group(void **state)
{
    (void)state;
    for (int32_t x = -3; x <= 3; x++)
        for (int32_t y = -3; y <= 3; y++)
            for (unsigned a = 0; a < 8; a++) {
                qw_int2 d = {x, y}, ad = qw_turn(a, d), back = qw_turn(4u * 2 - a, ad);
                assert_true(back.x == x && back.y == y);
                qw_int2 negated = qw_turn(a + 2, d);
                assert_true(qw_int2_is_zero(qw_int2_add(ad, negated)));
                assert_int_equal(qw_int2_norm(ad), qw_int2_norm(d));
                int32_t sine = a % 4 == 1 ? 1 : a % 4 == 3 ? -1 : 0;
                assert_int_equal(qw_int2_det(d, ad), sine * (x * x + y * y));
                for (unsigned b = 0; b < 4; b++) {
                    qw_int2 one = qw_turn(b, ad), both = qw_turn(a + b, d);
                    assert_true(one.x == both.x && one.y == both.y);
                }
            }
}

/* R2 on coordinates is R3 in space. */
static void axes_follow_turns(void **state)
{
    (void)state;
    unit_rng r = {1};
    for (int i = 0; i < 200; i++) {
        qw_vec3 n = unit_direction(&r), o = qw_any_orthogonal(n);
        assert_true(fabsf(qw_dot(n, o)) < 1e-6f && fabsf(qw_length(o) - 1) < 1e-6f);
        for (unsigned k = 0; k < 4; k++) {
            qw_int2 x = qw_turn(k, (qw_int2){1, 0});
            qw_vec3 in_space = qw_add(qw_scale(o, (float)x.x), qw_scale(qw_cross(n, o), (float)x.y));
            assert_true(qw_distance(in_space, qw_axis(o, n, k)) < 1e-6f);
        }
    }
}

static void matches_as_all_sixteen(void **state)
{
    (void)state;
    unit_rng r = {2};
    for (int i = 0; i < CASES; i++) {
        qw_vec3 nu = unit_direction(&r), nv = unit_direction(&r);
        qw_vec3 ou = qw_normalize(qw_reject(unit_direction(&r), nu)),
                ov = qw_normalize(qw_reject(unit_direction(&r), nv));
        qw_match m = qw_match_crosses(ou, nu, ov, nv);
        assert_true(m.ku < 2 && m.kv < 4);
        float best = -2;
        unsigned turns = 0;
        bool tie = false;
        for (unsigned a = 0; a < 4; a++)
            for (unsigned b = 0; b < 4; b++) {
                float likeness = qw_dot(qw_axis(ou, nu, a), qw_axis(ov, nv, b));
                unsigned t = (a + 4 - b) & 3u;
                if (fabsf(likeness - best) < 1e-5f && t != turns) tie = true;
                if (likeness > best + 1e-5f) best = likeness, turns = t, tie = false;
            }
        assert_true(qw_dot(qw_axis(ou, nu, m.ku), qw_axis(ov, nv, m.kv)) > best - 1e-5f);
        if (tie) continue;
        assert_int_equal(qw_match_turns(m), turns);
        assert_int_equal((4 - qw_match_turns(qw_match_crosses(ov, nv, ou, nu))) & 3u, turns);
    }
}

/* ---- orientation */

static void random_start(const qw_level *level, qw_vec3 *o)
{
    unit_rng r = {3};
    for (uint32_t v = 0; v < level->vertex_count; v++)
        o[v] = qw_normalize(qw_reject(unit_direction(&r), level->normal[v]));
}

static void check_tangents(const unit_fields *u)
{
    for (uint32_t v = 0; v < u->mesh.vertex_count; v++) {
        assert_true(fabsf(qw_length(u->orientation[v]) - 1) < 1e-4f);
        assert_true(fabsf(qw_dot(u->orientation[v], u->normal[v])) < 1e-4f);
    }
}

static void orientation_is_smooth(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh flat[] = {unit_grid(env, 40, 30, false, false), unit_cylinder(env, 80, 40, 3)};
    for (int i = 0; i < 2; i++) {
        unit_fields u = unit_solve(env, flat[i], 0.2f, true);
        check_tangents(&u);
        assert_true(orientation_energy(&u.hierarchy->level[0], u.orientation) < (i ? 1e-2 : 1e-6));
        assert_int_equal(qw_offset_count(&u.offsets).singular_vertices, 0);
        u = unit_solve(env, flat[i], 0.2f, false); /* nothing constrained: still no singularity on the plane */
        if (i == 0) assert_true(orientation_energy(&u.hierarchy->level[0], u.orientation) < 1e-4);
    }
    qw_trimesh sphere = unit_sphere(env, 4);
    unit_fields u = unit_solve(env, sphere, 0.2f, false);
    check_tangents(&u);
    qw_vec3 *wild = QW_NEW(env, qw_vec3, sphere.vertex_count);
    random_start(&u.hierarchy->level[0], wild);
    double solved = orientation_energy(&u.hierarchy->level[0], u.orientation);
    double before = orientation_energy(&u.hierarchy->level[0], wild);
    assert_true(solved < 0.1 * before);
    qw_env_destroy(env);
}

/* The energy does not change when crosses are turned by quarter turns, and is the squared angle on a pair. */
static void energy_of_crosses(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_triangle(env);
    qw_hierarchy h = qw_hierarchy_build(env, &m, qw_vertex_normals(env, &m), NULL, NULL);
    const float angle[3] = {0.1f, 0.3f, 0.7f};
    for (unsigned k = 0; k < 64; k++) {
        qw_vec3 o[3], n = qw_v3(0, 0, 1);
        for (unsigned i = 0; i < 3; i++) o[i] = qw_axis(qw_v3(cosf(angle[i]), sinf(angle[i]), 0), n, k >> (2 * i));
        assert_true(fabs(orientation_energy(&h.level[0], o) - (0.04 + 0.16 + 0.36)) < 1e-5);
    }
    qw_env_destroy(env);
}

static void curves_are_obeyed(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh meshes[] = {unit_cube(env, 4), unit_cylinder(env, 40, 20, 2), unit_fan(env, 24)};
    for (int i = 0; i < 3; i++) {
        unit_fields u = unit_solve(env, meshes[i], 0.15f, true);
        check_tangents(&u);
        uint32_t constrained = 0;
        for (uint32_t v = 0; v < u.mesh.vertex_count; v++) {
            if (u.constraint[v] == QW_VERTEX_CORNER) assert_true(qw_distance(u.lattice[v], u.mesh.position[v]) == 0);
            if (u.constraint[v] != QW_VERTEX_CURVE) continue;
            constrained++;
            qw_vec3 wanted = qw_normalize(qw_reject(u.direction[v], u.normal[v]));
            assert_true(qw_distance(u.orientation[v], wanted) < 1e-6f);
            /* a lattice point is on the curve's line */
            qw_vec3 off = qw_reject(qw_sub(u.lattice[v], u.mesh.position[v]), u.direction[v]);
            float tilt = fabsf(qw_dot(u.direction[v], u.normal[v]));
            assert_true(qw_length(off) < 1e-5f + 1.1f * tilt * u.size[v]);
            assert_true(qw_distance(u.lattice[v], u.mesh.position[v]) < 0.6f * u.size[v]);
        }
        assert_true(constrained > 20);
        for (uint32_t e = 0; e < u.offsets.edge_count; e++) {
            uint32_t h = u.offsets.half[e];
            bool curve = u.offsets.twin[h] == QW_NONE || u.offsets.mark[h];
            assert_int_equal(u.offsets.fixed[e] == QW_FIXED_X || u.offsets.fixed[e] == QW_FIXED_Y, curve);
        }
        qw_offset_validate(env, &u.offsets);
    }
    qw_env_destroy(env);
}

/* Poincare-Hopf: a vertex of index i has valence 4 - i, and 4 - valence sums to four times the Euler number over a
 * closed quad mesh. */
static void indices_sum_to_euler(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_torus(env, 70, 30, 0.4f), unit_double_torus(env, 3),
                           unit_cube(env, 4)};
    const int64_t sums[] = {8, 0, -8, 8};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(4 * qw_trimesh_census(env, &meshes[i]).euler, sums[i]);
        unit_fields u = unit_solve(env, meshes[i], i == 2 ? 0.3f : 0.15f, true);
        assert_int_equal(qw_offset_count(&u.offsets).index_sum, sums[i]);
        qw_offset_validate(env, &u.offsets);
        /* a vertex has a cone just where the frames come back turned */
        uint32_t *out = qw_offset_outgoing(env, &u.offsets);
        qw_star star = {0};
        for (uint32_t v = 0; v < u.mesh.vertex_count; v++) {
            qw_star_at(env, &u.offsets, out[v], &star);
            assert_int_equal(star.movable, (u.offsets.index[v] & 3) == 0);
        }
    }
    qw_env_destroy(env);
}

static void normals_smooth(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    unit_rng r = {5};
    qw_trimesh m = unit_grid(env, 40, 40, false, false);
    for (uint32_t v = 0; v < m.vertex_count; v++) m.position[v].z = 0.01f * unit_real(&r);
    qw_vec3 *rough = qw_vertex_normals(env, &m), *smooth = qw_vertex_normals(env, &m),
            *same = qw_vertex_normals(env, &m);
    qw_smooth_normals(env, &m, NULL, 0, same, NULL);
    assert_memory_equal(same, rough, m.vertex_count * sizeof *same);
    qw_smooth_normals(env, &m, NULL, 0.1f, smooth, NULL);
    double before = 0, after = 0;
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        assert_true(fabsf(qw_length(smooth[v]) - 1) < 1e-5f);
        before += 1 - rough[v].z, after += 1 - smooth[v].z;
    }
    assert_true(after < 0.2 * before);
    qw_env_destroy(env);
}

/* Away from a crease nothing comes over it: the sides of a cube stay flat right up to their edges. */
static void normals_stop_at_sharp_edges(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_cube(env, 4);
    qw_vec3 *normal = qw_vertex_normals(env, &m), *smooth = qw_vertex_normals(env, &m);
    qw_smooth_normals(env, &m, NULL, 0.5f, smooth, NULL);
    uint8_t *constraint;
    qw_vec3 *direction;
    qw_find_constraints(env, &m, true, 0.7, NULL, NULL, &constraint, &direction);
    for (uint32_t v = 0; v < m.vertex_count; v++)
        if (!constraint[v]) assert_true(qw_distance(normal[v], smooth[v]) < 1e-5f);
    qw_env_destroy(env);
}

/* ---- scale */

/* The limit is the largest function under the sizes with that slope: min over all w of size[w] + slope * (path from w),
 * by Bellman-Ford. */
static void gradation_is_exact(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {6};
    qw_trimesh islands = unit_triangle(env), sphere = unit_sphere(env, 2), m = unit_both(env, &sphere, &islands);
    for (int round = 0; round < 20; round++) {
        float *size = QW_NEW(env, float, m.vertex_count), *want = QW_NEW(env, float, m.vertex_count),
              slope = 0.1f + 0.05f * (float)round;
        for (uint32_t v = 0; v < m.vertex_count; v++)
            size[v] = want[v] = expf(4 * unit_real(&r)); /* pushed on the heap again and again */
        for (bool changed = true; changed;) {
            changed = false;
            for (uint32_t h = 0; h < 3 * m.face_count; h++) {
                uint32_t ends[2] = {m.corner[h], m.corner[qw_next(h)]};
                for (int i = 0; i < 2; i++) {
                    float most = want[ends[i]] + slope * qw_distance(m.position[ends[0]], m.position[ends[1]]);
                    if (want[ends[!i]] > most) want[ends[!i]] = most, changed = true;
                }
            }
        }
        qw_limit_gradation(env, &m, size, slope);
        for (uint32_t v = 0; v < m.vertex_count; v++) assert_true(size[v] == want[v]);
    }
    qw_env_destroy(env);
}

/* ---- position */

static qw_lattice random_lattice(unit_rng *r, qw_vec3 at, qw_vec3 n)
{
    qw_lattice l = {.vertex = at, .normal = n, .h = 1};
    l.o = qw_normalize(qw_reject(unit_direction(r), n));
    l.p = qw_madd(qw_madd(at, 0.5f * unit_real(r), l.o), 0.5f * unit_real(r), qw_cross(n, l.o));
    return l;
}

static qw_offsets best_of_window(const qw_lattice *u, const qw_lattice *v, int window)
{
    qw_offsets best = {.distance2 = INFINITY};
    for (int a = -window; a <= window; a++)
        for (int b = -window; b <= window; b++) {
            qw_int2 tu = {a, b};
            qw_vec3 pu = qw_lattice_point(u, tu);
            for (int c = -window; c <= window; c++)
                for (int d = -window; d <= window; d++) {
                    qw_int2 tv = {c, d};
                    float distance = qw_length2(qw_sub(pu, qw_lattice_point(v, tv)));
                    if (distance < best.distance2) best = (qw_offsets){tu, tv, distance};
                }
        }
    return best;
}

/* In one plane, with crosses that match, the offset between the lattices is the same wherever they are compared. */
static void lattices_match_in_a_plane(void **state)
{
    (void)state;
    unit_rng r = {7};
    for (int i = 0; i < 60; i++) {
        qw_vec3 n = unit_direction(&r), x = qw_any_orthogonal(n), y = qw_cross(n, x);
        qw_lattice u = random_lattice(&r, qw_v3(0, 0, 0), n);
        qw_lattice v = random_lattice(&r, qw_madd(qw_scale(x, 2 * unit_real(&r)), 2 * unit_real(&r), y), n);
        unsigned k = unit_random(&r, 4);
        v.o = qw_axis(u.o, n, k);
        v.p = qw_madd(qw_madd(v.vertex, 0.5f * unit_real(&r), v.o), 0.5f * unit_real(&r), qw_cross(n, v.o));
        qw_offsets found = qw_match_lattices(&u, &v), best = best_of_window(&u, &v, 3);
        assert_true(fabsf(found.distance2 - best.distance2) < 1e-5f);
        qw_vec3 pu = qw_lattice_point(&u, found.tu), pv = qw_lattice_point(&v, found.tv);
        assert_true(fabsf(qw_length2(qw_sub(pu, pv)) - found.distance2) < 1e-5f);
        /* what Definition 3.1 makes of it does not depend on which of the equal pairs was taken: axis k of u is axis 0
         * of v */
        qw_int2 d = qw_int2_sub(found.tu, qw_turn(k, found.tv)), e = qw_int2_sub(best.tu, qw_turn(k, best.tv));
        if (best.distance2 < 0.2f) assert_true(d.x == e.x && d.y == e.y);
    }
}

/* Across a fold no lattice point near both planes is nearer: against all of u's points within a step of the middle. */
static void lattices_match_across_a_fold(void **state)
{
    (void)state;
    unit_rng r = {8};
    for (int i = 0; i < 300; i++) {
        qw_vec3 nu = unit_direction(&r), nv = qw_normalize(qw_madd(nu, 0.6f, unit_direction(&r)));
        qw_lattice u = random_lattice(&r, qw_v3(0, 0, 0), nu),
                   v = random_lattice(&r, qw_scale(qw_any_orthogonal(nu), 0.4f), nv);
        qw_offsets found = qw_match_lattices(&u, &v), best = {.distance2 = INFINITY};
        for (int a = -1; a <= 1; a++) /* v's nearest to found.tu */
            for (int b = -1; b <= 1; b++) {
                qw_int2 tv = {found.tv.x + a, found.tv.y + b};
                float distance = qw_length2(qw_sub(qw_lattice_point(&u, found.tu), qw_lattice_point(&v, tv)));
                if (distance < best.distance2) best = (qw_offsets){found.tu, tv, distance};
            }
        assert_true(best.distance2 > found.distance2 - 1e-6f);
        assert_true(qw_length(qw_lattice_point(&u, found.tu)) < 3);
        qw_offsets all = best_of_window(&u, &v, 1); /* the pairs about the vertices themselves are not much better */
        assert_true(found.distance2 < all.distance2 + 0.8f);
    }
}

/* The energy of Eq. (2) in units of the local squared edge length. */
static double position_energy(const qw_level *level, const qw_vec3 *orientation, const float *size, const qw_vec3 *p)
{
    double energy = 0;
    for (uint32_t u = 0; u < level->vertex_count; u++)
        for (uint32_t i = level->begin[u]; i < level->begin[u + 1]; i++) {
            uint32_t v = level->neighbour[i];
            qw_lattice a = {level->position[u], level->normal[u], orientation[u], p[u], size[u]};
            qw_lattice b = {level->position[v], level->normal[v], orientation[v], p[v], size[v]};
            energy += level->weight[i] * qw_match_lattices(&a, &b).distance2 / (a.h * b.h);
        }
    return energy / 2;
}

static void position_on_a_plane(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh m = unit_grid(env, 40, 40, false, false);
    unit_rng r = {9};
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        uint32_t x = v % 41, y = v / 41;
        if (x % 40 && y % 40) m.position[v] = qw_madd(m.position[v], 0.006f, qw_v3(unit_real(&r), unit_real(&r), 0));
    }
    unit_fields u = unit_solve(env, m, 0.1f, true); /* ten to a side: the boundary fits */
    assert_true(position_energy(&u.hierarchy->level[0], u.orientation, u.size, u.lattice) < 1e-4);
    qw_offset_counts c = qw_offset_count(&u.offsets);
    assert_int_equal(c.irregular_triangles + c.singular_vertices, 0);
    assert_int_equal(c.double_area, 200);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        qw_vec3 p = qw_scale(u.lattice[v], 10);
        assert_true(fabsf(p.x - roundf(p.x)) < 1e-2f && fabsf(p.y - roundf(p.y)) < 1e-2f && fabsf(p.z) < 1e-5f);
        assert_true(fabsf(p.x - 10 * m.position[v].x) < 0.51f && fabsf(p.y - 10 * m.position[v].y) < 0.51f);
    }
    qw_env_destroy(env);
}

static void any_thread_count(void **state)
{
    (void)state;
    static const uint32_t threads[] = {1, 2, 3, 8};
    qw_int2 *first = NULL;
    for (int t = 0; t < 4; t++) {
        qw_env *env = qw_env_create(NULL, threads[t]);
        qw_trimesh m = unit_torus(env, 110, 50, 0.4f);
        unit_fields u = unit_solve(env, m, 0.1f, false);
        size_t bytes = u.offsets.edge_count * sizeof *first;
        if (t == 0) memcpy(first = malloc(bytes), u.offsets.d, bytes);
        assert_memory_equal(first, u.offsets.d, bytes);
        qw_env_destroy(env);
    }
    free(first);
}

/* Rims of a tube, 2 pi long: with quads of 3 they get smaller ones, which grow along the tube; with quads of 0.5
 * nothing changes. */
static void loops_get_room(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh m = unit_cylinder(env, 64, 40, 8.0f);
    float *size = QW_NEW(env, float, m.vertex_count);
    for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = 3;
    assert_int_equal(qw_fit_loops(env, &m, true, size), 2);
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        float end = fminf(m.position[v].z, 8 - m.position[v].z), wanted = fminf(3, 6.2831853f / 6 + end);
        assert_true(fabsf(size[v] - wanted) < 0.1f);
    }
    for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = 3;
    assert_int_equal(qw_fit_loops(env, &m, false, size), 0);
    for (uint32_t v = 0; v < m.vertex_count; v++) size[v] = 0.5f;
    assert_int_equal(qw_fit_loops(env, &m, true, size), 0);
    for (uint32_t v = 0; v < m.vertex_count; v++) assert_true(size[v] == 0.5f);
    qw_env_destroy(env);
}

QW_TEST_SUITE(field)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(turns_form_a_group),
        cmocka_unit_test(axes_follow_turns),
        cmocka_unit_test(matches_as_all_sixteen),
        cmocka_unit_test(orientation_is_smooth),
        cmocka_unit_test(energy_of_crosses),
        cmocka_unit_test(curves_are_obeyed),
        cmocka_unit_test(indices_sum_to_euler),
        cmocka_unit_test(normals_smooth),
        cmocka_unit_test(normals_stop_at_sharp_edges),
        cmocka_unit_test(gradation_is_exact),
        cmocka_unit_test(loops_get_room),
        cmocka_unit_test(lattices_match_in_a_plane),
        cmocka_unit_test(lattices_match_across_a_fold),
        cmocka_unit_test(position_on_a_plane),
        cmocka_unit_test(any_thread_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Offsets against enumeration on tiny surfaces: the network, the solvers, subdivision, star moves and the
 * satisfiability stage. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/network.h"
#include "paper/multiresolution.h"
#include "remesh/offsets/subdivide.h"
#include "solve/flow.h"
#include "solve/sat.h"

static qw_int2 random_place(unit_rng *r, int32_t size)
{
    return (qw_int2){unit_between(r, -size, size), unit_between(r, -size, size)};
}

/* Random places a vertex, all frames turned at random. */
static qw_offset_mesh random_regular(qw_env *env, const qw_trimesh *mesh, unit_rng *r, int32_t size)
{
    qw_int2 *place = QW_NEW(env, qw_int2, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) place[v] = random_place(r, size);
    return unit_offsets(env, mesh, place, r);
}

static qw_offset_mesh random_offsets(qw_env *env, const qw_trimesh *mesh, unit_rng *r, int32_t size)
{
    qw_offset_mesh m = unit_offsets(env, mesh, NULL, r);
    for (uint32_t e = 0; e < m.edge_count; e++) m.d[e] = random_place(r, size);
    unit_real_of(&m);
    return m;
}

static void assert_regular(const qw_offset_mesh *m)
{
    for (uint32_t f = 0; f < m->face_count; f++) assert_true(qw_int2_is_zero(qw_offset_residual(m, f)));
}

/* ---- complex */

static void assert_complex(const qw_complex *c)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        for (uint32_t s = 0; s < 2; s++) {
            uint32_t h = c->side[2 * e + s];
            assert_true(h == QW_NONE ? s == 1 : h < 3 * c->face_count && c->edge[h] == e);
        }
    for (uint32_t h = 0; h < 3 * c->face_count; h++) {
        assert_true(c->edge[h] < c->edge_count);
        assert_true(c->side[2 * c->edge[h]] == h || c->side[2 * c->edge[h] + 1] == h);
    }
}

/* Any solution of the coarse equations is one of the fine equations, and the coarse offsets are the fine ones that are
 * left. */
static void collapses_and_expands(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {11};
    uint32_t collapsed = 0;
    for (int round = 0; round < 60; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 3 == 1 ? unit_sphere(env, 1) : unit_grid(env, 8, 6, round % 3 == 2, false);
        qw_offset_mesh m = random_regular(env, &mesh, &r, 1);
        if (round % 2) unit_add_cones(env, &m, &r, 3);
        for (int i = 0; i < 5; i++) m.d[unit_random(&r, m.edge_count)] = random_place(&r, 1);
        for (uint32_t e = 0; e < m.edge_count; e++) {
            if (round % 4 > 1 && m.d[e].x == 0 && unit_random(&r, 6) == 0) m.fixed[e] |= QW_FIXED_X;
            if (round % 4 > 1 && m.d[e].y == 0 && unit_random(&r, 6) == 0) m.fixed[e] |= QW_FIXED_Y;
        }
        qw_complex fine = qw_complex_of(env, &m), coarse;
        qw_collapse map;
        assert_complex(&fine);
        for (int level = 0; level < 5 && qw_complex_collapse(env, &fine, &coarse, &map); level++) {
            collapsed++;
            assert_complex(&coarse);
            uint32_t broken_fine = 0, broken_coarse = 0;
            for (uint32_t f = 0; f < fine.face_count; f++)
                broken_fine += !qw_int2_is_zero(qw_complex_residual(&fine, f));
            for (uint32_t f = 0; f < coarse.face_count; f++)
                broken_coarse += !qw_int2_is_zero(qw_complex_residual(&coarse, f));
            assert_int_equal(broken_fine, broken_coarse); /* only regular triangles went */
            qw_int2 *before = QW_NEW(env, qw_int2, fine.edge_count);
            memcpy(before, fine.d, fine.edge_count * sizeof *before);
            qw_complex_expand(&coarse, &map, &fine);
            assert_memory_equal(before, fine.d, fine.edge_count * sizeof *before);
            /* other values on the coarse level, where they are free: the fine residuals are just the coarse ones, and
             * zero elsewhere */
            qw_int2 *kept = QW_NEW(env, qw_int2, coarse.edge_count);
            memcpy(kept, coarse.d, coarse.edge_count * sizeof *kept);
            for (uint32_t e = 0; e < coarse.edge_count; e++) {
                coarse.d[e] = random_place(&r, 3);
                if (coarse.fixed[e] & QW_FIXED_X) coarse.d[e].x = 0;
                if (coarse.fixed[e] & QW_FIXED_Y) coarse.d[e].y = 0;
            }
            qw_complex_expand(&coarse, &map, &fine);
            int64_t sum_fine = 0, sum_coarse = 0;
            for (uint32_t f = 0; f < fine.face_count; f++) sum_fine += qw_int2_norm(qw_complex_residual(&fine, f));
            for (uint32_t f = 0; f < coarse.face_count; f++)
                sum_coarse += qw_int2_norm(qw_complex_residual(&coarse, f));
            assert_int_equal(sum_fine, sum_coarse);
            for (uint32_t e = 0; e < fine.edge_count; e++) {
                if (fine.fixed[e] & QW_FIXED_X) assert_int_equal(fine.d[e].x, 0);
                if (fine.fixed[e] & QW_FIXED_Y) assert_int_equal(fine.d[e].y, 0);
            }
            memcpy(coarse.d, kept, coarse.edge_count * sizeof *kept);
            fine = coarse;
        }
        qw_scope_end(env);
    }
    assert_true(collapsed > 60);
    qw_env_destroy(env);
}

/* ---- network */

typedef struct appearance {
    uint32_t node[2];
    int coefficient[2]; /* after the nodes' signs */
    uint32_t count;
} appearance;

/* Where a variable appears, found by trying: raise it and see which rows of which triangles change. */
static appearance find_variable(const qw_network *net, qw_complex *c, uint32_t variable)
{
    appearance a = {.count = 0};
    uint32_t e = variable / 2;
    for (uint32_t s = 0; s < 2; s++) {
        uint32_t h = c->side[2 * e + s];
        if (h == QW_NONE) continue;
        qw_int2 unit = variable & 1u ? (qw_int2){0, 1} : (qw_int2){1, 0}, along = qw_turn(c->rot[h], unit);
        uint32_t node = 2 * (h / 3) + (along.y != 0);
        a.node[a.count] = node;
        a.coefficient[a.count++] = (along.x + along.y) * net->sign[node];
    }
    return a;
}

/* A frozen variable's ends have equal signs and are joined by balanced variables: it closes an odd cycle, whatever the
 * signs. */
/* Every free variable is balanced or frozen, with the signs of its appearances. */
static void check_variables(qw_env *env, qw_complex *c, const qw_network *network)
{
    qw_network net = *network;
    uint32_t ground = net.node_count - 1;
    uint8_t *seen = QW_NEW_ZERO(env, uint8_t, (size_t)2 * c->edge_count);
    assert_int_equal(net.node_count, 2 * c->face_count + 1);
    for (uint32_t i = 0; i < net.variable_count; i++) {
        uint32_t v = net.variable[i];
        appearance a = find_variable(&net, c, v);
        assert_int_equal(seen[v]++, 0);
        for (uint32_t k = 0; k < a.count; k++) {
            assert_int_equal(abs(a.coefficient[k]), 1);
            assert_int_equal(a.coefficient[k] > 0 ? net.plus[i] : net.minus[i], a.node[k]);
        }
        if (a.count == 2) assert_int_equal(a.coefficient[0] + a.coefficient[1], 0);
        else assert_int_equal(a.coefficient[0] > 0 ? net.minus[i] : net.plus[i], ground);
        assert_int_equal(net.component[net.minus[i]], net.component[net.plus[i]]);
    }
    for (uint32_t i = 0; i < net.frozen_count; i++) {
        appearance a = find_variable(&net, c, net.frozen[i]);
        assert_int_equal(seen[net.frozen[i]]++, 0);
        assert_int_equal(a.count, 2);
        assert_int_equal(a.coefficient[0], a.coefficient[1]);
        assert_int_equal(net.component[a.node[0]], net.component[a.node[1]]);
    }
    for (uint32_t v = 0; v < 2 * c->edge_count; v++) {
        bool constrained = c->fixed[v / 2] & (v & 1u ? QW_FIXED_Y : QW_FIXED_X);
        appearance a = find_variable(&net, c, v);
        bool cancels = a.count == 2 && a.node[0] == a.node[1] && a.coefficient[0] == -a.coefficient[1];
        assert_int_equal(seen[v], !constrained && !cancels);
    }
}

/* Components by union-find over the balanced variables: the same partition. */
static void check_components(qw_env *env, const qw_network *network)
{
    qw_network net = *network;
    uint32_t ground = net.node_count - 1;
    uint32_t *root = QW_NEW(env, uint32_t, net.node_count);
    for (uint32_t n = 0; n < net.node_count; n++) root[n] = n;
    for (bool changed = true; changed;) {
        changed = false;
        for (uint32_t i = 0; i < net.variable_count; i++) {
            uint32_t a = root[net.minus[i]], b = root[net.plus[i]], low = a < b ? a : b;
            if (a != b) root[net.minus[i]] = root[net.plus[i]] = low, changed = true;
        }
    }
    for (uint32_t a = 0; a < net.node_count; a++)
        for (uint32_t b = 0; b < a; b++) assert_int_equal(root[a] == root[b], net.component[a] == net.component[b]);
    assert_int_equal(net.ground_component == QW_NONE, root[ground] == ground);
}

static void check_network(qw_env *env, qw_complex *c)
{
    qw_network net = qw_network_build(env, c);
    check_variables(env, c, &net);
    check_components(env, &net);
    int32_t *supply = QW_NEW(env, int32_t, net.node_count);
    uint8_t *bad = QW_NEW(env, uint8_t, net.component_count);
    uint32_t failures = qw_network_balance_sums(env, &net, c, bad), marked = 0;
    qw_network_supply(&net, c, supply);
    int64_t *sum = QW_NEW_ZERO(env, int64_t, net.component_count);
    for (uint32_t n = 0; n < net.node_count; n++) sum[net.component[n]] += supply[n];
    for (uint32_t k = 0; k < net.component_count; k++) {
        assert_int_equal(bad[k], sum[k] != 0);
        marked += bad[k];
    }
    assert_int_equal(marked, failures);
    /* a component with a frozen variable can always be balanced: with all of them at zero the sum is zero */
    for (uint32_t i = 0; i < net.frozen_count; i++) {
        appearance a = find_variable(&net, c, net.frozen[i]);
        assert_int_equal(bad[net.component[a.node[0]]], 0);
    }
}

static void networks_are_balanced(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {12};
    for (int round = 0; round < 120; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 5 == 0   ? unit_tetrahedron(env)
                          : round % 5 == 1 ? unit_fan(env, 3 + (uint32_t)round % 7)
                          : round % 5 == 2 ? unit_grid(env, 4, 3, true, true)
                          : round % 5 == 3 ? unit_sphere(env, 0)
                                           : unit_grid(env, 5, 4, true, false);
        if (round % 7 == 3) mesh = unit_both(env, &mesh, &mesh);
        qw_offset_mesh m = random_offsets(env, &mesh, &r, round % 11 == 10 ? 40 : 2);
        if (round % 2) unit_add_cones(env, &m, &r, 1 + unit_random(&r, 4));
        for (uint32_t e = 0; e < m.edge_count; e++)
            if (round % 3 == 1 && unit_random(&r, 3) == 0) {
                m.fixed[e] = (uint8_t)(1u << unit_random(&r, 2));
                *(m.fixed[e] == QW_FIXED_X ? &m.d[e].x : &m.d[e].y) = 0;
            }
        qw_complex c = qw_complex_of(env, &m);
        check_network(env, &c);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* ---- regular */

static int64_t change(qw_int2 a, qw_int2 b) { return abs(a.x - b.x) + abs(a.y - b.y); }

/* The least change over all d in [-limit, limit]^2 that is regular: depth first over the edges with a stack of choices,
 * cut by cost. */
static int64_t cheapest(qw_env *env, const qw_offset_mesh *m, int32_t limit)
{
    uint32_t n = m->edge_count, side = (uint32_t)(2 * limit + 1), choices = side * side;
    qw_offset_mesh trial = qw_offset_copy(env, m);
    uint32_t *choice = QW_NEW_ZERO(env, uint32_t, n), level = 0;
    int64_t *cost = QW_NEW_ZERO(env, int64_t, (size_t)n + 1), best = INT64_MAX;
    for (;;) {
        if (level == n || choice[level] == choices) {
            if (level == n && cost[n] < best) best = cost[n];
            if (level < n) choice[level] = 0;
            if (level-- == 0) return best;
            choice[level]++;
            continue;
        }
        uint32_t k = choice[level];
        qw_int2 d = {(int32_t)(k % side) - limit, (int32_t)(k / side) - limit};
        trial.d[level] = d;
        cost[level + 1] = cost[level] + change(d, m->d[level]);
        bool possible = cost[level + 1] < best && !((m->fixed[level] & QW_FIXED_X) && d.x) &&
                        !((m->fixed[level] & QW_FIXED_Y) && d.y);
        for (uint32_t f = 0; f < m->face_count && possible; f++) {
            const uint32_t *e = m->edge + 3 * f;
            uint32_t last = e[0] > e[1] ? (e[0] > e[2] ? e[0] : e[2]) : (e[1] > e[2] ? e[1] : e[2]);
            if (last == level) possible = qw_int2_is_zero(qw_offset_residual(&trial, f));
        }
        if (possible) level++;
        else choice[level]++;
    }
}

static int64_t solve(qw_env *env, const qw_offset_mesh *m, qw_flow_choice kind, qw_regular_counts *counts)
{
    qw_offset_mesh copy = qw_offset_copy(env, m);
    *counts = qw_make_regular(env, &copy, kind, false);
    int64_t cost = 0, broken = 0;
    for (uint32_t e = 0; e < m->edge_count; e++) cost += change(copy.d[e], m->d[e]);
    for (uint32_t f = 0; f < m->face_count; f++) broken += !qw_int2_is_zero(qw_offset_residual(&copy, f));
    assert_int_equal(cost, counts->cost);
    assert_int_equal(broken, counts->irregular_after);
    qw_offset_validate(env, &copy);
    return cost;
}

static void cheapest_on_tiny_meshes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {13};
    int compared = 0, frozen = 0;
    for (int round = 0; round < 60; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 3 == 0   ? unit_fan(env, 3)
                          : round % 3 == 1 ? unit_tetrahedron(env)
                                           : unit_grid(env, 2, 1, false, false);
        qw_offset_mesh m = random_regular(env, &mesh, &r, 1);
        if (round % 2) unit_add_cones(env, &m, &r, 1 + unit_random(&r, 3));
        for (int i = 0; i < 3; i++) m.d[unit_random(&r, m.edge_count)] = random_place(&r, 2);
        for (uint32_t e = 0; e < m.edge_count && round % 4 == 3; e++)
            if (mesh.twin[m.half[e]] == QW_NONE)
                m.fixed[e] = m.d[e].x == 0 ? QW_FIXED_X : m.d[e].y == 0 ? QW_FIXED_Y : 0;
        int64_t best = cheapest(env, &m, 2);
        qw_regular_counts c;
        int64_t cost = solve(env, &m, QW_FLOW_MCF, &c);
        if (c.irregular_after == 0 && c.capacity_rounds == 1) {
            assert_true(cost >= best);
            if (c.fixed_variables == 0) assert_int_equal(cost, best), compared++;
            if (c.fixed_variables != 0) frozen++;
        }
        if (best == INT64_MAX) assert_true(c.irregular_after || c.capacity_rounds > 1);
        qw_scope_end(env);
    }
    assert_true(compared > 15);
    assert_true(frozen > 5);
    qw_env_destroy(env);
}

static void five_solvers(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh meshes[] = {unit_sphere(env, 3), unit_torus(env, 36, 16, 0.4f), unit_grid(env, 16, 16, false, false),
                           unit_cube(env, 3),   unit_double_torus(env, 2),     unit_cylinder(env, 20, 10, 2)};
    unit_rng r = {14};
    for (int i = 0; i < 6; i++)
        for (int wild = 0; wild < 2; wild++) {
            unit_fields u = unit_solve(env, meshes[i], i == 4 ? 0.6f : 0.25f, i == 3 || i == 5);
            for (uint32_t e = 0; e < u.offsets.edge_count && wild;
                 e++) { /* and with every fifth edge off by something */
                if (unit_random(&r, 5)) continue;
                if (!(u.offsets.fixed[e] & QW_FIXED_X)) u.offsets.d[e].x += unit_between(&r, -1, 1);
                if (!(u.offsets.fixed[e] & QW_FIXED_Y)) u.offsets.d[e].y += unit_between(&r, -1, 1);
            }
            int64_t cost[5];
            for (int kind = QW_FLOW_MF; kind <= QW_FLOW_ILP; kind++) {
                qw_regular_counts c;
                if (kind == QW_FLOW_ILP && (!qw_flow_has_integer_program() || wild)) continue;
                cost[kind] = solve(env, &u.offsets, (qw_flow_choice)kind, &c);
                assert_int_equal(c.irregular_after, 0);
                if (wild) assert_true(c.irregular_before > 10);
                if (kind == QW_FLOW_ILP) assert_int_equal(cost[kind], cost[QW_FLOW_MCF]);
            }
            assert_true(cost[QW_FLOW_MCF] <= cost[QW_FLOW_MF]);
        }
    qw_env_destroy(env);
}

/* Far from regular: capacities must open as far as it takes. */
static void wild_offsets_become_regular(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {15};
    for (int round = 0; round < 40; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 4 == 0   ? unit_sphere(env, 1)
                          : round % 4 == 1 ? unit_grid(env, 12, 3, true, true)
                          : round % 4 == 2 ? unit_grid(env, 6, 6, false, false)
                                           : unit_tetrahedron(env);
        int32_t size = round < 20 ? 2 : 30;
        qw_offset_mesh m = random_offsets(env, &mesh, &r, size);
        if (round % 3 == 0) unit_add_cones(env, &m, &r, 2);
        for (int kind = QW_FLOW_MF; kind <= QW_FLOW_MCF_MR; kind++) {
            qw_regular_counts c;
            solve(env, &m, (qw_flow_choice)kind, &c);
            assert_int_equal(c.irregular_after, 0);
        }
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* ---- subdivision */

static qw_trimesh as_trimesh(const qw_offset_mesh *m)
{
    return (qw_trimesh){.vertex_count = m->vertex_count,
                        .face_count = m->face_count,
                        .position = m->position,
                        .corner = m->corner,
                        .twin = m->twin,
                        .mark = m->mark};
}

static void check_subdivision(qw_env *env, qw_offset_mesh *m)
{
    qw_offset_counts before = qw_offset_count(m), after;
    qw_trimesh old = as_trimesh(m);
    qw_census census = qw_trimesh_census(env, &old);
    uint32_t vertices = m->vertex_count;
    int64_t splits = qw_subdivide_long_edges(env, m);
    after = qw_offset_count(m);
    qw_offset_validate(env, m);
    qw_trimesh mesh = as_trimesh(m);
    qw_trimesh_validate(env, &mesh);
    qw_census now = qw_trimesh_census(env, &mesh);
    assert_int_equal(census.euler, now.euler);
    assert_int_equal(census.boundary_loops, now.boundary_loops);
    assert_int_equal(m->vertex_count, vertices + splits);
    assert_int_equal(after.long_edges, 0);
    assert_int_equal(after.irregular_triangles, 0);
    if (now.boundary_loops == 0)
        assert_int_equal(after.double_area, before.double_area); /* halves of odd boundary edges step aside */
    assert_int_equal(after.index_sum, before.index_sum);
    uint32_t *out = qw_offset_outgoing(env, m);
    qw_star star = {0};
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        qw_star_at(env, m, out[v], &star);
        assert_int_equal(star.movable, m->index[v] == 0);
    }
}

static void subdivides(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {16};
    for (int round = 0; round < 60; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 3 == 0   ? unit_grid(env, 4, 3, false, false)
                          : round % 3 == 1 ? unit_sphere(env, 1)
                                           : unit_fan(env, 5);
        qw_offset_mesh m = random_regular(env, &mesh, &r, 1 + round % 7);
        if (round % 3 == 1) {
            unit_add_cones(env, &m, &r, 3);
            qw_make_regular(env, &m, QW_FLOW_MCF, false);
        }
        check_subdivision(env, &m);
        qw_scope_end(env);
    }
    /* the vector in space that an edge stands for is that between its ends' places, also on the new edges */
    for (int round = 0; round < 20; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = unit_grid(env, 3, 3, false, false);
        for (uint32_t v = 0; v < mesh.vertex_count; v++)
            mesh.position[v] = qw_v3((float)(8 * (v % 4)), (float)(8 * (v / 4)), 0);
        qw_int2 *place = QW_NEW(env, qw_int2, mesh.vertex_count);
        for (uint32_t v = 0; v < mesh.vertex_count; v++)
            place[v] = (qw_int2){(int32_t)mesh.position[v].x, (int32_t)mesh.position[v].y};
        qw_offset_mesh m = unit_offsets(env, &mesh, place, &r);
        check_subdivision(env, &m);
        for (uint32_t e = 0; e < m.edge_count; e++) {
            uint32_t h = m.half[e];
            qw_vec3 asked = qw_add(qw_scale(m.axis[e], (float)m.d[e].x), qw_scale(m.side[e], (float)m.d[e].y));
            qw_vec3 is = qw_sub(m.position[m.corner[qw_next(h)]], m.position[m.corner[h]]);
            assert_true(qw_distance(asked, is) <
                        1.6f); /* halves are rounded; turned the wrong way it would be off by twice its length */
            assert_true(qw_length2(is) < 1.9f || qw_dot(asked, is) > 0);
        }
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* ---- orientation-preserving */

static bool edge_fine(const qw_offset_mesh *m, uint32_t e)
{
    return qw_int2_norm(m->d[e]) <= 1 && !((m->fixed[e] & QW_FIXED_X) && m->d[e].x) &&
           !((m->fixed[e] & QW_FIXED_Y) && m->d[e].y);
}

static bool no_inversions(const qw_offset_mesh *m)
{
    for (uint32_t e = 0; e < m->edge_count; e++)
        if (!edge_fine(m, e)) return false;
    return unit_inverted_area(m) == 0;
}

/* Regular offsets, none long, on the mesh: places drawn again until no edge is long. */
static qw_offset_mesh random_short(qw_env *env, const qw_trimesh *mesh, unit_rng *r)
{
    qw_int2 *place = QW_NEW_ZERO(env, qw_int2, mesh->vertex_count);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) place[v] = (qw_int2){0, 0};
    for (int i = 0; i < 400; i++) { /* a walk that never leaves what is allowed */
        uint32_t v = unit_random(r, mesh->vertex_count);
        qw_int2 old = place[v];
        place[v] = qw_int2_add(place[v], random_place(r, 1));
        for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
            if (qw_int2_norm(qw_int2_sub(place[mesh->corner[h]], place[mesh->corner[qw_next(h)]])) > 1) place[v] = old;
    }
    return unit_offsets(env, mesh, place, r);
}

static void constrain_some(qw_offset_mesh *m, unit_rng *r, uint32_t one_in)
{
    for (uint32_t e = 0; e < m->edge_count; e++) {
        if (m->d[e].x == 0 && unit_random(r, one_in) == 0) m->fixed[e] |= QW_FIXED_X;
        if (m->d[e].y == 0 && unit_random(r, one_in) == 0) m->fixed[e] |= QW_FIXED_Y;
    }
}

static void greedy_only_improves(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {17};
    int64_t moved = 0, solved = 0;
    for (int round = 0; round < 48; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = round % 2 ? unit_grid(env, 7, 6, false, false) : unit_sphere(env, 2);
        qw_offset_mesh m;
        if (round % 2) {
            m = random_short(env, &mesh, &r);
            if (round % 4 == 1) constrain_some(&m, &r, 8);
        } else {
            m = random_regular(env, &mesh, &r, 0);
            unit_add_cones(env, &m, &r, 3);
            for (int i = 0; i < 25; i++) m.d[unit_random(&r, m.edge_count)] = random_place(&r, 1);
            qw_make_regular(env, &m, QW_FLOW_MCF, false);
            qw_subdivide_long_edges(env, &m);
        }
        assert_regular(&m);
        int64_t before = unit_inverted_area(&m), area = qw_offset_count(&m).double_area;
        qw_inversion_counts c = {0};
        qw_remove_inversions_greedy(env, &m, &c);
        assert_regular(&m);
        for (uint32_t e = 0; e < m.edge_count; e++) assert_true(edge_fine(&m, e));
        int64_t after = unit_inverted_area(&m);
        assert_true(after <= before - c.moves);
        if (round % 2 == 0)
            assert_int_equal(qw_offset_count(&m).double_area, area); /* closed: moves cannot change the sum */
        int64_t inverted = qw_offset_count(&m).inverted_triangles;
        assert_int_equal(c.inverted_after_greedy, inverted);
        moved += c.moves;
        if (qw_sat_available()) {
            int64_t left = unit_inverted_area(&m);
            qw_remove_inversions_sat(env, &m, QW_SAT_FAR, &c);
            assert_regular(&m);
            for (uint32_t e = 0; e < m.edge_count; e++) assert_true(edge_fine(&m, e));
            assert_int_equal(c.inverted_after, qw_offset_count(&m).inverted_triangles);
            assert_true(c.inverted_after <= c.inverted_after_greedy);
            assert_true(c.inverted_after > 0 || unit_inverted_area(&m) == 0);
            solved += left > 0 && c.inverted_after == 0;
        }
        qw_scope_end(env);
    }
    assert_true(moved > 50);
    assert_true(!qw_sat_available() || solved > 3);
    qw_env_destroy(env);
}

/* Whether some choice of a step a vertex leaves no triangle inverted: every vertex 9 steps, by counting in base 9.
 * Frames must be straight. */
static bool any_steps(qw_env *env, const qw_offset_mesh *m)
{
    qw_offset_mesh t = qw_offset_copy(env, m);
    uint32_t total = 1;
    for (uint32_t v = 0; v < m->vertex_count; v++) total *= m->index[v] ? 1 : 9;
    qw_int2 *step = QW_NEW_ZERO(env, qw_int2, m->vertex_count);
    for (uint32_t k = 0; k < total; k++) {
        uint32_t rest = k;
        for (uint32_t v = 0; v < m->vertex_count; v++) {
            if (m->index[v]) continue;
            step[v] = (qw_int2){(int32_t)(rest % 9 % 3) - 1, (int32_t)(rest % 9 / 3) - 1};
            rest /= 9;
        }
        for (uint32_t e = 0; e < m->edge_count; e++) {
            uint32_t h = m->half[e];
            t.d[e] = qw_int2_add(m->d[e], qw_int2_sub(step[m->corner[qw_next(h)]], step[m->corner[h]]));
        }
        if (no_inversions(&t)) return true;
    }
    return false;
}

static void satisfiability_against_all_steps(void **state)
{
    (void)state;
    if (!qw_sat_available()) skip();
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {18};
    int yes = 0, no = 0;
    for (int round = 0; round < 400; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = unit_fan(env, 3 + (uint32_t)round % 2);
        qw_offset_mesh m = random_short(env, &mesh, &r);
        constrain_some(&m, &r, 2 + (uint32_t)round % 4);
        for (uint32_t v = 0; v < m.vertex_count; v++)
            m.index[v] = unit_random(&r, 4) < (uint32_t)round % 4; /* these must stay */
        /* the same in straight frames for the enumeration */
        qw_int2 *place = QW_NEW_ZERO(env, qw_int2, m.vertex_count);
        qw_offset_mesh plain = unit_offsets(env, &mesh, place, NULL);
        for (uint32_t e = 0; e < m.edge_count; e++) {
            unsigned turn = 0;
            while (qw_distance(qw_axis(qw_v3(1, 0, 0), qw_v3(0, 0, 1), turn), m.axis[e]) > 0.5f) turn++;
            if (m.half[e] != plain.half[e]) turn += 2;
            plain.d[e] = qw_turn(turn, m.d[e]);
            uint8_t bits = m.fixed[e];
            plain.fixed[e] = turn & 1u ? (uint8_t)((bits & 1) << 1 | bits >> 1) : bits;
        }
        memcpy(plain.index, m.index, m.vertex_count);
        qw_inversion_counts c = {.inverted_after = unit_inverted_area(&m)};
        if (c.inverted_after) {
            bool possible = any_steps(env, &plain);
            qw_remove_inversions_sat(env, &m, QW_SAT_FAR, &c);
            assert_int_equal(c.inverted_after == 0, possible);
            assert_int_equal(no_inversions(&m), possible);
            assert_regular(&m);
            yes += possible, no += !possible;
        }
        qw_scope_end(env);
    }
    assert_true(yes > 20);
    assert_true(no > 5);
    qw_env_destroy(env);
}

QW_TEST_SUITE(integer)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(collapses_and_expands),       cmocka_unit_test(networks_are_balanced),
        cmocka_unit_test(cheapest_on_tiny_meshes),     cmocka_unit_test(five_solvers),
        cmocka_unit_test(wild_offsets_become_regular), cmocka_unit_test(subdivides),
        cmocka_unit_test(greedy_only_improves),        cmocka_unit_test(satisfiability_against_all_steps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

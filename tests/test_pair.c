/* Contraction that keeps the topology, pairs of any triangles, and what is made of both. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quads/contract.h"
#include "remesh/quads/extract.h"
#include "remesh/quads/pair.h"
#include "remesh/quads/topology.h"

/* ---- topology of an edited triangle mesh, by counting */

typedef struct kinship {
    int64_t euler, loops, components;
} kinship;

static kinship of_triangles(qw_env *env, const qw_trimesh *m)
{
    qw_census c = qw_trimesh_census(env, m);
    return (kinship){c.euler, c.boundary_loops, c.components};
}

static kinship of_edit(qw_env *env, qw_edit *e)
{
    float *target;
    qw_edit_pack(e);
    qw_trimesh m = qw_edit_close(e, &target);
    qw_trimesh_validate(env, &m); /* no two edges on the same vertices either: they could not be linked */
    return of_triangles(env, &m);
}

static void assert_same(kinship a, kinship b)
{
    assert_int_equal(a.euler, b.euler);
    assert_int_equal(a.loops, b.loops);
    assert_int_equal(a.components, b.components);
}

static void assert_good_quads(qw_env *env, const qw_quadmesh *q, kinship want)
{
    qw_quadmesh_validate(env, q);
    qw_quad_census c = qw_quadmesh_census(env, q);
    assert_int_equal(c.vertices, q->vertex_count);
    assert_int_equal(c.double_edges + c.degenerate_faces, 0);
    assert_same((kinship){c.euler, c.boundary_loops, c.components}, want);
}

static qw_trimesh random_shape(qw_env *env, unit_rng *r)
{
    uint32_t a = unit_random(r, 8), b = unit_random(r, 5);
    switch (unit_random(r, 7)) {
    case 0: return unit_grid(env, 1 + a, 1 + b, false, false);
    case 1: return unit_torus(env, 3 + a, 3 + b, 0.4f);
    case 2: return unit_cylinder(env, 3 + a, 1 + b, 2);
    case 3: return unit_sphere(env, b % 3);
    case 4: return unit_fan(env, 3 + a);
    case 5: return unit_cube(env, 1 + b % 3);
    default: return unit_triangle(env);
    }
}

static qw_edit open_edit(qw_env *env, const qw_trimesh *m)
{
    float *target = QW_NEW_ZERO(env, float, m->vertex_count);
    qw_edit e = qw_edit_open(env, m, target, qw_trimesh_outgoing(env, m));
    for (uint32_t v = 0; v < m->vertex_count; v++) e.vertex[v].home = 0;
    return e;
}

/* ---- pairs */

/* Triangulates at random: flips that are allowed. */
static void shuffle(qw_edit *e, unit_rng *r)
{
    for (uint32_t k = 0; k < 4 * e->face_count; k++) {
        uint32_t h = 4 * unit_random(r, e->face_count);
        h += unit_random(r, 3);
        if (qw_edit_twin(e, h) != QW_NONE && qw_edit_can_flip(e, h)) qw_edit_flip(e, h);
    }
}

static int64_t marked_length(const qw_edit *e)
{
    int64_t n = 0;
    for (uint32_t f = 0; f < e->face_count; f++)
        for (uint32_t i = 0; i < 3 && !qw_edit_dead(e, f); i++) n += e->face[f].mark[i];
    return n;
}

static void mark_at_random(qw_edit *e, unit_rng *r, uint32_t one_in)
{
    for (uint32_t h = 0; h < 4 * e->face_count; h++) {
        if ((h & 3) == 3 || qw_edit_twin(e, h) == QW_NONE || qw_edit_twin(e, h) < h || unit_random(r, one_in)) continue;
        uint32_t t = qw_edit_twin(e, h);
        e->face[h >> 2].mark[h & 3] = e->face[t >> 2].mark[t & 3] = 1;
        e->vertex[qw_edit_tail(e, h)].kind = e->vertex[qw_edit_head(e, h)].kind = QW_VERTEX_CURVE;
    }
}

/* Any triangles with any marks: all are paired, but where there are so few that two quads must share all their corners.
 */
static void pairs_anything(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {41};
    qw_pair_counts all = {0};
    int64_t left = 0, meshes = 0;
    for (int round = 0; round < 600; round++) {
        qw_scope_begin(env);
        qw_trimesh m = random_shape(env, &r);
        kinship want = of_triangles(env, &m);
        qw_edit e = open_edit(env, &m);
        if (round & 1) shuffle(&e, &r);
        if (round & 2) mark_at_random(&e, &r, 2 + unit_random(&r, 8));
        uint8_t *across = QW_NEW_ZERO(env, uint8_t, (size_t)4 * e.face_count);
        for (uint32_t h = 0; h < 4 * e.face_count; h++)
            across[h] = (round & 4) != 0 && (h & 3) == 0 && unit_random(&r, 2);
        qw_pair_counts c = {0};
        uint32_t *vertex_of;
        qw_quadmesh q = qw_pair_triangles(env, &e, across, &vertex_of, &c);
        meshes++;
        left += c.unpaired > 0;
        if (c.unpaired == 0 && e.live_faces > 12) {
            qw_quadmesh_validate(env, &q);
            assert_int_equal(2 * q.face_count, e.live_faces);
            assert_good_quads(env, &q, want);
            for (uint32_t v = 0; v < q.vertex_count; v++) assert_int_equal(q.kind[v], e.vertex[vertex_of[v]].kind);
        }
        assert_true(c.unpaired == 0 || e.live_faces <= 12);
        qw_quadmesh cut = qw_cut_triangles(env, &e);
        assert_int_equal(cut.face_count, 3 * e.live_faces);
        assert_good_quads(env, &cut, want);
        assert_same(of_edit(env, &e), want);
        all.given += c.given, all.taken += c.taken, all.split_edges += c.split_edges;
        all.walks += c.walks, all.steps += c.steps, all.flips += c.flips;
        qw_scope_end(env);
    }
    /* every way to a pair was gone */
    assert_true(all.given > 100 && all.taken > 100 && all.split_edges > 100 && all.walks > 100 && all.steps > 100 &&
                all.flips > 10);
    assert_true(left * 20 < meshes);
    qw_env_destroy(env);
}

/* A marked edge stays an edge, or becomes two, unless a walk had no other way. */
static void pairs_along_curves(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {42};
    for (int round = 0; round < 60; round++) {
        qw_scope_begin(env);
        qw_trimesh m = unit_grid(env, 9, 9, false, round & 1);
        qw_edit e = open_edit(env, &m);
        for (uint32_t h = 0; h < 3 * m.face_count; h++) { /* one column of edges, and a bit of a row */
            uint32_t a = m.corner[h], b = m.corner[qw_next(h)], t = m.twin[h];
            if (t == QW_NONE ||
                !((a % 10 == 4 && b % 10 == 4) || (a / 10 == 5 && b / 10 == 5 && a % 10 < 4 && b % 10 < 4)))
                continue;
            e.face[h / 3].mark[h % 3] = 1;
            e.vertex[a].kind = e.vertex[b].kind = QW_VERTEX_CURVE;
        }
        for (uint32_t k = 0; k < 300; k++) {
            uint32_t h = 4 * unit_random(&r, e.face_count);
            h += unit_random(&r, 3);
            if (!qw_edit_on_curve(&e, h) && qw_edit_can_flip(&e, h)) qw_edit_flip(&e, h);
        }
        qw_pair_counts c = {0};
        uint32_t *vertex_of;
        qw_quadmesh q = qw_pair_triangles(env, &e, NULL, &vertex_of, &c);
        assert_int_equal(c.unpaired, 0);
        int64_t marked = 0;
        for (uint32_t h = 0; h < 4 * q.face_count; h++) marked += q.mark[h];
        assert_int_equal(marked, marked_length(&e)); /* none lies inside a quad */
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* ---- contraction */

/* Steps between random whole places of the vertices: zero, orientation-preserving, inverted and longer than 1 in any
 * mix. */
static void random_steps(const qw_trimesh *mesh, qw_offset_mesh *m, unit_rng *r, qw_int2 *place)
{
    int32_t spread = 1 + (int32_t)unit_random(r, 3);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        qw_vec3 p = qw_scale(mesh->position[v], (float)spread);
        int32_t x = unit_between(r, 0, spread), y = unit_between(r, 0, spread);
        place[v] = unit_random(r, 4) ? (qw_int2){(int32_t)floorf(p.x), (int32_t)floorf(p.y)} : (qw_int2){x, y};
    }
    for (uint32_t e = 0; e < m->edge_count; e++) {
        qw_int2 a = place[m->corner[m->half[e]]], b = place[m->corner[qw_next(m->half[e])]];
        m->d[e] = (qw_int2){b.x - a.x, b.y - a.y};
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        m->constraint[v] = unit_random(r, 8) == 0 ? (uint8_t)(1 + unit_random(r, 2)) : 0;
}

static void contracts_and_keeps(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {43};
    int64_t before = 0, after = 0, broken = 0;
    for (int round = 0; round < 500; round++) {
        qw_scope_begin(env);
        qw_trimesh mesh = random_shape(env, &r);
        kinship want = of_triangles(env, &mesh);
        qw_offset_mesh m = unit_offsets(env, &mesh, NULL, NULL);
        random_steps(&mesh, &m, &r, QW_NEW(env, qw_int2, mesh.vertex_count));
        for (uint32_t h = 0; h < 3 * mesh.face_count; h++)
            if (mesh.twin[h] != QW_NONE && mesh.twin[h] < h && unit_random(&r, 10) == 0)
                m.mark[h] = m.mark[mesh.twin[h]] = 1;
        uint32_t *component = QW_NEW_ZERO(env, uint32_t, mesh.face_count), *vertex_of;
        uint8_t one = 1, *hypotenuse;
        qw_edit e = qw_contract(env, &m, component, &one, &hypotenuse, &vertex_of);
        before += mesh.face_count, after += e.live_faces;
        for (uint32_t v = 0; v < mesh.vertex_count; v++) {
            assert_true(vertex_of[v] < e.vertex_count && e.vertex[vertex_of[v]].out != QW_NONE);
            assert_true(e.vertex[vertex_of[v]].kind >= m.constraint[v]);
        }
        assert_same(of_edit(env, &e), want);
        /* and the whole way, from what extraction makes of it */
        qw_extraction x = qw_extract_quads(env, &m);
        qw_topology_check check = qw_check_topology(env, &x.quads, &mesh);
        if (check.broken_count) {
            qw_replacement n = qw_replace_components(env, &x.quads, &m, &x, x.quads.position, &check);
            qw_quadmesh q = n.quads;
            assert_good_quads(env, &q, want);
            check = qw_check_topology(env, &q, &mesh);
            assert_int_equal(check.broken_count, 0);
            assert_true(n.cut_components == 0 || e.live_faces <= 12);
            broken++;
        }
        qw_scope_end(env);
    }
    assert_true(after * 2 < before);
    assert_true(broken > 100);
    qw_env_destroy(env);
}

/* Two tetrahedra, all steps zero, and a plate: four triangles make two quads on the same corners, so they are cut. */
static void cuts_what_is_too_small(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh parts[] = {unit_tetrahedron(env), unit_grid(env, 3, 3, false, false), unit_tetrahedron(env)}, mesh = {0};
    mesh = unit_mesh(env, 4 + 16 + 4, 4 + 18 + 4);
    for (uint32_t i = 0, v = 0, f = 0; i < 3; v += parts[i].vertex_count, f += parts[i].face_count, i++) {
        memcpy(mesh.position + v, parts[i].position, parts[i].vertex_count * sizeof *mesh.position);
        for (uint32_t h = 0; h < 3 * parts[i].face_count; h++) mesh.corner[3 * f + h] = v + parts[i].corner[h];
    }
    qw_trimesh_link(env, &mesh);
    qw_offset_mesh m = unit_offsets(env, &mesh, NULL, NULL);
    memset(m.d, 0, m.edge_count * sizeof *m.d);
    qw_extraction x = qw_extract_quads(env, &m);
    assert_int_equal(x.quads.face_count, 0);
    qw_topology_check check = qw_check_topology(env, &x.quads, &mesh);
    assert_int_equal(check.broken_count, 3);
    qw_replacement n = qw_replace_components(env, &x.quads, &m, &x, x.quads.position, &check);
    qw_quadmesh q = n.quads;
    assert_int_equal(n.cut_components, 2);
    assert_good_quads(env, &q, of_triangles(env, &mesh));
    check = qw_check_topology(env, &q, &mesh);
    assert_int_equal(check.broken_count, 0);
    uint32_t faces[3] = {0};
    for (uint32_t f = 0; f < q.face_count; f++) faces[q.component[q.corner[4 * f]]]++;
    assert_int_equal(faces[0], 12);
    assert_int_equal(faces[2], 12);
    assert_true(faces[1] >= 1 && faces[1] <= 3); /* a disc of few triangles */
    qw_env_destroy(env);
}

/* A tetrahedron, all steps zero: whatever order its vertices come in, its corners are what is left. */
static void keeps_corners_apart(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {61};
    for (int round = 0; round < 100; round++) {
        qw_scope_begin(env);
        qw_trimesh coarse = unit_tetrahedron(env), once = unit_quarter(env, &coarse), mesh = unit_quarter(env, &once);
        uint32_t n = mesh.vertex_count, *name = QW_NEW(env, uint32_t, n),
                 *component = QW_NEW_ZERO(env, uint32_t, mesh.face_count), *vertex_of;
        for (uint32_t v = 0; v < n; v++) {
            uint32_t k = unit_random(&r, v + 1);
            name[v] = name[k], name[k] = v;
        }
        qw_vec3 *position = QW_NEW(env, qw_vec3, n);
        for (uint32_t v = 0; v < n; v++) position[name[v]] = mesh.position[v];
        for (uint32_t h = 0; h < 3 * mesh.face_count; h++) mesh.corner[h] = name[mesh.corner[h]];
        mesh.position = position;
        qw_trimesh_link(env, &mesh);
        qw_offset_mesh m = unit_offsets(env, &mesh, NULL, NULL);
        memset(m.d, 0, m.edge_count * sizeof *m.d);
        for (uint32_t h = 0; h < 3 * mesh.face_count; h++) {
            if (qw_dot(qw_normalize(qw_face_cross(&mesh, h / 3)),
                       qw_normalize(qw_face_cross(&mesh, mesh.twin[h] / 3))) > 0.9f)
                continue;
            m.mark[h] = 1;
            if (m.constraint[mesh.corner[h]] == QW_VERTEX_FREE) m.constraint[mesh.corner[h]] = QW_VERTEX_CURVE;
        }
        for (uint32_t v = 0; v < 4; v++) m.constraint[name[v]] = QW_VERTEX_CORNER;
        uint8_t one = 1, *hypotenuse;
        qw_edit e = qw_contract(env, &m, component, &one, &hypotenuse, &vertex_of);
        assert_int_equal(e.live_faces, 4);
        for (uint32_t v = 0; v < 4; v++) {
            assert_int_equal(e.vertex[vertex_of[name[v]]].kind, QW_VERTEX_CORNER);
            assert_true(qw_distance(e.vertex[vertex_of[name[v]]].position, coarse.position[v]) == 0);
        }
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* Quads on five vertices of which each edge joins other two. */
static qw_quadmesh five_vertices(qw_env *env, uint32_t faces, const uint32_t *corner)
{
    qw_quadmesh q = {.vertex_count = 5,
                     .face_count = faces,
                     .position = QW_NEW_ZERO(env, qw_vec3, 5),
                     .corner = QW_NEW(env, uint32_t, 4 * faces)};
    q.twin = QW_NEW_ZERO(env, uint32_t, 4 * faces), q.component = QW_NEW_ZERO(env, uint32_t, 5);
    memcpy(q.corner, corner, 4 * faces * sizeof *corner);
    for (uint32_t h = 0; h < 4 * faces; h++)
        for (uint32_t g = 0; g < 4 * faces; g++)
            if (corner[h] == corner[qw_quad_next(g)] && corner[g] == corner[qw_quad_next(h)]) q.twin[h] = g;
    return q;
}

/* Three quads on five vertices have the topology of a sphere, but three of their vertices have two edges. Five on five
 * are a torus, and all have four. */
static void shells_have_six(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    static const uint32_t of_pillow[] = {0, 2, 1, 3, 0, 3, 1, 4, 0, 4, 1, 2};
    static const uint32_t of_ring[] = {0, 1, 3, 2, 1, 2, 4, 3, 2, 3, 0, 4, 3, 4, 1, 0, 4, 0, 2, 1};
    qw_trimesh sphere = unit_tetrahedron(env), torus = unit_torus(env, 8, 6, 0.4f);
    qw_quadmesh pillow = five_vertices(env, 3, of_pillow), ring = five_vertices(env, 5, of_ring);
    assert_true(qw_quad_is_small_shell(&pillow, 0, 3) && !qw_quad_is_small_shell(&pillow, 0, 2));
    assert_int_equal(qw_check_topology(env, &pillow, &sphere).broken_count, 1);
    qw_quadmesh_validate(env, &ring);
    assert_int_equal(qw_quadmesh_census(env, &ring).irregular, 0);
    assert_int_equal(qw_check_topology(env, &ring, &torus).broken_count, 0);
    qw_env_destroy(env);
}

/* Where extraction is right, the contraction has the same quads. */
static void contracts_like_extraction(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_torus(env, 60, 24, 0.4f), unit_cube(env, 4),
                           unit_cylinder(env, 40, 16, 2)};
    const float rho[] = {0.25f, 0.2f, 0.2f, 0.3f};
    for (int i = 0; i < 4; i++) {
        unit_fields u = unit_solve(env, meshes[i], rho[i], true);
        qw_inversion_counts up = {0};
        unit_remove_inversions(env, &u.offsets, &up);
        qw_extraction x = qw_extract_quads(env, &u.offsets);
        uint32_t *component = QW_NEW_ZERO(env, uint32_t, u.offsets.face_count), *vertex_of;
        uint8_t one = 1, *hypotenuse;
        qw_edit e = qw_contract(env, &u.offsets, component, &one, &hypotenuse, &vertex_of);
        qw_pair_counts c = {0};
        qw_quadmesh q = qw_pair_triangles(env, &e, hypotenuse, &vertex_of, &c);
        assert_int_equal(c.unpaired, 0);
        assert_true(c.given >= x.quads.face_count * 99 / 100);
        assert_true(q.face_count >= x.quads.face_count && q.face_count <= x.quads.face_count * 102 / 100);
        assert_good_quads(env, &q, of_triangles(env, &meshes[i]));
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(pair)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pairs_anything),
        cmocka_unit_test(pairs_along_curves),
        cmocka_unit_test(contracts_and_keeps),
        cmocka_unit_test(cuts_what_is_too_small),
        cmocka_unit_test(keeps_corners_apart),
        cmocka_unit_test(shells_have_six),
        cmocka_unit_test(contracts_like_extraction),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

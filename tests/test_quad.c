/* Quads from offsets made by hand, their repair, places and relaxation. */
#include "suite.h"
#include "unit_shapes.h"

#include "geometry/bvh.h"
#include "remesh/quads/extract.h"
#include "remesh/offsets/embedding.h"
#include "remesh/relax/relax.h"
#include "remesh/quads/repair.h"

/* A grid of three times as many cells, most without width: d is 1 from every third column or row to the next, else 0.
 */
static qw_offset_mesh lattice(qw_env *env, uint32_t nu, uint32_t nv, bool wrap_u, bool wrap_v, qw_trimesh *mesh)
{
    *mesh = unit_grid(env, 3 * nu, 3 * nv, wrap_u, wrap_v);
    qw_offset_mesh m = unit_offsets(env, mesh, NULL, NULL);
    uint32_t row = 3 * nu + !wrap_u, rows = 3 * nv + !wrap_v;
    for (uint32_t e = 0; e < m.edge_count; e++) {
        uint32_t h = m.half[e], u = m.corner[h], v = m.corner[qw_next(h)];
        uint32_t ux = u % row, vx = v % row, uy = u / row, vy = v / row;
        /* one step along each axis at most, forward or back, perhaps around the end */
        int32_t x = vx == (ux + 1) % row ? (ux % 3 == 0) : ux == (vx + 1) % row ? -(vx % 3 == 0) : 0;
        int32_t y = vy == (uy + 1) % rows ? (uy % 3 == 0) : uy == (vy + 1) % rows ? -(vy % 3 == 0) : 0;
        m.d[e] = (qw_int2){x, y};
    }
    unit_real_of(&m);
    assert_int_equal(qw_offset_count(&m).irregular_triangles, 0);
    return m;
}

static qw_quadmesh quads_of(qw_env *env, uint32_t nu, uint32_t nv, bool wrap_u, bool wrap_v)
{
    qw_trimesh mesh;
    qw_offset_mesh m = lattice(env, nu, nv, wrap_u, wrap_v, &mesh);
    qw_extraction x = qw_extract_quads(env, &m);
    assert_int_equal(x.unpaired, 0);
    qw_quadmesh_validate(env, &x.quads);
    return x.quads;
}

static void extracts_grids(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint32_t nu = 1; nu < 6; nu++)
        for (uint32_t nv = 1; nv < 6; nv++) {
            qw_quadmesh q = quads_of(env, nu, nv, false, false);
            qw_quad_census c = qw_quadmesh_census(env, &q);
            assert_int_equal(c.faces, nu * nv);
            assert_int_equal(c.vertices, (nu + 1) * (nv + 1));
            assert_int_equal(c.euler, 1);
            assert_int_equal(c.boundary_loops, 1);
            assert_int_equal(c.components, 1);
            assert_int_equal(c.irregular + c.double_edges + c.degenerate_faces, 0);
            if (nu < 3) continue;
            q = quads_of(env, nu, nv, true, false);
            c = qw_quadmesh_census(env, &q);
            assert_int_equal(c.faces, nu * nv);
            assert_int_equal(c.euler, 0);
            assert_int_equal(c.boundary_loops, 2);
            assert_int_equal(c.irregular + c.double_edges + c.degenerate_faces, 0);
            if (nv < 3) continue;
            q = quads_of(env, nu, nv, true, true);
            c = qw_quadmesh_census(env, &q);
            assert_int_equal(c.faces, nu * nv);
            assert_int_equal(c.vertices, nu * nv);
            assert_int_equal(c.euler + c.boundary_loops, 0);
            assert_int_equal(c.irregular + c.double_edges + c.degenerate_faces, 0);
        }
    qw_env_destroy(env);
}

/* Where nothing is inverted the quads have the surface's topology, are as many as was counted, and lack what the cones
 * say. */
static void extracts_from_fields(void **state)
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
        assert_int_equal(up.inverted_after, 0);
        qw_offset_counts counts = qw_offset_count(&u.offsets);
        qw_extraction x = qw_extract_quads(env, &u.offsets);
        qw_quadmesh_validate(env, &x.quads);
        assert_int_equal(x.unpaired, 0);
        assert_int_equal(2 * (int64_t)x.quads.face_count, counts.double_area);
        qw_quad_census c = qw_quadmesh_census(env, &x.quads);
        qw_census s = qw_trimesh_census(env, &meshes[i]);
        assert_int_equal(c.euler, s.euler);
        assert_int_equal(c.boundary_loops, s.boundary_loops);
        assert_int_equal(c.components, s.components);
        int64_t lack = 0;
        uint32_t *out = qw_quadmesh_outgoing(env, &x.quads);
        for (uint32_t v = 0; v < x.quads.vertex_count; v++) {
            bool on_boundary;
            int64_t valence = qw_quad_valence(&x.quads, out[v], &on_boundary);
            if (!on_boundary) lack += 4 - valence;
        }
        if (s.boundary_loops == 0) assert_int_equal(lack, counts.index_sum);
    }
    qw_env_destroy(env);
}

/* ---- census and validation against what is broken by hand */

typedef struct call {
    qw_env *env;
    const qw_quadmesh *mesh;
} call;

static void validate(void *user)
{
    call *c = user;
    qw_quadmesh_validate(c->env, c->mesh);
}

static void validates(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh q = quads_of(env, 3, 3, false, false);
    call c = {env, &q};
    assert_int_equal(qw_protect(env, validate, &c), QW_OK);
    uint32_t h = 0, old;
    while (q.twin[h] == QW_NONE) h++;
    old = q.twin[h], q.twin[h] = QW_NONE;
    assert_int_equal(qw_protect(env, validate, &c), QW_INTERNAL);
    q.twin[h] = old;
    old = q.corner[h], q.corner[h] = (old + 1) % q.vertex_count;
    assert_int_equal(qw_protect(env, validate, &c), QW_INTERNAL);
    q.corner[h] = q.vertex_count;
    assert_int_equal(qw_protect(env, validate, &c), QW_INTERNAL);
    q.corner[h] = old;
    assert_int_equal(qw_protect(env, validate, &c), QW_OK);
    /* two corners of the square glued to one vertex: two fans */
    uint32_t far_corner = q.corner[0];
    for (uint32_t k = 0; k < 36; k++)
        if (q.corner[k] == 15) q.corner[k] = far_corner == 15 ? 0 : far_corner;
    assert_int_equal(qw_protect(env, validate, &c), QW_INTERNAL);
    qw_env_destroy(env);
}

static void normals_of_quads(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_quadmesh q = quads_of(env, 3, 2, false, false);
    qw_vec3 *n = qw_quadmesh_vertex_normals(env, &q);
    for (uint32_t v = 0; v < q.vertex_count; v++) assert_true(n[v].z > 0.999f);
    qw_env_destroy(env);
}

/* ---- repair */

/* Whether an inner vertex that one edge joins to v has three edges or fewer. */
static bool has_poor_neighbour(const qw_quadmesh *m, const uint32_t *out, uint32_t v)
{
    bool poor = false, open;
    uint32_t h = out[v];
    do {
        uint32_t valence = qw_quad_valence(m, out[m->corner[qw_quad_next(h)]], &open);
        poor |= valence <= 3 && !open;
        h = qw_quad_around(m, h);
    } while (h != QW_NONE && h != out[v]);
    return poor;
}

static void assert_repaired(qw_env *env, const qw_quadmesh *from, qw_quadmesh *to, qw_repair_counts *counts)
{
    *counts = (qw_repair_counts){0};
    qw_quad_census before = qw_quadmesh_census(env, from);
    *to = qw_repair_quads(env, from, INT64_MAX / 2, counts);
    qw_quadmesh_validate(env, to);
    qw_quad_census after = qw_quadmesh_census(env, to);
    assert_int_equal(after.vertices, to->vertex_count);
    assert_int_equal(after.double_edges + after.degenerate_faces, 0);
    assert_int_equal(after.euler, before.euler);
    assert_int_equal(after.boundary_loops, before.boundary_loops);
    assert_int_equal(after.components, before.components);
    uint32_t *out = qw_quadmesh_outgoing(env, to);
    for (uint32_t v = 0; v < to->vertex_count; v++) {
        bool on_boundary;
        uint32_t valence = qw_quad_valence(to, out[v], &on_boundary);
        assert_true(on_boundary || valence > 2 || (valence == 2 && (to->kind[v] || has_poor_neighbour(to, out, v))));
    }
}

/* Tubes and tori of one and two quads around become three around: no more rows than that takes. */
static void repairs_thin_tubes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint32_t around = 1; around < 4; around++)
        for (uint32_t along = 3; along < 6; along++)
            for (int closed = 0; closed < 2; closed++) {
                qw_quadmesh q = quads_of(env, around, along, true, closed), fixed;
                qw_repair_counts counts;
                assert_int_equal(q.face_count, around * along);
                qw_quad_census c = qw_quadmesh_census(env, &q);
                assert_int_equal(c.double_edges > 0, around < 3);
                assert_repaired(env, &q, &fixed, &counts);
                assert_int_equal(fixed.face_count, 3 * along);
                assert_int_equal(counts.split_chords, 3 - around);
            }
    for (int64_t room = 0; room < 5;
         room++) { /* a chord for which there is no room stays whole, and inner vertices are split */
        qw_quadmesh q = quads_of(env, 2, 4, true, false);
        qw_repair_counts counts = {0};
        qw_quadmesh separated = qw_repair_quads(env, &q, room, &counts);
        assert_int_equal(counts.split_chords, room == 4);
        if (room == 4) assert_int_equal(separated.face_count, 12);
        assert_true(separated.face_count > 8 && separated.face_count <= 12);
        assert_true(qw_quadmesh_double_edges(env, &separated, NULL) < qw_quadmesh_double_edges(env, &q, NULL));
    }
    qw_quadmesh q = quads_of(env, 1, 1, true, true), fixed; /* one quad, every side glued to its opposite */
    qw_repair_counts counts;
    assert_repaired(env, &q, &fixed, &counts);
    assert_int_equal(fixed.face_count, 9);
    qw_env_destroy(env);
}

/* A quad mesh with room to be cut about. */
static qw_quadmesh roomy(qw_env *env, const qw_quadmesh *q, uint32_t more)
{
    qw_quadmesh m = *q;
    size_t n = q->vertex_count + more, sides = 4 * ((size_t)q->face_count + more);
    m.position = QW_NEW_ZERO(env, qw_vec3, n), m.kind = QW_NEW_ZERO(env, uint8_t, n);
    m.corner = QW_NEW(env, uint32_t, sides), m.twin = QW_NEW(env, uint32_t, sides),
    m.mark = QW_NEW_ZERO(env, uint8_t, sides);
    m.component = NULL; /* repair puts all in one */
    memcpy(m.position, q->position, q->vertex_count * sizeof *m.position);
    memcpy(m.corner, q->corner, 4 * q->face_count * sizeof *m.corner);
    memcpy(m.twin, q->twin, 4 * q->face_count * sizeof *m.twin);
    return m;
}

static void join(qw_quadmesh *m, uint32_t a, uint32_t b)
{
    if (a != QW_NONE) m->twin[a] = b;
    if (b != QW_NONE) m->twin[b] = a;
}

/* The quad (a, b, c, d) of half-edge h becomes (a, b, c, v) and (a, v, c, d). */
static void insert_doublet(qw_quadmesh *m, uint32_t h)
{
    uint32_t h1 = qw_quad_next(h), h2 = qw_quad_next(h1), h3 = qw_quad_next(h2), v = m->vertex_count++,
             g = 4 * m->face_count++;
    uint32_t a = m->corner[h], c = m->corner[h2], d = m->corner[h3], t2 = m->twin[h2], t3 = m->twin[h3];
    m->position[v] = qw_lerp(m->position[a], m->position[c], 0.5f);
    m->corner[h3] = v;
    m->corner[g] = a, m->corner[g + 1] = v, m->corner[g + 2] = c, m->corner[g + 3] = d;
    if (t2 == h3) t2 = g + 3, t3 = g + 2; /* the two sides were glued to one another */
    join(m, g + 2, t2), join(m, g + 3, t3);
    join(m, h2, g + 1), join(m, h3, g);
}

/* The edge of h opens and a quad (v, a, x, a) goes in between, its sides at v glued to one another. */
static void insert_spike(qw_quadmesh *m, uint32_t h, uint8_t kind)
{
    uint32_t t = m->twin[h], v = m->vertex_count++, g = 4 * m->face_count++, a = m->corner[h],
             x = m->corner[qw_quad_next(h)];
    m->position[v] = qw_lerp(m->position[a], m->position[x], 0.5f);
    m->kind[v] = kind;
    m->corner[g] = v, m->corner[g + 1] = a, m->corner[g + 2] = x, m->corner[g + 3] = a;
    join(m, g, g + 3);
    join(m, g + 1, t), join(m, g + 2, h); /* h runs a -> x, g + 2 runs x -> a; t runs x -> a, g + 1 runs a -> x */
}

static void repairs_doublets_and_spikes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {21};
    for (int round = 0; round < 200; round++) {
        qw_scope_begin(env);
        qw_quadmesh base = quads_of(env, 3 + unit_random(&r, 2), 3, round & 1, round & 2), m = roomy(env, &base, 12),
                    fixed;
        uint32_t inserted = 1 + unit_random(&r, round < 100 ? 1 : 12);
        for (uint32_t k = 0; k < inserted; k++) {
            uint32_t h = unit_random(&r, 4 * m.face_count);
            if (m.twin[h] != QW_NONE && unit_random(&r, 2))
                insert_spike(&m, h, (uint8_t)unit_random(&r, 3)); /* a spike goes even where a curve holds it */
            else insert_doublet(&m, h);
        }
        qw_quadmesh_validate(env, &m);
        qw_repair_counts counts;
        assert_repaired(env, &m, &fixed, &counts);
        if (round < 100 && (round & 3) == 3) { /* a torus and one insertion: just what it was */
            assert_int_equal(fixed.face_count, base.face_count);
            assert_int_equal(fixed.vertex_count, base.vertex_count);
            assert_int_equal(counts.doublets, 1);
        }
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* Doublets that go make no others, which would go on from the tip of a protrusion until there is none. */
static void protrusions_are_not_unzipped(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {29};
    for (int round = 0; round < 1000; round++) {
        qw_scope_begin(env);
        qw_quadmesh m = unit_quad_sphere(env, &r, 8 + unit_random(&r, 40));
        uint32_t *out = qw_quadmesh_outgoing(env, &m), doublets = 0;
        bool open;
        for (uint32_t v = 0; v < m.vertex_count; v++) doublets += qw_quad_valence(&m, out[v], &open) <= 2;
        qw_repair_counts counts = {0};
        qw_quadmesh fixed = qw_repair_quads(env, &m, 0, &counts);
        assert_true(counts.doublets <= doublets);
        assert_true(fixed.face_count + doublets >= m.face_count);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* ---- positions */

/* Places of the quads' vertices by Eq. (9). */
static qw_vec3 *places_of(qw_env *env, const qw_offset_mesh *m, const qw_extraction *x, qw_embedding_counts *counts)
{
    qw_vec3 *place = qw_solve_embedding(env, m, x->class_of, 1e-4, counts),
            *p = QW_NEW(env, qw_vec3, x->quads.vertex_count);
    for (uint32_t v = 0; v < x->quads.vertex_count; v++) p[v] = place[x->vertex_class[v]];
    return p;
}

static void places_a_plane(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_rng r = {22};
    qw_trimesh mesh;
    qw_offset_mesh m = lattice(env, 12, 9, false, false, &mesh);
    for (uint32_t v = 0; v < m.vertex_count; v++) { /* the sizes say 1; the places are about that, and disturbed */
        m.position[v] = qw_v3((float)(v % 37) / 3 + 0.2f * unit_real(&r), (float)(v / 37) / 3 + 0.2f * unit_real(&r),
                              0);
        m.size[v] = 1;
    }
    qw_extraction x = qw_extract_quads(env, &m);
    qw_embedding_counts counts = {0};
    qw_vec3 *p = places_of(env, &m, &x, &counts);
    assert_true(counts.residual <= 1e-4);
    assert_true(counts.energy_after < 1e-4 && counts.energy_after < 0.01 * counts.energy_before);
    for (uint32_t h = 0; h < 4 * x.quads.face_count; h++) {
        float length = qw_distance(p[x.quads.corner[h]], p[x.quads.corner[qw_quad_next(h)]]);
        assert_true(fabsf(length - 1) < 0.03f);
    }
    qw_env_destroy(env);
}

static void places_on_curves(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh mesh = unit_cube(env, 4);
    unit_fields u = unit_solve(env, mesh, 0.2f, true);
    qw_inversion_counts up = {0};
    unit_remove_inversions(env, &u.offsets, &up);
    qw_extraction x = qw_extract_quads(env, &u.offsets);
    qw_embedding_counts counts = {0};
    qw_vec3 *p = places_of(env, &u.offsets, &x, &counts);
    assert_true(counts.residual <= 1e-4);
    assert_true(counts.energy_after <= counts.energy_before);
    uint32_t corners = 0, curves = 0;
    for (uint32_t v = 0; v < x.quads.vertex_count; v++) {
        int at_end = 0;
        for (int k = 0; k < 3; k++) at_end += fabsf((&p[v].x)[k]) < 1e-5f || fabsf((&p[v].x)[k] - 1) < 1e-5f;
        assert_true(at_end >= (x.quads.kind[v] == QW_VERTEX_CORNER ? 3 : x.quads.kind[v] == QW_VERTEX_CURVE ? 2 : 0));
        corners += x.quads.kind[v] == QW_VERTEX_CORNER, curves += x.quads.kind[v] == QW_VERTEX_CURVE;
    }
    assert_int_equal(corners, 8);
    assert_int_equal(curves, 12 * 4); /* five quads to an edge */
    uint32_t marked = 0;
    for (uint32_t h = 0; h < 4 * x.quads.face_count; h++) marked += x.quads.mark[h];
    assert_int_equal(marked, 2 * 12 * 5);
    qw_env_destroy(env);
}

/* ---- relaxation */

/* Root mean square of the corners' distance from a right angle, degrees; *flips: corners over 180 degrees as seen from
 * outside. */
static double angle_error(const qw_quadmesh *q, const qw_vec3 *p, qw_vec3 (*outside)(qw_vec3 at), uint32_t *flips)
{
    double sum = 0;
    *flips = 0;
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        qw_vec3 at = p[q->corner[h]], a = qw_sub(p[q->corner[qw_quad_next(h)]], at),
                b = qw_sub(p[q->corner[qw_quad_prev(h)]], at);
        double angle = atan2(qw_length(qw_cross(a, b)), qw_dot(a, b)) * 57.29578 - 90;
        sum += angle * angle;
        *flips += qw_dot(qw_cross(a, b), outside(at)) <= 0;
    }
    return sqrt(sum / (4.0 * q->face_count));
}

static qw_vec3 up(qw_vec3 at)
{
    (void)at;
    return qw_v3(0, 0, 1);
}

static qw_vec3 from_center(qw_vec3 at) { return at; }

static qw_vec3 from_cube(qw_vec3 at) { return qw_sub(at, qw_v3(0.5f, 0.5f, 0.5f)); }

/* A square plate, its quads disturbed by up to `by` of an edge: inner vertices in the plane, those on the sides along
 * them. */
static void relaxes_a_plate(void **state)
{
    (void)state;
    unit_rng r = {23};
    for (int round = 0; round < 12; round++) {
        qw_env *env = qw_env_create(NULL, 1 + (uint32_t)round % 3);
        qw_trimesh plate = unit_grid(env, 30, 30, false, false);
        qw_quadmesh q = quads_of(env, 12, 12, false, false);
        float by = 0.06f * (float)(round + 1) / 12.0f;
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            qw_vec3 *p = &q.position[v], was = *p;
            was.x = roundf(was.x * 12) / 12, was.y = roundf(was.y * 12) / 12;
            bool ends_x = was.x < 0.01f || was.x > 0.99f, ends_y = was.y < 0.01f || was.y > 0.99f;
            q.kind[v] = ends_x && ends_y ? QW_VERTEX_CORNER : ends_x || ends_y ? QW_VERTEX_CURVE : QW_VERTEX_FREE;
            *p = was;
            if (!ends_x) p->x += by * unit_real(&r);
            if (!ends_y) p->y += by * unit_real(&r);
        }
        uint32_t flips_before, flips;
        double before = angle_error(&q, q.position, up, &flips_before);
        qw_vec3 *p = qw_relax_quads(env, &q, &plate, &(qw_relax_target){.evenness = QW_EVENNESS});
        double after = angle_error(&q, p, up, &flips);
        assert_true(after < 0.35 * before);
        assert_true(flips <= flips_before);
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            assert_true(fabsf(p[v].z) < 1e-5f);
            if (q.kind[v] == QW_VERTEX_CORNER) assert_memory_equal(&p[v], &q.position[v], sizeof *p);
            if (q.kind[v] != QW_VERTEX_CURVE) continue;
            float nearest = fminf(fminf(fabsf(p[v].x), fabsf(p[v].x - 1)), fminf(fabsf(p[v].y), fabsf(p[v].y - 1)));
            assert_true(nearest < 1e-5f);
        }
        qw_env_destroy(env);
    }
}

static void relaxes_whole_runs(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh meshes[] = {unit_sphere(env, 4), unit_cube(env, 4)};
    for (int i = 0; i < 2; i++) {
        unit_fields u = unit_solve(env, meshes[i], i ? 0.1f : 0.2f, true);
        qw_inversion_counts counts = {0};
        unit_remove_inversions(env, &u.offsets, &counts);
        assert_int_equal(counts.inverted_after, 0);
        qw_extraction x = qw_extract_quads(env, &u.offsets);
        qw_embedding_counts placed = {0};
        x.quads.position = places_of(env, &u.offsets, &x, &placed);
        qw_repair_counts repaired = {0};
        qw_quadmesh q = qw_repair_quads(env, &x.quads, INT64_MAX / 2, &repaired);
        uint32_t flips_before, flips;
        double before = angle_error(&q, q.position, i ? from_cube : from_center, &flips_before);
        qw_vec3 *p = qw_relax_quads(env, &q, &meshes[i], &(qw_relax_target){.evenness = QW_EVENNESS});
        double after = angle_error(&q, p, i ? from_cube : from_center, &flips);
        assert_true(after <= before + 0.1);
        assert_true(flips <= flips_before);
        const qw_bvh *tree = qw_bvh_build(env, &meshes[i]);
        for (uint32_t v = 0; v < q.vertex_count; v++) {
            qw_hit hit = qw_bvh_nearest(tree, p[v], qw_v3(0, 0, 0), -2, 10, QW_NONE);
            assert_true(hit.face != QW_NONE && qw_distance(hit.point, p[v]) < 1e-4f);
            if (q.kind[v] == QW_VERTEX_CORNER) assert_memory_equal(&p[v], &q.position[v], sizeof *p);
        }
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(quad)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(extracts_grids),
        cmocka_unit_test(extracts_from_fields),
        cmocka_unit_test(validates),
        cmocka_unit_test(normals_of_quads),
        cmocka_unit_test(repairs_thin_tubes),
        cmocka_unit_test(protrusions_are_not_unzipped),
        cmocka_unit_test(repairs_doublets_and_spikes),
        cmocka_unit_test(places_a_plane),
        cmocka_unit_test(places_on_curves),
        cmocka_unit_test(relaxes_a_plate),
        cmocka_unit_test(relaxes_whole_runs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

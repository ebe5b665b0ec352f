/* Surfaces of several parts of very different sizes and shapes: each stays on its own surface, and each gets the quads
 * that it needs. */
#include "suite.h"
#include "torture_shapes.h"
#include "unit_shapes.h"

#include "remesh/sizes/shares.h"
#include "remesh/working/working.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

/* The first shape and the second, which is scaled and moved and freed. */
static void add_part(shape *all, shape part, double scale, double x, double y, double z)
{
    uint32_t first = all->vertex_count, faces = all->face_count;
    double to[3] = {x, y, z};
    all->vertex_count += part.vertex_count, all->face_count += part.face_count;
    all->position = realloc(all->position, 3 * (size_t)all->vertex_count * sizeof *all->position);
    all->corner = realloc(all->corner, 3 * (size_t)all->face_count * sizeof *all->corner);
    for (uint32_t i = 0; i < 3 * part.vertex_count; i++)
        all->position[3 * (size_t)first + i] = scale * part.position[i] + to[i % 3];
    for (uint32_t i = 0; i < 3 * part.face_count; i++) all->corner[3 * (size_t)faces + i] = first + part.corner[i];
    shape_free(&part);
}

/* The part of each vertex, by the order in which the faces come to them: uint32_t[vertex_count], the caller's. */
static uint32_t *parts_of(const qw_mesh_view *m)
{
    uint32_t *part = malloc(m->vertex_count * sizeof *part);
    for (uint32_t v = 0; v < m->vertex_count; v++) part[v] = v;
    for (bool changed = true; changed;) {
        changed = false;
        for (uint32_t f = 0; f < m->face_count; f++) {
            const uint32_t *c = m->corners + (size_t)m->uniform_face_size * f;
            uint32_t least = part[c[0]];
            for (uint32_t i = 1; i < m->uniform_face_size; i++) least = part[c[i]] < least ? part[c[i]] : least;
            for (uint32_t i = 0; i < m->uniform_face_size; i++)
                if (part[c[i]] != least) part[c[i]] = least, changed = true;
        }
    }
    return part;
}

static qw_result *remesh(const shape *s, const qw_options *options)
{
    qw_mesh_view view = shape_view(s);
    qw_result *result;
    if (qw_remesh(&view, options, NULL, &result) != QW_OK) fail_msg("%s", qw_result_message(result));
    return result;
}

/* ---- parts that touch */

/* A head, higher than wide, and two eyes of radius 0.2 that are half sunk into it. */
static void eyes_stay_in_their_place(void **state)
{
    (void)state;
    static const double eye[2][3] = {{0.314, 0.21, 0.785}, {-0.314, 0.21, 0.785}};
    for (int64_t faces = 60; faces <= 120; faces += 20) {
        shape all = {0};
        qw_options o;
        qw_options_init(&o);
        o.faces = faces, o.fit = 0;
        add_part(&all, shape_sphere(11), 1, 0, 0, 0);
        for (uint32_t v = 0; v < all.vertex_count; v++) all.position[3 * (size_t)v + 1] *= 1.3;
        for (int i = 0; i < 2; i++) add_part(&all, shape_sphere(8), 0.2, eye[i][0], eye[i][1], eye[i][2]);
        qw_result *result = remesh(&all, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        uint32_t *part = parts_of(&quads);
        for (uint32_t v = 0; v < quads.vertex_count; v++) {
            double least = 10, middle[3] = {0}, count = 0;
            for (uint32_t u = 0; u < quads.vertex_count; u++)
                for (int k = 0; k < 3 && part[u] == part[v]; k++)
                    middle[k] += quads.positions[3 * (size_t)u + (size_t)k], count += 1.0 / 3;
            for (int k = 0; k < 3; k++) middle[k] /= count;
            if (fabs(middle[2]) < 0.4) continue; /* the head */
            for (int i = 0; i < 2; i++) {
                const double *p = quads.positions + 3 * (size_t)v;
                least = fmin(least,
                             sqrt(pow(p[0] - eye[i][0], 2) + pow(p[1] - eye[i][1], 2) + pow(p[2] - eye[i][2], 2)));
            }
            if (least > 1.02 * 0.2) fail_msg("at %d quads a vertex of an eye is %g radii out", (int)faces, least / 0.2);
        }
        free(part), qw_result_destroy(result), shape_free(&all);
    }
}

/* The working mesh, whose faces lie along a curve through space, has components by the numbers of the surface. */
static void components_keep_their_numbers(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    static const float x[3] = {8, 0, 4};
    qw_trimesh all = {0};
    for (int i = 0; i < 3; i++) {
        qw_trimesh part = unit_slab(env, 2, 2, "####");
        for (uint32_t v = 0; v < part.vertex_count; v++) part.position[v].x += i ? x[i] - 9 : x[0]; /* of unit_both */
        all = i ? unit_both(env, &all, &part) : part;
    }
    float *size = QW_NEW(env, float, all.vertex_count);
    for (uint32_t v = 0; v < all.vertex_count; v++) size[v] = 0.4f;
    qw_census before = qw_trimesh_census(env, &all);
    qw_working working = qw_working_mesh(env, &all, &before, size, NULL);
    qw_census after = qw_trimesh_census(env, &working.mesh);
    assert_int_equal(before.components, 3);
    assert_int_equal(after.components, 3);
    for (uint32_t f = 0; f < working.mesh.face_count; f++) {
        float at = working.mesh.position[working.mesh.corner[3 * (size_t)f]].x - x[after.component[f]];
        assert_true(at > -0.5f && at < 2.5f);
    }
    qw_trimesh_validate(env, &working.mesh);
    qw_env_destroy(env);
}

/* ---- who gets how many */

/* Of a crowd only what gets next to no quads is made as a box of six: the largest component, one whose share is more,
   and one with a handle, which no box has, are left to the fields. */
static void crowds_leave_the_others(void **state)
{
    (void)state;
    enum { FRAGMENTS = 300 };
    shape all = {0};
    add_part(&all, shape_sphere(6), 5, -20, 0, 0), add_part(&all, shape_sphere(6), 2, -40, 0, 0);
    add_part(&all, shape_torus(4), 1, -60, 0, 0);
    for (int i = 0; i < FRAGMENTS; i++) add_part(&all, shape_cube(1), 0.1, i % 20, i / 20, 0);
    qw_options o;
    qw_options_init(&o);
    o.faces = 6 * FRAGMENTS + 1500;
    qw_result *result = remesh(&all, &o);
    qw_mesh_view quads = qw_result_mesh(result);
    const qw_report *r = qw_result_report(result);
    int64_t faces[4] = {0}; /* of the crowd, the largest, the next, the torus */
    for (uint32_t f = 0; f < quads.face_count; f++) {
        double x = quads.positions[3 * (size_t)quads.corners[4 * (size_t)f]];
        faces[x > -5 ? 0 : x > -30 ? 1 : x > -50 ? 2 : 3]++;
    }
    assert_int_equal(faces[0], 6 * FRAGMENTS);
    assert_true(faces[1] > 24 && faces[2] > 24 && faces[3] > 24 && faces[1] > faces[2]);
    assert_true(r->topology.euler == r->euler && r->topology.components == FRAGMENTS + 3);
    qw_result_destroy(result), shape_free(&all);
}

static uint32_t faces_above(const qw_mesh_view *m, double height)
{
    uint32_t count = 0;
    for (uint32_t f = 0; f < m->face_count; f++) {
        double z = 0;
        for (int i = 0; i < 4; i++) z += m->positions[3 * (size_t)m->corners[4 * (size_t)f + (size_t)i] + 2] / 4;
        count += z > height;
    }
    return count;
}

/* A plane of 20 by 20 and a ball of radius 0.5 on it: 0.8 % of the area. */
static void flat_ground_leaves_quads(void **state)
{
    (void)state;
    shape all = {0}, ground = {.vertex_count = 4, .face_count = 2};
    ground.position = malloc(12 * sizeof *ground.position), ground.corner = malloc(6 * sizeof *ground.corner);
    for (uint32_t i = 0; i < 4; i++)
        ground.position[3 * i] = i == 1 || i == 2, ground.position[3 * i + 1] = i >= 2, ground.position[3 * i + 2] = 0;
    static const uint32_t corner[6] = {0, 1, 2, 0, 2, 3};
    memcpy(ground.corner, corner, sizeof corner);
    add_part(&all, ground, 20, -10, -10, 0);
    add_part(&all, shape_sphere(10), 0.5, 0, 0, 0.6);
    qw_options o;
    qw_options_init(&o);
    o.faces = 1000;
    qw_result *result = remesh(&all, &o);
    qw_mesh_view quads = qw_result_mesh(result);
    uint32_t ball = faces_above(&quads, 0.05);
    assert_true(quads.face_count >= 980 && quads.face_count <= 1020);
    if (ball < 333 || ball > 700) fail_msg("%u of %u quads on the ball", ball, quads.face_count);
    qw_result_destroy(result), shape_free(&all);
}

/* A wire of eight sides, 0.006 wide: straight, 0.06 long and above a ball, or wound up in so many quarters of turns
   of radius 0.03. */
static shape wire(uint32_t quarters)
{
    uint32_t rings = quarters ? 6 * quarters + 1 : 11, ends = 8 * rings;
    shape s = {.vertex_count = ends + 2, .face_count = 0};
    s.position = malloc(3 * (size_t)(ends + 2) * sizeof *s.position);
    s.corner = malloc(3 * (size_t)(ends * 2) * sizeof *s.corner);
    for (uint32_t v = 0; v < ends + 2; v++) {
        uint32_t i = v < ends ? v / 8 : v == ends ? 0 : rings - 1;
        double a = 6.283185307179586 * (v % 8) / 8, t = 6.283185307179586 * i / 24, r = v < ends ? 0.003 : 0,
               *p = s.position + 3 * (size_t)v;
        double out = 0.03 + r * cos(a);
        p[0] = quarters ? out * cos(t) : r * cos(a), p[1] = quarters ? out * sin(t) : r * sin(a);
        p[2] = quarters ? 0.0025 * t - r * sin(a) : 0.006 * i;
    }
    for (uint32_t i = 0; i < 8; i++) {
        shape_triangle(&s, (i + 1) % 8, i, ends);
        shape_triangle(&s, ends - 8 + i, ends - 8 + (i + 1) % 8, ends + 1);
    }
    for (uint32_t j = 0; j + 1 < rings; j++)
        for (uint32_t i = 0; i < 8; i++)
            shape_square(&s, 8 * j + i, 8 * j + (i + 1) % 8, 8 * j + 8 + (i + 1) % 8, 8 * j + 8 + i, false);
    return s;
}

static void wires_take_a_quarter_at_most(void **state)
{
    (void)state;
    enum { WIRES = 14 };
    shape all = {0};
    add_part(&all, shape_sphere(12), 1, 0, 0, 0);
    for (int i = 0; i < WIRES; i++) add_part(&all, wire(0), 1, 0.03 * i - 0.2, 0, 1.05);
    qw_options o;
    qw_options_init(&o);
    o.faces = 1500;
    qw_result *result = remesh(&all, &o);
    qw_mesh_view quads = qw_result_mesh(result);
    uint32_t wires = faces_above(&quads, 1.04), *part = parts_of(&quads);
    assert_true(quads.face_count >= 1470 && quads.face_count <= 1530);
    if (wires > quads.face_count / 4 + 3) fail_msg("%u of %u quads on the wires", wires, quads.face_count);
    for (uint32_t v = 0; v < quads.vertex_count; v++) { /* each is still more than half as long */
        double low = 9, high = -9;
        if (part[v] != v || quads.positions[3 * (size_t)v + 2] < 1.04) continue;
        for (uint32_t u = v; u < quads.vertex_count; u++)
            if (part[u] == v) {
                double z = quads.positions[3 * (size_t)u + 2];
                low = fmin(low, z), high = fmax(high, z);
            }
        if (high - low < 0.03) fail_msg("a wire is %g long, not 0.06", high - low);
    }
    free(part), qw_result_destroy(result), shape_free(&all);
}

/* A spring of six turns beside a block: 0.3 % of the area. Its quads go around it in rings of four. */
static void springs_take_a_quarter_at_most(void **state)
{
    (void)state;
    shape all = {0};
    add_part(&all, shape_cube(6), 1, 0, 0, 0);
    add_part(&all, wire(24), 1, 0.5, 0.5, 1.1);
    qw_options o;
    qw_options_init(&o);
    for (o.faces = 1000; o.faces <= 2000; o.faces += 500) {
        qw_result *result = remesh(&all, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        uint32_t spring = faces_above(&quads, 1.05);
        assert_true(quads.face_count >= 0.97 * (double)o.faces && quads.face_count <= 1.03 * (double)o.faces);
        if (spring < 40 || spring > quads.face_count / 4) fail_msg("%u of %u quads", spring, quads.face_count);
        assert_int_equal(qw_result_report(result)->topology.irregular, 16);
        qw_result_destroy(result);
    }
    shape_free(&all);
}

/* Wires that wind more than once, in so few quads that a ring would stand nearly half a turn before the next: they get
   some more. All but six of the quads went to them. */
static void wires_that_wind_leave_quads(void **state)
{
    (void)state;
    enum { WIRES = 20 };
    shape all = {0};
    add_part(&all, shape_sphere(12), 1, 0, 0, 0);
    for (int i = 0; i < WIRES; i++) add_part(&all, wire(5), 1, 0.08 * i - 0.8, 0, 1.05);
    qw_options o;
    qw_options_init(&o);
    for (o.faces = 1100; o.faces <= 1500; o.faces += 400) {
        qw_result *result = remesh(&all, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        uint32_t wires = faces_above(&quads, 1.04);
        assert_true(quads.face_count >= 0.97 * (double)o.faces && quads.face_count <= 1.03 * (double)o.faces);
        if (wires > quads.face_count / 3) fail_msg("%u of %u quads on the wires", wires, quads.face_count);
        assert_int_equal(qw_result_report(result)->topology.irregular, 8 + 8 * WIRES);
        qw_result_destroy(result);
    }
    shape_free(&all);
}

static void at_key_ring(double u, double v, double p[3])
{
    double a = 6.283185307179586 * u, b = 6.283185307179586 * v, out = 0.13 + 0.005 * cos(b);
    p[0] = out * cos(a), p[1] = 0.005 * sin(b), p[2] = out * sin(a);
}

/* Key rings beside a block, which had hundreds of irregular quads: rings of four all the way. */
static void key_rings_leave_the_body_its_quads(void **state)
{
    (void)state;
    enum { RINGS = 6 };
    shape all = {0};
    add_part(&all, shape_cube(6), 1, 0, 0, 0);
    for (int i = 0; i < RINGS; i++)
        add_part(&all, shape_of_sheet(&(shape_sheet){24, 8, true, true, false, at_key_ring}), 1, 0.1 + 0.13 * i, 0.3,
                 1.2);
    qw_options o;
    qw_options_init(&o);
    for (o.faces = 1000; o.faces <= 3000; o.faces += 1000) {
        qw_result *result = remesh(&all, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        uint32_t rings = faces_above(&quads, 1.05);
        assert_true(quads.face_count >= 0.97 * (double)o.faces && quads.face_count <= 1.03 * (double)o.faces);
        if (rings < 12 * RINGS || rings > 0.55 * quads.face_count) fail_msg("%u of %u quads", rings, quads.face_count);
        assert_int_equal(qw_result_report(result)->topology.irregular, 8);
        assert_int_equal(qw_result_report(result)->topology.euler, 2);
        qw_result_destroy(result);
    }
    shape_free(&all);
}

/* Shares are of the whole, none is below what it takes to exist, and what is alike gets alike. */
/* A tetrahedron as long as 1 and 1e-5 wide, along a direction of its own. */
static void add_needle(shape *all, int i, int count)
{
    double a = 2.399963 * i, z = 1 - 2 * (i + 0.5) / count, r = sqrt(1 - z * z), w = 1e-5,
           d[3] = {r * cos(a), r * sin(a), z};
    shape s = {.vertex_count = 4, .position = malloc(12 * sizeof *s.position), .corner = malloc(12 * sizeof *s.corner)};
    const double p[12] = {0, 0, 0, w * d[1], 0.3 * w - w * d[0], 0, 0, w * d[2], -w * d[1], d[0], d[1], d[2]};
    memcpy(s.position, p, sizeof p);
    shape_triangle(&s, 0, 2, 1), shape_triangle(&s, 0, 1, 3), shape_triangle(&s, 0, 3, 2), shape_triangle(&s, 1, 2, 3);
    add_part(all, s, 1, 0.1 * i, 0.05 * (i % 3), 0.02 * (i % 5));
}

/* Where quads are far longer than working edges the offsets make no sense, and are given up before they are cut into
   units, which took several times the memory. */
static void needles_in_few_quads_take_no_more_memory(void **state)
{
    (void)state;
    enum { NEEDLES = 30 };
    shape all = {0};
    for (int i = 0; i < NEEDLES; i++) add_needle(&all, i, NEEDLES);
    qw_options o;
    qw_options_init(&o);
    o.faces = NEEDLES;
    qw_result *result = remesh(&all, &o);
    const qw_report *r = qw_result_report(result);
    double bytes = (double)r->stages[QW_STAGE_INVERSIONS].peak_bytes / (double)r->working_triangles;
    if (bytes > 3100) fail_msg("%g bytes a working triangle", bytes);
    qw_result_destroy(result), shape_free(&all);
}

static void shares_add_up(void **state)
{
    (void)state;
    const qw_part part[5] = {{.area = 4, .bend = 0, .extent = 1, .least = 4, .bare = 1},
                             {.area = 1, .bend = 2, .extent = 0.5, .least = 24, .bare = 6},
                             {.area = 1, .bend = 2, .extent = 0.5, .least = 24, .bare = 6},
                             {.area = 1e-4, .bend = 0.1, .extent = 0.01, .least = 24, .bare = 6},
                             {.area = 1e-12, .bend = 1e-9, .extent = 1e-6, .least = 24, .bare = 6}};
    for (double quads = 100; quads < 1e6; quads *= 3) {
        double share[5], sum = 0;
        qw_share_quads(part, 5, quads, share);
        for (int i = 0; i < 5; i++) {
            assert_true(share[i] >= part[i].bare);
            sum += share[i];
        }
        assert_true(fabs(sum - quads) < 0.02 * quads);
        assert_true(share[1] == share[2] && share[1] > share[0] / 4 && share[0] > quads / 5);
    }
    double share[2];
    qw_share_quads((const qw_part[2]){{.area = 3, .extent = 1, .least = 4, .bare = 1},
                                      {.area = 1, .extent = 1, .least = 4, .bare = 1}},
                   2, 400, share);
    assert_true(fabs(share[0] - 300) < 1e-6 && fabs(share[1] - 100) < 1e-6); /* planes: by area */
}

QW_TEST_SUITE(parts)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(eyes_stay_in_their_place),
        cmocka_unit_test(components_keep_their_numbers),
        cmocka_unit_test(crowds_leave_the_others),
        cmocka_unit_test(flat_ground_leaves_quads),
        cmocka_unit_test(wires_take_a_quarter_at_most),
        cmocka_unit_test(springs_take_a_quarter_at_most),
        cmocka_unit_test(wires_that_wind_leave_quads),
        cmocka_unit_test(key_rings_leave_the_body_its_quads),
        cmocka_unit_test(shares_add_up),
        cmocka_unit_test(needles_in_few_quads_take_no_more_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

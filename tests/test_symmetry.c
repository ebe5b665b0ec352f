/* Both sides of a plane alike: the plane that is found, the cut, and whole runs, which are compared bit for bit. */
#include "suite.h"

#include "faults.h"
#include "shapes.h"
#include "whole/half.h"
#include "torture_shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

static const double PI = 3.14159265358979;

/* A closed body with a nose and two ears, alike on both sides of x = 0. */
static void at_body(double u, double v, double p[3])
{
    double a = 2 * PI * u, polar = PI * v, s = v > 0 && v < 1 ? sin(polar) : 0, x = s * cos(a), y = s * sin(a),
           z = -cos(polar);
    double ear = exp(-12 * ((fabs(x) - 0.7) * (fabs(x) - 0.7) + (z - 0.7) * (z - 0.7) + 0.5 * y * y));
    double nose = exp(-10 * (x * x + (y - 1) * (y - 1) + z * z));
    double r = 1 + 0.6 * ear + 0.5 * nose;
    p[0] = r * x, p[1] = 1.3 * r * y, p[2] = r * z;
}

static shape body(double away)
{
    shape s = shape_of_sheet(&(shape_sheet){64, 48, true, false, false, at_body});
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v] += away;
    return s;
}

static shape join(shape a, const shape *b)
{
    size_t av = 3 * (size_t)a.vertex_count, bv = 3 * (size_t)b->vertex_count, af = 3 * (size_t)a.face_count,
           bf = 3 * (size_t)b->face_count;
    a.position = realloc(a.position, (av + bv) * sizeof *a.position);
    a.corner = realloc(a.corner, (af + bf) * sizeof *a.corner);
    memcpy(a.position + av, b->position, bv * sizeof *a.position);
    for (size_t i = 0; i < bf; i++) a.corner[af + i] = b->corner[i] + a.vertex_count;
    a.vertex_count += b->vertex_count, a.face_count += b->face_count;
    return a;
}

static qw_options asking(int64_t faces, int symmetry)
{
    qw_options o;
    qw_options_init(&o);
    o.faces = faces, o.symmetry = symmetry;
    return o;
}

/* ---- bits */

static const double *compared; /* of the vertices that are sorted */

static int by_place(const void *a, const void *b)
{
    return memcmp(compared + 3 * (size_t) * (const uint32_t *)a, compared + 3 * (size_t) * (const uint32_t *)b,
                  3 * sizeof(double));
}

/* The vertex to which each is reflected about x = 0, found by the bits of its coordinates. */
static uint32_t *find_reflections(const qw_mesh_view *m, double plane)
{
    uint32_t n = m->vertex_count, *order = malloc(n * sizeof *order), *other = malloc(n * sizeof *other),
             *twin = malloc(n * sizeof *twin);
    double *both = malloc(6 * (size_t)n * sizeof *both);
    for (uint32_t v = 0; v < n; v++) {
        const double *p = m->positions + 3 * (size_t)v;
        double *q = both + 3 * (size_t)v, *r = both + 3 * ((size_t)n + v);
        memcpy(q, p, 3 * sizeof *q), memcpy(r, p, 3 * sizeof *r);
        q[0] = p[0] - plane + 0.0, r[0] = plane - p[0] + 0.0; /* no negative zeros */
        assert_true(plane + q[0] == p[0]);                    /* exact */
        order[v] = v, other[v] = n + v;
    }
    compared = both;
    qsort(order, n, sizeof *order, by_place), qsort(other, n, sizeof *other, by_place);
    for (uint32_t i = 0; i < n; i++) {
        assert_memory_equal(both + 3 * (size_t)order[i], both + 3 * (size_t)other[i], 3 * sizeof *both);
        twin[other[i] - n] = order[i];
    }
    free(order), free(other), free(both);
    return twin;
}

static uint64_t key_of_quad(const uint32_t *c, const uint32_t *twin)
{
    uint64_t sum = 0; /* the same for any order of the corners */
    for (int i = 0; i < 4; i++) {
        uint64_t x = (twin ? twin[c[i]] : c[i]) + 1;
        x *= 0x9e3779b97f4a7c15u, x ^= x >> 29, x *= 0xbf58476d1ce4e5b9u;
        sum += x ^ (x >> 32);
    }
    return sum;
}

static int by_value(const void *a, const void *b)
{
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

static void expect_mirrored_quads(const qw_mesh_view *m, const uint32_t *twin)
{
    uint64_t *here = malloc(m->face_count * sizeof *here), *there = malloc(m->face_count * sizeof *there);
    for (uint32_t f = 0; f < m->face_count; f++) {
        here[f] = key_of_quad(m->corners + 4 * (size_t)f, NULL);
        there[f] = key_of_quad(m->corners + 4 * (size_t)f, twin);
    }
    qsort(here, m->face_count, sizeof *here, by_value), qsort(there, m->face_count, sizeof *there, by_value);
    assert_memory_equal(here, there, m->face_count * sizeof *here);
    free(here), free(there);
}

static qw_result *run_of(const shape *s, const qw_options *o)
{
    qw_result *result;
    qw_mesh_view view = shape_view(s);
    qw_status status = qw_remesh(&view, o, NULL, &result);
    if (status != QW_OK) fprintf(stderr, "%s\n", qw_result_message(result));
    assert_int_equal(status, QW_OK);
    return result;
}

static void expect_promise(const qw_result *result, int64_t faces)
{
    const qw_report *r = qw_result_report(result);
    const qw_topology *t = &r->topology;
    assert_int_equal(t->euler, r->euler);
    assert_int_equal(t->components, r->components);
    assert_int_equal(t->boundary_loops, r->boundary_loops);
    assert_int_equal(t->nonmanifold_edges + t->nonmanifold_vertices + t->degenerate_faces + t->duplicate_faces, 0);
    assert_int_equal(t->inconsistent_edges, 0);
    assert_true(fabs((double)t->faces / (double)faces - 1) <= (faces < 500 ? 0.05 : 0.02));
}

/* ---- whole runs */

static void sides_are_bits_of_each_other(void **state)
{
    (void)state;
    static const int64_t counts[] = {300, 1000, 3000};
    static const double away[] = {0, 3.7, -1e4 / 3};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            shape s = body(away[k]);
            qw_options o = asking(counts[i], k == 2 ? QW_SYMMETRY_X : QW_SYMMETRY_AUTO);
            qw_result *result = run_of(&s, &o);
            qw_mesh_view quads = qw_result_mesh(result);
            const qw_report *r = qw_result_report(result);
            assert_int_equal(r->symmetric, 1);
            assert_true(r->plane_x == 1 && r->plane_y == 0 && r->plane_z == 0);
            assert_true(fabs(r->plane_offset - away[k]) < 1e-3 && r->symmetry_gap < 1e-4);
            expect_promise(result, counts[i]);
            double middle = 0; /* the plane as the vertices on it have it */
            uint32_t on = 0;
            for (uint32_t v = 0; v < quads.vertex_count; v++)
                if (fabs(quads.positions[3 * (size_t)v] - r->plane_offset) < 1e-9)
                    middle = quads.positions[3 * (size_t)v], on++;
            assert_true(on > 8);
            uint32_t *twin = find_reflections(&quads, middle);
            expect_mirrored_quads(&quads, twin);
            free(twin), qw_result_destroy(result), shape_free(&s);
        }
}

static void at_open_body(double u, double v, double p[3]) { at_body(u, 0.15 + 0.85 * v, p); }

static void boundaries_stay_open(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){64, 48, true, false, false, at_open_body});
    qw_options o = asking(1500, QW_SYMMETRY_X);
    qw_result *result = run_of(&s, &o);
    expect_promise(result, 1500);
    assert_int_equal(qw_result_report(result)->boundary_loops, 1);
    qw_result_destroy(result), shape_free(&s);
}

/* A plane of any direction: reflections agree to rounding, each quad has its own. */
static void any_plane(void **state)
{
    (void)state;
    shape s = body(0);
    double c = cos(0.7), n = sin(0.7);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, x = p[0], y = p[1];
        p[0] = c * x - n * y + 2, p[1] = n * x + c * y;
    }
    qw_options o = asking(1000, QW_SYMMETRY_PLANE);
    o.symmetry_x = 3 * c, o.symmetry_y = 3 * n, o.symmetry_offset = 3 * 2 * c;
    for (int k = 0; k < 2; k++) {
        qw_result *result = run_of(&s, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        const qw_report *r = qw_result_report(result);
        expect_promise(result, 1000);
        assert_int_equal(r->symmetric, 1);
        assert_true(fabs(fabs(r->plane_x * c + r->plane_y * n) - 1) < 1e-4);
        uint32_t half = quads.face_count / 2;
        for (uint32_t i = 0; i < 4 * half; i++) { /* the reflection of a quad is as far behind it as all are */
            uint32_t to = 4 * half + (i & ~3u) + ((4 - (i & 3u)) & 3u);
            const double *p = quads.positions + 3 * (size_t)quads.corners[i],
                         *q = quads.positions + 3 * (size_t)quads.corners[to];
            double height = p[0] * r->plane_x + p[1] * r->plane_y + p[2] * r->plane_z - r->plane_offset;
            assert_true(fabs(p[0] - 2 * height * r->plane_x - q[0]) < 1e-12);
            assert_true(fabs(p[1] - 2 * height * r->plane_y - q[1]) < 1e-12);
            assert_true(fabs(p[2] - 2 * height * r->plane_z - q[2]) < 1e-12);
        }
        qw_result_destroy(result);
        o = asking(1000, QW_SYMMETRY_AUTO); /* and it is found */
    }
    shape_free(&s);
}

static void bump_one_side(shape *s)
{
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        double *p = s->position + 3 * (size_t)v, x = p[0] + 0.9, d = x * x + p[1] * p[1] + p[2] * p[2];
        p[0] -= 0.06 * exp(-8 * d);
    }
}

/* A bump on one side: about as symmetric as a scan. Each side goes to its own surface. */
static void each_side_follows_its_own(void **state)
{
    (void)state;
    shape s = body(0);
    bump_one_side(&s);
    double mean[2];
    for (int follow = 0; follow < 2; follow++) {
        qw_options o = asking(1000, follow ? QW_SYMMETRY_AUTO : QW_SYMMETRY_X); /* x: exactly alike */
        o.fit = 0;
        qw_mesh_view view = shape_view(&s), quads;
        qw_result *result = run_of(&s, &o);
        qw_topology t;
        qw_quality q;
        assert_int_equal(qw_result_report(result)->symmetric, 1);
        expect_promise(result, 1000);
        quads = qw_result_mesh(result);
        assert_int_equal(qw_measure(&quads, &view, NULL, &t, &q), QW_OK);
        assert_int_equal(q.flipped_faces, 0);
        mean[follow] = q.out_to_in_mean;
        qw_result_destroy(result);
    }
    print_message("mean distance %g, %g where each side follows its own\n", mean[0], mean[1]);
    assert_true(mean[1] < 0.85 * mean[0]);
    shape_free(&s);
}

/* How far the surface is from the quads in the mean, and how far from those that it gets without a plane. */
static double distance_of(const qw_result *result, const shape *s)
{
    qw_mesh_view view = shape_view(s), quads = qw_result_mesh(result);
    qw_topology t;
    qw_quality q;
    assert_int_equal(qw_measure(&quads, &view, NULL, &t, &q), QW_OK);
    assert_int_equal(q.flipped_faces, 0);
    return q.in_to_out_mean * q.mean_edge;
}

static double distance_without(const shape *s, int64_t faces)
{
    qw_options o = asking(faces, QW_SYMMETRY_NONE);
    qw_result *result = run_of(s, &o);
    double distance = distance_of(result, s);
    qw_result_destroy(result);
    return distance;
}

/* The same with two balls, of which the file has one before the body and one after it: the body is the second component
   of one side and the first of the other, and its quads there are as wide as the body's, not as a ball's. A third ball
   is on one side only. */
static void components_come_in_another_order(void **state)
{
    (void)state;
    shape all = {0};
    for (int i = -1; i < 3; i++) {
        shape part = i == 0 ? body(0) : shape_sphere(i == 2 ? 6 : 24);
        if (i == 0) bump_one_side(&part);
        for (size_t v = 0; i != 0 && v < part.vertex_count; v++) {
            double *p = part.position + 3 * v;
            if (i == 2) p[0] = 0.3 * p[0] + 0.4, p[1] = 0.3 * p[1] - 2, p[2] = 0.3 * p[2];
            else p[0] = 0.6 * p[0] - 0.62 * i, p[1] = 0.6 * p[1] + 2.5, p[2] = 0.6 * p[2] + 0.3;
        }
        all = join(all, &part);
        shape_free(&part);
    }
    qw_options o = asking(1000, QW_SYMMETRY_AUTO);
    qw_result *result = run_of(&all, &o);
    expect_promise(result, 1000);
    assert_int_equal(qw_result_report(result)->symmetric, 1);
    double ratio = distance_of(result, &all) / distance_without(&all, 1000);
    print_message("distance over that without a plane: %g\n", ratio);
    assert_true(ratio < 1.1);
    qw_result_destroy(result), shape_free(&all);
}

/* A knob on one side only: a result that is to be symmetric cannot have it on that side alone, and the report says so;
   where the plane is found, each side's quads lie on its own surface, as near as they would without. */
static void one_sided_detail_is_named(void **state)
{
    (void)state;
    for (int knob = 0; knob < 2; knob++) {
        shape s = body(0);
        for (uint32_t v = 0; knob && v < s.vertex_count; v++) {
            double *p = s.position + 3 * (size_t)v, x = p[0] + 0.9, d = x * x + p[1] * p[1] + p[2] * p[2];
            p[0] -= 0.5 * exp(-60 * d);
        }
        for (int64_t symmetry = QW_SYMMETRY_AUTO; symmetry <= QW_SYMMETRY_X; symmetry++) {
            qw_options o = asking(3000, symmetry);
            qw_result *result = run_of(&s, &o);
            const qw_report *r = qw_result_report(result);
            bool is_named = false, is_found = symmetry == QW_SYMMETRY_AUTO;
            for (uint32_t w = 0; w < r->warning_count; w++) is_named |= strstr(r->warnings[w], "differ by") != NULL;
            assert_int_equal(r->symmetric, 1);
            assert_true(r->symmetry_far >= r->symmetry_gap);
            assert_int_equal(is_named, !is_found && knob);
            if (is_found && knob) assert_true(distance_of(result, &s) < 1.1 * distance_without(&s, 3000));
            qw_result_destroy(result);
        }
        shape_free(&s);
    }
}

static void at_lump(double u, double v, double p[3])
{
    at_body(u, v, p);
    double grow = 1 +
                  0.8 * exp(-2 * ((p[0] - 1) * (p[0] - 1) + (p[1] - 0.8) * (p[1] - 0.8) + (p[2] + 0.6) * (p[2] + 0.6)));
    for (int k = 0; k < 3; k++) p[k] *= grow;
}

/* Not symmetric: auto gives what is made without, and no warning, as nobody asked. */
static void auto_leaves_others_alone(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){64, 48, true, false, false, at_lump});
    qw_options o = asking(700, QW_SYMMETRY_AUTO), none = asking(700, QW_SYMMETRY_NONE);
    qw_result *result = run_of(&s, &o), *plain = run_of(&s, &none);
    qw_mesh_view a = qw_result_mesh(result), b = qw_result_mesh(plain);
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->symmetric, 0);
    assert_true(r->symmetry_gap > 0.003);
    assert_int_equal(r->warning_count, 0);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_memory_equal(a.positions, b.positions, 3 * (size_t)a.vertex_count * sizeof *a.positions);
    qw_result_destroy(result), qw_result_destroy(plain);
    o.symmetry = QW_SYMMETRY_X; /* asked for all the same */
    result = run_of(&s, &o);
    assert_int_equal(qw_result_report(result)->symmetric, 1);
    expect_promise(result, 700);
    qw_result_destroy(result), shape_free(&s);
}

static void runs_go_on(void **state)
{
    (void)state;
    shape s = body(0);
    qw_mesh_view view = shape_view(&s), a, b;
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    static const struct {
        int64_t faces;
        int symmetry;
    } runs[] = {{600, QW_SYMMETRY_X},
                {900, QW_SYMMETRY_X},
                {900, QW_SYMMETRY_NONE},
                {900, QW_SYMMETRY_Y},
                {600, QW_SYMMETRY_AUTO}};
    for (size_t i = 0; i < sizeof runs / sizeof *runs; i++) {
        qw_options o = asking(runs[i].faces, runs[i].symmetry);
        assert_int_equal(qw_run(context, &o), QW_OK);
        assert_int_equal(qw_get_mesh(context, &a), QW_OK);
        qw_result *fresh = run_of(&s, &o);
        b = qw_result_mesh(fresh);
        assert_int_equal(a.vertex_count, b.vertex_count);
        assert_memory_equal(a.positions, b.positions, 3 * (size_t)a.vertex_count * sizeof *a.positions);
        qw_result_destroy(fresh);
    }
    qw_provenance p = {.size = sizeof p};
    assert_int_equal(qw_get_provenance(context, &p), QW_OK);
    assert_int_equal(p.vertex_count, a.vertex_count);
    assert_int_equal(p.lost_vertices, 0);
    qw_destroy(context), shape_free(&s);
}

static void what_is_refused(void **state)
{
    (void)state;
    shape s = body(0);
    qw_mesh_view view = shape_view(&s);
    qw_options o = asking(300, QW_SYMMETRY_PLANE);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &o), QW_OPTION);
    assert_non_null(strstr(qw_message(context), "no normal"));
    qw_destroy(context), shape_free(&s);
}

static qw_context *context_with(const shape *s)
{
    qw_mesh_view view = shape_view(s);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    return context;
}

static void expect_bits(qw_context *context)
{
    qw_mesh_view quads;
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    uint32_t *twin = find_reflections(&quads, 0);
    expect_mirrored_quads(&quads, twin);
    free(twin);
}

enum { RING = 48 };

/* The body's section at the height z, on one side of the plane or all around. */
static void ring_of_body(double z, bool half, double points[RING][3])
{
    for (int i = 0; i < RING; i++) { /* the polar angle that gives the height, by bisection */
        double u = half ? (double)i / (2 * (RING - 1)) - 0.25 : (double)i / RING, low = 0, high = 1, p[3];
        for (int k = 0; k < 50; k++) {
            double middle = (low + high) / 2;
            at_body(u, middle, p);
            if (p[2] < z) low = middle;
            else high = middle;
        }
        at_body(u, low, points[i]);
    }
}

/* A closed ring around one ear: the other ear is to have none, so that no plane is used where it is only found. */
static void what_steers_one_side_is_not_mirrored(void **state)
{
    (void)state;
    enum { POINTS = 16 };
    shape s = body(0);
    double points[2][POINTS][3];
    for (int side = 0; side < 2; side++)
        for (int i = 0; i < POINTS; i++) {
            double a = (side ? 0.25 - 0.1 * cos(2 * PI * i / POINTS) : 0.75 + 0.1 * cos(2 * PI * i / POINTS));
            at_body(a - 0.25 < 0 ? a + 0.75 : a - 0.25, 0.5 + 0.08 * sin(2 * PI * i / POINTS), points[side][i]);
        }
    for (uint32_t count = 0; count <= 2; count++) { /* none, on one side, on both */
        qw_guide guides[2];
        for (int k = 0; k < 2; k++) guides[k] = (qw_guide){sizeof *guides, QW_GUIDE_LOOP, 1, POINTS, points[k][0], 0};
        qw_mesh_view view = shape_view(&s);
        qw_options o = asking(2000, QW_SYMMETRY_AUTO);
        qw_context *context;
        assert_int_equal(qw_create(NULL, &context), QW_OK);
        assert_int_equal(qw_set_mesh(context, &view), QW_OK);
        if (count > 0) assert_int_equal(qw_set_guides(context, guides, count), QW_OK);
        if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
        const qw_report *r = qw_get_report(context);
        bool is_said = false;
        for (uint32_t w = 0; w < r->warning_count; w++) is_said |= strstr(r->warnings[w], "guides are not") != NULL;
        assert_int_equal(r->symmetric, count != 1);
        assert_int_equal(is_said, count == 1);
        qw_destroy(context);
    }
    shape_free(&s);
}

static bool has_rib(int x, int y, int z) { return x >= 0 && z >= 0 && (y == 0 || (y == 1 && x == 1 && z == 0)); }

/* A block with a rib in the plane of symmetry is left alone where half of the rib has no room for quads, but has for
   thin ones; so is a cube, which is plain. One with a
   wide rib is not, nor a ring. */
static void thin_ribs_are_not_cut_along(void **state)
{
    (void)state;
    for (int k = 0; k < 4; k++) {
        shape s = k == 0 ? shape_cube(6) : k == 1 ? shape_torus(8) : shape_of_cells(3, 2, 2, 6, has_rib);
        for (uint32_t v = 0; k == 3 && v < s.vertex_count;
             v++) { /* the middle cell of three gets a seventh of its width */
            double *x = s.position + 3 * (size_t)v, low = 1.0 / 3, high = 2.0 / 3;
            *x = *x <= low ? *x : *x >= high ? *x - high + low + 0.05 : low + (*x - low) * 0.15;
        }
        qw_options o = asking(400, QW_SYMMETRY_AUTO);
        qw_result *result = run_of(&s, &o);
        assert_int_equal(qw_result_report(result)->symmetric, k == 1 || k == 2);
        assert_int_equal(qw_result_report(result)->attempts, 0); /* it is not tried in vain */
        expect_promise(result, 400);
        qw_result_destroy(result);
        shape_free(&s);
    }
}

/* How many vertices of the result have none where the axis' plane through the origin would reflect them. */
static uint32_t count_unlike(const qw_mesh_view *view, const double middle[3], int axis)
{
    uint32_t unlike = 0;
    for (uint32_t v = 0; v < view->vertex_count; v++) {
        double p[3], least = HUGE_VAL;
        memcpy(p, view->positions + 3 * (size_t)v, sizeof p);
        p[axis] = 2 * middle[axis] - p[axis];
        for (uint32_t w = 0; w < view->vertex_count; w++) {
            const double *q = view->positions + 3 * (size_t)w;
            least = fmin(least, fabs(p[0] - q[0]) + fabs(p[1] - q[1]) + fabs(p[2] - q[2]));
        }
        unlike += least > 1e-5;
    }
    return unlike;
}

/* A body with two holes and three planes of symmetry is remeshed as an eighth: all its images are alike, and no row of
   quads crosses itself. */
static void an_eighth_is_remeshed(void **state)
{
    (void)state;
    shape s = shape_double_torus(8);
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, middle[3];
    for (uint32_t i = 0; i < 3 * s.vertex_count; i++)
        low[i % 3] = fmin(low[i % 3], s.position[i]), high[i % 3] = fmax(high[i % 3], s.position[i]);
    for (int k = 0; k < 3; k++) middle[k] = (low[k] + high[k]) / 2;
    qw_options o = asking(800, QW_SYMMETRY_AUTO);
    qw_result *result = run_of(&s, &o);
    const qw_mesh_view view = qw_result_mesh(result);
    assert_int_equal(qw_result_report(result)->symmetric, 1);
    for (int axis = 0; axis < 3; axis++) assert_int_equal(count_unlike(&view, middle, axis), 0);
    assert_true(qw_result_report(result)->simple > 0.999);
    expect_promise(result, 800);
    qw_result_destroy(result);
    shape_free(&s);
}

/* The point, turned about the axis through the origin along (1, 2, 3) by `turn` and moved. */
static void turn_and_move(double turn, const double by[3], double p[3])
{
    const double n[3] = {1 / sqrt(14), 2 / sqrt(14), 3 / sqrt(14)};
    double along = p[0] * n[0] + p[1] * n[1] + p[2] * n[2], c = cos(turn), s = sin(turn), q[3];
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        q[k] = c * p[k] + s * (n[i] * p[j] - n[j] * p[i]) + (1 - c) * along * n[k] + by[k];
    }
    memcpy(p, q, sizeof q);
}

/* Four bodies that are turned to each other, and among them one that is twisted and has no plane: each of the four is
   its own reflection, to a millionth, and all have their quads once. */
static void components_have_planes_of_their_own(void **state)
{
    (void)state;
    const double turn[5] = {0.4, 0, 1.3, 2.1, 2.9},
                 by[5][3] = {{0, 0, 0}, {4, 1, 0}, {8, 0, 1}, {12, 0, 0}, {16, 1, 1}};
    const int64_t faces = 4000;
    shape all = {0};
    for (int i = 0; i < 5; i++) {
        shape part = body(0);
        for (uint32_t v = 0; v < part.vertex_count; v++) {
            double *p = part.position + 3 * (size_t)v, x = p[0], twist = i == 1 ? 0.8 * p[2] : 0;
            p[0] = cos(twist) * x - sin(twist) * p[1], p[1] = sin(twist) * x + cos(twist) * p[1];
            turn_and_move(turn[i], by[i], p);
        }
        all = join(all, &part);
        shape_free(&part);
    }
    qw_options o = asking(faces, QW_SYMMETRY_AUTO);
    qw_result *result = run_of(&all, &o);
    qw_mesh_view quads = qw_result_mesh(result);
    expect_promise(result, faces);
    assert_int_equal(qw_result_report(result)->symmetric, 2);
    double worst = 0;
    uint32_t of_bodies = 0;
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v, back[3] = {0, 0, 0};
        int i = p[0] < 2 ? 0 : p[0] < 6 ? 1 : p[0] < 10 ? 2 : p[0] < 14 ? 3 : 4;
        double q[3] = {p[0] - by[i][0], p[1] - by[i][1], p[2] - by[i][2]}, nearest = HUGE_VAL;
        if (i == 1) continue;
        of_bodies++;
        turn_and_move(-turn[i], back, q);
        q[0] = -q[0];
        turn_and_move(turn[i], by[i], q);
        for (uint32_t u = 0; u < quads.vertex_count; u++) {
            const double *r = quads.positions + 3 * (size_t)u;
            nearest = fmin(nearest, (r[0] - q[0]) * (r[0] - q[0]) + (r[1] - q[1]) * (r[1] - q[1]) +
                                        (r[2] - q[2]) * (r[2] - q[2]));
        }
        worst = fmax(worst, sqrt(nearest));
    }
    assert_true(of_bodies > quads.vertex_count / 2 && of_bodies < quads.vertex_count);
    print_message("farthest from a reflection: %g\n", worst);
    assert_true(worst < 1e-5);
    double ratio = distance_of(result, &all) / distance_without(&all, faces);
    print_message("distance over that without a plane: %g\n", ratio);
    assert_true(ratio < 1.1);
    qw_result_destroy(result), shape_free(&all);
}

static double area_beyond(const qw_mesh_view *m, double y)
{
    double sum = 0;
    for (uint32_t f = 0; f < m->face_count; f++)
        for (uint32_t k = 2; k < m->uniform_face_size; k++) {
            const uint32_t *c = m->corners + (size_t)m->uniform_face_size * f;
            const double *a = m->positions + 3 * (size_t)c[0], *b = m->positions + 3 * (size_t)c[k - 1],
                         *d = m->positions + 3 * (size_t)c[k];
            double u[3], v[3], n[3];
            for (int i = 0; i < 3; i++) u[i] = b[i] - a[i], v[i] = d[i] - a[i];
            for (int i = 0; i < 3; i++) n[i] = u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3];
            if (a[1] > y) sum += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) / 2;
        }
    return sum;
}

/* A bent sheet that has no plane, one leg of which lies in the body's: it stays whole, with its boundary. */
static void others_in_a_plane_stay(void **state)
{
    (void)state;
    double position[18] = {0, 3, 0, 0, 5, 0, 0, 5, 1.3, 0, 3, 2, 1, 5.4, 0.2, 1, 5.4, 1.3};
    uint32_t corner[12] = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
    const shape sheet = {.vertex_count = 6, .face_count = 4, .position = position, .corner = corner};
    shape all = join(body(0), &sheet);
    qw_options o = asking(1500, QW_SYMMETRY_AUTO);
    qw_result *result = run_of(&all, &o);
    const qw_mesh_view quads = qw_result_mesh(result), surface = shape_view(&all);
    expect_promise(result, 1500);
    assert_int_equal(qw_result_report(result)->symmetric, 2);
    double was = area_beyond(&surface, 2.5), is = area_beyond(&quads, 2.5);
    print_message("area of the sheet: %g, was %g\n", is, was);
    assert_true(fabs(is - was) < 0.01 * was);
    qw_result_destroy(result), shape_free(&all);
}

/* Two balls of which one is inside out, which is to stay so, are no mirror images. */
static void orientation_counts(void **state)
{
    (void)state;
    for (int inside_out = 0; inside_out < 2; inside_out++) {
        shape s = shape_sphere(6), other = shape_sphere(6);
        double most = 0;
        for (uint32_t v = 0; v < s.vertex_count; v++) most = fmax(most, fabs(s.position[3 * (size_t)v]));
        for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v] -= 1.5 * most;
        for (uint32_t v = 0; v < other.vertex_count; v++) { /* reflected */
            double *p = other.position + 3 * (size_t)v;
            p[0] = 1.5 * most - p[0];
        }
        for (uint32_t f = 0; f < other.face_count && !inside_out; f++) {
            uint32_t *c = other.corner + 3 * (size_t)f, second = c[1];
            c[1] = c[2], c[2] = second;
        }
        s = join(s, &other);
        qw_options o = asking(300, QW_SYMMETRY_AUTO);
        o.outward = 0;
        qw_result *result = run_of(&s, &o);
        const qw_report *r = qw_result_report(result);
        assert_true(!r->symmetric || r->plane_x < 0.5 || !inside_out); /* each ball alone has planes of its own */
        if (!inside_out) assert_int_equal(r->symmetric, 1);
        qw_result_destroy(result);
        shape_free(&s), shape_free(&other);
    }
}

/* An edge loop that was asked for runs on both sides, whether it was drawn across the plane or on one side alone. */
static void guides_hold_on_both_sides(void **state)
{
    (void)state;
    shape s = body(0);
    static double ring[RING][3];
    for (int half = 0; half < 2; half++) {
        ring_of_body(-0.45, half, ring);
        const qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, !half, RING, &ring[0][0], 0};
        qw_context *context = context_with(&s);
        qw_options o = asking(1500, QW_SYMMETRY_X);
        assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
        if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
        assert_int_equal(qw_get_report(context)->symmetric, 1);
        assert_true(qw_get_report(context)->guide_edges > 0);
        assert_in_range((int)(100 * qw_get_report(context)->guide_off), 0, 25);
        expect_bits(context);
        qw_destroy(context);
    }
    shape_free(&s);
}

/* A field along the axis, given at all vertices, is followed on both sides, and comes back for both sides. */
static void fields_hold_on_both_sides(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){64, 48, true, false, false, at_open_body});
    float *direction = calloc(3 * (size_t)s.vertex_count, sizeof *direction);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        direction[3 * (size_t)v + 1] = 0.6f, direction[3 * (size_t)v + 2] = 0.8f;
    qw_cross_field field = {
        .size = sizeof field, .domain = QW_PER_VERTEX, .count = s.vertex_count, .directions = direction};
    qw_context *context = context_with(&s);
    qw_options o = asking(1500, QW_SYMMETRY_X);
    assert_int_equal(qw_set_field(context, &field), QW_OK);
    if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
    assert_true(qw_get_report(context)->field_angle >= 0 && qw_get_report(context)->field_angle < 12);
    expect_bits(context);
    assert_int_equal(qw_set_field(context, NULL), QW_OK);
    assert_int_equal(qw_run(context, &o), QW_OK);
    assert_int_equal(qw_get_field(context, QW_PER_FACE, &field), QW_OK);
    assert_int_equal(field.count, s.face_count);
    uint32_t found = 0;
    for (uint32_t f = 0; f < field.count; f++) {
        const float *d = field.directions + 3 * (size_t)f;
        found += fabsf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - 1) < 1e-3f;
    }
    assert_true(found > field.count * 9 / 10);
    qw_destroy(context), shape_free(&s), free(direction);
}

/* A boundary across the plane keeps its vertices; the rest is made of one side. */
static void boundaries_that_stay(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){64, 48, true, false, false, at_open_body});
    qw_context *context = context_with(&s);
    qw_mesh_view quads;
    qw_options o = asking(3000, QW_SYMMETRY_X);
    o.fix_boundary = 1;
    if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
    const qw_report *r = qw_get_report(context);
    assert_int_equal(r->symmetric, 1);
    assert_int_equal(r->topology.boundary_loops, 1);
    assert_int_equal(r->topology.nonmanifold_edges + r->topology.nonmanifold_vertices, 0);
    assert_int_equal(r->rim_vertices, 64);
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    uint32_t on_rim = 0;
    for (uint32_t v = 0; v < quads.vertex_count; v++)
        for (uint32_t i = 0; i < s.vertex_count; i++)
            on_rim += memcmp(quads.positions + 3 * (size_t)v, s.position + 3 * (size_t)i, 3 * sizeof(double)) == 0;
    assert_true(on_rim >= 64);
    qw_destroy(context);

    uint8_t *inside = calloc(s.face_count, 1);
    for (uint32_t f = 0; f < s.face_count; f++) inside[f] = s.position[3 * (size_t)s.corner[3 * f] + 2] > -0.2;
    context = context_with(&s);
    o.fix_boundary = 0;
    assert_int_equal(qw_set_region(context, inside, s.face_count), QW_OK);
    if (qw_run(context, &o) != QW_OK) fail_msg("%s", qw_message(context));
    assert_int_equal(qw_get_report(context)->symmetric, 1);
    assert_int_equal(qw_get_report(context)->topology.boundary_loops, 1);
    assert_true(qw_get_report(context)->kept_faces > 0);
    qw_destroy(context), free(inside), shape_free(&s);
}

/* Stages one by one, and from a dump after any of them: the bytes of a run in one go. */
static void stages_and_dumps(void **state)
{
    (void)state;
    shape s = body(0);
    qw_options o = asking(500, QW_SYMMETRY_AUTO);
    qw_context *direct = context_with(&s), *by_stages = context_with(&s);
    qw_mesh_view a, b;
    assert_int_equal(qw_run(direct, &o), QW_OK);
    assert_int_equal(qw_get_mesh(direct, &a), QW_OK);
    for (int stage = 0; stage < QW_STAGE_COUNT; stage++) {
        qw_context *resumed;
        assert_int_equal(qw_run_until(by_stages, &o, (qw_stage)stage), QW_OK);
        assert_int_equal(qw_dump(by_stages, "symmetric.qws"), QW_OK);
        assert_int_equal(qw_create(NULL, &resumed), QW_OK);
        if (qw_resume(resumed, "symmetric.qws") != QW_OK) fail_msg("stage %d: %s", stage, qw_message(resumed));
        assert_int_equal(qw_run(resumed, &o), QW_OK);
        assert_int_equal(qw_get_mesh(resumed, &b), QW_OK);
        assert_int_equal(a.vertex_count, b.vertex_count);
        assert_memory_equal(a.positions, b.positions, 3 * (size_t)a.vertex_count * sizeof *a.positions);
        assert_int_equal(qw_get_report(resumed)->symmetric, 1);
        assert_int_equal(qw_get_report(resumed)->warning_count, qw_get_report(direct)->warning_count);
        qw_destroy(resumed);
    }
    remove("symmetric.qws");
    qw_destroy(direct), qw_destroy(by_stages), shape_free(&s);
}

/* Painted on the head: smaller edges there, on both sides alike. */
static void painted_densities(void **state)
{
    (void)state;
    shape s = body(0);
    qw_mesh_view view = shape_view(&s), quads;
    qw_density *density = malloc(s.vertex_count * sizeof *density);
    for (uint32_t v = 0; v < s.vertex_count; v++) density[v] = s.position[3 * (size_t)v + 2] > 0 ? 3 : 1;
    qw_options o = asking(3000, QW_SYMMETRY_X);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_set_density(context, density, s.vertex_count), QW_OK);
    assert_int_equal(qw_run(context, &o), QW_OK);
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    uint32_t *twin = find_reflections(&quads, 0), above = 0;
    expect_mirrored_quads(&quads, twin);
    for (uint32_t v = 0; v < quads.vertex_count; v++) above += quads.positions[3 * (size_t)v + 2] > 0;
    assert_true(above > quads.vertex_count * 3 / 4);
    free(twin), free(density), qw_destroy(context), shape_free(&s);
}

static int stop_halfway(void *user, qw_stage stage, double fraction)
{
    (void)stage;
    double *last = user;
    assert_true(fraction >= *last);
    *last = fraction;
    return fraction > 0.5;
}

static void it_can_be_cancelled(void **state)
{
    (void)state;
    shape s = body(0);
    double last = 0;
    qw_host host = {.progress = stop_halfway, .progress_user = &last};
    qw_mesh_view view = shape_view(&s), quads;
    qw_options o = asking(2000, QW_SYMMETRY_X);
    qw_context *context;
    assert_int_equal(qw_create(&host, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &o), QW_CANCELLED);
    assert_int_equal(qw_get_mesh(context, &quads), QW_NOT_READY);
    qw_destroy(context), shape_free(&s);
}

/* A hole on the plane that is smaller than a quad stays open, and is alike on both sides. */
static void small_holes_stay(void **state)
{
    (void)state;
    shape s = body(0);
    uint32_t kept = 0;
    for (uint32_t f = 0; f < s.face_count; f++) {
        const uint32_t *c = s.corner + 3 * f;
        double middle[3] = {0};
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) middle[k] += s.position[3 * (size_t)c[i] + (size_t)k] / 3;
        if (fabs(middle[0]) < 0.12 && fabs(middle[2]) < 0.07 && middle[1] < 0) continue;
        memmove(s.corner + 3 * (size_t)kept++, c, 3 * sizeof *c);
    }
    assert_true(kept < s.face_count);
    s.face_count = kept;
    for (int64_t faces = 120; faces < 2000; faces *= 2) {
        qw_options o = asking(faces, QW_SYMMETRY_X);
        qw_result *result = run_of(&s, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        expect_promise(result, faces);
        assert_int_equal(qw_result_report(result)->boundary_loops, 1);
        uint32_t *twin = find_reflections(&quads, 0);
        expect_mirrored_quads(&quads, twin);
        free(twin), qw_result_destroy(result);
    }
    shape_free(&s);
}

/* Each component is as wide as before, no matter what crosses it at the plane. */
static void expect_widths(const qw_mesh_view *m, double width)
{
    uint32_t *label = malloc(m->vertex_count * sizeof *label);
    double *low = malloc(m->vertex_count * sizeof *low), *high = malloc(m->vertex_count * sizeof *high);
    for (uint32_t v = 0; v < m->vertex_count; v++) label[v] = v, low[v] = INFINITY, high[v] = -INFINITY;
    for (bool again = true; again;) {
        again = false;
        for (uint32_t h = 0; h < 4 * m->face_count; h++) {
            uint32_t *a = &label[m->corners[h]], *b = &label[m->corners[h ^ 1u]], *c = &label[m->corners[h ^ 2u]];
            uint32_t least = *a < *b ? *a : *b;
            least = least < *c ? least : *c;
            again |= *a != least || *b != least || *c != least;
            *a = *b = *c = least;
        }
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        double x = m->positions[3 * (size_t)v];
        low[label[v]] = fmin(low[label[v]], x), high[label[v]] = fmax(high[label[v]], x);
    }
    for (uint32_t v = 0; v < m->vertex_count; v++)
        if (label[v] == v && fabs(high[v] - low[v] - width) > 0.1 * width) fail_msg("from %g to %g", low[v], high[v]);
    free(label), free(low), free(high);
}

/* Two balls whose cuts coincide, point for point, are neither welded nor sewn to one another; with one across the
   plane and a pair off it. */
static void components_stay_apart(void **state)
{
    (void)state;
    static const double at[] = {0.5, -0.5, 0, 3, -3};
    shape all = {0};
    for (int i = 0; i < 5; i++) {
        shape ball = shape_sphere(6);
        for (uint32_t v = 0; v < ball.vertex_count; v++) ball.position[3 * (size_t)v] += at[i];
        all = join(all, &ball);
        shape_free(&ball);
    }
    qw_options o = asking(800, QW_SYMMETRY_X);
    qw_result *result = run_of(&all, &o);
    expect_promise(result, 800);
    assert_int_equal(qw_result_report(result)->topology.components, 5);
    qw_mesh_view quads = qw_result_mesh(result);
    qw_provenance p = {.size = sizeof p};
    assert_int_equal(qw_result_provenance(result, &p), QW_OK);
    assert_int_equal(p.lost_vertices, 0);
    uint32_t *twin = find_reflections(&quads, 0);
    expect_mirrored_quads(&quads, twin);
    expect_widths(&quads, 2);
    free(twin), qw_result_destroy(result), shape_free(&all);
}

/* The smallest such pair, with the plane given and found. */
static void crossing_twins_stay_themselves(void **state)
{
    (void)state;
    qw_mesh *mesh;
    assert_int_equal(qw_load(QW_TEST_DATA "/regress/crossing_twins.obj", NULL, &mesh), QW_OK);
    for (int i = 0; i < 2; i++) {
        qw_options o = asking(400, i ? QW_SYMMETRY_ANY : QW_SYMMETRY_X);
        qw_mesh_view view = qw_mesh_get(mesh), quads;
        qw_result *result;
        assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
        quads = qw_result_mesh(result);
        assert_int_equal(qw_result_report(result)->symmetric, 1);
        expect_widths(&quads, 2);
        qw_result_destroy(result);
    }
    qw_mesh_destroy(mesh);
}

/* The body, two balls that are twins, and a badge on one side: a ball too, or a box. */
static shape body_with_badge(bool is_box, const double at[3][3])
{
    shape all = body(0);
    for (int i = 0; i < 3; i++) {
        shape ball = i == 2 && is_box ? shape_cube(2) : shape_sphere(6);
        for (uint32_t v = 0; v < ball.vertex_count; v++)
            for (int k = 0; k < 3; k++)
                ball.position[3 * (size_t)v + (size_t)k] = 0.08 * ball.position[3 * (size_t)v + (size_t)k] + at[i][k];
        all = join(all, &ball);
        shape_free(&ball);
    }
    return all;
}

/* A badge on one side only, smooth or a plain solid: all else is symmetric to the bit, the badge is there once, and the
 * report says so. */
static void one_component_without_a_twin(void **state)
{
    (void)state;
    static const double at[3][3] = {{0.5, 1, 0.3}, {-0.5, 1, 0.3}, {0.4, -1.5, 0}};
    for (int i = 0; i < 3; i++) {
        shape all = body_with_badge(i == 2, at);
        for (int64_t faces = 600; faces < 3000; faces *= 3) {
            qw_options o = asking(faces, i == 1 ? QW_SYMMETRY_X : QW_SYMMETRY_AUTO);
            qw_result *result = run_of(&all, &o);
            const qw_report *r = qw_result_report(result);
            qw_mesh_view quads = qw_result_mesh(result);
            expect_promise(result, faces);
            assert_int_equal(r->symmetric, 1);
            assert_int_equal(r->topology.components, 4);
            assert_true(r->warning_count == 1 && strstr(r->warnings[0], "1 component on one side") != NULL);
            uint32_t alone = 0, badge = 0;
            for (uint32_t v = 0; v < quads.vertex_count; v++) {
                const double *p = quads.positions + 3 * (size_t)v;
                bool has_twin = false;
                for (uint32_t w = 0; w < quads.vertex_count && !has_twin; w++) {
                    const double *q = quads.positions + 3 * (size_t)w;
                    has_twin = fabs(p[0] + q[0] - 2 * r->plane_offset) < 1e-12 && p[1] == q[1] && p[2] == q[2];
                }
                alone += !has_twin;
                badge += hypot(hypot(p[0] - at[2][0], p[1] - at[2][1]), p[2] - at[2][2]) < 0.15;
            }
            if (alone == 0 || alone != badge)
                fail_msg("%u vertices without a twin, %u of the badge; plane at %g", alone, badge, r->plane_offset);
            qw_result_destroy(result);
        }
        shape_free(&all);
    }
}

static void at_strip(double u, double v, double p[3])
{
    double a = 2 * PI * u, t = 0.6 * (v - 0.5);
    p[0] = (1 + t * cos(a / 2)) * cos(a), p[1] = (1 + t * cos(a / 2)) * sin(a), p[2] = t * sin(a / 2);
}

/* Two quads that lie in a plane: not mirrored about it. A one-sided strip: not mirrored at all. */
static void surfaces_without_two_sides(void **state)
{
    (void)state;
    shape plate = shape_of_four((const double[4][3]){{-1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 1, 0}},
                                (const uint32_t[4][3]){{0, 1, 2}, {0, 2, 3}, {0, 1, 2}, {0, 2, 3}});
    plate.face_count = 2;
    qw_options o = asking(100, QW_SYMMETRY_AUTO);
    qw_result *result = run_of(&plate, &o);
    assert_int_equal(qw_result_report(result)->symmetric, 1);
    assert_true(qw_result_report(result)->plane_z == 0);
    expect_promise(result, 100);
    qw_result_destroy(result);
    qw_mesh_view view = shape_view(&plate);
    o.symmetry = QW_SYMMETRY_Z;
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OPTION);
    assert_non_null(strstr(qw_result_message(result), "lies in the plane"));
    qw_result_destroy(result), shape_free(&plate);

    shape strip = shape_of_sheet(&(shape_sheet){40, 4, true, false, true, at_strip});
    view = shape_view(&strip);
    o = asking(200, QW_SYMMETRY_Y);
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_UNSUPPORTED);
    assert_non_null(strstr(qw_result_message(result), "one-sided"));
    qw_result_destroy(result);
    o.symmetry = QW_SYMMETRY_AUTO;
    result = run_of(&strip, &o);
    assert_int_equal(qw_result_report(result)->symmetric, 0);
    qw_result_destroy(result), shape_free(&strip);
}

/* A valley whose bottom lies in the plane between two slopes below it. */
static void at_valley(double u, double v, double p[3])
{
    p[0] = 4 * u - 2, p[1] = 3 * v - 1.5, p[2] = fabs(2 * u - 1) - (v == 0 || v == 1);
}

/* An edge that the side would have in common with its reflection: the cut passes below it. */
static void a_plane_that_touches_an_edge(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){4, 3, false, false, false, at_valley});
    qw_options o = asking(100, QW_SYMMETRY_PLANE);
    o.symmetry_z = 1;
    qw_result *result = run_of(&s, &o);
    const qw_topology *t = &qw_result_report(result)->topology;
    assert_int_equal(t->nonmanifold_edges + t->nonmanifold_vertices + t->degenerate_faces + t->duplicate_faces, 0);
    assert_int_equal(t->components, 1);
    assert_int_equal(t->euler, 0); /* two slopes and what is above the plane, twice: a ring of two boundaries */
    qw_result_destroy(result), shape_free(&s);
}

/* Heights above the plane whose products vanish. */
static void tiny_coordinates(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){6, 5, false, false, false, at_valley});
    for (uint32_t i = 0; i < 3 * s.vertex_count; i++) s.position[i] *= 1e-290;
    qw_options o = asking(100, QW_SYMMETRY_PLANE);
    o.symmetry_x = 0.6, o.symmetry_y = 0.8;
    qw_result *result = run_of(&s, &o);
    assert_int_equal(qw_result_report(result)->topology.components, 1);
    qw_result_destroy(result), shape_free(&s);
}

/* Quads are bits of each other where lengths are no normal numbers (regress/subnormal.obj), and where they are as large
   as can be read. */
static void ends_of_the_numbers(void **state)
{
    (void)state;
    static const double sides[] = {8e-309, 1e300};
    for (int i = 0; i < 2; i++) {
        shape s = shape_cube(1);
        for (uint32_t k = 0; k < 3 * s.vertex_count; k++) s.position[k] *= sides[i];
        qw_options o = asking(200, QW_SYMMETRY_X);
        qw_result *result = run_of(&s, &o);
        qw_mesh_view quads = qw_result_mesh(result);
        const qw_report *r = qw_result_report(result);
        assert_int_equal(r->symmetric, 1);
        expect_promise(result, 200);
        uint32_t *twin = find_reflections(&quads, r->plane_offset);
        expect_mirrored_quads(&quads, twin);
        free(twin), qw_result_destroy(result), shape_free(&s);
    }
}

enum { PIERCED = 11 };

/* A plate with a hole in every second cell. */
static shape pierced_plate(void)
{
    shape s = shape_of_sheet(&(shape_sheet){PIERCED, PIERCED, false, false, false, at_valley});
    uint32_t kept = 0;
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v + 2] = 0;
    for (uint32_t f = 0; f < s.face_count; f++) {
        uint32_t cell = f / 2, column = cell % PIERCED, row = cell / PIERCED;
        if (column % 2 && row % 2) continue;
        memmove(s.corner + 3 * (size_t)kept++, s.corner + 3 * (size_t)f, 3 * sizeof *s.corner);
    }
    s.face_count = kept;
    return s;
}

/* A side needs many more quads than were asked for, and its two halves more still. */
static void too_few_quads(void **state)
{
    (void)state;
    shape s = pierced_plate();
    qw_options o = asking(1, QW_SYMMETRY_PLANE);
    o.symmetry_x = 1;
    qw_result *result = run_of(&s, &o);
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->topology.boundary_loops, 1 + PIERCED / 2 * (PIERCED / 2));
    assert_int_equal(r->topology.euler, 1 - PIERCED / 2 * (PIERCED / 2));
    assert_int_equal(r->topology.nonmanifold_edges + r->topology.nonmanifold_vertices, 0);
    qw_result_destroy(result), shape_free(&s);
}

/* An edge length is refused before anything is cut. */
static void too_many_quads(void **state)
{
    (void)state;
    shape s = body(0);
    qw_mesh_view view = shape_view(&s);
    qw_options o = asking(0, QW_SYMMETRY_X);
    o.edge_length = 1e-300;
    faults f = {.allocations = FAULTS_NONE, .reports = FAULTS_NONE};
    qw_host host = faults_host(&f);
    qw_result *result;
    assert_int_equal(qw_remesh(&view, &o, &host, &result), QW_OPTION);
    assert_non_null(strstr(qw_result_message(result), "asks for"));
    qw_result_destroy(result), shape_free(&s);
    assert_true(f.most < (size_t)64 << 20);
}

/* A plane that misses the surface doubles it; the report says that it was not like this. */
static void a_plane_beside_the_surface(void **state)
{
    (void)state;
    shape s = shape_sphere(6);
    qw_options o = asking(400, QW_SYMMETRY_PLANE);
    o.symmetry_x = 1, o.symmetry_offset = 5;
    qw_result *result = run_of(&s, &o);
    const qw_report *r = qw_result_report(result);
    assert_int_equal(r->topology.components, 2);
    assert_int_equal(r->topology.euler, 4);
    assert_true(r->warning_count > 0 && strstr(r->warnings[r->warning_count - 1], "two sides") != NULL);
    qw_result_destroy(result), shape_free(&s);
}

/* Quads of the result that are flipped as the input has it, and as the surface that they were made of has it. */
static void flips_of(const shape *s, const qw_options *o, int64_t *by_input, int64_t *by_origin)
{
    qw_context *context;
    qw_mesh_view input = shape_view(s), quads;
    qw_topology topology;
    qw_quality quality;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &input), QW_OK);
    assert_int_equal(qw_measure_result(context, &input, NULL, &topology, &quality), QW_NOT_READY);
    assert_int_equal(qw_run(context, o), QW_OK);
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    assert_int_equal(qw_measure(&quads, &input, NULL, &topology, &quality), QW_OK);
    *by_input = quality.flipped_faces;
    assert_int_equal(qw_measure_result(context, &input, NULL, &topology, &quality), QW_OK);
    *by_origin = quality.flipped_faces;
    assert_int_equal(quality.opposing_faces, *by_input);
    assert_int_equal(topology.quads, quads.face_count);
    qw_destroy(context);
}

/* On the other side of the plane there is nothing that quads could agree with, and a ball that was inside out has been
   turned: neither makes a quad flipped. */
static void quads_are_judged_by_what_they_came_from(void **state)
{
    (void)state;
    int64_t by_input, by_origin;
    shape s = shape_sphere(6);
    qw_options o = asking(400, QW_SYMMETRY_PLANE);
    o.symmetry_x = 1, o.symmetry_offset = 5;
    flips_of(&s, &o, &by_input, &by_origin);
    assert_true(by_input > 50);
    assert_int_equal(by_origin, 0);
    shape_free(&s);
    s = torture_joined(body(0), torture_moved(shape_sphere(6), 6, 0, 0), true);
    o = asking(600, QW_SYMMETRY_NONE);
    flips_of(&s, &o, &by_input, &by_origin);
    assert_true(by_input > 50);
    assert_int_equal(by_origin, 0);
    shape_free(&s);
}

/* Cancels at a report; none is heard once all is done. */
typedef struct canceller {
    long reports;
    double at; /* the share that was done then */
} canceller;

static int cancel_once(void *user, qw_stage stage, double fraction)
{
    (void)stage;
    canceller *c = user;
    if (c->reports-- != 0) return 0;
    c->at = fraction;
    return 1;
}

/* A first failure at some hundred places over a whole run, and a cancel at each report: nothing is left. */
static void failing_runs(void **state)
{
    (void)state;
    shape s = shape_sphere(3);
    qw_mesh_view view = shape_view(&s);
    qw_options o = asking(60, QW_SYMMETRY_AUTO);
    o.threads = 1; /* a pool that finds no memory is no failure */
    for (int kind = 0; kind < 2; kind++)
        for (long n = 0;; n += 1 + n / 40) {
            faults f = {.allocations = kind ? FAULTS_NONE : n, .reports = FAULTS_NONE};
            canceller c = {.reports = kind ? n : -1, .at = 1};
            qw_host host = faults_host(&f);
            host.progress = cancel_once, host.progress_user = &c;
            qw_result *result;
            qw_status status = qw_remesh(&view, &o, &host, &result);
            bool finished = kind ? c.at == 1 : f.allocations >= 0;
            assert_int_equal(status, finished ? QW_OK : kind ? QW_CANCELLED : QW_MEMORY);
            if (!finished) assert_int_equal(qw_result_mesh(result).face_count, 0);
            if (!finished && result) assert_true(strlen(qw_result_message(result)) > 0);
            qw_result_destroy(result);
            assert_int_equal(f.blocks, 0);
            assert_int_equal(f.held, 0);
            if (finished) break;
        }
    shape_free(&s);
}

/* ---- planes */

static void axes_are_exact(void **state)
{
    (void)state;
    qw_mirror_plane p = qw_mirror_plane_of((const double[3]){0, -2, 0}, 3);
    assert_int_equal(p.axis, 1);
    assert_true(p.normal[1] == 1 && p.offset == -1.5);
    double q[3] = {0.1, 7, 0.3}, r[3];
    qw_reflect(&p, q, r);
    assert_true(r[0] == 0.1 && r[1] == -10 && r[2] == 0.3);
    qw_put_on_plane(&p, q);
    assert_true(q[1] == -1.5);
    p = qw_mirror_plane_of((const double[3]){1e200, 1e200, 0}, 1e200);
    assert_int_equal(p.axis, QW_NO_AXIS);
    assert_true(fabs(p.offset - sqrt(0.5)) < 1e-15);
}

QW_TEST_SUITE(symmetry)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(axes_are_exact),
        cmocka_unit_test(sides_are_bits_of_each_other),
        cmocka_unit_test(boundaries_stay_open),
        cmocka_unit_test(any_plane),
        cmocka_unit_test(each_side_follows_its_own),
        cmocka_unit_test(components_come_in_another_order),
        cmocka_unit_test(one_sided_detail_is_named),
        cmocka_unit_test(auto_leaves_others_alone),
        cmocka_unit_test(runs_go_on),
        cmocka_unit_test(painted_densities),
        cmocka_unit_test(what_is_refused),
        cmocka_unit_test(guides_hold_on_both_sides),
        cmocka_unit_test(what_steers_one_side_is_not_mirrored),
        cmocka_unit_test(thin_ribs_are_not_cut_along),
        cmocka_unit_test(an_eighth_is_remeshed),
        cmocka_unit_test(components_have_planes_of_their_own),
        cmocka_unit_test(others_in_a_plane_stay),
        cmocka_unit_test(orientation_counts),
        cmocka_unit_test(fields_hold_on_both_sides),
        cmocka_unit_test(boundaries_that_stay),
        cmocka_unit_test(stages_and_dumps),
        cmocka_unit_test(one_component_without_a_twin),
        cmocka_unit_test(it_can_be_cancelled),
        cmocka_unit_test(small_holes_stay),
        cmocka_unit_test(components_stay_apart),
        cmocka_unit_test(crossing_twins_stay_themselves),
        cmocka_unit_test(surfaces_without_two_sides),
        cmocka_unit_test(a_plane_that_touches_an_edge),
        cmocka_unit_test(tiny_coordinates),
        cmocka_unit_test(ends_of_the_numbers),
        cmocka_unit_test(too_few_quads),
        cmocka_unit_test(too_many_quads),
        cmocka_unit_test(a_plane_beside_the_surface),
        cmocka_unit_test(quads_are_judged_by_what_they_came_from),
        cmocka_unit_test(failing_runs),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

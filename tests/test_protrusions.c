/* Protrusions survive whole runs at counts so low that they are thinner than the quads would be, low walls keep their
 * rims, strips stay strips however long, triangles triangles however sharp, quads are folded where the surface is, and
 * bumps need no singularities. */
#include "suite.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

static double distance2(const double *a, const double *b)
{
    double sum = 0;
    for (int i = 0; i < 3; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sum;
}

/* The distance of a point from the nearest vertex of the mesh. */
static double nearest(const qw_mesh_view *mesh, const double *p)
{
    double best = INFINITY;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) best = fmin(best, distance2(mesh->positions + 3 * (size_t)v, p));
    return sqrt(best);
}

static double area_of(const shape *s)
{
    double sum = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        const double *p[3];
        double u[3], v[3];
        for (int i = 0; i < 3; i++) p[i] = s->position + 3 * (size_t)s->corner[3 * (size_t)f + (size_t)i];
        for (int i = 0; i < 3; i++) u[i] = p[1][i] - p[0][i], v[i] = p[2][i] - p[0][i];
        double x = u[1] * v[2] - u[2] * v[1], y = u[2] * v[0] - u[0] * v[2], z = u[0] * v[1] - u[1] * v[0];
        sum += sqrt(x * x + y * y + z * z) / 2;
    }
    return sum;
}

/* The tip of each finger: the highest vertex of the input between its sides. */
static void find_tips(const shape *s, double tips[5][3])
{
    for (int i = 0; i < 5; i++) tips[i][1] = -INFINITY;
    for (uint32_t v = 0; v < s->vertex_count; v++) {
        const double *p = s->position + 3 * (size_t)v;
        int finger = (int)(p[0] / 2);
        if (p[0] < 2 * finger || p[0] > 2 * finger + 1 || p[1] <= tips[finger][1]) continue;
        for (int i = 0; i < 3; i++) tips[finger][i] = p[i];
    }
}

static qw_result *remeshed_as(const shape *s, const qw_options *options)
{
    qw_mesh_view view = shape_view(s);
    qw_result *result;
    assert_int_equal(qw_remesh(&view, options, NULL, &result), QW_OK);
    return result;
}

static qw_result *remeshed(const shape *s, int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    return remeshed_as(s, &options);
}

static void five_fingers(void **state)
{
    int64_t faces = *(const int64_t *)*state;
    shape hand = shape_hand(6);
    double tips[5][3];
    find_tips(&hand, tips);
    qw_result *result = remeshed(&hand, faces);
    qw_mesh_view quads = qw_result_mesh(result);
    double edge = sqrt(area_of(&hand) / (double)faces);
    for (int i = 0; i < 5; i++) {
        double off = nearest(&quads, tips[i]);
        if (off > 2 * edge)
            print_message("finger %d at %lld faces ends %.4f edges away\n", i, (long long)faces, off / edge);
        assert_true(off <= 2 * edge);
    }
    qw_result_destroy(result);
    shape_free(&hand);
}

/* A ball with so many horns. */
static shape horned(int horns, double width, double longer)
{
    shape ball = shape_sphere(24);
    for (uint32_t v = 0; v < ball.vertex_count; v++) {
        double *p = ball.position + 3 * (size_t)v, length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), r = 1;
        for (int i = 0; i < horns; i++) {
            double a = 2.4 * i, z = 0.8 - 1.6 * i / fmax(horns - 1, 1), w = sqrt(1 - z * z);
            double angle = acos(fmin((p[0] * w * cos(a) + p[1] * w * sin(a) + p[2] * z) / length, 1));
            r += longer * fmax(0, 1 - angle / width);
        }
        for (int k = 0; k < 3; k++) p[k] *= r / length;
    }
    return ball;
}

/* What a run finds is no matter of what was run before in the same context. */
static void used_context(void **state)
{
    (void)state;
    static const int64_t counts[] = {800, 400, 150};
    shape ball = horned(3, 0.14, 1.5);
    qw_mesh_view view = shape_view(&ball);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    for (int i = 0; i < 3; i++) {
        qw_options options;
        qw_options_init(&options);
        options.faces = counts[i];
        qw_mesh_view used;
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_int_equal(qw_get_mesh(context, &used), QW_OK);
        qw_result *result = remeshed(&ball, counts[i]);
        qw_mesh_view fresh = qw_result_mesh(result);
        assert_int_equal(used.vertex_count, fresh.vertex_count);
        assert_int_equal(used.face_count, fresh.face_count);
        assert_memory_equal(used.positions, fresh.positions, 3 * sizeof(double) * fresh.vertex_count);
        qw_result_destroy(result);
    }
    qw_destroy(context);
    shape_free(&ball);
}

static bool report_says(const qw_report *report, const char *words)
{
    for (uint32_t i = 0; i < report->warning_count; i++)
        if (strstr(report->warnings[i], words)) return true;
    return false;
}

/* The report says how few quads would do, and warns where there are to be fewer. */
static void fewest_quads_are_said(void **state)
{
    (void)state;
    shape s = shape_double_torus(2);
    for (int64_t faces = 4; faces <= 400; faces *= 10) {
        qw_result *result = remeshed(&s, faces);
        const qw_report *report = qw_result_report(result);
        assert_true(report->least_faces > 4 && report->least_faces < 40);
        assert_true(report->topology.faces >= report->least_faces);
        assert_int_equal(report_says(report, "are the fewest"), faces < report->least_faces);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

/* Quads for horns are kept before the others are made: these are not drawn out to make room, in the mean of ten
   counts. */
static void room_for_horns_leaves_no_long_quads(void **state)
{
    (void)state;
    enum { COUNTS = 16 };
    shape ball = horned(6, 0.3, 1.5);
    double long_share = 0;
    int64_t grown = 0, attempts = 0;
    for (int64_t faces = 80; faces < 80 + 10 * COUNTS; faces += 10) {
        qw_result *result = remeshed(&ball, faces);
        const qw_report *report = qw_result_report(result);
        print_message("%lld quads: %.3f of the area is in long ones, %lld horns lost\n", (long long)faces,
                      report->long_share, (long long)report->lost_parts);
        long_share += report->long_share / COUNTS;
        grown += report->grown_protrusions, attempts += report->attempts;
        assert_true(report->lost_parts <= 2);
        assert_true(llabs((long long)report->topology.faces - faces) <= 0.05 * (double)faces);
        qw_result_destroy(result);
    }
    assert_true(grown > 0 && attempts > 0 && long_share < 0.04);
    shape_free(&ball);
}

/* Two horns of a ball, a third of an edge wide: where the integers leave them out they grow, in the first attempt. */
static void horns_grow(void **state)
{
    (void)state;
    shape ball = shape_sphere(24);
    static const double horn[2][3] = {{0, 0.6, 0.8}, {0, -0.6, 0.8}};
    for (uint32_t v = 0; v < ball.vertex_count; v++) {
        double *p = ball.position + 3 * (size_t)v, length = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]), longer = 1;
        for (int i = 0; i < 2; i++) {
            double cosine = (p[0] * horn[i][0] + p[1] * horn[i][1] + p[2] * horn[i][2]) / length,
                   angle = acos(fmin(cosine, 1));
            longer += 1.5 * fmax(0, 1 - angle / 0.16);
        }
        for (int k = 0; k < 3; k++) p[k] *= longer / length;
    }
    qw_options options;
    qw_options_init(&options);
    options.faces = 400;
    options.follow = options.loops = 0, options.sharp_angle = 180; /* else the quads reach the tips by themselves */
    qw_result *result = remeshed_as(&ball, &options);
    qw_mesh_view quads = qw_result_mesh(result);
    const qw_report *report = qw_result_report(result);
    double edge = sqrt(area_of(&ball) / 400), far = 0;
    for (uint32_t v = 0; v < ball.vertex_count; v++) far = fmax(far, nearest(&quads, ball.position + 3 * (size_t)v));
    print_message("%lld protrusions grew in %lld attempts, %.2f edges away at most\n",
                  (long long)report->grown_protrusions, (long long)report->attempts, far / edge);
    assert_true(report->grown_protrusions >= 1);
    assert_int_equal(report->attempts, 0);
    assert_int_equal(report->lost_parts, 0);
    assert_true(far < 2 * edge); /* from a vertex, not from a quad */
    assert_true(llabs((long long)quads.face_count - 400) <= 20);
    qw_result_destroy(result);
    shape_free(&ball);
}

/* Six horns of a ball stay at 120 quads, each with its tip; what is not kept is counted. */
static void few_quads_keep_horns(void **state)
{
    (void)state;
    shape ball = horned(6, 0.25, 0.6);
    for (int64_t faces = 40; faces <= 120; faces += 80) {
        qw_result *result = remeshed(&ball, faces);
        const qw_report *report = qw_result_report(result);
        qw_mesh_view quads = qw_result_mesh(result);
        int64_t lost = 0;
        for (uint32_t v = 0; v < ball.vertex_count; v++) {
            const double *p = ball.position + 3 * (size_t)v;
            if (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) > 1.55) lost += nearest(&quads, p) > 0.3;
        }
        print_message("%lld of 6 horns lost at %lld quads, %lld reported\n", (long long)lost, (long long)faces,
                      (long long)report->lost_parts);
        if (faces == 120) assert_int_equal(lost, 0), assert_true(report->grown_protrusions > 0);
        assert_true(report->lost_parts >= lost && report->least_faces >= 6 + 6 * 4);
        if (faces == 40) assert_true(lost > 0);
        qw_result_destroy(result);
    }
    shape_free(&ball);
}

/* A thousand times as long as wide, at one row of quads: what the solvers leave undone adds up along it. */
static void long_strip(void **state)
{
    (void)state;
    enum { COLUMNS = 250, ROWS = 2, LENGTH = 1000 };
    shape s = {.position = malloc(sizeof(double) * 3 * (COLUMNS + 1) * (ROWS + 1)),
               .corner = malloc(sizeof(uint32_t) * 6 * COLUMNS * ROWS)};
    for (uint32_t j = 0; j <= ROWS; j++)
        for (uint32_t i = 0; i <= COLUMNS; i++) {
            double *p = s.position + 3 * (size_t)s.vertex_count++;
            p[0] = (double)i * LENGTH / COLUMNS, p[1] = (double)j / ROWS, p[2] = 0;
        }
    for (uint32_t j = 0; j < ROWS; j++)
        for (uint32_t i = 0; i < COLUMNS; i++) {
            uint32_t a = i + j * (COLUMNS + 1), b = a + COLUMNS + 1;
            shape_square(&s, a, a + 1, b + 1, b, (i + j) % 2);
        }
    qw_result *result = remeshed(&s, LENGTH);
    const qw_report *report = qw_result_report(result);
    assert_int_equal(report->topology.irregular, 0);
    assert_int_equal(report->topology.irregular_boundary, 4); /* its corners */
    assert_int_equal(report->fallback_components, 0);
    assert_true(report->angle_rms < 1 && report->area_cv < 0.1);
    qw_result_destroy(result);
    shape_free(&s);
}

/* A triangle with so sharp a corner that its sides are taken for one lattice line: it needs a quarter turn there, and
 * one cone. */
typedef struct {
    double tangent;
    int64_t count;
} acute;

static void acute_triangle(void **state)
{
    const acute *tip = *state;
    double position[] = {0, 0, 0, 1, 0, 0, 1, tip->tangent, 0};
    uint32_t corner[] = {0, 1, 2};
    shape s = {.position = position, .corner = corner, .vertex_count = 3, .face_count = 1};
    qw_result *result = remeshed(&s, tip->count);
    const qw_report *report = qw_result_report(result);
    assert_int_equal(report->topology.irregular, 1);
    assert_int_equal(report->fallback_components, 0);
    qw_mesh_view quads = qw_result_mesh(result);
    for (uint32_t f = 0; f < quads.face_count; f++) { /* all in the plane, and none flipped */
        const double *a = quads.positions + 3 * (size_t)quads.corners[4 * (size_t)f],
                     *c = quads.positions + 3 * (size_t)quads.corners[4 * (size_t)f + 2];
        const double *b = quads.positions + 3 * (size_t)quads.corners[4 * (size_t)f + 1],
                     *d = quads.positions + 3 * (size_t)quads.corners[4 * (size_t)f + 3];
        assert_true((c[0] - a[0]) * (d[1] - b[1]) - (c[1] - a[1]) * (d[0] - b[0]) > 0);
    }
    qw_result_destroy(result);
}

/* At the tip of a pyramid quads are thin, and what would turn them over on its way to the surface stays where it is: no
 * vertex may in the end. */
static void pyramid_is_met(void **state)
{
    (void)state;
    double position[] = {-1, -0.5, -0.5, -1, -0.5, 0.5, -1, 0.5, 0.5, -1, 0.5, -0.5, 1, 0, 0};
    uint32_t corner[] = {1, 0, 4, 2, 1, 4, 3, 2, 4, 0, 3, 4, 0, 1, 2, 0, 2, 3};
    shape s = {.position = position, .corner = corner, .vertex_count = 5, .face_count = 6};
    qw_result *result = remeshed(&s, 1000);
    qw_mesh_view quads = qw_result_mesh(result);
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const double *p = quads.positions + 3 * (size_t)v;
        double side = fmax(fabs(p[1]), fabs(p[2])) - (1 - p[0]) / 4;
        assert_true(fabs(side) < 1e-5 || (fabs(p[0] + 1) < 1e-5 && side < 1e-5));
    }
    qw_result_destroy(result);
}

static bool comb_cells(int x, int y, int z) { return z >= 0 && (y < 3 || x % 2 == 1); }

/* Ten teeth, walls and gaps about an edge wide and half an edge high: every corner is an irregular vertex, there are no
 * others, and all edges are kept. */
static void low_walls_stay(void **state)
{
    (void)state;
    shape s = shape_of_cells(21, 4, 6, 1, comb_cells);
    for (uint32_t v = 0; v < s.vertex_count; v++) s.position[3 * (size_t)v + 1] *= 0.55;
    qw_options options;
    qw_options_init(&options);
    options.adaptive = 0;
    static const int64_t more[] = {0, 340, 408, 450, 560, 670, 780, 890, 1000}; /* 0: an edge of 1 */
    for (size_t i = 0; i < sizeof more / sizeof *more; i++) {
        options.faces = i ? more[i] : (int64_t)area_of(&s);
        qw_result *result = remeshed_as(&s, &options);
        const qw_report *report = qw_result_report(result);
        qw_mesh_view quads = qw_result_mesh(result);
        assert_int_equal(report->topology.irregular, 8 + 2 * 2 * 20);
        assert_true(report->lost_edges == 0);
        if (i == 0) assert_true(report->angle_rms < 1);
        for (uint32_t v = 0; v < s.vertex_count; v++) { /* the ends of all rims are there */
            const double *p = s.position + 3 * (size_t)v;
            if (p[1] > 0.55 * 2.5 && (p[2] == 0 || p[2] == 6)) assert_true(nearest(&quads, p) < 1e-6);
        }
        qw_result_destroy(result);
    }
    shape_free(&s);
}

/* A cube of whole quads has 682 or 720 of them, this box as few counts: in between the irregular vertices lie beside
 * the corners, and there are no more of them. */
static void boxes_of_any_count(void **state)
{
    (void)state;
    static const struct {
        double size[3];
        int64_t faces;
    } boxes[] = {{{1, 1, 1}, 700}, {{1.2253, 0.6803, 1.331}, 1000}};
    for (size_t i = 0; i < sizeof boxes / sizeof *boxes; i++) {
        shape s = shape_cube(1);
        for (uint32_t k = 0; k < 3 * s.vertex_count; k++) s.position[k] *= boxes[i].size[k % 3];
        qw_result *result = remeshed(&s, boxes[i].faces);
        assert_int_equal(qw_result_report(result)->topology.irregular, 8);
        assert_true(llabs((long long)qw_result_mesh(result).face_count - boxes[i].faces) <= boxes[i].faces / 50);
        qw_result_destroy(result);
        shape_free(&s);
    }
}

/* A prism over a square with a roof: gables of so many units across, walls, ridge and depth. */
typedef struct house {
    double position[30];
    uint32_t corner[48];
} house;

static house house_of(double across, double wall_height, double ridge, double depth)
{
    house s;
    const double gable[5][2] = {{0, 0}, {across, 0}, {across, wall_height}, {across / 2, ridge}, {0, wall_height}};
    for (int v = 0; v < 10; v++)
        s.position[3 * v] = gable[v % 5][0], s.position[3 * v + 1] = gable[v % 5][1],
                       s.position[3 * v + 2] = v < 5 ? 0 : depth;
    const uint32_t gables[18] = {0, 2, 1, 0, 4, 2, 4, 3, 2, 5, 6, 7, 5, 7, 9, 9, 7, 8};
    memcpy(s.corner, gables, sizeof gables);
    for (uint32_t v = 0, at = 18; v < 5; v++, at += 6) {
        uint32_t w = (v + 1) % 5, wall[6] = {v, w, w + 5, v, w + 5, v + 5};
        memcpy(s.corner + at, wall, sizeof wall);
    }
    return s;
}

/* The eaves have 135 degrees and more. There one quarter is as good as two, and what one gable decides must suit the
 * other: nothing may be drawn to a line for it. */
static void roofs_stand(void **state)
{
    (void)state;
    static const double ridges[] = {2.8, 3.2, 3.5};
    for (int i = 0; i < 3; i++) {
        house h = house_of(3, 2, ridges[i], 1);
        shape s = {.position = h.position, .corner = h.corner, .vertex_count = 10, .face_count = 16};
        for (int64_t faces = 700; faces <= 1500; faces += 400) {
            qw_result *result = remeshed(&s, faces);
            const qw_report *report = qw_result_report(result);
            if (report->topology.irregular > 16 || report->fallback_components || report->angle_rms > 9)
                fail_msg("ridge %.1f, %lld faces: %lld irregular, angle %.1f", ridges[i], (long long)faces,
                         (long long)report->topology.irregular, report->angle_rms);
            qw_mesh_view quads = qw_result_mesh(result);
            for (int v = 0; v < 10; v++) assert_true(nearest(&quads, h.position + 3 * v) < 1e-6);
            qw_result_destroy(result);
        }
    }
}

/* Roofs of 44, 45 and 48 degrees: both gables have two quarters at every eave, and quads are even. Where chance
 * decided, areas were off by 0.25 to 0.9, and one house of 4,000 quads had 124 irregular vertices. */
static void gables_agree(void **state)
{
    (void)state;
    static const double slopes[] = {0.9657, 1, 1.1106};
    for (int i = 0; i < 3; i++) {
        house h = house_of(4, 2, 2 + 2 * slopes[i], 5);
        shape s = {.position = h.position, .corner = h.corner, .vertex_count = 10, .face_count = 16};
        for (int64_t faces = 1000; faces <= 4000; faces += 3000) {
            qw_result *result = remeshed(&s, faces);
            const qw_report *report = qw_result_report(result);
            if (report->topology.irregular != 8 || report->area_cv > 0.24)
                fail_msg("slope %.2f, %lld faces: %lld irregular, areas off by %.2f", slopes[i], (long long)faces,
                         (long long)report->topology.irregular, report->area_cv);
            qw_result_destroy(result);
        }
    }
}

static const double PI = 3.14159265358979;

/* Rods of 2 `sides` vertices, `length` diameters long. Where all four quarters of a cap were laid on the one vertex
   within its rim nothing could go around the rod: 140 to 460 irregular vertices, in up to 24 s. The last is three quads
   around at that count, which is no width; four are, at three quarters of the length. */
typedef struct rod {
    uint32_t sides;
    double length;
    int64_t faces;
} rod;

static void rod_is_regular(void **state)
{
    const rod *r = *state;
    double position[3 * 64];
    uint32_t corner[3 * 124], *c = corner;
    for (uint32_t v = 0; v < 2 * r->sides; v++) {
        double angle = 2 * PI * v / r->sides, *p = position + 3 * (size_t)v;
        p[0] = cos(angle) / 2, p[1] = sin(angle) / 2, p[2] = v < r->sides ? 0 : r->length;
    }
    for (uint32_t v = 0; v < r->sides; v++) {
        uint32_t w = (v + 1) % r->sides;
        *c++ = v, *c++ = w, *c++ = r->sides + w, *c++ = v, *c++ = r->sides + w, *c++ = r->sides + v;
    }
    for (uint32_t v = 1; v + 1 < r->sides; v++) {
        *c++ = 0, *c++ = v + 1, *c++ = v;
        *c++ = r->sides, *c++ = r->sides + v, *c++ = r->sides + v + 1;
    }
    shape s = {.position = position, .corner = corner, .vertex_count = 2 * r->sides, .face_count = 4 * r->sides - 4};
    qw_result *result = remeshed(&s, r->faces);
    const qw_report *report = qw_result_report(result);
    assert_true(report->topology.irregular <= 8);
    assert_true(report->angle_rms < 8);
    qw_result_destroy(result);
}

static void at_hoop(double u, double v, double p[3])
{
    double a = 2 * PI * u, b = 2 * PI * v, r = 20 + cos(b);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = sin(b);
}

/* A hoop four or five quads around: no size of squares has these counts. With other sizes alone there were 261 quads
 * for 250 and 480 for 460, and angles off by 27 degrees at 430. */
static void hoops_of_any_count(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){40, 16, true, true, false, at_hoop});
    static const int64_t counts[] = {250, 405, 430, 460};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        qw_options options;
        qw_options_init(&options);
        options.symmetry = 0;                                             /* rows around in pairs have other counts */
        options.faces = counts[i], options.follow = options.adaptive = 0; /* its facets bend at their edges only */
        qw_result *result = remeshed_as(&s, &options);
        const qw_report *report = qw_result_report(result);
        assert_int_equal(report->topology.irregular, 0);
        print_message("%lld of %lld quads, %lld irregular, %.1f degrees\n", (long long)report->topology.faces,
                      (long long)counts[i], (long long)report->topology.irregular, report->angle_rms);
        assert_true(llabs(report->topology.faces - counts[i]) <= counts[i] / 50);
        assert_true(report->angle_rms < 4);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

/* Cut off a cube's corner. A field that crosses its own corners the wrong way has a fourteenth less energy, but leaves
 * a face no room: 41 irregular vertices in seven attempts. */
static void corner_of_a_cube(void **state)
{
    (void)state;
    double position[12] = {0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1};
    uint32_t corner[12] = {0, 1, 2, 2, 3, 0, 1, 3, 2, 0, 3, 1};
    shape s = {.position = position, .corner = corner, .vertex_count = 4, .face_count = 4};
    static const int64_t faces[] = {3000, 5000, 10000};
    int64_t attempts = 0;
    for (int i = 0; i < 3; i++) {
        qw_result *result = remeshed(&s, faces[i]);
        const qw_report *report = qw_result_report(result);
        attempts += report->attempts;
        assert_true(report->topology.irregular <= 12);
        qw_result_destroy(result);
    }
    assert_true(attempts <= 1);
}

/* A frustum over a triangle, whose sides are trapeziums of 45 to 60 and 120 to 135 degrees: one quarter at each of
 * their corners, though two would suit at some. */
static void trapeziums_have_four_corners(void **state)
{
    (void)state;
    double position[18] = {0, 0, 0, 4, 0, 0, 1.4, 3.6, 0};
    for (int v = 0; v < 3; v++) { /* three fifths as large, about the middle */
        for (int i = 0; i < 2; i++)
            position[9 + 3 * v + i] = 0.6 * position[3 * v + i] +
                                      0.4 * (position[i] + position[3 + i] + position[6 + i]) / 3;
        position[9 + 3 * v + 2] = 0.8;
    }
    uint32_t corner[24] = {0, 2, 1, 3, 4, 5, 0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 2, 0, 3, 2, 3, 5};
    shape s = {.position = position, .corner = corner, .vertex_count = 6, .face_count = 8};
    qw_result *result = remeshed(&s, 1500);
    const qw_report *report = qw_result_report(result);
    assert_int_equal(report->topology.irregular, 8);
    assert_true(report->angle_rms < 12);
    qw_result_destroy(result);
}

/* ---- folds and bumps, as whole runs show them */

/* The distance from the sphere of radius 1 of the middle between two vertices. */
static double middle_off(const qw_mesh_view *m, uint32_t a, uint32_t b)
{
    double sum = 0;
    for (size_t i = 0; i < 3; i++)
        sum += pow((m->positions[3 * (size_t)a + i] + m->positions[3 * (size_t)b + i]) / 2, 2);
    return fabs(sqrt(sum) - 1);
}

/* Quads on a sphere begin where the cut from the first corner to the third lies nearer to it; half of them would by
 * chance. */
static void quads_begin_at_their_diagonal(void **state)
{
    (void)state;
    shape s = shape_sphere(24);
    qw_mesh_view view = shape_view(&s);
    qw_result *result;
    qw_options o;
    qw_options_init(&o);
    o.faces = 400, o.exact = false; /* vertices on the sphere itself leave hardly a fold */
    assert_int_equal(qw_remesh(&view, &o, NULL, &result), QW_OK);
    qw_mesh_view out = qw_result_mesh(result);
    uint32_t folded = 0, right = 0;
    for (uint32_t f = 0; f < out.face_count; f++) {
        const uint32_t *c = out.corners + 4 * (size_t)f;
        double first = middle_off(&out, c[0], c[2]), second = middle_off(&out, c[1], c[3]);
        if (fabs(first - second) < 1e-3) continue;
        folded++, right += first < second;
    }
    assert_true(folded > 20);
    assert_true(right >= 0.95 * folded);
    qw_result_destroy(result);
    shape_free(&s);
}

/* A sphere with bumps of some quads has no more singularities with the default smoothness than it would without bumps.
 */
static void bumps_are_evened(void **state)
{
    (void)state;
    shape s = shape_sphere(40);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, bump = 1 + 0.5 * sin(7 * p[0]) * sin(7 * p[1]) * sin(7 * p[2]);
        for (int i = 0; i < 3; i++) p[i] *= bump;
    }
    qw_mesh_view view = shape_view(&s);
    int64_t singularities[2];
    for (int i = 0; i < 2; i++) {
        qw_options options;
        qw_options_init(&options);
        options.faces = 1000;
        options.smoothness = i ? options.smoothness : 0;
        options.follow = 0; /* the bumps are there to be passed over */
        qw_result *result;
        assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
        singularities[i] = qw_result_report(result)->orientation_singularities;
        qw_result_destroy(result);
    }
    assert_true(singularities[0] > 100);
    assert_int_equal(singularities[1], 8); /* no sphere has fewer; with normals smoothed alone this one has 16 */
    shape_free(&s);
}

QW_TEST_SUITE(protrusions)
{
    static acute tips[] = {
        {0.176, 300}, {0.176, 1000}, {0.268, 1000}, {0.364, 1000}, {0.577, 1000}}; /* of 10, 15, 20 and 30 degrees */
    static int64_t counts[] = {100, 150, 200, 400};
    static rod rods[] = {{12, 100, 1000}, {16, 160, 1000}, {8, 160, 1000}, {32, 160, 500}};
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(five_fingers, counts),
        cmocka_unit_test_prestate(five_fingers, counts + 1),
        cmocka_unit_test_prestate(five_fingers, counts + 2),
        cmocka_unit_test_prestate(five_fingers, counts + 3),
        cmocka_unit_test(few_quads_keep_horns),
        cmocka_unit_test(room_for_horns_leaves_no_long_quads),
        cmocka_unit_test(long_strip),
        cmocka_unit_test(pyramid_is_met),
        cmocka_unit_test(roofs_stand),
        cmocka_unit_test(gables_agree),
        cmocka_unit_test(trapeziums_have_four_corners),
        cmocka_unit_test(corner_of_a_cube),
        cmocka_unit_test(low_walls_stay),
        cmocka_unit_test(boxes_of_any_count),
        cmocka_unit_test_prestate(acute_triangle, tips),
        cmocka_unit_test_prestate(acute_triangle, tips + 1),
        cmocka_unit_test_prestate(acute_triangle, tips + 2),
        cmocka_unit_test_prestate(acute_triangle, tips + 3),
        cmocka_unit_test_prestate(acute_triangle, tips + 4),
        cmocka_unit_test_prestate(rod_is_regular, rods),
        cmocka_unit_test_prestate(rod_is_regular, rods + 1),
        cmocka_unit_test_prestate(rod_is_regular, rods + 2),
        cmocka_unit_test_prestate(rod_is_regular, rods + 3),
        cmocka_unit_test(hoops_of_any_count),
        cmocka_unit_test(used_context),
        cmocka_unit_test(horns_grow),
        cmocka_unit_test(fewest_quads_are_said),
        cmocka_unit_test(quads_begin_at_their_diagonal),
        cmocka_unit_test(bumps_are_evened),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

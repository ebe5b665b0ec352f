/* Quads run along and around what bends one way, on surfaces whose directions are known: whole runs, at several counts.
 */
#include "suite.h"

#include "shapes.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

static const double PI = 3.14159265358979;

/* A rod with round ends, of radius 1 and a straight part of 4. */
static void at_capsule(double u, double v, double p[3])
{
    double length = 4 + PI, s = v * length, a = 2 * PI * u, turn = fmin(s, PI / 2) + fmax(s - PI / 2 - 4, 0);
    double r = v > 0 && v < 1 ? sin(turn) : 0, straight = fmin(fmax(s - PI / 2, 0), 4);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = straight - cos(turn);
}

static qw_quality quality_of(const shape *s, int64_t faces, double follow, int64_t *irregular)
{
    qw_result *result;
    qw_mesh_view view = shape_view(s), quads;
    qw_options options;
    qw_topology topology;
    qw_quality quality;
    qw_options_init(&options);
    options.faces = faces, options.adaptive = 0; /* the straight part as fine as the ends */
    if (follow >= 0) options.follow = follow, options.loops = 0, options.symmetry = 0;
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
    quads = qw_result_mesh(result);
    assert_int_equal(qw_measure(&quads, &view, NULL, &topology, &quality), QW_OK);
    *irregular = topology.irregular;
    qw_result_destroy(result);
    return quality;
}

/* Quads wound around the straight part at 43 degrees, as no direction costs a field more than another there. */
static void capsules_have_rings(void **state)
{
    (void)state;
    static const int64_t counts[] = {200, 300, 600, 1200};
    shape s = shape_of_sheet(&(shape_sheet){48, 56, true, false, false, at_capsule});
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        int64_t irregular;
        qw_quality quality = quality_of(&s, counts[i], -1, &irregular);
        assert_int_equal(quality.crossing, 0); /* strips run along or around */
        assert_true(quality.follow < 3);
        assert_true(irregular <= 8);
    }
    shape_free(&s);
}

/* A prism 20 high over a rectangle with round corners, its rims chamfered at 45 degrees: rings of 28 points at four
   heights, and a point amid either end. */
static void at_prism(double u, double v, double p[3])
{
    enum { ARC = 7 };
    static const double radius[] = {0, 2, 4, 4, 2, 0}, height[] = {0, 0, 2, 18, 20, 20};
    int i = (int)(u * 4 * ARC + 0.5) % (4 * ARC), corner = i / ARC, ring = (int)(v * 5 + 0.5);
    double a = PI / 2 * (corner + (double)(i % ARC) / (ARC - 1)), r = radius[ring], out = r > 0;
    p[0] = out * (corner % 3 ? -21 : 21) + r * cos(a), p[1] = out * (corner < 2 ? 11 : -11) + r * sin(a);
    p[2] = height[ring];
}

/* Lines between the cones at the ends cross four curves, which may pass close to them. Whatever the count, each end has
   its four cones and no others, and no strip crosses itself. */
static void chamfered_prisms_have_eight_cones(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){28, 5, true, false, false, at_prism});
    for (int64_t faces = 300; faces <= 1300; faces += 100) {
        int64_t irregular;
        qw_quality quality = quality_of(&s, faces, -1, &irregular);
        assert_int_equal(irregular, 8);
        assert_int_equal(quality.crossing, 0);
        assert_true(quality.follow < 10);
    }
    shape_free(&s);
}

/* Without it, and without lines that meet, the quads lie as few irregular vertices have them: at any angle. */
static void none_is_asked_for(void **state)
{
    (void)state;
    int64_t irregular;
    double sum = 0;
    shape s = shape_of_sheet(&(shape_sheet){48, 56, true, false, false, at_capsule});
    for (int64_t faces = 260; faces < 360; faces += 10) {
        sum += quality_of(&s, faces, 0, &irregular).follow;
        assert_int_equal(irregular, 8);
    }
    assert_true(sum > 4 * 10); /* followed, each is below 3 */
    shape_free(&s);
}

/* A plunger: a cylinder of radius 0.7 that draws together to a rod of radius 0.1. */
static void at_plunger(double u, double v, double p[3])
{
    static const double profile[6][2] = {{0, 0}, {0.7, 0}, {0.7, 0.6}, {0.1, 1}, {0.1, 2.4}, {0, 2.4}};
    static const int part[5] = {6, 6, 8, 16, 4}; /* of 40 rows */
    double at = v * 40, a = 2 * PI * u;
    int k = 0;
    while (k < 4 && at > part[k]) at -= part[k++];
    double t = fmin(at / part[k], 1), r = profile[k][0] + t * (profile[k + 1][0] - profile[k][0]);
    p[0] = r * cos(a), p[1] = r * sin(a), p[2] = profile[k][1] + t * (profile[k + 1][1] - profile[k][1]);
}

static double length_of(const qw_mesh_view *m, uint32_t a, uint32_t b)
{
    double d2 = 0;
    for (size_t k = 0; k < 3; k++) {
        double d = m->positions[3 * (size_t)a + k] - m->positions[3 * (size_t)b + k];
        d2 += d * d;
    }
    return sqrt(d2);
}

/* A plate of 4 x 3 with a round hole of 0.2 at (1.2, 1.1): from its rim to the plate's, which is sampled every 0.25. */
static void at_plate(double u, double v, double p[3])
{
    double t = 14 * u, x = fmin(t, 4) - fmin(fmax(t - 7, 0), 4), y = fmin(fmax(t - 4, 0), 3) - fmax(t - 11, 0);
    double a = atan2(y - 1.1, x - 1.2), near = 1 - v * v;
    p[0] = x + near * (1.2 + 0.2 * cos(a) - x), p[1] = y + near * (1.1 + 0.2 * sin(a) - y), p[2] = 0;
}

/* The mean angle, in degrees, of edges to the nearer axis; of those that lie a unit or more from the hole. */
static double off_axes(const qw_mesh_view *m)
{
    double sum = 0;
    int64_t count = 0;
    for (int64_t h = 0; h < 4 * m->face_count; h++) {
        const double *a = m->positions + 3 * (size_t)m->corners[h],
                     *b = m->positions + 3 * (size_t)m->corners[h % 4 == 3 ? h - 3 : h + 1];
        double x = fabs(b[0] - a[0]), y = fabs(b[1] - a[1]);
        if (hypot(a[0] - 1.2, a[1] - 1.1) > 1.2) sum += atan2(fmin(x, y), fmax(x, y)) * 180 / PI, count++;
    }
    return sum / (double)count;
}

/* Lines part around a hole and are straight behind it, at any number of quads. */
static void rows_on_planes_are_straight(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){56, 12, true, false, false, at_plate});
    for (int64_t faces = 400; faces <= 1600; faces += 300) {
        qw_result *result;
        qw_mesh_view view = shape_view(&s), quads;
        qw_options options;
        qw_options_init(&options);
        options.faces = faces;
        assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
        quads = qw_result_mesh(result);
        assert_true(off_axes(&quads) < 0.12);
        qw_result_destroy(result);
    }
    shape_free(&s);
}

static int compare_numbers(const void *a, const void *b)
{
    const double *x = a, *y = b;
    return *x < *y ? -1 : *x > *y;
}

static double median_aspect(const qw_mesh_view *m)
{
    double *aspect = malloc(m->face_count * sizeof *aspect);
    for (uint32_t f = 0; f < m->face_count; f++) {
        const uint32_t *c = m->corners + 4 * (size_t)f;
        double one = length_of(m, c[0], c[1]) + length_of(m, c[2], c[3]),
               other = length_of(m, c[1], c[2]) + length_of(m, c[3], c[0]);
        aspect[f] = fmax(one, other) / fmin(one, other);
    }
    qsort(aspect, m->face_count, sizeof *aspect, compare_numbers);
    double median = aspect[m->face_count / 2];
    free(aspect);
    return median;
}

/* A bottle with a rim, whose neck is a quarter as wide as its body. */
static void at_bottle(double u, double v, double p[3])
{
    static const double height[] = {0, 0, 0.05, 1, 1.15, 1.4, 1.8, 1.82, 1.88, 1.88},
                        radius[] = {0, 0.4, 0.42, 0.42, 0.35, 0.12, 0.1, 0.13, 0.13, 0};
    int i = (int)(9 * v + 0.5);
    p[0] = radius[i] * cos(2 * PI * u), p[1] = radius[i] * sin(2 * PI * u), p[2] = height[i];
}

/* A goblet: a foot, a stem, and a bowl with a wall. */
static void at_goblet(double u, double v, double p[3])
{
    static const double height[] = {0, 0, 0.03, 0.1, 0.6, 0.75, 1, 1.5, 1.5, 1.03, 0.8, 0.79},
                        radius[] = {0, 0.5, 0.5, 0.08, 0.06, 0.1, 0.45, 0.55, 0.52, 0.42, 0.06, 0};
    int i = (int)(11 * v + 0.5);
    p[0] = radius[i] * cos(2 * PI * u), p[1] = radius[i] * sin(2 * PI * u), p[2] = height[i];
}

/* Returns how many times as long as wide the median quad is. */
static double aspect_of(const shape *s, int64_t faces, double adaptive)
{
    qw_mesh_view view = shape_view(s), quads;
    qw_options options;
    qw_result *result;
    qw_topology topology;
    qw_quality quality;
    qw_options_init(&options);
    options.faces = faces, options.adaptive = adaptive;
    assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
    quads = qw_result_mesh(result);
    assert_int_equal(qw_measure(&quads, NULL, NULL, &topology, &quality), QW_OK);
    double aspect = median_aspect(&quads);
    assert_true(topology.irregular <= 20);
    qw_result_destroy(result);
    return aspect;
}

static void expect_square(const shape *s, int64_t faces, double adaptive)
{
    double aspect = aspect_of(s, faces, adaptive);
    if (aspect > 1.7) fail_msg("%g times as long as wide at %d quads", aspect, (int)faces);
}

/* Were all rows around the wide part to run along the rod as well, quads would be five times as long as wide. */
static void rows_end_where_the_girth_changes(void **state)
{
    (void)state;
    static const int64_t counts[] = {150, 300, 1000};
    shape s = shape_of_sheet(&(shape_sheet){48, 40, true, false, false, at_plunger});
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) expect_square(&s, counts[i], 0);
    shape_free(&s);
    s = shape_of_sheet(&(shape_sheet){48, 9, true, false, false, at_bottle});
    for (size_t i = 1; i < sizeof counts / sizeof *counts; i++) expect_square(&s, counts[i], 0.5);
    shape_free(&s);
    s = shape_of_sheet(&(shape_sheet){48, 11, true, false, false, at_goblet});
    double sum = 0;
    for (int64_t faces = 100; faces < 150; faces += 10) sum += aspect_of(&s, faces, 0.5) / 5;
    for (int64_t faces = 200; faces < 250; faces += 10) expect_square(&s, faces, 0.5);
    assert_true(sum < 1.65);
    shape_free(&s);
}

/* A wheel of 0.4 with a hole of 0.35, four points of its rim a tooth, by their radius and their share of the way to the
   next. */
enum { TEETH = 10 };
static const double (*tooth)[2];

static void at_wheel(double u, double v, double p[3])
{
    int i = (int)(u * 4 * TEETH + 0.5) % (4 * TEETH), ring = (int)(v * 4 + 0.5) % 4;
    double a = 2 * PI * (i / 4 + tooth[i % 4][1]) / TEETH, r = ring == 0 || ring == 3 ? 0.35 : tooth[i % 4][0];
    /* no face lies along an axis */
    double x = r * cos(a), y = r * sin(a), z = ring < 2 ? 0 : 0.4;
    p[0] = 0.8 * x + 0.6 * z, p[1] = y, p[2] = 0.8 * z - 0.6 * x;
}

/* Rows between the hole and the teeth run around the hole, so that there is no cone but at corners, and strips come
   home. Those that ran along the teeth of a ratchet would be spirals: these keep their teeth. */
static void rows_run_around_wheels(void **state)
{
    (void)state;
    static const double gear[4][2] = {{1, 0}, {1.15, 0.12}, {1.15, 0.38}, {1, 0.5}},
                        ratchet[4][2] = {{1, 0}, {1, 0.3}, {1.07, 0.65}, {1.18, 0.97}};
    static const int64_t counts[] = {600, 1000, 3000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        int64_t irregular;
        tooth = gear;
        shape s = shape_of_sheet(&(shape_sheet){4 * TEETH, 4, true, true, false, at_wheel});
        qw_quality quality = quality_of(&s, counts[i], -1, &irregular);
        assert_int_equal(quality.crossing, 0);
        assert_int_equal(irregular, 8 * TEETH);
        shape_free(&s);
        tooth = ratchet;
        s = shape_of_sheet(&(shape_sheet){4 * TEETH, 4, true, true, false, at_wheel});
        quality = quality_of(&s, counts[i], -1, &irregular);
        assert_true(quality.sharp_mean < 0.02); /* edges; 0.15 to 0.27 without teeth */
        shape_free(&s);
    }
}

QW_TEST_SUITE(follow)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(capsules_have_rings),
                                       cmocka_unit_test(none_is_asked_for),
                                       cmocka_unit_test(rows_on_planes_are_straight),
                                       cmocka_unit_test(chamfered_prisms_have_eight_cones),
                                       cmocka_unit_test(rows_end_where_the_girth_changes),
                                       cmocka_unit_test(rows_run_around_wheels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

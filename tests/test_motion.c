/* Rings where a surface moves: by its skin weights, and by its morph targets. */
#include "suite.h"
#include "quad_loops.h"
#include "shapes.h"
#include "unit_shapes.h"

#include "products/attributes/motion.h"

#include <stdio.h>

static const double PI = 3.14159265358979;

static double smooth_step(double t)
{
    t = fmin(fmax(t, 0), 1);
    return t * t * (3 - 2 * t);
}

static qw_context *context_with(const shape *s, const qw_attribute *attributes, uint32_t count)
{
    qw_mesh_view view = shape_view(s);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    if (qw_set_motion(context, attributes, count) != QW_OK) fail_msg("%s", qw_message(context));
    return context;
}

static qw_mesh_view run(qw_context *context, const qw_options *options)
{
    qw_mesh_view quads;
    if (qw_run(context, options) != QW_OK) fail_msg("%s", qw_message(context));
    qw_get_mesh(context, &quads);
    return quads;
}

/* ---- a bent tube, with weights of two bones whose joint is at a slant */

static const double ARC = 6, HALF = 4; /* radius of its bend, half of its length */

/* Bends what is straight along z. */
static void bend(double p[3])
{
    double x = p[0] + ARC, a = p[2] / ARC;
    p[0] = x * cos(a) - ARC, p[2] = x * sin(a);
}

/* How far a point of the bent tube is from the joint, across it, in the straight one. */
static double from_joint(const double p[3], double slant)
{
    double x = hypot(p[0] + ARC, p[2]) - ARC, z = ARC * atan2(p[2], p[0] + ARC);
    return sin(slant) * x + cos(slant) * z;
}

typedef struct tube {
    shape s;
    float *weight;
    uint32_t *group;
    qw_attribute weights;
} tube;

static tube bent_tube(double slant)
{
    tube t = {.s = shape_sphere(32)};
    uint32_t n = t.s.vertex_count;
    t.weight = malloc(2 * n * sizeof *t.weight), t.group = malloc(2 * n * sizeof *t.group);
    for (uint32_t v = 0; v < n; v++) {
        double *p = t.s.position + 3 * (size_t)v, out = hypot(p[0], p[1]), r = sqrt(1 - pow(fabs(p[2]), 6));
        for (int k = 0; k < 2; k++) p[k] *= out > 0 ? r / out : 0;
        p[2] *= HALF;
        bend(p);
        double w = smooth_step(0.5 + from_joint(p, slant) / 2);
        t.weight[2 * v] = (float)(1 - w), t.weight[2 * v + 1] = (float)w;
        t.group[2 * v] = 3, t.group[2 * v + 1] = 8;
    }
    t.weights = (qw_attribute){.size = sizeof t.weights,
                               .name = "weights",
                               .kind = QW_WEIGHTS,
                               .components = 2,
                               .count = n,
                               .values = t.weight,
                               .group = t.group};
    return t;
}

static void free_tube(tube *t) { shape_free(&t->s), free(t->weight), free(t->group); }

/* Whether a loop lies within the joint and runs along a line of equal weight. */
static int is_at_slant(const qw_mesh_view *q, const uint32_t *loop, uint32_t count, const void *user)
{
    double least = INFINITY, most = -INFINITY;
    for (uint32_t i = 0; i < count; i++) {
        double at = from_joint(q->positions + 3 * (size_t)loop[i], *(const double *)user);
        least = fmin(least, at), most = fmax(most, at);
    }
    return least > -1 && most < 1 && most - least < 0.3;
}

static void rings_run_at_the_slant_of_weights(void **state)
{
    (void)state;
    for (int degrees = -40; degrees <= 40; degrees += 10) {
        double slant = degrees * PI / 180;
        tube t = bent_tube(slant);
        qw_context *context = context_with(&t.s, &t.weights, 1);
        qw_options options;
        qw_options_init(&options);
        options.faces = 800;
        qw_mesh_view quads = run(context, &options);
        uint32_t rings = count_loops(&quads, is_at_slant, &slant);
        options.follow_motion = 0;
        quads = run(context, &options);
        uint32_t without = count_loops(&quads, is_at_slant, &slant);
        printf("%d degrees: %u rings at the slant, %u without\n", degrees, rings, without);
        assert_true(rings >= 3 && (degrees == 0 || without == 0));
        qw_destroy(context);
        free_tube(&t);
    }
}

/* On each triangle the direction is that of the gradient, as long as this is. */
static void motion_is_the_gradient(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    shape s = shape_sphere(6);
    uint32_t n = s.vertex_count, *begin = QW_NEW(env, uint32_t, s.face_count + 1);
    float *values = QW_NEW(env, float, 3 * n);
    for (uint32_t f = 0; f <= s.face_count; f++) begin[f] = 3 * f;
    for (uint32_t v = 0; v < n; v++) { /* from 0 to 5 over a length of 2 */
        const double *p = s.position + 3 * (size_t)v;
        for (int k = 0; k < 3; k++) values[3 * v + k] = k == 1 ? (float)(2.5 * (1 + p[2])) : 0;
    }
    qw_clean_input input = {
        .vertex_count = n, .face_count = s.face_count, .position = s.position, .face_begin = begin, .corner = s.corner};
    qw_attribute target = {.size = sizeof target, .name = "target:up", .components = 3, .count = n, .values = values};
    double *largest = qw_largest_offsets(env, &input, &target, 1);
    assert_float_equal(largest[0], 5, 1e-6);
    qw_vec3 *motion = qw_motion_of_faces(env, &input, &target, 1, largest);
    for (uint32_t f = 0; f < s.face_count; f++) {
        double a[3], b[3], normal[3];
        for (int k = 0; k < 3; k++) {
            const double *origin = s.position + 3 * (size_t)s.corner[3 * f];
            a[k] = s.position[3 * (size_t)s.corner[3 * f + 1] + k] - origin[k];
            b[k] = s.position[3 * (size_t)s.corner[3 * f + 2] + k] - origin[k];
        }
        qw_cross_doubles(a, b, normal), qw_unit_doubles(normal);
        qw_vec3 up = qw_reject(qw_v3(0, 0, 0.5f), qw_v3_of_doubles(normal));
        float off = fminf(qw_distance(up, motion[f]), qw_length(qw_add(up, motion[f])));
        assert_true(off < 1e-4f);
    }
    target.name = "other"; /* no target: nothing moves */
    largest = qw_largest_offsets(env, &input, &target, 1);
    assert_true(largest[0] == 0);
    assert_null(qw_motion_of_faces(env, &input, &target, 1, largest));
    qw_env_destroy(env);
    shape_free(&s);
}

/* What can't be is refused, and what says nothing of movement changes nothing. */
static void wrong_motion_is_refused(void **state)
{
    (void)state;
    tube t = bent_tube(0);
    qw_mesh_view view = shape_view(&t.s);
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_motion(NULL, NULL, 0), QW_ARGUMENT);
    assert_int_equal(qw_set_motion(context, &t.weights, 1), QW_NOT_READY);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    qw_options options;
    qw_options_init(&options);
    options.faces = 500;
    uint32_t faces = run(context, &options).face_count;
    assert_int_equal(qw_set_motion(context, NULL, 0), QW_OK);
    qw_mesh_view quads; /* still there */
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
    t.weight[7] = -1;
    assert_int_equal(qw_set_motion(context, &t.weights, 1), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "a weight below 0"));
    assert_int_equal(qw_get_mesh(context, &quads), QW_OK); /* and after a refusal */
    t.weight[7] = 0;
    assert_int_equal(qw_set_motion(context, &t.weights, 1), QW_OK);
    assert_int_equal(qw_get_mesh(context, &quads), QW_NOT_READY);
    run(context, &options);
    assert_int_equal(qw_get_report(context)->nests, 1);
    options.faces = 60; /* six quads go around, but three rings have no room along it */
    run(context, &options);
    assert_int_equal(qw_get_report(context)->nests, 0);
    options.faces = 500;
    assert_int_equal(qw_set_motion(context, NULL, 0), QW_OK);
    assert_int_equal(run(context, &options).face_count, faces);
    assert_int_equal(qw_get_report(context)->nests, 0);
    qw_destroy(context);
    free_tube(&t);
}

/* ---- a face, with targets that open its mouth and close its eyes */

typedef struct place {
    double x, y, wide, high;
} place;
static const place PLACES[] = {{0, -0.4, 0.28, 0.16}, {-0.33, 0.25, 0.17, 0.12}, {0.33, 0.25, 0.17, 0.12}};
enum { PLACE_COUNT = sizeof PLACES / sizeof *PLACES };

/* 1 in the middle of a place, 0.5 at its rim, 0 beyond twice of it; on the front side. */
static double nearness(const place *a, const double p[3])
{
    return p[2] > 0 ? smooth_step(1 - hypot((p[0] - a->x) / a->wide, (p[1] - a->y) / a->high) / 2) : 0;
}

/* Whether a loop goes around a place, and around no more than twice its size. */
static int is_around(const qw_mesh_view *q, const uint32_t *loop, uint32_t count, const void *user)
{
    const place *a = user;
    double turn = 0;
    for (uint32_t i = 0; i < count; i++) {
        const double *p = q->positions + 3 * (size_t)loop[i], *r = q->positions + 3 * (size_t)loop[(i + 1) % count];
        if (nearness(a, p) == 0) return 0;
        turn += remainder(atan2(r[1] - a->y, r[0] - a->x) - atan2(p[1] - a->y, p[0] - a->x), 2 * PI);
    }
    return fabs(fabs(turn) - 2 * PI) < 1e-6;
}

static void targets_get_rings(void **state)
{
    (void)state;
    static const char *const names[] = {"target:open mouth", "target:close right eye", "target:close left eye"};
    shape s = shape_sphere(48);
    uint32_t n = s.vertex_count;
    qw_attribute target[PLACE_COUNT];
    for (int i = 0; i < PLACE_COUNT; i++) {
        float *offset = calloc(3 * n, sizeof *offset);
        for (uint32_t v = 0; v < n; v++) {
            const double *p = s.position + 3 * (size_t)v;
            offset[3 * v + 1] = (float)(-0.1 * nearness(&PLACES[i], p));
        }
        target[i] =
            (qw_attribute){.size = sizeof *target, .name = names[i], .components = 3, .count = n, .values = offset};
    }
    qw_context *context = context_with(&s, target, PLACE_COUNT);
    qw_options options;
    qw_options_init(&options);
    options.faces = 3000;
    for (int follows = 0; follows < 2; follows++) {
        if (!follows) options.follow_motion = 0;
        else options.follow_motion = 0.5;
        qw_mesh_view quads = run(context, &options);
        for (int i = 0; i < PLACE_COUNT; i++) {
            uint32_t rings = count_loops(&quads, is_around, &PLACES[i]);
            printf("%s: %u rings, %d\n", names[i], rings, follows);
            assert_true(follows ? rings >= 3 : rings == 0);
        }
    }
    qw_destroy(context);
    for (int i = 0; i < PLACE_COUNT; i++) free((void *)target[i].values);
    shape_free(&s);
}

QW_TEST_SUITE(motion)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motion_is_the_gradient),
        cmocka_unit_test(rings_run_at_the_slant_of_weights),
        cmocka_unit_test(wrong_motion_is_refused),
        cmocka_unit_test(targets_get_rings),
    };
    return cmocka_run_group_tests_name("motion", tests, NULL, NULL);
}

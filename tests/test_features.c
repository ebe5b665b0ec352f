/* Sharp edges: found on solids at any resolution, not on smooth, bent or noisy surfaces; marks agree on both sides. */
#include "random.h"
#include "suite.h"
#include "remesh/features/features.h"
#include "remesh/clean/clean.h"
#include "remesh/clean/marks.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const double PI = 3.14159265358979;

/* Surfaces come as functions of a grid of columns x rows quads; `around` closes the columns. */
typedef struct shape {
    qw_env *env;
    uint32_t columns, rows;
    bool around;
    void (*point)(double u, double v, double *p); /* u, v: column and row, divided by their numbers */
    double noise, angle, quad_edge;
    /* results */
    qw_clean clean;
    int64_t count;
    double used, length; /* length in the shape's units */
} shape;

static uint64_t seed;

static double noise(double size)
{
    random_step(&seed);
    return size * ((double)(seed >> 11) / 9007199254740992.0 - 0.5);
}

static qw_clean clean_grid(const shape *s)
{
    uint32_t w = s->around ? s->columns : s->columns + 1, vertices = w * (s->rows + 1), faces = s->columns * s->rows;
    double *position = QW_NEW(s->env, double, 3 * vertices);
    uint32_t *begin = QW_NEW(s->env, uint32_t, faces + 1), *corner = QW_NEW(s->env, uint32_t, 4 * faces);
    for (uint32_t i = 0; i < vertices; i++) {
        s->point((double)(i % w) / s->columns, (double)(i / w) / s->rows, position + 3 * i);
        for (int k = 0; k < 3; k++) position[3 * i + k] += noise(s->noise);
    }
    for (uint32_t f = 0; f <= faces; f++) {
        begin[f] = 4 * f;
        if (f == faces) break;
        uint32_t x = f % s->columns, y = f / s->columns, next = (x + 1) % w;
        const uint32_t q[4] = {y * w + x, y * w + next, (y + 1) * w + next, (y + 1) * w + x};
        memcpy(corner + 4 * f, q, sizeof q);
    }
    return qw_clean_surface(
        s->env, &(qw_clean_input){vertices, faces, position, begin, corner, false, 0, NULL, NULL, NULL, 0, NULL}, 0,
        true);
}

static void find_body(void *user)
{
    shape *s = user;
    s->clean = clean_grid(s);
    qw_trimesh *m = &s->clean.mesh;
    s->count = qw_find_features(s->env, m, s->angle, (float)s->quad_edge, &s->used);
    qw_trimesh_validate(s->env, m);
    int64_t count = 0;
    s->length = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!m->mark[h]) continue;
        assert_true(m->twin[h] != QW_NONE);
        count++;
        s->length += qw_distance(m->position[m->corner[h]], m->position[m->corner[qw_next(h)]]) / s->clean.frame.scale /
                     2;
    }
    assert_int_equal(count, 2 * s->count);
}

static void find(shape *s)
{
    s->env = qw_env_create(NULL, 1);
    if (s->angle == 0) s->angle = -1;
    if (s->quad_edge == 0) s->quad_edge = 0.03;
    qw_status status = qw_protect(s->env, find_body, s);
    if (status != QW_OK) print_message("%s\n", qw_env_message(s->env));
    assert_int_equal(status, QW_OK);
}

/* ---- shapes */

/* A square tube of side 1 and height 2 without lids. */
static void tube(double u, double v, double *p)
{
    double t = 4 * u, s = t - floor(t);
    int side = (int)t % 4;
    p[0] = side == 0 ? s : side == 1 ? 1 : side == 2 ? 1 - s : 0;
    p[1] = side == 0 ? 0 : side == 1 ? s : side == 2 ? 1 : 1 - s;
    p[2] = 2 * v;
}

/* A can: lid, side, lid, all from one grid. */
static void can(double u, double v, double *p)
{
    double r = v < 0.25 ? 4 * v : v > 0.75 ? 4 * (1 - v) : 1;
    r = fmax(r, 0.05);
    p[0] = r * cos(2 * PI * u);
    p[1] = r * sin(2 * PI * u);
    p[2] = fmin(fmax(v, 0.25), 0.75) * 4;
}

static void ball(double u, double v, double *p)
{
    double t = 0.1 + v * (PI - 0.2);
    p[0] = sin(t) * cos(2 * PI * u);
    p[1] = sin(t) * sin(2 * PI * u);
    p[2] = -cos(t);
}

/* A roof whose ridge fades out: 80 degrees at one end, flat at the other. */
static void fading(double u, double v, double *p)
{
    p[0] = 2 * u - 1;
    p[1] = 2 * v;
    p[2] = -fabs(p[0]) * tan(40 * PI / 180 * (1 - v));
}

/* A roof whose ridge is dull in the middle: 80 degrees at both ends, 28 between. */
static void dipping(double u, double v, double *p)
{
    p[0] = 2 * u - 1;
    p[1] = 2 * v;
    p[2] = -fabs(p[0]) * tan((27 + 13 * cos(2 * PI * v)) * PI / 180);
}

/* And one that is dull at both ends, 29 degrees, where it meets the boundary, and 50 between. */
static void dull_ends(double u, double v, double *p)
{
    p[0] = 2 * u - 1;
    p[1] = 2 * v;
    p[2] = -fabs(p[0]) * tan((14.5 + 10.5 * sin(PI * v)) * PI / 180);
}

/* A sheet bent by 150 degrees over a radius of a few grid lines: a fold, no crease. */
static void fold(double u, double v, double *p)
{
    double x = (u - 0.5) * 40, bend = fmin(fmax(x, -2), 2) / 4 * 150 * PI / 180, r = 4 / (150 * PI / 180),
           out = fmax(fabs(x) - 2, 0);
    p[0] = (r * sin(bend) + out * cos(bend) * (x < 0 ? -1 : 1)) / 20;
    p[1] = 2 * v;
    p[2] = (r * cos(bend) - out * fabs(sin(bend))) / 20;
}

static void plane(double u, double v, double *p)
{
    p[0] = u;
    p[1] = v;
    p[2] = 0;
}

/* One spike in a plane. */
static void spike(double u, double v, double *p)
{
    plane(u, v, p);
    p[2] = hypot(u - 0.5, v - 0.5) < 0.011 ? 0.05 : 0;
}

/* ---- tests */

static void finds_edges_of_solids(void **state)
{
    (void)state;
    for (uint32_t n = 1; n <= 32; n *= 2) {
        shape s = {.columns = 4 * n, .rows = 2 * n, .around = true, .point = tube};
        find(&s);
        assert_int_equal(s.count, 8 * n); /* four edges of 2n pieces */
        assert_float_equal(s.length, 8, 1e-4);
        assert_float_equal(s.used, 40 * PI / 180, 1e-6);
        qw_env_destroy(s.env);
    }
}

static void finds_rims_and_no_facets(void **state)
{
    (void)state;
    static const uint32_t sides[] = {11, 12, 24, 64}; /* facets of 33, 30, 15 and 6 degrees */
    for (int i = 0; i < 4; i++) {
        shape s = {.columns = sides[i], .rows = 8, .around = true, .point = can};
        find(&s);
        assert_int_equal(s.count, 2 * sides[i]);
        qw_env_destroy(s.env);
    }
}

static void finds_nothing_on_smooth_surfaces(void **state)
{
    (void)state;
    shape smooth[] = {{.columns = 12, .rows = 6, .around = true, .point = ball},
                      {.columns = 60, .rows = 30, .around = true, .point = ball},
                      {.columns = 40, .rows = 30, .point = fold},
                      {.columns = 40, .rows = 40, .point = plane}};
    for (size_t i = 0; i < sizeof smooth / sizeof *smooth; i++) {
        find(&smooth[i]);
        assert_int_equal(smooth[i].count, 0);
        qw_env_destroy(smooth[i].env);
    }
}

static void finds_nothing_in_noise(void **state)
{
    (void)state;
    seed = 3;
    static const double size[] = {0.02, 0.05, 0.1, 0.2};
    for (int i = 0; i < 4; i++) {
        shape s = {.columns = 80, .rows = 40, .around = true, .point = ball, .noise = size[i]};
        find(&s);
        assert_true(s.count <= 3 * s.clean.mesh.face_count / 2 / 200);
        qw_env_destroy(s.env);
    }
}

static void finds_edges_under_slight_noise(void **state)
{
    (void)state;
    seed = 5;
    shape s = {.columns = 64, .rows = 32, .around = true, .point = tube, .noise = 0.005};
    find(&s);
    assert_true(s.count >= 4 * 32 && s.count <= 4 * 32 + 8);
    qw_env_destroy(s.env);
}

static void follows_fading_edges(void **state)
{
    (void)state;
    shape s = {.columns = 40, .rows = 40, .point = fading};
    find(&s);
    /* 40 (1 - v) is 20 degrees (seeds) at v = 0.5, 17.5 degrees (tails) at v = 0.5625 and 12.5 (growth) at 0.6875. */
    assert_true(s.count >= 22 && s.count <= 23);
    const qw_trimesh *m = &s.clean.mesh;
    for (uint32_t h = 0; h < 3 * m->face_count; h++)
        if (m->mark[h]) assert_float_equal(m->position[m->corner[h]].x, m->position[m->corner[qw_next(h)]].x, 1e-6);
    qw_env_destroy(s.env);
}

static void closes_gaps(void **state)
{
    (void)state;
    shape s = {.columns = 40, .rows = 40, .point = dipping};
    find(&s);
    assert_int_equal(s.count, 40);
    qw_env_destroy(s.env);
}

static void boundaries_hold_ends(void **state)
{
    (void)state;
    shape s = {.columns = 40, .rows = 40, .point = dull_ends};
    find(&s);
    assert_int_equal(s.count, 40);
    qw_env_destroy(s.env);
}

static void drops_tiny_features(void **state)
{
    (void)state;
    shape s = {.columns = 50, .rows = 50, .point = spike, .quad_edge = 1};
    find(&s);
    assert_int_equal(s.count, 0);
    qw_env_destroy(s.env);
}

static void takes_a_given_angle(void **state)
{
    (void)state;
    shape s = {.columns = 12, .rows = 8, .around = true, .point = can, .angle = 29 * PI / 180};
    find(&s);
    assert_true(s.count >= 24 + 12 * 4);
    assert_float_equal(s.used, s.angle, 0);
    qw_env_destroy(s.env);
    s.angle = 31 * PI / 180;
    find(&s);
    assert_int_equal(s.count, 24);
    qw_env_destroy(s.env);
    s.angle = PI;
    find(&s);
    assert_int_equal(s.count, 0);
    qw_env_destroy(s.env);
}

typedef struct solid {
    uint32_t vertex_count, face_count;
    const double *position;
    const uint32_t *corner;
} solid;

static int64_t sharp_edges_of(const solid *s, float quad_edge)
{
    qw_env *env = qw_env_create(NULL, 1);
    uint32_t *begin = QW_NEW(env, uint32_t, s->face_count + 1);
    for (uint32_t f = 0; f <= s->face_count; f++) begin[f] = 3 * f;
    qw_clean clean = qw_clean_surface(env,
                                      &(qw_clean_input){s->vertex_count, s->face_count, s->position, begin, s->corner,
                                                        false, 0, NULL, NULL, NULL, 0, NULL},
                                      0, true);
    double used;
    int64_t count = qw_find_features(env, &clean.mesh, -1, quad_edge * (float)clean.frame.scale, &used);
    qw_env_destroy(env);
    return count;
}

/* A pyramid of three ridges, 29 degrees where they meet and sharper outwards, on a hexagon of equilateral triangles. */
static void dull_creases_meet(void **state)
{
    (void)state;
    enum { N = 20, WIDE = 2 * N + 1 };
    static double position[3 * WIDE * WIDE];
    static uint32_t number[WIDE][WIDE], corner[3 * 2 * WIDE * WIDE];
    solid s = {.position = position, .corner = corner};
    for (int j = -N; j <= N; j++)
        for (int i = -N; i <= N; i++) {
            if (abs(i + j) > N) continue;
            double x = (i + 0.5 * j) / N, y = j * sqrt(0.75) / N,
                   down = fmax(x, fmax(-x / 2 + sqrt(0.75) * y, -x / 2 - sqrt(0.75) * y));
            number[j + N][i + N] = s.vertex_count;
            double *p = position + 3 * s.vertex_count++;
            p[0] = x, p[1] = y, p[2] = -0.3 * down * (1 + down);
        }
    for (int j = -N; j < N; j++)
        for (int i = -N; i < N; i++) {
            const uint32_t a = number[j + N][i + N], b = number[j + N][i + 1 + N], c = number[j + 1 + N][i + N],
                           d = number[j + 1 + N][i + 1 + N];
            const uint32_t lower[3] = {a, b, c}, upper[3] = {b, d, c};
            bool has_middle = abs(i + 1 + j) <= N; /* b and c */
            if (has_middle && abs(i + j) <= N) memcpy(corner + 3 * s.face_count++, lower, sizeof lower);
            if (has_middle && abs(i + j + 2) <= N) memcpy(corner + 3 * s.face_count++, upper, sizeof upper);
        }
    assert_int_equal(sharp_edges_of(&s, 0), 3 * N);
}

/* A prism of 12 sides, as low as a disk: its rims turn by most, and its sides by 30 degrees. */
static void facets_of_a_disk_stay_out(void)
{
    double position[3 * 26];
    uint32_t corner[3 * 48], *c = corner;
    for (uint32_t v = 0; v < 26; v++) {
        double *p = position + 3 * v, angle = v / 2 * acos(-1) / 6;
        p[0] = v < 24 ? cos(angle) : 0, p[1] = v < 24 ? sin(angle) : 0, p[2] = v % 2 ? 0.4 : 0;
    }
    for (uint32_t k = 0; k < 12; k++) {
        uint32_t a = 2 * k, b = 2 * ((k + 1) % 12);
        const uint32_t four[] = {a, b, b + 1, a, b + 1, a + 1, b, a, 24, a + 1, b + 1, 25};
        memcpy(c, four, sizeof four), c += 12;
    }
    assert_int_equal(sharp_edges_of(&(solid){26, 48, position, corner}, 0.05f), 24);
}

/* Solids of few facets keep all their edges, though more than three meet at most vertices, and eaves of a roof that is
   steeper or less steep; not where the quads are as large as the facets. */
static void keeps_edges_of_facets(void **state)
{
    (void)state;
    static const double octahedron[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    static const uint32_t octants[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    double obelisk[27] = {0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 0, 0, 3, 2, 0, 3, 2, 2, 3, 0, 2, 3, 1, 1, 0};
    static const uint32_t sides[] = {0, 2, 1, 0, 3, 2, 0, 1, 5, 0, 5, 4, 1, 2, 6, 1, 6, 5, 2, 3, 7,
                                     2, 7, 6, 3, 0, 4, 3, 4, 7, 4, 5, 8, 5, 6, 8, 6, 7, 8, 7, 4, 8};
    solid s = {6, 8, octahedron, octants};
    assert_int_equal(sharp_edges_of(&s, 0.2f), 12);
    assert_int_equal(sharp_edges_of(&s, 0.4f), 0);
    for (int i = 0; i < 2; i++) { /* eaves of 45 and 30 degrees */
        obelisk[26] = 3 + (i ? sqrt(3) : 1);
        s = (solid){9, 14, obelisk, sides};
        assert_int_equal(sharp_edges_of(&s, 0.2f), 16);
    }
    facets_of_a_disk_stay_out();
}

/* A facet that lies folded on itself, as a concave polygon does that was cut into triangles from one corner, makes
 * noise of what would be facets. */
static void folded_facets_are_noise(void **state)
{
    (void)state;
    static const double position[] = {
        1, 0, 0, -1, 0, 0, 0,  1,    0,    0,   -1,
        0, 0, 0, 1,  0, 0, -1, -0.5, 0.75, 0.75}; /* the last beside the first face, in its plane */
    static const uint32_t corner[] = {0, 2, 6, 2, 4, 6, 4, 0, 6, 2, 1, 4, 1, 3, 4,
                                      3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    assert_int_equal(sharp_edges_of(&(solid){7, 10, position, corner}, 0.2f), 0);
}

/* Marks of the input lie on the clean mesh wherever its vertices have gone; what is no edge there marks nothing. */
static void takes_marks(void **state)
{
    (void)state;
    static const double position[] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 9, 9, 9, 0, 0, 0, 1, 1, 0};
    static const uint32_t begin[] = {0, 3, 6}, corner[] = {0, 1, 2, 5, 6, 3},
                          mark[] = {6, 0, 0, 1, 1, 3, 4, 0}; /* a diagonal; a boundary; none; none */
    qw_env *env = qw_env_create(NULL, 1);
    qw_clean_input input = {7, 2, position, begin, corner, true, 4, mark, NULL, NULL, 0, NULL};
    qw_clean clean = qw_clean_surface(env, &input, 0, true);
    assert_int_equal(clean.mesh.vertex_count, 4);
    assert_int_equal(qw_take_marks(env, &input, &clean.frame, &clean.mesh), 1);
    qw_trimesh_validate(env, &clean.mesh);
    for (uint32_t h = 0; h < 6; h++) assert_int_equal(clean.mesh.mark[h] != 0, clean.mesh.twin[h] != QW_NONE);
    qw_env_destroy(env);
}

QW_TEST_SUITE(features)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(finds_edges_of_solids),
        cmocka_unit_test(finds_rims_and_no_facets),
        cmocka_unit_test(finds_nothing_on_smooth_surfaces),
        cmocka_unit_test(finds_nothing_in_noise),
        cmocka_unit_test(finds_edges_under_slight_noise),
        cmocka_unit_test(follows_fading_edges),
        cmocka_unit_test(closes_gaps),
        cmocka_unit_test(boundaries_hold_ends),
        cmocka_unit_test(drops_tiny_features),
        cmocka_unit_test(takes_a_given_angle),
        cmocka_unit_test(dull_creases_meet),
        cmocka_unit_test(keeps_edges_of_facets),
        cmocka_unit_test(folded_facets_are_noise),
        cmocka_unit_test(takes_marks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

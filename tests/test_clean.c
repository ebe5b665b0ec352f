/* Cleaning: each step on the smallest input that needs it, and random soups that must always become valid surfaces. */
#include "faults.h"
#include "random.h"
#include "suite.h"
#include "remesh/clean/clean.h"
#include "geometry/triangulate.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MOST = 4096 };

/* A polygon soup that is written down face by face. */
typedef struct soup {
    double position[3 * MOST];
    uint32_t begin[MOST + 1], corner[4 * MOST];
    uint32_t vertices, faces;
    bool separate;
    double least_share; /* of components */
} soup;

static soup s; /* large; each test starts it anew */

static uint32_t vertex(double x, double y, double z)
{
    s.position[3 * s.vertices] = x;
    s.position[3 * s.vertices + 1] = y;
    s.position[3 * s.vertices + 2] = z;
    return s.vertices++;
}

static void polygon(uint32_t n, const uint32_t *corner)
{
    memcpy(s.corner + s.begin[s.faces], corner, n * sizeof *corner);
    s.begin[s.faces + 1] = s.begin[s.faces] + n;
    s.faces++;
}

static void triangle(uint32_t a, uint32_t b, uint32_t c) { polygon(3, (uint32_t[]){a, b, c}); }
static void quad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) { polygon(4, (uint32_t[]){a, b, c, d}); }

/* An axis-aligned box of quads; vertices are made anew unless v is given. side < 0 turns it inside out. */
static void box(double x, double y, double z, double side)
{
    uint32_t v[8];
    double a = fabs(side);
    for (uint32_t i = 0; i < 8; i++) v[i] = vertex(x + (i & 1 ? a : 0), y + (i & 2 ? a : 0), z + (i & 4 ? a : 0));
    static const uint32_t q[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (int f = 0; f < 6; f++)
        if (side > 0) quad(v[q[f][0]], v[q[f][1]], v[q[f][2]], v[q[f][3]]);
        else quad(v[q[f][3]], v[q[f][2]], v[q[f][1]], v[q[f][0]]);
}

static void tetrahedron(double x, bool inside_out)
{
    uint32_t a = vertex(x, 0, 0), b = vertex(x + 1, 0, 0), c = vertex(x, 1, 0), d = vertex(x, 0, 1);
    uint32_t t[4][3] = {{a, c, b}, {a, b, d}, {b, c, d}, {c, a, d}};
    for (int f = 0; f < 4; f++) triangle(t[f][0], t[f][inside_out ? 2 : 1], t[f][inside_out ? 1 : 2]);
}

/* Gives every corner its own vertex, as STL does. */
static void separate(void)
{
    static soup t;
    t = s;
    memset(&s, 0, sizeof s);
    s.separate = true;
    for (uint32_t f = 0; f < t.faces; f++) {
        uint32_t own[16], n = t.begin[f + 1] - t.begin[f];
        for (uint32_t i = 0; i < n; i++) {
            const double *p = t.position + 3 * t.corner[t.begin[f] + i];
            own[i] = vertex(p[0], p[1], p[2]);
        }
        polygon(n, own);
    }
}

typedef struct run {
    qw_env *env;
    qw_clean clean;
    qw_census census;
    double volume; /* signed, in the units of the soup */
} run;

static void clean_body(void *user)
{
    run *r = user;
    qw_clean_input input = {s.vertices, s.faces, s.position, s.begin, s.corner, s.separate,
                            0,          NULL,    NULL,       NULL,    0,        NULL};
    r->clean = qw_clean_surface(r->env, &input, s.least_share, true);
    qw_trimesh *m = &r->clean.mesh, linked = *m;
    qw_trimesh_validate(r->env, m);
    qw_trimesh_link(r->env, &linked); /* two vertices tell an edge */
    assert_memory_equal(linked.twin, m->twin, 3 * m->face_count * sizeof *m->twin);
    r->census = qw_trimesh_census(r->env, m);
}

static double volume_of(const qw_clean *c)
{
    double sum = 0;
    for (uint32_t f = 0; f < c->mesh.face_count; f++)
        sum += (double)qw_dot(c->mesh.position[c->mesh.corner[3 * f]], qw_face_cross(&c->mesh, f)) / 6;
    return sum / (c->frame.scale * c->frame.scale * c->frame.scale);
}

static void start(void) { memset(&s, 0, sizeof s); }

/* Cleans, checks the census, and leaves the run for more. */
static run clean(int64_t components, int64_t euler, int64_t loops)
{
    run r = {.env = qw_env_create(NULL, 1)};
    qw_status status = qw_protect(r.env, clean_body, &r);
    if (status != QW_OK) print_message("%s\n", qw_env_message(r.env));
    assert_int_equal(status, QW_OK);
    assert_int_equal(r.census.components, components);
    assert_int_equal(r.census.euler, euler);
    assert_int_equal(r.census.boundary_loops, loops);
    r.volume = volume_of(&r.clean);
    return r;
}

static void expect_failure(qw_status status)
{
    run r = {.env = qw_env_create(NULL, 1)};
    assert_int_equal(qw_protect(r.env, clean_body, &r), status);
    assert_true(strlen(qw_env_message(r.env)) > 0);
    assert_int_equal(qw_env_bytes(r.env), 0);
    qw_env_destroy(r.env);
}

/* ---- whole runs */

static void cube_of_quads(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 1);
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.mesh.face_count, 12);
    assert_int_equal(r.clean.counts.triangles, 12);
    assert_int_equal(r.clean.counts.flipped_triangles, 0);
    assert_float_equal(r.volume, 1, 1e-5);
    assert_float_equal(r.clean.frame.scale, 1 / sqrt(3), 1e-12);
    for (int k = 0; k < 3; k++) assert_float_equal(r.clean.frame.center[k], 0.5, 1e-12);
    for (uint32_t f = 0; f < 12; f++) assert_int_equal(r.clean.source_face[f], f / 2);
    qw_env_destroy(r.env);
}

static void far_and_tiny(void **state)
{
    (void)state;
    static const double place[][2] = {{1e7, 1}, {0, 1e-9}, {1e7, 1e-1}, {0, 1e300}, {0, 1e-290}, {-3e15, 8}};
    for (size_t i = 0; i < sizeof place / sizeof *place; i++) {
        start();
        box(place[i][0], 2 * place[i][0], -place[i][0], place[i][1]);
        run r = clean(1, 2, 0);
        assert_float_equal(qw_trimesh_area(&r.clean.mesh), 2, 1e-3);
        qw_env_destroy(r.env);
    }
    start(); /* the largest coordinates there are */
    box(-1.7e308, -1.7e308, -1.7e308, 1.7e308);
    for (uint32_t v = 0; v < 8; v++)
        for (int k = 0; k < 3; k++)
            if (s.position[3 * v + k] >= 0) s.position[3 * v + k] = 1.7e308;
    run r = clean(1, 2, 0);
    assert_float_equal(qw_trimesh_area(&r.clean.mesh), 2, 1e-3);
    qw_env_destroy(r.env);
}

static void separate_corners(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 1);
    s.position[0] = -0.0;
    separate();
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.welded_vertices, 16);
    assert_int_equal(r.clean.counts.dropped_isolated, 0);
    qw_env_destroy(r.env);
    s.separate = false; /* all edges are open: the same */
    r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.welded_vertices, 16);
    qw_env_destroy(r.env);
}

static void negative_zero_is_zero(void **state)
{
    (void)state;
    start();
    uint32_t a = vertex(0.0, 0, 0), b = vertex(1, 0, 0), c = vertex(0, 1, 0);
    uint32_t d = vertex(-0.0, 0, -0.0), e = vertex(1, -0.0, 0), f = vertex(0, -1, 0);
    triangle(a, b, c);
    triangle(e, d, f);
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.welded_vertices, 2);
    qw_env_destroy(r.env);
}

static void rounded_seams_are_joined(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 1);
    separate();
    for (uint32_t i = 0; i < 3 * s.vertices; i++) s.position[i] += 2e-7 * (double)(i * 7 % 5);
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.welded_vertices, 16);
    qw_env_destroy(r.env);
    for (uint32_t i = 0; i < 3 * s.vertices; i++) s.position[i] += 1e-3 * (double)(i * 7 % 5);
    r = clean(6, 6, 6);
    qw_env_destroy(r.env);
}

/* A single face far away makes everything else smaller than the tolerance of the near weld: nothing may happen to it.
 */
static void far_faces_do_no_harm(void **state)
{
    (void)state;
    start();
    uint32_t v[20][20];
    for (uint32_t i = 0; i < 400; i++) v[i / 20][i % 20] = vertex(i % 20, i / 20, 0);
    for (uint32_t i = 0; i < 361; i++)
        quad(v[i / 19][i % 19], v[i / 19][i % 19 + 1], v[i / 19 + 1][i % 19 + 1], v[i / 19 + 1][i % 19]);
    triangle(vertex(1e9, 0, 0), vertex(1e9 + 1, 0, 0), vertex(1e9, 1, 0));
    run r = clean(2, 2, 2);
    assert_int_equal(r.clean.counts.welded_vertices, 0);
    qw_env_destroy(r.env);
}

/* Two squares whose edges would lie on a third one's: joining must not put three faces on an edge. */
static void near_weld_makes_no_crowd(void **state)
{
    (void)state;
    start();
    for (int i = 0; i < 3; i++) {
        double e = 1e-7 * i, x = i == 0 ? 1 : i == 1 ? -1 : 0;
        uint32_t a = vertex(e, 0, 0), b = vertex(e, 1, 0), c = vertex(x, 1, x == 0), d = vertex(x, 0, x == 0);
        quad(a, b, c, d);
    }
    run r = clean(3, 3, 3);
    assert_int_equal(r.clean.counts.welded_vertices, 0);
    qw_env_destroy(r.env);
}

/* Sides of a unit cube, askew, each cut into n x n squares, n its own; corners apart. */
static void cube_of_tiles(const int n[6])
{
    static const double axis[3][3] = {{0.6, 0.64, 0.48}, {-0.8, 0.48, 0.36}, {0, -0.6, 0.8}};
    start();
    for (int side = 0; side < 6; side++)
        for (int tile = 0; tile < n[side] * n[side]; tile++) {
            uint32_t v[4];
            for (int i = 0; i < 4; i++) {
                double c[3], x[3] = {0};
                c[side / 2] = side % 2;
                c[(side / 2 + 1) % 3] = (double)(tile % n[side] + (i == 1 || i == 2)) / n[side];
                c[(side / 2 + 2) % 3] = (double)(tile / n[side] + (i > 1)) / n[side];
                for (int k = 0; k < 9; k++) x[k % 3] += c[k / 3] * axis[k / 3][k % 3];
                v[i] = vertex((float)x[0], (float)x[1], (float)x[2]);
            }
            if (side % 2) quad(v[0], v[1], v[2], v[3]);
            else quad(v[3], v[2], v[1], v[0]);
        }
    s.separate = true;
}

static void junctions_are_sewn(void **state)
{
    (void)state;
    cube_of_tiles((const int[]){1, 2, 3, 4, 6, 12});
    run r = clean(1, 2, 0);
    assert_true(r.clean.counts.sewn_junctions > 40);
    assert_float_equal(r.volume, 1, 1e-5);
    qw_env_destroy(r.env);
    cube_of_tiles((const int[]){3, 3, 3, 3, 3, 3});
    r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.sewn_junctions, 0);
    qw_env_destroy(r.env);
}

/* Edges that overlap by a part: each holds an end of the other. */
static void overlapping_edges_are_sewn(void **state)
{
    (void)state;
    start();
    quad(vertex(0, 0, 0), vertex(2, 0, 0), vertex(2, 3, 0), vertex(0, 3, 0));
    quad(vertex(2, 1, 0), vertex(4, 1, 0), vertex(4, 4, 0), vertex(2, 4, 0));
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.sewn_junctions, 2);
    qw_env_destroy(r.env);
}

/* A rim of which a straight part is sewn and another has a chord where the other side has more vertices: all of it is
   closed. */
static void chords_are_sewn(void **state)
{
    (void)state;
    start();
    static const double along[7][2] = {{0, 0}, {0.3, 0.0015}, {0.7, 0.0015}, {1, 0}, {1.4, 0}, {1.7, 0}, {2, 0}};
    for (int i = 0; i < 6; i++)
        quad(vertex(along[i][0], along[i][1], 0), vertex(along[i][0], -1, 0), vertex(along[i + 1][0], -1, 0),
             vertex(along[i + 1][0], along[i + 1][1], 0));
    for (int i = 0; i < 2; i++) quad(vertex(i, 0, 0), vertex(i + 1, 0, 0), vertex(i + 1, 1, 0), vertex(i, 1, 0));
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.sewn_junctions, 4);
    qw_env_destroy(r.env);
}

/* A fan of triangles that are thinner than what counts as one place: its long side is not sewn to its rim. */
static void thin_fans_stay(void **state)
{
    (void)state;
    start();
    uint32_t apex = vertex(0, 0, 0), last = vertex(1, 0, 0);
    for (int i = 1; i < 300; i++) {
        uint32_t next = vertex(1 + (float)i, 1e-4f * (float)i, 0);
        triangle(apex, last, next);
        last = next;
    }
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.sewn_junctions, 0);
    qw_env_destroy(r.env);
}

/* A corner that touches an edge without an edge along it, and three sheets at one line. */
static void other_junctions_stay(void **state)
{
    (void)state;
    start();
    quad(vertex(0, 0, 0), vertex(2, 0, 0), vertex(2, 3, 0), vertex(0, 3, 0));
    triangle(vertex(2, 1, 0), vertex(4, 1, 0), vertex(4, 4, 0));
    run r = clean(2, 2, 2);
    assert_int_equal(r.clean.counts.sewn_junctions, 0);
    qw_env_destroy(r.env);
    start();
    quad(vertex(0, 0, 0), vertex(0, 3, 0), vertex(2, 3, 0), vertex(2, 0, 0));
    quad(vertex(0, 1, 0), vertex(0, 2, 0), vertex(-2, 2, 0), vertex(-2, 1, 0));
    quad(vertex(0, 1, 0), vertex(0, 2, 0), vertex(0, 2, 2), vertex(0, 1, 2));
    r = clean(2, 2, 2);
    assert_int_equal(r.clean.counts.sewn_junctions, 0);
    qw_env_destroy(r.env);
}

/* A sheet over a rectangle, cut into n[0] x n[1] squares and these along one diagonal; bent along one of its sides,
   askew in space. */
typedef struct layer {
    double low[2], high[2], height, bend;
    int n[2], along;
    bool is_turned, other_diagonal, is_saddle, has_hole; /* the square at 1, 1 */
    double uneven;                                       /* how far vertices within are moved, of a square */
} layer;

static void add_layer(const layer *l)
{
    static const double axis[3][3] = {{0.6, 0.64, 0.48}, {-0.8, 0.48, 0.36}, {0, -0.6, 0.8}};
    uint32_t first = s.vertices, down = (uint32_t)l->n[0] + 1;
    for (int j = 0; j <= l->n[1]; j++)
        for (int i = 0; i <= l->n[0]; i++) {
            double off = i % l->n[0] && j % l->n[1] ? l->uneven * ((3 * i + 5 * j) % 7 - 3) / 3 : 0;
            double c[3] = {l->low[0] + (l->high[0] - l->low[0]) * (i + off) / l->n[0],
                           l->low[1] + (l->high[1] - l->low[1]) * (j - off) / l->n[1], l->height},
                   x[3] = {0};
            c[2] += l->bend * c[l->along] * c[l->is_saddle ? 1 - l->along : l->along];
            for (int k = 0; k < 9; k++) x[k % 3] += c[k / 3] * axis[k / 3][k % 3];
            vertex(x[0], x[1], x[2]);
        }
    for (int j = 0; j < l->n[1]; j++)
        for (int i = 0; i < l->n[0]; i++) {
            uint32_t a = first + (uint32_t)j * down + (uint32_t)i, q[4] = {a, a + 1, a + 1 + down, a + down};
            for (int k = 0; k < 2 && !(l->has_hole && i == 1 && j == 1); k++) {
                const uint32_t t[3] = {q[l->other_diagonal], q[l->other_diagonal + k + 1],
                                       q[(l->other_diagonal + k + 2) % 4]};
                triangle(t[0], t[l->is_turned ? 2 : 1], t[l->is_turned ? 1 : 2]);
            }
        }
}

/* Two sheets that lie on one another, slid along a side, one within the other, or with rims in common, stay two sheets
   as they came. */
static void double_layers_stay_apart(void **state)
{
    (void)state;
    static const double gap[] = {0, 0, 1e-7, -3e-8};
    uint64_t random = 73;
    for (int round = 0; round < 100; round++) {
        layer a = {.high = {2, 1.5}}, b;
        start();
        a.n[0] = 4 + (int)(random_bits(&random) % 8), a.n[1] = 3 + (int)(random_bits(&random) % 8);
        a.along = (int)(random_bits(&random) % 2), a.bend = (double)(random_bits(&random) % 3) * 0.03;
        b = a, b.height = gap[random_bits(&random) % 4];
        b.is_turned = random_bits(&random) % 2, b.other_diagonal = a.bend > 0 || random_bits(&random) % 2;
        for (int k = 0; k < 2; k++)
            if (random_bits(&random) % 2) b.n[k] = 3 + (int)(random_bits(&random) % 10);
        int side = (int)(random_bits(&random) % 2), kind = (int)(random_bits(&random) % 4);
        double cell = (a.high[side] - a.low[side]) / a.n[side], shift = cell * (double)(1 + random_bits(&random) % 2);
        if (kind == 0) shift *= 0.37;
        if (kind < 2) b.low[side] += shift, b.high[side] += shift;
        if (kind == 2) b.low[side] += shift, b.high[side] -= 0.61 * shift;
        add_layer(&a), add_layer(&b);
        run r = clean(2, 2, 2);
        assert_int_equal(r.clean.counts.flipped_triangles, 0);
        assert_int_equal(r.clean.mesh.face_count, s.faces);
        qw_env_destroy(r.env);
    }
}

/* Saddles cut along other diagonals have all of their rim in common, as the sides of a thin body do, but vertices
   within too. */
static void saddles_that_meet_within_stay_apart(void **state)
{
    (void)state;
    layer a = {.high = {1, 1}, .bend = 0.05, .n = {5, 3}, .is_saddle = true}, b = a;
    b.is_turned = b.other_diagonal = true;
    start();
    add_layer(&a), add_layer(&b);
    run r = clean(2, 2, 2);
    qw_env_destroy(r.env);
}

/* Of two sheets with holes a rim goes on to one of the other at the holes, and nowhere else do they meet; two of
   another sheet have all of their rim in common and no vertex within, as the sides of a thin body. */
static void layers_are_known_by_their_faces(void **state)
{
    (void)state;
    layer a = {.high = {3, 3}, .n = {3, 3}, .has_hole = true}, b = a;
    b.low[0] = 0.5, b.high[0] = 3.5, b.low[1] = 1, b.high[1] = 4;
    start();
    add_layer(&a), add_layer(&b);
    run r = clean(2, 0, 4);
    assert_int_equal(r.clean.mesh.face_count, s.faces);
    qw_env_destroy(r.env);
    a = (layer){.high = {1, 1}, .bend = 0.08, .n = {4, 4}, .is_saddle = true}, b = a;
    b.is_turned = b.other_diagonal = true, b.uneven = 0.3;
    start();
    add_layer(&a), add_layer(&b);
    r = clean(2, 2, 2);
    qw_env_destroy(r.env);
}

static void open_fan_and_bow_tie(void **state)
{
    (void)state;
    start();
    uint32_t o = vertex(0, 0, 0), ring[5];
    for (int i = 0; i < 5; i++) ring[i] = vertex(cos(i), sin(i), 0);
    for (int i = 0; i < 4; i++) triangle(o, ring[i], ring[i + 1]);
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.split_vertices, 0);
    qw_env_destroy(r.env);
    start();
    o = vertex(0, 0, 0);
    triangle(o, vertex(1, 0, 0), vertex(1, 1, 0));
    triangle(o, vertex(-1, 0, 0), vertex(-1, -1, 0));
    r = clean(2, 2, 2);
    assert_int_equal(r.clean.counts.split_vertices, 1);
    qw_env_destroy(r.env);
}

static void three_faces_on_an_edge(void **state)
{
    (void)state;
    start();
    uint32_t a = vertex(0, 0, 0), b = vertex(0, 1, 0);
    triangle(a, b, vertex(0, 0.5, 1)); /* stands on ... */
    triangle(b, a, vertex(1, 0.5, 0));
    triangle(a, b, vertex(-1, 0.5, 0.1)); /* ... a nearly flat pair */
    run r = clean(2, 2, 2);
    assert_int_equal(r.clean.counts.split_edges, 1);
    assert_int_equal(r.clean.counts.split_vertices, 2);
    assert_int_equal(r.clean.mesh.twin[0], QW_NONE);
    assert_int_equal(r.clean.mesh.twin[3], 6);
    qw_env_destroy(r.env);
}

static void cubes_that_share_an_edge(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 1);
    box(1, 1, 0, 1);
    separate();
    run r = clean(2, 4, 0);
    assert_int_equal(r.clean.counts.split_edges, 1);
    assert_int_equal(r.clean.counts.split_vertices, 2);
    assert_float_equal(r.volume, 2, 1e-4);
    qw_env_destroy(r.env);
}

static void cubes_that_share_a_vertex(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 1);
    box(1, 1, 1, 1);
    run r = clean(2, 4, 0); /* apart as stored: not welded at all */
    assert_int_equal(r.clean.counts.welded_vertices, 0);
    assert_int_equal(r.clean.counts.split_vertices, 0);
    qw_env_destroy(r.env);
    separate();
    r = clean(2, 4, 0);
    assert_int_equal(r.clean.counts.split_vertices, 1);
    qw_env_destroy(r.env);
}

static void turns_outward(void **state)
{
    (void)state;
    start();
    tetrahedron(0, true); /* all there is is inside out: that is what the file means */
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 0);
    assert_float_equal(r.volume, -1.0 / 6, 1e-5);
    qw_env_destroy(r.env);
    start();
    tetrahedron(0, true); /* another part says what the file means */
    tetrahedron(5, false);
    r = clean(2, 4, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 4);
    assert_float_equal(r.volume, 2.0 / 6, 1e-5);
    qw_env_destroy(r.env);
    start();
    tetrahedron(0, true); /* and so does a face that differs from the rest */
    s.corner[4] ^= s.corner[5], s.corner[5] ^= s.corner[4], s.corner[4] ^= s.corner[5];
    r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 3);
    assert_float_equal(r.volume, 1.0 / 6, 1e-5);
    qw_env_destroy(r.env);
    start();
    tetrahedron(0, false);
    uint32_t keep = s.corner[4];
    s.corner[4] = s.corner[5];
    s.corner[5] = keep;
    r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 1);
    assert_float_equal(r.volume, 1.0 / 6, 1e-5);
    qw_env_destroy(r.env);
}

static void keeps_cavities(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 4);
    box(1, 1, 1, -2);       /* a cavity */
    box(1.5, 1.5, 1.5, -1); /* inside out, in the cavity */
    box(9, 0, 0, -1);       /* inside out, outside */
    run r = clean(4, 8, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 24);
    assert_float_equal(r.volume, 64 - 8 + 1 + 1, 1e-2);
    qw_env_destroy(r.env);
}

static void open_sheets_keep_the_majority(void **state)
{
    (void)state;
    start();
    uint32_t v[4][4];
    for (uint32_t i = 0; i < 16; i++) v[i / 4][i % 4] = vertex(i % 4, i / 4, 0);
    for (uint32_t i = 0; i < 9; i++) {
        uint32_t *a = &v[i / 3][i % 3], *b = &v[i / 3 + 1][i % 3];
        if (i % 4 == 0) /* three of nine */
            quad(a[0], b[0], b[1], a[1]);
        else quad(a[0], a[1], b[1], b[0]);
    }
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.flipped_triangles, 6);
    for (uint32_t f = 0; f < 18; f++) assert_true(qw_face_cross(&r.clean.mesh, f).z > 0);
    qw_env_destroy(r.env);
}

static void moebius_strip(void **state)
{
    (void)state;
    enum { N = 12 };
    start();
    for (int i = 0; i < N; i++) {
        double t = 2 * 3.14159265358979 * i / N, w = 0.3;
        for (int k = -1; k <= 1; k += 2)
            vertex((1 + k * w * cos(t / 2)) * cos(t), (1 + k * w * cos(t / 2)) * sin(t), k * w * sin(t / 2));
    }
    for (uint32_t i = 0; i < N; i++) {
        uint32_t a = 2 * i, b = 2 * ((i + 1) % N), twist = i == N - 1;
        quad(a, b + twist, b + 1 - twist, a + 1);
    }
    run r = clean(1, 1, 1); /* cut across: a disc */
    assert_int_equal(r.clean.counts.one_sided_seam_edges, 1);
    qw_env_destroy(r.env);
}

/* The strip is cut where the file disagrees with itself, though the front of a flood from its first face would meet
 * elsewhere. */
static void seam_where_the_file_has_it(void **state)
{
    (void)state;
    enum { N = 12, TWIST = 3 };
    start();
    for (int i = 0; i < N; i++) {
        double t = 2 * 3.14159265358979 * i / N, w = 0.3;
        for (int k = -1; k <= 1; k += 2)
            vertex((1 + k * w * cos(t / 2)) * cos(t), (1 + k * w * cos(t / 2)) * sin(t), k * w * sin(t / 2));
    }
    for (uint32_t i = 0; i < N; i++) {
        uint32_t a = 2 * i, b = 2 * ((i + 1) % N), twist = i == N - 1;
        if (i < TWIST) quad(a, a + 1, b + 1, b);
        else quad(a, b + twist, b + 1 - twist, a + 1);
    }
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.one_sided_seam_edges, 1);
    assert_int_equal(r.clean.counts.flipped_triangles, 0);
    qw_env_destroy(r.env);
}

/* Tetrahedra of 1, 1/4 and 1/100 of the area, the smallest far away: which of them stay, and that the frame is that of
 * what stays. */
static void drops_small_components(void **state)
{
    (void)state;
    static const struct {
        double share;
        int64_t left;
    } cases[] = {{0, 3}, {0.005, 3}, {0.05, 2}, {0.3, 1}, {1, 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        start();
        static const double size[3] = {1, 0.5, 0.1};
        for (uint32_t k = 0; k < 3; k++) {
            tetrahedron(10 * k * k * k * k, false);
            for (uint32_t v = 4 * k; v < 4 * k + 4; v++)
                for (int c = 0; c < 3; c++) s.position[3 * v + c] *= size[k];
        }
        s.least_share = cases[i].share;
        run r = clean(cases[i].left, 2 * cases[i].left, 0);
        assert_int_equal(r.clean.counts.dropped_components, 3 - cases[i].left);
        assert_int_equal(r.clean.mesh.face_count, 4 * cases[i].left);
        assert_int_equal(r.clean.counts.dropped_isolated, 0);
        double far = 0, back = 0;
        for (uint32_t v = 0; v < r.clean.mesh.vertex_count; v++)
            far = fmax(far, (double)qw_length(r.clean.mesh.position[v]));
        assert_true(far > 0.3 && far < 0.6);
        for (int k = 0; k < 3; k++)
            back += fabs(r.clean.frame.center[k] + (double)(&r.clean.mesh.position[0].x)[k] / r.clean.frame.scale);
        assert_true(back < 1e-5); /* the first vertex is the origin */
        qw_env_destroy(r.env);
    }
}

/* Of equal faces the one stays that is turned as most of them, and a sheet written from both sides takes nothing from a
 * surface that it touches. */
static void duplicates_turn_nothing(void **state)
{
    (void)state;
    start();
    triangle(0, 1, 2);
    tetrahedron(0, false); /* has 0, 2, 1 */
    triangle(2, 1, 0);
    triangle(1, 2, 0);
    triangle(0, 2, 1);
    triangle(2, 1, 0);
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.flipped_triangles, 0);
    assert_int_equal(r.clean.counts.dropped_duplicate, 5);
    qw_env_destroy(r.env);
    for (int side = 0; side < 2; side++) {
        start();
        box(0, 0, 0, 1);
        uint32_t a = vertex(1, 0, 3), b = vertex(1, 1, 3); /* stands on an edge of the lid, as the wall below goes on */
        quad(5, side ? a : 7, b, side ? 7 : a);
        quad(5, side ? 7 : a, b, side ? a : 7);
        r = clean(2, 3, 1);
        assert_int_equal(r.clean.counts.flipped_triangles, 0);
        assert_int_equal(r.clean.counts.split_edges, 1);
        qw_env_destroy(r.env);
    }
}

/* A square whose diagonals are equal, written from both sides, each time with another first corner and on the second's
 * own vertices: one sheet. */
static void squares_from_both_sides(void **state)
{
    (void)state;
    static const double at[4][2] = {{0.1, 0.2}, {0.7, 0.5}, {0.4, 1.1}, {-0.2, 0.8}};
    for (uint32_t first = 0; first < 4; first++) {
        start();
        uint32_t back[4];
        for (int i = 0; i < 4; i++) vertex(at[i][0], at[i][1], 0.3);
        for (int i = 0; i < 4; i++) back[i] = vertex(at[i][0], at[i][1], 0.3);
        quad(0, 1, 2, 3);
        quad(back[(first + 3) % 4], back[(first + 2) % 4], back[(first + 1) % 4], back[first]);
        run r = clean(1, 1, 1);
        assert_int_equal(r.clean.counts.dropped_duplicate, 2);
        qw_env_destroy(r.env);
    }
}

/* The projective plane with six vertices: any cut leaves edges between the same two vertices. */
static void closed_one_sided(void **state)
{
    (void)state;
    start();
    for (int i = 0; i < 6; i++) vertex(cos(i), sin(2 * i), cos(3 * i));
    static const uint32_t t[10][3] = {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 5}, {0, 5, 1},
                                      {1, 2, 4}, {2, 3, 5}, {3, 4, 1}, {4, 5, 2}, {5, 1, 3}};
    for (int f = 0; f < 10; f++) polygon(3, t[f]);
    run r = {.env = qw_env_create(NULL, 1)};
    assert_int_equal(qw_protect(r.env, clean_body, &r), QW_OK);
    assert_true(r.clean.counts.one_sided_seam_edges > 0);
    assert_true(r.census.boundary_loops > 0);
    qw_env_destroy(r.env);
}

/* Coordinates so small that their squares and their scale are beyond doubles: not "in one point". */
static void too_small_for_doubles(void **state)
{
    (void)state;
    static const double sizes[] = {1e-310, 5e-324, 3e-309};
    for (int i = 0; i < 3; i++) {
        start();
        box(0, 0, 0, sizes[i]);
        run r = {.env = qw_env_create(NULL, 1)};
        assert_int_equal(qw_protect(r.env, clean_body, &r), QW_ONLY_DEGENERATE);
        assert_non_null(strstr(qw_env_message(r.env), "scale the input up"));
        qw_env_destroy(r.env);
    }
    start();
    box(0, 0, 0, 1e-300);
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.mesh.face_count, 12);
    qw_env_destroy(r.env);
}

static void drops_what_is_no_face(void **state)
{
    (void)state;
    start();
    vertex(100, 100, 100); /* isolated, and not in the frame */
    tetrahedron(0, false);
    triangle(1, 2, 3);
    triangle(2, 1, 3);
    triangle(3, 3, 1);
    uint32_t two[2] = {1, 2};
    polygon(2, two);
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.dropped_duplicate, 2);
    assert_int_equal(r.clean.counts.dropped_degenerate, 1);
    assert_int_equal(r.clean.counts.dropped_isolated, 1);
    assert_int_equal(r.clean.mesh.vertex_count, 4);
    assert_true(r.clean.frame.center[0] < 1);
    qw_env_destroy(r.env);
}

/* A tetrahedron with a triangle, written from both sides, hanging on an edge: gone when small, a sheet when large. */
static void drops_flaps(void **state)
{
    (void)state;
    for (int large = 0; large < 2; large++) {
        start();
        tetrahedron(0, false);
        uint32_t a = vertex(0.3, 0.3, 0), b = vertex(0.31, 0.3, 0), tip = vertex(0.3, 0.3, large ? -0.5 : -0.01);
        s.faces = 0; /* the bottom again, with a and b in it */
        memset(s.begin, 0, sizeof s.begin);
        triangle(0, 1, 3);
        triangle(1, 2, 3);
        triangle(2, 0, 3);
        quad(0, a, b, 1);
        triangle(b, 2, 1);
        quad(2, b, a, 0);
        triangle(a, b, tip);
        triangle(b, a, tip);
        run r = clean(1 + large, 2 + large, large);
        assert_int_equal(r.clean.counts.dropped_duplicate, 2 - large);
        qw_env_destroy(r.env);
    }
}

static void keeps_flat_triangles(void **state)
{
    (void)state;
    start(); /* a square whose lower side has a vertex in the middle, filled by a triangle without area */
    uint32_t a = vertex(0, 0, 0), b = vertex(1, 0, 0), c = vertex(1, 1, 0), d = vertex(0, 1, 0), m = vertex(0.5, 0, 0);
    triangle(a, m, b);
    triangle(a, b, c);
    triangle(a, c, d);
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.mesh.face_count, 3);
    qw_env_destroy(r.env);
}

static void refuses(void **state)
{
    (void)state;
    start();
    expect_failure(QW_NO_FACES);
    uint32_t a = vertex(0, 0, 0), b = vertex(1, 1, 1), c = vertex(3, 3, 3), d = vertex(1. / 3, 1. / 3, 1. / 3);
    polygon(2, (uint32_t[]){a, b});
    expect_failure(QW_NO_FACES);
    triangle(a, a, b);
    expect_failure(QW_ONLY_DEGENERATE);
    triangle(a, b, c);
    quad(a, d, b, c);
    expect_failure(QW_ONLY_DEGENERATE);
    start();
    triangle(vertex(5, 5, 5), vertex(5, 5, 5), vertex(5, 5, 5));
    expect_failure(QW_ONLY_DEGENERATE);
    s.separate = true;
    expect_failure(QW_ONLY_DEGENERATE);
}

/* ---- triangulation */

/* Triangulates the one polygon and returns the sum of the triangles' areas, all of which must be turned like the
 * polygon. */
static double triangulated_area(uint32_t n, const double (*xy)[2], bool all_positive)
{
    start();
    uint32_t corner[64];
    for (uint32_t i = 0; i < n; i++)
        corner[i] = vertex(xy[i][0], 3 + xy[i][1], xy[i][0] + 2 * xy[i][1]); /* in a slanted plane */
    polygon(n, corner);
    qw_env *env = qw_env_create(NULL, 1);
    qw_clean_input input = {s.vertices, s.faces, s.position, s.begin, s.corner, false, 0, NULL, NULL, NULL, 0, NULL};
    qw_triangles t = qw_triangulate(env, &input);
    assert_int_equal(t.count, n - 2);
    double sum = 0;
    for (uint32_t f = 0; f < t.count; f++) {
        const double *a = xy[t.corner[3 * f]], *b = xy[t.corner[3 * f + 1]], *c = xy[t.corner[3 * f + 2]];
        double area = ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2;
        if (all_positive) assert_true(area > 0);
        sum += area;
    }
    qw_env_destroy(env);
    return sum;
}

static void triangulates_polygons(void **state)
{
    (void)state;
    static const double arrow[][2] = {{0, 0}, {2, 1}, {0, 2}, {1, 1}}; /* only the diagonal from the notch is inside */
    assert_float_equal(triangulated_area(4, arrow, true), 1, 1e-12);
    static const double arrow2[][2] = {{2, 1}, {0, 2}, {1, 1}, {0, 0}};
    assert_float_equal(triangulated_area(4, arrow2, true), 1, 1e-12);
    static const double comb[][2] = {{0, 0}, {7, 0}, {7, 3}, {6, 3}, {6, 1}, {5, 1}, {5, 3},
                                     {4, 3}, {4, 1}, {3, 1}, {3, 3}, {2, 3}, {2, 1}, {0, 1}};
    assert_float_equal(triangulated_area(14, comb, true), 7 + 3 * 2, 1e-12);
    static const double spiral[][2] = {{0, 0}, {6, 0}, {6, 6}, {1, 6}, {1, 2}, {4, 2}, {4, 4},
                                       {3, 4}, {3, 3}, {2, 3}, {2, 5}, {5, 5}, {5, 1}, {0, 1}};
    assert_float_equal(triangulated_area(14, spiral, true), 21, 1e-12);
    /* A square with a square hole, joined by a bridge that is walked twice. */
    static const double hole[][2] = {{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}};
    assert_float_equal(triangulated_area(10, hole, false), 8, 1e-12);
    double circle[40][2];
    for (int i = 0; i < 40; i++) circle[i][0] = cos(0.15707963 * i), circle[i][1] = sin(0.15707963 * i);
    assert_float_equal(triangulated_area(40, (const double(*)[2])circle, true), 20 * sin(0.15707963), 1e-6);
    static const double line[][2] = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}, {2.5, 2.5}};
    assert_float_equal(triangulated_area(6, line, false), 0, 1e-12);
    static const double star[][2] = {{0, 0}, {4, 3}, {0, 3}, {4, 0}, {2, 5}}; /* crosses itself */
    triangulated_area(5, star, false);
}

/* Two quads around a vertex of valence two must not both cut it off: the two triangles would be one. */
static void spares_doublets(void **state)
{
    (void)state;
    start();
    uint32_t a = vertex(0, 0, 0), b = vertex(0.1, 0, 0), c = vertex(0, 3, 0), d = vertex(5, 1, 0), e = vertex(-5, 1, 0);
    quad(b, a, d, c);
    quad(b, c, e, a);
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.counts.dropped_duplicate, 0);
    qw_env_destroy(r.env);
}

/* ---- soups */

static uint64_t seed;

static uint32_t pick(uint32_t n)
{
    random_step(&seed);
    return (uint32_t)((seed >> 33) % n);
}

/* Anything goes: few vertices on a small grid, so that every defect there is happens many times. */
static void random_soups(void **state)
{
    (void)state;
    seed = 7;
    for (int round = 0; round < 1500; round++) {
        start();
        uint32_t vertices = 4 + pick(round % 3 == 0 ? 8 : 60), faces = 1 + pick(round % 5 == 0 ? 400 : 40),
                 grid = 2 + pick(4);
        for (uint32_t v = 0; v < vertices; v++) vertex(pick(grid), pick(grid), pick(grid) + (pick(4) == 0 ? 1e-7 : 0));
        for (uint32_t f = 0; f < faces; f++) {
            uint32_t corner[6], n = pick(4) == 0 ? 4 + pick(3) : 3;
            for (uint32_t i = 0; i < n; i++) corner[i] = pick(vertices);
            polygon(n, corner);
        }
        s.separate = pick(3) == 0;
        run r = {.env = qw_env_create(NULL, 1)};
        qw_status status = qw_protect(r.env, clean_body, &r);
        if (status != QW_OK && status != QW_ONLY_DEGENERATE)
            print_message("round %d: %s\n", round, qw_env_message(r.env));
        assert_true(status == QW_OK || status == QW_ONLY_DEGENERATE);
        for (uint32_t f = 0; status == QW_OK && f < r.clean.mesh.face_count; f++)
            assert_true(r.clean.source_face[f] < s.faces);
        qw_env_destroy(r.env);
    }
}

/* Faces of a closed surface, turned at random and in random order, give that surface back. */
static void shuffled_spheres(void **state)
{
    (void)state;
    enum { N = 16 };
    seed = 11;
    for (int round = 0; round < 20; round++) {
        start();
        for (uint32_t i = 0; i < N * N; i++) {
            double u = 6.283185307 * (i % N) / N, v = 6.283185307 * (i / N) / N;
            vertex((2 + cos(u)) * cos(v), (2 + cos(u)) * sin(v), sin(u));
        }
        uint32_t order[N * N];
        for (uint32_t i = 0; i < N * N; i++) order[i] = i;
        for (uint32_t i = N * N; i-- > 1;) {
            uint32_t j = pick(i + 1), keep = order[i];
            order[i] = order[j];
            order[j] = keep;
        }
        for (uint32_t k = 0; k < N * N; k++) {
            uint32_t i = order[k], a = i, b = i / N * N + (i + 1) % N, c = (b + N) % (N * N), d = (i + N) % (N * N);
            if (pick(2)) quad(a, b, c, d);
            else quad(d, c, b, a);
        }
        run r = clean(1, 0, 0);
        assert_float_equal(r.volume, 2 * 3.14159265 * 2 * 3.14159265 * 0.974, 0.5 + 2);
        assert_true(r.volume > 30);
        qw_env_destroy(r.env);
    }
}

/* Fails the n-th allocation for all n: cleaning gives up in order and leaves nothing behind. */
static void survives_missing_memory(void **state)
{
    (void)state;
    start();
    box(0, 0, 0, 4);
    box(1, 1, 1, -2);
    box(4, 4, 0, 1);
    separate();
    polygon(5, (uint32_t[]){0, 1, 2, 3, 12});
    qw_status status = QW_MEMORY;
    long n = 1;
    for (; status != QW_OK && n < 500; n++) {
        faults f = {.allocations = n, .reports = FAULTS_NONE, .is_lasting = true};
        qw_host host = faults_host(&f);
        run r = {.env = qw_env_create(&host, 1)};
        assert_non_null(r.env);
        status = qw_protect(r.env, clean_body, &r);
        assert_true(status == QW_OK || status == QW_MEMORY);
        qw_env_destroy(r.env);
        assert_int_equal(f.blocks, 0);
    }
    assert_true(n > 20 && n < 500);
}

/* Many faces on one edge take no quadratic time and still make a surface. */
static void edge_of_many_faces(void **state)
{
    (void)state;
    start();
    uint32_t a = vertex(0, 0, 0), b = vertex(0, 0, 1);
    for (uint32_t i = 0; i < 3000; i++) {
        uint32_t c = vertex(cos(i), sin(i), 0.5);
        if (i % 2) triangle(a, b, c);
        else triangle(b, a, c);
    }
    run r = clean(1500, 1500, 1500);
    assert_int_equal(r.clean.counts.split_edges, 1);
    qw_env_destroy(r.env);
}

/* ---- the limits of precision */

/* A component without area goes; that a face without area hangs on others is in order. */
static void drops_flat_components(void **state)
{
    (void)state;
    start();
    tetrahedron(0, false);
    triangle(vertex(2, 2, 2), vertex(3, 3, 3), vertex(5, 5, 5));
    run r = clean(1, 2, 0);
    assert_int_equal(r.clean.counts.dropped_flat, 1);
    assert_int_equal(r.clean.counts.first_flat, 4);
    assert_true(r.clean.frame.scale > 0.5); /* the frame is that of what is left */
    qw_env_destroy(r.env);
}

/* What single precision cannot resolve gets a frame of its own, and comes back from it to its place. */
static void gives_tiny_components_a_frame(void **state)
{
    (void)state;
    static const double size[] = {1e-2, 1e-5, 1e-7, 1e-9, 1e-11};
    for (size_t i = 0; i < sizeof size / sizeof *size; i++) {
        start();
        tetrahedron(0, false);
        uint32_t from = s.vertices;
        tetrahedron(0, false);
        for (uint32_t v = from; v < s.vertices; v++)
            for (int k = 0; k < 3; k++)
                s.position[3 * v + (uint32_t)k] = 1.3 + size[i] * s.position[3 * v + (uint32_t)k];
        run r = clean(2, 4, 0);
        const qw_trimesh *m = &r.clean.mesh;
        assert_int_equal(r.clean.own.count, size[i] < 1e-4);
        double low = INFINITY, high = -INFINITY;
        for (uint32_t f = 0; f < m->face_count; f++) {
            if (r.clean.component[f] == 0) continue;
            for (uint32_t c = 0; c < 3; c++) {
                double q[3];
                if (!qw_leave_own_frame(&r.clean.own, m->position[m->corner[3 * f + c]], q)) continue;
                double x = r.clean.frame.center[0] + q[0] / r.clean.frame.scale;
                low = fmin(low, x), high = fmax(high, x);
            }
        }
        if (r.clean.own.count > 0) {
            assert_true(fabs(low - 1.3) < 1e-3 * size[i]);
            assert_true(fabs(high - 1.3 - size[i]) < 1e-3 * size[i]);
        }
        qw_env_destroy(r.env);
    }
}

/* A wisp along no axis is widened across, and nothing else of it changes. */
static void widens_wisps(void **state)
{
    (void)state;
    start();
    triangle(vertex(0.1, 0.2, 0.3), vertex(0.7, 0.9, 1.1), vertex(0.4, 0.55 + 1e-9, 0.7));
    run r = clean(1, 1, 1);
    assert_int_equal(r.clean.own.count, 1);
    double area = qw_trimesh_area(&r.clean.mesh);
    assert_true(area > 4e-5 && area < 6e-5);
    for (uint32_t v = 0; v < 3; v++) {
        double q[3], off = 0;
        assert_true(qw_leave_own_frame(&r.clean.own, r.clean.mesh.position[v], q));
        for (int k = 0; k < 3; k++) {
            double x = r.clean.frame.center[k] + q[k] / r.clean.frame.scale;
            off = fmax(off, fabs(x - s.position[3 * v + (uint32_t)k]));
        }
        assert_true(off < 1e-7); /* along it, where single precision does */
    }
    qw_env_destroy(r.env);
}

QW_TEST_SUITE(clean)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cube_of_quads),
        cmocka_unit_test(far_and_tiny),
        cmocka_unit_test(separate_corners),
        cmocka_unit_test(negative_zero_is_zero),
        cmocka_unit_test(rounded_seams_are_joined),
        cmocka_unit_test(near_weld_makes_no_crowd),
        cmocka_unit_test(junctions_are_sewn),
        cmocka_unit_test(overlapping_edges_are_sewn),
        cmocka_unit_test(chords_are_sewn),
        cmocka_unit_test(thin_fans_stay),
        cmocka_unit_test(other_junctions_stay),
        cmocka_unit_test(far_faces_do_no_harm),
        cmocka_unit_test(double_layers_stay_apart),
        cmocka_unit_test(saddles_that_meet_within_stay_apart),
        cmocka_unit_test(layers_are_known_by_their_faces),
        cmocka_unit_test(open_fan_and_bow_tie),
        cmocka_unit_test(three_faces_on_an_edge),
        cmocka_unit_test(cubes_that_share_an_edge),
        cmocka_unit_test(cubes_that_share_a_vertex),
        cmocka_unit_test(turns_outward),
        cmocka_unit_test(keeps_cavities),
        cmocka_unit_test(open_sheets_keep_the_majority),
        cmocka_unit_test(moebius_strip),
        cmocka_unit_test(seam_where_the_file_has_it),
        cmocka_unit_test(duplicates_turn_nothing),
        cmocka_unit_test(squares_from_both_sides),
        cmocka_unit_test(drops_small_components),
        cmocka_unit_test(closed_one_sided),
        cmocka_unit_test(too_small_for_doubles),
        cmocka_unit_test(drops_what_is_no_face),
        cmocka_unit_test(drops_flaps),
        cmocka_unit_test(keeps_flat_triangles),
        cmocka_unit_test(refuses),
        cmocka_unit_test(triangulates_polygons),
        cmocka_unit_test(spares_doublets),
        cmocka_unit_test(random_soups),
        cmocka_unit_test(shuffled_spheres),
        cmocka_unit_test(survives_missing_memory),
        cmocka_unit_test(edge_of_many_faces),
        cmocka_unit_test(drops_flat_components),
        cmocka_unit_test(gives_tiny_components_a_frame),
        cmocka_unit_test(widens_wisps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Layouts under flips and splits, against the edges that they began with; lengths of lines against a walk over the quads;
 * walks that close offsets against all closed integers; meetings on whole shapes. */
#include "suite.h"
#include "unit_shapes.h"

#include "integer/circuits.h"
#include "integer/closed.h"
#include "integer/meetings.h"
#include "integer/search.h"
#include "integer/segment.h"

enum { LONG = 1000 };

static bool is_closed(const qw_complex *c)
{
    for (uint32_t f = 0; f < c->face_count; f++)
        if (!qw_int2_is_zero(qw_complex_residual(c, f))) return false;
    return true;
}

static int64_t twice_area(const qw_complex *c)
{
    int64_t sum = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3)
        sum += qw_int2_det(qw_steps_along(c, h), qw_steps_along(c, h + 1));
    return sum;
}

typedef struct whole {
    qw_components components;
    qw_int2 *d; /* of the first component */
    double scale;
} whole;

/* A shape's complex with the integers nearest to `quads` quads. */
static whole whole_of(qw_env *env, qw_trimesh mesh, double quads)
{
    whole s;
    qw_offset_mesh m = unit_solve(env, mesh, 0.2f, true).offsets;
    float *stiffness = QW_NEW(env, float, m.edge_count);
    qw_closed_counts counts;
    qw_real2 *closed = qw_closed_offsets(env, &m, 1, stiffness, &counts);
    qw_decimated decimated = qw_decimate(env, &m, closed);
    decimated.complex.weight = QW_NEW(env, float, decimated.complex.edge_count);
    qw_complex_weigh(&decimated.complex);
    s.components = qw_split_components(env, &decimated, &m);
    assert_int_equal(s.components.count, 1);
    const qw_complex *c = &s.components.component[0].decimated.complex;
    double area = 0, cut = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) area += qw_cross2(qw_along(c, h), qw_along(c, h + 1)) / 2;
    qw_search_wish wish = {quads, sqrt(quads / area), &cut, 0};
    s.d = QW_NEW(env, qw_int2, c->edge_count);
    qw_search_result found = qw_search_integers(env, &s.components, &wish, s.d);
    assert_int_equal(found.inverted, 0);
    s.scale = found.scale[0];
    return s;
}

static qw_real2 *scaled(qw_env *env, const qw_complex *c, double scale)
{
    qw_real2 *real = QW_NEW(env, qw_real2, c->edge_count);
    for (uint32_t e = 0; e < c->edge_count; e++)
        real[e] = (qw_real2){c->real[e].x * (float)scale, c->real[e].y * (float)scale};
    return real;
}

static qw_trimesh bumpy(qw_env *env)
{
    qw_trimesh mesh = unit_sphere(env, 5);
    for (uint32_t v = 0; v < mesh.vertex_count; v++) {
        qw_vec3 p = mesh.position[v];
        float bump = 1 + 0.25f * sinf(5 * p.x + 1) * sinf(4 * p.y) + 0.2f * sinf(6 * p.z + p.x);
        mesh.position[v] = qw_scale(p, bump);
    }
    return mesh;
}

/* Whatever is flipped and split: the sum stays closed, the area stays, and undone the offsets are those of before. */
static void layouts_go_back(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    whole s = whole_of(env, bumpy(env), 1500);
    const qw_component *component = &s.components.component[0];
    const qw_complex *c = &component->decimated.complex;
    qw_layout l = qw_layout_make(env, 4 * c->face_count);
    qw_layout_fill(&l, component, scaled(env, c, s.scale), s.d);
    qw_int2 *d = QW_NEW(env, qw_int2, l.edge_room);
    int64_t area = twice_area(&l.complex);
    unit_rng r = {7};
    uint32_t flips = 0, splits = 0;
    for (int i = 0; i < 400; i++) {
        uint32_t h = unit_random(&r, 3 * l.complex.face_count);
        if (i % 8 != 0) {
            flips += qw_layout_flip(env, &l, h);
        } else {
            qw_int2 steps = qw_steps_along(&l.complex, h);
            splits += qw_layout_split(env, &l, h, 0.5, (qw_int2){steps.x / 2, steps.y / 2});
        }
        assert_true(is_closed(&l.complex));
        qw_layout_undo(&l, d);
        assert_memory_equal(d, s.d, c->edge_count * sizeof *d);
    }
    assert_true(flips > 20 && splits > 20);
    assert_int_equal(l.complex.face_count, c->face_count + 2 * splits);
    for (uint32_t e = 0; e < l.complex.edge_count; e++)
        for (uint32_t i = 0; i < 2; i++) assert_int_equal(l.complex.edge[l.complex.side[2 * e + i]], e);
    /* a vertex beside its edge's straight line would change the area of its triangles, but not their sum */
    assert_int_equal(twice_area(&l.complex), area);
    qw_env_destroy(env);
}

/* A box of 8 x 12 x 4 quads: every line runs along an edge of the box to the next corner. */
static void lines_of_a_box(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh box = unit_slab(env, 2, 3, "######");
    for (int i = 0; i < 3; i++) box = unit_quarter(env, &box);
    whole s = whole_of(env, box, 2 * (8 * 12 + 8 * 4 + 12 * 4));
    const qw_component *component = &s.components.component[0];
    const qw_complex *c = &component->decimated.complex;
    qw_layout l = qw_layout_make(env, c->face_count + component->vertex_count);
    qw_layout_fill(&l, component, scaled(env, c, s.scale), s.d);
    int32_t *length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)l.vertex_room), count[3] = {0};
    qw_layout_number(&l);
    for (uint32_t v = 0; v < l.vertex_count; v++) for (uint32_t i = 0; i < l.valence[v]; i++) print_message("%u/%u of %u %d\n", v, i, l.valence[v], length[QW_MOST_LINES*v+i]);
    for (uint32_t h = 0; h < 3 * c->face_count; h++) { qw_int2 a = qw_steps_along(&l.complex, h); qw_double2 b = qw_along(&l.complex, h); print_message("%u: %u (%d %d) %.2f %.2f fixed %d number %u\n", h, l.corner[h], a.x, a.y, b.x, b.y, c->fixed[c->edge[h]], l.number[h]); }
    assert_int_equal(qw_layout_measure(&l, LONG, length), 2 * 4 * (8 + 12 + 4));
    for (uint32_t v = 0; v < l.vertex_count; v++)
        for (uint32_t i = 0; i < l.valence[v]; i++) {
            int32_t x = length[QW_MOST_LINES * v + i];
            assert_int_equal(l.valence[v], 3);
            count[0] += x == 4, count[1] += x == 8, count[2] += x == 12;
            assert_true(l.held[v] >> i & 1u);
        }
    for (int i = 0; i < 3; i++) assert_int_equal(count[i], 8);
    qw_env_destroy(env);
}

/* One component of one edge is changed by one; the cheapest way to close the offsets again costs what the cheapest of all
   integers that are closed costs, where that is one step of each variable. */
static void offsets_are_closed_again(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    whole s = whole_of(env, bumpy(env), 1500);
    qw_complex c = s.components.component[0].decimated.complex;
    c.real = scaled(env, &c, s.scale);
    qw_int2 *first = s.d;
    c.d = QW_NEW(env, qw_int2, c.edge_count);
    uint32_t closed = 0, tried = 0;
    for (uint32_t e = 0; e < c.edge_count; e++) {
        memcpy(c.d, first, c.edge_count * sizeof *c.d);
        c.d[e].x++, c.fixed[e] |= QW_FIXED_X;
        assert_false(is_closed(&c));
        bool done = qw_close_offsets(env, &c, LONG, 1e4);
        assert_true(done == is_closed(&c));
        if (done) assert_int_equal(c.d[e].x, first[e].x + 1);
        closed += done, tried++;
        c.fixed[e] &= (uint8_t)~QW_FIXED_X;
        /* nothing may be had for nothing */
        memcpy(c.d, first, c.edge_count * sizeof *c.d);
        c.d[e].x += 3, c.fixed[e] |= QW_FIXED_X;
        assert_false(qw_close_offsets(env, &c, LONG, 1e-9));
        c.fixed[e] &= (uint8_t)~QW_FIXED_X;
    }
    print_message("%u of %u closed\n", closed, tried);
    assert_true(closed > tried / 2);
    qw_env_destroy(env);
}

static void lines_get_shorter(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh shapes[] = {bumpy(env), unit_double_torus(env, 3)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        whole s = whole_of(env, shapes[i], 2000);
        const qw_component *component = &s.components.component[0];
        qw_complex c = component->decimated.complex;
        qw_int2 *d = QW_NEW(env, qw_int2, c.edge_count);
        memcpy(d, s.d, c.edge_count * sizeof *d);
        qw_meeting_wish wish = {scaled(env, &c, s.scale), 1, 1960, 2040, 1};
        qw_meeting_counts counts = qw_make_meetings(env, component, &wish, d);
        print_message("%u of %u kept: %lld to %lld\n", counts.kept, counts.tried, (long long)counts.length_before,
                      (long long)counts.length_after);
        c.d = d;
        assert_true(is_closed(&c));
        assert_true(twice_area(&c) >= 2 * 1960 && twice_area(&c) <= 2 * 2040);
        assert_true(counts.kept > 0 && counts.length_after < counts.length_before);
        for (uint32_t e = 0; e < c.edge_count; e++) {
            if (c.fixed[e] & QW_FIXED_X) assert_int_equal(d[e].x, 0);
            if (c.fixed[e] & QW_FIXED_Y) assert_int_equal(d[e].y, 0);
        }
        qw_layout l = qw_layout_make(env, c.face_count + component->vertex_count);
        int32_t *length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)l.vertex_room);
        qw_layout_fill(&l, component, wish.real, d);
        qw_layout_number(&l);
        int64_t sum = qw_layout_measure(&l, LONG, length);
        qw_layout_fill(&l, component, wish.real, s.d);
        qw_layout_number(&l);
        assert_true(sum < qw_layout_measure(&l, LONG, length));
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(meetings)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(layouts_go_back), cmocka_unit_test(lines_of_a_box),
                                       cmocka_unit_test(offsets_are_closed_again),
                                       cmocka_unit_test(lines_get_shorter)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

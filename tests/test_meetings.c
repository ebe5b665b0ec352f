/* Layouts under flips and splits, against the edges that they began with; lengths of lines against a walk over the
 * quads; offsets closed again; the nearest offsets against all; meetings on whole shapes. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/meetings/strip_search.h"
#include "remesh/meetings/strips.h"
#include "remesh/meetings/tries.h"
#include "remesh/quantise/circuits.h"
#include "remesh/quantise/closed.h"
#include "remesh/meetings/meetings.h"
#include "remesh/quantise/nearest.h"
#include "remesh/quantise/search.h"
#include "remesh/meetings/segment.h"

enum { LONG = 1000 };

typedef struct whole {
    qw_components components;
    qw_int2 *d; /* of the first component */
    double scale;
} whole;

/* A shape's complex with the integers nearest to `quads` quads, whose lines meet where loops is above 0. */
static whole whole_with_loops(qw_env *env, qw_trimesh mesh, double quads, double loops)
{
    whole s;
    qw_offset_mesh m = unit_solve(env, mesh, 0.2f, true).offsets;
    float *stiffness = QW_NEW(env, float, m.edge_count);
    qw_closed_counts counts;
    qw_real2 *closed = qw_closed_offsets(env, &m, 0, stiffness, &counts);
    qw_decimated decimated = qw_decimate(env, &m, closed);
    decimated.complex.weight = QW_NEW(env, float, decimated.complex.edge_count);
    qw_complex_weigh(&decimated.complex);
    s.components = qw_split_components(env, &decimated, &m);
    assert_int_equal(s.components.count, 1);
    const qw_complex *c = &s.components.component[0].decimated.complex;
    double area = 0, cut = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) area += qw_cross2(qw_along(c, h), qw_along(c, h + 1)) / 2;
    qw_search_request request = {
        .quads = quads, .times = 1, .size = sqrt(quads / area), .effort = 1, .cut = &cut, .loops = loops};
    s.d = QW_NEW(env, qw_int2, c->edge_count);
    qw_search_result found = qw_search_integers(env, &s.components, &request, s.d);
    assert_int_equal(found.inverted, 0);
    s.scale = found.scale[0];
    return s;
}

static whole whole_of(qw_env *env, qw_trimesh mesh, double quads) { return whole_with_loops(env, mesh, quads, 0); }

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
    double area = qw_complex_area(&l.complex);
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
        assert_true(qw_complex_is_closed(&l.complex));
        qw_layout_undo(&l, d);
        assert_memory_equal(d, s.d, c->edge_count * sizeof *d);
    }
    assert_true(flips > 20 && splits > 20);
    assert_int_equal(l.complex.face_count, c->face_count + 2 * splits);
    for (uint32_t e = 0; e < l.complex.edge_count; e++)
        for (uint32_t i = 0; i < 2; i++) assert_int_equal(l.complex.edge[l.complex.side[2 * e + i]], e);
    /* a vertex beside its edge's straight line would change the area of its triangles, but not their sum */
    assert_true(qw_complex_area(&l.complex) == area);
    qw_env_destroy(env);
}

/* A box as twelve triangles, each side of it in a frame of its own. size: in quads. */
static qw_component box_of_size(qw_env *env, const int32_t *size)
{
    static const uint32_t side[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                        {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    qw_component box = {.vertex_count = 8};
    qw_complex *c = &box.decimated.complex;
    *c = (qw_complex){.face_count = 12, .edge_count = 0};
    c->edge = QW_NEW(env, uint32_t, 36), c->rot = QW_NEW_ZERO(env, uint8_t, 36), c->side = QW_NEW(env, uint32_t, 36);
    c->d = QW_NEW(env, qw_int2, 18), c->real = QW_NEW(env, qw_real2, 18), c->fixed = QW_NEW_ZERO(env, uint8_t, 18);
    c->weight = QW_NEW_ZERO(env, float, 18);
    box.decimated.corner = QW_NEW(env, uint32_t, 36);
    for (uint32_t h = 0; h < 36; h++) {
        const uint32_t *v = side[h / 6];
        uint32_t at[2][3] = {{0, 1, 2}, {0, 2, 3}}, from = at[h / 3 % 2][h % 3], to = at[h / 3 % 2][(h + 1) % 3];
        int32_t w = 0, l = 0; /* of the side */
        for (int k = 0; k < 3; k++)
            w += (int32_t)((v[0] ^ v[1]) >> k & 1u) * size[k], l += (int32_t)((v[1] ^ v[2]) >> k & 1u) * size[k];
        qw_int2 place[4] = {{0, 0}, {w, 0}, {w, l}, {0, l}}, d = qw_int2_sub(place[to], place[from]);
        uint32_t e = 0;
        while (e < c->edge_count && (box.decimated.corner[c->side[2 * e]] != v[to] ||
                                     c->side[2 * e + 1] != v[from])) /* for now: the vertex that it leads to */
            e++;
        box.decimated.corner[h] = v[from], c->edge[h] = e;
        if (e == c->edge_count) {
            c->side[2 * e] = h, c->side[2 * e + 1] = v[to], c->d[e] = d, c->edge_count++;
            c->real[e] = (qw_real2){(float)d.x, (float)d.y};
            continue;
        }
        c->side[2 * e + 1] = h;
        while (!qw_int2_is_zero(qw_int2_sub(qw_turn(c->rot[h], c->d[e]), d))) assert_true(++c->rot[h] < 4);
    }
    assert_int_equal(c->edge_count, 18);
    return box;
}

static qw_component box_of(qw_env *env) { return box_of_size(env, (int32_t[]){4, 6, 10}); }

/* Edges along the axes keep their directions: what is left are the three lengths. */
static void hold_axes(qw_complex *c)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        if (c->d[e].x == 0 || c->d[e].y == 0) c->fixed[e] = c->d[e].x == 0 ? QW_FIXED_X : QW_FIXED_Y;
}

/* Every line runs along an edge of the box to the next corner, the edges being held or not. */
static void lines_of_a_box(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_component box = box_of(env);
    const qw_complex *c = &box.decimated.complex;
    assert_true(qw_complex_is_closed(c));
    qw_layout l = qw_layout_make(env, 40);
    qw_layout_fill(&l, &box, c->real, c->d);
    int32_t *length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)l.vertex_room), count[3] = {0};
    qw_layout_number(&l);
    assert_int_equal(qw_layout_measure(&l, LONG, INT64_MAX, length), 8 * (4 + 6 + 10));
    for (uint32_t v = 0; v < 8; v++)
        for (uint32_t i = 0; i < 3; i++) {
            int32_t x = length[QW_MOST_LINES * v + i];
            assert_int_equal(l.valence[v], 3);
            assert_int_equal(l.held[v], 0);
            count[0] += x == 4, count[1] += x == 6, count[2] += x == 10;
        }
    for (int i = 0; i < 3; i++) assert_int_equal(count[i], 8);
    assert_int_equal(qw_layout_measure(&l, 5, INT64_MAX, length), 8 * (4 + 5 + 5));
    assert_int_equal(qw_layout_measure(&l, LONG, 8 * (4 + 6 + 10), length), 8 * (4 + 6 + 10));
    for (int64_t most = 0; most < 8 * (4 + 6 + 10); most++)
        assert_true(qw_layout_measure(&l, LONG, most, length) > most);
    hold_axes(&l.complex);
    qw_layout_number(&l);
    for (uint32_t v = 0; v < 8; v++) assert_int_equal(l.held[v], 7);
    qw_env_destroy(env);
}

/* Across a side of the box, from corner to corner: the edge that is drawn is flipped away, one that is held is in the
   way or, where it runs across, gets a vertex. */
static void segments_become_edges(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_component box = box_of(env);
    const qw_complex *c = &box.decimated.complex;
    qw_layout l = qw_layout_make(env, 40);
    uint32_t start = 1; /* from corner 2 of the first side, (0, 4, 6 and 10): (w, 0), to the opposite one, (0, l) */
    qw_layout_fill(&l, &box, c->real, c->d);
    qw_double2 a = qw_along(c, 1), b = qw_along(c, 0);
    qw_segment s = {start, l.corner[5], {a.x - b.x, a.y - b.y}, 0};
    s.quarter = qw_quarter_of(s.to);
    assert_true(qw_make_segment(env, &l, s));
    assert_int_equal(l.complex.face_count, 12);
    uint32_t held = 0;
    for (uint32_t e = 0; e < 18; e++) held += l.complex.fixed[e] != 0;
    assert_int_equal(held, 1);
    qw_layout_fill(&l, &box, c->real, c->d);
    l.complex.fixed[c->edge[2]] = qw_quarter_of(s.to) & 1u ? QW_FIXED_X : QW_FIXED_Y; /* as if it were a parallel */
    assert_false(qw_make_segment(env, &l, s));
    qw_env_destroy(env);
}

/* One component of one edge is changed and held: the offsets are closed again by changing others, always, as cones let
   walks arrive from every side; and not where that may cost nothing. */
static void close_after_each(qw_env *env, qw_complex c, const qw_int2 *first)
{
    c.d = QW_NEW(env, qw_int2, c.edge_count);
    for (uint32_t e = 0; e < c.edge_count; e++)
        for (int32_t by = -1; by <= 1; by += 2) {
            memcpy(c.d, first, c.edge_count * sizeof *c.d);
            c.d[e].x += by, c.fixed[e] |= QW_FIXED_X;
            assert_false(qw_complex_is_closed(&c));
            assert_true(qw_close_offsets(env, &c, LONG, 1e4));
            assert_true(qw_complex_is_closed(&c));
            assert_int_equal(c.d[e].x, first[e].x + by);
            c.fixed[e] &= (uint8_t)~QW_FIXED_X;
            /* nothing may be had for nothing */
            memcpy(c.d, first, c.edge_count * sizeof *c.d);
            c.d[e].x += 3 * by, c.fixed[e] |= QW_FIXED_X;
            assert_false(qw_close_offsets(env, &c, LONG, 1e-9));
            c.fixed[e] &= (uint8_t)~QW_FIXED_X;
        }
}

static void offsets_are_closed_again(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    whole s = whole_of(env, bumpy(env), 1500);
    qw_complex c = s.components.component[0].decimated.complex;
    c.real = scaled(env, &c, s.scale);
    close_after_each(env, c, s.d);
    qw_component box = box_of(env);
    close_after_each(env, box.decimated.complex, box.decimated.complex.d);
    qw_env_destroy(env);
}

typedef struct visited {
    const qw_complex *complex;
    double farthest, dearest, area; /* sum of all areas */
    uint32_t count;
} visited;

static void visit(qw_env *env, void *user)
{
    (void)env;
    visited *v = user;
    double cost = qw_complex_cost(v->complex);
    assert_true(qw_complex_is_closed(v->complex));
    assert_true(cost <= v->farthest + 1e-6);
    v->dearest = fmax(v->dearest, cost), v->area += qw_complex_area(v->complex), v->count++;
}

/* All boxes of lengths that are near, each once: as many as there are, with as large areas. */
static void nearest_are_visited(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_component box = box_of(env);
    qw_complex *c = &box.decimated.complex;
    hold_axes(c);
    qw_complex_weigh(c);
    visited v = {.complex = c, .farthest = 30.1}, all = {0};
    uint32_t inner = 0;
    for (int32_t i = 0; i < 11 * 11 * 11; i++) {
        qw_component other = box_of_size(env, (int32_t[]){4 + i % 11 - 5, 6 + i / 11 % 11 - 5, 10 + i / 121 - 5});
        qw_complex *o = &other.decimated.complex;
        o->real = c->real, o->weight = c->weight;
        double cost = qw_complex_cost(o);
        if (cost > v.farthest) continue;
        all.count++, all.area += qw_complex_area(o), all.dearest = fmax(all.dearest, cost);
        inner += abs(i % 11 - 5) < 4 && abs(i / 11 % 11 - 5) < 4 && abs(i / 121 - 5) < 4;
    }
    assert_true(all.count > 20);
    assert_int_equal(inner, all.count); /* none was missed as it is beyond the lengths tried */
    qw_int2 *had = QW_NEW(env, qw_int2, c->edge_count);
    memcpy(had, c->d, c->edge_count * sizeof *had);
    qw_nearest_request request = {10000, v.farthest, visit, &v};
    assert_int_equal(qw_visit_nearest(env, c, &request), all.count);
    assert_int_equal(v.count, all.count);
    assert_true(v.area == all.area && v.dearest == all.dearest);
    assert_memory_equal(c->d, had, c->edge_count * sizeof *had);
    request.most = 10, v.count = 0; /* the first of them */
    assert_int_equal(qw_visit_nearest(env, c, &request), 10);
    assert_int_equal(v.count, 10);
    qw_env_destroy(env);
}

/* Makes lines meet in a copy of the integers, d, for areas between these bounds and promised between those. */
static qw_meeting_counts meet(qw_env *env, const whole *s, const double area[2], const double promised[2], qw_int2 **d)
{
    const qw_component *component = &s->components.component[0];
    const qw_complex *c = &component->decimated.complex;
    *d = memcpy(QW_NEW(env, qw_int2, c->edge_count), s->d, c->edge_count * sizeof **d);
    qw_meeting_request request = {scaled(env, c, s->scale), 1, area[0], area[1], promised[0], promised[1], 1, false};
    return qw_make_meetings(env, component, &request, *d);
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
        const double area[] = {1960, 2040};
        qw_int2 *d;
        qw_meeting_counts counts = meet(env, &s, area, area, &d);
        print_message("%u of %u kept: %lld to %lld\n", counts.kept, counts.tried, (long long)counts.length_before,
                      (long long)counts.length_after);
        c.d = d;
        assert_true(qw_complex_is_closed(&c));
        assert_true(qw_complex_area(&c) >= 1960 && qw_complex_area(&c) <= 2040);
        assert_true(counts.kept > 0 && counts.length_after < counts.length_before);
        for (uint32_t e = 0; e < c.edge_count; e++) {
            if (c.fixed[e] & QW_FIXED_X) assert_int_equal(d[e].x, 0);
            if (c.fixed[e] & QW_FIXED_Y) assert_int_equal(d[e].y, 0);
        }
        qw_layout l = qw_layout_make(env, c.face_count + component->vertex_count);
        int32_t *length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)l.vertex_room);
        const qw_real2 *real = scaled(env, &c, s.scale);
        qw_layout_fill(&l, component, real, d);
        qw_layout_number(&l);
        int64_t sum = qw_layout_measure(&l, LONG, INT64_MAX, length);
        qw_layout_fill(&l, component, real, s.d);
        qw_layout_number(&l);
        assert_true(sum < qw_layout_measure(&l, LONG, INT64_MAX, length));
    }
    qw_env_destroy(env);
}

/* Where what a component is to have is no area, as its integers turn it inside out, nothing is tried. */
static void no_area_no_meetings(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    whole s = whole_of(env, unit_double_torus(env, 3), 500);
    size_t edges = s.components.component[0].decimated.complex.edge_count;
    const double most[] = {0, -1e-3, -500};
    for (int i = 0; i < 3; i++) {
        const double area[] = {most[i] - 10, most[i]};
        qw_int2 *d;
        qw_meeting_counts counts = meet(env, &s, area, area, &d);
        assert_int_equal(counts.tried, 0);
        assert_true(counts.length_before == 0 && counts.length_after == 0);
        assert_memory_equal(d, s.d, edges * sizeof *d);
    }
    qw_env_destroy(env);
}

/* Where no offsets within reach have the area that is promised, they stay as they are. */
static void areas_out_of_reach(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh shapes[] = {bumpy(env), unit_double_torus(env, 3)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        whole s = whole_of(env, shapes[i], 500);
        const double area[] = {490, 510}, promised[] = {5000, 5010};
        qw_int2 *d;
        qw_meeting_counts counts = meet(env, &s, area, promised, &d);
        assert_true(counts.length_after == counts.length_before);
        assert_memory_equal(d, s.d, s.components.component[0].decimated.complex.edge_count * sizeof *d);
    }
    qw_env_destroy(env);
}

/* A box of 248 quads whose real lengths are so many times its integers: the square of how far each derivative is from
   the identity, and five times what quads lack of four tenths of their real area. */
static void crushed_quads_cost_more(void **state)
{
    (void)state;
    static const double times[] = {1, 1.25, 2, 4};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        qw_env *env = qw_env_create(NULL, 1);
        qw_component box = box_of(env);
        const qw_complex *c = &box.decimated.complex;
        qw_real2 *real = QW_NEW(env, qw_real2, c->edge_count);
        double k = times[i], area = 248 * k * k, square = 2 * (1 - 1 / k) * (1 - 1 / k);
        for (uint32_t e = 0; e < c->edge_count; e++)
            real[e] = (qw_real2){(float)(c->d[e].x * k), (float)(c->d[e].y * k)};
        qw_measured_layout m = qw_measured_layout_make(env, &box, real, c->face_count);
        qw_meeting_terms terms = {.component = &box, .first = c->d, .first_area = 248, .longest = LONG};
        qw_measured_layout_fill(&terms, &m, c->d);
        assert_true(fabs(m.energy - area * (square + 5 * fmax(0.4 - 1 / (k * k), 0))) < 1e-3 * area);
        qw_env_destroy(env);
    }
}

/* What came of the attempts at all candidates, one kept after the other. */
typedef struct outcomes {
    uint32_t count, kept[64];
    double lines, energy;
    qw_int2 *d;
} outcomes;

static outcomes attempt_all(qw_env *env, const whole *s, size_t lane_bytes)
{
    const qw_component *component = &s->components.component[0];
    const qw_complex *c = &component->decimated.complex;
    qw_real2 *real = scaled(env, c, s->scale);
    uint32_t room = 4 * c->face_count;
    qw_measured_layout now = qw_measured_layout_make(env, component, real, room);
    qw_meeting_terms terms = {.component = component,
                              .first = s->d,
                              .first_area = 2000,
                              .worth = 0.6,
                              .least_area = 1960,
                              .most_area = 2040,
                              .least_promised = 1960,
                              .most_promised = 2040,
                              .longest = 900,
                              .best_score = INFINITY};
    qw_measured_layout_fill(&terms, &now, s->d);
    qw_tries *a = qw_tries_begin(env, &terms, real, room, lane_bytes);
    outcomes o = {0};
    for (qw_candidates found = {0}; o.count < 6; o.count++) {
        qw_outlook outlook = {&now.layout, now.length, 20, false};
        qw_tries_find(env, a, &outlook, &found);
        qw_candidate **list = QW_NEW(env, qw_candidate *, found.count);
        for (size_t i = 0; i < found.count; i++) list[i] = &found.found[i];
        assert_true(found.count > 0);
        o.kept[o.count] = qw_tries_make(env, a, list, (uint32_t)found.count, &now);
        if (o.kept[o.count] == found.count) break;
        qw_measure_lines(&terms, &now, INFINITY);
    }
    qw_tries_end(a);
    o.lines = now.lines, o.energy = now.energy;
    o.d = QW_NEW(env, qw_int2, now.layout.complex.edge_count);
    qw_layout_undo(&now.layout, o.d);
    return o;
}

/* Seen from one cone or from the other, in the same place, they are the same two lines. */
static void candidates_are_seen_from_both_ends(void **state)
{
    (void)state;
    qw_candidate a = {.segment.end = 7, .from = 3, .ahead = 12, .aside = -1.5}, b = a;
    b.segment.end = 3, b.from = 7;
    assert_true(qw_is_same_candidate(&a, &a) && qw_is_same_candidate(&a, &b) && qw_is_same_candidate(&b, &a));
    b.aside = 1.5;
    assert_false(qw_is_same_candidate(&a, &b));
    b.aside = a.aside, b.ahead = 12.01;
    assert_false(qw_is_same_candidate(&a, &b));
    b.ahead = a.ahead, b.from = 3;
    assert_false(qw_is_same_candidate(&a, &b));
}

/* However many lanes there are, and where their memory runs out at once, in their first attempt or later, what is kept
   is the same. */
static void lanes_agree(void **state)
{
    (void)state;
    qw_env *alone = qw_env_create(NULL, 1);
    whole s = whole_of(alone, bumpy(alone), 2000);
    outcomes first = attempt_all(alone, &s, 0);
    assert_true(first.count > 2);
    for (uint32_t threads = 2; threads <= 5; threads++)
        for (size_t bytes = 512; bytes < 1 << 18; bytes += bytes / 2) {
            qw_env *env = qw_env_create(NULL, threads);
            outcomes o = attempt_all(env, &s, bytes);
            assert_int_equal(o.count, first.count);
            assert_memory_equal(o.kept, first.kept, sizeof o.kept);
            assert_true(o.lines == first.lines && o.energy == first.energy);
            size_t edges = s.components.component[0].decimated.complex.edge_count;
            assert_memory_equal(o.d, first.d, edges * sizeof *o.d);
            qw_env_destroy(env);
        }
    qw_env_destroy(alone);
}

/* ---- strips */

/* The middle of a quad in the frame of triangle `face`, from its first corner, in halves of a quad; and a direction
   there, a quarter turn of that frame. */
typedef struct middle {
    uint32_t face;
    qw_int2 at;
    unsigned quarter;
} middle;

/* Double the area left of side i of the middle's triangle. */
static int64_t left_of_side(const qw_complex *c, middle p, uint32_t i)
{
    qw_int2 corner = {0, 0}, side = qw_steps_along(c, 3 * p.face + i);
    for (uint32_t k = 0; k < i; k++) corner = qw_int2_add(corner, qw_steps_along(c, 3 * p.face + k));
    return (int64_t)side.x * (p.at.y - 2 * corner.y) - (int64_t)side.y * (p.at.x - 2 * corner.x);
}

/* The same middle, seen from the triangle across side i. */
static middle seen_across(const qw_complex *c, middle p, uint32_t i)
{
    uint32_t h = 3 * p.face + i, t = qw_across(c, h);
    unsigned turn = (4u - qw_turn_across(c, 0, h, t)) & 3u;
    qw_int2 corner = {0, 0}, there = {0, 0};
    for (uint32_t k = 0; k < i; k++) corner = qw_int2_add(corner, qw_steps_along(c, 3 * p.face + k));
    for (uint32_t k = 3 * (t / 3); k <= t; k++) there = qw_int2_add(there, qw_steps_along(c, k)); /* h begins there */
    qw_int2 from = qw_turn(turn, (qw_int2){p.at.x - 2 * corner.x, p.at.y - 2 * corner.y});
    return (middle){t / 3, {from.x + 2 * there.x, from.y + 2 * there.y}, (p.quarter + turn) & 3u};
}

/* A middle on a side belongs to the triangle with the lower number. */
static middle named(const qw_complex *c, middle p)
{
    for (uint32_t i = 0; i < 3; i++)
        if (left_of_side(c, p, i) == 0 && qw_across(c, 3 * p.face + i) / 3 < p.face) return seen_across(c, p, i);
    return p;
}

/* The next quad straight on: through the triangles between, each left by the side that the way crosses. */
static middle next_quad(const qw_complex *c, middle p)
{
    qw_int2 step = qw_turn(p.quarter, (qw_int2){2, 0});
    middle q = {p.face, qw_int2_add(p.at, step), p.quarter};
    for (uint32_t guard = 0; guard < 1000; guard++) {
        uint32_t out = 3;
        double first = 2;
        for (uint32_t i = 0; i < 3; i++) { /* left of a side at first, or behind it already, and not at last */
            double b = (double)left_of_side(c, q, i);
            middle begin = {q.face, qw_int2_sub(q.at, qw_turn(q.quarter, (qw_int2){2, 0})), q.quarter};
            double a = (double)left_of_side(c, begin, i), share = a / (a - b);
            if (b < 0 && b < a && share < first) first = share, out = i;
        }
        if (out == 3) return named(c, q);
        q = seen_across(c, q, out);
    }
    fail_msg("a way does not end");
    return q;
}

static bool is_same_quad(middle a, middle b) { return a.face == b.face && a.at.x == b.at.x && a.at.y == b.at.y; }

/* Whether the strip through p along its quarter comes back to some quad the other way. */
static bool strip_crosses(const qw_complex *c, middle p)
{
    middle way[2000];
    uint32_t n = 0;
    for (middle q = p; n == 0 || !is_same_quad(q, p) || q.quarter != p.quarter; q = next_quad(c, q)) {
        for (uint32_t i = 0; i < n; i++)
            if (is_same_quad(way[i], q)) {
                assert_int_equal((way[i].quarter ^ q.quarter) & 1u, 1);
                return true;
            }
        assert_true(n < 2000);
        way[n++] = q;
    }
    return false;
}

/* Quads of all strips and of those that cross themselves, by ways from each quad. */
static qw_strip_counts walk_strips(const qw_complex *c)
{
    qw_strip_counts sum = {0};
    for (uint32_t f = 0; f < c->face_count; f++)
        for (int32_t x = -99; x <= 99; x += 2)
            for (int32_t y = -99; y <= 99; y += 2) {
                middle p = {f, {x, y}, 0};
                bool is_inside = true;
                for (uint32_t i = 0; i < 3; i++) is_inside &= left_of_side(c, p, i) >= 0;
                if (!is_inside || named(c, p).face != f) continue;
                for (p.quarter = 0; p.quarter < 2; p.quarter++) sum.area++, sum.crossing_area += strip_crosses(c, p);
            }
    return sum;
}

static void strips_are_those_of_walks(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_component box = box_of(env);
    qw_strip_room room = {0};
    qw_strip_counts k = qw_count_strips(env, &box.decimated.complex, &room);
    assert_int_equal(k.strips, 4 + 6 + 10);
    assert_int_equal(k.crossing, 0);
    assert_true(fabs(k.area - 2 * 248) < 1e-6 && k.crossing_area == 0);
    qw_trimesh shapes[] = {bumpy(env), unit_double_torus(env, 3)};
    uint32_t crossing = 0;
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        whole s = whole_of(env, shapes[i], 250);
        qw_complex c = s.components.component[0].decimated.complex;
        c.d = s.d;
        room = (qw_strip_room){0};
        k = qw_count_strips(env, &c, &room);
        qw_strip_counts walked = walk_strips(&c);
        assert_true(fabs(k.area - 2 * qw_complex_area(&c)) < 1e-6 && fabs(k.area - walked.area) < 1e-6);
        assert_true(fabs(k.crossing_area - walked.crossing_area) < 1e-6);
        crossing += k.crossing;
    }
    assert_true(crossing > 0);
    qw_env_destroy(env);
}

/* Counts by what has changed are those by all, move after move, kept or undone, also where edges outgrow the room that
   they had; a bound ends a count only where more cross. */
static void strips_are_linked_anew(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    whole s = whole_of(env, unit_double_torus(env, 3), 250);
    qw_complex c = s.components.component[0].decimated.complex;
    c.d = s.d;
    qw_complex_weigh(&c);
    unit_rng r = {74};
    qw_strip_room room = {0};
    double kept = qw_count_strips(env, &c, &room).crossing_area;
    uint32_t *face = QW_NEW(env, uint32_t, 2 * c.edge_count), moves = 0, crossing = 0, ended = 0;
    qw_int2 *had = QW_NEW(env, qw_int2, c.edge_count);
    for (int k = 0; k < 600; k++) {
        memcpy(had, c.d, c.edge_count * sizeof *had);
        if (!qw_step_offsets(env, &c, unit_random(&r, 2 * c.edge_count), k % 2 ? 1 : -1, LONG, 1e4)) continue;
        uint32_t count = 0;
        for (uint32_t e = 0; e < c.edge_count; e++)
            for (uint32_t i = 2 * e; i < 2 * e + 2 && memcmp(&c.d[e], &had[e], sizeof *had); i++)
                if (c.side[i] != QW_NONE) face[count++] = c.side[i] / 3;
        qw_strip_room other = {0};
        qw_strip_counts all = qw_count_strips(env, &c, &other);
        double most = k % 3 == 0 ? all.crossing_area / 2 : INFINITY,
               now = qw_change_strips(env, &c, &room, face, count, most);
        assert_true(now > most ? now < all.crossing_area + 1e-6 : fabs(now - all.crossing_area) < 1e-6);
        moves++, crossing += all.crossing > 0, ended += now > most;
        if (k % 3 == 1) {
            qw_keep_strips(&room), kept = all.crossing_area;
            assert_int_equal(room.crossing_count, all.crossing);
        } else {
            memcpy(c.d, had, c.edge_count * sizeof *had);
            qw_undo_strips(env, &c, &room, face, count);
        }
        assert_true(fabs(room.area - kept) < 1e-6);
    }
    assert_true(moves > 100 && crossing > 100 && ended > 50);
    qw_env_destroy(env);
}

static qw_meeting_terms strip_terms(const qw_component *component, const qw_int2 *d, double area)
{
    return (qw_meeting_terms){.component = component,
                              .first = d,
                              .first_area = area,
                              .touching = UINT32_MAX,
                              .worth = 0.6,
                              .least_area = 0.99 * area,
                              .most_area = 1.01 * area,
                              .least_promised = 0.94 * area,
                              .most_promised = 1.06 * area};
}

/* Searches on from d in lanes of so many bytes; checks what holds of any result, which `to` becomes. Returns the area
   that crosses itself afterwards. */
static double search_strips(qw_env *env, const qw_component *component, const qw_real2 *real, const qw_int2 *d,
                            double area, size_t lane_bytes, qw_int2 *to)
{
    qw_complex c = component->decimated.complex;
    c.d = memcpy(to, d, c.edge_count * sizeof *d), c.real = (qw_real2 *)real;
    qw_meeting_terms terms = strip_terms(component, d, area);
    qw_strip_room room = {0};
    double first = qw_count_strips(env, &c, &room).crossing_area, least = INFINITY, crossing = 0;
    qw_strip_find found[QW_STRIP_SEARCHES];
    uint32_t count = qw_search_strips(env, &terms, &c, 1, lane_bytes, found);
    assert_int_equal(count, c.edge_count * c.edge_count <= 2000 ? 3 : 2);
    for (uint32_t i = 0; i < count; i++) {
        assert_true(found[i].kept > 0 && found[i].kept <= found[i].tried);
        c.d = found[i].d;
        assert_true(qw_complex_is_closed(&c));
        assert_int_equal(qw_complex_inverted(&c), 0);
        assert_true(fabs(qw_complex_area(&c) - area) <= 0.06 * area);
        double now = qw_count_strips(env, &c, &room).crossing_area;
        assert_true(fabs(first - found[i].freed - now) < 1e-6);
        if (found[i].score >= least) continue;
        least = found[i].score, crossing = now;
        memcpy(to, c.d, c.edge_count * sizeof *d);
    }
    return crossing;
}

/* A box as long as a limb, its offsets, and room for others. */
typedef struct limb {
    qw_component box;
    qw_int2 *had, *found; /* qw_int2[edges] */
} limb;

static limb limb_like_box(qw_env *env)
{
    limb s = {.box = box_of_size(env, (int32_t[]){4, 5, 14})};
    qw_complex *c = &s.box.decimated.complex;
    qw_complex_weigh(c);
    s.had = memcpy(QW_NEW(env, qw_int2, c->edge_count), c->d, c->edge_count * sizeof *c->d);
    s.found = QW_NEW(env, qw_int2, c->edge_count);
    return s;
}

/* Such a box, whose rows around it come back one row beside their beginning: they become rings. */
static void helices_become_rings(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    limb s = limb_like_box(env);
    qw_complex *c = &s.box.decimated.complex;
    uint32_t helices = 0, rings = 0;
    for (uint32_t v = 0; v < 2 * c->edge_count; v++) {
        memcpy(c->d, s.had, c->edge_count * sizeof *c->d);
        qw_strip_room room = {0};
        if (!qw_step_offsets(env, c, v, 1, LONG, 1e4) || qw_complex_inverted(c) > 0) continue;
        double crossing = qw_count_strips(env, c, &room).crossing_area;
        if (crossing < 20) continue;
        helices++;
        double after = search_strips(env, &s.box, c->real, c->d, 292, 0, s.found);
        assert_true(after < crossing / 2);
        rings += after == 0;
    }
    print_message("of %u helices %u became rings\n", helices, rings);
    assert_true(rings > 10);
    qw_env_destroy(env);
}

/* The same box, twisted by two or three quads at a ring around it: no offset that is changed by one leads back. */
static void twists_are_taken_back(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    limb s = limb_like_box(env);
    qw_complex *c = &s.box.decimated.complex;
    uint32_t twisted = 0, rings = 0, list[1000];
    for (uint32_t v = 0; v < 2 * c->edge_count; v++) {
        memcpy(c->d, s.had, c->edge_count * sizeof *c->d);
        qw_strip_room room = {0};
        qw_count_strips(env, c, &room);
        if (room.places[v] == 0) continue;
        uint32_t count = qw_list_strip(&room, room.first[v], list);
        int32_t quads = v % 3 ? 2 : -3;
        for (uint32_t i = 0; i < count; i++) {
            uint32_t k = qw_component_of_place(c, &room, list[i]);
            assert_true(list[i] >= room.first[k] && list[i] < room.first[k] + room.places[k]);
            qw_int2 d = s.had[k / 2];
            if (k % 2) c->d[k / 2].x -= d.y > 0 ? quads : -quads;
            else c->d[k / 2].y += d.x > 0 ? quads : -quads;
        }
        assert_true(qw_complex_is_closed(c));
        if (qw_complex_inverted(c) > 0 || qw_count_strips(env, c, &room).crossing_area < 20) continue;
        twisted++;
        rings += search_strips(env, &s.box, c->real, c->d, 292, 0, s.found) == 0;
    }
    print_message("of %u twists %u became rings\n", twisted, rings);
    assert_true(rings > 20); /* circuits alone make 16 */
    qw_env_destroy(env);
}

static void fewer_strips_cross(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    qw_trimesh shapes[] = {bumpy(env), unit_double_torus(env, 3)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        whole s = whole_of(env, shapes[i], 1000);
        const qw_component *component = &s.components.component[0];
        qw_complex c = component->decimated.complex;
        c.d = s.d;
        qw_strip_room room = {0};
        qw_int2 *found = QW_NEW(env, qw_int2, c.edge_count), *other = QW_NEW(env, qw_int2, c.edge_count);
        qw_real2 *real = scaled(env, &c, s.scale);
        double crossing = qw_count_strips(env, &c, &room).crossing_area,
               after = search_strips(env, component, real, s.d, 1000, 0, found);
        print_message("of 2000 quads in strips that cross themselves %g, %g after the search\n", crossing, after);

        assert_true(after < crossing);
        for (size_t lane_bytes = 1 << 12; lane_bytes <= 1 << 24; lane_bytes <<= 2) { /* too few at first */
            search_strips(env, component, real, s.d, 1000, lane_bytes, other);
            assert_memory_equal(other, found, c.edge_count * sizeof *found);
        }
    }
    qw_env_destroy(env);
}

/* Three strips for each: as many cross themselves, and lines are three times as long. */
static void multiplied_strips_lie_side_by_side(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh shapes[] = {bumpy(env), unit_double_torus(env, 3)};
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        whole s = whole_of(env, shapes[i], 250);
        qw_complex c = s.components.component[0].decimated.complex;
        c.d = s.d;
        qw_strip_room room = {0};
        qw_strip_counts once = qw_count_strips(env, &c, &room);
        for (uint32_t e = 0; e < c.edge_count; e++) c.d[e].x *= 3, c.d[e].y *= 3;
        qw_strip_counts thrice = qw_count_strips(env, &c, &room);
        assert_int_equal(thrice.strips, 3 * once.strips);
        assert_int_equal(thrice.crossing, 3 * once.crossing);
        assert_true(fabs(thrice.crossing_area - 9 * once.crossing_area) < 1e-6);
    }
    qw_env_destroy(env);
}

static double lines_of(qw_env *env, const whole *s, const qw_int2 *d, double quads)
{
    const qw_component *component = &s->components.component[0];
    qw_complex c = component->decimated.complex;
    c.d = memcpy(QW_NEW(env, qw_int2, c.edge_count), d, c.edge_count * sizeof *d);
    assert_true(qw_complex_is_closed(&c));
    assert_int_equal(qw_complex_inverted(&c), 0);
    assert_true(fabs(qw_complex_area(&c) - quads) <= 0.02 * quads);
    qw_measured_layout m = qw_measured_layout_make(env, component, scaled(env, &c, s->scale), 4 * c.face_count);
    qw_meeting_terms terms = strip_terms(component, d, quads);
    terms.longest = INT32_MAX / 4;
    qw_measured_layout_fill(&terms, &m, d);
    return m.lines;
}

/* With many quads lines meet with fewer first. They are then about as long as with few quads, but for the factor of
   four of edges a quarter as long, and shorter than where they meet with all quads only. */
static void many_quads_have_lines_of_few(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh torus = unit_double_torus(env, 3);
    whole few = whole_with_loops(env, torus, 1000, 0.5), many = whole_with_loops(env, torus, 16000, 0.5),
          all = whole_of(env, torus, 16000);
    qw_int2 *met;
    meet(env, &all, (double[]){15900, 16100}, (double[]){15700, 16300}, &met);
    double of_few = lines_of(env, &few, few.d, 1000), of_many = lines_of(env, &many, many.d, 16000),
           of_all = lines_of(env, &all, met, 16000);
    print_message("lines of %g quads with 1,000, of %g with 16,000, of %g with these only\n", of_few, of_many, of_all);
    assert_true(of_many < 7 * of_few && of_many < 0.7 * of_all);
    qw_env_destroy(env);
}

QW_TEST_SUITE(meetings)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(layouts_go_back),
                                       cmocka_unit_test(lines_of_a_box),
                                       cmocka_unit_test(crushed_quads_cost_more),
                                       cmocka_unit_test(segments_become_edges),
                                       cmocka_unit_test(offsets_are_closed_again),
                                       cmocka_unit_test(nearest_are_visited),
                                       cmocka_unit_test(lines_get_shorter),
                                       cmocka_unit_test(no_area_no_meetings),
                                       cmocka_unit_test(areas_out_of_reach),
                                       cmocka_unit_test(strips_are_those_of_walks),
                                       cmocka_unit_test(strips_are_linked_anew),
                                       cmocka_unit_test(helices_become_rings),
                                       cmocka_unit_test(twists_are_taken_back),
                                       cmocka_unit_test(fewer_strips_cross),
                                       cmocka_unit_test(multiplied_strips_lie_side_by_side),
                                       cmocka_unit_test(many_quads_have_lines_of_few),
                                       cmocka_unit_test(lanes_agree),
                                       cmocka_unit_test(candidates_are_seen_from_both_ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

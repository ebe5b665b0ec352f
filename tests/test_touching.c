/* Touching curves: counted against a brute-force identification of lattice points, signs against their rules, parting
 * against an enumeration of all integers of a narrow band. */
#include "suite.h"
#include "unit_lattice.h"

#include "remesh/quantise/touching.h"

enum { MOST_POINTS = 400 };

/* A lattice point of the sheet: so many steps from vertex a towards b, a < b, or at a where `step` is 0. */
typedef struct lattice_point {
    uint32_t a, b;
    int32_t step;
    qw_int2 place;
} lattice_point;

typedef struct brute {
    lattice_point point[MOST_POINTS];
    uint32_t count, set[MOST_POINTS], curve[MOST_POINTS];
    bool on_curve[MOST_POINTS], corner[MOST_POINTS];
} brute;

static int32_t steps_between(qw_int2 a, qw_int2 b)
{
    int32_t x = abs(b.x - a.x), y = abs(b.y - a.y), steps = 0;
    for (int32_t k = 1; k <= x + y; k++)
        if (x % k == 0 && y % k == 0) steps = k;
    return steps;
}

static uint32_t point_of(brute *s, const unit_lattice *l, uint32_t a, uint32_t b, int32_t step, int32_t steps)
{
    if (step == steps) a = b, step = 0;
    if (step == 0) b = a;
    if (a > b) step = steps - step, a ^= b, b ^= a, a ^= b;
    for (uint32_t i = 0; i < s->count; i++)
        if (s->point[i].a == a && s->point[i].b == b && s->point[i].step == step) return i;
    assert_true(s->count < MOST_POINTS);
    qw_int2 from = l->place[a], to = l->place[b];
    qw_int2 place = step == 0
                        ? from
                        : (qw_int2){from.x + (to.x - from.x) / steps * step, from.y + (to.y - from.y) / steps * step};
    s->point[s->count] = (lattice_point){a, b, step, place};
    s->set[s->count] = s->curve[s->count] = s->count;
    return s->count++;
}

static void unite(uint32_t *set, uint32_t count, uint32_t a, uint32_t b)
{
    uint32_t from = set[a], to = set[b];
    for (uint32_t i = 0; i < count; i++)
        if (set[i] == from) set[i] = to;
}

/* Within a triangle without an area, points of its sides at the same place are one. */
static void contract_face(brute *s, const unit_lattice *l, uint32_t f)
{
    const uint32_t *v = &l->component.decimated.corner[3 * f];
    uint32_t on[MOST_POINTS], count = 0;
    for (int i = 0; i < 3; i++) {
        uint32_t a = v[i], b = v[(i + 1) % 3];
        int32_t steps = steps_between(l->place[a], l->place[b]);
        for (int32_t k = 0; k <= steps; k++) on[count++] = point_of(s, l, a, b, k, steps);
    }
    qw_int2 p = l->place[v[0]];
    if (qw_int2_det(qw_int2_sub(l->place[v[1]], p), qw_int2_sub(l->place[v[2]], p)) != 0) return;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t j = 0; j < i; j++)
            if (qw_int2_is_zero(qw_int2_sub(s->point[on[i]].place, s->point[on[j]].place)))
                unite(s->set, s->count, on[i], on[j]);
}

static void mark_curves(brute *s, const unit_lattice *l)
{
    const qw_complex *c = &l->component.decimated.complex;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        uint32_t h = c->side[2 * e], a = l->component.decimated.corner[h],
                 b = l->component.decimated.corner[qw_next(h)];
        int32_t steps = steps_between(l->place[a], l->place[b]);
        if (steps == 0) unite(s->set, s->count, point_of(s, l, a, a, 0, 1), point_of(s, l, b, b, 0, 1));
        if (!c->fixed[e] && c->side[2 * e + 1] != QW_NONE) continue;
        for (int32_t k = 0; k <= steps; k++) s->on_curve[point_of(s, l, a, b, k, steps)] = true;
        s->on_curve[point_of(s, l, a, a, 0, 1)] = true;
        if (steps == 0) unite(s->curve, s->count, point_of(s, l, a, a, 0, 1), point_of(s, l, b, b, 0, 1));
    }
    for (uint32_t i = 0; i < s->count; i++)
        s->corner[i] = s->on_curve[i] && s->point[i].step == 0 &&
                       l->component.constraint[s->point[i].a] == QW_VERTEX_CORNER;
}

/* Over the sets of points that are one: the curves beyond the first, and the corners beyond the first. */
static uint32_t brute_touching(const unit_lattice *l)
{
    brute s = {0};
    for (uint32_t f = 0; f < l->component.decimated.complex.face_count; f++) contract_face(&s, l, f);
    mark_curves(&s, l);
    uint32_t sum = 0;
    for (uint32_t set = 0; set < s.count; set++) {
        uint32_t curves = 0, corners = 0;
        for (uint32_t i = 0; i < s.count; i++) {
            if (s.set[i] != set) continue;
            bool counted = !s.on_curve[i]; /* one point stands for each curve */
            for (uint32_t j = 0; j < i && !counted; j++) counted = s.on_curve[j] && s.curve[j] == s.curve[i];
            curves += !counted, corners += s.corner[i];
        }
        sum += (curves > 1 ? curves - 1 : 0) + (corners > 1 ? corners - 1 : 0);
    }
    return sum;
}

static void counts_as_brute_force(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint64_t seed = 11;
    uint32_t apart = 0, most = 0;
    for (int i = 0; i < 600; i++) {
        qw_scope_begin(env);
        unit_lattice l = unit_lattice_make(env, 1 + i % 3, 1 + i / 3 % 2, seed | 1u);
        for (uint32_t v = 0; v < l.component.vertex_count; v++) {
            l.place[v] = (qw_int2){(int32_t)(random_bits(&seed) % 5), (int32_t)(random_bits(&seed) % (1 + i % 4))};
            l.component.constraint[v] = random_bits(&seed) % 3 ? QW_VERTEX_CURVE : QW_VERTEX_CORNER;
        }
        qw_complex *c = &l.component.decimated.complex;
        for (uint32_t e = 0; e < c->edge_count; e++)
            c->fixed[e] = random_bits(&seed) % 4 ? 0 : (uint8_t)(random_bits(&seed) & 1u ? QW_FIXED_X : QW_FIXED_Y);
        unit_lattice_fill(&l);
        uint32_t count = qw_count_touching(env, &l.component, c->d);
        assert_int_equal(count, brute_touching(&l));
        apart += count == 0, most = count > most ? count : most;
        qw_scope_end(env);
    }
    assert_true(apart > 20 && apart < 580 && most > 8); /* the shapes have both kinds */
    qw_env_destroy(env);
}

/* A band of no width, three quads long, between two curves: its two inner points touch; so do the corners of its
   short sides, if they are corners. */
static void a_band_without_width(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    unit_lattice l = unit_lattice_make(env, 1, 1, 3);
    unit_lattice_hold_rim(&l);
    l.place[1] = l.place[3] = (qw_int2){3, 0}, l.place[2] = l.place[0];
    unit_lattice_fill(&l);
    assert_int_equal(qw_count_touching(env, &l.component, l.component.decimated.complex.d), 4);
    l.component.constraint = NULL;
    assert_int_equal(qw_count_touching(env, &l.component, l.component.decimated.complex.d), 2);
    l.place[2].y = l.place[3].y = 1;
    unit_lattice_fill(&l);
    assert_int_equal(qw_count_touching(env, &l.component, l.component.decimated.complex.d), 0);
    qw_env_destroy(env);
}

/* The sign of an edge in the sheet's frame, from its first vertex to its second. */
static qw_int2 sign_from(const unit_lattice *l, uint32_t a, uint32_t b)
{
    const qw_complex *c = &l->component.decimated.complex;
    uint32_t e = unit_lattice_edge(l, a, b);
    qw_int2 s = qw_turn(4u - unit_lattice_turns(l, e), (qw_int2){c->at_least[2 * e], c->at_least[2 * e + 1]});
    return l->component.decimated.corner[c->side[2 * e]] == a ? s : qw_turn(2, s);
}

static void assert_sign(const unit_lattice *l, uint32_t a, uint32_t b, int32_t x, int32_t y)
{
    qw_int2 s = sign_from(l, a, b);
    assert_int_equal(s.x, x), assert_int_equal(s.y, y);
}

/* Two cells side by side between the curves y = 0 and y = 0.3, in any frames. The longest edge of each curve keeps its
   length, and what leads from a curve to a vertex of the other keeps its distance. If the short sides are curves as
   well, the vertices next to them keep their distance from these. */
static void signs_of_a_band(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint64_t seed = 0; seed < 80; seed++) {
        qw_scope_begin(env);
        bool rim = seed % 2;
        unit_lattice l = unit_lattice_make(env, 2, 1, seed / 2);
        if (rim) unit_lattice_hold_rim(&l);
        for (uint32_t v = 0; v < 5; v++)
            if (v != 2) unit_lattice_hold(&l, v, v + 1, true);
        for (uint32_t v = 0; v < 6; v++)
            l.position[v] = (qw_real2){v % 3 == 2 ? 5.0f : (float)(v % 3), v > 2 ? 0.3f : 0.0f};
        unit_lattice_fill(&l);
        qw_set_signs(env, &l.component);
        assert_sign(&l, 0, 1, 0, 0), assert_sign(&l, 1, 2, 1, 0);
        assert_sign(&l, 3, 4, rim, 0), assert_sign(&l, 4, 5, 1, 0);
        assert_sign(&l, 0, 3, 0, 1), assert_sign(&l, 1, 4, 0, 1), assert_sign(&l, 2, 5, 0, 1);
        assert_sign(&l, 0, 4, rim, 1), assert_sign(&l, 1, 5, rim, 1);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* A corner in the middle of a curve parts it in two, each with a length to keep; what is nearly 0 has no sign; and a
   vertex on no curve needs no distance. */
static void signs_that_are_not_set(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint64_t seed = 0; seed < 40; seed++) {
        qw_scope_begin(env);
        unit_lattice l = unit_lattice_make(env, 2, 1, seed);
        unit_lattice_hold(&l, 0, 1, true), unit_lattice_hold(&l, 1, 2, true);
        qw_set_signs(env, &l.component);
        for (uint32_t a = 0; a < 3; a++) assert_sign(&l, a, a + 3, 0, 0);
        assert_sign(&l, 0, 4, 0, 0), assert_sign(&l, 3, 4, 0, 0);
        assert_int_equal(sign_from(&l, 0, 1).x + sign_from(&l, 1, 2).x, 1); /* as long as one another: one of them */
        l.component.constraint[1] = QW_VERTEX_CORNER;
        qw_set_signs(env, &l.component);
        assert_sign(&l, 0, 1, 1, 0), assert_sign(&l, 1, 2, 1, 0);
        l.position[0] = (qw_real2){1 - 0.05f, 0}, l.position[2].x = -3;
        unit_lattice_fill(&l);
        qw_set_signs(env, &l.component);
        assert_sign(&l, 0, 1, 0, 0), assert_sign(&l, 1, 2, -1, 0);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* Where three curves meet, at a vertex that is not called a corner, each keeps a length of its own. */
static void signs_of_curves_that_meet(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (uint64_t seed = 0; seed < 40; seed++) {
        qw_scope_begin(env);
        unit_lattice l = unit_lattice_make(env, 2, 2, seed);
        unit_lattice_hold(&l, 3, 4, true), unit_lattice_hold(&l, 1, 4, false), unit_lattice_hold(&l, 4, 8, true);
        qw_set_signs(env, &l.component);
        assert_sign(&l, 3, 4, 1, 0), assert_sign(&l, 1, 4, 0, 1), assert_sign(&l, 4, 8, 1, 0);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

enum { BAND_ROWS = 2 };

/* A band of one column and two rows between two curves, which rounding has left no width. */
static unit_lattice closed_band(qw_env *env, uint64_t seed, float length, const float width[BAND_ROWS])
{
    unit_lattice l = unit_lattice_make(env, 1, BAND_ROWS, seed);
    unit_lattice_hold_rim(&l);
    for (uint32_t v = 0; v < l.component.vertex_count; v++) {
        l.position[v] = (qw_real2){v & 1u ? length : 0, 0};
        for (uint32_t row = 0; row < v / 2; row++) l.position[v].y += width[row];
        l.place[v] = (qw_int2){v & 1u ? (int32_t)(length + 0.5f) : 0, 0};
    }
    unit_lattice_fill(&l);
    return l;
}

/* The least cost of all integers of the band, of which the rim leaves the length and the widths free, that touch
   nowhere and invert nothing. */
static double least_apart(qw_env *env, unit_lattice l)
{
    double least = INFINITY;
    qw_complex *c = &l.component.decimated.complex;
    c->d = QW_NEW(env, qw_int2, c->edge_count);
    for (int32_t i = 0; i < 8 * 5 * 5; i++) {
        int32_t x = i % 8, y[3] = {0, i / 8 % 5 - 1, i / 40 - 1};
        y[2] += y[1];
        for (uint32_t v = 0; v < l.component.vertex_count; v++) l.place[v] = (qw_int2){v & 1u ? x : 0, y[v / 2]};
        unit_lattice_fill(&l);
        if (brute_touching(&l) == 0 && qw_complex_inverted(c) == 0) least = fmin(least, qw_complex_cost(c));
    }
    return least;
}

static void assert_constraints(const qw_complex *c)
{
    assert_true(qw_complex_is_closed(c));
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (c->fixed[e] & QW_FIXED_X) assert_int_equal(c->d[e].x, 0);
        if (c->fixed[e] & QW_FIXED_Y) assert_int_equal(c->d[e].y, 0);
    }
}

static void parts_at_the_least_cost(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint64_t seed = 2;
    for (int i = 0; i < 60; i++) {
        qw_scope_begin(env);
        float length = 1 + (float)(random_bits(&seed) % 50) / 10,
              width[BAND_ROWS] = {(float)(1 + random_bits(&seed) % 48) / 100,
                                  (float)(1 + random_bits(&seed) % 48) / 100};
        unit_lattice l = closed_band(env, seed, length, width);
        qw_complex *c = &l.component.decimated.complex;
        assert_true(qw_count_touching(env, &l.component, c->d) > 0);
        double work = 1e4, before = work;
        assert_int_equal(qw_part_curves(env, &l.component, c->real, c->d, &work), 0);
        assert_int_equal(qw_count_touching(env, &l.component, c->d), 0);
        assert_constraints(c);
        assert_true(qw_complex_inverted(c) == 0 && work < before);
        assert_float_equal((float)qw_complex_cost(c), (float)least_apart(env, l), 1e-4f);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* On sheets of random lengths with corners of curves and free vertices inside: what is returned is true, curves do not
   touch more often than before, and no more triangles are inverted. */
static void parts_without_harm(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint64_t seed = 77;
    uint32_t touched = 0, parted = 0;
    for (int i = 0; i < 400; i++) {
        qw_scope_begin(env);
        unit_lattice l = unit_lattice_make(env, 2 + i % 2, 2, seed | 1u);
        unit_lattice_hold_rim(&l);
        for (uint32_t v = 0; v < l.component.vertex_count; v++) {
            uint32_t x = v % (l.nx + 1), y = v / (l.nx + 1);
            bool inner = x > 0 && x < l.nx && y > 0 && y < l.ny;
            l.position[v] = (qw_real2){0.7f * (float)x, 0.23f * (float)y};
            if (inner) l.position[v].x += (float)(random_bits(&seed) % 100) / 100 - 0.5f;
            if (inner) l.position[v].y += (float)(random_bits(&seed) % 30) / 100 - 0.15f;
            l.place[v] = (qw_int2){(int32_t)x, 0};
            if (inner) l.place[v].x += (int32_t)(random_bits(&seed) % 3) - 1;
            if (inner) l.place[v].y += (int32_t)(random_bits(&seed) % 3) - 1;
        }
        unit_lattice_fill(&l);
        qw_complex *c = &l.component.decimated.complex;
        uint32_t inverted = qw_complex_inverted(c), before = brute_touching(&l);
        double work = 1e4;
        uint32_t left = qw_part_curves(env, &l.component, c->real, c->d, &work);
        assert_int_equal(left, qw_count_touching(env, &l.component, c->d));
        assert_true(left <= before && qw_complex_inverted(c) <= inverted);
        assert_constraints(c);
        touched += before > 0, parted += left < before;
        qw_scope_end(env);
    }
    assert_true(touched > 100 && parted > 2 * touched / 3);
    qw_env_destroy(env);
}

/* Without work, where every variable is constrained, and where all but one are, so that no step can be closed again:
   nothing changes, and the count is that of before. */
static void leaves_what_it_cannot_part(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    for (int i = 0; i < 3; i++) {
        qw_scope_begin(env);
        unit_lattice l = closed_band(env, 5, 3, (float[BAND_ROWS]){0.4f, 0.3f});
        qw_complex *c = &l.component.decimated.complex;
        uint32_t side = unit_lattice_edge(&l, 0, 2);
        uint8_t fixed = c->fixed[side];
        if (i > 0) memset(c->fixed, QW_FIXED_X | QW_FIXED_Y, c->edge_count);
        if (i == 2) c->fixed[side] = fixed;
        qw_int2 *d = QW_NEW(env, qw_int2, c->edge_count);
        memcpy(d, c->d, c->edge_count * sizeof *d);
        double work = i == 0 ? 0 : 1e4;
        assert_int_equal(qw_part_curves(env, &l.component, c->real, d, &work), brute_touching(&l));
        assert_memory_equal(d, c->d, c->edge_count * sizeof *d);
        assert_true(i == 0 || work > 0); /* a place that cannot be parted is tried once */
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(touching)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(counts_as_brute_force),     cmocka_unit_test(a_band_without_width),
        cmocka_unit_test(signs_of_a_band),           cmocka_unit_test(signs_that_are_not_set),
        cmocka_unit_test(signs_of_curves_that_meet), cmocka_unit_test(parts_at_the_least_cost),
        cmocka_unit_test(parts_without_harm),        cmocka_unit_test(leaves_what_it_cannot_part),
    };
    return cmocka_run_group_tests_name("touching", tests, NULL, NULL);
}

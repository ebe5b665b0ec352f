/* Areas brought within bounds by single steps, on a sheet of rows and columns whose lengths are all there is to
 * choose: against an enumeration of the lengths. */
#include "suite.h"
#include "unit_lattice.h"

#include "remesh/quantise/nudge.h"

enum { COLUMNS = 2, ROWS = 2 };

typedef struct lengths {
    int32_t x[COLUMNS], y[ROWS];
} lengths;

/* Feature curves run along every row and column. */
static unit_lattice make_sheet(qw_env *env, uint64_t seed)
{
    unit_lattice l = unit_lattice_make(env, COLUMNS, ROWS, seed);
    for (uint32_t y = 0; y <= ROWS; y++)
        for (uint32_t x = 0; x <= COLUMNS; x++) {
            uint32_t v = unit_lattice_at(&l, x, y);
            if (x < COLUMNS) unit_lattice_hold(&l, v, unit_lattice_at(&l, x + 1, y), true);
            if (y < ROWS) unit_lattice_hold(&l, v, unit_lattice_at(&l, x, y + 1), false);
        }
    return l;
}

static void set_places(unit_lattice *l, const lengths *n)
{
    qw_int2 at = {0, 0};
    for (uint32_t y = 0; y <= ROWS; at.y += y < ROWS ? n->y[y] : 0, at.x = 0, y++)
        for (uint32_t x = 0; x <= COLUMNS; at.x += x < COLUMNS ? n->x[x] : 0, x++)
            l->place[unit_lattice_at(l, x, y)] = at;
    unit_lattice_fill(l);
}

static lengths lengths_of(const unit_lattice *l)
{
    lengths n;
    const qw_complex *c = &l->component.decimated.complex;
    for (uint32_t i = 0; i < COLUMNS; i++) {
        uint32_t e = unit_lattice_edge(l, i, i + 1);
        n.x[i] = abs(c->d[e].x + c->d[e].y);
    }
    for (uint32_t i = 0; i < ROWS; i++) {
        uint32_t e = unit_lattice_edge(l, unit_lattice_at(l, 0, i), unit_lattice_at(l, 0, i + 1));
        n.y[i] = abs(c->d[e].x + c->d[e].y);
    }
    return n;
}

static int32_t area_of(const lengths *n) { return (n->x[0] + n->x[1]) * (n->y[0] + n->y[1]); }

/* Lengths from 1 to 4 with real ones within half a quad of them. */
static void random_sheet(unit_lattice *l, lengths *n, uint64_t *seed)
{
    float x = 0, y = 0, real[COLUMNS + ROWS];
    for (uint32_t i = 0; i < COLUMNS + ROWS; i++) {
        int32_t k = 1 + (int32_t)(random_bits(seed) % 4);
        *(i < COLUMNS ? &n->x[i] : &n->y[i - COLUMNS]) = k;
        real[i] = (float)k + (float)(random_bits(seed) % 1000) / 1000 - 0.5f;
    }
    for (uint32_t v = 0; v < l->component.vertex_count; v++) {
        uint32_t column = v % (COLUMNS + 1), row = v / (COLUMNS + 1);
        x = y = 0;
        for (uint32_t i = 0; i < column; i++) x += real[i];
        for (uint32_t i = 0; i < row; i++) y += real[COLUMNS + i];
        l->position[v] = (qw_real2){x, y};
    }
    set_places(l, n);
}

/* The cheapest change of one length by one (by: 1 or -1) that leads into the bounds; INFINITY: none does. */
static double cheapest_step(unit_lattice *l, const lengths *n, int32_t by, double least, double most)
{
    double cost = INFINITY;
    for (uint32_t i = 0; i < COLUMNS + ROWS; i++) {
        lengths changed = *n;
        int32_t *k = i < COLUMNS ? &changed.x[i] : &changed.y[i - COLUMNS];
        *k += by;
        if (*k < 1 || area_of(&changed) < least || area_of(&changed) > most) continue;
        set_places(l, &changed);
        cost = fmin(cost, qw_complex_cost(&l->component.decimated.complex));
    }
    set_places(l, n);
    return cost;
}

static void assert_sound(const unit_lattice *l)
{
    const qw_complex *c = &l->component.decimated.complex;
    assert_true(qw_complex_is_closed(c));
    assert_int_equal(qw_complex_inverted(c), 0);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (c->fixed[e] & QW_FIXED_X) assert_int_equal(c->d[e].x, 0);
        if (c->fixed[e] & QW_FIXED_Y) assert_int_equal(c->d[e].y, 0);
        if (c->fixed[e]) assert_true(c->d[e].x != 0 || c->d[e].y != 0);
    }
}

/* Where one step leads into the bounds, the cheapest such step is taken; what is returned is true of the area. */
static void takes_the_cheapest_step(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint64_t seed = 5;
    uint32_t single = 0, several = 0, missed = 0;
    for (int i = 0; i < 200; i++) {
        qw_scope_begin(env);
        unit_lattice l = make_sheet(env, seed | 1u);
        qw_complex *c = &l.component.decimated.complex;
        lengths n;
        random_sheet(&l, &n, &seed);
        bool longer = i & 1;
        double width = i % 5, off = 1 + (double)(random_bits(&seed) % 6);
        double least = longer ? area_of(&n) + off : area_of(&n) - off - width, most = least + width, work = 1e6;
        double cost = cheapest_step(&l, &n, longer ? 1 : -1, least, most);
        bool within = qw_nudge_area(env, c, least, most, &work);
        double area = qw_complex_area(c);
        lengths now = lengths_of(&l);
        assert_sound(&l);
        assert_true(area == area_of(&now) && work < 1e6);
        assert_int_equal(within, area >= least && area <= most);
        assert_true(within || (longer ? area >= area_of(&n) : area <= area_of(&n)));
        if (cost < INFINITY) assert_true(within && fabs(qw_complex_cost(c) - cost) < 1e-4);
        single += cost < INFINITY, several += within && cost == INFINITY, missed += !within;
        qw_scope_end(env);
    }
    assert_true(single > 40 && several > 5 && missed > 5);
    qw_env_destroy(env);
}

/* On one or two rows of cells with slanting sides between two curves, which alone are held: shortening one curve may
   shorten the other, and invert triangles between. No edge loses its length, no more triangles are inverted, and the
   area comes no farther from the bounds. */
static void does_no_harm(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    uint64_t seed = 9;
    uint32_t changed = 0;
    for (int i = 0; i < 400; i++) {
        qw_scope_begin(env);
        unit_lattice l = unit_lattice_make(env, 2, 1 + i / 2 % 2, seed | 1u);
        for (uint32_t v = 0; v < l.component.vertex_count; v++) {
            int32_t x = v % 3 ? l.place[v - 1].x + 1 + (int32_t)(random_bits(&seed) % 2) : 0;
            bool held = v < 3 || v / 3 == l.ny;
            if (held && v % 3 < 2) unit_lattice_hold(&l, v, v + 1, true);
            if (!held) l.place[v].y += (int32_t)(random_bits(&seed) % 2);
            l.place[v].x = x;
            l.position[v].x = (float)x + (float)(random_bits(&seed) % 100) / 50 - 1;
        }
        unit_lattice_fill(&l);
        qw_complex *c = &l.component.decimated.complex;
        qw_int2 *had = QW_NEW(env, qw_int2, c->edge_count);
        memcpy(had, c->d, c->edge_count * sizeof *had);
        double before = qw_complex_area(c), least = before + (i & 1 ? 1 : -1.5), most = least + 0.5, work = 1e6;
        uint32_t inverted = qw_complex_inverted(c);
        bool within = qw_nudge_area(env, c, least, most, &work);
        double area = qw_complex_area(c);
        assert_true(qw_complex_is_closed(c) && qw_complex_inverted(c) <= inverted);
        for (uint32_t e = 0; e < c->edge_count; e++) {
            if (had[e].x) assert_int_not_equal(c->d[e].x, 0);
            if (had[e].y) assert_int_not_equal(c->d[e].y, 0);
        }
        assert_int_equal(within, area >= least && area <= most);
        assert_true(fmax(least - area, area - most) <= fmax(least - before, before - most));
        changed += area != before;
        qw_scope_end(env);
    }
    assert_true(changed > 100);
    qw_env_destroy(env);
}

/* Nothing is shorter than a quad, nothing changes without work or where the area is right already. */
static void leaves_offsets(void **state)
{
    (void)state;
    static const struct {
        int32_t length;
        double least, most, work;
        bool within;
    } rows[] = {{1, 1, 3, 1e6, false}, {2, 20, 21, 0, false}, {2, 15, 16, 1e6, true}, {2, 16, 17, 1e6, true}};
    qw_env *env = qw_env_create(NULL, 1);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        qw_scope_begin(env);
        unit_lattice l = make_sheet(env, i);
        qw_complex *c = &l.component.decimated.complex;
        int32_t k = rows[i].length;
        set_places(&l, &(lengths){{k, k}, {k, k}});
        qw_int2 *d = QW_NEW(env, qw_int2, c->edge_count);
        memcpy(d, c->d, c->edge_count * sizeof *d);
        double work = rows[i].work;
        assert_int_equal(qw_nudge_area(env, c, rows[i].least, rows[i].most, &work), rows[i].within);
        assert_memory_equal(d, c->d, c->edge_count * sizeof *d);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

QW_TEST_SUITE(nudge)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(takes_the_cheapest_step), cmocka_unit_test(does_no_harm),
                                       cmocka_unit_test(leaves_offsets)};
    return cmocka_run_group_tests_name("nudge", tests, NULL, NULL);
}

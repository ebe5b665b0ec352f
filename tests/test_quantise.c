/* Closed real offsets by their optimality, the decimated complex by what it must keep, the layout by Eq. (3), acute
 * corners on a plate with a sharp tip. */
#include "suite.h"
#include "unit_shapes.h"

#include "remesh/quantise/closed.h"
#include "remesh/quantise/flatten.h"
#include "remesh/quantise/quantise.h"
#include "remesh/quantise/decimated.h"
#include "remesh/quantise/narrow_bands.h"
#include "remesh/quantise/acute_corners.h"

typedef struct solid {
    const char *name;
    qw_trimesh mesh;
    float rho;
    int euler;
} solid;

enum { SOLIDS = 5 };

static void make_solids(qw_env *env, solid *s)
{
    s[0] = (solid){"sphere", unit_sphere(env, 4), 0.2f, 2};
    s[1] = (solid){"cube", unit_cube(env, 4), 0.125f, 2};
    s[2] = (solid){"double torus", unit_double_torus(env, 2), 0.4f, -2};
    s[3] = (solid){"torus", unit_torus(env, 40, 24, 0.4f), 0.2f, 0};
    s[4] = (solid){"open cylinder", unit_cylinder(env, 40, 20, 2.0f), 0.2f, 0};
}

static float *stiffness_of(qw_env *env, const qw_offset_mesh *m)
{
    float *s = QW_NEW(env, float, m->edge_count);
    for (uint32_t e = 0; e < m->edge_count; e++) s[e] = 1;
    return s;
}

static qw_real2 sum_around(const qw_offset_mesh *m, const qw_real2 *d, uint32_t f)
{
    qw_real2 sum = {0, 0};
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        qw_real2 a = qw_turn_real(m->rot[h], d[m->edge[h]]);
        sum.x += a.x, sum.y += a.y;
    }
    return sum;
}

/* Eq. (3) holds, what is constrained stays 0, and moving any free vertex, which keeps Eq. (3), cannot lower the energy:
 * its derivative is 0. */
static void closed_offsets_are_the_closest(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    solid solids[SOLIDS];
    make_solids(env, solids);
    for (int i = 0; i < SOLIDS; i++) {
        qw_scope_begin(env);
        qw_offset_mesh m = unit_solve(env, solids[i].mesh, solids[i].rho, true).offsets;
        qw_closed_counts counts;
        qw_real2 *c = qw_closed_offsets(env, &m, 0, stiffness_of(env, &m), &counts);
        double open = 0, was_open = 0;
        for (uint32_t f = 0; f < m.face_count; f++) {
            qw_real2 now = sum_around(&m, c, f), before = sum_around(&m, m.real, f);
            open += (double)(now.x * now.x + now.y * now.y),
                was_open += (double)(before.x * before.x + before.y * before.y);
        }
        assert_true(open <= 3e-5 * was_open + 1e-6);
        for (uint32_t e = 0; e < m.edge_count; e++) {
            if (m.fixed[e] & QW_FIXED_X) assert_true(c[e].x == 0);
            if (m.fixed[e] & QW_FIXED_Y) assert_true(c[e].y == 0);
        }
        uint32_t *out = qw_offset_outgoing(env, &m);
        qw_star star = {0};
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            qw_star_at(env, &m, out[v], &star);
            if (!star.movable || m.constraint[v] || m.twin[out[v]] == QW_NONE) continue;
            double gx = 0, gy = 0, scale = 0;
            for (uint32_t k = 0; k < star.count; k++) {
                uint32_t h = star.out[k], e = m.edge[h];
                qw_real2 off = {c[e].x - m.real[e].x, c[e].y - m.real[e].y};
                qw_real2 g = qw_turn_real(m.rot[h] + 4u - star.turn[k], off);
                double w = 1 / fmax((double)(m.real[e].x * m.real[e].x + m.real[e].y * m.real[e].y), 0.0025);
                gx += w * (double)g.x, gy += w * (double)g.y, scale += w * 0.5;
            }
            assert_true(sqrt(gx * gx + gy * gy) <=
                        0.01 * scale); /* c is x less a combination of the rows, so this holds but for float */
        }
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* Mean angle, weighted by area, by which the lines of the crosses are turned where `own` edges become `closed` ones. */
static double mean_turn(const qw_offset_mesh *m, const qw_real2 *own, const qw_real2 *closed)
{
    double sum = 0, all = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h += 3) {
        uint32_t e = m->edge[h], f = m->edge[h + 1];
        qw_real2 a = qw_turn_real(m->rot[h], own[e]), b = qw_turn_real(m->rot[h + 1], own[f]),
                 c = qw_turn_real(m->rot[h], closed[e]), d = qw_turn_real(m->rot[h + 1], closed[f]);
        double area = (double)(a.x * b.y - a.y * b.x), xx = (double)(c.x * b.y - d.x * a.y),
               xy = (double)(d.x * a.x - c.x * b.x), yx = (double)(c.y * b.y - d.y * a.y),
               yy = (double)(d.y * a.x - c.y * b.x);
        if (!(area > 0)) continue;
        sum += area * (fabs(atan2(xy, xx)) + fabs(atan2(yx, yy))) / 2;
        all += area;
    }
    return sum / all;
}

/* Where sizes give way, offsets are closed as well, lines turn less, and the edges are wanted as they are stretched;
   where they don't, the edges stay as they are. */
static void sizes_give_way_to_directions(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    solid solids[SOLIDS];
    make_solids(env, solids);
    double plain = 0, given = 0;
    for (int i = 0; i < SOLIDS; i++) {
        qw_scope_begin(env);
        qw_offset_mesh m = unit_solve(env, solids[i].mesh, solids[i].rho, true).offsets;
        qw_real2 *own = QW_NEW(env, qw_real2, m.edge_count);
        memcpy(own, m.real, m.edge_count * sizeof *own);
        qw_closed_counts counts;
        plain += mean_turn(&m, own, qw_closed_offsets(env, &m, 0, stiffness_of(env, &m), &counts));
        assert_memory_equal(own, m.real, m.edge_count * sizeof *own);
        qw_real2 *c = qw_closed_offsets(env, &m, 1, stiffness_of(env, &m), &counts);
        given += mean_turn(&m, own, c);
        double open = 0, was_open = 0;
        for (uint32_t f = 0; f < m.face_count; f++) {
            qw_real2 now = sum_around(&m, c, f), before = sum_around(&m, own, f);
            open += (double)(now.x * now.x + now.y * now.y);
            was_open += (double)(before.x * before.x + before.y * before.y);
        }
        assert_true(open <= 3e-5 * was_open + 1e-6);
        for (uint32_t e = 0; e < m.edge_count; e++) {
            assert_true(m.real[e].x * own[e].x >= 0 && fabsf(m.real[e].x) <= 3 * fabsf(own[e].x));
            assert_true(m.real[e].y * own[e].y >= 0 && fabsf(m.real[e].y) <= 3 * fabsf(own[e].y));
        }
        qw_scope_end(env);
    }
    print_message("lines turn by %.2f degrees, and by %.2f where sizes give way\n", plain * 57.3, given * 57.3);
    assert_true(given < 0.92 * plain);
    qw_env_destroy(env);
}

static double det_of(const qw_complex *c, uint32_t f, bool whole)
{
    uint32_t h = 3 * f;
    if (whole) return qw_int2_det(qw_turn(c->rot[h], c->d[c->edge[h]]), qw_turn(c->rot[h + 1], c->d[c->edge[h + 1]]));
    qw_real2 a = qw_turn_real(c->rot[h], c->real[c->edge[h]]), b = qw_turn_real(c->rot[h + 1], c->real[c->edge[h + 1]]);
    return (double)a.x * (double)b.y - (double)a.y * (double)b.x;
}

/* The decimated complex has the surface's Euler number and area and little besides cones and corners; closed integers
   on it are closed on the surface, with the same area, and no constrained component moves. */
static void decimated_complex_stands_for_the_surface(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    solid solids[SOLIDS];
    make_solids(env, solids);
    for (int i = 0; i < SOLIDS; i++) {
        qw_scope_begin(env);
        qw_offset_mesh m = unit_solve(env, solids[i].mesh, solids[i].rho, true).offsets;
        qw_closed_counts counts;
        qw_real2 *c = qw_closed_offsets(env, &m, 0, stiffness_of(env, &m), &counts);
        qw_decimated s = qw_decimate(env, &m, c);
        uint8_t *left = QW_NEW_ZERO(env, uint8_t, m.vertex_count);
        uint32_t vertices = 0, needed = 0;
        for (uint32_t h = 0; h < 3 * s.complex.face_count; h++) {
            vertices += !left[s.corner[h]];
            left[s.corner[h]] = 1;
        }
        for (uint32_t v = 0; v < m.vertex_count; v++) {
            bool must_stay = m.index[v] != 0 || m.constraint[v] == 2;
            if (must_stay && m.constraint[v] == 2) assert_true(left[v]);
            needed += must_stay;
        }
        assert_int_equal((int)vertices - (int)s.complex.edge_count + (int)s.complex.face_count, solids[i].euler);
        assert_true(vertices <= needed + 12);
        double fine_area = 0, area = 0;
        for (uint32_t f = 0; f < m.face_count; f++) {
            qw_real2 a = qw_turn_real(m.rot[3 * f], c[m.edge[3 * f]]),
                     b = qw_turn_real(m.rot[3 * f + 1], c[m.edge[3 * f + 1]]);
            fine_area += (double)a.x * (double)b.y - (double)a.y * (double)b.x;
        }
        for (uint32_t f = 0; f < s.complex.face_count; f++) area += det_of(&s.complex, f, false);
        assert_true(fabs(area - fine_area) <= 0.01 * fine_area);
        qw_regular_counts regular = {0};
        assert_true(qw_solve_complex(env, &s.complex, NULL, QW_FLOW_MCF, QW_COST_SQUARE, true, NULL, &regular));
        qw_decimated_expand(&s, s.complex.d, m.d);
        int64_t whole = 0;
        for (uint32_t f = 0; f < s.complex.face_count; f++) whole += (int64_t)det_of(&s.complex, f, true);
        qw_offset_counts after = qw_offset_count(&m);
        assert_int_equal(after.irregular_triangles, 0);
        assert_int_equal(after.double_area, whole);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* All length on few edges is a valid start: the layout spreads it out, keeps Eq. (3) and the constrained components,
 * and leaves next to nothing inverted. */
static void quantises_to_the_count(void **state)
{
    (void)state;
    static const double wanted[] = {300, 700, 2000};
    qw_env *env = qw_env_create(NULL, 2);
    solid solids[SOLIDS];
    make_solids(env, solids);
    for (int i = 0; i < SOLIDS; i++)
        for (int k = 0; k < 3; k++) {
            qw_scope_begin(env);
            qw_offset_mesh m = unit_solve(env, solids[i].mesh, solids[i].rho, true).offsets;
            qw_quantise_counts counts = qw_quantise(env, &m, &(qw_quantise_request){.quads = wanted[k], .times = 1});
            qw_offset_counts after = qw_offset_count(&m);
            qw_offset_validate(env, &m);
            assert_int_equal(after.irregular_triangles, 0);
            double off = (double)after.double_area / 2 / wanted[k] - 1;
            if (fabs(off) > (wanted[k] < 500 ? 0.05 : 0.02))
                fail_msg("%s: %.0f quads asked for, off by %.3f", solids[i].name, wanted[k], off);
            assert_true(after.inverted_triangles <= m.face_count / 100);
            assert_true(counts.energy < 0.15 && counts.tries > 0);
            qw_scope_end(env);
        }
    qw_env_destroy(env);
}

/* The layout is the same wherever vertices start from, also where the right-hand side is nearly all that of a few
   edges: of stiff ones here, of long ones on a surface of millions of quads. */
static void lays_out_from_afar(void **state)
{
    (void)state;
    enum { FAR = 40 };
    qw_env *env = qw_env_create(NULL, 2);
    qw_offset_mesh m = unit_solve(env, unit_sphere(env, 4), 0.2f, true).offsets;
    qw_quantise(env, &m, &(qw_quantise_request){.quads = 700, .times = 1});
    qw_flatten_counts near, far;
    float *stiffness = stiffness_of(env, &m);
    stiffness[0] = 1e4f;
    qw_flatten(env, &m, stiffness, &near);
    uint32_t *out = qw_offset_outgoing(env, &m);
    uint64_t random = 3;
    qw_star star = {0};
    for (uint32_t v = 0; v < m.vertex_count; v++) {
        qw_star_at(env, &m, out[v], &star);
        random_step(&random);
        qw_int2 step = {(int32_t)(random >> 32) % FAR, (int32_t)(random >> 40) % FAR};
        if (star.movable && m.constraint[v] == QW_VERTEX_FREE) qw_star_move(&m, &star, step);
    }
    qw_flatten(env, &m, stiffness, &far);
    qw_offset_counts after = qw_offset_count(&m);
    assert_true(after.irregular_triangles == 0 && after.inverted_triangles <= m.face_count / 100);
    assert_true(far.energy < near.energy + 0.002);
    qw_env_destroy(env);
}

/* A cube with cones at its corners is a box of a x b x c quads: no box of like sides has a count much nearer to the one
 * asked for. */
static void cubes_are_boxes(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 2);
    for (double wanted = 100; wanted < 3000; wanted *= 1.13) {
        qw_scope_begin(env);
        unit_fields u = unit_solve(env, unit_cube(env, 3), 0.1f, true);
        qw_offset_input in = {&u.mesh,      u.normal,    NULL, u.orientation, u.size,
                              u.constraint, u.direction, NULL, true,          true};
        qw_offset_mesh m = qw_integer_offsets(env, &in);
        qw_quantise(env, &m, &(qw_quantise_request){.quads = wanted, .times = 1});
        qw_offset_counts after = qw_offset_count(&m);
        assert_int_equal(after.irregular_triangles, 0);
        double quads = (double)after.double_area / 2, nearest = INFINITY;
        int side = (int)sqrt(wanted / 6);
        bool is_box = false;
        for (int a = side - 1; a <= side + 3; a++)
            for (int b = a; b <= side + 3; b++)
                for (int c = b; c <= side + 3; c++) {
                    double box = 2.0 * (a * b + b * c + c * a);
                    if (a >= side && c <= side + 1) nearest = fmin(nearest, fabs(box / wanted - 1));
                    is_box |= box == quads;
                }
        if (!is_box || fabs(quads / wanted - 1) > nearest + 1e-9)
            fail_msg("%.0f quads wanted, %.0f made", wanted, quads);
        qw_scope_end(env);
    }
    qw_env_destroy(env);
}

/* A flat sector of `angle` with radius 1, both straight sides and the arc constrained as boundary; the tip is vertex 0.
 */
static qw_trimesh sector(qw_env *env, uint32_t rings, uint32_t spokes, float angle)
{
    qw_trimesh m = unit_mesh(env, 1 + rings * (spokes + 1), spokes + 2 * (rings - 1) * spokes);
    uint32_t f = 0;
    m.position[0] = qw_v3(0, 0, 0);
    for (uint32_t r = 0; r < rings; r++)
        for (uint32_t s = 0; s <= spokes; s++) {
            float a = angle * (float)s / (float)spokes, radius = (float)(r + 1) / (float)rings;
            m.position[1 + r * (spokes + 1) + s] = qw_v3(radius * cosf(a), radius * sinf(a), 0);
        }
    for (uint32_t s = 0; s < spokes; s++) {
        unit_face(&m, f++, 0, 1 + s, 2 + s);
        for (uint32_t r = 0; r + 1 < rings; r++) {
            uint32_t a = 1 + r * (spokes + 1) + s, b = a + spokes + 1;
            unit_face(&m, f++, a, b, b + 1);
            unit_face(&m, f++, a, b + 1, a + 1);
        }
    }
    qw_trimesh_link(env, &m);
    return m;
}

/* Two curves inside a disc that leave its centre at `angle`. */
static qw_offset_mesh two_curves(qw_env *env, float angle, uint32_t rings)
{
    enum { SPOKES = 48 };
    qw_trimesh m = sector(env, rings, SPOKES, 6.0f);
    uint32_t second = (uint32_t)lroundf(angle / 6.0f * SPOKES);
    for (uint32_t h = 0; h < 3 * m.face_count; h++) {
        uint32_t a = m.corner[h], b = m.corner[qw_next(h)];
        uint32_t sa = a ? (a - 1) % (SPOKES + 1) : QW_NONE, sb = b ? (b - 1) % (SPOKES + 1) : QW_NONE;
        uint32_t along = sa == QW_NONE ? sb : sb == QW_NONE || sa == sb ? sa : QW_NONE;
        if (along == 10 || along == 10 + second) m.mark[h] |= QW_MARK_FEATURE;
    }
    return unit_solve(env, m, 0.1f, false).offsets;
}

/* An acute corner is let go as far as no quad fits, a right angle is not. */
static int64_t released_at(qw_env *env, float angle)
{
    enum { RINGS = 20 };
    qw_offset_mesh o = two_curves(env, angle, RINGS);
    int64_t constrained = 0;
    for (uint32_t e = 0; e < o.edge_count; e++) constrained += o.fixed[e] != 0;
    assert_int_equal(constrained, 2 * RINGS);
    return qw_release_acute_corners(env, &o, NULL);
}

static void acute_corners_are_let_go(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_scope_begin(env);
    int64_t narrow = released_at(env, 0.375f), right = released_at(env, 1.5f);
    assert_true(narrow >= 2 && narrow <= 8); /* one side, as far as they are 0.07 apart: a fifth of 20 edges */
    assert_int_equal(right, 0);
    qw_scope_end(env);
    qw_env_destroy(env);
}

/* An acute corner is stretched where it is narrow, but not at its tip, where that would have no bound. */
static void tips_are_not_stretched(void **state)
{
    (void)state;
    qw_env *env = qw_env_create(NULL, 1);
    qw_offset_mesh o = two_curves(env, 0.375f, 20), before = qw_offset_copy(env, &o);
    assert_true(qw_stretch_narrow_bands(env, &o, 300) > 0);
    uint32_t at_tip = 0;
    for (uint32_t e = 0; e < o.edge_count; e++) {
        uint32_t h = o.half[e];
        if (o.corner[h] != 0 && o.corner[qw_next(h)] != 0) continue;
        assert_true(o.real[e].x == before.real[e].x && o.real[e].y == before.real[e].y);
        at_tip++;
    }
    assert_int_equal(at_tip, 49);
    qw_env_destroy(env);
}

/* A plate of unit sides whose rim is a third of an edge high: across it, offsets add up to one edge; elsewhere they
 * stay. */
static void narrow_bands_are_stretched(void **state)
{
    (void)state;
    const float rho = 0.25f, height = rho / 3;
    qw_env *env = qw_env_create(NULL, 1);
    qw_trimesh cube = unit_cube(env, 2), plate = unit_cube(env, 2); /* sides of four edges: the rim has four rows */
    for (uint32_t v = 0; v < plate.vertex_count; v++) plate.position[v].z *= height;
    qw_offset_mesh thick = unit_solve(env, cube, rho, false).offsets, thin = unit_solve(env, plate, rho, false).offsets;
    double area = 2 / ((double)rho * (double)rho);
    assert_int_equal(qw_stretch_narrow_bands(env, &thick, 3 * area), 0);
    qw_offset_mesh before = qw_offset_copy(env, &thin);
    int64_t count = qw_stretch_narrow_bands(
        env, &thin, area + 4 / (double)rho); /* a quad an edge along the rim: nothing is scaled */
    assert_int_equal(count, 4 * 2 * 4 * 4);  /* those at the plate's corners too, where the crosses lie askew */
    uint32_t across = 0, stretched = 0, flat = 0;
    for (uint32_t e = 0; e < thin.edge_count; e++) {
        uint32_t a = thin.corner[thin.half[e]], b = thin.corner[qw_next(thin.half[e])];
        qw_vec3 d = qw_sub(thin.position[b], thin.position[a]);
        double length = sqrt((double)(thin.real[e].x * thin.real[e].x + thin.real[e].y * thin.real[e].y));
        if (fabsf(d.x) + fabsf(d.y) < 1e-6f) {
            stretched += fabs(4 * length - 1) < 0.1; /* one of four steps up */
            across++;
        } else if (fabsf(d.z) < 1e-6f && thin.constraint[a] == 0 && thin.constraint[b] == 0 &&
                   fabsf(thin.normal[a].z) > 0.9f && fabsf(thin.normal[b].z) > 0.9f) {
            assert_true(thin.real[e].x == before.real[e].x && thin.real[e].y == before.real[e].y);
            flat++;
        }
    }
    assert_true(across == 4 * 4 * 4 && stretched >= across * 3 / 4 && flat >= 2 * 4);
    qw_env_destroy(env);
}

QW_TEST_SUITE(quantise)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_offsets_are_the_closest),
        cmocka_unit_test(sizes_give_way_to_directions),
        cmocka_unit_test(decimated_complex_stands_for_the_surface),
        cmocka_unit_test(quantises_to_the_count),
        cmocka_unit_test(lays_out_from_afar),
        cmocka_unit_test(cubes_are_boxes),
        cmocka_unit_test(acute_corners_are_let_go),
        cmocka_unit_test(narrow_bands_are_stretched),
        cmocka_unit_test(tips_are_not_stretched),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

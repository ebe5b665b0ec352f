/* Creases of parts that were sampled on a grid are found where they are, and nothing else is. */
#include "suite.h"

#include "run/driver.h"
#include "sampled.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "shape_context.h"

/* Edge of 2,000 quads on the parts: 0.042 to 0.053. */
static const double EDGE = 0.045;

/* Corners where three creases meet; irregular vertices that the exact part has at some count. */
static const struct {
    uint32_t corners, irregular;
} known[PARTS] = {[PART_STEP] = {12, 12},   [PART_ANGLE] = {12, 12}, [PART_BRACKET] = {12, 20},
                  [PART_CYLINDER] = {0, 8}, [PART_WEDGE] = {6, 8},   [PART_PRISM] = {12, 16}};

typedef struct lines {
    double worst, mean, length; /* distance from the true creases; length of all; in the input's coordinates */
    double far;                 /* share of the edges beyond 0.15 edges of 2,000 quads */
    uint32_t corners, ends;
} lines;

static void from_frame(const qw_frame *f, qw_vec3 p, double *to)
{
    to[0] = (double)p.x / f->scale + f->center[0], to[1] = (double)p.y / f->scale + f->center[1];
    to[2] = (double)p.z / f->scale + f->center[2];
}

/* far: in the input's coordinates. */
static lines measure_lines(const qw_run_state *run, const part *truth, double far)
{
    const qw_trimesh *m = &run->surface;
    lines l = {0};
    uint32_t *degree = calloc(m->vertex_count, sizeof *degree), edges = 0;
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (!m->mark[h] || !qw_stands_for_edge(m, h)) continue;
        double a[3], b[3];
        from_frame(&run->clean.frame, m->position[m->corner[h]], a);
        from_frame(&run->clean.frame, m->position[m->corner[qw_next(h)]], b);
        double off = truth->segments ? part_off_crease(truth, a) : 0;
        l.worst = fmax(l.worst, off), l.mean += off, l.far += off > far, edges++;
        l.length += sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
        degree[m->corner[h]]++, degree[m->corner[qw_next(h)]]++;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) l.ends += degree[v] == 1, l.corners += degree[v] > 2;
    l.mean /= edges ? edges : 1, l.far /= edges ? edges : 1;
    free(degree);
    return l;
}

static double true_length(const part *truth)
{
    double sum = 0;
    for (int i = 0; i < truth->segments; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++) {
            double d = truth->segment[i][1][k] - truth->segment[i][0][k];
            square += d * d;
        }
        sum += sqrt(square);
    }
    return sum;
}

/* worst: most distance of a line from the true crease, in cells of the grid; a quad of 2,000 has 1.3 of 60. */
static void assert_lines(const shape *s, part_name name, int n, double worst)
{
    part truth = part_of(name);
    qw_context *context = context_of(s, 2000, QW_STAGE_SURFACE);
    const qw_run_state *run = &((qw_context_state *)context)->run;
    qw_trimesh_validate(run->env, &run->surface);
    lines l = measure_lines(run, &truth, 0.15 * EDGE);
    double length = true_length(&truth);
    assert_true(l.worst < worst * 2 / n && l.mean < 0.1 * 2 / n && l.far < 0.05);
    assert_true(fabs(l.length - length) < 0.03 * length);
    assert_int_equal(l.ends, 0);
    assert_int_equal(l.corners, known[name].corners);
    qw_destroy(context), part_free(&truth);
}

static void lines_lie_on_the_creases(void **state)
{
    (void)state;
    for (int how = 0; how < SAMPLED_HOWS; how++)
        for (part_name name = 0; name < PARTS; name++) {
            if (name == PART_WEDGE) continue;
            int n = how == MARCHING_TETRAHEDRA ? 44 : 58;
            shape s = sampled_part(name, n, (sampled_how)how, 0);
            assert_lines(&s, name, n, 0.4);
            shape_free(&s);
        }
}

/* An edge of 34 degrees, which a grid cuts off by more than a cell. */
static void acute_creases_come_back(void **state)
{
    (void)state;
    shape s = sampled_part(PART_WEDGE, 60, SURFACE_NETS, 0);
    assert_lines(&s, PART_WEDGE, 60, 1);
    shape_free(&s);
}

static void noise_leaves_them_straight(void **state)
{
    (void)state;
    static const part_name names[] = {PART_STEP, PART_BRACKET, PART_PRISM};
    for (int i = 0; i < 3; i++) {
        shape s = sampled_part(names[i], 57, MARCHING_CUBES, 0.1);
        assert_lines(&s, names[i], 57, 0.8);
        shape_free(&s);
    }
}

static void quads_are_those_of_the_exact_part(void **state)
{
    (void)state;
    static const part_name names[] = {PART_STEP, PART_BRACKET, PART_CYLINDER};
    for (int i = 0; i < 3; i++) {
        shape s = sampled_part(names[i], 60, SURFACE_NETS, 0);
        qw_mesh_view view = shape_view(&s);
        qw_options options;
        qw_options_init(&options);
        options.adaptive = 0;
        for (options.faces = 1000; options.faces <= 4000; options.faces *= 2) {
            qw_result *result;
            assert_int_equal(qw_remesh(&view, &options, NULL, &result), QW_OK);
            assert_int_equal(qw_result_report(result)->topology.irregular, known[names[i]].irregular);
            qw_result_destroy(result);
        }
        shape_free(&s);
    }
}

static int64_t edges_found(const shape *s, int64_t faces)
{
    qw_context *context = context_of(s, faces, QW_STAGE_SURFACE);
    int64_t count = ((qw_context_state *)context)->report.feature_edges;
    qw_destroy(context);
    return count;
}

/* Whether the surface was cut along creases. */
static bool was_cut(const shape *s, int64_t faces)
{
    qw_context *context = context_of(s, faces, QW_STAGE_SURFACE);
    const qw_run_state *run = &((qw_context_state *)context)->run;
    bool cut = run->surface.vertex_count > run->core.mesh.vertex_count;
    qw_destroy(context);
    return cut;
}

static void round_things_have_none(void **state)
{
    (void)state;
    for (part_name name = PART_BALL; name < ALL_PARTS; name++)
        for (int how = 0; how < SAMPLED_HOWS; how++)
            for (int noise = 0; noise < 2; noise++) {
                shape s = sampled_part(name, 45, (sampled_how)how, 0.1 * noise);
                assert_false(was_cut(&s, 200));
                assert_false(was_cut(&s, 3000));
                if (how == SURFACE_NETS) assert_int_equal(edges_found(&s, 1000), 0);
                shape_free(&s);
            }
}

static bool in_ball(int x, int y, int z)
{
    int a = 2 * x - 23, b = 2 * y - 23, c = 2 * z - 23;
    return a * a + b * b + c * c < 23 * 23;
}

/* Stairs that were smoothed, and exact creases, of which nothing is moved. */
static void stairs_and_exact_edges_stay(void **state)
{
    (void)state;
    shape ball = shape_of_cells(24, 24, 24, 1, in_ball), box = shape_of_cells(1, 1, 1, 20, shape_all);
    assert_int_equal(edges_found(&ball, 300), 0);
    shape_smooth(&ball, 1);
    assert_int_equal(edges_found(&ball, 300), 0);
    assert_int_equal(edges_found(&box, 1000), 12 * 20);
    shape_free(&ball), shape_free(&box);
}

/* A cup whose wall has folds, as thick as a fifth of a triangle: its outer wall, rim, inner wall, rim. u goes around
 * it, v down the outer wall and up the inner one. */
typedef struct cup {
    int flutes, rows; /* rows: of each wall */
    double depth, thickness;
} cup;

static const cup *the_cup; /* that shape_of_sheet is asked for */

static void cup_middle(double u, double height, double p[2])
{
    double a = 6.283185307179586 * u;
    double r = 0.45 + 0.15 * sin(3 * height) + the_cup->depth * cos(the_cup->flutes * a);
    p[0] = r * cos(a), p[1] = r * sin(a);
}

static void at_cup(double u, double v, double p[3])
{
    int count = 2 * the_cup->rows + 2, row = (int)floor(v * count + 0.5);
    bool outside = row <= the_cup->rows;
    double height = 1 - (double)(outside ? row : count - 1 - row) / the_cup->rows, q[2], from[2], to[2];
    cup_middle(u, height, q), cup_middle(u - 1e-4, height, from), cup_middle(u + 1e-4, height, to);
    double x = to[1] - from[1], y = from[0] - to[0], off = (outside ? 0.5 : -0.5) * the_cup->thickness / hypot(x, y);
    p[0] = q[0] + off * x, p[1] = q[1] + off * y, p[2] = 1.2 * height;
}

static bool cup_is_cut(const cup *c, int columns)
{
    the_cup = c;
    shape s = shape_of_sheet(&(shape_sheet){columns, 2 * c->rows + 2, true, true, false, at_cup});
    bool cut = was_cut(&s, 2000);
    shape_free(&s);
    return cut;
}

/* Their rims are exact; folds with too few columns are cut off like creases, but the rims would be cut too. */
static void folds_of_thin_shells_stay(void **state)
{
    (void)state;
    assert_false(cup_is_cut(&(cup){7, 28, 0.06, 0.01}, 67));
    assert_false(cup_is_cut(&(cup){7, 28, 0.06, 0.03}, 67));
    assert_false(cup_is_cut(&(cup){12, 60, 0.06, 0.01}, 144));
    assert_false(cup_is_cut(&(cup){12, 80, 0.0417, 0.02}, 96));
}

/* Cut open: creases reach the boundary, which stays as it is. */
static void creases_end_at_the_boundary(void **state)
{
    (void)state;
    shape s = sampled_part(PART_ANGLE, 57, MARCHING_CUBES, 0);
    uint32_t kept = 0;
    for (uint32_t f = 0; f < s.face_count; f++) {
        const uint32_t *c = s.corner + 3 * (size_t)f;
        bool keep = true;
        for (int i = 0; i < 3; i++) keep = keep && s.position[3 * (size_t)c[i]] < 0.25;
        if (keep) memmove(s.corner + 3 * (size_t)kept++, c, 3 * sizeof *c);
    }
    s.face_count = kept;
    qw_context *context = context_of(&s, 1000, QW_STAGE_SURFACE);
    const qw_run_state *run = &((qw_context_state *)context)->run;
    const qw_trimesh *m = &run->surface;
    qw_trimesh_validate(run->env, m);
    uint32_t *degree = calloc(m->vertex_count, sizeof *degree), ends = 0;
    bool *open = calloc(m->vertex_count, sizeof *open);
    for (uint32_t h = 0; h < 3 * m->face_count; h++) {
        if (m->twin[h] == QW_NONE) open[m->corner[h]] = open[m->corner[qw_next(h)]] = true;
        if (m->mark[h]) degree[m->corner[h]]++;
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        if (degree[v] != 1) continue;
        assert_true(open[v]);
        ends++;
    }
    assert_true(ends >= 4 && run->surface_census.boundary_loops == run->clean_census.boundary_loops);
    free(degree), free(open);
    qw_destroy(context), shape_free(&s);
}

QW_TEST_SUITE(sampled)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_lie_on_the_creases),   cmocka_unit_test(acute_creases_come_back),
        cmocka_unit_test(noise_leaves_them_straight), cmocka_unit_test(quads_are_those_of_the_exact_part),
        cmocka_unit_test(round_things_have_none),     cmocka_unit_test(stairs_and_exact_edges_stay),
        cmocka_unit_test(folds_of_thin_shells_stay),  cmocka_unit_test(creases_end_at_the_boundary),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* What a caller steers: a cross field of their own, lines on the surface, a rim that stays. Each is judged by what it
 * does to the quads. */
#include "suite.h"
#include "shapes.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

static const double DEGREE = 6.283185307179586 / 360;

static qw_context *context_with(const qw_mesh_view *view)
{
    qw_context *context;
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, view), QW_OK);
    return context;
}

static void run(qw_context *context, int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces, options.symmetry = 0; /* which no field of one side would have */
    if (qw_run(context, &options) != QW_OK) fail_msg("%s", qw_message(context));
}

/* ---- cross fields */

/* The tangent of the torus at p that is turned by an angle from the direction around its axis. */
static void turned_tangent(const double p[3], double angle, float d[3])
{
    double a = atan2(p[1], p[0]), b = atan2(p[2], hypot(p[0], p[1]) - 1);
    double around[3] = {-sin(a), cos(a), 0}, along[3] = {-sin(b) * cos(a), -sin(b) * sin(a), cos(b)};
    for (int k = 0; k < 3; k++) d[k] = (float)(cos(angle) * around[k] + sin(angle) * along[k]);
}

/* float[elements][3], the caller's to free. */
static float *turned_field(const shape *s, qw_domain domain, double angle)
{
    uint32_t count = domain == QW_PER_FACE ? s->face_count : s->vertex_count;
    float *d = malloc(3 * count * sizeof *d);
    for (uint32_t e = 0; e < count; e++) {
        double p[3] = {0, 0, 0};
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                p[k] += s->position[3 * (domain == QW_PER_FACE ? s->corner[3 * e + (uint32_t)i] : e) + (uint32_t)k] / 3;
        turned_tangent(p, angle, d + 3 * e);
    }
    return d;
}

/* Mean angle, in degrees, of the edges of the quads to the turned tangents. */
static double angle_to_turned(const qw_mesh_view *quads, double angle)
{
    double sum = 0;
    for (size_t h = 0; h < 4 * (size_t)quads->face_count; h++) {
        const double *a = quads->positions + 3 * (size_t)quads->corners[h],
                     *b = quads->positions + 3 * (size_t)quads->corners[h % 4 == 3 ? h - 3 : h + 1];
        double middle[3], dot = 0, length = 0;
        float d[3];
        for (int k = 0; k < 3; k++) middle[k] = (a[k] + b[k]) / 2;
        turned_tangent(middle, angle, d);
        for (int k = 0; k < 3; k++) dot += (b[k] - a[k]) * (double)d[k], length += (b[k] - a[k]) * (b[k] - a[k]);
        double off = acos(fmin(fabs(dot) / sqrt(length), 1)) / DEGREE;
        sum += fmin(off, 90 - off);
    }
    return sum / (4.0 * quads->face_count);
}

/* Without a field quads run around a torus and along it; with one at 30 degrees to that they don't. */
static void quads_follow_a_field(void **state)
{
    (void)state;
    shape s = shape_torus(16);
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    run(context, 800);
    qw_get_mesh(context, &quads);
    assert_true(angle_to_turned(&quads, 0) < 4 && angle_to_turned(&quads, 30 * DEGREE) > 24);
    assert_true(qw_get_report(context)->field_angle < 0);
    for (int i = 0; i < 2; i++) {
        qw_domain domain = i ? QW_PER_FACE : QW_PER_VERTEX;
        qw_cross_field field = {sizeof field, domain, i ? s.face_count : s.vertex_count,
                                turned_field(&s, domain, 30 * DEGREE)};
        assert_int_equal(qw_set_field(context, &field), QW_OK);
        run(context, 800);
        qw_get_mesh(context, &quads);
        double off = angle_to_turned(&quads, 30 * DEGREE);
        assert_true(off < 5);
        assert_true(fabs(qw_get_report(context)->field_angle - off) < 3);
        free((void *)field.directions);
    }
    assert_int_equal(qw_set_field(context, NULL), QW_OK);
    run(context, 800);
    qw_get_mesh(context, &quads);
    assert_true(angle_to_turned(&quads, 0) < 4);
    qw_destroy(context);
    shape_free(&s);
}

/* A field that says nothing but in one place bends the quads there. */
static void a_field_may_be_silent(void **state)
{
    (void)state;
    shape s = shape_torus(16);
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    float *d = turned_field(&s, QW_PER_VERTEX, 30 * DEGREE);
    for (uint32_t v = 0; v < s.vertex_count; v++)
        if (s.position[3 * v] < 0.9) d[3 * v] = d[3 * v + 1] = d[3 * v + 2] = 0;
    qw_cross_field field = {sizeof field, QW_PER_VERTEX, s.vertex_count, d};
    assert_int_equal(qw_set_field(context, &field), QW_OK);
    run(context, 800);
    qw_get_mesh(context, &quads);
    double near = 0, edges = 0;
    for (uint32_t f = 0; f < quads.face_count; f++) {
        if (quads.positions[3 * quads.corners[4 * f]] < 1.1) continue;
        qw_mesh_view one = {sizeof one, quads.vertex_count,    1,    4, quads.positions,
                            NULL,       quads.corners + 4 * f, NULL, 0};
        near += angle_to_turned(&one, 30 * DEGREE), edges++;
    }
    assert_true(edges > 20 && near / edges < 12); /* more than 24 without it */
    qw_destroy(context);
    free(d), shape_free(&s);
}

static void copy_file(const char *path, char **bytes, size_t *size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *size = (size_t)ftell(file);
    rewind(file);
    *bytes = malloc(*size + 1);
    assert_int_equal(fread(*bytes, 1, *size, file), *size);
    fclose(file);
}

/* A field found by one run steers another, which tells the same bytes and has the same singularities. */
static void a_field_comes_back(void **state)
{
    (void)state;
    static const char *const path[] = {QW_BINARY_DIR "/field-1.rosy", QW_BINARY_DIR "/field-2.rosy"};
    shape s = shape_double_torus(6);
    qw_mesh_view view = shape_view(&s);
    for (int i = 0; i < 2; i++) {
        qw_domain domain = i ? QW_PER_FACE : QW_PER_VERTEX;
        qw_context *first = context_with(&view), *second = context_with(&view);
        char *bytes[2];
        size_t size[2];
        run(first, 900);
        assert_int_equal(qw_save_field(first, domain, path[0]), QW_OK);
        if (qw_load_field(second, path[0]) != QW_OK) fail_msg("%s", qw_message(second));
        run(second, 900);
        assert_int_equal(qw_save_field(second, domain, path[1]), QW_OK);
        for (int k = 0; k < 2; k++) copy_file(path[k], &bytes[k], &size[k]);
        assert_int_equal(size[0], size[1]);
        assert_memory_equal(bytes[0], bytes[1], size[0]);
        const qw_report *a = qw_get_report(first), *b = qw_get_report(second);
        assert_true(llabs((long long)(a->orientation_singularities - b->orientation_singularities)) <= 2);
        assert_true(b->field_angle >= 0 && b->field_angle < 7);
        free(bytes[0]), free(bytes[1]);
        qw_destroy(first), qw_destroy(second);
    }
    shape_free(&s);
}

static void face_normal(const shape *s, uint32_t f, double n[3])
{
    const double *p[3];
    double a[3], b[3], length = 0;
    for (int i = 0; i < 3; i++) p[i] = s->position + 3 * (size_t)s->corner[3 * (size_t)f + (size_t)i];
    for (int k = 0; k < 3; k++) a[k] = p[1][k] - p[0][k], b[k] = p[2][k] - p[0][k];
    for (int k = 0; k < 3; k++) n[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    for (int k = 0; k < 3; k++) length += n[k] * n[k];
    for (int k = 0; k < 3; k++) n[k] /= sqrt(length);
}

/* Every direction is a unit tangent: on faces exactly, at vertices as far as anybody's normals agree. */
static void directions_are_unit_tangents(void **state)
{
    (void)state;
    shape s = shape_sphere(8);
    qw_mesh_view view = shape_view(&s);
    qw_context *context = context_with(&view);
    qw_cross_field field;
    assert_int_equal(qw_get_field(context, QW_PER_FACE, &field), QW_NOT_READY);
    run(context, 400);
    assert_int_equal(qw_get_field(context, QW_PER_CORNER, &field), QW_ARGUMENT);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(qw_get_field(context, i ? QW_PER_FACE : QW_PER_VERTEX, &field), QW_OK);
        assert_int_equal(field.count, i ? s.face_count : s.vertex_count);
        for (uint32_t e = 0; e < field.count; e++) {
            double n[3], length = 0, dot = 0;
            const float *d = field.directions + 3 * e;
            if (i) face_normal(&s, e, n);
            else memcpy(n, s.position + 3 * (size_t)e, sizeof n);
            for (int k = 0; k < 3; k++) length += (double)(d[k] * d[k]), dot += (double)d[k] * n[k];
            assert_true(fabs(length - 1) < 1e-5 && fabs(dot) < (i ? 1e-5 : 0.06));
        }
    }
    qw_destroy(context);
    shape_free(&s);
}

static void write_text(const char *path, const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

static void wrong_fields_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        qw_status status;
        const char *says;
    } rows[] = {{"", QW_FILE_EMPTY, "empty"},
                {"4\n", QW_FORMAT_TRUNCATED, "number of directions"},
                {"4\n6\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n", QW_FORMAT_SYNTAX, "6 directions"},
                {"4\n4\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n", QW_ARGUMENT, "does not say which"},
                {"3\n4\n1 0 0\n1 0 0\n1 0 0\n", QW_ARGUMENT, "3 elements"},
                {"3\n4\n1 0 0\n1 0 0\n1 0 0\n# per face\n", QW_ARGUMENT, "4 faces"},
                {"4\n4\n1 0 0\n1 0 0\nnan 0 0\n1 0 0\n# per vertex\n", QW_NOT_FINITE, "element 2"},
                {"4\n4\n1 0 0\n1 0 0\n1 0 x\n1 0 0\n# per vertex\n", QW_FORMAT_SYNTAX, "\"x\""},
                {"4\n4\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n# per vertex\n", QW_FORMAT_SYNTAX, "goes on"},
                {"4\n4\n1 0 0\n1 0 0\n1 0 0\n1 0 0\n# per vertex\n# per face\n", QW_FORMAT_SYNTAX, "goes by one"},
                {"900000000\n4\n1 0 0\n", QW_FORMAT_TRUNCATED, "900000000"},
                {"4\n4\n0 0 1\n1 0 0\n1 0 0\n1 0 0\n# per face\n", QW_ARGUMENT, "face 0 stands"},
                {"4\n4\n1 0 0\n1 0 0\n0 0 0\n0 1 0\n# per vertex\n", QW_OK, ""}};
    shape s = shape_tetrahedron(1);
    qw_mesh_view view = shape_view(&s);
    qw_context *context = context_with(&view);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        write_text(QW_BINARY_DIR "/wrong.rosy", rows[i].text);
        qw_status status = qw_load_field(context, QW_BINARY_DIR "/wrong.rosy");
        if (status != rows[i].status || !strstr(qw_message(context), rows[i].says))
            fail_msg("row %zu: status %s, \"%s\"", i, qw_status_name(status), qw_message(context));
    }
    float d[12] = {NAN};
    qw_cross_field field = {sizeof field, QW_PER_VERTEX, 4, d};
    assert_int_equal(qw_set_field(context, &field), QW_NOT_FINITE);
    d[0] = 1, field.size = 1;
    assert_int_equal(qw_set_field(context, &field), QW_ARGUMENT);
    field.size = sizeof field, field.domain = QW_PER_CORNER;
    assert_int_equal(qw_set_field(context, &field), QW_ARGUMENT);
    field.domain = QW_PER_FACE, field.count = 5;
    assert_int_equal(qw_set_field(context, &field), QW_ARGUMENT);
    qw_destroy(context);
    shape_free(&s);
}

/* ---- guides */

enum { AROUND = 48 };

/* The parallel of the unit sphere at that height, off it by a factor. */
static void parallel(double z, double factor, double p[AROUND][3])
{
    for (int i = 0; i < AROUND; i++) {
        double a = 360 * DEGREE * i / AROUND, r = sqrt(1 - z * z);
        p[i][0] = factor * r * cos(a), p[i][1] = factor * r * sin(a), p[i][2] = factor * z;
    }
}

/* Edges of the quads whose ends both lie within a tenth of a mean edge of the parallel, and the largest distance of
   their middles, in mean edges. Every vertex on it must have two of them. */
static uint32_t edges_on_parallel(const qw_mesh_view *quads, double mean, double z, double *farthest)
{
    uint32_t on = 0, *degree = calloc(quads->vertex_count, sizeof *degree);
    *farthest = 0;
    for (size_t h = 0; h < 4 * (size_t)quads->face_count; h++) {
        uint32_t v[2] = {quads->corners[h], quads->corners[h % 4 == 3 ? h - 3 : h + 1]};
        double off[3];
        for (int i = 0; i < 3; i++) {
            double p[3];
            for (int k = 0; k < 3; k++)
                p[k] = i < 2
                           ? quads->positions[3 * v[i] + (uint32_t)k]
                           : (quads->positions[3 * v[0] + (uint32_t)k] + quads->positions[3 * v[1] + (uint32_t)k]) / 2;
            off[i] = hypot(hypot(p[0], p[1]) - sqrt(1 - z * z), p[2] - z) / mean;
        }
        if (off[0] > 0.1 || off[1] > 0.1) continue;
        *farthest = fmax(*farthest, fmax(fmax(off[0], off[1]), off[2]));
        degree[v[0]]++, on++;
    }
    for (uint32_t v = 0; v < quads->vertex_count; v++) assert_true(degree[v] == 0 || degree[v] == 2);
    free(degree);
    return on / 2; /* each from both sides */
}

/* A loop drawn on a sphere is a loop of edges. */
static void a_guide_is_a_loop_of_edges(void **state)
{
    (void)state;
    static const double heights[] = {0.3, -0.62};
    shape s = shape_sphere(20);
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    for (int i = 0; i < 2; i++)
        for (int64_t faces = 400; faces <= 1600; faces *= 4) {
            double p[AROUND][3], z = heights[i], farthest;
            parallel(z, 1.02, p);
            qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 1, AROUND, p[0], 0};
            assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
            run(context, faces);
            const qw_report *r = qw_get_report(context);
            qw_get_mesh(context, &quads);
            uint32_t edges = edges_on_parallel(&quads, r->mean_edge, z, &farthest);
            double round = 360 * DEGREE * sqrt(1 - z * z) / r->mean_edge;
            assert_true(edges > 0.7 * round && edges < 1.4 * round && farthest < 0.1);
            assert_true(r->guide_edges > 0 && r->guide_off >= 0 && r->guide_off < 0.1);
        }
    assert_int_equal(qw_set_guides(context, NULL, 0), QW_OK);
    run(context, 400);
    assert_true(qw_get_report(context)->guide_off < 0 && qw_get_report(context)->guide_edges == 0);
    qw_destroy(context);
    shape_free(&s);
}

/* On a plane only guides say which way quads run: along a line at 25 degrees to the rim's. */
static void shape_at_plane(double u, double v, double p[3]) { p[0] = 4 * u, p[1] = 4 * v, p[2] = 0; }

static double angle_near_line(const qw_mesh_view *quads, double angle)
{
    double sum = 0, count = 0;
    for (size_t h = 0; h < 4 * (size_t)quads->face_count; h++) {
        const double *a = quads->positions + 3 * (size_t)quads->corners[h],
                     *b = quads->positions + 3 * (size_t)quads->corners[h % 4 == 3 ? h - 3 : h + 1];
        double x = (a[0] + b[0]) / 2 - 2, y = (a[1] + b[1]) / 2 - 2;
        if (fabs(y * cos(angle) - x * sin(angle)) > 0.15 || hypot(x, y) > 1) continue;
        double off = fabs(fmod(atan2(b[1] - a[1], b[0] - a[0]) / DEGREE - angle / DEGREE + 360, 90));
        sum += fmin(off, 90 - off), count++;
    }
    return sum / count;
}

static void a_guide_gives_a_direction(void **state)
{
    (void)state;
    shape s = shape_of_sheet(&(shape_sheet){40, 40, false, false, false, shape_at_plane});
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    double a = 25 * DEGREE, p[2][3] = {{2 - cos(a), 2 - sin(a), 0}, {2 + cos(a), 2 + sin(a), 0}};
    run(context, 900);
    qw_get_mesh(context, &quads);
    assert_true(angle_near_line(&quads, a) > 20);
    qw_guide guide = {sizeof guide, QW_GUIDE_DIRECTION, 0, 2, p[0], 0};
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
    run(context, 900);
    qw_get_mesh(context, &quads);
    assert_true(angle_near_line(&quads, a) < 8);
    qw_destroy(context);
    shape_free(&s);
}

/* A file of three guides: a closed loop, and two whose group says that they are directions. */
static void guides_come_from_a_file(void **state)
{
    (void)state;
    double p[AROUND][3], farthest;
    shape s = shape_sphere(16);
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    FILE *file = fopen(QW_BINARY_DIR "/guides.obj", "wb");
    assert_non_null(file);
    parallel(0.4, 1, p);
    for (int i = 0; i < AROUND; i++) fprintf(file, "v %.9g %.9g %.9g\n", p[i][0], p[i][1], p[i][2]);
    fputs("# a loop\nl", file);
    for (int i = 0; i < AROUND; i++) fprintf(file, " %d", i + 1);
    fputs(" 1\ng direction of the pole\nv 0 0 1\nv 0.1 0 0.995\nl -2 -1/7\n", file);
    fclose(file);
    if (qw_load_guides(context, QW_BINARY_DIR "/guides.obj") != QW_OK) fail_msg("%s", qw_message(context));
    run(context, 500);
    qw_get_mesh(context, &quads);
    assert_true(edges_on_parallel(&quads, qw_get_report(context)->mean_edge, 0.4, &farthest) > 20);
    qw_destroy(context);
    shape_free(&s);
}

/* Of a file with rings and of one without: there are other quads, and in an open line rings have no meaning. */
static void rings_come_from_a_file(void **state)
{
    (void)state;
    static const char *const names[] = {"g rings", "g rings 3 left eye", "o rings_3", "g rings3", "g ring 3"};
    double p[AROUND][3];
    shape s = shape_sphere(16);
    qw_mesh_view view = shape_view(&s), quads;
    qw_context *context = context_with(&view);
    uint32_t corners[2] = {0};
    parallel(0.4, 1, p);
    for (size_t n = 0; n < sizeof names / sizeof *names; n++) {
        FILE *file = fopen(QW_BINARY_DIR "/ring-guides.obj", "wb");
        assert_non_null(file);
        fprintf(file, "%s\n", names[n]);
        for (int i = 0; i < AROUND; i++) fprintf(file, "v %.9g %.9g %.9g\n", p[i][0], p[i][1], p[i][2]);
        fputc('l', file);
        for (int i = 0; i <= AROUND; i++) fprintf(file, " %d", i % AROUND + 1);
        fclose(file);
        if (qw_load_guides(context, QW_BINARY_DIR "/ring-guides.obj") != QW_OK) fail_msg("%s", qw_message(context));
        run(context, 500);
        qw_get_mesh(context, &quads);
        uint32_t sum = 0;
        for (size_t i = 0; i < 4 * (size_t)quads.face_count; i++) sum = 31 * sum + quads.corners[i];
        if (n < 2) corners[n] = sum;
        assert_int_equal(sum, corners[n == 1 || n == 2 || n == 3]);
    }
    assert_int_not_equal(corners[0], corners[1]);
    write_text(QW_BINARY_DIR "/ring-guides.obj", "g rings 3\nv 0 0 1\nv 0.1 0 0.995\nl 1 2\n");
    assert_int_equal(qw_load_guides(context, QW_BINARY_DIR "/ring-guides.obj"), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "guide 0 is to have rings, but is no closed loop"));
    write_text(QW_BINARY_DIR "/ring-guides.obj", "g rings 1001\nv 0 0 1\nv 0.1 0 0.995\nv 0 0.1 0.995\nl 1 2 3 1\n");
    assert_int_equal(qw_load_guides(context, QW_BINARY_DIR "/ring-guides.obj"), QW_ARGUMENT);
    qw_destroy(context);
    shape_free(&s);
}

static void wrong_guides_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        qw_status status;
        const char *says;
    } rows[] = {{"", QW_FILE_EMPTY, "empty"},
                {"v 0 0 1\n", QW_FORMAT_SYNTAX, "no line"},
                {"v 0 0 1\nl 1\n", QW_FORMAT_SYNTAX, "two vertices"},
                {"v 0 0 1\nv 1 0 0\nl 1 3\n", QW_INDEX_RANGE, "line 3"},
                {"v 0 0 1\nl 1 -2\n", QW_INDEX_RANGE, "-2"},
                {"v 0 0 1\nl 1 0\n", QW_INDEX_RANGE, "vertex 0"},
                {"v 0 0 1\nl 1 99999999999999999999\n", QW_INDEX_RANGE, "9999"},
                {"v 0 0 1\nl 1 x\n", QW_FORMAT_SYNTAX, "\"x\""},
                {"v 0 nan 1\nv 1 0 0\nl 1 2\n", QW_NOT_FINITE, "line 1"},
                {"v 0 0\nv 1 0 0\nl 1 2\n", QW_FORMAT_SYNTAX, "coordinate"}};
    shape s = shape_sphere(8);
    qw_mesh_view view = shape_view(&s);
    qw_context *context = context_with(&view);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        write_text(QW_BINARY_DIR "/wrong-guides.obj", rows[i].text);
        qw_status status = qw_load_guides(context, QW_BINARY_DIR "/wrong-guides.obj");
        if (status != rows[i].status || !strstr(qw_message(context), rows[i].says))
            fail_msg("row %zu: status %s, \"%s\"", i, qw_status_name(status), qw_message(context));
    }
    double p[3][3] = {{0, 0, 1}, {NAN, 0, 0}, {1, 0, 0}};
    qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 0, 3, p[0], 0};
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_NOT_FINITE);
    guide.point_count = 1;
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_ARGUMENT);
    guide.point_count = 2, guide.closed = 1;
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_ARGUMENT);
    guide.closed = 0, guide.kind = (qw_guide_kind)7;
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_ARGUMENT);
    guide.kind = QW_GUIDE_LOOP, guide.size = 3;
    assert_int_equal(qw_set_guides(context, &guide, 1), QW_ARGUMENT);
    assert_int_equal(qw_set_guides(context, NULL, 1), QW_ARGUMENT);
    qw_destroy(context);
    shape_free(&s);
}

/* A run says which guide is off the surface, and how far; and where one cannot be drawn. */
static void guides_off_the_surface_are_refused(void **state)
{
    (void)state;
    shape s = shape_two_cubes(6); /* unit cubes, with one cell between them */
    qw_mesh_view view = shape_view(&s);
    qw_context *context = context_with(&view);
    double on[2][3] = {{0.3, 0.5, 1}, {0.7, 0.5, 1}}, off[3][3] = {{0.2, 0.5, 1}, {0.5, 0.5, 1.75}, {0.8, 0.5, 1}},
           apart[2][3] = {{0.5, 0.5, 1}, {2.5, 0.5, 1}};
    qw_guide guides[2] = {{sizeof *guides, QW_GUIDE_LOOP, 0, 2, on[0], 0},
                          {sizeof *guides, QW_GUIDE_DIRECTION, 0, 3, off[0], 0}};
    qw_options options;
    qw_options_init(&options);
    options.faces = 300;
    assert_int_equal(qw_set_guides(context, guides, 2), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "guide 1 is off the surface: its point 1 lies 0.75 away"));
    guides[1] = (qw_guide){sizeof *guides, QW_GUIDE_LOOP, 0, 2, apart[0], 0};
    assert_int_equal(qw_set_guides(context, guides, 2), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_ARGUMENT);
    assert_non_null(strstr(qw_message(context), "guide 1 cannot be drawn"));
    assert_int_equal(qw_set_guides(context, guides, 1), QW_OK);
    run(context, 300);
    assert_true(qw_get_report(context)->guide_off < 0.1);
    qw_destroy(context);
    shape_free(&s);
}

static bool cells_of_a_diagonal(int x, int y, int z) { return x == y && y == z; }

/* Two cubes that touch at a corner: there is a vertex of either, and a guide may begin with an edge of any. */
static void guides_leave_a_corner_on_either_sheet(void **state)
{
    (void)state;
    shape s = shape_of_cells(2, 2, 2, 1, cells_of_a_diagonal);
    qw_mesh_view view = shape_view(&s);
    for (int i = 0; i < 6; i++) {
        double ends[2][3] = {{1, 1, 1}, {1, 1, 1}};
        ends[1][i / 2] += i % 2 ? 1 : -1;
        const qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 0, 2, ends[0], 0};
        qw_context *context = context_with(&view);
        assert_int_equal(qw_set_guides(context, &guide, 1), QW_OK);
        run(context, 200);
        assert_true(qw_get_report(context)->guide_off >= 0 && qw_get_report(context)->guide_off < 0.1);
        qw_destroy(context);
    }
    shape_free(&s);
}

/* A run that is taken up from a dump goes on with the field and the guides. */
static void a_dump_holds_both(void **state)
{
    (void)state;
    shape s = shape_torus(12);
    qw_mesh_view view = shape_view(&s), a, b;
    qw_context *first = context_with(&view), *second;
    float *d = turned_field(&s, QW_PER_FACE, 20 * DEGREE);
    qw_cross_field field = {sizeof field, QW_PER_FACE, s.face_count, d};
    qw_options options;
    qw_options_init(&options);
    options.faces = 400;
    double line[2][3] = {{1.4, -0.3, 0}, {1.4, 0.3, 0}};
    qw_guide guide = {sizeof guide, QW_GUIDE_LOOP, 0, 2, line[0], 0};
    assert_int_equal(qw_set_field(first, &field), QW_OK);
    assert_int_equal(qw_set_guides(first, &guide, 1), QW_OK);
    assert_int_equal(qw_run_until(first, &options, QW_STAGE_WORKING), QW_OK);
    assert_int_equal(qw_dump(first, QW_BINARY_DIR "/steered.qws"), QW_OK);
    assert_int_equal(qw_create(NULL, &second), QW_OK);
    if (qw_resume(second, QW_BINARY_DIR "/steered.qws") != QW_OK) fail_msg("%s", qw_message(second));
    run(first, 400), run(second, 400);
    assert_true(qw_get_report(second)->field_angle >= 0 && qw_get_report(second)->guide_off >= 0);
    qw_get_mesh(first, &a), qw_get_mesh(second, &b);
    assert_int_equal(a.vertex_count, b.vertex_count);
    assert_memory_equal(a.positions, b.positions, 3 * a.vertex_count * sizeof *a.positions);
    qw_destroy(first), qw_destroy(second);
    free(d), shape_free(&s);
}

QW_TEST_SUITE(steering)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quads_follow_a_field),
        cmocka_unit_test(a_field_may_be_silent),
        cmocka_unit_test(a_field_comes_back),
        cmocka_unit_test(directions_are_unit_tangents),
        cmocka_unit_test(a_guide_is_a_loop_of_edges),
        cmocka_unit_test(a_guide_gives_a_direction),
        cmocka_unit_test(guides_come_from_a_file),
        cmocka_unit_test(rings_come_from_a_file),
        cmocka_unit_test(wrong_guides_are_refused),
        cmocka_unit_test(guides_off_the_surface_are_refused),
        cmocka_unit_test(wrong_fields_are_refused),
        cmocka_unit_test(a_dump_holds_both),
        cmocka_unit_test(guides_leave_a_corner_on_either_sheet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

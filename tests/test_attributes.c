/* What is carried from the input to the quads, judged by what it should be there: places, colours of close sheets,
 * weights of legs that touch, texture coordinates at seams, labels, and what callers get wrong. */
#define _POSIX_C_SOURCE 200809L
#include "suite.h"
#include "random.h"
#include "shapes.h"
#include "io/soup.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

static const double TURN = 6.283185307179586;

static qw_result *remesh(const qw_mesh_view *view, int64_t faces)
{
    qw_options options;
    qw_options_init(&options);
    options.faces = faces;
    qw_result *result;
    qw_status status = qw_remesh(view, &options, NULL, &result);
    if (status != QW_OK) fail_msg("%s", qw_result_message(result));
    return result;
}

static qw_attribute of_vertices(const char *name, qw_attribute_kind kind, uint32_t components, uint32_t count,
                                const float *values)
{
    return (qw_attribute){.size = sizeof(qw_attribute),
                          .name = name,
                          .kind = kind,
                          .components = components,
                          .count = count,
                          .values = values};
}

static const qw_attribute *transfer(qw_result *result, const qw_attribute *a, uint32_t most, qw_transfer_report *report)
{
    const qw_attribute *out;
    qw_status status = qw_result_transfer(result, a, 1, most, &out, report);
    if (status != QW_OK) fail_msg("%s", qw_result_message(result));
    return out;
}

/* ---- places */

static double distance_to_origin(const qw_mesh_view *input, const uint32_t *begin, const qw_origin *o,
                                 const double *position)
{
    double at[3] = {0, 0, 0}, sum = 0;
    assert_true(o->face < input->face_count);
    for (int k = 0; k < 3; k++) {
        assert_true(o->corner[k] < begin[o->face + 1] - begin[o->face] && o->weight[k] >= 0 && o->weight[k] <= 1);
        sum += (double)o->weight[k];
        const double *p = input->positions + 3 * (size_t)input->corners[begin[o->face] + o->corner[k]];
        for (int i = 0; i < 3; i++) at[i] += (double)o->weight[k] * p[i];
    }
    assert_true(fabs(sum - 1) < 1e-5);
    return sqrt(pow(at[0] - position[0], 2) + pow(at[1] - position[1], 2) + pow(at[2] - position[2], 2));
}

/* A torus of quads and triangles, every third face of which is turned round, behind three faces that cleaning drops. */
static void places_are_those_of_the_caller(void **state)
{
    (void)state;
    enum { N = 32, M = 16 };
    static double position[N * M][3];
    static uint32_t corner[4 * N * M + 9], size[2 * N * M + 3], begin[2 * N * M + 4];
    uint32_t faces = 0, corners = 0;
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < M; j++) {
            double a = TURN * i / N, b = TURN * j / M, r = 3 + cos(b);
            position[i * M + j][0] = 100 + r * cos(a), position[i * M + j][1] = r * sin(a),
                             position[i * M + j][2] = sin(b);
        }
    for (int i = 0; i < 3; i++)
        size[faces++] = 3, corner[corners] = corner[corners + 1] = 7, corner[corners + 2] = 9, corners += 3;
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < M; j++) {
            uint32_t v[4] = {i * M + j, (i + 1) % N * M + j, (i + 1) % N * M + (j + 1) % M, i * M + (j + 1) % M};
            size[faces] = 4;
            for (int k = 0; k < 4; k++) corner[corners++] = v[faces % 3 == 0 ? 3 - k : k];
            faces++;
        }
    for (uint32_t f = 0; f < faces; f++) begin[f + 1] = begin[f] + size[f];
    qw_mesh_view view = {sizeof view, N * M, faces, 0, position[0], size, corner, NULL, 0};
    qw_result *result = remesh(&view, 700);
    qw_mesh_view quads = qw_result_mesh(result);
    qw_provenance p;
    assert_int_equal(qw_result_provenance(result, &p), QW_OK);
    assert_int_equal(p.vertex_count, quads.vertex_count);
    assert_int_equal(p.corner_count, 4 * quads.face_count);
    assert_int_equal(p.lost_vertices + p.lost_corners, 0);
    double farthest = 0;
    for (uint32_t v = 0; v < p.vertex_count; v++)
        farthest = fmax(farthest, distance_to_origin(&view, begin, &p.vertices[v], quads.positions + 3 * (size_t)v));
    assert_true(fabs(farthest - p.farthest) < 1e-4 && farthest < 0.1);
    for (uint32_t h = 0; h < p.corner_count; h++)
        assert_true(distance_to_origin(&view, begin, &p.corners[h], quads.positions + 3 * (size_t)quads.corners[h]) <
                    0.15);
    qw_result_destroy(result);
}

/* ---- sheets */

/* Two plates, one over the other, closer than a hundredth of a quad; facing apart, or both up as cloth on a body. */
static shape two_plates(bool both_up, double gap)
{
    enum { N = 16 };
    shape s = {0, 0, malloc(2 * (N + 1) * (N + 1) * 3 * sizeof(double)), malloc(2 * N * N * 2 * 3 * sizeof(uint32_t))};
    for (uint32_t plate = 0; plate < 2; plate++) {
        uint32_t first = s.vertex_count;
        for (uint32_t i = 0; i <= N; i++)
            for (uint32_t j = 0; j <= N; j++) {
                double *p = s.position + 3 * (size_t)s.vertex_count++;
                p[0] = i, p[1] = j, p[2] = (plate ? 0 : gap) + 1.5 * sin(0.4 * i);
            }
        for (uint32_t i = 0; i < N; i++)
            for (uint32_t j = 0; j < N; j++) {
                uint32_t v = first + i * (N + 1) + j;
                bool up = plate == 0 || both_up;
                shape_square(&s, v, up ? v + N + 1 : v + 1, v + N + 2, up ? v + 1 : v + N + 1, (i + j) & 1);
            }
    }
    return s;
}

static void sheets_take_nothing_from_one_another(void **state)
{
    (void)state;
    for (int both_up = 0; both_up < 2; both_up++) {
        shape s = two_plates(both_up, 0.02);
        float *colour = malloc(s.vertex_count * sizeof *colour);
        for (uint32_t v = 0; v < s.vertex_count; v++) colour[v] = v < s.vertex_count / 2;
        qw_mesh_view view = shape_view(&s);
        qw_result *result = remesh(&view, 160);
        qw_attribute a = of_vertices("colour", QW_VALUES, 1, s.vertex_count, colour);
        qw_transfer_report report;
        const qw_attribute *out = transfer(result, &a, 0, &report);
        qw_mesh_view quads = qw_result_mesh(result);
        assert_int_equal(report.filled_vertices, 0);
        uint32_t count[2] = {0, 0};
        for (uint32_t f = 0; f < quads.face_count; f++) {
            float first = out->values[quads.corners[4 * f]];
            assert_true(first == 0 || first == 1);
            count[(int)first]++;
            for (uint32_t i = 1; i < 4; i++) assert_true(out->values[quads.corners[4 * f + i]] == first);
        }
        assert_true(count[0] > 50 && count[1] > 50);
        qw_result_destroy(result);
        shape_free(&s), free(colour);
    }
}

/* ---- weights */

static bool is_in_trousers(int x, int y, int z) { return z < 1 && (y == 2 || x != 1) && x < 3 && y < 3; }

/* Two legs, squeezed together until nearly nothing is between them; each has a group of its own below the hip. */
static void weights_come_from_their_own_leg(void **state)
{
    (void)state;
    shape s = shape_of_cells(3, 3, 1, 4, is_in_trousers);
    uint32_t n = s.vertex_count;
    float *weight = malloc(3 * n * sizeof *weight);
    uint32_t *group = malloc(3 * n * sizeof *group);
    for (uint32_t v = 0; v < n; v++) {
        double *p = s.position + 3 * (size_t)v, y = p[1];
        bool right = p[0] > 1.5;
        if (y < 2) p[0] += (right ? -0.4975 : 0.4975) * (p[0] > 0.99 && p[0] < 2.01 ? 1 : 0);
        float leg = y < 2 ? 1.0f : (float)(3 - y);
        group[3 * v] = right ? 1 : 2, weight[3 * v] = leg * 0.9f;
        group[3 * v + 1] = 3, weight[3 * v + 1] = 1 - leg;
        group[3 * v + 2] = 4 + v % 5, weight[3 * v + 2] = 0.1f * leg;
    }
    qw_mesh_view view = shape_view(&s);
    qw_result *result = remesh(&view, 400);
    qw_attribute a = of_vertices("skin", QW_WEIGHTS, 3, n, weight);
    a.group = group;
    qw_transfer_report report;
    const qw_attribute *out = transfer(result, &a, 2, &report);
    qw_mesh_view quads = qw_result_mesh(result);
    assert_int_equal(out->components, 2);
    assert_true(report.dropped_weights > 0);
    uint32_t legs[2] = {0, 0};
    for (uint32_t v = 0; v < quads.vertex_count; v++) {
        const float *w = out->values + 2 * v;
        const double *p = quads.positions + 3 * (size_t)v;
        assert_true(fabsf(w[0] + w[1] - 1) < 1e-6f && w[0] >= w[1] && w[1] >= 0);
        if (p[1] > 1.9 || fabs(p[0] - 1.5) < 1e-4) continue;
        uint32_t wrong = p[0] > 1.5 ? 2 : 1;
        legs[p[0] > 1.5]++;
        for (int k = 0; k < 2; k++) assert_true(w[k] == 0 || out->group[2 * v + (uint32_t)k] != wrong);
    }
    assert_true(legs[0] > 20 && legs[1] > 20);
    qw_result_destroy(result);
    shape_free(&s), free(weight), free(group);
}

/* ---- seams */

/* A torus whose texture wraps around both ways: u and v run from 0 to 1 and meet in seams. */
static void quads_keep_to_one_side_of_a_seam(void **state)
{
    (void)state;
    enum { N = 60, M = 30 };
    static double position[N * M][3];
    static uint32_t corner[N * M][4];
    static float uv[N * M][4][2];
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < M; j++) {
            double a = TURN * i / N, b = TURN * j / M, r = 3 + cos(b);
            double *p = position[i * M + j];
            p[0] = r * cos(a), p[1] = r * sin(a), p[2] = sin(b);
            for (uint32_t k = 0; k < 4; k++) {
                uint32_t x = i + (k == 1 || k == 2), y = j + (k > 1);
                corner[i * M + j][k] = x % N * M + y % M;
                uv[i * M + j][k][0] = (float)x / N, uv[i * M + j][k][1] = (float)y / M;
            }
        }
    qw_mesh_view view = {sizeof view, N * M, N * M, 4, position[0], NULL, corner[0], NULL, 0};
    qw_result *result = remesh(&view, 800);
    qw_attribute a = of_vertices("uv", QW_UVS, 2, 4 * N * M, uv[0][0]);
    a.domain = QW_PER_CORNER;
    qw_transfer_report report;
    const qw_attribute *out = transfer(result, &a, 0, &report);
    qw_mesh_view quads = qw_result_mesh(result);
    assert_int_equal(report.charts, 1);
    assert_true(report.straddling_quads > 20 && report.straddling_quads < 160);
    double worst = 0;
    for (uint32_t f = 0; f < quads.face_count; f++)
        for (uint32_t i = 0; i < 4; i++) {
            const float *t = out->values + 2 * (4 * f + i), *next = out->values + 2 * (4 * f + (i + 1) % 4);
            const double *p = quads.positions + 3 * (size_t)quads.corners[4 * f + i];
            assert_true(fabsf(t[0] - next[0]) < 0.1f && fabsf(t[1] - next[1]) < 0.2f); /* a quad is about 0.03, 0.06 */
            double du = fabs(atan2(p[1], p[0]) / TURN - (double)t[0]);
            worst = fmax(worst, fmin(fabs(du - round(du)), 1));
        }
    assert_true(worst < 0.05); /* clamped at the seam by less than a quad */
    qw_result_destroy(result);
}

/* Coordinates of a plate as a transform leaves them, off by some units of single precision at each corner: one chart,
 * no border to be kept, and all corners of a vertex of the result have the same. `gap`: a cut through its middle. */
static void check_rounded(float gap, uint32_t charts)
{
    enum { N = 24 };
    static double position[N + 1][N + 1][3];
    static uint32_t corner[N * N][4];
    static float uv[N * N][4][2];
    uint64_t random = 11;
    for (uint32_t i = 0; i <= N; i++)
        for (uint32_t j = 0; j <= N; j++)
            position[i][j][0] = i, position[i][j][1] = j, position[i][j][2] = 2 * sin(0.2 * i);
    for (uint32_t f = 0; f < N * N; f++)
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t x = f / N + (k == 1 || k == 2), y = f % N + (k > 1), v[2] = {x, y};
            corner[f][k] = x * (N + 1) + y;
            for (uint32_t c = 0; c < 2; c++) {
                random_step(&random);
                float noise = (float)((double)(random >> 11) / 9007199254740992.0 - 0.5) * 6e-7f;
                uv[f][k][c] = (float)v[c] / N + noise + (c == 0 && f / N >= N / 2 ? gap : 0);
            }
        }
    qw_mesh_view view = {sizeof view, (N + 1) * (N + 1), N * N, 4, position[0][0], NULL, corner[0], NULL, 0};
    qw_attribute a = of_vertices("uv", QW_UVS, 2, 4 * N * N, uv[0][0]);
    a.domain = QW_PER_CORNER;
    const qw_attribute *list[1] = {&a};
    uint32_t edges;
    qw_env *env = qw_env_create(NULL, 1);
    qw_find_attribute_borders(env, &view, list, 1, &edges);
    assert_int_equal(edges, charts == 1 ? 0 : N);
    qw_env_destroy(env);
    qw_result *result = remesh(&view, 300);
    qw_transfer_report report;
    const qw_attribute *out = transfer(result, &a, 0, &report);
    qw_mesh_view quads = qw_result_mesh(result);
    assert_int_equal(report.charts, charts);
    float(*known)[2] = calloc(quads.vertex_count, sizeof *known);
    for (uint32_t h = 0; h < 4 * quads.face_count && charts == 1; h++) {
        float *of_vertex = known[quads.corners[h]];
        if (of_vertex[0] == 0) memcpy(of_vertex, out->values + 2 * h, sizeof *known);
        assert_memory_equal(of_vertex, out->values + 2 * h, sizeof *known);
    }
    qw_result_destroy(result);
    free(known);
}

static void rounding_is_no_seam(void **state)
{
    (void)state;
    check_rounded(0, 1);
    check_rounded(1e-5f, 2); /* a sixth of a pixel of 16384: somebody's seam */
}

/* ---- labels */

static void labels_go_by_area(void **state)
{
    (void)state;
    shape s = two_plates(true, 40);
    int32_t *label = malloc(s.face_count * sizeof *label);
    double area[3] = {0, 0, 0}, got[3] = {0, 0, 0};
    for (uint32_t f = 0; f < s.face_count; f++) {
        const double *p = s.position + 3 * (size_t)s.corner[3 * f];
        label[f] = p[1] < 7 ? 0 : p[0] < 9 ? 1 : 2;
        area[label[f]] += 1.0 / s.face_count;
    }
    static const char *const names[] = {"skin", "cloth", "shoe"};
    qw_mesh_view view = shape_view(&s);
    qw_result *result = remesh(&view, 500);
    qw_attribute a = {sizeof a, "material", QW_PER_FACE, QW_LABELS, 1, s.face_count,
                      NULL,     NULL,       label,       names,     3, QW_INT32};
    const qw_attribute *out = transfer(result, &a, 0, NULL);
    assert_int_equal(out->label_count, 3);
    assert_string_equal(out->label_names[2], "shoe");
    qw_mesh_view quads = qw_result_mesh(result);
    for (uint32_t f = 0; f < out->count; f++) { /* seen from above, where all triangles are of one size */
        const uint32_t *c = quads.corners + 4 * (size_t)f;
        for (int i = 0; i < 4; i++) {
            const double *p = quads.positions + 3 * (size_t)c[i], *q = quads.positions + 3 * (size_t)c[(i + 1) % 4];
            got[out->labels[f]] += (p[0] * q[1] - p[1] * q[0]) / 2 / (2 * 16 * 16);
        }
    }
    /* borders of 16 a plate, each to half a quad */
    for (int i = 0; i < 3; i++) assert_true(fabs(got[i] - area[i]) < 0.04);
    qw_result_destroy(result);
    shape_free(&s), free(label);
}

/* ---- numbers of faces */

/* A number that rises evenly over a plate: the mean over a quad is what it is in its middle, to neither side of it. */
static void means_of_faces_lie_in_the_middle(void **state)
{
    (void)state;
    enum { N = 150, FACES = 2 * N * N };
    shape s = {0, 0, malloc((N + 1) * (N + 1) * 3 * sizeof(double)), malloc(FACES * 3 * sizeof(uint32_t))};
    for (uint32_t i = 0; i <= N; i++)
        for (uint32_t j = 0; j <= N; j++) {
            double *p = s.position + 3 * (size_t)s.vertex_count++;
            p[0] = i, p[1] = j, p[2] = 0;
        }
    for (uint32_t i = 0; i < N; i++)
        for (uint32_t j = 0; j < N; j++) {
            uint32_t v = i * (N + 1) + j;
            shape_square(&s, v, v + N + 1, v + N + 2, v + 1, (i + j) & 1);
        }
    float(*value)[2] = malloc(FACES * sizeof *value);
    for (uint32_t f = 0; f < FACES; f++)
        for (uint32_t k = 0, c = 0; k < 2; k++)
            for (c = 0, value[f][k] = 0; c < 3; c++)
                value[f][k] += (float)(s.position[3 * (size_t)s.corner[3 * f + c] + k] / 3);
    qw_mesh_view view = shape_view(&s);
    qw_result *result = remesh(&view, 100);
    qw_attribute a = of_vertices("heat", QW_VALUES, 2, FACES, value[0]);
    a.domain = QW_PER_FACE;
    const qw_attribute *out = transfer(result, &a, 0, NULL);
    qw_mesh_view quads = qw_result_mesh(result);
    assert_int_equal(out->count, quads.face_count);
    double sum2 = 0;
    for (uint32_t f = 0; f < quads.face_count; f++)
        for (uint32_t k = 0; k < 2; k++) {
            double middle = 0;
            for (uint32_t c = 0; c < 4; c++) middle += quads.positions[3 * (size_t)quads.corners[4 * f + c] + k] / 4;
            double off = (double)out->values[2 * f + k] - middle;
            sum2 += off * off / quads.face_count;
        }
    assert_true(sqrt(sum2) < 0.03 * N / 10); /* of an edge */
    qw_result_destroy(result);
    shape_free(&s), free(value);
}

/* ---- what callers get wrong */

static void bad_attributes_are_refused(void **state)
{
    (void)state;
    shape s = shape_torus(12);
    qw_mesh_view view = shape_view(&s);
    qw_result *result = remesh(&view, 100);
    float *values = calloc(16 * (size_t)s.vertex_count, sizeof *values);
    int32_t *labels = calloc(s.face_count, sizeof *labels);
    static const char *const names[] = {"one"};
    qw_attribute good = of_vertices("x", QW_VALUES, 2, s.vertex_count, values);
    qw_attribute label = {sizeof label, "m",  QW_PER_FACE, QW_LABELS, 1, s.face_count,
                          NULL,         NULL, labels,      names,     1, QW_INT32};
    const qw_attribute *out;
    qw_attribute bad[12];
    for (int i = 0; i < 12; i++) bad[i] = good;
    bad[0].size = 8, bad[1].name = "", bad[2].components = 0, bad[3].components = 17, bad[4].count--;
    bad[5].values = NULL, bad[6].domain = QW_PER_FACE, bad[7].kind = QW_WEIGHTS, bad[8].kind = QW_NORMALS;
    bad[9].kind = (qw_attribute_kind)9, bad[10].name = NULL, bad[11].kind = QW_LABELS;
    for (int i = 0; i < 12; i++) {
        assert_int_equal(qw_result_transfer(result, &bad[i], 1, 0, &out, NULL), QW_ARGUMENT);
        assert_true(out == NULL && strlen(qw_result_message(result)) > 10);
    }
    labels[3] = 1;
    assert_int_equal(qw_result_transfer(result, &label, 1, 0, &out, NULL), QW_ARGUMENT);
    assert_non_null(strstr(qw_result_message(result), "element 3 has label 1"));
    values[11] = NAN;
    assert_int_equal(qw_result_transfer(result, &good, 1, 0, &out, NULL), QW_NOT_FINITE);
    assert_non_null(strstr(qw_result_message(result), "element 5"));
    values[11] = 0;
    assert_int_equal(qw_result_transfer(result, &good, 1, 17, &out, NULL), QW_ARGUMENT);
    assert_int_equal(qw_result_transfer(result, &good, 1, 0, &out, NULL), QW_OK);
    assert_true(qw_result_mesh(result).face_count > 50);
    qw_result_destroy(result);
    shape_free(&s), free(values), free(labels);
}

/* Before the run there is nothing to ask for, and a new run finds anew. */
static void provenance_is_of_the_last_run(void **state)
{
    (void)state;
    shape s = shape_torus(12);
    qw_mesh_view view = shape_view(&s);
    qw_context *context;
    qw_provenance p;
    qw_options options;
    qw_options_init(&options);
    assert_int_equal(qw_create(NULL, &context), QW_OK);
    assert_int_equal(qw_get_provenance(context, &p), QW_NOT_READY);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_get_provenance(context, &p), QW_NOT_READY);
    for (int64_t faces = 100; faces < 500; faces += 150) {
        qw_mesh_view quads;
        options.faces = faces;
        assert_int_equal(qw_run(context, &options), QW_OK);
        assert_int_equal(qw_get_provenance(context, &p), QW_OK);
        assert_int_equal(qw_get_mesh(context, &quads), QW_OK);
        assert_int_equal(p.vertex_count, quads.vertex_count);
        qw_provenance again;
        assert_int_equal(qw_get_provenance(context, &again), QW_OK);
        assert_ptr_equal(p.vertices, again.vertices);
    }
    qw_destroy(context);
    shape_free(&s);
}

/* ---- a host that wants no more */

typedef struct impatience {
    int slow; /* so many allocations take longer than the host is left without a word */
    bool cancels;
    long calls;
} impatience;

static void *resize_slowly(void *user, void *block, size_t old_size, size_t new_size)
{
    impatience *m = user;
    (void)old_size;
    if (m->slow > 0 && new_size > 0) nanosleep(&(struct timespec){0, 30000000}, NULL), m->slow--;
    if (new_size > 0) return realloc(block, new_size);
    free(block);
    return NULL;
}

static int hear(void *user, qw_stage stage, double fraction)
{
    impatience *m = user;
    (void)stage, (void)fraction;
    m->calls++;
    return m->cancels;
}

/* What is asked of a result can be cancelled, and then be asked again. */
static void asking_can_be_cancelled(void **state)
{
    (void)state;
    shape s = shape_cube(8);
    qw_mesh_view view = shape_view(&s);
    impatience m = {0};
    const qw_host host = {.resize = resize_slowly, .resize_user = &m, .progress = hear, .progress_user = &m};
    qw_context *context;
    qw_options options;
    qw_options_init(&options);
    options.faces = 150;
    assert_int_equal(qw_create(&host, &context), QW_OK);
    assert_int_equal(qw_set_mesh(context, &view), QW_OK);
    assert_int_equal(qw_run(context, &options), QW_OK);
    float *values = calloc(s.vertex_count, sizeof *values), *offset = calloc(s.vertex_count, 3 * sizeof *offset);
    assert_true(values && offset);
    for (uint32_t i = 0; i < 3 * s.vertex_count; i++) offset[i] = (float)s.position[i];
    qw_attribute a = of_vertices("a", QW_VALUES, 1, s.vertex_count, values);
    const qw_attribute *out;
    qw_provenance provenance;
    qw_cross_field field;
    m = (impatience){.slow = 3, .cancels = true};
    assert_int_equal(qw_get_provenance(context, &provenance), QW_CANCELLED);
    assert_int_equal(m.calls, 1);
    m = (impatience){.slow = 3};
    assert_int_equal(qw_transfer(context, &a, 1, 0, &out, NULL), QW_OK);
    assert_true(m.calls >= 1);
    m = (impatience){.slow = 3, .cancels = true};
    assert_int_equal(qw_transfer(context, &a, 1, 0, &out, NULL), QW_CANCELLED);
    m = (impatience){.slow = 3, .cancels = true};
    assert_int_equal(qw_get_field(context, QW_PER_VERTEX, &field), QW_CANCELLED);
    const qw_attribute target = of_vertices("target:wide", QW_VALUES, 3, s.vertex_count, offset);
    m = (impatience){.slow = 3, .cancels = true};
    assert_int_equal(qw_set_motion(context, &target, 1), QW_CANCELLED);
    m = (impatience){0};
    assert_int_equal(qw_get_field(context, QW_PER_VERTEX, &field), QW_OK);
    assert_int_equal(qw_transfer(context, &a, 1, 0, &out, NULL), QW_OK);
    assert_int_equal(qw_get_provenance(context, &provenance), QW_OK);
    free(values), free(offset);
    qw_destroy(context);
    shape_free(&s);
}

QW_TEST_SUITE(attributes)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_are_those_of_the_caller),
        cmocka_unit_test(sheets_take_nothing_from_one_another),
        cmocka_unit_test(weights_come_from_their_own_leg),
        cmocka_unit_test(quads_keep_to_one_side_of_a_seam),
        cmocka_unit_test(rounding_is_no_seam),
        cmocka_unit_test(labels_go_by_area),
        cmocka_unit_test(means_of_faces_lie_in_the_middle),
        cmocka_unit_test(bad_attributes_are_refused),
        cmocka_unit_test(provenance_is_of_the_last_run),
        cmocka_unit_test(asking_can_be_cancelled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

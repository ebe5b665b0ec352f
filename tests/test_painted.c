/* A textured, rigged character through the tool: its colours from eight views against those of the input, where seams
 * are, compared with what copying from the nearest vertex gives; and what must come out of the file as it went in. */
#include "suite.h"
#include "loaded.h"
#include "quadwright/quadwright.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define FOLDER QW_BINARY_DIR "/painted"
enum { TEXELS = 1024, PIXELS = 320, VIEWS = 8 };

static uint8_t texels[3 * TEXELS * TEXELS];

static void run(const char *command)
{
    if (system(command) != 0) fail_msg("%s", command);
}

static int set_up(void **state)
{
    (void)state;
    run("mkdir -p " FOLDER);
    run(QW_BINARY_DIR "/quadwright-shapes dancer 20000 " FOLDER "/in.obj");
    run(QW_BINARY_DIR "/quadwright-painted " FOLDER "/in.obj " FOLDER "/in.glb " FOLDER "/in.png " FOLDER
                      "/in.rgb > " FOLDER "/said.txt");
    run(QW_BINARY_DIR "/quadwright -q " FOLDER "/in.glb -o " FOLDER "/out.glb --faces 4000");
    run(QW_BINARY_DIR "/quadwright -q " FOLDER "/in.glb -o " FOLDER "/kept.glb --faces 4000 --keep seams");
    FILE *file = fopen(FOLDER "/in.rgb", "rb");
    assert_non_null(file);
    assert_int_equal(fread(texels, 1, sizeof texels, file), sizeof texels);
    fclose(file);
    return 0;
}

static const qw_attribute *needed(const qw_mesh *mesh, const char *name)
{
    const qw_attribute *a = named(mesh, name);
    if (!a) fail_msg("there is no %s", name);
    return a;
}

/* ---- pictures */

typedef struct surface {
    qw_mesh_view view;
    const float *uv; /* float[corners][2]; v from below */
} surface;

typedef struct pixel {
    float depth; /* from the viewer; INFINITY: nothing */
    float rgb[3];
    uint32_t face;
} pixel;

static void sample(const double uv[2], float rgb[3])
{
    double x = fmin(fmax(uv[0] * TEXELS - 0.5, 0), TEXELS - 1.001),
           y = fmin(fmax((1 - uv[1]) * TEXELS - 0.5, 0), TEXELS - 1.001);
    int i = (int)x, j = (int)y;
    for (int c = 0; c < 3; c++) {
        double a = texels[3 * (j * TEXELS + i) + c], b = texels[3 * (j * TEXELS + i + 1) + c];
        double d = texels[3 * ((j + 1) * TEXELS + i) + c], e = texels[3 * ((j + 1) * TEXELS + i + 1) + c];
        rgb[c] = (float)((a + (b - a) * (x - i)) * (1 - (y - j)) + (d + (e - d) * (x - i)) * (y - j));
    }
}

/* Axes of a view: the diagonals of a cube. */
static void look(int view, double axis[3][3])
{
    const double k = sqrt(1 / 3.0);
    for (int i = 0; i < 3; i++) axis[2][i] = view >> i & 1 ? k : -k;
    double up[3] = {0, 1, 0}, along = axis[2][1], length = sqrt(1 - along * along);
    for (int i = 0; i < 3; i++) axis[1][i] = (up[i] - along * axis[2][i]) / length;
    for (int i = 0; i < 3; i++)
        axis[0][i] = axis[1][(i + 1) % 3] * axis[2][(i + 2) % 3] - axis[1][(i + 2) % 3] * axis[2][(i + 1) % 3];
}

static void draw_triangle(const surface *s, const uint32_t c[3], uint32_t face, double axis[3][3], double centre[3],
                          double scale, pixel *out)
{
    double p[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            p[k][i] = 0;
            for (int j = 0; j < 3; j++)
                p[k][i] += axis[i][j] * (s->view.positions[3 * (size_t)s->view.corners[c[k]] + (size_t)j] - centre[j]);
            if (i < 2) p[k][i] = PIXELS / 2.0 + scale * p[k][i];
        }
    double det = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]);
    int low[2], high[2];
    for (int i = 0; i < 2; i++) {
        low[i] = (int)fmax(0, fmin(p[0][i], fmin(p[1][i], p[2][i])));
        high[i] = (int)fmin(PIXELS - 1, fmax(p[0][i], fmax(p[1][i], p[2][i])));
    }
    for (int y = low[1]; y <= high[1] && det != 0; y++)
        for (int x = low[0]; x <= high[0]; x++) {
            double u = x + 0.5 - p[0][0], v = y + 0.5 - p[0][1], w[3], uv[2] = {0, 0}, depth = 0;
            w[1] = (u * (p[2][1] - p[0][1]) - v * (p[2][0] - p[0][0])) / det;
            w[2] = (v * (p[1][0] - p[0][0]) - u * (p[1][1] - p[0][1])) / det;
            w[0] = 1 - w[1] - w[2];
            if (fmin(w[0], fmin(w[1], w[2])) < 0) continue;
            for (int k = 0; k < 3; k++) {
                depth += w[k] * p[k][2];
                for (int i = 0; i < 2; i++) uv[i] += w[k] * (double)s->uv[2 * (size_t)c[k] + (size_t)i];
            }
            pixel *to = &out[y * PIXELS + x];
            if (depth >= (double)to->depth) continue;
            to->depth = (float)depth, to->face = face;
            sample(uv, to->rgb);
        }
}

static pixel *draw(const surface *s, int view, double centre[3], double scale)
{
    double axis[3][3];
    pixel *out = malloc(sizeof *out * PIXELS * PIXELS);
    look(view, axis);
    for (int i = 0; i < PIXELS * PIXELS; i++) out[i].depth = INFINITY;
    uint32_t n = s->view.uniform_face_size;
    for (uint32_t f = 0; f < s->view.face_count; f++)
        for (uint32_t k = 2; k < n; k++) {
            const uint32_t c[3] = {n * f, n * f + k - 1, n * f + k};
            draw_triangle(s, c, f, axis, centre, scale, out);
        }
    return out;
}

/* ---- nearest vertices, seams */

static double distance2(const double *p, const double *q)
{
    return (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) + (p[2] - q[2]) * (p[2] - q[2]);
}

/* float[corners][2]: each vertex has the coordinates of the nearest vertex of the input, where that has several those
 * of its first corner. */
static float *copy_nearest(const surface *in, const surface *out)
{
    uint32_t *first = malloc(in->view.vertex_count * sizeof *first), corners = 4 * out->view.face_count;
    float *of_vertex = malloc(2 * out->view.vertex_count * sizeof *of_vertex), *uv = malloc(2 * corners * sizeof *uv);
    for (uint32_t c = 3 * in->view.face_count; c-- > 0;) first[in->view.corners[c]] = c;
    for (uint32_t v = 0; v < out->view.vertex_count; v++) {
        double best = INFINITY;
        for (uint32_t w = 0; w < in->view.vertex_count; w++) {
            double d = distance2(out->view.positions + 3 * (size_t)v, in->view.positions + 3 * (size_t)w);
            if (d < best) best = d, memcpy(of_vertex + 2 * (size_t)v, in->uv + 2 * (size_t)first[w], 2 * sizeof *uv);
        }
    }
    for (uint32_t c = 0; c < corners; c++)
        memcpy(uv + 2 * (size_t)c, of_vertex + 2 * (size_t)out->view.corners[c], 2 * sizeof *uv);
    free(first), free(of_vertex);
    return uv;
}

/* bool[faces of out]: a vertex of the input that lies on a seam is within an edge of the middle. */
static bool *find_seam_quads(const surface *in, const surface *out)
{
    float *known = malloc(2 * in->view.vertex_count * sizeof *known);
    bool *has = calloc(in->view.vertex_count, 1), *seam = calloc(in->view.vertex_count, 1),
         *near = calloc(out->view.face_count, 1);
    for (uint32_t c = 0; c < 3 * in->view.face_count; c++) {
        uint32_t v = in->view.corners[c];
        if (has[v] && memcmp(known + 2 * (size_t)v, in->uv + 2 * (size_t)c, 2 * sizeof *known)) seam[v] = true;
        memcpy(known + 2 * (size_t)v, in->uv + 2 * (size_t)c, 2 * sizeof *known), has[v] = true;
    }
    for (uint32_t f = 0; f < out->view.face_count; f++) {
        const uint32_t *c = out->view.corners + 4 * (size_t)f;
        double middle[3] = {0, 0, 0},
               edge = distance2(out->view.positions + 3 * (size_t)c[0], out->view.positions + 3 * (size_t)c[1]);
        for (int k = 0; k < 12; k++) middle[k % 3] += out->view.positions[3 * (size_t)c[k / 3] + (size_t)(k % 3)] / 4;
        for (uint32_t v = 0; v < in->view.vertex_count && !near[f]; v++)
            near[f] = seam[v] && distance2(middle, in->view.positions + 3 * (size_t)v) < edge;
    }
    free(known), free(has), free(seam);
    return near;
}

/* Mean difference of colours, of 255, over all pixels and over those of quads at seams, where both show the same place.
 */
static void compare(const surface *in, const surface *out, const bool *at_seam, double *all, double *seams)
{
    double sum[2] = {0, 0}, count[2] = {0, 0}, centre[3] = {0, 0, 0}, size = 0;
    for (uint32_t v = 0; v < in->view.vertex_count; v++)
        for (int i = 0; i < 3; i++) centre[i] += in->view.positions[3 * (size_t)v + (size_t)i] / in->view.vertex_count;
    for (uint32_t v = 0; v < in->view.vertex_count; v++)
        size = fmax(size, sqrt(distance2(centre, in->view.positions + 3 * (size_t)v)));
    for (int view = 0; view < VIEWS; view++) {
        pixel *a = draw(in, view, centre, PIXELS / 2.0 / size), *b = draw(out, view, centre, PIXELS / 2.0 / size);
        for (int i = 0; i < PIXELS * PIXELS; i++) {
            if (!(fabsf(a[i].depth - b[i].depth) < 0.01f * (float)size)) continue;
            double difference = 0;
            for (int c = 0; c < 3; c++) difference += fabs((double)a[i].rgb[c] - (double)b[i].rgb[c]) / 3;
            for (int which = 0; which <= at_seam[b[i].face]; which++) sum[which] += difference, count[which]++;
        }
        free(a), free(b);
    }
    assert_true(count[0] > 20000 && count[1] > 4000 && count[1] < 0.8 * count[0]);
    *all = sum[0] / count[0], *seams = sum[1] / count[1];
}

static void colours_stay_where_they_are(void **state)
{
    (void)state;
    static const char *const paths[] = {FOLDER "/out.glb", FOLDER "/kept.glb"};
    static const double most[] = {0.1, 0.1};
    qw_mesh *before = load_file(FOLDER "/in.glb");
    surface in = {qw_mesh_get(before), needed(before, "uv")->values};
    assert_int_equal(in.view.uniform_face_size, 3);
    for (int i = 0; i < 2; i++) {
        qw_mesh *after = load_file(paths[i]);
        surface out = {qw_mesh_get(after), needed(after, "uv")->values};
        assert_int_equal(out.view.uniform_face_size, 4);
        float *copied = copy_nearest(&in, &out);
        surface copy = {out.view, copied};
        bool *at_seam = find_seam_quads(&in, &out);
        double ours[2], copies[2];
        compare(&in, &out, at_seam, &ours[0], &ours[1]);
        compare(&in, &copy, at_seam, &copies[0], &copies[1]);
        print_message(
            "%s: colours off by %.2f of 255 (%.2f at seams), copied from the nearest vertex %.2f (%.2f at seams)\n",
            paths[i], ours[0], ours[1], copies[0], copies[1]);
        assert_true(ours[1] < most[i] * copies[1]);
        free(copied), free(at_seam);
        qw_mesh_destroy(after);
    }
    qw_mesh_destroy(before);
}

/* ---- what passes */

typedef struct contents {
    char *bytes;
    size_t size;
} contents;

static contents read_whole(const char *path)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    contents c = {.size = (size_t)ftell(file)};
    rewind(file);
    c.bytes = malloc(c.size);
    assert_int_equal(fread(c.bytes, 1, c.size, file), c.size);
    fclose(file);
    return c;
}

static bool holds(const contents *c, const char *what, size_t size)
{
    for (size_t i = 0; i + size <= c->size; i++)
        if (memcmp(c->bytes + i, what, size) == 0) return true;
    return false;
}

static void the_rest_of_the_file_is_untouched(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "\"materials\":[{\"name\":\"paint\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":0},"
        "\"metallicFactor\":0,"
        "\"roughnessFactor\":0.8}}]",
        "\"textures\":[{\"source\":0,\"sampler\":0}]",
        "\"samplers\":[{\"magFilter\":9729,\"minFilter\":9729,\"wrapS\":33071,\"wrapT\":33071}]",
        "\"channels\":[{\"sampler\":0,\"target\":{\"node\":3,\"path\":\"rotation\"}}]",
        "\"skins\":[{\"joints\":[1,2,3,4,5],\"inverseBindMatrices\":",
        "{\"name\":\"middle\",\"children\":[2,3,4,5],\"translation\":",
        "\"extras\":{\"targetNames\":[\"Swell\"]},\"weights\":[0]"};
    contents in = read_whole(FOLDER "/in.glb"), out = read_whole(FOLDER "/out.glb"),
             picture = read_whole(FOLDER "/in.png");
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        if (!holds(&in, texts[i], strlen(texts[i])) || !holds(&out, texts[i], strlen(texts[i])))
            fail_msg("%s is not there", texts[i]);
    assert_true(holds(&in, picture.bytes, picture.size) && holds(&out, picture.bytes, picture.size));
    free(in.bytes), free(out.bytes), free(picture.bytes);
}

/* Weights sum to 1; the target moves the middle outward, and nothing far from it. */
static void rig_and_morph_target_come_along(void **state)
{
    (void)state;
    qw_mesh *before = load_file(FOLDER "/in.glb"), *after = load_file(FOLDER "/out.glb");
    const qw_attribute *weights = needed(after, "weights"), *was = needed(before, "weights"),
                       *swell = needed(after, "target:Swell"), *swelled = needed(before, "target:Swell");
    qw_mesh_view in = qw_mesh_get(before), out = qw_mesh_get(after);
    float most = 0, most_before = 0;
    assert_true(weights->components == 4 && weights->label_count == 5 && was->label_count == 5);
    for (uint32_t v = 0; v < out.vertex_count; v++) {
        float sum = 0, there[5] = {0}, here[5] = {0}, off = 0;
        double best = INFINITY;
        uint32_t nearest = 0;
        for (uint32_t w = 0; w < in.vertex_count; w++) {
            double d = distance2(out.positions + 3 * (size_t)v, in.positions + 3 * (size_t)w);
            if (d < best) best = d, nearest = w;
        }
        for (size_t k = 0; k < 4; k++) {
            sum += weights->values[4 * (size_t)v + k];
            here[weights->group[4 * (size_t)v + k]] += weights->values[4 * (size_t)v + k];
            there[was->group[4 * (size_t)nearest + k]] += was->values[4 * (size_t)nearest + k];
        }
        for (int k = 0; k < 5; k++) off = fmaxf(off, fabsf(here[k] - there[k]));
        assert_true(fabsf(sum - 1) < 1e-5f && off < 0.2f);
        for (size_t k = 0; k < 3; k++) most = fmaxf(most, fabsf(swell->values[3 * (size_t)v + k]));
        for (size_t k = 0; k < 3; k++)
            assert_true(fabsf(swell->values[3 * (size_t)v + k] - swelled->values[3 * (size_t)nearest + k]) < 0.02f);
    }
    for (uint32_t i = 0; i < 3 * in.vertex_count; i++) most_before = fmaxf(most_before, fabsf(swelled->values[i]));
    assert_true(most > 0.8f * most_before && most_before > 0.01f);
    qw_mesh_destroy(before), qw_mesh_destroy(after);
}

QW_TEST_SUITE(painted)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(colours_stay_where_they_are),
        cmocka_unit_test(the_rest_of_the_file_is_untouched),
        cmocka_unit_test(rig_and_morph_target_come_along),
    };
    return cmocka_run_group_tests(tests, set_up, NULL);
}

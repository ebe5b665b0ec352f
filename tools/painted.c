/* A textured, rigged character out of a plain surface: quadwright-painted IN.obj OUT.glb TEXELS.png [TEXELS.rgb]
 *
 * The surface is cut into charts that face along one axis each, which are packed into a square; into it a pattern is
 * painted that is a function of the place in space, so that it runs on across seams and any picture of the result can
 * be compared with the function. Five joints stand at the middle and at the ends of the figure; each vertex hangs on
 * the four nearest. A morph target swells the middle, and an animation turns a joint. What the attribute and glTF tests
 * remesh. */
#include "base/env.h"
#include "io/file.h"
#include "io/pen.h"
#include "base/elementary.h"
#include "io/pictures/picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXELS = 1024, MARGIN = 6, SMALLEST_CHART = 40, JOINTS = 5, INFLUENCES = 4, ROUNDS = 12 };

typedef struct figure {
    qw_env *env;
    const char *in, *out, *picture, *raw; /* raw: the picture as bytes; may be NULL */
    qw_mesh_view mesh;                    /* triangles */
    double least[3], most[3], size;       /* of the whole */
    float *normal;                        /* float[vertices][3] */
    uint32_t *neighbour; /* uint32_t[corners]: face beyond the edge from each corner to the next, or QW_NONE */
    uint8_t *axis;       /* uint8_t[faces]: 0 to 5: x, -x, y, ... */
    uint32_t *chart;     /* uint32_t[faces] */
    uint32_t charts;
    double (*box)[4];   /* of each chart: least u and v, width and height, in units of the surface */
    double (*place)[2]; /* its corner in the texture, texels */
    double texels;      /* a unit */
    uint8_t *rgb;       /* uint8_t[TEXELS][TEXELS][3] */
    double joint[JOINTS][3];
} figure;

static const double *at(const figure *f, uint32_t corner)
{
    return f->mesh.positions + 3 * (size_t)f->mesh.corners[corner];
}

/* ---- charts */

static void find_normals(figure *f)
{
    f->normal = QW_NEW_ZERO(f->env, float, 3 * (size_t)f->mesh.vertex_count);
    for (uint32_t c = 0; c < 3 * f->mesh.face_count; c += 3) {
        const double *p = at(f, c), *q = at(f, c + 1), *r = at(f, c + 2);
        for (int k = 0; k < 3; k++) {
            int i = (k + 1) % 3, j = (k + 2) % 3;
            double n = (q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]);
            for (uint32_t s = 0; s < 3; s++) f->normal[3 * (size_t)f->mesh.corners[c + s] + (size_t)k] += (float)n;
        }
    }
    for (uint32_t v = 0; v < f->mesh.vertex_count; v++) {
        float *n = f->normal + 3 * (size_t)v, length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (int k = 0; k < 3; k++) n[k] = length > 0 ? n[k] / length : k == 2;
    }
}

typedef struct side {
    uint64_t edge;
    uint32_t corner;
} side;

static int by_edge(const void *a, const void *b)
{
    const side *x = a, *y = b;
    return x->edge < y->edge ? -1 : x->edge > y->edge ? 1 : x->corner < y->corner ? -1 : x->corner > y->corner;
}

static void find_neighbours(figure *f)
{
    uint32_t corners = 3 * f->mesh.face_count;
    side *sides = QW_NEW(f->env, side, corners);
    f->neighbour = QW_NEW(f->env, uint32_t, corners);
    for (uint32_t c = 0; c < corners; c++) {
        uint32_t a = f->mesh.corners[c], b = f->mesh.corners[c - c % 3 + (c + 1) % 3];
        sides[c] = (side){(uint64_t)(a < b ? a : b) << 32 | (a < b ? b : a), c};
        f->neighbour[c] = QW_NONE;
    }
    qsort(sides, corners, sizeof *sides, by_edge);
    for (uint32_t i = 0; i + 1 < corners; i++)
        if (sides[i].edge == sides[i + 1].edge) {
            f->neighbour[sides[i].corner] = sides[i + 1].corner / 3;
            f->neighbour[sides[i + 1].corner] = sides[i].corner / 3;
        }
}

static uint8_t axis_of(const figure *f, uint32_t face)
{
    double n[3] = {0, 0, 0};
    for (uint32_t c = 3 * face; c < 3 * face + 3; c++)
        for (int k = 0; k < 3; k++) n[k] += (double)f->normal[3 * (size_t)f->mesh.corners[c] + (size_t)k];
    int best = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(n[k]) > fabs(n[best])) best = k;
    return (uint8_t)(2 * best + (n[best] < 0));
}

/* Numbers connected faces of one axis. size: uint32_t[charts], faces of each. */
static uint32_t *number_charts(figure *f)
{
    uint32_t faces = f->mesh.face_count, *stack = QW_NEW(f->env, uint32_t, faces),
             *size = QW_NEW_ZERO(f->env, uint32_t, faces);
    memset(f->chart, 0xff, faces * sizeof *f->chart);
    f->charts = 0;
    for (uint32_t first = 0; first < faces; first++) {
        if (f->chart[first] != QW_NONE) continue;
        uint32_t held = 0;
        stack[held++] = first, f->chart[first] = f->charts;
        while (held > 0) {
            uint32_t face = stack[--held];
            size[f->charts]++;
            for (uint32_t c = 3 * face; c < 3 * face + 3; c++) {
                uint32_t next = f->neighbour[c];
                if (next == QW_NONE || f->chart[next] != QW_NONE || f->axis[next] != f->axis[face]) continue;
                f->chart[next] = f->charts, stack[held++] = next;
            }
        }
        f->charts++;
    }
    qw_free(f->env, stack);
    return size;
}

/* Small charts join a neighbour. */
static void find_charts(figure *f)
{
    uint32_t faces = f->mesh.face_count;
    f->axis = QW_NEW(f->env, uint8_t, faces), f->chart = QW_NEW(f->env, uint32_t, faces);
    for (uint32_t i = 0; i < faces; i++) f->axis[i] = axis_of(f, i);
    uint32_t *size = number_charts(f);
    for (int round = 0; round < ROUNDS; round++) {
        for (uint32_t c = 0; c < 3 * faces; c++) {
            uint32_t here = f->chart[c / 3], next = f->neighbour[c];
            if (size[here] >= SMALLEST_CHART || next == QW_NONE || size[f->chart[next]] <= size[here]) continue;
            f->axis[c / 3] = f->axis[next];
        }
        qw_free(f->env, size);
        size = number_charts(f);
    }
}

static void project(const figure *f, uint32_t face, const double p[3], double uv[2])
{
    int k = f->axis[face] / 2;
    uv[0] = p[(k + 1) % 3], uv[1] = p[(k + 2) % 3];
    if (f->axis[face] % 2) uv[0] = -uv[0];
}

static void find_boxes(figure *f)
{
    f->box = qw_alloc(f->env, f->charts, sizeof *f->box);
    f->place = qw_alloc(f->env, f->charts, sizeof *f->place);
    for (uint32_t i = 0; i < f->charts; i++)
        for (int k = 0; k < 4; k++) f->box[i][k] = k < 2 ? 1e300 : -1e300;
    for (uint32_t c = 0; c < 3 * f->mesh.face_count; c++) {
        double uv[2], *box = f->box[f->chart[c / 3]];
        project(f, c / 3, at(f, c), uv);
        for (int k = 0; k < 2; k++) box[k] = fmin(box[k], uv[k]), box[2 + k] = fmax(box[2 + k], uv[k]);
    }
    for (uint32_t i = 0; i < f->charts; i++)
        for (int k = 0; k < 2; k++) f->box[i][2 + k] -= f->box[i][k];
}

static const figure *sorted; /* by qsort */
static int by_height(const void *a, const void *b)
{
    uint32_t i = *(const uint32_t *)a, j = *(const uint32_t *)b;
    double x = sorted->box[i][3], y = sorted->box[j][3];
    return x > y ? -1 : x < y ? 1 : i < j ? -1 : i > j;
}

/* In rows, the highest first. False where they do not fit at that size. */
static bool pack(figure *f, const uint32_t *order)
{
    double x = MARGIN, y = MARGIN, row = 0;
    for (uint32_t i = 0; i < f->charts; i++) {
        double w = f->box[order[i]][2] * f->texels + 2 * MARGIN, h = f->box[order[i]][3] * f->texels + 2 * MARGIN;
        if (x + w > TEXELS) x = MARGIN, y += row, row = 0;
        if (x + w > TEXELS || y + h > TEXELS) return false;
        f->place[order[i]][0] = x, f->place[order[i]][1] = y;
        x += w, row = fmax(row, h);
    }
    return true;
}

static void pack_charts(figure *f)
{
    uint32_t *order = QW_NEW(f->env, uint32_t, f->charts);
    for (uint32_t i = 0; i < f->charts; i++) order[i] = i;
    sorted = f;
    qsort(order, f->charts, sizeof *order, by_height);
    f->texels = 2 * TEXELS / f->size;
    while (!pack(f, order)) f->texels *= 0.98;
}

/* In texels, the second downward. */
static void texel_of(const figure *f, uint32_t corner, double uv[2])
{
    uint32_t face = corner / 3, i = f->chart[face];
    project(f, face, at(f, corner), uv);
    for (int k = 0; k < 2; k++) uv[k] = f->place[i][k] + (uv[k] - f->box[i][k]) * f->texels;
}

/* ---- the picture */

/* The pattern at a place, 0 to 255: hues that drift through space, and rings. */
static void paint(const figure *f, const double p[3], uint8_t rgb[3])
{
    double x[3];
    for (int k = 0; k < 3; k++) x[k] = (p[k] - f->least[k]) / f->size;
    double ring = qw_sin(60 * x[1] + 3 * qw_sin(11 * x[0]) + 3 * qw_cos(9 * x[2]));
    for (int k = 0; k < 3; k++) {
        double hue = 0.5 + 0.4 * qw_sin(13 * x[0] - 7 * x[2] + 9 * x[1] + 2.1 * k);
        double value = hue * (0.75 + 0.25 * ring);
        rgb[k] = (uint8_t)(255 * fmin(fmax(value, 0), 1) + 0.5);
    }
}

static void bake_face(figure *f, uint32_t face, uint8_t *known)
{
    double t[3][2], low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (uint32_t s = 0; s < 3; s++) {
        texel_of(f, 3 * face + s, t[s]);
        for (int k = 0; k < 2; k++) low[k] = fmin(low[k], t[s][k]), high[k] = fmax(high[k], t[s][k]);
    }
    double det = (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]);
    for (int y = (int)low[1]; y <= (int)high[1] && det != 0; y++)
        for (int x = (int)low[0]; x <= (int)high[0]; x++) {
            double u = x + 0.5 - t[0][0], v = y + 0.5 - t[0][1], w[3], p[3] = {0, 0, 0};
            w[1] = (u * (t[2][1] - t[0][1]) - v * (t[2][0] - t[0][0])) / det;
            w[2] = (v * (t[1][0] - t[0][0]) - u * (t[1][1] - t[0][1])) / det;
            w[0] = 1 - w[1] - w[2];
            if (fmin(w[0], fmin(w[1], w[2])) < -1e-9 || x < 0 || y < 0 || x >= TEXELS || y >= TEXELS) continue;
            for (uint32_t s = 0; s < 3; s++)
                for (int k = 0; k < 3; k++) p[k] += w[s] * at(f, 3 * face + s)[k];
            paint(f, p, f->rgb + 3 * ((size_t)y * TEXELS + (size_t)x));
            known[(size_t)y * TEXELS + (size_t)x] = 1;
        }
}

/* What lies beside a chart takes its colours, so that blending at its rim finds no other. */
static void spread(figure *f, uint8_t *known)
{
    for (uint8_t round = 1; round <= MARGIN; round++)
        for (int y = 0; y < TEXELS; y++)
            for (int x = 0; x < TEXELS; x++) {
                int sum[3] = {0, 0, 0}, count = 0;
                if (known[y * TEXELS + x]) continue;
                for (int j = y - 1; j <= y + 1; j++)
                    for (int i = x - 1; i <= x + 1; i++) {
                        if (i < 0 || j < 0 || i >= TEXELS || j >= TEXELS) continue;
                        uint8_t k = known[j * TEXELS + i];
                        if (k == 0 || k > round) continue;
                        for (int c = 0; c < 3; c++) sum[c] += f->rgb[3 * (j * TEXELS + i) + c];
                        count++;
                    }
                if (count == 0) continue;
                for (int c = 0; c < 3; c++) f->rgb[3 * (y * TEXELS + x) + c] = (uint8_t)(sum[c] / count);
                known[y * TEXELS + x] = (uint8_t)(round + 1);
            }
}

static void bake(figure *f)
{
    f->rgb = QW_NEW_ZERO(f->env, uint8_t, 3 * (size_t)TEXELS * TEXELS);
    uint8_t *known = QW_NEW_ZERO(f->env, uint8_t, (size_t)TEXELS * TEXELS);
    for (uint32_t i = 0; i < f->mesh.face_count; i++) bake_face(f, i, known);
    spread(f, known);
    qw_picture picture = {TEXELS, TEXELS, 3, 8, f->rgb};
    qw_write_png(f->env, f->picture, &picture);
    if (!f->raw) return;
    qw_file *raw = qw_file_begin(f->env, f->raw);
    qw_file_put(raw, f->rgb, 3 * (size_t)TEXELS * TEXELS);
    qw_file_finish(raw);
}

/* ---- the rig */

/* The middle, and the vertices that are farthest out along x and y. */
static void find_joints(figure *f)
{
    static const int along[JOINTS] = {-1, 0, 0, 1, 1};
    for (int j = 0; j < JOINTS; j++) {
        double best = -1e300;
        for (int k = 0; k < 3 && j == 0; k++) f->joint[j][k] = (f->least[k] + f->most[k]) / 2;
        for (uint32_t v = 0; v < f->mesh.vertex_count && j > 0; v++) {
            const double *p = f->mesh.positions + 3 * (size_t)v;
            double far = j % 2 ? p[along[j]] : -p[along[j]];
            if (far > best) best = far, memcpy(f->joint[j], p, sizeof f->joint[j]);
        }
    }
}

/* The four nearest joints, by the fourth power of the distance. */
static void hang(const figure *f, const double p[3], uint8_t joint[INFLUENCES], float weight[INFLUENCES])
{
    double pull[JOINTS], sum = 0;
    int weakest = 0, n = 0;
    for (int j = 0; j < JOINTS; j++) {
        double d = 0;
        for (int k = 0; k < 3; k++) d += (p[k] - f->joint[j][k]) * (p[k] - f->joint[j][k]);
        pull[j] = 1 / (d * d / (f->size * f->size * f->size * f->size) + 1e-9);
        if (pull[j] < pull[weakest]) weakest = j;
    }
    for (int j = 0; j < JOINTS; j++) sum += j == weakest ? 0 : pull[j];
    for (int j = 0; j < JOINTS; j++)
        if (j != weakest) joint[n] = (uint8_t)j, weight[n++] = (float)(pull[j] / sum);
}

/* ---- the file */

typedef struct file {
    qw_pen bytes, views, accessors;
    uint32_t count;
} file;

static void put_floats(file *o, const float *value, size_t count)
{
    qw_pen_put(&o->bytes, value, count * sizeof *value);
}

/* One view and accessor of what was put since `begin`. */
static uint32_t end_view(file *o, size_t begin, int type, size_t count, const char *kind, const char *more)
{
    qw_pen_print(&o->views, "%s{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu}", o->count ? "," : "", begin,
                 o->bytes.size - begin);
    if (kind)
        qw_pen_print(&o->accessors, "%s{\"bufferView\":%u,\"componentType\":%d,\"count\":%zu,\"type\":\"%s\"%s}",
                     o->count ? "," : "", o->count, type, count, kind, more);
    qw_pen_align(&o->bytes, 4, 0);
    return o->count++;
}

static void put_vertices(figure *f, file *o)
{
    uint32_t corners = 3 * f->mesh.face_count;
    char more[256];
    for (int what = 0; what < 4; what++) {
        float low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
        size_t begin = o->bytes.size;
        for (uint32_t c = 0; c < corners; c++) {
            const double *p = at(f, c);
            const float *n = f->normal + 3 * (size_t)f->mesh.corners[c];
            double uv[2], middle = 0;
            float value[3];
            texel_of(f, c, uv);
            for (int k = 0; k < 3; k++)
                middle += (p[k] - f->joint[0][k]) * (p[k] - f->joint[0][k]) / (f->size * f->size);
            for (int k = 0; k < 3; k++) {
                if (what == 0) value[k] = (float)p[k];
                if (what == 1) value[k] = n[k];
                if (what == 2 && k < 2) value[k] = (float)(uv[k] / TEXELS);
                if (what == 3) value[k] = (float)(fmax(0, 0.03 - middle) * f->size) * n[k];
                if (what == 0 || what == 3) low[k] = fminf(low[k], value[k]), high[k] = fmaxf(high[k], value[k]);
            }
            put_floats(o, value, what == 2 ? 2 : 3);
        }
        snprintf(more, sizeof more, ",\"min\":[%.9g,%.9g,%.9g],\"max\":[%.9g,%.9g,%.9g]", (double)low[0],
                 (double)low[1], (double)low[2], (double)high[0], (double)high[1], (double)high[2]);
        end_view(o, begin, 5126, corners, what == 2 ? "VEC2" : "VEC3", what % 3 ? "" : more);
    }
    for (int what = 0; what < 2; what++) {
        size_t begin = o->bytes.size;
        for (uint32_t c = 0; c < corners; c++) {
            uint8_t joint[INFLUENCES];
            float weight[INFLUENCES];
            hang(f, at(f, c), joint, weight);
            if (what) put_floats(o, weight, INFLUENCES);
            else qw_pen_put(&o->bytes, joint, INFLUENCES);
        }
        end_view(o, begin, what ? 5126 : 5121, corners, "VEC4", "");
    }
}

static void put_rig(figure *f, file *o)
{
    size_t begin = o->bytes.size;
    for (int j = 0; j < JOINTS; j++) {
        float m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        for (int k = 0; k < 3; k++) m[12 + k] = (float)-f->joint[j][k];
        put_floats(o, m, 16);
    }
    end_view(o, begin, 5126, JOINTS, "MAT4", "");
    static const float times[] = {0, 1, 2}, turns[] = {0, 0, 0, 1, 0, 0, 0.6f, 0.8f, 0, 0, 0, 1};
    begin = o->bytes.size;
    put_floats(o, times, 3);
    end_view(o, begin, 5126, 3, "SCALAR", ",\"min\":[0],\"max\":[2]");
    begin = o->bytes.size;
    put_floats(o, turns, 12);
    end_view(o, begin, 5126, 3, "VEC4", "");
}

static void put_nodes(const figure *f, qw_pen *out)
{
    qw_pen_text(out,
                "\"scene\":0,\"scenes\":[{\"nodes\":[0,1]}],\"nodes\":[{\"name\":\"figure\",\"mesh\":0,\"skin\":0},"
                "{\"name\":\"middle\",\"children\":[2,3,4,5],\"translation\":");
    for (int j = 0; j < JOINTS; j++) {
        if (j) qw_pen_print(out, "},{\"name\":\"end %d\",\"translation\":", j);
        for (int k = 0; k < 3; k++) {
            qw_pen_text(out, k ? "," : "[");
            qw_pen_number(out, (double)(float)(f->joint[j][k] - (j ? f->joint[0][k] : 0)));
        }
        qw_pen_text(out, "]");
    }
    qw_pen_text(out, "}],");
}

static void put_glb(figure *f)
{
    file o = {.bytes = {.env = f->env}, .views = {.env = f->env}, .accessors = {.env = f->env}};
    put_vertices(f, &o);
    put_rig(f, &o);
    qw_bytes png = qw_file_read(f->env, f->picture, f->picture);
    size_t begin = o.bytes.size;
    qw_pen_put(&o.bytes, png.at, png.size);
    uint32_t image = end_view(&o, begin, 0, 0, NULL, "");
    qw_pen json = {.env = f->env};
    qw_pen_text(&json, "{\"asset\":{\"version\":\"2.0\",\"generator\":\"quadwright-painted\"},");
    put_nodes(f, &json);
    qw_pen_text(
        &json,
        "\"meshes\":[{\"name\":\"figure\",\"extras\":{\"targetNames\":[\"Swell\"]},\"weights\":[0],\"primitives\":[{"
        "\"attributes\":{"
        "\"POSITION\":0,\"NORMAL\":1,\"TEXCOORD_0\":2,\"JOINTS_0\":4,\"WEIGHTS_0\":5},\"targets\":[{\"POSITION\":3}],"
        "\"material\":0}]}],");
    qw_pen_text(
        &json,
        "\"skins\":[{\"joints\":[1,2,3,4,5],\"inverseBindMatrices\":6}],\"animations\":[{\"name\":\"wave\","
        "\"channels\":"
        "[{\"sampler\":0,\"target\":{\"node\":3,\"path\":\"rotation\"}}],\"samplers\":[{\"input\":7,\"output\":8}]}],");
    qw_pen_print(&json, "\"materials\":[{\"name\":\"paint\",\"pbrMetallicRoughness\":{\"baseColorTexture\":{\"index\":"
                        "0},\"metallicFactor\":0,"
                        "\"roughnessFactor\":0.8}}],\"textures\":[{\"source\":0,\"sampler\":0}],");
    qw_pen_print(&json,
                 "\"samplers\":[{\"magFilter\":9729,\"minFilter\":9729,\"wrapS\":33071,\"wrapT\":33071}],"
                 "\"images\":[{\"name\":\"paint\",\"bufferView\":%u,\"mimeType\":\"image/png\"}],",
                 image);
    qw_pen_text(&json, "\"accessors\":["), qw_pen_put(&json, o.accessors.at, o.accessors.size);
    qw_pen_text(&json, "],\"bufferViews\":["), qw_pen_put(&json, o.views.at, o.views.size);
    qw_pen_print(&json, "],\"buffers\":[{\"byteLength\":%zu}]}", o.bytes.size);
    qw_pen_align(&json, 4, ' ');
    const uint32_t words[] = {0x46546c67, 2, (uint32_t)(28 + json.size + o.bytes.size), (uint32_t)json.size,
                              0x4e4f534a},
                   tail[] = {(uint32_t)o.bytes.size, 0x004e4942};
    qw_file *target = qw_file_begin(f->env, f->out);
    qw_file_put(target, words, sizeof words);
    qw_file_put(target, json.at, json.size);
    qw_file_put(target, tail, sizeof tail);
    qw_file_put(target, o.bytes.at, o.bytes.size);
    qw_file_finish(target);
}

static void make(void *user)
{
    figure *f = user;
    for (int k = 0; k < 3; k++) f->least[k] = 1e300, f->most[k] = -1e300;
    for (size_t i = 0; i < 3 * (size_t)f->mesh.vertex_count; i++) {
        f->least[i % 3] = fmin(f->least[i % 3], f->mesh.positions[i]);
        f->most[i % 3] = fmax(f->most[i % 3], f->mesh.positions[i]);
    }
    for (int k = 0; k < 3; k++) f->size = fmax(f->size, f->most[k] - f->least[k]);
    find_normals(f);
    find_neighbours(f);
    find_charts(f);
    find_boxes(f);
    pack_charts(f);
    bake(f);
    find_joints(f);
    put_glb(f);
    printf("%u triangles in %u charts, %.0f texels across\n", f->mesh.face_count, f->charts, f->texels * f->size);
}

int main(int argc, char **argv)
{
    qw_mesh *mesh = NULL;
    if (argc != 4 && argc != 5) {
        fputs("usage: quadwright-painted IN.obj OUT.glb TEXELS.png [TEXELS.rgb]\n", stderr);
        return 2;
    }
    figure f = {.env = qw_env_create(NULL, 1), .in = argv[1], .out = argv[2], .picture = argv[3], .raw = argv[4]};
    qw_status status = f.env ? qw_load(f.in, NULL, &mesh) : QW_MEMORY;
    f.mesh = qw_mesh_get(mesh);
    if (status != QW_OK) fprintf(stderr, "quadwright-painted: %s\n", qw_mesh_message(mesh));
    else if (f.mesh.uniform_face_size != 3)
        fputs("quadwright-painted: not all faces are triangles\n", stderr), status = QW_ARGUMENT;
    else if ((status = qw_protect(f.env, make, &f)) != QW_OK)
        fprintf(stderr, "quadwright-painted: %s\n", qw_env_message(f.env));
    qw_mesh_destroy(mesh);
    qw_env_destroy(f.env);
    return qw_status_exit_code(status);
}

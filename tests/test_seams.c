/* Seams as a person cuts them: along lines of quads, tubes once, straight where rows are; and what is baked on both
 * sides of a seam is the same. */
#include "products/atlas/atlas.h"
#include "products/bake/maps.h"
#include "products/bake/shading.h"
#include "quad_shapes.h"
#include "suite.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

typedef struct job {
    qw_env *env;
    quad_shape shape;
    qw_atlas_mesh mesh;
    qw_atlas atlas;
    uint32_t margin, texels;
} job;

static void protect(void (*body)(void *user), job *j)
{
    j->env = qw_env_create(NULL, 2);
    if (qw_protect(j->env, body, j) != QW_OK) fail_msg("%s", qw_env_message(j->env));
    qw_env_destroy(j->env);
    quad_shape_free(&j->shape);
}

static void unwrap(job *j)
{
    qw_mesh_view view = quad_shape_view(&j->shape);
    j->mesh = qw_atlas_mesh_of(j->env, &view, NULL, 0, NULL);
    const qw_atlas_options options = {.most_stretch = 1.35,
                                      .pack = {.texels = j->texels, .margin = j->margin, .tiles = 1}};
    j->atlas = qw_make_atlas(j->env, &j->mesh, &options);
    assert_int_equal(j->atlas.overlapping, 0);
}

/* ---- where seams lie */

/* The seam that goes straight on where seam c ends, across a vertex of four quads; QW_NONE: none does. */
static uint32_t straight_seam(const qw_atlas_mesh *m, uint32_t c)
{
    uint32_t n = qw_atlas_next(m, c), t = m->twin[n], on = t == QW_NONE ? QW_NONE : qw_atlas_next(m, t), quads = 0;
    if (on == QW_NONE || !m->seam[on] || m->twin[on] == QW_NONE) return QW_NONE;
    for (uint32_t at = n; quads < 5; quads++) {
        at = qw_atlas_turn(m, at);
        if (at == QW_NONE) return QW_NONE;
        if (at == n) break;
    }
    return quads == 3 ? on : QW_NONE;
}

/* Share of the seams' length in rows of four and more. */
static double share_on_lines(const qw_atlas_mesh *m)
{
    double all = 0, good = 0;
    for (uint32_t c = 0; c < m->corner_count; c++) {
        if (!m->seam[c] || m->twin[c] == QW_NONE) continue;
        uint32_t row = 1;
        const uint32_t begin[2] = {c, m->twin[c]};
        for (int side = 0; side < 2; side++)
            for (uint32_t at = begin[side]; row < 4 && (at = straight_seam(m, at)) != QW_NONE;) row++;
        all += qw_atlas_edge_length(m, c), good += row >= 4 ? qw_atlas_edge_length(m, c) : 0;
    }
    return all > 0 ? good / all : 1;
}

static void cut_along_lines(void *user)
{
    job *j = user;
    unwrap(j);
    double share = share_on_lines(&j->mesh);
    if (share < 0.8) fail_msg("%.2f of the seams on lines", share);
}
static void seams_on_lines(void **state)
{
    (void)state;
    for (int shape = 0; shape < 3; shape++) {
        job j = {.texels = 512, .margin = 4};
        j.shape = shape == 0 ? quad_sphere(16) : quad_sheet(32, shape == 1 ? 16 : 24, 1, shape == 1, 0);
        protect(cut_along_lines, &j);
    }
}

/* A tube that bulges, and is bent by a quarter: the way a limb is. */
static quad_shape limb(uint32_t around, uint32_t along)
{
    quad_shape s = quad_sheet(around, along, 1, 0, 0);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        double *p = s.position + 3 * (size_t)v, t = p[2], r = 0.12 + 0.04 * sin(6 * t), a = 0.9 * t;
        double x = r * p[0], y = r * p[1];
        p[0] = (1 + x) * cos(a), p[1] = y, p[2] = (1 + x) * sin(a);
    }
    return s;
}

/* One chart, one seam along it from end to end, and that on a line of the texture on both sides. */
static void cut_limb(void *user)
{
    job *j = user;
    unwrap(j);
    const qw_atlas_mesh *m = &j->mesh;
    uint32_t seams = 0;
    assert_int_equal(j->atlas.charts, 1);
    for (uint32_t c = 0; c < m->corner_count; c++) {
        const float *p = j->atlas.uv + 2 * (size_t)c, *q = j->atlas.uv + 2 * (size_t)qw_atlas_next(m, c);
        if (!m->seam[c] || m->twin[c] == QW_NONE) continue;
        double x = fabs((double)(q[0] - p[0])), y = fabs((double)(q[1] - p[1])), angle = atan2(fmin(x, y), fmax(x, y));
        if (angle > 0.07) fail_msg("an edge of the seam lies %.1f degrees off its line", angle * 180 / 3.14159265);
        seams++;
    }
    assert_int_equal(seams, 2 * 40);
}
static void limbs_are_cut_once(void **state)
{
    (void)state;
    job j = {.shape = limb(20, 40), .texels = 512, .margin = 4};
    protect(cut_limb, &j);
}

/* ---- what is baked on both sides of them */

/* A sphere with low waves, its triangles shaded smooth, to be baked onto the round one. */
static qw_look wavy_sphere(qw_env *env)
{
    quad_shape s = quad_sphere(24);
    uint32_t faces = 2 * s.face_count;
    qw_vec3 *position = QW_NEW(env, qw_vec3, s.vertex_count), *normal = QW_NEW_ZERO(env, qw_vec3, faces);
    uint32_t *corner = QW_NEW(env, uint32_t, 3 * (size_t)faces), *face = QW_NEW_ZERO(env, uint32_t, faces);
    for (uint32_t v = 0; v < s.vertex_count; v++) {
        const double *p = s.position + 3 * (size_t)v;
        double r = 1 + 0.03 * sin(3 * p[0] + 1) * cos(2 * p[1]) + 0.02 * sin(2 * p[2]);
        position[v] = qw_v3((float)(r * p[0]), (float)(r * p[1]), (float)(r * p[2]));
    }
    for (uint32_t f = 0; f < s.face_count; f++) {
        const uint32_t *q = s.corner + 4 * (size_t)f, both[6] = {q[0], q[1], q[2], q[0], q[2], q[3]};
        memcpy(corner + 6 * (size_t)f, both, sizeof both);
    }
    quad_shape_free(&s);
    qw_source *source = QW_NEW_ZERO(env, qw_source, 1);
    qw_clean_input *input = QW_NEW_ZERO(env, qw_clean_input, 1);
    source->mesh =
        (qw_trimesh){.vertex_count = s.vertex_count, .face_count = faces, .position = position, .corner = corner};
    for (uint32_t f = 0; f < faces; f++) normal[f] = qw_normalize(qw_face_cross(&source->mesh, f));
    *input = (qw_clean_input){.vertex_count = s.vertex_count, .face_count = faces, .corner = corner};
    source->input = input, source->face = face, source->normal = normal;
    source->bvh = qw_bvh_build(env, &source->mesh), source->corner = QW_NEW(env, uint32_t, 3 * (size_t)faces);
    for (uint32_t h = 0; h < 3 * faces; h++) source->corner[h] = h;
    static const qw_material_list none = {0}; /* the look keeps it */
    return qw_begin_look(env, source, NULL, 0, false, &none, NULL);
}

/* A picture's texels as numbers, and each level half as large as the one before. */
typedef struct level {
    double *texel; /* double[side][side][channels] */
    uint32_t side, channels;
} level;

static level first_level(qw_env *env, const qw_picture *p)
{
    level l = {QW_NEW(env, double, (size_t)p->width * p->height * p->channels), p->width, p->channels};
    for (size_t i = 0; i < (size_t)p->width * p->height * p->channels; i++)
        l.texel[i] = p->bits == 8 ? ((const uint8_t *)p->pixels)[i] : ((const uint16_t *)p->pixels)[i] / 257.0;
    return l;
}

static level next_level(qw_env *env, const level *l)
{
    level n = {QW_NEW_ZERO(env, double, (size_t)l->side * l->side / 4 * l->channels), l->side / 2, l->channels};
    for (uint32_t y = 0; y < l->side; y++)
        for (uint32_t x = 0; x < l->side; x++)
            for (uint32_t c = 0; c < l->channels; c++)
                n.texel[((size_t)(y / 2) * n.side + x / 2) * n.channels + c] +=
                    l->texel[((size_t)y * l->side + x) * l->channels + c] / 4;
    return n;
}

static double sample(const level *l, const double uv[2], uint32_t channel)
{
    double x = uv[0] * l->side - 0.5, y = (1 - uv[1]) * l->side - 0.5, sum = 0;
    for (int i = 0; i < 4; i++) {
        double px = floor(x) + (i & 1), py = floor(y) + (i >> 1), w = (1 - fabs(px - x)) * (1 - fabs(py - y));
        px = fmax(0, fmin(l->side - 1, px)), py = fmax(0, fmin(l->side - 1, py));
        sum += w * l->texel[((size_t)py * l->side + (size_t)px) * l->channels + channel];
    }
    return sum;
}

/* The normal that the map has on edge c, so far along it. */
static qw_vec3 normal_at(const qw_bake_target *t, const level *l, uint32_t c, uint32_t next, double along)
{
    double uv[2], n[3];
    for (int r = 0; r < 2; r++)
        uv[r] = (1 - along) * (double)t->uv[2 * (size_t)c + (size_t)r] +
                along * (double)t->uv[2 * (size_t)next + (size_t)r];
    for (uint32_t k = 0; k < 3; k++) n[k] = sample(l, uv, k) / 127.5 - 1;
    const float *a = t->tangent + 4 * (size_t)c, *b = t->tangent + 4 * (size_t)next;
    const float *p = t->normal + 3 * (size_t)c, *q = t->normal + 3 * (size_t)next;
    float s = (float)along;
    qw_vec3 tangent = qw_v3(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), a[2] + s * (b[2] - a[2]));
    qw_vec3 normal = qw_v3(p[0] + s * (q[0] - p[0]), p[1] + s * (q[1] - p[1]), p[2] + s * (q[2] - p[2]));
    qw_vec3 across = qw_scale(qw_cross(normal, tangent), a[3]);
    qw_vec3 sum = qw_add(qw_scale(tangent, (float)n[0]), qw_scale(across, (float)n[1]));
    return qw_normalize(qw_madd(sum, (float)n[2], normal));
}

typedef struct agreement {
    double mean[4], most[4]; /* how much heights differ across seams, of 255, in each level */
    double angle;            /* by how much normals do at most, degrees */
    uint32_t count;
} agreement;

static void compare_sides(const job *j, const qw_bake_target *t, const level *height, const level *normal, agreement *a)
{
    const qw_atlas_mesh *m = &j->mesh;
    *a = (agreement){.count = 0};
    for (uint32_t c = 0; c < m->corner_count; c++) {
        uint32_t w = m->twin[c], cn = qw_atlas_next(m, c);
        if (!m->seam[c] || w < c) continue;
        uint32_t wn = qw_atlas_next(m, w);
        for (int i = 1; i < 4; i++, a->count++) {
            double along = i / 4.0, here[2], there[2];
            for (size_t r = 0; r < 2; r++) {
                here[r] = (1 - along) * (double)t->uv[2 * (size_t)c + r] + along * (double)t->uv[2 * (size_t)cn + r];
                there[r] = (1 - along) * (double)t->uv[2 * (size_t)wn + r] + along * (double)t->uv[2 * (size_t)w + r];
            }
            for (int k = 0; k < 4; k++) {
                double d = fabs(sample(&height[k], here, 0) - sample(&height[k], there, 0));
                a->mean[k] += d, a->most[k] = fmax(a->most[k], d);
            }
            double cosine = (double)qw_dot(normal_at(t, normal, c, cn, along), normal_at(t, normal, wn, w, along));
            a->angle = fmax(a->angle, acos(fmin(1, cosine)) * 180 / 3.14159265);
        }
    }
    assert_true(a->count > 0);
    for (int k = 0; k < 4; k++) a->mean[k] /= a->count;
}

static agreement bake_sphere(job *j, uint32_t pad)
{
    qw_env *env = j->env;
    unwrap(j);
    const qw_atlas_mesh *m = &j->mesh;
    qw_vec3 *place = QW_NEW(env, qw_vec3, m->corner_count);
    float *normal = QW_NEW(env, float, 3 * (size_t)m->corner_count);
    for (uint32_t c = 0; c < m->corner_count; c++) {
        const double *p = m->position + 3 * (size_t)m->corner[c];
        place[c] = qw_v3((float)p[0], (float)p[1], (float)p[2]);
        for (int k = 0; k < 3; k++) normal[3 * (size_t)c + (size_t)k] = (float)p[k];
    }
    qw_bake_target target = {.corner_count = m->corner_count,
                             .face_count = m->face_count,
                             .begin = m->begin,
                             .vertex = m->corner,
                             .twin = m->twin,
                             .place = place,
                             .aim = normal,
                             .normal = normal,
                             .uv = j->atlas.uv};
    qw_look look = wavy_sphere(env);
    qw_bake_target_begin(env, &target);
    float far = qw_bake_target_cage(env, &target, look.source, 0.2f);
    qw_maps maps = qw_bake_maps(env, &target, &look, 1 << QW_MAP_NORMAL | 1 << QW_MAP_HEIGHT, 1, j->texels, 2, pad,
                                far);
    level height[4], bent = first_level(env, &maps.picture[QW_MAP_NORMAL]);
    height[0] = first_level(env, &maps.picture[QW_MAP_HEIGHT]);
    for (int k = 1; k < 4; k++) height[k] = next_level(env, &height[k - 1]);
    agreement a;
    compare_sides(j, &target, height, &bent, &a);
    return a;
}

/* With so wide a margin three levels show no seam; without what is filled around charts all do. */
static void bake_seams(void *user)
{
    job *j = user;
    agreement a = bake_sphere(j, j->margin), bare = bake_sphere(j, 0);
    for (int k = 0; k < 4; k++)
        if (a.mean[k] > 1 || a.most[k] > 1.2 * (k + 1))
            fail_msg("level %d: %.2f, at most %.2f", k, a.mean[k], a.most[k]);
    assert_true(bare.mean[0] > 4 * a.mean[0] && bare.most[0] > 4 * a.most[0]);
    if (a.angle > 1.2) fail_msg("normals differ by %.2f degrees", a.angle);
}
static void sides_agree(void **state)
{
    (void)state;
    job j = {.shape = quad_sphere(12), .texels = 512, .margin = 16};
    protect(bake_seams, &j);
}

QW_TEST_SUITE(seams)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(seams_on_lines),
        cmocka_unit_test(limbs_are_cut_once),
        cmocka_unit_test(sides_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

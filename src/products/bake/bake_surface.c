#include "products/bake/bake_surface.h"

#include "base/elementary.h"
#include "base/groups.h"

#include <stdio.h>
#include <string.h>

static const float SMOOTH = 0.5f; /* faces whose normals have this cosine, or more, share a normal at a vertex */

static double from_srgb(double x)
{
    return x <= 0 ? 0 : x >= 1 ? 1 : x <= 0.04045 ? x / 12.92 : qw_pow((x + 0.055) / 1.055, 2.4);
}
double qw_to_srgb(double x)
{
    return x <= 0 ? 0 : x >= 1 ? 1 : x <= 0.0031308 ? 12.92 * x : 1.055 * qw_pow(x, 1 / 2.4) - 0.055;
}

/* ---- normals */

typedef struct normal_search {
    qw_look *look;
    const uint32_t *first, *corner; /* half-edges from each vertex: corner[first[v]] .. corner[first[v + 1] - 1] */
    float *angle;                   /* float[3 faces]: in radians, at the corners */
} normal_search;

static void find_some_angles(void *user, uint32_t begin, uint32_t end)
{
    const normal_search *s = user;
    const qw_trimesh *m = &s->look->source->mesh;
    for (uint32_t h = 3 * begin; h < 3 * end; h++) s->angle[h] = (float)qw_corner_angle(m->position, m->corner, h);
}

/* At each corner the mean of the faces around its vertex that face nearly as its own, by their angles there: so a
   surface looks the same however it is cut into triangles, and as programs for pictures show it. */
static void find_some_normals(void *user, uint32_t begin, uint32_t end)
{
    const normal_search *s = user;
    const qw_trimesh *m = &s->look->source->mesh;
    for (uint32_t f = begin; f < end; f++)
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
            qw_vec3 own = s->look->source->normal[f], sum = qw_v3(0, 0, 0);
            for (uint32_t k = s->first[m->corner[h]]; k < s->first[m->corner[h] + 1]; k++)
                if (qw_dot(s->look->source->normal[s->corner[k] / 3], own) >= SMOOTH)
                    sum = qw_madd(sum, s->angle[s->corner[k]], s->look->source->normal[s->corner[k] / 3]);
            sum = qw_normalize(sum);
            s->look->normal[h] = qw_length2(sum) > 0 ? sum : own;
        }
}

static void find_normals(qw_env *env, qw_look *l)
{
    const qw_trimesh *m = &l->source->mesh;
    uint32_t *first, *corner = qw_group(env, m->corner, 3 * m->face_count, m->vertex_count, &first);
    normal_search s = {l, first, corner, QW_NEW(env, float, 3 * (size_t)m->face_count)};
    qw_parallel(env, m->face_count, QW_GRAIN_LIGHT, find_some_angles, &s);
    qw_parallel(env, m->face_count, QW_GRAIN_LIGHT, find_some_normals, &s);
    qw_free(env, s.angle), qw_free(env, corner), qw_free(env, first);
}

/* Those that the input has, on the side that the result faces. */
static void take_normals(qw_look *l, const qw_attribute *a)
{
    const qw_source *s = l->source;
    for (uint32_t h = 0; h < 3 * s->mesh.face_count; h++) {
        const float *v = a->values + 3 * qw_element_of(s, a->domain, h / 3, h % 3);
        qw_vec3 n = qw_normalize(qw_v3(v[0], v[1], v[2])), own = s->normal[h / 3];
        if (qw_dot(n, own) < 0) n = qw_scale(n, -1);
        if (qw_length2(n) > 0) l->normal[h] = n;
    }
}

static void take_attribute(qw_look *l, const qw_attribute *a)
{
    for (uint32_t i = 0; i < QW_MOST_SETS && a->kind == QW_UVS; i++) {
        char name[8];
        snprintf(name, sizeof name, i ? "uv%u" : "uv", i);
        if (strcmp(a->name, name) == 0) l->uv[i] = a;
    }
    if (a->kind == QW_VALUES && strcmp(a->name, "color") == 0 && a->components >= 3) l->color = a;
    if (a->kind == QW_LABELS && a->domain == QW_PER_FACE && strcmp(a->name, "material") == 0) l->material = a->labels;
    if (a->kind == QW_NORMALS) take_normals(l, a);
}

static bool can_see(const qw_look *l, const qw_texture *t)
{
    return t->image < l->list->image_count && l->picture[t->image].pixels && t->set < QW_MOST_SETS && l->uv[t->set];
}

/* Of one material for all: what is cut off at several thresholds is so at one half. */
static void join_alphas(qw_look *l, const qw_material *m, bool is_first)
{
    if (m->alpha == 1 && l->cutoff >= 0 && l->cutoff != m->cutoff) l->cutoff = 0.5f;
    else if (m->alpha == 1) l->cutoff = m->cutoff;
    if (m->alpha > l->alpha) l->alpha = m->alpha;
    l->is_unlit = (is_first || l->is_unlit) && m->is_unlit;
    for (int k = 0; k < 3; k++) l->brightest = fmaxf(l->brightest, m->emission[k]);
}

/* Which maps the materials in use have anything to say to, and how transparency is to be shown. */
static void find_kinds(qw_look *l)
{
    bool is_first = true;
    l->has_color = l->color != NULL, l->cutoff = -1, l->brightest = 1;
    for (uint32_t i = 0; i < l->list->count; i++) {
        const qw_material *m = &l->list->material[i];
        if (!qw_is_used(l->list, i)) continue;
        join_alphas(l, m, is_first), is_first = false;
        l->has_color |= can_see(l, &m->alpha_map) || (m->alpha > 0 && m->color[3] != 1);
        l->has_color |= can_see(l, &m->color_map) || m->color[0] != 1 || m->color[1] != 1 || m->color[2] != 1;
        l->has_roughness |= can_see(l, &m->roughness_map) || can_see(l, &m->metallic_map) ||
                            m->roughness != l->list->material[0].roughness ||
                            m->metallic != l->list->material[0].metallic;
        l->has_occlusion |= can_see(l, &m->occlusion_map);
        l->has_emission |= m->emission[0] + m->emission[1] + m->emission[2] > 0;
    }
    if (l->cutoff < 0) l->cutoff = 0.5f;
}

qw_look qw_begin_look(qw_env *env, const qw_source *source, const qw_attribute *attributes, uint32_t count,
                      bool color_is_srgb, const qw_material_list *list, const qw_picture *picture)
{
    qw_look l = {.source = source,
                 .color_is_srgb = color_is_srgb,
                 .list = list,
                 .picture = picture,
                 .plain = qw_plain_material()};
    float *linear = QW_NEW(env, float, 256);
    for (int i = 0; i < 256; i++) linear[i] = (float)from_srgb(i / 255.0);
    l.linear = linear, l.normal = QW_NEW(env, qw_vec3, 3 * (size_t)source->mesh.face_count);
    find_normals(env, &l);
    for (uint32_t i = 0; i < count; i++) take_attribute(&l, &attributes[i]);
    find_kinds(&l);
    return l;
}

/* ---- textures */

static int64_t wrap(int64_t x, int64_t size, int mode)
{
    if (mode == 1) return x < 0 ? 0 : x >= size ? size - 1 : x;
    int64_t turn = mode == 2 ? 2 * size : size;
    x %= turn;
    if (x < 0) x += turn;
    return x >= size ? 2 * size - 1 - x : x;
}

static float texel(const qw_look *l, const qw_picture *p, int64_t x, int64_t y, uint32_t channel, bool is_srgb)
{
    size_t at = ((size_t)y * p->width + (size_t)x) * 4 + channel;
    if (p->bits == 16) {
        float v = ((const uint16_t *)p->pixels)[at] / 65535.0f;
        return is_srgb ? (float)from_srgb((double)v) : v;
    }
    uint8_t v = ((const uint8_t *)p->pixels)[at];
    return is_srgb ? l->linear[v] : v / 255.0f;
}

/* Where a point lies in the picture, in pixels: glTF's coordinates, v downward. */
static void place_in(const qw_look *l, const qw_texture *t, uint32_t triangle, const float w[3], double at[2])
{
    const qw_attribute *uv = l->uv[t->set];
    double u = 0, v = 0;
    for (uint32_t k = 0; k < 3; k++) {
        const float *p = uv->values + uv->components * qw_element_of(l->source, uv->domain, triangle, k);
        u += (double)w[k] * (double)p[0], v += (double)w[k] * (1 - (double)p[1]);
    }
    u *= (double)t->scale[0], v *= (double)t->scale[1];
    if (t->rotation != 0) {
        double c = qw_cos((double)t->rotation), s = qw_sin((double)t->rotation), x = u;
        u = c * x + s * v, v = c * v - s * x;
    }
    at[0] = (u + (double)t->offset[0]) * l->picture[t->image].width - 0.5;
    at[1] = (v + (double)t->offset[1]) * l->picture[t->image].height - 0.5;
    if (!(fabs(at[0]) < 1e9 && fabs(at[1]) < 1e9)) at[0] = at[1] = 0;
}

/* Of so many channels, bilinear; colours are linear then, the fourth channel is taken as it is. */
static void sample(const qw_look *l, const qw_texture *t, uint32_t triangle, const float w[3], uint32_t channels,
                   bool is_srgb, float *to)
{
    const qw_picture *p = &l->picture[t->image];
    double at[2];
    place_in(l, t, triangle, w, at);
    int64_t x0 = (int64_t)qw_floor(at[0]), y0 = (int64_t)qw_floor(at[1]);
    float fx = (float)(at[0] - (double)x0), fy = (float)(at[1] - (double)y0);
    int64_t xs[2] = {wrap(x0, p->width, t->wrap[0]), wrap(x0 + 1, p->width, t->wrap[0])};
    int64_t ys[2] = {wrap(y0, p->height, t->wrap[1]), wrap(y0 + 1, p->height, t->wrap[1])};
    for (uint32_t c = 0; c < channels; c++) {
        float sum = 0;
        for (int i = 0; i < 4; i++)
            sum += (i & 1 ? fx : 1 - fx) * (i & 2 ? fy : 1 - fy) *
                   texel(l, p, xs[i & 1], ys[i >> 1], t->channel + c, is_srgb && c < 3);
        to[c] = sum;
    }
}

/* ---- a point */

static qw_vec3 interpolate(const qw_vec3 *at, const float w[3])
{
    return qw_madd(qw_madd(qw_scale(at[0], w[0]), w[1], at[1]), w[2], at[2]);
}

/* The normal that a normal map bends: its tangent is the direction in which u grows on the triangle. */
static qw_vec3 bend(const qw_look *l, const qw_material *m, uint32_t triangle, const float w[3], qw_vec3 n)
{
    const qw_texture *t = &m->normal_map;
    const qw_attribute *uv = l->uv[t->set];
    const uint32_t *corner = l->source->mesh.corner + 3 * (size_t)triangle;
    const qw_vec3 *p = l->source->mesh.position;
    float coded[3], d[2][2];
    qw_vec3 e[2];
    const float *at[3];
    sample(l, t, triangle, w, 3, false, coded);
    for (uint32_t k = 0; k < 3; k++)
        at[k] = uv->values + uv->components * qw_element_of(l->source, uv->domain, triangle, k);
    for (int k = 0; k < 2; k++) {
        e[k] = qw_sub(p[corner[k + 1]], p[corner[0]]);
        for (int r = 0; r < 2; r++) d[k][r] = at[k + 1][r] - at[0][r];
    }
    float det = d[0][0] * d[1][1] - d[0][1] * d[1][0];
    qw_vec3 tangent = qw_sub(qw_scale(e[0], d[1][1]), qw_scale(e[1], d[0][1]));
    tangent = qw_normalize(qw_reject(det < 0 ? qw_scale(tangent, -1) : tangent, n));
    if (qw_length2(tangent) == 0) return n;
    qw_vec3 across = qw_scale(qw_cross(n, tangent), det < 0 ? -1.0f : 1.0f);
    float x = (2 * coded[0] - 1) * m->normal_scale, y = (2 * coded[1] - 1) * m->normal_scale, z = 2 * coded[2] - 1;
    qw_vec3 bent = qw_normalize(qw_madd(qw_madd(qw_scale(tangent, x), y, across), z, n));
    return qw_length2(bent) > 0 ? bent : n;
}

/* Roughness, metal, occlusion and emission at a point of a triangle, factors times textures. w: its weights there. */
static void see_factors(const qw_look *l, const qw_material *m, uint32_t triangle, const float w[3], qw_seen *s)
{
    float one[4];
    s->roughness = m->roughness, s->metallic = m->metallic, s->occlusion = 1;
    if (can_see(l, &m->roughness_map)) sample(l, &m->roughness_map, triangle, w, 1, false, one), s->roughness *= one[0];
    if (can_see(l, &m->metallic_map)) sample(l, &m->metallic_map, triangle, w, 1, false, one), s->metallic *= one[0];
    if (can_see(l, &m->occlusion_map)) {
        sample(l, &m->occlusion_map, triangle, w, 1, false, one);
        s->occlusion = 1 + m->occlusion_strength * (one[0] - 1);
    }
    for (int c = 0; c < 3; c++) s->emission[c] = m->emission[c] / l->brightest;
    if (!can_see(l, &m->emission_map)) return;
    sample(l, &m->emission_map, triangle, w, 3, true, one);
    for (int c = 0; c < 3; c++) s->emission[c] *= one[c];
}

/* As what is written shows it: opaque is 1, and what is cut off is so at its own threshold. */
static float shown_alpha(const qw_look *l, const qw_material *m, float alpha)
{
    if (m->alpha == 0) return 1;
    if (m->alpha == 2 || l->cutoff == m->cutoff) return m->alpha == 1 && l->alpha == 2 ? alpha >= m->cutoff : alpha;
    if (l->alpha == 2) return alpha >= m->cutoff;
    return alpha < m->cutoff ? alpha / m->cutoff * l->cutoff
                             : l->cutoff + (alpha - m->cutoff) * (1 - l->cutoff) / fmaxf(1 - m->cutoff, 1e-6f);
}

/* Colour and opacity at a point of a triangle, factor times texture times colours of vertices. w: its weights
   there. */
static void see_color(const qw_look *l, const qw_material *m, uint32_t triangle, const float w[3], float color[4])
{
    float one[4];
    memcpy(color, m->color, 4 * sizeof *color);
    if (can_see(l, &m->color_map)) {
        sample(l, &m->color_map, triangle, w, 4, true, one);
        for (int c = 0; c < 4; c++) color[c] *= one[c];
    }
    if (can_see(l, &m->alpha_map))
        sample(l, &m->alpha_map, triangle, w, 1, false, one), color[3] = m->color[3] * one[0];
    color[3] = shown_alpha(l, m, color[3]);
    for (uint32_t c = 0; c < 3 && l->color; c++) {
        float sum = 0;
        for (uint32_t k = 0; k < 3; k++)
            sum += w[k] *
                   l->color->values[l->color->components * qw_element_of(l->source, l->color->domain, triangle, k) + c];
        color[c] *= l->color_is_srgb ? (float)from_srgb((double)sum) : sum;
    }
}

qw_seen qw_look_at(const qw_look *l, uint32_t triangle, const float w[3])
{
    int32_t label = l->material ? l->material[l->source->face[triangle]] : l->list->count == 1 ? 0 : -1;
    const qw_material *m = label >= 0 && (uint32_t)label < l->list->count ? &l->list->material[label] : &l->plain;
    qw_seen s;
    see_color(l, m, triangle, w, s.color);
    see_factors(l, m, triangle, w, &s);
    s.normal = qw_normalize(interpolate(l->normal + 3 * (size_t)triangle, w));
    if (qw_length2(s.normal) == 0) s.normal = l->source->normal[triangle];
    if (can_see(l, &m->normal_map)) s.normal = bend(l, m, triangle, w, s.normal);
    return s;
}

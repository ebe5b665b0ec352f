#include "products/bake/shading.h"
#include "base/groups.h"

#include <string.h>

typedef struct shader {
    const qw_bake_target *target;
    const qw_look *look;
    qw_vec3 *part; /* qw_vec3[3 corners]: of the fan of each face, what its triangles give their corners */
} shader;

static qw_vec3 vector_at(const float *v) { return qw_v3(v[0], v[1], v[2]); }

/* What the input is shaded with near a point of a triangle of the target; zero: nothing that faces alike. */
static qw_vec3 shade(const shader *s, const uint32_t corner[3], const float w[3], float within, uint32_t *hint)
{
    qw_vec3 p = qw_v3(0, 0, 0), n = p, sum = p;
    for (int k = 0; k < 3; k++) {
        p = qw_madd(p, w[k], s->target->place[corner[k]]);
        n = qw_madd(n, w[k], vector_at(s->target->normal + 3 * (size_t)corner[k]));
    }
    n = qw_normalize(n);
    qw_hit hit = qw_bvh_nearest(s->look->source->bvh, p, n, QW_SAME_SHEET, within, *hint);
    if (hit.face == QW_NONE) return sum;
    *hint = hit.face;
    for (int k = 0; k < 3; k++) sum = qw_madd(sum, hit.weight[k], s->look->normal[3 * (size_t)hit.face + (size_t)k]);
    return qw_dot(sum, n) > 0 ? qw_normalize(sum) : qw_v3(0, 0, 0);
}

/* Each corner of a triangle is given the normals at six points of it, as far as they are the corner's. */
static void shade_triangle(const shader *s, const uint32_t corner[3], uint32_t *hint)
{
    static const float at[6][3] = {{0.66f, 0.17f, 0.17f},   {0.17f, 0.66f, 0.17f},   {0.17f, 0.17f, 0.66f},
                                   {0.11f, 0.445f, 0.445f}, {0.445f, 0.11f, 0.445f}, {0.445f, 0.445f, 0.11f}};
    qw_vec3 p[3];
    for (int k = 0; k < 3; k++) p[k] = s->target->place[corner[k]];
    float area = qw_length(qw_cross(qw_sub(p[1], p[0]), qw_sub(p[2], p[0])));
    float within = fmaxf(qw_distance(p[0], p[1]), fmaxf(qw_distance(p[1], p[2]), qw_distance(p[2], p[0])));
    for (int i = 0; i < 6; i++) {
        qw_vec3 n = shade(s, corner, at[i], within, hint);
        for (int k = 0; k < 3; k++) s->part[corner[k]] = qw_madd(s->part[corner[k]], area * at[i][k], n);
    }
}

static void shade_faces(void *user, uint32_t begin, uint32_t end)
{
    const shader *s = user;
    uint32_t hint = QW_NONE;
    for (uint32_t f = begin; f < end; f++)
        for (uint32_t c = s->target->begin[f] + 1; c + 1 < s->target->begin[f + 1]; c++)
            shade_triangle(s, (const uint32_t[3]){s->target->begin[f], c, c + 1}, &hint);
}

float *qw_shading_of_input(qw_env *env, const qw_bake_target *t, const qw_look *look)
{
    const float of_use = 0.5f; /* cosine: normals of the input that are farther off than that are not */
    float *normal = QW_NEW(env, float, 3 * (size_t)t->corner_count);
    uint32_t vertices = 0, *first;
    for (uint32_t c = 0; c < t->corner_count; c++)
        if (t->vertex[c] >= vertices) vertices = t->vertex[c] + 1;
    uint32_t *corner = qw_group(env, t->vertex, t->corner_count, vertices, &first);
    shader s = {.target = t, .look = look, .part = QW_NEW_ZERO(env, qw_vec3, t->corner_count)};
    qw_parallel(env, t->face_count, 64, shade_faces, &s);
    for (uint32_t c = 0; c < t->corner_count; c++) {
        const float *own = t->normal + 3 * (size_t)c;
        qw_vec3 sum = qw_v3(0, 0, 0);
        for (uint32_t i = first[t->vertex[c]]; i < first[t->vertex[c] + 1]; i++)
            if (memcmp(own, t->normal + 3 * (size_t)corner[i], 3 * sizeof *own) == 0)
                sum = qw_add(sum, s.part[corner[i]]);
        sum = qw_normalize(sum);
        if (!(qw_dot(sum, vector_at(own)) >= of_use)) sum = vector_at(own);
        normal[3 * (size_t)c] = sum.x, normal[3 * (size_t)c + 1] = sum.y, normal[3 * (size_t)c + 2] = sum.z;
    }
    qw_free(env, s.part), qw_free(env, first), qw_free(env, corner);
    return normal;
}

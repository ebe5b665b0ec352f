#include "products/attributes/crosses.h"

#include "base/elementary.h"
#include "geometry/bvh.h"

#include <assert.h>

/* The mean of the crosses at the corners of a triangle says nothing where it is shorter than this: around a
 * singularity. */
static const float LEAST_MEAN = 0.05f;

/* The fourth power of a direction's angle to x in the plane of x and y: the same for all four of a cross. */
typedef struct fourth {
    float re, im;
} fourth;

/* The square root with a real part >= 0, of a number of length 1. */
static fourth half_angle(fourth z)
{
    float im = sqrtf(fmaxf(0, (1 - z.re) / 2));
    return (fourth){sqrtf(fmaxf(0, (1 + z.re) / 2)), z.im < 0 ? -im : im};
}

static fourth squared(fourth z) { return (fourth){z.re * z.re - z.im * z.im, 2 * z.re * z.im}; }

/* The direction of the cross (d, n x d) that leans least out of the plane with normal `to`, as it lies in that plane:
   of unit length, or 0. Crosses are so carried over an edge of the surface that is parallel to one of their lines,
   however sharp it is. */
static qw_vec3 laid_down(qw_vec3 d, qw_vec3 n, qw_vec3 to)
{
    qw_vec3 other = qw_cross(n, d);
    qw_vec3 flat = fabsf(qw_dot(d, to)) <= fabsf(qw_dot(other, to)) || qw_length2(other) < 0.25f ? d : other;
    return qw_normalize(qw_reject(flat, to));
}

/* Weighted mean of crosses with directions d[i] and normals n[i], in the plane with normal `to`. */
static qw_vec3 mean_cross(const qw_vec3 d[3], const qw_vec3 n[3], const float weight[3], qw_vec3 to)
{
    qw_vec3 x = qw_any_orthogonal(to), y = qw_cross(to, x);
    fourth sum = {0, 0};
    for (int i = 0; i < 3; i++) {
        qw_vec3 flat = laid_down(d[i], n[i], to);
        fourth z = squared(squared((fourth){qw_dot(flat, x), qw_dot(flat, y)}));
        sum.re += weight[i] * z.re, sum.im += weight[i] * z.im;
    }
    float length = sqrtf(sum.re * sum.re + sum.im * sum.im);
    if (!(length > LEAST_MEAN)) return qw_v3(0, 0, 0);
    fourth t = half_angle(half_angle((fourth){sum.re / length, sum.im / length}));
    return qw_normalize(qw_madd(qw_scale(x, t.re), t.im, y));
}

/* Whether a triangle of the source lies in a frame of its own, whose directions are not those of the field. */
static bool is_in_own_frame(const qw_source *s, uint32_t triangle)
{
    return s->mesh.corner[3 * (size_t)triangle] >= s->input->vertex_count;
}

/* ---- from elements to points */

typedef struct taking {
    const qw_source *source;
    qw_domain domain;
    const qw_vec3 *field, *point, *normal;
    const qw_vec3 *vertex_normal; /* qw_vec3[input vertices]; NULL where the field goes by faces */
    float reach;
    qw_vec3 *taken;
} taking;

/* The cross of the given field at a point of the source, laid into the plane of `normal`. */
static qw_vec3 cross_at(const taking *t, const qw_hit *hit, qw_vec3 normal)
{
    const qw_source *s = t->source;
    qw_vec3 facing = s->normal[hit->face];
    if (t->domain == QW_PER_FACE) return laid_down(t->field[s->face[hit->face]], facing, normal);
    qw_vec3 d[3], n[3];
    for (int i = 0; i < 3; i++) {
        uint32_t v = s->input->corner[s->corner[3 * (size_t)hit->face + (size_t)i]];
        d[i] = t->field[v], n[i] = t->vertex_normal[v];
    }
    return laid_down(mean_cross(d, n, hit->weight, facing), facing, normal);
}

/* The given field's cross at each point of the run's surface; zero where there is nothing near. */
static void take_block(void *user, uint32_t begin, uint32_t end)
{
    const taking *t = user;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        qw_hit hit = qw_bvh_nearest(t->source->bvh, t->point[i], t->normal[i], QW_SAME_SHEET, t->reach, hint);
        t->taken[i] = qw_v3(0, 0, 0);
        if (hit.face == QW_NONE || is_in_own_frame(t->source, hit.face)) continue;
        t->taken[i] = cross_at(t, &hit, t->normal[i]);
        hint = hit.face;
    }
}

/* Normals of the input's vertices, weighted by area: qw_vec3[input vertices]; 0 for those of no triangle. */
static qw_vec3 *input_normals(qw_env *env, const qw_source *s)
{
    qw_vec3 *normal = QW_NEW_ZERO(env, qw_vec3, s->input->vertex_count);
    for (uint32_t f = 0; f < s->mesh.face_count; f++) {
        qw_vec3 area = qw_face_cross(&s->mesh, f);
        for (size_t h = 3 * (size_t)f; h < 3 * (size_t)f + 3; h++) {
            uint32_t v = s->input->corner[s->corner[h]];
            normal[v] = qw_add(normal[v], area);
        }
    }
    for (uint32_t v = 0; v < s->input->vertex_count; v++) normal[v] = qw_normalize(normal[v]);
    return normal;
}

qw_vec3 *qw_crosses_at_points(qw_env *env, const qw_source *source, qw_domain domain, const qw_vec3 *field,
                              const qw_vec3 *point, const qw_vec3 *normal, uint32_t count, float reach)
{
    assert(domain != QW_PER_CORNER && reach > 0);
    qw_vec3 *taken = QW_NEW(env, qw_vec3, count), *of_vertices = NULL;
    if (domain == QW_PER_VERTEX) of_vertices = input_normals(env, source);
    taking t = {source, domain, field, point, normal, of_vertices, reach, taken};
    qw_parallel(env, count, QW_GRAIN_HEAVY, take_block, &t);
    qw_free(env, of_vertices);
    return taken;
}

/* ---- how far the quads are from it */

/* Angle of a direction to the nearest one of the cross, 0 to 45 degrees. */
static double angle_to_cross(qw_vec3 line, qw_vec3 direction, qw_vec3 normal)
{
    double along = fabs((double)qw_dot(line, direction)),
           across = fabs((double)qw_dot(line, qw_cross(normal, direction)));
    return qw_atan2(fmin(along, across), fmax(along, across)) * (180 / QW_PI);
}

double qw_mean_field_angle(qw_env *env, const qw_source *source, qw_domain domain, const qw_vec3 *field,
                           const qw_quadmesh *quads, float reach)
{
    assert(field && quads->corner);
    uint32_t n = quads->face_count, lines = 0;
    double sum = 0;
    qw_scope_begin(env);
    qw_vec3 *point = QW_NEW(env, qw_vec3, n), *normal = QW_NEW(env, qw_vec3, n);
    for (uint32_t f = 0; f < n; f++) {
        point[f] = qw_quad_middle(quads->position, quads->corner + 4 * (size_t)f);
        normal[f] = qw_quad_normal(quads, f);
    }
    const qw_vec3 *cross = qw_crosses_at_points(env, source, domain, field, point, normal, n, reach);
    for (uint32_t f = 0; f < n; f++) {
        const uint32_t *c = quads->corner + 4 * (size_t)f;
        if (!(qw_length2(cross[f]) > 0) || !(qw_length2(normal[f]) > 0)) continue;
        for (uint32_t i = 0; i < 2; i++, lines++) {
            qw_vec3 from = qw_add(quads->position[c[i]], quads->position[c[i + 1]]),
                    to = qw_add(quads->position[c[i + 2]], quads->position[c[(i + 3) % 4]]);
            sum += angle_to_cross(qw_sub(to, from), cross[f], normal[f]);
        }
    }
    qw_scope_end(env);
    return lines ? sum / lines : -1;
}

/* ---- from points to elements */

typedef struct telling {
    const qw_vertex_crosses *crosses;
    const qw_bvh *bvh; /* over crosses->mesh */
    const qw_vec3 *point, *normal;
    float reach;
    qw_vec3 *told;
} telling;

/* The run's cross at each element of the input; zero where there is nothing near. */
static void tell_block(void *user, uint32_t begin, uint32_t end)
{
    const telling *t = user;
    const qw_vertex_crosses *c = t->crosses;
    uint32_t hint = QW_NONE;
    for (uint32_t i = begin; i < end; i++) {
        t->told[i] = qw_v3(0, 0, 0);
        if (!(qw_length2(t->normal[i]) > 0)) continue;
        qw_hit hit = qw_bvh_nearest(t->bvh, t->point[i], t->normal[i], QW_SAME_SHEET, t->reach, hint);
        if (hit.face == QW_NONE) continue;
        qw_vec3 d[3], n[3];
        for (int k = 0; k < 3; k++) {
            uint32_t v = c->mesh->corner[3 * (size_t)hit.face + (size_t)k];
            d[k] = c->direction[v], n[k] = c->normal[v];
        }
        qw_vec3 mean = mean_cross(d, n, hit.weight, t->normal[i]);
        t->told[i] = qw_length2(mean) > 0 ? mean
                                          : laid_down(d[0], n[0], t->normal[i]); /* at a singularity any is as good */
        hint = hit.face;
    }
}

/* Where each element lies, and its normal, 0 for those of no triangle and those in a frame of their own. */
static void place_elements(const qw_source *s, qw_domain domain, qw_vec3 *point, qw_vec3 *normal, uint32_t *triangles)
{
    for (uint32_t f = 0; f < s->mesh.face_count; f++) {
        const uint32_t *c = s->mesh.corner + 3 * (size_t)f;
        qw_vec3 area = qw_face_cross(&s->mesh, f);
        if (is_in_own_frame(s, f)) continue;
        if (domain == QW_PER_FACE) {
            uint32_t e = s->face[f];
            for (int i = 0; i < 3; i++) point[e] = qw_madd(point[e], 1.0f / 3, s->mesh.position[c[i]]);
            normal[e] = qw_add(normal[e], area);
            triangles[e]++;
        }
        for (int i = 0; i < 3 && domain == QW_PER_VERTEX; i++) {
            point[c[i]] = s->mesh.position[c[i]], triangles[c[i]] = 1;
            normal[c[i]] = qw_add(normal[c[i]], area);
        }
    }
}

qw_vec3 *qw_crosses_of_elements(qw_env *env, const qw_source *source, qw_domain domain,
                                const qw_vertex_crosses *crosses, float reach)
{
    assert(domain != QW_PER_CORNER && reach > 0);
    uint32_t count = domain == QW_PER_FACE ? source->input->face_count : source->input->vertex_count;
    qw_vec3 *told = QW_NEW(env, qw_vec3, count);
    qw_scope_begin(env);
    qw_vec3 *point = QW_NEW_ZERO(env, qw_vec3, count), *normal = QW_NEW_ZERO(env, qw_vec3, count);
    uint32_t *triangles = QW_NEW_ZERO(env, uint32_t, count);
    place_elements(source, domain, point, normal, triangles);
    for (uint32_t e = 0; e < count; e++) {
        if (triangles[e] > 1) point[e] = qw_scale(point[e], 1.0f / (float)triangles[e]);
        normal[e] = qw_normalize(normal[e]);
    }
    telling t = {crosses, qw_bvh_build(env, crosses->mesh), point, normal, reach, told};
    qw_parallel(env, count, QW_GRAIN_HEAVY, tell_block, &t);
    qw_scope_end(env);
    return told;
}

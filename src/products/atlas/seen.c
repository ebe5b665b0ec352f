#include "products/atlas/seen.h"

#include "base/sort.h"
#include "base/vec.h"
#include "geometry/openness.h"
#include "base/groups.h"

#include <assert.h>
#include <string.h>

static const float LIFT = 1e-4f;      /* of the rays above the surface; the box is about 1 wide */
static const double LEAST_OPEN = 0.2; /* what a vertex counts that nobody sees */

typedef struct seer {
    const qw_bvh *bvh;
    const qw_trimesh *mesh;
    const qw_vec3 *normal; /* qw_vec3[vertex_count] */
    qw_open_rays rays;
    float *open; /* float[vertex_count] */
} seer;

static void look(void *user, uint32_t begin, uint32_t end)
{
    seer *s = user;
    for (uint32_t v = begin; v < end; v++)
        s->open[v] = qw_length2(s->normal[v]) > 0 ? qw_openness(s->bvh, &s->rays, s->mesh->position[v], s->normal[v],
                                                                LIFT, 0, INFINITY, QW_NONE, 0, 1)
                                                  : 0;
}

/* Fans from the first corner of each face. */
static qw_trimesh triangles_of(qw_env *env, const qw_atlas_mesh *m)
{
    qw_trimesh t = {.vertex_count = m->vertex_count, .face_count = m->corner_count - 2 * m->face_count};
    qw_vec3 *position = QW_NEW(env, qw_vec3, m->vertex_count);
    uint32_t *corner = QW_NEW(env, uint32_t, 3 * (size_t)t.face_count), n = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        const double *p = m->position + 3 * (size_t)v;
        position[v] = qw_v3_of_doubles(p);
    }
    for (uint32_t f = 0; f < m->face_count; f++)
        for (uint32_t c = m->begin[f] + 1; c + 1 < m->begin[f + 1]; c++) {
            corner[n++] = m->corner[m->begin[f]], corner[n++] = m->corner[c], corner[n++] = m->corner[c + 1];
        }
    assert(n == 3 * t.face_count);
    t.position = position, t.corner = corner;
    return t;
}

static qw_vec3 area_vector(const qw_trimesh *t, uint32_t f)
{
    const uint32_t *c = t->corner + 3 * (size_t)f;
    return qw_cross(qw_sub(t->position[c[1]], t->position[c[0]]), qw_sub(t->position[c[2]], t->position[c[0]]));
}

/* Sine of the angle between the faces at an edge: above 0 where it is convex. */
static float bend_at(const qw_atlas_mesh *m, const qw_vec3 *normal, const qw_trimesh *t, uint32_t c)
{
    if (m->twin[c] == QW_NONE) return 0;
    qw_vec3 along = qw_sub(t->position[m->corner[qw_atlas_next(m, c)]], t->position[m->corner[c]]);
    return qw_dot(qw_cross(normal[m->face[c]], normal[m->face[m->twin[c]]]), qw_normalize(along));
}

double *qw_seam_weights(qw_env *env, const qw_atlas_mesh *m)
{
    double *weight = QW_NEW(env, double, m->corner_count), sum = 0, length = 0;
    qw_scope_begin(env);
    qw_trimesh t = triangles_of(env, m);
    qw_vec3 *of_vertex = QW_NEW_ZERO(env, qw_vec3, m->vertex_count),
            *of_face = QW_NEW_ZERO(env, qw_vec3, m->face_count);
    for (uint32_t f = 0, n = 0; f < m->face_count; f++) {
        for (uint32_t c = m->begin[f] + 1; c + 1 < m->begin[f + 1]; c++)
            of_face[f] = qw_add(of_face[f], area_vector(&t, n++));
        for (uint32_t c = m->begin[f]; c < m->begin[f + 1]; c++)
            of_vertex[m->corner[c]] = qw_add(of_vertex[m->corner[c]], of_face[f]);
        of_face[f] = qw_normalize(of_face[f]);
    }
    for (uint32_t v = 0; v < m->vertex_count; v++) of_vertex[v] = qw_normalize(of_vertex[v]);
    seer s = {.bvh = qw_bvh_build(env, &t), .mesh = &t, .normal = of_vertex, .rays = qw_begin_open_rays()};
    s.open = QW_NEW(env, float, m->vertex_count);
    qw_parallel(env, m->vertex_count, QW_GRAIN_HEAVY, look, &s);
    for (uint32_t c = 0; c < m->corner_count; c++) {
        double open = 0.5 * ((double)s.open[m->corner[c]] + (double)s.open[m->corner[qw_atlas_next(m, c)]]);
        double l = qw_atlas_edge_length(m, c);
        weight[c] = (LEAST_OPEN + open) * (1 + 0.5 * (double)bend_at(m, of_face, &t, c));
        sum += l * weight[c], length += l;
    }
    for (uint32_t c = 0; c < m->corner_count; c++) weight[c] = sum > 0 ? weight[c] * length / sum : 1;
    qw_scope_end(env);
    return weight;
}

/* ---- reflection */

typedef struct matcher {
    const qw_atlas_mesh *m;
    const uint64_t
        *order; /* uint64_t[vertex_count], sorted: height along a direction that no axis is near, and vertex */
    double tolerance;
} matcher;

static uint64_t key_of(const double p[3], double more)
{
    return (uint64_t)qw_signed_float_key((float)(0.48 * p[0] + 0.6 * p[1] + 0.64 * p[2] + more)) << 32;
}

/* The vertex nearest to a place, within the tolerance; QW_NONE: none. */
static uint32_t vertex_at(const matcher *k, const double p[3])
{
    uint64_t last = key_of(p, k->tolerance) | UINT32_MAX;
    double nearest = k->tolerance * k->tolerance;
    uint32_t found = QW_NONE, count = k->m->vertex_count;
    size_t at = qw_first_not_below(k->order, count, key_of(p, -k->tolerance));
    for (; at < count && k->order[at] <= last; at++) {
        const double *q = k->m->position + 3 * (size_t)(uint32_t)k->order[at];
        double d = 0;
        for (int i = 0; i < 3; i++) d += (p[i] - q[i]) * (p[i] - q[i]);
        if (d < nearest) nearest = d, found = (uint32_t)k->order[at];
    }
    return found;
}

/* uint32_t[vertex_count]. */
static uint32_t *mirrored_vertices(qw_env *env, const qw_atlas_mesh *m, const double normal[3], double offset)
{
    uint32_t *to = QW_NEW(env, uint32_t, m->vertex_count);
    uint64_t *order = QW_NEW(env, uint64_t, m->vertex_count);
    double length = 0;
    for (uint32_t v = 0; v < m->vertex_count; v++) order[v] = key_of(m->position + 3 * (size_t)v, 0) | v;
    qw_sort_u64(order, m->vertex_count);
    for (uint32_t c = 0; c < m->corner_count; c++) length += qw_atlas_edge_length(m, c);
    const matcher k = {.m = m, .order = order, .tolerance = 0.01 * length / m->corner_count};
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        const double *p = m->position + 3 * (size_t)v;
        double height = normal[0] * p[0] + normal[1] * p[1] + normal[2] * p[2] - offset, q[3];
        for (int i = 0; i < 3; i++) q[i] = p[i] - 2 * height * normal[i];
        to[v] = vertex_at(&k, q);
    }
    qw_free(env, order);
    return to;
}

uint32_t *qw_mirrored_corners(qw_env *env, const qw_atlas_mesh *m, const double normal[3], double offset)
{
    uint32_t *to = QW_NEW(env, uint32_t, m->corner_count);
    qw_scope_begin(env);
    uint32_t *vertex = mirrored_vertices(env, m, normal, offset);
    uint32_t *first, *item = qw_group(env, m->corner, m->corner_count, m->vertex_count, &first);
    for (uint32_t c = 0; c < m->corner_count; c++) {
        uint32_t from = vertex[m->corner[qw_atlas_next(m, c)]], end = vertex[m->corner[c]];
        to[c] = QW_NONE;
        if (from == QW_NONE || end == QW_NONE) continue;
        for (uint32_t i = first[from]; i < first[from + 1]; i++)
            if (m->corner[qw_atlas_next(m, item[i])] == end) to[c] = item[i];
    }
    qw_scope_end(env);
    return to;
}

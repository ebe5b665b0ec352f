/* Each vertex looks up its nearest point on the quads, in a tree over their halves; the first uncovered vertex of a
   neighbourhood stands for it. */
#include "remesh/quads/uncovered.h"

#include <assert.h>
#include <math.h>

typedef struct coverage {
    const qw_trimesh *surface;
    const qw_halves *quads;
    float far;
    uint8_t *uncovered;
} coverage;

static bool is_corner_near(const coverage *r, uint32_t half, qw_vec3 p)
{
    const uint32_t *c = r->quads->mesh.corner + 3 * (size_t)half;
    const qw_vec3 *at = r->quads->mesh.position;
    float far2 = r->far * r->far;
    return qw_length2(qw_sub(at[c[0]], p)) < far2 || qw_length2(qw_sub(at[c[1]], p)) < far2 ||
           qw_length2(qw_sub(at[c[2]], p)) < far2;
}

/* Asks for each vertex of the surface whether a quad lies near it. */
static void ask_block(void *user, uint32_t begin, uint32_t end)
{
    const coverage *r = user;
    uint32_t hint = QW_NONE;
    for (uint32_t v = begin; v < end; v++) {
        r->uncovered[v] = 0;
        if (hint != QW_NONE && is_corner_near(r, hint, r->surface->position[v]))
            continue; /* neighbours follow one another: most often */
        qw_bvh_query query = {.point = r->surface->position[v], .least_dot = -1, .max_distance = r->far, .hint = hint};
        query.enough2 = r->far * r->far; /* any that is near will do */
        qw_hit hit = qw_bvh_find(r->quads->tree, &query, NULL);
        r->uncovered[v] = hit.face == QW_NONE;
        hint = hit.face;
    }
}

qw_halves qw_halve_quads(qw_env *env, const qw_quadmesh *quads)
{
    assert(quads->face_count < QW_NONE / 6);
    qw_trimesh t = {
        .vertex_count = quads->vertex_count, .face_count = 2 * quads->face_count, .position = quads->position};
    t.corner = QW_NEW(env, uint32_t, 3 * (size_t)t.face_count);
    for (uint32_t f = 0; f < quads->face_count; f++) {
        const uint32_t *q = quads->corner + 4 * (size_t)f;
        uint32_t *c = t.corner + 6 * (size_t)f;
        c[0] = q[0], c[1] = q[1], c[2] = q[2];
        c[3] = q[0], c[4] = q[2], c[5] = q[3];
    }
    return (qw_halves){t, qw_bvh_build(env, &t)};
}

float *qw_distances_to_quads(qw_env *env, const qw_vec3 *point, uint32_t count, const qw_halves *quads)
{
    float *distance = QW_NEW(env, float, count);
    for (uint32_t i = 0; i < count; i++) {
        qw_hit hit = qw_bvh_nearest(quads->tree, point[i], qw_v3(0, 0, 0), -1, INFINITY, QW_NONE);
        distance[i] = hit.face == QW_NONE ? INFINITY : sqrtf(hit.distance2);
    }
    return distance;
}

static void add_point(qw_sites *l, qw_vec3 point, float size)
{
    for (uint32_t i = 0; i < l->count; i++)
        if (qw_distance(l->point[i], point) < l->size[i] / 2) return;
    l->point[l->count] = point;
    l->size[l->count++] = size;
}

uint8_t *qw_mark_uncovered(qw_env *env, const qw_trimesh *surface, const qw_halves *quads, float far)
{
    assert(far > 0 && quads->tree);
    uint8_t *uncovered = QW_NEW(env, uint8_t, surface->vertex_count);
    coverage r = {surface, quads, far, uncovered};
    qw_parallel(env, surface->vertex_count, QW_GRAIN, ask_block, &r);
    return uncovered;
}

static qw_sites list_uncovered(qw_env *env, const qw_trimesh *surface, const float *size, const uint8_t *uncovered)
{
    assert(surface->position && size && uncovered);
    qw_sites l = {0, QW_NEW(env, qw_vec3, QW_MOST_SITES), QW_NEW(env, float, QW_MOST_SITES), 0};
    for (uint32_t v = 0; v < surface->vertex_count && l.count < QW_MOST_SITES; v++)
        if (uncovered[v]) add_point(&l, surface->position[v], size[v]);
    for (uint32_t h = 0; l.count > 0 && h < 3 * surface->face_count; h++)
        if (uncovered[surface->corner[h]]) l.area += qw_length(qw_face_cross(surface, h / 3)) / 6;
    return l;
}

qw_sites qw_uncovered_sites(qw_env *env, const qw_trimesh *surface, const float *size, const qw_halves *quads,
                            float far)
{
    assert(surface->position && size && far > 0);
    if (quads->mesh.face_count == 0) return (qw_sites){0};
    uint8_t *uncovered = qw_mark_uncovered(env, surface, quads, far);
    qw_sites l = list_uncovered(env, surface, size, uncovered);
    qw_free(env, uncovered);
    return l;
}

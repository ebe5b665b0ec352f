#include "remesh/field/plane_directions.h"

#include "base/constants.h"
#include "base/elementary.h"
#include "base/mechanisms.h"
#include "base/sets.h"
#include "remesh/field/connection_level.h"

#include <assert.h>
#include <math.h>

typedef struct plane {
    qw_vec3 normal, axis; /* of its first triangle */
    qw_phasor edges;      /* sum over the edges around: fourth powers, each as long as the edge */
    float length;         /* of these edges */
    bool is_bent;         /* it turns slowly: no plane */
} plane;

static bool is_same(qw_vec3 a, qw_vec3 b)
{
    return qw_dot(a, b) > 0 && qw_length2(qw_cross(a, b)) < (float)(QW_ONE_PLANE * QW_ONE_PLANE);
}

static bool is_edge(const qw_trimesh *mesh, uint32_t h)
{
    return mesh->twin[h] == QW_NONE || (mesh->mark && (mesh->mark[h] & QW_MARK_FEATURE));
}

/* Of each triangle, the first of its plane: uint32_t[face_count]. facing: their normals. */
static uint32_t *join_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *facing)
{
    uint32_t *first = QW_NEW(env, uint32_t, mesh->face_count);
    qw_sets_begin(first, mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++)
        if (!is_edge(mesh, h) && is_same(facing[h / 3], facing[mesh->twin[h] / 3]))
            qw_join_sets(first, h / 3, mesh->twin[h] / 3);
    for (uint32_t f = 0; f < mesh->face_count; f++) first[f] = qw_set_of(first, f);
    return first;
}

/* Each plane at its first triangle: plane[face_count]. */
static plane *measure_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *facing, const uint32_t *first)
{
    plane *planes = QW_NEW_ZERO(env, plane, mesh->face_count);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        uint32_t f = h / 3;
        plane *p = &planes[first[f]];
        if (first[f] == f && h % 3 == 0) p->normal = facing[f], p->axis = qw_any_orthogonal(facing[f]);
        p->is_bent |= !is_same(facing[f], p->normal);
        if (!is_edge(mesh, h)) continue;
        qw_vec3 d = qw_sub(mesh->position[mesh->corner[qw_next(h)]], mesh->position[mesh->corner[h]]);
        qw_phasor z = qw_phasor_of_cross(d, p->normal, p->axis);
        p->edges.re += qw_length(d) * z.re, p->edges.im += qw_length(d) * z.im;
        p->length += qw_length(d);
    }
    return planes;
}

/* The direction in which most edges run, as long as they agree. */
static qw_vec3 direction_of(const plane *p)
{
    double angle = 0.25 * qw_atan2(p->edges.im, p->edges.re);
    float clear = sqrtf(p->edges.re * p->edges.re + p->edges.im * p->edges.im) / p->length;
    qw_vec3 y = qw_cross(p->normal, p->axis);
    return qw_madd(qw_scale(p->axis, clear * (float)qw_cos(angle)), clear * (float)qw_sin(angle), y);
}

void qw_direct_planes(qw_env *env, const qw_trimesh *mesh, const qw_vec3 *normal, const qw_vec3 *cross,
                      qw_vec3 *direction)
{
    assert(mesh->twin && normal && cross && direction);
    qw_scope_begin(env);
    int64_t directed = 0;
    qw_vec3 *facing = QW_NEW(env, qw_vec3, mesh->face_count);
    for (uint32_t f = 0; f < mesh->face_count; f++) facing[f] = qw_normalize(qw_face_cross(mesh, f));
    uint32_t *first = join_planes(env, mesh, facing);
    plane *planes = measure_planes(env, mesh, facing, first);
    for (uint32_t h = 0; h < 3 * mesh->face_count; h++) {
        const plane *p = &planes[first[h / 3]];
        uint32_t v = mesh->corner[h];
        if (p->is_bent || !(p->length > 0) || !is_same(normal[v], p->normal)) continue;
        qw_vec3 d = direction_of(p);
        /* powers: where edges or crosses go more than one way, lines that are held straight cost distance */
        float agree = fmaxf(qw_phasor_of_cross(cross[v], p->normal, d).re, 0);
        d = qw_scale(d, qw_length(d) * agree * agree * agree);
        if (qw_length2(d) > qw_length2(direction[v])) direction[v] = d, directed++;
    }
    qw_did(env, QW_MECH_PLANES, directed);
    qw_scope_end(env);
}

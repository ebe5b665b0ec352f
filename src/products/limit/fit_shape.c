#include "products/limit/fit_shape.h"

#include "products/limit/stencils.h"
#include "geometry/go_back.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { ROUNDS = 3 /* of projections, each after what the one before let go */ };
/* In mean edges around a vertex: what is farther from it is no part of what it stands for. */
static const float REACH = 1.5f, CURVE_REACH = 0.75f;
/* Cosine between an edge of the quads and the curve that it lies on, at the least. */
static const float LEAST_ALONG = 0.5f;

qw_shape_hit qw_nearest_on_shape(const qw_shape *s, uint32_t component, qw_vec3 point, qw_vec3 normal, float reach,
                                 uint32_t *hint)
{
    qw_hit hit = qw_bvh_nearest_of(s->tree, component, point, normal, QW_SAME_SHEET, reach, *hint);
    if (hit.face == QW_NONE) return (qw_shape_hit){.is_found = false};
    *hint = hit.face;
    return (qw_shape_hit){true, hit.point, qw_normalize(qw_face_cross(s->surface, hit.face))};
}

qw_shape_hit qw_nearest_on_curves(const qw_shape *s, qw_vec3 point, qw_vec3 tangent, float reach)
{
    qw_curve_hit hit = {.segment = QW_NONE};
    if (s->curves) hit = qw_curve_nearest(s->curves, point, reach);
    if (hit.segment == QW_NONE) return (qw_shape_hit){.is_found = false};
    qw_vec3 along = qw_normalize(qw_sub(s->to[hit.segment], s->from[hit.segment]));
    return (qw_shape_hit){fabsf(qw_dot(along, tangent)) >= LEAST_ALONG, hit.point, along};
}

float *qw_edges_around(qw_env *env, const qw_quadmesh *q)
{
    float *edge = QW_NEW_ZERO(env, float, q->vertex_count);
    uint32_t *count = QW_NEW_ZERO(env, uint32_t, q->vertex_count);
    for (uint32_t h = 0; h < 4 * q->face_count; h++) {
        uint32_t a = q->corner[h], b = q->corner[qw_quad_next(h)];
        float length = qw_distance(q->position[a], q->position[b]);
        edge[a] += length, edge[b] += length, count[a]++, count[b]++;
    }
    for (uint32_t v = 0; v < q->vertex_count; v++) edge[v] = count[v] ? edge[v] / (float)count[v] : 0;
    qw_free(env, count);
    return edge;
}

typedef struct placing {
    const qw_quadmesh *quads;
    const qw_shape *shape;
    const uint8_t *rule, *stays;
    uint32_t (*crease)[2];
    const float *edge;
    const qw_vec3 *normal;
    qw_vec3 *place;
} placing;

/* The place on the shape or on its curves for each vertex; it stays where there is none near. */
static void place_block(void *user, uint32_t begin, uint32_t end)
{
    const placing *p = user;
    const qw_vec3 *at = p->quads->position;
    uint32_t hint = QW_NONE;
    for (uint32_t v = begin; v < end; v++) {
        qw_shape_hit hit = {.is_found = false};
        p->place[v] = at[v];
        if (p->rule[v] == QW_RULE_CORNER || (p->stays && p->stays[v])) continue;
        if (p->rule[v] == QW_RULE_CREASE) {
            qw_vec3 tangent = qw_normalize(qw_sub(at[p->crease[v][1]], at[p->crease[v][0]]));
            hit = qw_nearest_on_curves(p->shape, at[v], tangent, CURVE_REACH * p->edge[v]);
        } else {
            hit = qw_nearest_on_shape(p->shape, p->quads->component[v], at[v], p->normal[v], REACH * p->edge[v], &hint);
        }
        if (hit.is_found) p->place[v] = hit.point;
    }
}

void qw_put_on_shape(qw_env *env, qw_quadmesh *q, const qw_shape *shape, const uint8_t *stays)
{
    assert(q->twin && q->component && shape->tree);
    uint32_t n = q->vertex_count;
    for (int round = 0; round < ROUNDS; round++) {
        qw_vec3 *before = QW_NEW(env, qw_vec3, n);
        qw_scope_begin(env);
        memcpy(before, q->position, n * sizeof *before);
        placing p = {.quads = q, .shape = shape, .stays = stays, .place = QW_NEW(env, qw_vec3, n)};
        p.crease = qw_alloc(env, n, 2 * sizeof(uint32_t));
        p.rule = qw_find_rules(env, q, p.crease), p.edge = qw_edges_around(env, q);
        p.normal = qw_quadmesh_vertex_normals(env, q);
        qw_parallel(env, n, QW_GRAIN_HEAVY, place_block, &p);
        memcpy(q->position, p.place, n * sizeof *p.place);
        uint32_t held = qw_hold_back_flips(env, q, before);
        qw_scope_end(env);
        qw_free(env, before);
        if (held == 0) break;
    }
}

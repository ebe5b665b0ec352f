#include "attributes/provenance.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A corner looks from this share of the way to the middle of its quad: beyond the rounding of single precision, and
 * less than any detail that quads of that size could show. */
static const float INWARD = 0.01f;

enum { GRAIN = 1024 };

typedef struct search {
    const qw_source *source;
    const qw_quadmesh *quads;
    const qw_vec3 *normal;     /* of the vertices */
    const uint32_t *component; /* uint32_t[quads->face_count]: QW_NONE: any */
    uint32_t *of_vertex;       /* uint32_t[quads->vertex_count]: of the component of a face at it */
    float *vertex_reach;       /* float[quads->vertex_count]: longest edge at it */
    float *distance2;          /* float[quads->vertex_count] */
    qw_origins origins;
} search;

static qw_hit nearest(const search *s, qw_vec3 point, qw_vec3 normal, float reach, uint32_t hint, uint32_t component)
{
    if (component == QW_NONE) return qw_bvh_nearest(s->source->bvh, point, normal, QW_SAME_SHEET, reach, hint);
    return qw_bvh_nearest_labelled(s->source->bvh, point, normal, QW_SAME_SHEET, reach, hint, s->source->component,
                                   component);
}

static qw_source_point point_of(const qw_hit *hit)
{
    return (qw_source_point){hit->face, {hit->weight[0], hit->weight[1], hit->weight[2]}};
}

static void find_corners(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    search *s = user;
    const qw_quadmesh *q = s->quads;
    uint32_t hint = QW_NONE;
    for (uint32_t f = begin; f < end; f++) {
        qw_vec3 middle = qw_quad_middle(q->position, q->corner + 4 * (size_t)f), normal = qw_quad_normal(q, f);
        for (size_t h = 4 * (size_t)f; h < 4 * (size_t)f + 4; h++) {
            qw_vec3 at = q->position[q->corner[h]];
            qw_hit hit = {.face = QW_NONE};
            if (qw_length2(normal) > 0)
                hit = nearest(s, qw_lerp(at, middle, INWARD), normal, s->origins.reach[f], hint, s->component[f]);
            if (hit.face != QW_NONE) hint = hit.face, hit = qw_bvh_nearest_on(s->source->bvh, hit.face, at);
            s->origins.corner[h] = point_of(&hit);
        }
    }
}

static void find_vertices(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    search *s = user;
    for (uint32_t v = begin; v < end; v++) {
        qw_hit hit = {.face = QW_NONE};
        if (qw_length2(s->normal[v]) > 0)
            hit = nearest(s, s->quads->position[v], s->normal[v], s->vertex_reach[v], QW_NONE, s->of_vertex[v]);
        s->origins.vertex[v] = point_of(&hit);
        s->distance2[v] = hit.face == QW_NONE ? INFINITY : hit.distance2;
    }
}

/* A vertex that found nothing, as on a blade whose sides face away from each other, lies where the nearest of its
 * corners does; a corner that found nothing where its vertex does. */
static void help_each_other(qw_env *env, search *s)
{
    const qw_quadmesh *q = s->quads;
    qw_origins *o = &s->origins;
    uint8_t *lost = QW_NEW(env, uint8_t, q->vertex_count);
    for (uint32_t v = 0; v < q->vertex_count; v++) lost[v] = o->vertex[v].triangle == QW_NONE;
    for (size_t h = 0; h < 4 * (size_t)q->face_count; h++) {
        uint32_t v = q->corner[h];
        if (o->corner[h].triangle == QW_NONE || !lost[v]) continue;
        float d2 = qw_bvh_nearest_on(s->source->bvh, o->corner[h].triangle, q->position[v]).distance2;
        if (d2 < s->distance2[v]) o->vertex[v] = o->corner[h], s->distance2[v] = d2;
    }
    for (size_t h = 0; h < 4 * (size_t)q->face_count; h++)
        if (o->corner[h].triangle == QW_NONE) o->corner[h] = o->vertex[q->corner[h]];
    qw_free(env, lost);
}

static void set_reach(search *s)
{
    const qw_quadmesh *q = s->quads;
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *c = q->corner + 4 * (size_t)f;
        float longest = 0;
        for (uint32_t i = 0; i < 4; i++)
            longest = fmaxf(longest, qw_distance(q->position[c[i]], q->position[c[(i + 1) % 4]]));
        s->origins.reach[f] = longest;
        for (uint32_t i = 0; i < 4; i++) s->vertex_reach[c[i]] = fmaxf(s->vertex_reach[c[i]], longest);
    }
}

/* Each component of the quads is of that component of the surface on which most of its corners lie. Returns whether a
 * corner or vertex lies on another. */
static bool choose_components(qw_env *env, const qw_source *source, const qw_quadmesh *q, const qw_origins *o,
                              uint32_t *component)
{
    uint32_t *part = QW_NEW(env, uint32_t, q->face_count), *leader, strangers = 0;
    uint32_t parts = qw_label_components(env, 4, q->twin, q->face_count, part);
    int64_t *lead = QW_NEW_ZERO(env, int64_t, parts); /* majority vote of Boyer and Moore */
    leader = QW_NEW(env, uint32_t, parts);
    for (uint32_t p = 0; p < parts; p++) leader[p] = QW_NONE;
    for (size_t h = 0; h < 4 * (size_t)q->face_count; h++) {
        uint32_t t = o->corner[h].triangle, p = part[h / 4];
        if (t == QW_NONE) continue;
        if (lead[p] == 0) leader[p] = source->component[t];
        lead[p] += leader[p] == source->component[t] ? 1 : -1;
    }
    for (uint32_t f = 0; f < q->face_count; f++) component[f] = leader[part[f]];
    for (size_t h = 0; h < 4 * (size_t)q->face_count; h++) {
        uint32_t t = o->corner[h].triangle, v = o->vertex[q->corner[h]].triangle;
        strangers += t != QW_NONE && source->component[t] != component[h / 4];
        strangers += v != QW_NONE && source->component[v] != component[h / 4];
    }
    qw_free(env, part), qw_free(env, leader), qw_free(env, lead);
    return strangers > 0;
}

static void find_all(qw_env *env, search *s)
{
    const qw_quadmesh *q = s->quads;
    for (size_t h = 0; h < 4 * (size_t)q->face_count; h++) s->of_vertex[q->corner[h]] = s->component[h / 4];
    qw_parallel(env, q->face_count, GRAIN, find_corners, s);
    qw_parallel(env, q->vertex_count, GRAIN, find_vertices, s);
}

static void count_lost(const search *s, qw_origins *o)
{
    float farthest2 = 0;
    for (uint32_t v = 0; v < s->quads->vertex_count; v++) {
        o->lost_vertices += o->vertex[v].triangle == QW_NONE;
        if (o->vertex[v].triangle != QW_NONE) farthest2 = fmaxf(farthest2, s->distance2[v]);
    }
    for (size_t h = 0; h < 4 * (size_t)s->quads->face_count; h++) o->lost_corners += o->corner[h].triangle == QW_NONE;
    o->farthest = sqrtf(farthest2);
}

qw_origins qw_find_origins(qw_env *env, const qw_source *source, const qw_quadmesh *quads)
{
    assert(source->bvh && quads->twin && quads->face_count > 0);
    size_t faces = quads->face_count, vertices = quads->vertex_count;
    qw_origins o = {.vertex = QW_NEW(env, qw_source_point, vertices),
                    .corner = QW_NEW(env, qw_source_point, 4 * faces),
                    .component = QW_NEW(env, uint32_t, faces),
                    .reach = QW_NEW(env, float, faces)};
    qw_scope_begin(env);
    memset(o.component, 0xff, faces * sizeof *o.component);
    search s = {.source = source,
                .quads = quads,
                .normal = qw_quadmesh_vertex_normals(env, quads),
                .component = o.component,
                .of_vertex = QW_NEW(env, uint32_t, vertices),
                .vertex_reach = QW_NEW_ZERO(env, float, vertices),
                .distance2 = QW_NEW(env, float, vertices),
                .origins = o};
    set_reach(&s);
    find_all(env, &s);
    if (choose_components(env, source, quads, &o, o.component)) find_all(env, &s);
    help_each_other(env, &s);
    count_lost(&s, &o);
    qw_scope_end(env);
    return o;
}

qw_origin qw_origin_of(const qw_source *source, const qw_source_point *point)
{
    qw_origin p = {.face = QW_NO_FACE};
    if (point->triangle == QW_NONE) return p;
    const uint32_t *corner = source->corner + 3 * (size_t)point->triangle;
    p.face = source->face[point->triangle];
    uint32_t first = source->input->face_begin[p.face];
    /* the polygon's own order, also where the triangle was flipped */
    bool flipped = (corner[0] > corner[1]) + (corner[1] > corner[2]) + (corner[2] > corner[0]) == 2;
    for (uint32_t i = 0; i < 3; i++) {
        uint32_t k = flipped && i ? 3 - i : i;
        p.corner[i] = corner[k] - first,
        p.weight[i] = fminf(fmaxf(point->weight[k], 0), 1); /* rounding may leave that range */
    }
    return p;
}

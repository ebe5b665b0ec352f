#include "products/attributes/provenance.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* A corner looks from this share of the way to the middle of its quad: beyond the rounding of single precision, and
 * less than any detail that quads of that size could show. */
static const float INWARD = 0.01f;

/* The ball around a quad's middle in which the source is gathered reaches so far beyond its corners, as a share of
 * their distance: for surfaces that leave the quads by less. What is farther off is found too, but more slowly. */
static const float CACHE_REACH = 1.15f;

typedef struct origin_search {
    const qw_source *source;
    const qw_quadmesh *quads;
    const qw_vec3 *normal; /* of the vertices */
    uint32_t *home;        /* uint32_t[quads->vertex_count]: the last quad at each */
    float *vertex_reach;   /* float[quads->vertex_count]: longest edge at it */
    float *distance2;      /* float[quads->vertex_count] */
    qw_origins origins;
} origin_search;

qw_bvh_query qw_query_of_quad(const qw_source *source, const qw_origins *origins, uint32_t f)
{
    uint32_t component = origins->component[f];
    return (qw_bvh_query){.least_dot = QW_SAME_SHEET,
                          .max_distance = origins->reach[f],
                          .hint = QW_NONE,
                          .label = component == QW_NONE ? NULL : source->component,
                          .wanted = component};
}

void qw_fill_cache(const qw_source *source, const qw_quadmesh *quads, uint32_t f, qw_bvh_cache *cache)
{
    assert(f < quads->face_count);
    const uint32_t *corner = quads->corner + 4 * (size_t)f;
    qw_vec3 middle = qw_quad_middle(quads->position, corner);
    float farthest2 = 0;
    for (uint32_t i = 0; i < 4; i++)
        farthest2 = fmaxf(farthest2, qw_length2(qw_sub(quads->position[corner[i]], middle)));
    qw_bvh_fill_cache(source->bvh, middle, CACHE_REACH * sqrtf(farthest2), cache);
}

static qw_source_point point_of(const qw_hit *hit)
{
    return (qw_source_point){hit->face, {hit->weight[0], hit->weight[1], hit->weight[2]}};
}

static void find_corner(origin_search *s, uint32_t h, qw_bvh_query *query, qw_vec3 middle)
{
    assert(h < 4 * s->quads->face_count);
    qw_vec3 at = s->quads->position[s->quads->corner[h]];
    qw_hit hit = {.face = QW_NONE};
    query->point = qw_lerp(at, middle, INWARD);
    if (qw_length2(query->normal) > 0) hit = qw_bvh_find(s->source->bvh, query, NULL);
    if (hit.face != QW_NONE) query->hint = hit.face, hit = qw_bvh_nearest_on(s->source->bvh, hit.face, at);
    s->origins.corner[h] = point_of(&hit);
}

/* hint: a triangle near the vertex, or QW_NONE. */
static void find_vertex(origin_search *s, uint32_t v, uint32_t hint)
{
    assert(v < s->quads->vertex_count);
    qw_hit hit = {.face = QW_NONE};
    qw_bvh_query query = qw_query_of_quad(s->source, &s->origins, s->home[v]);
    query.point = s->quads->position[v], query.normal = s->normal[v], query.max_distance = s->vertex_reach[v];
    query.hint = hint;
    if (qw_length2(query.normal) > 0) hit = qw_bvh_find(s->source->bvh, &query, NULL);
    s->origins.vertex[v] = point_of(&hit);
    s->distance2[v] = hit.face == QW_NONE ? INFINITY : hit.distance2;
}

/* What a quad before f, but not before `begin`, has found at the vertex of f's corner h; QW_NONE: nothing. */
static uint32_t found_before(const origin_search *s, uint32_t begin, uint32_t f, uint32_t h)
{
    const qw_quadmesh *q = s->quads;
    uint32_t out = q->twin[h], in = q->twin[qw_quad_prev(h)];
    if (in != QW_NONE && in / 4 >= begin && in / 4 < f) return s->origins.corner[in].triangle;
    if (out != QW_NONE && out / 4 >= begin && out / 4 < f) return s->origins.corner[qw_quad_next(out)].triangle;
    return QW_NONE;
}

/* The corners of each quad, and the vertices that are at home in it. */
static void find_quads(void *user, uint32_t begin, uint32_t end)
{
    origin_search *s = user;
    for (uint32_t f = begin; f < end; f++) {
        qw_bvh_query query = qw_query_of_quad(s->source, &s->origins, f);
        qw_vec3 middle = qw_quad_middle(s->quads->position, s->quads->corner + 4 * (size_t)f);
        query.normal = qw_quad_normal(s->quads, f);
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++) {
            uint32_t found = found_before(s, begin, f, h);
            if (found != QW_NONE) query.hint = found;
            find_corner(s, h, &query, middle);
        }
        for (uint32_t h = 4 * f; h < 4 * f + 4; h++)
            if (s->home[s->quads->corner[h]] == f) find_vertex(s, s->quads->corner[h], s->origins.corner[h].triangle);
    }
}

/* A vertex that found nothing, as on a blade whose sides face away from each other, lies where the nearest of its
 * corners does; a corner that found nothing where its vertex does. */
static void help_each_other(qw_env *env, origin_search *s)
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

/* How far from a face and from a vertex the input is sought: the longest edge there. */
static void set_reach(origin_search *s)
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

/* Vertices without a quad stay lost. */
static void lose_all(origin_search *s)
{
    for (uint32_t v = 0; v < s->quads->vertex_count; v++)
        s->origins.vertex[v] = (qw_source_point){.triangle = QW_NONE}, s->distance2[v] = INFINITY;
}

/* Each component of the quads is of that component of the surface on which most of its corners lie. Returns whether a
 * corner or vertex lies on another. */
static bool choose_components(qw_env *env, const qw_source *source, const qw_quadmesh *q, const qw_origins *o,
                              uint32_t *component)
{
    assert(component && o->component);
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

static void count_lost(const origin_search *s, qw_origins *o)
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
    assert(source->bvh && quads->twin && quads->face_count > 0 && quads->face_count < QW_NONE / 4);
    size_t faces = quads->face_count, vertices = quads->vertex_count;
    qw_origins o = {.vertex = QW_NEW(env, qw_source_point, vertices),
                    .corner = QW_NEW(env, qw_source_point, 4 * faces),
                    .component = QW_NEW(env, uint32_t, faces),
                    .reach = QW_NEW(env, float, faces)};
    qw_scope_begin(env);
    memset(o.component, 0xff, faces * sizeof *o.component);
    origin_search s = {.source = source,
                       .quads = quads,
                       .normal = qw_quadmesh_vertex_normals(env, quads),
                       .home = QW_NEW(env, uint32_t, vertices),
                       .vertex_reach = QW_NEW_ZERO(env, float, vertices),
                       .distance2 = QW_NEW(env, float, vertices),
                       .origins = o};
    set_reach(&s);
    lose_all(&s);
    for (size_t h = 0; h < 4 * faces; h++) s.home[quads->corner[h]] = (uint32_t)(h / 4);
    qw_parallel(env, quads->face_count, QW_GRAIN_HEAVY, find_quads, &s);
    if (choose_components(env, source, quads, &o, o.component))
        qw_parallel(env, quads->face_count, QW_GRAIN_HEAVY, find_quads, &s);
    help_each_other(env, &s);
    count_lost(&s, &o);
    qw_scope_end(env);
    return o;
}

qw_origin qw_origin_of(const qw_source *source, const qw_source_point *point)
{
    assert(point->triangle == QW_NONE || point->triangle < source->mesh.face_count);
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

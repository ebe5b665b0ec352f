#include "products/attributes/uv_charts.h"

#include "base/mesh_view.h"
#include "geometry/weld.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* The part of the input that is looked at around a quad reaches so many of its longest edges from its middle: beyond
 * its corners, also where it is no square. */
static const float AROUND = 1.25f;
/* A quad straddles a seam where more than this share of its area lies beyond: what less lies there is due to the quads'
 * straight edges. */
static const float STRADDLES = 0.1f;

enum { MOST_SIDES = 16 }; /* sides of seams that are told apart in one quad */

uint32_t *qw_find_neighbours(qw_env *env, const qw_source *source)
{
    assert(source->mesh.position && source->corner);
    size_t sides = 3 * (size_t)source->mesh.face_count;
    uint32_t *corner = QW_NEW(env, uint32_t, sides), vertices = source->input->vertex_count, fault;
    for (size_t h = 0; h < sides; h++) corner[h] = source->input->corner[source->corner[h]];
    qw_weld_equal(env, source->input->position, vertices, NULL, corner, source->mesh.face_count);
    uint32_t *neighbour = qw_find_twins(env, 3, corner, source->mesh.face_count, vertices, &fault);
    qw_free(env, corner);
    return neighbour;
}

static bool same_value(const qw_source *source, const qw_attribute *uv, float rounding, uint32_t a, uint32_t b)
{
    const float *x = uv->values + qw_element_of(source, uv->domain, a / 3, a % 3) * uv->components,
                *y = uv->values + qw_element_of(source, uv->domain, b / 3, b % 3) * uv->components;
    return fabsf(x[0] - y[0]) <= rounding && fabsf(x[1] - y[1]) <= rounding;
}

qw_charts qw_find_charts(qw_env *env, const qw_source *source, const uint32_t *neighbour, const qw_attribute *uv)
{
    assert(uv->components >= 2);
    uint32_t sides = 3 * source->mesh.face_count;
    qw_charts c = {.across = QW_NEW(env, uint32_t, sides), .chart = QW_NEW(env, uint32_t, source->mesh.face_count)};
    float rounding = qw_rounding_of(uv);
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t t = neighbour[h];
        bool joins = t != QW_NONE && same_value(source, uv, rounding, h, qw_next(t)) &&
                     same_value(source, uv, rounding, qw_next(h), t);
        c.across[h] = joins ? t : QW_NONE;
    }
    c.count = qw_label_components(env, 3, c.across, source->mesh.face_count, c.chart);
    for (uint32_t h = 0; h < sides; h++) c.across[h] = c.across[h] == QW_NONE ? QW_NONE : c.across[h] / 3;
    return c;
}

uint32_t qw_sample_quad(const qw_source *source, const qw_quadmesh *quads, const qw_origins *origins, uint32_t f,
                        uint32_t i, uint32_t j, uint32_t hint, const qw_bvh_cache *cache)
{
    assert(f < quads->face_count);
    const uint32_t *c = quads->corner + 4 * (size_t)f;
    const qw_vec3 *p = quads->position;
    float s = ((float)i + 0.5f) / QW_SAMPLES, t = ((float)j + 0.5f) / QW_SAMPLES;
    qw_bvh_query query = qw_query_of_quad(source, origins, f);
    query.hint = hint;
    query.point = qw_lerp(qw_lerp(p[c[0]], p[c[1]], s), qw_lerp(p[c[3]], p[c[2]], s), t);
    query.normal = qw_normalize(qw_cross(qw_sub(qw_lerp(p[c[1]], p[c[2]], t), qw_lerp(p[c[0]], p[c[3]], t)),
                                         qw_sub(qw_lerp(p[c[3]], p[c[2]], s), qw_lerp(p[c[0]], p[c[1]], s))));
    return qw_length2(query.normal) == 0 ? QW_NONE : qw_bvh_find(source->bvh, &query, cache).face;
}

/* ---- the sides of seams around one quad */

typedef struct around {
    const qw_source *source;
    const qw_charts *charts;
    uint32_t *stamp; /* uint32_t[triangles]: number of the quad + 1 for which `side` holds */
    uint32_t *side;  /* uint32_t[triangles]: triangles of one side join without a seam in the neighbourhood */
    uint32_t *list;  /* uint32_t[triangles]: those with the stamp */
    uint32_t count, sides, current;
    qw_vec3 middle;
    float radius2;
} around;

static void stamp(around *a, uint32_t t, uint32_t side)
{
    a->stamp[t] = a->current, a->side[t] = side, a->list[a->count++] = t;
}

/* The side of a triangle; what is not known yet is gathered from there. */
static uint32_t side_of(around *a, uint32_t t)
{
    assert(t < a->source->mesh.face_count);
    if (a->stamp[t] == a->current) return a->side[t];
    if (a->sides == MOST_SIDES) return MOST_SIDES - 1;
    uint32_t side = a->sides++, at = a->count;
    for (stamp(a, t, side); at < a->count; at++)
        for (uint32_t h = 3 * a->list[at]; h < 3 * a->list[at] + 3; h++) {
            uint32_t next = a->charts->across[h];
            if (next == QW_NONE || a->stamp[next] == a->current) continue;
            const qw_trimesh *m = &a->source->mesh;
            qw_vec3 p = m->position[m->corner[h]], q = m->position[m->corner[qw_next(h)]];
            if (qw_distance2_to_segment(a->middle, p, q) <= a->radius2) stamp(a, next, side);
        }
    return side;
}

/* The nearest point on that side that faces as the quad does. */
static qw_source_point nearest_on_side(const around *a, uint32_t side, qw_vec3 point, qw_vec3 normal)
{
    qw_hit best = {.face = QW_NONE, .distance2 = INFINITY};
    for (uint32_t i = 0; i < a->count; i++) {
        uint32_t t = a->list[i];
        if (a->side[t] != side || qw_dot(a->source->normal[t], normal) < 0) continue;
        qw_hit hit = qw_bvh_nearest_on(a->source->bvh, t, point);
        if (hit.distance2 < best.distance2) best = hit;
    }
    return (qw_source_point){best.face, {best.weight[0], best.weight[1], best.weight[2]}};
}

/* The side on which most of the quad lies, by the samples; *share: of the others. */
static uint32_t choose_side(around *a, const qw_quadmesh *quads, const qw_origins *o, uint32_t f, float *share)
{
    assert(f < quads->face_count && share);
    uint32_t samples[MOST_SIDES] = {0}, all = 0, best = 0, hint = QW_NONE;
    qw_bvh_cache cache;
    qw_fill_cache(a->source, quads, f, &cache);
    for (uint32_t i = 0; i < QW_SAMPLES * QW_SAMPLES; i++) {
        uint32_t t = qw_sample_quad(a->source, quads, o, f, i % QW_SAMPLES, i / QW_SAMPLES, hint, &cache);
        if (t == QW_NONE) continue;
        hint = t, samples[side_of(a, t)]++, all++;
    }
    for (uint32_t s = 1; s < MOST_SIDES; s++)
        if (samples[s] > samples[best]) best = s;
    *share = all ? (float)(all - samples[best]) / (float)all : 0;
    return best;
}

qw_source_point *qw_choose_charts(qw_env *env, const qw_source *source, const qw_charts *charts,
                                  const qw_quadmesh *quads, const qw_origins *origins, uint32_t *straddling)
{
    assert(charts->across && charts->chart && origins->corner);
    size_t triangles = source->mesh.face_count;
    qw_source_point *point = QW_NEW(env, qw_source_point, 4 * (size_t)quads->face_count);
    memcpy(point, origins->corner, 4 * (size_t)quads->face_count * sizeof *point);
    qw_scope_begin(env);
    around a = {.source = source,
                .charts = charts,
                .stamp = QW_NEW_ZERO(env, uint32_t, triangles),
                .side = QW_NEW(env, uint32_t, triangles),
                .list = QW_NEW(env, uint32_t, triangles)};
    for (uint32_t f = 0; f < quads->face_count; f++) {
        size_t first = 4 * (size_t)f;
        if (f % 256 == 0) qw_heartbeat(env);
        a.current = f + 1, a.count = a.sides = 0;
        a.middle = qw_quad_middle(quads->position, quads->corner + first);
        a.radius2 = AROUND * AROUND * origins->reach[f] * origins->reach[f];
        for (size_t h = first; h < first + 4; h++)
            if (point[h].triangle != QW_NONE) side_of(&a, point[h].triangle);
        if (a.sides < 2) continue;
        float share;
        uint32_t side = choose_side(&a, quads, origins, f, &share);
        *straddling += share > STRADDLES;
        for (size_t h = first; h < first + 4; h++)
            if (point[h].triangle == QW_NONE || a.side[point[h].triangle] != side)
                point[h] = nearest_on_side(&a, side, quads->position[quads->corner[h]], qw_quad_normal(quads, f));
    }
    qw_scope_end(env);
    return point;
}

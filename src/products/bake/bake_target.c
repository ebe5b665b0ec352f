#include "products/bake/bake_target.h"

#include "base/elementary.h"
#include "base/sets.h"

#include <assert.h>
#include <string.h>

static const float CAGE_MORE = 1.25f;  /* of the distance that was found */
static const float CAGE_LEAST = 0.02f; /* edges: a cage is never thinner */
static const float CAGE_MOST = 2;      /* longest edges at the vertex */
enum { MOST_CROSSED = 8 };             /* faces that a ray passes as they look away */

static qw_vec3 vector_at(const float *v) { return qw_v3(v[0], v[1], v[2]); }

/* ---- tangents */

static bool is_same_corner(const qw_bake_target *t, uint32_t a, uint32_t b)
{
    return memcmp(t->uv + 2 * (size_t)a, t->uv + 2 * (size_t)b, 2 * sizeof *t->uv) == 0 &&
           memcmp(t->normal + 3 * (size_t)a, t->normal + 3 * (size_t)b, 3 * sizeof *t->normal) == 0;
}

static uint32_t next_of(const qw_bake_target *t, uint32_t f, uint32_t c)
{
    return c + 1 == t->begin[f + 1] ? t->begin[f] : c + 1;
}

/* Corners of one vertex that have the same place, normal and texture coordinates are one set (base/sets.h). */
static uint32_t *group_corners(qw_env *env, const qw_bake_target *t)
{
    uint32_t *into = QW_NEW(env, uint32_t, t->corner_count), *face = QW_NEW(env, uint32_t, t->corner_count);
    for (uint32_t f = 0; f < t->face_count; f++)
        for (uint32_t c = t->begin[f]; c < t->begin[f + 1]; c++) into[c] = c, face[c] = f;
    for (uint32_t c = 0; c < t->corner_count; c++) {
        uint32_t w = t->twin[c];
        if (w == QW_NONE || w < c) continue;
        uint32_t end = next_of(t, face[c], c), other = next_of(t, face[w], w);
        if (!is_same_corner(t, c, other) || !is_same_corner(t, end, w)) continue;
        qw_join_sets(into, c, other), qw_join_sets(into, end, w);
    }
    qw_free(env, face);
    return into;
}

/* What a triangle adds to the tangent at its corner k: the direction of u in the plane of the normal there, times the
   angle between the sides in that plane. */
static qw_vec3 contribution(const qw_bake_target *t, const uint32_t corner[3], int k, qw_vec3 along)
{
    qw_vec3 n = vector_at(t->normal + 3 * (size_t)corner[k]), here = t->place[corner[k]];
    qw_vec3 a = qw_normalize(qw_reject(qw_sub(t->place[corner[(k + 1) % 3]], here), n));
    qw_vec3 b = qw_normalize(qw_reject(qw_sub(t->place[corner[(k + 2) % 3]], here), n));
    double cosine = (double)qw_dot(a, b);
    float angle = (float)qw_acos(cosine < -1 ? -1 : cosine > 1 ? 1 : cosine);
    return qw_scale(qw_normalize(qw_reject(along, n)), angle);
}

/* Tangents along u at all corners, the same at corners of one set, as MikkTSpace has them. */
static void find_tangents(qw_env *env, qw_bake_target *t)
{
    uint32_t *into = group_corners(env, t);
    qw_vec3 *sum = QW_NEW_ZERO(env, qw_vec3, t->corner_count);
    for (uint32_t f = 0; f < t->triangle_count; f++) {
        const uint32_t *c = t->corner + 3 * (size_t)f;
        const float *a = t->uv + 2 * (size_t)c[0], *b = t->uv + 2 * (size_t)c[1], *d = t->uv + 2 * (size_t)c[2];
        qw_vec3 e1 = qw_sub(t->place[c[1]], t->place[c[0]]), e2 = qw_sub(t->place[c[2]], t->place[c[0]]);
        qw_vec3 along = qw_normalize(qw_sub(qw_scale(e1, d[1] - a[1]), qw_scale(e2, b[1] - a[1])));
        for (int k = 0; k < 3; k++) {
            uint32_t group = qw_set_of(into, c[k]);
            sum[group] = qw_add(sum[group], contribution(t, c, k, along));
        }
    }
    for (uint32_t c = 0; c < t->corner_count; c++) {
        qw_vec3 n = vector_at(t->normal + 3 * (size_t)c), s = qw_normalize(sum[qw_set_of(into, c)]);
        if (qw_length2(s) == 0) s = qw_any_orthogonal(n);
        float *to = t->tangent + 4 * (size_t)c;
        to[0] = s.x, to[1] = s.y, to[2] = s.z, to[3] = 1; /* no chart is mirrored */
    }
    qw_free(env, sum), qw_free(env, into);
}

void qw_bake_target_begin(qw_env *env, qw_bake_target *t)
{
    uint32_t n = 0;
    t->triangle_count = t->corner_count - 2 * t->face_count;
    t->corner = QW_NEW(env, uint32_t, 3 * (size_t)t->triangle_count),
    t->face = QW_NEW(env, uint32_t, t->triangle_count);
    t->tangent = QW_NEW(env, float, 4 * (size_t)t->corner_count);
    for (uint32_t f = 0; f < t->face_count; f++)
        for (uint32_t c = t->begin[f] + 1; c + 1 < t->begin[f + 1]; c++, n++) {
            t->corner[3 * n] = t->begin[f], t->corner[3 * n + 1] = c, t->corner[3 * n + 2] = c + 1;
            t->face[n] = f;
        }
    find_tangents(env, t);
}

/* ---- cage */

typedef struct cage_search {
    const qw_bake_target *target;
    const qw_source *source;
    const qw_bvh *bvh;     /* of the target */
    const qw_vec3 *normal; /* qw_vec3[source vertices] */
    const float *reach;    /* float[faces]: longest edge */
    float farthest;        /* the largest reach */
    float *distance;       /* float[source vertices], or float[triangles] */
    uint32_t *near;        /* uint32_t[source vertices]: triangle of the target; QW_NONE: none */
} cage_search;

/* The nearest face of the target for each vertex of the source, and how far away that is. */
static void search_from_source(void *user, uint32_t begin, uint32_t end)
{
    cage_search *s = user;
    uint32_t hint = QW_NONE;
    for (uint32_t v = begin; v < end; v++) {
        s->near[v] = QW_NONE;
        if (qw_length2(s->normal[v]) == 0) continue;
        qw_hit hit = qw_bvh_nearest(s->bvh, s->source->mesh.position[v], s->normal[v], QW_SAME_SHEET, s->farthest,
                                    hint);
        if (hit.face == QW_NONE) continue;
        s->near[v] = hint = hit.face, s->distance[v] = sqrtf(hit.distance2);
    }
}

/* From the middle of each triangle of the target to the source. */
static void search_from_target(void *user, uint32_t begin, uint32_t end)
{
    cage_search *s = user;
    const qw_bake_target *t = s->target;
    uint32_t hint = QW_NONE;
    for (uint32_t f = begin; f < end; f++) {
        const uint32_t *c = t->corner + 3 * (size_t)f;
        qw_vec3 p[3], middle = qw_v3(0, 0, 0);
        for (int k = 0; k < 3; k++) p[k] = t->place[c[k]], middle = qw_madd(middle, 1 / 3.0f, p[k]);
        qw_vec3 n = qw_normalize(qw_cross(qw_sub(p[1], p[0]), qw_sub(p[2], p[0])));
        qw_hit hit = qw_bvh_nearest(s->source->bvh, middle, n, QW_SAME_SHEET, s->reach[t->face[f]], hint);
        s->distance[f] = hit.face == QW_NONE ? 0 : sqrtf(hit.distance2);
        if (hit.face != QW_NONE) hint = hit.face;
    }
}

static qw_vec3 *source_normals(qw_env *env, const qw_source *s)
{
    qw_vec3 *n = QW_NEW_ZERO(env, qw_vec3, s->mesh.vertex_count);
    for (uint32_t f = 0; f < s->mesh.face_count; f++)
        for (uint32_t h = 3 * f; h < 3 * f + 3; h++) n[s->mesh.corner[h]] = qw_add(n[s->mesh.corner[h]], s->normal[f]);
    for (uint32_t v = 0; v < s->mesh.vertex_count; v++) n[v] = qw_normalize(n[v]);
    return n;
}

/* float[faces]. */
static float *find_reach(qw_env *env, const qw_bake_target *t, float *farthest)
{
    float *reach = QW_NEW_ZERO(env, float, t->face_count);
    for (uint32_t f = 0; f < t->face_count; f++)
        for (uint32_t c = t->begin[f]; c < t->begin[f + 1]; c++)
            reach[f] = fmaxf(reach[f], qw_distance(t->place[c], t->place[next_of(t, f, c)]));
    for (uint32_t f = 0; f < t->face_count; f++) *farthest = fmaxf(*farthest, reach[f]);
    return reach;
}

/* How far target and source are apart at each face of the target, looked at from both. */
static void measure_faces(qw_env *env, const qw_bake_target *t, const qw_source *source, const float *reach,
                          float farthest, float *apart)
{
    const qw_trimesh mesh = {
        .vertex_count = t->corner_count, .face_count = t->triangle_count, .position = t->place, .corner = t->corner};
    cage_search s = {.target = t, .source = source, .reach = reach, .farthest = farthest};
    uint32_t most = source->mesh.vertex_count > t->triangle_count ? source->mesh.vertex_count : t->triangle_count;
    s.bvh = qw_bvh_build(env, &mesh), s.normal = source_normals(env, source);
    s.distance = QW_NEW(env, float, most), s.near = QW_NEW(env, uint32_t, most);
    qw_parallel(env, t->triangle_count, QW_GRAIN, search_from_target, &s);
    for (uint32_t f = 0; f < t->triangle_count; f++) apart[t->face[f]] = fmaxf(apart[t->face[f]], s.distance[f]);
    qw_parallel(env, source->mesh.vertex_count, QW_GRAIN, search_from_source, &s);
    for (uint32_t v = 0; v < source->mesh.vertex_count; v++) {
        if (s.near[v] == QW_NONE) continue;
        uint32_t f = t->face[s.near[v]];
        assert(f < t->face_count);
        apart[f] = fmaxf(apart[f], fminf(s.distance[v], CAGE_MOST * reach[f]));
    }
}

float qw_bake_target_cage(qw_env *env, qw_bake_target *t, const qw_source *source, float given)
{
    float most = 0, farthest = 0;
    uint32_t vertices = 0;
    t->cage = QW_NEW(env, float, t->corner_count);
    for (uint32_t c = 0; c < t->corner_count; c++) {
        t->cage[c] = given;
        if (t->vertex[c] >= vertices) vertices = t->vertex[c] + 1;
    }
    if (given > 0) return given;
    qw_scope_begin(env);
    float *reach = find_reach(env, t, &farthest), *apart = QW_NEW_ZERO(env, float, t->face_count);
    float *of_vertex = QW_NEW_ZERO(env, float, vertices);
    measure_faces(env, t, source, reach, farthest, apart);
    for (uint32_t f = 0; f < t->face_count; f++)
        for (uint32_t c = t->begin[f]; c < t->begin[f + 1]; c++)
            of_vertex[t->vertex[c]] = fmaxf(of_vertex[t->vertex[c]], CAGE_MORE * apart[f] + CAGE_LEAST * reach[f]);
    for (uint32_t c = 0; c < t->corner_count; c++) t->cage[c] = of_vertex[t->vertex[c]], most = fmaxf(most, t->cage[c]);
    qw_scope_end(env);
    return most;
}

/* ---- rays */

static void take_hit(qw_sight *s, const qw_hit *hit, qw_vec3 p, qw_vec3 aim)
{
    s->triangle = hit->face, s->point = hit->point;
    s->height = qw_dot(qw_sub(hit->point, p), aim);
    memcpy(s->weight, hit->weight, sizeof s->weight);
}

qw_bake_face qw_bake_face_of(const qw_bake_target *t, uint32_t triangle)
{
    qw_bake_face face;
    for (int k = 0; k < 3; k++) {
        size_t c = t->corner[3 * (size_t)triangle + (size_t)k];
        face.place[k] = t->place[c], face.cage[k] = t->cage[c];
        face.aim[k] = vector_at(t->aim + 3 * c), face.normal[k] = vector_at(t->normal + 3 * c);
        face.tangent[k] = vector_at(t->tangent + 4 * c);
        face.across[k] = qw_scale(qw_cross(face.normal[k], face.tangent[k]), t->tangent[4 * c + 3]);
    }
    return face;
}

void qw_bake_fill_cache(const qw_source *source, const qw_bake_face *face, const float w[3][3], qw_bvh_cache *cache)
{
    qw_vec3 p[3];
    for (int i = 0; i < 3; i++) {
        p[i] = qw_v3(0, 0, 0);
        for (int k = 0; k < 3; k++) p[i] = qw_madd(p[i], w[i][k], face->place[k]);
    }
    float cage = fmaxf(face->cage[0], fmaxf(face->cage[1], face->cage[2]));
    float within = fmaxf(qw_distance(p[0], p[1]), qw_distance(p[0], p[2]));
    cache->radius = 0;
    if (within < INFINITY) qw_bvh_fill_cache(source->bvh, p[0], 1.01f * (within + cage), cache);
}

static qw_vec3_lanes interpolate(const qw_vec3 at[3], const qw_lanes w[3])
{
    qw_vec3_lanes sum = {qw_lanes_of(0), qw_lanes_of(0), qw_lanes_of(0)};
    for (int k = 0; k < 3; k++) sum = qw_madd4(sum, w[k], qw_four(at[k], at[k], at[k], at[k]));
    return sum;
}

qw_bake_points qw_bake_points_of(const qw_bake_face *face, const qw_lanes w[3])
{
    qw_bake_points p = {.cage = qw_lanes_of(0)};
    for (int k = 0; k < 3; k++) p.cage += w[k] * qw_lanes_of(face->cage[k]);
    p.place = interpolate(face->place, w), p.aim = qw_normalize4(interpolate(face->aim, w));
    p.normal = qw_normalize4(interpolate(face->normal, w)), p.tangent = qw_normalize4(interpolate(face->tangent, w));
    p.across = qw_normalize4(interpolate(face->across, w));
    p.from = qw_madd4(p.place, p.cage, p.aim);
    return p;
}

/* Goes on with a ray that met a face which looks away; else the nearest point. */
static qw_sight see_one(const qw_source *source, const qw_bake_points *points, int lane, qw_hit hit, uint32_t *hint,
                        const qw_bvh_cache *cache)
{
    qw_sight s = {.triangle = QW_NONE};
    qw_vec3 p = qw_lane(&points->place, lane), aim = qw_lane(&points->aim, lane), down = qw_scale(aim, -1);
    float cage = points->cage[lane], left = 2 * cage;
    for (int i = 1; hit.face != QW_NONE && left > 0; i++) {
        if (qw_dot(source->normal[hit.face], aim) > 0) {
            take_hit(&s, &hit, p, aim);
            *hint = hit.face;
            return s;
        }
        left -= sqrtf(hit.distance2);
        if (i == MOST_CROSSED) break;
        if (left > 0) hit = qw_bvh_ray_near(source->bvh, cache, hit.point, down, left, hit.face);
    }
    s.is_missed = true;
    hit = qw_bvh_nearest(source->bvh, p, aim, QW_SAME_SHEET, 2 * cage, *hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest(source->bvh, p, aim, QW_SAME_SHEET, INFINITY, *hint);
    if (hit.face == QW_NONE) hit = qw_bvh_nearest(source->bvh, p, qw_v3(0, 0, 0), -1, INFINITY, *hint);
    if (hit.face != QW_NONE) take_hit(&s, &hit, p, aim), *hint = hit.face;
    return s;
}

void qw_bake_see(const qw_source *source, const qw_bake_points *points, uint32_t count, uint32_t *hint,
                 const qw_bvh_cache *cache, qw_sight sight[QW_LANES])
{
    qw_hit hit[QW_LANES];
    qw_vec3 from[QW_LANES], down[QW_LANES];
    float through[QW_LANES];
    for (int i = 0; i < QW_LANES; i++) {
        from[i] = qw_lane(&points->from, i), down[i] = qw_scale(qw_lane(&points->aim, i), -1);
        through[i] = 2 * points->cage[i];
    }
    qw_bvh_rays_near(source->bvh, cache, from, down, through, count, hit);
    for (int i = 0; i < (int)count; i++) sight[i] = see_one(source, points, i, hit[i], hint, cache);
}

#include "geometry/flips.h"

#include "geometry/slide.h"

#include <assert.h>
#include <float.h>
#include <math.h>

enum {
    POINTS = 4,        /* of a triangle that are looked at: its centre, and one towards each corner */
    MOST_AGREEING = 64 /* triangles that are added up to see whether they are more than a sliver patch */
};

static const float weights[POINTS][3] = {{1.0f / 3, 1.0f / 3, 1.0f / 3},
                                         {2.0f / 3, 1.0f / 6, 1.0f / 6},
                                         {1.0f / 6, 2.0f / 3, 1.0f / 6},
                                         {1.0f / 6, 1.0f / 6, 2.0f / 3}};

static qw_vec3 point_in(const qw_vec3 *p, const uint32_t *c, int k)
{
    qw_vec3 q = qw_scale(p[c[0]], weights[k][0]);
    return qw_madd(qw_madd(q, weights[k][1], p[c[1]]), weights[k][2], p[c[2]]);
}

/* Of a triangle, or 0 where it is thinner than its corners are rounded, as coordinates go up to 1: such a one has no
   side. */
static qw_vec3 cross_of(const qw_vec3 *p, const uint32_t *c)
{
    qw_vec3 cross = qw_triangle_cross(p, c);
    float longest2 = 0;
    for (int i = 0; i < 3; i++) longest2 = fmaxf(longest2, qw_length2(qw_sub(p[c[(i + 1) % 3]], p[c[i]])));
    return qw_length2(cross) > 4 * FLT_EPSILON * FLT_EPSILON * longest2 ? cross : qw_v3(0, 0, 0);
}

static qw_vec3 surface_normal(const qw_flip_judge *j, uint32_t face)
{
    const qw_trimesh *s = j->surface;
    qw_vec3 cross = cross_of(s->position, s->corner + 3 * (size_t)face);
    return j->normal && qw_length2(cross) > 0 ? j->normal[face] : qw_normalize(cross);
}

static qw_hit find_nearest(const qw_flip_judge *j, qw_vec3 point, qw_vec3 normal, float least_dot, float reach,
                           uint32_t hint)
{
    qw_hit hit = qw_bvh_nearest(j->tree, point, normal, least_dot, reach, hint);
    if (j->effort) *j->effort += hit.looked;
    return hit;
}

/* Whether more than a share of the triangles' area faces against what is nearest to it. */
static bool opposes_nearest(const qw_flip_judge *j, const qw_vec3 *p, const uint32_t *corner, uint32_t count,
                            float share, uint32_t *hint)
{
    assert(j->surface && j->tree);
    assert(share >= 0 && share <= 1);
    float all = 0, opposed = 0, other = 0;
    for (uint32_t t = 0; t < count; t++) all += qw_length(cross_of(p, corner + 3 * t));
    for (uint32_t t = 0; t < count; t++) {
        const uint32_t *c = corner + 3 * t;
        qw_vec3 cross = cross_of(p, c), normal = qw_normalize(cross);
        for (int k = 0; k < POINTS; k++) {
            qw_hit hit = find_nearest(j, point_in(p, c, k), qw_v3(0, 0, 0), -1, INFINITY, *hint);
            if (hit.face == QW_NONE) return false;
            *hint = hit.face;
            bool is_sheet = j->both && j->both[hit.face];
            bool against = !is_sheet && qw_dot(normal, surface_normal(j, hit.face)) < QW_FLIP_OPPOSES;
            *(against ? &opposed : &other) += qw_length(cross) / POINTS;
            if (other >= (1 - share) * all) return false;
        }
    }
    return opposed > share * all;
}

/* Whether a triangle agrees with a normal, and a point of it is within `reach` of p. */
static bool agrees_near(const qw_trimesh *s, uint32_t triangle, qw_vec3 p, qw_vec3 normal, float reach)
{
    assert(triangle < s->face_count);
    const uint32_t *c = s->corner + 3 * (size_t)triangle;
    qw_vec3 n = qw_face_cross(s, triangle);
    if (qw_dot(n, normal) <= QW_FLIP_AGREES * qw_length(n)) return false;
    return qw_triangle_distance2(s->position[c[0]], s->position[c[1]], s->position[c[2]], p) <= reach * reach;
}

/* Whether the triangles that agree, connected to the one given, have an area of `enough`; false where it takes too many
 * of them. */
static bool is_more_than_sliver_patch(const qw_trimesh *s, uint32_t triangle, qw_vec3 p, qw_vec3 normal, float reach,
                                      float enough)
{
    assert(triangle < s->face_count);
    uint32_t list[MOST_AGREEING] = {triangle}, count = 1;
    float area = 0;
    for (uint32_t i = 0; i < count; i++) {
        area += 0.5f * qw_length(qw_face_cross(s, list[i]));
        if (area >= enough) return true;
        for (uint32_t h = 3 * list[i]; h < 3 * list[i] + 3 && count < MOST_AGREEING; h++) {
            uint32_t next = s->twin[h] == QW_NONE ? QW_NONE : s->twin[h] / 3, k = 0;
            while (k < count && list[k] != next) k++;
            if (next != QW_NONE && k == count && agrees_near(s, next, p, normal, reach)) list[count++] = next;
        }
    }
    return false;
}

/* Whether for nearly all of the triangles' area no surface nearby faces the same way. */
static bool is_alone(const qw_flip_judge *j, const qw_vec3 *p, const uint32_t *corner, uint32_t count,
                     const qw_flip_limits *l)
{
    assert(j->surface && j->tree);
    float all = 0, agreed = 0, reach = l->reach * j->edge, sliver_patch = l->sliver_patch * j->edge * j->edge;
    uint32_t hint = QW_NONE;
    for (uint32_t t = 0; t < count; t++) all += qw_length(cross_of(p, corner + 3 * t));
    for (uint32_t t = 0; t < count; t++) {
        const uint32_t *c = corner + 3 * t;
        qw_vec3 cross = cross_of(p, c), normal = qw_normalize(cross);
        for (int k = 0; k < POINTS; k++) {
            qw_vec3 point = point_in(p, c, k);
            qw_hit hit = find_nearest(j, point, normal, QW_FLIP_AGREES, reach, hint);
            if (hit.face == QW_NONE) continue;
            hint = hit.face;
            if (sliver_patch > 0 &&
                !is_more_than_sliver_patch(j->surface, hit.face, point, normal, reach, sliver_patch))
                continue;
            agreed += qw_length(cross) / POINTS;
            if (agreed > (1 - l->alone) * all) return false;
        }
    }
    return true;
}

bool qw_is_flipped(const qw_flip_judge *judge, const qw_vec3 *position, const uint32_t *corner, uint32_t count,
                   const qw_flip_limits *limits, uint32_t *hint)
{
    assert(judge->edge > 0 && (limits->sliver_patch <= 0 || judge->surface->twin));
    return opposes_nearest(judge, position, corner, count, limits->share, hint) &&
           is_alone(judge, position, corner, count, limits);
}

qw_flip qw_flip_of_quad(const qw_flip_judge *judge, const qw_vec3 *position, const uint32_t *corner)
{
    const uint32_t halves[6] = {corner[0], corner[1], corner[2], corner[0], corner[2], corner[3]};
    uint32_t hint = QW_NONE;
    if (!qw_is_flipped(judge, position, halves, 2, &QW_FLIP_POSSIBLE, &hint)) return QW_NOT_FLIPPED;
    return qw_is_flipped(judge, position, halves, 2, &QW_FLIP_CERTAIN, &hint) ? QW_FLIPPED : QW_DOUBTFUL;
}

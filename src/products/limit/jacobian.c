/* Around each bad quad its vertices and their neighbours try steps in eight directions, or two on a curve, of shorter
 * and shorter lengths, each put on the shape first, and take the best: that which leaves the least sum of the squares
 * by which corners around miss the aim and a margin. One vertex after another, so that none undoes what another gained.
 */
#include "products/limit/jacobian.h"

#include "geometry/step_search.h"
#include "products/limit/stencils.h"
#include "base/groups.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { ROUNDS = 16, LENGTHS = 4 };
/* Of the longest step tried, in edges; each next is half as long. And how far a vertex may get in all. */
static const float LONGEST = 0.3f, FARTHEST = 1;
/* Above the aim, so that rounding does not lose it; and what angles count beside it. */
static const float MARGIN = 0.05f, FAIRNESS = 1e-3f;
/* Cosine between a quad's normal and the surface's below which it would face away. */
static const float FACES = 0.2f;

typedef struct raising {
    qw_quadmesh *quads;
    const qw_shape *shape;
    const uint8_t *rule, *stays;
    uint8_t *was_good; /* uint8_t[quads]: at the aim already, where it is to stay */
    uint32_t (*crease)[2];
    const float *edge;
    const qw_vec3 *normal, *start; /* qw_vec3[vertices]: normals and places at first */
    qw_vec3 along;                 /* of the curve at the vertex that is searched */
    float aim;
} raising;

static float corner_sine(const qw_vec3 *position, const uint32_t *corner, uint32_t i, qw_vec3 up)
{
    qw_vec3 p = position[corner[i]], a = qw_sub(position[corner[(i + 1) & 3]], p),
            b = qw_sub(position[corner[(i + 3) & 3]], p);
    float lengths = qw_length(a) * qw_length(b);
    return lengths > 0 ? qw_dot(qw_cross(a, b), up) / lengths : 0;
}

float qw_scaled_jacobian(const qw_vec3 *position, const uint32_t *corner)
{
    qw_vec3 up = qw_normalize(qw_quad_cross(position, corner));
    float least = 1;
    for (uint32_t i = 0; i < 4; i++) least = fminf(least, corner_sine(position, corner, i, up));
    return least;
}

/* What a quad's corners miss; infinite where it was at the aim and would not be. */
static double cost_at(void *user, uint32_t v, uint32_t f)
{
    const raising *r = user;
    const qw_vec3 *position = r->quads->position;
    const uint32_t *corner = r->quads->corner + 4 * (size_t)f;
    qw_vec3 up = qw_normalize(qw_quad_cross(position, corner));
    float sum = qw_dot(up, r->normal[v]) < FACES ? 4 : 0;
    for (uint32_t i = 0; i < 4; i++) {
        float sine = corner_sine(position, corner, i, up), lack = fmaxf(r->aim + MARGIN - sine, 0);
        if (sine < r->aim && r->was_good[f]) return INFINITY;
        sum += lack * lack + FAIRNESS * (1 - sine) * (1 - sine);
    }
    return (double)sum;
}

/* How far vertex v may be moved, along which axes: along its crease, or in its tangent plane; 0: it stays. */
static double frame_of(void *user, uint32_t v, qw_spot *here, qw_vec3 axis[2])
{
    raising *r = user;
    const qw_vec3 *at = r->quads->position;
    if (r->rule[v] == QW_RULE_CORNER || (r->stays && r->stays[v])) return 0;
    (void)here;
    axis[0] = qw_any_orthogonal(r->normal[v]), axis[1] = qw_cross(r->normal[v], axis[0]);
    if (r->rule[v] == QW_RULE_CREASE) {
        r->along = qw_normalize(qw_sub(at[r->crease[v][1]], at[r->crease[v][0]]));
        axis[0] = r->along, axis[1] = qw_v3(0, 0, 0);
    }
    return (double)(LONGEST * r->edge[v]);
}

static bool land(void *user, uint32_t v, const double aimed[3], qw_spot *spot)
{
    const raising *r = user;
    qw_vec3 to = qw_v3_of_doubles(aimed);
    qw_shape_hit hit = r->rule[v] == QW_RULE_CREASE ? qw_nearest_on_curves(r->shape, to, r->along, r->edge[v])
                                                    : qw_nearest_on_shape(r->shape, r->quads->component[v], to,
                                                                          r->normal[v], r->edge[v], &spot->on);
    qw_to_doubles(hit.point, spot->at);
    return hit.is_found && qw_distance(hit.point, r->start[v]) <= FARTHEST * r->edge[v];
}

/* Lists the vertices of bad quads, and of the quads around them; returns how many quads are bad. */
static uint32_t list_around_bad(const raising *r, uint8_t *marks, uint32_t *list, uint32_t *count)
{
    const qw_quadmesh *q = r->quads;
    uint32_t bad = 0;
    memset(marks, 0, q->vertex_count);
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *corner = q->corner + 4 * (size_t)f;
        r->was_good[f] = qw_scaled_jacobian(q->position, corner) >= r->aim;
        for (int i = 0; i < 4 && !r->was_good[f]; i++) marks[corner[i]] = 1;
        bad += !r->was_good[f];
    }
    qw_grow_marks(q, 2, marks);
    *count = 0;
    for (uint32_t v = 0; v < q->vertex_count; v++)
        if (marks[v]) list[(*count)++] = v;
    return bad;
}

uint32_t qw_raise_jacobians(qw_env *env, qw_quadmesh *q, const qw_shape *shape, const uint8_t *stays, float aim)
{
    assert(q->twin && q->component && shape->tree);
    uint32_t n = q->vertex_count, bad = 0;
    qw_vec3 *position = QW_NEW(env, qw_vec3, n);
    memcpy(position, q->position, n * sizeof *position);
    qw_scope_begin(env);
    raising r = {.quads = q, .shape = shape, .stays = stays, .start = q->position, .aim = aim};
    r.crease = qw_alloc(env, n, sizeof *r.crease);
    r.rule = qw_find_rules(env, q, r.crease), r.edge = qw_edges_around(env, q);
    r.normal = qw_quadmesh_vertex_normals(env, q), r.was_good = QW_NEW(env, uint8_t, q->face_count);
    uint8_t *awake = QW_NEW(env, uint8_t, n), *marks = QW_NEW(env, uint8_t, n);
    qw_step_search search = {q->corner, position, NULL, NULL, NULL, awake, LENGTHS, &r, frame_of, land, NULL, cost_at};
    search.around = qw_group(env, q->corner, 4 * q->face_count, q->vertex_count, &search.begin);
    uint32_t *list = QW_NEW(env, uint32_t, n), count;
    q->position = position;
    bool any = true;
    for (int round = 0; round < ROUNDS && any; round++) {
        uint32_t bad_now = list_around_bad(&r, marks, list, &count);
        if (round == 0) bad = bad_now;
        if (bad_now == 0) break;
        qw_heartbeat(env);
        memset(awake, 1, n);
        any = qw_search_all(&search, list, count);
    }
    qw_scope_end(env);
    return bad;
}

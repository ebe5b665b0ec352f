/* Around each bad quad its vertices and their neighbours try steps in eight directions, or two on a curve, of shorter
 * and shorter lengths, each put on the shape first, and take the best: that which leaves the least sum of the squares
 * by which corners around miss the aim and a margin. One vertex after another, so that none undoes what another gained.
 */
#include "products/limit/jacobian.h"

#include "products/limit/stencils.h"

#include <assert.h>
#include <math.h>
#include <string.h>

enum { ROUNDS = 16, LENGTHS = 4, WAYS = 8, MOST_AROUND = 64 };
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
    uint32_t (*crease)[2];
    const uint32_t *outgoing;
    const float *edge;
    const qw_vec3 *normal, *start; /* qw_vec3[vertices]: normals and places at first */
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

/* What the quads around v miss, by their corners; infinite where one faces away. */
static float missed_around(const raising *r, uint32_t v)
{
    const qw_quadmesh *q = r->quads;
    float sum = 0;
    uint32_t h = r->outgoing[v];
    for (int k = 0; h != QW_NONE && k < MOST_AROUND; k++) {
        const uint32_t *corner = q->corner + 4 * (size_t)(h / 4);
        qw_vec3 up = qw_normalize(qw_quad_cross(q->position, corner));
        for (uint32_t i = 0; i < 4; i++) {
            float sine = corner_sine(q->position, corner, i, up), lack = fmaxf(r->aim + MARGIN - sine, 0);
            sum += lack * lack + FAIRNESS * (1 - sine) * (1 - sine);
        }
        if (qw_dot(up, r->normal[v]) < FACES) sum += 4;
        h = qw_quad_around(q, h);
        if (h == r->outgoing[v]) break;
    }
    return sum;
}

/* The least scaled Jacobian of the quads around v, but for those below the aim at first. */
static bool goes_below(const raising *r, uint32_t v, const uint8_t *was_good)
{
    uint32_t h = r->outgoing[v];
    for (int k = 0; h != QW_NONE && k < MOST_AROUND; k++) {
        uint32_t f = h / 4;
        if (was_good[f] && qw_scaled_jacobian(r->quads->position, r->quads->corner + 4 * (size_t)f) < r->aim)
            return true;
        h = qw_quad_around(r->quads, h);
        if (h == r->outgoing[v]) break;
    }
    return false;
}

/* Where a step leads; false where there is nothing near. */
static bool step_to(const raising *r, uint32_t v, int way, float length, qw_vec3 *to)
{
    static const float across[WAYS][2] = {{1, 0},  {0.7f, 0.7f},   {0, 1},  {-0.7f, 0.7f},
                                          {-1, 0}, {-0.7f, -0.7f}, {0, -1}, {0.7f, -0.7f}};
    const qw_vec3 *at = r->quads->position;
    qw_shape_hit hit;
    uint32_t hint = QW_NONE;
    if (r->rule[v] == QW_RULE_CREASE) {
        qw_vec3 tangent = qw_normalize(qw_sub(at[r->crease[v][1]], at[r->crease[v][0]]));
        hit = qw_nearest_on_curves(r->shape, qw_madd(at[v], way == 0 ? length : -length, tangent), tangent, r->edge[v]);
    } else {
        qw_vec3 x = qw_any_orthogonal(r->normal[v]), y = qw_cross(r->normal[v], x);
        qw_vec3 aimed = qw_madd(qw_madd(at[v], length * across[way][0], x), length * across[way][1], y);
        hit = qw_nearest_on_shape(r->shape, r->quads->component[v], aimed, r->normal[v], r->edge[v], &hint);
    }
    *to = hit.point;
    return hit.is_found && qw_distance(hit.point, r->start[v]) <= FARTHEST * r->edge[v];
}

static bool improve(const raising *r, uint32_t v, const uint8_t *was_good)
{
    if (r->rule[v] == QW_RULE_CORNER || (r->stays && r->stays[v])) return false;
    qw_vec3 *place = &r->quads->position[v], first = *place, best = first;
    float least = missed_around(r, v), length = LONGEST * r->edge[v];
    int ways = r->rule[v] == QW_RULE_CREASE ? 2 : WAYS;
    bool any = false;
    for (int k = 0; k < LENGTHS; k++, length *= 0.5f) {
        for (int way = 0; way < ways; way++) {
            qw_vec3 to;
            *place = first;
            if (!step_to(r, v, way, length, &to)) continue;
            *place = to;
            float missed = missed_around(r, v);
            if (!(missed < 0.999f * least) || goes_below(r, v, was_good)) continue;
            least = missed, best = to, any = true;
        }
        first = best;
    }
    *place = best;
    return any;
}

/* Marks the vertices of bad quads, and of the quads around them; returns how many quads are bad. */
static uint32_t mark_bad(const raising *r, uint8_t *wanted, uint8_t *was_good)
{
    const qw_quadmesh *q = r->quads;
    uint32_t count = 0;
    memset(wanted, 0, q->vertex_count);
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *corner = q->corner + 4 * (size_t)f;
        was_good[f] = qw_scaled_jacobian(q->position, corner) >= r->aim;
        for (int i = 0; i < 4 && !was_good[f]; i++) wanted[corner[i]] = 2;
        count += !was_good[f];
    }
    for (uint32_t f = 0; f < q->face_count; f++) {
        const uint32_t *corner = q->corner + 4 * (size_t)f;
        bool beside = false;
        for (int i = 0; i < 4; i++) beside |= wanted[corner[i]] == 2;
        for (int i = 0; i < 4; i++) wanted[corner[i]] |= beside;
    }
    return count;
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
    r.normal = qw_quadmesh_vertex_normals(env, q), r.outgoing = qw_quadmesh_outgoing(env, q);
    uint8_t *wanted = QW_NEW(env, uint8_t, n), *was_good = QW_NEW(env, uint8_t, q->face_count);
    q->position = position;
    bool any = true;
    for (int round = 0; round < ROUNDS && any; round++) {
        any = false;
        uint32_t count = mark_bad(&r, wanted, was_good);
        if (round == 0) bad = count;
        if (count == 0) break;
        for (uint32_t v = 0; v < n; v++) {
            if (!wanted[v]) continue;
            qw_break_silence(env);
            any |= improve(&r, v, was_good);
        }
    }
    qw_scope_end(env);
    return bad;
}

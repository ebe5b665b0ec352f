#include "products/limit/flip_guard.h"

#include <assert.h>
#include <string.h>

enum { GRAIN = 512, ROUNDS = 24, HALVINGS = 4 /* of a vertex's way, until it stays */ };
/* Cosine between a corner's normals before and after: below it the corner has flipped. */
static const float LEAST_TURN = 0.2f;

typedef struct keeping {
    qw_quadmesh *quads;
    const qw_vec3 *before, *wanted; /* qw_vec3[vertices] */
    uint8_t *is_worse;              /* uint8_t[faces] */
    uint8_t *halvings;              /* uint8_t[vertices] */
} keeping;

static qw_vec3 corner_cross(const qw_vec3 *position, const uint32_t *corner, uint32_t i)
{
    qw_vec3 p = position[corner[i]];
    return qw_cross(qw_sub(position[corner[(i + 1) & 3]], p), qw_sub(position[corner[(i + 3) & 3]], p));
}

static bool has_moved(const keeping *k, const uint32_t *corner)
{
    for (int i = 0; i < 4; i++)
        if (memcmp(&k->quads->position[corner[i]], &k->before[corner[i]], sizeof *k->before) != 0) return true;
    return false;
}

static bool is_worse(const keeping *k, const uint32_t *corner)
{
    const qw_vec3 *now = k->quads->position, *before = k->before;
    qw_vec3 quad_is = qw_quad_cross(now, corner), quad_was = qw_quad_cross(before, corner);
    if (!has_moved(k, corner)) return false;
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 was = corner_cross(before, corner, i), is = corner_cross(now, corner, i);
        if (qw_dot(is, quad_is) <= 0 && qw_dot(was, quad_was) > 0) return true;
        if (qw_dot(qw_normalize(is), qw_normalize(was)) < LEAST_TURN && qw_length2(was) > 0) return true;
    }
    return false;
}

static void judge_block(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const keeping *k = user;
    for (uint32_t f = begin; f < end; f++) k->is_worse[f] = is_worse(k, k->quads->corner + 4 * (size_t)f);
}

static void step_back(const keeping *k, uint32_t v)
{
    static const float share[HALVINGS + 1] = {1, 0.5f, 0.25f, 0.125f, 0};
    uint8_t *halvings = &k->halvings[v];
    if (*halvings == HALVINGS) return;
    ++*halvings;
    k->quads->position[v] = *halvings == HALVINGS ? k->before[v]
                                                  : qw_lerp(k->before[v], k->wanted[v], share[*halvings]);
}

uint32_t qw_hold_back_flips(qw_env *env, qw_quadmesh *q, const qw_vec3 *before)
{
    assert(q->position != before);
    uint32_t n = q->vertex_count, held = 0, worse = 1;
    qw_scope_begin(env);
    qw_vec3 *wanted = QW_NEW(env, qw_vec3, n);
    memcpy(wanted, q->position, n * sizeof *wanted);
    keeping k = {q, before, wanted, QW_NEW(env, uint8_t, q->face_count), QW_NEW_ZERO(env, uint8_t, n)};
    uint8_t *steps = QW_NEW(env, uint8_t, n);
    for (int round = 0; round < ROUNDS && worse > 0; round++) {
        worse = 0;
        memset(steps, 0, n);
        qw_parallel(env, q->face_count, GRAIN, judge_block, &k);
        for (uint32_t f = 0; f < q->face_count; f++)
            for (uint32_t i = 0; k.is_worse[f] && i < 4; i++) worse++, steps[q->corner[4 * (size_t)f + i]] = 1;
        for (uint32_t v = 0; v < n; v++)
            if (steps[v]) step_back(&k, v);
    }
    for (uint32_t v = 0; v < n; v++) held += k.halvings[v] > 0;
    qw_scope_end(env);
    return held;
}

#include "geometry/go_back.h"

#include <assert.h>
#include <string.h>

enum { ROUNDS = 24, STEPS = 4 };
/* Of its way that a vertex goes after so many steps back. */
static const float SHARE[STEPS + 1] = {1, 0.5f, 0.25f, 0.125f, 0};
/* Cosine between a corner's normals before and after: below it the corner has flipped. */
static const float LEAST_TURN = 0.2f;

bool qw_go_back(qw_env *env, const qw_going_back *g, uint8_t *went_back)
{
    assert(g->judge && g->put);
    const qw_quadmesh *q = g->quads;
    bool any = true;
    qw_scope_begin(env);
    uint8_t *steps = QW_NEW_ZERO(env, uint8_t, q->vertex_count), *goes = QW_NEW(env, uint8_t, q->vertex_count),
            *is_worse = QW_NEW(env, uint8_t, q->face_count);
    for (int round = 0; round < ROUNDS && any; round++) {
        any = false;
        memset(goes, 0, q->vertex_count), memset(is_worse, 0, q->face_count);
        g->judge(env, g->user, is_worse);
        for (uint32_t h = 0; h < 4 * q->face_count; h++)
            if (is_worse[h / 4]) goes[q->corner[h]] = 1;
        for (uint32_t v = 0; v < q->vertex_count; v++) {
            if (!goes[v] || steps[v] == STEPS) continue;
            steps[v] = g->at_once ? STEPS : steps[v] + 1u;
            g->put(g->user, v, SHARE[steps[v]]), any = true;
        }
    }
    for (uint32_t v = 0; went_back && v < q->vertex_count; v++) went_back[v] = steps[v] > 0;
    qw_scope_end(env);
    return !any;
}

/* ---- corners that turn over */

typedef struct holding {
    qw_quadmesh *quads;
    const qw_vec3 *before, *wanted; /* qw_vec3[vertices] */
    uint8_t *is_worse;
} holding;

static qw_vec3 corner_cross(const qw_vec3 *position, const uint32_t *corner, uint32_t i)
{
    qw_vec3 p = position[corner[i]];
    return qw_cross(qw_sub(position[corner[(i + 1) & 3]], p), qw_sub(position[corner[(i + 3) & 3]], p));
}

/* Whether a quad that had the places `before` has a corner now that is folded and was not, or that faces elsewhere. */
static bool turns_over(const qw_vec3 *before, const qw_vec3 *now, const uint32_t *corner)
{
    qw_vec3 quad_is = qw_quad_cross(now, corner), quad_was = qw_quad_cross(before, corner);
    for (uint32_t i = 0; i < 4; i++) {
        qw_vec3 was = corner_cross(before, corner, i), is = corner_cross(now, corner, i);
        if (qw_dot(is, quad_is) <= 0 && qw_dot(was, quad_was) > 0) return true;
        if (qw_dot(qw_normalize(is), qw_normalize(was)) < LEAST_TURN && qw_length2(was) > 0) return true;
    }
    return false;
}

static void judge_block(void *user, uint32_t begin, uint32_t end)
{
    const holding *h = user;
    for (uint32_t f = begin; f < end; f++)
        h->is_worse[f] = turns_over(h->before, h->quads->position, h->quads->corner + 4 * (size_t)f);
}

static void judge(qw_env *env, void *user, uint8_t *is_worse)
{
    holding *h = user;
    h->is_worse = is_worse;
    qw_parallel(env, h->quads->face_count, QW_GRAIN_HEAVY, judge_block, h);
}

static void put(void *user, uint32_t v, float share)
{
    const holding *h = user;
    h->quads->position[v] = share > 0 ? qw_lerp(h->before[v], h->wanted[v], share) : h->before[v];
}

uint32_t qw_hold_back_flips(qw_env *env, qw_quadmesh *q, const qw_vec3 *before)
{
    assert(q->position != before);
    uint32_t n = q->vertex_count, held = 0;
    qw_scope_begin(env);
    qw_vec3 *wanted = QW_NEW(env, qw_vec3, n);
    memcpy(wanted, q->position, n * sizeof *wanted);
    uint8_t *went_back = QW_NEW(env, uint8_t, n);
    holding h = {.quads = q, .before = before, .wanted = wanted};
    qw_go_back(env, &(qw_going_back){q, false, &h, judge, put}, went_back);
    for (uint32_t v = 0; v < n; v++) held += went_back[v];
    qw_scope_end(env);
    return held;
}

#include "remesh/field/alignment.h"

#include "geometry/curvature.h"

#include <assert.h>
#include <math.h>

/* Rounds of averaging a direction with those of its neighbours. A round reaches about half an edge of the quads. With
 * three rounds, noise of the size of the quads steers them. */
enum { ROUNDS = 6 };
/* Weight of a direction at follow 1, as a multiple of the weights of the vertex's edges: PULL times the square of its
 * clearness, at most MOST_PULL. Where the surface bows by a fifth of a quad's edge, it weighs half as much as they. */
static const float PULL = 12, MOST_PULL = 8;
/* Weight of a direction that was asked for, as a multiple of the weights of the vertex's edges: a cross that they would
 * turn by 45 degrees gives way by two. */
static const float ASKED_PULL = 16;
static const float LEAST_LENGTH = 1e-12f; /* of a mean length, squared: keeps a division from 0 / 0 */

/* Pieces of the surface around a point, some thousands where it is one sheet; where there are more, it runs through
   itself again and again, and its bends mean nothing. */
enum { MOST_PIECES = 1 << 16 };

typedef struct direction_task {
    const qw_ball_curvature *curvature;
    bool may_crowd; /* more than MOST_PIECES may lie around a point */
    const qw_vec3 *point, *normal;
    qw_vec3 *direction;
} direction_task;

/* The principal direction at each vertex, as long as it is clear; 0 where too much lies around it. */
static void direction_block(void *user, uint32_t begin, uint32_t end)
{
    const direction_task *t = user;
    for (uint32_t v = begin; v < end; v++) {
        t->direction[v] = qw_v3(0, 0, 0);
        if (t->may_crowd && qw_ball_effort(t->curvature, t->point[v]) > MOST_PIECES) continue;
        qw_principal p = qw_ball_curvature_at(t->curvature, t->point[v], t->normal[v]);
        t->direction[v] = qw_scale(p.direction, p.weight);
    }
}

qw_vec3 *qw_principal_directions(qw_env *env, const qw_trimesh *surface, double h, const qw_vec3 *point,
                                 const qw_vec3 *normal, uint32_t count)
{
    assert(h > 0);
    qw_vec3 *direction = QW_NEW(env, qw_vec3, count);
    qw_scope_begin(env);
    qw_vec3 *facing = QW_NEW(env, qw_vec3, surface->face_count);
    for (uint32_t f = 0; f < surface->face_count; f++) facing[f] = qw_normalize(qw_face_cross(surface, f));
    const qw_ball_curvature *curvature = qw_ball_curvature_of(env, surface, facing, QW_BALL_UNMARKED, h);
    bool may_crowd = qw_ball_most_effort(curvature) > MOST_PIECES;
    direction_task t = {curvature, may_crowd, point, normal, direction};
    qw_parallel(env, count, QW_GRAIN_HEAVY, direction_block, &t);
    qw_scope_end(env);
    return direction;
}

/* ---- pull */

/* The cross that a vertex's principal direction asks for: the fourth power of its angle to the vertex's axis, times the
 * direction's clearness, which `length` holds by itself. Sums of crosses are shorter where they disagree. */
typedef struct preference {
    qw_phasor cross;
    float length;
} preference;

typedef struct pull_task {
    qw_connection_level *c;
    const qw_vec3 *axis;
    qw_vec3 *direction;
    const preference *own, *from;
    preference *to;
    float follow;
    float *pulled;
} pull_task;

/* The cross that each vertex's direction asks for. */
static void preference_block(void *user, uint32_t begin, uint32_t end)
{
    const pull_task *t = user;
    for (uint32_t v = begin; v < end; v++) {
        float length = qw_length(t->direction[v]);
        qw_phasor z = qw_phasor_of_cross(t->direction[v], t->c->level->normal[v], t->axis[v]);
        t->to[v] = (preference){{length * z.re, length * z.im}, length};
    }
}

/* Replaces each preference by the mean of itself and of its neighbours' mean, carried along the links. */
static void spread_block(void *user, uint32_t begin, uint32_t end)
{
    const pull_task *t = user;
    const qw_level *level = t->c->level;
    for (uint32_t v = begin; v < end; v++) {
        preference sum = {{0, 0}, 0};
        float weight = 0;
        for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++) {
            qw_phasor link = t->c->link[i];
            const preference *u = &t->from[level->neighbour[i]];
            if (link.re == 0 && link.im == 0) continue;
            sum.cross = qw_phasor_add(sum.cross, qw_phasor_mul(link, u->cross));
            sum.length += level->weight[i] * u->length;
            weight += level->weight[i];
        }
        const preference *own = &t->from[v];
        float half = weight > 0 ? 0.5f / weight : 0, rest = weight > 0 ? 0.5f : 1;
        t->to[v].cross = (qw_phasor){rest * own->cross.re + half * sum.cross.re,
                                     rest * own->cross.im + half * sum.cross.im};
        t->to[v].length = rest * own->length + half * sum.length;
    }
}

/* Whether a neighbour lies on a curve: its normal is a mean over sides that the field does not cross, and the bend that
   it makes is none of the surface's. The curve itself says there how quads are to lie. */
static bool is_beside_curve(const qw_level *level, uint32_t v)
{
    for (uint32_t i = level->begin[v]; i < level->begin[v + 1]; i++)
        if (level->constraint[level->neighbour[i]] != QW_VERTEX_FREE) return true;
    return false;
}

/* Pulls each cross towards what its neighbourhood prefers, as far as that agrees in itself; not beside curves,
 * which decide there. */
static void pull_block(void *user, uint32_t begin, uint32_t end)
{
    const pull_task *t = user;
    for (uint32_t v = begin; v < end; v++) {
        preference own = t->own[v], around = t->from[v];
        if (!(own.length > 0)) continue;
        float mean2 = around.cross.re * around.cross.re + around.cross.im * around.cross.im;
        float agree = mean2 / fmaxf(around.length * around.length, LEAST_LENGTH);
        t->direction[v] = qw_scale(t->direction[v], fminf(sqrtf(agree), 1));
        if (is_beside_curve(t->c->level, v)) continue;
        float pull = t->c->diagonal[v] * t->follow * fminf(PULL * own.length * own.length, MOST_PULL) * agree;
        qw_phasor target = qw_phasor_unit(own.cross);
        t->c->pull[v] = qw_phasor_add(t->c->pull[v], (qw_phasor){pull * target.re, pull * target.im});
        t->c->diagonal[v] += pull;
        t->pulled[v] += pull;
    }
}

void qw_pull_along(qw_env *env, qw_connection_level *c, const qw_vec3 *axis, qw_vec3 *direction, float follow,
                   float *pulled)
{
    assert(follow >= 0);
    uint32_t n = c->level->vertex_count;
    qw_scope_begin(env);
    preference *own = QW_NEW(env, preference, n), *spread[2] = {QW_NEW(env, preference, n), QW_NEW(env, preference, n)};
    pull_task t = {.c = c, .axis = axis, .direction = direction, .own = own, .to = own};
    qw_parallel(env, n, QW_GRAIN_HEAVY, preference_block, &t);
    t.from = own;
    for (int i = 0; i < ROUNDS; i++) {
        t.to = spread[i % 2];
        qw_parallel(env, n, QW_GRAIN_HEAVY, spread_block, &t);
        t.from = t.to;
    }
    t.follow = follow, t.pulled = pulled;
    qw_parallel(env, n, QW_GRAIN_HEAVY, pull_block, &t);
    qw_scope_end(env);
}

/* ---- directions that were asked for */

typedef struct asked_task {
    qw_connection_level *c;
    const qw_vec3 *axis, *asked;
    float *pulled;
} asked_task;

/* Pulls each cross towards the direction that was asked for at its vertex. */
static void pull_to_asked_block(void *user, uint32_t begin, uint32_t end)
{
    const asked_task *t = user;
    for (uint32_t v = begin; v < end; v++) {
        float pull = t->c->diagonal[v] * ASKED_PULL * qw_length(t->asked[v]);
        if (!(pull > 0) || is_beside_curve(t->c->level, v)) continue;
        qw_phasor z = qw_phasor_of_cross(t->asked[v], t->c->level->normal[v], t->axis[v]);
        t->c->pull[v] = qw_phasor_add(t->c->pull[v], (qw_phasor){pull * z.re, pull * z.im});
        t->c->diagonal[v] += pull;
        t->pulled[v] += pull;
    }
}

void qw_pull_to_asked(qw_env *env, qw_connection_level *c, const qw_vec3 *axis, const qw_vec3 *asked, float *pulled)
{
    assert(c->level && c->diagonal && axis && asked && pulled);
    asked_task t = {c, axis, asked, pulled};
    qw_parallel(env, c->level->vertex_count, QW_GRAIN_HEAVY, pull_to_asked_block, &t);
}

#include "products/wrap/shrink.h"

#include "base/elementary.h"
#include "products/wrap/skin_blocks.h"
#include "products/wrap/edits.h"
#include "products/wrap/skin_features.h"

#include <math.h>

enum {
    MOVE_ROUNDS = 4, /* of all vertices, before any edge is edited */
    EDIT_ROUNDS = 2, /* of splits, flips, collapses and moves */
    HALVINGS = 3     /* of a step that the guard refuses */
};
/* A vertex moves straight to the nearest point where that lies along its normal; of a step that goes more sideways than
   this (cosine) only the part along the normal is made, as it leads to the rim of a gap that the skin bridges. */
static const double ALONG = 0.5;
static const double RELAXED = 0.5; /* share of the way to the middle of the neighbours */

static bool normalize(double a[3])
{
    double length = sqrt(qw_dot_doubles(a, a));
    for (int k = 0; k < 3; k++) a[k] = length > 0 ? a[k] / length : 0;
    return length > 0;
}

void qw_skin_place(const qw_skin *s, uint32_t v, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = s->position[v].at[k];
}

void qw_skin_normal(const qw_skin *s, uint32_t v, double normal[3])
{
    uint32_t h = s->out[v];
    normal[0] = normal[1] = normal[2] = 0;
    do {
        double n[3];
        const uint32_t *c = s->corner + (h - h % 3);
        qw_exact_normal(&s->position[c[0]], &s->position[c[1]], &s->position[c[2]], n);
        for (int k = 0; k < 3; k++) normal[k] += n[k];
        h = qw_skin_around(s, h);
    } while (h != s->out[v]);
    normalize(normal);
}

qw_wrap_lattice_point qw_rounded(const qw_skin *s, const double p[3])
{
    qw_wrap_lattice_point to;
    for (int k = 0; k < 3; k++) {
        double most = (double)s->frame.side * s->frame.cells[k], at = fmin(fmax(p[k], 0), most);
        to.at[k] = (int32_t)qw_round_even(at);
    }
    return to;
}

void qw_lift(const qw_skin *s, const qw_touch *touch, const double outward[3], double to[3])
{
    double along = qw_dot_doubles(touch->normal, outward), side = along < 0 ? -1 : 1;
    bool plain = fabs(along) > ALONG;
    for (int k = 0; k < 3; k++)
        to[k] = touch->at[k] + QW_WRAP_OFF * s->frame.side * (plain ? side * touch->normal[k] : outward[k]);
}

void qw_lift_from(const qw_skin *s, double at[3], const double outward[3])
{
    for (int k = 0; k < 3; k++) at[k] += QW_WRAP_OFF * s->frame.side * outward[k];
}

bool qw_step_towards(qw_guard_room *room, uint32_t v, const double to[3])
{
    const qw_skin *s = room->guard->skin;
    double from[3], step = 1;
    qw_skin_place(s, v, from);
    for (int i = 0; i <= HALVINGS && !room->reaches_out; i++, step /= 2) {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = from[k] + step * (to[k] - from[k]);
        if (qw_guard_move(room, v, qw_rounded(s, p))) return i == 0;
    }
    return false;
}

static void middle_of_neighbours(const qw_skin *s, uint32_t v, double p[3])
{
    uint32_t h = s->out[v], count = 0;
    double sum[3] = {0, 0, 0};
    do {
        for (int k = 0; k < 3; k++) sum[k] += s->position[qw_skin_head(s, h)].at[k];
        count++, h = qw_skin_around(s, h);
    } while (h != s->out[v]);
    for (int k = 0; k < 3; k++) p[k] = sum[k] / count;
}

/* Where a vertex at p, on a part of the skin with this normal, is wanted: on the input, or over a gap no nearer to its
 * rim. */
static void wanted_place(const qw_skin *s, const qw_wrap_target *target, const double p[3], const double normal[3],
                         uint32_t *hint, double to[3])
{
    qw_touch touch = qw_wrap_target_nearest(target, p, *hint);
    double way[3], lifted[3];
    *hint = touch.face;
    qw_lift(s, &touch, normal, lifted);
    for (int k = 0; k < 3; k++) way[k] = lifted[k] - p[k];
    double along = qw_dot_doubles(way, normal), length = sqrt(qw_dot_doubles(way, way));
    bool is_far = length > 3 * s->frame.side; /* no gap that is bridged is so wide */
    bool straight = fabs(along) >= ALONG * length || length < 0.25 * s->frame.side || is_far;
    for (int k = 0; k < 3; k++) to[k] = straight ? lifted[k] : p[k] + along * normal[k];
}

typedef struct moving {
    const qw_wrap_target *target;
    uint32_t *hint; /* uint32_t[vertices] */
    bool relaxes;
} moving;

/* First along to the middle of its neighbours, as long as that is not straight to the input. */
static void move_vertex(void *user, qw_guard_room *room, uint32_t v, uint32_t *unused)
{
    const moving *m = user;
    const qw_skin *s = room->guard->skin;
    double p[3], normal[3], middle[3], to[3];
    (void)unused;
    qw_skin_place(s, v, p), qw_skin_normal(s, v, normal);
    if (m->relaxes) {
        middle_of_neighbours(s, v, middle);
        for (int k = 0; k < 3; k++) middle[k] = RELAXED * (middle[k] - p[k]);
        double along = qw_dot_doubles(middle, normal);
        for (int k = 0; k < 3; k++) p[k] += middle[k] - along * normal[k];
    }
    wanted_place(s, m->target, p, normal, &m->hint[v], to);
    qw_step_towards(room, v, to);
}

void qw_shrink(qw_env *env, qw_skin *skin, const qw_wrap_target *target)
{
    qw_guard g = qw_guard_begin(env, skin);
    uint32_t vertices = skin->vertex_count;
    moving m = {target, QW_NEW(env, uint32_t, vertices), false};
    const qw_block_work moves = {&m, qw_living_vertex, move_vertex};
    for (uint32_t v = 0; v < vertices; v++) m.hint[v] = QW_NONE;
    for (int i = 0; i < MOVE_ROUNDS; i++) {
        m.relaxes = i > 0;
        qw_in_blocks(env, &g, vertices, &moves);
        qw_progress(env, 0.2 + 0.1 * (i + 1)); /* of the stage, of which a fifth came before, and a fifth follows */
    }
    const qw_near_faces near = {vertices, m.hint};
    for (int i = 0; i < EDIT_ROUNDS; i++) {
        qw_snap_to_features(env, &g, target, &near);
        qw_flip_to_features(env, &g, target, &near);
        qw_split_at_features(env, &g, target, &near);
        qw_flip_to_features(env, &g, target, &near);
        qw_collapse_short(env, &g, target);
        qw_progress(env, 0.6 + 0.1 * (i + 1));
    }
}

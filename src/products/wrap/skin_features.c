#include "products/wrap/skin_features.h"

#include "products/wrap/skin_blocks.h"
#include "products/wrap/edits.h"
#include "base/constants.h"

#include <assert.h>
#include <math.h>
#include <string.h>

/* All lengths are in cells. */
enum {
    MOST_PLANES = 16 /* around a vertex that are looked at */
};
static const double SHARP = 0.85;   /* cosine: planes that turn by more have an edge between them */
static const double CORNER = 0.25;  /* volume of three normals from which on they have a corner */
static const double SNAP = 0.75;    /* a vertex goes no farther to an edge */
static const double ON_INPUT = 0.1; /* and the place must be so near to the input */
static const double CUTS = 0.03;    /* an edge whose middle is farther from the input cuts something off */
static const double LONG = 0.4;     /* shorter ones are not split */
static const double SHORT = 0.3;    /* shorter ones collapse */
static const double GAIN = 0.01;    /* a flip must bring the middle so much nearer */

static double distance_of(const double a[3], const double b[3])
{
    double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return sqrt(qw_dot_doubles(d, d));
}

/* ---- planes of the input and where they meet */

typedef struct plane {
    double at[3], normal[3];
} plane;

static plane plane_at(const qw_wrap_target *target, const double p[3], uint32_t *hint)
{
    qw_touch touch = qw_wrap_target_nearest(target, p, *hint);
    plane f;
    memcpy(f.at, touch.at, sizeof f.at), memcpy(f.normal, touch.normal, sizeof f.normal);
    *hint = touch.face;
    return f;
}

/* The point of all of the 2 or 3 planes that is nearest to p: p plus a combination of their normals. */
static bool meet(const plane *const f[3], int count, const double p[3], double to[3])
{
    assert(count == 2 || count == 3);
    double a[3][4];
    for (int i = 0; i < count; i++) {
        double way[3] = {f[i]->at[0] - p[0], f[i]->at[1] - p[1], f[i]->at[2] - p[2]};
        for (int j = 0; j < count; j++) a[i][j] = qw_dot_doubles(f[i]->normal, f[j]->normal);
        a[i][3] = qw_dot_doubles(f[i]->normal, way);
    }
    for (int i = 0; i < count; i++) { /* the matrix of scalar products is positive: no pivoting */
        if (!(a[i][i] > 1e-3)) return false;
        for (int r = 0; r < count; r++) {
            double share = a[r][i] / a[i][i];
            if (r == i) continue;
            for (int c = i; c < 4; c++) a[r][c] -= share * a[i][c];
        }
    }
    memcpy(to, p, 3 * sizeof *to);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 3; k++) to[k] += a[i][3] / a[i][i] * f[i]->normal[k];
    return true;
}

static double volume(const plane *a, const plane *b, const plane *c)
{
    double n[3];
    qw_cross_doubles(a->normal, b->normal, n);
    return fabs(qw_dot_doubles(n, c->normal));
}

/* The place on the edge or corner that some of the planes make, near p; false where they make none. */
static bool feature_near(const plane *f, int count, const double p[3], double side, double to[3])
{
    int a = 0, b = 0, c = -1;
    double least = 1, most = CORNER;
    for (int i = 0; i < count; i++)
        for (int j = 0; j < i; j++) {
            double turn = fabs(qw_dot_doubles(f[i].normal, f[j].normal));
            if (turn < least) least = turn, a = j, b = i;
        }
    if (least > SHARP) return false;
    for (int i = 0; i < count; i++) {
        double v = volume(&f[a], &f[b], &f[i]);
        if (v > most) most = v, c = i;
    }
    const plane *of[3] = {&f[a], &f[b], c >= 0 ? &f[c] : NULL};
    if (c >= 0 && meet(of, 3, p, to) && distance_of(to, p) <= SNAP * side) return true;
    return meet(of, 2, p, to) && distance_of(to, p) <= SNAP * side;
}

/* Moved off the input as other vertices are; false where the place is not on it. */
static bool lift_feature(const qw_skin *s, const qw_wrap_target *target, const double outward[3], uint32_t hint,
                         double at[3])
{
    double most = ON_INPUT * s->frame.side;
    if (qw_wrap_target_near(target, at, hint, most).distance > most) return false;
    qw_lift_from(s, at, outward);
    return true;
}

static void on_edge(const qw_skin *s, uint32_t a, uint32_t b, double share, double p[3])
{
    for (int k = 0; k < 3; k++) p[k] = s->position[a].at[k] + share * (s->position[b].at[k] - s->position[a].at[k]);
}

/* ---- what is looked at by many threads before anything changes */

/* A question to each face or half-edge; the answers do not depend on how they are parted. */
typedef struct asking {
    qw_env *env;
    const qw_skin *skin;
    const qw_wrap_target *target;
    const qw_near_faces *near;
    bool (*is_wanted)(const qw_skin *s, const qw_wrap_target *target, uint32_t h, uint32_t *hint);
    uint8_t *wanted; /* uint8_t[3 face_count]: half-edges */
    plane *face;     /* plane[face_count]: of the input, nearest to the middle of each face */
} asking;

static void ask_half_edges(void *user, uint32_t begin, uint32_t end)
{
    const asking *a = user;
    uint32_t hint = QW_NONE;
    if (!qw_listen(a->env)) return;
    for (uint32_t h = begin; h < end; h++) {
        if (qw_skin_dead(a->skin, h / 3) || h > a->skin->twin[h]) continue;
        if (a->skin->corner[h] < a->near->count) hint = a->near->face[a->skin->corner[h]];
        a->wanted[h] = a->is_wanted(a->skin, a->target, h, &hint);
    }
}

static uint8_t *wanted_edges(qw_env *env, const qw_skin *s, const qw_wrap_target *target, const qw_near_faces *near,
                             bool (*is_wanted)(const qw_skin *, const qw_wrap_target *, uint32_t, uint32_t *))
{
    asking a = {env, s, target, near, is_wanted, QW_NEW_ZERO(env, uint8_t, 3 * (size_t)s->face_count), NULL};
    qw_parallel(env, 3 * s->face_count, QW_GRAIN, ask_half_edges, &a);
    qw_heartbeat(env);
    return a.wanted;
}

static void middle_of_face(const qw_skin *s, uint32_t f, double p[3])
{
    const uint32_t *c = s->corner + 3 * (size_t)f;
    for (int k = 0; k < 3; k++)
        p[k] = ((double)s->position[c[0]].at[k] + s->position[c[1]].at[k] + s->position[c[2]].at[k]) / 3;
}

/* The plane of the target nearest to the middle of each face. */
static void ask_faces(void *user, uint32_t begin, uint32_t end)
{
    const asking *a = user;
    uint32_t hint = QW_NONE;
    if (!qw_listen(a->env)) return;
    for (uint32_t f = begin; f < end; f++) {
        double p[3];
        if (qw_skin_dead(a->skin, f)) continue;
        middle_of_face(a->skin, f, p);
        a->face[f] = plane_at(a->target, p, &hint);
    }
}

/* ---- vertices */

/* Moves v onto the edge or corner of the target between the planes of its faces, if one is near and the guard
   allows it. */
static void snap_vertex(void *user, qw_guard_room *room, uint32_t v, uint32_t *hint)
{
    const asking *a = user;
    const qw_skin *s = room->guard->skin;
    plane around[MOST_PLANES];
    double p[3], normal[3], to[3];
    int count = 0;
    uint32_t h = s->out[v];
    do {
        if (count < MOST_PLANES) around[count++] = a->face[h / 3];
        h = qw_skin_around(s, h);
    } while (h != s->out[v]);
    qw_skin_place(s, v, p);
    if (!feature_near(around, count, p, s->frame.side, to)) return;
    qw_skin_normal(s, v, normal);
    if (v < a->near->count) *hint = a->near->face[v];
    if (lift_feature(s, a->target, normal, *hint, to)) qw_step_towards(room, v, to);
}

void qw_snap_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near)
{
    qw_skin *s = g->skin;
    qw_scope_begin(env);
    asking a = {.env = env, .skin = s, .target = target, .near = near, .face = QW_NEW(env, plane, s->face_count)};
    qw_parallel(env, s->face_count, QW_GRAIN, ask_faces, &a);
    qw_heartbeat(env);
    qw_in_blocks(env, g, s->vertex_count, &(qw_block_work){&a, qw_living_vertex, snap_vertex});
    qw_scope_end(env);
}

/* ---- splits */

/* How far a point is from the input; where that is below `enough`, any such figure. */
static double off_input(const qw_wrap_target *target, const double p[3], double enough, uint32_t *hint)
{
    qw_touch touch = qw_wrap_target_near(target, p, *hint, enough);
    *hint = touch.face;
    return touch.distance;
}

static void replace_in(qw_guard_edit *edit, uint32_t f) { edit->old[edit->old_count++] = f; }

static void put(qw_guard_edit *edit, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *now = edit->now[edit->now_count++];
    now[0] = a, now[1] = b, now[2] = c;
}

/* Whether an edge is long and its middle off the input. */
static bool cuts_off(const qw_skin *s, const qw_wrap_target *target, uint32_t h, uint32_t *hint)
{
    double p[3], q[3], side = s->frame.side;
    qw_skin_place(s, qw_skin_tail(s, h), p), qw_skin_place(s, qw_skin_head(s, h), q);
    if (distance_of(p, q) < LONG * side) return false;
    on_edge(s, qw_skin_tail(s, h), qw_skin_head(s, h), 0.5, p);
    return off_input(target, p, CUTS * side, hint) >= CUTS * side;
}

/* Where the edge of h should be split; false: nowhere. */
static bool split_place(const qw_skin *s, const qw_wrap_target *target, uint32_t h, uint32_t *hint, double to[3])
{
    uint32_t a = qw_skin_tail(s, h), b = qw_skin_head(s, h);
    double p[3], q[3], normal[3], other[3], side = s->frame.side;
    qw_skin_place(s, a, p), qw_skin_place(s, b, q);
    if (distance_of(p, q) < LONG * side) return false;
    double middle[3];
    on_edge(s, a, b, 0.5, middle);
    qw_touch touch = qw_wrap_target_nearest(target, middle, *hint);
    *hint = touch.face;
    if (touch.distance < CUTS * side) return false;
    plane f[2];
    on_edge(s, a, b, 0.2, p), on_edge(s, a, b, 0.8, q);
    f[0] = plane_at(target, p, hint), f[1] = plane_at(target, q, hint);
    qw_skin_normal(s, a, normal), qw_skin_normal(s, b, other);
    for (int k = 0; k < 3; k++) normal[k] += other[k];
    double length = sqrt(qw_dot_doubles(normal, normal));
    if (!(length > 0.1)) return false;
    for (int k = 0; k < 3; k++) normal[k] /= length;
    if (feature_near(f, 2, middle, side, to) && lift_feature(s, target, normal, *hint, to)) return true;
    if (touch.distance > SNAP * side) return false;
    qw_lift(s, &touch, normal, to);
    return true;
}

/* Splits edge h by a vertex at `to`, if the guard allows it. Whether it did. */
static bool try_split(qw_guard_room *room, uint32_t h, const double to[3])
{
    qw_skin *s = room->guard->skin;
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t), made[2];
    qw_guard_edit edit = {.old_count = 0};
    qw_wrap_lattice_point at = qw_rounded(s, to);
    uint32_t v = qw_skin_reserve(s, at); /* the place is looked at before there is a vertex */
    replace_in(&edit, h / 3), replace_in(&edit, t / 3);
    put(&edit, a, v, c), put(&edit, v, b, c), put(&edit, b, v, d), put(&edit, v, a, d);
    if (!qw_guard_allows(room, &edit)) return false;
    qw_guard_remove(room, h / 3), qw_guard_remove(room, t / 3);
    qw_skin_split(s, h, at, made);
    qw_guard_add(room, h / 3), qw_guard_add(room, t / 3), qw_guard_add(room, made[0]), qw_guard_add(room, made[1]);
    return true;
}

void qw_split_at_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near)
{
    qw_skin *s = g->skin;
    uint32_t hint = QW_NONE, count = 3 * s->face_count; /* not those that splits make */
    uint8_t *wanted = wanted_edges(env, s, target, near, cuts_off);
    qw_guard_room room = qw_guard_everywhere(g); /* as splits make vertices and faces, which are numbered one by one */
    for (uint32_t h = 0; h < count; h++) {
        double to[3];
        if (h % QW_GRAIN == 0) qw_heartbeat(env);
        if (!wanted[h]) continue;
        if (split_place(s, target, h, &hint, to)) try_split(&room, h, to);
    }
    qw_free(env, wanted);
}

/* ---- flips */

/* The cosine of the turn between two triangles abc, bad at their common edge, and below -1 where one has no area. */
static double turn_at(const qw_skin *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    double m[3], n[3];
    qw_exact_normal(&s->position[a], &s->position[b], &s->position[c], m);
    qw_exact_normal(&s->position[b], &s->position[a], &s->position[d], n);
    double size = sqrt(qw_dot_doubles(m, m) * qw_dot_doubles(n, n));
    return size > 0 ? qw_dot_doubles(m, n) / size : -2;
}

/* Least height over longest side of a triangle. */
static double shape_of(const qw_skin *s, uint32_t a, uint32_t b, uint32_t c)
{
    double p[3], q[3], r[3], n[3];
    qw_skin_place(s, a, p), qw_skin_place(s, b, q), qw_skin_place(s, c, r);
    qw_exact_normal(&s->position[a], &s->position[b], &s->position[c], n);
    double x = distance_of(p, q), y = distance_of(q, r), z = distance_of(r, p), most = fmax(x, fmax(y, z));
    return sqrt(qw_dot_doubles(n, n)) / (most * most);
}

/* Whether both triangles get better angles by a flip. */
static bool shapes_gain(const qw_skin *s, uint32_t a, uint32_t b, uint32_t c, uint32_t d)
{
    double before = fmin(shape_of(s, a, b, c), shape_of(s, b, a, d)),
           after = fmin(shape_of(s, c, a, d), shape_of(s, d, b, c));
    return after > 1.2 * before;
}

/* Whether the other diagonal of the two triangles at h lies nearer to the target, or gives better triangles in a
   plane. */
static bool wants_flip(const qw_skin *s, const qw_wrap_target *target, uint32_t h, uint32_t *hint)
{
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t);
    double p[3], side = s->frame.side;
    double turn = turn_at(s, a, b, c, d);
    bool gains = turn >= 0.99 && shapes_gain(s, a, b, c, d);
    if ((turn > QW_PARALLEL_COSINE && !gains) || turn_at(s, d, c, a, b) < -0.5) return false;
    on_edge(s, a, b, 0.5, p);
    double was = off_input(target, p, gains ? 0 : GAIN * side, hint), most = was - GAIN * side;
    if (gains) most = was + GAIN / 4 * side;
    if (most <= 0) return false;
    on_edge(s, c, d, 0.5, p);
    return off_input(target, p, most, hint) <= most;
}

/* Flips edge h, if topology and guard allow it. */
static void try_flip(qw_guard_room *room, uint32_t h)
{
    qw_skin *s = room->guard->skin;
    uint32_t t = s->twin[h], a = qw_skin_tail(s, h), b = qw_skin_head(s, h), c = qw_skin_apex(s, h),
             d = qw_skin_apex(s, t);
    qw_guard_edit edit = {.old_count = 0};
    if (!qw_room_holds(room, b) || !qw_room_holds(room, c) || !qw_room_holds(room, d)) return;
    assert(a != b);
    if (c == d || qw_skin_find(s, c, d) != QW_NONE || qw_skin_valence(s, a) <= 3 || qw_skin_valence(s, b) <= 3) return;
    replace_in(&edit, h / 3), replace_in(&edit, t / 3);
    put(&edit, c, a, d), put(&edit, d, b, c);
    if (!qw_guard_allows(room, &edit)) return;
    qw_guard_remove(room, h / 3), qw_guard_remove(room, t / 3);
    qw_skin_flip(s, h);
    qw_guard_add(room, h / 3), qw_guard_add(room, t / 3);
}

static uint32_t tail_of_wanted(void *user, const qw_skin *s, uint32_t h)
{
    const asking *a = user;
    return a->wanted[h] ? qw_skin_tail(s, h) : QW_NONE;
}

/* Where it is wanted still, after the flips before it. */
static void flip_edge(void *user, qw_guard_room *room, uint32_t h, uint32_t *hint)
{
    const asking *a = user;
    if (wants_flip(room->guard->skin, a->target, h, hint)) try_flip(room, h);
}

void qw_flip_to_features(qw_env *env, qw_guard *g, const qw_wrap_target *target, const qw_near_faces *near)
{
    asking a = {.env = env, .skin = g->skin, .target = target};
    a.wanted = wanted_edges(env, g->skin, target, near, wants_flip);
    qw_in_blocks(env, g, 3 * g->skin->face_count, &(qw_block_work){&a, tail_of_wanted, flip_edge});
    qw_free(env, a.wanted);
}

/* ---- collapses */

/* Whether the edges from the head of h to the neighbours of its tail would lie on the input, and the triangles keep
 * their sides. */
static bool wants_collapse(const qw_skin *s, const qw_wrap_target *target, uint32_t h, uint32_t *hint)
{
    uint32_t a = qw_skin_tail(s, h), b = qw_skin_head(s, h), i = h;
    double p[3], q[3], side = s->frame.side;
    qw_skin_place(s, a, p), qw_skin_place(s, b, q);
    if (distance_of(p, q) > SHORT * side) return false;
    do {
        uint32_t c = qw_skin_head(s, i), d = qw_skin_apex(s, i);
        double was[3], is[3];
        if (c != b && d != b) {
            qw_exact_normal(&s->position[a], &s->position[c], &s->position[d], was);
            qw_exact_normal(&s->position[b], &s->position[c], &s->position[d], is);
            double size = sqrt(qw_dot_doubles(was, was) * qw_dot_doubles(is, is));
            if (!(qw_dot_doubles(was, is) > 0.5 * size) || shape_of(s, b, c, d) < 0.05) return false;
        }
        if (c != b) {
            on_edge(s, b, c, 0.5, p);
            if (off_input(target, p, CUTS / 2 * side, hint) > CUTS / 2 * side) return false;
        }
        i = qw_skin_around(s, i);
    } while (i != h);
    return true;
}

/* Whether the room holds all vertices around the tail of h, whose own faces are looked at too. */
static bool holds_around(qw_guard_room *room, uint32_t h)
{
    const qw_skin *s = room->guard->skin;
    uint32_t i = h;
    do {
        if (!qw_room_holds(room, qw_skin_head(s, i))) return false;
        i = qw_skin_around(s, i);
    } while (i != h);
    return true;
}

/* Collapses edge h, if topology and guard allow it. */
static void try_collapse(qw_guard_room *room, uint32_t h)
{
    qw_skin *s = room->guard->skin;
    uint32_t t = s->twin[h], b = qw_skin_head(s, h), i = h;
    qw_guard_edit edit = {.old_count = 0};
    if (!holds_around(room, h) || !qw_skin_can_collapse(s, h)) return;
    do {
        uint32_t c = qw_skin_head(s, i), d = qw_skin_apex(s, i);
        if (edit.old_count == QW_GUARD_MOST) return;
        replace_in(&edit, i / 3);
        if (c != b && d != b) put(&edit, b, c, d);
        i = qw_skin_around(s, i);
    } while (i != h);
    if (!qw_guard_allows(room, &edit)) return;
    for (uint32_t k = 0; k < edit.old_count; k++) qw_guard_remove(room, edit.old[k]);
    qw_skin_collapse(s, h);
    for (uint32_t k = 0; k < edit.old_count; k++)
        if (edit.old[k] != h / 3 && edit.old[k] != t / 3) qw_guard_add(room, edit.old[k]);
}

static uint32_t tail_of_living(void *user, const qw_skin *s, uint32_t h)
{
    (void)user;
    return qw_skin_dead(s, h / 3) ? QW_NONE : qw_skin_tail(s, h);
}

static void collapse_edge(void *user, qw_guard_room *room, uint32_t h, uint32_t *hint)
{
    const asking *a = user;
    const qw_skin *s = room->guard->skin;
    if (!qw_skin_dead(s, h / 3) && wants_collapse(s, a->target, h, hint)) try_collapse(room, h);
}

void qw_collapse_short(qw_env *env, qw_guard *g, const qw_wrap_target *target)
{
    asking a = {.env = env, .skin = g->skin, .target = target};
    qw_in_blocks(env, g, 3 * g->skin->face_count, &(qw_block_work){&a, tail_of_living, collapse_edge});
}

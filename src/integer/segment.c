#include "integer/segment.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* At most: edges that one segment crosses, pieces of a segment, flips for each edge that a piece crosses. Of 12,000
   pieces none that could be made took more than 1.5; the others flip the same edges back and forth. */
enum { MOST_CROSSED = 256, MOST_PIECES = 64, FLIPS_A_CROSSING = 3 };
/* A constrained edge is not crossed nearer to one of its ends than this share of its length. */
static const double CORNER = 0.02;

typedef struct walk {
    uint32_t crossed[MOST_CROSSED], count; /* half-edges, on the near side */
    uint32_t edge;          /* the half-edge that is the segment, where nothing is crossed; else QW_NONE */
    bool is_stopped;        /* by the last one crossed, which is constrained */
    qw_double2 right, left; /* ends of the last one crossed, in the start's frame */
    qw_int2 steps_right;    /* the right one in steps */
    unsigned turn;          /* from the frame of its triangle to the start's */
} walk;

static const double SAME2 = 1e-6; /* squared, of their lengths: two vectors differ by rounding only */

static bool is_same(qw_double2 a, qw_double2 b)
{
    return qw_square2(qw_minus2(a, b)) < SAME2 * (qw_square2(a) + qw_square2(b));
}

/* Whether the segment is a side of the triangle that it starts in. */
static bool is_side(const qw_layout *l, const qw_segment *s, walk *w)
{
    const qw_complex *c = &l->complex;
    uint32_t before = qw_prev(s->start);
    if (is_same(qw_along(c, s->start), s->to) && l->corner[qw_next(s->start)] == s->end) w->edge = s->start;
    else if (is_same(qw_turned2(2, qw_along(c, before)), s->to) && l->corner[before] == s->end)
        w->edge = qw_across(c, before);
    return w->edge != QW_NONE;
}

static bool was_here(const walk *w, uint32_t h)
{
    for (uint32_t i = 0; i < w->count; i++)
        if (w->crossed[i] / 3 == h / 3) return true;
    return false;
}

/* Goes along the segment until its end or a constrained edge. Returns false where it meets neither. */
static bool go(const qw_layout *l, const qw_segment *s, walk *w)
{
    assert(s->start < 3 * l->complex.face_count && s->end < l->vertex_count);
    const qw_complex *c = &l->complex;
    w->count = 0, w->edge = QW_NONE, w->is_stopped = false;
    if (is_side(l, s, w)) return true;
    w->right = qw_along(c, s->start), w->left = qw_turned2(2, qw_along(c, qw_prev(s->start)));
    w->steps_right = qw_steps_along(c, s->start), w->turn = 0;
    if (qw_cross2(w->right, s->to) <= 0 || qw_cross2(s->to, w->left) <= 0) return false;
    for (uint32_t h = qw_next(s->start); w->count < MOST_CROSSED && !was_here(w, h);) {
        w->crossed[w->count++] = h;
        if (c->fixed[c->edge[h]]) return w->is_stopped = true;
        uint32_t t = qw_across(c, h);
        if (t == QW_NONE) return false;
        w->turn = qw_turn_across(c, w->turn, h, t);
        qw_double2 apex = qw_plus2(w->right, qw_turned2(w->turn, qw_along(c, qw_next(t))));
        if (is_same(apex, s->to)) return l->corner[qw_prev(t)] == s->end;
        if (qw_cross2(s->to, apex) > 0) {
            w->left = apex, h = qw_next(t);
        } else {
            w->steps_right = qw_int2_add(w->steps_right, qw_turn(w->turn, qw_steps_along(c, qw_next(t))));
            w->right = apex, h = qw_prev(t);
        }
    }
    return false;
}

/* Of the triangles of h and t, which share a frame, the corner of v that `to` leaves by; QW_NONE where there is none.
 */
static uint32_t corner_towards(const qw_layout *l, uint32_t v, uint32_t h, uint32_t t, qw_double2 to)
{
    for (uint32_t i = 0; i < 6; i++) {
        uint32_t k = 3 * ((i < 3 ? h : t) / 3) + i % 3;
        if (l->corner[k] != v) continue;
        qw_double2 right = qw_along(&l->complex, k), left = qw_turned2(2, qw_along(&l->complex, qw_prev(k)));
        if ((qw_cross2(right, to) >= 0 || is_same(right, to)) && (qw_cross2(to, left) > 0 || is_same(left, to)))
            return k;
    }
    return QW_NONE;
}

/* Flips the first edge crossed that can be. */
static bool flip_one(qw_env *env, qw_layout *l, qw_segment *s, const walk *w)
{
    uint32_t v = l->corner[s->start];
    for (uint32_t i = 0; i < w->count; i++) {
        uint32_t t = qw_across(&l->complex, w->crossed[i]);
        if (!qw_layout_flip(env, l, w->crossed[i])) continue;
        if (i == 0) s->start = corner_towards(l, v, w->crossed[0], t, s->to);
        return s->start != QW_NONE;
    }
    return false;
}

/* Makes a constrained edge of a piece that crosses none. */
static bool make_edge(qw_env *env, qw_layout *l, qw_segment s)
{
    walk w;
    for (uint32_t flips = 0, most = 0;; flips++) {
        if (!go(l, &s, &w) || w.is_stopped) return false;
        if (flips == 0) most = FLIPS_A_CROSSING * w.count;
        if (w.edge != QW_NONE) {
            qw_complex *c = &l->complex;
            uint32_t e = c->edge[w.edge];
            bool along_y = (qw_quarter_of(qw_along(c, w.edge)) + c->rot[w.edge]) & 1u; /* in the edge's own frame */
            c->fixed[e] |= along_y ? QW_FIXED_X : QW_FIXED_Y;
            return true;
        }
        if (flips == most || !flip_one(env, l, &s, &w)) return false;
    }
}

/* Steps from the right end of the edge that stopped the walk to where the lattice line crosses it, in the frame turned
   by `quarter`. aside: steps from the line to the segment's start. Returns false where the edge is along the line. */
static bool find_crossing(const qw_layout *l, const walk *w, unsigned quarter, int32_t *aside, int32_t *up)
{
    assert(w->count > 0);
    qw_int2 p = qw_turn((4u - quarter) & 3u, w->steps_right);
    qw_int2 d = qw_turn((4u - quarter + w->turn) & 3u, qw_steps_along(&l->complex, w->crossed[w->count - 1]));
    if (d.x != 0) return false;
    int32_t u = -(p.y + *aside);
    if ((d.y >= 0 && u < 0) || (d.y <= 0 && u > 0)) u = 0;
    *up = abs(u) > abs(d.y) ? d.y : u;
    *aside += p.y + *up;
    return true;
}

bool qw_make_segment(qw_env *env, qw_layout *l, qw_segment s)
{
    assert(s.start < 3 * l->complex.face_count && s.end < l->vertex_count && s.quarter < 4);
    const qw_complex *c = &l->complex;
    int32_t aside = 0, up;
    walk w;
    for (int piece = 0; piece < MOST_PIECES; piece++) {
        if (!go(l, &s, &w)) return false;
        if (!w.is_stopped) return make_edge(env, l, s);
        uint32_t h = w.crossed[w.count - 1], t = qw_across(c, h);
        qw_double2 side = qw_minus2(w.left, w.right);
        double share = qw_cross2(w.right, s.to) / qw_cross2(s.to, side);
        if (t == QW_NONE || !(share > CORNER && share < 1 - CORNER)) return false;
        if (!find_crossing(l, &w, s.quarter, &aside, &up)) return false;
        unsigned beyond = qw_turn_across(c, w.turn, h, t);
        qw_double2 here = qw_plus2(w.right, (qw_double2){side.x * share, side.y * share});
        if (!qw_layout_split(env, l, h, share, qw_turn((8u + s.quarter - w.turn) & 3u, (qw_int2){0, up}))) return false;
        uint32_t v = l->vertex_count - 1;
        if (!make_edge(env, l, (qw_segment){s.start, v, here, s.quarter})) return false;
        s.to = qw_turned2(4u - beyond, qw_minus2(s.to, here)), s.quarter = (s.quarter + 4u - beyond) & 3u;
        s.start = corner_towards(l, v, t, 3 * (c->face_count - 1), s.to);
        if (s.start == QW_NONE) return false;
    }
    return false;
}

#include "remesh/meetings/segment.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

/* At most: edges that one segment crosses, pieces of a segment, flips for each edge that a piece crosses. Of 12,000
   pieces none that could be made took more than 1.5; the others flip the same edges back and forth. */
enum { MOST_CROSSED = 256, MOST_PIECES = 64, FLIPS_A_CROSSING = 3, MOST_TURNS = 64 };
/* A constrained edge is not crossed nearer to one of its ends than this share of its length, or so many quads. */
static const double CORNER = 0.02, CORNER_QUADS = 0.05;

typedef struct walk {
    uint32_t crossed[MOST_CROSSED], count; /* half-edges, on the near side */
    uint32_t edge;          /* the half-edge that is the segment, where nothing is crossed; else QW_NONE */
    bool is_stopped;        /* by the last one crossed, which is constrained */
    qw_double2 right, left; /* ends of the last one crossed, in the start's frame */
    qw_int2 steps_right;    /* the right one in steps */
    unsigned turn;          /* from the frame of its triangle to the start's */
} walk;

/* Squared: real offsets close but for this share of the lengths that they are summed over. */
static const double SAME2 = 1e-6;

/* Whether two ways to a vertex, the longest edge on which has this squared length, differ by that only. Beside a long
   edge a short one may be missed by more than a share of its own length. */
static bool is_same(qw_double2 a, qw_double2 b, double longest)
{
    return qw_square2(qw_minus2(a, b)) < SAME2 * fmax(longest, qw_square2(a) + qw_square2(b));
}

/* The squared length of the longest side of the triangle of h. */
static double longest_side(const qw_layout *l, uint32_t h)
{
    const qw_complex *c = &l->complex;
    return fmax(qw_square2(qw_along(c, h)),
                fmax(qw_square2(qw_along(c, qw_next(h))), qw_square2(qw_along(c, qw_prev(h)))));
}

/* Whether the segment is a side of the triangle that it starts in. */
static bool is_side(const qw_layout *l, const qw_segment *s, walk *w)
{
    const qw_complex *c = &l->complex;
    uint32_t before = qw_prev(s->start);
    double longest = longest_side(l, s->start);
    if (is_same(qw_along(c, s->start), s->to, longest) && l->corner[qw_next(s->start)] == s->end) w->edge = s->start;
    else if (is_same(qw_turned2(2, qw_along(c, before)), s->to, longest) && l->corner[before] == s->end)
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
        if (is_same(apex, s->to, fmax(qw_square2(w->right), qw_square2(w->left))))
            return l->corner[qw_prev(t)] == s->end;
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
        double longest = longest_side(l, k);
        if ((qw_cross2(right, to) >= 0 || is_same(right, to, longest)) &&
            (qw_cross2(to, left) > 0 || is_same(left, to, longest)))
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

/* Whether only one constrained line passes v, straight on, over regular ground; h leaves it. */
static bool is_plain_on_curve(const qw_layout *l, uint32_t h)
{
    const qw_complex *c = &l->complex;
    uint32_t first = h, quarters = 0, constrained = 0;
    do {
        uint32_t in = qw_prev(h);
        quarters += (qw_quarter_of(qw_turned2(2, qw_along(c, in))) - qw_quarter_of(qw_along(c, h))) & 3u;
        constrained += c->fixed[c->edge[h]] != 0;
        h = qw_across(c, in);
    } while (h != QW_NONE && h != first && quarters <= 4);
    return h == first && quarters == 4 && constrained == 2;
}

/* Turns about the vertex that half-edge k leaves until the segment leaves into k's triangle; not across a constrained
   edge. s: in the frame of k's triangle, before and after. */
static bool turn_about(const qw_layout *l, uint32_t k, qw_segment *s)
{
    const qw_complex *c = &l->complex;
    for (int i = 0; i < MOST_TURNS; i++) {
        qw_double2 right = qw_along(c, k), left = qw_turned2(2, qw_along(c, qw_prev(k)));
        bool is_right = qw_cross2(right, s->to) < 0, is_left = qw_cross2(s->to, left) < 0;
        s->start = k;
        if (!is_right && !is_left) return true;
        uint32_t h = is_right ? k : qw_prev(k), t = qw_across(c, h);
        if (t == QW_NONE || c->fixed[c->edge[h]]) return false;
        unsigned beyond = qw_turn_across(c, 0, h, t);
        s->to = qw_turned2(4u - beyond, s->to), s->quarter = (s->quarter + 4u - beyond) & 3u;
        k = is_right ? qw_next(t) : t;
    }
    return false;
}

/* The walk was stopped where the constrained edge ends: the line goes through the curve's vertex there, if that is
   nothing but a vertex on it. s becomes what is left of the segment. */
static bool pass_vertex(qw_env *env, qw_layout *l, const walk *w, bool is_right, qw_segment *s, int32_t *aside)
{
    const qw_complex *c = &l->complex;
    uint32_t h = w->crossed[w->count - 1], t = qw_across(c, h), leaving = is_right ? h : qw_next(h);
    if (t == QW_NONE || !is_plain_on_curve(l, leaving)) return false;
    qw_double2 here = is_right ? w->right : w->left;
    qw_int2 p = w->steps_right;
    if (!is_right) p = qw_int2_add(p, qw_turn(w->turn, qw_steps_along(c, h)));
    *aside += qw_turn((4u - s->quarter) & 3u, p).y;
    unsigned beyond = qw_turn_across(c, w->turn, h, t);
    if (!make_edge(env, l, (qw_segment){s->start, l->corner[leaving], here, s->quarter})) return false;
    s->to = qw_turned2(4u - beyond, qw_minus2(s->to, here)), s->quarter = (s->quarter + 4u - beyond) & 3u;
    return turn_about(l, is_right ? qw_next(t) : t, s);
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
        double corner = fmin(CORNER, CORNER_QUADS / sqrt(qw_square2(side)));
        if (t == QW_NONE) return false;
        if (!(share > corner && share < 1 - corner)) {
            if (!pass_vertex(env, l, &w, share <= corner, &s, &aside)) return false;
            continue;
        }
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

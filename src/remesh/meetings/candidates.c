#include "remesh/meetings/candidates.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

const double QW_FARTHEST_CONE = 60;
/* Cones are looked for beside a line up to this tangent and so many quads (of 322 meetings that were kept on twelve
   meshes three were farther aside), and no nearer than this, in quads. */
static const double ASIDE = 0.5, FARTHEST_ASIDE = 3, NEAREST = 0.5;
/* Minimum gain, in quads: what may save less is no candidate. */
static const double LEAST_GAIN = 2;
/* Edges yet to be looked through; triangles that one line is looked for through. */
enum { STACK = 128, MOST_STEPS = 1000 };

/* Looks into a triangle's corner, whose half-edge is `start`, along the line by `quarter` of its frame. */
typedef struct look {
    const qw_outlook *outlook;
    qw_candidates *to;
    uint32_t start;
    unsigned quarter;
} look;

/* Adds a candidate if the cone that was seen from `start` lies nearly straight ahead, and a line of it that is not
 * held yet looks back. */
static void add_candidate(qw_env *env, const look *s, uint32_t end, unsigned turn, qw_double2 at)
{
    const qw_layout *l = s->outlook->layout;
    const int32_t *length = s->outlook->length;
    uint32_t v = l->corner[s->start], w = l->corner[end];
    unsigned by = (s->quarter - qw_quarter_of(qw_along(&l->complex, s->start))) & 3u;
    unsigned by_end = ((6u - turn) - qw_quarter_of(qw_along(&l->complex, end))) & 3u;
    if (at.x < NEAREST || at.x > s->outlook->reach || fabs(at.y) > FARTHEST_ASIDE || !l->valence[w] || by == 3 ||
        by_end == 3)
        return;
    qw_candidate k = {
        .segment = {s->start, w, qw_turned2(s->quarter, at), s->quarter}, .from = v, .ahead = at.x, .aside = at.y};
    k.line = (l->number[s->start] + by) % l->valence[v], k.end_line = (l->number[end] + by_end) % l->valence[w];
    if (l->held[v] >> k.line & 1u || l->held[w] >> k.end_line & 1u) return;
    k.gain = (length[QW_MOST_LINES * (size_t)v + k.line] + length[QW_MOST_LINES * (size_t)w + k.end_line]) / 2.0 -
             k.ahead;
    if (k.gain < LEAST_GAIN) return;
    k.turned = 1 + k.aside * k.aside;
    k.key = s->outlook->nearest_first ? -k.ahead * k.turned : k.gain / k.turned;
    qw_candidates *to = s->to;
    to->found = qw_grow(env, to->found, &to->room, to->count + 1, sizeof *to->found);
    to->found[to->count++] = k;
}

/* What is seen from a cone through an edge, in the frame in which its line runs along x. */
typedef struct window {
    uint32_t half;          /* the edge, on the near side */
    unsigned turn;          /* from the frame of its triangle */
    qw_double2 from, to;    /* directions, clockwise end first */
    qw_double2 right, left; /* ends of the edge */
} window;

/* Leaves of the window what passes the edge within the strip along the line; false where that is nothing. */
static bool narrow(window *w)
{
    double x = fmin(w->right.x, w->left.x);
    if (fmin(w->right.y, w->left.y) > FARTHEST_ASIDE || fmax(w->right.y, w->left.y) < -FARTHEST_ASIDE) return false;
    if (x <= 0) return true;
    qw_double2 low = {x, -FARTHEST_ASIDE}, high = {x, FARTHEST_ASIDE};
    if (qw_cross2(w->from, low) > 0) w->from = low;
    if (qw_cross2(high, w->to) > 0) w->to = high;
    return qw_cross2(w->from, w->to) > 0;
}

/* Looks through triangle after triangle for cones. */
static void look_through(qw_env *env, const look *s, double reach, window first)
{
    const qw_complex *c = &s->outlook->layout->complex;
    window stack[STACK];
    uint32_t depth = 0;
    stack[depth++] = first;
    for (int steps = 0; depth > 0 && depth + 2 <= STACK && steps < MOST_STEPS; steps++) {
        window w = stack[--depth];
        uint32_t t = qw_across(c, w.half);
        if (t == QW_NONE || fmin(w.right.x, w.left.x) > reach || !narrow(&w)) continue;
        unsigned turn = qw_turn_across(c, w.turn, w.half, t);
        qw_double2 apex = qw_plus2(w.right, qw_turned2(turn, qw_along(c, qw_next(t))));
        bool is_left = qw_cross2(w.from, apex) > 0, is_right = qw_cross2(apex, w.to) > 0;
        if (is_left && is_right) add_candidate(env, s, qw_prev(t), turn, apex);
        if (is_left) stack[depth++] = (window){qw_next(t), turn, w.from, is_right ? apex : w.to, w.right, apex};
        if (is_right) stack[depth++] = (window){qw_prev(t), turn, is_left ? apex : w.from, w.to, apex, w.left};
    }
}

static bool is_ahead(qw_double2 a) { return a.x > 0 && fabs(a.y) <= ASIDE * a.x; }

/* Looks along the lines that are near the triangle of h, from its corner, each as far as it runs: what saves anything
   is seen from one of both ends so. */
static void look_from(qw_env *env, const qw_outlook *outlook, uint32_t h, qw_candidates *to)
{
    const qw_layout *l = outlook->layout;
    const qw_complex *c = &l->complex;
    uint32_t v = l->corner[h];
    for (unsigned quarter = 0; quarter < 4; quarter++) {
        uint32_t line = (l->number[h] + ((quarter - qw_quarter_of(qw_along(c, h))) & 3u)) % l->valence[v];
        if (l->held[v] >> line & 1u) continue;
        double reach = fmin(outlook->reach, outlook->length[QW_MOST_LINES * (size_t)v + line]);
        unsigned turn = (4u - quarter) & 3u;
        qw_double2 right = qw_turned2(turn, qw_along(c, h)), left = qw_turned2(turn + 2u, qw_along(c, qw_prev(h)));
        if (qw_cross2(right, left) <= 0) continue;
        qw_double2 low = {1, -ASIDE}, high = {1, ASIDE};
        look s = {outlook, to, h, quarter};
        if (is_ahead(right)) add_candidate(env, &s, qw_next(h), turn, right);
        bool sees_from = qw_cross2(right, low) >= 0 && qw_cross2(low, left) >= 0;
        bool sees_to = qw_cross2(right, high) >= 0 && qw_cross2(high, left) >= 0;
        if ((!sees_from && !is_ahead(right)) || (!sees_to && !is_ahead(left))) continue;
        look_through(env, &s, reach,
                     (window){qw_next(h), turn, sees_from ? low : right, sees_to ? high : left, right, left});
    }
}

void qw_add_candidates(qw_env *env, const qw_outlook *outlook, uint32_t begin, uint32_t end, qw_candidates *to)
{
    const qw_layout *l = outlook->layout;
    assert(begin <= end && end <= 3 * l->complex.face_count && outlook->length);
    for (uint32_t h = begin; h < end; h++)
        if (l->valence[l->corner[h]]) look_from(env, outlook, h, to);
}

static int compare(const void *a, const void *b)
{
    const qw_candidate *x = a, *y = b;
    if (x->key != y->key) return x->key > y->key ? -1 : 1;
    if (x->segment.start != y->segment.start) return x->segment.start < y->segment.start ? -1 : 1;
    if (x->segment.end != y->segment.end) return x->segment.end < y->segment.end ? -1 : 1;
    if (x->ahead != y->ahead) return x->ahead < y->ahead ? -1 : 1;
    if (x->aside != y->aside) return x->aside < y->aside ? -1 : 1;
    return x->segment.quarter < y->segment.quarter ? -1 : x->segment.quarter > y->segment.quarter;
}

void qw_sort_candidates(qw_candidates *c)
{
    if (c->count > 0) qsort(c->found, c->count, sizeof *c->found, compare);
}

static const double SAME_PLACE = 1e-3; /* quads; flips leave places as they are, but for rounding */

bool qw_is_same_candidate(const qw_candidate *a, const qw_candidate *b)
{
    bool from_one = a->from == b->from && a->segment.end == b->segment.end,
         from_both = a->from == b->segment.end && a->segment.end == b->from;
    return (from_one || from_both) && fabs(a->ahead - b->ahead) < SAME_PLACE && fabs(a->aside - b->aside) < SAME_PLACE;
}

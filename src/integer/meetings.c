#include "integer/meetings.h"

#include "base/constants.h"
#include "integer/circuits.h"
#include "integer/moves.h"
#include "integer/nearest.h"
#include "integer/segment.h"
#include "integer/touching.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Cones are looked for so many quads along a line, and beside it up to this tangent. */
static const double REACH = 60, ASIDE = 0.5, NEAREST = 0.5;
/* Quads that lines must become shorter by for a unit of energy, at --loops 1 and for each unit of (1 - loops) / loops.
 */
static const double WORTH_LEAST = 0.1, WORTH = 0.5;
/* A walk that closes the offsets costs at most so many times what the meeting itself can save. */
static const double INDIRECT = 3;
/* Candidates that may save this many quads or fewer are not tried. */
static const double LEAST_GAIN = 2;
/* The longest that a line can count, in square roots of the area. */
static const double LONGEST = 20;
/* A search that trusts may miss the count by this share. */
static const double TRUSTED_AREA = 0.05;
/* IN_VAIN: attempts without success, one after the other, before the search ends. WORK: triangles of all layouts
   looked at; the search of candidates costs about as much as SEARCH attempts. ROOM: triangles for each of the complex.
   NEAREST_WORK: triangles of the offsets looked at that keep what is held. */
enum { IN_VAIN = 600, WORK = 600000, SEARCH = 20, ROOM = 4, STACK = 128, MOST_STEPS = 4000, NEAREST_WORK = 24000 };

/* Two lines that may meet. */
typedef struct candidate {
    qw_segment segment;
    uint32_t from, line, end_line; /* vertex; numbers of the lines at both ends */
    double ahead, aside;           /* where the other cone lies, in quads */
    double gain, key;
} candidate;

typedef struct search {
    qw_layout layout, before; /* before: as it was before the attempt at hand */
    qw_complex source;    /* the component's, with scaled lengths and room for the offsets of all edges of a layout */
    const qw_int2 *first; /* its offsets before */
    double worth, least_area, most_area, least_promised, most_promised;
    double left;      /* work */
    bool trusts;      /* candidates are kept for what they may save, the nearest first */
    bool is_numbered; /* the layout's lines have been numbered since it was changed, but for its integers */
    qw_int2 *best;    /* offsets of the best so far */
    double best_score, best_lines;
    int32_t longest, *length;         /* [QW_MOST_LINES V] */
    double lines, energy, first_area; /* lines: length of all */
    const qw_component *component;
    uint32_t inverted, touching; /* triangles of the source; how often its curves touch */
    candidate *found;
    size_t count, room;
    candidate *failed;
    size_t failed_count, failed_room;
} search;

/* ---- what a layout is worth */

/* Energy of the map from the real to the integer complex that is linear on each triangle: the integral of the square of
   how far its derivative is from the identity, in quads. */
static double energy_of(const qw_complex *c)
{
    double sum = 0;
    for (uint32_t h = 0; h < 3 * c->face_count; h += 3) {
        qw_double2 u = qw_along(c, h), v = qw_turned2(2, qw_along(c, h + 2));
        qw_int2 iu = qw_steps_along(c, h), iv = qw_turn(2, qw_steps_along(c, h + 2));
        double det = qw_cross2(u, v);
        if (det <= 0) continue;
        qw_double2 a = {iu.x - u.x, iu.y - u.y}, b = {iv.x - v.x, iv.y - v.y};
        /* [a b] times the inverse of [u v], times det */
        qw_double2 p = {a.x * v.y - b.x * u.y, b.x * u.x - a.x * v.x},
                   q = {a.y * v.y - b.y * u.y, b.y * u.x - a.y * v.x};
        sum += (qw_square2(p) + qw_square2(q)) / fmax(det, 1e-6) / 2;
    }
    return sum;
}

/* Length of all lines if the quads were as many as the first offsets have: fewer and larger ones are no gain. */
static double measure_lines(search *s, double area)
{
    if (!s->is_numbered) qw_layout_number(&s->layout);
    s->is_numbered = true;
    int64_t sum = qw_layout_measure(&s->layout, s->longest, s->length);
    return (double)sum / 2 * sqrt(s->first_area / fmax(area, 1));
}

/* ---- candidates */

static void add_candidate(qw_env *env, search *s, uint32_t start, unsigned quarter, uint32_t end, unsigned turn,
                          qw_double2 at)
{
    const qw_layout *l = &s->layout;
    uint32_t v = l->corner[start], w = l->corner[end];
    unsigned by = (quarter - qw_quarter_of(qw_along(&l->complex, start))) & 3u;
    unsigned by_end = ((6u - turn) - qw_quarter_of(qw_along(&l->complex, end))) & 3u;
    if (at.x < NEAREST || at.x > REACH || v == w || !l->valence[w] || by == 3 || by_end == 3) return;
    candidate k = {.segment = {start, w, qw_turned2(quarter, at), quarter}, .from = v, .ahead = at.x, .aside = at.y};
    k.line = (l->number[start] + by) % l->valence[v], k.end_line = (l->number[end] + by_end) % l->valence[w];
    if (l->held[v] >> k.line & 1u || l->held[w] >> k.end_line & 1u) return;
    k.gain = (s->length[QW_MOST_LINES * (size_t)v + k.line] + s->length[QW_MOST_LINES * (size_t)w + k.end_line]) / 2.0 -
             k.ahead;
    if (k.gain < LEAST_GAIN) return;
    double turned = 1 + k.aside * k.aside;
    k.key = s->trusts ? -k.ahead * turned : k.gain / turned;
    s->found = qw_grow(env, s->found, &s->room, s->count + 1, sizeof *s->found);
    s->found[s->count++] = k;
}

/* What is seen from a cone through an edge, in the frame in which its line runs along x. */
typedef struct window {
    uint32_t half;          /* the edge, on the near side */
    unsigned turn;          /* from the frame of its triangle */
    qw_double2 from, to;    /* directions, clockwise end first */
    qw_double2 right, left; /* ends of the edge */
} window;

/* Looks through triangle after triangle for cones. */
static void look_through(qw_env *env, search *s, uint32_t start, unsigned quarter, double reach, window first)
{
    const qw_complex *c = &s->layout.complex;
    window stack[STACK];
    uint32_t depth = 0;
    stack[depth++] = first;
    for (int steps = 0; depth > 0 && depth + 2 <= STACK && steps < MOST_STEPS; steps++) {
        window w = stack[--depth];
        uint32_t t = qw_across(c, w.half);
        if (t == QW_NONE || fmin(w.right.x, w.left.x) > reach) continue;
        unsigned turn = qw_turn_across(c, w.turn, w.half, t);
        qw_double2 apex = qw_plus2(w.right, qw_turned2(turn, qw_along(c, qw_next(t))));
        bool is_left = qw_cross2(w.from, apex) > 0, is_right = qw_cross2(apex, w.to) > 0;
        if (is_left && is_right) add_candidate(env, s, start, quarter, qw_prev(t), turn, apex);
        if (is_left) stack[depth++] = (window){qw_next(t), turn, w.from, is_right ? apex : w.to, w.right, apex};
        if (is_right) stack[depth++] = (window){qw_prev(t), turn, is_left ? apex : w.from, w.to, apex, w.left};
    }
}

static bool is_ahead(qw_double2 a) { return a.x > 0 && fabs(a.y) <= ASIDE * a.x; }

/* Looks along the lines that are near the triangle of h, from its corner, each as far as it runs: what saves anything
   is seen from one of both ends so. */
static void look_from(qw_env *env, search *s, uint32_t h)
{
    assert(h < 3 * s->layout.complex.face_count);
    const qw_layout *l = &s->layout;
    const qw_complex *c = &l->complex;
    uint32_t v = l->corner[h];
    for (unsigned quarter = 0; quarter < 4; quarter++) {
        uint32_t line = (l->number[h] + ((quarter - qw_quarter_of(qw_along(c, h))) & 3u)) % l->valence[v];
        if (l->held[v] >> line & 1u) continue;
        double reach = fmin(REACH, s->length[QW_MOST_LINES * (size_t)v + line]);
        unsigned turn = (4u - quarter) & 3u;
        qw_double2 right = qw_turned2(turn, qw_along(c, h)), left = qw_turned2(turn + 2u, qw_along(c, qw_prev(h)));
        if (qw_cross2(right, left) <= 0) continue;
        qw_double2 from = {1, -ASIDE}, to = {1, ASIDE};
        if (is_ahead(right)) add_candidate(env, s, h, quarter, qw_next(h), turn, right);
        bool sees_from = qw_cross2(right, from) >= 0 && qw_cross2(from, left) >= 0;
        bool sees_to = qw_cross2(right, to) >= 0 && qw_cross2(to, left) >= 0;
        if ((!sees_from && !is_ahead(right)) || (!sees_to && !is_ahead(left))) continue;
        look_through(env, s, h, quarter, reach,
                     (window){qw_next(h), turn, sees_from ? from : right, sees_to ? to : left, right, left});
    }
}

static int compare(const void *a, const void *b)
{
    const candidate *x = a, *y = b;
    if (x->key != y->key) return x->key > y->key ? -1 : 1;
    if (x->segment.start != y->segment.start) return x->segment.start < y->segment.start ? -1 : 1;
    if (x->segment.end != y->segment.end) return x->segment.end < y->segment.end ? -1 : 1;
    if (x->ahead != y->ahead) return x->ahead < y->ahead ? -1 : 1;
    if (x->aside != y->aside) return x->aside < y->aside ? -1 : 1;
    return x->segment.quarter < y->segment.quarter ? -1 : x->segment.quarter > y->segment.quarter;
}

/* All candidates, the most promising first. */
static void find_candidates(qw_env *env, search *s)
{
    const qw_layout *l = &s->layout;
    s->count = 0;
    for (uint32_t h = 0; h < 3 * l->complex.face_count; h++)
        if (l->valence[l->corner[h]]) look_from(env, s, h);
    if (s->count > 0) qsort(s->found, s->count, sizeof *s->found, compare);
}

static const double SAME_PLACE = 1e-3; /* edge lengths: two candidates lead along the same segment */

/* The same two cones, the one seen from the other in the same place: flips leave that as it is, but for rounding. */
static bool has_failed(const search *s, const candidate *k)
{
    for (size_t i = 0; i < s->failed_count; i++) {
        const candidate *f = &s->failed[i];
        if (f->from == k->from && f->segment.end == k->segment.end && fabs(f->ahead - k->ahead) < SAME_PLACE &&
            fabs(f->aside - k->aside) < SAME_PLACE)
            return true;
    }
    return false;
}

/* ---- the search */

/* Closes the offsets again where constrained edges have got a part that they may not have. Returns false where that
   cannot be, or costs more than `most`. */
static bool close_layout(qw_env *env, qw_complex *c, double most)
{
    qw_complex_weigh(c);
    for (uint32_t e = 0; e < c->edge_count; e++) {
        if (c->fixed[e] & QW_FIXED_X) c->d[e].x = 0;
        if (c->fixed[e] & QW_FIXED_Y) c->d[e].y = 0;
    }
    return qw_close_offsets(env, c, QW_LONGEST_WALK, most);
}

/* Whether cones, corners or curves that were in one place are so no more, or others are: a corner would lose its cone,
   two cones would be one, two curves touch. */
static bool joins_or_parts(const qw_complex *c, const qw_int2 *had)
{
    for (uint32_t e = 0; e < c->edge_count; e++)
        if (qw_int2_is_zero(c->d[e]) != qw_int2_is_zero(had[e])) return true;
    return false;
}

static double beyond(double least, double most, double area) { return fmax(fmax(least - area, area - most), 0); }

/* Lines and energy of the layout as it is; false where it has faults. */
static bool look_at(search *s, double *lines, double *energy)
{
    const qw_complex *c = &s->layout.complex;
    if (qw_complex_inverted(c) > s->inverted) return false;
    qw_layout_undo(&s->layout, s->source.d);
    if (qw_complex_inverted(&s->source) > s->inverted || joins_or_parts(&s->source, s->first)) return false;
    *energy = energy_of(&s->source);
    if (s->trusts && s->worth * *energy >= s->best_score) return false;
    *lines = measure_lines(s, qw_complex_area(c));
    return true;
}

/* What lines and energy cost together; a quad that the count is off by counts as one of a line. */
static double score_of(const search *s, double area, double lines, double energy)
{
    return lines + s->worth * energy + beyond(s->least_area, s->most_area, area);
}

/* Keeps the layout's offsets, which have these lines and this energy, if they are the best so far. */
static void consider(qw_env *env, search *s, double lines, double energy)
{
    double area = qw_complex_area(&s->layout.complex), score = score_of(s, area, lines, energy);
    if (score >= s->best_score || beyond(s->least_promised, s->most_promised, area) > 0) return;
    if (qw_count_touching(env, s->component, s->source.d) > s->touching) return;
    qw_layout_undo(&s->layout, s->best);
    s->best_score = score, s->best_lines = lines;
}

/* Makes the two lines of k meet. Returns whether what is saved is worth the energy that it costs: the length that all
   lines together have lost or, where the search trusts, what these two may save. */
static bool attempt(qw_env *env, search *s, const candidate *k)
{
    assert(k->segment.start < 3 * s->layout.complex.face_count);
    qw_layout *l = &s->layout;
    double lines, energy;
    s->is_numbered = false;
    if (!qw_make_segment(env, l, k->segment) || !close_layout(env, &l->complex, INDIRECT * k->gain / s->worth))
        return false;
    double area = qw_complex_area(&l->complex), had = qw_complex_area(&s->before.complex),
           room = s->trusts ? TRUSTED_AREA * s->first_area : beyond(s->least_area, s->most_area, had);
    if (beyond(s->least_area, s->most_area, area) > room || !look_at(s, &lines, &energy)) return false;
    double gain = s->trusts ? k->gain : s->lines - lines;
    if (gain <= s->worth * (energy - s->energy)) return false;
    if (qw_count_touching(env, s->component, s->source.d) > s->touching) return false;
    s->lines = lines, s->energy = energy;
    return true;
}

/* Tries candidates until one is kept; returns false where none is. */
static bool keep_one(qw_env *env, search *s, uint32_t *tried, uint32_t most)
{
    find_candidates(env, s);
    for (size_t i = 0; i < s->count && *tried < most; i++) {
        const candidate *k = &s->found[i];
        if (has_failed(s, k)) continue;
        qw_break_silence(env);
        ++*tried;
        if (attempt(env, s, k)) {
            qw_layout_copy(&s->layout, &s->before);
            return true;
        }
        qw_layout_copy(&s->before, &s->layout), s->is_numbered = false;
        s->failed = qw_grow(env, s->failed, &s->failed_room, s->failed_count + 1, sizeof *s->failed);
        s->failed[s->failed_count++] = *k;
    }
    return false;
}

/* Begins anew, with offsets d. */
static void start_from(search *s, const qw_meeting_wish *wish, const qw_int2 *d)
{
    qw_layout_fill(&s->layout, s->component, wish->real, d), qw_layout_fill(&s->before, s->component, wish->real, d);
    memcpy(s->source.d, d, s->source.edge_count * sizeof *d);
    s->is_numbered = false;
    s->energy = energy_of(&s->source);
    s->lines = measure_lines(s, qw_complex_area(&s->source));
}

/* Considers the layout with other integers. */
static void look_at_nearest(qw_env *env, void *user)
{
    search *s = user;
    double lines, energy;
    if (beyond(s->least_promised, s->most_promised, qw_complex_area(&s->layout.complex)) > 0) return;
    if (look_at(s, &lines, &energy)) consider(env, s, lines, energy);
}

/* Considers all offsets that keep what is held and cost less than the best so far. */
static void look_around(qw_env *env, search *s)
{
    uint32_t faces = s->layout.complex.face_count;
    qw_nearest_wish wish = {NEAREST_WORK / faces, s->best_score / s->worth, look_at_nearest, s};
    s->left -= (double)qw_visit_nearest(env, &s->layout.complex, &wish) * faces;
}

/* Makes lines meet until none more can be made to. */
static void make_all(qw_env *env, search *s, qw_meeting_counts *counts, double share)
{
    s->left = WORK * share;
    for (uint32_t kept_before = QW_NONE; kept_before != counts->kept;) {
        kept_before = counts->kept, s->failed_count = 0; /* what failed may succeed since others have met */
        for (bool kept = true; kept;) {
            double faces = fmax(s->layout.complex.face_count, 1);
            if ((s->left -= SEARCH * faces) < faces) break;
            uint32_t tried = 0;
            kept = keep_one(env, s, &tried, (uint32_t)fmin(IN_VAIN, s->left / faces));
            if (kept) consider(env, s, s->lines, s->energy);
            if (kept && s->trusts) look_around(env, s);
            counts->tried += tried, counts->kept += kept;
            s->left = !kept && tried == IN_VAIN ? 0 : s->left - tried * faces;
            (void)measure_lines(s, s->first_area); /* the last attempt has left another's */
        }
    }
}

static search begin_search(qw_env *env, const qw_component *component, const qw_meeting_wish *wish, const qw_int2 *d)
{
    assert(component->vertex_count > 0 && wish->real && d);
    const qw_complex *c = &component->decimated.complex;
    uint32_t room = ROOM * c->face_count + component->vertex_count;
    search s = {.layout = qw_layout_make(env, room), .before = qw_layout_make(env, room), .source = *c};
    s.source.real = QW_NEW(env, qw_real2, c->edge_count), s.source.d = QW_NEW(env, qw_int2, s.layout.edge_room);
    s.first = d, s.component = component, s.touching = qw_count_touching(env, component, d);
    memcpy(s.source.real, wish->real, c->edge_count * sizeof *s.source.real);
    memcpy(s.source.d, d, c->edge_count * sizeof *d);
    s.length = QW_NEW(env, int32_t, QW_MOST_LINES * (size_t)room);
    s.worth = WORTH_LEAST + WORTH * (1 - wish->loops) / wish->loops;
    s.least_area = wish->least_area, s.most_area = wish->most_area;
    s.least_promised = wish->least_promised, s.most_promised = wish->most_promised;
    s.longest = (int32_t)(LONGEST * sqrt(wish->most_area));
    s.inverted = qw_complex_inverted(&s.source), s.first_area = qw_complex_area(&s.source);
    start_from(&s, wish, d);
    s.best = memcpy(QW_NEW(env, qw_int2, s.layout.edge_room), d, c->edge_count * sizeof *d);
    s.best_score = score_of(&s, s.first_area, s.lines, s.energy), s.best_lines = s.lines;
    return s;
}

/* The search that trusts, and the careful one from where that came; then all is as it was before. */
static void trust(qw_env *env, search *s, const qw_meeting_wish *wish, qw_meeting_counts *counts)
{
    size_t edges = s->source.edge_count;
    double had = s->best_score;
    s->trusts = true;
    make_all(env, s, counts, wish->share);
    s->trusts = false;
    if (s->best_score < had) {
        start_from(s, wish, memcpy(QW_NEW(env, qw_int2, edges), s->best, edges * sizeof *s->best));
        make_all(env, s, counts, wish->share);
    }
    start_from(s, wish, s->first);
}

qw_meeting_counts qw_make_meetings(qw_env *env, const qw_component *component, const qw_meeting_wish *wish, qw_int2 *d)
{
    assert(wish->loops > 0 && wish->loops <= 1 && wish->least_area <= wish->most_area);
    if (!(wish->most_area > 0)) return (qw_meeting_counts){0}; /* it is inverted as a whole: no line has a length */
    qw_scope_begin(env);
    search s = begin_search(env, component, wish, d);
    qw_meeting_counts counts = {.length_before = (int64_t)s.lines};
    if (s.source.edge_count <= QW_MOST_MOVED_EDGES) trust(env, &s, wish, &counts);
    make_all(env, &s, &counts, wish->share);
    memcpy(d, s.best, s.source.edge_count * sizeof *d);
    counts.length_after = (int64_t)s.best_lines;
    qw_scope_end(env);
    return counts;
}

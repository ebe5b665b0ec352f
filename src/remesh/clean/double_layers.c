/* Sheets of the file that lie on one another, whose rims would be joined where they have vertices in common. At one
 * edge they look like the two sides of a thin blade, so pairs of sheets are judged by all edges at which they meet. */
#include "remesh/clean/sheets.h"

#include "base/sets.h"
#include "base/sort.h"
#include "base/vec.h"
#include "geometry/trimesh.h"
#include "geometry/weld.h"

#include <assert.h>
#include <string.h>

/* Sheets of one position along their rims, as files have them of which each was cut alike. Those that agree may be a
   thin blade. */
static const qw_fold_limits same_rim = {0.99996, 0.985}; /* 0.5 and 10 degrees */

static const double *position_of(const qw_sheets *s, uint32_t v) { return s->position + 3 * (size_t)v; }

bool qw_fold_back(const qw_sheets *s, uint32_t a, uint32_t b, const qw_fold_limits *limits)
{
    const uint32_t half[2] = {a, b};
    double axis[2][3], out[2][3];
    for (int i = 0; i < 2; i++) {
        const double *p = position_of(s, s->corner[half[i]]), *q = position_of(s, s->corner[qw_next(half[i])]),
                     *r = position_of(s, s->corner[qw_prev(half[i])]);
        for (int k = 0; k < 3; k++) axis[i][k] = q[k] - p[k], out[i][k] = r[k] - p[k];
        qw_unit_doubles(axis[i]);
        double along = qw_dot_doubles(out[i], axis[i]);
        for (int k = 0; k < 3; k++) out[i][k] -= along * axis[i][k];
        qw_unit_doubles(out[i]);
    }
    bool agree = qw_dot_doubles(axis[0], axis[1]) < 0;
    return qw_dot_doubles(out[0], out[1]) > (agree ? limits->agreeing : limits->disagreeing);
}

bool qw_is_named_alike(const qw_sheets *s, uint32_t a, uint32_t b)
{
    uint32_t from = s->named[a], to = s->named[qw_next(a)], other = s->named[b], end = s->named[qw_next(b)];
    return (from == other && to == end) || (from == end && to == other);
}

bool qw_stay_apart(const qw_sheets *s, uint32_t a, uint32_t b)
{
    if (!s->named || qw_is_named_alike(s, a, b)) return false;
    uint64_t pair = s->sheet ? qw_pair_key(s->sheet[a / 3], s->sheet[b / 3]) : 0;
    size_t at = qw_first_not_below(s->layered, s->layers, pair);
    return (at < s->layers && s->layered[at] == pair) || qw_fold_back(s, a, b, &same_rim);
}

/* Sheets that are cut differently and curved: most of the length along which they meet folds back by so little. */
static const qw_fold_limits curved_rim = {0.985, 0.985};
static const double MOST = 0.75;

enum { MOST_SIDES = 32 }; /* edges with more are no rims */

/* Of two sheets of the file: how long their rims meet, and fold back there, and whether they meet within, too. */
typedef struct meeting {
    double length, curved, same;
    bool within;
} meeting;

typedef struct layering {
    qw_sheets *sheets;
    uint64_t *pair; /* uint64_t[pairs]: of sheets that meet, sorted once all are known */
    size_t pairs, room;
    meeting *of;   /* meeting[pairs]; NULL while pairs are gathered */
    uint8_t *open; /* uint8_t[names]: sheets with a side that meets none */
} layering;

/* Notes that the sides a and b are between the same vertices now. */
static void meet(qw_env *env, layering *w, uint32_t a, uint32_t b)
{
    const qw_sheets *s = w->sheets;
    uint64_t pair = qw_pair_key(s->sheet[a / 3], s->sheet[b / 3]);
    if (s->sheet[a / 3] == s->sheet[b / 3]) return;
    if (!w->of) {
        w->pair = qw_grow(env, w->pair, &w->room, w->pairs + 1, sizeof *w->pair);
        w->pair[w->pairs++] = pair;
        return;
    }
    const double *p = position_of(s, s->corner[a]), *q = position_of(s, s->corner[qw_next(a)]);
    meeting *m = &w->of[qw_first_not_below(w->pair, w->pairs, pair)];
    const double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]}, length = sqrt(qw_dot_doubles(d, d));
    m->length += length;
    if (qw_fold_back(s, a, b, &curved_rim)) m->curved += length;
    if (qw_fold_back(s, a, b, &same_rim)) m->same += length;
}

static void visit_meetings(qw_env *env, layering *w, const qw_edges *edges)
{
    for (uint32_t v = 0; v < w->sheets->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i == 1) w->open[w->sheets->sheet[qw_side_half(edges->side[i]) / 3]] = 1;
            for (uint32_t k = i; k < end && end - i <= MOST_SIDES; k++)
                for (uint32_t j = k + 1; j < end; j++)
                    meet(env, w, qw_side_half(edges->side[k]), qw_side_half(edges->side[j]));
        }
}

static bool fold_back(const meeting *m) { return m->curved > MOST * m->length; }

/* Two sheets that close a body between them, without a rim that is left, may do so as thinly as they like, unless they
   meet within. */
static bool are_layers(const layering *w, uint64_t pair, const meeting *m)
{
    bool open = w->open[pair >> 32] || w->open[(uint32_t)pair];
    return fold_back(m) && (open || m->within || m->same > (1 - MOST) * m->length);
}

/* Whether more than one of the sides of an edge is of this sheet, so that it is no rim of it. */
static bool is_within(const qw_sheets *s, const uint64_t *side, uint32_t count, uint32_t sheet)
{
    uint32_t sides = 0;
    for (uint32_t i = 0; i < count; i++) sides += s->sheet[qw_side_half(side[i]) / 3] == sheet;
    return sides > 1;
}

/* Marks the pairs of sheets of which neither has its rim at this edge: they meet within. */
static void meet_within(layering *w, const uint64_t *side, uint32_t count)
{
    const qw_sheets *s = w->sheets;
    for (uint32_t i = 0; i < count; i++)
        for (uint32_t k = i + 1; k < count; k++) {
            uint32_t a = s->sheet[qw_side_half(side[i]) / 3], b = s->sheet[qw_side_half(side[k]) / 3];
            uint64_t pair = qw_pair_key(a, b);
            size_t at = qw_first_not_below(w->pair, w->pairs, pair);
            if (at < w->pairs && w->pair[at] == pair && is_within(s, side, count, a) && is_within(s, side, count, b))
                w->of[at].within = true;
        }
}

/* Finds which pairs have an edge in one place that is a rim of neither; what is within has not been joined. */
static void find_within(qw_env *env, layering *w)
{
    const qw_sheets *s = w->sheets;
    size_t half_edges = 3 * (size_t)s->face_count;
    uint32_t *joined = QW_NEW(env, uint32_t, half_edges);
    memcpy(joined, s->corner, half_edges * sizeof *joined);
    qw_weld_equal(env, s->position, s->vertex_count, NULL, joined, s->face_count);
    qw_edges edges = qw_edges_build(env, 3, joined, s->face_count, s->vertex_count);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges.begin[v], end; i < edges.begin[v + 1]; i = end) {
            end = qw_edge_end(&edges, i, edges.begin[v + 1]);
            if (end - i > 3 && end - i <= MOST_SIDES) meet_within(w, edges.side + i, end - i);
        }
    qw_edges_free(env, &edges);
}

void qw_find_double_layers(qw_env *env, qw_sheets *s, const qw_edges *edges)
{
    assert(s->named && !s->sheet);
    s->sheet = QW_NEW(env, uint32_t, s->face_count);
    uint32_t *set = QW_NEW(env, uint32_t, s->names);
    qw_sets_begin(set, s->names);
    for (size_t h = 0; h < 3 * (size_t)s->face_count; h += 3)
        qw_join_sets(set, s->named[h], s->named[h + 1]), qw_join_sets(set, s->named[h], s->named[h + 2]);
    for (uint32_t f = 0; f < s->face_count; f++) s->sheet[f] = qw_set_of(set, s->named[3 * (size_t)f]);
    layering w = {.sheets = s, .open = QW_NEW_ZERO(env, uint8_t, s->names)};
    visit_meetings(env, &w, edges);
    if (w.pairs == 0) return;
    w.pairs = qw_sort_once(w.pair, w.pairs);
    w.of = QW_NEW_ZERO(env, meeting, w.pairs);
    visit_meetings(env, &w, edges);
    bool folded = false;
    for (size_t i = 0; i < w.pairs; i++) folded |= fold_back(&w.of[i]);
    if (folded) find_within(env, &w);
    for (size_t i = 0; i < w.pairs; i++)
        if (are_layers(&w, w.pair[i], &w.of[i])) w.pair[s->layers++] = w.pair[i];
    s->layered = w.pair;
}

/* Faces that lie on one another.
 *
 * Of equal faces the first of the file stays that is turned as most of them. Where they come in pairs of opposite
 * orientation they may also enclose nothing: edge collapses of scans leave flaps, one or two triangles written from
 * both sides and hanging on a closed surface by an edge with four sides. Keeping one side of a flap would tear it off
 * as a sheet of its own; a small one goes with both sides. Double-sided sheets that are larger, that stand alone, or
 * that close a hole keep one side. */
#include "remesh/clean/sheets.h"

#include "base/sets.h"
#include "base/sort.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

/* Most area of a flap, as a share of the square of the bounding box's diagonal: a hundredth of it wide and long. */
static const double FLAP_AREA = 1e-4;

enum copy_kind {
    SINGLE = 0,
    DROPPED = QW_FACE_DROPPED,
    HOLLOW = QW_FACE_BOTH
}; /* HOLLOW: stays so far, for as many faces one way as the other */

typedef struct equals {
    const qw_sheets *sheets;
    uint8_t *kind;      /* of the call */
    uint8_t *has_equal; /* uint8_t[face_count], receives 1 where there is another; NULL: not asked for */
    uint32_t *sheet;    /* uint32_t[face_count]: faces of different ones are not equal; NULL: all may be */
    uint64_t *key;      /* scratch of an edge */
    size_t room;
} equals;

/* Drops all but the first of equal faces, given by a half-edge of each. Returns how many. */
static uint32_t drop_but_one(const equals *a, const uint64_t *key, uint32_t count)
{
    const uint32_t *corner = a->sheets->corner;
    uint32_t first = (uint32_t)key[0], other = first, alike = 1;
    for (uint32_t i = 1; i < count; i++) {
        uint32_t h = (uint32_t)key[i];
        a->kind[h / 3] = DROPPED;
        if (corner[h] == corner[first]) alike++;
        else if (other == first) other = h;
    }
    if (2 * alike < count) a->kind[first / 3] = DROPPED, a->kind[other / 3] = SINGLE;
    if (2 * alike == count) a->kind[first / 3] = HOLLOW;
    for (uint32_t i = 0; a->has_equal && i < count; i++) a->has_equal[(uint32_t)key[i] / 3] = 1;
    return count - 1;
}

/* The end of the keys from i on that begin alike. */
static uint32_t end_of_run(const uint64_t *key, uint32_t i, uint32_t count)
{
    uint32_t end = i + 1;
    while (end < count && key[end] >> 32 == key[i] >> 32) end++;
    return end;
}

/* Equal faces share all three edges; looking only at the edge between their two lower vertices finds each once. Sorted
   by apex (the third vertex), equals are neighbours, the first of the file in front. Returns the number of faces
   dropped. */
static uint32_t drop_at_edge(equals *a, const uint64_t *side, uint32_t count)
{
    assert(count > 1 && side);
    const qw_sheets *s = a->sheets;
    uint32_t dropped = 0, n = 0;
    uint64_t *key = a->key;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t h = qw_side_half(side[i]), apex = s->corner[qw_prev(h)];
        if (apex > qw_side_upper(side[i])) key[n++] = (uint64_t)apex << 32 | h;
    }
    qw_sort_u64(key, n);
    for (uint32_t i = 0, end; i < n; i = end) {
        end = end_of_run(key, i, n);
        for (uint32_t k = i; k < end && a->sheet; k++) {
            uint32_t h = (uint32_t)key[k];
            key[k] = (uint64_t)a->sheet[h / 3] << 32 | h;
        }
        if (a->sheet) qw_sort_u64(key + i, end - i);
        for (uint32_t k = i, last; k < end; k = last) {
            last = a->sheet ? end_of_run(key, k, end) : end;
            if (last - k > 1) dropped += drop_but_one(a, key + k, last - k);
        }
    }
    return dropped;
}

/* Drops all but one of the triangles with the same three corners. Returns how many. */
static uint32_t drop_equals(qw_env *env, equals *a, const qw_edges *edges)
{
    uint32_t dropped = 0;
    for (uint32_t v = 0; v < a->sheets->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i == 1) continue;
            a->key = qw_grow(env, a->key, &a->room, end - i, sizeof *a->key);
            dropped += drop_at_edge(a, edges->side + i, end - i);
        }
    return dropped;
}

/* Sheets of the file some of whose faces equal others keep all of them: they lie on one
   another there. Those all of whose faces do are the same written again, and count as one. */
static void find_sheets(qw_env *env, equals *a)
{
    const qw_sheets *s = a->sheets;
    uint8_t *is_in_part = QW_NEW_ZERO(env, uint8_t, s->names);
    for (uint32_t f = 0; f < s->face_count; f++)
        if (!a->has_equal[f]) is_in_part[s->sheet[f]] = 1;
    a->sheet = QW_NEW(env, uint32_t, s->face_count);
    for (uint32_t f = 0; f < s->face_count; f++) a->sheet[f] = is_in_part[s->sheet[f]] ? s->sheet[f] : QW_NONE;
}

/* ---- flaps */

/* Connected sets of hollow faces, as union-find trees over the faces; the members below belong to the root. */
typedef struct flaps {
    uint32_t *parent; /* uint32_t[face_count] */
    double *area;     /* double[face_count] */
    uint8_t *loose;   /* uint8_t[face_count]: 1 hangs on other faces; 2 an odd number of them, which need it */
} flaps;

/* Of a triangle, in the coordinates of the file. */
static double area_of(const qw_sheets *s, uint32_t f)
{
    assert(f < s->face_count);
    const uint32_t *c = s->corner + 3 * (size_t)f;
    const double *p = s->position;
    return sqrt(qw_cross2_doubles(p + 3 * (size_t)c[0], p + 3 * (size_t)c[1], p + 3 * (size_t)c[2])) / 2;
}

/* Calls for each edge: joins its hollow faces (judge false), or tells their flap how many other faces there are (judge
 * true). */
static void visit_edge(flaps *t, const uint8_t *kind, const uint64_t *side, uint32_t count, bool judge)
{
    assert(count > 1);
    uint32_t hollow = QW_NONE, others = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t f = qw_side_half(side[i]) / 3;
        others += kind[f] == SINGLE;
        if (kind[f] != HOLLOW) continue;
        if (hollow != QW_NONE) qw_join_sets(t->parent, f, hollow);
        hollow = qw_set_of(t->parent, f);
    }
    if (judge && hollow != QW_NONE) t->loose[hollow] |= others % 2 == 1 ? 2 : others > 0;
}

static void visit_edges(flaps *t, const qw_sheets *s, const qw_edges *edges, const uint8_t *kind, bool judge)
{
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i > 1) visit_edge(t, kind, edges->side + i, end - i, judge);
        }
}

/* Drops flaps: connected sets of hollow triangles that hang on the rest along a single edge and are small
 * (FLAP_AREA). Returns how many triangles. */
static uint32_t drop_flaps(qw_env *env, const qw_sheets *s, const qw_edges *edges, uint8_t *kind)
{
    flaps t = {.parent = QW_NEW(env, uint32_t, s->face_count), .area = QW_NEW_ZERO(env, double, s->face_count)};
    t.loose = QW_NEW_ZERO(env, uint8_t, s->face_count);
    qw_sets_begin(t.parent, s->face_count);
    visit_edges(&t, s, edges, kind, false);
    visit_edges(&t, s, edges, kind, true);
    for (uint32_t f = 0; f < s->face_count; f++)
        if (kind[f] == HOLLOW) t.area[qw_set_of(t.parent, f)] += area_of(s, f);
    uint32_t dropped = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        uint32_t root = qw_set_of(t.parent, f);
        if (kind[f] != HOLLOW || t.loose[root] != 1 || t.area[root] > FLAP_AREA) continue;
        kind[f] = DROPPED;
        dropped++;
    }
    return dropped;
}

uint32_t qw_find_duplicates(qw_env *env, const qw_sheets *s, const qw_edges *edges, uint8_t *kind)
{
    assert(edges->side && kind);
    qw_scope_begin(env);
    equals a = {.sheets = s, .kind = kind};
    if (s->named) a.has_equal = QW_NEW_ZERO(env, uint8_t, s->face_count);
    uint32_t count = drop_equals(env, &a, edges);
    if (count > 0 && s->named) {
        find_sheets(env, &a);
        a.has_equal = NULL;
        memset(kind, SINGLE, s->face_count * sizeof *kind);
        count = drop_equals(env, &a, edges);
    }
    if (count > 0) count += drop_flaps(env, s, edges, kind);
    qw_scope_end(env);
    return count;
}

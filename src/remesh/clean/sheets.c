/* Dropping of faces, cutting at edges with more than two of them, splitting of vertices with more than one fan. */
#include "remesh/clean/sheets.h"

#include "base/vec.h"
#include "geometry/trimesh.h"

#include <assert.h>
#include <string.h>

uint32_t qw_drop_degenerate(qw_sheets *s)
{
    assert(s->corner);
    uint32_t kept = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        const uint32_t *c = s->corner + 3 * (size_t)f;
        if (qw_repeats_vertex(c)) continue;
        if (kept != f) {
            memcpy(s->corner + 3 * (size_t)kept, c, 3 * sizeof *c);
            if (s->named) memcpy(s->named + 3 * (size_t)kept, s->named + 3 * (size_t)f, 3 * sizeof *s->named);
            s->source[kept] = s->source[f];
        }
        kept++;
    }
    uint32_t dropped = s->face_count - kept;
    s->face_count = kept;
    return dropped;
}

/* Closes the gaps of dropped triangles. moved: uint32_t[faces], receives their new numbers. */
static void compact_faces(qw_sheets *s, uint32_t *moved)
{
    assert(s->kind && moved);
    uint32_t kept = 0;
    for (uint32_t f = 0; f < s->face_count; f++) {
        moved[f] = kept;
        if (s->kind[f] == QW_FACE_DROPPED) continue;
        s->kind[kept] = s->kind[f];
        memmove(s->corner + 3 * (size_t)kept, s->corner + 3 * (size_t)f, 3 * sizeof(uint32_t));
        memmove(s->twin + 3 * (size_t)kept, s->twin + 3 * (size_t)f, 3 * sizeof(uint32_t));
        s->source[kept++] = s->source[f];
    }
    s->face_count = kept;
    for (size_t h = 0; h < 3 * (size_t)kept; h++)
        if (s->twin[h] != QW_NONE) s->twin[h] = 3 * moved[s->twin[h] / 3] + s->twin[h] % 3;
}

/* ---- pairing */

static uint32_t largest_edge(const qw_edges *edges, uint32_t vertex_count)
{
    uint32_t largest = 0;
    for (uint32_t v = 0; v < vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            if (end - i > largest) largest = end - i;
        }
    return largest;
}

/* An edge with more faces than this is no surface that anyone built; its sides are paired in the order of the file, so
   that the work stays linear. */
enum { MOST_BY_ANGLE = 32 };

typedef struct wing {
    uint32_t half;
    bool forward;  /* runs from the lower to the upper vertex */
    bool both;     /* or the other way: of a face that may be turned */
    double out[3]; /* unit vector from the edge into the face, orthogonal to the edge; 0 for faces without area */
} wing;

static const double *position_of(const qw_sheets *s, uint32_t v) { return s->position + 3 * (size_t)v; }

/* For each wing (a triangle at an edge with several) the direction away from the edge, of unit length and square to
 * it. axis: receives the edge's own. */
static void wing_directions(const qw_sheets *s, uint32_t lower, uint32_t upper, wing *w, uint32_t count, double *axis)
{
    assert(lower < upper && upper < s->vertex_count);
    const double *p = position_of(s, lower), *q = position_of(s, upper);
    for (int k = 0; k < 3; k++) axis[k] = q[k] - p[k];
    qw_unit_doubles(axis);
    for (uint32_t i = 0; i < count; i++) {
        const double *a = position_of(s, s->corner[qw_prev(w[i].half)]);
        double *out = w[i].out;
        for (int k = 0; k < 3; k++) out[k] = a[k] - p[k];
        double along = qw_dot_doubles(out, axis);
        for (int k = 0; k < 3; k++) out[k] -= along * axis[k];
        qw_unit_doubles(out);
    }
}

/* Of two pairs with the same angle, that which folds inward is worse by so much: a choice for ever the same. */
static const double FOLDS_INWARD = 1e-6;

/* The wider the angle the larger. Of equal angles the one with the solid inside it counts as wider: two cubes that
   share an edge stay two cubes. */
static double pair_score(const double *axis, const wing *forward, const wing *backward)
{
    const double *d = forward->out, *e = backward->out;
    double normal[3];
    qw_cross_doubles(axis, d, normal);
    return -qw_dot_doubles(d, e) - (qw_dot_doubles(normal, e) > 0 ? FOLDS_INWARD : 0);
}

/* Whether a may run forward and b backward. The faces that can be turned wait until the others are paired: a surface
   does without a sheet that hangs on it. */
static bool may_pair(const wing *a, const wing *b, bool both)
{
    if (a->half == QW_NONE || b->half == QW_NONE || a == b) return false;
    if (!both && (a->both || b->both)) return false;
    return (a->forward || a->both) && (!b->forward || b->both);
}

/* Joins wings two by two, those that score best first, until no two may be joined. count: of the wings, few. */
static void pair_by_angle(qw_sheets *s, const double *axis, wing *w, uint32_t count, bool both)
{
    assert(count > 1);
    for (;;) {
        wing *best_a = NULL, *best_b = NULL;
        double best = -2;
        for (wing *a = w; a < w + count; a++)
            for (wing *b = w; b < w + count; b++) {
                if (!may_pair(a, b, both) || pair_score(axis, a, b) <= best) continue;
                if (qw_stay_apart(s, a->half, b->half)) continue;
                best = pair_score(axis, a, b);
                best_a = a;
                best_b = b;
            }
        if (!best_a) return;
        s->twin[best_a->half] = best_b->half;
        s->twin[best_b->half] = best_a->half;
        best_a->half = best_b->half = QW_NONE;
    }
}

/* Joins the sides of an edge with very many, one of each direction, in the order of the file. */
static void pair_in_order(qw_sheets *s, uint32_t lower, const uint32_t *half, uint32_t count)
{
    uint32_t a = 0, b = 0; /* a walks the sides of one direction, b those of the other */
    for (;; a++, b++) {
        while (a < count && s->corner[half[a]] != lower) a++;
        while (b < count && s->corner[half[b]] == lower) b++;
        if (a >= count || b >= count) return;
        s->twin[half[a]] = half[b];
        s->twin[half[b]] = half[a];
    }
}

/* Joins the sides of an edge that are the only two of theirs in the file, few in all. Returns how many are left. */
static uint32_t pair_as_named(qw_sheets *s, uint32_t *half, uint32_t count)
{
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t alike = 0, other = half[i];
        for (uint32_t j = 0; j < count; j++)
            if (j != i && qw_is_named_alike(s, half[i], half[j])) alike++, other = half[j];
        if (alike == 1) s->twin[half[i]] = other;
    }
    for (uint32_t i = 0; i < count; i++)
        if (s->twin[half[i]] == QW_NONE) half[left++] = half[i];
    return left;
}

/* half: the sides of one edge whose faces live; put into another order. Their twins are QW_NONE so far. Returns whether
 * there are more than two. */
static bool pair_edge(qw_sheets *s, uint32_t lower, uint32_t upper, uint32_t *half, uint32_t count)
{
    assert(lower < s->vertex_count && upper < s->vertex_count);
    bool nonmanifold = count > 2;
    if (count > MOST_BY_ANGLE) {
        pair_in_order(s, lower, half, count);
        return true;
    }
    if (nonmanifold && s->named) count = pair_as_named(s, half, count);
    if (count == 2 && qw_stay_apart(s, half[0], half[1])) {
        s->apart++;
    } else if (count == 2) {
        s->twin[half[0]] = half[1];
        s->twin[half[1]] = half[0];
    }
    if (count <= 2) return nonmanifold;
    wing w[MOST_BY_ANGLE];
    double axis[3];
    for (uint32_t i = 0; i < count; i++) {
        bool both = s->kind[half[i] / 3] == QW_FACE_BOTH;
        w[i] = (wing){.half = half[i], .forward = s->corner[half[i]] == lower, .both = both};
    }
    wing_directions(s, lower, upper, w, count, axis);
    pair_by_angle(s, axis, w, count, false);
    pair_by_angle(s, axis, w, count, true);
    return true;
}

typedef struct plain_pairs {
    qw_sheets *sheets;
    const qw_edges *edges;
    /* uint8_t[blocks]: has an edge with more than two sides, or with two that stay apart or have one apex */
    uint8_t *strange;
} plain_pairs;

/* Joins the two sides of ordinary edges; notes where a block has others, which need more thought. */
static void pair_plainly(void *user, uint32_t begin, uint32_t end_vertex)
{
    plain_pairs *p = user;
    const uint32_t *corner = p->sheets->corner;
    for (uint32_t v = begin; v < end_vertex; v++)
        for (uint32_t i = p->edges->begin[v], end; i < p->edges->begin[v + 1]; i = end) {
            end = qw_edge_end(p->edges, i, p->edges->begin[v + 1]);
            if (end - i == 1) continue;
            uint32_t a = qw_side_half(p->edges->side[i]), b = qw_side_half(p->edges->side[i + 1]);
            if (end - i > 2 || corner[qw_prev(a)] == corner[qw_prev(b)] || qw_stay_apart(p->sheets, a, b))
                p->strange[begin / QW_GRAIN_LIGHT] = 1;
            p->sheets->twin[a] = b, p->sheets->twin[b] = a;
        }
}

/* Most files have but edges with one side or two, and no face twice. Where this one has others it returns false, and
 * twin means nothing. */
static bool pair_all_plainly(qw_env *env, qw_sheets *s, const qw_edges *edges)
{
    uint32_t blocks = qw_block_count(s->vertex_count, QW_GRAIN_LIGHT), strange = 0;
    plain_pairs p = {s, edges, QW_NEW_ZERO(env, uint8_t, blocks)};
    qw_parallel(env, s->vertex_count, QW_GRAIN_LIGHT, pair_plainly, &p);
    for (uint32_t b = 0; b < blocks; b++) strange += p.strange[b];
    qw_free(env, p.strange);
    return strange == 0;
}

uint32_t qw_pair_sides(qw_env *env, qw_sheets *s, const qw_edges *edges, uint32_t *nonmanifold)
{
    assert(edges->side && nonmanifold);
    size_t half_edges = 3 * (size_t)s->face_count;
    s->twin = QW_NEW(env, uint32_t, half_edges);
    memset(s->twin, 0xff, half_edges * sizeof(uint32_t));
    s->kind = QW_NEW_ZERO(env, uint8_t, s->face_count);
    *nonmanifold = s->apart = 0;
    if (pair_all_plainly(env, s, edges)) return 0;
    memset(s->twin, 0xff, half_edges * sizeof(uint32_t));
    qw_scope_begin(env);
    uint32_t *half = QW_NEW(env, uint32_t, largest_edge(edges, s->vertex_count));
    uint32_t dropped = qw_find_duplicates(env, s, edges, s->kind);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        for (uint32_t i = edges->begin[v], end; i < edges->begin[v + 1]; i = end) {
            end = qw_edge_end(edges, i, edges->begin[v + 1]);
            uint32_t count = 0;
            for (uint32_t j = i; j < end; j++)
                if (s->kind[qw_side_half(edges->side[j]) / 3] != QW_FACE_DROPPED)
                    half[count++] = qw_side_half(edges->side[j]);
            *nonmanifold += pair_edge(s, v, qw_side_upper(edges->side[i]), half, count);
        }
    if (dropped) compact_faces(s, QW_NEW(env, uint32_t, s->face_count));
    qw_scope_end(env);
    return dropped;
}

/* ---- fans */

/* The half-edge of the fan around the tail of h that is furthest clockwise: a boundary side, or h itself when the fan
 * is closed. */
static uint32_t first_of_fan(const uint32_t *twin, uint32_t h)
{
    uint32_t g = h;
    while (twin[g] != QW_NONE) {
        g = qw_next(twin[g]);
        if (g == h) break;
    }
    return g;
}

static void name_fan(const uint32_t *twin, uint32_t first, uint32_t vertex, uint32_t *fan)
{
    uint32_t h = first;
    do {
        fan[h] = vertex;
        h = twin[qw_prev(h)];
    } while (h != QW_NONE && h != first);
}

typedef struct fans {
    const qw_sheets *sheets;
    const uint32_t *half; /* uint32_t[vertex_count]: a half-edge out of the vertex, or QW_NONE */
    uint64_t *corners;    /* uint64_t[blocks]: of the fans that those are in */
} fans;

/* Counts the corners of the fans that the vertices of a block keep. */
static void count_fan_corners(void *user, uint32_t begin, uint32_t end)
{
    const fans *t = user;
    const uint32_t *twin = t->sheets->twin;
    uint64_t count = 0;
    for (uint32_t v = begin; v < end; v++) {
        if (t->half[v] == QW_NONE) continue;
        uint32_t first = first_of_fan(twin, t->half[v]), h = first;
        do {
            count++;
            h = twin[qw_prev(h)];
        } while (h != QW_NONE && h != first);
    }
    t->corners[begin / QW_GRAIN_LIGHT] = count;
}

/* Whether every vertex has faces, and one fan of them: then all stays as it is. */
static bool has_single_fans(qw_env *env, const qw_sheets *s)
{
    uint32_t blocks = qw_block_count(s->vertex_count, QW_GRAIN_LIGHT), *half = QW_NEW(env, uint32_t, s->vertex_count);
    memset(half, 0xff, s->vertex_count * sizeof *half);
    for (uint32_t h = 0; h < 3 * s->face_count; h++) half[s->corner[h]] = h;
    fans t = {s, half, QW_NEW(env, uint64_t, blocks)};
    qw_parallel(env, s->vertex_count, QW_GRAIN_LIGHT, count_fan_corners, &t);
    uint64_t corners = 0;
    bool isolated = false;
    for (uint32_t b = 0; b < blocks; b++) corners += t.corners[b];
    for (uint32_t v = 0; v < s->vertex_count; v++) isolated |= half[v] == QW_NONE;
    qw_free(env, half), qw_free(env, t.corners);
    return !isolated && corners == 3 * (uint64_t)s->face_count;
}

/* Renumbers the vertices that have faces in the order of their numbers. */
static void compact_vertices(qw_env *env, qw_sheets *s, const uint32_t *point_of_added, uint32_t old_count)
{
    qw_scope_begin(env);
    uint32_t *number = QW_NEW(env, uint32_t, s->vertex_count), count = 0;
    memset(number, 0xff, s->vertex_count * sizeof *number);
    for (size_t h = 0; h < 3 * (size_t)s->face_count; h++) number[s->corner[h]] = 0;
    for (uint32_t v = 0; v < s->vertex_count; v++)
        if (number[v] != QW_NONE) number[v] = count++;
    s->point = QW_NEW(env, uint32_t, count);
    qw_keep(env, s->point);
    for (uint32_t v = 0; v < s->vertex_count; v++)
        if (number[v] != QW_NONE) s->point[number[v]] = v < old_count ? v : point_of_added[v - old_count];
    for (size_t h = 0; h < 3 * (size_t)s->face_count; h++) s->corner[h] = number[s->corner[h]];
    s->vertex_count = count;
    qw_scope_end(env);
}

uint32_t qw_split_fans(qw_env *env, qw_sheets *s)
{
    assert(s->twin && s->corner);
    if (has_single_fans(env, s)) {
        s->point = QW_NEW(env, uint32_t, s->vertex_count);
        for (uint32_t v = 0; v < s->vertex_count; v++) s->point[v] = v;
        return 0;
    }
    qw_scope_begin(env);
    size_t half_edges = 3 * (size_t)s->face_count, capacity = 0;
    uint32_t *fan = QW_NEW(env, uint32_t, half_edges), *added = NULL, old_count = s->vertex_count;
    uint8_t *taken = QW_NEW_ZERO(env, uint8_t, old_count);
    memset(fan, 0xff, half_edges * sizeof *fan);
    for (uint32_t h = 0; h < half_edges; h++) {
        if (fan[h] != QW_NONE) continue;
        uint32_t v = s->corner[h], name = v;
        if (taken[v]) {
            name = s->vertex_count++;
            added = qw_grow(env, added, &capacity, name - old_count + 1, sizeof *added);
            added[name - old_count] = v;
        }
        taken[v] = 1;
        name_fan(s->twin, first_of_fan(s->twin, h), name, fan);
    }
    memcpy(s->corner, fan, half_edges * sizeof *fan);
    uint32_t split = s->vertex_count - old_count;
    compact_vertices(env, s, added, old_count);
    qw_keep(env, s->point);
    qw_scope_end(env);
    return split;
}

#include "remesh/meetings/strips.h"

#include "base/sets.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

/* The places of component k of edge e have the numbers first[2 e + k] .. first[2 e + k + 1] - 1, from the tail of the
   edge's first half-edge on. */

/* What a half-edge is along one axis of its triangle's frame. */
typedef struct side {
    int32_t steps;  /* along the axis */
    uint32_t count; /* of its places, */
    uint32_t first; /* which are first, first + by, ... from its tail on */
    int32_t by;
} side;

static side side_of(const qw_complex *c, const uint32_t *first, uint32_t h, unsigned axis)
{
    uint32_t e = c->edge[h];
    unsigned k = (axis + c->rot[h]) & 1u; /* of the edge's own frame */
    qw_int2 steps = qw_steps_along(c, h);
    side s = {axis ? steps.y : steps.x, first[2 * e + k + 1] - first[2 * e + k], first[2 * e + k], 1};
    if (c->side[2 * e] != h) s.first += s.count - 1, s.by = -1;
    return s;
}

static uint32_t place_on(side s, uint32_t i) { return s.first + (uint32_t)(s.by * (int32_t)i); }

/* Strips that pass between two sides of a triangle: so many, beside the corner where `out` begins and `in` ends. */
static void join_around(uint32_t *strip, side out, side in, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) qw_join_sets(strip, place_on(out, i), place_on(in, in.count - 1 - i));
}

/* What crosses the longest side of a triangle leaves it by one of the two others, in order. */
static side longest_of(const qw_complex *c, const uint32_t *first, uint32_t f, unsigned axis, side *next, side *before)
{
    side s[3];
    unsigned longest = 0;
    for (unsigned i = 0; i < 3; i++) {
        s[i] = side_of(c, first, 3 * f + i, axis);
        if (s[i].count > s[longest].count) longest = i;
    }
    *next = s[(longest + 1) % 3], *before = s[(longest + 2) % 3];
    assert(next->count + before->count == s[longest].count);
    return s[longest];
}

static uint32_t find_strips(qw_env *env, const qw_complex *c, qw_strip_room *r)
{
    r->first = qw_grow(env, r->first, &r->first_room, 2 * (size_t)c->edge_count + 1, sizeof *r->first);
    r->first[0] = 0;
    for (uint32_t e = 0; e < c->edge_count; e++) {
        r->first[2 * e + 1] = r->first[2 * e] + (uint32_t)abs(c->d[e].x);
        r->first[2 * e + 2] = r->first[2 * e + 1] + (uint32_t)abs(c->d[e].y);
    }
    uint32_t count = r->first[2 * c->edge_count];
    r->strip = qw_grow(env, r->strip, &r->strip_room, count + 1, sizeof *r->strip);
    qw_sets_begin(r->strip, count);
    for (uint32_t f = 0; f < c->face_count; f++)
        for (unsigned axis = 0; axis < 2; axis++) {
            side next, before, longest = longest_of(c, r->first, f, axis, &next, &before);
            join_around(r->strip, longest, before, before.count);
            join_around(r->strip, next, longest, next.count);
        }
    for (uint32_t i = 0; i < count; i++) r->strip[i] = r->strip[r->strip[i]]; /* parents are lower, so done already */
    return count;
}

/* A triangle's strips along one axis, from its least coordinate on. */
typedef struct rows {
    int32_t least;
    uint32_t count, first;
    int32_t by;
} rows;

static rows rows_of(const qw_complex *c, const uint32_t *first, uint32_t f, unsigned axis)
{
    side next, before, s = longest_of(c, first, f, axis, &next, &before);
    qw_int2 tail = {0, 0}; /* of the longest side, from the triangle's first corner */
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        side t = side_of(c, first, h, axis);
        if (t.first == s.first && t.by == s.by && t.count == s.count && t.steps == s.steps) break;
        tail = qw_int2_add(tail, qw_steps_along(c, h));
    }
    int32_t at = axis ? tail.y : tail.x;
    if (s.steps >= 0) return (rows){at, s.count, s.first, s.by};
    return (rows){at + s.steps, s.count, place_on(s, s.count - 1), -s.by};
}

/* Counts the quads whose middles lie in triangle f, those on its sides half. */
static void count_triangle(const qw_complex *c, uint32_t f, qw_strip_room *r)
{
    qw_int2 u[3];
    for (uint32_t i = 0; i < 3; i++) u[i] = qw_steps_along(c, 3 * f + i);
    if (qw_int2_det(u[0], u[1]) <= 0) return;
    rows x = rows_of(c, r->first, f, 0), y = rows_of(c, r->first, f, 1);
    int64_t left[3]; /* twice the double area between each side and the middle of the first cell of a row */
    qw_int2 corner = {0, 0};
    for (uint32_t i = 0; i < 3; i++) {
        left[i] = u[i].x * (2 * ((int64_t)y.least - corner.y) + 1) - u[i].y * (2 * ((int64_t)x.least - corner.x) + 1);
        corner = qw_int2_add(corner, u[i]);
    }
    for (uint32_t j = 0; j < y.count; j++) {
        uint32_t row = r->strip[y.first + (uint32_t)(y.by * (int32_t)j)], in_row = 0;
        int64_t a = left[0], b = left[1], d = left[2];
        for (uint32_t i = 0; i < x.count; i++, a -= 2 * u[0].y, b -= 2 * u[1].y, d -= 2 * u[2].y) {
            if ((a | b | d) < 0) continue;
            uint32_t column = r->strip[x.first + (uint32_t)(x.by * (int32_t)i)], halves = a && b && d ? 2 : 1;
            in_row += halves, r->halves[column] += halves;
            if (row == column) r->crosses[row] = 1;
        }
        r->halves[row] += in_row;
        for (uint32_t i = 0; i < 3; i++) left[i] += 2 * (int64_t)u[i].x;
    }
}

qw_strip_counts qw_count_strips(qw_env *env, const qw_complex *c, qw_strip_room *r)
{
    uint32_t count = find_strips(env, c, r);
    r->halves = qw_grow(env, r->halves, &r->halves_room, count + 1, sizeof *r->halves);
    r->crosses = qw_grow(env, r->crosses, &r->crosses_room, count + 1, sizeof *r->crosses);
    memset(r->halves, 0, (count + 1) * sizeof *r->halves), memset(r->crosses, 0, count + 1);
    for (uint32_t f = 0; f < c->face_count; f++) count_triangle(c, f, r);
    qw_strip_counts k = {0};
    for (uint32_t i = 0; i < count; i++) {
        if (r->strip[i] != i || r->halves[i] == 0) continue;
        k.strips++, k.area += r->halves[i] / 2.0;
        if (r->crosses[i]) k.crossing++, k.crossing_area += r->halves[i] / 2.0;
    }
    return k;
}

#include "remesh/meetings/strips.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The places of component k of edge e have the numbers from first[2 e + k] on, as many as it is long, from the tail of
   the edge's first half-edge on; before first[2 e + k + 1] there is room for RESERVE more. */
enum { RESERVE = 4 };

/* What a half-edge is along one axis of its triangle's frame. */
typedef struct side {
    int32_t steps;  /* along the axis */
    uint32_t count; /* of its places, */
    uint32_t first; /* which are first, first + by, ... from its tail on */
    int32_t by;
    uint32_t end; /* which half of its edge it is */
} side;

/* The half-edge along x and along y. */
static void look_along(const qw_complex *c, const uint32_t *first, uint32_t h, side *x, side *y)
{
    uint32_t e = c->edge[h], turned = c->rot[h] & 1u, end = c->side[2 * e] != h;
    qw_int2 steps = qw_steps_along(c, h);
    side *of[2] = {x, y};
    for (unsigned axis = 0; axis < 2; axis++) {
        int32_t along = axis ? steps.y : steps.x;
        uint32_t count = (uint32_t)abs(along), at = first[2 * e + (axis ^ turned)];
        *of[axis] = (side){along, count, end ? at + count - 1 : at, end ? -1 : 1, end};
    }
}

static uint32_t place_on(const side *s, uint32_t i) { return s->first + (uint32_t)(s->by * (int32_t)i); }

/* Links the places of two sides of a triangle between which strips pass: `count` of them, beside the corner where `out`
   begins and `in` ends. They run through the triangle over a length that grows from nothing at the corner to `width`,
   which is put down at the places of the first of the two. */
static void link_around(qw_strip_room *r, const side *out, const side *in, uint32_t count, double width)
{
    uint32_t a = 2 * out->first + out->end, b = 2 * place_on(in, in->count - 1) + in->end;
    uint32_t a_by = (uint32_t)(2 * out->by), b_by = (uint32_t)(-2 * in->by);
    double step = width / count, length = step / 2;
    for (uint32_t i = 0; i < count; i++, a += a_by, b += b_by, length += step) {
        r->beyond[a] = b, r->beyond[b] = a;
        r->part[a] = length, r->part[b] = 0;
    }
}

/* The places of a triangle along an axis are those of its longest side, in the order of their coordinates from the
   first corner on. */
static qw_strip_rows rows_of(const side s[3], unsigned longest)
{
    const side *l = &s[longest];
    int32_t at = longest == 0 ? 0 : longest == 1 ? s[0].steps : s[0].steps + s[1].steps;
    if (l->steps >= 0) return (qw_strip_rows){at, l->count, l->first, l->by};
    return (qw_strip_rows){at + l->steps, l->count, place_on(l, l->count - 1), -l->by};
}

/* What crosses the longest side of a triangle leaves it by one of the two others, in order. s: its sides along an axis.
   Returns the rows, none where the triangle has no area. */
static qw_strip_rows pass_triangle(qw_strip_room *r, const side s[3], double double_area)
{
    unsigned longest = s[1].count > s[0].count;
    if (s[2].count > s[longest].count) longest = 2;
    const side *most = &s[longest], *next = &s[longest == 2 ? 0 : longest + 1], *before = &s[longest ? longest - 1 : 2];
    assert(next->count + before->count == most->count);
    double width = double_area / most->count; /* at the corner opposite, where the triangle is widest */
    if (before->count > 0) link_around(r, most, before, before->count, width);
    if (next->count > 0) link_around(r, next, most, next->count, width);
    return double_area > 0 ? rows_of(s, longest) : (qw_strip_rows){0};
}

static void pass_along_axes(const qw_complex *c, qw_strip_room *r, uint32_t f)
{
    side x[3], y[3];
    for (unsigned i = 0; i < 3; i++) look_along(c, r->first, 3 * f + i, &x[i], &y[i]);
    double area = (double)x[0].steps * y[1].steps - (double)x[1].steps * y[0].steps, double_area = area > 0 ? area : 0;
    r->rows[2 * f] = pass_triangle(r, x, double_area);
    r->rows[2 * f + 1] = pass_triangle(r, y, double_area);
}

static uint32_t places_of(const qw_complex *c, uint32_t component)
{
    qw_int2 d = c->d[component / 2];
    return (uint32_t)abs(component & 1u ? d.y : d.x);
}

void qw_lay_strips(qw_env *env, const qw_complex *c, qw_strip_room *r)
{
    r->first = qw_grow(env, r->first, &r->first_room, 2 * (size_t)c->edge_count + 1, sizeof *r->first);
    r->first[0] = 0;
    for (uint32_t i = 0; i < 2 * c->edge_count; i++) r->first[i + 1] = r->first[i] + places_of(c, i) + RESERVE;
    size_t count = (size_t)r->first[2 * c->edge_count] + 1;
    r->strip = qw_grow(env, r->strip, &r->strip_room, count, sizeof *r->strip);
    r->beyond = qw_grow(env, r->beyond, &r->beyond_room, 2 * count, sizeof *r->beyond);
    r->part = qw_grow(env, r->part, &r->part_room, 2 * count, sizeof *r->part);
    r->length = qw_grow(env, r->length, &r->length_room, count, sizeof *r->length);
    r->face = qw_grow(env, r->face, &r->face_room, count, sizeof *r->face);
    r->last = qw_grow(env, r->last, &r->last_room, count, sizeof *r->last);
    r->before = qw_grow(env, r->before, &r->before_room, count, sizeof *r->before);
    r->crosses = qw_grow(env, r->crosses, &r->crosses_room, count, sizeof *r->crosses);
    r->rows = qw_grow(env, r->rows, &r->rows_room, 2 * (size_t)c->face_count, sizeof *r->rows);
    for (uint32_t e = 0; e < c->edge_count; e++) /* strips end at the boundary */
        for (uint32_t i = r->first[2 * e]; i < r->first[2 * e + 2] && c->side[2 * e + 1] == QW_NONE; i++)
            r->beyond[2 * i + 1] = QW_NONE, r->part[2 * i + 1] = 0;
    for (uint32_t f = 0; f < c->face_count; f++) pass_along_axes(c, r, f);
}

void qw_link_strips(qw_env *env, const qw_complex *c, qw_strip_room *r, const uint32_t *face, uint32_t count)
{
    assert(r->first && face);
    bool has_room = true;
    for (uint32_t h = 0; h < 3 * count && has_room; h++) {
        uint32_t i = 2 * c->edge[3 * face[h / 3] + h % 3];
        for (uint32_t k = i; k < i + 2; k++) has_room &= r->first[k] + places_of(c, k) <= r->first[k + 1];
    }
    if (!has_room) qw_lay_strips(env, c, r);
    for (uint32_t i = 0; i < count && has_room; i++) pass_along_axes(c, r, face[i]);
}

/* Follows the strip through place i, which has no name yet, from there both ways; names all its places after it. */
static void name_strip(qw_strip_room *r, uint32_t i)
{
    double length = r->part[2 * i] + r->part[2 * i + 1];
    r->strip[i] = i;
    for (uint32_t way = 0; way < 2; way++)
        for (uint32_t at = r->beyond[2 * i + way]; at != QW_NONE && r->strip[at / 2] == QW_NONE;
             at = r->beyond[at ^ 1u])
            r->strip[at / 2] = i, length += r->part[at] + r->part[at ^ 1u];
    r->length[i] = length;
}

/* Whether the middle of the cell of column x and row y lies in triangle f or on its sides. */
static bool has_middle(const qw_complex *c, uint32_t f, int64_t x, int64_t y)
{
    int64_t cx = 0, cy = 0; /* the corner that a side begins at */
    for (uint32_t h = 3 * f; h < 3 * f + 3; h++) {
        qw_int2 u = qw_steps_along(c, h);
        if (u.x * (2 * (y - cy) + 1) < u.y * (2 * (x - cx) + 1)) return false;
        cx += u.x, cy += u.y;
    }
    return true;
}

static uint32_t place_in(const qw_strip_rows *rows, uint32_t i)
{
    return rows->first + (uint32_t)(rows->by * (int32_t)i);
}

/* Finds the strips that cross themselves in triangle f and have not in any before, and counts them. */
static void find_crossings(const qw_complex *c, uint32_t f, qw_strip_room *r, qw_strip_counts *counts)
{
    const qw_strip_rows *x = &r->rows[2 * f], *y = x + 1;
    for (uint32_t i = 0; i < x->count; i++) { /* the columns of each strip, as a list from the last one on */
        uint32_t place = place_in(x, i), strip = r->strip[place];
        r->before[place] = r->face[strip] == f ? r->last[strip] : QW_NONE;
        r->face[strip] = f, r->last[strip] = i;
    }
    for (uint32_t j = 0; j < y->count; j++) {
        uint32_t strip = r->strip[place_in(y, j)];
        if (r->crosses[strip] || r->face[strip] != f) continue;
        for (uint32_t i = r->last[strip]; i != QW_NONE && !r->crosses[strip]; i = r->before[place_in(x, i)])
            r->crosses[strip] = has_middle(c, f, x->least + (int64_t)i, y->least + (int64_t)j);
        if (r->crosses[strip] && r->length[strip] > 0) counts->crossing++, counts->crossing_area += r->length[strip];
    }
}

qw_strip_counts qw_follow_strips(const qw_complex *c, qw_strip_room *r, double most)
{
    qw_strip_counts k = {0};
    uint32_t components = 2 * c->edge_count, places = r->first[components];
    memset(r->strip, 0xff, places * sizeof *r->strip);
    memset(r->face, 0xff, places * sizeof *r->face), memset(r->crosses, 0, places);
    for (uint32_t e = 0; e < components; e++)
        for (uint32_t i = r->first[e], end = i + places_of(c, e); i < end; i++) {
            if (r->strip[i] != QW_NONE) continue;
            name_strip(r, i);
            if (r->length[i] > 0) k.strips++, k.area += r->length[i];
        }
    for (uint32_t f = 0; f < c->face_count && k.crossing_area <= most; f++) find_crossings(c, f, r, &k);
    return k;
}

qw_strip_counts qw_count_strips(qw_env *env, const qw_complex *c, qw_strip_room *room)
{
    qw_lay_strips(env, c, room);
    return qw_follow_strips(c, room, INFINITY);
}

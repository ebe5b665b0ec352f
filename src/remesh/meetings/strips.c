#include "remesh/meetings/strips.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The places of component k of edge e have the numbers from first[2 e + k] on, places[2 e + k] of them, as many as it
   is long, from the tail of the edge's first half-edge on; before first[2 e + k + 1] there is room for RESERVE more. */
enum { RESERVE = 6 };

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

/* What lies in a triangle along one axis: its column, and the coordinates of the places of its longest side. */
typedef struct across {
    uint32_t column;
    int32_t at, by; /* the lower coordinate of the first place, and how it goes on from one to the next */
    double width;   /* at the corner opposite, where the triangle is widest */
} across;

/* Links the places of two sides of a triangle between which strips pass: `count` of them, beside the corner where `out`
   begins and `in` ends. They run through the triangle over a length that grows from nothing at the corner to the width.
   at: the coordinate of the first. */
static void link_around(qw_strip_room *r, const side *out, const side *in, uint32_t count, const across *t, int32_t at,
                        int32_t by)
{
    uint32_t a = 2 * out->first + out->end,
             b = 2 * (in->first + (uint32_t)(in->by * (int32_t)(in->count - 1))) + in->end;
    uint32_t a_by = (uint32_t)(2 * out->by), b_by = (uint32_t)(-2 * in->by);
    double step = t->width / count, length = step / 2;
    for (uint32_t i = 0; i < count; i++, a += a_by, b += b_by, length += step, at += by) {
        r->link[a] = (qw_strip_link){b, t->column, at, length};
        r->link[b] = (qw_strip_link){a, t->column, at, length};
    }
}

/* What crosses the longest side of a triangle leaves it by one of the two others, in order. s: its sides along an
   axis. */
static void pass_triangle(qw_strip_room *r, const side s[3], double double_area, uint32_t column)
{
    unsigned longest = s[1].count > s[0].count;
    if (s[2].count > s[longest].count) longest = 2;
    const side *most = &s[longest], *next = &s[longest == 2 ? 0 : longest + 1], *before = &s[longest ? longest - 1 : 2];
    assert(next->count + before->count == most->count);
    int32_t tail = longest == 0 ? 0 : longest == 1 ? s[0].steps : s[0].steps + s[1].steps, count = (int32_t)most->count;
    across t = {.column = double_area > 0 ? column : QW_NONE, .width = double_area / most->count};
    t.by = most->steps >= 0 ? 1 : -1, t.at = most->steps >= 0 ? tail : tail - 1;
    if (before->count > 0) link_around(r, most, before, before->count, &t, t.at, t.by);
    if (next->count > 0) link_around(r, next, most, next->count, &t, t.at + t.by * (count - 1), -t.by);
}

static void pass_along_axes(const qw_complex *c, qw_strip_room *r, uint32_t f)
{
    side x[3], y[3];
    for (unsigned i = 0; i < 3; i++) look_along(c, r->first, 3 * f + i, &x[i], &y[i]);
    double area = (double)x[0].steps * y[1].steps - (double)x[1].steps * y[0].steps, double_area = area > 0 ? area : 0;
    pass_triangle(r, x, double_area, 2 * f);
    pass_triangle(r, y, double_area, 2 * f + 1);
}

static uint32_t places_of(const qw_complex *c, uint32_t component)
{
    qw_int2 d = c->d[component / 2];
    return (uint32_t)abs(component & 1u ? d.y : d.x);
}

/* Lays out the places of all edges and links them through all triangles. */
static void lay(qw_env *env, const qw_complex *c, qw_strip_room *r)
{
    uint32_t components = 2 * c->edge_count;
    r->first = qw_grow(env, r->first, &r->room[0], (size_t)components + 1, sizeof *r->first);
    r->places = qw_grow(env, r->places, &r->room[1], components, sizeof *r->places);
    r->first[0] = 0;
    for (uint32_t i = 0; i < components; i++)
        r->places[i] = places_of(c, i), r->first[i + 1] = r->first[i] + r->places[i] + RESERVE;
    size_t count = (size_t)r->first[components] + 1;
    r->link = qw_grow(env, r->link, &r->room[2], 2 * count, sizeof *r->link);
    r->strip = qw_grow(env, r->strip, &r->room[3], count, sizeof *r->strip);
    r->crossing = qw_grow(env, r->crossing, &r->room[4], count, sizeof *r->crossing);
    r->crossing_now = qw_grow(env, r->crossing_now, &r->room[5], count, sizeof *r->crossing_now);
    r->before = qw_grow(env, r->before, &r->room[6], 2 * count, sizeof *r->before);
    r->last = qw_grow(env, r->last, &r->room[7], 2 * (size_t)c->face_count, sizeof *r->last);
    r->follows = qw_grow(env, r->follows, &r->room[8], 2 * (size_t)c->face_count, sizeof *r->follows);
    r->number = qw_grow(env, r->number, &r->room[9], count, sizeof *r->number);
    r->followed = qw_grow(env, r->followed, &r->room[10], count, sizeof *r->followed);
    memset(r->follows, 0, 2 * (size_t)c->face_count * sizeof *r->follows);
    memset(r->number, 0, count * sizeof *r->number);
    r->numbers = 0;
    for (uint32_t e = 0; e < components; e++) /* strips end at the boundary */
        for (uint32_t i = r->first[e]; i < r->first[e + 1] && c->side[e | 1u] == QW_NONE; i++)
            r->link[2 * i + 1] = (qw_strip_link){QW_NONE, QW_NONE, 0, 0};
    for (uint32_t f = 0; f < c->face_count; f++) pass_along_axes(c, r, f);
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

/* Puts the strip down in the triangle that it enters by link a. Returns whether it crosses itself there. */
static bool crosses_in(const qw_complex *c, qw_strip_room *r, uint32_t a)
{
    uint32_t k = r->link[a].column, other = k ^ 1u, number = r->numbers;
    if (k == QW_NONE) return false;
    for (uint32_t q = r->follows[other] == number ? r->last[other] : QW_NONE; q != QW_NONE; q = r->before[q]) {
        int32_t x = r->link[k & 1u ? q : a].at, y = r->link[k & 1u ? a : q].at;
        if (has_middle(c, k / 2, x, y)) return true;
    }
    r->before[a] = r->follows[k] == number ? r->last[k] : QW_NONE;
    r->last[k] = a, r->follows[k] = number;
    return false;
}

/* Follows the strip through place i both ways, and lists its places. *length: its quads, those twice that
   it crosses at. Returns whether it crosses itself; it may not be followed to its end where it does over more than
   `most`. */
static bool follow(const qw_complex *c, qw_strip_room *r, uint32_t i, double most, double *length)
{
    uint32_t number = ++r->numbers;
    bool crosses = false;
    *length = 0;
    r->number[i] = number, r->followed[r->follow_count++] = i;
    for (uint32_t way = 0; way < 2; way++)
        for (uint32_t a = 2 * i + way, b; (b = r->link[a].beyond) != QW_NONE; a = b ^ 1u) {
            uint32_t p = b / 2;
            *length += r->link[a].part;
            crosses = crosses || crosses_in(c, r, a);
            if (r->number[p] == number || (crosses && *length > most)) return crosses;
            r->number[p] = number, r->followed[r->follow_count++] = p;
        }
    return crosses;
}

/* Follows the strip through place i for the change at hand. */
static double follow_for_change(const qw_complex *c, qw_strip_room *r, uint32_t i, double most)
{
    double length;
    bool crosses = follow(c, r, i, most, &length) && length > 0;
    r->crossing_now[i] = crosses ? length : 0;
    r->change += r->crossing_now[i], r->change_count += crosses;
    return length;
}

void qw_keep_strips(qw_strip_room *r)
{
    for (uint32_t i = 0, name = 0; i < r->follow_count;
         i++) { /* strip after strip, each from the place that names it */
        uint32_t p = r->followed[i];
        if (i == 0 || r->number[p] != r->number[name]) name = p, r->crossing[p] = r->crossing_now[p];
        r->strip[p] = name;
    }
    r->crossing_count += r->change_count, r->area = r->crossing_count > 0 ? r->area + r->change : 0;
    r->follow_count = r->change_count = 0, r->change = 0, r->is_laid_anew = false;
}

qw_strip_counts qw_count_strips(qw_env *env, const qw_complex *c, qw_strip_room *r)
{
    qw_strip_counts k = {0};
    lay(env, c, r);
    r->follow_count = r->change_count = r->crossing_count = 0, r->change = r->area = 0;
    for (uint32_t e = 0; e < 2 * c->edge_count; e++)
        for (uint32_t i = r->first[e], end = i + r->places[e]; i < end; i++) {
            if (r->number[i] > 0) continue;
            double length = follow_for_change(c, r, i, INFINITY);
            if (length > 0) k.strips++, k.area += length;
        }
    qw_keep_strips(r);
    k.crossing = r->crossing_count, k.crossing_area = r->area;
    return k;
}

/* The i-th of the six components of the offsets at the sides of a triangle. */
static uint32_t component_of(const qw_complex *c, uint32_t face, uint32_t i)
{
    return 2 * c->edge[3 * face + i / 2] + i % 2;
}

/* Links the places anew in these triangles. Returns false where one of their sides has no room for its places. */
static bool link_anew(const qw_complex *c, qw_strip_room *r, const uint32_t *face, uint32_t count)
{
    for (uint32_t h = 0; h < 6 * count; h++) {
        uint32_t k = component_of(c, face[h / 6], h % 6);
        r->places[k] = places_of(c, k);
        if (r->first[k] + r->places[k] > r->first[k + 1]) return false;
    }
    for (uint32_t i = 0; i < count; i++) pass_along_axes(c, r, face[i]);
    return true;
}

double qw_change_strips(qw_env *env, const qw_complex *c, qw_strip_room *r, const uint32_t *face, uint32_t count,
                        double most)
{
    assert(r->first && face && r->follow_count == 0);
    uint32_t number = ++r->numbers; /* of all strips that meet the triangles before the change */
    for (uint32_t h = 0; h < 6 * count; h++) {
        uint32_t k = component_of(c, face[h / 6], h % 6);
        for (uint32_t i = r->first[k], end = i + r->places[k]; i < end; i++) {
            uint32_t strip = r->strip[i];
            if (r->number[strip] == number) continue;
            r->number[strip] = number, r->change -= r->crossing[strip], r->change_count -= r->crossing[strip] > 0;
        }
    }
    if (!link_anew(c, r, face, count)) {
        qw_count_strips(env, c, r);
        r->is_laid_anew = true;
        return r->area;
    }
    for (uint32_t h = 0; h < 6 * count && r->area + r->change <= most; h++) {
        uint32_t k = component_of(c, face[h / 6], h % 6);
        for (uint32_t i = r->first[k], end = i + r->places[k]; i < end && r->area + r->change <= most; i++)
            if (r->number[i] <= number) follow_for_change(c, r, i, most - r->area - r->change);
    }
    return r->area + r->change;
}

void qw_undo_strips(qw_env *env, const qw_complex *c, qw_strip_room *r, const uint32_t *face, uint32_t count)
{
    r->follow_count = r->change_count = 0, r->change = 0;
    if (r->is_laid_anew || !link_anew(c, r, face, count)) qw_count_strips(env, c, r);
    r->is_laid_anew = false;
}

uint32_t qw_list_strip(qw_strip_room *r, uint32_t place, uint32_t *list)
{
    uint32_t count = 0, number = ++r->numbers;
    r->number[place] = number, list[count++] = place;
    for (uint32_t way = 0; way < 2; way++)
        for (uint32_t a = 2 * place + way, b; (b = r->link[a].beyond) != QW_NONE && r->number[b / 2] != number;
             a = b ^ 1u)
            r->number[b / 2] = number, list[count++] = b / 2;
    return count;
}

uint32_t qw_component_of_place(const qw_complex *c, const qw_strip_room *r, uint32_t place)
{
    uint32_t low = 0, high = 2 * c->edge_count;
    while (high - low > 1) {
        uint32_t middle = (low + high) / 2;
        if (r->first[middle] <= place) low = middle;
        else high = middle;
    }
    return low;
}

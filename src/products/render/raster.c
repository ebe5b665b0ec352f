/* Triangles are filled row by row: each side bounds the row's span from the left or from the right. Wide ones leave out
 * tiles in which all that was drawn is nearer, so that thousands of large triangles behind one another cost little more
 * than those that can be seen. */
#include "products/render/raster.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { MOST_COLUMNS = 1024 };

/* How far spans reach over their ends, in samples: neighbours overlap a little rather than leave a crack. */
static const double overlap = 1e-4;

void raster_clear(raster *r, uint32_t top, uint32_t bottom)
{
    assert(top % RASTER_TILE_HEIGHT == 0 && bottom <= r->height && raster_columns(r) <= MOST_COLUMNS);
    size_t begin = (size_t)top * r->width, count = (size_t)(bottom - top) * r->width;
    uint32_t columns = raster_columns(r), first = top / RASTER_TILE_HEIGHT,
             last = (bottom + RASTER_TILE_HEIGHT - 1) / RASTER_TILE_HEIGHT;
    memset(r->row_depth + (size_t)top * columns, 0, (size_t)(bottom - top) * columns * sizeof *r->row_depth);
    memset(r->tile_depth + (size_t)first * columns, 0, (size_t)(last - first) * columns * sizeof *r->tile_depth);
    memset(r->depth + begin, 0, count * sizeof *r->depth);
    memset(r->id + begin, 0xff, count * sizeof *r->id);
}

static inline void put(raster *r, size_t at, float depth, uint32_t id)
{
    if (depth > r->depth[at]) {
        r->depth[at] = depth;
        r->id[at] = id;
    }
}

static float least_of(float a, float b, float c) { return fminf(fminf(a, b), c); }
static float most_of(float a, float b, float c) { return fmaxf(fmaxf(a, b), c); }

static inline float between(float low, float x, float high) { return x < low ? low : x > high ? high : x; }

/* The first index not before, and the first index past, a range of sample centres clipped to low..high. */
static uint32_t clip(double x, uint32_t low, uint32_t high)
{
    double i = ceil(x - 0.5);
    return i <= low ? low : i >= high ? high : (uint32_t)i;
}

/* Keeps the part of the span left..right at height y that is on the left of the line from a to b (in a frame with y
   down: inside, for corners whose doubled area is positive). */
static void clip_span(raster_point a, raster_point b, double y, double *left, double *right)
{
    double dx = (double)b.x - a.x, dy = (double)b.y - a.y, offset = dx * (y - a.y);
    if (dy == 0) {
        if (offset < -overlap * fabs(dx)) *right = -INFINITY;
        return;
    }
    double x = a.x + offset / dy; /* inside: dx (y - a.y) - dy (x - a.x) >= 0 */
    if (dy > 0) *right = fmin(*right, x + overlap);
    else *left = fmax(*left, x - overlap);
}

/* A triangle whose doubled area is positive, with its depth as an affine function of the sample. */
typedef struct shape {
    raster_point a, b, c;
    double slope_x, slope_y, left, right;
    float nearest, farthest;
    uint32_t id;
} shape;

/* A triangle ready to be drawn: turned to the front, slopes of its depth, its range; false: it has no area. */
static bool make_shape(raster_point a, raster_point b, raster_point c, uint32_t id, shape *s)
{
    double ux = (double)b.x - a.x, uy = (double)b.y - a.y, vx = (double)c.x - a.x, vy = (double)c.y - a.y,
           area = ux * vy - uy * vx;
    if (!(fabs(area) > 1e-9)) return false;
    *s = (shape){.a = a, .b = area < 0 ? c : b, .c = area < 0 ? b : c, .id = id};
    double u = (double)s->b.depth - a.depth, v = (double)s->c.depth - a.depth;
    ux = (double)s->b.x - a.x, uy = (double)s->b.y - a.y, vx = (double)s->c.x - a.x, vy = (double)s->c.y - a.y;
    s->slope_x = (u * vy - v * uy) / fabs(area), s->slope_y = (v * ux - u * vx) / fabs(area);
    s->nearest = most_of(a.depth, b.depth, c.depth), s->farthest = least_of(a.depth, b.depth, c.depth);
    s->left = least_of(a.x, b.x, c.x) - overlap, s->right = most_of(a.x, b.x, c.x) + overlap;
    return true;
}

static double depth_at(const shape *s, uint32_t i, double y)
{
    return s->a.depth + s->slope_x * (i + 0.5 - s->a.x) + s->slope_y * (y - s->a.y);
}

/* The samples i .. last - 1 of row j that the triangle covers. */
static void span_of(const raster *r, const shape *s, uint32_t j, uint32_t *i, uint32_t *last)
{
    double y = j + 0.5, left = s->left, right = s->right;
    clip_span(s->a, s->b, y, &left, &right);
    clip_span(s->b, s->c, y, &left, &right);
    clip_span(s->c, s->a, y, &left, &right);
    *i = *last = 0;
    if (left <= right) *i = clip(left, 0, r->width), *last = clip(right, 0, r->width);
}

static void fill_row(raster *r, const shape *s, uint32_t j, uint32_t i, uint32_t last)
{
    double depth = depth_at(s, i, j + 0.5);
    for (size_t at = (size_t)j * r->width + i; i < last; i++, at++, depth += s->slope_x)
        put(r, at, between(s->farthest, (float)depth, s->nearest), s->id);
}

/* Whether nothing of the triangle about a place, so far to each side of it, is nearer than a depth; with room for the
 * rounding. */
static bool is_behind(const shape *s, double x, double y, double half_x, double half_y, float depth)
{
    double most = s->a.depth + s->slope_x * (x - s->a.x) + s->slope_y * (y - s->a.y) + fabs(s->slope_x) * half_x +
                  fabs(s->slope_y) * half_y;
    return fmin(most, s->nearest) * (1 + 1e-6) < depth;
}

static float least_in(const raster *r, uint32_t j, uint32_t i, uint32_t last)
{
    float least = INFINITY;
    for (size_t at = (size_t)j * r->width + i; i < last; i++, at++) least = fminf(least, r->depth[at]);
    return least;
}

/* Fills the part of a row that lies in a tile's column; true where the least depth of all the tile's row is known anew.
 */
static bool fill_in_tile(raster *r, const shape *s, uint32_t j, uint32_t column, uint32_t i, uint32_t last)
{
    uint32_t begin = column * RASTER_TILE_WIDTH,
             end = r->width - begin < RASTER_TILE_WIDTH ? r->width : begin + RASTER_TILE_WIDTH;
    float *least = r->row_depth + (size_t)j * raster_columns(r) + column;
    if (i < begin) i = begin;
    if (last > end) last = end;
    if (i >= last) return false;
    double half = 0.5 * (last - i);
    if (is_behind(s, i + half, j + 0.5, half, 0, *least)) return false;
    fill_row(r, s, j, i, last);
    if (last - i < end - begin) return false;
    *least = least_in(r, j, begin, end);
    return true;
}

/* The rows from j to end, all of one row of tiles. */
static void fill_tiles(raster *r, const shape *s, uint32_t j, uint32_t end)
{
    assert(j < end && (end - 1) / RASTER_TILE_HEIGHT == j / RASTER_TILE_HEIGHT);
    uint8_t hidden[MOST_COLUMNS], changed[MOST_COLUMNS];
    uint32_t columns = raster_columns(r), row = j / RASTER_TILE_HEIGHT, first = clip(s->left, 0, r->width),
             last = clip(s->right, 0, r->width);
    if (first >= last) return;
    first /= RASTER_TILE_WIDTH, last = (last - 1) / RASTER_TILE_WIDTH;
    float *tile = r->tile_depth + (size_t)row * columns;
    double half_x = 0.5 * RASTER_TILE_WIDTH, half_y = 0.5 * RASTER_TILE_HEIGHT;
    bool any = false;
    for (uint32_t k = first; k <= last; k++) {
        hidden[k] = is_behind(s, (2 * k + 1) * half_x, (2 * row + 1) * half_y, half_x, half_y, tile[k]);
        changed[k] = 0, any |= !hidden[k];
    }
    for (; any && j < end; j++) {
        uint32_t i, past;
        span_of(r, s, j, &i, &past);
        for (uint32_t k = i / RASTER_TILE_WIDTH; i < past && k <= (past - 1) / RASTER_TILE_WIDTH; k++)
            if (!hidden[k]) changed[k] |= fill_in_tile(r, s, j, k, i, past);
    }
    for (uint32_t k = first; any && k <= last; k++) {
        if (!changed[k]) continue;
        tile[k] = INFINITY;
        for (uint32_t y = row * RASTER_TILE_HEIGHT; y < (row + 1) * RASTER_TILE_HEIGHT && y < r->height; y++)
            tile[k] = fminf(tile[k], r->row_depth[(size_t)y * columns + k]);
    }
}

void raster_triangle(raster *r, uint32_t top, uint32_t bottom, raster_point a, raster_point b, raster_point c,
                     uint32_t id)
{
    float low = least_of(a.y, b.y, c.y), high = most_of(a.y, b.y, c.y);
    shape s;
    if (high < (float)top || low > (float)bottom || !make_shape(a, b, c, id, &s)) return;
    uint32_t end = clip(high + overlap, top, bottom), j = clip(low - overlap, top, bottom);
    if (s.right - s.left < RASTER_TILE_WIDTH) {
        for (; j < end; j++) {
            uint32_t i, last;
            span_of(r, &s, j, &i, &last);
            fill_row(r, &s, j, i, last);
        }
        return;
    }
    while (j < end) {
        uint32_t next = (j / RASTER_TILE_HEIGHT + 1) * RASTER_TILE_HEIGHT;
        fill_tiles(r, &s, j, next < end ? next : end);
        j = next;
    }
}

void raster_ball(raster *r, uint32_t top, uint32_t bottom, raster_point centre, float radius, float samples_per_length,
                 uint32_t id)
{
    uint32_t end = clip(centre.y + radius, top, bottom), last = clip(centre.x + radius, 0, r->width);
    float distance = 1 / centre.depth;
    for (uint32_t j = clip(centre.y - radius, top, bottom); j < end; j++)
        for (uint32_t i = clip(centre.x - radius, 0, r->width); i < last; i++) {
            float dx = (float)i + 0.5f - centre.x, dy = (float)j + 0.5f - centre.y,
                  height2 = radius * radius - dx * dx - dy * dy;
            if (height2 > 0) put(r, (size_t)j * r->width + i, 1 / (distance - sqrtf(height2) / samples_per_length), id);
        }
}

/* Triangles are filled row by row: each side bounds the row's span from the left or from the right. */
#include "raster.h"

#include <math.h>
#include <string.h>

/* How far spans reach over their ends, in samples: neighbours overlap a little rather than leave a crack. */
static const double overlap = 1e-4;

void raster_clear(raster *r, uint32_t top, uint32_t bottom)
{
    size_t begin = (size_t)top * r->width, count = (size_t)(bottom - top) * r->width;
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

void raster_triangle(raster *r, uint32_t top, uint32_t bottom, raster_point a, raster_point b, raster_point c,
                     uint32_t id)
{
    float low = least_of(a.y, b.y, c.y), high = most_of(a.y, b.y, c.y);
    if (high < (float)top || low > (float)bottom) return;
    double ux = (double)b.x - a.x, uy = (double)b.y - a.y, vx = (double)c.x - a.x, vy = (double)c.y - a.y,
           area = ux * vy - uy * vx;
    if (!(fabs(area) > 1e-9)) return;
    if (area < 0) {
        raster_point t = b;
        b = c, c = t;
    }
    double u = (double)b.depth - a.depth, v = (double)c.depth - a.depth;
    ux = (double)b.x - a.x, uy = (double)b.y - a.y, vx = (double)c.x - a.x, vy = (double)c.y - a.y, area = fabs(area);
    double slope_x = (u * vy - v * uy) / area, slope_y = (v * ux - u * vx) / area;
    float nearest = most_of(a.depth, b.depth, c.depth), farthest = least_of(a.depth, b.depth, c.depth);
    double left_end = least_of(a.x, b.x, c.x) - overlap, right_end = most_of(a.x, b.x, c.x) + overlap;
    uint32_t end = clip(high + overlap, top, bottom);
    for (uint32_t j = clip(low - overlap, top, bottom); j < end; j++) {
        double y = j + 0.5, left = left_end, right = right_end;
        clip_span(a, b, y, &left, &right);
        clip_span(b, c, y, &left, &right);
        clip_span(c, a, y, &left, &right);
        if (!(left <= right)) continue;
        uint32_t i = clip(left, 0, r->width), last = clip(right, 0, r->width);
        double depth = a.depth + slope_x * (i + 0.5 - a.x) + slope_y * (y - a.y);
        for (size_t at = (size_t)j * r->width + i; i < last; i++, at++, depth += slope_x)
            put(r, at, between(farthest, (float)depth, nearest), id);
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

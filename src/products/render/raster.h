/* A z-buffer: which triangle or ball is in front at each sample, nothing about colours. */
#pragma once

#include <stdint.h>

#define RASTER_NOTHING UINT32_MAX

/* Sample (i, j) lies at (i + 0.5, j + 0.5), j downwards. */
typedef struct raster {
    uint32_t width, height;
    float *depth; /* float[height][width]: one over the distance along the view, larger in front; 0 where there is
                     nothing */
    uint32_t *id; /* uint32_t[height][width], RASTER_NOTHING where there is nothing */
    /* What lies no nearer than all of a row's or a tile's samples is hidden there; least depths, 0 where not known: */
    float *row_depth;  /* float[height][columns], of the samples of a row in a tile */
    float *tile_depth; /* float[rows][columns] */
} raster;

enum { RASTER_TILE_WIDTH = 64, RASTER_TILE_HEIGHT = 16 };

static inline uint32_t raster_columns(const raster *r) { return (r->width - 1) / RASTER_TILE_WIDTH + 1; }
static inline uint32_t raster_rows(const raster *r) { return (r->height - 1) / RASTER_TILE_HEIGHT + 1; }

/* Position in samples, and one over the distance: affine functions of the position stay affine over a triangle. */
typedef struct raster_point {
    float x, y, depth;
} raster_point;

/* All work on the rows top <= j < bottom only, so that bands of rows may be drawn by different threads; top is that of
   a tile, bottom too or the last row. Of equal depths the id that came first stays. */
void raster_clear(raster *r, uint32_t top, uint32_t bottom);
void raster_triangle(raster *r, uint32_t top, uint32_t bottom, raster_point a, raster_point b, raster_point c,
                     uint32_t id);
/* radius in samples. */
void raster_ball(raster *r, uint32_t top, uint32_t bottom, raster_point centre, float radius, float samples_per_length,
                 uint32_t id);

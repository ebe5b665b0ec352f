/* A sheet of quads on a sheet of triangles, with all that the last steps of relaxation want to know of them. */
#ifndef QW_TESTS_UNIT_BED_H
#define QW_TESTS_UNIT_BED_H

#include "unit_shapes.h"

#include "remesh/relax/flip_repair.h"

enum { BED = 12 };

typedef struct unit_bed {
    qw_trimesh surface;
    qw_quadmesh quads;
    uint32_t *begin, *around;
    qw_vec3 *ground, *position;
    float *size;
    qw_curve_binding curves;
} unit_bed;

/* A grid of quads with sides of 1 on a finer grid of triangles. */
static inline unit_bed unit_make_bed(qw_env *env)
{
    unit_bed b = {.surface = unit_grid(env, 2 * BED, 2 * BED, false, false),
                  .quads = unit_quads(env, BED, BED, false, false)};
    for (uint32_t v = 0; v < b.surface.vertex_count; v++)
        b.surface.position[v] = qw_v3((float)(v % (2 * BED + 1)) / 2, (float)(v / (2 * BED + 1)) / 2, 0);
    uint32_t n = b.quads.vertex_count, sides = 4 * b.quads.face_count;
    b.begin = QW_NEW_ZERO(env, uint32_t, (size_t)n + 2), b.around = QW_NEW(env, uint32_t, sides);
    for (uint32_t h = 0; h < sides; h++) b.begin[b.quads.corner[h] + 2]++;
    for (uint32_t v = 0; v < n; v++) b.begin[v + 2] += b.begin[v + 1];
    for (uint32_t h = 0; h < sides; h++) b.around[b.begin[b.quads.corner[h] + 1]++] = h;
    b.ground = QW_NEW_ZERO(env, qw_vec3, n), b.position = QW_NEW(env, qw_vec3, n), b.size = QW_NEW(env, float, n);
    for (uint32_t v = 0; v < n; v++) {
        b.position[v] = b.quads.position[v], b.size[v] = 1;
        if (b.quads.kind[v] == QW_VERTEX_FREE) b.ground[v] = qw_v3(0, 0, 1);
    }
    b.curves = qw_bind_curves(env, &b.quads, &b.surface, b.size, b.position);
    return b;
}

static inline float unit_least_corner(const unit_bed *b)
{
    float least = INFINITY;
    for (uint32_t h = 0; h < 4 * b->quads.face_count; h++) {
        qw_vec3 p = b->position[b->quads.corner[h]];
        qw_vec3 next = b->position[b->quads.corner[qw_quad_next(h)]],
                prev = b->position[b->quads.corner[qw_quad_prev(h)]];
        least = fminf(least, qw_cross(qw_sub(next, p), qw_sub(prev, p)).z);
    }
    return least;
}

static inline float unit_mean_edge(const unit_bed *b)
{
    float sum = 0;
    for (uint32_t h = 0; h < 4 * b->quads.face_count; h++)
        sum += qw_distance(b->position[b->quads.corner[h]], b->position[b->quads.corner[qw_quad_next(h)]]);
    return sum / (4 * (float)b->quads.face_count);
}

static inline uint32_t unit_bed_at(uint32_t x, uint32_t y) { return y * (BED + 1) + x; }

#endif

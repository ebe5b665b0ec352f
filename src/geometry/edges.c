#include "geometry/edges.h"

#include "base/sort.h"

#include <assert.h>

static inline uint32_t least(uint32_t a, uint32_t b) { return a < b ? a : b; }
static inline uint32_t most(uint32_t a, uint32_t b) { return a < b ? b : a; }

/* begin[v + 1] becomes the start of bucket v; filling the buckets then moves each start to its end, which is the next
 * one's start. */
static uint32_t *bucket_starts(qw_env *env, const uint32_t *corner, uint32_t face_count, uint32_t vertex_count)
{
    assert(vertex_count < QW_NONE - 1);
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)vertex_count + 2);
    for (uint32_t f = 0; f < face_count; f++) {
        const uint32_t *c = corner + 3 * (size_t)f;
        if (qw_repeats_vertex(c)) continue;
        for (int i = 0; i < 3; i++) begin[(size_t)least(c[i], c[(i + 1) % 3]) + 2]++;
    }
    for (size_t v = 1; v < (size_t)vertex_count + 2; v++) begin[v] += begin[v - 1];
    return begin;
}

static void sort_buckets(void *user, uint32_t block, uint32_t begin, uint32_t end)
{
    (void)block;
    const qw_edges *e = user;
    for (uint32_t v = begin; v < end; v++) qw_sort_u64(e->side + e->begin[v], e->begin[v + 1] - e->begin[v]);
}

qw_edges qw_edges_build(qw_env *env, const uint32_t *corner, uint32_t face_count, uint32_t vertex_count)
{
    assert(face_count < QW_NONE / 3 && vertex_count > 0);
    uint32_t *begin = bucket_starts(env, corner, face_count, vertex_count);
    uint64_t *side = QW_NEW(env, uint64_t, begin[(size_t)vertex_count + 1]);
    for (uint32_t f = 0; f < face_count; f++) {
        const uint32_t *c = corner + 3 * (size_t)f;
        if (qw_repeats_vertex(c)) continue;
        for (uint32_t i = 0; i < 3; i++) {
            uint32_t a = c[i], b = c[(i + 1) % 3];
            side[begin[(size_t)least(a, b) + 1]++] = (uint64_t)most(a, b) << 32 | (3 * f + i);
        }
    }
    qw_edges edges = {.begin = begin, .side = side};
    qw_parallel(env, vertex_count, 4096, sort_buckets, &edges);
    return edges;
}

void qw_edges_free(qw_env *env, qw_edges *edges)
{
    qw_free(env, edges->begin);
    qw_free(env, edges->side);
    *edges = (qw_edges){0};
}

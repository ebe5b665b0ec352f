#include "geometry/edges.h"

#include "base/sort.h"

#include <assert.h>
#include <string.h>

/* The edge of side i of a face as the key of its ends. */
static inline uint64_t ends_of(uint32_t sides, const uint32_t *c, uint32_t i)
{
    uint32_t a = c[i], b = c[i + 1 < sides ? i + 1 : 0];
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

static inline bool has_loop(uint32_t sides, const uint32_t *c)
{
    bool has = c[0] == c[sides - 1];
    for (uint32_t i = 1; i < sides; i++) has |= c[i] == c[i - 1];
    return has;
}

/* begin[v + 1] becomes the start of bucket v; filling the buckets then moves each start to its end, which is the next
 * one's start. */
static inline uint32_t *bucket_starts(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count,
                                      uint32_t vertex_count)
{
    uint32_t *begin = QW_NEW_ZERO(env, uint32_t, (size_t)vertex_count + 2);
    for (uint32_t f = 0; f < face_count; f++) {
        const uint32_t *c = corner + sides * (size_t)f;
        for (uint32_t i = 0; i < sides && !has_loop(sides, c); i++) begin[(ends_of(sides, c, i) >> 32) + 2]++;
    }
    for (size_t v = 1; v < (size_t)vertex_count + 2; v++) begin[v] += begin[v - 1];
    return begin;
}

static void sort_buckets(void *user, uint32_t begin, uint32_t end)
{
    const qw_edges *e = user;
    for (uint32_t v = begin; v < end; v++) qw_sort_u64(e->side + e->begin[v], e->begin[v + 1] - e->begin[v]);
}

/* Sorts all sides by the lower end of their edge, then by the upper one. */
static inline qw_edges build(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count,
                             uint32_t vertex_count)
{
    uint32_t *begin = bucket_starts(env, sides, corner, face_count, vertex_count);
    uint64_t *side = QW_NEW(env, uint64_t, begin[(size_t)vertex_count + 1]);
    for (uint32_t f = 0; f < face_count; f++) {
        const uint32_t *c = corner + sides * (size_t)f;
        for (uint32_t i = 0; i < sides && !has_loop(sides, c); i++) {
            uint64_t ends = ends_of(sides, c, i);
            side[begin[(ends >> 32) + 1]++] = ends << 32 | (sides * f + i);
        }
    }
    qw_edges edges = {.begin = begin, .side = side};
    qw_parallel(env, vertex_count, 4096, sort_buckets, &edges);
    return edges;
}

qw_edges qw_edges_build(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count, uint32_t vertex_count)
{
    assert((sides == 3 || sides == 4) && face_count < QW_NONE / sides && vertex_count < QW_NONE - 1);
    return sides == 3 ? build(env, 3, corner, face_count, vertex_count)
                      : build(env, 4, corner, face_count, vertex_count);
}

uint32_t *qw_find_twins(qw_env *env, uint32_t sides, const uint32_t *corner, uint32_t face_count, uint32_t vertex_count,
                        uint32_t *fault)
{
    uint32_t *twin = QW_NEW(env, uint32_t, sides * (size_t)face_count);
    memset(twin, 0xff, sides * (size_t)face_count * sizeof *twin);
    *fault = QW_NONE;
    qw_edges edges = qw_edges_build(env, sides, corner, face_count, vertex_count);
    for (uint32_t f = face_count; f-- > 0 && edges.begin[vertex_count] < sides * face_count;)
        if (has_loop(sides, corner + sides * (size_t)f)) *fault = sides * f;
    for (uint32_t v = 0; v < vertex_count; v++)
        for (uint32_t i = edges.begin[v], end; i < edges.begin[v + 1]; i = end) {
            end = qw_edge_end(&edges, i, edges.begin[v + 1]);
            uint32_t a = qw_side_half(edges.side[i]), b = end - i > 1 ? qw_side_half(edges.side[i + 1]) : QW_NONE;
            if (b == QW_NONE) continue;
            if (end - i > 2 || corner[a] == corner[b]) *fault = *fault == QW_NONE ? a : *fault;
            else twin[a] = b, twin[b] = a;
        }
    qw_edges_free(env, &edges);
    return twin;
}

void qw_edges_free(qw_env *env, qw_edges *edges)
{
    qw_free(env, edges->begin);
    qw_free(env, edges->side);
    *edges = (qw_edges){0};
}

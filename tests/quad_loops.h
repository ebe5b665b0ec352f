/* Loops of edges of a closed mesh of quads, which go straight on through vertices of four edges. */
#ifndef QW_TESTS_QUAD_LOOPS_H
#define QW_TESTS_QUAD_LOOPS_H

#include "quadwright/quadwright.h"

#include <stdlib.h>
#include <string.h>

static inline uint32_t next_of(uint32_t h) { return h % 4 == 3 ? h - 3 : h + 1; }

/* uint32_t[4 faces]: the half-edge that goes the other way; UINT32_MAX: none does. */
static inline uint32_t *twins_of(const qw_mesh_view *q)
{
    uint32_t sides = 4 * q->face_count, *twin = malloc(sides * sizeof *twin),
             *first = malloc(q->vertex_count * sizeof *first), *after = malloc(sides * sizeof *after);
    memset(first, 0xff, q->vertex_count * sizeof *first);
    for (uint32_t h = 0; h < sides; h++) after[h] = first[q->corners[h]], first[q->corners[h]] = h;
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t t = first[q->corners[next_of(h)]];
        while (t != UINT32_MAX && q->corners[next_of(t)] != q->corners[h]) t = after[t];
        twin[h] = t;
    }
    free(first), free(after);
    return twin;
}

static inline uint32_t valence_at_head(const uint32_t *twin, uint32_t h)
{
    uint32_t n = 0, at = h;
    do at = next_of(twin[at]), n++;
    while (at != h && n < 10);
    return n; /* of the tail of h */
}

/* The vertices of the loop that leaves along h, where it closes; returns how many, else 0. seen: uint8_t[4 faces], of
   half-edges that were walked along; loop: uint32_t[4 faces]. */
static inline uint32_t loop_from(const qw_mesh_view *q, const uint32_t *twin, uint32_t h, uint8_t *seen, uint32_t *loop)
{
    uint32_t at = h, count = 0;
    do {
        seen[at] = 1, loop[count++] = q->corners[at];
        uint32_t out = next_of(at); /* leaves the head */
        if (valence_at_head(twin, out) != 4) return 0;
        at = next_of(twin[out]);
    } while (at != h && count < 4 * q->face_count);
    return at == h ? count : 0;
}

/* How many closed loops are as wanted. */
typedef int (*loop_test)(const qw_mesh_view *q, const uint32_t *loop, uint32_t count, const void *user);
static inline uint32_t count_loops(const qw_mesh_view *q, loop_test is_wanted, const void *user)
{
    uint32_t *twin = twins_of(q), sides = 4 * q->face_count, *loop = malloc(sides * sizeof *loop), found = 0;
    uint8_t *seen = calloc(sides, 1);
    for (uint32_t h = 0; h < sides; h++) {
        uint32_t count = seen[h] ? 0 : loop_from(q, twin, h, seen, loop);
        found += count > 0 && is_wanted(q, loop, count, user);
    }
    free(twin), free(loop), free(seen);
    return found / 2; /* each walked both ways */
}

#endif

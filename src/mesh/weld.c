#include "mesh/weld.h"

#include <string.h>

/* A table of vertices with open addressing, filled in vertex order, so that the result never depends on the hash. */
typedef struct table {
    uint32_t *slot; /* uint32_t[mask + 1], QW_NONE where free */
    uint64_t mask;
} table;

static table new_table(qw_env *env, uint32_t entries)
{
    uint64_t size = 16;
    while (size < 2 * (uint64_t)entries) size *= 2;
    table t = {.slot = QW_NEW(env, uint32_t, size), .mask = size - 1};
    memset(t.slot, 0xff, size * sizeof(uint32_t));
    return t;
}

static inline uint64_t mix(uint64_t x)
{
    x ^= x >> 32;
    x *= 0x9e3779b97f4a7c15u;
    return x ^ x >> 29;
}

static inline uint64_t hash_position(const double *p)
{
    uint64_t h = 0;
    for (int k = 0; k < 3; k++) {
        double x = p[k] + 0.0; /* -0 becomes 0 */
        uint64_t bits;
        memcpy(&bits, &x, sizeof bits);
        h = mix(h + bits);
    }
    return mix(h);
}

static uint32_t find_or_add(table *t, const double *position, uint32_t v)
{
    const double *p = position + 3 * (size_t)v;
    for (uint64_t i = hash_position(p) & t->mask;; i = (i + 1) & t->mask) {
        uint32_t w = t->slot[i];
        if (w == QW_NONE) return t->slot[i] = v;
        const double *q = position + 3 * (size_t)w;
        if (p[0] == q[0] && p[1] == q[1] && p[2] == q[2]) return w;
    }
}

uint32_t qw_weld_equal(qw_env *env, const double *position, uint32_t vertex_count, const uint8_t *only, uint32_t *corner,
                       uint32_t face_count)
{
    uint32_t entries = 0, welded = 0;
    for (uint32_t v = 0; v < vertex_count; v++) entries += !only || only[v];
    qw_scope_begin(env);
    table t = new_table(env, entries);
    uint32_t *target = QW_NEW(env, uint32_t, vertex_count);
    for (uint32_t v = 0; v < vertex_count; v++) {
        target[v] = !only || only[v] ? find_or_add(&t, position, v) : v;
        welded += target[v] != v;
    }
    for (size_t h = 0; welded && h < 3 * (size_t)face_count; h++) corner[h] = target[corner[h]];
    qw_scope_end(env);
    return welded;
}

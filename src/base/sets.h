/* Disjoint sets as trees in an array, parent[i] = i at the roots; the lowest member is the root, so that names do not
 * depend on the order of joins. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

static inline void qw_sets_begin(uint32_t *parent, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) parent[i] = i;
}

static inline uint32_t qw_set_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
}

/* Returns whether two sets became one. */
static inline bool qw_join_sets(uint32_t *parent, uint32_t a, uint32_t b)
{
    a = qw_set_of(parent, a), b = qw_set_of(parent, b);
    parent[a > b ? a : b] = a > b ? b : a;
    return a != b;
}

/* Hashing: of numbers, places and bytes, and a table with open addressing. Numbers go in in ascending order and what is
 * looked up is compared, so that no result depends on a hash. */
#pragma once

#include "base/env.h"

/* One step of splitmix64. */
static inline uint64_t qw_mix(uint64_t x)
{
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

/* A number added to a hash; -0 is 0. */
uint64_t qw_hash_real(uint64_t hash, double x);
uint64_t qw_hash_place(const double p[3]);
static inline bool qw_is_one_place(const double p[3], const double q[3])
{
    return p[0] == q[0] && p[1] == q[1] && p[2] == q[2];
}

#define QW_HASH_BYTES UINT64_C(0xcbf29ce484222325) /* the hash of no bytes (Fowler, Noll and Vo) */
uint64_t qw_hash_bytes(uint64_t hash, const void *bytes, size_t size);

typedef struct qw_hash_table {
    uint32_t *slot; /* uint32_t[mask + 1]: a number, QW_NONE where free */
    size_t mask;
} qw_hash_table;

/* For so many numbers at most; in the current scope, to be freed by its slots. */
qw_hash_table qw_hash_table_create(qw_env *env, size_t numbers);

/* Whether a number of the table stands for what is looked up. */
typedef bool qw_is_same(const void *wanted, uint32_t number);

/* The slot of the number that is the same as what is wanted, or a free one, where such a number may be put. */
static inline uint32_t *qw_hash_slot(const qw_hash_table *t, uint64_t hash, qw_is_same *is_same, const void *wanted)
{
    size_t at = (size_t)(hash ^ hash >> 32) & t->mask;
    while (t->slot[at] != QW_NONE && !is_same(wanted, t->slot[at])) at = (at + 1) & t->mask;
    return &t->slot[at];
}

/* uint32_t[count]: the first vertex at the place of each. position: double[count][3]. only: uint8_t[count], vertices
 * that are looked at, the others have their own number; NULL: all. In the caller's scope. */
uint32_t *qw_find_places(qw_env *env, const double *position, uint32_t count, const uint8_t *only);

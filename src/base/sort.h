/* Sorting of plain integers: ascending, in place, without allocation, n log n at worst. Pack key and payload into one
 * number. */
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

enum { QW_SHORT_RUN = 24 }; /* items that are sorted faster by insertion */

void qw_sort_u64(uint64_t *item, size_t count);

/* Sorts, and leaves each once. Returns how many are left. */
size_t qw_sort_once(uint64_t *item, size_t count);

/* The first of sorted keys that is not below one; count: all are. */
static inline size_t qw_first_not_below(const uint64_t *sorted, size_t count, uint64_t key)
{
    size_t low = 0;
    while (low < count) {
        size_t middle = low + (count - low) / 2;
        if (sorted[middle] < key) low = middle + 1;
        else count = middle;
    }
    return low;
}

/* Keys of numbers that are not negative, in the same order as these. */
static inline uint32_t qw_float_key(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* Of any finite numbers. */
static inline uint32_t qw_signed_float_key(float x)
{
    uint32_t bits = qw_float_key(x + 0.0f);
    return bits >> 31 ? ~bits : bits | 0x80000000u;
}

/* One key for (a, b) and (b, a): that of an edge, by its vertices. */
static inline uint64_t qw_pair_key(uint32_t a, uint32_t b)
{
    return a < b ? (uint64_t)a << 32 | b : (uint64_t)b << 32 | a;
}

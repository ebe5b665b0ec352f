/* Binary numbers of either byte order, at any address. */
#pragma once

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

static inline uint64_t qw_fetch_bits(const char *at, int size, bool big)
{
    const unsigned char *p = (const unsigned char *)at;
    uint64_t bits = 0;
    for (int i = 0; i < size; i++) bits |= (uint64_t)p[i] << 8 * (big ? size - 1 - i : i);
    return bits;
}

static inline double qw_fetch_float(const char *at, bool big)
{
    uint32_t bits = (uint32_t)qw_fetch_bits(at, 4, big);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

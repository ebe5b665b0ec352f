/* Numbers as if drawn at random, the same on every run: the state is a seed that each test sets. */
#ifndef QW_TESTS_RANDOM_H
#define QW_TESTS_RANDOM_H

#include <stdint.h>

/* A linear congruential step (Knuth's MMIX): the upper bits are the better ones. */
static inline uint64_t random_step(uint64_t *state)
{
    return *state = *state * 6364136223846793005u + 1442695040888963407u;
}

/* Marsaglia's xorshift, for a state other than 0: all bits are good. */
static inline uint64_t random_bits(uint64_t *state)
{
    *state ^= *state << 13, *state ^= *state >> 7;
    return *state ^= *state << 17;
}

#endif

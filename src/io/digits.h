/* Decimal digits, eight at a time in one word: without a loop there is nothing for the processor to guess wrong where a
 * number ends. */
#pragma once

#include <stdint.h>
#include <string.h>

enum { QW_DIGITS_AT_ONCE = 8 };

/* How many digits begin at `at`, eight at most, and their value. So many bytes are read, whatever they are. */
static inline uint32_t qw_digits(const char *at, uint64_t *value)
{
    uint64_t word;
    memcpy(&word, at, sizeof word);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    word = __builtin_bswap64(word);
#endif
    /* 0 to 9 in the bytes that are digits. Adding 0x76 sets the top bit of a byte from ten to 0x89, and carries above
     * that only into later ones. */
    word ^= 0x3030303030303030u;
    uint64_t others = (word | (word + 0x7676767676767676u)) & 0x8080808080808080u;
    uint32_t count = others ? (uint32_t)__builtin_ctzll(others) / 8 : QW_DIGITS_AT_ONCE;
    if (count == 0) {
        *value = 0;
        return 0;
    }
    word <<= 64 - 8 * count;        /* zeros in front, what follows the digits falls off */
    word = word * 10 + (word >> 8); /* every second byte: two digits */
    *value = ((word & 0x000000ff000000ffu) * (100 + ((uint64_t)1000000 << 32)) +
              (word >> 16 & 0x000000ff000000ffu) * (1 + ((uint64_t)10000 << 32))) >>
             32;
    return count;
}

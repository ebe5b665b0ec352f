#include "base/printable.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

enum { ESCAPE_SIZE = 4 }; /* \xNN */

/* The Unicode value of a well-formed sequence, or -1: overlong forms, surrogates and values past U+10FFFF are none. */
static long decode(const unsigned char *text, size_t size)
{
    static const long least[5] = {0, 0, 0x80, 0x800, 0x10000};
    long value = size == 1 ? text[0] : text[0] & (0x7f >> size);
    for (size_t i = 1; i < size; i++) {
        if ((text[i] & 0xc0) != 0x80) return -1;
        value = value << 6 | (text[i] & 0x3f);
    }
    bool surrogate = value >= 0xd800 && value <= 0xdfff;
    return value < least[size] || value > 0x10ffff || surrogate ? -1 : value;
}

size_t qw_utf8_size(const char *text)
{
    const unsigned char *at = (const unsigned char *)text;
    size_t size = at[0] < 0x80 ? 1 : at[0] < 0xc0 ? 0 : at[0] < 0xe0 ? 2 : at[0] < 0xf0 ? 3 : at[0] < 0xf8 ? 4 : 0;
    return size > 0 && decode(at, size) >= 0 ? size : 0;
}

bool qw_is_control(const char *text, size_t size)
{
    long value = decode((const unsigned char *)text, size);
    return value < 0x20 || (value >= 0x7f && value < 0xa0);
}

bool qw_is_printable(const char *text)
{
    for (size_t size; *text; text += size) {
        size = qw_utf8_size(text);
        if (size == 0 || qw_is_control(text, size)) return false;
    }
    return true;
}

size_t qw_printable(char *to, size_t size, const char *text)
{
    assert(size > 0);
    size_t used = 0;
    while (*text) {
        size_t bytes = qw_utf8_size(text), taken = bytes > 0 ? bytes : 1;
        bool as_it_is = bytes > 0 && !qw_is_control(text, bytes);
        size_t needed = as_it_is ? bytes : ESCAPE_SIZE * taken;
        if (needed >= size - used) break;
        if (as_it_is) memcpy(to + used, text, bytes);
        for (size_t i = 0; i < taken && !as_it_is; i++) {
            char escape[ESCAPE_SIZE + 1];
            snprintf(escape, sizeof escape, "\\x%02x", (unsigned)(unsigned char)text[i]);
            memcpy(to + used + ESCAPE_SIZE * i, escape, ESCAPE_SIZE);
        }
        used += needed;
        text += taken;
    }
    to[used] = 0;
    return used;
}

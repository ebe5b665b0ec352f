/* Decimal to binary and back.
 *
 * Reading gathers up to 19 digits w and a power of ten e, so that the value is w 10^e. Where w and 10^|e| are doubles,
 * one operation rounds correctly (Clinger 1990). Otherwise, for |e| <= 27, 5^|e| fits 64 bits: the exact 128-bit
 * product, or a 64-bit quotient and its remainder, is rounded by hand; powers of two only move the exponent. What is
 * left (far exponents, more digits than decide the matter) goes to strtod as an integer with an exponent, since only
 * the decimal point depends on the locale.
 *
 * Printing makes 17 digits by the same product, rounds them to 15 and 16, and takes the first that reads back. Every
 * decimal of up to 15 digits survives the way to a double and back, so numbers that were short in the input stay short.
 */
#include "io/number.h"

#include "io/digits.h"

#include <assert.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    MAX_POWER5 = 27,           /* 5^27 < 2^64 */
    MAX_WORD_DIGITS = 19,      /* 10^19 < 2^64 */
    HALF_DIGITS = 9,           /* of a printed number, which has at most 18 */
    MAX_DECIDING_DIGITS = 800, /* a midpoint between two doubles has at most 767 digits */
    MAX_EXPONENT = 100000 /* beyond this every number is zero or infinite, however many digits it has in a buffer */
};

static const uint64_t power5[MAX_POWER5 + 1] = {1u,
                                                5u,
                                                25u,
                                                125u,
                                                625u,
                                                3125u,
                                                15625u,
                                                78125u,
                                                390625u,
                                                1953125u,
                                                9765625u,
                                                48828125u,
                                                244140625u,
                                                1220703125u,
                                                6103515625u,
                                                30517578125u,
                                                152587890625u,
                                                762939453125u,
                                                3814697265625u,
                                                19073486328125u,
                                                95367431640625u,
                                                476837158203125u,
                                                2384185791015625u,
                                                11920928955078125u,
                                                59604644775390625u,
                                                298023223876953125u,
                                                1490116119384765625u,
                                                7450580596923828125u};

/* The powers of ten that are doubles. */
static const double power10[23] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                   1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

typedef struct wide {
    uint64_t high, low;
} wide;

static wide multiply(uint64_t a, uint64_t b)
{
    uint64_t a0 = (uint32_t)a, a1 = a >> 32, b0 = (uint32_t)b, b1 = b >> 32;
    uint64_t low = a0 * b0, middle = a1 * b0 + (low >> 32), other = a0 * b1 + (uint32_t)middle;
    return (wide){a1 * b1 + (middle >> 32) + (other >> 32), other << 32 | (uint32_t)low};
}

/* One 32-bit digit of a quotient by schoolbook division: the rest, below d, is brought down by the digit `next`. */
static uint64_t quotient_digit(uint64_t *rest, uint64_t next, uint64_t d)
{
    uint64_t high = d >> 32, low = (uint32_t)d;
    uint64_t q = *rest / high;
    if (q > UINT32_MAX) q = UINT32_MAX;
    uint64_t left = *rest - q * high; /* q is too large by at most 2, as the top bit of d is set */
    while (left <= UINT32_MAX && q * low > (left << 32 | next)) {
        q--;
        left += high;
    }
    *rest = (*rest << 32 | next) - q * d; /* modulo 2^64: the true rest is below d */
    return q;
}

/* n / d where n.high < d and the top bit of d is set. */
static uint64_t divide(wide n, uint64_t d, bool *inexact)
{
    uint64_t rest = n.high;
    uint64_t q = quotient_digit(&rest, n.low >> 32, d);
    q = q << 32 | quotient_digit(&rest, (uint32_t)n.low, d);
    *inexact = rest != 0;
    return q;
}

/* m 2^exponent, and a little more if inexact, to the nearest double. The top bit of m is set; the result is a normal
 * number. */
static double round_to_double(uint64_t m, bool inexact, int exponent)
{
    uint64_t kept = m >> 11, cut = m & 0x7ff;
    if (cut > 0x400 || (cut == 0x400 && (inexact || (kept & 1)))) kept++;
    /* the leading bit of kept adds one to the exponent field, a carry out of the mantissa one more */
    uint64_t bits = ((uint64_t)(exponent + 11 + 52 + 1022) << 52) + kept;
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* w 10^exponent, if that is within reach of 128 bits. */
static bool from_decimal(uint64_t w, int64_t exponent, double *value)
{
    if (w <= (uint64_t)1 << 53 && exponent >= -22 && exponent <= 22) {
        *value = exponent < 0 ? (double)w / power10[-exponent] : (double)w * power10[exponent];
        return true;
    }
    if (w == 0 || exponent < -MAX_POWER5 || exponent > MAX_POWER5) return false;
    int up = __builtin_clzll(w), e = (int)exponent;
    uint64_t top = w << up;
    if (e >= 0) {
        wide p = multiply(top, power5[e]);
        int shift = p.high ? __builtin_clzll(p.high) : 64;
        uint64_t m = shift == 64 ? p.low : shift == 0 ? p.high : p.high << shift | p.low >> (64 - shift);
        bool inexact = shift != 64 && (shift == 0 ? p.low : p.low << shift) != 0;
        *value = round_to_double(m, inexact, 64 - shift + e - up);
        return true;
    }
    uint64_t d = power5[-e];
    int down = __builtin_clzll(d);
    d <<= down;
    bool inexact, half = top >= d;
    wide n = half ? (wide){top >> 1, top << 63} : (wide){top, 0};
    uint64_t q = divide(n, d, &inexact);
    *value = round_to_double(q, inexact, half - 64 + e + down - up);
    return true;
}

static bool is_digit(char c) { return (unsigned char)(c - '0') < 10; }

/* The digits between begin and end, with a point perhaps, times 10^exponent; the last digit's place is 10^exponent. */
static double read_long(const char *begin, const char *end, int64_t exponent)
{
    char digits[MAX_DECIDING_DIGITS + 32];
    int count = 0;
    int64_t dropped = 0;
    bool lost = false;
    for (const char *p = begin; p < end; p++) {
        if (*p == '.' || (count == 0 && *p == '0')) continue;
        if (count < MAX_DECIDING_DIGITS) {
            digits[count++] = *p;
        } else {
            dropped++;
            lost |= *p != '0';
        }
    }
    if (count == 0) return 0.0;
    uint64_t w = 0;
    int used = count < MAX_WORD_DIGITS ? count : MAX_WORD_DIGITS;
    for (int i = 0; i < used; i++) w = w * 10 + (uint64_t)(digits[i] - '0');
    double least, most;
    int64_t cut = exponent + dropped + count - used;
    if (from_decimal(w, cut, &least)) {
        if (used == count) return least;
        if (from_decimal(w + 1, cut, &most) && least == most) return least;
    }
    exponent += dropped;
    if (lost) { /* whatever was cut off, it is above the digits kept */
        digits[count++] = '1';
        exponent--;
    }
    if (exponent > MAX_EXPONENT) exponent = MAX_EXPONENT;
    if (exponent < -MAX_EXPONENT) exponent = -MAX_EXPONENT;
    snprintf(digits + count, sizeof digits - (size_t)count, "e%d", (int)exponent);
    return strtod(digits, NULL);
}

static bool starts_with(const char *at, const char *lower)
{
    while (*lower && (*at | 0x20) == *lower) at++, lower++;
    return *lower == 0;
}

/* "nan", "inf", "infinity", and as older Windows programs print them: "1.#INF", "1.#IND00", "1.#QNAN". at is past the
 * sign. */
static bool read_special(const char **at, double *value)
{
    const char *p = *at;
    if (starts_with(p, "infinity")) {
        p += 8;
    } else if (starts_with(p, "inf") || starts_with(p, "nan")) {
        p += 3;
    } else if (p[0] == '1' && p[1] == '.' && p[2] == '#' && (p[3] == 'I' || p[3] == 'Q' || p[3] == 'S')) {
        p += 4;
        while ((*p >= 'A' && *p <= 'Z') || is_digit(*p)) p++;
    } else {
        return false;
    }
    *value = (p[-1] | 0x20) == 'n' ? (double)NAN : (double)INFINITY;
    *at = p;
    return true;
}

/* The exponent at *at, which moves behind it; 0, and *at stays, where there is none. */
static int64_t read_exponent(const char **at)
{
    const char *p = *at;
    if ((*p | 0x20) != 'e') return 0;
    bool negative = *++p == '-';
    if (*p == '-' || *p == '+') p++;
    if (!is_digit(*p)) return 0; /* left where it is, so that "1e" is no number followed by a blank */
    int64_t exponent = 0;
    for (; is_digit(*p); p++)
        if (exponent < INT32_MAX) exponent = exponent * 10 + (*p - '0');
    *at = p;
    return negative ? -exponent : exponent;
}

/* Appends the digits at at to *w, modulo 2^64; returns where they end. */
static inline const char *gather(const char *at, uint64_t *w)
{
    static const uint64_t power[QW_DIGITS_AT_ONCE + 1] = {1,      10,      100,      1000,     10000,
                                                          100000, 1000000, 10000000, 100000000};
    uint32_t count;
    do {
        uint64_t value;
        count = qw_digits(at, &value);
        *w = *w * power[count] + value;
        at += count;
    } while (count == QW_DIGITS_AT_ONCE);
    return at;
}

/* What nearly all numbers are: at most seven digits, and perhaps a point and at most seven more. False, and nothing
 * moved, for all others. */
static inline bool read_plain(const char **at, double *value)
{
    static const double power[QW_DIGITS_AT_ONCE] = {1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7};
    const char *p = *at + (**at == '-');
    uint64_t whole, part = 0;
    uint32_t digits = qw_digits(p, &whole), places = 0;
    if (digits == 0 || digits == QW_DIGITS_AT_ONCE) return false;
    p += digits;
    if (*p == '.') {
        places = qw_digits(++p, &part);
        p += places;
    }
    if (places == QW_DIGITS_AT_ONCE || (*p | 0x20) == 'e' || *p == '#')
        return false; /* see read_special for the last */
    double v = ((double)whole * power[places] + (double)part) /
               power[places]; /* both are whole and below 2^53: rounded once */
    *value = **at == '-' ? -v : v;
    *at = p;
    return true;
}

bool qw_number_read(const char **at, double *value)
{
    if (read_plain(at, value)) return true;
    bool negative = **at == '-';
    const char *begin = *at + (**at == '-' || **at == '+');
    uint64_t w = 0;
    const char *p = gather(begin, &w);
    ptrdiff_t digits = p - begin;
    int64_t exponent = 0;
    if (*p == '.') {
        const char *point = p;
        p = gather(p + 1, &w);
        exponent = point + 1 - p;
        digits -= exponent;
    }
    if (digits == 0 || (p[-1] == '.' && *p == '#')) {
        const char *special = begin;
        if (read_special(&special, value)) {
            if (negative) *value = -*value;
            *at = special;
            return true;
        }
        if (digits == 0) return false;
    }
    const char *end = p;
    exponent += read_exponent(&p);
    double v;
    if (digits > MAX_WORD_DIGITS || !from_decimal(w, exponent, &v)) v = read_long(begin, end, exponent);
    *value = negative ? -v : v;
    *at = p;
    return true;
}

/* Rounds |value| to 17 digits: value = digits 10^(exponent - 16). */
static uint64_t seventeen_digits(double value, int *exponent)
{
    const uint64_t least = 10000000000000000u, hidden = (uint64_t)1 << 52;
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint64_t m = hidden |
                 (bits & (hidden - 1)); /* value = m 2^e2, but for subnormal numbers, which are out of reach below */
    int e2 = (int)(bits >> 52 & 0x7ff) - 1075;
    int e10 = (e2 + 52) * 78913 >> 18; /* log10(2) 2^18: of the power of two below value, right or one too low */
    for (;; e10++) {
        int k = 16 - e10;
        if (k < 0 || k > MAX_POWER5) break;
        wide p = multiply(m, power5[k]);
        int shift = -(e2 + k);
        if (shift <= 0) {
            p.low <<= -shift; /* below 10^17, or there would be fewer places */
        } else {
            uint64_t half = (uint64_t)1 << ((shift - 1) & 63);
            wide sum = {p.high, p.low + (shift <= 64 ? half : 0)};
            sum.high += sum.low < p.low;
            if (shift > 64) sum.high += half;
            p.low = shift < 64 ? sum.low >> shift | sum.high << (64 - shift) : sum.high >> (shift - 64);
        }
        if (p.low >= 10 * least) continue;
        *exponent = e10;
        return p.low;
    }
    char text[64];
    snprintf(text, sizeof text, "%.16e", value);
    uint64_t digits = (uint64_t)(text[0] - '0');
    const char *p = text + 1;
    while (!is_digit(*p)) p++; /* the locale's point */
    for (; is_digit(*p); p++) digits = digits * 10 + (uint64_t)(*p - '0');
    *exponent = (int)strtol(p + 1, NULL, 10);
    return digits;
}

static bool reads_back(uint64_t digits, int exponent, double value)
{
    double v;
    if (from_decimal(digits, exponent, &v)) return v == value;
    char text[48];
    snprintf(text, sizeof text, "%llue%d", (unsigned long long)digits, exponent);
    return strtod(text, NULL) == value;
}

static size_t put_exponent(char *out, int exponent) { return (size_t)snprintf(out, 8, "e%d", exponent); }

/* 0.d1d2d3... 10^places, digits without trailing zeros. */
static size_t layout(char *out, const char *digits, int count, int places)
{
    char *p = out;
    if (places > 0 && places <= 17) {
        for (int i = 0; i < places || i < count; i++) {
            if (i == places) *p++ = '.';
            *p++ = i < count ? digits[i] : '0';
        }
        return (size_t)(p - out);
    }
    if (places <= 0 && places > -5) {
        *p++ = '0';
        *p++ = '.';
        for (int i = places; i < 0; i++) *p++ = '0';
        memcpy(p, digits, (size_t)count);
        return (size_t)(p - out) + (size_t)count;
    }
    *p++ = digits[0];
    if (count > 1) {
        *p++ = '.';
        memcpy(p, digits + 1, (size_t)(count - 1));
        p += count - 1;
    }
    return (size_t)(p - out) + put_exponent(p, places - 1);
}

size_t qw_number_print(char out[QW_NUMBER_SIZE], double value)
{
    assert(isfinite(value));
    char *p = out;
    if (signbit(value)) *p++ = '-';
    value = fabs(value);
    if (value == 0) {
        *p++ = '0';
        return (size_t)(p - out);
    }
    int exponent, count = 17;
    uint64_t w = seventeen_digits(value, &exponent);
    uint64_t fifteen = (w + 50) / 100, sixteen = (w + 5) / 10,
             other = (w + 4) / 10; /* a last digit 5 may itself be rounded up */
    if (reads_back(fifteen, exponent - 14, value)) {
        w = fifteen;
        count = 15;
    } else if (reads_back(sixteen, exponent - 15, value)) {
        w = sixteen;
        count = 16;
    } else if (other != sixteen && reads_back(other, exponent - 15, value)) {
        w = other;
        count = 16;
    }
    char digits[2 * HALF_DIGITS];     /* with zeros before them */
    const uint64_t half = 1000000000; /* 10^HALF_DIGITS */
    uint32_t high = (uint32_t)(w / half), low = (uint32_t)(w % half);
    for (int i = HALF_DIGITS; i-- > 0; high /= 10, low /= 10) {
        digits[i] = (char)('0' + high % 10);
        digits[HALF_DIGITS + i] = (char)('0' + low % 10);
    }
    const char *first = digits;
    while (*first == '0') first++;
    int used = (int)(digits + sizeof digits - first);
    int places = exponent + 1 + used - count; /* rounding 99.9... up made one digit more */
    while (first[used - 1] == '0') used--;
    return (size_t)(p - out) + layout(p, first, used, places);
}

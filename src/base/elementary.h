/* Elementary functions with the same bits on every machine. The C library's differ between platforms, and within one
 * between processors, in the last bit, and a last bit can tip an integer. These use + - * / and the square root only,
 * each of which IEEE 754 defines to the bit, in double precision and in a written order. They round to nearest, as
 * every thread begins.
 *
 * The errors are in units of the last place of the result, as measured by tests/test_elementary.c over the ranges in
 * use. Special values are those of C's Annex F, unless said otherwise. */
#pragma once

#include <float.h>
#include <math.h>
#include <stdint.h>

_Static_assert(FLT_EVAL_METHOD == 0, "intermediate results must be as precise as their types: on 32-bit x86, use SSE2");
#ifdef __FAST_MATH__
#error "fast mathematics changes the results"
#endif

#define QW_PI 3.14159265358979323846

/* Below 1 unit up to |x| = 1,000. From 2^20 on the argument is first reduced by 2 pi as a double holds it, so that
   nothing is left of the accuracy, though still of the repeatability. */
double qw_sin(double x);
double qw_cos(double x);
double qw_atan2(double y, double x); /* below 3 units */
double qw_acos(double x);            /* below 4 units */
/* The angle of a sine and a cosine whose squares add up to 1, in [-pi, pi], to 1e-8 of itself: small ones, as those
   between most faces, by the series of the inverse sine. */
static inline double qw_angle_of(double sine, double cosine)
{
    double s2 = sine * sine;
    if (!(cosine > 0 && s2 < 0.015625)) return qw_atan2(sine, cosine);
    return sine * (1 + s2 * (1.0 / 6 + s2 * (3.0 / 40 + s2 * (15.0 / 336))));
}
double qw_ln(double x);  /* below 1 unit; the natural logarithm */
double qw_exp(double x); /* below 1 unit */
/* exp(exponent ln(base)): below 2 (1 + |exponent ln(base)|) units. NaN below a base of 0; infinite arguments are not
   those of Annex F. */
double qw_pow(double base, double exponent);
/* x less the whole multiple of y > 0 that is nearest to it, the even one of two. Exact. */
double qw_remainder(double x, double y);

/* Whole numbers, exact as the C library's of like names, which are calls where the processor at hand need not have the
   instruction. qw_round_even is rint: ties to even. qw_round_away: ties away from 0. */
static const double QW_ALL_WHOLE = 4503599627370496.0; /* 2^52, from which on a double has no fraction */

static inline double qw_round_even(double x)
{
    double a = fabs(x);
    return a < QW_ALL_WHOLE ? copysign((a + QW_ALL_WHOLE) - QW_ALL_WHOLE, x) : x;
}
static inline double qw_floor(double x)
{
    if (!(fabs(x) < QW_ALL_WHOLE)) return x;
    double whole = (double)(int64_t)x;
    return whole > x ? whole - 1 : copysign(whole, x);
}
static inline double qw_ceil(double x) { return -qw_floor(-x); }
/* Fractional parts of the multiples of these fill a square evenly (Roberts 2018); folded, the triangle u + v <= 1. */
static const double QW_ROBERTS[2] = {0.7548776662466927, 0.5698402909980532};
static inline void qw_spread_in_triangle(uint32_t i, double *u, double *v)
{
    *u = QW_ROBERTS[0] * i, *v = QW_ROBERTS[1] * i;
    *u -= qw_floor(*u), *v -= qw_floor(*v);
    if (*u + *v > 1) *u = 1 - *u, *v = 1 - *v;
}
static inline double qw_round_away(double x)
{
    double a = fabs(x), whole = qw_floor(a);
    return copysign(a - whole >= 0.5 ? whole + 1 : whole, x);
}

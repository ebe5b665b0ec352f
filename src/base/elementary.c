/* Each function is brought to a small range by an exact step, and there is its first terms and a polynomial: a minimax
 * fit that tools/derive-polynomials computes, with its error far below a unit of the last place. */
#include "base/elementary.h"

#include <assert.h>
#include <stdbool.h>
#include <string.h>

/* sin(r) = r + r^3 SIN(r^2) and cos(r) = 1 - r^2 / 2 + r^4 COS(r^2) up to pi / 4,
   atan(t) = t + t^3 ATAN(t^2) up to tan(pi / 8),
   ln((1 + s) / (1 - s)) = 2 s + 2 s^3 LN(s^2) up to 3 - sqrt(8), which is ln of sqrt(1/2) to sqrt(2),
   exp(r) = 1 + r + r^2 EXP(r) up to ln(2) / 2. */
static const double SIN[] = {-0x1.5555555555548p-3, 0x1.111111110f7b0p-7,   -0x1.a01a019bf9c40p-13,
                             0x1.71de356410341p-19, -0x1.ae5e5784ac8f6p-26, 0x1.5d8ee815271d7p-33};
static const double COS[] = {0x1.555555555554bp-5,   -0x1.6c16c16c14f6ep-10, 0x1.a01a019c80bcbp-16,
                             -0x1.27e4f7e81ea67p-22, 0x1.1ee9d5dc6c69dp-29,  -0x1.8fa39f86e2682p-37};
static const double ATAN[] = {-0x1.555555555553dp-2, 0x1.99999999957c1p-3, -0x1.24924922a9f6bp-3, 0x1.c71c70e4e90edp-4,
                              -0x1.745cf8bf00f8fp-4, 0x1.3b111741fd24bp-4, -0x1.10eba4efc6591p-4, 0x1.df0e4634d740ap-5,
                              -0x1.9cce71a98de85p-5, 0x1.37cb60e83cb5ap-5, -0x1.255514b6a7bd9p-6};
static const double LN[] = {0x1.5555555555592p-2, 0x1.999999997febfp-3, 0x1.24924941e3ddcp-3, 0x1.c71c521337881p-4,
                            0x1.74663d0db388cp-4, 0x1.39a1e6c6181e6p-4, 0x1.2f03c9a6f816cp-4};
static const double EXP[] = {0x1.000000000000ap-1,  0x1.55555555554f8p-3,  0x1.55555555507fbp-5,  0x1.1111111128054p-7,
                             0x1.6c16c1844a107p-10, 0x1.a01a01294695fp-13, 0x1.a01999aea4617p-16, 0x1.71df26da80e7bp-19,
                             0x1.28adce7d23eebp-22, 0x1.ad7e3ee191f30p-26};

/* pi / 2, ln(2) and pi as sums. The first ones have few bits, so that their products with whole numbers are exact. */
static const double HALF_PI_PARTS[] = {0x1.921fb54400000p+0, 0x1.0b4611a600000p-34, 0x1.3198a2e037073p-69};
static const double LN2_PARTS[] = {0x1.62e42fefa3800p-1, 0x1.ef35793c76730p-45};
static const double PI_PARTS[] = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};

static const double MOST_ANGLE = 1048576;            /* times 2 / pi below 2^20, which with 33 bits is 53 */
static const double TAN_EIGHTH = 0.4142135623730951; /* of pi / 8 */

enum { FRACTION_BITS = 52, BIAS = 1023, MOST_EXPONENT = 1023, LEAST_EXPONENT = -1022 };

static double polynomial(const double *c, int degree, double x)
{
    double sum = c[degree];
    while (degree-- > 0) sum = sum * x + c[degree];
    return sum;
}
#define POLYNOMIAL(c, x) polynomial(c, (int)(sizeof(c) / sizeof *(c)) - 1, x)

static double power_of_two(int e)
{
    assert(e >= LEAST_EXPONENT && e <= MOST_EXPONENT);
    uint64_t bits = (uint64_t)(e + BIAS) << FRACTION_BITS;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* x = mantissa 2^exponent, mantissa from 1 to 2, for a normal number above 0. */
static double mantissa_of(double x, int *exponent)
{
    uint64_t bits, fraction = ((uint64_t)1 << FRACTION_BITS) - 1;
    memcpy(&bits, &x, sizeof bits);
    *exponent = (int)(bits >> FRACTION_BITS) - BIAS;
    bits = (bits & fraction) | (uint64_t)BIAS << FRACTION_BITS;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* ---- sine and cosine */

/* high + low = a - b to twice the precision (Knuth's TwoSum). */
static double difference(double a, double b, double *low)
{
    double high = a - b, back = high - a;
    *low = (a - (high - back)) - (b + back);
    return high;
}

/* x = quadrant pi / 2 + high + low, in parts of pi / 2 (Cody and Waite). */
static double reduce(double x, double *low, unsigned *quadrant)
{
    if (fabs(x) >= MOST_ANGLE) x = qw_remainder(x, 2 * PI_PARTS[0]);
    double k = qw_round_even(x * (1 / 1.5707963267948966)), below, high;
    high = difference(x - k * HALF_PI_PARTS[0], k * HALF_PI_PARTS[1], low);
    high = difference(high, k * HALF_PI_PARTS[2], &below);
    *low += below;
    *quadrant = (unsigned)(int32_t)k & 3u;
    return high;
}

static double sine(double r, double low)
{
    double u = r * r;
    return r + (u * r * POLYNOMIAL(SIN, u) + low * (1 - 0.5 * u));
}

static double cosine(double r, double low)
{
    double u = r * r, half = 0.5 * u, one = 1 - half;
    return one + (((1 - one) - half) + (u * u * POLYNOMIAL(COS, u) - r * low));
}

static double wave(double x, unsigned shift)
{
    if (!isfinite(x)) return NAN;
    double low;
    unsigned quadrant;
    double r = reduce(x, &low, &quadrant);
    quadrant += shift;
    double y = quadrant & 1u ? cosine(r, low) : sine(r, low);
    return quadrant & 2u ? -y : y;
}

double qw_sin(double x) { return x == 0 ? x : wave(x, 0); }
double qw_cos(double x) { return wave(x, 1); }

double qw_remainder(double x, double y)
{
    if (!isfinite(x) || !(y > 0)) return NAN;
    if (isinf(y)) return x;
    double r = fabs(x), step = y;
    while (step <= r / 2) step *= 2;
    bool odd = false;
    for (; step >= y; step /= 2) { /* r < 2 step, so that each difference is exact */
        odd = r >= step && step <= y;
        if (r >= step) r -= step;
    }
    if (r > y - r || (odd && r == y - r)) r -= y;
    return copysign(1, x) * r;
}

/* ---- the inverse functions */

double qw_atan2(double y, double x)
{
    if (isnan(x) || isnan(y)) return x + y;
    double ax = fabs(x), ay = fabs(y);
    bool steep = ay > ax;
    double small = steep ? ax : ay, large = steep ? ay : ax;
    if (isinf(small)) small = large = 1;
    if (large > 0x1p1000) small *= 0x1p-1000, large *= 0x1p-1000;
    bool middle = small > TAN_EIGHTH * large; /* then as the angle to the diagonal */
    double t = large == 0 ? 0 : middle ? (small - large) / (small + large) : small / large, u = t * t;
    double angle = t + t * u * POLYNOMIAL(ATAN, u);
    if (middle) angle = 0.25 * PI_PARTS[0] + (angle + 0.25 * PI_PARTS[1]);
    if (steep) angle = 0.5 * PI_PARTS[0] - (angle - 0.5 * PI_PARTS[1]);
    if (signbit(x)) angle = PI_PARTS[0] - (angle - PI_PARTS[1]);
    return copysign(angle, y);
}

double qw_acos(double x) { return qw_atan2(sqrt((1 - x) * (1 + x)), x); }

/* ---- logarithm and powers */

double qw_ln(double x)
{
    if (isnan(x) || x < 0) return NAN;
    if (x == 0) return -INFINITY;
    if (isinf(x)) return x;
    int exponent, shift = 0;
    if (x < DBL_MIN) x *= 0x1p54, shift = 54;
    double m = mantissa_of(x, &exponent);
    if (m > 1.4142135623730951) m *= 0.5, exponent++;
    double k = exponent - shift, f = m - 1, s = f / (m + 1), u = s * s;
    /* 2 s is f - s f, of which f is exact */
    return k * LN2_PARTS[0] + (f - (s * (f - 2 * u * POLYNOMIAL(LN, u)) - k * LN2_PARTS[1]));
}

double qw_exp(double x)
{
    if (isnan(x)) return x;
    if (x > 710) return INFINITY;
    if (x < -746) return 0;
    double k = qw_round_even(x * (1 / 0.6931471805599453)), head = x - k * LN2_PARTS[0], low;
    double r = difference(head, k * LN2_PARTS[1], &low);
    double y = 1 + (r + (r * r * POLYNOMIAL(EXP, r) + low));
    int half = (int)k / 2; /* a power of two that is no double is a product of two that are */
    return y * power_of_two(half) * power_of_two((int)k - half);
}

double qw_pow(double base, double exponent)
{
    if (exponent == 0 || base == 1) return 1;
    return qw_exp(exponent * qw_ln(base));
}

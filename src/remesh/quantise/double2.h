/* Vectors in the plane of a layout, in double precision. */
#pragma once

typedef struct qw_double2 {
    double x, y;
} qw_double2;

static inline double qw_cross2(qw_double2 a, qw_double2 b) { return a.x * b.y - a.y * b.x; }
static inline double qw_square2(qw_double2 a) { return a.x * a.x + a.y * a.y; }
static inline qw_double2 qw_plus2(qw_double2 a, qw_double2 b) { return (qw_double2){a.x + b.x, a.y + b.y}; }
static inline qw_double2 qw_minus2(qw_double2 a, qw_double2 b) { return (qw_double2){a.x - b.x, a.y - b.y}; }
/* By k quarter turns, counter-clockwise. */
static inline qw_double2 qw_turned2(unsigned k, qw_double2 d)
{
    switch (k & 3u) {
    case 0: return d;
    case 1: return (qw_double2){-d.y, d.x};
    case 2: return (qw_double2){-d.x, -d.y};
    default: return (qw_double2){d.y, -d.x};
    }
}

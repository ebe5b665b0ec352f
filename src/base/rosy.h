/* Crosses (4-RoSy directions) and the square lattices that hang on them: the discrete choices of Section 3.1 of the
 * paper.
 *
 * A cross at a vertex with unit normal n is a unit tangent o and its turns by 90 degrees about n: axis k is R3(n, k) o.
 * Frame coordinates (x, y) mean x o + y (n x o).
 */
#pragma once

#include "base/vec.h"

#include <stdint.h>

typedef struct qw_int2 {
    int32_t x, y;
} qw_int2;

/* R2(k) d: turns by 90 k degrees. k is taken modulo 4. */
static inline qw_int2 qw_turn(unsigned k, qw_int2 d)
{
    switch (k & 3u) {
    case 0: return d;
    case 1: return (qw_int2){-d.y, d.x};
    case 2: return (qw_int2){-d.x, -d.y};
    default: return (qw_int2){d.y, -d.x};
    }
}
static inline qw_int2 qw_int2_add(qw_int2 a, qw_int2 b) { return (qw_int2){a.x + b.x, a.y + b.y}; }
static inline qw_int2 qw_int2_sub(qw_int2 a, qw_int2 b) { return (qw_int2){a.x - b.x, a.y - b.y}; }
static inline int qw_int2_is_zero(qw_int2 d) { return d.x == 0 && d.y == 0; }
static inline int32_t qw_int2_det(qw_int2 a, qw_int2 b) { return a.x * b.y - a.y * b.x; }
/* The largest of |x| and |y|. */
static inline int32_t qw_int2_norm(qw_int2 d)
{
    int32_t x = d.x < 0 ? -d.x : d.x, y = d.y < 0 ? -d.y : d.y;
    return x > y ? x : y;
}

/* R3(n, k) o */
static inline qw_vec3 qw_axis(qw_vec3 o, qw_vec3 n, unsigned k)
{
    qw_vec3 a = (k & 1u) ? qw_cross(n, o) : o;
    return (k & 2u) ? qw_scale(a, -1.0f) : a;
}

/* The integers of Eq. (1): the axis ku of the cross (ou, nu) and kv of (ov, nv) that are nearest in direction, compared
   extrinsically (in space). ku is 0 or 1, as turning both by 180 degrees changes nothing. */
typedef struct qw_match {
    uint8_t ku, kv;
} qw_match;

static inline qw_match qw_match_crosses(qw_vec3 ou, qw_vec3 nu, qw_vec3 ov, qw_vec3 nv)
{
    qw_vec3 au = qw_cross(nu, ou), av = qw_cross(nv, ov);
    float d00 = qw_dot(ou, ov), d01 = qw_dot(ou, av), d10 = qw_dot(au, ov), d11 = qw_dot(au, av);
    qw_match m = {0, (uint8_t)(d00 < 0 ? 2 : 0)};
    float best = fabsf(d00);
    if (fabsf(d01) > best) best = fabsf(d01), m = (qw_match){0, (uint8_t)(d01 < 0 ? 3 : 1)};
    if (fabsf(d10) > best) best = fabsf(d10), m = (qw_match){1, (uint8_t)(d10 < 0 ? 2 : 0)};
    if (fabsf(d11) > best) m = (qw_match){1, (uint8_t)(d11 < 0 ? 3 : 1)};
    return m;
}

/* How many quarter turns take coordinates in v's frame to coordinates in u's: axis kv of v is axis ku of u. */
static inline unsigned qw_match_turns(qw_match m) { return (unsigned)(m.ku + 4 - m.kv) & 3u; }

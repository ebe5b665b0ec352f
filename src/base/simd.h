/* Four floats side by side, for loops over many small things of which each takes the same steps. Each gets the bits
 * that it would get by itself. */
#pragma once

#include "base/vec.h"

#include <stdbool.h>
#include <stdint.h>

enum { QW_LANES = 4 };
typedef float qw_lanes __attribute__((vector_size(16)));
typedef int32_t qw_lanes_mask __attribute__((vector_size(16)));

static inline qw_lanes qw_lanes_of(float a) { return (qw_lanes){a, a, a, a}; }
static inline qw_lanes qw_choose(qw_lanes_mask which, qw_lanes yes, qw_lanes no)
{
    return (qw_lanes)(((qw_lanes_mask)yes & which) | ((qw_lanes_mask)no & ~which));
}
static inline qw_lanes qw_lanes_sqrt(qw_lanes a)
{
    return (qw_lanes){sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3])};
}
static inline bool qw_any(qw_lanes_mask m) { return (m[0] | m[1] | m[2] | m[3]) != 0; }

typedef struct qw_vec3_lanes {
    qw_lanes x, y, z;
} qw_vec3_lanes;

static inline qw_vec3_lanes qw_four(qw_vec3 a, qw_vec3 b, qw_vec3 c, qw_vec3 d)
{
    return (qw_vec3_lanes){{a.x, b.x, c.x, d.x}, {a.y, b.y, c.y, d.y}, {a.z, b.z, c.z, d.z}};
}
static inline void qw_put_lane(qw_vec3_lanes *to, int lane, qw_vec3 from)
{
    to->x[lane] = from.x, to->y[lane] = from.y, to->z[lane] = from.z;
}
static inline qw_vec3 qw_lane(const qw_vec3_lanes *from, int lane)
{
    return (qw_vec3){from->x[lane], from->y[lane], from->z[lane]};
}

/* As their namesakes in vec.h. */
static inline qw_vec3_lanes qw_add4(qw_vec3_lanes a, qw_vec3_lanes b)
{
    return (qw_vec3_lanes){a.x + b.x, a.y + b.y, a.z + b.z};
}
static inline qw_vec3_lanes qw_sub4(qw_vec3_lanes a, qw_vec3_lanes b)
{
    return (qw_vec3_lanes){a.x - b.x, a.y - b.y, a.z - b.z};
}
static inline qw_vec3_lanes qw_scale4(qw_vec3_lanes a, qw_lanes s)
{
    return (qw_vec3_lanes){a.x * s, a.y * s, a.z * s};
}
static inline qw_vec3_lanes qw_madd4(qw_vec3_lanes a, qw_lanes s, qw_vec3_lanes b)
{
    return (qw_vec3_lanes){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline qw_lanes qw_dot4(qw_vec3_lanes a, qw_vec3_lanes b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline qw_vec3_lanes qw_cross4(qw_vec3_lanes a, qw_vec3_lanes b)
{
    return (qw_vec3_lanes){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline qw_vec3_lanes qw_normalize4(qw_vec3_lanes a)
{
    qw_lanes l = qw_lanes_sqrt(qw_dot4(a, a)), s = 1.0f / l, none = qw_lanes_of(0);
    qw_lanes_mask has = l > 1e-30f;
    return (qw_vec3_lanes){qw_choose(has, a.x * s, none), qw_choose(has, a.y * s, none), qw_choose(has, a.z * s, none)};
}

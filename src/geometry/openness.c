#include "geometry/openness.h"

#include "base/elementary.h"

#include <string.h>

qw_open_rays qw_begin_open_rays(void)
{
    qw_open_rays rays;
    double turn[QW_OPEN_RAYS]; /* ascending */
    for (uint32_t i = 0; i < QW_OPEN_RAYS; i++) {
        double r = sqrt((i + 0.5) / QW_OPEN_RAYS), own = i * 0.6180339887498949, a = 2 * QW_PI * own;
        uint32_t n = i;
        for (own -= qw_floor(own); n > 0 && turn[n - 1] > own; n--)
            turn[n] = turn[n - 1], memcpy(rays.at[n], rays.at[n - 1], sizeof *rays.at);
        turn[n] = own, rays.at[n][0] = (float)(r * qw_cos(a)), rays.at[n][1] = (float)(r * qw_sin(a));
        rays.at[n][2] = (float)sqrt(1 - r * r);
    }
    return rays;
}

float qw_openness(const qw_bvh *bvh, const qw_open_rays *rays, qw_vec3 point, qw_vec3 normal, float lift, double turn,
                  float reach, uint32_t skip, uint32_t part, uint32_t parts)
{
    qw_vec3 u = qw_any_orthogonal(normal), v = qw_cross(normal, u), from = qw_madd(point, lift, normal);
    float c = (float)qw_cos(2 * QW_PI * turn), s = (float)qw_sin(2 * QW_PI * turn);
    uint32_t open = 0, count = 0;
    for (uint32_t i = 4 * part; i < QW_OPEN_RAYS; i += 4 * parts, count += 4) {
        qw_vec3 d[4];
        for (uint32_t k = 0; k < 4; k++) {
            const float *r = rays->at[i + k];
            float x = c * r[0] - s * r[1], y = s * r[0] + c * r[1];
            d[k] = qw_madd(qw_madd(qw_scale(u, x), y, v), r[2], normal);
        }
        for (uint32_t bits = qw_bvh_blocked(bvh, from, d, reach, skip); bits; bits &= bits - 1) open--;
        open += 4;
    }
    return (float)open / (float)count;
}

#include "geometry/openness.h"

#include "base/elementary.h"

qw_open_rays qw_begin_open_rays(void)
{
    qw_open_rays rays;
    for (uint32_t i = 0; i < QW_OPEN_RAYS; i++) {
        double r = sqrt((i + 0.5) / QW_OPEN_RAYS), a = 2 * QW_PI * (i * 0.6180339887498949);
        rays.at[i][0] = (float)(r * qw_cos(a)), rays.at[i][1] = (float)(r * qw_sin(a));
        rays.at[i][2] = (float)sqrt(1 - r * r);
    }
    return rays;
}

float qw_openness(const qw_bvh *bvh, const qw_open_rays *rays, qw_vec3 point, qw_vec3 normal, float lift, double turn,
                  float reach, uint32_t skip)
{
    qw_vec3 u = qw_any_orthogonal(normal), v = qw_cross(normal, u), from = qw_madd(point, lift, normal);
    float c = (float)qw_cos(2 * QW_PI * turn), s = (float)qw_sin(2 * QW_PI * turn);
    uint32_t open = 0;
    for (uint32_t i = 0; i < QW_OPEN_RAYS; i++) {
        const float *r = rays->at[i];
        float x = c * r[0] - s * r[1], y = s * r[0] + c * r[1];
        qw_vec3 d = qw_madd(qw_madd(qw_scale(u, x), y, v), r[2], normal);
        open += qw_bvh_ray(bvh, from, d, reach, skip).face == QW_NONE;
    }
    return (float)open / QW_OPEN_RAYS;
}

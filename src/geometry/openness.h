/* How open a surface is: the share of rays from a point, more of them along the normal, that meet nothing near. */
#pragma once

#include "geometry/bvh.h"

enum { QW_OPEN_RAYS = 24 };

/* The rays of a spiral, in the plane of the surface and along the normal; those that follow one another in fours lie
   near one another. */
typedef struct qw_open_rays {
    float at[QW_OPEN_RAYS][3];
} qw_open_rays;
qw_open_rays qw_begin_open_rays(void);

/* 0 to 1. normal: unit. lift: the rays begin so far above the point. turn: of the spiral, any number. skip: as
   qw_bvh_ray. parts: of all rays every so many fours, from the `part`-th on. */
float qw_openness(const qw_bvh *bvh, const qw_open_rays *rays, qw_vec3 point, qw_vec3 normal, float lift, double turn,
                  float reach, uint32_t skip, uint32_t part, uint32_t parts);

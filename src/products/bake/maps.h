/* Maps: pictures of what the input looks like, on the texture coordinates of the result. */
#pragma once

#include "products/bake/bake_surface.h"
#include "products/bake/bake_target.h"

typedef struct qw_maps {
    qw_picture *picture; /* qw_picture[tiles][QW_MAP_COUNT]: without pixels where the map was not asked for */
    uint32_t tiles;
    uint64_t texels, missed; /* texels on charts, and those of them of which a ray met nothing */
    float height_scale;      /* the height map: 0.5 is the quads, 1 so far above them, in the frame of the source */
    double normal_error;     /* mean angle, in degrees, between what a map shows and the input; negative without one */
    double color_error;      /* mean difference of the channels, of 255 */
} qw_maps;

/* maps: bits of qw_map. texels: along each side. samples: along each side of a texel. pad: texels around charts that
   are filled. In the caller's scope. */
qw_maps qw_bake_maps(qw_env *env, const qw_bake_target *target, const qw_look *look, uint32_t maps, uint32_t tiles,
                     uint32_t texels, uint32_t samples, uint32_t pad, float farthest);

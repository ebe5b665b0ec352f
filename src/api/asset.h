/* Texture coordinates and maps of a result, as a context keeps them. */
#ifndef QW_API_ASSET_H
#define QW_API_ASSET_H

#include "atlas/atlas.h"
#include "io/asset.h"
#include "run/driver.h"

/* Its arrays are blocks of the scope of the last stage, as this is. */
typedef struct qw_asset {
    qw_atlas atlas;
    qw_asset_report report;
    qw_asset_options options;
    qw_attribute uv;
    float *normal, *tangent; /* float[corners][3], float[corners][4]: as baked; NULL before */
    qw_asset_look look;
    qw_picture *picture; /* of the look; NULL before */
    qw_image *image;     /* qw_image[images] */
    uint32_t images;
} qw_asset;

/* Frees the maps, if there are any: api/bake.c. */
void qw_drop_maps(qw_context_state *c);
/* Finds where the result lies on the input, once: api/attributes.c. */
void qw_find_carried(qw_context_state *c);

#endif

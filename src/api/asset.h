/* Texture coordinates and maps of a result, as a context keeps them. */
#ifndef QW_API_ASSET_H
#define QW_API_ASSET_H

#include "atlas/atlas.h"
#include "run/driver.h"

typedef struct qw_asset {
    qw_atlas atlas; /* its arrays are blocks of the scope of the last stage, as this is */
    qw_asset_report report;
    qw_asset_options options;
} qw_asset;

#endif

/* Texture coordinates and maps of a result, as a context keeps them. */
#pragma once

#include "products/atlas/atlas.h"
#include "io/asset_file.h"
#include "api/context.h"

/* Its arrays are blocks of the scope of the last stage, as this is. */
typedef struct qw_asset {
    qw_atlas atlas;
    qw_asset_report report;
    qw_asset_options options;
    qw_attribute uv;
    float *normal, *tangent; /* float[corners][3], float[corners][4]: as baked; NULL before */
    qw_asset_look look;
    uint8_t *alpha; /* uint8_t[alphas]: of each material of the input: 0 opaque, 1 cut off, 2 blended; NULL before */
    uint32_t alphas;
    qw_picture *picture; /* of the look; NULL before */
    qw_image *image;     /* qw_image[images] */
    uint32_t images;
} qw_asset;

/* As qw_protect_listening, for a body that begins with qw_begin_work. */
qw_status qw_protect_working(qw_context *context, void (*body)(void *user), void *user);
/* The positions times a power of two, *exponent, that brings the largest coordinate below 1: squares of lengths neither
   overflow nor vanish. In the caller's scope. */
const double *qw_scaled_positions(qw_env *env, const qw_mesh_view *view, int *exponent);
/* Frees the maps, if there are any: api/bake.c. */
void qw_drop_maps(qw_context_state *c);
/* What a result with maps is written with, of *count attributes of its own: but for their texture coordinates, normals
   and materials, and with those of the asset, the material's label last; *count of the list. In the caller's scope:
   api/bake.c. */
qw_attribute *qw_list_asset(qw_env *env, const qw_asset *a, const qw_mesh_view *view, const qw_attribute *attributes,
                            uint32_t *count, bool is_gltf);
/* Finds where the result lies on the input, once: api/attributes.c. */
void qw_find_carried(qw_context_state *c);

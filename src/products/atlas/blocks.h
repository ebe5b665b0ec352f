/* Texture coordinates by blocks: each patch of the quads a rectangle of texels, the same number of them for each quad,
 * wall to wall. For displacement, trim sheets and what else is made quad by quad. */
#pragma once

#include "products/atlas/atlas.h"

typedef struct qw_block_options {
    uint32_t texels;   /* along a side of a tile */
    uint32_t tiles;    /* at most */
    uint32_t per_quad; /* texels along each side of a quad */
} qw_block_options;

/* In the caller's scope; sets the seams of the mesh. Fails with QW_ARGUMENT where the blocks do not fit. */
qw_atlas qw_make_block_atlas(qw_env *env, qw_atlas_mesh *mesh, const qw_block_options *options);

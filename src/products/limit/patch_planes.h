/* Blocks of patches that lie on one plane and hang together are one face there, with a loop around it and one around
 * each hole. */
#ifndef QW_PRODUCTS_LIMIT_PATCH_PLANES_H
#define QW_PRODUCTS_LIMIT_PATCH_PLANES_H

#include "io/step.h"

/* In the current scope. */
qw_patch_planes *qw_find_patch_planes(qw_env *env, const qw_patches *patches, const qw_patch_blocks *blocks);

#endif

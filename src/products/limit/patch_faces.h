/* Blocks of patches that lie on one plane, cylinder or cone and hang together are one face there, with its loops. */
#pragma once

#include "io/step.h"
#include "products/exact/primitive.h"

/* A point in the middle of each quad, those of the first block first: double[patches->face_count][3]. */
void qw_patch_middles(const qw_patches *patches, const qw_patch_blocks *blocks, double (*middle)[3]);

/* designed: planes, cylinders and cones of the part, in the coordinates of the points; of_cell:
   uint32_t[patches->face_count], the one that each of these middles is next to, or QW_NONE. Other planes are found
   here. Points of the borders of faces are moved onto their surfaces. In the current scope. */
qw_patch_faces *qw_find_patch_faces(qw_env *env, const qw_patches *patches, const qw_patch_blocks *blocks,
                                    const qw_primitive *designed, const uint32_t *of_cell);

/* Texels around charts, filled so that what is filtered at their edges shows nothing else. */
#pragma once

#include "io/pictures/picture.h"

/* Fills so many texels around those that are covered with the mean of their neighbours, and the rest with the mean of
   all that is covered. covered: uint8_t[texels][texels], 1 or 0; changed. picture: qw_picture[count]: those with pixels
   are filled. */
void qw_pad_pictures(qw_env *env, const qw_picture *picture, uint32_t count, uint8_t *covered, uint32_t texels,
                     uint32_t pad);

/* PNG files. */
#ifndef QW_CLI_PNG_H
#define QW_CLI_PNG_H

#include "base/env.h"

/* Writes uint8_t[height][width][3] as io/file.h does, and fails as it does. */
void png_write(qw_env *env, const char *path, const uint8_t *rgb, uint32_t width, uint32_t height);

#endif

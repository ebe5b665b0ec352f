/* PNG files. */
#ifndef QW_CLI_PNG_H
#define QW_CLI_PNG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Writes uint8_t[height][width][3] through a temporary file beside path that is renamed at the end, or to standard
   output for "-". On failure there is a sentence in message and neither a new file nor a changed one. */
bool png_write(const char *path, const uint8_t *rgb, uint32_t width, uint32_t height, char *message,
               size_t message_size);

#endif

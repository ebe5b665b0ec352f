/* PNG files by stb_image_write, which is compiled here and nowhere else. */
#include "png.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wmissing-prototypes"
#pragma GCC diagnostic ignored "-Wstrict-prototypes"
#pragma GCC diagnostic ignored "-Wsign-compare"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wextra"
#endif
#include <stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

enum { NAME_TRIES = 100 };

/* A file that did not exist before, beside path. name has room for path and 16 characters. */
static FILE *open_beside(const char *path, char *name, size_t name_size)
{
    for (int i = 0; i < NAME_TRIES; i++) {
        snprintf(name, name_size, "%s.%d.tmp", path, i);
        FILE *file = fopen(name, "wbx");
        if (file || errno != EEXIST) return file;
    }
    return NULL;
}

static bool write_file(const char *path, const unsigned char *bytes, size_t size, char *message, size_t message_size)
{
    if (strcmp(path, "-") == 0) {
        if (fwrite(bytes, 1, size, stdout) == size && fflush(stdout) == 0) return true;
        snprintf(message, message_size, "standard output: %s", strerror(errno));
        return false;
    }
    size_t name_size = strlen(path) + 16;
    char *name = malloc(name_size);
    if (!name) {
        snprintf(message, message_size, "%s: out of memory", path);
        return false;
    }
    FILE *file = open_beside(path, name, name_size);
    bool written = file && fwrite(bytes, 1, size, file) == size, closed = file && fclose(file) == 0;
    bool done = written && closed && rename(name, path) == 0;
    if (!done) {
        snprintf(message, message_size, "%s: cannot be written: %s", path, strerror(errno));
        if (file) remove(name);
    }
    free(name);
    return done;
}

bool png_write(const char *path, const uint8_t *rgb, uint32_t width, uint32_t height, char *message,
               size_t message_size)
{
    int size = 0;
    unsigned char *bytes = stbi_write_png_to_mem(rgb, (int)(3 * width), (int)width, (int)height, 3, &size);
    if (!bytes) {
        snprintf(message, message_size, "%s: out of memory", path);
        return false;
    }
    bool done = write_file(path, bytes, (size_t)size, message, message_size);
    STBIW_FREE(bytes);
    return done;
}

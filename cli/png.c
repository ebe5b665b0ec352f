/* PNG files by stb_image_write, which is compiled here and nowhere else. */
#include "png.h"

#include "io/file.h"

#include <string.h>

/* The encoder knows no environment and ends the process where it finds no memory: so it gets its memory here, where
 * failure unwinds. Set while it runs, on the thread that it runs on. */
static _Thread_local qw_env *encoder_env;

#define STBIW_MALLOC(size)                         qw_alloc(encoder_env, (size), 1)
#define STBIW_REALLOC(block, size)                 qw_resize(encoder_env, (block), (size), 1)
#define STBIW_REALLOC_SIZED(block, old_size, size) qw_resize(encoder_env, (block), (size), 1)
#define STBIW_FREE(block)                          qw_free(encoder_env, (block))
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

void png_write(qw_env *env, const char *path, const uint8_t *rgb, uint32_t width, uint32_t height)
{
    qw_scope_begin(env);
    int size = 0;
    encoder_env = env;
    unsigned char *bytes = stbi_write_png_to_mem(rgb, (int)(3 * width), (int)width, (int)height, 3, &size);
    if (!bytes) qw_fail(env, QW_INTERNAL, -1, "the picture was not encoded");
    qw_file *file = qw_file_begin(env, path);
    qw_file_put(file, bytes, (size_t)size);
    qw_file_finish(file);
    qw_scope_end(env);
}

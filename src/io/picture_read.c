/* The one file that knows stb_image: without it (QW_HAVE_STB_IMAGE) no picture can be read, and everything else runs.
 * It decodes PNG and JPEG only, without instructions that not every processor has, so that pixels are the same
 * everywhere.
 */
#include "io/picture.h"

#include <string.h>

#ifdef QW_HAVE_STB_IMAGE
#include <stdlib.h>
#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
#define STBI_NO_STDIO
#define STBI_NO_SIMD
#define STBI_NO_THREAD_LOCALS
#define STBI_MAX_DIMENSIONS 16384
#define STBI_FAILURE_USERMSG
#pragma GCC diagnostic ignored "-Wunused-function"
#include "stb_image.h"
#endif

static uint32_t big_endian(const char *at, int bytes)
{
    uint32_t x = 0;
    for (int i = 0; i < bytes; i++) x = x << 8 | (uint8_t)at[i];
    return x;
}

bool qw_picture_size(qw_bytes b, uint32_t *width, uint32_t *height)
{
    if (b.size >= 24 && memcmp(b.at, "\x89PNG\r\n\x1a\n", 8) == 0 && memcmp(b.at + 12, "IHDR", 4) == 0) {
        *width = big_endian(b.at + 16, 4), *height = big_endian(b.at + 20, 4);
        return true;
    }
    if (b.size < 4 || memcmp(b.at, "\xff\xd8", 2) != 0) return false;
    for (size_t at = 2; at + 9 < b.size;) { /* segments until that of the frame */
        uint32_t mark = (uint8_t)b.at[at + 1], size = big_endian(b.at + at + 2, 2);
        if ((uint8_t)b.at[at] != 0xff) return false;
        if (mark == 0xff) {
            at++;
            continue;
        }
        if (mark >= 0xc0 && mark <= 0xcf && mark != 0xc4 && mark != 0xc8 && mark != 0xcc) {
            *height = big_endian(b.at + at + 5, 2), *width = big_endian(b.at + at + 7, 2);
            return true;
        }
        at += 2 + (size_t)size;
    }
    return false;
}

qw_picture qw_read_picture(qw_env *env, qw_bytes bytes, const char **why)
{
    qw_picture p = {0};
    *why = "it is neither PNG nor JPEG";
    if (!qw_picture_size(bytes, &p.width, &p.height)) return p;
    *why = "it is larger than 16384 x 16384 pixels, or has none";
    if (p.width > QW_MOST_PIXELS_ALONG || p.height > QW_MOST_PIXELS_ALONG || !p.width || !p.height) return p;
#ifdef QW_HAVE_STB_IMAGE
    int width, height, channels;
    bool wide = stbi_is_16_bit_from_memory((const stbi_uc *)bytes.at, (int)bytes.size) != 0;
    p.bits = wide ? 16 : 8, p.channels = 4;
    /* what is kept is asked for first, so that a limit of the host's memory is met before the decoder runs */
    void *pixels = qw_alloc(env, (size_t)p.width * p.height, 4 * (size_t)p.bits / 8);
    void *decoded = bytes.size > INT32_MAX ? NULL
                    : wide ? (void *)stbi_load_16_from_memory((const stbi_uc *)bytes.at, (int)bytes.size, &width,
                                                              &height, &channels, 4)
                           : (void *)stbi_load_from_memory((const stbi_uc *)bytes.at, (int)bytes.size, &width, &height,
                                                           &channels, 4);
    if (decoded && ((uint32_t)width != p.width || (uint32_t)height != p.height))
        stbi_image_free(decoded), decoded = NULL;
    *why = "it is broken";
    if (!decoded) {
        qw_free(env, pixels);
        return p;
    }
    memcpy(pixels, decoded, (size_t)p.width * p.height * 4 * p.bits / 8);
    stbi_image_free(decoded);
    p.pixels = pixels;
#else
    (void)env;
    *why = "this build reads no pictures (stb_image.h was not found)";
#endif
    return p;
}

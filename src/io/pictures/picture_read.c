/* The one file that knows stb_image, for PNG and JPEG, and libwebp: what was not there when this was built
 * (QW_HAVE_STB_IMAGE, QW_HAVE_WEBP) cannot be read, and everything else runs. stb_image decodes without instructions
 * that not every processor has; libwebp's pixels are the same with and without them.
 */
#include "io/pictures/picture.h"

#include <string.h>

#ifdef QW_HAVE_WEBP
#include <webp/decode.h>
#endif

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

static uint32_t little_endian(const char *at, int bytes)
{
    uint32_t x = 0;
    for (int i = bytes; i-- > 0;) x = x << 8 | (uint8_t)at[i];
    return x;
}

static bool is_webp(qw_bytes b)
{
    return b.size >= 30 && memcmp(b.at, "RIFF", 4) == 0 && memcmp(b.at + 8, "WEBP", 4) == 0;
}

/* By the first chunk: that of the canvas, of lossless or of lossy pixels. */
static bool webp_size(qw_bytes b, uint32_t *width, uint32_t *height)
{
    if (memcmp(b.at + 12, "VP8X", 4) == 0) {
        *width = little_endian(b.at + 24, 3) + 1, *height = little_endian(b.at + 27, 3) + 1;
        return true;
    }
    if (memcmp(b.at + 12, "VP8L", 4) == 0 && b.at[20] == 0x2f) {
        uint32_t bits = little_endian(b.at + 21, 4);
        *width = (bits & 0x3fff) + 1, *height = (bits >> 14 & 0x3fff) + 1;
        return true;
    }
    if (memcmp(b.at + 12, "VP8 ", 4) != 0 || memcmp(b.at + 23, "\x9d\x01\x2a", 3) != 0) return false;
    *width = little_endian(b.at + 26, 2) & 0x3fff, *height = little_endian(b.at + 28, 2) & 0x3fff;
    return true;
}

bool qw_picture_size(qw_bytes b, uint32_t *width, uint32_t *height)
{
    if (is_webp(b)) return webp_size(b, width, height);
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

#ifdef QW_HAVE_STB_IMAGE
/* Sets bits and pixels; false: it is broken. */
static bool read_by_stb(qw_env *env, qw_bytes bytes, qw_picture *p)
{
    int width, height, channels;
    bool wide = stbi_is_16_bit_from_memory((const stbi_uc *)bytes.at, (int)bytes.size) != 0;
    p->bits = wide ? 16 : 8;
    /* what is kept is asked for first, so that a limit of the host's memory is met before the decoder runs */
    void *pixels = qw_alloc(env, (size_t)p->width * p->height, 4 * (size_t)p->bits / 8);
    void *decoded = bytes.size > INT32_MAX ? NULL
                    : wide ? (void *)stbi_load_16_from_memory((const stbi_uc *)bytes.at, (int)bytes.size, &width,
                                                              &height, &channels, 4)
                           : (void *)stbi_load_from_memory((const stbi_uc *)bytes.at, (int)bytes.size, &width, &height,
                                                           &channels, 4);
    if (decoded && ((uint32_t)width != p->width || (uint32_t)height != p->height))
        stbi_image_free(decoded), decoded = NULL;
    if (decoded) {
        memcpy(pixels, decoded, (size_t)p->width * p->height * 4 * p->bits / 8);
        stbi_image_free(decoded);
        p->pixels = pixels;
        return true;
    }
    qw_free(env, pixels);
    return false;
}
#endif

#ifdef QW_HAVE_WEBP
/* The same. */
static bool read_by_webp(qw_env *env, qw_bytes bytes, qw_picture *p)
{
    int width, height;
    size_t size = (size_t)p->width * p->height * 4;
    const uint8_t *at = (const uint8_t *)bytes.at;
    if (!WebPGetInfo(at, bytes.size, &width, &height)) return false;
    if ((uint32_t)width != p->width || (uint32_t)height != p->height) return false;
    p->bits = 8, p->pixels = qw_alloc(env, size, 1);
    if (WebPDecodeRGBAInto(at, bytes.size, p->pixels, size, (int)(4 * p->width))) return true;
    qw_free(env, p->pixels);
    p->pixels = NULL;
    return false;
}
#endif

bool qw_reads_webp(void)
{
#ifdef QW_HAVE_WEBP
    return true;
#else
    return false;
#endif
}

qw_picture qw_read_picture(qw_env *env, qw_bytes bytes, const char **why)
{
    qw_picture p = {.channels = 4};
    *why = "it is neither PNG nor JPEG nor WebP";
    if (!qw_picture_size(bytes, &p.width, &p.height)) return p;
    *why = "it is larger than 16384 x 16384 pixels, or has none";
    if (p.width > QW_MOST_PIXELS_ALONG || p.height > QW_MOST_PIXELS_ALONG || !p.width || !p.height) return p;
    *why = "it is broken";
    if (is_webp(bytes)) {
#ifdef QW_HAVE_WEBP
        (void)read_by_webp(env, bytes, &p);
#else
        *why = "this build reads no WebP (libwebp was not found)";
#endif
        return p;
    }
#ifdef QW_HAVE_STB_IMAGE
    (void)read_by_stb(env, bytes, &p);
#else
    *why = "this build reads neither PNG nor JPEG (stb_image.h was not found)";
#endif
    (void)env;
    return p;
}

/* The one file that knows stb_image, for PNG, JPEG, BMP and TGA, and libwebp: what was not there when this was built
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
#define STBI_ONLY_BMP
#define STBI_ONLY_TGA
#define STBI_NO_STDIO
#define STBI_NO_SIMD
#define STBI_NO_THREAD_LOCALS
#define STBI_MAX_DIMENSIONS QW_MOST_PIXELS_ALONG
#define STBI_FAILURE_USERMSG
/* Before 2.28 tables that a scan of a JPEG names and that are not there are read as they were allocated. */
#define STBI_MALLOC(size) calloc(1, size)
#define STBI_REALLOC      realloc
#define STBI_FREE         free
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

static bool is_png(qw_bytes b)
{
    return b.size >= 33 && memcmp(b.at, "\x89PNG\r\n\x1a\n", 8) == 0 && memcmp(b.at + 12, "IHDR", 4) == 0;
}

static bool is_jpeg(qw_bytes b) { return b.size >= 4 && memcmp(b.at, "\xff\xd8", 2) == 0; }

/* What the bytes are that this program does not read; NULL: who knows. */
static const char *stranger(qw_bytes b)
{
    static const struct {
        size_t at, size;
        const char *magic, *why;
    } row[] = {{0, 7, "\xabKTX 20", "it is KTX2, which is not read"},
               {0, 7, "\xabKTX 11", "it is KTX, which is not read"},
               {0, 4, "DDS ", "it is DDS, which is not read"},
               {0, 4, "II*\0", "it is TIFF, which is not read"},
               {0, 4, "MM\0*", "it is TIFF, which is not read"},
               {0, 4, "GIF8", "it is GIF, which is not read"},
               {0, 10, "#?RADIANCE", "it is HDR, which is not read"},
               {0, 4, "8BPS", "it is PSD, which is not read"},
               {0, 4, "\x76\x2f\x31\x01", "it is EXR, which is not read"},
               {4, 7, "ftypavi", "it is AVIF, which is not read"},
               {4, 7, "ftyphei", "it is HEIC, which is not read"},
               {4, 4, "jP  ", "it is JPEG 2000, which is not read"},
               {4, 4, "JXL ", "it is JPEG XL, which is not read"}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++)
        if (b.size >= row[i].at + row[i].size && memcmp(b.at + row[i].at, row[i].magic, row[i].size) == 0)
            return row[i].why;
    return NULL;
}

/* BMP, and TGA, which has no signature: stb_image looks whether all of its head makes sense. */
static bool other_size(qw_bytes b, uint32_t *width, uint32_t *height)
{
#ifdef QW_HAVE_STB_IMAGE
    int w, h, channels;
    if (stranger(b) || b.size > INT32_MAX || b.size < 18 || (uint8_t)b.at[0] == 0xff) return false; /* no JPEG */
    if (!stbi_info_from_memory((const stbi_uc *)b.at, (int)b.size, &w, &h, &channels) || w < 0 || h < 0) return false;
    *width = (uint32_t)w, *height = (uint32_t)h;
    return true;
#else
    (void)b, (void)width, (void)height;
    return false;
#endif
}

bool qw_picture_size(qw_bytes b, uint32_t *width, uint32_t *height)
{
    if (is_webp(b)) return webp_size(b, width, height);
    if (is_png(b)) {
        *width = big_endian(b.at + 16, 4), *height = big_endian(b.at + 20, 4);
        return true;
    }
    if (!is_jpeg(b)) return other_size(b, width, height);
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
/* Bytes of the rows of a PNG as they are deflated, each with its filter, in one pass or in the seven of an interlaced
   one. */
static uint64_t inflated_size(qw_bytes b)
{
    static const uint8_t channels[7] = {1, 0, 3, 1, 2, 0, 4},
                         first[7][2] = {{0, 0}, {4, 0}, {0, 4}, {2, 0}, {0, 2}, {1, 0}, {0, 1}},
                         step[7][2] = {{8, 8}, {8, 8}, {4, 8}, {4, 4}, {2, 4}, {2, 2}, {1, 2}};
    uint32_t size[2] = {big_endian(b.at + 16, 4), big_endian(b.at + 20, 4)}, type = (uint8_t)b.at[25] % 7u;
    uint64_t bits = (uint64_t)(uint8_t)b.at[24] * channels[type], sum = 0;
    if (b.at[28] == 0) return size[1] * (1 + (size[0] * bits + 7) / 8);
    for (int pass = 0; pass < 7; pass++) {
        uint64_t n[2];
        for (int k = 0; k < 2; k++)
            n[k] = size[k] > first[pass][k] ? (size[k] - first[pass][k] + step[pass][k] - 1u) / step[pass][k] : 0;
        if (n[0] > 0) sum += n[1] * (1 + (n[0] * bits + 7) / 8);
    }
    return sum;
}

/* Whether what is deflated in a PNG is as much as its pixels take and no more: stb_image would inflate all there is.
   room: char[inflated_size]. */
static bool inflates_to_its_size(qw_env *env, qw_bytes b, char *room, uint64_t size)
{
    char *joined = QW_NEW(env, char, b.size);
    size_t held = 0;
    for (size_t at = 8; at + 12 <= b.size;) {
        uint64_t length = big_endian(b.at + at, 4);
        if (length > b.size - at - 12) length = b.size - at - 12;
        if (memcmp(b.at + at + 4, "IDAT", 4) == 0) memcpy(joined + held, b.at + at + 8, length), held += length;
        at += 12 + length;
    }
    int written = size > INT32_MAX || held > INT32_MAX ? -1
                                                       : stbi_zlib_decode_buffer(room, (int)size, joined, (int)held);
    qw_free(env, joined);
    return written >= 0 && (uint64_t)written == size;
}

/* Whether each of the tables in a segment of a JPEG names at most 255 symbols: stb_image mistakes one more, and
   before 2.28 writes beyond its own tables otherwise. segment: its size and what follows, up to the end of the file. */
static bool has_short_tables(const char *segment, size_t left)
{
    size_t size = big_endian(segment, 2), at = 2;
    for (; at + 17 <= size && at + 17 <= left; at += 17) {
        uint32_t symbols = 0;
        for (int i = 1; i <= 16; i++) symbols += (uint8_t)segment[at + (size_t)i];
        if (symbols > 255) return false;
        at += symbols;
    }
    return at == size;
}

/* Whether that holds of all tables. Before the first scan segments are passed over by their size, behind it marks are
   looked for at every byte: there are none in pixels. */
static bool has_only_short_tables(qw_bytes b)
{
    bool in_scans = false;
    for (size_t at = 2; at + 4 <= b.size;) {
        uint32_t mark = (uint8_t)b.at[at] == 0xff ? (uint8_t)b.at[at + 1] : 0;
        if (mark == 0xc4 && !has_short_tables(b.at + at + 2, b.size - at - 2)) return false;
        in_scans |= mark == 0xda;
        at += in_scans || mark == 0 || mark == 0xff ? 1 : 2 + big_endian(b.at + at + 2, 2);
    }
    return true;
}

/* The bytes, as stb_image asks for them. It goes on with zeros behind the end of a file that is cut off; its own buffer
   holds TAPE_BUFFER bytes, of which the last may be fewer. */
typedef struct tape {
    qw_bytes bytes;
    size_t next;
    bool is_cut; /* what is not there was asked for */
} tape;
enum { TAPE_BUFFER = 128 };

static int tape_read(void *user, char *to, int size)
{
    tape *t = user;
    size_t left = t->bytes.size - t->next, n = left < (size_t)size ? left : (size_t)size;
    memcpy(to, t->bytes.at + t->next, n);
    t->next += n, t->is_cut |= n == 0 || (n < (size_t)size && size != TAPE_BUFFER);
    return (int)n;
}

static void tape_skip(void *user, int by)
{
    tape *t = user;
    int64_t to = (int64_t)t->next + by;
    t->is_cut |= to > (int64_t)t->bytes.size;
    t->next = to < 0 ? 0 : t->is_cut ? t->bytes.size : (size_t)to;
}

static int tape_ends(void *user) { return ((tape *)user)->next == ((tape *)user)->bytes.size; }

/* Sets bits and pixels; false: it is broken or cut off. */
static bool read_by_stb(qw_env *env, qw_bytes bytes, qw_picture *p)
{
    enum { JPEG_BYTES = 10, LEAST_BYTES = 4 }; /* that stb_image asks for beside its pixels, for each of them */
    int width, height, channels;
    uint64_t more = is_png(bytes) ? inflated_size(bytes)
                                  : (uint64_t)p->width * p->height * (is_jpeg(bytes) ? JPEG_BYTES : LEAST_BYTES);
    bool wide = stbi_is_16_bit_from_memory((const stbi_uc *)bytes.at, (int)bytes.size) != 0;
    p->bits = wide ? 16 : 8;
    /* what is kept, and as much as the decoder takes beside it, is asked for first, so that a limit of the host's
       memory is met before it runs */
    size_t size = (size_t)p->width * p->height * 4 * p->bits / 8;
    void *pixels = qw_alloc(env, size, 1);
    char *room = qw_alloc(env, size + more, 1);
    bool is_broken = bytes.size > INT32_MAX || (is_png(bytes) && !inflates_to_its_size(env, bytes, room, more)) ||
                     (is_jpeg(bytes) && !has_only_short_tables(bytes));
    const stbi_io_callbacks io = {tape_read, tape_skip, tape_ends};
    tape t = {.bytes = bytes};
    void *decoded = is_broken ? NULL
                    : wide    ? (void *)stbi_load_16_from_callbacks(&io, &t, &width, &height, &channels, 4)
                              : (void *)stbi_load_from_callbacks(&io, &t, &width, &height, &channels, 4);
    if (decoded && (t.is_cut || (uint32_t)width != p->width || (uint32_t)height != p->height))
        stbi_image_free(decoded), decoded = NULL;
    qw_free(env, room);
    if (decoded) {
        memcpy(pixels, decoded, size);
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
    *why = stranger(bytes) ? stranger(bytes) : "it is neither PNG, JPEG, WebP, BMP nor TGA, or it is cut off";
    if (!qw_picture_size(bytes, &p.width, &p.height)) return p;
    *why = "it is larger than 16384 x 16384 pixels, or has none";
    if (p.width > QW_MOST_PIXELS_ALONG || p.height > QW_MOST_PIXELS_ALONG || !p.width || !p.height) return p;
    *why = "it is broken or cut off";
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
    *why = "this build reads neither PNG nor JPEG, BMP and TGA (stb_image.h was not found)";
#endif
    (void)env;
    return p;
}

/* Pictures in memory, PNG files of them, and what is read of PNG, JPEG, WebP, BMP and TGA files. */
#pragma once

#include "io/file.h"
#include "io/pen.h"

typedef struct qw_picture {
    uint32_t width, height, channels; /* channels: 1 to 4: grey, grey and alpha, RGB, RGBA */
    uint32_t bits;                    /* 8 or 16 */
    void *pixels;                     /* uint8_t or uint16_t[height][width][channels], the upper row first */
} qw_picture;

/* The bytes of a PNG file, behind what the pen has. */
void qw_put_png(qw_env *env, const qw_picture *picture, qw_pen *pen);
/* Writes such a file as io/file.h does, and fails as it does. */
void qw_write_png(qw_env *env, const char *path, const qw_picture *picture);

enum { QW_MOST_PIXELS_ALONG = 16384 };
/* What the head of such a file says of its size; false: it is none of them. */
bool qw_picture_size(qw_bytes bytes, uint32_t *width, uint32_t *height);
bool qw_reads_webp(void); /* whether this build does */
/* Reads such a file; at NULL pixels it cannot be, and *why says so. Larger ones than QW_MOST_PIXELS_ALONG, and those
   that inflate to more than their pixels take, are refused. Without stb_image or libwebp those of theirs can't be read.
   In the caller's scope. */
qw_picture qw_read_picture(qw_env *env, qw_bytes bytes, const char **why);
